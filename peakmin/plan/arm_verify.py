"""Is an arm's plan file true? Everything it states is computed anew from the file alone, without any solver."""

from __future__ import annotations

import math
from typing import Any

from ..proofs.double_integrator import PointMass
from ..scenes.passages import passages
from ..search.finish import begins, lands
from ..spec.reading import load
from .arm_document import of, read
from .arm_plan import ArmPlan
from .document import digest
from .verify import bounded, moved, unlike


def verify_arm(text: str | bytes) -> tuple[ArmPlan, float, list[str]]:
    """The plan, its bound computed anew [m/s^2], and what of a document is not so: from the text alone, no solver.

    Raises:
        SpecError: when the text is not a plan document.
    """
    data = load(text, finite=True)
    plan, found = read(data), []
    workspace = plan.maneuver.workspace
    if data.get("digest") != digest(data):
        found.append("digest: the file is not as it was written")
    motion, path = plan.trajectory, plan.joints
    if motion is not None and path is not None:
        found += moved(plan, motion)
        (passage,) = [one for one in passages(plan.maneuver, workspace) if one.indices == plan.indices]
        if not lands(plan.maneuver, path) or not begins(passage, path):
            found.append("joints: do not lead from the start's configuration to the goal's")
        if plan.status == "solved" and not plan.free:
            found.append(
                "status: solved, but a link comes too close, the path leaves what is in reach, or a joint jumps"
            )
        if plan.status == "solved" and plan.exceeded:
            found.append("status: solved, but joint limits or speeds are not kept")
    elif data["peak"] is not None or plan.status == "solved":
        found.append("status: there is no motion, so no peak and no solution")
    bound = plan.proof.bound(plan.maneuver)
    limit = plan.maneuver.max_peak or math.inf
    if plan.status == "unknown" and (math.isinf(bound) or bound > limit):
        found.append("status: unknown, but it is infeasible")
    if plan.status == "unknown" and plan.free and not plan.exceeded and plan.peak <= limit:
        found.append("status: unknown, but it is solved")
    found += bounded(plan, bound, math.isinf(bound))
    mass, size = PointMass.of(plan.crossing), workspace.size
    units = {"position": size, "velocity": size / mass.time, "acceleration": size / mass.time**2, "joints": 1.0}
    return plan, bound, found + unlike(_apart(data), _apart(of(plan)), units | {"clearance": size, "others": 1.0})


def _apart(data: dict[str, Any]) -> dict[str, Any]:
    """The document with the angles [rad] that a path's spline goes through beside it: their last digit may differ."""
    path = data.get("path")
    others = path.get("others") if isinstance(path, dict) else None
    if not isinstance(path, dict) or not isinstance(others, list) or len(others) != 2:
        return data
    return data | {"path": path | {"others": others[0]}, "others": others[1]}
