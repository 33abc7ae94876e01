"""Plan documents that state what is not so, with a digest that fits."""

import json

import numpy as np
import pytest

import peakmin as pm
from peakmin.check import check
from peakmin.document import digest
from peakmin.trajectory import HoldTrajectory

from .conftest import wall_maneuver

NOWHERE = {"low": [-1e200], "high": [1e200], "multipliers": [[1, 0], [0, 0], [0, 0]]}
POINT = {"low": [0.001], "high": [0.001], "multipliers": [[1, 0], [0, 0], [0, 1]]}
HUGE = {"low": [0.0], "high": [1.0], "multipliers": [[1e308, 1e308], [-1e308, 0], [1e308, 1e308]]}


@pytest.fixture(scope="module", params=["direct", "exact"])
def written(request):
    return pm.solve(wall_maneuver(), pm.Settings(method={"kind": request.param})).to_json()


@pytest.mark.parametrize(
    "lie",
    [
        {"proof": [NOWHERE], "lower_bound": 1000.0},
        {"proof": [POINT, NOWHERE]},
        {"proof": []},
        {"proof": [HUGE]},
        {"lower_bound": float("inf")},
        {"lower_bound": float("nan")},
        {"lower_bound": "8.5"},
        {"lower_bound": -1.0},
        {"status": "infeasible"},
        {"status": "unknown", "peak": 1e-3, "times": [], "position": [], "velocity": [], "acceleration": []},
        {"position": [[float("nan")] * 2] * 201},
        {"position": [["0", "0"]] * 201},
        {"velocity": []},
        {"peak": None},
        {"times": [0.0, 1.0]},
        {"extra": 1},
        {"version": 2},
        {"spec": {}},
        {"scope": "some"},
        {"multipliers": [[1, 2]]},
    ],
    ids=str,
)
def test_forged_documents_are_refused(written, lie):
    """Found untrue, or no plan at all."""
    data = json.loads(written) | lie
    if lie.get("times") == []:
        data.pop("costate", None)
    data["digest"] = digest(data)
    try:
        passed = pm.verify(json.dumps(data)).passed
    except pm.SpecError:
        passed = False
    assert not passed


def test_a_negative_size_is_no_costate():
    data = json.loads(pm.solve(wall_maneuver(obstacles=()), pm.Settings(method=pm.Exact())).to_json())
    data["costate"]["size"] = [-1000.0] * len(data["costate"]["size"])
    with pytest.raises(pm.SpecError, match="a size is below zero"):
        pm.verify(json.dumps(data))


def test_errors_count_against_what_is_asked_not_against_a_far_wall():
    """A hold that stops half a metre short must not pass because a wall's tip is a million kilometres away."""
    far = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -1e9)),))
    hold = HoldTrajectory(np.array([0.0, 1.0]), np.array([[1e-3, 0.0]]), np.zeros(2), np.zeros(2))
    assert not check(far, hold, np.array([0.5]), 1e-3).passed


def test_more_walls_than_a_box_can_have_corners_for_are_refused():
    walls = [pm.Wall(tip=(0.1 * i, 1.0)) for i in range(1, 10)]
    with pytest.raises(pm.SpecError, match=r"^maneuver.obstacles: was 9 walls, must be at most 8"):
        pm.solve(wall_maneuver(obstacles=walls))


@pytest.mark.parametrize(("duration", "shift"), [(100.0, 1e-8), (0.01, 1e-4)])
def test_velocities_are_held_to_their_own_unit(duration, shift):
    """A slow maneuver's are small: what would be rounding of a fast one is a lie there."""
    data = json.loads(pm.solve(wall_maneuver(duration=duration)).to_json())
    data["velocity"][7][0] += shift
    data["digest"] = digest(data)
    assert pm.verify(json.dumps(data)).problems == ("velocity: not what the control gives",)
