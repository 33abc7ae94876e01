"""Arms of three and more links: planned in joint space; the bound is that of the centre of mass alone.

No motion whatsoever, whatever the joints do, has a smaller peak than the centre of mass's straight line.
"""

from __future__ import annotations

import math

import numpy as np

from ..plan.answer import plan_of
from ..plan.arm_plan import ArmPlan
from ..plan.found import Found
from ..proofs.branch_and_bound import least_over_times
from ..proofs.double_integrator import PointMass
from ..scenes.arm_proof import ArmProof, PassageProof
from ..scenes.kinds import ArmScene
from ..scenes.passages import Looks
from ..scenes.proof_tree import Branch
from .job import Job
from .planned import Joints, Planner, with_proof


def redundant(scene: ArmScene, job: Job) -> ArmPlan:
    """The plan of an arm of at least three links; "unknown" where no motion was met that keeps what is asked."""
    passage = next(iter(scene.passages.values()))
    mass = PointMass.of(passage.maneuver)
    certified = least_over_times(mass, 1e-6)
    proof = ArmProof((PassageProof(passage.indices, None, (), Branch(tuple(certified.leaves), Looks())),))
    planner = Planner(scene, job, job.until, certified.lower * mass.unit)
    found = planner.finished(planner.look({}, [passage]))
    if not found:
        times, made = np.zeros(0), job.made(0)
        none: Joints = Found(passage.maneuver, times, None, math.inf, made, proof, indices=passage.indices)
        return plan_of(scene, job.settings, none)
    plan = plan_of(scene, job.settings, with_proof(found[0], proof, job, planner, certified.nodes))
    return planner.calmer(plan) if scene.task.then == "moment" else plan
