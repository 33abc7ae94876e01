"""What the least peak depends on, from the multipliers: M = max <L, b> / I, so dM = (<L, db> - M dI) / I."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .integrals import mean_direction
from .moments import PointMass, costate, impulse
from .spec import Maneuver

IDLE = 1e-9  # of the largest multiplier: a wall with less is passed anywhere


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of the least peak M [m/s^2], everything else and the other obstacle times held fixed.

    tips (q, 2) [1/s^2], obstacle_times (q,) [m/s^3], duration [m/s^3], start_position, goal_position (2,) [1/s^2],
    start_velocity, goal_velocity (2,) [1/s].
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
    trial = mass.admissible(multipliers)
    area = float(impulse(trial, times))
    if area == 0:
        trial, area = 0 * trial, 1.0
    peak = float(np.sum(trial * mass.targets(times))) / area
    rates = trial / area
    kinks, p = costate(trial, times)
    position, velocity, slope = 1 / mass.time**2, 1 / mass.time, mass.unit / mass.time
    return Sensitivities(
        tips=rates[2:] * position,
        obstacle_times=-np.sum(rates[2:] * _velocities(mass, kinks, p, peak, rates[2:]), axis=1) * slope + 0.0,
        duration=-float(rates[0] @ mass.vf + peak * np.hypot(*rates[1])) * slope,
        start_position=-(rates[0] + np.sum(rates[2:], axis=0)) * position,
        start_velocity=-p[0] / area * velocity,
        goal_position=rates[0] * position,
        goal_velocity=rates[1] * velocity,
    )


def _velocities(mass: PointMass, kinks: Array, p: Array, peak: float, push: Array) -> Array:
    """r'(T_i) [scaled] at the tips of walls that push, shape (q, 2); zero at others.

    Between two of them, or ends, h apart, u = M p/|p| gains h M a in velocity, and r(b) - r(a) = h (v + h M (a - w))
    with a and w the plain and the weighted mean of p/|p|. Where p is zero it says nothing of the motion: each velocity
    is that of the leg, before or after, in which p is larger.
    """
    size = np.hypot(*push.T)
    at = np.r_[0, 1 + np.flatnonzero(size > IDLE * np.max(size, initial=0.0)), len(kinks) - 1]
    place = np.vstack([np.zeros(2), mass.tips, mass.pf])[at]
    h, speak = np.diff(kinks[at])[:, None], np.hypot(*p[at].T)
    plain, weighted = mean_direction(p[at[:-1]], p[at[1:]])
    first = np.diff(place, axis=0) / h - h * peak * (plain - weighted)
    last = first + h * peak * plain
    before = speak[:-2] >= speak[2:]
    out = np.zeros_like(push)
    out[at[1:-1] - 1] = np.where(before[:, None], last[:-1], first[1:])
    return out
