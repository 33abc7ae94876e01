"""Why a maneuver of a centre of mass is impossible: too short a time, too little peak, speed or room."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import shapely

from ..errors import SpecError
from ..geometry.norm import length
from ..proofs.branch_and_bound import least_over_times
from ..scenes.cells import Cells
from ..scenes.impossible import impossible, least_way
from ..scenes.kinds import scene_of
from ..search.held import Hold
from ..search.job import Job
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..spec.settings import Aligned, Exact
from .reasons import Reasons
from .repairs import FINEST, Change, Repair, changed, downwards, left_out, longer, raised, tried

LIMITS = ("region", "max_speed", "max_peak")
ROUGH = 1e-2  # relative, as FINEST, with blocks, a region or a speed
OPENED = 3  # changes that are tried where one just leaves a way, likewise
COARSE, STEPS = 40, 4  # holds of a quick look; changes that are tried with the real settings, each a little larger
NEAREST = 1e-6  # relative, as FINEST, where no solve is needed
SHARPER = 4  # halvings with the real settings
MOST = 1e3  # times the entry: larger changes are not looked for
FURTHEST = 10.0  # times the maneuver's size: nothing is moved further


class PointReasons(Reasons):
    """Of a centre of mass's maneuver."""

    task: Maneuver

    @property
    def entries(self) -> list[str]:
        return self.obstacles + [name for name in LIMITS if getattr(self.task, name) is not None]

    def bound(self, kept: list[str]) -> float | None:
        fewer = self._only(kept)
        return None if fewer is None else self._refuted_by(fewer)

    def named(self, kept: list[str]) -> tuple[tuple[str, ...], str]:
        task, fewer = self.task, self._only(kept)
        assert fewer is not None
        fields = list(kept)
        if task.margin and fewer.blocks and self._refuted_by(changed(fewer, margin=0.0)) is None:
            fields.append("margin")
        shown = impossible(fewer)
        if shown is not None:
            with_time = ["duration"] if "duration" in shown.fields else []
            return tuple(dict.fromkeys(fields + with_time)), _renamed(shown.because, kept)
        bound = max(self.bounds[tuple(kept)], self.trials.solve(changed(fewer, max_peak=None)).bound)
        past = ", ".join(name for name in kept if name in self.obstacles)
        because = (
            f"max_peak {task.max_peak:.6g} m/s² is below {bound:.6g} m/s², the least that any control needs in "
            f"{task.duration:.6g} s" + (f" past {past}" if past else "")
        )
        return (*fields, "duration"), because

    def repairs(self, fields: tuple[str, ...]) -> Iterator[Repair]:
        bounds = {"max_peak": self._higher_peak, "duration": self._other_duration, "max_speed": self._higher_speed}
        for field, repaired in bounds.items():
            if field in fields:
                yield from repaired()
        conflicting = [i for i, name in enumerate(self.obstacles) if name in fields]
        if self.task.margin and conflicting:
            yield from self._less_margin()
        for i in conflicting:
            one = self.task.obstacles[i]
            if isinstance(one, Wall):
                yield from self._wall_back(i, one)
            else:
                yield from self.trials.repair(left_out(self.task, i), 1.0)
        if "region" in fields:
            yield from self._larger_region()

    def _only(self, kept: list[str]) -> Maneuver | None:
        """With these entries alone; None where it would be refused, as walls that become neighbours may be."""
        every = zip(self.obstacles, self.task.obstacles, strict=True)
        limits = {name: getattr(self.task, name) if name in kept else None for name in LIMITS}
        return tried(self.task, obstacles=tuple(one for name, one in every if name in kept), **limits)

    def _refuted_by(self, maneuver: Maneuver) -> float | None:
        """A bound [m/s^2] above its max_peak, infinite where no peak would do; None where nothing is proved."""
        if impossible(maneuver) is not None:
            return math.inf
        if maneuver.max_peak is None:
            return None
        tried_out = self.trials.solve(maneuver)
        return tried_out.bound if tried_out.status == "infeasible" and tried_out.bound > maneuver.max_peak else None

    @property
    def _more(self) -> float:
        return 5 * FINEST if self.task.simple else 2 * ROUGH

    @property
    def _size(self) -> float:
        """Of the maneuver [m]."""
        states, walls = (self.task.start, self.task.goal), self.task.walls
        points = [*(state.position for state in states), *(wall.tip for wall in walls)]
        return float(np.max(np.ptp(np.array(points), axis=0))) or 1.0

    def _repaired(self, change: Change[Maneuver], low: float, first: float, most: float) -> Iterator[Repair]:
        """The least change, x above `low`, that helps."""
        yield from self.trials.repair(change, self._least(change.to, low, first, most), STEPS)

    def _higher_peak(self) -> Iterator[Repair]:
        free = self.trials.solve(changed(self.task, max_peak=None))
        yield from self.trials.repair(raised(self.task, self.task.limit, self._more), free.peak, STEPS)

    def _other_duration(self) -> Iterator[Repair]:
        task, D = self.task, self.task.duration
        yield from self._repaired(longer(task, self._more), D, 0.1 * D, MOST * D)
        if any(task.start.velocity) and any(task.goal.velocity):  # else what is quick enough can wait at rest
            shorter = functools.partial(_less, task, "duration")
            change = Change(
                "duration",
                shorter,
                lambda x: f"duration {D:.6g} s is too long: {D - float(x):.6g} s would do",
                lambda x: x / D,
                self._more,
            )
            yield from self._repaired(change, 0.0, 0.05 * D, D)

    def _higher_speed(self) -> Iterator[Repair]:
        task, v, slowest = self.task, self.task.max_speed, least_way(self.task) / self.task.duration
        assert v is not None
        faster = Change(
            "max_speed",
            lambda x: tried(task, max_speed=x),
            "raise max_speed to {} m/s".format,
            lambda x: x / v - 1,
            self._more,
        )
        yield from self._repaired(faster, slowest, 0.1 * slowest, MOST * slowest)

    def _wall_back(self, i: int, wall: Wall) -> Iterator[Repair]:
        verb = "lower" if wall.direction[0] == 0 and wall.direction[1] < 0 else "draw back"
        wider = "" if wall.opening is None else ", its opening as much wider"
        tip, size = f"obstacles[{i}].tip", self._size
        words = f"{verb} {tip} by {{}} m{wider}".format
        back = Change(tip, functools.partial(_drawn_back, self.task, i, wall), words, lambda x: x / size, self._more)
        yield from self._repaired(back, 0.0, 1e-3 * size, FURTHEST * size)

    def _less_margin(self) -> Iterator[Repair]:
        margin = self.task.margin
        words = f"margin {margin:.6g} m is too wide: {{}} m would do".format
        less, at = functools.partial(_less, self.task, "margin"), functools.partial(tried, self.task)
        change = Change("margin", lambda m: at(margin=m), words, lambda m: 1 - m / margin, -ROUGH / 2, downwards)
        low = self._opening(lambda x: at(margin=max(margin - x, 0.0)), 0.0, margin / 8, margin)
        yield from self._past_opening(change, less, low, margin / 8, margin, lambda x: max(margin - x, 0.0))

    def _larger_region(self) -> Iterator[Repair]:
        size, words = self._size, "move the edges of region outward by {} m".format
        larger = functools.partial(_grown, self.task)
        change = Change("region", larger, words, lambda x: x / size, self._more)
        first, most = 1e-3 * size, FURTHEST * size
        low = self._opening(larger, 0.0, first, most) if self.task.blocks else 0.0
        yield from self._past_opening(change, larger, low, first, most, lambda x: x)

    def _past_opening(
        self,
        change: Change[Maneuver],
        to: Callable[[float], Maneuver | None],
        low: float | None,
        first: float,
        most: float,
        said: Callable[[float], float],
    ) -> Iterator[Repair]:
        """The change by x = low > 0, the least that leaves a way, if what is then left can be done; else by more.

        Args:
            to: the task for x;  first, most: as in `_least`;  said: what the change takes for x.
        """
        if low is None:
            return
        wider = low * (1 + NEAREST)  # what just touches counts as closed
        opened = list(self.trials.repair(change, said(wider), OPENED)) if low > 0 else []
        yield from opened
        if not opened:
            x = self._least(to, low, first, most)
            yield from self.trials.repair(change, None if x is None else said(x), STEPS)

    def _opening(self, to: Callable[[float], Maneuver | None], low: float, first: float, most: float) -> float | None:
        """About the least x from `low` on that leaves a way past the blocks, as far as is known without a solve.

        Without such an x that is at most `most` above, None.
        """
        if _leaves_a_way(to(low)):
            return low
        return self._halved(lambda x: _leaves_a_way(to(x)), low, first, most, NEAREST)

    def _least(self, change: Callable[[float], Maneuver | None], low: float, first: float, most: float) -> float | None:
        """About the least x above `low` that helps, at most `most` above, steps growing from `first`; or None."""
        start = change(low + first)
        simple = start is not None and start.simple
        high = self._halved(lambda x: self._helps(change(x)), low, first, most, FINEST if simple else ROUGH)
        if high is None or start is None or simple or start.blocks:
            return high
        return self._sharper(change, high, high - first)

    def _halved(
        self, helps: Callable[[float], bool], low: float, first: float, most: float, finest: float
    ) -> float | None:
        """Nearly the least x that helps, to `finest` of itself, at most `most` above `low`, which does not; or None."""
        step, high = first, low + first
        while not helps(high):
            low, step = high, 2 * step
            high = low + step
            if step > most or self.trials.over:
                return None
        while high - low > finest * high and not self.trials.over:
            middle = (low + high) / 2
            low, high = (low, middle) if helps(middle) else (middle, high)
        return high

    def _sharper(self, change: Callable[[float], Maneuver | None], high: float, below: float) -> float:
        """Less than x = high, at most by `below`: a quick look at a region or a speed asks for more than it takes."""
        for _ in range(SHARPER):
            if below <= ROUGH * high or self.trials.over:
                break
            below /= 2
            maneuver = change(high - below)
            if maneuver is not None and self.trials.solve(maneuver).keeps:
                high -= below
        return high

    def _helps(self, maneuver: Maneuver | None) -> bool:
        """Whether it is solved, as a quick look tells: at the times that are best without region and speed."""
        if self.trials.over or maneuver is None or impossible(maneuver) is not None:
            return False
        grid = Aligned(steps=COARSE)
        if maneuver.simple or maneuver.blocks:
            exact = maneuver.simple and isinstance(self.trials.settings.circle, Disc)
            quick = self.trials.settings.model_copy(update={"method": Exact()} if exact else {"grid": grid})
            return self.trials.solve(maneuver, quick).keeps
        until, scene = self.trials.until, scene_of(maneuver)
        job = replace(Job.begun(self.trials.settings, None, None), until=until)
        times = least_over_times(scene.mass, 1e-3, until=until).times
        held = Hold(scene, maneuver.past(maneuver.walls), job, steps=grid.steps).at(times)
        return held is not None and held.bracket.upper * scene.mass.unit <= maneuver.limit


def _leaves_a_way(maneuver: Maneuver | None) -> bool:
    """Whether there is no proof, by lengths, areas and the gaps between blocks, that nothing can be done."""
    if maneuver is None:
        return False
    try:
        return impossible(maneuver) is None and (not maneuver.blocks or Cells(maneuver).ways is not None)
    except SpecError:  # walls that stand askew beside blocks
        return False


def _renamed(text: str, kept: list[str]) -> str:
    """Indices of the reduced maneuver's obstacles as those of the whole one."""
    names = [name for name in kept if name.startswith("obstacles")]
    for k in range(len(names) - 1, -1, -1):
        text = text.replace(f"obstacles[{k}]", names[k].replace("[", "<").replace("]", ">"))
    return text.replace("<", "[").replace(">", "]")


def _less(maneuver: Maneuver, field: str, x: float) -> Maneuver | None:
    """With an entry less by x, by the number that is then said of it."""
    return tried(maneuver, **{field: max(float(f"{getattr(maneuver, field) - x:.6g}"), 0.0)})


def _drawn_back(maneuver: Maneuver, i: int, wall: Wall, x: float) -> Maneuver | None:
    """With a wall's tip moved by x [m] along its direction; what stands across its opening stays."""
    along = np.array(wall.direction) / length(wall.direction)
    opening = None if wall.opening is None else wall.opening + x
    moved = wall.model_copy(update={"tip": tuple((np.array(wall.tip) + x * along).tolist()), "opening": opening})
    return tried(maneuver, obstacles=(*maneuver.obstacles[:i], moved, *maneuver.obstacles[i + 1 :]))


def _grown(maneuver: Maneuver, x: float) -> Maneuver | None:
    """With the region's edges moved outward by x [m]."""
    ring = shapely.Polygon(maneuver.region).buffer(x, join_style="mitre", mitre_limit=100).exterior
    return tried(maneuver, region=tuple((a, b) for a, b in list(ring.coords)[:-1]))
