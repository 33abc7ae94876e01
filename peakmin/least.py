"""The function that the outer loop minimises: M over the obstacle times, by whichever method the settings name."""

from __future__ import annotations

import math

import numpy as np

from .arrays import Array
from .bisection import bisect, direct
from .bracket import Bracket
from .circle import Disc, Polygon
from .exact import Extremal, settled
from .frame import Frame
from .grid import Aligned
from .moments import PointMass
from .spec import Bisection, Exact, Maneuver, Settings
from .trajectory import HoldTrajectory, Trajectory

COARSE = 100  # holds per segment of the program that proposes multipliers to the exact method


class LeastPeak:
    """M(T_obs) of one maneuver for one circle and grid: programs compiled once, answers remembered."""

    def __init__(
        self,
        maneuver: Maneuver,
        settings: Settings,
        circle: Disc | Polygon | None = None,
        until: float = math.inf,
    ) -> None:
        from . import compiled, program  # cvxpy takes a second to import

        self.maneuver, self.settings, self.until = maneuver, settings, until
        self.mass = PointMass.of(maneuver)
        self.count = program.Count()
        self._kinds, self._programs = program, compiled.programs()
        shape = (circle or settings.circle).facing(Frame.from_maneuver(maneuver).angle)
        self._arguments = (maneuver, shape, settings.grid)
        self._known: dict[bytes, Bracket] = {}
        self._extremals: dict[bytes, Extremal] = {}
        self._hint: Array | None = None

    def place(self, times: Array) -> Array:
        """The obstacle times [scaled] that the grid makes of these [s], shape (q,)."""
        scaled = np.asarray(times, dtype=float) / self.mass.time
        return scaled if isinstance(self.settings.method, Exact) else self.settings.grid.place(scaled)

    def __call__(self, times: Array) -> Bracket:
        """The bracket [scaled] at these obstacle times [s], shape (q,)."""
        placed = self.place(times)
        key = placed.tobytes()
        if key not in self._known:
            if isinstance(self.settings.method, Exact):
                self._extremals[key] = settled(self.mass, placed, self._propose)
                bracket = self._extremals[key].bracket
            elif isinstance(self.settings.method, Bisection):
                feasibility = self._programs.take(self._kinds.FeasibilityProgram, *self._arguments, self.count)
                bracket = bisect(feasibility, times, self.settings, self._hint, self.until)
            else:
                program = self._programs.take(self._kinds.DirectProgram, *self._arguments, self.count)
                bracket = direct(program, times, self.settings, self.until)
            self._hint = bracket.multipliers
            self._known[key] = bracket
        return self._known[key]

    def motion(self, times: Array) -> Trajectory | None:
        """The motion of the upper end at these obstacle times [s], in SI units; None where there is none."""
        bracket, placed = self(times), self.place(times)
        found = self._extremals.get(placed.tobytes())
        if found is not None:
            return found.motion.in_units(self.mass) if math.isfinite(found.upper) else None
        if bracket.control is None:
            return None
        start = self.maneuver.start
        nodes = self.settings.grid.edges(placed) * self.mass.time
        control = bracket.control * self.mass.unit
        return HoldTrajectory(nodes, control, np.array(start.position), np.array(start.velocity))

    def _propose(self, times: Array) -> Bracket:
        """The bracket at scaled times of a conic program on a coarse aligned grid."""
        grid = Aligned(steps=COARSE * (1 + self.mass.walls))
        program = self._programs.take(self._kinds.DirectProgram, self.maneuver, Disc(), grid, self.count)
        return direct(program, times * self.mass.time, self.settings, self.until)
