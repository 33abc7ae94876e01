"""What is asked of an arm: its links, its poses at start and goal, what stands in its workspace.

The configurations that the poses allow are checked to exist, to be within limits and to stand free.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from ..geometry.norm import length
from ..robots.kinematics import ANGLE, Chain, Pair
from ..robots.workspace import Workspace
from .model import Model, Number, Positive, Vector, few
from .obstacles import Blocks
from .task import Task

Elbow = Literal["up", "down", "either"]


class Link(Model):
    """One link, a rod unless told otherwise.

    Args:
        length: from joint to joint [m].
        mass: [kg].
        com: distance of its centre of mass from its first joint, along it [m]; default half its length.
        inertia: about its centre of mass [kg m^2]; default that of a uniform rod, mass length^2 / 12.
        half_width: how far its matter reaches to either side [m].
        limits: least and largest joint angle [rad].
        max_speed, max_acceleration, max_torque: bounds on the joint's speed [rad/s], acceleration [rad/s^2] and torque
            [N m]. Where one is missing a plan may not ask for more than ten times what the straight motion of the
            joints needs.
    """

    length: Positive
    mass: Positive
    com: Annotated[Number, Field(ge=0)] | None = None
    inertia: Positive | None = None
    half_width: Annotated[Number, Field(ge=0)] = 0.0
    limits: tuple[Number, Number] | None = None
    max_speed: Positive | None = None
    max_acceleration: Positive | None = None
    max_torque: Positive | None = None

    @property
    def limited(self) -> bool:
        """Whether its joint has any limit."""
        return any(one is not None for one in (self.limits, self.max_speed, self.max_acceleration, self.max_torque))

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
        self_margin: distance [m] that links which share no joint keep from each other, half-widths included; without
            it they lie in different planes and may pass over one another.
    """

    links: Annotated[tuple[Link, ...], Field(min_length=2, max_length=20), few(20)]
    base: Vector = (0.0, 0.0)
    payload: Annotated[Number, Field(ge=0)] = 0.0
    self_margin: Annotated[Number, Field(ge=0)] | None = None

    @property
    def chain(self) -> Chain:
        """The arm in numbers."""
        links = self.links
        return Chain(
            np.array(self.base),
            np.array([link.length for link in links]),
            np.array([link.mass for link in links]),
            np.array([link.centre for link in links]),
            np.array([link.about_centre for link in links]),
            np.array([link.half_width for link in links]),
            self.payload,
        )

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


class ArmTask(Task):
    """From pose to pose, both at rest, in the given time, clear of the obstacles.

    Args:
        start, goal: poses.
        duration: T [s].
        obstacles: polygons in the workspace that no link may touch.
        margin: distance [m] that every link keeps from them.
        max_peak: optional bound on the centre of mass's acceleration [m/s^2].
        max_moment: optional bound on the moment about the first joint that the base feels [N m].
        then: "moment" for, among motions within a hundredth of the least peak, one with the least base moment.
    """

    kind: ClassVar[str] = "arm"

    start: Pose
    goal: Pose
    obstacles: Blocks = ()
    max_moment: Positive | None = None
    then: Literal["moment"] | None = None

    @model_validator(mode="after")
    def _plain_blocks(self) -> ArmTask:
        for i, block in enumerate(self.obstacles):
            if block.side != "either":
                raise ValueError(f".obstacles[{i}].side: was {block.side!r}, must be left out (an arm's path has none)")
        return self


class ArmManeuver(ArmTask):
    """A task for an arm."""

    arm: Arm

    @property
    def limited(self) -> bool:
        """Whether a joint, or the moment at the base, has any limit."""
        return self.max_moment is not None or any(link.limited for link in self.arm.links)

    @property
    def workspace(self) -> Workspace:
        """The arm among the obstacles; made anew each time."""
        polygons = tuple(np.array(block.vertices) for block in self.obstacles)
        return Workspace(self.arm.chain, polygons, self.margin, self.arm.self_margin)

    def unfit(self, name: Literal["start", "goal"], theta: tuple[float, ...], workspace: Workspace) -> str | None:
        """What keeps a configuration of the start or the goal, absolute angles [rad], from being one; or None.

        Its joints are out of their limits, it touches an obstacle, or links come too close to each other.
        """
        pose, place = getattr(self, name), np.array(theta)
        beyond = _beyond(self.arm, pose, theta, exact=name == "start")
        if beyond is not None:
            return f"{name}.{beyond}"
        hit = workspace.touched(place)
        if hit is not None:
            i, link, depth = hit
            return (
                f"obstacles[{i}]: was {depth:.4g} m from link {link + 1} at the {name}, must leave the arm "
                f"{self.margin:g} m free there"
            )
        least = self.arm.self_margin
        apart = workspace.apart(place) if least is not None and workspace.pairs else np.zeros(0)
        if least is not None and np.min(apart, initial=math.inf) < least * (1 - 1e-12):
            first, second = workspace.pairs[int(np.argmin(apart))]
            return (
                f"{name}: was links {first + 1} and {second + 1} {np.min(apart):.4g} m apart, must be at least "
                f"arm.self_margin, {least:g} m"
            )
        return None

    @model_validator(mode="after")
    def _poses_exist(self) -> ArmManeuver:
        ends: tuple[tuple[Literal["start", "goal"], Pose], ...] = (("start", self.start), ("goal", self.goal))
        for name, pose in ends:
            try:
                found = postures(self.arm, pose)
            except ValueError as error:
                raise ValueError(f".{name}{error}") from None
            if not found:
                first, second = (link.length for link in self.arm.links[:2])
                assert pose.tip is not None
                raise ValueError(
                    f".{name}.tip: was {list(pose.tip)}, must be {abs(first - second):g} to {first + second:g} m "
                    f"from the base, {list(self.arm.base)}"
                )
            workspace = self.workspace
            wrong = [self.unfit(name, theta, workspace) for theta in found]
            if None not in wrong:
                raise ValueError(f".{wrong[0]}")
        return self


def postures(arm: Arm, pose: Pose) -> list[tuple[float, ...]]:
    """The absolute angles [rad] of every configuration that a pose allows, best known order: up, down.

    Raises:
        ValueError: where the pose does not fit the arm, worded for a spec.
    """
    if pose.joints is not None:
        if len(pose.joints) != len(arm.links):
            raise ValueError(f".joints: was {len(pose.joints)} angles, must be {len(arm.links)}, one for every link")
        return [tuple(np.cumsum(pose.joints).tolist())]
    if len(arm.links) != 2:
        raise ValueError(f".tip: was given for {len(arm.links)} links, must be joints (a tip needs two links)")
    assert pose.tip is not None
    pair = Pair(arm.links[0].length, arm.links[1].length)
    s = np.array(pose.tip) - arm.base
    rho, room = length(s), 1e-12 * pair.outer
    if not pair.inner - room <= rho <= pair.outer + room:
        return []
    signs = {"up": [-1.0], "down": [1.0]}.get(pose.elbow or "either", [-1.0, 1.0])
    found = [np.diff(pair.angles(s, sign), prepend=0.0).tolist() for sign in signs]
    turned = [[_turned(link, q) for link, q in zip(arm.links, each, strict=True)] for each in found]
    return [tuple(np.cumsum(each).tolist()) for each in turned]


def _turned(link: Link, q: float) -> float:
    """A joint angle [rad], turned by whole turns into the joint's limits if one of these is within."""
    if link.limits is None or link.limits[0] - ANGLE <= q <= link.limits[1] + ANGLE:
        return q
    near = q + math.tau * math.ceil((link.limits[0] - ANGLE - q) / math.tau)
    return near if near <= link.limits[1] + ANGLE else q


def _beyond(arm: Arm, pose: Pose, theta: tuple[float, ...], exact: bool) -> str | None:
    """A joint of a configuration that is outside of its limits, worded for a spec; or None.

    Args:
        exact: whether a pose given as joints has these very angles, else they are meant up to full turns.
    """
    for k, (link, q) in enumerate(zip(arm.links, pose.joints or np.diff(theta, prepend=0.0).tolist(), strict=True)):
        if link.limits is None:
            continue
        low, high = link.limits[0] - ANGLE, link.limits[1] + ANGLE
        near = q if exact and pose.joints else q + math.tau * math.ceil((low - q) / math.tau)
        if not low <= near <= high:
            what = f"joints[{k}]: was {q:g}" if pose.joints else f"tip: was {list(pose.tip or ())}, joint {k + 1} {q:g}"
            return f"{what} rad, must be within arm.links[{k}].limits, {list(link.limits)}"
    return None
