"""What a motion does at most beside the limits that it has: the tables of a report."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..plan.arm_plan import ArmPlan


class Beside(NamedTuple):
    """What a motion does at most, and the limit that it has; whether that is stated, or counts where none is."""

    most: str
    limit: str
    stated: bool = True


class Tables(NamedTuple):
    """Of the joints a row each; of the base a name, a unit and what it feels."""

    joints: list[list[Beside]]
    base: list[tuple[str, str, Beside]]


def tables(plan: ArmPlan) -> Tables:
    """Those of an arm's motion; empty where there is none."""
    return Tables(joints(plan), base(plan))


def joints(plan: ArmPlan) -> list[list[Beside]]:
    """Of every joint its range of angles, speed, acceleration and torque, each beside its limit."""
    found, may = plan.extremes, plan.allowed
    if found is None or may is None:
        return []
    rows = []
    for k, link in enumerate(plan.maneuver.arm.links):
        limits = "none" if link.limits is None else f"{link.limits[0]:.4g} to {link.limits[1]:.4g}"
        row = [Beside(f"{found.low[k]:.4g} to {found.high[k]:.4g}", limits, link.limits is not None)]
        for name in ("speed", "acceleration", "torque"):
            stated = getattr(link, f"max_{name}") is not None
            row.append(Beside(_most(getattr(found, name)[k]), f"{getattr(may, name)[k]:.4g}", stated))
        rows.append(row)
    return rows


def _most(size: float) -> str:
    return f"{size:.4g}" if math.isfinite(size) else "not bounded"


def base(plan: ArmPlan) -> list[tuple[str, str, Beside]]:
    """What the base feels at most, each with its unit, beside what max_peak and max_moment let it feel."""
    if plan.extremes is None:
        return []
    asked = plan.maneuver
    force = None if asked.max_peak is None else plan.crossing.mass * asked.max_peak
    both = (("base force", "N", plan.peak_force, force), ("base moment", "N m", plan.peak_moment, asked.max_moment))
    return [
        (name, unit, Beside(_most(most), "none" if limit is None else f"{limit:.4g}", limit is not None))
        for name, unit, most, limit in both
    ]
