"""Pictures in one style: readable in grey and by the colour-blind, units on every axis.

Every function takes `ax=` and returns the axes it drew on. The paper's figures 1 to 11 are, in order, `problem`,
`flowchart`, `circle_approximation`, `task`, `control`, `over_segments` with `control_differences`, `peak_over_time`,
`control` with `path`, `poses`, `joint_angles` and `circle_error`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ..geometry.trajectory import HoldTrajectory
from ..plan.plan import Plan
from ..types import Array
from .arm_plots import base_force, joint_angles, poses, task
from .scenery import ends, obstacles, show, view
from .sketches import circle_approximation, circle_error, flowchart, problem
from .style import BELOW, BLACK, BLUE, FRAMES, GREEN, ORANGE, PINK, RED, STYLE, WALL, axes_of, gif, peak_and_bound

if TYPE_CHECKING:
    from ..plan.arm_plan import ArmPlan
    from ..queries.budget import ErrorBudget
    from ..search.sweep import Sweep

__all__ = [
    "BLACK",
    "BLUE",
    "ORANGE",
    "STYLE",
    "WALL",
    "animate",
    "base_force",
    "budget",
    "circle_approximation",
    "circle_error",
    "control",
    "control_differences",
    "control_size",
    "flowchart",
    "joint_angles",
    "over_segments",
    "overview",
    "path",
    "peak_over_time",
    "poses",
    "problem",
    "task",
]


def control(plan: Plan, axis: int = 0, ax: Axes | None = None, label: str | None = None, dashes: str = "-") -> Axes:
    """One component of the acceleration over time (the paper's figures 5 and 8); axis 0 is x, 1 is y."""
    ax = axes_of(ax)
    _over_time(ax, plan, lambda u: u[..., axis], label, dashes)
    for at in plan.obstacle_times:
        ax.axvline(at, color="#999999", linewidth=0.8, linestyle=":")
    ax.set(xlabel="t [s]", ylabel=f"$u_{'xy'[axis]}$ [m/s²]")
    return ax


def _over_time(ax: Axes, plan: Plan, of: Callable[[Array], Array], label: str | None, dashes: str = "-") -> None:
    """Something of the acceleration: steps for holds, a line for a continuous control."""
    t, color = plan.times, ax._get_lines.get_next_color()  # type: ignore[attr-defined]
    drawn: Any = {"label": label, "color": color, "linestyle": dashes, "linewidth": 1.4, "zorder": 3}
    if isinstance(plan.trajectory, HoldTrajectory):
        ax.stairs(of(plan.acceleration(t[:-1])), t, baseline=None, **drawn)
    else:
        t = np.linspace(0, plan.maneuver.duration, 1001)
        ax.plot(t, of(plan.acceleration(t)), **drawn)


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
    peak_and_bound(ax, plan.peak, plan.lower_bound, "m/s²")
    for axis, dashes in ((0, "-"), (1, "--")):
        _over_time(ax, plan, lambda u, i=axis: u[..., i], f"$u_{'xy'[axis]}$", dashes)  # type: ignore[misc]
    _over_time(ax, plan, lambda u: np.hypot(u[..., 0], u[..., 1]), "|u(t)|")
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
    low, high = view(maneuver, plan.walls, track)
    size = float(np.max(high - low))
    obstacles(ax, maneuver, 2 * size, plan.walls)
    if plan.trajectory is not None:
        ax.plot(*track[2:].T, color=BLUE, linestyle="-", linewidth=1.8, label="path of the centre of mass", zorder=4)
        if arrows:
            t = (np.arange(arrows) + 0.5) / arrows * maneuver.duration
            u = plan.acceleration(t)
            ax.quiver(*plan.position(t).T, *u.T, label="acceleration", **_arrow(float(np.max(np.hypot(*u.T))), size))
        if len(plan.obstacle_times):
            mark: Any = {"linestyle": "none", "marker": "D", "markersize": 5, "color": ORANGE, "zorder": 6}
            ax.plot(*plan.position(plan.obstacle_times).T, markeredgecolor=BLACK, label="crossing", **mark)
    ends(ax, maneuver)
    show(ax, (low, high))
    return ax


def _arrow(longest: float, size: float) -> dict[str, Any]:
    """How accelerations are drawn in a picture of this size [m], the longest of them an eighth of it."""
    scale: Any = {"angles": "xy", "scale_units": "xy", "scale": (longest or 1) / (0.12 * size)}
    shape: Any = {"units": "inches", "width": 0.022, "headwidth": 4, "headlength": 5, "headaxislength": 4.5}
    return {"color": RED, "zorder": 5, "minshaft": 2, **scale, **shape}


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
    bound = sweep.best.lower_bound
    ax.axhline(bound, color=BLACK, linestyle=":", label=f"lower bound at the winner, any control: {bound:.4f} m/s²")
    if peak > 0 and np.max(sweep.peak[known]) > 20 * peak:
        ax.set_yscale("log")
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]")
    ax.legend(**BELOW)
    return ax


def over_segments(
    n: Sequence[int], values: ArrayLike, ylabel: str, ax: Axes | None = None, limit: float | None = None
) -> Axes:
    """Something over the segments per quadrant (the panels of the paper's figure 6).

    Args:
        limit: the least peak with the disc; then the band is drawn in which that with the polygon must lie.
    """
    ax = axes_of(ax)
    if limit is not None:
        fine = np.linspace(min(n), max(n), 200)
        most = limit / np.cos(np.pi / (4 * fine))
        ax.fill_between(fine, limit, most, color="#e4e4e4", label="disc to disc/cos(π/4n)")
        ax.axhline(limit, color=ORANGE, linestyle="--", label=f"disc: {limit:.4f} m/s²")
    ax.plot(n, np.asarray(values), color=BLUE, marker="o", linestyle="-", label=None if limit is None else "polygon")
    if limit is not None:
        ax.legend()
    ax.set(xlabel="segments per quadrant n", ylabel=ylabel)
    ax.set_xticks(list(n))
    return ax


def control_differences(n: Sequence[int], differences: Array, ax: Axes | None = None) -> Axes:
    """Squared difference of the controls for n and n - 1, shape (len(n), 2) (the paper's figure 6)."""
    ax = axes_of(ax)
    for axis, mark, dashes in ((0, "o", "-"), (1, "s", "--")):
        ax.semilogy(n, differences[:, axis], marker=mark, linestyle=dashes, label=f"$\\Delta u_{'xy'[axis]}$")
    ax.set(xlabel="segments per quadrant n", ylabel="squared difference to n-1 [m²/s⁴]", xticks=list(n))
    ax.legend()
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


def animate(plan: Plan | ArmPlan, frames: int = FRAMES) -> bytes:
    """A plan in motion, as a GIF: the centre of mass with its control arrow, or the arm with its base force.

    Raises:
        ValueError: where the plan has no motion.
    """
    if not isinstance(plan, Plan):
        from .arm_plots import animate as animate_arm

        return animate_arm(plan, frames)
    if plan.trajectory is None:
        raise ValueError(f"this plan is {plan.status}: it has no trajectory")
    t = np.linspace(0, plan.maneuver.duration, frames)
    place, u = plan.position(t), plan.acceleration(np.minimum(t, plan.maneuver.duration * (1 - 1e-9)))
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6), dpi=70)
        path(plan, ax=left, arrows=0)
        control_size(plan, ax=right)
    size = max(np.ptp(left.get_xlim()), np.ptp(left.get_ylim()))
    (mass,) = left.plot([], [], color=BLACK, marker="o", markersize=9, linestyle="none", zorder=7)
    arrow = left.quiver(*place[0], *u[0], **_arrow(0.6 * plan.peak, size))
    (now,) = right.plot([], [], color=RED, marker="o", markersize=7, linestyle="none", zorder=7)

    def draw(k: int) -> None:
        mass.set_data(*place[k][:, None])
        arrow.set_offsets(place[k])
        arrow.set_UVC(*u[k])
        now.set_data([t[k]], [np.hypot(*u[k])])

    return gif(figure, [mass, arrow, now], draw, frames)
