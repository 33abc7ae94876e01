"""A spec that is refused, drawn as far as it can be read, with what is wrong in red."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..robots.kinematics import Pair, unit
from ..types import Array, Json
from .style import BELOW, BLACK, BLOCK, RED, WALL, Look, axes_of

if TYPE_CHECKING:
    from .pyplot import Axes

LARGEST = 1e9  # m: what is further away is not drawn
LINKS: Look = {"marker": "o", "markersize": 4, "linewidth": 1.8}
WIDE = 96  # letters of a title's line
FIELD = re.compile(r"[A-Za-z_][\w.\[\]]*(?=: )")
BOTH = {"up": (-1.0,), "down": (1.0,)}  # signs of the elbow; else it is either


def sketch(data: Json, refusal: str, ax: Axes | None = None) -> Axes:
    """What a refused spec shows: start, goal, walls, blocks, region, or the arm in its poses.

    Args:
        data: the file's.
        refusal: its line, which begins with the field that is wrong; the title.
    """
    ax = axes_of(ax)
    named = FIELD.match(refusal)
    drawing = _Drawing(ax, named[0] if named else "")
    maneuver = _object(data.get("maneuver"))
    drawing.area("maneuver.region", maneuver.get("region"))
    drawing.obstacles(maneuver.get("obstacles"))
    if "arm" in data:
        drawing.arm(_object(data["arm"]), maneuver)
    else:
        drawing.ends(maneuver)
    drawing.finish()
    title = "\n".join(textwrap.wrap(refusal, WIDE, max_lines=6))
    ax.set_title(title, color=RED, fontsize="small", parse_math=False)
    return ax


class _Drawing:
    """What has been drawn: all its points, for how much to show, and which names the legend has."""

    def __init__(self, ax: Axes, field: str) -> None:
        self.ax, self.field = ax, field
        self.seen: list[Array] = []
        self.rays: list[tuple[Array, Array, Look]] = []
        self.names: set[str] = set()

    def wrong(self, path: str) -> bool:
        """Whether the entry is the one refused, holds it, or is in it."""
        one, other = sorted((self.field, path), key=len)
        return bool(one) and other.startswith(one) and other[len(one) : len(one) + 1] in ("", ".", "[")

    def name(self, path: str, name: str) -> str | None:
        """For the legend, once: what this is, or that it is refused."""
        name = f"{name}, refused" if self.wrong(path) else name
        if name in self.names:
            return None
        self.names.add(name)
        return name

    def line(self, path: str, name: str, points: Array, **look: object) -> None:
        self.seen.append(points)
        red: Look = {"color": RED, "zorder": 8} if self.wrong(path) else {}
        self.ax.plot(*points.T, label=self.name(path, name), **{**look, **red})

    def area(self, path: str, corners: object, name: str = "region") -> None:
        points = _points(corners)
        if not len(points):
            return
        self.seen.append(points)
        plain: Look = {**BLOCK, "linestyle": "-"} if name == "block" else {"facecolor": "none", "linestyle": "-."}
        red: Look = {"edgecolor": RED, "linewidth": 2.2} if self.wrong(path) else {"edgecolor": BLACK}
        self.ax.fill(*points.T, label=self.name(path, name), **{**plain, **red, "zorder": 2})

    def obstacles(self, listed: object) -> None:
        for i, one in enumerate(listed if isinstance(listed, list) else []):
            path, entry = f"maneuver.obstacles[{i}]", _object(one)
            self.area(path, entry.get("vertices"), "block")
            tip, along = _point(entry.get("tip")), _point(entry.get("direction", [0, -1]))
            if tip is None or "vertices" in entry:
                continue
            if along is not None and math.hypot(*along) > 0:
                look: Look = {"label": self.name(path, "wall"), **WALL}
                self.rays.append((tip, along / math.hypot(*along), look | ({"color": RED} if self.wrong(path) else {})))
                self.seen.append(tip[None])
            else:
                self.line(path, "tip of a wall", tip[None], color=WALL["color"], marker="o", linestyle="none")

    def ends(self, maneuver: Json) -> None:
        for end, mark in (("start", "o"), ("goal", "s")):
            place = _point(_object(maneuver.get(end)).get("position"))
            if place is not None:
                look: Look = {"linestyle": "none", "markersize": 7, "color": BLACK, "zorder": 6, "marker": mark}
                self.line(f"maneuver.{end}", end, place[None], **look)

    def arm(self, arm: Json, maneuver: Json) -> None:
        base = _point(arm.get("base", [0, 0]))
        links = arm.get("links")
        lengths = [_number(_object(one).get("length")) for one in (links if isinstance(links, list) else [])]
        if base is None:
            return
        self.line("arm.base", "base", base[None], marker="^", markersize=9, linestyle="none", color=BLACK, zorder=6)
        known = [size for size in lengths if size is not None and size > 0]
        for end, shade, dashes in (("start", "0.6", "--"), ("goal", "0", "-")):
            path, pose = f"maneuver.{end}", _object(maneuver.get(end))
            tip = _point(pose.get("tip"))
            if tip is not None:
                self.line(path, f"tip at the {end}", tip[None], marker="x", markersize=8, linestyle="none", color=shade)
            if len(known) < len(lengths):
                continue
            found = list(_configurations(pose, known, None if tip is None else tip - base))
            for theta in found:
                joints = base + np.vstack(
                    [np.zeros(2), np.cumsum(np.array(known)[: len(theta), None] * unit(theta), 0)]
                )
                for k in range(len(theta)):
                    own = f"arm.links[{k}]" if self.wrong(f"arm.links[{k}]") else path
                    self.line(own, f"arm at the {end}", joints[k : k + 2], color=shade, linestyle=dashes, **LINKS)
            if tip is not None and len(known) == 2 and not found:
                self.reach(base, known)

    def reach(self, base: Array, lengths: list[float]) -> None:
        """What the tip of two links can reach: between two circles."""
        edge = unit(np.linspace(0, math.tau, 361))
        for radius in filter(None, (abs(lengths[0] - lengths[1]), sum(lengths))):
            look: Look = {"color": BLACK, "linewidth": 0.8, "linestyle": ":"}
            self.line("reach", "reach of the tip", base + radius * edge, **look)

    def finish(self) -> None:
        """All of it in view, walls to the edge of that; units and legend."""
        cloud = np.vstack(self.seen) if self.seen else np.zeros((0, 2))
        low, high = (cloud.min(axis=0), cloud.max(axis=0)) if len(cloud) else (np.zeros(2), np.ones(2))
        size = float(np.max(high - low)) or 1.0
        for tip, along, look in self.rays:
            self.ax.plot(*np.array([tip, tip + 3 * size * along]).T, **look)
            low, high = np.minimum(low, tip + 0.3 * size * along), np.maximum(high, tip + 0.3 * size * along)
        low, high = low - 0.1 * size, high + 0.1 * size
        self.ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
        self.ax.set_aspect("equal", anchor="S")
        if self.names:
            self.ax.legend(ncols=3, **BELOW)
        else:
            self.ax.text(0.5, 0.5, "nothing of it can be drawn", ha="center", transform=self.ax.transAxes)


def _configurations(pose: Json, lengths: list[float], tip: Array | None) -> Iterator[Array]:
    """Absolute angles (n,) of what a pose says, as far as that can be made out.

    Args:
        tip: seen from the base [m].
    """
    listed = pose.get("joints")
    joints = [_number(q) for q in listed] if isinstance(listed, list) else []
    angles = [q for q in joints[: len(lengths)] if q is not None]
    if joints and len(angles) == min(len(joints), len(lengths)):
        yield np.cumsum(angles)
    elif tip is not None and len(lengths) == 2:
        pair = Pair(*lengths)
        if pair.inner <= math.hypot(*tip) <= pair.outer:
            elbow = pose.get("elbow")
            for sign in BOTH.get(elbow, (-1.0, 1.0)) if isinstance(elbow, str) else (-1.0, 1.0):
                yield pair.angles(tip, sign)


def _object(value: object) -> Json:
    return value if isinstance(value, dict) else {}


def _number(value: object) -> float | None:
    """A number that can be drawn, or None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        return None
    return float(value)


def _point(value: object) -> Array | None:
    """Two numbers, or None."""
    if not isinstance(value, list) or len(value) != 2:
        return None
    x, y = map(_number, value)
    return None if x is None or y is None else np.array([x, y])


def _points(value: object) -> Array:
    """Those of a list of points that are some, shape (n, 2)."""
    found = [_point(one) for one in value] if isinstance(value, list) else []
    return np.reshape([one for one in found if one is not None], (-1, 2))
