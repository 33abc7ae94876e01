"""cvxpy, read when it is first used: it takes a second, and a spec that is refused does not wait for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import cvxpy as cp
else:
    import lazy_loader

    cp = lazy_loader.load("cvxpy")

__all__ = ["cp"]
