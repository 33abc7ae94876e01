"""The units in which a maneuver is solved."""

from __future__ import annotations

from dataclasses import dataclass

from ..types import Array


@dataclass(frozen=True)
class Units:
    """length [m], time [s], and the place [m] that counts as the origin (d,)."""

    length: float
    time: float
    origin: Array

    @property
    def unit(self) -> float:
        """Size of the scaled acceleration 1 [m/s^2]."""
        return self.length / self.time**2
