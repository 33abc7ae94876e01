"""The frame of a way: its start at the origin, its goal on the x axis (the paper's displaced and turned axes)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ..types import Array


@dataclass(frozen=True)
class Frame:
    """origin [m] (2,) and the unit vector along its x axis (2,), both seen from outside."""

    origin: Array
    along: Array

    @classmethod
    def between(cls, start: ArrayLike, goal: ArrayLike) -> Self:
        """From start to goal [m], (2,) each; unturned where the two are at the same place."""
        origin = np.array(start, dtype=float)
        way = np.array(goal, dtype=float) - origin
        length = math.hypot(*way)
        return cls(origin, way / length if length else np.array([1.0, 0.0]))

    @property
    def angle(self) -> float:
        """By which the frame is turned [rad]."""
        return math.atan2(self.along[1], self.along[0])

    def vector(self, vectors: ArrayLike) -> Array:
        """Velocities, accelerations, directions (..., 2) as seen in the frame."""
        v, (c, s) = np.asarray(vectors, dtype=float), self.along
        return np.stack([c * v[..., 0] + s * v[..., 1], c * v[..., 1] - s * v[..., 0]], axis=-1)

    def position(self, positions: ArrayLike) -> Array:
        """Positions [m] (..., 2) as seen in the frame."""
        return self.vector(np.asarray(positions, dtype=float) - self.origin)

    def vector_back(self, vectors: ArrayLike) -> Array:
        """Vectors in the frame (..., 2) as seen from outside."""
        v, (c, s) = np.asarray(vectors, dtype=float), self.along
        return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]], axis=-1)

    def position_back(self, positions: ArrayLike) -> Array:
        """Positions in the frame [m] (..., 2) as seen from outside."""
        return self.vector_back(positions) + self.origin
