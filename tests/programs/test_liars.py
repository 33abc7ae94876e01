"""Whatever a solver says, no bracket that is reported is wrong: solvers propose, arithmetic decides."""

import itertools
import time

import cvxpy as cp
import numpy as np
import pytest

import peakmin as pm
from peakmin.view import words
from peakmin.view.hints import advice
from tests.conftest import ALL, wall_maneuver
from tests.random_arms import task

honest = cp.Problem.solve
POINTS = [0.2, 0.5]


def proposed(problem):
    return list(problem.variables()), [dual for one in problem.constraints for dual in one.dual_variables]


def changed(things, how):
    for thing in things:
        if thing.value is not None:
            thing.save_value(np.asarray(how(np.asarray(thing.value, dtype=float))))


def liar(control=None, duals=None):
    """A solver that changes what it found."""

    def solve(problem, *args, **options):
        honest(problem, *args, **options)
        values, multipliers = proposed(problem)
        changed(values, control or (lambda x: x))
        changed(multipliers, duals or (lambda x: x))

    return solve


def silent(status):
    """A solver that says so and gives nothing."""

    def solve(problem, *args, **options):
        for thing in itertools.chain(*proposed(problem)):
            thing.save_value(None)
        problem._status = status

    return solve


def failing(error):
    def solve(problem, *args, **options):
        raise error

    return solve


def noise(x):
    return np.random.default_rng(x.size).normal(size=x.shape)


def now_and_then():
    calls = itertools.count()

    def solve(problem, *args, **options):
        return (honest if next(calls) % 2 else liar(noise, noise))(problem, *args, **options)

    return solve


LIARS = {
    "fails": lambda: failing(cp.SolverError("no")),
    "divides by zero": lambda: failing(ZeroDivisionError()),
    "optimal, but nothing": lambda: silent("optimal"),
    "infeasible": lambda: silent("infeasible"),
    "unbounded": lambda: silent("unbounded"),
    "zeros": lambda: liar(np.zeros_like, np.zeros_like),
    "nan": lambda: liar(lambda x: np.full_like(x, np.nan), lambda x: np.full_like(x, np.nan)),
    "infinite": lambda: liar(lambda x: x + np.inf, lambda x: x + np.inf),
    "noise": lambda: liar(noise, noise),
    "inaccurate": lambda: liar(lambda x: x * (1 + 1e-4 * noise(x)), lambda x: x * (1 + 1e-4 * noise(x))),
    "too small": lambda: liar(lambda x: 0.5 * x),
    "huge": lambda: liar(lambda x: 1e200 * x, lambda x: 1e200 * x),
    "largest": lambda: liar(lambda x: 1e308 * np.sign(x), lambda x: 1e308 * np.sign(x)),
    "tiny": lambda: liar(lambda x: 1e-300 * x, lambda x: 1e-300 * x),
    "wrong signs": lambda: liar(lambda x: -x, lambda x: -x),
    "duals of wrong sign": lambda: liar(duals=lambda x: -x),
    "duals backwards": lambda: liar(duals=lambda x: x[::-1].copy() if x.ndim else x),
    "duals too large": lambda: liar(duals=lambda x: 100 * x),
    "now and then": now_and_then,
}

ALIGNED = {"grid": pm.Aligned(steps=20)}
UNIFORM = {"grid": pm.Uniform(steps=20), "circle": pm.Polygon(segments=2)}
PLAIN, VERIFIED = pm.Bisection(verified=False, tolerance=1e-3), pm.Bisection(tolerance=1e-3)
SETTINGS = {
    "direct, aligned": pm.Settings(**ALIGNED),
    "direct, uniform": pm.Settings(**UNIFORM),
    "plain, aligned": pm.Settings(**ALIGNED, method=PLAIN),
    "plain, uniform": pm.Settings(**UNIFORM, method=PLAIN),
    "verified, aligned": pm.Settings(**ALIGNED, method=VERIFIED),
    "verified, uniform": pm.Settings(**UNIFORM, method=VERIFIED),
    "exact": pm.Settings(method=pm.Exact()),
}
# every liar to a third of the settings, every setting with a third of the liars
TOLD = [(s, t) for i, s in enumerate(SETTINGS) for k, t in enumerate(LIARS) if ALL or (i + k) % 3 == 0]


@pytest.fixture(scope="module")
def truth():
    """Sweeps by an honest solver, its best multipliers and all: brackets that are known to hold."""
    known = {}
    for name, settings in SETTINGS.items():
        known[name] = pm.sweep(wall_maneuver(), settings, times=POINTS)
        assert np.all(known[name].lower <= known[name].peak)
        assert np.all(known[name].lower > (1 - 1e-3) * known[name].peak)
    return known


@pytest.mark.parametrize(("settings", "liar"), TOLD)
def test_no_end_of_a_bracket_moves_without_proof(truth, monkeypatch, settings, liar):
    monkeypatch.setattr(cp.Problem, "solve", LIARS[liar]())
    found, known = pm.sweep(wall_maneuver(), SETTINGS[settings], times=POINTS), truth[settings]
    assert np.all(found.lower <= known.peak * (1 + 1e-12))
    assert np.all(found.peak >= known.lower * (1 - 1e-12))
    assert np.all(found.lower > 0)  # single equations prove this much without any solver
    sound(found.best)


def sound(plan):
    """Whether a plan's status is its own: with a motion that passes its checks, or with words on what to try."""
    assert plan.status in ("solved", "feasible", "unknown")
    assert pm.verify(plan.to_json()).passed
    if plan.keeps:
        assert plan.check().passed
        assert advice(plan) == [] or plan.gap > 1e-3
        assert (plan.status == "solved") == (plan.gap <= 0.05)
    else:
        what, *tries = advice(plan)
        assert what.startswith("whether ")
        assert tries


OVER = pm.Maneuver(
    start=pm.State(position=(0, 0)),
    goal=pm.State(position=(1, 0)),
    duration=1.0,
    obstacles=[pm.Block(vertices=[(0.45, -0.5), (0.55, -0.5), (0.55, 0.2), (0.45, 0.2)], side="right")],
    margin=0.02,
)
WHOLE = {
    "global": wall_maneuver(max_peak=50.0),
    "refine": wall_maneuver(),
    "speed": wall_maneuver(max_speed=3.0),
    "region": wall_maneuver(region=[(-0.1, -0.1), (1.1, -0.1), (1.1, 0.6), (-0.1, 0.6)]),
    "block": OVER,
    "arm": task(1),
}


def solved(name):
    search = pm.RefineSearch(count=4) if name == "refine" else pm.GlobalSearch(gap=1e-4)
    return pm.solve(WHOLE[name], pm.Settings(**ALIGNED, search=search))


@pytest.fixture(scope="module")
def plans():
    return {name: solved(name) for name in WHOLE}


@pytest.mark.parametrize(
    ("name", "liar"),
    [
        (name, liar)
        for i, name in enumerate(WHOLE)
        for k, liar in enumerate(("fails", "infeasible", "nan", "noise", "now and then"))
        if ALL or (i + k) % 2 == 0
    ],
)
def test_plans_are_solved_or_say_what_is_unknown(plans, monkeypatch, name, liar):
    known = plans[name]
    assert known.status == "solved"
    monkeypatch.setattr(cp.Problem, "solve", LIARS[liar]())
    plan = solved(name)
    sound(plan)
    assert plan.peak >= known.lower_bound * (1 - 1e-12) or plan.status == "unknown"
    if plan.scope == "all":  # the bound over all obstacle times asks no solver
        assert plan.lower_bound == known.lower_bound


def test_the_terminal_says_what_to_try(monkeypatch):
    settings = pm.Settings(circle=pm.Polygon(segments=2), **ALIGNED, search=pm.SweepSearch(count=2))
    monkeypatch.setattr(cp.Problem, "solve", LIARS["fails"]())
    text = words.describe(pm.solve(wall_maneuver(), settings))
    assert "  unknown         whether there is a control and how small its peak is at these obstacle times" in text
    assert "  try             another solver: HIGHS or OSQP or SCS in place of CLARABEL" in text
    assert "  try             search global, over all obstacle times" in text


@pytest.mark.parametrize("grid", [pm.Aligned, pm.Uniform] if ALL else [pm.Aligned])
def test_too_few_holds_are_told_with_as_many_as_will_do(grid):
    thin = pm.Block(vertices=[(0.499, -0.2), (0.501, -0.2), (0.501, 0.2), (0.499, 0.2)])
    for steps, said in ((2, "no control on these holds, 2 in 3 segments"), (3, "no control was found on these holds")):
        what, *tries = advice(pm.solve(wall_maneuver(obstacles=(thin,)), pm.Settings(grid=grid(steps=steps))))
        assert what.startswith(said)
        assert tries == ["steps: at least 4 here"]
    assert pm.solve(wall_maneuver(obstacles=(thin,)), pm.Settings(grid=grid(steps=4))).keeps


def test_a_path_above_max_peak_is_told_to_be_made_finer():
    plan = pm.solve(wall_maneuver(max_peak=8.54), pm.Settings(grid=pm.Aligned(steps=20)))
    what, *tries = advice(plan)
    assert what.startswith("whether a peak of 8.54 m/s² (max_peak) can be kept: this path has 8.5")
    assert tries == ["more steps: 40 in place of 20", "method exact, in continuous time"]
    assert pm.solve(plan.maneuver, pm.Settings(method=pm.Exact())).status == "solved"


@pytest.mark.parametrize("name", ["global", "speed", "block"])
def test_a_solver_that_stalls_is_given_what_is_left_of_the_time(monkeypatch, name):
    given = []

    def stalls(problem, *args, time_limit, **options):
        given.append(time_limit)
        time.sleep(time_limit)
        raise cp.SolverError("time is over")

    monkeypatch.setattr(cp.Problem, "solve", stalls)
    began = time.perf_counter()
    plan = pm.solve(WHOLE[name], pm.Settings(**ALIGNED, time_limit=1.0))
    assert given
    assert max(given) <= 1
    assert time.perf_counter() - began < 4  # of which 1 s is asleep; the rest is room for a loaded computer
    sound(plan)
    assert any("time_limit" in one for one in advice(plan))
