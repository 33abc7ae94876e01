"""Local minima of M* over the obstacle times, from places that promise them."""

from __future__ import annotations

import itertools
import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.optimize import LinearConstraint, brentq, minimize

from ..deadline import OverError, over
from ..geometry.norm import across, dot, norm
from ..types import Array
from .double_integrator import PointMass, impulse
from .extremal import APART, Extremal, extremal

FINE = 1e-15  # relative: how precisely a descent is ended
COARSE = tuple((k + 0.5) / 7 for k in range(7))  # times tried where one box does not prove the rest
DESCENTS = 5
NEAR, MOST_TRIALS = 0.02, 300  # of the duration; how far and how often is looked around the best times


def slopes(mass: PointMass, times: Array, found: Extremal) -> Array:
    """dM/dT_i = -l_i . r'(T_i) / I, shape (q,) [scaled]: the multipliers give it for nothing."""
    area = float(impulse(found.multipliers, times)) or 1.0
    return np.asarray(-np.sum(found.multipliers[2:] * found.motion.velocity(times), axis=1) / area)


def descend(mass: PointMass, found: Extremal, times: Array, until: float = math.inf) -> tuple[Extremal, Array]:
    """A local minimum of M* over the times from the given ones; never worse than those."""
    q = mass.walls
    if not q or found.upper == 0 or not math.isfinite(found.upper):
        return found, times
    best: tuple[Extremal, Array] = (found, times)

    def value(at: Array) -> tuple[float, Array]:
        nonlocal best
        if over(until):
            raise OverError
        at = np.clip(at, APART, 1 - APART)
        if np.any(np.diff(at) < APART):
            return 1e3, np.zeros(q)
        here = extremal(mass, at, best[0].multipliers)
        if here.upper < best[0].upper:
            best = here, at
        if not math.isfinite(here.upper):
            return 1e3, np.zeros(q)
        return here.upper / found.upper, slopes(mass, at, here) / found.upper

    order = np.eye(q)[1:] - np.eye(q)[:-1]
    constraints = [LinearConstraint(order, lb=APART)] if q > 1 else []
    with suppress(OverError):
        minimize(
            value,
            times,
            jac=True,
            method="SLSQP",
            bounds=[(APART, 1 - APART)] * q,
            constraints=constraints,
            options={"maxiter": 40, "ftol": FINE},
        )
    return best


def unhindered(mass: PointMass) -> tuple[Extremal, Array] | None:
    """The optimum without any wall, at the times at which it crosses their lines; None where it meets one or does not
    cross them in order. Its multipliers, without walls, prove that no wall is in the way.
    """
    free = extremal(mass.only(np.zeros(mass.walls, dtype=bool)), np.zeros(0))
    motion = free.motion
    ends = motion.position(np.array([0.0, 1.0]))
    normal, side = across(mass.free, ends[0] - mass.tips)
    if np.any(side * dot(ends[1] - mass.tips, normal) >= 0):
        return None

    def off(t: float, i: int) -> float:
        return float((motion.position(np.array([t]))[0] - mass.tips[i]) @ normal[i])

    times = np.array([brentq(off, 0.0, 1.0, (i,), xtol=np.finfo(float).eps) for i in range(mass.walls)])
    at = motion.position(times) - mass.tips
    kept = norm(at - mass.windows.nearest(at)) <= APART
    if np.any(np.diff(np.concatenate([[0.0], times, [1.0]])) <= APART) or not np.all(kept):
        return None
    idle = np.vstack([free.multipliers, np.zeros_like(mass.tips)])
    found = extremal(mass, times, idle)
    return replace(found, lower=free.lower, multipliers=idle), times


def elsewhere(mass: PointMass, best: Extremal, at: Array, until: float) -> tuple[Extremal, Array]:
    """The best of a few descents, from where a coarse choice of ordered times is best: M* can have several minima."""
    q = mass.walls
    if q > len(COARSE) // 2:
        return best, at
    points = [np.array(point) for point in itertools.combinations(COARSE, q)]
    met = ((extremal(mass, point), point) for point in points if not over(until))
    for here, point in sorted(met, key=lambda pair: pair[0].upper)[:DESCENTS]:
        there, times = descend(mass, here, point, until)
        if there.upper < best.upper:
            best, at = there, times
    return _polished(mass, best, at, until)


def _polished(mass: PointMass, best: Extremal, at: Array, until: float) -> tuple[Extremal, Array]:
    """Better times nearby without slopes, which M* need not have where a wall stops to push."""

    def value(times: Array) -> float:
        nonlocal best, at
        if over(until):
            raise OverError
        if np.any(np.diff(np.concatenate([[0.0], times, [1.0]])) < APART):
            return 1e9
        here = extremal(mass, times)
        if here.upper < best.upper:
            best, at = here, times.copy()
        return here.upper if math.isfinite(here.upper) else 1e9

    # each time is moved with all later ones: times that nearly coincide stay in order
    together = np.triu(np.ones((mass.walls, mass.walls)))
    for _ in range(2):
        simplex = at + NEAR * np.vstack([np.zeros(mass.walls), together])
        options = {"initial_simplex": simplex, "xatol": 1e-7, "fatol": 1e-12, "maxfev": MOST_TRIALS}
        with suppress(OverError):
            minimize(value, at, method="Nelder-Mead", options=options)
    return best, at
