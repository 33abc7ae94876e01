"""Branch and bound against a dense sweep refined by a local minimiser, on seeded random maneuvers.

`make test` takes some of the 500 seeds; `make proofs` (PEAKMIN_SEEDS=all) takes all of them.
"""

import itertools

import numpy as np
import pytest
from scipy.optimize import minimize

from peakmin.proofs.bounds import global_bound
from peakmin.proofs.branch_and_bound import least_over_times
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from tests.conftest import ALL
from tests.random_maneuvers import maneuver

CHUNKS = [range(k, k + 50) for k in range(0, 500, 50)]
SOME = (20, 42, 84)  # one to three walls, degenerate and not
NODES = {1: 300, 2: 40, 3: 20}
POINTS = {1: 40, 2: 10, 3: 7}


def dense_sweep(mass):
    """The least M* over ordered choices of evenly spaced times, followed by Nelder and Mead's method from the best."""
    q, points = mass.walls, POINTS[mass.walls]

    def peak(at):
        return extremal(mass, at).upper if np.all(np.diff([1e-6, *at, 1 - 1e-6]) > 1e-9) else 1e9

    grid = [np.array(at) for at in itertools.combinations(np.linspace(0.01, 0.99, points), q)]
    values = [peak(at) for at in grid]
    best = grid[int(np.argmin(values))]
    simplex = best + 0.4 / points * np.vstack([np.zeros(q), np.eye(q)])
    near = minimize(
        peak,
        best,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 1e-7, "fatol": 1e-12, "maxfev": 200},
    )
    return min(float(near.fun), min(values))


@pytest.mark.parametrize("seeds", CHUNKS if ALL else [[seed] for seed in SOME], ids=str)
def test_branch_and_bound_agrees_with_a_dense_sweep(seeds):
    for seed in seeds:
        mass = PointMass.of(maneuver(seed))
        found = least_over_times(mass, 1e-6, node_limit=NODES[mass.walls])
        swept = dense_sweep(mass)
        assert 0 <= found.lower <= found.best.upper, seed
        assert global_bound(mass, found.leaves) >= found.lower * (1 - 1e-12), seed
        assert found.lower <= swept, seed
        assert found.best.upper <= swept * (1 + 1e-6), (seed, mass.walls, found.best.upper / swept - 1, found.complete)


@pytest.mark.parametrize("seeds", CHUNKS if ALL else [range(10, 400, 80)], ids=str)
def test_one_wall_is_certified(seeds):
    """A gap of 1e-6; of all 500 at most one in every fifty states more, of the sample one."""
    found = [least_over_times(PointMass.of(maneuver(seed, walls=1)), 1e-6, node_limit=300) for seed in seeds]
    assert all(one.complete == (one.gap <= 1e-6) or one.nodes >= 300 for one in found)
    assert sum(not one.complete for one in found) <= 1
