"""Is an arm's plan file true? Everything it states is computed anew from the file alone, without any solver."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Array
from ..check import CHECK
from ..document import digest
from ..model import load
from ..moments import PointMass
from .document import of, read
from .finish import begins, lands
from .passage import passages
from .plan import ArmPlan
from .workspace import Workspace

SAME = 1e-9  # relative difference up to which a number counts as the one stated


def verify_arm(text: str | bytes) -> tuple[ArmPlan, float, list[str]]:
    """The plan, its bound computed anew [m/s^2], and what of a document is not so: from the text alone, no solver.

    Raises:
        SpecError: when the text is not a plan document.
    """
    data = load(text, finite=True)
    plan, found = read(data), []
    workspace = Workspace(plan.maneuver)
    if data.get("digest") != digest(data):
        found.append("digest: the file is not as it was written")
    motion, path = plan.trajectory, plan.joints
    if motion is not None and path is not None:
        result = plan.check()
        if not result.goal <= CHECK:
            found.append(f"goal: missed by {result.goal:.2e} of the maneuver's size")
        if not result.walls <= CHECK:
            found.append(f"walls: not crossed as stated, {result.walls:.2e} of the maneuver's size")
        if not result.peak <= 1e-12:
            found.append(f"peak: was stated as {plan.peak!r}, the control has {motion.peak()!r} m/s^2")
        (passage,) = [one for one in passages(workspace) if one.indices == plan.indices]
        if not lands(workspace, path) or not begins(passage, path):
            found.append("joints: do not lead from the start's configuration to the goal's")
        assert plan.clear is not None
        if plan.status == "solved" and plan.clear.short(plan.maneuver, workspace.size) > 0:
            found.append(
                "status: solved, but a link comes too close, the path leaves what is in reach, or a joint jumps"
            )
        if plan.status == "solved" and plan.exceeded:
            found.append("status: solved, but joint limits or speeds are not kept")
        if plan.status == "solved" and not plan.peak >= plan.lower_bound * (1 - SAME):
            found.append(f"peak: was stated as {plan.peak!r}, below the bound {plan.lower_bound!r} m/s^2")
    elif data["peak"] is not None or plan.status == "solved":
        found.append("status: there is no motion, so no peak and no solution")
    bound = plan.proof.bound(plan.maneuver)
    if bound != plan.lower_bound and not abs(bound - plan.lower_bound) <= SAME * bound:
        found.append(f"lower_bound: was stated as {plan.lower_bound!r}, the proof gives {bound!r} m/s^2")
    found += _unlike(data, of(plan), PointMass.of(plan.crossing), workspace.size)
    limit = plan.maneuver.max_peak or math.inf
    if plan.status == "solved" and plan.peak > limit:
        found.append(f"status: solved, but the peak {plan.peak!r} is above max_peak {limit!r}")
    if plan.status == "infeasible" and not (bound > limit or math.isinf(bound)):
        found.append("status: infeasible is not proved")
    return plan, bound, found


def _unlike(data: dict[str, Any], again: dict[str, Any], mass: PointMass, size: float) -> list[str]:
    """Fields that differ from a document written anew; motions may differ by rounding errors."""
    found = [f"{name}: must {'be left out' if name in data else 'be given'}" for name in sorted(set(data) ^ set(again))]
    units = {
        "position": size,
        "velocity": size / mass.time,
        "acceleration": mass.unit,
        "joints": 1e3,
        "clearance": 1e3 * size,
    }
    for name in sorted(set(data) & set(again) - {"digest", "made"}):
        if name not in units:
            if data[name] != again[name]:
                found.append(f"{name}: was {str(data[name])[:80]}, must be {str(again[name])[:80]}")
            continue
        try:
            same = (data[name] is None) == (again[name] is None)
            if same and data[name] is not None:
                listed: Array = np.array(data[name])
                there: Array = np.array(again[name])
                same = listed.shape == there.shape and bool(np.all(np.abs(listed - there) <= SAME * units[name]))
        except (TypeError, ValueError):
            same = False
        if not same:
            found.append(f"{name}: not what the control gives")
    return found
