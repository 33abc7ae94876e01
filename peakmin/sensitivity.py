"""What the least peak depends on, from the multipliers: M = max <L, b> / I, so dM = (<L, db> - M dI) / I."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .costate import CostateTrajectory
from .moments import PointMass, costate, impulse
from .spec import Maneuver


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
    none = np.zeros((len(p) - 1, 2))
    motion = CostateTrajectory(kinks, p[:-1], p[1:], np.full(len(p) - 1, peak), none, none, np.zeros(2), mass.v0)
    position, velocity, slope = 1 / mass.time**2, 1 / mass.time, mass.unit / mass.time
    return Sensitivities(
        tips=rates[2:] * position,
        obstacle_times=-np.sum(rates[2:] * motion.velocity(times), axis=1) * slope,
        duration=-float(rates[0] @ mass.vf + peak * np.hypot(*rates[1])) * slope,
        start_position=-(rates[0] + np.sum(rates[2:], axis=0)) * position,
        start_velocity=-p[0] / area * velocity,
        goal_position=rates[0] * position,
        goal_velocity=rates[1] * velocity,
    )
