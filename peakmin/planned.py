"""What every plan offers, of a centre of mass or of an arm: its motion, its gap, its check, its text."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array
from .check import Check, check
from .spec import Maneuver
from .trajectory import Trajectory

Status = Literal["solved", "infeasible", "unknown"]


class Planned:
    """Accessors over a plan's own fields."""

    status: Status
    obstacle_times: Array
    peak: float
    lower_bound: float

    if TYPE_CHECKING:

        @property
        def trajectory(self) -> Trajectory | None:
            """The motion of the centre of mass."""

        @property
        def crossing(self) -> Maneuver:
            """The centre of mass's maneuver past the walls that the obstacle times belong to."""

        def document(self) -> dict[str, Any]:
            """The plan as plain JSON data."""

    @property
    def gap(self) -> float:
        """(peak - lower_bound) / peak; 1 where the path is none that the bound speaks of."""
        if not math.isfinite(self.peak) or self.peak < self.lower_bound * (1 - 1e-9):
            return 1.0
        return (self.peak - self.lower_bound) / self.peak if self.peak else 0.0

    @property
    def peak_force(self) -> float:
        """Peak base reaction force, mass times peak [N]."""
        return self.crossing.mass * self.peak

    def _motion(self) -> Trajectory:
        if self.trajectory is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.trajectory

    @property
    def times(self) -> Array:
        """Nodes of the trajectory [s], shape (steps+1,); empty when there is none."""
        return np.zeros(0) if self.trajectory is None else self.trajectory.nodes

    def position(self, t: ArrayLike) -> Array:
        """Position of the centre of mass [m] at t [s], shape (...) -> (..., 2); beyond the ends as at the ends."""
        return self._motion().position(t)

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity of the centre of mass [m/s] at t [s], shape (...) -> (..., 2)."""
        return self._motion().velocity(t)

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration of the centre of mass [m/s^2] at t [s], shape (...) -> (..., 2)."""
        return self._motion().acceleration(t)

    def base_force(self, t: ArrayLike) -> Array:
        """Force that the base exerts on the robot, m u(t) [N], shape (...) -> (..., 2); the robot's is its opposite."""
        return self.crossing.mass * self.acceleration(t)

    def check(self) -> Check:
        """Propagate the control anew, hold by hold, and compare with everything the plan states."""
        return check(self.crossing, self._motion(), self.obstacle_times, self.peak)

    def to_json(self, *, indent: int | None = None) -> str:
        """The plan as one JSON document (text; write it where you like)."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)


def table_text(head: list[str], columns: list[Array]) -> str:
    """Columns (m,) or (m, k) as CSV text under a head."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(np.column_stack(columns).tolist())
    return out.getvalue()
