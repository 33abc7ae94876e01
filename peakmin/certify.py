"""Lower bounds that hold for every control, and need no trust in a solver."""

from __future__ import annotations

import numpy as np

from .circle import Array
from .moments import ROUNDING, PointMass, impulse


def lower_bound(mass: PointMass, times: Array, multipliers: Array) -> float:
    """D(L, T) = <L, b(T)> / int_0^1 |p(t)| dt: no control at all has a smaller peak [scaled] at these times.

    Args:
        mass: the maneuver in scaled units.
        times: obstacle times [scaled], shape (q,).
        multipliers: any L, shape (2+q, 2); made admissible first.
    """
    trial = mass.admissible(multipliers / (np.max(np.abs(multipliers)) or 1.0))
    b, size = mass.targets(times), np.abs(trial)
    work = np.sum(trial * b) - np.sum(size * (ROUNDING * np.abs(b) + mass.target_errors(times)))
    if not work > 0:
        return 0.0
    return float(work / (impulse(trial, times) * (1 + ROUNDING) + ROUNDING * np.sum(size)))
