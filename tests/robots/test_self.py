"""Links that share no joint keep clear of each other."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.robots.link_clearance import self_clearance
from peakmin.robots.separation import self_separations
from peakmin.robots.workspace import Workspace
from peakmin.view import hints, words
from tests.solved import solved

ARM = pm.Arm(links=[pm.Link(length=a, mass=m, half_width=0.03) for a, m in ((0.9, 8), (0.8, 5), (0.5, 2), (0.4, 1))])


def workspace(self_margin=0.01):
    return Workspace(ARM.chain, (), 0.0, self_margin)


def test_pairs_share_no_joint():
    assert workspace().pairs == [(0, 2), (0, 3), (1, 3)]
    assert workspace(None).pairs == []


def test_distances_are_those_of_the_links_and_change_as_stated():
    space, rng = workspace(), np.random.default_rng(3)
    theta = np.cumsum(rng.uniform(-2.8, 2.8, (400, 4)), axis=1)
    far, by = self_separations(space.chain, theta, space.pairs)
    exact = space.apart(theta)
    lines = [shapely.linestrings(np.stack([p[:-1], p[1:]], axis=1)) for p in space.chain.joints(theta)]
    by_hand = [[one[i].distance(one[j]) - 0.06 for i, j in space.pairs] for one in lines]
    clear = np.array(by_hand) > -0.06 + 1e-9
    assert exact[clear] == pytest.approx(np.array(by_hand)[clear], abs=1e-12)
    assert np.all(exact[~clear] <= -0.06)  # by how much they cross
    assert clear.any()
    assert not clear.all()
    assert far[clear] == pytest.approx(exact[clear], abs=1e-9)
    assert np.all(far[~clear] <= -0.06 + 1e-9)
    step = 1e-7
    moved = np.stack([self_separations(space.chain, theta + step * e, space.pairs)[0] for e in np.eye(4)], axis=-1)
    smooth = np.abs((moved - far[..., None]) / step - by).max(axis=-1) < 1e-4
    assert np.mean(smooth) > 0.98


def test_links_move_against_each_other_by_no_more_than_stated():
    space, rng = workspace(), np.random.default_rng(4)
    theta = np.cumsum(rng.uniform(-2.8, 2.8, (300, 4)), axis=1)
    spread = rng.uniform(0, 0.3, (300, 4))
    near = theta + spread * rng.uniform(-1, 1, (300, 4))
    assert np.all(np.abs(space.apart(near) - space.apart(theta)) <= space.turned_apart(spread) + 1e-12)


def folded(**change):
    """The last links pass over the first where nothing forbids it."""
    links = [pm.Link(length=a, mass=m, half_width=0.03) for a, m in ((0.9, 4), (0.6, 2), (0.8, 2))]
    given = {
        "arm": pm.Arm(links=links, self_margin=0.02),
        "start": pm.Pose(joints=(0.0, 0.6, 2.6)),
        "goal": pm.Pose(joints=(0.0, -0.6, 2 * np.pi - 2.6)),
        "duration": 3.0,
    }
    return pm.ArmManeuver(**given | change)


def test_links_that_would_cross_are_planned_around_each_other():
    task = folded()
    over = task.model_copy(update={"arm": task.arm.model_copy(update={"self_margin": None})})
    crossing, plan = solved(over), pm.solve(task)
    t = np.linspace(0, 3, 10_001)
    assert crossing.keeps
    assert np.min(task.workspace.apart(crossing.joints.absolute(t))) < 0
    assert plan.keeps
    assert plan.peak > crossing.peak
    assert np.min(task.workspace.apart(plan.joints.absolute(t))) >= 0.02
    least, at = self_clearance(task.workspace, plan.joints)
    assert 0.02 <= least <= np.min(task.workspace.apart(plan.joints.absolute(t))) + 1e-9
    assert task.workspace.apart(plan.joints.absolute(at)) == pytest.approx(least, abs=1e-3)
    assert pm.verify(plan.to_json()).passed


def test_links_that_pass_over_one_another_are_told():
    task = folded()
    over = solved(task.model_copy(update={"arm": task.arm.model_copy(update={"self_margin": None})}))
    ((i, j, at),) = over.passing_over
    assert (i, j) == (0, 2)
    assert workspace_of(over).apart(over.joints.absolute(at)) <= 0
    lines = words.describe(over).splitlines()
    assert (
        f"  links           pass over one another: 1 and 3 about {at:.3g} s; arm.self_margin keeps them apart" in lines
    )
    asked = replace(over, maneuver=task)
    assert asked.passing_over == []
    said = "  not kept        arm.self_margin: two links come 0.08"
    assert any(line.startswith(said) for line in words.describe(asked).splitlines())
    assert "a smaller self_margin, or other poses" in hints.advice(replace(asked, status="unknown"))


def workspace_of(plan):
    return Workspace(plan.joints.chain, (), 0.0, 0.0)


def test_a_file_whose_links_come_too_close_is_refused():
    task = folded()
    over = task.model_copy(update={"arm": task.arm.model_copy(update={"self_margin": None})})
    data = solved(over).document()
    data["spec"]["arm"]["self_margin"] = 0.02
    found = pm.verify(json.dumps(data))
    assert not found.passed


def test_poses_that_touch_themselves_are_refused_in_one_line():
    with pytest.raises(
        pm.SpecError, match=r"goal: was links 1 and 3 -0.4517 m apart, must be at least arm.self_margin"
    ):
        folded(goal=pm.Pose(joints=(0.0, 2.4, 2.4)))
