"""What the least peak depends on, from the multipliers: M = max <L, b> / I, so dM = (<L, db> - M dI) / I."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..geometry.norm import norm
from ..spec.maneuver import Maneuver
from ..types import Array
from .bounds import lower_bound
from .double_integrator import PointMass, costate_at_kinks, impulse, normalized
from .extremal import SETTLED, extremal, far_apart

AGAIN = 10  # how often Newton's method goes on from where it came to
CLOSE = 1e-8  # relative gap from which on a motion counts as the optimal one
IDLE = 5e-8  # relative: what leaving a wall out may cost


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of the least peak M [m/s^2], everything else and the other obstacle times held fixed.

    tips (q, d) [1/s^2], obstacle_times (q,) [m/s^3], duration [m/s^3], start_position, goal_position (d,) [1/s^2],
    start_velocity, goal_velocity (d,) [1/s]. Obstacle times' are NaN where the optimal motion at these times is not
    found, or they are nearer to each other or to the ends than half of 1e-9 of the duration (null in a plan's file).
    Where a wall can be left out, its tip and time count as not mattering: what crosses there by itself has a larger
    peak at any other time, and M a kink, but none when the time may follow.
    """

    tips: Array
    obstacle_times: Array
    duration: float
    start_position: Array
    start_velocity: Array
    goal_position: Array
    goal_velocity: Array


def sensitivities(maneuver: Maneuver, obstacle_times: Array, multipliers: Array) -> Sensitivities:
    """dM/d(everything) at given obstacle times [s], shape (q,), from optimal multipliers (2+q, d), scaled.

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
    speed = np.zeros(mass.walls)
    if np.any(pushing):
        speed[pushing] = np.sum(rates[2:] * _velocities(maneuver, times, multipliers), axis=1)[pushing]
    _, p = costate_at_kinks(trial, times)
    position, velocity, slope = 1 / mass.time**2, 1 / mass.time, mass.unit / mass.time
    return Sensitivities(
        tips=rates[2:] * position,
        obstacle_times=-speed * slope + 0.0,
        duration=-float(rates[0] @ mass.vf + peak * float(norm(rates[1]))) * slope,
        start_position=-(rates[0] + np.sum(rates[2:], axis=0)) * position,
        start_velocity=-p[0] / area * velocity,
        goal_position=rates[0] * position,
        goal_velocity=rates[1] * velocity,
    )


def optimal(mass: PointMass, times: Array, given: Array, peak: float) -> Array:
    """The best multipliers (2+q, d) at scaled times (q,): those of the optimum, or given ones that prove more.

    A program's own are those of its circle and grid: with few edges they may look along one of them only.

    Walls that can be left out have none: where the optimum past the others is at the tips by itself, M has a kink
    over these tips and times, and a slope on either side of zero.

    Args:
        peak: attained at these times [scaled]: nothing proves more.
    """
    return without_idle(mass, times, _optimal(mass, times, given, peak))


def without_idle(mass: PointMass, times: Array, multipliers: Array) -> Array:
    """Multipliers (2+q, d) that prove as much, without those of walls that can be left out; these where none can."""
    if not far_apart(times):
        return multipliers
    enough = (1 - IDLE) * lower_bound(mass, times, multipliers)
    for i in np.flatnonzero(np.any(multipliers[2:] != 0, axis=1)).tolist():
        others = np.any(multipliers[2:] != 0, axis=1) & (np.arange(mass.walls) != i)
        found = np.zeros_like(multipliers)
        found[np.concatenate([[True, True], others])] = extremal(mass.only(others), times[others]).multipliers
        if lower_bound(mass, times, found) >= enough:
            multipliers = found
    return multipliers


def _optimal(mass: PointMass, times: Array, given: Array, peak: float) -> Array:
    """The best multipliers found, of all walls."""
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
    """r'(T_i) [scaled] of the optimal motion, (q, d); NaN where that is not found.

    Not from p alone, which may be zero before a wall, after it, or both; a clear wall may be crossed beyond its tip.
    """
    mass, out = PointMass.of(maneuver), np.full_like(multipliers[2:], math.nan)
    if not far_apart(times):
        return out
    pushing = np.any(multipliers[2:] != 0, axis=1)
    # past those that push, and past all, where a motion through the others is easier to find
    for walls in (pushing, np.ones_like(pushing)):
        own = multipliers[np.concatenate([[True, True], walls])]
        for start in (own, None):
            found = extremal(mass.only(walls), times[walls], start)
            if found.gap <= CLOSE:
                out[walls] = found.motion.velocity(times[walls])
                return out
    return out
