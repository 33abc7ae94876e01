"""What a search found becomes a plan, solved or feasible only if it passes its own checks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, overload

import numpy as np

from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Leaf, Proof
from ..proofs.check import check_motion
from ..proofs.double_integrator import PointMass
from ..robots.joint_motion import JointMotion
from ..robots.joints import JointPath
from ..scenes.kinds import ArmScene, PointScene, Setting
from ..spec.settings import Settings
from .arm_plan import ArmPlan
from .document import Status
from .found import Found
from .plan import Plan, gap_between

PLANS: dict[str, Callable[..., Plan]] = {"point": Plan.of, "arm": ArmPlan.of}  # by the kind of task


@overload
def plan_of(scene: PointScene, settings: Settings, found: Found[Trajectory]) -> Plan: ...
@overload
def plan_of(scene: ArmScene, settings: Settings, found: Found[JointMotion | JointPath]) -> ArmPlan: ...
def plan_of(scene: Setting[Any, Any], settings: Settings, found: Found[Any]) -> Plan:
    """The plan of what was found: "solved" or "feasible" only if it passes its own checks."""
    mass = PointMass.of(found.crossing)
    if found.multipliers is None:
        found = replace(found, multipliers=np.zeros((2 + mass.walls, mass.dimension)))
    if found.proof is None:
        found = replace(found, proof=proof_at(mass, found))
    if found.motion is not None and not _follows(scene, found):
        found = replace(found, motion=None, peak=math.inf, kept=None)
    if found.motion is not None and found.kept is None:
        found = replace(found, kept=scene.kept(found.motion))
    assert found.proof is not None
    bound = scene.bound(found.proof, found.times)
    closed = math.isinf(bound) or scene.impossible() is not None
    limit, gap = scene.task.limit, gap_between(found.peak, bound)
    kept = found.kept is not None and found.kept.passed and found.peak <= limit
    status = status_of(kept, gap <= settings.search.accept, bound > limit, found.proof.scope, closed)
    plan = PLANS[scene.task.kind](scene, settings, status, bound, found)
    if found.kept is not None:
        vars(plan)["kept"] = found.kept  # proved a moment ago
    return plan


def proof_at(mass: PointMass, found: Found[Trajectory]) -> Proof:
    """That of the bound which the multipliers prove at the times found."""
    assert found.multipliers is not None
    place = tuple((found.times / mass.time).tolist())
    return Proof("these" if mass.walls else "all", (Leaf(place, place, found.multipliers, place),))


def status_of(kept: bool, near: bool, refuted: bool, scope: str, closed: bool) -> Status:
    """The status of a plan.

    Args:
        kept: whether there is a motion that keeps all that was asked, `max_peak` too.
        near: whether its gap is at most what `search.accept` takes.
        refuted: whether the bound is above `max_peak`;  scope: what it covers.
        closed: whether it is proved that there is no motion.
    """
    if closed or (refuted and scope == "all"):
        return "infeasible"
    if not kept:
        return "unknown"
    return "solved" if near else "feasible"


def _follows(scene: Setting[Any, Any], found: Found[Any]) -> bool:
    """Whether the motion leads from start to goal, crosses the walls when it should, and keeps its peak."""
    motion = scene.centre(found.motion)
    joins = scene.joins(found.motion, found.indices)
    return joins and check_motion(found.crossing, motion, found.times, found.peak).passed
