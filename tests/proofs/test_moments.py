import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp
from scipy.signal import cont2discrete

import peakmin as pm
from peakmin.proofs.double_integrator import PointMass, costate_at_kinks, hold_rows, impulse, responses, transition
from tests.conftest import wall_maneuver


@pytest.mark.parametrize("dt", [1e-6, 0.005, 1.0, 7.0])
def test_transition_is_scipy_s_zero_order_hold(dt):
    system = (np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1]]), np.eye(2), np.zeros((2, 1)))
    phi, gamma, *_ = cont2discrete(system, dt, method="zoh")
    np.testing.assert_allclose(transition(dt)[0], phi, rtol=1e-14)
    np.testing.assert_allclose(transition(dt)[1], gamma[:, 0], rtol=1e-14)


@given(
    steps=st.integers(1, 40),
    at=st.lists(st.floats(0.01, 0.99), max_size=3),
    seed=st.integers(0, 1000),
)
def test_condensed_rows_are_the_recursion_also_between_nodes(steps, at, seed):
    rng = np.random.default_rng(seed)
    edges = np.concatenate([[0.0], np.sort(rng.uniform(0, 1, steps - 1)), [1.0]])
    u = rng.normal(size=steps)
    moments = hold_rows(edges, np.array(at)) @ u

    def reach(time):
        state = np.zeros(2)
        for begin, end, control in zip(edges, edges[1:], u, strict=False):
            if begin < time:
                phi, gamma = transition(min(end, time) - begin)
                state = phi @ state + gamma * control
        return state

    np.testing.assert_allclose(moments[:2], reach(1.0), atol=1e-12)
    np.testing.assert_allclose(moments[2:], [reach(t)[0] for t in at], atol=1e-12)


def test_rows_are_integrals_of_the_responses():
    edges, times = np.array([0.0, 0.2, 0.7, 1.0]), np.array([0.33, 0.8])
    fine = np.linspace(0, 1, 200_001)
    middle = (fine[1:] + fine[:-1]) / 2
    hold = np.searchsorted(edges, middle, side="right") - 1
    g = responses(middle, times) / len(middle)
    integrals = np.stack([g[:, hold == k].sum(axis=1) for k in range(3)], axis=1)
    np.testing.assert_allclose(hold_rows(edges, times), integrals, atol=1e-8)


def test_targets_are_affine_in_the_obstacle_times_and_scaled():
    maneuver = wall_maneuver(start=pm.State(position=(0, 0), velocity=(0.3, -2)), duration=3.0)
    mass = PointMass.of(maneuver)
    b = [mass.targets(np.array([t])) for t in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(b[0] + b[2], 2 * b[1], atol=1e-15)
    assert max(np.hypot(*row) for each in b for row in each) == pytest.approx(1)


def exact_impulse(multipliers, times):
    """The same integral in 40 digits."""
    mp.dps = 40
    times = [mp.mpf(float(t)) for t in times]
    rows = [[mp.mpf(float(x)) for x in row] for row in multipliers]

    def p(t):
        g = [1 - t, mp.mpf(1), *(max(at - t, mp.mpf(0)) for at in times)]
        return [sum(g[i] * rows[i][j] for i in range(len(g))) for j in (0, 1)]

    total, kinks = mp.mpf(0), [mp.mpf(0), *sorted(times), mp.mpf(1)]
    for a, b in zip(kinks, kinks[1:], strict=False):
        (x0, y0), (x1, y1) = p(a), p(b)
        dx, dy = x1 - x0, y1 - y0
        d = mp.sqrt(dx**2 + dy**2)
        if d == 0:
            total += (b - a) * mp.sqrt(x0**2 + y0**2)
            continue
        e, s = abs(x0 * dy - y0 * dx) / d, (x0 * dx + y0 * dy) / d

        def f(s, e=e):
            return (s * mp.sqrt(s * s + e * e) + (e * e * mp.asinh(s / e) if e > 0 else 0)) / 2

        total += (b - a) / d * (f(s + d) - f(s))
    return total


@settings(deadline=None)
@given(q=st.integers(0, 3), seed=st.integers(0, 10**6), spread=st.integers(0, 12))
def test_impulse_is_exact_to_rounding(q, seed, spread):
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0, 1, q))
    multipliers = rng.normal(size=(2 + q, 2)) * 10.0 ** -rng.uniform(0, spread, (2 + q, 1))
    if seed % 3 == 0:  # one line: p runs through zero or is constant
        multipliers[:, 1] = multipliers[:, 0] * 0.3
    exact = exact_impulse(multipliers, times)
    assert float(abs(impulse(multipliers, times) - exact) / np.abs(multipliers).sum()) < 2e-15


def test_impulse_and_costate_broadcast():
    rng = np.random.default_rng(0)
    times, multipliers = rng.uniform(0, 1, (5, 3, 2)), rng.normal(size=(4, 2))
    together = impulse(multipliers, times)
    assert together.shape == (5, 3)
    assert together[2, 1] == pytest.approx(impulse(multipliers, times[2, 1]), rel=1e-15)
    kinks, p = costate_at_kinks(multipliers, times[2, 1])
    np.testing.assert_allclose(p, (multipliers.T @ responses(kinks, times[2, 1])).T, atol=1e-15)
