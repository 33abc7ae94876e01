"""The flood of joint space: what it parts has no motion, what it joins has one."""

import json

import numpy as np
import pytest

import peakmin as pm
from peakmin.robots.joint_space import FLOODS, JointWay, decisive_flood, flood
from peakmin.robots.workspace import BLOCKED, FREE
from peakmin.scenes.passages import passages


def bar(angle, width=0.05):
    """A bar from near the base out of reach."""
    e = np.array([np.cos(angle), np.sin(angle)])
    n = width * np.array([-e[1], e[0]])
    return pm.Block(vertices=[0.3 * e - n, 2.2 * e - n, 2.2 * e + n, 0.3 * e + n])


def between_bars(*angles):
    arm = pm.Arm(links=[pm.Link(length=1, mass=1), pm.Link(length=1, mass=1)])
    start, goal = pm.Pose(tip=(1.2, -0.8), elbow="down"), pm.Pose(tip=(-0.4, 1.5), elbow="down")
    return pm.ArmManeuver(arm=arm, start=start, goal=goal, duration=2, obstacles=[bar(one) for one in angles])


@pytest.fixture(scope="module")
def closed():
    return pm.solve(between_bars(0.75, -1.8), pm.Settings(node_limit=1))  # repairs with any gap are repairs


def test_a_way_that_is_closed_is_proved_so(closed):
    plan = closed
    assert plan.status == "infeasible"
    assert plan.lower_bound == np.inf
    assert plan.joints is None
    why = pm.explain(plan)
    assert why.conflict == ("obstacles[0]", "obstacles[1]")
    assert why.repairs
    assert {one.field for one in why.repairs} <= set(why.conflict)
    assert pm.verify(plan.to_json()).passed


def test_a_flood_that_parts_nothing_proves_nothing(closed):
    data = json.loads(closed.to_json())
    assert data["proof"]["cells"] in FLOODS

    def flooded(cells):
        return json.dumps(data | {"proof": data["proof"] | {"cells": cells}})

    for cells in (0, 32):  # none, or one too coarse to tell
        assert any("lower_bound" in one for one in pm.verify(flooded(cells)).problems)
    for cells in (-1, 48, 1024, True, "128", None):
        with pytest.raises(pm.SpecError, match=r"flood|cells"):
            pm.verify(flooded(cells))


def test_with_one_bar_the_arm_goes_around():
    """The other way about is open, however far it is."""
    task = between_bars(0.75)
    workspace = task.workspace
    (passage,) = passages(task, workspace)
    found = decisive_flood(workspace, [(passage.theta, None)], np.inf)
    assert not found.parts(passage.theta)
    way = found.way(passage.theta)
    assert way is not None
    # from each to the next the arm keeps clear all along
    fine = np.concatenate(
        [np.linspace(a, a + (b - a + np.pi) % (2 * np.pi) - np.pi, 20) for a, b in zip(way, way[1:], strict=False)]
    )
    assert np.min(workspace.clearance(fine)) > 0


@pytest.mark.parametrize("cells", FLOODS[:3])
def test_cells_are_what_they_are_called(cells):
    workspace, rng = between_bars(0.75, -1.8).workspace, np.random.default_rng(cells)
    found = flood(workspace, cells)
    theta = rng.uniform(-np.pi, np.pi, (20_000, 2))
    free = np.min(workspace.clearance(theta), axis=1) >= 0
    named = np.array([found.found[found.cell(one)] for one in theta])
    assert not np.any(free & (named == BLOCKED))
    assert not np.any(~free & (named == FREE))
    assert np.any(named == FREE)


def test_an_elbow_that_must_turn_over_parts_its_own_sheet_only():
    workspace = between_bars().workspace
    found = flood(workspace, 64)
    up, down = np.array([0.0, -1.0]), np.array([0.0, 1.0])
    assert found.parts((up, down), -1.0)
    assert not found.parts((up, down))
    assert len(JointWay(workspace, found.way((up, down)), 1.0).turns) % 2 == 1


def test_a_motion_is_found_where_gaps_lead_to_none():
    """Bars that leave a way with the elbow the other way around only."""
    task = pm.ArmManeuver(
        arm=pm.Arm(
            links=[pm.Link(length=0.9, mass=2, half_width=0.03), pm.Link(length=0.7, mass=1, half_width=0.03)],
            payload=1.5,
        ),
        start=pm.Pose(tip=(1.15, -0.7), elbow="either"),
        goal=pm.Pose(tip=(1.2, 0.45), elbow="either"),
        duration=2,
        obstacles=[pm.Block(vertices=[(0.75, -0.15), (1.4, -0.15), (1.4, 0.3), (0.75, 0.3)])],
        margin=0.02,
    )
    plan = pm.solve(task, pm.Settings(node_limit=1))  # nothing left for motions that touch an edge anywhere else
    assert plan.keeps
    assert plan.clearance >= 0.02
    assert len(plan.elbow_changes) == 1
    assert pm.verify(plan.to_json()).passed


def test_the_fewest_obstacles_that_close_the_way_are_named():
    """A claw that closes it alone, listed before two bars that do it together."""
    arm = pm.Arm(links=[pm.Link(length=1, mass=1), pm.Link(length=1, mass=1)])

    def polar(*corners):
        return pm.Block(vertices=[(r * np.cos(np.radians(a)), r * np.sin(np.radians(a))) for r, a in corners])

    claw = [(0.3, 70), (2.6, 70), (3.6, 35), (3.6, 0), (3.6, -35), (2.6, -70), (0.3, -70)]
    inside = [(0.35, -62), (2.3, -66), (2.6, -35), (2.6, 0), (2.6, 35), (2.3, 66), (0.35, 62)]
    bars = [polar((0.3, a - 3), (2.4, a - 0.75), (2.4, a + 0.75), (0.3, a + 3)) for a in (110, -110)]
    task = pm.ArmManeuver(
        arm=arm,
        start=pm.Pose(joints=(np.pi, 0.3)),
        goal=pm.Pose(joints=(0, 0.3)),
        duration=2,
        obstacles=[polar(*claw, *inside), *bars],
    )
    plan = pm.solve(task, pm.Settings(grid=pm.Aligned(steps=50), time_limit=10))
    assert plan.status == "infeasible"
    assert pm.explain(plan).conflict == ("obstacles[0]",)
