"""The least peak as a function for other planners: many queries of one maneuver with other numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import SpecError
from ..plan.plan import Plan
from ..programs.least_peak import LeastPeak
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremals
from ..proofs.sensitivity import Sensitivities, sensitivities, without_idle
from ..search.solve import solve
from ..search.sweep import APART, in_order
from ..spec.maneuver import Maneuver, State, walls_only
from ..spec.obstacles import Wall
from ..spec.settings import Exact, Settings
from ..spec.spec import refuse_unfit
from ..types import Array
from .given import Given, state
from .threads import OfThread

TOGETHER = 1000  # queries at given times that are answered at once


@dataclass(frozen=True, repr=False)
class Peaks:
    """Answers to m queries past q walls.

    peak, lower_bound: [m/s^2], (m,), infinite and a bound where no control was found that keeps all that was asked;
    keeps: whether one was found, (m,);  obstacle_times: [s], (m, q), ending in NaN where past blocks fewer walls are
    put up than in another query;  queries: their maneuvers;  crossings: the same past the walls that the times belong
    to;  multipliers: that prove each, (2+q, d), scaled.
    """

    peak: Array
    lower_bound: Array
    keeps: Array
    obstacle_times: Array
    queries: tuple[Maneuver, ...]
    crossings: tuple[Maneuver, ...]
    multipliers: tuple[Array, ...]

    @cached_property
    def sensitivities(self) -> tuple[Sensitivities, ...]:
        """Derivatives of each peak, as `Plan.sensitivities`."""
        out = []
        for crossing, placed, multipliers in zip(self.crossings, self.obstacle_times, self.multipliers, strict=True):
            mass, times = PointMass.of(crossing), placed[: len(crossing.walls)]
            pushing = without_idle(mass, times / mass.time, multipliers)
            out.append(sensitivities(crossing, times, pushing))
        return tuple(out)

    @property
    def gap(self) -> Array:
        """(peak - lower_bound) / peak, (m,)."""
        return np.where(self.peak > 0, 1 - self.lower_bound / np.where(self.peak > 0, self.peak, 1.0), 0.0)

    def __repr__(self) -> str:
        return f"Peaks({np.count_nonzero(self.keeps)} of {len(self.peak)} found, peak={self.peak})"


class _Answer(NamedTuple):
    """To one query, as in `Peaks`."""

    peak: float
    lower_bound: float
    keeps: bool
    obstacle_times: Array
    crossing: Maneuver
    multipliers: Array


class PeakOracle:
    """Answers "how large must the peak be?" in a loop, every answer with its bound.

    One oracle serves any number of threads: each keeps programs of its own, compiled once for all queries of the same
    structure (walls, circle, grid). With the default settings nothing is compiled: the optimum is that of continuous
    time, at some 40 ms a query past one wall, or one or two at given obstacle times, where many queries are answered
    together at a quarter of a millisecond each (`benchmarks/bench_oracle.py` compares). Several walls and fast starts
    can take seconds until the bound has closed in; a `time_limit` in the settings ends a query with the gap so far.

    Args:
        maneuver: what queries leave out is taken from it.
        settings: how to answer; default the exact method.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """

    def __init__(self, maneuver: Maneuver, settings: Settings | None = None) -> None:
        self.maneuver, self.settings = maneuver, settings or Settings(method=Exact())
        refuse_unfit(self.maneuver, self.settings)
        self._own = OfThread()

    def __reduce__(self) -> tuple[object, ...]:
        return PeakOracle, (self.maneuver, self.settings)  # programs stay with their thread

    def plan(
        self,
        start: State | ArrayLike | None = None,
        goal: State | ArrayLike | None = None,
        duration: float | None = None,
        walls: list[Wall] | ArrayLike | None = None,
    ) -> Plan:
        """The whole plan of one query.

        Args:
            start, goal: states, or [x, y] at rest, or [x, y, vx, vy] [m, m/s].
            duration: [s].
            walls: in place of all obstacles; or other tips for the maneuver's own walls, (q, 2) [m].

        Raises:
            SpecError: when a number is wrong, in one line.
        """
        with self._own.programs as programs:
            return solve(self.query(start, goal, duration, walls), self.settings, programs=programs)

    def query(
        self,
        start: State | ArrayLike | None = None,
        goal: State | ArrayLike | None = None,
        duration: float | ArrayLike | None = None,
        walls: list[Wall] | ArrayLike | None = None,
    ) -> Maneuver:
        """The maneuver of one query, as for `plan`. Raises `SpecError` when a number is wrong."""
        fields: dict[str, object] = {}
        for name, given in (("start", start), ("goal", goal)):
            if given is not None:
                fields[name] = state(name, given)
        if duration is not None:
            if np.ndim(duration):
                raise SpecError(f"duration: was of shape {np.shape(duration)}, must be one number (`peaks` takes many)")
            fields["duration"] = duration.item() if isinstance(duration, np.ndarray) else duration
        if walls is not None:
            fields["obstacles"] = self._walls(walls)
        return Maneuver(**({name: getattr(self.maneuver, name) for name in Maneuver.model_fields} | fields))

    def peak(
        self,
        start: State | ArrayLike | None = None,
        goal: State | ArrayLike | None = None,
        duration: float | None = None,
        walls: list[Wall] | ArrayLike | None = None,
        obstacle_times: ArrayLike | None = None,
    ) -> float:
        """The least peak [m/s^2] of one query, as for `plan`; infinite where no control was found.

        Args:
            obstacle_times: [s], (q,), to be asked at these only, which is much faster; walls alone.
        """
        if obstacle_times is None:
            found = self.plan(start, goal, duration, walls)
            return found.peak if found.keeps else np.inf
        maneuver = self.query(start, goal, duration, walls)
        return self._at(maneuver, np.asarray(obstacle_times, dtype=float)).peak

    def peaks(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: ArrayLike | None = None,
        tips: ArrayLike | None = None,
        obstacle_times: ArrayLike | None = None,
    ) -> Peaks:
        """Many queries at once, whatever is given for each of m or once for all.

        Args:
            start, goal: (m, 2) or (m, 4), or (2,) or (4,): positions [m], at rest, or with velocities [m/s].
            duration: (m,) or one [s].
            tips: (m, q, 2) or (q, 2) [m], of the maneuver's own walls.
            obstacle_times: (m, q) or (q,) [s], to be asked at these only, which is much faster; bounds then are of
                these times, max_peak is not looked at, and walls must be all there is.

        Raises:
            SpecError: when shapes do not go together, or as for `plan`.
        """
        given = Given(start=start, goal=goal, duration=duration, tips=tips, obstacle_times=obstacle_times)
        queries = [self._query(given, k) for k in range(len(given))]
        if obstacle_times is None:
            answers = [self._best(maneuver) for maneuver in queries]
        else:
            answers = self._all_at(queries, [given.of("obstacle_times", k) for k in range(len(given))])
        walls = max((len(one.obstacle_times) for one in answers), default=len(self.maneuver.walls))
        placed = np.full((len(answers), walls), np.nan)
        for own, one in zip(placed, answers, strict=True):
            own[: len(one.obstacle_times)] = one.obstacle_times
        return Peaks(
            np.array([one.peak for one in answers]),
            np.array([one.lower_bound for one in answers]),
            np.array([one.keeps for one in answers], dtype=bool),
            placed,
            tuple(queries),
            tuple(one.crossing for one in answers),
            tuple(one.multipliers for one in answers),
        )

    def _query(self, given: Given, k: int) -> Maneuver:
        """The maneuver of the k-th query."""
        own = {name: given.of(name, k) for name in given.values if name != "obstacle_times"}
        try:
            return self.query(own.get("start"), own.get("goal"), own.get("duration"), own.get("tips"))
        except SpecError as error:
            raise SpecError(f"queries[{k}].{error}" if given.each else str(error)) from None

    def _best(self, maneuver: Maneuver) -> _Answer:
        """At the best obstacle times."""
        with self._own.programs as programs:
            plan = solve(maneuver, self.settings, programs=programs)
        peak = plan.peak if plan.keeps else math.inf
        return _Answer(peak, plan.lower_bound, plan.keeps, plan.obstacle_times, plan.crossing, plan.multipliers)

    def _at(self, maneuver: Maneuver, times: Array) -> _Answer:
        """At the obstacle times [s], (q,), as the grid places them."""
        _refuse(maneuver, times)
        with self._own.programs as programs:
            least = LeastPeak(maneuver, self.settings, programs=programs)
            placed, bracket, unit = least.place(times) * least.mass.time, least(times), least.mass.unit
        none = np.zeros((2 + len(placed), maneuver.dimension))
        multipliers = none if bracket.multipliers is None else bracket.multipliers
        found = math.isfinite(bracket.upper)
        return _Answer(bracket.upper * unit, bracket.lower * unit, found, placed, maneuver, multipliers)

    def _all_at(self, queries: list[Maneuver], times: list[Array]) -> list[_Answer]:
        """As `_at`, with all that is not difficult done at once by the exact method."""
        for maneuver, placed in zip(queries, times, strict=True):
            _refuse(maneuver, placed)
        done: dict[int, _Answer] = {}
        narrow = any(wall.opening is not None for wall in self.maneuver.walls)
        many = len(queries) if isinstance(self.settings.method, Exact) and not narrow else 0
        for first in range(0, many, TOGETHER):
            each = [PointMass.of(maneuver) for maneuver in queries[first : first + TOGETHER]]
            scaled = [at / mass.time for at, mass in zip(times[first : first + TOGETHER], each, strict=True)]
            found = extremals(PointMass.stacked(each), np.array(scaled))
            for k in np.flatnonzero(found.settled).tolist():
                ends = float(found.upper[k]) * each[k].unit, float(found.lower[k]) * each[k].unit
                at = scaled[k] * each[k].time
                done[first + k] = _Answer(*ends, True, at, queries[first + k], found.multipliers[k])
        every = enumerate(zip(queries, times, strict=True))
        return [done[k] if k in done else self._at(*asked) for k, asked in every]

    def _walls(self, walls: list[Wall] | ArrayLike) -> tuple[object, ...]:
        if isinstance(walls, list | tuple) and all(isinstance(wall, Wall) for wall in walls):
            return tuple(walls)
        tips, own = np.asarray(walls, dtype=float), self.maneuver.walls
        if tips.shape != (len(own), 2):
            raise SpecError(f"tips: was of shape {tips.shape}, must be {(len(own), 2)}, one for each wall")
        moved = iter(tips.tolist())
        return tuple(
            Wall(**(wall.model_dump() | {"tip": next(moved)})) if isinstance(wall, Wall) else wall
            for wall in self.maneuver.obstacles
        )


def _refuse(maneuver: Maneuver, times: Array) -> None:
    walls_only(maneuver, "given obstacle times")
    if times.shape != (len(maneuver.walls),) or not in_order(times, maneuver.duration):
        rising = (
            f"{len(maneuver.walls)} times that increase between 0 and {maneuver.duration}, by {APART} of it at least"
        )
        raise SpecError(f"obstacle_times: was {times.tolist()}, must be {rising}")
