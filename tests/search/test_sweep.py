import numpy as np
import pytest
from cvxpy.reductions.solvers import solving_chain

import peakmin as pm
from peakmin.programs.least_peak import LeastPeak
from tests.conftest import wall_maneuver

PAPER = {"circle": {"kind": "polygon", "segments": 2}, "search": {"kind": "sweep", "count": 6}}
METHODS = [
    {"kind": "direct"},
    {"kind": "bisection", "upper": 15.0, "tolerance": 0.01},
    {"kind": "bisection", "upper": 15.0, "tolerance": 0.01, "verified": False},
]


@pytest.fixture
def compilations(monkeypatch):
    """How often cvxpy builds a program anew, counted in cvxpy."""
    built = []
    apply = solving_chain.SolvingChain.apply
    monkeypatch.setattr(
        solving_chain.SolvingChain, "apply", lambda self, *args, **kw: built.append(1) or apply(self, *args, **kw)
    )
    return built


@pytest.mark.parametrize("grid", [{"kind": "uniform", "steps": 50}, {"kind": "aligned", "steps": 50}], ids=str)
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_whole_sweep_is_one_compilation(compilations, method, grid):
    settings = pm.Settings(**PAPER, method=method, grid=grid)
    found = pm.sweep(wall_maneuver(), settings)
    assert found.best.made.compilations == 1
    assert len(compilations) == 1
    assert found.best.made.solves >= 6
    assert found.best.keeps


def test_methods_agree_at_every_point():
    uneven = wall_maneuver(goal=pm.State(position=(1.2, 0.1), velocity=(0, -1)))
    results = [pm.sweep(uneven, pm.Settings(**PAPER, method=m, grid=pm.Uniform(steps=50))) for m in METHODS]
    for one in results[1:]:
        assert np.all(one.peak - one.lower <= 0.0101)
        assert np.all(one.lower <= results[0].peak)
        assert np.all(results[0].lower <= one.peak)
        assert one.winner == results[0].winner


def test_plain_bisection_takes_the_paper_s_steps():
    settings = pm.Settings(method=pm.Bisection(upper=15.0, tolerance=0.01, verified=False))
    peak = LeastPeak(wall_maneuver(), settings)
    bracket = peak([0.5])
    assert peak.count.solves <= 1 + 11  # 15, then 11 halvings; what is proved already is not asked again
    assert bracket.upper - bracket.lower == pytest.approx(15 / 2048)
    for end in (bracket.lower, bracket.upper):
        assert end * 2048 / 15 == pytest.approx(round(end * 2048 / 15), abs=1e-9)
    grown = LeastPeak(wall_maneuver(), pm.Settings(method=pm.Bisection(upper=1.0, tolerance=0.01, verified=False)))(
        [0.5]
    )
    assert grown.lower <= bracket.upper
    assert bracket.lower <= grown.upper <= grown.lower + 0.01


def test_refine_finds_the_minimum_that_a_fine_sweep_finds():
    maneuver = wall_maneuver(goal=pm.State(position=(1.3, 0.2), velocity=(0, 1)))
    plan = pm.solve(maneuver, pm.Settings(search={"kind": "refine"}))
    fine = pm.sweep(maneuver, times=np.linspace(0.02, 0.98, 193))
    assert plan.peak <= fine.peak.min() * (1 + 1e-7)
    assert plan.scope == "these"


def test_refine_on_a_uniform_grid_ends_on_a_node():
    plan = pm.solve(wall_maneuver(), pm.Settings(grid=pm.Uniform(steps=50), search={"kind": "refine"}))
    assert plan.obstacle_times[0] * 50 == pytest.approx(25, abs=1e-9)


def test_two_walls_are_swept_over_every_ordered_choice():
    maneuver = wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.4)), pm.Wall(tip=(0.7, 0.4))])
    found = pm.sweep(maneuver, pm.Settings(search={"kind": "sweep", "count": 5}))
    assert found.obstacle_times.shape == (10, 2)
    assert np.all(np.diff(found.obstacle_times, axis=1) > 0)
    assert found.best.made.compilations == 1
    assert found.best.check().passed


@pytest.mark.parametrize("times", [[0.0], [1.0], [-0.1], [1.5], [float("nan")]])
def test_times_outside_the_maneuver_are_refused(times):
    with pytest.raises(pm.SpecError, match=r"^times\[0\]: was .* must increase between 0 and 1"):
        pm.sweep(wall_maneuver(), times=times)


def test_a_failing_solver_changes_nothing_and_another_answers(monkeypatch):
    from peakmin.programs import program

    solve = program._Program.solve

    def broken(self, solver, until):
        answer = solve(self, solver, until)
        return program.Answer(status="failed") if solver.startswith("CLARABEL") else answer

    monkeypatch.setattr(program._Program, "solve", broken)
    maneuver = wall_maneuver()
    plan = pm.sweep(maneuver, pm.Settings(**PAPER), times=[0.5]).best
    assert plan.status == "solved"
    assert plan.made.compilations == 2  # CLARABEL, then HIGHS
    monkeypatch.setattr(program._Program, "solve", lambda self, solver, until: program.Answer(status="failed"))
    nothing = pm.sweep(maneuver, pm.Settings(**PAPER), times=[0.5]).best
    assert nothing.status == "unknown"
    assert nothing.trajectory is None
    assert nothing.gap == 1.0
