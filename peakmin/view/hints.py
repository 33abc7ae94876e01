"""Of an answer that is unknown, or not good: what is unknown, and what to try. Of a spec: units not meant."""

from __future__ import annotations

from ..deadline import SHARE
from ..plan.plan import Plan
from ..spec.control_set import Disc
from ..spec.settings import SOLVERS, Direct, GlobalSearch, Settings
from ..spec.task import Task
from .kinds import kind_of

LARGE = 1e-3  # a gap of which is said why
NEARLY = 0.9  # of a limit: what took so much of it was stopped by it


def advice(plan: Plan) -> list[str]:
    """First what is unknown, then what to try, a line each; nothing for other answers."""
    if plan.keeps:
        return _of_a_gap(plan)
    if plan.status != "unknown":
        return []
    limit, bound, kind = plan.maneuver.max_peak, f"{plan.lower_bound:.6g} m/s²", kind_of(plan)
    where = "" if plan.scope == "all" else " at these obstacle times"
    if plan.trajectory is None:
        if few := kind.holds(plan):
            return few
        what = f"whether there is a control and how small its peak is{where}: none was found; none is below {bound}"
        return [what, *_more_time(plan), *_other_program(plan.settings), *_all_times(plan)]
    if limit is not None and plan.peak > limit:
        what = f"whether a peak of {limit:.6g} m/s² (max_peak) can be kept{where}: this path has {plan.peak:.6g}"
        return [f"{what}, none is below {bound}", *_more_time(plan), *kind.finer(plan), *_all_times(plan)]
    what = f"whether a path keeps all that was asked, and at what peak: this one does not; none is below {bound}"
    return [what, *_more_time(plan), *kind.tries(plan), *kind.finer(plan)]


def units(task: Task) -> list[str]:
    """Numbers of a spec that look like degrees or millimetres, a line each."""
    return kind_of(task).units(task)


def _of_a_gap(plan: Plan) -> list[str]:
    """Where the gap is larger than asked for: what the bound does not know of, or what stopped the search."""
    search, more = plan.settings.search, _more_time(plan)
    if not isinstance(search, GlobalSearch) or plan.gap <= search.gap:
        return []
    if not more and (plan.gap <= LARGE or not isinstance(plan.settings.circle, Disc)):
        return []
    names = [name for name in ("region", "max_speed") if getattr(plan.maneuver, name, None) is not None]
    but = f", a bound that does not know of {' and '.join(names)}" if names else ""
    return [f"whether a smaller peak can be had: none is below {plan.lower_bound:.6g} m/s²{but}", *more]


def _more_time(plan: Plan) -> list[str]:
    """Limits that the search came to."""
    settings, made, out = plan.settings, plan.made, []
    if made.stopped and settings.time_limit is not None and made.seconds >= (1 - SHARE) * settings.time_limit:
        out.append(f"a larger time_limit: {settings.time_limit:g} s were used up")
    if made.nodes >= NEARLY * settings.node_limit:
        out.append(f"a larger node_limit: {settings.node_limit} boxes were used up")
    return out


def _other_program(settings: Settings) -> list[str]:
    """What else can be asked for a control."""
    others = [name for name in SOLVERS[settings.circle.kind] if name != settings.solver]
    out = [f"another solver: {' or '.join(others)} in place of {settings.solver}"]
    if not isinstance(settings.method, Direct):
        out.append(f"method direct, in place of {settings.method.kind}")
    return [*out, f"another number of steps: {settings.grid.steps} now"]


def _all_times(plan: Plan) -> list[str]:
    """Whether other obstacle times are left to look at."""
    return [] if isinstance(plan.settings.search, GlobalSearch) else ["search global, over all obstacle times"]
