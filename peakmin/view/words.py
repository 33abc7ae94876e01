"""What the terminal says of a plan and of a sweep."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..plan.plan import Plan
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Block
from ..spec.settings import SOLVERS, Direct, Exact, GlobalSearch, Settings

if TYPE_CHECKING:
    from ..plan.arm_plan import ArmPlan
if TYPE_CHECKING:
    from ..plan.arm_plan import ArmPlan
    from ..plan.plan import Plan
    from ..queries.study.table import Study
    from ..search.sweep import Sweep

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
    asked, kept, out = plan.maneuver, plan.kept, []
    if kept is None:
        return []
    if any(one.field.startswith("obstacles") for one in kept.excesses) and len(asked.walls) > 1:
        out.append("the walls in another order: they are passed as they are listed")
    if kept.of("max_speed"):
        out.append("a larger max_speed, or a longer duration")
    if kept.of("region") and asked.blocks:
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


ROWS = 60  # of a study, on a terminal


def one_line(text: str) -> str:
    """The text without what a terminal would take for a command or a new line, as file names may have it."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def describe(plan: Plan) -> str:
    search = plan.settings.search.kind
    return facts(plan) + (
        f"\n  made by         {plan.made.solver}, search {search}, {plan.made.solves} solves of "
        f"{plan.made.compilations} compiled programs, {plan.made.nodes} boxes, {plan.made.seconds:.2f} s"
    )


def facts(plan: Plan) -> str:
    times = ", ".join(f"{t:.6g} s" for t in plan.obstacle_times) or "none"
    covered = "every obstacle time" if plan.scope == "all" else "these obstacle times only"
    lines = opening(plan, f"any control, over {covered}")
    lines.append(f"  obstacle times  {times}")
    if math.isfinite(plan.clearance):
        where = (
            ""
            if plan.clearance >= plan.maneuver.margin
            else ", closer than asked"
            if plan.clearance >= 0
            else ": inside"
        )
        lines.append(f"  clearance       {plan.clearance:.6g} m at every instant{where}")
    if plan.status != "solved" and plan.trajectory is not None:
        lines += [f"  not kept        {one}" for one in not_kept(plan)]
    return "\n".join([*lines, *advised(plan)])


def advised(plan: Plan | ArmPlan) -> list[str]:
    """Of an answer "unknown" what is unknown and what to try."""
    found = advice(plan)
    return [f"  {'try' if k else 'unknown':<14}  {one}" for k, one in enumerate(found)]


def opening(plan: Plan | ArmPlan, bounded: str) -> list[str]:
    """Status, peak, max_peak, bound (of what) and gap."""
    found = math.isfinite(plan.peak)
    head = f"peak {plan.peak:.9g} m/s², peak base force {plan.peak_force:.9g} N" if found else "no motion"
    if plan.status == "infeasible":
        lines = [f"{plan.status}: nothing keeps all that was asked (proved)"]
        lines += [f"  path found      {head}, does not keep it either"] if found else []
    else:
        other = "the path found, which does not keep all that was asked, has " if found else ""
        lines = [f"{plan.status}: {other if plan.status == 'unknown' else ''}{head}"]
    limit = plan.maneuver.max_peak
    if limit is not None and plan.status != "solved":
        proved = "nothing keeps it (proved)" if plan.status == "infeasible" else "not proved to be impossible"
        lines.append(f"  max_peak        {limit:.9g} m/s²: {proved}")
    lines.append(f"  lower bound     {plan.lower_bound:.9g} m/s² for {bounded}")
    if found and plan.peak >= plan.lower_bound * (1 - 1e-9):
        lines.append(f"  gap             {plan.gap:.2e} of the peak")
    return lines


def not_kept(plan: Plan) -> list[str]:
    """What the path that was found does not keep of what was asked, in words."""
    shown = plan.scene.impossible()
    said = [] if shown is None else [f"{', '.join(shown.fields)}: {shown.because}"]
    excesses = () if plan.kept is None else plan.kept.excesses
    return said + [one.words for one in excesses if shown is None or one.field != "max_speed"]


def so_far(plan: Plan | ArmPlan) -> str:
    """What a search that was stopped has."""
    if plan.status == "solved":
        return f"the best plan so far has a peak of {plan.peak:.6g} m/s², {plan.gap:.1e} of it above the bound"
    return f"no plan so far, and none can have a peak below {plan.lower_bound:.6g} m/s²"


def done(sweep: Sweep) -> str:
    """How far a sweep came."""
    return f"{len(sweep.peak)} of {sweep.asked} obstacle times are done"


def table(sweep: Sweep) -> str:
    times = sweep.obstacle_times.reshape(len(sweep.peak), -1)
    lines = ["  T_obs [s]" + " " * (10 * max(times.shape[1] - 1, 0)) + "   least M [m/s²]   lower end"]
    for i, row in enumerate(times):
        mark = "  <- least" if i == sweep.winner else ""
        cells = " ".join(f"{t:9.4f}" for t in row) or " " * 9
        lines.append(f"  {cells}   {sweep.peak[i]:14.6f}   {sweep.lower[i]:9.4f}{mark}")
    if len(sweep.peak) < sweep.asked:
        lines.append(f"  {done(sweep)}")
    return "\n".join([*lines, describe(sweep.best)])


def rows(study: Study) -> str:
    """What varies and what came out, one line for each of the first rows."""
    lines = [[*study.varied, "status", "peak [m/s²]", "lower bound", "gap", "T_obs [s]"]]
    for row in study.rows[:ROWS]:
        bounds = [_short(row["peak"], ".6g"), _short(row["lower_bound"], ".6g"), _short(row["gap"], ".1e")]
        last = row["error"] or " ".join(f"{t:.4g}" for t in row["obstacle_times"] or [])
        lines.append([*(_short(row[name], ".6g") for name in study.varied), row["status"], *bounds, last])
    widths = [max(map(len, column)) for column in zip(*(line[:-1] for line in lines), strict=True)]
    text = ["  ".join([*(c.rjust(w) for c, w in zip(line, widths, strict=False)), line[-1]]) for line in lines]
    more = [f"  and {len(study) - ROWS} rows more"] if len(study) > ROWS else []
    return "\n".join([*text, *more, repr(study)])


def _short(value: Any, form: str) -> str:
    if isinstance(value, float):
        return format(value, form)
    return "" if value is None else str(value)
