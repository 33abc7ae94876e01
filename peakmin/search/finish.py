"""A motion becomes a plan: solved only if it passes every check."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..plan.arm_plan import ArmPlan
from ..plan.plan import Made, Status
from ..proofs.check import check_motion
from ..robots.joints import JointPath
from ..robots.link_clearance import link_clearance
from ..scenes.arm_proof import ArmProof
from ..scenes.passages import Passage
from ..spec.arm import ArmManeuver, postures
from ..spec.maneuver import Maneuver
from ..spec.settings import Settings
from ..types import Array

LANDED = 1e-5  # rad: close to a stretched arm angles go with the root of a distance


def finished(
    passage: Passage,
    settings: Settings,
    crossing: Maneuver,
    times: Array,
    path: JointPath | None,
    peak: float,
    proof: ArmProof,
    bound: float,
    made: Made,
) -> ArmPlan:
    """The plan, solved only if its motion passes every check. Times [s], peak and the proof's bound [m/s^2]."""
    clear, limit = None, passage.asked.limit
    kept = False
    ends = path is not None and begins(passage, path) and lands(passage.asked, path)
    if path is not None and not (ends and check_motion(crossing, path.motion, times, peak).passed):
        path, peak = None, math.inf
    if path is not None:
        clear = link_clearance(passage.workspace, path)
        kept = clear.short(passage.workspace) == 0
    plan = ArmPlan(
        passage.asked, settings, "unknown", passage.indices, crossing, times, path, clear, peak, bound, proof, made
    )
    status: Status = "unknown"
    if kept and peak <= limit and not plan.exceeded:
        status = "solved"
    elif bound > limit or math.isinf(bound):
        status = "infeasible"
    return replace(plan, status=status)


def begins(passage: Passage, path: JointPath) -> bool:
    """Whether the motion begins in the passage's start configuration, full turns included."""
    return bool(np.max(np.abs(path.absolute(0.0) - passage.theta[0])) < LANDED)


def lands(asked: ArmManeuver, path: JointPath) -> bool:
    """Whether the motion ends in one of the goal's configurations, up to full turns."""
    wanted = postures(asked.arm, asked.goal)
    apart = [np.abs((path.absolute(path.duration) - one + np.pi) % (2 * np.pi) - np.pi) for one in wanted]
    return min(float(np.max(one)) for one in apart) < LANDED
