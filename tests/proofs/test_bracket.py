import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import peakmin as pm
from peakmin.proofs.bracket import Answer, Bracket, HoldProblem, Verdict
from peakmin.proofs.double_integrator import PointMass
from tests.conftest import least, wall_maneuver

POLYGON = pm.Polygon(segments=5)


def problem(circle=POLYGON, steps=40, at=0.4, contact="clear"):
    mass = PointMass.of(wall_maneuver(contact))
    times = np.array([at])
    return HoldProblem(mass, circle, times, pm.Aligned(steps=steps).edges(times))


@settings(deadline=None)
@given(seed=st.integers(0, 10**6), contact=st.sampled_from(["clear", "touch"]), size=st.floats(0, 100))
def test_whatever_is_proposed_the_bracket_holds_the_optimum(seed, contact, size):
    lower, upper = TRUE[contact]
    rng = np.random.default_rng(seed)
    nonsense = Answer(rng.normal(size=(40, 2)) * size, rng.normal(size=(40, 2)), "optimal")
    bracket = problem(contact=contact).tighten(Bracket(), nonsense)
    assert bracket.lower <= upper
    assert bracket.upper >= lower


TRUE = {c: least(wall_maneuver(c), [0.4], circle=POLYGON, grid=pm.Aligned(steps=40)) for c in ("clear", "touch")}


@pytest.mark.parametrize("circle", [pm.Disc(), pm.Polygon(segments=1), POLYGON], ids=str)
def test_a_landed_control_reaches_goal_and_wall(circle):
    hold = problem(circle)
    upper, control = hold.upper(np.random.default_rng(3).normal(size=(40, 2)))
    moments = hold.rows @ control
    np.testing.assert_allclose(moments, hold.mass.reached(hold.times, moments), atol=1e-13)
    assert upper == pytest.approx(circle.gauge(control).max())


@pytest.mark.parametrize(
    "answer",
    [
        Answer(),
        Answer(np.full((40, 2), np.nan), np.full((40, 2), np.nan)),
        Answer(np.full((40, 2), np.inf), np.full((40, 2), -np.inf)),
        Answer(None, np.zeros((40, 2)), "infeasible"),
    ],
)
def test_an_answer_without_proof_moves_nothing(answer):
    before = Bracket(lower=3.0, upper=20.0)
    assert problem().tighten(before, answer) == before


def test_verdicts():
    bracket = Bracket(lower=2.0, upper=3.0)
    assert [bracket.verdict(m) for m in (1.9, 2.0, 2.5, 3.0)] == [
        Verdict.INFEASIBLE,
        Verdict.UNKNOWN,
        Verdict.UNKNOWN,
        Verdict.FEASIBLE,
    ]


def test_clear_walls_have_multipliers_that_only_push_away():
    hold = problem(contact="clear")
    multipliers = hold.mass.admissible(np.array([[0.1, 2.0], [0.0, 1.0], [0.5, -3.0]]))
    assert 0 <= multipliers[2] @ hold.mass.free[0] < 1e-12
    assert multipliers[2, 0] == 0.5
    touch = problem(contact="touch").mass
    assert touch.admissible(np.array([[0.1, 2.0], [0.0, 1.0], [0.5, -3.0]]))[2, 1] == -3.0


@pytest.mark.parametrize(
    ("circle", "solvers"), [(POLYGON, ("CLARABEL", "OSQP", "HIGHS")), (pm.Disc(), ("CLARABEL", "SCS"))], ids=str
)
@pytest.mark.parametrize("grid", [pm.Uniform(steps=60), pm.Aligned(steps=60)], ids=str)
def test_solvers_of_different_kinds_reach_the_same_bracket(circle, solvers, grid):
    from peakmin.programs.program import DirectProgram

    ends = []
    for solver in solvers:
        program = DirectProgram(wall_maneuver(), circle, grid)
        times = program.place([0.45])
        hold = HoldProblem(program.mass, circle, times, grid.edges(times))
        bracket = hold.tighten(Bracket(), program.solve(solver))
        # OSQP is a first-order method: its own bracket stays this wide on these linear programs
        assert bracket.gap <= (1e-3 if solver == "OSQP" else 1e-6), (solver, bracket.gap)
        ends.append((bracket.lower, bracket.upper))
    for (low, _), (_, high) in itertools.product(ends, ends):
        assert low <= high
