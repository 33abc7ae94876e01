"""Bounds against arithmetic of another kind: 40 digits, brute force, and controls that attain what is bounded.

Where a bound allows for rounding errors they are made visible here: with a ROUNDING of a hundredth it must be what the
worst errors of that size leave.
"""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from mpmath import mp

import peakmin as pm
from peakmin.geometry import window
from peakmin.proofs import bounds as least_over_times
from peakmin.proofs import bracket, saddle
from peakmin.proofs import double_integrator as moments
from peakmin.proofs import saddle as pushing
from peakmin.proofs.bounds import Leaf, Proof, box_bound, covers, global_bound, lower_bound, out_of_order
from peakmin.proofs.bracket import Answer, Bracket, HoldProblem, Verdict
from peakmin.proofs.double_integrator import PointMass, costate_at_kinks, hold_rows, responses
from peakmin.proofs.extremal import extremal
from tests.conftest import wall_maneuver
from tests.proofs.test_moments import exact_impulse
from tests.random_maneuvers import maneuver

MOVING = wall_maneuver(
    start=pm.State(position=(0, 0), velocity=(0.5, -1.5)),
    goal=pm.State(position=(1, 0.3), velocity=(-0.4, 0.7)),
    duration=1.3,
    obstacles=(pm.Wall(tip=(0.3, 0.4)), pm.Wall(tip=(0.6, -0.2), direction=(0.2, 1), contact="touch")),
)
SLITS = MOVING.model_copy(
    update={"obstacles": (pm.Wall(tip=(0.3, 0.4), opening=0.2), pm.Wall(tip=(0.6, 0.2), opening=0.1))}
)
TABLE = wall_maneuver(obstacles=(pm.Wall(tip=(0.3, 0.5)), pm.Wall(tip=(0.7, 0.5))))
SLALOM = wall_maneuver(
    obstacles=(pm.Wall(tip=(0.25, 0.3)), pm.Wall(tip=(0.5, -0.3), direction=(0, 1)), pm.Wall(tip=(0.75, 0.3)))
)
MIXED = MOVING.model_copy(update={"obstacles": (pm.Wall(tip=(0.3, 0.4), opening=0.2), pm.Wall(tip=(0.6, 0.2)))})
MASSES = [PointMass.of(problem) for problem in (MOVING, SLITS, TABLE, SLALOM, MIXED, *map(maneuver, range(7)))]


def past(mass, **changes):
    """The same maneuver past other windows."""
    return replace(mass, windows=replace(mass.windows, **changes))


def at_random(seed):
    """A maneuver, ordered obstacle times and multipliers, good ones in two of three cases."""
    rng, mass = np.random.default_rng(seed), MASSES[seed % len(MASSES)]
    times = np.sort(rng.uniform(0.05, 0.95, mass.walls))
    good = extremal(mass, times).multipliers
    return rng, mass, times, good if seed % 3 else rng.normal(size=good.shape)


def worst(mass, times, multipliers, rounding):
    """What errors of this relative size leave of <L, b> at times (q,), and of what size L is: (work, L, sum |L|)."""
    trial = multipliers / np.max(np.abs(multipliers))
    tips, free = mass.tips.copy(), mass.free.copy()
    for i in range(mass.walls):
        if np.isfinite(mass.width[i]) and free[i] @ trial[2 + i] < 0:  # the opening's other wall
            tips[i] += mass.width[i] * free[i]
            free[i] = -free[i]
        push = float(np.sum(free[i] * trial[2 + i]))
        if mass.clear[i] and push < 0:
            trial[2 + i] += (rounding * np.hypot(*trial[2 + i]) - push) * free[i]
    b = [mass.pf - mass.v0, mass.vf - mass.v0, *(tip - t * mass.v0 for tip, t in zip(tips, times, strict=True))]
    parts = [
        abs(mass.pf) + abs(mass.v0),
        abs(mass.vf) + abs(mass.v0),
        *(abs(tip) + t * abs(mass.v0) for tip, t in zip(tips, times, strict=True)),
    ]
    work = sum(float(one @ row) for one, row in zip(trial, b, strict=True))
    lost = sum(float(abs(one) @ (abs(row) + part)) for one, row, part in zip(trial, b, parts, strict=True))
    return work - rounding * lost, trial, float(np.sum(abs(trial)))


@pytest.fixture(params=[None, 1e-2], ids=["as it is", "coarse"])
def rounding(request, monkeypatch):
    if request.param is not None:
        for module in (bracket, least_over_times, saddle, pushing, moments, window):
            monkeypatch.setattr(module, "ROUNDING", request.param)
    return moments.ROUNDING


def hold_problem(mass, times, circle, steps=30):
    return HoldProblem(mass, circle, times, pm.Aligned(steps=steps).edges(times))


CIRCLES = [pm.Disc(), pm.Polygon(segments=2), pm.Polygon(segments=3, fit="circumscribed")]


@pytest.mark.parametrize("seed", range(12))
def test_the_lower_end_is_weak_duality_less_the_worst_rounding(seed, rounding):
    _, mass, times, multipliers = at_random(seed)
    circle = CIRCLES[seed % 3]
    hold = hold_problem(mass, times, circle)
    expected = 0.0
    for signed in (multipliers, -multipliers):
        work, trial, _ = worst(mass, times, signed, rounding)
        p = hold_rows(hold.edges, times).T @ trial
        directions = getattr(circle, "vertices", None)
        support = np.hypot(*p.T) if directions is None else np.max(p @ directions.T, axis=1)
        impulse = np.sum(support) + rounding * np.sum(np.abs(hold_rows(hold.edges, times)).T @ abs(trial))
        expected = max(expected, work / (impulse * (1 + rounding)))
    for one in (multipliers, -1e5 * multipliers):
        bound, own = hold.lower(one)
        assert bound == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert (bound > 0) == bool(np.any(own))
        if bound:
            assert np.max(np.abs(own)) == pytest.approx(1, rel=2 * rounding)
            assert hold.lower(own)[0] == pytest.approx(bound, rel=4 * rounding)
    found = hold.raise_lower(Bracket(), multipliers)
    assert found.lower == pytest.approx(expected, rel=1e-9, abs=1e-15)
    assert hold.raise_lower(found, multipliers) is found


@pytest.mark.parametrize("seed", range(12))
def test_no_control_is_below_the_lower_end_nor_misses_its_targets(seed):
    rng, mass, times, multipliers = at_random(seed)
    circle = CIRCLES[seed % 3]
    hold = hold_problem(mass, times, circle)
    lower = hold.lower(multipliers)[0]
    for size in (0, 0.1, 10):
        proposed = size * rng.normal(size=(30, 2))
        upper, control = hold.upper(proposed)
        assert lower <= upper == np.max(circle.gauge(control))
        reached = hold_rows(hold.edges, times) @ control
        b = mass.targets(times)
        np.testing.assert_allclose(reached[:2], b[:2], atol=1e-12)
        past = np.sum((reached - b)[2:] * mass.free, axis=1)
        across = (reached - b)[2:] - past[:, None] * mass.free
        np.testing.assert_allclose(across, 0, atol=1e-12)
        assert np.all(past >= -1e-12)
        assert np.all(past <= np.where(mass.clear, mass.width, 0) + 1e-12)


def test_landing_is_the_projection_onto_the_equations():
    """u - A'(A A')^-1 (A u - b), all walls touched; half of it only, what is left over would not be zero."""
    mass = PointMass.of(MOVING.model_copy(update={"obstacles": (MOVING.obstacles[1],)}))
    times, u = np.array([0.4]), np.random.default_rng(0).normal(size=(30, 2))
    hold = hold_problem(mass, times, pm.Disc())
    rows, b = hold.rows, mass.targets(times)
    expected = u - rows.T @ np.linalg.solve(rows @ rows.T, rows @ u - b)
    np.testing.assert_allclose(hold.land(u), expected, atol=1e-12)
    np.testing.assert_array_equal(hold.targets[0], b)
    np.testing.assert_array_equal(hold.targets[1], mass.target_errors(times))


def test_what_cannot_be_landed_has_no_upper_end():
    mass = PointMass.of(MOVING)
    few = HoldProblem(mass, pm.Disc(), np.array([0.3, 0.6]), np.array([0.0, 1.0]))
    assert few.land(np.zeros((1, 2))) is None
    assert few.upper(np.zeros((1, 2))) == (math.inf, None)
    hold = hold_problem(mass, np.array([0.3, 0.6]), pm.Disc())
    with np.errstate(all="ignore"):
        for value in (np.nan, np.inf, 1e308):
            assert hold.upper(np.full((30, 2), value)) == (math.inf, None)


def test_a_landing_may_miss_by_rounding_errors_only(monkeypatch):
    """Of four equations and three holds the least squares leave a residual: the limit on it decides."""
    mass = PointMass.of(MOVING)
    times = np.array([0.3, 0.6])
    few = HoldProblem(mass, pm.Disc(), times, np.array([0.0, 0.2, 0.5, 1.0]))
    assert few.land(np.zeros((3, 2))) is None
    monkeypatch.setattr(bracket, "LANDED", math.inf)
    landed = few.land(np.zeros((3, 2)))
    moments_ = few.rows @ landed
    miss = float(np.max(np.abs(mass.reached(times, moments_) - moments_)))
    monkeypatch.setattr(bracket, "LANDED", miss)
    assert few.land(np.zeros((3, 2))) is not None
    monkeypatch.setattr(bracket, "LANDED", miss * (1 - 1e-9))
    assert few.land(np.zeros((3, 2))) is None


def test_fitted_multipliers_have_the_costate():
    rng, mass, times, _ = at_random(0)
    hold = hold_problem(mass, times, pm.Disc())
    multipliers = rng.normal(size=(2 + mass.walls, 2))
    np.testing.assert_allclose(hold.fit(hold.rows.T @ multipliers), multipliers, atol=1e-11)


def test_multipliers_that_are_none_prove_nothing():
    _, mass, times, multipliers = at_random(1)
    hold = hold_problem(mass, times, pm.Disc())
    spoiled = multipliers.copy()
    spoiled[0, 0] = np.inf
    for one in (np.zeros_like(multipliers), np.full_like(multipliers, np.inf), spoiled):
        bound, own = hold.lower(one)
        assert bound == 0
        assert not np.any(own)
        assert own.shape == one.shape
    orthogonal = np.zeros_like(multipliers)
    orthogonal[0] = mass.targets(times)[0] @ np.array([[0, 1], [-1, 0]])
    assert hold.lower(orthogonal)[0] == 0
    assert lower_bound(mass, times, orthogonal) == 0


def test_the_scale_of_multipliers_does_not_matter():
    """Nor whether any of them is above zero."""
    mass = PointMass.of(wall_maneuver(goal=pm.State(position=(-1, -0.5)), obstacles=()))
    none = np.zeros(0)
    hold = hold_problem(mass, none, pm.Disc())
    multipliers = np.array([[-1.0, -0.5], [0.0, -1e-3]])
    bounds = [
        bound(multipliers) for bound in (lambda own: box_bound(mass, none, none, own), lambda own: hold.lower(own)[0])
    ]
    for scale in (1e-200, 1e200):
        assert box_bound(mass, none, none, scale * multipliers) == pytest.approx(bounds[0], rel=1e-12)
        assert hold.lower(scale * multipliers)[0] == pytest.approx(bounds[1], rel=1e-12)
        assert saddle.saddle(mass, none, none, none, scale * multipliers)[0] == pytest.approx(bounds[0], rel=1e-12)
    assert bounds[0] > 1
    assert not np.any(saddle.saddle(mass, none, none, none, 0 * multipliers)[0])


def test_least_squares_that_fail_propose_nothing(monkeypatch):
    def fail(*_, **__):
        raise np.linalg.LinAlgError

    _, mass, times, _ = at_random(0)
    hold = hold_problem(mass, times, pm.Disc())
    monkeypatch.setattr(np.linalg, "lstsq", fail)
    np.testing.assert_array_equal(hold.fit(np.ones((30, 2))), np.zeros((2 + mass.walls, 2)))
    assert hold.upper(np.ones((30, 2))) == (math.inf, None)


def test_an_end_moves_only_to_something_better():
    _, mass, times, multipliers = at_random(1)
    hold = hold_problem(mass, times, pm.Disc())
    control, costate_ = np.ones((30, 2)), hold.rows.T @ multipliers
    upper, lower = hold.upper(control)[0], hold.lower(multipliers)[0]
    both = hold.tighten(Bracket(), Answer(control, costate_))
    assert both.upper == upper
    assert both.lower == pytest.approx(lower, rel=1e-9)
    assert hold.tighten(both, Answer(control, costate_)) is both
    spoiled = control.copy()
    spoiled[3, 1] = np.inf
    for answer in (Answer(control, None), Answer(control, costate_ * np.nan)):
        assert hold.tighten(Bracket(), answer).upper == upper
        assert hold.tighten(Bracket(), answer).lower == 0
    for answer in (Answer(None, costate_), Answer(spoiled, costate_)):
        assert hold.tighten(Bracket(), answer).lower == both.lower
        assert hold.tighten(Bracket(), answer).upper == math.inf
    costate_[2, 0] = np.inf
    assert hold.tighten(Bracket(), Answer(None, costate_)).lower == 0
    better = Bracket(lower=both.upper, upper=both.lower)
    assert hold.tighten(better, Answer(control, hold.rows.T @ multipliers)) is better


def test_what_is_proved_before_a_solver_was_asked():
    coasting = PointMass.of(
        wall_maneuver(
            start=pm.State(position=(0, 0), velocity=(1, 0.5)),
            goal=pm.State(position=(1, 0.5), velocity=(1, 0.5)),
            obstacles=(pm.Wall(tip=(0.5, 0.2)),),
        )
    )
    begun = hold_problem(coasting, np.array([0.5]), pm.Disc()).begin()
    assert (begun.lower, begun.upper) == (0, 0)
    np.testing.assert_array_equal(begun.control, np.zeros((30, 2)))
    np.testing.assert_array_equal(begun.multipliers, np.zeros((3, 2)))
    beyond = coasting.windows.tips - [[0, 0.3]]  # which passes the tip by as much, and the far end by half of it
    assert past(coasting, tips=beyond).floor(np.array([0.5])) == 0
    assert past(coasting, tips=beyond, width=np.array([1.0])).floor(np.array([0.5])) == 0
    slit = past(coasting, tips=beyond, width=np.array([0.15]))
    assert slit.floor(np.array([0.5])) > 0
    begun = hold_problem(slit, np.array([0.5]), pm.Disc()).begin()
    assert begun.upper == math.inf
    mass = PointMass.of(TABLE)
    times = np.array([0.3, 0.7])
    hold = hold_problem(mass, times, pm.Disc())
    assert hold.begin().lower == max(hold.lower(one)[0] for one in mass.elementary(times)) > 0
    assert hold.begin().upper == math.inf


def test_gaps_and_verdicts_at_their_borders():
    assert Bracket(1.0, 4.0).gap == 0.75
    assert Bracket(3.0, 2.0).gap == 0
    assert Bracket(0.0, 0.0).gap == 0
    assert Bracket(3.0).gap == 1
    found = Bracket(lower=2.0, upper=3.0)
    assert [found.verdict(m) for m in (2.0, np.nextafter(2, 0), 3.0, np.nextafter(3, 0))] == [
        Verdict.UNKNOWN,
        Verdict.INFEASIBLE,
        Verdict.FEASIBLE,
        Verdict.UNKNOWN,
    ]


@pytest.mark.parametrize("seed", range(16))
def test_box_bounds_are_the_least_corner_less_the_worst_rounding(seed, rounding):
    rng, mass, times, multipliers = at_random(seed)
    q = mass.walls
    high = times.copy()
    high[: q - seed % 2] += 0.02 * rng.random(q - seed % 2)  # some with no width
    ratios = []
    for corner in itertools.product(*zip(times, high, strict=True)):
        work, trial, size = worst(mass, np.array(corner), multipliers, rounding)
        # what errors there may be is that of the latest times
        work -= rounding * sum((high[i] - corner[i]) * float(abs(trial[2 + i]) @ abs(mass.v0)) for i in range(q))
        bulge = sum(np.hypot(*trial[2 + i]) * (high[i] - times[i]) ** 2 for i in range(q)) / 8
        area = (float(exact_impulse(trial, corner)) + bulge) * (1 + rounding) + rounding * size
        ratios.append(work / area)
    bound = box_bound(mass, times, high, multipliers)
    assert bound == pytest.approx(max(min(ratios) * (1 - rounding), 0.0), rel=1e-9, abs=1e-15)
    assert box_bound(mass, times, high, 2.0**20 * multipliers) == pytest.approx(bound, rel=1e-9, abs=1e-15)
    if np.all(high == times):
        assert lower_bound(mass, times, multipliers) == bound


def test_a_bound_is_no_more_than_forty_digits_give():
    """And as close to it as a bound can be: its margins are a few rounding errors."""
    for seed in range(12):
        _, mass, times, multipliers = at_random(seed)
        mp.dps = 40
        _, trial, _ = worst(mass, times, multipliers, 0.0)
        facing = mass.facing(np.sum(mass.free * multipliers[2:], axis=1) < 0)
        b = [
            [mp.mpf(float(x)) - mp.mpf(float(y)) * t for x, y in zip(a, mass.v0, strict=True)]
            for a, t in [
                (mass.pf, 1),
                (mass.vf, 1),
                *((p, mp.mpf(float(t))) for p, t in zip(facing.tips, times, strict=True)),
            ]
        ]
        work = sum(
            mp.mpf(float(x)) * y for one, row in zip(trial, b, strict=True) for x, y in zip(one, row, strict=True)
        )
        exact = work / exact_impulse(trial, times)
        bound = lower_bound(mass, times, multipliers)
        assert bound <= max(exact, 0)
        assert bound >= exact * (1 - 1e-8)


def test_a_box_that_is_half_proved_is_not():
    """The wall's tip lies ahead of the start's velocity for late times, behind it for early ones."""
    mass = PointMass.of(MOVING)
    multipliers = np.zeros((4, 2))
    multipliers[3] = -mass.v0
    early, late = np.array([0.02, 0.05]), np.array([0.02, 0.6])
    assert lower_bound(mass, early, multipliers) == 0
    assert lower_bound(mass, late, multipliers) > 0
    assert box_bound(mass, early, late, multipliers) == 0


def test_numbers_too_large_prove_nothing():
    mass = PointMass.of(TABLE)
    times = np.array([0.3, 0.7])
    with np.errstate(all="ignore"):
        for value in (np.nan, np.inf):
            assert box_bound(mass, times, times, np.full((4, 2), value)) == 0


@pytest.mark.parametrize("seed", range(10))
def test_box_bounds_hold_in_the_box(seed):
    rng, mass, times, multipliers = at_random(seed)
    low, high = np.maximum(times - 0.1 * rng.random(), 0), np.minimum(times + 0.1 * rng.random(), 1)
    at = extremal(mass, times).multipliers if seed % 2 else multipliers
    bounds = box_bound(mass, low, high, at), Leaf(tuple(low), tuple(high), at, tuple(times)).bound(mass)
    assert bounds[1] == max(bounds[0], saddle.saddle(mass, low, high, times, at)[0])
    for _ in range(4):
        inside = np.sort(low + rng.random(mass.walls) * (high - low))
        if np.all((low <= inside) & (inside <= high)):
            assert max(bounds) <= extremal(mass, inside).upper * (1 + 1e-12)


def test_which_boxes_are_out_of_order():
    """Whether T_1 < ... < T_q has room in a box, against all thirds of a coarse grid."""
    inner = [k + s for k in range(4) for s in (0.2, 0.5, 0.8)]
    for low in itertools.product(range(4), repeat=2):
        for high in itertools.product(range(1, 5), repeat=2):
            if all(a < b for a, b in zip(low, high, strict=True)):
                room = any(
                    s < t and low[0] < s < high[0] and low[1] < t < high[1] for s, t in itertools.product(inner, inner)
                )
                assert out_of_order(low, high) != room
    assert out_of_order((0, 3, 1), (1, 4, 3))
    assert not out_of_order((0, 3, 1), (1, 4, 3.5))
    assert out_of_order((1,), (1,))  # what has no width has no room


def _cut(rng, low, high, depth):
    """Boxes that fill a box, by halving it at random."""
    axis = int(rng.integers(len(low)))
    if depth == 0 or high[axis] - low[axis] < 2:
        return [(low, high)]
    at = int(rng.integers(low[axis] + 1, high[axis]))
    left, right = [*high], [*low]
    left[axis] = right[axis] = at
    return _cut(rng, low, tuple(left), depth - 1) + _cut(rng, tuple(right), high, depth - 1)


@pytest.mark.parametrize("seed", range(40))
def test_covers_are_found_and_gaps_in_them_too(seed):
    """Against points of every cell, in every order."""
    rng = np.random.default_rng(seed)
    q = seed % 3 + 1
    boxes = _cut(rng, (0,) * q, (8,) * q, 5)
    rng.shuffle(boxes)
    inner = [k + s for k in range(8) for s in (0.2, 0.5, 0.8)]
    points = np.array(
        [t for t in itertools.product(inner, repeat=q) if all(a < b for a, b in zip(t, t[1:], strict=False))]
    )

    def covered(parts):
        leaves = [Leaf(tuple(low), tuple(high), np.zeros((2 + q, 2)), tuple(low)) for low, high in parts]
        return covers(leaves, [0] * q, [8] * q)

    def sampled(parts):
        met = [np.all((np.array(low) < points) & (points < np.array(high)), axis=1) for low, high in parts]
        return bool(np.all(np.any(met, axis=0))) if met else False

    assert covered(boxes)
    for k in rng.permutation(len(boxes))[:5].tolist():
        low, high = boxes[k]
        axis = int(rng.integers(q))
        less = (low, tuple(b - 0.9 if i == axis else b for i, b in enumerate(high)))
        others = boxes[:k] + boxes[k + 1 :]
        for rest in (others, [*others, less]):
            assert covered(rest) == sampled(rest)
        wider = [(low, tuple(min(b + int(rng.integers(0, 3)), 8) for b in high)) for low, high in others]
        assert sampled(wider) or not covered(wider)  # where boxes overlap a cover may not be seen as one


def test_boxes_beside_each_other_do_not_cover_each_other():
    def leaf(low, high):
        return Leaf(low, high, np.zeros((4, 2)), low)

    # five boxes around a pinwheel, one of them missing: no straight cut meets none of them
    wheel = [leaf((0, 4), (1, 6)), leaf((1, 5), (3, 6)), leaf((2, 3), (3, 5)), leaf((0, 3), (2, 4))]
    assert not covers(wheel, [0, 3], [3, 6])
    # a box that only meets the edge of what is asked, or stops at it
    assert not covers([leaf((0, 0), (1, 8))], [1, 2], [2, 8])
    assert not covers([leaf((2, 0), (8, 8))], [1, 2], [2, 8])
    assert covers([leaf((1, 0), (2, 8))], [1, 2], [2, 8])
    assert covers([], [3, 1], [4, 2])
    assert not covers([], [1, 1], [2, 2])


def test_the_bound_of_all_boxes_is_the_least_and_none_without_a_cover():
    mass = PointMass.of(wall_maneuver())
    good = extremal(mass, np.array([0.5])).multipliers
    left, right = Leaf((0.0,), (0.6,), good, (0.5,)), Leaf((0.6,), (1.0,), good, (0.5,))
    assert right.bound(mass) > left.bound(mass) > 0
    assert global_bound(mass, [left, right]) == left.bound(mass)
    assert global_bound(mass, [right]) == global_bound(mass, [left]) == global_bound(mass, []) == 0
    times = np.array([0.4])
    bounds = [lower_bound(mass, times, one.multipliers) for one in (left, Leaf((0.0,), (0.5,), -good, (0.5,)))]
    assert bounds[0] > bounds[1]
    assert Proof("all", (left, right)).bound(mass, times) == left.bound(mass)
    assert Proof("all", (left,)).bound(mass, times) == 0
    assert Proof("these", (Leaf((0.4,), (0.4,), -good, (0.4,)), left)).bound(mass, times) == bounds[0]
    assert Proof("these", ()).bound(mass, times) == 0
    without = PointMass.of(wall_maneuver(obstacles=()))
    assert global_bound(without, [Leaf((), (), np.array([[1.0, 0], [-0.5, 0]]), ())]) == pytest.approx(4, rel=1e-12)


# ---- saddle bounds


def kinked(mass, p, times):
    """The multipliers whose costate has the values p, (q+2, 2), at the kinks of these times."""
    kinks = np.concatenate([[0.0], times, [1.0]])
    return np.linalg.solve(responses(kinks, times).T, p)


@pytest.mark.parametrize("mass", MASSES[2:4], ids=["table", "slalom"])
def test_where_walls_push_one_box_proves_the_least_of_all_times(mass):
    from peakmin.proofs.branch_and_bound import least_over_times as search

    found = search(mass, 1e-6)
    q = mass.walls
    at, multipliers = np.array(found.leaves[0].at), found.leaves[0].multipliers
    bound, place = saddle.saddle(mass, np.zeros(q), np.ones(q), at, multipliers)
    assert found.best.upper * (1 - 1e-7) <= bound <= found.best.upper
    np.testing.assert_allclose(place, at, atol=1e-3)


@pytest.mark.parametrize("seed", range(24))
def test_saddle_bounds_at_one_instant_are_those_of_the_multipliers(seed):
    _, mass, times, _ = at_random(seed)
    good = extremal(mass, times).multipliers
    bound, place = saddle.saddle(mass, times, times, times, good)
    exact = lower_bound(mass, times, good)
    assert bound <= extremal(mass, times).upper * (1 + 1e-12)
    np.testing.assert_array_equal(place, times)
    if all(mass is not moved for moved in (MASSES[2], MASSES[4])):  # there values of p are moved, see below
        assert bound == pytest.approx(exact, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_saddle_bounds_hold_at_every_time_and_lose_little(seed):
    """Against the ratio itself with the kinks moved, at times all over the box."""
    rng, mass, times, _ = at_random(seed)
    q = mass.walls
    good = extremal(mass, times).multipliers
    low, high = np.maximum(times - 0.2 * rng.random(q), 0), np.minimum(times + 0.2 * rng.random(q), 1)
    bound, place = saddle.saddle(mass, low, high, times, good)
    assert np.all((low <= place) & (place <= high))
    for _ in range(4):
        inside = np.sort(low + rng.random(q) * (high - low))
        if np.all((low <= inside) & (inside <= high) & (np.diff(inside, prepend=0) > 1e-3)):
            assert bound <= extremal(mass, inside).upper * (1 + 1e-9)


def test_ordered_vertices():
    low, high = np.array([0.0, 0.25]), np.array([0.5, 0.75])
    points = saddle.vertices(low, high)
    assert {tuple(p) for p in points} >= {(0.0, 0.25), (0.0, 0.75), (0.5, 0.5), (0.5, 0.75), (0.25, 0.25)}
    assert all(0 <= a <= 0.5 and 0.25 <= b <= 0.75 and a <= b for a, b in points)
    three = saddle.vertices(np.array([0.0, 0.2, 0.1]), np.array([0.5, 0.6, 0.7]))
    assert np.all(np.diff(three, axis=1) >= 0)
    assert len(saddle.vertices(np.zeros(9), np.arange(1, 10) / 9)) == 0
    np.testing.assert_allclose(saddle.segments(np.array([[0.2, 0.7]])), [[0.2, 0.5, 0.3]])


# ---- what they are made of


@pytest.mark.parametrize("seed", range(12))
def test_parts_of_the_dual(seed, rounding):
    rng, mass, times, _ = at_random(seed)
    multipliers = rng.normal(size=(2 + mass.walls, 2))
    facing = mass.facing_for(multipliers)
    for i in range(mass.walls):
        far = np.isfinite(mass.width[i]) and mass.free[i] @ multipliers[2 + i] < 0
        np.testing.assert_allclose(
            facing.tips[i], mass.tips[i] + (mass.width[i] * mass.free[i] if far else 0), rtol=1e-15
        )
        np.testing.assert_array_equal(facing.free[i], -mass.free[i] if far else mass.free[i])
    assert np.all(np.isinf(facing.width))
    assert facing.width.shape == (mass.walls,)
    _, trial, _ = worst(mass, times, multipliers, rounding)
    np.testing.assert_allclose(facing.admissible(multipliers), trial * np.max(np.abs(multipliers)), atol=1e-14)
    b, parts = mass.targets(times), mass.target_errors(times)
    with_errors = [abs(mass.pf) + abs(mass.v0), abs(mass.vf) + abs(mass.v0)]
    with_errors += [abs(tip) + t * abs(mass.v0) for tip, t in zip(mass.tips, times, strict=True)]
    np.testing.assert_allclose(parts, rounding * np.array(with_errors), rtol=1e-14)
    coasting = np.array(
        [mass.pf - mass.v0, mass.vf - mass.v0, *(p - t * mass.v0 for p, t in zip(mass.tips, times, strict=True))]
    )
    np.testing.assert_allclose(b, coasting, atol=1e-15)
    later = mass.targets(times, np.array([1.0, 2.0]))
    np.testing.assert_allclose(later[1][0], mass.pf - 2 * mass.v0, atol=1e-15)
    np.testing.assert_allclose(later[0], b, atol=1e-15)


def test_targets_beyond_clear_walls_and_within_openings():
    mass = PointMass.of(SLITS)
    times = np.array([0.3, 0.6])
    b = mass.targets(times)
    for past, kept in ((-0.1, 0.0), (0.02, 0.02), (5.0, None)):
        wanted = b.copy()
        wanted[2:] += past * mass.free + 0.3 * mass.free[:, ::-1] * [1, -1]
        reached = mass.reached(times, wanted)
        for i in range(2):
            expected = mass.width[i] if kept is None else kept
            np.testing.assert_allclose(reached[2 + i], b[2 + i] + expected * mass.free[i], atol=1e-14)
    touch = PointMass.of(MOVING)
    wanted = touch.targets(times) + 1
    np.testing.assert_allclose(touch.reached(times, wanted)[3], touch.targets(times)[3], atol=1e-15)
    only = mass.only(np.array([False, True]))
    np.testing.assert_array_equal(only.tips, mass.tips[1:])
    assert only.walls == 1


def test_costates_before_the_end_of_the_maneuver():
    rng = np.random.default_rng(0)
    multipliers = rng.normal(size=(4, 2))
    kinks, p = costate_at_kinks(multipliers, np.array([0.4, 0.7]), 0.6)
    np.testing.assert_allclose(kinks, [0, 0.4, 0.6, 0.6])
    for t, value in zip(kinks, p, strict=True):
        g = np.array([0.6 - t, 1, max(0.4 - t, 0), max(0.7 - t, 0)])
        np.testing.assert_allclose(value, g @ multipliers, atol=1e-15)


@pytest.mark.parametrize("seed", range(12))
def test_saddle_bounds_leave_the_worst_rounding(seed, rounding):
    """Of walls that are touched, where no value of p is moved, in a box without width."""
    rng, mass, times, _ = at_random(seed)
    q = mass.walls
    mass = past(mass, clear=np.zeros(q, dtype=bool), width=np.full(q, np.inf))
    good = extremal(mass, times).multipliers if seed % 3 else rng.normal(size=(2 + q, 2))
    trial = good / np.max(np.abs(good))
    p, h = costate_at_kinks(trial, times)[1], np.diff([0.0, *times, 1.0])
    r = np.array([(0, 0), *mass.tips, mass.pf])
    sums = [(abs(p[j]) + abs(p[j + 1])) @ (abs(r[j]) + abs(r[j + 1])) for j in range(q + 1)]
    a = np.array([-(p[j + 1] - p[j]) @ (r[j + 1] - r[j]) for j in range(q + 1)]) - rounding * np.array(sums)
    ends = p[-1] @ mass.vf, -p[0] @ mass.v0
    c = sum(ends) - rounding * (abs(p[-1]) @ abs(mass.vf) + abs(p[0]) @ abs(mass.v0))
    mean = [float(exact_impulse(np.array([p[j] - p[j + 1], p[j + 1]]), [])) for j in range(q + 1)]
    level = c + sum(2 * x / y for x, y in zip(a, h, strict=True) if x < 0)
    height = level + sum(2 * x / y for x, y in zip(a, h, strict=True) if x >= 0)
    work = c + np.sum(a / h) - rounding * (abs(c) + abs(level) + abs(height) + np.sum(abs(a) / h))
    area = (h @ mean) * (1 + rounding) + rounding * max(mean)
    bound = saddle.saddle(mass, times, times, times, good)[0]
    assert bound == pytest.approx(max(work / area * (1 - rounding), 0), rel=1e-9, abs=1e-13)


def pushed(mass, p, flat, h, margin=0):
    """f . (P_{j+1} - P_j) h_j >= f . (P_j - P_{j-1}) h_{j+1} in fractions at every clear wall, zero on flat segments."""
    for j in np.flatnonzero(mass.clear):
        step = [
            Fraction(0) if flat[j + k] else sum(
                Fraction(float(f)) * (Fraction(float(b)) - Fraction(float(a)))
                for f, a, b in zip(mass.free[j], p[j + k], p[j + k + 1], strict=True)
            )
            for k in (0, 1)
        ]  # fmt: skip
        for one in h:
            left, right = step[1] * Fraction(float(one[j])), step[0] * Fraction(float(one[j + 1]))
            if left - right < Fraction(margin * float(one[j] + one[j + 1])):
                return False
    return True


def walls_and_values(seed):
    """Random walls, some alike, some touched; values about level along the first direction; the h of a box."""
    rng = np.random.default_rng(seed)
    q = seed % 4 + 1
    mass = past(
        MASSES[0],
        tips=rng.normal(size=(q, 2)),
        free=np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [1.0, 0.0]])[rng.permutation(4)[:q]],
        clear=rng.random(q) < 0.8,
        width=np.full(q, np.inf),
    )
    p = rng.normal(size=(q + 2, 2)) * [1.0, rng.choice([1.0, 1e-8, 1e-14])]
    low, high = np.sort(rng.uniform(0, 1, (2, q)), axis=0)
    low, high = np.minimum.accumulate(low[::-1])[::-1], np.maximum.accumulate(high)
    return rng, mass, p, saddle.segments(saddle.vertices(low, high))


@pytest.mark.parametrize("seed", range(40))
def test_values_are_moved_until_every_clear_wall_pushes(seed):
    """None is moved along a wall's line or where all is well."""
    _, mass, p, h = walls_and_values(seed)
    found, flat = pushing.pushing(mass, p, h)
    if not pushing.pushes(mass, found, flat, h):
        return
    assert pushed(mass, found, flat, h)
    none = np.zeros_like(flat)
    if pushed(mass, p, none, h, 1e-12):
        np.testing.assert_allclose(found, p, atol=2e-6)


@pytest.mark.parametrize("seed", range(40))
def test_whether_every_clear_wall_pushes_is_checked(seed, monkeypatch):
    """With coarse rounding, values in line are bent until the exact margin is that of the worst errors, and further."""
    monkeypatch.setattr(pushing, "ROUNDING", 1e-2)
    rng, mass, _, h = walls_and_values(seed)
    q = mass.walls
    line = rng.normal(size=2) + np.arange(q + 2)[:, None] * rng.normal(size=2) * rng.choice([0, 0.01, 1])
    line *= rng.choice([1e-3, 30])
    # all kinks bent into the walls, or the last segment alone, or some the other way
    bend = {
        0: np.arange(q + 2)[:, None] ** 2 * np.ones(2),
        1: np.eye(q + 2)[-1][:, None] * np.ones(2),
        2: rng.normal(size=(q + 2, 2)),
    }[seed // 4 % 3]
    none = np.zeros(q + 1, dtype=bool)
    if not np.any(mass.clear):
        assert pushing.pushes(mass, line + bend, none, h)
        return

    def margin(p):
        step = np.diff(p, axis=0)
        return min(
            ((step[j + 1] @ mass.free[j]) * one[j] - (step[j] @ mass.free[j]) * one[j + 1]) / (one[j] + one[j + 1])
            for j in np.flatnonzero(mass.clear)
            for one in h
            if one[j] + one[j + 1] > 0
        )

    even = h[:1] * 0 + 1 / (q + 1)
    h = even if seed % 2 else h  # at even times what is in line has no margin of its own
    amounts = np.geomspace(1e-6, 1e4, 300)
    found = [pushing.pushes(mass, line + t * bend, none, h) for t in amounts]
    expected = [margin(line + t * bend) - 1e-2 * np.max(np.abs(line + t * bend)) for t in amounts]
    for yes, left, t in zip(found, expected, amounts, strict=True):
        if abs(left) > 1e-9 * np.max(np.abs(line + t * bend)):
            assert yes == (left > 0)


ALIKE = past(
    MASSES[0],
    tips=np.zeros((3, 2)),
    free=np.array([[0.6, 0.8]] * 3),
    clear=np.ones(3, dtype=bool),
    width=np.full(3, np.inf),
)


@pytest.mark.parametrize("f", [(0.6, 0.8), (-0.6, -0.8), (0.6, -0.8)])
@pytest.mark.parametrize("level", [0.3, -0.3])
def test_where_values_are_said_to_stand_still_they_do(level, f):
    """Three walls alike; along their free direction p falls to a level, stands still, and rises."""
    alike = past(ALIKE, free=np.array([f] * 3))
    f, across = np.array(f), np.array([-f[1], f[0]])
    h = np.array([[0.25, 0.25, 0.25, 0.25], [0.1, 0.2, 0.3, 0.4]])
    flat = np.array([False, True, True, False])
    p = np.array([1.0, 0, 0, 0, 1.0])[:, None] * f + level * f + np.array([0.3, -2, 5, 1, 1])[:, None] * across
    assert pushing.pushes(alike, p, flat, h)
    for k in (1, 2, 3):
        for by in (1e-12, -1e-12):
            moved = p.copy()
            moved[k] += by * f
            assert not pushing.pushes(alike, moved, flat, h)
        moved = p.copy()
        moved[k] += 0.1 * across  # along the walls' line it may move
        assert pushing.pushes(alike, moved, flat, h)
    creeping = p + np.array([0, 0, 6e-15, 12e-15, 12e-15])[:, None] * f  # each step a rounding error, both not
    assert not pushing.pushes(alike, creeping, flat, h)
    bare = p - np.array([0.3, -2, 5, 1, 1])[:, None] * across
    rounded = bare + np.array([0, 0, 1e-16, 2e-16, 2e-16])[:, None] * f
    assert pushing.pushes(alike, bare, flat, h)
    assert pushing.pushes(alike, rounded, flat, h)
    for wrong in ([True, True, True, False], [False, True, True, True], [True] * 4):
        assert not pushing.pushes(alike, p, np.array(wrong), h)
    for other in (f[::-1], f * [1, -1]):
        turned = past(alike, free=np.array([f, f, other]))
        away = np.array([-other[1], other[0]]) * -np.sign(f @ [-other[1], other[0]])
        fallen = bare.copy()
        fallen[3:] = bare[2] + away  # not moved along the last wall's direction, against that of the one before
        fallen[4] += 3 * other
        assert not pushing.pushes(turned, fallen, flat, h)
    first = np.array([False, True, False, False])
    risen = p + np.array([0, 0, 0, 0.1, 1])[:, None] * f
    assert pushing.pushes(alike, risen, first, h)
    assert not pushing.pushes(past(alike, clear=np.array([False, True, True])), risen, first, h)
    for touched in range(3):
        clear = np.arange(3) != touched
        assert not pushing.pushes(past(alike, clear=clear), p, flat, h)
    sinking = p - np.array([2.0, 0, 0, 0, 0])[:, None] * f
    assert not pushing.pushes(alike, sinking, flat, h)
    sinking = p - np.array([0, 0, 0, 0, 2.0])[:, None] * f
    assert not pushing.pushes(alike, sinking, flat, h)


@pytest.mark.parametrize("seed", range(40))
def test_saddle_bounds_are_below_the_ratio_all_over_the_box(seed):
    """Whatever bends the way of a hill or of a bowl: N(T) / sum m h at times everywhere in the box, walls touched."""
    rng, mass, _, _ = at_random(seed)
    q = mass.walls
    mass = past(mass, clear=np.zeros(q, dtype=bool), width=np.full(q, np.inf))
    at = np.sort(rng.uniform(0.1, 0.9, q))
    good = extremal(mass, at).multipliers + rng.choice([0, 0.1, 1]) * rng.normal(size=(2 + q, 2))
    wide = rng.choice([0.02, 0.1])
    low, high = np.maximum(at - wide, 0 if seed % 4 else at), np.minimum(at + wide, 1)
    if not seed % 4:
        low[0] = 0
    p = costate_at_kinks(good, at)[1]
    r = np.vstack([np.zeros(2), mass.tips, mass.pf])
    mean = [float(exact_impulse(np.array([p[j] - p[j + 1], p[j + 1]]), [])) for j in range(q + 1)]
    bound, _ = saddle.saddle(mass, low, high, at, good)
    for k in range(400):
        inside = low + (rng.integers(2, size=q) if k % 2 else rng.random(q)) * (high - low)
        h = np.diff(np.concatenate([[0.0], inside, [1.0]]))
        if np.all(h > 0):
            work = (
                p[-1] @ mass.vf - p[0] @ mass.v0 - np.sum(np.sum(np.diff(p, axis=0) * np.diff(r, axis=0), axis=1) / h)
            )
            assert bound <= max(work / (h @ mean), 0) * (1 + 1e-9)


def test_a_concave_part_next_to_the_start_proves_nothing():
    """-1/h has no lower bound where a wall may be met at once."""
    rng = np.random.default_rng(3)
    mass = PointMass.of(wall_maneuver(obstacles=(pm.Wall(tip=(0.5, 0.5), contact="touch"),)))
    low, high, at = np.array([0.0]), np.array([0.3]), np.array([0.2])
    seen = 0
    while seen < 20:
        multipliers = rng.normal(size=(3, 2))
        p = costate_at_kinks(multipliers, at)[1]
        if (p[1] - p[0]) @ mass.tips[0] > 0.1 and saddle.saddle(mass, at, at, at, multipliers)[0] > 0.1:
            assert saddle.saddle(mass, low, high, at, multipliers)[0] == 0
            seen += 1


def test_values_that_do_not_push_prove_nothing(monkeypatch):
    """Over a wall that is far below nothing has to be done; multipliers that would pull down to its tip say else."""
    level = wall_maneuver(
        start=pm.State(position=(0, 0.5)), goal=pm.State(position=(1, 0.5)), obstacles=(pm.Wall(tip=(0.5, -5)),)
    )
    mass, at = PointMass.of(level), np.array([0.5])
    pull = extremal(past(mass, clear=np.zeros(1, dtype=bool)), at)
    p = costate_at_kinks(pull.multipliers, at)[1]
    monkeypatch.setattr(saddle, "pushing", lambda mass, _, h: (p, np.zeros(2, bool)))
    assert saddle.saddle(mass, at, at, at, np.abs(pull.multipliers))[0] == 0
    monkeypatch.setattr(saddle, "pushes", lambda *_: True)
    assert saddle.saddle(mass, at, at, at, np.abs(pull.multipliers))[0] == pytest.approx(pull.lower, rel=1e-6)


def test_too_many_walls_at_once_prove_nothing():
    """Of boxes with more vertices than are looked at."""
    q = 9
    mass = past(
        MASSES[0],
        tips=np.zeros((q, 2)),
        free=np.tile([0.0, 1.0], (q, 1)),
        clear=np.zeros(q, dtype=bool),
        width=np.full(q, np.inf),
    )
    at, multipliers = np.arange(1, q + 1) / (q + 1), np.ones((2 + q, 2))
    assert saddle.saddle(mass, np.zeros(q), np.arange(1, q + 1) / q, at, multipliers)[0] == 0


@pytest.mark.parametrize("tiny", [1e-152, 3e-162, 1e-300])
def test_values_that_nearly_vanish_are_taken_in_their_own_unit(tiny):
    """Multipliers that nearly cancel at kinks next to the start: P of any size is as good as another."""
    mass = PointMass.of(wall_maneuver())
    best = extremal(mass, np.array([0.5]))
    p = tiny * costate_at_kinks(best.multipliers, np.array([0.5]))[1]  # the best values, at kinks 0, tiny, 1
    multipliers = np.array([-(p[2] - p[1]), p[2], (p[2] - p[1]) - (p[1] - p[0]) / tiny])
    bound = saddle.saddle(mass, np.zeros(1), np.ones(1), np.array([tiny]), multipliers)[0]
    assert bound <= best.upper
    assert bound == pytest.approx(best.upper, rel=1e-6)
