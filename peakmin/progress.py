"""How long-running calls report."""

from collections.abc import Callable

Progress = Callable[[int, int], None]  # done, total as far as it is known
