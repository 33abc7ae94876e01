"""Why there is no plan, in the spec's own words: which entries conflict, and what would help, each tried out.

A conflict is made smallest by leaving out entries as long as the rest is still proved impossible: all choices where
there are few entries; where there are many, all single ones and pairs, then one after another. A repair changes one
entry as little as it takes, to three digits, and counts only if the changed maneuver was solved.
"""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ..deadline import over
from ..plan.plan import Plan
from ..scenes.impossible import impossible
from ..spec.maneuver import Maneuver
from ..spec.settings import Settings
from .repairs import Repair, Trials, changed, repairs, tried

FEW = 6  # entries of which all choices are tried
TIME_LIMIT = 60.0  # s


@dataclass(frozen=True)
class Explanation:
    """Entries that cannot all be kept, why, and repairs, the smallest change first.

    complete: whether there was time to look for the fewest entries and for all repairs.
    """

    conflict: tuple[str, ...]
    because: str
    repairs: tuple[Repair, ...]
    complete: bool = True

    def document(self) -> dict[str, Any]:
        """As plain JSON data, each repair with its whole maneuver."""
        repairs = [
            {"field": one.field, "text": one.text, "peak": one.peak, "maneuver": json.loads(one.maneuver.to_json())}
            for one in self.repairs
        ]
        answer = {"conflict": list(self.conflict), "because": self.because, "repairs": repairs}
        return answer | {"complete": self.complete}

    def __str__(self) -> str:
        none = "no change of a single entry was found that helps" + ("" if self.complete else " in this time")
        said = "; or ".join(repair.text for repair in self.repairs) or none
        late = "" if self.complete else "\n(it ended before fewer entries and other changes were looked for)"
        return f"{', '.join(self.conflict)} conflict: {self.because}\n{said}{late}"


def explain(
    maneuver: Maneuver, settings: Settings | None = None, time_limit: float = TIME_LIMIT, proved: float = 0.0
) -> Explanation | None:
    """Why a maneuver is proved impossible and what would help; None where it is not proved so.

    Args:
        time_limit: seconds after which no more repairs are looked for.
        proved: a lower bound [m/s^2] that is known of it.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """
    settings = settings or Settings()
    trials = Trials(settings, time.perf_counter() + min(time_limit, settings.time_limit or time_limit))
    trials.know(maneuver, proved)
    if not trials.refuted(maneuver):
        return None

    def impossible_with(kept: list[str]) -> bool:
        fewer = _only(maneuver, kept)
        return fewer is not None and trials.refuted(fewer)

    kept = fewest(_entries(maneuver), impossible_with, trials.until)
    all_tried, reduced = not trials.over, _only(maneuver, kept)
    assert reduced is not None
    if maneuver.margin and reduced.blocks and not trials.refuted(changed(reduced, margin=0.0)):
        kept.append("margin")
    shown = impossible(reduced)
    if shown is not None:
        fields, because = tuple(dict.fromkeys(kept + [f for f in shown.fields if f == "duration"])), shown.because
        because = _renamed(because, kept)
    else:
        fields = (*kept, "duration")
        past = [name for name in kept if name.startswith("obstacles")]
        bound = trials.bound(reduced)
        because = (
            f"max_peak {maneuver.max_peak:.6g} m/s² is below {bound:.6g} m/s², the least that any control needs in "
            f"{maneuver.duration:.6g} s" + (f" past {', '.join(past)}" if past else "")
        )
    found = sorted(repairs(maneuver, fields, trials), key=lambda one: one.cost)
    return Explanation(fields, because, tuple(found), all_tried and not trials.over)


def explained(plan: Plan) -> Explanation | None:
    """Why a plan that is "infeasible" is so, and what would help; None for others."""
    if plan.status != "infeasible":
        return None
    if plan.kind == "arm":
        from .explain_arm import explain_arm

        return explain_arm(plan, TIME_LIMIT)
    return explain(plan.maneuver, plan.settings, proved=plan.lower_bound)


def _entries(maneuver: Maneuver) -> list[str]:
    """What can be left out of a maneuver."""
    out = [f"obstacles[{i}]" for i in range(len(maneuver.obstacles))]
    return out + [name for name in ("region", "max_speed", "max_peak") if getattr(maneuver, name) is not None]


def _only(maneuver: Maneuver, kept: list[str]) -> Maneuver | None:
    """The maneuver with these entries alone; None where it would be refused, as walls that become neighbours may be."""
    obstacles = tuple(one for i, one in enumerate(maneuver.obstacles) if f"obstacles[{i}]" in kept)
    limits = {name: getattr(maneuver, name) for name in ("region", "max_speed", "max_peak") if name in kept}
    none = {"region": None, "max_speed": None, "max_peak": None}
    return tried(maneuver, obstacles=obstacles, **(none | limits))


def fewest(entries: list[str], refuted: Callable[[list[str]], bool], until: float) -> list[str]:
    """The fewest entries that are still proved impossible together, as far as there is time to look.

    Args:
        refuted: whether these entries alone are proved impossible; all of them are.
    """

    def tries(kept: Iterable[str]) -> bool:
        return not over(until) and refuted(list(kept))

    for count in range(1, len(entries)) if len(entries) <= FEW else (1, 2):
        for kept in itertools.combinations(entries, count):
            if tries(kept):
                return list(kept)
    left = entries
    for name in entries if len(entries) > FEW else []:
        fewer = [other for other in left if other != name]
        if tries(fewer):
            left = fewer
    return left


def _renamed(text: str, kept: list[str]) -> str:
    """Indices of the reduced maneuver's obstacles as those of the whole one."""
    names = [name for name in kept if name.startswith("obstacles")]
    for k in range(len(names) - 1, -1, -1):
        text = text.replace(f"obstacles[{k}]", names[k].replace("[", "<").replace("]", ">"))
    return text.replace("<", "[").replace(">", "]")
