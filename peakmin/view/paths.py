"""Ways in the plane: that of the centre of mass past its obstacles, and an arm's poses over theirs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from shapely import LineString

from ..geometry.norm import norm
from ..plan.arm_plan import ArmPlan
from ..plan.plan import Plan
from ..robots.kinematics import Chain
from ..spec.arm import ArmManeuver
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..types import Array
from .scenery import arrows_at, ends, look_through, polygons, surroundings, window
from .style import BELOW, BLACK, BLUE, MARK, ORANGE, Look, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes

ARROWS = 24
POSES = 9  # drawn between start and goal
TRACK: Look = {"color": BLUE, "linestyle": "-", "linewidth": 1.8, "zorder": 4}


def path(plan: Plan, ax: Axes | None = None, arrows: int = ARROWS) -> Axes:
    """The path of the centre of mass past its obstacles (the paper's figure 8).

    Args:
        arrows: how many times to draw the acceleration at, as far apart along the path; 0 for none.
    """
    return _path(axes_of(ax), plan, plan.maneuver, plan.walls, arrows)


def arm_path(plan: ArmPlan, ax: Axes | None = None, arrows: int = ARROWS) -> Axes:
    """The path of an arm's centre of mass with the walls that the obstacles make of it, and what it can reach.

    Args:
        arrows: how many times to draw the acceleration at; 0 for none.
    """
    ax = _path(axes_of(ax), plan, plan.crossing, (), arrows, "obstacle, as a wall")
    if plan.joints is not None and plan.joints.chain.links == 2:
        _reach(ax, plan.joints.chain.base, plan.joints.chain.reach)
    return ax


def _path(ax: Axes, plan: Plan, maneuver: Maneuver, walls: Sequence[Wall], count: int, name: str = "wall") -> Axes:
    track, duration = np.array([maneuver.start.position, maneuver.goal.position]), maneuver.duration
    if plan.trajectory is not None:
        track = np.vstack([track, plan.position(np.linspace(0, duration, 600))])
    corners = window(maneuver, walls, track)
    size = float(np.max(corners[1] - corners[0]))
    surroundings(ax, maneuver, 2 * size, walls, name)
    if plan.trajectory is not None:
        ax.plot(*track[2:].T, label="path of the centre of mass", **TRACK)
        if count:
            t = _evenly(plan, track[2:], count)
            arrows_at(ax, plan.position(t), plan.acceleration(t), size, "acceleration")
        if len(plan.obstacle_times):
            ax.plot(*plan.position(plan.obstacle_times).T, markersize=5, label="crossing", **MARK)
    ends(ax, maneuver)
    look_through(ax, corners)
    return ax


def _evenly(plan: Plan, track: Array, count: int) -> Array:
    """Instants [s] that are equally far apart along the way, whose places at equal times are (m, 2)."""
    t, way = np.linspace(0, plan.maneuver.duration, len(track)), norm(np.diff(track, axis=0))
    way = np.concatenate([[0.0], np.cumsum(way + np.mean(way) / len(track))])
    if way[-1] == 0:
        way = t
    return np.asarray(np.interp((np.arange(count) + 0.5) / count * way[-1], way, t))


def _reach(ax: Axes, base: Array, radii: tuple[float, float]) -> None:
    """The inner and the outer edge of what the centre of mass can reach, where they are in the picture."""
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    turn = np.linspace(0, 2 * np.pi, 721)
    for name, dashes, radius in zip(("inner", "outer"), (":", "-."), radii, strict=True):
        edge = base + radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        if np.any(np.all((edge > low) & (edge < high), axis=-1)):
            ax.plot(*edge.T, color=BLACK, linewidth=0.9, linestyle=dashes, label=f"{name} reach")
            ax.legend(ncols=3, **BELOW)


def poses(plan: ArmPlan, ax: Axes | None = None, count: int = POSES) -> Axes:
    """The arm at equal intervals over its obstacles, the paths of tip and centre of mass (the paper's figure 9).

    Without a motion its start and a goal.
    """
    ax = axes_of(ax)
    polygons(ax, plan.maneuver.obstacles, plan.maneuver.margin, "obstacle")
    chain, joints = plan.scene.workspace.chain, plan.joints
    if joints is not None:
        _stages(ax, chain, chain.joints(joints.absolute(np.linspace(0, joints.duration, count))))
        fine = np.linspace(0, joints.duration, 400)
        ax.plot(*plan.tip(fine).T, color=ORANGE, linestyle="--", linewidth=1.5, label="tip", zorder=4)
        ax.plot(*plan.position(fine).T, label="centre of mass", **TRACK)
        for k, contact in enumerate(plan.contacts):
            ax.plot(*contact.at, markersize=5, label=None if k else "contact", **MARK)
    elif ends := next(iter(plan.scene.passages.values()), None):
        _stages(ax, chain, chain.joints(np.array(ends.theta)))
    around_base(ax, plan.maneuver)
    return ax


def _stages(ax: Axes, chain: Chain, stages: Array) -> None:
    """The arm at its joints' places (m, n+1, 2), the later the darker."""
    last = len(stages) - 1
    for k, points in enumerate(stages):
        shade = str(0.75 - 0.75 * k / last)
        links(ax, points, chain.half_width, shade)
        style: Look = {"color": shade, "linestyle": "-", "marker": "o", "markersize": 3, "linewidth": 1.6}
        ax.plot(*points.T, label={0: "start", last: "goal"}.get(k), zorder=3, **style)


def around_base(ax: Axes, maneuver: ArmManeuver) -> None:
    """An arm's base, units and legend."""
    ax.plot(*maneuver.arm.base, marker="^", color=BLACK, markersize=9, linestyle="none", label="base", zorder=6)
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend(ncols=3, **BELOW)


def links(ax: Axes, points: Array, half_width: Array, shade: str) -> None:
    """The links' matter: all that is within their half-widths [m] of the lines between the joints (n+1, 2)."""
    edge: Look = {"edgecolor": shade, "linestyle": "-", "linewidth": 0.6}
    inside: Look = {"facecolor": (*[float(shade)] * 3, 0.08), "zorder": 2.5}
    for one, other, width in zip(points, points[1:], half_width, strict=False):
        if width:
            ax.fill(*capsule(one, other, width).T, **edge, **inside)


def capsule(one: Array, other: Array, width: float) -> Array:
    """The edge of all that is within `width` of the line from one point to the other, shape (m, 2)."""
    return np.array(LineString([one, other]).buffer(width).exterior.coords)
