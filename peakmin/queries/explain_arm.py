"""Why there is no plan for an arm, in its spec's own words, and what would help, each change tried out."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

from ..deadline import over
from ..plan.arm_plan import ArmPlan
from ..robots.joint_space import FLOODS, flood
from ..scenes.passages import passages
from ..search.solve import solve as solve_arm
from ..spec.arm import ArmManeuver, ArmTask
from ..spec.settings import Settings
from .explain import Explanation, fewest
from .repairs import Repair, limited, upwards

MARGINS = (0.5, 0.25, 0.1, 0.0)  # shares of a margin that are tried, in this order
SLOWER = 1.002  # times the duration that time scaling asks for: what a control on holds needs more


def explain_arm(plan: ArmPlan, time_limit: float) -> Explanation | None:
    """Why an arm's task is proved impossible, and what would help; None where it is not proved so.

    Args:
        time_limit: seconds after which no more repairs are looked for.
    """
    if plan.status != "infeasible":
        return None
    until, maneuver = time.perf_counter() + min(time_limit, plan.settings.time_limit or time_limit), plan.maneuver
    if math.isinf(plan.lower_bound):
        kept = fewest(_obstacles(maneuver), lambda names: closed(_only(maneuver, names)), until)
        fields = (*kept, "margin") if maneuver.margin and not closed(_with(maneuver, margin=0.0)) else tuple(kept)
        because = "the links cannot get past from start to goal, whatever they do"
        found = sorted(_open_again(maneuver, fields, plan.settings, until), key=lambda one: one.cost)
        return Explanation(fields, because, tuple(found), not over(until))
    assert maneuver.max_peak is not None

    def slow(names: list[str]) -> bool:
        return solve_arm(_only(maneuver, names), limited(plan.settings, until)).status == "infeasible"

    kept = [] if slow([]) else fewest(_obstacles(maneuver), slow, until)
    because = (
        f"max_peak {maneuver.max_peak:.6g} m/s² is below {plan.lower_bound:.6g} m/s², the least that any motion of the "
        f"arm needs in {maneuver.duration:.6g} s"
    )
    found = sorted(_faster(maneuver, plan.settings, until), key=lambda one: one.cost)
    return Explanation((*kept, "max_peak", "duration"), because, tuple(found), not over(until))


def closed(maneuver: ArmManeuver) -> bool:
    """Whether it is proved that no motion of a two-link arm leads from start to goal."""
    workspace = maneuver.workspace
    found = flood(workspace, FLOODS[-1])
    return all(found.parts(one.theta) for one in passages(maneuver, workspace))


def _with(maneuver: ArmManeuver, **fields: object) -> ArmManeuver:
    every = {name: getattr(maneuver, name) for name in ArmTask.model_fields} | fields
    return ArmManeuver(arm=maneuver.arm, **every)


def _obstacles(maneuver: ArmManeuver) -> list[str]:
    return [f"obstacles[{i}]" for i in range(len(maneuver.obstacles))]


def _only(maneuver: ArmManeuver, names: list[str]) -> ArmManeuver:
    """The task past these obstacles alone."""
    every = zip(_obstacles(maneuver), maneuver.obstacles, strict=True)
    return _with(maneuver, obstacles=tuple(one for name, one in every if name in names))


def _solved(
    field: str, text: str, maneuver: ArmManeuver, cost: float, settings: Settings, until: float
) -> Iterator[Repair]:
    """The change, if there is time to try it and it helps."""
    if over(until):
        return
    plan = solve_arm(maneuver, limited(settings, until))
    if plan.status == "solved":
        yield Repair(field, text, maneuver, plan.peak, cost)


def _open_again(maneuver: ArmManeuver, fields: tuple[str, ...], settings: Settings, until: float) -> Iterator[Repair]:
    """Less margin, or an obstacle left out."""
    for share in MARGINS if maneuver.margin else ():
        less = _with(maneuver, margin=share * maneuver.margin)
        if not over(until) and not closed(less):
            text = f"lower margin to {less.margin:.6g} m"
            yield from _solved("margin", text, less, 1 - share, settings, until)
            break
    for i in range(len(maneuver.obstacles)):
        if f"obstacles[{i}]" in fields:
            without = _with(maneuver, obstacles=maneuver.obstacles[:i] + maneuver.obstacles[i + 1 :])
            yield from _solved(f"obstacles[{i}]", f"leave out obstacles[{i}]", without, 1.0, settings, until)


def _faster(maneuver: ArmManeuver, settings: Settings, until: float) -> Iterator[Repair]:
    """More peak, or more time: between poses at rest, D' = D sqrt(M / max_peak) makes the peak M to max_peak."""
    limit, D = maneuver.max_peak, maneuver.duration
    assert limit is not None
    free = solve_arm(_with(maneuver, max_peak=None), limited(settings, until))
    if free.status != "solved":
        return
    more, longer = upwards(free.peak), upwards(SLOWER * D * math.sqrt(free.peak / limit))
    for field, text, x, was in (
        ("max_peak", f"raise max_peak to {more:.6g} m/s²", more, limit),
        ("duration", f"duration {D:.6g} s is too short: {longer:.6g} s would do", longer, D),
    ):
        yield from _solved(field, text, _with(maneuver, **{field: x}), x / was - 1, settings, until)
