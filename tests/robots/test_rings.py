"""Limits of the second joint, seen by the centre of mass: rings that hold every place within limits, and little more."""

import math

import numpy as np
import pytest

from peakmin.robots.kinematics import Chain
from peakmin.robots.workspace import BLOCKED, Sheets, Workspace, bends_within
from tests.search.test_arms import small

LIMITS = [(-2.6, 2.6), (0.3, 1.2), (-1.2, -0.3), (-0.5, 4.0), (2.5, 3.9), (-7.0, 7.0), (5.0, 6.0), (0.0, 0.0)]


@pytest.mark.parametrize("limits", LIMITS)
def test_no_place_within_limits_is_blocked(limits):
    chain: Chain = small().arm.chain
    workspace, rng = Workspace(chain, (), 0.0), np.random.default_rng(0)
    bends = np.concatenate([rng.uniform(*limits, 500), limits])
    theta = np.cumsum(np.stack([rng.uniform(-3, 3, len(bends)), bends], axis=1), axis=1)
    places, elbows = chain.centre(theta), np.sign(np.sin(bends))
    for elbow in (-1.0, 1.0):
        own = places[elbows == elbow]
        if len(own):
            sheets = Sheets(workspace, (elbow,), limits)
            assert np.all(sheets.slack(own) >= -1e-8 * workspace.size)
            assert not np.any(sheets.decide(own, np.zeros(len(own))) == BLOCKED)


@pytest.mark.parametrize("limits", LIMITS)
def test_bends_are_those_of_some_turn_of_the_joint(limits):
    for elbow in (-1.0, 1.0):
        for bend in np.linspace(1e-6, math.pi - 1e-6, 301).tolist():
            turns = elbow * bend + math.tau * np.arange(-3, 4)
            within = bool(np.any((turns >= limits[0] - 1e-9) & (turns <= limits[1] + 1e-9)))
            assert any(near <= bend <= far for near, far in bends_within(limits, elbow)) == within
