"""Random arms with limits of every kind: what is called solved, or feasible, holds at 10,000 instants."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.robots.dynamics import inverse_dynamics
from tests.conftest import ALL
from tests.random_arms import limited

INSTANTS = 10_000


@pytest.mark.parametrize("links", [2, 3, 5] if ALL else [5])
@pytest.mark.parametrize("seed", range(20) if ALL else [1])
def test_a_plan_keeps_what_it_says_at_10_000_instants(links, seed):
    task = limited(seed, links)
    plan = pm.solve(task, pm.Settings(time_limit=6.0 if ALL else 2.0))
    assert pm.verify(plan.to_json()).passed
    if ALL and not plan.keeps:
        pytest.skip("no motion that keeps everything was found")
    assert plan.keeps
    t = np.linspace(0, task.duration, INSTANTS)
    theta, first, second = plan.joints.rates(t)
    tau = inverse_dynamics(task.arm.chain, theta, first, second)
    q, speed = (np.diff(x, axis=-1, prepend=0.0) for x in (theta, first))
    for k, link in enumerate(task.arm.links):
        assert link.limits[0] - 1e-8 <= np.min(q[:, k]) <= np.max(q[:, k]) <= link.limits[1] + 1e-8
        assert np.max(np.abs(speed[:, k])) <= link.max_speed * (1 + 1e-8)
        assert np.max(np.abs(tau[:, k])) <= link.max_torque * (1 + 1e-8)
    assert np.max(np.hypot(*plan.acceleration(t).T)) <= plan.peak * (1 + 1e-9)
    assert plan.lower_bound <= plan.peak * (1 + 1e-9)
    if task.obstacles:
        assert np.min(task.workspace.clearance(theta)) >= min(plan.clearance, task.margin) - 1e-9
    assert q[0] == pytest.approx(task.start.joints, abs=1e-5)
    beyond = (q[-1] - np.array(task.goal.joints)) / (2 * np.pi)
    assert beyond == pytest.approx(np.round(beyond), abs=1e-5)
    assert np.max(np.abs(speed[[0, -1]])) <= 1e-6 * max(link.max_speed for link in task.arm.links)
