import csv
import io
import json

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.proofs.check import check_motion
from tests.conftest import wall_maneuver


@pytest.fixture(scope="module")
def plan():
    maneuver = wall_maneuver(
        start=pm.State(position=(0.1, 0), velocity=(0.5, -1)),
        goal=pm.State(position=(1, 0.2), velocity=(0, 3)),
        mass=4.0,
    )
    return pm.sweep(maneuver, times=np.linspace(0.2, 0.8, 7)).best


def test_the_trajectory_starts_ends_and_crosses_as_asked(plan):
    m = plan.maneuver
    np.testing.assert_allclose(plan.position(0), m.start.position, atol=1e-12)
    np.testing.assert_allclose(plan.velocity(0), m.start.velocity, atol=1e-12)
    np.testing.assert_allclose(plan.position(m.duration), m.goal.position, atol=1e-12)
    np.testing.assert_allclose(plan.velocity(m.duration), m.goal.velocity, atol=1e-12)
    x, y = plan.position(plan.obstacle_times[0])
    assert x == pytest.approx(0.5, abs=1e-12)
    assert y >= 0.5 - 1e-12


def test_the_trajectory_is_callable_and_differentiates(plan):
    t = np.linspace(0, 1, 501)[:-1] + 1e-3
    h = 1e-6
    assert plan.position(t).shape == (500, 2)
    assert plan.position(0.3).shape == (2,)
    np.testing.assert_allclose((plan.position(t + h) - plan.position(t - h)) / (2 * h), plan.velocity(t), atol=1e-5)
    assert np.hypot(*plan.acceleration(t).T).max() <= plan.peak * (1 + 1e-12)
    np.testing.assert_allclose(plan.base_force(t), 4.0 * plan.acceleration(t))
    assert plan.peak_force == 4.0 * plan.peak


def test_bounds_are_honest(plan):
    assert 0 < plan.lower_bound <= plan.peak
    assert plan.gap == pytest.approx((plan.peak - plan.lower_bound) / plan.peak)
    assert plan.gap < 1e-3


def test_json_and_csv_hold_the_numbers(plan):
    document = json.loads(plan.to_json())
    assert {"status", "peak", "lower_bound", "gap", "peak_force", "obstacle_times"} <= set(document)
    assert len(document["times"]) == len(document["position"]) == len(document["velocity"]) == 201
    assert len(document["acceleration"]) == 200
    assert pm.Spec(**document["spec"]) == pm.Spec(maneuver=plan.maneuver, settings=plan.settings)
    rows = list(csv.reader(io.StringIO(plan.to_csv())))
    assert rows[0] == ["t", "x", "y", "vx", "vy", "ax", "ay"]
    assert float(rows[-1][1]) == plan.position(1.0)[0]
    assert {"solver", "solves", "compilations", "seconds", "versions"} <= set(document["made"])


@pytest.mark.parametrize("field", ["control", "goal", "wall", "time", "peak"])
def test_a_plan_that_is_off_does_not_pass_its_check(plan, field):
    motion, maneuver, times, peak = plan.trajectory, plan.maneuver, plan.obstacle_times, plan.peak
    assert check_motion(maneuver, motion, times, peak).passed
    if field == "control":
        control = motion.control.copy()
        control[50, 1] += 1e-4
        motion = HoldTrajectory(motion.nodes, control, motion.start_position, motion.start_velocity)
    if field == "goal":
        maneuver = maneuver.model_copy(update={"goal": pm.State(position=(1, 0.2), velocity=(0, 3 + 1e-6))})
    if field == "wall":
        maneuver = maneuver.model_copy(update={"obstacles": (pm.Wall(tip=(0.5, 0.5 + 1e-6), contact="touch"),)})
    if field == "time":
        times = times + 1e-6
    if field == "peak":
        peak *= 1 - 1e-9
    assert not check_motion(maneuver, motion, times, peak).passed


@pytest.mark.parametrize("goal", [(0, 0), (2, -1)])
def test_coasting_needs_no_force(goal):
    start = pm.State(position=(0, 0), velocity=goal)
    plan = pm.solve(pm.Maneuver(start=start, goal=pm.State(position=goal, velocity=goal), duration=1.0))
    assert (plan.status, plan.peak, plan.lower_bound, plan.gap) == ("solved", 0.0, 0.0, 0.0)
    np.testing.assert_array_equal(plan.acceleration([0.2, 0.9]), 0)


def test_max_peak_above_the_optimum_is_met_and_below_it_is_refuted():
    straight = {"start": pm.State(position=(0, 0)), "goal": pm.State(position=(1, 0)), "duration": 1.0}
    assert pm.solve(pm.Maneuver(**straight, max_peak=4.001)).status == "solved"
    refused = pm.solve(pm.Maneuver(**straight, max_peak=3.99))
    assert refused.status == "infeasible"
    assert refused.lower_bound == pytest.approx(4.0, rel=1e-9)


def test_far_from_the_origin_a_plan_still_checks_out():
    far = 1e7
    maneuver = wall_maneuver(
        start=pm.State(position=(far, far)),
        goal=pm.State(position=(far + 1, far)),
        obstacles=(pm.Wall(tip=(far + 0.5, far + 0.5)),),
    )
    plan = pm.sweep(maneuver, times=[0.5]).best
    assert plan.status == "solved"
    assert plan.peak == pytest.approx(8.5376757, rel=1e-6)


def test_a_circumscribed_polygon_states_the_norm_that_its_control_has():
    settings = pm.Settings(circle=pm.Polygon(segments=1, fit="circumscribed"))
    plan = pm.sweep(wall_maneuver(), settings, times=[0.5]).best
    norms = np.hypot(*plan.acceleration(plan.times[:-1]).T)
    assert plan.peak == pytest.approx(norms.max())
    assert plan.lower_bound <= 8.537416 <= plan.peak


@pytest.mark.parametrize("method", [pm.Direct(), pm.Exact()])
def test_times_outside_of_the_maneuver_count_as_its_ends(method):
    plan = pm.solve(wall_maneuver(), pm.Settings(method=method))
    for look in (plan.position, plan.velocity, plan.acceleration):
        np.testing.assert_array_equal(look([-1.0, 5.0]), look([0.0, 1.0]))
