"""The continuous-time optimum: reference values, Pontryagin's conditions, random maneuvers, sensitivities."""

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.costate import CostateTrajectory
from peakmin.geometry.integrals import assembly, derivatives, mean_direction, mean_norm
from peakmin.paper import TWO_LINK
from peakmin.programs.least_peak import LeastPeak
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from tests.conftest import ALL, wall_maneuver
from tests.random_maneuvers import maneuver, times

EXACT = pm.Settings(method=pm.Exact())
CHUNKS = [range(k, k + 20) for k in range(0, 500, 20)] if ALL else [range(1, 500, 34)]


@pytest.mark.parametrize("seed", range(40))
def test_integrals_along_a_piece(seed):
    """Against an eight-point Gauss rule on panels that halve towards the place where p is smallest."""
    from peakmin.geometry.integrals import GAUSS_NODES, GAUSS_WEIGHTS

    rng = np.random.default_rng(seed)
    p0 = rng.normal(size=2)
    p1 = p0 + rng.normal(size=2) * 10.0 ** rng.uniform(-4, 1)
    d = p1 - p0
    nearest = np.clip(-(p0 @ d) / (d @ d), 0, 1)
    cuts = np.unique(np.clip(np.r_[0, 1, *(nearest + side * 0.5 ** np.arange(50) for side in (-1, 1)), nearest], 0, 1))
    x = cuts[:-1, None] + np.diff(cuts)[:, None] * GAUSS_NODES
    w = np.diff(cuts)[:, None] * GAUSS_WEIGHTS
    p = p0 + x[..., None] * d
    r = np.hypot(p[..., 0], p[..., 1])
    unit = p / r[..., None]
    assert mean_norm(p0, p1) == pytest.approx(np.sum(w * r), rel=1e-13)
    plain, weighted = mean_direction(p0, p1)
    np.testing.assert_allclose(plain, np.einsum("pg,pgi->i", w, unit), atol=1e-13)
    np.testing.assert_allclose(weighted, np.einsum("pg,pgi->i", w * x, unit), atol=1e-13)
    total = np.array(derivatives(p0.tolist(), p1.tolist())) @ assembly(2, 2)
    norm, gradient, hessian = total[0], total[1:5], total[5:]
    assert norm == pytest.approx(np.sum(w * r), rel=1e-13)
    shares = np.stack([1 - x, x])
    np.testing.assert_allclose(np.reshape(gradient, (2, 2)), np.einsum("pg,apg,pgi->ai", w, shares, unit), atol=1e-13)
    across = (np.eye(2) - unit[..., :, None] * unit[..., None, :]) / r[..., None, None]
    expected = np.einsum("pg,apg,bpg,pgij->aibj", w, shares, shares, across)
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(np.reshape(hessian, (2, 2, 2, 2)), expected, rtol=1e-6, atol=1e-9 * scale)


@pytest.mark.parametrize(
    ("maneuver", "at", "value"),
    [
        (wall_maneuver("touch"), 0.5, 8.537415),
        (wall_maneuver("clear"), 0.5, 8.537415),
        (wall_maneuver("touch"), 0.1 + 0.8 * 9 / 17, 8.616756),
        (TWO_LINK, 3.1217, 0.499997),
    ],
)
def test_reference_values(maneuver, at, value):
    plan = pm.sweep(maneuver, EXACT, times=[at]).best
    assert plan.peak == pytest.approx(value, abs=6e-7)
    assert plan.gap < 1e-9
    assert plan.check().passed


def test_rest_to_rest_is_four_times_distance_over_duration_squared():
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(1, 2)), goal=pm.State(position=(4, 6)), duration=2.0), EXACT)
    assert plan.peak == pytest.approx(5.0, rel=1e-12)
    assert plan.lower_bound == pytest.approx(5.0, rel=1e-12)


def test_the_paper_s_optimality_conditions_hold():
    """u on the circle, along the costate; the costate affine between walls and continuous at them."""
    uneven = wall_maneuver(goal=pm.State(position=(1.2, 0.1), velocity=(0.5, -1)))
    plan = pm.sweep(uneven, EXACT, times=[0.45]).best
    motion = plan.trajectory
    assert isinstance(motion, CostateTrajectory)
    t = np.linspace(0, 1, 1001)
    u = plan.acceleration(t)
    np.testing.assert_allclose(np.hypot(*u.T), plan.peak, rtol=1e-9)
    kinks = [0, plan.obstacle_times[0], 1]
    p0, p1, p2 = motion.first[0], motion.first[1], motion.last[1]
    np.testing.assert_allclose(motion.last[0], p1, atol=1e-12)
    p = np.stack([np.interp(t, kinks, [p0[i], p1[i], p2[i]]) for i in (0, 1)], axis=1)
    np.testing.assert_allclose(u / plan.peak, p / np.hypot(*p.T)[:, None], atol=1e-9)


@pytest.mark.parametrize("seeds", CHUNKS, ids=str)
def test_random_maneuvers_at_given_times(seeds):
    """500 of them: bounds in order, holds of 2,000 steps just above the optimum, and few that do not settle."""
    settled = 0
    for seed in seeds:
        problem = maneuver(seed)
        at = times(seed, len(problem.obstacles)) * problem.duration
        exact = LeastPeak(problem, EXACT)(at)
        holds = LeastPeak(problem, pm.Settings(grid=pm.Aligned(steps=2000), solver="CLARABEL"))(at)
        assert exact.lower <= exact.upper, seed
        assert exact.lower <= holds.upper, seed
        if exact.gap <= 1e-7 and holds.gap <= 1e-6:
            settled += 1
            assert exact.upper * (1 - 2e-7) <= holds.upper <= exact.upper * (1 + 1e-4), seed
    assert settled >= 0.85 * len(seeds)


def test_holds_approach_the_optimum_as_their_number_grows():
    exact = LeastPeak(wall_maneuver(), EXACT)([0.45])
    excess = []
    for steps in (50, 200, 800):
        excess.append(LeastPeak(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=steps)))([0.45]).upper - exact.upper)
    assert excess[0] > 10 * excess[1] > 100 * excess[2] > 0


@pytest.mark.parametrize("at", [1e-3, 0.02, 0.1, 0.9, 0.98, 0.999])
def test_times_near_the_ends_leave_a_silent_stretch(at):
    """There one leg alone decides, M = 2 |b| / T_i^2, and the other is filled with what it needs by itself."""
    plan = pm.sweep(wall_maneuver("touch"), EXACT, times=[at]).best
    assert plan.status == "solved"
    assert plan.peak == pytest.approx(2 * np.hypot(0.5, 0.5) / min(at, 1 - at) ** 2, rel=1e-9)
    assert plan.gap < 1e-6


def test_an_idle_wall_costs_nothing():
    low = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -5)),))
    plan = pm.solve(low, EXACT)
    assert plan.peak == pytest.approx(4.0, rel=1e-6)
    assert plan.lower_bound == pytest.approx(4.0, rel=2e-6)


def test_multipliers_are_sensitivities():
    """Against central differences of the exact least peak."""
    base = wall_maneuver(
        "touch",
        start=pm.State(position=(0.1, -0.1), velocity=(0.5, 0.3)),
        goal=pm.State(position=(1.2, 0.1), velocity=(0.5, -1)),
        duration=2.0,
    )
    at = 0.9
    plan = pm.sweep(base, EXACT, times=[at]).best
    found, h = plan.sensitivities, 1e-5

    def peak(problem, t=at):
        return pm.sweep(problem, EXACT, times=[t]).best.peak

    def moved(field, part, axis, step):
        state = getattr(base, field)
        value = list(getattr(state, part))
        value[axis] += step
        return base.model_copy(update={field: state.model_copy(update={part: tuple(value)})})

    def tip(axis, step):
        value = list(base.obstacles[0].tip)
        value[axis] += step
        return base.model_copy(update={"obstacles": (base.obstacles[0].model_copy(update={"tip": tuple(value)}),)})

    def slope(shifted):
        return (peak(shifted(h)) - peak(shifted(-h))) / (2 * h)

    for axis in (0, 1):
        assert found.tips[0, axis] == pytest.approx(slope(lambda s, a=axis: tip(a, s)), rel=1e-6, abs=1e-7)
        for field in ("start", "goal"):
            for part in ("position", "velocity"):
                value = getattr(found, f"{field}_{part}")[axis]
                difference = slope(lambda s, f=field, p=part, a=axis: moved(f, p, a, s))
                assert value == pytest.approx(difference, rel=1e-6, abs=1e-7), (field, part, axis)
    difference = (peak(base, at + h) - peak(base, at - h)) / (2 * h)
    assert found.obstacle_times[0] == pytest.approx(difference, rel=1e-6)
    difference = slope(lambda s: base.model_copy(update={"duration": base.duration + s}))
    assert found.duration == pytest.approx(difference, rel=1e-6)


def test_elementary_multipliers_prove_the_single_equations():
    mass = PointMass.of(wall_maneuver("touch"))
    from peakmin.proofs.bounds import lower_bound

    at = np.array([0.1])
    best = max(lower_bound(mass, at, multipliers) for multipliers in mass.elementary(at))
    assert best == pytest.approx(extremal(mass, at).upper, rel=1e-10)
