"""Where the holds of the control begin and end, in units of the duration.

Both grids give `edges(times)`, the steps+1 ends of the holds, for obstacle times 0 < T_1 < ... < T_q < 1.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from .arrays import Array
from .model import Count, Model


class Uniform(Model):
    """Equal holds (the paper). An obstacle time is moved to the nearest node inside."""

    kind: Literal["uniform"] = "uniform"
    steps: Count = 200

    def place(self, times: Array) -> Array:
        """The times moved to distinct inner nodes, shape (q,); needs steps > q."""
        count = len(times)
        node = np.clip(np.round(np.asarray(times) * self.steps), 1, self.steps - 1)
        for i in range(1, count):  # one node each, in order
            node[i] = max(node[i], node[i - 1] + 1)
        for i in reversed(range(count)):
            node[i] = min(node[i], self.steps - (count - i))
        return np.asarray(node / self.steps, dtype=float)

    def edges(self, times: Array) -> Array:
        """Ends of the holds, shape (steps+1,)."""
        return np.arange(self.steps + 1) / self.steps


class Aligned(Model):
    """Equal holds between one obstacle time and the next, so that each obstacle time is a node."""

    kind: Literal["aligned"] = "aligned"
    steps: Count = 200

    def place(self, times: Array) -> Array:
        """The times as they are, shape (q,)."""
        return np.asarray(times, dtype=float)

    def holds(self, walls: int) -> list[int]:
        """Number of holds N_j of each of the q+1 segments; they add up to `steps`."""
        return [self.steps * (j + 1) // (walls + 1) - self.steps * j // (walls + 1) for j in range(walls + 1)]

    def edges(self, times: Array) -> Array:
        """Ends of the holds, shape (steps+1,)."""
        ends = np.concatenate([[0.0], times, [1.0]])
        parts = [
            a + (b - a) * np.arange(n) / n for a, b, n in zip(ends, ends[1:], self.holds(len(times)), strict=False)
        ]
        return np.concatenate([*parts, [1.0]])


Grid = Annotated[Uniform | Aligned, Field(discriminator="kind")]
