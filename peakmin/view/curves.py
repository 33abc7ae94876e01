"""What goes over time or over a number: controls, forces, joint angles, M over T_obs, and the parts of an error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.trajectory import HoldTrajectory
from ..plan.arm_plan import ArmPlan
from ..plan.plan import Plan
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal
from ..queries.budget import ErrorBudget
from ..search.sweep import Sweep
from ..types import Array
from .style import BELOW, BLACK, BLUE, COLORS, DASHES, GREEN, INSTANT, MARK, ORANGE, PINK, RED, Look, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes

PEAK: Look = {"color": "#c8c8c8", "linewidth": 7, "linestyle": "-", "zorder": 1.5}
LEAST: Look = {"color": BLACK, "linestyle": ":"}
BOUND: Look = {
    "linestyle": "none",
    "color": ORANGE,
    "markeredgecolor": BLACK,
    "markeredgewidth": 0.5,
    "marker": 6,  # a triangle below the point, which it touches
    "markersize": 7,
}
LIMIT: Look = {"linestyle": (0, (7, 5)), "linewidth": 0.9}
INSTANTS = 1201  # of a curve


def control(plan: Plan, axis: int = 0, ax: Axes | None = None, label: str | None = None, dashes: str = "-") -> Axes:
    """One component of the acceleration over time (the paper's figures 5 and 8); axis 0 is x, 1 is y."""
    ax = axes_of(ax)
    _over_time(ax, plan, lambda u: u[..., axis], label=label, linestyle=dashes)
    for at in plan.obstacle_times:
        ax.axvline(at, **INSTANT)
    ax.set(xlabel="t [s]", ylabel=f"$u_{'xy'[axis]}$ [m/s²]")
    return ax


def control_size(plan: Plan, ax: Axes | None = None) -> Axes:
    """|u| and its components over time with the peak and the lower bound."""
    return _sizes(axes_of(ax), plan, 1.0, "u", "acceleration", "m/s²")


def base_force(plan: Plan, ax: Axes | None = None) -> Axes:
    """The base force's size and components over time, with its peak and the lower bound."""
    return _sizes(axes_of(ax), plan, plan.crossing.mass, "F", "base force", "N")


def _sizes(ax: Axes, plan: Plan, factor: float, letter: str, name: str, unit: str) -> Axes:
    """Acceleration times a factor.

    The peak is a broad pale band, the bound a row of triangles that point at it from below. They often lie on one
    another and on the size, which is thin and dark: all three can still be seen.
    """
    peak, bound = factor * plan.peak, factor * plan.lower_bound
    ax.set_xmargin(0)  # the triangles stay within the time
    ax.axhline(peak, **PEAK, label=f"peak {peak:.6g} {unit}")
    x = np.linspace(0.02, 0.98, 13)
    places: Look = {"label": f"lower bound {bound:.6g} {unit}", "transform": ax.get_yaxis_transform()}
    ax.plot(x, np.full_like(x, bound), **places, **BOUND)
    for axis in (0, 1):
        of_axis: Look = {"label": f"${letter}_{'xy'[axis]}$", "color": COLORS[axis], "linestyle": DASHES[axis]}
        _over_time(ax, plan, lambda u, i=axis: factor * u[..., i], **of_axis)  # type: ignore[misc]
    size: Look = {"label": f"|{letter}(t)|", "color": BLACK, "linestyle": "-"}
    _over_time(ax, plan, lambda u: factor * np.hypot(u[..., 0], u[..., 1]), **size)
    ax.set(xlabel="t [s]", ylabel=f"{name} [{unit}]", ylim=(-1.15 * peak or -1, 1.15 * peak or 1))
    ax.legend(ncols=3, **BELOW)
    return ax


def _over_time(ax: Axes, plan: Plan, of: Callable[[Array], Array], **look: object) -> None:
    """Something of the acceleration: steps for holds, a line for a continuous control."""
    t, holds = plan.times, isinstance(plan.trajectory, HoldTrajectory)
    if not holds:
        t = np.linspace(0, plan.maneuver.duration, INSTANTS)
    drawn: Look = {"drawstyle": "steps-post" if holds else "default", "linewidth": 1.4, "zorder": 3, **look}
    ax.plot(t, of(plan.acceleration(t)), **drawn)


def joint_angles(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """All joint angles over time (the paper's figure 10), beside their limits."""
    ax = _of_joints(ax, plan, plan.angles, "angle [rad]", [link.limits for link in plan.maneuver.arm.links])
    for k, at in enumerate(plan.elbow_changes):
        ax.axvline(at, label=None if k else "elbow turns over", **INSTANT)
    ax.legend(ncols=2, **BELOW)
    return ax


def joint_speeds(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """All joint speeds over time, beside their limits."""
    most = [_to_either_side(link.max_speed) for link in plan.maneuver.arm.links]
    return _of_joints(ax, plan, plan.joint_velocities, "speed [rad/s]", most)


def joint_accelerations(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """All joint accelerations over time, beside their limits."""
    most = [_to_either_side(link.max_acceleration) for link in plan.maneuver.arm.links]
    return _of_joints(ax, plan, plan.joint_accelerations, "acceleration [rad/s²]", most)


def joint_torques(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """All joint torques over time, beside their limits; the first is the base moment, with the task's own limit."""
    asked, t = plan.maneuver, np.linspace(0, plan.maneuver.duration, INSTANTS)
    limits = [_to_either_side(link.max_torque) for link in asked.arm.links]
    ax = _of_joints(ax, plan, plan.torques, "torque [N m]", limits)
    if asked.max_moment is not None:
        with np.errstate(all="ignore"):
            _limits(ax, _to_either_side(asked.max_moment), plan.torques(t), RED)
        ax.plot([], [], label=f"base moment (joint 1), limit ±{asked.max_moment:.4g}", color=RED, **LIMIT)
        ax.legend(ncols=2, **BELOW)
    return ax


Ends = tuple[float, float] | None


def _to_either_side(most: float | None) -> Ends:
    return None if most is None else (-most, most)


def _of_joints(ax: Axes | None, plan: ArmPlan, of: Callable[[Array], Array], what: str, limits: Sequence[Ends]) -> Axes:
    """Something of every joint over time, and its limits."""
    ax, t = axes_of(ax), np.linspace(0, plan.maneuver.duration, INSTANTS)
    with np.errstate(all="ignore"):  # near singular postures joints have no bounded speeds
        every = of(t)
    for k, (column, ends) in enumerate(zip(every.T, limits, strict=True)):
        look: Look = {"color": COLORS[k % 5], "linestyle": DASHES[k % 5]}
        said = "" if ends is None else f", limits {ends[0]:.4g} to {ends[1]:.4g}"
        said = f", limit ±{ends[1]:.4g}" if ends is not None and ends[0] == -ends[1] else said
        ax.plot(t, column, label=f"joint {k + 1}{said}", **look)
        _limits(ax, ends, every, COLORS[k % 5])
    ax.set(xlabel="t [s]", ylabel=f"joint {what}")
    ax.legend(ncols=2, **BELOW)
    return ax


def _limits(ax: Axes, ends: Ends, curves: Array, color: str) -> None:
    """Dashed lines, where they are no further from all curves than these span: what is further would flatten them."""
    seen = curves[np.isfinite(curves)]
    low, high = np.min(seen, initial=0.0), np.max(seen, initial=0.0)
    for end in ends or ():
        if 2 * low - high <= end <= 2 * high - low:
            ax.axhline(end, color=color, **LIMIT)


def peak_over_time(sweep: Sweep, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Least M over T_obs with the winner (the paper's figure 7).

    Raises:
        ValueError: for a sweep over the times of anything but one wall.
    """
    if sweep.obstacle_times.ndim != 1:
        raise ValueError("peak_over_time draws sweeps over one wall")
    ax = axes_of(ax)
    known = np.isfinite(sweep.peak)
    ax.plot(sweep.obstacle_times[known], sweep.peak[known], color=BLUE, marker="o", markersize=4, label=label)
    if np.any(known):
        at, peak, bound = sweep.obstacle_times[sweep.winner], sweep.peak[sweep.winner], sweep.best.lower_bound
        ax.plot(at, peak, label=f"least: {peak:.4f} m/s² at {at:.4f} s", **MARK)
        ax.axhline(bound, label=f"lower bound at the winner, any control: {bound:.4f} m/s²", **LEAST)
        if peak > 0 and np.max(sweep.peak[known]) > 20 * peak:
            ax.set_yscale("log")
        ax.legend(**BELOW)
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]")
    return ax


def peak_over_contact(plan: ArmPlan, ax: Axes | None = None, count: int = 60) -> Axes:
    """The least M over the time of an arm's contact (the paper's figure 7).

    Raises:
        ValueError: for a plan with anything but one contact.
    """
    ax = axes_of(ax)
    mass = PointMass.of(plan.crossing)
    if mass.walls != 1:
        raise ValueError("peak_over_contact draws plans with one contact")
    at = np.unique(np.append(np.linspace(0.1, 0.95, count), plan.obstacle_times / mass.time))
    least = np.array([extremal(mass, np.array([x])).upper for x in at]) * mass.unit
    ax.plot(at * mass.time, least, color=BLUE, linestyle="-", label="least M at this time")
    ax.plot(plan.obstacle_times, plan.peak, label=f"plan: {plan.peak:.6g} m/s²", **MARK)
    ax.axhline(plan.lower_bound, label=f"lower bound of all motions: {plan.lower_bound:.6g} m/s²", **LEAST)
    highest = min(float(np.max(least)), 6 * plan.peak)
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]", ylim=(0, highest))
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


def error_parts(errors: ErrorBudget, ax: Axes | None = None) -> Axes:
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
