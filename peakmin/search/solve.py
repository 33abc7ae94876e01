"""From a task to its plan: the best obstacle times and ways, with their proof, then the settings' own control."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import overload

from ..deadline import part
from ..errors import SpecError
from ..geometry.trajectory import Trajectory
from ..plan.answer import plan_of
from ..plan.arm_plan import ArmPlan
from ..plan.found import Found
from ..plan.plan import Plan
from ..programs.program import Programs
from ..proofs.bounds import Proof
from ..proofs.branch_and_bound import least_over_times
from ..scenes.blocks import BlockClasses, BlockProof, WayClass
from ..scenes.kinds import PointScene, scene_of
from ..spec.arm import ArmManeuver
from ..spec.maneuver import Maneuver
from ..spec.settings import Exact, GlobalSearch, RefineSearch, Settings, Uniform
from ..spec.spec import refuse_unfit
from ..spec.task import Task
from ..types import Progress
from .arms import arm_plan
from .held import Hold
from .job import Best, Job
from .sweep import best_of_sweep, closer, refined
from .tree import Effort, Tree, raised

PROVING = 0.1, 0.5  # of a search's time, and no more than so many seconds, for its proof
NEARBY = 1 / 64  # of the duration: where a polygon's or a uniform grid's best times are looked for


@overload
def solve(
    task: Maneuver,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
    stopped: threading.Event | None = ...,
) -> Plan: ...
@overload
def solve(
    task: ArmManeuver,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
    stopped: threading.Event | None = ...,
) -> ArmPlan: ...
@overload
def solve(
    task: Task,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
    stopped: threading.Event | None = ...,
) -> Plan: ...
def solve(
    task: Task,
    settings: Settings | None = None,
    progress: Progress | None = None,
    programs: Programs | None = None,
    stopped: threading.Event | None = None,
) -> Plan:
    """The motion of least peak base reaction force, with its proof.

    Args:
        task: what to do: of a centre of mass, or of an arm in its workspace.
        settings: how; default an exact disc, 200 aligned holds, M as a variable, a global search to a gap of 1e-6.
        progress: called with (done, total).
        programs: where compiled programs are taken from; default a place of its own.
        stopped: to be set when the search is to end with the best it has, as its time limit ends it.

    Raises:
        SpecError: when the settings do not fit the task.
    """
    settings = settings or Settings()
    refuse_unfit(task, settings)
    scene, job = scene_of(task), Job.begun(settings, progress, programs, stopped)
    if scene.kind == "arm":
        return arm_plan(scene, job)
    return _point_plan(scene, job)


def _point_plan(scene: PointScene, job: Job) -> Plan:
    """The best obstacle times and ways, then the settings' own control there, held to what it must keep."""
    found, one = _best(scene, job)
    plan = plan_of(scene, job.settings, found)
    # a sweep's times are those that were asked for: no others are looked for
    return _kept_out(scene, job, plan, one) if isinstance(job.settings.search, GlobalSearch) else plan


def _best(scene: PointScene, job: Job) -> tuple[Found[Trajectory], WayClass | None]:
    """The settings' control at the best obstacle times, and the ways past blocks that it takes."""
    one = None
    if scene.classes is not None:
        best, one = _past_blocks(scene.classes, job)
    elif isinstance(job.settings.search, GlobalSearch):
        best = _past_walls(scene, job)
    else:
        best = (refined if isinstance(job.settings.search, RefineSearch) else best_of_sweep)(scene.task, job)
    return job.at(best), one


def _past_walls(scene: PointScene, job: Job) -> Best:
    """Branch and bound in continuous time; where the settings' own control has other best times, those nearby."""
    settings, mass = job.settings, scene.mass
    assert isinstance(settings.search, GlobalSearch)
    least = job.least(scene.task.past(scene.task.walls))
    same = isinstance(settings.method, Exact) or (
        settings.circle.kind == "disc" and not isinstance(settings.grid, Uniform)
    )
    # what proves the answer is evaluated once more in the end
    until = part(job.until, *PROVING) if same and scene.task.simple else part(job.until)
    found = least_over_times(mass, settings.search.gap, settings.node_limit, until, job.progress)
    times = found.times * mass.time
    if not same and mass.walls:
        times = closer(least, times, NEARBY * mass.time, job.until)
    return Best(least, times, found.nodes, Proof("all", tuple(found.leaves)))


def _past_blocks(classes: BlockClasses, job: Job) -> tuple[Best, WayClass]:
    """The search over the ways in continuous time, the best times past the walls that it put up, and the best way."""
    settings = job.settings
    assert isinstance(settings.search, GlobalSearch)
    if classes.cells.ways is None:
        raise SpecError(
            "maneuver.obstacles: was closed on the sides asked for, must leave a way between start and goal"
        )
    effort = Effort(settings.search.gap, settings.node_limit, settings.rounds, part(job.until), progress=job.progress)
    tree = Tree(classes, effort)
    tree.run()
    best = tree.best or tree.nearest
    least, times = raised(classes, best, job, again=tree.best is not None)
    return Best(least, times, effort.boxes, BlockProof(tree.root.trunk.branch())), best.one


def _kept_out(scene: PointScene, job: Job, plan: Plan, one: WayClass | None = None) -> Plan:
    """The plan, or where its path leaves the region, goes too fast or meets a wall again, one that does not."""
    if plan.status != "unknown" or plan.kept is None or plan.kept.passed:
        return plan
    hold = Hold(scene, plan.crossing, job, one)
    found = hold.best(plan.obstacle_times / scene.task.duration)
    before = plan.made
    made = replace(
        job.made(before.nodes, hold.count),
        compilations=before.compilations + hold.count.compilations,
        solves=before.solves + hold.count.solves,
    )
    if found is None:
        ended = replace(plan, made=made)
        vars(ended)["kept"] = plan.kept  # proved a moment ago
        return ended
    return plan_of(scene, job.settings, replace(found, proof=plan.proof, made=made))
