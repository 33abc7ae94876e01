"""What is asked of an arm: its links, its poses at start and goal, what stands in its workspace."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .model import Model, Number, Positive, Vector, few
from .obstacles import Blocks

Elbow = Literal["up", "down", "either"]


class Link(Model):
    """One link, a rod unless told otherwise.

    Args:
        length: from joint to joint [m].
        mass: [kg].
        com: distance of its centre of mass from its first joint, along it [m]; default half its length.
        inertia: about its centre of mass [kg m^2]; default that of a uniform rod, mass length^2 / 12.
        half_width: how far its matter reaches to either side [m].
        limits: least and largest joint angle [rad], checked on the result.
        max_speed: bound on the joint's speed [rad/s], checked on the result.
    """

    length: Positive
    mass: Positive
    com: Annotated[Number, Field(ge=0)] | None = None
    inertia: Positive | None = None
    half_width: Annotated[Number, Field(ge=0)] = 0.0
    limits: tuple[Number, Number] | None = None
    max_speed: Positive | None = None

    @property
    def centre(self) -> float:
        """`com`, or half the length [m]."""
        return self.length / 2 if self.com is None else self.com

    @property
    def about_centre(self) -> float:
        """`inertia`, or that of a rod [kg m^2]."""
        return self.mass * self.length**2 / 12 if self.inertia is None else self.inertia

    @model_validator(mode="after")
    def _makes_sense(self) -> Link:
        if self.com is not None and self.com > self.length:
            raise ValueError(f".com: was {self.com}, must be at most the length, {self.length}")
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise ValueError(f".limits: was {list(self.limits)}, must be two increasing angles")
        return self


class Arm(Model):
    """A planar serial arm.

    Args:
        links: from the base to the tip, at least two.
        base: position of the first joint [m].
        payload: point mass at the tip [kg].
    """

    links: Annotated[tuple[Link, ...], Field(min_length=2, max_length=20), few(20)]
    base: Vector = (0.0, 0.0)
    payload: Annotated[Number, Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _centre_moves(self) -> Arm:
        if self.links[-1].centre == 0 and self.payload == 0:
            last = len(self.links) - 1
            raise ValueError(f".links[{last}].com: was 0, must be above 0 without a payload (else nothing moves)")
        return self


class Pose(Model):
    """A configuration at rest: joint angles, or where the tip is and how the elbow bends.

    Args:
        joints: angle of every joint [rad], the first against the x axis, the others against the link before. A goal is
            reached up to full turns; limits are checked on the angles that the motion really has.
        tip: position of the tip [m], two links only.
        elbow: seen from the base towards the tip, "up" has the elbow on the left (joint 2 below zero), "down" on the
            right; "either" takes the better one.
    """

    joints: Annotated[tuple[Number, ...], Field(min_length=2, max_length=20), few(20)] | None = None
    tip: Vector | None = None
    elbow: Elbow | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Pose:
        if (self.joints is None) == (self.tip is None):
            was = "missing" if self.tip is None else "given beside joints"
            raise ValueError(f".tip: was {was}, must be given if and only if joints are not")
        if self.joints is not None and self.elbow is not None:
            raise ValueError(f".elbow: was {self.elbow!r}, must be left out where joints are given")
        return self


class Task(Model):
    """From pose to pose, both at rest, in the given time, clear of the obstacles.

    Args:
        start, goal: poses.
        duration: T [s].
        obstacles: polygons in the workspace that no link may touch.
        margin: distance [m] that every link keeps from them.
        max_peak: optional bound on the centre of mass's acceleration [m/s^2].
    """

    start: Pose
    goal: Pose
    duration: Positive
    obstacles: Blocks = ()
    margin: Annotated[Number, Field(ge=0)] = 0.0
    max_peak: Positive | None = None

    @model_validator(mode="after")
    def _plain_blocks(self) -> Task:
        for i, block in enumerate(self.obstacles):
            if block.side != "either":
                raise ValueError(f".obstacles[{i}].side: was {block.side!r}, must be left out (an arm's path has none)")
        return self
