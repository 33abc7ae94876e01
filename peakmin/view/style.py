"""The house style of all pictures: colours and dashes that stay apart in grey; and a picture as a file's bytes."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cycler import cycler

from . import pyplot as plt

if TYPE_CHECKING:
    from .pyplot import Axes, Figure, RcKeyType

DPI = 150  # of a file
Look = dict[str, Any]  # what matplotlib is told of an artist: names and values are matplotlib's

# Okabe and Ito's colours in an order whose lightness differs too; dashes tell the lines apart in grey.
BLUE, ORANGE, GREEN, PINK, BLACK, RED = "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#000000", "#D55E00"
COLORS = (BLUE, ORANGE, BLACK, GREEN, PINK)
DASHES = ("-", "--", "-.", ":", (0, (5, 1)))
STYLE: dict[RcKeyType, object] = {
    "axes.prop_cycle": cycler(color=COLORS, linestyle=DASHES),
    "axes.grid": True,
    "grid.color": "#dddddd",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "font.size": 10,
    "figure.constrained_layout.use": True,
}
WALL: Look = {"color": "#555555", "linewidth": 4, "linestyle": "-", "solid_capstyle": "butt", "zorder": 3}
LINE: Look = {"color": BLACK, "linewidth": 1.4, "linestyle": ":", "zorder": 3}
BLOCK: Look = {"facecolor": "#d0d0d0", "edgecolor": "#333333", "linewidth": 1.2, "linestyle": "-", "zorder": 2}
MARGIN: Look = {"color": "#444444", "linewidth": 0.9, "linestyle": "--", "zorder": 3}
MARK: Look = {"linestyle": "none", "marker": "D", "color": ORANGE, "markeredgecolor": BLACK, "zorder": 6}
INSTANT: Look = {"color": "#999999", "linewidth": 0.8, "linestyle": ":"}
BELOW: Look = {  # a legend under the axes, at a distance in units of its letters: clear of the ticks and the label
    "fontsize": "small",
    "loc": "upper center",
    "bbox_to_anchor": (0.5, 0),
    "borderaxespad": 4.8,
    "frameon": False,
}


def axes_of(ax: Axes | None) -> Axes:
    """The given axes, or new ones in the house style."""
    if ax is not None:
        return ax
    with plt.rc_context(STYLE):
        return plt.subplots()[1]


def sheet(*painters: Callable[[Axes], object], size: tuple[float, float], columns: int | None = None) -> Figure:
    """A figure in the house style with a panel for each painter, row by row; by default all in one row."""
    columns = columns or len(painters)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(-(-len(painters) // columns), columns, figsize=size, squeeze=False)
        for draw, ax in zip(painters, axes.ravel(), strict=True):
            draw(ax)
    return figure


def png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG file, which do not name the software: equal pictures are equal. Closes it."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=DPI, metadata={"Software": None})
    plt.close(figure)
    return out.getvalue()
