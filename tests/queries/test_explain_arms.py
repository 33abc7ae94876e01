"""Limits of joints that are in the way are named, and what would do is tried out."""

import math

import numpy as np
import pytest

import peakmin as pm
from peakmin.scenes.kinds import scene_of
from tests.conftest import ALL

SETTINGS = pm.Settings(time_limit=4.0)


def task(duration=1.0, **limits):
    links = [pm.Link(length=0.6, mass=3.0, **limits) for _ in range(2)]
    poses = {"start": pm.Pose(joints=(0.2, 0.8)), "goal": pm.Pose(joints=(1.6, 1.9))}
    return pm.ArmManeuver(arm=pm.Arm(links=links), duration=duration, **poses)


@pytest.mark.parametrize(("limit", "most"), [("max_speed", 1.0), *([("max_acceleration", 1.25)] if ALL else [])])
def test_a_joint_that_cannot_turn_so_far_is_proved_so(limit, most):
    plan = pm.solve(task(**{limit: 5.0 if limit == "max_acceleration" else 1.0}))
    assert plan.status == "infeasible"
    assert pm.verify(plan.to_json()).passed
    why = pm.explain(plan.maneuver, SETTINGS)
    assert set(why.conflict) == {f"arm.links[0].{limit}", "duration"}
    assert why.because.startswith(f"joint 1 must turn by 1.4 rad in 1 s, and can by {most:g} rad")
    longer = next(one for one in why.repairs if one.field == "duration")
    assert pm.solve(longer.maneuver, SETTINGS).keeps


@pytest.mark.parametrize(
    ("limits", "least"),
    [
        ({"max_speed": 2.0}, 0.7),
        ({"max_acceleration": 10.0}, math.sqrt(0.56)),
        ({"max_speed": 2.0, "max_acceleration": 10.0}, 0.9),
    ],
)
def test_the_least_duration_of_a_joint_is_that_of_a_trapezoid(limits, least):
    """1.4 rad from rest to rest: V T, A T^2 / 4, and V T - V^2 / A."""
    assert scene_of(task(least * (1 - 1e-6), **limits)).impossible() is not None
    assert scene_of(task(least * (1 + 1e-6), **limits)).impossible() is None


def test_a_joint_turns_the_way_round_that_its_limits_leave():
    def turning(**change):
        limited = pm.Link(length=0.6, mass=3.0, limits=(-4.0, 0.5), max_speed=1.0)
        poses = {"start": pm.Pose(joints=(-2.8, 0.5)), "goal": pm.Pose(joints=(2.8, 0.6))}
        first = limited.model_copy(update=change)
        return pm.ArmManeuver(
            arm=pm.Arm(links=[first, limited.model_copy(update={"limits": None})]), duration=1.0, **poses
        )

    assert scene_of(turning()).impossible() is None  # 0.68 rad, through pi
    with pytest.raises(pm.SpecError):
        turning(limits=(-3.0, 0.5))
    assert scene_of(turning(limits=(-3.0, 3.0))).impossible() is not None  # 5.6 rad, through zero


@pytest.mark.skipif(not ALL, reason="it searches until its time limits; a speed in the way is proved in other tests")
def test_a_torque_in_the_way_is_named_with_a_duration_that_keeps_it():
    plan = pm.solve(task(max_torque=3.0), SETTINGS)
    assert plan.status == "unknown"
    why = pm.explain(plan)
    assert set(why.conflict) <= {"arm.links[0].max_torque", "arm.links[1].max_torque"}
    assert not why.proved
    longer = next(one for one in why.repairs if one.field == "duration")
    found = pm.solve(longer.maneuver, SETTINGS)
    assert found.keeps
    assert np.max(np.abs(found.torques(np.linspace(0, found.maneuver.duration, 10_001)))) <= 3.0 * (1 + 1e-9)
