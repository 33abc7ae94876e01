"""The frame of a maneuver and back."""

import numpy as np

import peakmin as pm
from peakmin.geometry.frame import Frame
from tests.random_maneuvers import maneuver


def test_start_at_the_origin_and_goal_on_the_axis():
    start, goal = np.array([1.0, 2.0]), np.array([-2.0, 6.0])
    frame = Frame.between(start, goal)
    np.testing.assert_allclose(frame.position([start, goal]), [[0, 0], [5, 0]], atol=1e-15)
    np.testing.assert_allclose(frame.vector([-3.0, 4.0]), [5, 0], atol=1e-15)
    assert frame.angle == np.arctan2(4, -3)
    places = np.random.default_rng(0).normal(size=(4, 3, 2))
    np.testing.assert_allclose(frame.position_back(frame.position(places)), places, atol=1e-14)
    np.testing.assert_allclose(frame.vector(frame.vector_back(places)), places, atol=1e-14)
    np.testing.assert_array_equal(Frame.between(start, start).along, [1, 0])


def test_maneuvers_there_and_back():
    asked = maneuver(1).model_copy(
        update={"region": ((-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)), "obstacles": (*maneuver(1).obstacles, BLOCK)}
    )
    frame = pm.Frame.from_maneuver(asked)
    there = frame.maneuver(asked)
    assert there.start.position == (0.0, 0.0)
    assert abs(there.goal.position[1]) < 1e-14
    back = frame.maneuver_back(there)
    for one, other in zip(back.obstacles, asked.obstacles, strict=True):
        assert type(one) is type(other)
    np.testing.assert_allclose(back.obstacles[-1].vertices, BLOCK.vertices, atol=1e-14)
    np.testing.assert_allclose(back.obstacles[0].tip, asked.obstacles[0].tip, atol=1e-14)
    np.testing.assert_allclose(back.obstacles[0].direction, asked.obstacles[0].direction, atol=1e-14)
    np.testing.assert_allclose(back.region, asked.region, atol=1e-14)
    np.testing.assert_allclose(back.goal.velocity, asked.goal.velocity, atol=1e-14)


BLOCK = pm.Block(vertices=[(7.0, 7.0), (8.0, 7.0), (8.0, 8.0)])
