"""Changes of single entries that let a task be done, each tried out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar, overload

from ..deadline import Deadline, after, left, over, stopped_by
from ..errors import SpecError
from ..plan.arm_plan import ArmPlan
from ..plan.plan import KEEPS, Plan
from ..search.solve import solve
from ..spec.arm import ArmManeuver
from ..spec.settings import Settings
from ..spec.task import Task

LEAST = 0.05  # s, of a solve
FINEST = 1e-3  # relative: to which the least change is looked for; what is said is rounded to three digits
SHARE, SHORTEST = 1 / 3, 1.0  # of the time that is left, for one try, and s that it has at least
T = TypeVar("T", bound=Task)


def upwards(x: float, digits: int = 3) -> float:
    """The next number of so many digits [any unit]."""
    if not x > 0 or math.isinf(x):
        return x
    unit = 10.0 ** (math.floor(math.log10(x)) - digits + 1)
    return float(f"{math.ceil(x / unit * (1 - 1e-12)) * unit:.{digits}g}")


def downwards(x: float, digits: int = 3) -> float:
    """The number of so many digits before, or x itself [any unit]."""
    if not x > 0 or math.isinf(x):
        return x
    unit = 10.0 ** (math.floor(math.log10(x)) - digits + 1)
    return float(f"{math.floor(x / unit * (1 + 1e-12)) * unit:.{digits}g}")


@dataclass(frozen=True)
class Repair:
    """One entry changed, and solved so.

    field: its path in the maneuver;  text: the change in words;  maneuver: with it;  peak: then reached [m/s^2];
    cost: how large the change is, relative to what was there or to the maneuver's size.
    """

    field: str
    text: str
    maneuver: Task
    peak: float
    cost: float


@dataclass(frozen=True)
class Change(Generic[T]):
    """One entry of a task, changed by a number x.

    to: the task for x, None where it would be refused;  text: for x in words;  cost: of x;  more: share by which x is
    made larger where the settings' own control needs it, below zero if smaller;  rounded: x as it is said, to the side
    that helps.
    """

    field: str
    to: Callable[[float], T | None]
    text: Callable[[str], str]
    cost: Callable[[float], float]
    more: float = 5 * FINEST
    rounded: Callable[[float], float] = upwards


class Tried(NamedTuple):
    """What a solve came to: peak and bound [m/s^2]; status "refused" where the changed task is none."""

    status: str
    peak: float
    bound: float

    @property
    def keeps(self) -> bool:
        """Whether a motion that keeps all of it was found."""
        return self.status in KEEPS


class Trials:
    """Solves of changed tasks, until the time is over; none takes more than a share of what is left.

    cut: whether one ended by that without an answer.
    """

    def __init__(self, settings: Settings, until: float) -> None:
        self.settings, self.until, self.cut = settings, until, False

    @property
    def over(self) -> bool:
        """Whether nothing more is tried."""
        return over(self.until)

    def solve(self, task: Task, settings: Settings | None = None) -> Tried:
        """What the settings, by default the user's own, make of a task in the time that is left."""
        if left(self.until) <= 0:
            return Tried("unknown", math.inf, 0.0)
        plan = self.plan(task, settings)
        return Tried("refused", math.inf, 0.0) if plan is None else Tried(plan.status, plan.peak, plan.lower_bound)

    @overload
    def plan(self, task: ArmManeuver, settings: Settings | None = None) -> ArmPlan | None: ...
    @overload
    def plan(self, task: Task, settings: Settings | None = None) -> Plan | None: ...
    def plan(self, task: Task, settings: Settings | None = None) -> Plan | None:
        """The plan likewise; None where the changed task is refused."""
        until = self.part(SHARE, SHORTEST)
        try:
            plan = solve(task, limited(settings or self.settings, until), stopped=stopped_by(until))
        except SpecError:
            return None
        self.cut |= plan.status == "unknown" and over(until)
        return plan

    def part(self, share: float, least: float = 0.0) -> Deadline:
        """The deadline after this share of the time that is left, and after `least` [s] of it."""
        rest = left(self.until)
        return after(min(rest, max(share * rest, least)), stopped_by(self.until))

    def repair(self, change: Change[T], x: float | None, most: int = 1) -> Iterator[Repair]:
        """The change by x rounded if that is solved, else by a little more.

        Args:
            x: None where no change was found;  most: how many are tried.
        """
        for _ in range(most):
            if x is None or self.over:
                return
            x = change.rounded(x)
            task = change.to(x)
            if task is not None:
                tried_out = self.solve(task)
                if tried_out.keeps:
                    yield Repair(change.field, change.text(f"{x:.6g}"), task, tried_out.peak, change.cost(x))
                    return
            x *= 1 + change.more


def limited(settings: Settings, until: float) -> Settings:
    """Settings of one solve of many, which goes on for no longer than all of them may."""
    rest = left(until)
    if math.isinf(rest):
        return settings
    return settings.model_copy(update={"time_limit": min(max(rest, LEAST), settings.time_limit or math.inf)})


def changed(task: T, **fields: object) -> T:
    """The task with other entries, checked anew. Raises `SpecError`."""
    return type(task)(**({name: getattr(task, name) for name in type(task).model_fields} | fields))


def tried(task: T, **fields: object) -> T | None:
    """The same, None where it would be refused."""
    try:
        return changed(task, **fields)
    except SpecError:
        return None


def raised(task: T, limit: float, more: float = 5 * FINEST) -> Change[T]:
    """A `max_peak` of x instead of the limit that it is [m/s^2]."""
    return Change(
        "max_peak",
        lambda x: tried(task, max_peak=x),
        "raise max_peak to {} m/s²".format,
        lambda x: x / limit - 1,
        more,
    )


def longer(task: T, more: float = 5 * FINEST, short: str = " is too short") -> Change[T]:
    """A duration of x [s]; short: what is said of the one asked for, nothing where it is not proved."""
    D = task.duration
    words = f"duration {D:.6g} s{short}: {{}} s would do".format
    return Change("duration", lambda x: tried(task, duration=x), words, lambda x: x / D - 1, more)


def with_link(task: ArmManeuver, k: int, **fields: object) -> ArmManeuver | None:
    """The task with other entries of one link, None where it would be refused."""
    links = list(task.arm.links)
    links[k] = links[k].model_copy(update=fields)
    return tried(task, arm=task.arm.model_copy(update={"links": tuple(links)}))


def left_out(task: T, i: int) -> Change[T]:
    """Without an obstacle, whatever x."""
    rest = tried(task, obstacles=task.obstacles[:i] + task.obstacles[i + 1 :])
    return Change(f"obstacles[{i}]", lambda x: rest, lambda x: f"leave out obstacles[{i}]", lambda x: 1.0)
