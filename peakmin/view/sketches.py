"""Pictures of the question and of the method, before anything is solved."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch
from numpy.typing import ArrayLike

from ..spec.control_set import Polygon
from ..spec.maneuver import Maneuver
from .scenery import ends, obstacles, show, view
from .style import BLACK, BLUE, ORANGE, RED, axes_of

WIDE, HIGH = 1.9, 0.45  # half the sides of the flowchart's boxes


def problem(maneuver: Maneuver, ax: Axes | None = None) -> Axes:
    """What is asked: start and goal with their velocities, the straight way, and what stands in it (figure 1)."""
    ax = axes_of(ax)
    line = np.array([maneuver.start.position, maneuver.goal.position])
    low, high = view(maneuver, (), np.vstack([line, *(wall.tip for wall in maneuver.walls)]))
    size = float(np.max(high - low))
    obstacles(ax, maneuver, 2 * size)
    ax.plot(*line.T, color=BLUE, linestyle="--", linewidth=1.2, label="straight way", zorder=2)
    speeds = np.array([maneuver.start.velocity, maneuver.goal.velocity])
    if np.any(speeds):
        fastest = np.max(np.hypot(*speeds.T))
        drawn: Any = {"angles": "xy", "scale_units": "xy", "scale": fastest / (0.15 * size), "width": 0.006}
        ax.quiver(*line.T, *speeds.T, color=RED, zorder=5, label="velocity", **drawn)
    ends(ax, maneuver)
    note: Any = {"textcoords": "offset points", "fontsize": "small", "zorder": 7}
    for place, speed, when in zip(line, speeds, ("0", f"{maneuver.duration:g} s"), strict=True):
        ax.annotate(f"t = {when}", place, xytext=(0, -17 if speed[1] > 0 else 9), ha="center", **note)
    names = ["$T_{obs}$"] if len(maneuver.walls) == 1 else [f"$T_{i + 1}$" for i in range(len(maneuver.walls))]
    for wall, name in zip(maneuver.walls, names, strict=True):
        where = f"{name} at ({wall.tip[0]:g}, {wall.tip[1]:g}) m"
        up = -wall.direction[1] >= 0
        ax.annotate(where, wall.tip, xytext=(0, 7 if up else -7), ha="center", va="bottom" if up else "top", **note)
    show(ax, (low, high))
    return ax


def flowchart(ax: Axes | None = None) -> Axes:
    """The two loops: bisection on M inside, obstacle times outside (figure 2)."""
    ax = axes_of(ax)
    ax.set(xlim=(0.1, 11.8), ylim=(0.2, 12))
    ax.set_axis_off()
    for x, y, words, shade in (
        (4.5, 11.4, "first $T_{obs}$", "white"),
        (4.5, 9.8, "bracket $[M_{left}, M_{right}]$", "white"),
        (4.5, 8.2, "$M = (M_{left} + M_{right})/2$", "white"),
        (4.5, 6.4, "LP: a control within $M$?", "#dcdcdc"),
        (2.5, 4.5, "yes: $M_{right} = M$", "white"),
        (6.5, 4.5, "no: $M_{left} = M$", "white"),
        (4.5, 2.7, "bracket narrow enough?", "#dcdcdc"),
        (4.5, 0.9, "last $T_{obs}$?", "#dcdcdc"),
        (9.7, 0.9, "least $M(T_{obs})$ of all", "white"),
        (9.7, 6.4, "next $T_{obs}$", "white"),
    ):
        box: Any = {"boxstyle": "round,pad=0,rounding_size=0.2", "facecolor": shade, "edgecolor": BLACK, "zorder": 2}
        ax.add_patch(FancyBboxPatch((x - WIDE, y - HIGH), 2 * WIDE, 2 * HIGH, **box))
        ax.text(x, y, words, ha="center", va="center", fontsize="small", zorder=3)
    for line, word in (
        ([(4.5, 11.4), (4.5, 9.8 + HIGH)], ""),
        ([(4.5, 9.8), (4.5, 8.2 + HIGH)], ""),
        ([(4.5, 8.2), (4.5, 6.4 + HIGH)], ""),
        ([(4.1, 6.4), (2.7, 4.5 + HIGH)], ""),
        ([(4.9, 6.4), (6.3, 4.5 + HIGH)], ""),
        ([(2.5, 4.5), (3.8, 2.7 + HIGH)], ""),
        ([(6.5, 4.5), (5.2, 2.7 + HIGH)], ""),
        ([(4.5 - WIDE, 2.7), (0.3, 2.7), (0.3, 8.2), (4.5 - WIDE, 8.2)], "no"),
        ([(4.5, 2.7 - HIGH), (4.5, 0.9 + HIGH)], "yes"),
        ([(4.5 + WIDE, 0.9), (9.7 - WIDE, 0.9)], "yes"),
        ([(4.5 + WIDE, 1.35), (9.7, 2.4), (9.7, 6.4 - HIGH)], "no"),
        ([(9.7, 6.4), (9.7, 9.8), (4.5 + WIDE, 9.8)], ""),
    ):
        ax.plot(*np.transpose(line), color=BLACK, linestyle="-", linewidth=1.2, zorder=1)
        head: Any = {"arrowstyle": "-|>", "color": BLACK, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", line[-1], line[-2], arrowprops=head, zorder=1)
        if word:
            (x, y), upright = np.mean(line[:2], axis=0), line[0][0] == line[1][0]
            place: Any = {"ha": "left", "va": "center"} if upright else {"ha": "center", "va": "bottom"}
            ax.text(x + 0.12 * upright, y + 0.2 * (not upright), word, fontsize="small", **place)
    return ax


def circle_approximation(polygon: Polygon, ax: Axes | None = None) -> Axes:
    """One quadrant of the circle and its polygon for M = 1 (figure 3)."""
    ax = axes_of(ax)
    angle = np.linspace(0, np.pi / 2, 200)
    ax.plot(np.cos(angle), np.sin(angle), color=ORANGE, linestyle="--", label="circle")
    corners = polygon.vertices[: polygon.segments + 1]
    ax.plot(*corners.T, color=BLUE, marker="o", markersize=4, linestyle="-", label=f"n = {polygon.segments}")
    ax.set(aspect="equal", xlabel="$u_x/M$", ylabel="$u_y/M$", title=f"Circle approximation, n = {polygon.segments}")
    ax.legend(loc="lower left")
    return ax


def circle_error(segments: ArrayLike = range(1, 11), ax: Axes | None = None) -> Axes:
    """Largest error 1 - cos(pi/(4n)) in percent over n (figure 11)."""
    ax = axes_of(ax)
    n = np.asarray(segments)
    ax.semilogy(n, [100 * Polygon(segments=int(k)).error for k in n], color=BLUE, marker="o", linestyle="-")
    ax.set(xlabel="segments per quadrant n", ylabel="largest error [%]", title="Circle error")
    ax.set_xticks(n)
    return ax
