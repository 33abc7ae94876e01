"""The verbs for point masses and arms alike: `solve` and `verify` pick the room that answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast, overload

import numpy as np

from .plan.verify import Verification
from .plan.verify import verify as verify_point
from .search.solve import solve as solve_point
from .spec.maneuver import Maneuver
from .spec.reading import load
from .spec.settings import Settings
from .spec.task import Task
from .types import Progress

if TYPE_CHECKING:
    from .plan.arm_plan import ArmPlan
    from .plan.plan import Plan
    from .programs.compiled import Programs
    from .spec.arm import ArmManeuver


@overload
def solve(
    maneuver: Maneuver,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
) -> Plan: ...
@overload
def solve(
    maneuver: ArmManeuver,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
) -> ArmPlan: ...
@overload
def solve(
    maneuver: Task,
    settings: Settings | None = ...,
    progress: Progress | None = ...,
    programs: Programs | None = ...,
) -> Plan | ArmPlan: ...
def solve(
    maneuver: Task,
    settings: Settings | None = None,
    progress: Progress | None = None,
    programs: Programs | None = None,
) -> Plan | ArmPlan:
    """The maneuver of least peak base reaction force, with its proof.

    Args:
        maneuver: what to do: of a centre of mass, or of an arm in its workspace.
        settings: how; default an exact disc, 200 aligned holds, M as a variable, a global search to a gap of 1e-6.
        progress: called with (done, total).
        programs: where compiled programs are taken from; default a place of its own.

    Raises:
        SpecError: when the settings do not fit the maneuver.
    """
    from .spec.arm import ArmManeuver

    if isinstance(maneuver, ArmManeuver):
        from .search.solve_arm import solve_arm

        return solve_arm(maneuver, settings, progress, programs)
    return solve_point(cast(Maneuver, maneuver), settings, progress, programs)


@np.errstate(all="ignore")  # a number that is none fails every comparison that it enters
def verify(text: str | bytes) -> Verification:
    """Compute anew everything that a plan document states: states, crossings, peak, clearance, bound, gap.

    Args:
        text: a plan document, as `to_json` or `peakmin solve --json` writes it.

    Raises:
        SpecError: when the text is not a plan document.
    """
    if load(text, finite=True).get("kind") != "arm":
        return verify_point(text)
    from .plan.arm_verify import verify_arm

    plan, bound, problems = verify_arm(text)
    peak = float("inf") if plan.trajectory is None else plan.trajectory.peak()
    return Verification(plan, peak, bound, tuple(problems))
