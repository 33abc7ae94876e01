"""The planner in joint space: its derivatives, and that what it calls solved holds at every instant looked at."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.robots.dynamics import PlanarRobot
from peakmin.robots.joints import torques
from peakmin.robots.separation import convex_pieces, separations
from tests.conftest import ALL

LINKS = (
    {"length": 0.9, "mass": 8, "half_width": 0.05, "limits": (-3, 3), "max_speed": 2},
    {"length": 0.8, "mass": 5, "half_width": 0.05, "limits": (-2.6, 2.6), "max_speed": 2},
    {"length": 0.4, "mass": 2, "half_width": 0.04, "limits": (-2.2, 2.2), "max_speed": 3, "max_torque": 5.0},
)
SHELF = pm.Block(vertices=[(1.1, 0.75), (2.2, 0.75), (2.2, 0.95), (1.1, 0.95)])


def around_the_shelf(**changes):
    asked = {
        "arm": pm.Arm(links=[pm.Link(**link) for link in LINKS], payload=5.0),
        "start": pm.Pose(joints=(-0.4, 1.1, 0.3)),
        "goal": pm.Pose(joints=(1.5, -0.9, 0.4)),
        "duration": 4,
        "margin": 0.01,
        "obstacles": [SHELF],
    }
    return pm.ArmManeuver(**asked | changes)


def test_derivatives_are_those_of_differences():
    robot, rng = PlanarRobot(around_the_shelf().arm.chain), np.random.default_rng(1)
    x, h = rng.normal(size=(5, 9)), 1e-6
    for function, derivative in (
        (robot.acceleration, robot.acceleration_by),
        (robot.torques, robot.torques_by),
    ):
        by = derivative(tuple(np.split(x, 3, axis=1)))
        for k, step in enumerate(np.eye(9) * h):
            ahead, behind = (function(tuple(np.split(x + sign * step, 3, axis=1))) for sign in (1, -1))
            assert (ahead - behind) / (2 * h) == pytest.approx(by[..., k], rel=1e-5, abs=1e-5)


def test_separations_and_their_derivatives():
    chain, rng = around_the_shelf().arm.chain, np.random.default_rng(2)
    (shelf,) = convex_pieces(np.array(SHELF.vertices))
    theta, h = rng.uniform(-3, 3, (200, 3)), 1e-6
    apart, by = separations(chain, theta, shelf)
    workspace = around_the_shelf().workspace
    free = apart > 0
    assert np.sum(free) > 100
    assert apart[free] == pytest.approx(workspace.clearance(theta)[free], abs=1e-9)
    assert np.all(workspace.clearance(theta)[apart < -chain.half_width - 1e-9] <= 0)
    for k, step in enumerate(np.eye(3) * h):
        change = (separations(chain, theta + step, shelf)[0] - separations(chain, theta - step, shelf)[0]) / (2 * h)
        smooth = np.abs(change - by[..., k]) < 1e-4
        assert np.mean(smooth) > 0.98  # but where another corner comes to be the nearest


def test_three_links_go_around_a_block_within_their_limits():
    task = around_the_shelf()
    plan = pm.solve(task, pm.Settings(time_limit=None if ALL else 7.0))
    assert plan.keeps
    assert pm.verify(plan.to_json()).passed
    t = np.linspace(0, 4, 10_000)
    q, chain = plan.joint_positions(t), task.arm.chain
    assert np.min(task.workspace.clearance(plan.joints.absolute(t))) >= task.margin - 1e-9
    for k, link in enumerate(task.arm.links):
        assert link.limits[0] - 1e-9 <= np.min(q[:, k]) <= np.max(q[:, k]) <= link.limits[1] + 1e-9
        assert np.max(np.abs(plan.joint_velocities(t)[:, k])) <= link.max_speed * (1 + 1e-9)
    assert np.max(np.abs(torques(plan.joints, t)[:, 2])) <= 5.0 * (1 + 1e-9)
    assert np.max(np.hypot(*plan.acceleration(t).T)) <= plan.peak * (1 + 1e-12)
    assert chain.centre(plan.joints.absolute(t)) == pytest.approx(plan.position(t), abs=1e-12)


def test_postures_change_where_the_straight_line_forbids_it():
    links = [pm.Link(length=a, mass=m) for a, m in ((0.9, 8), (0.8, 5), (0.4, 2))]
    plan = pm.solve(around_the_shelf(arm=pm.Arm(links=links), obstacles=(), margin=0.0))
    assert plan.keeps
    assert plan.gap < 0.2
    assert plan.peak_moment == plan.extremes.torque[0]
