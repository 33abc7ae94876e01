"""What the terminal says of arms, and the files it writes."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

from .. import files
from ..errors import PeakminError
from ..plan.arm_plan import ArmPlan
from ..queries.compare import Row
from ..queries.simulate import Simulation
from ..spec.arm import ArmManeuver
from ..spec.spec import ArmSpec
from ..types import Progress
from .words import advised, opening

TURNS = 2  # further round than that, an angle may have been meant in degrees


def describe(plan: ArmPlan) -> str:
    """The plan in words, with how it was made."""
    made = plan.made
    return facts(plan) + (
        f"\n  made by         {made.solver}, {made.nodes} boxes of obstacle times bounded, {made.seconds:.2f} s"
    )


def facts(plan: ArmPlan) -> str:
    """The plan in words."""
    lines = opening(plan, "any motion of the arm")
    for t, contact in zip(plan.contact_times, plan.contacts, strict=True):
        lines.append(f"  contact         {t:.6g} s: {contact}")
    if plan.joints is not None and plan.joints.chain.links == 2:
        word = {-1.0: "up", 1.0: "down"}[plan.joints.elbow]
        turned = "".join(f", turns over at {t:.6g} s" for t in plan.elbow_changes)
        lines.append(f"  elbow           {word} at the start{turned}")
    if math.isfinite(plan.clearance):
        near = ": closer than asked" if plan.clearance >= 0 else ": a link is inside"
        where = "" if plan.clearance >= plan.maneuver.margin else near
        lines.append(f"  clearance       {plan.clearance:.6g} m of every link at every instant{where}")
    if plan.clear is not None and plan.clear.within < -1e-6:
        lines.append(f"  reach           the path leaves it by {-plan.clear.within:.6g} m")
    if plan.clear is not None and not plan.clear.steady:
        lines.append("  joints          jump where the folded arm passes its base")
    lines += [f"  not kept        {one}" for one in plan.exceeded]
    if plan.status == "unknown" and plan.joints is not None and plan.joints.chain.links > 2:
        lines.append("  way             three and more links follow the straight way only; obstacles do not bend it")
    if math.isinf(plan.lower_bound):
        lines.append("  closed          obstacles and reach leave no way from start to goal (proved)")
    elif plan.joints is None:
        lines.append("  no free motion was found; the bound holds all the same")
    return "\n".join([*lines, *_far_round(plan.maneuver), *advised(plan)])


def _far_round(task: ArmManeuver) -> list[str]:
    """Joint angles that look like degrees, a line each."""
    poses = (("start", task.start), ("goal", task.goal))
    angles = [(f"{name}.joints[{i}]", q) for name, pose in poses for i, q in enumerate(pose.joints or ())]
    angles += [(f"arm.links[{i}].limits", q) for i, link in enumerate(task.arm.links) for q in link.limits or ()]
    far = [(field, q) for field, q in angles if abs(q) > TURNS * math.tau]
    return [f"  radians         {field} is {q:g} rad, {abs(q) / math.tau:.3g} turns" for field, q in far]


def write(plan: ArmPlan, out: Path, gif: bool = True) -> None:
    """plan.json, plan.csv, the figures and, if asked for, the animation."""
    import matplotlib.pyplot as plt

    from .arm_plots import animate, figures

    files.write(out / "plan.json", plan.to_json(indent=2) + "\n")
    for name, figure in figures(plan).items():
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": None})
        plt.close(figure)
        files.write(out / f"{name}.png", buffer.getvalue())
    if plan.joints is not None:
        files.write(out / "plan.csv", plan.to_csv())
        if gif:
            files.write(out / "arm.gif", animate(plan))


def solved(asked: ArmSpec, progress: Progress | None) -> ArmPlan:
    """The plan of a spec. Raises `PeakminError` where it has no motion."""
    from ..search.solve import solve as solve_arm

    plan = solve_arm(asked.task, asked.settings, progress)
    if plan.joints is None:
        raise PeakminError("compare: was a task without a free motion, must have one")
    return plan


def plain(row: Row) -> dict[str, Any]:
    """A row of a comparison as plain data."""
    return {name: None if isinstance(x, float) and not math.isfinite(x) else x for name, x in vars(row).items()}


def numbers(found: Simulation) -> dict[str, Any]:
    """A simulation as plain data."""
    return {
        "planned_peak": found.planned_peak,
        "simulated_peak": found.felt_peak,
        "peak_error": found.felt_peak / found.planned_peak - 1 if found.planned_peak else 0.0,
        "curve_error": found.error,
        "drift": found.drift,
        "agrees": found.agrees,
    }


def felt(found: Simulation) -> str:
    """A simulation in words."""
    return (
        f"planned peak base force    {found.planned_peak:.6g} N\n"
        f"simulated peak base force  {found.felt_peak:.6g} N\n"
        f"largest difference         {100 * found.error:.3f} % of the planned peak, at any instant\n"
        f"joint angles               within {found.drift:.2e} rad of the plan"
    )
