"""The cost of a query: an oracle's against solving anew, and at given obstacle times against a program built anew."""

import cvxpy as cp
import numpy as np
import pytest

import peakmin as pm
from peakmin.paper import GENERAL

TRUE = GENERAL.model_copy(update={"duration": 1.0})
TIPS = np.random.default_rng(0).uniform([0.3, 0.2], [0.7, 0.6], (50, 1, 2))
HELD = pm.Settings(circle=pm.Polygon(segments=5), method=pm.Direct())
EXACT = pm.Settings(method=pm.Exact())
STEPS, AT = 200, 0.5


def fresh(tip):
    """The same question as a cvxpy problem written and solved for this query alone: disc, 200 holds (the peer)."""
    h = 1 / STEPS
    u, peak = cp.Variable((STEPS, 2)), cp.Variable()
    t = h * (np.arange(STEPS) + 0.5)
    v0, rest = np.array(TRUE.start.velocity), np.array(TRUE.goal.velocity)
    to_wall = np.where(t < AT, h * (AT - t), 0.0)
    constraints = [
        cp.SOC(peak * np.ones(STEPS), u, axis=1),
        h * cp.sum(u, axis=0) == rest - v0,
        (h * (1 - t)) @ u == np.array(TRUE.goal.position) - TRUE.start.position - v0,
        to_wall @ u == tip - TRUE.start.position - AT * v0,
    ]
    return float(cp.Problem(cp.Minimize(peak), constraints).solve(solver="CLARABEL"))


def fresh_states(tip):
    """The same with positions and velocities as variables, as such programs are mostly written."""
    h = 1 / STEPS
    u, peak = cp.Variable((STEPS, 2)), cp.Variable()
    r, v = cp.Variable((STEPS + 1, 2)), cp.Variable((STEPS + 1, 2))
    constraints = [
        cp.SOC(peak * np.ones(STEPS), u, axis=1),
        r[1:] == r[:-1] + h * v[:-1] + h**2 / 2 * u,
        v[1:] == v[:-1] + h * u,
        r[0] == TRUE.start.position,
        v[0] == TRUE.start.velocity,
        r[-1] == TRUE.goal.position,
        v[-1] == TRUE.goal.velocity,
        r[round(AT * STEPS)] == tip,
    ]
    return float(cp.Problem(cp.Minimize(peak), constraints).solve(solver="CLARABEL"))


@pytest.mark.parametrize(("name", "settings"), [("exact", None), ("20-gon on 200 holds", HELD)])
def test_queries(benchmark, name, settings):
    oracle = pm.PeakOracle(TRUE, settings)
    found = benchmark.pedantic(lambda: oracle.peaks(tips=TIPS), rounds=3, warmup_rounds=1)
    assert np.all(found.keeps)
    benchmark.extra_info.update(group="oracle", name=f"50 queries, {name}", value=float(found.peak.max()))


@pytest.mark.parametrize(("name", "settings"), [("exact", EXACT), ("20-gon on 200 holds", HELD)])
def test_solves(benchmark, name, settings):
    walls = [(TRUE.walls[0].model_copy(update={"tip": tuple(tip)}),) for (tip,) in TIPS.tolist()]

    def each():
        return [pm.solve(TRUE.model_copy(update={"obstacles": wall}), settings) for wall in walls]

    found = benchmark.pedantic(each, rounds=3, warmup_rounds=1)
    benchmark.extra_info.update(group="oracle", name=f"50 solves, {name}", value=max(plan.peak for plan in found))


def compiled_anew(tip):
    """The project's own program of the same, compiled for this query alone."""
    wall = TRUE.walls[0].model_copy(update={"tip": tuple(tip.tolist())})
    return float(pm.sweep(TRUE.model_copy(update={"obstacles": (wall,)}), times=[AT]).peak[0])


@pytest.mark.parametrize(
    ("name", "ask"),
    [("with states (peer)", fresh_states), ("condensed (peer)", fresh), ("of peakmin", compiled_anew)],
)
def test_fresh_programs(benchmark, name, ask):
    found = benchmark.pedantic(lambda: [ask(tip) for (tip,) in TIPS], rounds=2, warmup_rounds=1)
    benchmark.extra_info.update(group="at given times", name=f"50 cvxpy problems {name}", value=max(found))


@pytest.mark.parametrize(("name", "at"), [("one by one", AT), ("one by one, far from the best times", 0.1)])
def test_single_queries_at_times(benchmark, name, at):
    oracle = pm.PeakOracle(TRUE)
    found = benchmark.pedantic(
        lambda: [oracle.peak(walls=tips, obstacle_times=[at]) for tips in TIPS], rounds=3, warmup_rounds=1
    )
    benchmark.extra_info.update(group="at given times", name=f"50 queries {name}", value=max(found))


def test_queries_at_times(benchmark):
    oracle = pm.PeakOracle(TRUE)
    found = benchmark.pedantic(lambda: oracle.peaks(tips=TIPS, obstacle_times=[AT]), rounds=3, warmup_rounds=1)
    assert np.all(found.gap < 1e-6)
    benchmark.extra_info.update(group="at given times", name="50 queries of an oracle", value=float(found.peak.max()))
