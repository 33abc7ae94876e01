"""Many optima at once are those found one at a time; bounds hold for all, attained or not."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.integrals import all_derivatives, derivatives
from peakmin.proofs import nodal as nodal_form
from peakmin.proofs.bounds import lower_bound, lower_bounds
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal, extremals
from peakmin.proofs.newton import newton
from peakmin.proofs.nodal import Nodal
from tests.conftest import wall_maneuver
from tests.random_maneuvers import maneuver


@pytest.mark.parametrize("walls", [1, 2, 3])
def test_together_and_alone(walls):
    rng = np.random.default_rng(walls)
    masses = [PointMass.of(one) for one in map(maneuver, range(60)) if len(one.walls) == walls]
    masses = [mass for mass in masses if not np.any(np.isfinite(mass.width))]
    assert len(masses) > 10
    # one each at good times and at any
    times = np.sort(rng.uniform(0.05, 0.95, (len(masses), walls)), axis=1)
    times[::2] = np.arange(1, walls + 1) / (walls + 1)
    found = extremals(PointMass.stacked(masses), times)
    for mass, at, lower, upper, multipliers, settled in zip(
        masses, times, found.lower, found.upper, found.multipliers, found.settled, strict=True
    ):
        alone = extremal(mass, at)
        assert lower <= alone.upper * (1 + 1e-12)
        assert alone.lower <= upper * (1 + 1e-9)
        assert lower == pytest.approx(lower_bound(mass, at, multipliers), rel=1e-12)
        if settled and alone.gap < 1e-9:
            assert upper == pytest.approx(alone.upper, rel=1e-9)
    assert np.count_nonzero(found.settled) > 0


def test_what_is_not_difficult_is_settled_at_once():
    """Tips about the middle at half time: all of them; some walls push, some are passed beyond, some touched."""
    rng = np.random.default_rng(0)
    for contact in ("clear", "touch"):
        masses = [
            PointMass.of(wall_maneuver(obstacles=(pm.Wall(tip=tuple(tip), contact=contact),)))
            for tip in rng.uniform([0.3, -0.3], [0.7, 0.6], (200, 2)).tolist()
        ]
        times = np.full((200, 1), 0.5)
        found = extremals(PointMass.stacked(masses), times)
        assert np.count_nonzero(found.settled) > 150
        alone = [extremal(mass, at) for mass, at in zip(masses, times, strict=True)]
        settled = found.settled & np.array([one.gap < 1e-9 for one in alone])
        assert np.count_nonzero(settled) > 150
        np.testing.assert_allclose(found.upper[settled], [one.upper for one in np.array(alone)[settled]], rtol=2e-9)


def test_bounds_of_stacked_maneuvers_are_those_of_each():
    rng = np.random.default_rng(1)
    masses = [PointMass.of(one) for one in map(maneuver, range(40)) if len(one.walls) == 2]
    times = np.sort(rng.uniform(0.05, 0.95, (len(masses), 2)), axis=1)
    multipliers = rng.normal(size=(len(masses), 4, 2))
    multipliers[0] = 0
    together = lower_bounds(PointMass.stacked(masses), times, multipliers)
    alone = [lower_bound(*one) for one in zip(masses, times, multipliers, strict=True)]
    np.testing.assert_allclose(together, alone, rtol=1e-14)
    assert together[0] == 0


def test_steps_together_and_alone():
    """Each goes its own way: damped or not, over a part of the values or all, from anywhere, for a few steps or many."""
    rng = np.random.default_rng(3)
    masses = [PointMass.of(one) for one in map(maneuver, range(80)) if len(one.walls) == 2]
    kinks = np.tile([0.0, 0.3, 0.6, 1.0], (len(masses), 1))
    every = Nodal(PointMass.stacked(masses), kinks)
    starts = every.least_energy() + rng.normal(size=(len(masses), 4, 2)) * 10.0 ** -rng.uniform(
        0, 4, (len(masses), 1, 1)
    )
    starts[::7] *= -1  # no multiple of which is good
    none = np.zeros(4, dtype=bool)
    for idle, silent in ((none[:2], none), (np.array([True, False]), none), (none[:2], np.arange(4) == 3)):
        for steps in (1, 3, 60):
            together = newton(every, starts, every.basis(idle, silent), steps)
            seen = 0
            for mass, p, start in zip(masses, together, starts, strict=True):
                own = Nodal(mass, kinks[0])
                alone = newton(own, start, own.basis(idle, silent), steps)
                if steps < 60:  # of many, where F has a kink, rounding errors decide the way
                    np.testing.assert_allclose(p, alone, rtol=1e-6, atol=1e-6 * np.max(np.abs(alone)))
                multipliers, best = own.multipliers(alone), extremal(mass, kinks[0, 1:-1])
                assert np.all(np.abs(p[silent]) <= 1e-12 * np.max(np.abs(p)))
                settled = not np.any(silent | np.any(idle)) and best.gap < 1e-9
                if steps == 60 and settled and np.all(mass.windows.along(multipliers[2:])[mass.clear] > 0):
                    for one in (p, alone):
                        proved = lower_bound(mass, kinks[0, 1:-1], own.multipliers(one))
                        assert proved == pytest.approx(best.upper, rel=1e-6)
                    seen += 1
            assert seen > 5 or steps < 60 or np.any(silent) or np.any(idle)


def test_a_singular_step_is_damped_alone(monkeypatch):
    """Of a stack whose first Hessian vanishes at first the others take the steps they would."""
    masses = [PointMass.of(one) for one in map(maneuver, range(80)) if len(one.walls) == 2][:6]
    every = Nodal(PointMass.stacked(masses), np.tile([0.0, 0.3, 0.6, 1.0], (6, 1)))
    start = every.least_energy()
    expected, calls = newton(every, start, None), []
    kernel = nodal_form.derivatives_of_all

    def spoiled(h, p):
        impulse, gradient, hessian = kernel(h, p)
        calls.append(len(p))
        if len(calls) == 2:  # where the first step is taken from
            gradient, hessian = gradient.copy(), hessian.copy()
            gradient[0, 1:], hessian[0] = 0, 0
        return impulse, gradient, hessian

    monkeypatch.setattr(nodal_form, "derivatives_of_all", spoiled)
    found = newton(every, start, None)
    np.testing.assert_array_equal(found[1:], expected[1:])
    proved = lower_bounds(every.mass, every.kinks[:, 1:-1], every.multipliers(found))
    assert proved[0] > lower_bounds(every.mass, every.kinks[:, 1:-1], every.multipliers(start))[0]


def test_pieces_together_and_alone():
    rng = np.random.default_rng(2)
    first, last = rng.normal(size=(2, 300, 2))
    last[:100] = first[:100] * (1 + 1e-3 * rng.normal(size=(100, 1)))  # nearly constant
    last[100:120] = -first[100:120] * rng.random((20, 1))  # through zero
    last[120:130] = first[120:130]
    first[130:140] = 0
    first[140:150] = last[140:150] = 0
    alone = [derivatives(a, b) for a, b in zip(first.tolist(), last.tolist(), strict=True)]
    np.testing.assert_allclose(all_derivatives(first, last), alone, rtol=1e-12, atol=1e-12)
