"""The proofs know no dimension: problems of the plane, put into space and turned there, have the same answers."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from peakmin.geometry.integrals import all_derivatives, mean_direction, mean_norm
from peakmin.geometry.window import Windows
from peakmin.proofs.bounds import Leaf, box_bound, global_bound, lower_bound, lower_bounds
from peakmin.proofs.branch_and_bound import least_over_times
from peakmin.proofs.descent import descend, unhindered
from peakmin.proofs.double_integrator import PointMass, costate_at_kinks, impulse
from peakmin.proofs.extremal import ascend, extremal, extremals
from peakmin.proofs.nodal import Nodal
from peakmin.proofs.saddle import saddle
from peakmin.proofs.sensitivity import optimal
from tests.conftest import ALL

SEEDS = range(48)
SAME = 1e-9


@dataclass(frozen=True)
class Both:
    """One problem in the plane and in space, and how vectors of the plane are turned into space, (2, 3)."""

    plane: PointMass
    space: PointMass
    turn: np.ndarray
    times: np.ndarray
    rng: np.random.Generator

    def same(self, plane, space, scale=None):
        """Whether vectors (..., 2) are those in space (..., 3), relative to the largest or to a scale."""
        assert np.shape(space) == (*np.shape(plane)[:-1], 3)
        largest = np.max(np.abs(plane), initial=0.0) if scale is None else scale
        np.testing.assert_allclose(space, plane @ self.turn, rtol=0, atol=SAME * largest)


def both(seed):
    """Of 0 to 3 walls to be touched, passed or passed within an opening, ends at rest or not, any units."""
    rng = np.random.default_rng(seed)
    q = seed % 4
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    p0, pf = rng.normal(size=(2, 2))
    v0, vf = rng.normal(size=(2, 2)) * (rng.random((2, 1)) < 0.7)
    tips, free = rng.normal(size=(2, q, 2))
    clear = rng.random(q) < 0.7
    width = np.where(clear & (rng.random(q) < 0.4), rng.uniform(0.1, 0.8, q), np.inf)
    shift, duration = rng.normal(size=3), 10.0 ** rng.uniform(-1, 1)
    plane = PointMass.between(p0, v0, pf, vf, duration, Windows(tips, free, clear, width))
    space = PointMass.between(
        p0 @ turn + shift,
        v0 @ turn,
        pf @ turn + shift,
        vf @ turn,
        duration,
        Windows(tips @ turn + shift, free @ turn, clear, width),
    )
    return Both(plane, space, turn, (np.arange(q) + rng.uniform(0.2, 0.8, q)) / q if q else np.zeros(0), rng)


@pytest.fixture(params=SEEDS)
def pair(request):
    return both(request.param)


def close(plane, space):
    np.testing.assert_allclose(space, plane, rtol=SAME, atol=1e-12)


def test_integrals_of_pieces():
    for seed in range(8):
        pair = both(seed)
        first, last = pair.rng.normal(size=(2, 200, 2))
        last[:50] = first[:50] * (1 + 0.01 * pair.rng.normal(size=(50, 1)))  # nearly constant
        last[50:70] = -first[50:70] * pair.rng.random((20, 1))  # through zero
        last[70:75], first[190:195], last[195:] = first[70:75], 0, 0
        there = first @ pair.turn, last @ pair.turn
        np.testing.assert_allclose(mean_norm(*there), mean_norm(first, last), rtol=1e-12)
        for plane, space in zip(mean_direction(first, last), mean_direction(*there), strict=True):
            pair.same(plane, space)
        plane, space = all_derivatives(first, last), all_derivatives(*there)
        assert (plane.shape, space.shape) == ((200, 14), (200, 25))
        close(plane[:, 0], space[:, 0])
        for k in (0, 1):
            pair.same(plane[:, 1 + 2 * k : 3 + 2 * k], space[:, 1 + 3 * k : 4 + 3 * k])
        for k in range(3):  # the curvature of |p| within the plane
            curved, wanted = np.zeros((190, 3, 3)), plane[:190, 5 + 3 * k : 8 + 3 * k]  # at zero itself it has none
            curved[:, *np.triu_indices(3)] = space[:190, 7 + 6 * k : 13 + 6 * k]
            curved = curved + np.swapaxes(np.triu(curved, 1), 1, 2)
            within = (pair.turn @ curved @ pair.turn.T)[:, *np.triu_indices(2)]
            scale = np.max(np.abs(wanted), axis=1, keepdims=True)
            np.testing.assert_allclose(within / scale, wanted / scale, atol=SAME)


def test_equations(pair):
    plane, space, times = pair.plane, pair.space, pair.times
    assert (plane.walls, len(space.v0)) == (space.walls, 3)
    close([plane.length, plane.time, plane.unit], [space.length, space.time, space.unit])
    close(plane.width, space.width)
    multipliers = pair.rng.normal(size=(2 + plane.walls, 2))
    there = multipliers @ pair.turn
    pair.same(plane.targets(times), space.targets(times))
    assert space.target_errors(times).shape == space.targets(times).shape
    assert np.all(np.abs(plane.targets(times) @ pair.turn - space.targets(times)) <= 1e-14 + space.target_errors(times))
    pair.same(plane.admissible(multipliers), space.admissible(there))
    pair.same(plane.facing_for(multipliers).tips, space.facing_for(there).tips)
    pair.same(plane.facing_for(multipliers).free, space.facing_for(there).free)
    pair.same(plane.reached(times, multipliers), space.reached(times, there))
    close(plane.windows.least(multipliers[2:]), space.windows.least(there[2:]))
    close(plane.floor(times), space.floor(times))
    for one, other in zip(plane.elementary(times), space.elementary(times), strict=True):
        pair.same(one, other)
    close(impulse(multipliers, times), impulse(there, times))
    (kinks, p), (others, values) = costate_at_kinks(multipliers, times), costate_at_kinks(there, times)
    np.testing.assert_array_equal(kinks, others)
    pair.same(p, values)


def test_bounds(pair):
    plane, space, times, rng = pair.plane, pair.space, pair.times, pair.rng
    low, high = times - 0.08 * rng.random(len(times)), times + 0.08 * rng.random(len(times))
    at, proved = rng.uniform(low, high), 0
    for multipliers in (extremal(plane, times).multipliers, rng.normal(size=(2 + len(times), 2))):
        there = multipliers @ pair.turn
        close(lower_bound(plane, times, multipliers), lower_bound(space, times, there))
        close(box_bound(plane, low, high, multipliers), box_bound(space, low, high, there))
        found, other = saddle(plane, low, high, at, multipliers), saddle(space, low, high, at, there)
        close(found[0], other[0])
        np.testing.assert_allclose(other[1], found[1], atol=1e-6)
        proved += found[0] > 0
    assert proved


def test_nodal_form(pair):
    kinks = np.concatenate([[0.0], pair.times, [1.0]])
    plane, space = Nodal(pair.plane.facing(pair.plane.clear), kinks), Nodal(pair.space.facing(pair.plane.clear), kinks)
    n = len(kinks)
    p = pair.rng.normal(size=(n, 2))
    there = p @ pair.turn
    beyond = pair.rng.random(n - 2)
    pair.same(plane.forces(beyond), space.forces(beyond))
    pair.same(plane.multipliers(p), space.multipliers(there))
    (size, gradient), (same, slope) = plane.derivatives(p), space.derivatives(there)
    close(size, same)
    pair.same(gradient, slope)
    *_, hessian = plane.kernel(plane.h[None], p.reshape(1, -1))
    *_, curved = space.kernel(space.h[None], there.reshape(1, -1))
    turned = np.kron(np.eye(n), pair.turn)
    np.testing.assert_allclose(turned @ curved[0] @ turned.T, hessian[0], atol=1e-9 * np.max(np.abs(hessian)))
    none = np.zeros(n, dtype=bool)
    assert plane.basis(none[2:], none) is space.basis(none[2:], none) is None
    for silent in (none, np.arange(n) == 1):
        idle = np.arange(n - 2) == 0 if n > 2 else none[2:]
        if not np.any(idle) and not np.any(silent):
            continue
        basis, other = plane.basis(idle, silent), space.basis(idle, silent)
        assert other.shape == (3 * n, 3 * n - np.sum(idle) - 3 * np.sum(silent))
        # the plane's span is what the other has of it
        np.testing.assert_allclose(turned @ other @ other.T @ turned.T, basis @ basis.T, atol=1e-9)


SETTLED = [
    seed
    for seed in SEEDS
    if all(extremal(m, both(seed).times).gap < SAME for m in (both(seed).plane, both(seed).space))
]


def test_most_optima_are_found():
    """Of the others, where walls play against each other, each dimension has ends of its own: steps are damped by the
    curvature's mean over all directions.
    """
    assert len(SETTLED) >= 42


@pytest.mark.parametrize("seed", SETTLED[:: 1 if ALL else 2])
def test_optima_at_given_times(seed):
    pair = both(seed)
    plane, space, times = pair.plane, pair.space, pair.times
    found, other = extremal(plane, times), extremal(space, times)
    close([found.lower, found.upper], [other.lower, other.upper])
    largest = np.max(np.abs(found.multipliers))
    pair.same(found.multipliers / largest, other.multipliers / largest)
    close(found.motion.peak(), other.motion.peak())
    if np.ptp(found.motion.size) > SAME * found.upper:
        return  # where p is silent other motions are as good
    at = np.linspace(0, 1, 31)
    for name in ("position", "velocity"):
        pair.same(getattr(found.motion, name)(at), getattr(other.motion, name)(at))
    for panels in (found.motion.panels(), other.motion.panels()):
        assert np.all(np.isin(np.concatenate([[0.0], times, [1.0]]), panels))
    back, there = (one.motion.in_units(mass) for one, mass in ((found, plane), (other, space)))
    seconds = at * plane.time
    pair.same(back.position(seconds) - plane.origin, there.position(seconds) - space.origin)
    pair.same(back.acceleration(seconds), there.acceleration(seconds))


@pytest.mark.parametrize("seed", SETTLED[:: 1 if ALL else 4])
def test_optima_from_given_multipliers(seed):
    pair = both(seed)
    plane, space, times = pair.plane, pair.space, pair.times
    found = extremal(plane, times)
    again = extremal(space, times, found.multipliers @ pair.turn)
    close([again.lower, again.upper], [found.lower, found.upper])
    rough = found.multipliers + 0.1 * np.max(np.abs(found.multipliers)) * pair.rng.normal(size=found.multipliers.shape)
    own, others = optimal(plane, times, rough, found.upper), optimal(space, times, rough @ pair.turn, found.upper)
    close(lower_bound(plane, times, own), lower_bound(space, times, others))
    # a few steps come about as far
    assert 0.1 * found.lower <= lower_bound(space, times, ascend(space, times)) <= found.upper * (1 + 1e-12)


@pytest.mark.parametrize("seed", [0, 4, 9, 10, 13, 17, 21, 22, 25, 29, 33, 37, 41, 42, 46][:: 1 if ALL else 3])
def test_optima_over_all_times(seed):
    pair = both(seed)
    plane, space = pair.plane, pair.space
    found, other = (least_over_times(mass, 1e-6) for mass in (plane, space))
    close(found.best.upper, other.best.upper)
    assert found.complete
    assert (other.complete, other.nodes) == (True, found.nodes)
    close(found.lower, other.lower)
    leaves = [Leaf(leaf.low, leaf.high, leaf.multipliers @ pair.turn, leaf.at) for leaf in found.leaves]
    close(global_bound(plane, found.leaves), global_bound(space, leaves))


@pytest.mark.parametrize("seed", [seed for seed in SETTLED if seed % (4 if ALL else 8) == 1])
def test_descents(seed):
    pair = both(seed)
    found, other = (descend(mass, extremal(mass, pair.times), pair.times) for mass in (pair.plane, pair.space))
    close(found[0].upper, other[0].upper)


def test_ways_that_no_wall_hinders():
    seen = 0
    for seed in SEEDS:
        pair = both(seed)
        free, same = unhindered(pair.plane), unhindered(pair.space)
        assert (free is None) == (same is None)
        if free is not None:
            close(free[0].upper, same[0].upper)
            close(free[1], same[1])
            seen += len(free[1]) > 0
    assert seen


@pytest.mark.parametrize("walls", range(4))
def test_many_at_once(walls):
    """As for each alone, in the plane or in space."""
    pairs = [both(seed) for seed in SEEDS if seed % 4 == walls]
    for pair in pairs:
        assert pair.space.walls == walls
    times = np.array([pair.times for pair in pairs])
    plane, space = (
        PointMass.stacked(
            [replace(mass, windows=replace(mass.windows, width=np.full(walls, np.inf))) for mass in masses]
        )
        for masses in zip(*((pair.plane, pair.space) for pair in pairs), strict=True)
    )
    multipliers = np.array([pair.rng.normal(size=(2 + walls, 2)) for pair in pairs])
    there = np.array([one @ pair.turn for one, pair in zip(multipliers, pairs, strict=True)])
    close(lower_bounds(plane, times, multipliers), lower_bounds(space, times, there))
    found, other = extremals(plane, times), extremals(space, times)
    both_settled = found.settled & other.settled
    assert np.sum(both_settled) >= 4
    close(found.lower[both_settled], other.lower[both_settled])
    close(found.upper[both_settled], other.upper[both_settled])
    for k in np.flatnonzero(both_settled):
        pairs[k].same(found.multipliers[k], other.multipliers[k])
