"""Is a plan file true? Everything it states is computed anew from the file alone, without any solver."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SpecError
from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Proof
from ..proofs.check import CHECK
from ..scenes.kept import Kept
from ..spec.control_set import Disc, Polygon
from ..spec.reading import short
from ..spec.settings import Bisection, Settings
from ..types import Json
from .answer import status_of
from .arm_plan import ArmPlan
from .document import VERSION, ArmDocument, PointDocument, digest, made_of
from .older import SINCE_3, stated
from .plan import KEEPS, Plan

SAME = 1e-9  # relative difference up to which a number counts as the one stated
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


@dataclass(frozen=True, repr=False)
class Verification:
    """What was stated and found. `problems` is empty when all of it is so.

    since: what is asked of a motion since the version of an older file, and that of the file does not keep.
    """

    plan: Plan
    peak: float
    lower_bound: float
    problems: tuple[str, ...]
    since: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether everything is as stated."""
        return not self.problems

    def __repr__(self) -> str:
        return f"Verification({'passed' if self.passed else 'failed'}, problems={self.problems}, plan={self.plan})"


@np.errstate(all="ignore")  # a number that is none fails every comparison that it enters
def verify(text: str | bytes) -> Verification:
    """Compute anew everything that a plan document states: states, crossings, peak, clearance, bound, gap.

    Args:
        text: a plan document, as `to_json` or `peakmin solve --json` writes it.

    Raises:
        SpecError: when the text is not a plan document.
    """
    data, new = stated(text)
    plan = plan_stated(new)
    scene, found, older = plan.scene, [], data["version"] < VERSION
    if data.get("digest") != digest(data):
        found.append("digest: the file is not as it was written")
    motion, kept = plan.trajectory, plan.kept
    since: tuple[str, ...] = ()
    if motion is not None and kept is not None:
        if older:  # it was not asked then that joints be within what no spec states
            since = tuple(one.words for one in kept.excesses if not one.stated)
            kept = replace(kept, excesses=tuple(one for one in kept.excesses if one.stated))
        found += moved(plan, motion) + _kept(plan, kept)
    elif data["peak"] is not None or plan.keeps:
        found.append("status: there is no motion, so no peak and no solution")
    bound = scene.bound(plan.proof, plan.obstacle_times)
    closed = math.isinf(bound) or scene.impossible() is not None
    found += bounded(plan, bound, closed)
    if isinstance(plan.proof, Proof) and plan.scope == "these" and any(x.low != x.high for x in plan.proof.leaves):
        found.append("scope: the proof has boxes, but claims these times only")
    limit, accept = plan.maneuver.limit, plan.settings.search.accept
    all_kept = kept is not None and kept.passed and plan.peak <= limit
    known = status_of(all_kept, plan.gap <= accept, bound > limit, plan.scope, closed)
    if plan.status == "unknown" != known:  # the others are looked at where their reasons are
        found.append(f"status: unknown, but it is {known}")
    elif plan.keeps and known in KEEPS and plan.status != known:
        found.append(f"status: {plan.status}, but with a gap of {plan.gap:.6g} and accept at {accept:g} it is {known}")
    found += plan.misstated()
    found += _anew(plan, new, older)
    return Verification(plan, math.inf if motion is None else motion.peak(), bound, tuple(found), since)


def plan_stated(data: Json) -> Plan | ArmPlan:
    """The plan that a document of the present version states, of either kind. Raises `SpecError` in one line."""
    if data.get("kind") == "arm":
        return made_of(ArmDocument, ArmPlan.stated_by, data)
    return made_of(PointDocument, Plan.stated_by, data)


def _kept(plan: Plan, kept: Kept) -> list[str]:
    """Whether the clearance, computed anew, is as stated, and what a plan that says it keeps all does not keep."""
    found = []
    room = SAME * max(abs(kept.clearance), plan.size)
    same = kept.clearance == plan.clearance or abs(kept.clearance - plan.clearance) <= room < math.inf
    if not same:
        found.append(f"clearance: was stated as {plan.clearance!r}, the path has {kept.clearance!r} m")
    if plan.keeps:
        found += [f"status: {plan.status}, but not all is kept ({one.words})" for one in kept.excesses]
    if not plan.joined:
        found.append("joints: do not lead from the start's configuration to the goal's")
    return found


def _anew(plan: Plan, data: Json, older: bool) -> list[str]:
    """What differs where the plan is written anew, or why it cannot be."""
    try:
        again = plan.document()
    except SpecError as error:  # of a motion whose numbers no document has
        return [f"the document: cannot be written anew ({error})"]
    if older:
        again |= {name: None for name in SINCE_3 if name in again}
        if "exceeded" in again and plan.kept is not None:
            again["exceeded"] = [
                one.words for one in plan.kept.excesses if one.stated and one.words in again["exceeded"]
            ]
    return unlike(data, again, plan.units)


def unlike(data: Json, again: Json, units: dict[str, float]) -> list[str]:
    """Fields that differ from a document written anew by more than rounding errors, of another processor too."""
    found = [f"{name}: must {'be left out' if name in data else 'be given'}" for name in sorted(set(data) ^ set(again))]
    for name in sorted(set(data) & set(again) - {"digest", "made"}):
        if alike(data[name], again[name], units.get(name, 0.0)):
            continue
        if name in units and data[name] is not None and again[name] is not None:
            found.append(f"{name}: not what the control gives")
        else:
            found.append(f"{name}: was {short(data[name], 80)}, must be {short(again[name], 80)}")
    return found


def alike(a: object, b: object, unit: float = 0.0) -> bool:
    """Whether a value of a document is another one but for rounding errors.

    Args:
        unit: what its numbers are measured by, if that is more than the largest of b.
    """
    if isinstance(a, dict) and isinstance(b, dict):
        return set(a) == set(b) and all(alike(a[name], b[name], unit) for name in a)
    room = SAME * max([unit, *(abs(x) for x in _numbers(b))])
    return _alike(a, b, room)


def _numbers(b: object) -> Iterator[float]:
    """All of a value's, those in dictionaries too."""
    if isinstance(b, dict):
        b = list(b.values())
    if isinstance(b, list | tuple):
        for one in b:
            yield from _numbers(one)
    elif isinstance(b, int | float) and not isinstance(b, bool):
        yield b


def _alike(a: object, b: object, room: float) -> bool:
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(_alike(x, y, room) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict) and isinstance(b, dict):
        return alike(a, b)
    if isinstance(a, int | float) and isinstance(b, int | float) and bool not in (type(a), type(b)):
        return abs(a - b) <= room
    if isinstance(a, str) and isinstance(b, str):
        return a == b or _said_alike(a, b)
    return type(a) is type(b) and a == b


def _said_alike(a: str, b: str) -> bool:
    """Whether two sentences are the same but for the last digits of their numbers."""
    if NUMBER.sub("", a) != NUMBER.sub("", b):
        return False
    first, second = NUMBER.findall(a), NUMBER.findall(b)
    same = len(first) == len(second)
    return same and all(abs(float(x) - float(y)) <= _last(y) for x, y in zip(first, second, strict=True))


def _last(number: str) -> float:
    """By how much a printed number may differ: its last place and a half, nothing of an integer."""
    digits, _, power = number.partition("e")
    _, point, decimals = digits.partition(".")
    return 1.5 * 10.0 ** (int(power or 0) - len(decimals)) if point or power else 0.0


def moved(plan: Plan, motion: Trajectory) -> list[str]:
    """What of goal, crossings and peak is not as stated, the control propagated anew."""
    result, found = plan.check(), []
    # each comparison is written so that a number that is none fails it
    if not result.goal <= CHECK:
        found.append(f"goal: missed by {result.goal:.2e} of the maneuver's size")
    if not result.walls <= CHECK:
        found.append(f"walls: not crossed as stated, {result.walls:.2e} of the maneuver's size")
    if not result.peak <= 1e-12:
        found.append(f"peak: was stated as {plan.peak!r}, the control has {motion.peak()!r} m/s²")
    if not _tested(plan.settings) and plan.peak > _most(plan.settings.circle) * motion.peak() * (1 + SAME):
        found.append(f"peak: was stated as {plan.peak!r}, the control has no more than {motion.peak()!r} m/s²")
    if plan.keeps and not plan.peak >= plan.lower_bound * (1 - SAME):
        found.append(f"peak: was stated as {plan.peak!r}, below the bound {plan.lower_bound!r} m/s²")
    return found


def _tested(settings: Settings) -> bool:
    """Whether the peak may be the last M that a program was solved for, and its control below it."""
    return isinstance(settings.method, Bisection) and not settings.method.verified


def _most(circle: Disc | Polygon) -> float:
    """How far the circle's M may be above |u|, as a factor."""
    return 1 / math.cos(math.pi / (4 * circle.segments)) if isinstance(circle, Polygon) else 1.0


def bounded(plan: Plan, bound: float, closed: bool) -> list[str]:
    """What of the bound, and of the status that rests on it, is not so.

    Args:
        bound: the proof's, evaluated anew [m/s^2];  closed: whether a no is proved without it.
    """
    found, limit = [], plan.maneuver.limit
    if bound != plan.lower_bound and not abs(bound - plan.lower_bound) <= SAME * bound:
        found.append(f"lower_bound: was stated as {plan.lower_bound!r}, the proof gives {bound!r} m/s²")
    if plan.keeps and plan.peak > limit:
        found.append(f"status: {plan.status}, but the peak {plan.peak!r} is above max_peak {limit!r}")
    if plan.status == "infeasible" and not closed and not (plan.scope == "all" and bound > limit):
        found.append("status: infeasible is not proved")
    return found
