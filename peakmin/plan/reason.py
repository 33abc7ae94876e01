"""Why a plan is infeasible or unknown, in words."""

from __future__ import annotations

import math

from .plan import Plan


def reason(plan: Plan) -> str | None:
    """Why a plan is "infeasible" or "unknown"; None of one that keeps all that was asked."""
    if plan.keeps:
        return None
    limit, bound = plan.maneuver.limit, f"{plan.lower_bound:.6g} m/s²"
    if plan.status == "infeasible":
        if plan.scene.impossible() is not None:
            return not_kept(plan)[0]
        if math.isinf(plan.lower_bound):
            return "obstacles: leave no way from start to goal"
        return f"max_peak: {limit:.6g} m/s² is below {bound}, the least that any motion needs"
    if plan.trajectory is None:
        said = ["no motion was found"]
    elif plan.peak > limit:
        said = [f"max_peak: the path found has {plan.peak:.6g} m/s² in place of {limit:.6g}", *not_kept(plan)]
    else:
        said = not_kept(plan)
    where = "" if plan.scope == "all" else " at these obstacle times"
    ended = [] if stopped(plan) is None else [f"stopped {stopped(plan)}"]
    return "; ".join([*said, f"no peak is below {bound}{where}", *ended])


def not_kept(plan: Plan) -> list[str]:
    """What the path that was found does not keep of what was asked."""
    shown = plan.scene.impossible()
    said = [] if shown is None else [f"{', '.join(shown.fields)}: {shown.because}"]
    excesses = () if plan.kept is None else plan.kept.excesses
    return said + [one.words for one in excesses if shown is None or one.field != "max_speed"]


def stopped(plan: Plan) -> str | None:
    """When the time limit, or Ctrl-C, ended the search, and with which gap; None of one that came to its end."""
    if not plan.made.stopped:
        return None
    return f"after {plan.made.seconds:.3g} s" + (f" with a gap of {plan.gap:.2e}" if plan.keeps else "")
