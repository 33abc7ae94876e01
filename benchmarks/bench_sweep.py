"""The paper's sweep (n = 5, 18 times, tolerance 0.01, 199 holds) against the same loop on scipy's linprog."""

import numpy as np
import pytest

import peakmin as pm
from peakmin import paper

SETTINGS = {
    "plain bisection": pm.Bisection(upper=15.0, tolerance=0.01, verified=False),
    "verified bisection": pm.Bisection(upper=15.0, tolerance=0.01),
    "direct": pm.Direct(),
}


def test_linprog_loop(benchmark):
    from peer import sweep

    circle = pm.Polygon(segments=5)
    nodes = np.round(paper.obstacle_nodes() / paper.STEP).astype(int)
    arguments = (nodes, paper.HOLDS, paper.STEP, circle.normals, circle.inradius, (0.5, 0.5), (1, 0), 15.0, 0.01)
    peaks = benchmark.pedantic(sweep, arguments, rounds=1)
    benchmark.extra_info.update(group="sweep", name="linprog loop (peer)", value=min(peaks))


@pytest.mark.parametrize("name", SETTINGS)
def test_sweep(benchmark, name):
    settings = paper.settings_for(5, SETTINGS[name])
    found = benchmark.pedantic(pm.sweep, (paper.GENERAL, settings, paper.obstacle_nodes()), rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(group="sweep", name=name, value=found.best.peak, solves=found.best.made.solves)
