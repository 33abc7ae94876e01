"""What an oracle's queries are given: numbers and arrays in, refused in one line."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import SpecError
from ..spec.maneuver import State
from ..spec.reading import short
from ..types import Array

AXES = {"start": 1, "goal": 1, "duration": 0, "tips": 2, "obstacle_times": 1}  # of what is given once for all


class Given:
    """What many queries are given, by name: once for all, or for each along the first axis.

    Raises:
        SpecError: when shapes do not go together.
    """

    def __init__(self, **given: ArrayLike | None) -> None:
        self.values = {name: _numbers(name, value) for name, value in given.items() if value is not None}
        self.each = {name for name, value in self.values.items() if value.ndim > AXES[name]}
        if any(value.ndim not in (AXES[name], AXES[name] + 1) for name, value in self.values.items()):
            shapes = [self.values[name].shape if name in self.values else None for name in given]
            raise SpecError(f"queries: was of shapes {shapes}, must be one for all, or one each along the first axis")
        self.sizes = {len(self.values[name]) for name in self.each}
        if len(self.sizes) > 1:
            raise SpecError(f"queries: was {sorted(self.sizes)} of a kind, must be as many of each, or one for all")

    def __len__(self) -> int:
        return max(self.sizes, default=1)

    def of(self, name: str, k: int) -> Array:
        """What the k-th query is given."""
        value = self.values[name]
        return np.asarray(value[k]) if name in self.each else value


def _numbers(name: str, given: ArrayLike) -> Array:
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise SpecError(f"{name}: was {short(given)}, must be an array of numbers") from None


def state(name: str, given: State | ArrayLike) -> State:
    """A state, or [x, y] at rest, or [x, y, vx, vy] [m, m/s]. Raises `SpecError` for anything else."""
    if isinstance(given, State):
        return given
    try:
        numbers = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise SpecError(f"{name}: was {str(given)[:60]}, must be two or four numbers") from None
    if numbers.shape not in ((2,), (4,)):
        raise SpecError(f"{name}: was of shape {numbers.shape}, must be (2,), at rest, or (4,), with its velocity")
    try:
        return State(position=numbers[:2], velocity=numbers[2:] if len(numbers) == 4 else (0.0, 0.0))
    except SpecError as error:
        raise SpecError(f"{name}.{error}") from None
