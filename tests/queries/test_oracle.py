"""The oracle answers as `solve` does, compiles once for each thread, and takes queries in every shape."""

import dataclasses
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import peakmin as pm
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from tests.conftest import ALL, wall_maneuver

MANEUVER = pm.Maneuver(
    start=pm.State(position=(0, 0)),
    goal=pm.State(position=(1, 0)),
    duration=1,
    obstacles=[pm.Wall(tip=(0.5, 0.5), contact="touch")],
)
TIPS = np.array([[[0.4, 0.3]], [[0.5, 0.5]], [[0.6, 0.45]]])


def test_queries_are_solves():
    found = pm.PeakOracle(MANEUVER).peaks(start=[0, 0, 0.2, -0.5], tips=TIPS, duration=[0.8, 1.0, 1.2])
    for k, duration in enumerate((0.8, 1.0, 1.2)):
        wall = pm.Wall(tip=tuple(TIPS[k, 0]), contact="touch")
        start = pm.State(position=(0, 0), velocity=(0.2, -0.5))
        plan = pm.solve(
            pm.Maneuver(start=start, goal=MANEUVER.goal, duration=duration, obstacles=[wall]),
            pm.Settings(method=pm.Exact()),
        )
        assert found.peak[k] == plan.peak
        assert found.lower_bound[k] == plan.lower_bound
        assert found.obstacle_times[k] == pytest.approx(plan.obstacle_times)
    assert np.all(found.keeps)
    assert np.all(found.gap <= 1e-6)


def test_sensitivities_are_derivatives():
    oracle, h = pm.PeakOracle(MANEUVER), 1e-4
    slope = oracle.peaks().sensitivities[0].goal_position
    for k, step in enumerate(np.eye(2) * h):
        goal = np.array([1.0, 0.0])
        difference = (oracle.peak(goal=goal + step) - oracle.peak(goal=goal - step)) / (2 * h)
        assert slope[k] == pytest.approx(difference, rel=1e-3, abs=1e-3)


def test_walls_of_a_query_take_the_place_of_all():
    oracle = pm.PeakOracle(MANEUVER)
    assert oracle.peak(walls=[]) == pytest.approx(4.0)
    assert oracle.peak(walls=[pm.Wall(tip=(0.5, -1))]) == pytest.approx(4.0)
    assert oracle.peak(goal=pm.State(position=(2, 0)), walls=[]) == pytest.approx(8.0)


def test_programs_are_compiled_once_for_each_thread():
    held = pm.Settings(circle=pm.Polygon(segments=2), grid=pm.Aligned(steps=20))
    oracle = pm.PeakOracle(MANEUVER, held)
    compiled = [oracle.plan(walls=TIPS[k]).made.compilations for k in range(3)]
    assert compiled == [1, 0, 0]
    alone = [oracle.peak(walls=tips) for tips in TIPS]
    with ThreadPoolExecutor(2) as threads:
        together = list(threads.map(lambda k: oracle.peak(walls=TIPS[k % 3]), range(12)))
    assert together == alone * 4


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ({"start": [0, 0, 0]}, r"^start: was of shape \(3,\)"),
        ({"tips": [[0, 1], [1, 1]]}, r"^tips: was of shape \(2, 2\)"),
        ({"duration": [1, 2], "start": [[0, 0]] * 3}, r"^queries: was \[2, 3\]"),
        ({"duration": [[1], [2]]}, r"^queries: was of shapes"),
        ({"start": pm.State(position=(0, 0))}, r"^start: was State"),
        ({"duration": -1}, r"^duration: was -1.0"),
        ({"goal": [np.nan, 0]}, r"^goal\.position\[0\]: was nan"),
    ],
)
def test_wrong_queries_are_refused_in_one_line(query, words):
    with pytest.raises(pm.SpecError, match=words):
        pm.PeakOracle(MANEUVER).peaks(**query)


def test_queries_at_given_times_are_sweeps():
    for settings in (None, pm.Settings(circle=pm.Polygon(segments=2), grid=pm.Aligned(steps=20))):
        oracle = pm.PeakOracle(MANEUVER, settings)
        times = np.array([[0.3], [0.5], [0.6]])
        found = oracle.peaks(obstacle_times=times)
        swept = pm.sweep(MANEUVER, settings or oracle.settings, times=times[:, 0])
        assert found.peak == pytest.approx(swept.peak, rel=2e-9)
        assert found.lower_bound == pytest.approx(swept.lower, rel=2e-9)
        assert oracle.peak(obstacle_times=[0.3]) == pytest.approx(found.peak[0], rel=1e-9)
        h = 1e-4
        slope = (oracle.peak(obstacle_times=[0.3 + h]) - oracle.peak(obstacle_times=[0.3 - h])) / (2 * h)
        if settings is None:
            assert found.sensitivities[0].obstacle_times[0] == pytest.approx(slope, rel=1e-3)
    with pytest.raises(pm.SpecError, match=r"^obstacle_times: was \[1.5\], must be 1 times that increase"):
        oracle.peak(obstacle_times=[1.5])


def test_very_many_queries_at_times_and_those_through_openings():
    rng = np.random.default_rng(0)
    oracle = pm.PeakOracle(MANEUVER)
    goals, times = rng.uniform([0.9, -0.1], [1.1, 0.1], (1203, 2)), rng.uniform(0.4, 0.6, (1203, 1))
    found = oracle.peaks(goal=goals, obstacle_times=times)
    np.testing.assert_allclose(found.obstacle_times, times, rtol=1e-15)
    for k in (0, 999, 1000, 1202):
        assert found.queries[k].goal.position == tuple(goals[k])
        assert found.peak[k] == pytest.approx(oracle.peak(goal=goals[k], obstacle_times=times[k]), rel=2e-9)
    assert np.all(found.gap < 1e-6)
    narrow = MANEUVER.model_copy(update={"obstacles": (pm.Wall(tip=(0.5, 0.1), opening=0.1),)})
    through = pm.PeakOracle(narrow).peaks(tips=[[[0.5, 0.1]], [[0.5, 0.2]]], obstacle_times=[0.5])
    assert np.all(through.keeps)
    assert through.peak[0] == pytest.approx(pm.PeakOracle(narrow).peak(obstacle_times=[0.5]), rel=1e-12)


def test_queries_at_times_that_need_nothing_done_and_times_that_cannot_be_told_apart():
    still = pm.PeakOracle(MANEUVER.model_copy(update={"obstacles": (pm.Wall(tip=(0, 0)),)}))
    found = still.peaks(goal=[[0, 0], [1, 0]], obstacle_times=[0.5])
    assert found.peak[0] == found.lower_bound[0] == 0
    assert found.peak[1] == pytest.approx(still.peak(goal=[1, 0], obstacle_times=[0.5]))
    free = pm.PeakOracle(MANEUVER.model_copy(update={"obstacles": ()}))
    assert free.peaks(goal=[[0, 0], [2, 0]], obstacle_times=[]).peak == pytest.approx([0, 8])
    oracle = pm.PeakOracle(MANEUVER)
    for time in (5e-324, 1e-100, 1 - 1e-16):
        for ask in (oracle.peak, oracle.peaks):
            with pytest.raises(pm.SpecError, match=r"^obstacle_times: was .* by 1e-15 of it at least"):
                ask(obstacle_times=[time])
        with pytest.raises(pm.SpecError, match=r"^times\[0\]: was .* by 1e-15 of it at least"):
            pm.sweep(MANEUVER, oracle.settings, times=[time])
    assert np.isfinite(oracle.peak(obstacle_times=[1e-14]))


def test_no_queries_have_no_answers():
    found = pm.PeakOracle(MANEUVER).peaks(goal=np.zeros((0, 2)))
    assert found.peak.shape == (0,)
    assert found.obstacle_times.shape == (0, 1)
    assert found.sensitivities == ()


@pytest.mark.parametrize("seed", range(0, 24, 1 if ALL else 3))
def test_slopes_over_obstacle_times_are_differences(seed):
    """Also where one leg is so short, or so long, that all others are silent."""
    rng = np.random.default_rng(seed)
    q = int(rng.integers(1, 4))
    contact = "touch" if rng.random() < 0.5 else "clear"
    walls = [
        pm.Wall(tip=(x, rng.uniform(0.1, 0.6) * (-1) ** i), direction=(0, -((-1) ** i)), contact=contact)
        for i, x in enumerate(np.linspace(0.2, 0.8, q + 2)[1:-1])
    ]
    asked = wall_maneuver(obstacles=walls)
    times, h = np.sort(rng.uniform(0.03, 0.97, q)), 1e-6
    shifts = np.vstack([np.zeros(q), h * np.eye(q), -h * np.eye(q)])
    found = pm.PeakOracle(asked).peaks(obstacle_times=times + shifts)
    after, before = (found.peak[1 : q + 1] - found.peak[0]) / h, (found.peak[0] - found.peak[q + 1 :]) / h
    slopes = found.sensitivities[0].obstacle_times
    np.testing.assert_allclose(after, before, rtol=2e-3, atol=1e-4 * found.peak[0])
    np.testing.assert_allclose(slopes, (after + before) / 2, rtol=2e-3, atol=1e-4 * found.peak[0])


@pytest.mark.parametrize("wall", [{"tip": (0.7, -50)}, {"tip": (0.7, -0.5)}, {"tip": (0.7, -0.5), "opening": 2.0}])
@pytest.mark.parametrize(("times", "slope"), [((0.5, 0.6), 195.659), ((0.45, 0.6), 77.1125)])
def test_a_wall_that_is_crossed_beyond_its_tip_has_slopes_all_the_same(wall, times, slope):
    """It pushes along the way only: where its tip is does not matter."""
    oracle = pm.PeakOracle(wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.3)), pm.Wall(**wall)]))
    found = oracle.peaks(obstacle_times=np.array(times))
    assert found.sensitivities[0].obstacle_times[0] == pytest.approx(slope, rel=1e-4)
    before, after = (oracle.peak(obstacle_times=[times[0] + h, times[1]]) for h in (-1e-6, 1e-6))
    assert (after - before) / 2e-6 == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("times", [(0.0, 0.5), (0.5, 0.5), (0.5, 1 - 1e-11)])
def test_slopes_that_are_not_known_are_no_numbers_and_null_in_files(times):
    plan = pm.solve(wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.3)), pm.Wall(tip=(0.7, -0.5), direction=(0, 1))]))
    there = dataclasses.replace(plan, obstacle_times=np.array(times))
    assert np.all(np.isnan(there.sensitivities.obstacle_times))
    assert np.all(np.isfinite(there.sensitivities.tips))
    assert there.document()["sensitivities"]["obstacle_times"] == [None, None]
    idle = dataclasses.replace(there, multipliers=plan.multipliers * [[1], [1], [1], [0]])
    assert idle.sensitivities.obstacle_times[1] == 0  # a wall that does not push has no say


def test_slopes_are_not_taken_from_a_motion_that_does_not_land(monkeypatch):
    plan = pm.solve(wall_maneuver())
    lost = dataclasses.replace(extremal(PointMass.of(plan.crossing), plan.obstacle_times), upper=np.inf)
    monkeypatch.setattr("peakmin.proofs.sensitivity.extremal", lambda *_: lost)
    assert np.all(np.isnan(plan.sensitivities.obstacle_times))


def test_a_silent_leg_has_slopes_too():
    """All the force is used after the wall; before it nothing is known of the motion but where it must be."""
    asked = wall_maneuver(obstacles=[pm.Wall(tip=(0.5, 0.5))])
    found = pm.PeakOracle(asked).peaks(obstacle_times=[[0.9], [0.1]])
    np.testing.assert_allclose([one.obstacle_times[0] for one in found.sensitivities], [2000 * 2**0.5, -2000 * 2**0.5])


@pytest.mark.parametrize("method", [pm.Direct(), pm.Exact()], ids=lambda method: method.kind)
def test_walls_that_can_be_left_out_do_not_matter(method):
    """The straight path crosses their lines beyond the tips, at this time only: M has a kink over it."""
    maneuver = wall_maneuver(obstacles=[pm.Wall(tip=(0.3, -0.2)), pm.Wall(tip=(0.7, -0.2))])
    plan = pm.solve(maneuver, pm.Settings(method=method))
    assert plan.peak == pytest.approx(4, rel=1e-4)
    found = plan.sensitivities
    assert not np.any(found.tips)
    assert not np.any(found.obstacle_times)
    np.testing.assert_allclose(found.goal_position, [4, 0], atol=1e-6)
    assert pm.verify(plan.to_json()).passed
    h, oracle = 1e-4, pm.PeakOracle(maneuver)
    alone, before, after = oracle.peaks(obstacle_times=plan.obstacle_times + np.array([[0, 0], [-h, 0], [h, 0]])).peak
    assert min(before, after) - alone > 5 * h
    assert not np.any(oracle.peaks(obstacle_times=[plan.obstacle_times]).sensitivities[0].obstacle_times)
    # a wall that pushes is not left out
    pushing = pm.solve(wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.01)), pm.Wall(tip=(0.7, -0.2))])).sensitivities
    assert np.any(pushing.tips[0])
    assert not np.any(pushing.tips[1])


def test_slopes_are_those_of_an_optimal_motion_or_not_known():
    """Newton's method does not settle from the multipliers here: what it ends with is no motion to take speeds from."""
    maneuver = pm.Maneuver(
        start=pm.State(position=(0, 0)),
        goal=pm.State(position=(0.3368965761399726, 0.00475931626877543)),
        duration=0.9841438265266302,
        obstacles=[
            pm.Wall(tip=(0.08522538415777355, 0.2120666727495831)),
            pm.Wall(tip=(0.1396766166401227, -0.08778179121489299)),
            pm.Wall(tip=(0.2292633356005748, 0.1816595791611888), direction=(0.1134759940177707, 1)),
        ],
    )
    times, h = np.array([0.18713717113549697, 0.7328759862801887, 0.8777829690062212]), 1e-6
    found = pm.PeakOracle(maneuver).peaks(obstacle_times=times + h * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]))
    slopes = (found.peak[1:4] - found.peak[4:]) / (2 * h)
    stated = found.sensitivities[0].obstacle_times
    assert np.all(np.isnan(stated) | (np.abs(stated - slopes) <= 1e-3 * np.max(np.abs(slopes))))


def test_queries_past_blocks_may_need_different_numbers_of_walls():
    """From beside the block no wall is needed; what is not there is NaN, and slopes are those of the plan's own."""
    block = pm.Block(vertices=[(0.4, -0.2), (0.5, -0.2), (0.5, 0.2), (0.4, 0.2)])
    settings = pm.Settings(grid=pm.Aligned(steps=40), search=pm.GlobalSearch(gap=0.05))
    oracle = pm.PeakOracle(wall_maneuver(obstacles=[block]), settings)
    found = oracle.peaks(start=[[0, 0], [0, 2]])
    assert found.obstacle_times.shape == (2, 1)
    assert np.isnan(found.obstacle_times[:, 0]).tolist() == [False, True]
    for start, slopes in zip([[0, 0], [0, 2]], found.sensitivities, strict=True):
        stated = oracle.plan(start=start).sensitivities
        assert slopes.tips.shape == stated.tips.shape
        np.testing.assert_allclose(slopes.goal_position, stated.goal_position, atol=1e-6)


def test_an_oracle_can_be_sent_to_another_process():
    oracle = pickle.loads(pickle.dumps(pm.PeakOracle(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=40)))))
    assert oracle.peak() == pm.PeakOracle(oracle.maneuver, oracle.settings).peak()
