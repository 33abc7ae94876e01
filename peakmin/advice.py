"""Of an answer "unknown", or of one that a limit cut short: what is unknown, and what to try."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .circle import Disc
from .obstacles import Block
from .plan import Plan
from .spec import SOLVERS, Direct, Exact, GlobalSearch, Maneuver, Settings

if TYPE_CHECKING:
    from .arm.plan import ArmPlan

LARGE = 1e-3  # a gap of which is said why
NEARLY = 0.9  # of a limit: what took so much of it was stopped by it


def advice(plan: Plan | ArmPlan) -> list[str]:
    """First what is unknown, then what to try, a line each; nothing for other answers."""
    search, more = plan.settings.search, _more_time(plan)
    if plan.status == "solved" and isinstance(search, GlobalSearch) and plan.gap > search.gap:
        what = f"whether a smaller peak can be had: none is below {plan.lower_bound:.6g} m/s²{_not_in_the_bound(plan)}"
        return [what, *more] if more or (plan.gap > LARGE and isinstance(plan.settings.circle, Disc)) else []
    if plan.status != "unknown":
        return []
    limit, bound = plan.maneuver.max_peak, f"{plan.lower_bound:.6g} m/s²"
    where = "" if plan.scope == "all" else " at these obstacle times"
    if plan.trajectory is None:
        what = f"whether there is a control and how small its peak is{where}: none was found; none is below {bound}"
        return [what, *more, *_other_program(plan.settings), *_all_times(plan)]
    if limit is not None and plan.peak > limit:
        what = f"whether a peak of {limit:.6g} m/s² (max_peak) can be kept{where}: this path has {plan.peak:.6g}"
        return [f"{what}, none is below {bound}", *more, *_finer(plan), *_all_times(plan)]
    what = f"whether a path keeps all that was asked, and at what peak: this one does not; none is below {bound}"
    return [what, *more, *_other_numbers(plan), *_finer(plan)]


def _not_in_the_bound(plan: Plan | ArmPlan) -> str:
    """What was asked for of which the bound does not know, in words."""
    asked = plan.maneuver
    if not isinstance(asked, Maneuver):
        return ""
    names = [name for name in ("region", "max_speed") if getattr(asked, name) is not None]
    return f", a bound that does not know of {' and '.join(names)}" if names else ""


def _other_numbers(plan: Plan | ArmPlan) -> list[str]:
    """Changes of what was asked that may help a path that does not keep it."""
    if not isinstance(plan, Plan):
        tries = {
            "limits": "wider limits, the other elbow, or other poses",
            "max_speed": "a larger max_speed, or a longer duration",
        }
        return [text for name, text in tries.items() if any(f".{name}:" in one for one in plan.exceeded)]
    if plan.trajectory is None:
        return []
    asked, kept, out = plan.maneuver, plan.keeping(), []
    if kept.walls < 0 and len(asked.walls) > 1:
        out.append("the walls in another order: they are passed as they are listed")
    if asked.max_speed is not None and kept.speed > asked.max_speed:
        out.append("a larger max_speed, or a longer duration")
    if kept.region < 0 and asked.blocks:
        out.append("the other side of a block: side left or right")
    return out


def _more_time(plan: Plan | ArmPlan) -> list[str]:
    """Limits that the search came to."""
    settings, made, out = plan.settings, plan.made, []
    if settings.time_limit is not None and made.seconds >= NEARLY * settings.time_limit:
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


def _finer(plan: Plan | ArmPlan) -> list[str]:
    """What a path that is better by a little may need."""
    if not isinstance(plan, Plan) and plan.exceeded and plan.free:
        return []
    settings = plan.settings
    out = [f"more steps: {2 * settings.grid.steps} in place of {settings.grid.steps}"]
    if isinstance(settings.circle, Disc) and not isinstance(settings.method, Exact):
        out.append("method exact, in continuous time")
    if any(isinstance(one, Block) for one in plan.maneuver.obstacles):
        out.append(f"more rounds: {2 * settings.rounds} in place of {settings.rounds}")
    return out


def _all_times(plan: Plan | ArmPlan) -> list[str]:
    """Whether other obstacle times are left to look at."""
    return [] if isinstance(plan.settings.search, GlobalSearch) else ["search global, over all obstacle times"]
