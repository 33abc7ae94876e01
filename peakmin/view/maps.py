"""The least peak over the times of two walls, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..queries.peak_map import peak_map as cells_of
from ..search.solve import solve
from ..spec.maneuver import Maneuver
from ..spec.settings import Settings
from .style import BELOW, BLACK, MARK, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes


def peak_map(maneuver: Maneuver, settings: Settings | None = None, count: int = 40, ax: Axes | None = None) -> Axes:
    """Least peak in continuous time over (T_1, T_2) for two walls, on `count` x `count` cells.

    Args:
        settings: to solve the maneuver with; its times are marked. Default: the least of the cells is.

    Raises:
        SpecError: when the maneuver is anything but two walls.
    """
    t, peak, best, top = cells_of(maneuver, count)
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
