"""Is a plan file true? Everything it states is computed anew from the file alone, without any solver."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .check import CHECK, check
from .document import digest, listed_times, of, read
from .model import load
from .moments import PointMass
from .plan import Plan

SAME = 1e-9  # relative difference up to which a number counts as the one stated


@dataclass(frozen=True)
class Verification:
    """What was stated and found. `problems` is empty when all of it is so."""

    plan: Plan
    peak: float
    lower_bound: float
    problems: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether everything is as stated."""
        return not self.problems


def verify(text: str | bytes) -> Verification:
    """Recompute the motion's states, crossings and peak, the bound with its cover of all times, and the gap.

    Args:
        text: a plan document, as `Plan.to_json` or `peakmin solve --json` writes it.

    Raises:
        SpecError: when the text is not a plan document.
    """
    data, plan = load(text), read(text)
    mass, found = PointMass.of(plan.maneuver), []
    if data.get("digest") != digest(data):
        found.append("digest: the file is not as it was written")
    motion, peak = plan.trajectory, math.inf
    if motion is not None:
        result = check(plan.maneuver, motion, plan.obstacle_times, plan.peak)
        peak = motion.peak()
        if result.goal > CHECK:
            found.append(f"goal: missed by {result.goal:.2e} of the maneuver's length")
        if result.walls > CHECK:
            found.append(f"walls: not crossed as stated, {result.walls:.2e} of the maneuver's length")
        if result.peak > 1e-12:
            found.append(f"peak: was stated as {plan.peak!r}, the control has {peak!r} m/s^2")
        t = listed_times(motion, plan.maneuver.duration)
        units = {"position": mass.length, "velocity": mass.length / mass.time, "acceleration": mass.unit}
        for name, unit in units.items():
            listed = np.array(data[name], dtype=float)
            there = getattr(motion, name)(t[: len(listed)])
            if listed.shape != there.shape or np.max(np.abs(listed - there)) > SAME * max(unit, np.max(np.abs(there))):
                found.append(f"{name}: not what the control gives")
        if not np.array_equal(np.array(data["times"], dtype=float), t):
            found.append("times: not those of the motion")
    elif plan.status == "solved":
        found.append("status: solved, but there is no motion")
    bound = float(plan.proof.bound(mass, plan.obstacle_times / mass.time) * mass.unit)
    if abs(bound - plan.lower_bound) > SAME * max(bound, plan.lower_bound):
        found.append(f"lower_bound: was stated as {plan.lower_bound!r}, the proof gives {bound!r} m/s^2")
    if plan.scope == "these" and any(leaf.low != leaf.high for leaf in plan.proof.leaves):
        found.append("scope: the proof has boxes, but claims these times only")
    again = of(plan)
    for name in ("gap", "peak_force", "peak", "sensitivities"):
        if data.get(name) != again[name]:
            found.append(f"{name}: was {data.get(name)!r}, must be {again[name]!r}"[:200])
    limit = plan.maneuver.max_peak or math.inf
    if plan.status == "solved" and plan.peak > limit:
        found.append(f"status: solved, but the peak {plan.peak!r} is above max_peak {limit!r}")
    if plan.status == "infeasible" and not (plan.scope == "all" and bound > limit):
        found.append("status: infeasible is not proved")
    return Verification(plan, peak, bound, tuple(found))
