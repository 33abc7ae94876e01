"""The outer loop: M over the obstacle times, by the paper's sweep or refined around a first guess."""

from __future__ import annotations

import itertools
import json
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..byname import found
from ..deadline import over, part
from ..errors import SpecError
from ..files import csv_text
from ..plan.answer import plan_of
from ..plan.plan import Plan
from ..programs.least_peak import LeastPeak
from ..programs.program import Programs
from ..scenes.kinds import PointScene, scene_of
from ..spec.control_set import Polygon
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import SOLVERS, Direct, RefineSearch, Settings, SweepSearch, Uniform
from ..spec.spec import refuse_other, refuse_unfit
from ..types import Array, Axes, Json, Mask, Progress
from .job import Best, Job

FINEST = 1e-4  # of the duration: `refined` stops here (an aligned M(T_obs) is flat to 1e-8 around its minimum)
APART = 1e-15  # of the duration: least time between two walls that are asked for


@dataclass(frozen=True, repr=False)
class Sweep:
    """M over T_obs.

    obstacle_times: as asked for [s], shape (points,) for one wall and (points, q) for several.
    peak: a bound on |acceleration| that the best control found keeps at each point [m/s^2], (points,); infinite where
    there is none, or the time limit came first;  lower: no control of the settings' circle and grid has a smaller M
    there.
    best: the plan at the winner.
    asked: how many points were asked for; fewer are done where the time was over before.
    """

    maneuver: Maneuver
    settings: Settings
    obstacle_times: Array
    peak: Array
    lower: Array
    best: Plan
    asked: int

    @property
    def winner(self) -> int:
        """Index of the least peak."""
        return int(np.argmin(self.peak))

    def __repr__(self) -> str:
        return f"Sweep({len(self.peak)} of {self.asked} obstacle times, best={self.best})"

    def plot(self, ax: Axes | None = None) -> Axes:
        """M over T_obs (the paper's figure 7), one wall only."""
        return found("peakmin.view.curves:peak_over_time")(self, ax=ax)

    def document(self) -> Json:
        """The sweep as plain JSON data."""
        return {
            "version": 1,
            "status": self.best.status,
            "obstacle_times": self.obstacle_times.tolist(),
            "peak": [p if np.isfinite(p) else None for p in self.peak.tolist()],
            "lower": self.lower.tolist(),
            "winner": self.winner,
            "asked": self.asked,
            "best": self.best.document(),
        }

    def to_json(self, *, indent: int | None = None) -> str:
        """The sweep as one JSON document."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    def to_csv(self) -> str:
        """Rows of obstacle times [s], least M and its lower end [m/s^2]."""
        times = self.obstacle_times.reshape(len(self.peak), -1)
        head = [*(f"T_{i + 1}" for i in range(times.shape[1])), "peak", "lower"]
        return csv_text(head, np.column_stack([times, self.peak, self.lower]).tolist())


def sweep(
    maneuver: Maneuver,
    settings: Settings | None = None,
    times: ArrayLike | None = None,
    progress: Progress | None = None,
    programs: Programs | None = None,
    stopped: threading.Event | None = None,
) -> Sweep:
    """The least M at every obstacle time of a sweep (the paper's outer loop): one compilation, then re-solves.

    Ends at the settings' `time_limit` with the times that are done.

    Args:
        maneuver: with q walls.
        settings: `search` gives start, stop and count; anything but a sweep means the default 18 times.
        times: obstacle times [s] to use instead, shape (points,) or (points, q).
        progress: called with (done, total) after every point.
        programs: where compiled programs are taken from; default a place of its own.
        stopped: to be set when the sweep is to end with the times that are done.

    Raises:
        SpecError: when the settings or times do not fit the maneuver.
    """
    settings = settings or Settings()
    if isinstance(settings, Settings) and not isinstance(settings.search, SweepSearch):
        settings = settings.model_copy(update={"search": SweepSearch(accept=settings.search.accept)})
    refuse_other(maneuver, Maneuver)
    walls_only(maneuver, "a sweep")
    refuse_unfit(maneuver, settings)
    return swept(scene_of(maneuver), Job.begun(settings, progress, programs, stopped), times)


def swept(scene: PointScene, job: Job, times: ArrayLike | None = None) -> Sweep:
    """The sweep of a scene whose settings fit it, as `sweep`."""
    least, points, asked = _measured(scene.task, job, times)
    peaks = np.array([least.bound(point) for point in points])
    return Sweep(
        scene.task,
        job.settings,
        np.squeeze(points, axis=1) if points.shape[1] == 1 else points,
        peaks,
        np.array([least(point).lower for point in points]) * least.mass.unit,
        plan_of(scene, job.settings, job.at(Best(least, points[int(np.argmin(peaks))]))),
        asked,
    )


def best_of_sweep(maneuver: Maneuver, job: Job) -> Best:
    """The best of the obstacle times that are looked at."""
    least, points, _ = _measured(maneuver, job, None)
    return Best(least, min(points, key=least.bound))


def _measured(maneuver: Maneuver, job: Job, times: ArrayLike | None) -> tuple[LeastPeak, Array, int]:
    """M at the obstacle times given, or those of the settings: at which it is known [s], (points, q), of how many."""
    walls, search = len(maneuver.walls), job.settings.search
    if times is None:
        assert isinstance(search, SweepSearch)
        span = search.span(maneuver.duration)
        points = np.array(list(itertools.combinations(np.linspace(*span, search.count), walls)))
    else:
        points = _given(times, walls)
    points = points.reshape(-1, walls) if walls else np.zeros((1, 0))
    _refuse(points, maneuver)
    least, done = job.least(maneuver), 0
    for done, point in enumerate(points, 1):
        least(point)
        if job.progress:
            job.progress(done, len(points))
        if over(job.until):
            break
    return least, points[:done], len(points)


def refined(maneuver: Maneuver, job: Job) -> Best:
    """A sweep with n = 1 over the whole duration (the paper's good initial guess), then closer with the real circle."""
    settings, walls = job.settings, len(maneuver.walls)
    assert isinstance(settings.search, RefineSearch)
    least, count = job.least(maneuver), settings.search.count
    if not walls:
        return Best(least, np.zeros(0))
    coarse_solver = settings.solver if settings.solver in SOLVERS["polygon"] else "CLARABEL"
    quick = settings.model_copy(update={"method": Direct(), "solver": coarse_solver})
    coarse = replace(job, settings=quick).least(maneuver, Polygon(segments=1))
    spacing = maneuver.duration / (count + 1)
    points = list(itertools.combinations(spacing * np.arange(1, count + 1), walls))
    ends: list[float] = []
    part_of_it = part(job.until)
    for done, point in enumerate(points, 1):
        ends.append(coarse(np.array(point)).upper)
        if job.progress:
            job.progress(done, len(points))
        if over(part_of_it):
            break
    best = closer(least, np.array(points[int(np.argmin(ends))]), spacing, job.until)
    return Best(least, best, others=(coarse.count,))


def closer(least: LeastPeak, best: Array, spacing: float, until: float) -> Array:
    """Better obstacle times [s] near the given ones, shape (q,).

    Each round asks around the winner at half the spacing of the round before, until it is 1e-4 of the duration or
    half a node of a uniform grid, or the time is over.
    """
    grid, duration = least.settings.grid, least.mass.time
    finest = duration * (max(FINEST, 0.5 / grid.steps) if isinstance(grid, Uniform) else FINEST)
    while spacing > finest and not over(until):
        around = itertools.takewhile(lambda _: not over(until), _around(best, spacing, duration))
        best = min(around, key=least.bound, default=best)
        spacing /= 2
    return best


def _around(best: Array, spacing: float, duration: float) -> Iterator[Array]:
    """The ordered obstacle times within one spacing of the best ones, the best itself first."""
    yield best
    offsets = (-1.0, -0.5, 0.0, 0.5, 1.0) if len(best) == 1 else (-1.0, 0.0, 1.0)
    for offset in itertools.product(offsets, repeat=len(best)):
        point = best + spacing * np.array(offset)
        if np.all(np.diff([0.0, *point, duration]) > 0):
            yield point


def _given(times: ArrayLike, walls: int) -> Array:
    try:
        points = np.asarray(times, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.size == 0 or points.ndim > 2 or ((points.ndim == 2 or walls != 1) and points.shape[-1] != walls):
        wanted = "(points,)" if walls == 1 else f"(points, {walls})"
        raise SpecError(f"times: was an array of shape {np.shape(times)}, must be numbers of shape {wanted}")
    return points


def _refuse(points: Array, maneuver: Maneuver) -> None:
    bad = ~in_order(points, maneuver.duration)
    if np.any(bad) and points.shape[1]:
        index = int(np.argmax(bad))
        raise SpecError(
            f"times[{index}]: was {points[index].tolist()}, must increase between 0 and {maneuver.duration}, "
            f"by {APART} of it at least"
        )


def in_order(times: Array, duration: float) -> Mask:
    """Whether obstacle times [s], (..., q), increase between the ends, by enough for arithmetic to tell them apart."""
    ends = np.zeros((*times.shape[:-1], 1))
    return np.asarray(
        np.all(np.diff(np.concatenate([ends, times, ends + duration], axis=-1)) > APART * duration, axis=-1)
    )
