"""From an arm's task to its plan: the search in continuous time, then the settings' own control."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..check import check
from ..frame import Frame
from ..least import LeastPeak
from ..plan import Made, Status, peak_of
from ..progress import Progress
from ..spec import GlobalSearch, Maneuver, Settings
from .clearance import link_clearance
from .course import Course
from .joints import JointPath
from .plan import ArmPlan
from .proof import ArmProof
from .redundant import redundant
from .search import ArmSearch, Found
from .spec import ArmManeuver, check_arm, postures
from .tree import FIRST_LIFT, LIFTS, Candidate
from .workspace import Workspace

LANDED = 1e-5  # rad: close to a stretched arm angles go with the root of a distance


def solve_arm(maneuver: ArmManeuver, settings: Settings | None = None, progress: Progress | None = None) -> ArmPlan:
    """The motion of least peak base reaction force of an arm, with its proof.

    Args:
        maneuver: the arm, its poses, its obstacles.
        settings: as for `solve`; the search must be global.
        progress: called with (done, total).

    Raises:
        SpecError: when the settings do not fit.
    """
    settings = settings or Settings()
    check_arm(maneuver, settings)
    began, workspace = time.perf_counter(), Workspace(maneuver)
    assert isinstance(settings.search, GlobalSearch)
    if workspace.chain.links > 2:
        return redundant(workspace, settings, began)
    circle = settings.circle.facing(0.0)
    search = ArmSearch(workspace, settings.search.gap, circle)
    found = search.run(settings.rounds, settings.time_limit or math.inf, progress)
    kept = _kept(workspace, settings, found, began)
    turned = _turned(workspace, settings, found, began)
    if kept is None or (turned is not None and turned.status == "solved" and turned.peak < kept.peak):
        kept = turned or kept
    if kept is not None:
        return kept
    nothing = found.nearest
    crossing = passages(workspace)[0].maneuver if nothing is None else nothing.past
    return finished(
        workspace,
        settings,
        crossing,
        np.zeros(len(crossing.walls)),
        None,
        math.inf,
        found.proof,
        _made(settings, found, began),
    )


def _made(settings: Settings, found: Found, began: float, least: LeastPeak | None = None) -> Made:
    count = None if least is None else least.count
    return Made(
        settings.solver,
        0 if count is None else count.compilations,
        0 if count is None else count.solves,
        found.nodes,
        time.perf_counter() - began,
    )


def _kept(workspace: Workspace, settings: Settings, found: Found, began: float) -> ArmPlan | None:
    """The settings' control along the best order of gaps, these narrowed until it is free; None where there is none."""
    best: Candidate | None = found.best or found.nearest
    if best is None:
        return None
    passage, past, lift = best.passage, best.past, best.lift
    plan: ArmPlan | None = None
    for _ in range(LIFTS if found.best else 1):
        least = LeastPeak(past, settings)
        times = best.times * past.duration
        bracket, motion = least(times), least.motion(times)
        if motion is None:
            return plan
        path = JointPath(workspace.chain, motion, (0, 1), passage.elbow, (), None, passage.theta[0])
        peak = max(peak_of(bracket, settings.circle) * least.mass.unit, motion.peak())
        plan = finished(workspace, settings, past, times, path, peak, found.proof, _made(settings, found, began, least))
        assert plan.clear is not None
        short = max(workspace.maneuver.margin - plan.clear.least, -plan.clear.within)
        if plan.status == "solved" or not short > 0 or not best.paths:
            break
        lift += max(1.3 * short, FIRST_LIFT * workspace.size)
        raised = passage.past(best.paths, lift)
        if raised is None:
            break
        past = raised
    if (
        plan is not None
        and plan.clear is not None
        and (plan.clearance < workspace.maneuver.margin or plan.clear.within < 0)
    ):
        return _cut(workspace, settings, found, best, began) or plan
    return plan


def _cut(workspace: Workspace, settings: Settings, found: Found, best: Candidate, began: float) -> ArmPlan | None:
    """A control whose path is kept out of everything node by node."""
    circle = settings.circle.facing(Frame.from_maneuver(best.past).angle)
    for past, times in ((best.past, best.times), (best.passage.maneuver, np.zeros(0))):
        course = Course(best.passage, past, circle, settings.grid.steps)
        free = course.free(np.clip(times, 1e-3, 1 - 1e-3))
        if free is not None:
            motion, path = free
            made = _made(settings, found, began)
            at = times * past.duration
            return finished(workspace, settings, past, at, path, motion.peak(), found.proof, made)
    return None


def _turned(workspace: Workspace, settings: Settings, found: Found, began: float) -> ArmPlan | None:
    """The settings' control of the best motion that turns its elbow over; None where there is none."""
    if found.turned is None:
        return None
    turn = found.turned.finer(settings.grid.steps) or found.turned
    made = _made(settings, found, began)
    at = turn.times * turn.course.past.duration
    return finished(workspace, settings, turn.course.past, at, turn.joints, turn.peak, found.proof, made)


def finished(
    workspace: Workspace,
    settings: Settings,
    crossing: Maneuver,
    times: Array,
    path: JointPath | None,
    peak: float,
    proof: ArmProof,
    made: Made,
) -> ArmPlan:
    """The plan, solved only if its motion passes every check. Times [s], peak [m/s^2]."""
    bound, clear, limit = proof.bound(workspace.maneuver), None, workspace.maneuver.max_peak or math.inf
    kept = False
    if path is not None and not check(crossing, path.motion, times, peak).passed:
        path, peak = None, math.inf
    if path is not None:
        clear = link_clearance(workspace, path)
        kept = clear.least >= workspace.maneuver.margin and clear.within >= 0 and lands(workspace, path)
    plan = ArmPlan(workspace.maneuver, settings, "unknown", crossing, times, path, clear, peak, bound, proof, made)
    status: Status = "unknown"
    if kept and peak <= limit and not plan.exceeded:
        status = "solved"
    elif bound > limit:
        status = "infeasible"
    return replace(plan, status=status)


def lands(workspace: Workspace, path: JointPath) -> bool:
    """Whether the motion ends in one of the goal's configurations, up to full turns."""
    end = path.absolute(path.duration)
    apart = [
        np.abs((end - goal + np.pi) % (2 * np.pi) - np.pi)
        for goal in postures(workspace.maneuver.arm, workspace.maneuver.goal)
    ]
    return min(float(np.max(one)) for one in apart) < LANDED
