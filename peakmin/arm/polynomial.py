"""A motion of the centre of mass in polynomial pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly, PPoly

from ..arrays import Array

SAMPLES = 4000  # of a motion when its peak is looked for


@dataclass(frozen=True)
class Polynomial:
    """A motion of the centre of mass in polynomial pieces, as a trajectory."""

    pieces: BPoly | PPoly

    @property
    def nodes(self) -> Array:
        return np.asarray(self.pieces.x)

    def position(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces(np.asarray(t, dtype=float)))

    def velocity(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces.derivative(1)(np.asarray(t, dtype=float)))

    def acceleration(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces.derivative(2)(np.asarray(t, dtype=float)))

    def peak(self) -> float:
        """Largest |acceleration| at SAMPLES + 1 instants [m/s^2]."""
        return float(np.max(np.hypot(*self.acceleration(np.linspace(0, self.nodes[-1], SAMPLES + 1)).T)))

    def panels(self) -> Array:
        return self.nodes
