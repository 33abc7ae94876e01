"""The outer loop: M over the obstacle times, by the paper's sweep or refined around a first guess."""

from __future__ import annotations

import itertools
import json
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..byname import found
from ..deadline import after, over
from ..errors import SpecError
from ..files import csv_text
from ..plan.plan import Made, Plan, from_bracket, peak_of
from ..programs.least_peak import LeastPeak
from ..proofs.bounds import Proof
from ..scenes.blocks import WaysProof
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import Settings, SweepSearch
from ..spec.spec import refuse_unfit
from ..types import Array, Axes, Mask, Progress

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

    def document(self) -> dict[str, Any]:
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
) -> Sweep:
    """The least M at every obstacle time of a sweep (the paper's outer loop): one compilation, then re-solves.

    Ends at the settings' `time_limit` with the times that are done.

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
    if isinstance(settings, Settings) and not isinstance(settings.search, SweepSearch):
        settings = settings.model_copy(update={"search": SweepSearch()})
    if isinstance(maneuver, Maneuver):
        walls_only(maneuver, "a sweep")
    refuse_unfit(maneuver, settings)
    walls = len(maneuver.walls)
    if times is None:
        assert isinstance(settings.search, SweepSearch)
        span = settings.search.span(maneuver.duration)
        points = np.array(list(itertools.combinations(np.linspace(*span, settings.search.count), walls)))
    else:
        points = _given(times, walls)
    points = points.reshape(-1, walls) if walls else np.zeros((1, 0))
    _refuse(points, maneuver)
    until = after(settings.time_limit)
    least = LeastPeak(maneuver, settings, until=until)
    brackets = []
    for done, point in enumerate(points, 1):
        brackets.append(least(point))
        if progress:
            progress(done, len(points))
        if over(until):
            break
    asked, points = len(points), points[: len(brackets)]
    unit = least.mass.unit
    peaks = np.array([peak_of(b, settings.circle) for b in brackets]) * unit
    return Sweep(
        maneuver,
        settings,
        points[:, 0] if walls == 1 else points,
        peaks,
        np.array([b.lower for b in brackets]) * unit,
        plan_at(least, points[int(np.argmin(peaks))], began),
        asked,
    )


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


def plan_at(
    least: LeastPeak,
    times: Array,
    began: float,
    also: LeastPeak | None = None,
    nodes: int = 0,
    proof: Proof | WaysProof | None = None,
    of: Maneuver | None = None,
) -> Plan:
    """The plan at these obstacle times [s], shape (q,), with an account of the work since `began`.

    Args:
        began: a `time.perf_counter()`.
        also: another M(T_obs) that was used on the way.
        nodes: boxes of obstacle times looked at.
        proof: of all obstacle times.
        of: the maneuver with blocks or bounds on the path, where that of `least` has but the walls that it takes.
    """
    bracket, motion = least(times), least.motion(times)
    counts = [each.count for each in (least, also) if each is not None]
    made = Made(
        solver=least.settings.solver,
        compilations=sum(count.compilations for count in counts),
        solves=sum(count.solves for count in counts),
        nodes=nodes,
        seconds=time.perf_counter() - began,
    )
    walls, asked = least.maneuver.walls, of or least.maneuver
    return from_bracket(asked, least.settings, least.place(times), bracket, motion, proof, made, walls)
