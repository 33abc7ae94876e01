"""From an arm's task to its plan: the search in continuous time, then the settings' own control."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from ..deadline import after, over, part
from ..plan.arm_plan import ArmPlan
from ..plan.plan import Made, peak_of
from ..programs.compiled import Programs
from ..programs.least_peak import LeastPeak
from ..robots.workspace import Workspace
from ..scenes.passages import passages
from ..spec.arm import ArmManeuver
from ..spec.frame import Frame
from ..spec.settings import GlobalSearch, Settings
from ..spec.spec import refuse_unfit
from ..types import Progress
from .arm_tree import FIRST_LIFT, LIFTS, Candidate
from .arms import ArmSearch, Found
from .course import Steered
from .finish import finished
from .redundant import redundant


def solve_arm(
    maneuver: ArmManeuver,
    settings: Settings | None = None,
    progress: Progress | None = None,
    programs: Programs | None = None,
) -> ArmPlan:
    """The motion of least peak base reaction force of an arm, with its proof.

    Args:
        maneuver: the arm, its poses, its obstacles.
        settings: as for `solve`; the search must be global.
        progress: called with (done, total).
        programs: where compiled programs are taken from; default a place of its own.

    Raises:
        SpecError: when the settings do not fit.
    """
    settings = settings or Settings()
    refuse_unfit(maneuver, settings)
    began, until, workspace = time.perf_counter(), after(settings.time_limit), maneuver.workspace
    assert isinstance(settings.search, GlobalSearch)
    if workspace.chain.links > 2:
        return redundant(maneuver, workspace, settings, began, until, programs)
    from ..programs import program  # noqa: F401  cvxpy takes a second to import, which is the search's

    search = ArmSearch(maneuver, workspace, settings.search.gap, settings.node_limit, part(until))
    found = search.run(settings.rounds, progress)
    plans = [_kept(workspace, settings, found, began, until, programs)]
    plans += [_steered(workspace, settings, found, one, began, until) for one in (found.steered, found.turned)]
    made = [plan for plan in plans if plan is not None]
    if made:
        return min(made, key=lambda plan: (plan.status != "solved", plan.peak))
    nothing = found.nearest
    passage = passages(maneuver, workspace)[0] if nothing is None else nothing.passage
    crossing = passage.maneuver if nothing is None else nothing.past
    none, made_so = np.zeros(len(crossing.walls)), _made(settings, found, began)
    return finished(passage, settings, crossing, none, None, math.inf, found.proof, found.bound, made_so)


def _made(settings: Settings, found: Found, began: float, least: LeastPeak | None = None) -> Made:
    count = None if least is None else least.count
    return Made(
        settings.solver,
        0 if count is None else count.compilations,
        0 if count is None else count.solves,
        found.nodes,
        time.perf_counter() - began,
    )


def _kept(
    workspace: Workspace, settings: Settings, found: Found, began: float, until: float, programs: Programs | None
) -> ArmPlan | None:
    """The settings' control along the best order of gaps, these narrowed until it is free; None where there is none."""
    best: Candidate | None = found.best or found.nearest
    if best is None:
        return None
    passage, past, lift = best.passage, best.past, best.lift
    plan: ArmPlan | None = None
    for _ in range(LIFTS if found.best else 1):
        least = LeastPeak(past, settings, until=until, programs=programs)
        times = best.times * past.duration
        bracket, motion = least(times), least.motion(times)
        if motion is None:
            return plan
        path = passage.joints(motion)
        times = least.place(times) * past.duration
        peak = max(peak_of(bracket, settings.circle) * least.mass.unit, motion.peak())
        plan = finished(
            passage,
            settings,
            past,
            times,
            path,
            peak,
            found.proof,
            found.bound,
            _made(settings, found, began, least),
        )
        if plan.clear is None:
            return plan
        short = plan.clear.short(workspace)
        if plan.status == "solved" or not short > 0 or not best.paths or over(until):
            break
        lift += max(1.3 * short, FIRST_LIFT * workspace.size)
        raised = passage.past(best.paths, lift)
        if raised is None:
            break
        past = raised
    return plan


def _steered(
    workspace: Workspace, settings: Settings, found: Found, one: Steered | None, began: float, until: float
) -> ArmPlan | None:
    """The settings' control of a motion that is kept out of everything node by node; None where there is none."""
    if one is None:
        return None
    course = replace(one.course, circle=settings.circle.facing(Frame.from_maneuver(one.course.past).angle))
    fine = replace(one, course=course).finer(settings.grid.steps, until) or one
    at, made = fine.times * course.past.duration, _made(settings, found, began)
    return finished(course.passage, settings, course.past, at, fine.joints, fine.peak, found.proof, found.bound, made)
