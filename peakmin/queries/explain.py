"""Why there is no plan, in the spec's own words: which entries conflict, and what would help, each tried out.

A conflict is made smallest by leaving out entries as long as the rest is still proved impossible: all choices where
there are few entries; where there are many, all single ones and pairs, then one after another. A repair changes one
entry as little as it takes, to three digits, and counts only if the changed task was solved.
"""

from __future__ import annotations

import itertools
import json
import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ..deadline import after, over
from ..errors import SpecError
from ..plan.plan import Plan
from ..scenes.kinds import scene_of
from ..search.solve import solve
from ..spec.settings import Settings
from ..spec.spec import refuse_unfit
from ..spec.task import Task
from .arm_reasons import ArmReasons
from .point_reasons import PointReasons
from .reasons import Reasons
from .repairs import Repair, Trials

FEW = 6  # entries of which all choices are tried
TIME_LIMIT = 8.0  # s, where the settings have no shorter one
FOR_FEWEST = 1 / 3  # of the time, to look for the fewest entries
REASONS: dict[str, type[Reasons]] = {"point": PointReasons, "arm": ArmReasons}


@dataclass(frozen=True)
class Explanation:
    """Entries that cannot all be kept, why, and repairs, the smallest change first.

    complete: whether there was time to look for the fewest entries and for all repairs;  proved: whether it
    is proved that they conflict, or only no motion was found that keeps them.
    """

    conflict: tuple[str, ...]
    because: str
    repairs: tuple[Repair, ...]
    complete: bool = True
    proved: bool = True

    def document(self) -> dict[str, object]:
        """As plain JSON data, each repair with its whole maneuver."""
        repairs = [
            {"field": one.field, "text": one.text, "peak": one.peak, "maneuver": json.loads(one.maneuver.to_json())}
            for one in self.repairs
        ]
        return {
            "conflict": list(self.conflict),
            "because": self.because,
            "repairs": repairs,
            "complete": self.complete,
            "proved": self.proved,
        }

    def __str__(self) -> str:
        none = "no change of a single entry was found that helps" + ("" if self.complete else " in this time")
        said = "; or ".join(repair.text for repair in self.repairs) or none
        late = "" if self.complete else "\n(it ended before fewer entries and other changes were looked for)"
        verb = "conflict" if self.proved else "in the way"
        why = self.because.split("; ")
        because = f" {why[0]}" if len(why) == 1 else "".join(f"\n  {one}" for one in why)
        return f"{', '.join(self.conflict)} {verb}:{because}\n{said}{late}"


def explain(task: Task | Plan, settings: Settings | None = None) -> Explanation | None:
    """Why a task is proved infeasible: the fewest entries that conflict, and the smallest changes that help.

    None where it is solved, or nothing is proved and no joint limit or speed of an arm is in the way. Every change was
    solved; an explanation takes many solves, up to eight seconds or a shorter `settings.time_limit`.

    Args:
        task: a plan of it is not solved again, and has its own settings.

    Raises:
        SpecError: when the settings do not fit the task, or are given beside a plan.
    """
    if isinstance(task, Plan):
        if settings is not None:
            raise SpecError("settings: was given beside a plan, must be left out (a plan has its own)")
        return explained(task)
    settings = settings or Settings()
    refuse_unfit(task, settings)
    if scene_of(task).impossible() is not None:  # no search is needed to know that
        return why_not(task, settings, math.inf, _until(settings))
    return explained(solve(task, settings))


def explained(plan: Plan, stopped: threading.Event | None = None) -> Explanation | None:
    """Why a plan that is "infeasible" is so, and what would help, each tried out; None for others. Takes solves.

    Of an arm's that is "unknown", which joint limits or speeds are in the way of the motions that were found.

    Args:
        stopped: to be set when it is to end with what it has.
    """
    if plan.status == "unknown":
        return in_the_way(plan, _until(plan.settings, stopped))
    if plan.status != "infeasible":
        return None
    return why_not(plan.maneuver, plan.settings, plan.lower_bound, _until(plan.settings, stopped))


def _until(settings: Settings, stopped: threading.Event | None = None) -> float:
    return after(min(settings.time_limit or math.inf, TIME_LIMIT), stopped)


def in_the_way(plan: Plan, until: float) -> Explanation | None:
    """What is in the way of the motions found, though none is proved impossible; None where nothing is."""
    trials = Trials(plan.settings, until)
    found = REASONS[plan.kind].in_the_way(plan, trials)
    if found is None:
        return None
    repairs = sorted(found.repairs, key=lambda one: one.cost)
    return Explanation(found.fields, found.because, tuple(repairs), not (trials.over or trials.cut), proved=False)


def why_not(task: Task, settings: Settings, proved: float, until: float) -> Explanation | None:
    """Why a task is impossible and what would help; None where it is not proved so.

    Args:
        proved: a lower bound [m/s^2] that is known of it.
        until: a deadline, after which no more repairs are looked for.
    """
    trials = Trials(settings, until)
    reasons = REASONS[task.kind](task, proved, trials)
    if not reasons.refuted(reasons.entries):
        return None
    fields, because = reasons.named(fewest(reasons.entries, reasons.refuted, trials.part(FOR_FEWEST)))
    repairs = sorted(reasons.repairs(fields), key=lambda one: one.cost)
    return Explanation(fields, because, tuple(repairs), not (trials.over or trials.cut))


def fewest(entries: list[str], refuted: Callable[[list[str]], bool], until: float) -> list[str]:
    """The fewest entries that are still proved impossible together, as far as there is time to look.

    Args:
        refuted: whether these entries alone are proved impossible; all of them are.
    """

    def tries(kept: Iterable[str]) -> bool:
        return not over(until) and refuted(list(kept))

    for count in range(len(entries)) if len(entries) <= FEW else range(3):
        for kept in itertools.combinations(entries, count):
            if tries(kept):
                return list(kept)
    left = entries
    for name in entries if len(entries) > FEW else []:
        fewer = [other for other in left if other != name]
        if tries(fewer):
            left = fewer
    return left
