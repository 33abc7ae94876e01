"""The least peak over the times of two walls, cell by cell."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..errors import SpecError
from ..programs.least_peak import LeastPeak
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import Exact, Settings
from ..types import Array

DEPTH = 4.0  # times the least peak up to which peaks are made: above it bounds from below stand for them


class PeakMap(NamedTuple):
    """times: of the cells' middles [s], (count,);  peak: at T_1, T_2, a row for each T_2 [m/s^2], (count, count);
    best: the cell (T_1, T_2) of the least one;  top: where bounds begin [m/s^2].
    """

    times: Array
    peak: Array
    best: tuple[int, int]
    top: float


def peak_map(maneuver: Maneuver, count: int) -> PeakMap:
    """Least peaks in continuous time on `count` x `count` cells.

    Raises:
        SpecError: when the maneuver is anything but two walls, or there are fewer than three cells in a row.
    """
    walls_only(maneuver, "a map of the peak")
    if len(maneuver.walls) != 2:
        raise SpecError(f"maneuver.obstacles: was {len(maneuver.walls)} walls, must be 2 for a map of the peak")
    if count < 3:
        raise SpecError(f"count: was {count}, must be at least 3")
    t = (np.arange(count) + 0.5) / count * maneuver.duration
    least_peak = LeastPeak(maneuver, Settings(method=Exact()))
    mass = least_peak.mass
    peak = np.full((count, count), np.nan)
    for i, j in combinations(range(count), 2):
        peak[j, i] = mass.floor(t[[i, j]] / mass.time) * mass.unit
    base, best, least = 0.1 * float(np.nanquantile(peak, 0.1)), (0, 1), np.inf
    for flat in np.argsort(peak, axis=None)[: count * (count - 1) // 2]:
        j, i = divmod(int(flat), count)
        if peak[j, i] > DEPTH * max(least, base):
            break
        peak[j, i] = least_peak(t[[i, j]]).upper * mass.unit
        if peak[j, i] < least:
            best, least = (i, j), float(peak[j, i])
    return PeakMap(t, peak, best, DEPTH * max(least, base) or 1.0)
