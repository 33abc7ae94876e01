"""A plan's motion for the controller of a robot: a row for each instant, as CSV or as ROS's JointTrajectory."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..errors import PeakminError
from ..files import csv_text
from ..types import Array
from .arm_plan import ArmPlan
from .plan import Plan

NANO = 1_000_000_000  # ns in a second
MOST_SECONDS = 2**31  # of a duration in ROS


class Motion(NamedTuple):
    """What moves, by name (n,), and how: instants [s] (m,), and q, q', q'' there, (m, n) each [SI].

    beside: how many of the names stand side by side in a table before their velocities.
    """

    names: list[str]
    beside: int
    times: Array
    positions: Array
    velocities: Array
    accelerations: Array


def csv(plan: Plan, rate: float | None = None) -> str:
    """A table: t, and of each joint NAME, NAME.velocity, NAME.acceleration; of a centre of mass in x and y together.

    Args:
        rate: rows a second [1/s]; by default a row for each node of the plan.

    Raises:
        PeakminError: where there is nothing that a robot may be given: see `_motion`.
    """
    names, beside, times, *orders = _motion(plan, rate)
    kinds, groups = ("", ".velocity", ".acceleration"), [names[k : k + beside] for k in range(0, len(names), beside)]
    head = [name + kind for group in groups for kind in kinds for name in group]
    columns = np.stack(orders, axis=1).reshape(len(times), len(kinds), -1, beside).swapaxes(1, 2)
    return csv_text(["t", *head], np.column_stack([times, columns.reshape(len(times), -1)]).tolist())


def joint_trajectory(plan: Plan, rate: float | None = None) -> str:
    """ROS's message trajectory_msgs/JointTrajectory as JSON, which is YAML, too; arguments and errors as of `csv`."""
    if plan.kind != "arm":
        raise PeakminError("export: was a plan of a centre of mass, must be one of an arm for joint_trajectory")
    motion = _motion(plan, rate)
    if motion.times[-1] >= MOST_SECONDS:
        raise PeakminError(
            f"export: was a duration of {motion.times[-1]:g} s, must be below 2^31 s for joint_trajectory"
        )
    nanoseconds = [round(t * NANO) for t in motion.times.tolist()]
    if np.any(np.diff(nanoseconds) <= 0):
        raise PeakminError("export: was rows less than a nanosecond apart, must be further for joint_trajectory")
    points = [
        {
            "positions": q,
            "velocities": dq,
            "accelerations": ddq,
            "time_from_start": {"sec": t // NANO, "nanosec": t % NANO},
        }
        for t, q, dq, ddq in zip(nanoseconds, *(order.tolist() for order in motion[3:]), strict=True)
    ]
    return json.dumps({"joint_names": motion.names, "points": points}, allow_nan=False) + "\n"


FORMATS: dict[str, Callable[[Plan, float | None], str]] = {"csv": csv, "joint_trajectory": joint_trajectory}


def _motion(plan: Plan, rate: float | None) -> Motion:
    """The motion at the plan's instants of this rate.

    Raises:
        PeakminError: where there is none, it does not keep what was asked, or a joint's speed has no end.
    """
    if plan.kept is None:
        raise PeakminError(f"export: was a plan that is {plan.status}, must have a motion")
    lacking = [one.words for one in plan.kept.excesses]
    lacking += ["its peak is above max_peak"] if plan.peak > plan.maneuver.limit else []
    if lacking:
        raise PeakminError(
            f"export: was a motion that does not keep what was asked ({lacking[0]}), must be one that does"
        )
    t = plan.instants(rate)
    with np.errstate(all="ignore"):
        motion = MOTIONS[plan.kind](plan, t)
    if not all(np.all(np.isfinite(order)) for order in motion[3:]):
        raise PeakminError("export: was a plan whose joints need speeds without end, must have finite ones")
    return motion


def _of_centre(plan: Plan, t: Array) -> Motion:
    return Motion(["x", "y"], 2, t, plan.position(t), plan.velocity(t), plan.acceleration(t))


def _of_joints(plan: ArmPlan, t: Array) -> Motion:
    names = [f"joint_{k + 1}" for k in range(len(plan.maneuver.arm.links))]
    return Motion(names, 1, t, plan.joint_positions(t), plan.joint_velocities(t), plan.joint_accelerations(t))


MOTIONS: dict[str, Callable[[Any, Array], Motion]] = {"point": _of_centre, "arm": _of_joints}  # by the kind of plan
