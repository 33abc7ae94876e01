"""The house style of all pictures: colours and dashes that stay apart in grey, and how a moving picture is made."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.markers import CARETUP

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
MARGIN: Any = {"color": "#444444", "linewidth": 0.9, "linestyle": "--", "zorder": 3}
PEAK: Any = {"color": "#c8c8c8", "linewidth": 7, "linestyle": "-", "zorder": 1.5}
BELOW: Any = {  # a legend under the axes, at a distance in units of its letters: clear of the ticks and the label
    "fontsize": "small",
    "loc": "upper center",
    "bbox_to_anchor": (0.5, 0),
    "borderaxespad": 4.8,
    "frameon": False,
}


FRAMES, SECOND = 48, 12  # of a GIF, and how many of them a second


def axes_of(ax: Axes | None) -> Axes:
    """The given axes, or new ones in the house style."""
    if ax is not None:
        return ax
    with plt.rc_context(STYLE):
        return plt.subplots()[1]


def peak_and_bound(ax: Axes, peak: float, bound: float, unit: str) -> None:
    """The peak as a broad pale band, the bound as a row of triangles that point at it from below.

    They often lie on one another and on |u|, which is thin and dark: all three can still be seen.
    """
    ax.set_xmargin(0)  # the triangles stay within the time
    ax.axhline(peak, **PEAK, label=f"peak {peak:.6g} {unit}")
    x: Any = np.linspace(0.02, 0.98, 13)
    mark: Any = {"color": ORANGE, "markeredgecolor": BLACK, "markeredgewidth": 0.5, "marker": CARETUP, "markersize": 7}
    name = f"lower bound {bound:.6g} {unit}"
    ax.plot(x, np.full_like(x, bound), linestyle="none", label=name, transform=ax.get_yaxis_transform(), **mark)


def gif(figure: Figure, moving: Sequence[Artist], draw: Callable[[int], None], frames: int) -> bytes:
    """A GIF of a figure in which only some artists move; the figure is closed.

    Args:
        moving: what is drawn anew in every frame, in this order.
        draw: sets these artists to frame k.
    """
    from PIL import Image

    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()  # type: ignore[no-untyped-call]
    still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[no-untyped-call]
    shots = []
    for k in range(frames):
        canvas.restore_region(still)  # type: ignore[no-untyped-call]
        draw(k)
        for artist in moving:
            assert artist.axes is not None
            artist.axes.draw_artist(artist)
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        shots.append(Image.fromarray(pixels).convert("RGB"))
    plt.close(figure)
    palette = Image.new("P", (1, 1))
    palette.putpalette(_shades())
    shots = [shot.quantize(palette=palette, dither=Image.Dither.NONE) for shot in shots]
    out = io.BytesIO()
    shots[0].save(out, format="gif", save_all=True, append_images=shots[1:], duration=1000 // SECOND, loop=0)
    return out.getvalue()


def _shades() -> list[int]:
    """The house's colours from pale to full, then greys: red, green and blue of each in turn."""
    pale = np.linspace(0.25, 1, 6)[:, None]
    mixed = [255 - pale * (255 - 255 * np.array(to_rgb(one))) for one in (BLUE, ORANGE, GREEN, PINK, RED)]
    greys = np.linspace(0, 255, 26)[:, None] * np.ones(3)
    return [int(level) for level in np.round(np.vstack([*mixed, greys])).ravel()]
