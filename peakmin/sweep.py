"""The outer loop: M over the obstacle times, by the paper's sweep or refined around a first guess."""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .bisection import LeastPeak
from .circle import Array, Polygon
from .errors import SpecError
from .grid import Uniform
from .plan import Made, Plan, from_bracket, peak_of
from .progress import Progress
from .spec import SOLVERS, Direct, Maneuver, RefineSearch, Settings, SweepSearch, check

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FINEST = 1e-4  # of the duration: `refine` stops here (an aligned M(T_obs) is flat to 1e-8 around its minimum)


@dataclass(frozen=True)
class Sweep:
    """M over T_obs.

    obstacle_times: as asked for [s], shape (points,) for one wall and (points, q) for several.
    peak, lower: the least M [m/s^2] lies between them at each point, for the settings' circle and grid; (points,).
    best: the plan at the winner.
    """

    maneuver: Maneuver
    settings: Settings
    obstacle_times: Array
    peak: Array
    lower: Array
    best: Plan

    @property
    def winner(self) -> int:
        """Index of the least peak."""
        return int(np.argmin(self.peak))

    def plot(self, ax: Axes | None = None) -> Axes:
        """M over T_obs (the paper's figure 7), one wall only."""
        from .plots import peak_over_time

        return peak_over_time(self, ax=ax)

    def document(self) -> dict[str, Any]:
        """The sweep as plain JSON data."""
        return {
            "version": 1,
            "status": self.best.status,
            "obstacle_times": self.obstacle_times.tolist(),
            "peak": [p if np.isfinite(p) else None for p in self.peak.tolist()],
            "lower": self.lower.tolist(),
            "winner": self.winner,
            "best": self.best.document(),
        }

    def to_json(self, indent: int | None = None) -> str:
        """The sweep as one JSON document."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    def to_csv(self) -> str:
        """Rows of obstacle times [s], least M and its lower end [m/s^2]."""
        times = self.obstacle_times.reshape(len(self.peak), -1)
        head = ",".join([*(f"T_{i + 1}" for i in range(times.shape[1])), "peak", "lower"])
        rows = np.column_stack([times, self.peak, self.lower])
        return "\n".join([head, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def sweep(
    maneuver: Maneuver,
    settings: Settings | None = None,
    times: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """The least M at every obstacle time of a sweep (the paper's outer loop): one compilation, then re-solves.

    Args:
        maneuver: with q walls.
        settings: `search` gives start, stop and count; anything but a sweep means the default 18 times.
        times: obstacle times [s] to use instead, shape (points,) or (points, q).
        progress: called with (done, total) after every point.

    Raises:
        SpecError: when the settings or times do not fit the maneuver.
    """
    began = time.perf_counter()
    settings = settings or Settings()
    if not isinstance(settings.search, SweepSearch):
        settings = settings.model_copy(update={"search": SweepSearch()})
    check(maneuver, settings)
    walls = len(maneuver.obstacles)
    if times is None:
        assert isinstance(settings.search, SweepSearch)
        span = settings.search.span(maneuver.duration)
        points = np.array(list(itertools.combinations(np.linspace(*span, settings.search.count), walls)))
    else:
        points = np.asarray(times, dtype=float)
    points = points.reshape(-1, walls) if walls else np.zeros((1, 0))
    _refuse(points, maneuver)
    least = LeastPeak(maneuver, settings)
    brackets = []
    for done, point in enumerate(points, 1):
        brackets.append(least(point))
        if progress:
            progress(done, len(points))
    unit = least.program.mass.unit
    peaks = np.array([peak_of(b, settings.circle) for b in brackets]) * unit
    return Sweep(
        maneuver,
        settings,
        points[:, 0] if walls == 1 else points,
        peaks,
        np.array([b.lower for b in brackets]) * unit,
        _plan(least, points[int(np.argmin(peaks))], [least], began),
    )


def _refuse(points: Array, maneuver: Maneuver) -> None:
    ends = np.zeros((len(points), 1)), np.full((len(points), 1), maneuver.duration)
    bad = ~np.all(np.diff(np.hstack([ends[0], points, ends[1]]), axis=1) > 0, axis=1)
    if np.any(bad) and points.shape[1]:
        index = int(np.argmax(bad))
        raise SpecError(
            f"times[{index}]: was {points[index].tolist()}, must increase strictly between 0 and {maneuver.duration}"
        )


def _plan(least: LeastPeak, times: Array, used: Iterable[LeastPeak], began: float) -> Plan:
    program = least.program
    used = list(used)
    made = Made(
        solver=least.settings.solver,
        compilations=sum(each.program.count.compilations for each in used),
        solves=sum(each.program.count.solves for each in used),
        seconds=time.perf_counter() - began,
    )
    placed = least.place(times) / program.mass.time
    return from_bracket(program.maneuver, least.settings, program.mass, placed, least(times), made)


def refine(maneuver: Maneuver, settings: Settings, progress: Progress | None = None) -> Plan:
    """A sweep with n = 1 over the whole duration (the paper's good initial guess), then closer with the real circle.

    Each round asks around the winner at half the spacing of the round before, until it is 1e-4 of the duration
    or half a node of a uniform grid.
    """
    began = time.perf_counter()
    check(maneuver, settings)
    walls, duration = len(maneuver.obstacles), maneuver.duration
    least = LeastPeak(maneuver, settings)
    if not walls:
        return _plan(least, np.zeros(0), [least], began)
    coarse_solver = settings.solver if settings.solver in SOLVERS["polygon"] else "CLARABEL"
    coarse = LeastPeak(
        maneuver,
        settings.model_copy(update={"method": Direct(), "solver": coarse_solver}),
        circle=Polygon(segments=1),
    )
    spacing = duration / (settings.search.count + 1)
    points = list(itertools.combinations(spacing * np.arange(1, settings.search.count + 1), walls))
    ends: list[float] = []
    for done, point in enumerate(points, 1):
        ends.append(coarse(np.array(point)).upper)
        if progress:
            progress(done, len(points))
    best = np.array(points[int(np.argmin(ends))])
    finest = duration * (max(FINEST, 0.5 / settings.grid.steps) if isinstance(settings.grid, Uniform) else FINEST)
    while spacing > finest:
        best = min(_around(best, spacing, duration), key=lambda point: peak_of(least(point), settings.circle))
        spacing /= 2
    return _plan(least, best, [coarse, least], began)


def _around(best: Array, spacing: float, duration: float) -> Iterator[Array]:
    """The ordered obstacle times within one spacing of the best ones, the best itself first."""
    yield best
    offsets = (-1.0, -0.5, 0.0, 0.5, 1.0) if len(best) == 1 else (-1.0, 0.0, 1.0)
    for offset in itertools.product(offsets, repeat=len(best)):
        point = best + spacing * np.array(offset)
        if np.all(np.diff([0.0, *point, duration]) > 0):
            yield point


def solve(maneuver: Maneuver, settings: Settings | None = None, progress: Progress | None = None) -> Plan:
    """The maneuver of least peak base reaction force, best over the obstacle times that the search visits.

    Args:
        maneuver: what to do.
        settings: how; default an exact disc, 200 aligned holds, M as a variable, `refine`.
        progress: called with (done, total).

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """
    settings = settings or Settings()
    if isinstance(settings.search, RefineSearch):
        return refine(maneuver, settings, progress)
    return sweep(maneuver, settings, progress=progress).best
