"""Why an arm cannot do its task: its links do not get past the obstacles, or not with so small a peak."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

from ..plan.arm_plan import ArmPlan
from ..robots.extremes import Extremes
from ..robots.joint_space import FLOODS, flood
from ..scenes.impossible import Impossible
from ..scenes.kinds import LIMITED, scene_of
from ..scenes.passages import passages
from ..spec.arm import ArmManeuver
from .reasons import InTheWay, Reasons
from .repairs import Change, Repair, Trials, changed, downwards, left_out, longer, raised, tried, upwards, with_link

# of what a joint does at most: its unit, and by which power of the duration's factor it falls
FALLS = {"speed": ("rad/s", 1), "acceleration": ("rad/s²", 2), "torque": ("N m", 2)}
NARROWER = (0.9, 0.5)  # shares of the margin between links that are tried
MARGINS = (0.5, 0.25, 0.1, 0.0)  # shares of a margin that are tried, in this order
SLOWER = 1.002  # times the duration that time scaling asks for: what a control on holds needs more
HALVINGS = 2  # between a limit and one that is enough
STEP, TRIES = 0.15, 3  # by how much longer it is made where that is not enough, and how often


class ArmReasons(Reasons):
    """Of an arm's task."""

    task: ArmManeuver

    @property
    def entries(self) -> list[str]:
        return self.obstacles

    @cached_property
    def slow(self) -> Impossible | None:
        """Which joint cannot turn as far as it must, if one cannot."""
        return scene_of(self.task).impossible()

    @property
    def shut(self) -> bool:
        """Whether it is the obstacles alone that leave no motion."""
        return math.isinf(self.bounds.get(tuple(self.entries), 0.0))

    def bound(self, kept: list[str]) -> float | None:
        every = zip(self.obstacles, self.task.obstacles, strict=True)
        fewer = changed(self.task, obstacles=tuple(one for name, one in every if name in kept))
        if self.slow is not None:  # obstacles may leave no other posture
            return math.inf if scene_of(fewer).impossible() is not None else None
        if self.shut:
            return math.inf if closed(fewer) else None
        tried_out = self.trials.solve(fewer)
        return tried_out.bound if tried_out.status == "infeasible" else None

    def named(self, kept: list[str]) -> tuple[tuple[str, ...], str]:
        task = self.task
        if self.slow is not None:
            return (*kept, *self.slow.fields), self.slow.because
        if self.shut:
            margin = ("margin",) if task.margin and not closed(changed(task, margin=0.0)) else ()
            return (*kept, *margin), "the links cannot get past from start to goal, whatever they do"
        because = (
            f"max_peak {task.max_peak:.6g} m/s² is below {self.bounds[tuple(self.entries)]:.6g} m/s², "
            f"the least that any motion of the arm needs in {task.duration:.6g} s"
        )
        return (*kept, "max_peak", "duration"), because

    def repairs(self, fields: tuple[str, ...]) -> Iterator[Repair]:
        if self.slow is not None:
            return self._faster(self.slow, fields)
        return self._opened(fields) if self.shut else self._slower()

    def _faster(self, slow: Impossible, fields: tuple[str, ...]) -> Iterator[Repair]:
        """A longer duration, limits made as wide as a motion takes, or an obstacle left out."""
        for i, name in enumerate(self.obstacles):
            if name in fields:
                yield from self.trials.repair(left_out(self.task, i), 1.0)
        limits = [limit for limit in given_limits(self.task) if limit.power]
        yield from slower(self.task, self.trials, limits)
        for limit in limits:
            if limit.field in slow.fields:
                yield from widened(self.task, self.trials, limit)

    def _opened(self, fields: tuple[str, ...]) -> Iterator[Repair]:
        """Less margin, or an obstacle left out."""
        margin = self.task.margin
        less = Change(
            "margin",
            lambda share: changed(self.task, margin=share * margin),
            lambda share: f"margin {margin:.6g} m is too wide: {float(share) * margin:.6g} m would do",
            lambda share: 1 - share,
        )
        for share in MARGINS if margin else ():
            if not self.trials.over and not closed(changed(self.task, margin=share * margin)):
                yield from self.trials.repair(less, share)
                break
        for i, name in enumerate(self.obstacles):
            if name in fields:
                yield from self.trials.repair(left_out(self.task, i), 1.0)

    def _slower(self) -> Iterator[Repair]:
        """More peak, or more time: between poses at rest, D' = D sqrt(M / max_peak) makes the peak M to max_peak."""
        limit = self.task.limit
        free = self.trials.solve(changed(self.task, max_peak=None))
        if free.keeps:
            yield from self.trials.repair(raised(self.task, limit), free.peak)
            yield from self.trials.repair(longer(self.task), SLOWER * self.task.duration * math.sqrt(free.peak / limit))

    @staticmethod
    def in_the_way(plan: ArmPlan, trials: Trials) -> InTheWay | None:  # type: ignore[override]
        """A limit is, where the motion does not keep it or the task is solved with it made wider; or an obstacle."""
        task, excesses = plan.maneuver, () if plan.kept is None else plan.kept.excesses
        given = {limit.field: limit for limit in given_limits(task)}
        if plan.kept is not None:
            given = {one.field: given[one.field] for one in excesses if one.field in given}
        found = list(slower(task, trials, list(given.values())))
        found += [repair for limit in given.values() for repair in widened(task, trials, limit)]
        fields = tuple(given) if plan.joints is not None else tuple(repair.field for repair in found)
        if any(one.field == "obstacles" for one in excesses):
            without = [repair for i in range(len(task.obstacles)) for repair in trials.repair(left_out(task, i), 1.0)]
            found += without
            fields += tuple(repair.field for repair in without) or ("obstacles",)
        if any(one.field == "arm.self_margin" for one in excesses):
            fields += ("arm.self_margin",)
            found += (repair for share in NARROWER for repair in _closer(task, trials, share))
        because = "; ".join(plan.exceeded) or "no motion was found that keeps them"
        return InTheWay(fields, because, found) if fields else None


def _closer(task: ArmManeuver, trials: Trials, share: float) -> Iterator[Repair]:
    """A share of the margin between links, if the task is solved with it."""
    margin = task.arm.self_margin or 0.0
    less = Change(
        "arm.self_margin",
        lambda x: tried(task, arm=task.arm.model_copy(update={"self_margin": x * margin})),
        lambda x: f"arm.self_margin {margin:.6g} m: {float(x) * margin:.6g} m would do",
        lambda x: 1 - x,
    )
    yield from trials.repair(less, share)


@dataclass(frozen=True)
class Limit:
    """A limit of an arm's task that a motion may need more of.

    asked: its number [unit], or two;  to: the task with another, None for none, where it is one;  taken: what a motion
    takes, rounded to the side that helps;  power: of the duration's factor, by which that falls for a slower motion.
    """

    field: str
    unit: str
    asked: float | tuple[float, float]
    to: Callable[[float | tuple[float, float] | None], ArmManeuver | None]
    taken: Callable[[Extremes], float | tuple[float, float]]
    power: int


def given_limits(task: ArmManeuver) -> Iterator[Limit]:
    """Those that the task has, of its joints and its base."""
    for k, link in enumerate(task.arm.links):
        if link.limits is not None:
            yield Limit(
                f"arm.links[{k}].limits",
                "rad",
                link.limits,
                partial(_with, task, k, "limits"),
                partial(_range, k, link.limits),
                0,
            )
        for name, (unit, power) in FALLS.items():
            most = getattr(link, f"max_{name}")
            if most is not None:
                to, taken = partial(_with, task, k, f"max_{name}"), partial(_largest, k, name)
                yield Limit(f"arm.links[{k}].max_{name}", unit, most, to, taken, power)
    if task.max_moment is not None:
        taken = partial(_largest, 0, "torque")
        yield Limit("max_moment", "N m", task.max_moment, lambda x: tried(task, max_moment=x), taken, 2)


def _with(task: ArmManeuver, k: int, name: str, x: object) -> ArmManeuver | None:
    return with_link(task, k, **{name: x})


def _range(k: int, asked: tuple[float, float], found: Extremes) -> tuple[float, float]:
    low, high = -upwards_signed(-float(found.low[k])), upwards_signed(float(found.high[k]))
    return min(asked[0], low), max(asked[1], high)


def _largest(k: int, name: str, found: Extremes) -> float:
    return upwards(float(getattr(found, name)[k]))


def slower(task: ArmManeuver, trials: Trials, limits: list[Limit]) -> Iterator[Repair]:
    """A duration in which the motion found without these limits keeps them: D' = D max (taken / asked)^(1/power)."""
    names = {limit.field for limit in limits if limit.power}
    links = [
        link.model_copy(update={name: None for name in LIMITED if f"arm.links[{k}].{name}" in names})
        for k, link in enumerate(task.arm.links)
    ]
    moment = None if "max_moment" in names else task.max_moment
    free = tried(task, arm=task.arm.model_copy(update={"links": tuple(links)}), max_moment=moment)
    plan = None if free is None or not names or trials.over else trials.plan(free)
    if plan is None or not plan.keeps or plan.extremes is None:
        return
    factors = [1.0]
    for limit in limits:
        most = limit.taken(plan.extremes)
        if limit.power and isinstance(most, float) and isinstance(limit.asked, float):
            factors.append((most / limit.asked) ** (1 / limit.power))
    yield from trials.repair(longer(task, STEP, ""), SLOWER * task.duration * max(factors), TRIES)


def widened(task: ArmManeuver, trials: Trials, limit: Limit) -> Iterator[Repair]:
    """One limit made as wide as a motion that was found without it takes, if the task is then solved; halved in on."""
    free = limit.to(None)
    plan = None if free is None or trials.over else trials.plan(free)
    if plan is None or not plan.keeps or plan.extremes is None:
        return
    best = _with_other(trials, limit, limit.taken(plan.extremes))
    if best is not None and isinstance(limit.asked, float):
        low, high = limit.asked, limit.asked * (1 + best.cost)
        for _ in range(HALVINGS):
            middle = upwards((low + high) / 2)
            better = None if trials.over else _with_other(trials, limit, middle)
            low, high, best = (middle, high, best) if better is None else (low, middle, better)
    if best is not None:
        yield best


def _with_other(trials: Trials, limit: Limit, value: float | tuple[float, float]) -> Repair | None:
    """The task with another number for a limit, if it is solved so."""
    asked = limit.asked
    if isinstance(asked, tuple) and isinstance(value, tuple):
        said = f"[{asked[0]:.6g}, {asked[1]:.6g}] {limit.unit}: [{value[0]:.6g}, {value[1]:.6g}]"
        cost = (value[1] - value[0]) / (asked[1] - asked[0]) - 1
    else:
        assert isinstance(asked, float)
        assert isinstance(value, float)
        said, cost = f"{asked:.6g} {limit.unit}: {value:.6g}", value / asked - 1
    other = limit.to(value)
    if other is None or cost <= 0 or trials.over:
        return None
    found = trials.solve(other)
    return (
        Repair(limit.field, f"{limit.field} {said} {limit.unit} would do", other, found.peak, cost)
        if found.keeps
        else None
    )


def upwards_signed(x: float) -> float:
    """The next number of three digits, for any sign [any unit]."""
    return upwards(float(x)) if x >= 0 else -downwards(-float(x))


def closed(maneuver: ArmManeuver) -> bool:
    """Whether it is proved that no motion of a two-link arm leads from start to goal."""
    workspace = maneuver.workspace
    found = flood(workspace, FLOODS[-1])
    return all(found.parts(one.theta) for one in passages(maneuver, workspace))
