"""Pictures of the question and of the method, before anything is solved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..spec.arm import ArmManeuver, postures
from ..spec.control_set import Polygon
from ..spec.maneuver import Maneuver
from . import pyplot as plt
from .paths import around_base, links
from .scenery import arrows_at, ends, look_through, polygons, surroundings, window
from .style import BLACK, BLUE, ORANGE, Look, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes

WIDE, HIGH = 1.9, 0.45  # half the sides of the flowchart's boxes
BOXES = {  # their middles
    "first $T_{obs}$": (4.5, 11.4),
    "bracket $[M_{left}, M_{right}]$": (4.5, 9.8),
    "$M = (M_{left} + M_{right})/2$": (4.5, 8.2),
    "LP: a control within $M$?": (4.5, 6.4),
    "yes: $M_{right} = M$": (2.5, 4.5),
    "no: $M_{left} = M$": (6.5, 4.5),
    "bracket narrow enough?": (4.5, 2.7),
    "last $T_{obs}$?": (4.5, 0.9),
    "least $M(T_{obs})$ of all": (9.7, 0.9),
    "next $T_{obs}$": (9.7, 6.4),
}
WAYS = (  # from box to box, with a word at the first stretch
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
    ([(5.8, 0.9 + HIGH), (5.8, 1.9), (9.7, 1.9), (9.7, 6.4 - HIGH)], "no"),
    ([(9.7, 6.4), (9.7, 9.8), (4.5 + WIDE, 9.8)], ""),
)


def problem(maneuver: Maneuver, ax: Axes | None = None) -> Axes:
    """What is asked: start and goal with their velocities, the straight way, and what stands in it (figure 1)."""
    ax = axes_of(ax)
    line = np.array([maneuver.start.position, maneuver.goal.position])
    corners = window(maneuver, (), np.vstack([line, *(wall.tip for wall in maneuver.walls)]))
    size = float(np.max(corners[1] - corners[0]))
    surroundings(ax, maneuver, 2 * size)
    ax.plot(*line.T, color=BLUE, linestyle="--", linewidth=1.2, label="straight way", zorder=2)
    speeds = np.array([maneuver.start.velocity, maneuver.goal.velocity])
    if np.any(speeds):
        arrows_at(ax, line, speeds, size, "velocity")
    ends(ax, maneuver)
    note: Look = {"textcoords": "offset points", "ha": "center", "fontsize": "small", "zorder": 7}
    for place, speed, when in zip(line, speeds, ("0", f"{maneuver.duration:g} s"), strict=True):
        ax.annotate(f"t = {when}", place, xytext=(0, -17 if speed[1] > 0 else 9), **note)
    for i, wall in enumerate(maneuver.walls, 1):
        name = "$T_{obs}$" if len(maneuver.walls) == 1 else f"$T_{i}$"
        up = wall.direction[1] <= 0
        drop: Look = {"xytext": (0, 7 if up else -7), "va": "bottom" if up else "top"}
        ax.annotate(f"{name} at ({wall.tip[0]:g}, {wall.tip[1]:g}) m", wall.tip, **drop, **note)
    look_through(ax, corners)
    return ax


def arm_problem(maneuver: ArmManeuver, ax: Axes | None = None) -> Axes:
    """What is asked: the arm at start and goal, every configuration that they allow, its obstacles (figure 4)."""
    ax, chain = axes_of(ax), maneuver.arm.chain
    polygons(ax, maneuver.obstacles, maneuver.margin, "obstacle")
    for name, pose, shade, dashes, mark in (
        ("start", maneuver.start, "0.55", "--", "+"),
        ("goal", maneuver.goal, "0", "-", "x"),
    ):
        arm: Look = {"color": shade, "linestyle": dashes, "marker": "o", "markersize": 4, "linewidth": 1.8}
        centre: Look = {"color": BLUE, "linestyle": "none", "marker": mark, "markersize": 9, "markeredgewidth": 2}
        for k, theta in enumerate(np.array(postures(maneuver.arm, pose))):
            points = chain.joints(theta)
            links(ax, points, chain.half_width, shade)
            ax.plot(*points.T, label=None if k else f"arm at the {name}", zorder=4, **arm)
            ax.plot(*chain.centre(theta), label=None if k else f"centre of mass at the {name}", zorder=6, **centre)
    around_base(ax, maneuver)
    return ax


def flowchart(ax: Axes | None = None) -> Axes:
    """The two loops: bisection on M inside, obstacle times outside (figure 2)."""
    ax = axes_of(ax)
    ax.set(xlim=(0.1, 11.8), ylim=(0.2, 12))
    ax.set_axis_off()
    for words, (x, y) in BOXES.items():
        shade = "#dcdcdc" if words.endswith("?") else "white"
        box: Look = {"boxstyle": "round,pad=0,rounding_size=0.2", "facecolor": shade, "edgecolor": BLACK, "zorder": 2}
        ax.add_patch(plt.FancyBboxPatch((x - WIDE, y - HIGH), 2 * WIDE, 2 * HIGH, **box))
        ax.text(x, y, words, ha="center", va="center", fontsize="small", zorder=3)
    head: Look = {"arrowstyle": "-|>", "color": BLACK, "shrinkA": 0, "shrinkB": 0}
    for line, word in WAYS:
        ax.plot(*np.transpose(line), color=BLACK, linestyle="-", linewidth=1.2, zorder=1)
        ax.annotate("", line[-1], line[-2], arrowprops=head, zorder=1)
        (x, y), upright = np.mean(line[:2], axis=0), line[0][0] == line[1][0]
        place: Look = {"ha": "left", "va": "center"} if upright else {"ha": "center", "va": "bottom"}
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
