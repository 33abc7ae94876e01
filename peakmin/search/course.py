"""A held control for given instants whose path stays within reach and out of the way, node by node.

    maximise kappa = 1/M  subject to  v_k in shape,  A v = kappa b,  |r_k - kappa base| <= kappa R,
                                      n_k . r_k >= kappa c_k,  and where an elbow turns over  n . V_k = 0

with r and V the position and velocity at the nodes, kappa times as large. The outer edge is convex; the inner edge and
what the links would touch are cut off by half-planes at the nodes where the path before was inside, again and again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..deadline import over
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..programs.states import StateProgram
from ..proofs.double_integrator import PointMass
from ..robots.joint_space import JointWay
from ..robots.joints import JointPath
from ..robots.link_clearance import link_clearance
from ..scenes.passages import Passage
from ..scenes.scene import Plane
from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.settings import Aligned
from ..types import Array
from .held import asked_more

TRIES = 14  # of cutting off
FIRST_ROOM = 3e-6  # of the arm: asked more than needed at first
WIDE, WORTH = 0.3, 1e-3  # of the arm: what counts as near to a node; relative gain worth another round
COARSE = 60  # holds of a motion that is looked for first
RADIUS = 1e-7  # of the reach: by which the outer edge is drawn in, for what bends outwards between nodes


@dataclass(frozen=True)
class Asked:
    """What is asked more than needed [m], and what nodes keep to."""

    room: float
    planes: list[Plane]


def resampled(motion: HoldTrajectory, edges: Array) -> HoldTrajectory:
    """About the same motion with other holds, whose ends are given as fractions of the duration."""
    nodes = edges * motion.nodes[-1]
    control = np.diff(motion.velocity(nodes), axis=0) / np.diff(nodes)[:, None]
    return HoldTrajectory(nodes, control, motion.start_position, motion.start_velocity)


@dataclass(frozen=True)
class Steered:
    """A free motion that a course found at its times [scaled], (q,)."""

    course: Course
    times: Array
    motion: HoldTrajectory
    joints: JointPath

    @property
    def peak(self) -> float:
        """[m/s^2]"""
        return self.motion.peak()

    def finer(self, steps: int, until: float = math.inf) -> Steered | None:
        """The same with so many holds; None where there is none, or the deadline `until` comes before."""
        course = replace(self.course, steps=steps, until=until)
        return course.around(self.times, resampled(self.motion, course.edges(self.times))) or course.free(self.times)


@dataclass(frozen=True)
class Course:
    """What is kept: the maneuver past its walls, touched at given times, and which edge is touched at one of them.

    turn: index of the wall at which the elbow turns over, with the outward unit normal there; or None.
    """

    passage: Passage
    past: Maneuver
    circle: Disc | Polygon
    steps: int
    turn: tuple[int, Array] | None = None
    until: float = math.inf  # a deadline after which nothing more is tried

    @property
    def mass(self) -> PointMass:
        return PointMass.of(self.past)

    def free(self, times: Array) -> Steered | None:
        """The motion of about least peak at these times [scaled], (q,), that is free and within reach; or None."""
        size = self.passage.size

        def solve(asked: Asked) -> tuple[Steered, float] | None:
            motion = self.solve(times, asked.planes)
            return None if motion is None else self._looked_at(motion, times)

        def more(found: tuple[Steered, float], asked: Asked) -> Asked | None:
            steered, short = found
            if short <= 0:
                return None
            room = asked.room + min(short, 0.01 * size) * 0.5
            return Asked(room, self._planes(steered.motion, times, asked.room + 0.02 * size, room))

        found = asked_more(Asked(FIRST_ROOM * size, []), solve, more, TRIES, self.until)
        return None if found is None else found[0]

    def around(self, times: Array, first: Trajectory, found: Steered | None = None) -> Steered | None:
        """The best free motion that solving again and again past what the nodes are near to leads to; None if none.

        Each time the half-planes are those of the motion before, which lies in all of them.

        Args:
            first: a motion that is free or nearly;  found: the best that is known.
        """
        size, room = self.passage.size, FIRST_ROOM * self.passage.size
        for _ in range(TRIES):
            planes = self._planes(first, times, WIDE * size, room)
            if over(self.until) or (motion := self.solve(times, planes)) is None:
                return found
            now, short = self._looked_at(motion, times)
            if short > 0:
                room += 1.3 * short
            elif found is None or now.peak < (1 - WORTH) * found.peak:
                first, found = motion, now
            else:
                return found
        return found

    def _looked_at(self, motion: HoldTrajectory, times: Array) -> tuple[Steered, float]:
        """The motion with its joints, and by how much [m] it does not keep what is asked."""
        path, workspace = self.joints(motion, times), self.passage.workspace
        return Steered(self, times, motion, path), link_clearance(workspace, path).short(workspace)

    def edges(self, times: Array) -> Array:
        """Ends of the holds [scaled], (steps+1,)."""
        return Aligned(steps=self.steps).edges(times)

    def joints(self, motion: Trajectory, times: Array) -> JointPath:
        """The joints' motion, which turns the elbow over where that is asked for."""
        changes = () if self.turn is None else (float(times[self.turn[0]]) * self.past.duration,)
        return self.passage.joints(motion, changes)

    def _planes(self, motion: Trajectory, times: Array, near: float, room: float) -> list[Plane]:
        """What keeps the nodes that are near to something on the outside of it, and `room` [m] more."""
        t = self.edges(times) * self.past.duration
        every = self.passage.planes(self.joints(motion, times), t, near)
        return [plane._replace(level=plane.level + room) for plane in every]

    def solve(self, times: Array, planes: list[Plane]) -> HoldTrajectory | None:
        """The motion of least peak at these times with these half-planes; None where the solver finds none."""
        mass, chain, edges = self.mass, self.passage.workspace.chain, self.edges(times)
        program = StateProgram(mass, self.circle, times, edges)
        inside = np.ones(len(edges), dtype=bool)
        inside[[0, -1]] = False
        if self.turn is not None:
            k = int(np.argmin(np.abs(edges - times[self.turn[0]])))
            inside[k] = False
            program.constraints.append(program.velocity[k] @ self.turn[1] == 0)
        nodes = np.flatnonzero(inside)
        base = np.tile((chain.base - mass.origin) / mass.length, (len(nodes), 1))
        program.within(program.position[nodes] - program.kappa * base, chain.reach[1] * (1 - RADIUS) / mass.length)
        program.keep([plane for plane in planes if inside[plane.node]])
        control = program.solve(self.until).control
        if control is None:
            return None
        state = self.past.start
        return HoldTrajectory(
            edges * mass.time, control * mass.unit, np.array(state.position), np.array(state.velocity)
        )


def steered(passage: Passage, past: Maneuver, times: Array, way: JointWay | None, until: float) -> Steered | None:
    """A free motion that keeps its elbow: past walls at about these times [scaled], or near a way that is free."""
    found = Course(passage, past, Disc(), COARSE, until=until).free(np.clip(times, 1e-3, 1 - 1e-3))
    # the walls have shown the way; without them it can be better
    alone, none = Course(passage, passage.maneuver, Disc(), COARSE, until=until), np.zeros(0)
    tries: list[Trajectory] = [way.motion] if way is not None else []
    if found is not None:
        tries.insert(0, resampled(found.motion, alone.edges(none)))
    made = [found, *(alone.around(none, one) for one in tries)]
    return min((one for one in made if one is not None), key=lambda one: one.peak, default=None)
