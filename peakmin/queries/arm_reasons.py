"""Why an arm cannot do its task: its links do not get past the obstacles, or not with so small a peak."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from ..plan.arm_plan import ArmPlan
from ..robots.joint_space import FLOODS, flood
from ..scenes.passages import passages
from ..spec.arm import ArmManeuver
from .reasons import InTheWay, Reasons
from .repairs import Change, Repair, Trials, changed, downwards, left_out, longer, raised, upwards, with_link

Limit = tuple[int, Literal["limits", "max_speed"]]  # of which link, and which
MARGINS = (0.5, 0.25, 0.1, 0.0)  # shares of a margin that are tried, in this order
SLOWER = 1.002  # times the duration that time scaling asks for: what a control on holds needs more


class ArmReasons(Reasons):
    """Of an arm's task."""

    task: ArmManeuver

    @property
    def entries(self) -> list[str]:
        return self.obstacles

    @property
    def shut(self) -> bool:
        """Whether it is the obstacles alone that leave no motion."""
        return math.isinf(self.bounds.get(tuple(self.entries), 0.0))

    def bound(self, kept: list[str]) -> float | None:
        every = zip(self.obstacles, self.task.obstacles, strict=True)
        fewer = changed(self.task, obstacles=tuple(one for name, one in every if name in kept))
        if self.shut:
            return math.inf if closed(fewer) else None
        tried_out = self.trials.solve(fewer)
        return tried_out.bound if tried_out.status == "infeasible" else None

    def named(self, kept: list[str]) -> tuple[tuple[str, ...], str]:
        task = self.task
        if self.shut:
            margin = ("margin",) if task.margin and not closed(changed(task, margin=0.0)) else ()
            return (*kept, *margin), "the links cannot get past from start to goal, whatever they do"
        because = (
            f"max_peak {task.max_peak:.6g} m/s² is below {self.bounds[tuple(self.entries)]:.6g} m/s², "
            f"the least that any motion of the arm needs in {task.duration:.6g} s"
        )
        return (*kept, "max_peak", "duration"), because

    def repairs(self, fields: tuple[str, ...]) -> Iterator[Repair]:
        return self._opened(fields) if self.shut else self._slower()

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
        """A joint limit or speed is, where the motion does not keep it or the task is solved with it made wider."""
        task = plan.maneuver
        given = given_limits(task)
        if plan.joints is not None:
            kept = plan.kept
            assert kept is not None
            given = {name: given[name] for one in kept.excesses if (name := one.field) in given}
        found = [one for name, limit in given.items() for one in widened(task, trials, name, limit)]
        fields = tuple(given) if plan.joints is not None else tuple(one.field for one in found)
        because = "; ".join(plan.exceeded) or "no motion was found that keeps them"
        return InTheWay(fields, because, found) if fields else None


def given_limits(task: ArmManeuver) -> dict[str, Limit]:
    """The joint limits and speeds that are asked for, by their paths."""
    return {
        f"arm.links[{k}].{name}": (k, name)
        for k, link in enumerate(task.arm.links)
        for name in ("limits", "max_speed")
        if getattr(link, name) is not None
    }


def widened(task: ArmManeuver, trials: Trials, field: str, limit: Limit) -> Iterator[Repair]:
    """One limit made as wide as a motion that was found without it takes, if the task is then solved."""
    k, name = limit
    free = with_link(task, k, **{name: None})
    plan = None if free is None or trials.over else trials.plan(free)
    if plan is None or not plan.keeps or plan.extremes is None:
        return
    asked, found = getattr(task.arm.links[k], name), plan.extremes
    if name == "limits":
        low = min(asked[0], -upwards_signed(-float(found.low[k])))
        high = max(asked[1], upwards_signed(float(found.high[k])))
        value: object = (low, high)
        said = f"{field} [{asked[0]:.6g}, {asked[1]:.6g}] rad are too narrow: [{low:.6g}, {high:.6g}] rad"
        cost = (high - low) / (asked[1] - asked[0]) - 1
    else:
        value = fastest = upwards(float(found.speed[k]))
        said, cost = f"{field} {asked:.6g} rad/s is too slow: {fastest:.6g} rad/s", fastest / asked - 1
    changed_so = with_link(task, k, **{name: value})
    if changed_so is not None and not trials.over:
        tried_out = trials.solve(changed_so)
        if tried_out.keeps:
            yield Repair(field, f"{said} would do", changed_so, tried_out.peak, cost)


def upwards_signed(x: float) -> float:
    """The next number of three digits, for any sign [any unit]."""
    return upwards(float(x)) if x >= 0 else -downwards(-float(x))


def closed(maneuver: ArmManeuver) -> bool:
    """Whether it is proved that no motion of a two-link arm leads from start to goal."""
    workspace = maneuver.workspace
    found = flood(workspace, FLOODS[-1])
    return all(found.parts(one.theta) for one in passages(maneuver, workspace))
