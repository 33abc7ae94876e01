"""Of an answer that is unknown, or not good: what is unknown, and what to try. Of a spec: units not meant."""

from __future__ import annotations

import math

from ..deadline import SHARE
from ..geometry.norm import length
from ..plan.plan import Plan
from ..spec.arm import ArmManeuver
from ..spec.control_set import Disc
from ..spec.maneuver import Maneuver
from ..spec.settings import SOLVERS, Direct, Exact, GlobalSearch, Settings
from ..spec.task import Task
from .kinds import kind_of
from .sentences import line

LARGE = 1e-3  # a gap of which is said why
TURN = math.tau * (1 + 1e-9)  # rad: joint angles beyond it, and
FAST = 20.0  # rad/s: speeds of joints above it may have been meant in degrees
LONG = 20.0  # m: links above it, and
FAR, HASTE = 100.0, 200.0  # m, m/s^2: ways above it that need so much may have been meant in millimetres
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
        if few := _too_few_holds(plan, bound):
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
    if isinstance(task, ArmManeuver):
        return [*_degrees(task), *_long_links(task)]
    assert isinstance(task, Maneuver)
    way = length(tuple(b - a for a, b in zip(task.start.position, task.goal.position, strict=True)))
    needed = 4 * way / task.duration**2  # of the straight way from rest to rest: M = 4 d / T^2
    if way <= FAR or needed <= HASTE:
        return []
    return [line("metres", f"start and goal are {way:g} m apart, {needed:.3g} m/s² in {task.duration:g} s: not mm?")]


def _degrees(task: ArmManeuver) -> list[str]:
    poses = (("start", task.start), ("goal", task.goal))
    angles = [(f"{name}.joints[{i}]", q) for name, pose in poses for i, q in enumerate(pose.joints or ())]
    links = list(enumerate(task.arm.links))
    angles += [(f"arm.links[{i}].limits", q) for i, link in links for q in link.limits or ()]
    speeds = [(f"arm.links[{i}].max_speed", link.max_speed) for i, link in links if link.max_speed is not None]
    return [
        *(
            line("radians", f"{field} is {q:g} rad, {abs(q) / math.tau:.3g} turns")
            for field, q in angles
            if abs(q) > TURN
        ),
        *(
            line("radians", f"{field} is {speed:g} rad/s, {speed / math.tau:.3g} turns a second: not degrees?")
            for field, speed in speeds
            if speed > FAST
        ),
    ]


def _long_links(task: ArmManeuver) -> list[str]:
    long = [(i, link.length) for i, link in enumerate(task.arm.links) if link.length > LONG]
    return [line("metres", f"arm.links[{i}].length is {size:g} m: not mm?") for i, size in long]


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


def _too_few_holds(plan: Plan, bound: str) -> list[str]:
    """Of a control past q walls on fewer than q + 2 holds: one for each segment, and one more to stop at the goal."""
    steps, least = plan.settings.grid.steps, len(plan.crossing.walls) + 2
    if isinstance(plan.maneuver, ArmManeuver) or isinstance(plan.settings.method, Exact) or steps >= least:
        return []
    none = "no control on these holds" if steps < least - 1 else "no control was found on these holds"
    return [f"{none}, {steps} in {least - 1} segments; none is below {bound}", f"steps: at least {least} here"]


def _all_times(plan: Plan) -> list[str]:
    """Whether other obstacle times are left to look at."""
    return [] if isinstance(plan.settings.search, GlobalSearch) else ["search global, over all obstacle times"]
