"""The least peak over the times of two walls, as a picture."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SpecError
from ..programs.least_peak import LeastPeak
from ..search.solve import solve
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import Exact, Settings
from ..types import Array
from .style import BELOW, BLACK, MARK, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes

DEPTH = 4.0  # times the least peak at which the colours end


def peak_map(maneuver: Maneuver, settings: Settings | None = None, count: int = 40, ax: Axes | None = None) -> Axes:
    """Least peak in continuous time over (T_1, T_2) for two walls, on `count` x `count` cells.

    Args:
        settings: to solve the maneuver with; its times are marked. Default: the least of the cells is.

    Raises:
        SpecError: when the maneuver is anything but two walls.
    """
    walls_only(maneuver, "a map of the peak")
    if len(maneuver.walls) != 2:
        raise SpecError(f"maneuver.obstacles: was {len(maneuver.walls)} walls, must be 2 for a map of the peak")
    if count < 3:
        raise SpecError(f"count: was {count}, must be at least 3")
    t = (np.arange(count) + 0.5) / count * maneuver.duration
    peak, best, top = _cells(maneuver, t)
    times, size, name = t[list(best)], float(peak[best[::-1]]), "least of the cells"
    least = size
    if settings is not None:
        plan = solve(maneuver, settings)
        times, size, name = plan.obstacle_times, plan.peak, "solution"
    ax = axes_of(ax)
    levels, shown = np.geomspace(max(least, top / 100), top, 13), np.ma.masked_invalid(np.minimum(peak, 10 * top))
    colours = ax.contourf(
        t, t, shown, levels=levels, cmap="cividis", norm="log", extend="max" if levels[0] == least else "both"
    )
    ax.contour(t, t, shown, levels=levels, colors=BLACK, linewidths=0.4)
    ax.plot(*times, label=f"{name}: {size:.4g} m/s² at {times[0]:.3g} s, {times[1]:.3g} s", **MARK)
    bar = ax.figure.colorbar(colours, ax=ax, label="least peak [m/s²]", ticks=levels[::3], format="%.3g")
    bar.ax.minorticks_off()
    span = (0, maneuver.duration)
    ax.set(xlim=span, ylim=span, xlabel="$T_1$ [s]", ylabel="$T_2$ [s]")
    ax.set_aspect("equal", anchor="SE")
    ax.legend(**BELOW)
    return ax


def _cells(maneuver: Maneuver, t: Array) -> tuple[Array, tuple[int, int], float]:
    """Least peaks [m/s^2] for T_1, T_2 in t, a row for each T_2; the cell (T_1, T_2) of the least; where colours end.

    Where bounds from below are beyond the colours already, they stand for the peaks.
    """
    least_peak = LeastPeak(maneuver, Settings(method=Exact()))
    mass, count = least_peak.mass, len(t)
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
    return peak, best, DEPTH * max(least, base) or 1.0
