"""Global bounds: branch and bound against sampling, and plan files that are not what they state."""

import json

import numpy as np
import pytest

import peakmin as pm
from peakmin.cli import main
from peakmin.paper import TWO_LINK
from peakmin.proofs.bounds import Leaf, box_bound, covers, lower_bound, out_of_order
from peakmin.proofs.branch_and_bound import inside, least_over_times
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from peakmin.proofs.saddle import saddle
from tests.conftest import ALL, wall_maneuver
from tests.random_maneuvers import maneuver

# Out and back past a point beside the way: on the way out or on the way back, the one the other backwards in time.
TWO_MINIMA = wall_maneuver(
    "touch",
    start=pm.State(position=(0, 0), velocity=(2, 0)),
    goal=pm.State(position=(0, 0), velocity=(-2, 0)),
    obstacles=(pm.Wall(tip=(0.3, 0.1), contact="touch"),),
)


def least(mass, t):
    return extremal(mass, np.array([t])).upper


@pytest.mark.parametrize(("problem", "at", "value"), [(wall_maneuver(), 0.5, 8.537415), (TWO_LINK, 3.1217, 0.499997)])
def test_reference_values_are_certified(problem, at, value):
    plan = pm.solve(problem, pm.Settings(method=pm.Exact()))
    assert plan.scope == "all"
    assert plan.obstacle_times[0] == pytest.approx(at, abs=5e-4)  # M is flat there
    assert plan.peak == pytest.approx(value, abs=6e-7)
    assert 0 <= plan.gap <= 1e-6
    assert plan.made.nodes < 100


def test_a_hold_plan_states_its_own_gap():
    plan = pm.solve(wall_maneuver())
    assert plan.gap == pytest.approx((plan.peak - plan.lower_bound) / plan.peak)
    assert 2e-5 < plan.gap < 4e-5


@pytest.mark.parametrize("seed", range(0, 6, 1 if ALL else 2))
def test_box_bounds_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    problem = maneuver(seed + 4)
    mass = PointMass.of(problem)
    for _ in range(30):
        low, high = np.sort(rng.uniform(0, 1, (2, mass.walls)) ** rng.uniform(0.3, 3), axis=0)
        multipliers = rng.normal(size=(2 + mass.walls, 2))
        if rng.random() < 0.7:  # good ones, near the true optimum of some times in the box
            multipliers = extremal(mass, np.sort((low + high) / 2) + 1e-6 * np.arange(mass.walls)).multipliers
        bound = box_bound(mass, low, high, multipliers)
        for _ in range(40):
            assert bound <= lower_bound(mass, low + rng.random(mass.walls) * (high - low), multipliers) * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(12) if ALL else (6,))
def test_saddle_bounds_hold_everywhere_in_the_box(seed):
    """Against the optimum itself at times all over the box, with good multipliers and with any."""
    rng = np.random.default_rng(seed)
    mass = PointMass.of(maneuver(seed + 4))
    q = mass.walls
    for trial in range(4):
        low, high = np.sort(rng.uniform(0, 1, (2, q)) ** rng.uniform(0.3, 3), axis=0)
        if trial == 0:
            low, high = np.zeros(q), np.ones(q)
        low = np.minimum.accumulate(low[::-1])[::-1]
        high = np.maximum.accumulate(high)
        at = inside(low, high)
        multipliers = extremal(mass, at).multipliers if trial < 3 else rng.normal(size=(2 + q, 2))
        bound = saddle(mass, low, high, at, multipliers)[0]
        for _ in range(15):
            times = np.sort(low + rng.random(q) * (high - low))
            if np.all((low <= times) & (times <= high) & (np.diff(times, prepend=0) > 1e-6)):
                assert bound <= extremal(mass, times).upper * (1 + 1e-9)


def test_one_box_proves_all_times_where_walls_push():
    """Also with two walls of one height, where p stands still between them, and over, under, over."""
    table = (pm.Wall(tip=(0.3, 0.5)), pm.Wall(tip=(0.7, 0.5)))
    slalom = (pm.Wall(tip=(0.25, 0.3)), pm.Wall(tip=(0.5, -0.3), direction=(0, 1)), pm.Wall(tip=(0.75, 0.3)))
    for walls in ((pm.Wall(tip=(0.5, 0.5)),), table, slalom):
        found = least_over_times(PointMass.of(wall_maneuver(obstacles=walls)), 1e-6)
        assert found.nodes == 1
        assert found.gap <= 1e-8


def test_several_minima_do_not_mislead():
    mass = PointMass.of(TWO_MINIMA)
    grid = np.linspace(0.02, 0.98, 193)
    values = np.array([least(mass, t) for t in grid])
    inner = (values[1:-1] < values[:-2]) & (values[1:-1] < values[2:])
    assert np.sum(inner) >= 2
    found = least_over_times(mass, 1e-6)
    assert found.complete
    assert found.best.upper <= values.min() * (1 + 1e-6)
    assert found.lower <= values.min()


EVERY = [(walls, seed) for walls in (2, 3) for seed in range(6)]


@pytest.mark.parametrize(("walls", "seed"), EVERY if ALL else [(2, 1), (2, 5), (3, 0)])
def test_more_walls_state_what_is_left_of_the_gap(walls, seed):
    mass = PointMass.of(maneuver(seed, walls=walls))
    found = least_over_times(mass, 1e-4, node_limit=60)
    rng = np.random.default_rng(seed)
    sampled = min(extremal(mass, np.sort(rng.uniform(0.02, 0.98, walls))).upper for _ in range(20))
    assert found.lower <= min(sampled, found.best.upper)
    assert found.best.upper <= sampled * (1 + 1e-9)
    assert found.complete == (found.gap <= 1e-4) or found.nodes >= 60


def test_two_walls_are_certified():
    plan = pm.solve(
        wall_maneuver(obstacles=(pm.Wall(tip=(0.3, 0.5)), pm.Wall(tip=(0.7, 0.5)))), pm.Settings(method=pm.Exact())
    )
    assert plan.gap <= 1e-6
    assert plan.peak == pytest.approx(9.3586445, rel=1e-7)


def test_limits_stop_the_search_with_an_honest_gap():
    plan = pm.solve(DETOUR, pm.Settings(method=pm.Exact(), node_limit=5))
    assert plan.status == "solved"
    assert plan.made.nodes <= 7
    assert 1e-6 < plan.gap < 1
    assert pm.verify(plan.to_json()).passed


def test_a_wall_can_make_it_infeasible():
    refused = pm.solve(wall_maneuver(max_peak=8.5))
    assert refused.status == "infeasible"
    assert refused.lower_bound > 8.5
    assert pm.verify(refused.to_json()).passed
    assert pm.solve(wall_maneuver(max_peak=8.54)).status == "solved"
    # between the true optimum and what 200 holds reach, nothing is proved either way
    assert pm.solve(wall_maneuver(max_peak=8.5375)).status == "unknown"


def test_cover_is_exact():
    none = np.zeros((4, 2))

    def leaf(low, high):
        return Leaf(low, high, none, low)

    halves = [leaf((0.0, 0.0), (0.5, 1.0)), leaf((0.5, 0.5), (1.0, 1.0))]
    assert covers(halves, [0.0, 0.0], [1.0, 1.0])  # (0.5..1, 0..0.5) is out of order
    assert not covers(halves[:1], [0.0, 0.0], [1.0, 1.0])
    assert not covers([leaf((0.0, 0.0), (0.5, 1.0)), leaf((0.5, 0.5), (1.0, 0.99))], [0.0, 0.0], [1.0, 1.0])
    assert out_of_order((0.5, 0.0), (1.0, 0.5))
    assert not out_of_order((0.5, 0.0), (1.0, 0.6))


# a line beyond the goal is touched and left again: no push along the wall, so that the proof takes many boxes
DETOUR = wall_maneuver(goal=pm.State(position=(1, 0.5)), obstacles=(pm.Wall(tip=(1.4, -1.0)),))


@pytest.fixture(scope="module", params=["direct", "exact"])
def written(request):
    return pm.solve(DETOUR, pm.Settings(method={"kind": request.param})).to_json()


def test_a_true_plan_file_is_verified(written):
    found = pm.verify(written)
    assert found.passed
    assert found.problems == ()
    again = pm.Plan.from_json(written)
    assert again.to_json() == written


def change(path, value=None):
    def apply(data):
        here = data
        for key in path[:-1]:
            here = here[key]
        if value is None:
            del here[path[-1]]
        else:
            here[path[-1]] = value(here[path[-1]]) if callable(value) else value

    return apply


@pytest.mark.parametrize(
    "spoil",
    [
        change(["acceleration", 7, 0], 1.25),
        change(["position", 7, 0], 1.25),
        change(["proof", "leaves", 3]),
        change(["proof", "leaves", 3, "multipliers", 0, 0], 9.0),
        change(["proof", "leaves", 3, "high", 0], 0.4),
        change(["lower_bound"], lambda bound: bound * 1.00001),
        change(["peak"], lambda peak: peak * 0.999),
        change(["gap"], 1e-9),
        change(["obstacle_times", 0], 0.4),
        change(["scope"], "these"),
        change(["spec", "maneuver", "goal", "position", 0], 1.1),
        change(["spec", "maneuver", "obstacles", 0, "tip", 1], 0.6),
        change(["spec", "maneuver", "duration"], 1.01),
        change(["sensitivities", "duration"], 0.0),
    ],
)
@pytest.mark.parametrize("forged", [False, True])
def test_a_changed_plan_file_is_refused(written, spoil, forged):
    """Also when whoever changed it wrote a fitting digest: then what it states must be untrue, or still proved."""
    from peakmin.plan.document import digest

    data = json.loads(written)
    spoil(data)
    if forged:
        data["digest"] = digest(data)
    found = pm.verify(json.dumps(data))
    if found.passed:  # other multipliers of one box can prove the same bound
        assert forged
        assert spoil is not None
        assert found.lower_bound <= pm.Plan.from_json(written).peak
        assert data["proof"]["leaves"][3]["multipliers"][0][0] == 9.0
    else:
        assert found.problems


def test_verify_at_the_terminal(tmp_path, capsys, written):
    def run(text):
        path = tmp_path / "plan.json"
        path.write_text(text)
        with pytest.raises(SystemExit) as end:
            main(["verify", str(path)])
        return end.value.code, *capsys.readouterr()

    assert run(written)[0] == 0
    data = json.loads(written)
    data["lower_bound"] *= 1.001
    status, out, _ = run(json.dumps(data))
    assert status == 4
    assert "lower_bound" in out
    status, _, err = run('{"version": 1}')
    assert status == 2
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("problem", "peak"),
    [
        (wall_maneuver(obstacles=()), 4.0),
        (wall_maneuver(), 8.0),
        (
            wall_maneuver(
                start=pm.State(position=(0, 0), velocity=(1, -0.5)), goal=pm.State(position=(1, 0), velocity=(0, 2))
            ),
            6.0,
        ),
        (wall_maneuver(obstacles=(), start=pm.State(position=(0, 0), velocity=(10, 0))), 3.0),
    ],
)
def test_shortest_and_solve_are_inverse(problem, peak):
    found = pm.shortest(problem, peak)
    assert found.lower_bound <= found.duration
    assert found.gap <= 1e-6
    assert found.plan.peak == pytest.approx(peak, rel=1e-6)
    slower = pm.solve(
        problem.model_copy(update={"duration": found.lower_bound * (1 - 1e-4)}), pm.Settings(method=pm.Exact())
    )
    assert slower.lower_bound > peak


def test_shortest_in_one_dimension_is_the_textbook_s():
    """From 10 m/s, stopping 1 m ahead with 3 m/s^2: brake past the goal, come back bang-bang."""
    problem = wall_maneuver(obstacles=(), start=pm.State(position=(0, 0), velocity=(10, 0)))
    past = 100 / 6 - 1
    assert pm.shortest(problem, 3.0).duration == pytest.approx(10 / 3 + 2 * np.sqrt(past / 3), rel=1e-6)


@pytest.mark.parametrize("peak", [0, -1, float("nan"), float("inf"), "4", True])
def test_shortest_refuses_what_is_no_peak(peak):
    with pytest.raises(pm.SpecError, match=r"^peak: was "):
        pm.shortest(wall_maneuver(), peak)


def test_the_error_budget_of_table_1_adds_up():
    from peakmin import paper

    meant = paper.GENERAL.model_copy(update={"duration": 1.0})
    plan = pm.sweep(paper.GENERAL, paper.settings_for(5), times=paper.obstacle_nodes()).best
    errors = pm.error_budget(paper.GENERAL, paper.settings_for(5), meant=meant, plan=plan)
    assert sum(errors.parts.values()) == pytest.approx(errors.total, abs=1e-12)
    assert errors.stated == pytest.approx(8.7451, abs=5e-5)
    assert errors.true == pytest.approx(8.537415, abs=1e-6)
    assert errors.total / errors.true == pytest.approx(0.0243, abs=1e-4)  # the 2.4 %
    assert errors.tolerance == pytest.approx(8.74512 - 8.74443, abs=2e-5)
    assert errors.maneuver / errors.true == pytest.approx(1 / 0.995**2 - 1, abs=1e-6)
    assert "obstacle times" in errors.table()


@pytest.mark.parametrize(
    "tips",
    [[(0.5, -0.05)], [(0.5, -0.3)], [(0.5, -1)], [(0.3, -0.3), (0.7, -0.2)], [(0.3, -0.3), (0.5, -0.1), (0.7, -0.2)]],
)
def test_walls_that_are_not_in_the_way_cost_nothing(tips):
    """There a multiplier may be anything along the way, and other times prove nothing by themselves."""
    plan = pm.solve(wall_maneuver(obstacles=[pm.Wall(tip=tip) for tip in tips]), pm.Settings(method=pm.Exact()))
    assert plan.peak == pytest.approx(4, rel=1e-9)
    assert plan.gap < 1e-6
    assert plan.made.nodes == 1
