"""Random tasks of two-link arms: what a plan states is held against the arm's own mechanics, by samples.

`make test` takes some of the tasks and a short search; `make proofs` (PEAKMIN_SEEDS=all) all of them, to the end.
"""

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.robots.kinematics import unit
from tests.conftest import ALL
from tests.random_arms import TASKS, task

SEEDS, SETTINGS = (range(TASKS), pm.Settings()) if ALL else (range(24, 73, 24), pm.Settings(node_limit=60))


def momentum(plan, t):
    """sum m_k v_k of the links and the payload [kg m/s], from the joints' speeds alone."""
    path = plan.joints
    chain = path.chain
    theta, rate, _ = path.rates(t)
    across = np.stack([-unit(theta)[..., 1], unit(theta)[..., 0]], axis=-1)
    turned = chain.length[:, None] * rate[..., None] * across
    start = np.cumsum(turned, axis=-2) - turned
    own = start + chain.com[:, None] * rate[..., None] * across
    return np.sum(chain.mass[:, None] * own, axis=-2) + chain.payload * np.sum(turned, axis=-2)


def holds_true(plan):
    path, chain, T = plan.joints, plan.joints.chain, plan.maneuver.duration
    t = np.linspace(0, T, 20_001)
    theta = path.absolute(t)
    assert np.max(np.abs(chain.centre(theta) - plan.position(t))) <= 1e-8 * np.sum(chain.length)
    # no jump above what the joints' speeds allow (near a stretched arm these are taken beside the instant)
    speed = np.max(np.abs(path.rates(t)[1]), axis=1)
    jump = np.max(np.abs(np.diff(theta, axis=0)), axis=1)
    assert np.all(jump <= 1.5 * np.maximum(speed[1:], speed[:-1]) * np.diff(t) + 1e-6)
    # the base force is the rate of change of momentum, away from the control's switches and the elbow's
    middle, h = (plan.times[:-1] + plan.times[1:]) / 2, np.minimum(1e-6 * T, np.diff(plan.times) / 8)
    away = np.all([np.abs(middle - at) > 0.01 * T for at in plan.elbow_changes] or [middle > 0], axis=0)
    middle, h = middle[away], h[away]
    force = (momentum(plan, middle + h) - momentum(plan, middle - h)) / (2 * h[:, None])
    assert np.max(np.abs(force - plan.base_force(middle))) <= 1e-5 * plan.peak_force
    if plan.maneuver.obstacles:
        world = shapely.union_all([shapely.Polygon(block.vertices) for block in plan.maneuver.obstacles])
        points = chain.joints(theta)
        near = min(
            float(np.min(shapely.distance(shapely.linestrings(points[:, k : k + 2]), world)))
            for k in range(chain.links)
        )
        assert near >= plan.clearance >= 0
        assert near <= plan.clearance + 1e-4


@pytest.mark.parametrize("seed", SEEDS)
def test_plans_hold_true(seed):
    asked = task(seed)
    if asked is None:
        pytest.skip("the arm touches the table at an end: refused")
    plan = pm.solve(asked, SETTINGS)
    assert plan.lower_bound <= plan.peak
    found = pm.verify(plan.to_json())
    assert found.passed, found.problems
    if plan.keeps:
        holds_true(plan)
    assert plan.keeps
