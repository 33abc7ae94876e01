"""Functions of packages further down, by their names."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from typing import cast

from .types import Axes

Painter = Callable[..., Axes]


def found(name: str) -> Painter:
    """The painter of this name, "package.module:function", imported when it is asked for.

    `plan.plot()` is there for notebooks. But what draws plans imports them, and matplotlib: a plan that imported it
    would close a circle. So it knows its painter by its name only, as pandas knows what it plots with.
    """
    return cast(Painter, pkgutil.resolve_name(name))
