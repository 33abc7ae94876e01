"""Units of a point mass, and about how large M is, by closed forms."""

import math

import numpy as np
import pytest

from peakmin.geometry.window import Windows
from peakmin.proofs.double_integrator import PointMass

EPS = np.finfo(float).eps


def windows(*, tips=(), free=(), clear=(), width=()):
    return Windows(
        np.array(tips, dtype=float).reshape(-1, 2),
        np.array(free, dtype=float).reshape(-1, 2),
        np.array(clear, dtype=bool),
        np.array(width, dtype=float),
    )


def between(p0, v0, pf, vf, duration=1.0, past=None):
    states = (np.array(x, dtype=float) for x in (p0, v0, pf, vf))
    return PointMass.between(*states, duration, windows() if past is None else past)


@pytest.mark.parametrize(
    ("largest", "v0", "pf", "vf", "tip"),
    [
        (5.0, (0, 0), (3, -4), (0, 1), (1, 1)),  # the way
        (6.0, (0, -1), (0, 0), (0, 2), (1, 1)),  # the change of velocity, over two seconds
        (4.0, (0, 0), (1, 0), (0, 0), (0, -4)),  # a tip
        (7.0, (1.5, 0), (3, 0), (1.5, 0), (-4, 0)),  # a tip, seen when start's velocity has left it behind
    ],
)
def test_the_unit_of_length_is_the_largest_target(largest, v0, pf, vf, tip):
    at = np.array([10.0, -20.0])
    past = windows(tips=at + tip, free=(0, 3), clear=[True], width=[8])
    mass = between(at, v0, at + pf, vf, 2.0, past)
    assert mass.length == pytest.approx(largest, rel=1e-15)
    np.testing.assert_allclose(mass.pf, np.array(pf) / largest)
    np.testing.assert_allclose(mass.v0, 2 * np.array(v0) / largest)
    np.testing.assert_allclose(mass.vf, 2 * np.array(vf) / largest)
    np.testing.assert_allclose(mass.tips, [np.array(tip) / largest])
    np.testing.assert_allclose(mass.width, 8 / largest)
    np.testing.assert_array_equal(mass.free, [[0, 1]])


def test_a_unit_is_no_smaller_than_the_rounding_errors():
    coasting = between((0, 0), (-1e9, 0), (-1e9, 0), (-1e9, 0))
    assert coasting.length == 1e9 * EPS
    assert between((3, 4), (0, 0), (3, 4), (0, 0)).length == 1.0


def test_the_floor_is_the_largest_of_one_equation_at_a_time():
    none = np.zeros(0)
    # 1 m from rest to rest, if the velocity at the goal were free: |b| = M int (1 - t) dt = M / 2
    assert between((0, 0), (0, 0), (0, -1), (0, 0)).floor(none) == pytest.approx(2)
    # a change of velocity alone: |b| = M
    turned = between((0, 0), (0, -1), (0, -1), (0, 1))
    assert turned.length * turned.floor(none) == pytest.approx(2)
    # a wall's tip 1/4 away at T = 1/4: M T² / 2 from the start; from the goal it is M (1 - T)² / 2
    for place, time in ((0.25, 0.25), (0.25, 0.75)):
        past = windows(tips=(0, place), free=(0, 1), clear=[True], width=[math.inf])
        met = between((0, 0), (0, 0), (0, 0), (0, 0), past=past)
        assert met.length * met.floor(np.array([time])) == pytest.approx(place / 0.5 / min(time, 1 - time) ** 2)
    # what the window gives away is not needed
    past = windows(tips=(0.1, -0.25), free=(0, 1), clear=[True], width=[math.inf])
    beside = between((0, 0), (0, 0), (0, 0), (0, 0), past=past)
    assert beside.length * beside.floor(np.array([0.5])) == pytest.approx(0.1 / 0.5 / 0.25)


@pytest.mark.parametrize("free", [(0.0, 1.0), (0.6, 0.8), (-0.8, 0.6), (1.0, 0.0)])
def test_coasting_needs_nothing(free):
    """Also where the wall's frame is turned, and rounding has moved the tip aside along one axis more than along another."""
    way = np.array([1.0, 0.0])
    for tip in (0.3 * way - 0.2 * np.array(free), 0.3 * way - 0.2 * np.array(free) + [0.0, EPS]):
        past = windows(tips=tip, free=free, clear=[True], width=[math.inf])
        assert between((0, 0), way, way, way, past=past).floor(np.array([0.3])) == 0.0
        assert between((0, 0), way, way, way, past=past.moved(np.array([0.01, 0.01]))).floor(np.array([0.3])) > 0.01
