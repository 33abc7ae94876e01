"""Is a plan file true? Everything it states is computed anew from the file alone, without any solver."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Proof, lower_bound
from ..proofs.check import CHECK
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal, far_apart
from ..proofs.sensitivity import without_idle
from ..scenes.impossible import impossible
from ..scenes.kept import Keeping, extent
from ..spec.control_set import Disc, Polygon
from ..spec.reading import load, short
from ..spec.settings import Bisection, Settings
from .document import digest, of, read
from .plan import Plan, proved, status_of

if TYPE_CHECKING:
    from .arm_plan import ArmPlan

NEARLY = 1e-7  # relative: how far the multipliers' own bound may be below the best at the plan's times
SAME = 1e-9  # relative difference up to which a number counts as the one stated


@dataclass(frozen=True, repr=False)
class Verification:
    """What was stated and found. `problems` is empty when all of it is so."""

    plan: Plan | ArmPlan
    peak: float
    lower_bound: float
    problems: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether everything is as stated."""
        return not self.problems

    def __repr__(self) -> str:
        return f"Verification({'passed' if self.passed else 'failed'}, problems={self.problems}, plan={self.plan})"


def verify(text: str | bytes) -> Verification:
    """Recompute the motion's states, crossings and peak, the bound with its cover of all times, and the gap.

    Args:
        text: a plan document, as `Plan.to_json` or `peakmin solve --json` writes it.

    Raises:
        SpecError: when the text is not a plan document.
    """
    data, plan = load(text, finite=True), read(text)
    mass, found = PointMass.of(plan.crossing), []
    if data.get("digest") != digest(data):
        found.append("digest: the file is not as it was written")
    motion, peak, keeps = plan.trajectory, math.inf, None
    if motion is not None:
        peak = motion.peak()
        keeps = plan.keeping()
        found += moved(plan, motion) + _kept(plan, keeps)
    elif data["peak"] is not None or plan.status == "solved":
        found.append("status: there is no motion, so no peak and no solution")
    bound = proved(plan.maneuver, plan.walls, plan.proof, plan.obstacle_times / mass.time)
    found += bounded(plan, bound, impossible(plan.maneuver) is not None)
    if (
        isinstance(plan.proof, Proof)
        and plan.scope == "these"
        and any(leaf.low != leaf.high for leaf in plan.proof.leaves)
    ):
        found.append("scope: the proof has boxes, but claims these times only")
    known = status_of(plan.maneuver, keeps is not None and keeps.passed(plan.maneuver), plan.peak, bound, plan.scope)
    if plan.status == "unknown" != known:  # the others are looked at where their reasons are
        found.append(f"status: unknown, but it is {known}")
    found += _multipliers(plan, mass)
    own = PointMass.of(plan.maneuver.past(()))  # not of walls that the file lists
    units = {"position": own.length, "velocity": own.length / own.time, "acceleration": own.unit}
    found += unlike(data, of(plan), units)
    return Verification(plan, peak, bound, tuple(found))


def _multipliers(plan: Plan, mass: PointMass) -> list[str]:
    """Whether a plan's multipliers are the best at its times: its sensitivities are made from them."""
    times = plan.obstacle_times / mass.time
    if not far_apart(times):
        return []
    own, best = lower_bound(mass, times, plan.multipliers), extremal(mass, times).lower
    if not own >= (1 - NEARLY) * best:
        return [f"multipliers: prove {own * mass.unit!r} m/s² at these times, others {best * mass.unit!r}"]
    if without_idle(mass, times, plan.multipliers) is not plan.multipliers:
        return ["multipliers: are of walls that can be left out"]
    return []


def _kept(plan: Plan, keeps: Keeping) -> list[str]:
    """Whether clearance, region and speed, computed anew, are as stated and, in a solved plan, as asked."""
    found = []
    room = SAME * max(abs(keeps.clearance), extent(plan.maneuver.past(())))
    same = keeps.clearance == plan.clearance or abs(keeps.clearance - plan.clearance) <= room < math.inf
    if not same:
        found.append(f"clearance: was stated as {plan.clearance!r}, the path has {keeps.clearance!r} m")
    if plan.status == "solved" and not keeps.passed(plan.maneuver):
        found.append("status: solved, but the path does not keep its obstacles, margin, region or speed")
    return found


def unlike(data: dict[str, Any], again: dict[str, Any], units: dict[str, float]) -> list[str]:
    """Fields that differ from a document written anew; those with units of their own may differ by rounding errors."""
    found = [f"{name}: must {'be left out' if name in data else 'be given'}" for name in sorted(set(data) ^ set(again))]
    for name in sorted(set(data) & set(again) - {"digest", "made"}):
        if name not in units or data[name] is None or again[name] is None:
            if data[name] != again[name]:
                found.append(f"{name}: was {short(data[name], 80)}, must be {short(again[name], 80)}")
            continue
        try:
            listed, there = np.array(data[name]), np.array(again[name])
            same = listed.dtype.kind in "if" or not there.size
            room = SAME * max(units[name], float(np.max(np.abs(there), initial=0.0)))
            same = same and listed.shape == there.shape and bool(np.all(np.abs(listed - there) <= room))
        except (TypeError, ValueError):
            same = False
        if not same:
            found.append(f"{name}: not what the control gives")
    return found


def moved(plan: Plan | ArmPlan, motion: Trajectory) -> list[str]:
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
    if plan.status == "solved" and not plan.peak >= plan.lower_bound * (1 - SAME):
        found.append(f"peak: was stated as {plan.peak!r}, below the bound {plan.lower_bound!r} m/s²")
    return found


def _tested(settings: Settings) -> bool:
    """Whether the peak may be the last M that a program was solved for, and its control below it."""
    return isinstance(settings.method, Bisection) and not settings.method.verified


def _most(circle: Disc | Polygon) -> float:
    """How far the circle's M may be above |u|, as a factor."""
    return 1 / math.cos(math.pi / (4 * circle.segments)) if isinstance(circle, Polygon) else 1.0


def bounded(plan: Plan | ArmPlan, bound: float, closed: bool) -> list[str]:
    """What of the bound, and of the status that rests on it, is not so.

    Args:
        bound: the proof's, evaluated anew [m/s^2];  closed: whether a no is proved without it.
    """
    found, limit = [], plan.maneuver.max_peak or math.inf
    if bound != plan.lower_bound and not abs(bound - plan.lower_bound) <= SAME * bound:
        found.append(f"lower_bound: was stated as {plan.lower_bound!r}, the proof gives {bound!r} m/s²")
    if plan.status == "solved" and plan.peak > limit:
        found.append(f"status: solved, but the peak {plan.peak!r} is above max_peak {limit!r}")
    if plan.status == "infeasible" and not closed and not (plan.scope == "all" and bound > limit):
        found.append("status: infeasible is not proved")
    return found
