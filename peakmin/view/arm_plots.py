"""Pictures of an arm's plan: M over T_obs, control and path, poses, joint angles, and the arm in motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from ..types import Array
from .scenery import blocks
from .style import BELOW, BLACK, BLUE, FRAMES, GREEN, ORANGE, PINK, RED, STYLE, WALL, axes_of, gif, peak_and_bound

if TYPE_CHECKING:
    from ..plan.arm_plan import ArmPlan
    from ..spec.arm import ArmManeuver

POSES = 9  # drawn between start and goal
COLORS = (BLUE, ORANGE, GREEN, PINK, BLACK)
DASHES = ("-", "--", "-.", ":", (0, (5, 1)))


def task(maneuver: ArmManeuver, ax: Axes | None = None) -> Axes:
    """What is asked: the arm at start and goal, every configuration that they allow, its obstacles (figure 4)."""
    from ..spec.arm import postures

    ax, chain = axes_of(ax), maneuver.arm.chain
    blocks(ax, maneuver.obstacles, maneuver.margin, "obstacle")
    for name, pose, shade, dashes in (("start", maneuver.start, "0.55", "--"), ("goal", maneuver.goal, "0", "-")):
        for k, theta in enumerate(postures(maneuver.arm, pose)):
            points = chain.joints(np.array(theta))
            _links(ax, points, chain.half_width, shade)
            style: Any = {"color": shade, "linestyle": dashes, "marker": "o", "markersize": 4, "linewidth": 1.8}
            ax.plot(*points.T, label=None if k else f"arm at the {name}", zorder=4, **style)
            mark: Any = {"color": BLUE, "marker": "+x"[name == "goal"], "markersize": 9, "markeredgewidth": 2}
            centre = None if k else f"centre of mass at the {name}"
            ax.plot(*chain.centre(np.array(theta)), linestyle="none", label=centre, zorder=6, **mark)
    _frame(ax, maneuver)
    return ax


def poses(plan: ArmPlan, ax: Axes | None = None, count: int = POSES) -> Axes:
    """The arm at equal intervals over its obstacles, the paths of tip and centre of mass (the paper's figure 9)."""
    ax = axes_of(ax)
    blocks(ax, plan.maneuver.obstacles, plan.maneuver.margin, "obstacle")
    if plan.joints is not None:
        path, chain = plan.joints, plan.joints.chain
        t = np.linspace(0, path.duration, count)
        for k, points in enumerate(chain.joints(path.absolute(t))):
            shade = str(0.75 - 0.75 * k / (count - 1))
            _links(ax, points, chain.half_width, shade)
            style: Any = {"color": shade, "linestyle": "-", "marker": "o", "markersize": 3, "linewidth": 1.6}
            ax.plot(*points.T, label={0: "start", count - 1: "goal"}.get(k), zorder=3, **style)
        fine = np.linspace(0, path.duration, 400)
        ax.plot(*plan.tip(fine).T, color=ORANGE, linestyle="--", linewidth=1.5, label="tip", zorder=4)
        ax.plot(*plan.position(fine).T, color=BLUE, linestyle="-", linewidth=1.8, label="centre of mass", zorder=4)
        mark: Any = {"linestyle": "none", "marker": "D", "markersize": 5, "color": ORANGE, "markeredgecolor": BLACK}
        for k, contact in enumerate(plan.contacts):
            ax.plot(*contact.at, label=None if k else "contact", zorder=6, **mark)
    _frame(ax, plan.maneuver)
    return ax


def _links(ax: Axes, points: Array, half_width: Array, shade: str) -> None:
    """The links' matter: all that is within their half-widths [m] of the lines between the joints (n+1, 2)."""
    for one, other, width in zip(points, points[1:], half_width, strict=False):
        if width:
            edge: Any = {"edgecolor": shade, "facecolor": (*[float(shade)] * 3, 0.08), "linewidth": 0.6}
            ax.add_patch(PathPatch(_capsule(one, other, width), zorder=2.5, **edge))


def _capsule(one: Array, other: Array, width: float) -> Path:
    """The edge of all that is within `width` of the line from one point to the other."""
    heading = np.arctan2(*(other - one)[::-1])
    turn = np.linspace(-np.pi / 2, np.pi / 2, 19)
    round_end = width * np.stack([np.cos(heading + turn), np.sin(heading + turn)], axis=-1)
    return Path(np.vstack([other + round_end, one - round_end, other + round_end[:1]]), closed=True)


def _frame(ax: Axes, maneuver: ArmManeuver) -> None:
    ax.plot(*maneuver.arm.base, marker="^", color=BLACK, markersize=9, linestyle="none", label="base", zorder=6)
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend(ncols=3, **BELOW)


def joint_angles(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """Joint angles over time (the paper's figure 10)."""
    ax = axes_of(ax)
    t = np.linspace(0, plan.maneuver.duration, 600)
    for k, column in enumerate(plan.angles(t).T):
        ax.plot(t, column, color=COLORS[k % 5], linestyle=DASHES[k % 5], label=f"joint {k + 1}")
    for at in plan.elbow_changes:
        ax.axvline(at, color="#999999", linewidth=0.8, linestyle=":", label="elbow turns over")
    ax.set(xlabel="t [s]", ylabel="joint angle [rad]")
    ax.legend()
    return ax


def path(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """The centre of mass's path with the walls that the obstacles make of it, and what it can reach."""
    ax = axes_of(ax)
    t = np.linspace(0, plan.maneuver.duration, 600)
    ax.plot(*plan.position(t).T, color=BLUE, linestyle="-", linewidth=1.8, label="path of the centre of mass", zorder=4)
    size = float(np.max(np.ptp(plan.position(t), axis=0)))
    for i, (tip, along) in enumerate(ray for wall in plan.crossing.walls for ray in wall.rays):
        ends = np.array([tip, tip + 0.5 * size * along])
        ax.plot(*ends.T, label=None if i else "obstacle, as a wall", **WALL)
    at = np.array(plan.obstacle_times)
    if len(at):
        ax.plot(
            *plan.position(at).T, "D", color=ORANGE, markeredgecolor=BLACK, markersize=5, label="crossing", zorder=6
        )
    (left, right), (down, up) = ax.get_xlim(), ax.get_ylim()
    low, high = np.array([left, down]), np.array([right, up])
    if plan.joints is not None and plan.joints.chain.links == 2:
        turn = np.linspace(0, 2 * np.pi, 721)
        for i, radius in enumerate(plan.joints.chain.reach):
            edge = plan.joints.chain.base + radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
            inside = (edge > low) & (edge < high)
            if np.any(inside[:, 0] & inside[:, 1]):
                ax.plot(*edge.T, color=BLACK, linewidth=0.9, linestyle="-.", label=f"{('inner', 'outer')[i]} reach")
    ax.set(xlabel="x [m]", ylabel="y [m]", xlim=(left, right), ylim=(down, up))
    ax.set_aspect("equal")
    ax.legend(ncols=2, **BELOW)
    return ax


def peak_over_time(plan: ArmPlan, ax: Axes | None = None, count: int = 60) -> Axes:
    """The least M over the time of the plan's contact (the paper's figure 7); for one contact."""
    from ..proofs.double_integrator import PointMass
    from ..proofs.extremal import extremal

    ax = axes_of(ax)
    mass = PointMass.of(plan.crossing)
    if mass.walls != 1:
        raise ValueError("peak_over_time draws plans with one contact")
    at = np.unique(np.append(np.linspace(0.1, 0.95, count), plan.obstacle_times / mass.time))
    least = np.array([extremal(mass, np.array([x])).upper for x in at]) * mass.unit
    ax.plot(at * mass.time, least, color=BLUE, linestyle="-", label="least M at this time")
    ax.plot(
        plan.obstacle_times, plan.peak, "D", color=ORANGE, markeredgecolor=BLACK, label=f"plan: {plan.peak:.6g} m/s²"
    )
    bound = f"lower bound of all motions: {plan.lower_bound:.6g} m/s²"
    ax.axhline(plan.lower_bound, color=BLACK, linestyle=":", label=bound)
    ax.set(xlabel="$T_{obs}$ [s]", ylabel="least M [m/s²]", ylim=(0, min(float(np.max(least)), 6 * plan.peak)))
    ax.legend(**BELOW)
    return ax


def base_force(plan: ArmPlan, ax: Axes | None = None) -> Axes:
    """The base force's size and components over time, with its peak and the lower bound."""
    ax = axes_of(ax)
    t = np.linspace(0, plan.maneuver.duration, 1201)
    force = plan.base_force(t)
    peak_and_bound(ax, plan.peak_force, plan.crossing.mass * plan.lower_bound, "N")
    for axis in (0, 1):
        ax.plot(t, force[:, axis], color=COLORS[axis], linestyle=DASHES[axis], label=f"$F_{'xy'[axis]}$")
    ax.plot(t, np.hypot(*force.T), color=BLACK, linestyle="-", label="|F|", zorder=3)
    ax.set(xlabel="t [s]", ylabel="base force [N]", ylim=(-1.15 * plan.peak_force or -1, 1.25 * plan.peak_force or 1))
    ax.legend(ncols=3, **BELOW)
    return ax


def overview(plan: ArmPlan) -> Figure:
    """Poses, path, joint angles and control on one figure."""
    from .plots import control_size

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(12, 10))
        poses(plan, ax=axes[0, 0])
        if plan.joints is not None:
            path(plan, ax=axes[0, 1])
            joint_angles(plan, ax=axes[1, 0])
            control_size(plan, ax=axes[1, 1])  # type: ignore[arg-type]
    return figure


def figures(plan: ArmPlan) -> dict[str, Figure]:
    """The figures of an arm's plan by name: all at once, and each by itself as the paper has them."""
    out = {"plan": overview(plan)}
    if plan.joints is None:
        return out
    drawn: dict[str, Any] = {"poses": poses, "joint_angles": joint_angles, "path": path, "base_force": base_force}
    if len(plan.crossing.walls) == 1 and not plan.elbow_changes:
        drawn["peak_over_time"] = peak_over_time
    for name, draw in drawn.items():
        with plt.rc_context(STYLE):
            figure, ax = plt.subplots(figsize=(7, 6) if name in ("poses", "path") else (7, 4.5))
            draw(plan, ax=ax)
        out[name] = figure
    return out


def animate(plan: ArmPlan, frames: int = FRAMES) -> bytes:
    """The arm in motion beside its base force: a GIF. Raises `ValueError` where the plan has no motion."""
    if plan.joints is None:
        raise ValueError(f"this plan is {plan.status}: it has no trajectory")
    joints, chain = plan.joints, plan.joints.chain
    t = np.linspace(0, joints.duration, frames)
    points: Array = chain.joints(joints.absolute(t))
    forces, place = plan.base_force(np.minimum(t, joints.duration * (1 - 1e-9))), plan.position(t)
    size = float(np.max(np.ptp(points.reshape(-1, 2), axis=0)))
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6), width_ratios=(1.15, 1), dpi=70)
        blocks(left, plan.maneuver.obstacles, plan.maneuver.margin, "obstacle")
        left.plot(*plan.tip(t).T, color=ORANGE, linestyle="--", linewidth=1.0, label="tip")
        left.plot(*place.T, color=BLUE, linestyle="-", linewidth=1.2, label="centre of mass")
        shown = np.vstack([points.reshape(-1, 2), *(block.vertices for block in plan.maneuver.obstacles)])
        shown = np.clip(shown, points.min(axis=(0, 1)) - 0.3 * size, points.max(axis=(0, 1)) + 0.3 * size)
        low, high = shown.min(axis=0) - 0.08 * size, shown.max(axis=0) + 0.08 * size
        left.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
        left.set_aspect("equal", anchor="S")
        left.set_title("arm, and the force of the base on it (arrow)", fontsize="medium")
        left.legend(ncols=3, **BELOW)
        base_force(plan, ax=right)
    nowhere: Any = np.zeros((3, 2))
    widths = [PathPatch(Path(nowhere), facecolor="#00000030", edgecolor=BLACK, zorder=4) for _ in range(chain.links)]
    for patch in widths:
        left.add_patch(patch)
    (arm,) = left.plot([], [], color=BLACK, linestyle="-", marker="o", linewidth=2.5, zorder=5)
    (mass,) = left.plot([], [], color=BLUE, linestyle="none", marker="o", markersize=7, zorder=6)
    scale: Any = {"angles": "xy", "scale_units": "xy", "scale": 4 * plan.peak_force / size}
    arrow = left.quiver(*chain.base, 0, 0, color=RED, zorder=7, **scale)
    (dot,) = right.plot([], [], color=RED, marker="o", linestyle="none", markersize=7, zorder=7)

    def draw(k: int) -> None:
        arm.set_data(*points[k].T)
        for patch, one, other, width in zip(widths, points[k], points[k][1:], chain.half_width, strict=False):
            patch.set_path(_capsule(one, other, width))
        mass.set_data(*place[k][:, None])
        arrow.set_UVC(*forces[k])
        dot.set_data([t[k]], [np.hypot(*forces[k])])

    return gif(figure, [*(widths if np.any(chain.half_width) else []), arm, mass, arrow, dot], draw, frames)
