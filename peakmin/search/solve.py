"""The best obstacle times: proved over all of them, refined from a first guess, or the best of a sweep."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..deadline import after, over, part
from ..errors import SpecError
from ..plan.plan import Plan, from_bracket, peak_of
from ..programs.compiled import Count, Programs
from ..programs.least_peak import LeastPeak
from ..proofs.bounds import Proof
from ..proofs.branch_and_bound import least_over_times
from ..proofs.double_integrator import PointMass
from ..scenes.blocks import Cells, Way, WaysProof
from ..scenes.kept import keeping
from ..spec.control_set import Disc, Polygon
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.settings import SOLVERS, Direct, Exact, GlobalSearch, RefineSearch, Settings, Uniform
from ..spec.spec import refuse_unfit
from ..types import Array, Progress
from .sweep import plan_at, sweep
from .tree import FIRST_LIFT, LIFTS, Search

FINEST = 1e-4  # of the duration: `refine` stops here (an aligned M(T_obs) is flat to 1e-8 around its minimum)
NEARBY = 1 / 64  # of the duration: where a polygon's or a uniform grid's best times are looked for


def solve(
    maneuver: Maneuver,
    settings: Settings | None = None,
    progress: Progress | None = None,
    programs: Programs | None = None,
) -> Plan:
    """The maneuver of least peak base reaction force, with its proof.

    Args:
        maneuver: what to do.
        settings: how; default an exact disc, 200 aligned holds, M as a variable, a global search to a gap of 1e-6.
        progress: called with (done, total).
        programs: where compiled programs are taken from; default a place of its own.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """
    settings = settings or Settings()
    refuse_unfit(maneuver, settings)
    until = after(settings.time_limit)
    if maneuver.blocks:
        return _past_blocks(maneuver, settings, progress, until, programs)
    if isinstance(settings.search, GlobalSearch):
        return _keeping(_global(maneuver, settings, progress, until, programs), until)
    if isinstance(settings.search, RefineSearch):
        return _refine(maneuver, settings, progress, programs)
    return sweep(maneuver, settings, progress=progress, programs=programs).best


def _global(
    maneuver: Maneuver, settings: Settings, progress: Progress | None, until: float, programs: Programs | None
) -> Plan:
    """Branch and bound in continuous time, then the settings' own control at (or near) the best times."""
    began = time.perf_counter()
    assert isinstance(settings.search, GlobalSearch)
    mass = PointMass.of(maneuver)
    least = LeastPeak(maneuver.past(maneuver.walls), settings, until=until, programs=programs)
    same = isinstance(settings.method, Exact) or (
        isinstance(settings.circle, Disc) and not isinstance(settings.grid, Uniform)
    )
    search_until = until if same and maneuver.simple else part(until)
    found = least_over_times(mass, settings.search.gap, settings.node_limit, search_until, progress)
    times = found.times * mass.time
    if not same and mass.walls:
        times = _closer(least, times, NEARBY * mass.time, until)
    proof = Proof("all", tuple(found.leaves))
    return plan_at(least, times, began, nodes=found.nodes, proof=proof, of=maneuver)


def _past_blocks(
    maneuver: Maneuver, settings: Settings, progress: Progress | None, until: float, programs: Programs | None
) -> Plan:
    """The search over the ways in continuous time, then the settings' own control past the walls that it put up.

    A held control bends a little otherwise than the one that was proved free: its walls are raised until it is free.
    """
    began = time.perf_counter()
    assert isinstance(settings.search, GlobalSearch)
    cells = Cells.of(maneuver)
    if cells.ways is None:
        raise SpecError(
            "maneuver.obstacles: was closed on the sides asked for, must leave a way between start and goal"
        )
    found = Search(cells, settings.search.gap, settings.node_limit, part(until)).run(
        cells.ways, settings.rounds, progress
    )
    free, proof = found.best or found.nearest, WaysProof(found.branches)
    lift, past = free.lift, free.past
    times = free.times * maneuver.duration
    for _ in range(LIFTS):
        least = LeastPeak(past, settings, until=until, programs=programs)
        motion = least.motion(times)
        if motion is None or found.best is None or over(until):
            break
        kept = keeping(maneuver, motion)
        short = -min(kept.walls, kept.blocks)
        if not short > 0:
            break
        lift += max(1.3 * short, FIRST_LIFT * cells.size)
        raised = cells.maneuver_past(free.way, free.lines, lift)
        if raised is None or not raised.walls:
            break
        past = raised
    plan = plan_at(least, times, began, nodes=found.nodes, proof=proof, of=maneuver)
    return _keeping(plan, until, cells, free.way)


def _keeping(plan: Plan, until: float, cells: Cells | None = None, way: Way = ()) -> Plan:
    """The plan, or where its path leaves the region, goes too fast or meets a wall again, one that does not."""
    if plan.status != "unknown" or plan.trajectory is None or plan.keeping().passed(plan.maneuver):
        return plan
    from .held import KeptProgram

    began, count = time.perf_counter(), Count()
    circle = plan.settings.circle.facing(Frame.from_maneuver(plan.maneuver).angle)
    program = KeptProgram(plan.maneuver, plan.walls, circle, plan.settings.grid, count, cells, way, until)
    found = program.best(plan.obstacle_times / plan.maneuver.duration)
    if found is None:
        return plan
    times, bracket, motion = found
    made = replace(
        plan.made,
        compilations=plan.made.compilations + count.compilations,
        solves=plan.made.solves + count.solves,
        seconds=plan.made.seconds + time.perf_counter() - began,
    )
    return from_bracket(plan.maneuver, plan.settings, times, bracket, motion, plan.proof, made, plan.walls)


def _refine(maneuver: Maneuver, settings: Settings, progress: Progress | None, programs: Programs | None) -> Plan:
    """A sweep with n = 1 over the whole duration (the paper's good initial guess), then closer with the real circle."""
    began = time.perf_counter()
    assert isinstance(settings.search, RefineSearch)
    walls, count = len(maneuver.walls), settings.search.count
    until = after(settings.time_limit)
    least = LeastPeak(maneuver, settings, until=until, programs=programs)
    if not walls:
        return plan_at(least, np.zeros(0), began)
    coarse_solver = settings.solver if settings.solver in SOLVERS["polygon"] else "CLARABEL"
    coarse_settings = settings.model_copy(update={"method": Direct(), "solver": coarse_solver})
    coarse = LeastPeak(maneuver, coarse_settings, circle=Polygon(segments=1), until=until, programs=programs)
    spacing = maneuver.duration / (count + 1)
    points = list(itertools.combinations(spacing * np.arange(1, count + 1), walls))
    ends: list[float] = []
    part_of_it = part(until)
    for done, point in enumerate(points, 1):
        ends.append(coarse(np.array(point)).upper)
        if progress:
            progress(done, len(points))
        if over(part_of_it):
            break
    best = _closer(least, np.array(points[int(np.argmin(ends))]), spacing, until)
    return plan_at(least, best, began, also=coarse)


def _closer(least: LeastPeak, best: Array, spacing: float, until: float) -> Array:
    """Better obstacle times [s] near the given ones, shape (q,).

    Each round asks around the winner at half the spacing of the round before, until it is 1e-4 of the duration or
    half a node of a uniform grid, or the time is over.
    """
    grid, duration = least.settings.grid, least.mass.time
    finest = duration * (max(FINEST, 0.5 / grid.steps) if isinstance(grid, Uniform) else FINEST)
    while spacing > finest and not over(until):
        around = itertools.takewhile(lambda _: not over(until), _around(best, spacing, duration))
        best = min(around, key=lambda point: peak_of(least(point), least.settings.circle), default=best)
        spacing /= 2
    return best


def _around(best: Array, spacing: float, duration: float) -> Iterator[Array]:
    """The ordered obstacle times within one spacing of the best ones, the best itself first."""
    yield best
    offsets = (-1.0, -0.5, 0.0, 0.5, 1.0) if len(best) == 1 else (-1.0, 0.0, 1.0)
    for offset in itertools.product(offsets, repeat=len(best)):
        point = best + spacing * np.array(offset)
        if np.all(np.diff([0.0, *point, duration]) > 0):
            yield point
