"""What view needs of matplotlib, imported when the first picture is drawn: a refused spec does not wait for it.

No other module imports matplotlib. Modules are left lazy by hand (PEP 562): lazy_loader's `load` takes whole packages
only, its `attach` writes the names into the package they come from, where they hide matplotlib's own.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch
    from matplotlib.pyplot import close, rc_context, subplots, switch_backend
    from matplotlib.typing import RcKeyType

    __all__ = [
        "Artist",
        "Axes",
        "FancyBboxPatch",
        "Figure",
        "RcKeyType",
        "close",
        "rc_context",
        "subplots",
        "switch_backend",
    ]
else:
    ELSEWHERE = {"FancyBboxPatch": "patches"}  # in matplotlib than in its pyplot

    def __getattr__(name: str) -> object:
        return getattr(import_module(f"matplotlib.{ELSEWHERE.get(name, 'pyplot')}"), name)
