"""The function that the outer loop minimises: M over the obstacle times, by whichever method the settings name."""

from __future__ import annotations

import math

import numpy as np

from ..geometry.norm import norm
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..proofs.bracket import Bracket
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import Extremal, extremal_or_proposed
from ..spec.control_set import Disc, Polygon
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.settings import Aligned, Bisection, Exact, Settings
from ..types import Array
from .bisection import bisect, direct
from .program import Count, DirectProgram, FeasibilityProgram, Programs

COARSE = 100  # holds per segment of the program that proposes multipliers to the exact method


class LeastPeak:
    """M(T_obs) of one maneuver for one circle and grid: programs compiled once, answers remembered.

    Args:
        circle: in place of the settings' own.
        until: a deadline.
        programs: where programs are taken from; default a place of its own.
    """

    def __init__(
        self,
        maneuver: Maneuver,
        settings: Settings,
        circle: Disc | Polygon | None = None,
        until: float = math.inf,
        programs: Programs | None = None,
    ) -> None:
        self.maneuver, self.settings, self.until = maneuver, settings, until
        self.mass = PointMass.of(maneuver)
        self.count = Count()
        self._programs = programs or Programs()
        shape = (circle or settings.circle).facing(Frame.from_maneuver(maneuver).angle)
        self._arguments = (maneuver, shape, settings.grid)
        self._known: dict[bytes, Bracket] = {}
        self._extremals: dict[bytes, Extremal] = {}
        self._hint: Array | None = None

    def place(self, times: Array) -> Array:
        """The obstacle times [scaled] that the grid makes of these [s], shape (q,)."""
        scaled = np.asarray(times, dtype=float) / self.mass.time
        exact = isinstance(self.settings.method, Exact)
        return scaled if exact or self._too_few else self.settings.grid.place(scaled)

    def __call__(self, times: Array) -> Bracket:
        """The bracket [scaled] at these obstacle times [s], shape (q,)."""
        placed = self.place(times)
        key = placed.tobytes()
        if key not in self._known:
            if isinstance(self.settings.method, Exact):
                self._extremals[key] = extremal_or_proposed(self.mass, placed, self._propose)
                bracket = self._extremals[key].bracket
            else:
                bracket = self._asked(times)
            self._hint = bracket.multipliers
            self._known[key] = bracket
        return self._known[key]

    @property
    def _too_few(self) -> bool:
        """Whether the holds are so few that a segment between obstacle times has none."""
        return self.settings.grid.steps <= self.mass.walls

    def _asked(self, times: Array) -> Bracket:
        """The bracket by a program; without one where there are too few holds for a control."""
        if self._too_few:
            return Bracket(multipliers=np.zeros((2 + self.mass.walls, self.mass.dimension)))
        if isinstance(self.settings.method, Bisection):
            feasibility = self._programs.take(FeasibilityProgram, *self._arguments, self.count)
            return bisect(feasibility, times, self.settings, self._hint, self.until)
        program = self._programs.take(DirectProgram, *self._arguments, self.count)
        return direct(program, times, self.settings, self.until)

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

    def bound(self, times: Array) -> float:
        """A bound [m/s^2] on |u| of the control found at these obstacle times [s]; infinite where there is none.

        It is the circle's M, except that a circumscribed polygon reaches beyond its M.
        """
        bracket, circle = self(times), self.settings.circle
        if isinstance(circle, Polygon) and circle.fit == "circumscribed":
            control = bracket.control
            return math.inf if control is None else float(np.max(norm(control))) * self.mass.unit
        return bracket.upper * self.mass.unit

    def peak(self, times: Array) -> float:
        """The same, of the motion in SI units."""
        motion = self.motion(times)
        return max(self.bound(times), 0.0 if motion is None else motion.peak())

    def _propose(self, times: Array) -> Bracket:
        """The bracket at scaled times of a conic program on a coarse aligned grid."""
        grid = Aligned(steps=COARSE * (1 + self.mass.walls))
        program = self._programs.take(DirectProgram, self.maneuver, Disc(), grid, self.count)
        return direct(program, times * self.mass.time, self.settings, self.until)
