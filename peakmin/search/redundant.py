"""Arms of three and more links, and what no joint can do: the bound is that of the centre of mass alone.

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
    """The plan of an arm, planned in joint space where it can be done; "unknown" where no motion met keeps all."""
    every = list(scene.passages.values())
    masses = [PointMass.of(passage.maneuver) for passage in every]
    certified = [least_over_times(mass, 1e-6) for mass in masses]
    proof = ArmProof(
        tuple(
            PassageProof(passage.indices, None, (), Branch(tuple(one.leaves), Looks()))
            for passage, one in zip(every, certified, strict=True)
        )
    )
    passage, floor = every[0], min(one.lower * mass.unit for one, mass in zip(certified, masses, strict=True))
    planner = Planner(scene, job, job.until, floor)
    found = [] if scene.impossible() is not None else planner.finished(planner.look({}, every))
    if not found:
        times, made = np.zeros(0), job.made(0)
        none: Joints = Found(passage.maneuver, times, None, math.inf, made, proof, indices=passage.indices)
        return plan_of(scene, job.settings, none)
    plan = plan_of(scene, job.settings, with_proof(found[0], proof, job, planner, sum(one.nodes for one in certified)))
    return planner.calmer(plan) if scene.task.then == "moment" else plan
