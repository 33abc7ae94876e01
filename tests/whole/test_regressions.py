"""What once went wrong, each with the number that it must be."""

import json
import math
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import peakmin as pm
from peakmin import deadline
from peakmin.geometry.integrals import derivatives
from peakmin.plan.document import digest
from tests.conftest import ALL, least, wall_maneuver

ALWAYS = [0.01, 0.05, 0.1, 0.2, 0.8, 0.9, 0.95]


@pytest.mark.parametrize("at", ALWAYS)
@pytest.mark.parametrize("n", [1, 2, 5])
def test_circumscribed_polygons_have_their_own_single_equation_bounds(at, n):
    """Their M may lie below the disc's: a Euclidean bound would be false."""
    circle = pm.Polygon(segments=n, fit="circumscribed")
    low, high = least(wall_maneuver(), [at], circle=circle)
    assert low <= high
    assert high - low <= 1e-6 * high
    disc = least(wall_maneuver(), [at])
    assert low <= disc[1] * (1 + 1e-9)
    assert disc[0] * math.cos(math.pi / (4 * n)) <= high * (1 + 1e-9)


@pytest.mark.parametrize("at", ALWAYS)
@pytest.mark.parametrize("verified", [True, False])
def test_bisection_with_its_defaults_closes_where_one_equation_decides(at, verified):
    low, high = least(wall_maneuver(), [at], method=pm.Bisection(verified=verified))
    direct = least(wall_maneuver(), [at])
    assert low <= direct[1] * (1 + 1e-9)
    assert high == pytest.approx(direct[1], rel=1e-5)


def test_an_upper_end_never_stands_without_a_control():
    tiny = least(wall_maneuver(), [0.5], method=pm.Bisection(upper=1e-90, verified=False))
    assert tiny[1] == pytest.approx(8.5377, rel=1e-3)


def test_single_equation_bounds_lose_no_truth_to_cancellation():
    goal = np.array([1 / 3, 0.1])
    maneuver = wall_maneuver(
        goal=pm.State(position=tuple(goal), velocity=(1, 0)),
        obstacles=(pm.Wall(tip=tuple(goal - [1e-9, 0]), contact="touch"),),
    )
    found = pm.sweep(maneuver, times=[1 - 1e-9])
    assert found.lower[0] <= found.peak[0]


@pytest.mark.parametrize("speed", [1.0, 5e5, 1e8, 1e10])
def test_velocities_of_any_size(speed):
    """In a moving frame it is the same maneuver."""
    moving = wall_maneuver(
        "touch",
        start=pm.State(position=(0, 0), velocity=(speed, 0)),
        goal=pm.State(position=(speed + 1, 0), velocity=(speed, 0)),
        obstacles=(pm.Wall(tip=(speed / 2 + 0.5, 0.5), contact="touch"),),
    )
    plan = pm.sweep(moving, times=[0.5]).best
    assert plan.status == "solved"
    assert plan.peak == pytest.approx(8.5376757, rel=1e-15 * speed + 1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_coasting_in_decimal_numbers(seed):
    rng = np.random.default_rng(seed)
    v, duration = np.round(rng.uniform(-2, 2, 2), 1), float(np.round(rng.uniform(0.1, 9), 1))
    end = tuple(np.round(v * duration, 2))
    plan = pm.solve(
        pm.Maneuver(
            start=pm.State(position=(0, 0), velocity=tuple(v)),
            goal=pm.State(position=end, velocity=tuple(v)),
            duration=duration,
        )
    )
    assert (plan.status, plan.peak, plan.lower_bound) == ("solved", 0.0, 0.0)


@pytest.mark.parametrize("solver", ["OSQP", "HIGHS", "SCS"])
def test_counts_are_cvxpy_s_own(solver, monkeypatch):
    from cvxpy.reductions.solvers import solving_chain

    built = []
    apply = solving_chain.SolvingChain.apply
    monkeypatch.setattr(
        solving_chain.SolvingChain, "apply", lambda self, *args, **kw: built.append(1) or apply(self, *args, **kw)
    )
    settings = pm.Settings(circle=pm.Polygon(segments=1), grid=pm.Aligned(steps=20), solver=solver)
    made = pm.sweep(wall_maneuver(), settings, times=[0.3, 0.4, 0.5]).best.made
    assert made.compilations == len(built)
    straight = pm.solve(wall_maneuver(obstacles=()))
    assert (straight.made.compilations, straight.made.solves) == (1, 1)


@pytest.mark.parametrize("times", [[1.7], [0.0], [1.0], [-0.2], [float("nan")]])
@pytest.mark.parametrize("grid", [pm.Aligned(steps=20), pm.Uniform(steps=20)], ids=str)
def test_programs_refuse_times_outside_the_duration(times, grid):
    program = pm.FeasibilityProgram(wall_maneuver(), pm.Disc(), grid)
    program.M.value = 9.0

    def solve():
        program.obstacle_times.value = times
        program.problem.solve(solver="CLARABEL")

    with pytest.raises((pm.SpecError, ValueError)):
        solve()


@pytest.mark.parametrize("times", [[], ["a"], [[0.1, 0.2]], [[[0.5]]], {}])
def test_sweep_refuses_what_are_no_times(times):
    with pytest.raises(pm.SpecError, match=r"^times: was "):
        pm.sweep(wall_maneuver(), times=times)


@pytest.mark.parametrize("changes", [{"duration": 1e50}, {"duration": 1e100}, {"duration": 1e-44}, {"mass": 1e-99}])
def test_extreme_units_answer_or_say_unknown(changes):
    far = wall_maneuver(**changes)
    plan = pm.sweep(far, times=[0.5 * far.duration]).best
    assert plan.status in ("solved", "feasible", "unknown")
    assert plan.lower_bound <= plan.peak


def test_odd_keys_stay_on_one_line():
    for key in ("a\nb", "x" * 100_000, "\x1b[31m"):
        with pytest.raises(pm.SpecError) as error:
            pm.Maneuver(
                **{"start": pm.State(position=(0, 0)), "goal": pm.State(position=(0, 1)), "duration": 1.0, key: 1}
            )
        assert str(error.value).isprintable()
        assert len(str(error.value)) < 300


@pytest.mark.parametrize("value", ["no", 0, "1"])
def test_switches_are_true_or_false(value):
    with pytest.raises(pm.SpecError, match=r"^verified: was "):
        pm.Bisection(verified=value)


def test_a_plan_that_misses_is_never_called_solved(monkeypatch):
    from peakmin.proofs import bracket

    land = bracket.HoldProblem.land
    monkeypatch.setattr(bracket.HoldProblem, "land", lambda self, control: land(self, control) * (1 + 1e-6))
    plan = pm.sweep(wall_maneuver(), times=[0.5]).best
    assert plan.status == "unknown"
    assert plan.trajectory is None


@pytest.mark.parametrize("wrong", ["my.json", {"duration": 1}, None, 3])
def test_what_is_no_maneuver_is_refused_by_name(wrong):
    for call in (
        pm.solve,
        pm.sweep,
        lambda m: pm.solve(wall_maneuver(), m or 1),
        lambda m: pm.sweep(wall_maneuver(), m or 1),
    ):
        with pytest.raises(pm.SpecError, match=r"^(maneuver|settings): was a \w+, must be a peakmin\."):
            call(wrong)


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.5, 4.0])
def test_a_wall_whose_line_runs_through_a_resting_start_needs_no_force(angle):
    """Up to the rounding of its direction: the answer is zero, not 1e-8."""
    c, s = math.cos(angle), math.sin(angle)
    still = wall_maneuver(
        start=pm.State(position=(-1, 0)),
        goal=pm.State(position=(-1, 0)),
        obstacles=(pm.Wall(tip=(-1 - 0.7 * c, -0.7 * s), direction=(-c, -s)),),
    )
    plan = pm.sweep(still, times=[0.5]).best
    assert (plan.status, plan.peak, plan.lower_bound) == ("solved", 0.0, 0.0)


@pytest.mark.parametrize("kind", ["global", "sweep", "refine"])
@pytest.mark.parametrize("walls", [3, 8] if ALL else [8])
def test_a_time_limit_ends_every_search(walls, kind):
    """Descents, sweeps and walls whose stretches lie in one another once took minutes past it."""
    obstacles = [pm.Wall(tip=((i + 1) / (walls + 1), 0.5)) for i in range(walls)]
    search = {"global": {}, "sweep": {"count": 18 - walls}, "refine": {"count": 18 - walls}}[kind]
    settings = pm.Settings(search={"kind": kind, **search}, time_limit=0.5, grid=pm.Aligned(steps=40))
    began = time.perf_counter()
    plan = pm.solve(wall_maneuver(obstacles=obstacles), settings)
    assert time.perf_counter() - began < 25
    assert plan.lower_bound <= plan.peak
    assert pm.verify(plan.to_json()).passed


def test_a_maneuver_past_blocks_that_needs_no_force():
    still = wall_maneuver(
        goal=pm.State(position=(0, 0)), obstacles=(pm.Block(vertices=[(0, 0.5), (0.1, 0.5), (0.1, 0.6)]),)
    )
    plan = pm.solve(still)
    assert (plan.status, plan.peak, plan.lower_bound) == ("solved", 0.0, 0.0)


def test_an_arm_that_stays_stretched_out_is_no_division_by_zero():
    arm = pm.Arm(links=[pm.Link(length=0.5, mass=0.05)] * 2)
    plan = pm.solve(
        pm.ArmManeuver(arm=arm, start=pm.Pose(joints=(0, 0)), goal=pm.Pose(joints=(0, 0)), duration=0.5),
        pm.Settings(grid=pm.Aligned(steps=6), time_limit=0.5),
    )
    assert plan.peak <= 1e-9
    assert pm.verify(plan.to_json()).passed


def test_a_spline_s_last_digit_is_not_a_different_plan():
    """Files of older versions state the free angles of three links as a spline."""
    old = Path(__file__).parent.parent / "plan" / "version_1" / "three_link.json"
    document = json.loads(old.read_text())
    for more, same in ((1e-15, True), (1e-6, False)):
        document["path"]["others"][1][1][0] += more
        found = pm.verify(json.dumps(document | {"digest": digest(document)})).problems
        assert (found == ()) == same


@pytest.fixture(scope="module")
def small_plan():
    return json.loads(pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=8), time_limit=1.0)).to_json())


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("lower_bound", 10**400),
        ("obstacle_times", [10**400]),
        ("acceleration", [[1e200, 0]] * 8),
        ("multipliers", "\n" * 100_000),
        ("made", {"\x1b[2J" * 1000: 0}),
        ("status", ["x" * 100_000]),
        ("version", "\x1b" * 1000),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 50 else "wrong",
)
def test_what_is_no_plan_gives_one_short_line(small_plan, field, value):
    with pytest.raises(pm.SpecError) as error:
        pm.verify(json.dumps(small_plan | {field: value}))
    assert str(error.value).isprintable()
    assert len(str(error.value)) < 300


@pytest.mark.parametrize("time", [2.5e99, -0.25, 0.125])
def test_times_that_are_none_are_found_out_without_a_warning(small_plan, time):
    times = [*small_plan["times"][:2], time, *small_plan["times"][3:]]
    found = pm.verify(json.dumps(small_plan | {"times": times}))
    assert not found.passed
    assert all(problem.isprintable() for problem in found.problems)


def test_a_motion_that_takes_no_time_is_found_out(small_plan):
    found = pm.verify(json.dumps(small_plan | {"times": [0.0] * len(small_plan["times"])}))
    assert any(problem.startswith("goal: missed") for problem in found.problems)


@pytest.mark.parametrize("factor", [1e-120, 1e-300, 1e80])
def test_multipliers_of_any_size_prove_the_same_and_have_the_same_slopes(small_plan, factor):
    """The third powers of small ones are none."""
    plan = pm.Plan.from_json(json.dumps(small_plan))
    other = pm.Plan.from_json(json.dumps(small_plan | {"multipliers": (factor * plan.multipliers).tolist()}))
    for name, value in vars(plan.sensitivities).items():
        np.testing.assert_allclose(vars(other.sensitivities)[name], value, rtol=1e-9, atol=1e-9)
    there = json.loads(json.dumps(small_plan | {"multipliers": other.multipliers.tolist()}))
    assert not [one for one in pm.verify(json.dumps(there)).problems if one.startswith("multipliers")]


def test_multipliers_of_many_sizes_are_found_out(small_plan):
    (wall, away) = (1e-46, 1e62), (1e60, 0.0)
    data = json.loads(json.dumps(small_plan | {"multipliers": [*small_plan["multipliers"][:2], wall]}))
    data["spec"]["maneuver"]["goal"]["position"] = away
    assert not pm.verify(json.dumps(data)).passed


def test_pieces_of_any_size_have_derivatives():
    first, last = np.array([1e-120, -2e-120]), np.array([3e-120, 1e-120])
    small = derivatives(first.tolist(), last.tolist())
    large = derivatives((first * 1e120).tolist(), (last * 1e120).tolist())
    assert small[0] == pytest.approx(large[0] * 1e-120, rel=0.1)  # by the Gauss rule
    assert np.all(np.isfinite(small))


def test_a_budget_keeps_its_time_limit(monkeypatch):
    """What is true is searched with it, too."""
    monkeypatch.setattr(deadline, "time", SimpleNamespace(perf_counter=time.process_time))
    asked = wall_maneuver(
        start=pm.State(position=(-0.02, 0), velocity=(-1.06, 1.07)),
        goal=pm.State(position=(0, 1.13)),
        duration=1e-6,
        obstacles=[pm.Wall(tip=(-1.3, 0)), pm.Wall(tip=(0, 0.1), opening=0.28), pm.Wall(tip=(1, 0.61), opening=0.5)],
    )
    began = time.process_time()
    found = pm.error_budget(asked, pm.Settings(grid=pm.Aligned(steps=15), time_limit=0.5))
    assert time.process_time() - began < 10
    assert 0 < found.width <= found.true


def test_what_differs_is_shown_without_its_control_characters(small_plan):
    with pytest.raises(pm.SpecError, match=r"sensitivities.*must be") as error:
        pm.verify(json.dumps(small_plan | {"sensitivities": {"\x1b[2J\n\ud800": 1}}))
    assert str(error.value).isprintable()
    found = pm.verify(json.dumps(small_plan | {"sensitivities": small_plan["sensitivities"] | {"duration": None}}))
    assert any(problem.startswith("sensitivities: was ") for problem in found.problems)


def test_a_wall_whose_tip_is_the_goal_leaves_no_time_of_its_own():
    """The best obstacle time is the end itself: boxes there become too narrow for M* to be evaluated in."""
    goal = pm.State(position=(0.42, -0.6))
    asked = wall_maneuver(
        start=pm.State(position=(0.31, -0.33)), goal=goal, duration=20.0, obstacles=(pm.Wall(tip=goal.position),)
    )
    plan = pm.solve(asked, pm.Settings(grid=pm.Aligned(steps=26)))
    assert plan.lower_bound <= plan.peak
    assert pm.verify(plan.to_json()).passed


def test_what_cannot_be_simulated_is_said_in_one_line(monkeypatch):
    pytest.importorskip("mujoco")
    from peakmin.queries.simulate import simulate

    arm = pm.Arm(links=[pm.Link(length=1.0, mass=1.0)] * 2)
    plan = pm.solve(
        pm.ArmManeuver(arm=arm, start=pm.Pose(joints=(0.2, 0.9)), goal=pm.Pose(joints=(0.9, 0.5)), duration=1.0),
        pm.Settings(grid=pm.Aligned(steps=8)),
    )
    monkeypatch.setattr(type(plan), "torques", lambda self, t: np.full((len(t), 2), np.inf) - np.inf)
    with pytest.raises(pm.PeakminError, match="torques without end"):
        simulate(plan)
