"""The least peak as a function for other planners: many queries of one maneuver with other numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array
from .compiled import shared
from .errors import SpecError
from .obstacles import Wall
from .plan import Plan
from .search import solve
from .sensitivity import Sensitivities
from .spec import Exact, Maneuver, Settings, State


@dataclass(frozen=True)
class Peaks:
    """Answers to m queries past q walls.

    peak, lower_bound: [m/s^2], (m,), infinite and a bound where no control was found;  solved: (m,);
    obstacle_times: [s], (m, q);  sensitivities: derivatives of each peak, as `Plan.sensitivities`.
    """

    peak: Array
    lower_bound: Array
    solved: Array
    obstacle_times: Array
    sensitivities: tuple[Sensitivities, ...]

    @property
    def gap(self) -> Array:
        """(peak - lower_bound) / peak, (m,)."""
        return np.where(self.peak > 0, 1 - self.lower_bound / np.where(self.peak > 0, self.peak, 1.0), 0.0)


class PeakOracle:
    """Answers "how large must the peak be?" in a loop, every answer with its bound.

    One oracle serves any number of threads: each keeps programs of its own, compiled once for all queries of the same
    structure (walls, circle, grid). With the default settings nothing is compiled: the optimum is that of continuous
    time, at a few milliseconds a query (`benchmarks/bench_oracle.py` compares).

    Args:
        maneuver: what queries leave out is taken from it.
        settings: how to answer; default the exact method.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """

    def __init__(self, maneuver: Maneuver, settings: Settings | None = None) -> None:
        self.maneuver, self.settings = maneuver, settings or Settings(method=Exact())
        self.plan()

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
        fields: dict[str, object] = {}
        for name, given in (("start", start), ("goal", goal)):
            if given is not None:
                fields[name] = _state(name, given)
        if duration is not None:
            fields["duration"] = duration
        if walls is not None:
            fields["obstacles"] = self._walls(walls)
        every = {name: getattr(self.maneuver, name) for name in Maneuver.model_fields} | fields
        with shared():
            return solve(Maneuver(**every), self.settings)

    def peak(
        self,
        start: State | ArrayLike | None = None,
        goal: State | ArrayLike | None = None,
        duration: float | None = None,
        walls: list[Wall] | ArrayLike | None = None,
    ) -> float:
        """The least peak [m/s^2] of one query, as for `plan`; infinite where no control was found."""
        found = self.plan(start, goal, duration, walls)
        return found.peak if found.status == "solved" else np.inf

    def peaks(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        duration: ArrayLike | None = None,
        tips: ArrayLike | None = None,
    ) -> Peaks:
        """Many queries at once, whatever is given for each of m or once for all.

        Args:
            start, goal: (m, 2) or (m, 4), or (2,) or (4,): positions [m], at rest, or with velocities [m/s].
            duration: (m,) or one [s].
            tips: (m, q, 2) or (q, 2) [m], of the maneuver's own walls.

        Raises:
            SpecError: when shapes do not go together, or as for `plan`.
        """
        given = [
            (name, None if value is None else np.asarray(value, dtype=float), depth)
            for name, value, depth in (
                ("start", start, 1),
                ("goal", goal, 1),
                ("duration", duration, 0),
                ("tips", tips, 2),
            )
        ]
        sizes = {len(value) for _, value, depth in given if value is not None and value.ndim > depth}
        if len(sizes) > 1:
            raise SpecError(f"queries: was {sorted(sizes)} of a kind, must be as many of each, or one for all")
        m = sizes.pop() if sizes else 1
        plans = []
        for k in range(m):
            one = [None if value is None else value[k] if value.ndim > depth else value for _, value, depth in given]
            plans.append(self.plan(one[0], one[1], None if one[2] is None else float(one[2]), one[3]))
        return Peaks(
            np.array([plan.peak for plan in plans]),
            np.array([plan.lower_bound for plan in plans]),
            np.array([plan.status == "solved" for plan in plans]),
            np.array([plan.obstacle_times for plan in plans]).reshape(m, -1),
            tuple(plan.sensitivities for plan in plans),
        )

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


def _state(name: str, given: State | ArrayLike) -> State:
    if isinstance(given, State):
        return given
    numbers = np.asarray(given, dtype=float)
    if numbers.shape not in ((2,), (4,)):
        raise SpecError(f"{name}: was of shape {numbers.shape}, must be (2,), at rest, or (4,), with its velocity")
    return State(position=numbers[:2], velocity=numbers[2:] if len(numbers) == 4 else (0.0, 0.0))
