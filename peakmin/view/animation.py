"""A plan in motion: the scene on the left, what the base feels on the right, frame by frame into a GIF."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from ..plan.arm_plan import ArmPlan
from ..plan.plan import Plan
from . import pyplot as plt
from .curves import base_force, control_size
from .paths import TRACK, capsule, path
from .scenery import arrow, look_through, name_arrow, polygons
from .style import BLACK, BLUE, ORANGE, RED, STYLE, Look

if TYPE_CHECKING:
    from .pyplot import Artist, Axes

FEW, MANY = 48, 240  # frames of a GIF, where it lasts long enough and is not too long
SECOND = 12  # frames a second, between those
SHORTEST, LONGEST = 2, 65_535  # that a frame can last [s / 100]: viewers take less for a tenth of a second
SIZE, DPI = (10, 4.6), 70
POINT_ARROW, ARM_ARROW = 0.2, 0.25  # of the picture and of the arm's reach: how long arrows are at the peak
LAST = 1 - 1e-9  # of the duration: the last instant at which a held control still acts
POINT: Look = {"linestyle": "none", "marker": "o", "zorder": 7}
Scene = tuple[Sequence["Artist"], Callable[[int], None]]  # what moves, and what shows its frame k


def frames_of(duration: float) -> int:
    """How many frames a GIF of a motion so long [s] has."""
    return int(max(2, min(max(FEW, SECOND * duration), MANY, 100 * duration // SHORTEST)))


def lasting(duration: float, frames: int) -> list[int]:
    """How long each frame is shown [s / 100]: together as long as the motion [s], as far as a GIF can state it."""
    ends = [round(100 * duration * k / frames) for k in range(frames + 1)]
    return [min(max(end - begin, SHORTEST), LONGEST) for begin, end in zip(ends, ends[1:], strict=False)]


def gif(set_up: Callable[[Axes, Axes], Scene], duration: float, frames: int) -> bytes:
    """A GIF of two panels in real time, with a clock above the first.

    What stands still is drawn once and is the background of all frames: ten times as fast as drawing it in each.

    Args:
        set_up: draws what stands still on them, and gives what moves and how to show its frame k.
        duration: of the motion [s], whose frames are at equal intervals from its start to its end.
    """
    t, digits = np.linspace(0, duration, frames), max(2 - math.floor(math.log10(duration)), 0)
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=SIZE, dpi=DPI)
        moving, show = set_up(*panels)
        clock = panels[0].text(0.5, 1.02, f"t = {duration:.{digits}f} s", ha="center", transform=panels[0].transAxes)
        figure.draw_without_rendering()  # lays all of it out, the clock too
        figure.set_layout_engine("none")
        _show([*moving, clock], False)
        figure.savefig(drawn := io.BytesIO(), format="rgba", dpi=DPI)
        width, height = figure.canvas.get_width_height()
        figure.figimage(np.frombuffer(drawn.getvalue(), np.uint8).reshape(height, width, 4), zorder=-1)
        for ax in panels:
            ax.set_axis_off()
            _show(ax.get_children(), False)
        _show([*moving, clock], True)
        shots = []
        for k in range(frames):
            show(k)
            clock.set_text(f"t = {t[k]:.{digits}f} s")
            figure.savefig(drawn := io.BytesIO(), format="rgba", dpi=DPI)
            shots.append(Image.frombytes("RGBA", (width, height), drawn.getvalue()).convert("RGB"))
        plt.close(figure)
    film, lasts = io.BytesIO(), [10 * one for one in lasting(duration, frames)]  # Pillow counts in milliseconds
    shots[0].save(film, format="GIF", save_all=True, append_images=shots[1:], duration=lasts, loop=0)
    return film.getvalue()


def _show(artists: Iterable[Artist], seen: bool) -> None:
    for artist in artists:
        artist.set_visible(seen)


def point_scene(plan: Plan, frames: int, left: Axes, right: Axes) -> Scene:
    """The centre of mass on its path with its control as an arrow, and the control's size."""
    t = np.linspace(0, plan.maneuver.duration, frames)
    place, u = plan.position(t), plan.acceleration(np.minimum(t, plan.maneuver.duration * LAST))
    name_arrow(left, "acceleration")
    path(plan, ax=left, arrows=0)
    control_size(plan, ax=right)
    size = max(np.ptp(left.get_xlim()), np.ptp(left.get_ylim()))
    (mass,) = left.plot([], [], color=BLACK, markersize=9, **POINT)
    push = left.quiver(*place[0], *u[0], **arrow(plan.peak, POINT_ARROW * size))
    (now,) = right.plot([], [], color=RED, markersize=7, **POINT)

    def show(k: int) -> None:
        mass.set_data(*place[k][:, None])
        push.set_offsets(place[k])
        push.set_UVC(*u[k])
        now.set_data([t[k]], [np.hypot(*u[k])])

    return [mass, push, now], show


def arm_scene(plan: ArmPlan, frames: int, left: Axes, right: Axes) -> Scene:
    """The arm among its obstacles with the force of the base on it as an arrow, and the force's size."""
    assert plan.joints is not None
    joints, chain = plan.joints, plan.joints.chain
    t = np.linspace(0, joints.duration, frames)
    points, place = chain.joints(joints.absolute(t)), plan.position(t)
    forces = plan.base_force(np.minimum(t, joints.duration * LAST))
    polygons(left, plan.maneuver.obstacles, plan.maneuver.margin, "obstacle")
    left.plot(*plan.tip(t).T, color=ORANGE, linestyle="--", linewidth=1.0, label="tip")
    left.plot(*place.T, label="centre of mass", **TRACK)
    size = float(np.max(np.ptp(points.reshape(-1, 2), axis=0)))
    low, high = points.min(axis=(0, 1)) - 0.3 * size, points.max(axis=(0, 1)) + 0.3 * size
    near = [np.clip(block.vertices, low, high) for block in plan.maneuver.obstacles]
    heads = chain.base + ARM_ARROW * size * forces / (plan.peak_force or 1)
    shown = np.vstack([points.reshape(-1, 2), heads, *near])
    name_arrow(left, "force of the base")
    look_through(left, (shown.min(axis=0) - 0.08 * size, shown.max(axis=0) + 0.08 * size))
    base_force(plan, ax=right)
    wide = [k for k in range(chain.links) if chain.half_width[k]]
    matter = [left.fill([], [], facecolor="#00000030", edgecolor=BLACK, linestyle="-", zorder=4)[0] for _ in wide]
    (arm,) = left.plot([], [], color=BLACK, linestyle="-", marker="o", linewidth=2.5, zorder=5)
    (mass,) = left.plot([], [], color=BLUE, markersize=7, **POINT)
    push = left.quiver(*chain.base, 0, 0, **arrow(plan.peak_force, ARM_ARROW * size))
    (now,) = right.plot([], [], color=RED, markersize=7, **POINT)

    def show(k: int) -> None:
        arm.set_data(*points[k].T)
        for patch, link in zip(matter, wide, strict=True):
            patch.set_xy(capsule(points[k, link], points[k, link + 1], chain.half_width[link]))
        mass.set_data(*place[k][:, None])
        push.set_UVC(*forces[k])
        now.set_data([t[k]], [np.hypot(*forces[k])])

    return [*matter, arm, mass, push, now], show
