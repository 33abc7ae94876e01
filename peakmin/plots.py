"""Pictures in one style: readable in grey and by the colour-blind, units on every axis.

Every function takes `ax=` and returns the axes it drew on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.quiver import Quiver
from numpy.typing import ArrayLike

from .arrays import Array
from .circle import Polygon
from .trajectory import HoldTrajectory

if TYPE_CHECKING:
    from .budget import ErrorBudget
    from .obstacles import Wall
    from .plan import Plan
    from .sweep import Sweep

# Okabe and Ito's colours in an order whose lightness differs too; dashes tell the lines apart in grey.
BLUE, ORANGE, GREEN, PINK, BLACK, RED = "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#000000", "#D55E00"
STYLE: Any = {  # matplotlib's rc parameters
    "axes.prop_cycle": cycler(color=[BLUE, ORANGE, BLACK, GREEN, PINK], linestyle=["-", "--", "-.", ":", (0, (5, 1))]),
    "axes.grid": True,
    "grid.color": "#dddddd",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "font.size": 10,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 150,
}
WALL: Any = {"color": "#555555", "linewidth": 4, "linestyle": "-", "solid_capstyle": "butt", "zorder": 3}
LINE: Any = {"color": BLACK, "linewidth": 1.4, "linestyle": ":", "zorder": 3}
BLOCK: Any = {"facecolor": "#d0d0d0", "edgecolor": "#333333", "linewidth": 1.2, "linestyle": "-", "zorder": 2}
BELOW: Any = {  # a legend under the axes, at a distance in units of its letters: clear of the ticks and the label
    "fontsize": "small",
    "loc": "upper center",
    "bbox_to_anchor": (0.5, 0),
    "borderaxespad": 4.8,
    "frameon": False,
}


def axes_of(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    with plt.rc_context(STYLE):
        return plt.subplots()[1]


def circle_approximation(polygon: Polygon, ax: Axes | None = None) -> Axes:
    """One quadrant of the circle and its polygon for M = 1 (the paper's figure 3)."""
    ax = axes_of(ax)
    angle = np.linspace(0, np.pi / 2, 200)
    ax.plot(np.cos(angle), np.sin(angle), color=ORANGE, linestyle="--", label="circle")
    corners = polygon.vertices[: polygon.segments + 1]
    ax.plot(*corners.T, color=BLUE, marker="o", markersize=4, linestyle="-", label=f"n = {polygon.segments}")
    ax.set(aspect="equal", xlabel="$u_x/M$", ylabel="$u_y/M$", title=f"Circle approximation, n = {polygon.segments}")
    ax.legend(loc="lower left")
    return ax


def circle_error(segments: ArrayLike = range(1, 11), ax: Axes | None = None) -> Axes:
    """Largest error 1 - cos(pi/(4n)) in percent over n (the paper's figure 11)."""
    ax = axes_of(ax)
    n = np.asarray(segments)
    ax.semilogy(n, [100 * Polygon(segments=int(k)).error for k in n], color=BLUE, marker="o", linestyle="-")
    ax.set(xlabel="segments per quadrant n", ylabel="largest error [%]", title="Circle error")
    ax.set_xticks(n)
    return ax


def control(plan: Plan, axis: int = 0, ax: Axes | None = None, label: str | None = None) -> Axes:
    """One component of the acceleration over time (the paper's figures 5 and 8); axis 0 is x, 1 is y."""
    ax = axes_of(ax)
    _over_time(ax, plan, lambda u: u[..., axis], label)
    for at in plan.obstacle_times:
        ax.axvline(at, color="#999999", linewidth=0.8, linestyle=":")
    ax.set(xlabel="t [s]", ylabel=f"$u_{'xy'[axis]}$ [m/s²]")
    return ax


def _over_time(ax: Axes, plan: Plan, of: Callable[[Array], Array], label: str | None) -> None:
    """Something of the acceleration: steps for holds, a line for a continuous control."""
    t, color = plan.times, ax._get_lines.get_next_color()  # type: ignore[attr-defined]
    if isinstance(plan.trajectory, HoldTrajectory):
        ax.stairs(of(plan.acceleration(t[:-1])), t, baseline=None, label=label, color=color, linewidth=1.4)
    else:
        t = np.linspace(0, plan.maneuver.duration, 1001)
        ax.plot(t, of(plan.acceleration(t)), label=label, color=color, linestyle="-", linewidth=1.4)


def overview(plan: Plan) -> Figure:
    """The path beside |u| over time with the peak and its bound, on one figure."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(11, 4.5))
        path(plan, ax=axes[0])
        if plan.trajectory is not None:
            control_size(plan, ax=axes[1])
    return figure


def control_size(plan: Plan, ax: Axes | None = None) -> Axes:
    """|u| and its components over time with the peak and the lower bound."""
    ax = axes_of(ax)
    for axis in (0, 1):
        _over_time(ax, plan, lambda u, i=axis: u[..., i], f"$u_{'xy'[axis]}$")  # type: ignore[misc]
    _over_time(ax, plan, lambda u: np.hypot(u[..., 0], u[..., 1]), "|u(t)|")
    ax.axhline(plan.peak, color=BLACK, linewidth=0.9, label=f"peak {plan.peak:.6g}")
    ax.axhline(plan.lower_bound, color=ORANGE, linestyle="--", linewidth=1.2, label=f"bound {plan.lower_bound:.6g}")
    ax.set(xlabel="t [s]", ylabel="acceleration [m/s²]", ylim=(-1.15 * plan.peak or -1, 1.15 * plan.peak or 1))
    ax.legend(ncols=3, **BELOW)
    return ax


def path(plan: Plan, ax: Axes | None = None, arrows: int = 24) -> Axes:
    """The path of the centre of mass past its obstacles (the paper's figure 8).

    Args:
        arrows: how many times to draw the acceleration at; 0 for none.
    """
    ax = axes_of(ax)
    maneuver, track = plan.maneuver, np.array([plan.maneuver.start.position, plan.maneuver.goal.position])
    if plan.trajectory is not None:
        track = np.vstack([track, plan.position(np.linspace(0, maneuver.duration, 600))])
    low, high = _view(plan, track)
    size = float(np.max(high - low))
    _obstacles(ax, plan, 2 * size)
    if plan.trajectory is not None:
        ax.plot(*track[2:].T, color=BLUE, linestyle="-", linewidth=1.8, label="path of the centre of mass", zorder=4)
        if arrows:
            t = (np.arange(arrows) + 0.5) / arrows * maneuver.duration
            u = plan.acceleration(t)
            longest: Any = {"angles": "xy", "scale_units": "xy", "scale": (np.max(np.hypot(*u.T)) or 1) / (0.12 * size)}
            shape: Any = {
                "units": "inches",
                "width": 0.022,
                "headwidth": 4,
                "headlength": 5,
                "headaxislength": 4.5,
                "minshaft": 2,
            }
            ax.quiver(*plan.position(t).T, *u.T, color=RED, zorder=5, label="acceleration", **longest, **shape)
        if len(plan.obstacle_times):
            mark: Any = {"linestyle": "none", "marker": "D", "markersize": 5, "color": ORANGE, "zorder": 6}
            ax.plot(*plan.position(plan.obstacle_times).T, markeredgecolor=BLACK, label="crossing", **mark)
    ends: Any = {"linestyle": "none", "markersize": 6, "color": BLACK, "zorder": 6}
    ax.plot(*maneuver.start.position, marker="o", label="start", **ends)
    ax.plot(*maneuver.goal.position, marker="s", label="goal", **ends)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal", anchor="S")  # from below: the layout then knows where the legend ends
    handles, labels = ax.get_legend_handles_labels()
    arrow = Line2D([], [], linestyle="none", color=RED, marker=r"$\rightarrow$", markersize=11)
    handles = [arrow if isinstance(handle, Quiver) else handle for handle in handles]
    ax.legend(handles, labels, ncols=3, **BELOW)
    return ax


def _view(plan: Plan, track: Array) -> tuple[Array, Array]:
    """Lower left and upper right corner of the picture: all of the path, and of the rest what is not too far away."""
    maneuver = plan.maneuver
    low, high = track.min(axis=0), track.max(axis=0)
    reach = 0.75 * max(float(np.max(high - low)), 1e-12)
    middle = (low + high) / 2
    rays = [ray for wall in {*maneuver.walls, *plan.walls} for ray in wall.rays]
    rest = [tip for tip, _ in rays] + [tip + 0.4 * reach * along for tip, along in rays]
    rest += [corner for block in maneuver.blocks for ring in block.grown(maneuver.margin) for corner in ring]
    cloud = np.array(
        [low, high, *np.clip(np.reshape([*rest, *(maneuver.region or ())], (-1, 2)), middle - reach, middle + reach)]
    )
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    room = 0.08 * max(float(np.max(high - low)), reach)
    return low - room, high + room


def _obstacles(ax: Axes, plan: Plan, far: float) -> None:
    """Region, blocks, margins, walls, and the lines that the search put up, drawn `far` [m] from their tips."""
    maneuver = plan.maneuver
    if maneuver.region is not None:
        edge: Any = {"edgecolor": BLACK, "linewidth": 1.2, "linestyle": "-.", "zorder": 2}
        ax.fill(*np.transpose(maneuver.region), facecolor="none", label="region", **edge)
    for i, block in enumerate(maneuver.blocks):
        ax.fill(*np.transpose(block.vertices), label=None if i else "block", **BLOCK)
    rings = [ring for block in maneuver.blocks for ring in block.grown(maneuver.margin)] if maneuver.margin else []
    for i, ring in enumerate(rings):
        dashes: Any = {"color": "#444444", "linewidth": 0.9, "linestyle": "--", "zorder": 3}
        ax.plot(*np.vstack([ring, ring[:1]]).T, label=None if i else "margin", **dashes)
    lines = [wall for wall in plan.walls if not any(_same_line(wall, other, far) for other in maneuver.walls)]
    for name, walls, style in (("wall", maneuver.walls, WALL), ("line", lines, LINE)):
        for i, (tip, along) in enumerate(ray for wall in walls for ray in wall.rays):
            ax.plot(*np.array([tip, tip + far * along]).T, label=None if i else name, **style)


def _same_line(one: Wall, other: Wall, size: float) -> bool:
    """Whether two walls stand on one line, to a millionth of the picture: the search puts up the user's walls anew."""
    (tip, along), (there, toward) = one.rays[0], other.rays[0]
    across = np.array([-along[1], along[0]])
    return bool(abs(across @ toward) < 1e-6 and abs(across @ (there - tip)) < 1e-6 * size)


def peak_over_time(sweep: Sweep, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Least M over T_obs with the winner (the paper's figure 7); one wall."""
    if sweep.obstacle_times.ndim != 1:
        raise ValueError("peak_over_time draws sweeps over one wall")
    ax = axes_of(ax)
    known = np.isfinite(sweep.peak)
    ax.plot(sweep.obstacle_times[known], sweep.peak[known], color=BLUE, marker="o", markersize=4, label=label)
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]")
    if not np.any(known):
        return ax
    at, peak = sweep.obstacle_times[sweep.winner], sweep.peak[sweep.winner]
    ax.plot(at, peak, "D", color=ORANGE, markeredgecolor=BLACK, label=f"least: {peak:.4f} m/s² at {at:.4f} s")
    ax.axhline(sweep.best.lower_bound, color=BLACK, linestyle=":", label="lower bound at the winner, any control")
    if peak > 0 and np.max(sweep.peak[known]) > 20 * peak:
        ax.set_yscale("log")
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]")
    ax.legend()
    return ax


def over_segments(
    n: Sequence[int], values: ArrayLike, ylabel: str, ax: Axes | None = None, limit: float | None = None
) -> Axes:
    """Something over the segments per quadrant (the panels of the paper's figure 6); `limit` is n -> infinity."""
    ax = axes_of(ax)
    ax.plot(n, np.asarray(values), color=BLUE, marker="o", linestyle="-")
    if limit is not None:
        ax.axhline(limit, color=ORANGE, linestyle="--", label=f"disc: {limit:.4f}")
        ax.legend()
    ax.set(xlabel="segments per quadrant n", ylabel=ylabel)
    ax.set_xticks(list(n))
    return ax


def budget(errors: ErrorBudget, ax: Axes | None = None) -> Axes:
    """The parts of an error budget as one stacked bar, costs to the right of zero and gains to the left."""
    ax = axes_of(ax)
    ends = {True: 0.0, False: 0.0}
    shades = [BLUE, ORANGE, GREEN, PINK, "#999999"]
    hatches = ["", "//", "..", "xx", ""]
    for (name, part), shade, hatch in zip(errors.parts.items(), shades, hatches, strict=True):
        label = f"{name.replace('_', ' ')}: {part:+.3g}"
        ax.barh(0, part, left=ends[part >= 0], color=shade, hatch=hatch, edgecolor="white", label=label)
        ends[part >= 0] += part
    ax.axvline(errors.total, color=BLACK, linestyle="--", label=f"stated - true: {errors.total:+.3g}")
    ax.axvline(0, color=BLACK, linewidth=0.8)
    ax.set(yticks=[], xlabel=f"M(settings) - M(true) [m/s²], M(true) = {errors.true:.6g}")
    ax.legend(ncols=2, **BELOW)
    return ax
