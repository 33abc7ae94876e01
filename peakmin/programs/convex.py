"""cvxpy, read when it is first used: it takes a second, and a spec that is refused does not wait for it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import cvxpy as cp
else:
    import lazy_loader

    cp = lazy_loader.load("cvxpy")

__all__ = ["cp", "ready", "silence_highs"]


def ready() -> None:
    """Have it read now: within a time that is limited, not after it."""
    assert cp.Variable


@cache
def silence_highs() -> None:
    """Make HiGHS's first instance one that is silent: that one prints HiGHS's name, before cvxpy says it is not to."""
    from highspy import Highs

    class Silent(Highs):
        def enableCallbacks(self) -> None:  # what prints it
            self.setOptionValue("log_to_console", False)
            super().enableCallbacks()  # type: ignore[no-untyped-call]

    Silent()  # type: ignore[no-untyped-call]
