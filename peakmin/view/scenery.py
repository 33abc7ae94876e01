"""What stands around a path, drawn: region, blocks with their margins, walls, start and goal; and how much to show."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..spec.maneuver import Maneuver
from ..spec.obstacles import Block, Wall
from ..types import Array
from .style import BELOW, BLACK, BLOCK, LINE, MARGIN, RED, WALL, Look

if TYPE_CHECKING:
    from .pyplot import Axes


def window(maneuver: Maneuver, walls: Iterable[Wall], track: Array) -> tuple[Array, Array]:
    """Lower left and upper right corner of the picture: all of the track, and of the rest what is not too far away."""
    low, high = track.min(axis=0), track.max(axis=0)
    reach = 0.75 * max(float(np.max(high - low)), 1e-12)
    middle = (low + high) / 2
    rays = [ray for wall in {*maneuver.walls, *walls} for ray in wall.rays]
    rest = [tip for tip, _ in rays] + [tip + 0.4 * reach * along for tip, along in rays]
    rest += [corner for block in maneuver.blocks for ring in block.grown(maneuver.margin) for corner in ring]
    cloud = np.array(
        [low, high, *np.clip(np.reshape([*rest, *(maneuver.region or ())], (-1, 2)), middle - reach, middle + reach)]
    )
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    room = 0.08 * max(float(np.max(high - low)), reach)
    return low - room, high + room


def look_through(ax: Axes, corners: tuple[Array, Array]) -> None:
    """Set what is shown, in metres, and the legend below it."""
    low, high = corners
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    ax.set_aspect("equal", anchor="S")  # from below: the layout then knows where the legend ends
    ax.legend(ncols=3, **BELOW)


def polygons(ax: Axes, shapes: Iterable[Block], margin: float, name: str = "block") -> None:
    """Blocks, and what the margin adds to them."""
    for i, block in enumerate(shapes):
        ax.fill(*np.transpose(block.vertices), label=None if i else name, **BLOCK)
        for j, ring in enumerate(block.grown(margin) if margin else []):
            ax.plot(*np.vstack([ring, ring[:1]]).T, label=None if i + j else "margin", **MARGIN)


def surroundings(ax: Axes, maneuver: Maneuver, far: float, walls: Iterable[Wall] = (), name: str = "wall") -> None:
    """Region, blocks, margins, walls, and lines of `walls` that a search put up, drawn `far` [m] from their tips."""
    if maneuver.region is not None:
        edge: Look = {"edgecolor": BLACK, "linewidth": 1.2, "linestyle": "-.", "zorder": 2}
        ax.fill(*np.transpose(maneuver.region), facecolor="none", label="region", **edge)
    polygons(ax, maneuver.blocks, maneuver.margin)
    lines = [wall for wall in walls if not any(_same_line(wall, other, far) for other in maneuver.walls)]
    for label, some, style in ((name, maneuver.walls, WALL), ("line", lines, LINE)):
        for i, (tip, along) in enumerate(ray for wall in some for ray in wall.rays):
            ax.plot(*np.array([tip, tip + far * along]).T, label=None if i else label, **style)


def _same_line(one: Wall, other: Wall, size: float) -> bool:
    """Whether two walls stand on one line, to a millionth of the picture: the search puts up the user's walls anew."""
    (tip, along), (there, toward) = one.rays[0], other.rays[0]
    across = np.array([-along[1], along[0]])
    return bool(abs(across @ toward) < 1e-6 and abs(across @ (there - tip)) < 1e-6 * size)


def ends(ax: Axes, maneuver: Maneuver) -> None:
    """Start and goal."""
    mark: Look = {"linestyle": "none", "markersize": 6, "color": BLACK, "zorder": 6}
    ax.plot(*maneuver.start.position, marker="o", label="start", **mark)
    ax.plot(*maneuver.goal.position, marker="s", label="goal", **mark)


def arrows_at(ax: Axes, places: Array, vectors: Array, size: float, name: str) -> None:
    """Vectors (m, 2) at places [m] (m, 2) in a picture of this size [m], the longest of them an eighth of it."""
    longest = float(np.max(np.hypot(*vectors.T)))
    ax.quiver(*places.T, *vectors.T, **arrow(longest, 0.12 * size))
    name_arrow(ax, name)


def name_arrow(ax: Axes, name: str) -> None:
    """What the arrows are, for the legend: there a quiver would be a patch of colour."""
    ax.plot([], [], linestyle="none", color=RED, marker=r"$\rightarrow$", markersize=11, label=name)


def arrow(vector: float, length: float) -> Look:
    """How arrows are drawn, those of so long a vector as long as so many metres."""
    scale: Look = {"angles": "xy", "scale_units": "xy", "scale": (vector or 1) / length}
    shape: Look = {"units": "inches", "width": 0.022, "headwidth": 4, "headlength": 5, "headaxislength": 4.5}
    return {"color": RED, "zorder": 5, "minshaft": 2, **scale, **shape}
