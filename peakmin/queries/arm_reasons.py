"""Why an arm cannot do its task: its links do not get past the obstacles, or not with so small a peak."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..robots.joint_space import FLOODS, flood
from ..scenes.passages import passages
from ..spec.arm import ArmManeuver
from .reasons import Reasons
from .repairs import Change, Repair, changed, left_out, longer, raised

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
            lambda share: f"lower margin to {float(share) * margin:.6g} m",
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


def closed(maneuver: ArmManeuver) -> bool:
    """Whether it is proved that no motion of a two-link arm leads from start to goal."""
    workspace = maneuver.workspace
    found = flood(workspace, FLOODS[-1])
    return all(found.parts(one.theta) for one in passages(maneuver, workspace))
