"""What the least peak depends on, from the multipliers: M = max <L, b> / I, so dM = (<L, db> - M dI) / I."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .certify import lower_bound
from .exact import SETTLED, extremal, far_apart
from .moments import PointMass, costate, impulse, normalized
from .spec import Maneuver

AGAIN = 10  # how often Newton's method goes on from where it came to


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of the least peak M [m/s^2], everything else and the other obstacle times held fixed.

    tips (q, 2) [1/s^2], obstacle_times (q,) [m/s^3], duration [m/s^3], start_position, goal_position (2,) [1/s^2],
    start_velocity, goal_velocity (2,) [1/s]. Obstacle times' are NaN where the optimal motion at these times is not
    found, or they are nearer to each other or to the ends than half of 1e-9 of the duration (null in a plan's file).
    """

    tips: Array
    obstacle_times: Array
    duration: float
    start_position: Array
    start_velocity: Array
    goal_position: Array
    goal_velocity: Array


def sensitivities(maneuver: Maneuver, obstacle_times: Array, multipliers: Array) -> Sensitivities:
    """dM/d(everything) at given obstacle times [s], shape (q,), from optimal multipliers (2+q, 2), scaled.

    dM/dtip_i = l_i/I, dM/dpf = l_pos/I, dM/dvf = l_vel/I, dM/dp0 = -(l_pos + sum l_i)/I, dM/dv0 = -p(0)/I,
    dM/dT_i = -l_i . r'(T_i)/I, dM/dT = -(l_pos . vf + M |l_vel|)/I.
    """
    mass = PointMass.of(maneuver).facing_for(multipliers)
    times = obstacle_times / mass.time
    trial = mass.admissible(normalized(multipliers))
    area = float(impulse(trial, times))
    if area == 0:
        trial, area = 0 * trial, 1.0
    peak = float(np.sum(trial * mass.targets(times))) / area
    rates = trial / area
    pushing = np.any(rates[2:] != 0, axis=1)
    speed = np.sum(rates[2:] * _velocities(maneuver, times, multipliers), axis=1) if np.any(pushing) else 0.0
    _, p = costate(trial, times)
    position, velocity, slope = 1 / mass.time**2, 1 / mass.time, mass.unit / mass.time
    return Sensitivities(
        tips=rates[2:] * position,
        obstacle_times=np.where(pushing, -speed * slope, 0.0),
        duration=-float(rates[0] @ mass.vf + peak * np.hypot(*rates[1])) * slope,
        start_position=-(rates[0] + np.sum(rates[2:], axis=0)) * position,
        start_velocity=-p[0] / area * velocity,
        goal_position=rates[0] * position,
        goal_velocity=rates[1] * velocity,
    )


def optimal(mass: PointMass, times: Array, given: Array, peak: float) -> Array:
    """The best multipliers (2+q, 2) at scaled times (q,): those of the optimum, or given ones that prove more.

    A program's own are those of its circle and grid: with few edges they may look along one of them only.

    Args:
        peak: attained at these times [scaled]: nothing proves more.
    """
    own = lower_bound(mass, times, given)
    if own >= (1 - SETTLED) * peak or not far_apart(times):
        return given
    best, found = own, max((extremal(mass, times), extremal(mass, times, given)), key=lambda one: one.lower)
    for _ in range(AGAIN):  # where it does not settle at once, it goes on from there
        if found.lower <= (1 + SETTLED) * best:
            break
        best, given = found.lower, found.multipliers
        found = extremal(mass, times, given)
    return given


def _velocities(maneuver: Maneuver, times: Array, multipliers: Array) -> Array:
    """r'(T_i) [scaled] of the optimal motion, (q, 2); NaN where that is not found.

    Not from p alone, which may be zero before a wall, after it, or both; a clear wall may be crossed beyond its tip.
    """
    found = extremal(PointMass.of(maneuver), times, multipliers) if far_apart(times) else None
    if found is None or math.isinf(found.upper):
        return np.full_like(multipliers[2:], math.nan)
    return found.motion.velocity(times)
