"""Motions whose elbow turns over: the centre of mass touches an edge of the annulus, moving along it there.

The place on the edge and the instant are free; at given ones the least peak is a convex program (`Course`).
"""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
from scipy.optimize import minimize

from ..deadline import OverError, over
from ..proofs.branch_and_bound import Certificate
from ..proofs.double_integrator import PointMass
from ..robots.joint_space import JointWay
from ..robots.kinematics import unit
from ..scenes.passages import Edge, Passage
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..types import Array
from .course import Course, Steered

COARSE = 40  # holds of the programs that place and instant are looked for with
MOST_TRIALS = 40
MOST_FREED, APART = 4, np.array([0.05, 0.15])  # places and instants that are freed; how far apart
GOOD = 0.05  # relative: a free motion so close to one that may hit things is enough
ROOM = 0.02  # of the duration: least distance of the instant from the ends


def turn_on(
    passage: Passage,
    edge: Edge,
    found: Certificate,
    past: Maneuver,
    until: float,
) -> Steered | None:
    """The best free motion near the one that comes in over an arc; None where none is found free.

    Args:
        edge: which edge is touched.
        until: a deadline after which nothing more is tried.
        found, past: the optimum that only comes in over the arc's chord or tangent.
    """
    if not len(found.times):
        return None
    mass, workspace = PointMass.of(past), passage.workspace
    place = found.best.motion.in_units(mass).position(found.times[0] * mass.time) - workspace.chain.base
    began = np.array([found.times[0], math.atan2(place[1], place[0])])
    best: list[tuple[float, Array]] = []

    def value(x: Array) -> float:
        if over(until):
            raise OverError
        if not ROOM < x[0] < 1 - ROOM:
            return 1e9
        motion = _course(passage, edge, float(x[1]), until).solve(x[:1], [])
        if motion is None:
            return 1e9
        best.append((motion.peak(), x.copy()))
        return motion.peak()

    simplex = began + np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.12]])
    simplex[:, 0] = np.clip(simplex[:, 0], 2 * ROOM, 1 - 2 * ROOM)
    options = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxfev": MOST_TRIALS}
    with suppress(OverError):
        minimize(value, simplex[0], method="Nelder-Mead", options=options)
    return _freed(passage, edge, best, until)


def _freed(passage: Passage, edge: Edge, met: list[tuple[float, Array]], until: float) -> Steered | None:
    """The best of the motions that become free near those met, their peaks [m/s^2] with instant and angle; or None."""
    least = min((peak for peak, _ in met), default=math.inf)
    made: list[Steered] = []
    tried: list[Array] = []
    for _, x in sorted(met, key=lambda one: one[0]):
        if len(tried) >= MOST_FREED or any(np.all(np.abs(x - other) < APART) for other in tried):
            continue
        tried.append(x)
        here = _course(passage, edge, float(x[1]), until)
        found = here.free(x[:1])
        if found is not None:
            better = here.around(x[:1], found.motion, found)
            assert better is not None
            made.append(better)
            if better.peak < (1 + GOOD) * least:
                break
    return min(made, key=lambda one: one.peak, default=None)


def turn_along(passage: Passage, way: JointWay, until: float) -> Steered | None:
    """A free motion near a way on which the elbow turns over once; None where none is found, or it does so oftener."""
    turns = way.turns
    if len(turns) % 2 == 0:  # cells that a fold goes through have either elbow: it may seem to turn over and back
        return None
    t, angle, bend = turns[len(turns) // 2]
    course, at = _course(passage, "outer" if bend > 0 else "inner", angle, until), np.array([t])
    return course.around(at, way.motion)


def _course(passage: Passage, edge: Edge, angle: float, until: float) -> Course:
    """What touches an edge at an angle, moving along it."""
    inner, outer = passage.workspace.chain.reach
    n = unit(angle)
    tip = passage.workspace.chain.base + (outer if edge == "outer" else inner) * n
    touched = passage.maneuver.past([Wall(tip=tip, direction=-n, contact="touch")])
    return Course(passage, touched, Disc(), COARSE, (0, n), until)
