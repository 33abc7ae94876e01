"""Arms of three and more links: the joints' motion of least speed that follows the centre of mass's best path.

The centre of mass takes the straight way, whose peak no motion can undercut. The angles that are free on the way are
splines; among them the one is taken that makes  int |q'|^2 dt  least, q the joint angles, and keeps clear.
"""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from ..deadline import OverError, over
from ..geometry.norm import norm
from ..plan.answer import plan_of
from ..plan.arm_plan import ArmPlan
from ..plan.found import Found
from ..proofs.branch_and_bound import least_over_times
from ..proofs.double_integrator import PointMass
from ..robots.joints import JointPath, steadiest
from ..robots.workspace import Workspace
from ..scenes.arm_proof import ArmProof, PassageProof
from ..scenes.kinds import ArmScene
from ..scenes.passages import Looks
from ..scenes.proof_tree import Branch
from ..types import Array
from .job import Job

KNOTS = 6  # between start and goal
SAMPLES = 120
WEIGHTS = (0.0, 1e2, 1e4)  # of what is not kept, round by round; relative to the straight way's speed
ROOM = 0.005  # of the arm: a clearance below which it counts as not kept


def redundant(scene: ArmScene, job: Job) -> ArmPlan:
    """The plan of an arm of at least three links; "unknown" where the links cannot be kept clear on this path."""
    workspace, passage = scene.workspace, next(iter(scene.passages.values()))
    mass = PointMass.of(passage.maneuver)
    certified = least_over_times(mass, 1e-6)
    proof = ArmProof((PassageProof(passage.indices, None, (), Branch(tuple(certified.leaves), Looks())),))
    least, none = job.least(passage.maneuver), np.zeros(0)
    motion, path = least.motion(none), None
    pair = steadiest(workspace.chain, *passage.theta)
    if motion is not None and pair is not None:
        first = JointPath(workspace.chain, motion, *pair, (), None, passage.theta[0])
        path = slowest(workspace, first, passage.theta[1], job.until)
    peak, made = math.inf if path is None else least.peak(none), job.made(certified.nodes, least.count)
    found = Found(passage.maneuver, none, path, peak, made, proof, indices=passage.indices)
    return plan_of(scene, job.settings, found)


def slowest(workspace: Workspace, path: JointPath, goal: Array, until: float = math.inf) -> JointPath:
    """The path with the free angles of least int |q'|^2 dt that keeps clear, to the goal's absolute angles (n,).

    At the deadline `until` the best that was met is taken.
    """
    rest, margin = path.rest, workspace.margin
    first, last = path.start[rest], goal[rest]
    knots = np.linspace(0, path.duration, KNOTS + 2)
    t = np.linspace(0, path.duration, SAMPLES + 1)
    size, pair = workspace.size, path.two
    scale = float(np.sum((goal - path.start) ** 2)) / path.duration or 1.0

    def through(x: Array) -> JointPath:
        values = np.vstack([first, x.reshape(KNOTS, -1), last])
        spline = CubicSpline(knots, values, bc_type="clamped")
        return JointPath(path.chain, path.motion, path.pair, path.elbow, (), spline, path.start)

    best: tuple[float, Array]

    def cost(x: Array, weight: float) -> float:
        nonlocal best
        if over(until):
            raise OverError
        trial = through(x)
        rho = norm(trial.left(t))
        short = np.maximum(np.maximum(rho - pair.outer, pair.inner - rho) + ROOM * size, 0.0)
        with np.errstate(all="ignore"):
            theta, rates, _ = trial.rates(t)
        speed = np.diff(rates, axis=-1, prepend=0.0)
        energy = float(np.trapezoid(np.minimum(np.nan_to_num(np.sum(speed**2, axis=-1), nan=1e6), 1e6), t))
        if weight and workspace.obstacles:
            near = margin + ROOM * size - np.min(workspace.clearance(theta), axis=-1)
            short = short + np.maximum(near, 0.0)
        found = energy + scale * (1e3 + weight) * float(np.mean((short / size) ** 2)) * 1e2
        best = min(best, (found, x.copy()), key=lambda one: one[0])
        return found

    x = (first + np.linspace(0, 1, KNOTS + 2)[1:-1, None] * (last - first)).ravel()
    for weight in WEIGHTS if workspace.obstacles else WEIGHTS[:1]:
        best = math.inf, x
        with suppress(OverError):
            x = minimize(cost, x, args=(weight,), method="L-BFGS-B", options={"maxiter": 60}).x
            continue
        x = best[1]
        break
    return through(x)
