"""Motions whose elbow turns over: the centre of mass touches an edge of the annulus, moving along it there.

The place on the edge and the instant are free; at given ones the least peak is a convex program (`Course`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..arrays import Array
from ..branch import Certificate
from ..circle import Disc, Polygon
from ..moments import PointMass
from ..obstacles import Wall
from ..spec import Maneuver
from ..trajectory import HoldTrajectory
from .course import Course
from .joints import JointPath
from .kinematics import unit
from .passage import Edge, Passage
from .workspace import Workspace

COARSE = 40  # holds of the programs that place and instant are looked for with
MOST_TRIALS = 40
ROOM = 0.02  # of the duration: least distance of the instant from the ends


@dataclass(frozen=True)
class Turn:
    """A free motion that turns its elbow over: how, its instant [scaled], its peak [m/s^2] with coarse holds."""

    course: Course
    times: Array
    motion: HoldTrajectory
    joints: JointPath
    peak: float

    def finer(self, steps: int) -> Turn | None:
        """The same with so many holds."""
        return _at(self.course.passage, self.course, self.times, steps)


def turn_on(
    workspace: Workspace, passage: Passage, edge: Edge, found: Certificate, past: Maneuver, circle: Disc | Polygon
) -> Turn | None:
    """The best free motion near the one that comes in over an arc; None where none is found free.

    Args:
        edge: which edge is touched.
        found, past: the optimum that only comes in over the arc's chord or tangent.
    """
    if not len(found.times):
        return None
    mass = PointMass.of(past)
    place = found.best.motion.in_units(mass).position(found.times[0] * mass.time) - workspace.chain.base
    began = np.array([found.times[0], math.atan2(place[1], place[0])])
    best: list[tuple[float, Array]] = []

    def course(angle: float, steps: int = COARSE) -> Course:
        inner, outer = workspace.chain.reach
        n = unit(angle)
        tip = workspace.chain.base + (outer if edge == "outer" else inner) * n
        touched = passage.maneuver.past([Wall(tip=tip, direction=-n, contact="touch")])
        return Course(passage, touched, circle, steps, (0, n))

    def value(x: Array) -> float:
        if not ROOM < x[0] < 1 - ROOM:
            return 1e9
        motion = course(float(x[1])).solve(x[:1], [])
        if motion is None:
            return 1e9
        best.append((motion.peak(), x.copy()))
        return motion.peak()

    simplex = began + np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.12]])
    simplex[:, 0] = np.clip(simplex[:, 0], 2 * ROOM, 1 - 2 * ROOM)
    options = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxfev": MOST_TRIALS}
    minimize(value, simplex[0], method="Nelder-Mead", options=options)
    for _, x in sorted(best, key=lambda one: one[0])[:1]:
        made = _at(passage, course(float(x[1])), x[:1], COARSE)
        if made is not None:
            return made
    return None


def _at(passage: Passage, course: Course, times: Array, steps: int) -> Turn | None:
    """The free motion at a place and instant, with so many holds."""
    course = Course(passage, course.past, course.circle, steps, course.turn)
    found = course.free(times)
    if found is None:
        return None
    motion, joints = found
    return Turn(course, times, motion, joints, motion.peak())
