"""Explanations: the entries named do conflict, none of them is idle, and every change that is offered was solved."""

import functools
import json
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest

import peakmin as pm
from peakmin.cli import main
from peakmin.deadline import after
from peakmin.proofs.branch_and_bound import least_over_times
from peakmin.queries.explain import why_not
from peakmin.queries.point_reasons import PointReasons
from peakmin.queries.repairs import Trials, downwards, upwards
from peakmin.scenes.impossible import impossible, least_way
from peakmin.search.solve import solve
from peakmin.spec.spec import read_spec
from tests.conftest import ALL

WALL = pm.Wall(tip=(0.7, 0.3))
POST = pm.Block(vertices=[(0.4, -0.2), (0.5, -0.2), (0.5, 0.3), (0.4, 0.3)])
ASIDE = pm.Block(vertices=[(0.7, -0.1), (0.75, -0.1), (0.75, 0.05), (0.7, 0.05)])
STRIP = [(-0.1, -0.1), (1.1, -0.1), (1.1, 0.2), (-0.1, 0.2)]
COARSE = pm.Settings(grid=pm.Aligned(steps=40))
# a region or a speed is kept at the nodes nearest to the times that are best without it: no other times are tried
HELD = pm.Settings(grid=pm.Uniform(steps=40), search=pm.GlobalSearch(gap=0.02))


def maneuver(**changes):
    start, goal = pm.State(position=(0, 0)), pm.State(position=(1, 0))
    return pm.Maneuver(**({"start": start, "goal": goal, "duration": 1, "obstacles": [WALL]} | changes))


CASES = {
    "peak": (
        maneuver(max_peak=5),
        {"obstacles[0]", "max_peak", "duration"},
        {"max_peak", "duration", "obstacles[0].tip"},
    ),
    "one of two walls": (
        maneuver(obstacles=[pm.Wall(tip=(0.3, 0.1)), pm.Wall(tip=(0.7, 0.5))], max_peak=8),
        {"obstacles[1]", "max_peak", "duration"},
        {"max_peak", "duration", "obstacles[1].tip"},
    ),
    "the way alone": (maneuver(max_peak=3.9), {"max_peak", "duration"}, {"max_peak", "duration"}),
    "speed": (maneuver(max_speed=0.9), {"max_speed", "duration"}, {"max_speed", "duration"}),
    "speed past a wall": (
        maneuver(max_speed=1.1, obstacles=[pm.Wall(tip=(0.5, 0.5))]),
        {"max_speed", "duration", "obstacles[0]"},
        {"max_speed", "duration"},
    ),
    "region": (maneuver(region=STRIP), {"region", "obstacles[0]"}, {"obstacles[0].tip"}),
    "closed": (maneuver(region=STRIP, obstacles=[ASIDE, POST]), {"region", "obstacles[1]"}, {"region", "obstacles[1]"}),
}


SOME = CASES if ALL else ("peak", "the way alone", "speed", "region")


@functools.cache
def explained(name):
    """The plan of a case, its explanation, and the plans that were tried for it."""
    tried = {}

    def told(task, *settings, **stopped):
        tried[task] = solve(task, *settings, **stopped)
        return tried[task]

    asked = CASES[name][0]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("peakmin.queries.repairs.solve", told)
        plan = pm.solve(asked, COARSE if asked.simple else HELD)
        why = pm.explain(plan)
    return plan, why, tried


@pytest.mark.parametrize("name", SOME)
def test_conflicts_and_repairs(name):
    _, conflict, repaired = CASES[name]
    plan, why, tried = explained(name)
    assert plan.status == "infeasible"
    assert pm.verify(plan.to_json()).passed
    assert set(why.conflict) == conflict
    assert repaired <= {one.field for one in why.repairs}
    assert [one.cost for one in why.repairs] == sorted(one.cost for one in why.repairs)
    for one in why.repairs:
        there = tried[one.maneuver]
        assert there.keeps
        assert there.peak == one.peak
        assert pm.verify(there.to_json()).passed
        words = {"obstacles[0].tip": "obstacles"}.get(one.field, one.field.split("[")[0])
        assert words in one.text


def test_changes_are_as_small_as_they_get():
    why = explained("peak")[1]
    least = {one.field: one for one in why.repairs}
    free = pm.solve(maneuver(), COARSE).peak
    assert least["max_peak"].maneuver.max_peak == pytest.approx(free, rel=1e-2)
    assert least["duration"].maneuver.duration == pytest.approx(pm.shortest(maneuver(), 5.0).duration, rel=1e-2)
    lower = least["obstacles[0].tip"].maneuver.walls[0].tip[1]
    above = maneuver(obstacles=[pm.Wall(tip=(0.7, lower + 0.002))], max_peak=5)
    assert pm.solve(above, COARSE).status == "infeasible"


def test_what_can_be_done_is_not_explained():
    assert pm.explain(pm.solve(maneuver())) is None
    assert pm.explain(maneuver()) is None


def test_a_plan_has_its_own_settings():
    with pytest.raises(pm.SpecError, match="settings: was given beside a plan, must be left out"):
        pm.explain(pm.solve(maneuver()), COARSE)


def test_no_path_is_shorter_than_the_least_way():
    rng = np.random.default_rng(0)
    for _ in range(60):
        q = int(rng.integers(0, 4))
        walls = [
            pm.Wall(
                tip=tuple(rng.uniform(-1, 2, 2)),
                direction=tuple(rng.normal(size=2)),
                contact=str(rng.choice(["clear", "touch"])),
            )
            for _ in range(q)
        ]
        asked = maneuver(obstacles=()).model_copy(update={"obstacles": tuple(walls)})
        bound = least_way(asked)
        free = np.array([-np.array(w.direction) / np.hypot(*w.direction) for w in walls]).reshape(-1, 2)
        tips = np.array([w.tip for w in walls]).reshape(-1, 2)
        moves = np.array([w.contact == "clear" for w in walls])
        s = np.abs(rng.normal(size=(4000, q))) * rng.choice([0, 0.1, 1, 3], (4000, 1)) * moves
        points = np.concatenate(
            [np.zeros((4000, 1, 2)), tips + s[..., None] * free, np.tile([[[1.0, 0]]], (4000, 1, 1))], axis=1
        )
        lengths = np.sum(np.linalg.norm(np.diff(points, axis=1), axis=-1), axis=1)
        assert bound <= lengths.min()
        assert bound >= 1 - 1e-6
        if not np.any(moves):
            assert bound == pytest.approx(lengths.min(), rel=1e-6)


def test_a_touching_pair_of_blocks_does_not_close_a_region():
    halves = [pm.Block(vertices=[(0.4, -0.2), (0.5, -0.2), (0.5, 0.05), (0.4, 0.05)])]
    halves += [pm.Block(vertices=[(0.5, 0.05), (0.6, 0.05), (0.6, 0.3), (0.5, 0.3)])]
    assert impossible(maneuver(region=STRIP, obstacles=halves)) is None
    overlapping = [halves[0], pm.Block(vertices=[(0.49, 0.04), (0.6, 0.04), (0.6, 0.3), (0.49, 0.3)])]
    assert impossible(maneuver(region=STRIP, obstacles=overlapping)).fields[0] == "region"


@pytest.mark.parametrize(("far", "size"), [(0.0, 1.0), (5.4e6, 0.1), (1e6, 1e-6), (1e6, 1.0)])
def test_places_far_from_the_origin_close_nothing(far, size):
    def at(*corners):
        return [(far + x * size, far + y * size) for x, y in corners]

    ends = {name: pm.State(position=place) for name, place in zip(("start", "goal"), at((0, 0), (2, 0)), strict=True)}
    block = pm.Block(vertices=at((0.5, -1), (1.5, -1), (1.5, 0.5), (0.5, 0.5)))
    region = at((-1, -1), (3, -1), (3, 1), (-1, 1))
    assert impossible(maneuver(**ends, obstacles=[block], region=region)) is None
    if size > 1e-3:
        closed = pm.Block(vertices=at((0.5, -2), (1.5, -2), (1.5, 2), (0.5, 2)))
        assert impossible(maneuver(**ends, obstacles=[closed], region=region)) is not None


def test_a_gap_of_just_the_margin_on_both_sides_does_not_close_a_region():
    pair = [pm.Block(vertices=[(0.4, s * 0.0625), (0.5, s * 0.0625), (0.5, s), (0.4, s)]) for s in (-1.0, 1.0)]
    assert impossible(maneuver(region=STRIP, obstacles=pair, margin=0.0625)) is None
    assert impossible(maneuver(region=STRIP, obstacles=pair, margin=0.063)).fields[-1] == "margin"


def test_the_same_wall_twice_keeps_its_names():
    wall = pm.Wall(tip=(0.3, 0.9), direction=(1, -1))
    shown = impossible(maneuver(obstacles=[wall, pm.Wall(tip=(0.5, 0.2)), wall], max_speed=1.2))
    assert shown.fields[2:] == ("obstacles[0]", "obstacles[1]", "obstacles[2]")


def test_an_explanation_keeps_its_time():
    walls = [pm.Wall(tip=(0.1 * k, 0.3 * (-1) ** k), direction=(0, (-1) ** (k + 1))) for k in range(1, 7)]
    began = time.process_time()
    why = pm.explain(maneuver(obstacles=walls, max_peak=5), pm.Settings(time_limit=1))
    assert time.process_time() - began < 4
    assert not why.complete
    assert "it ended before" in str(why)


@pytest.mark.parametrize(("x", "up"), [(1.2643, 1.27), (8.537415, 8.54), (0.03091, 0.031), (1.0, 1.0), (99.91, 100.0)])
def test_numbers_are_rounded_up(x, up):
    assert upwards(x) == up


@pytest.mark.parametrize(
    ("x", "down"), [(1.2643, 1.26), (0.12499999, 0.124), (0.125, 0.125), (0.1 + 0.2, 0.3), (99.99, 99.9), (0.0, 0.0)]
)
def test_numbers_are_rounded_down(x, down):
    assert downwards(x) == down


@pytest.mark.skipif(not ALL, reason="it searches until its time limits")
@pytest.mark.parametrize("gap", [0.25, 0.28])
def test_the_widest_margin_that_leaves_a_way_comes_before_leaving_out(gap):
    """Of two blocks that close the region by their margin it is nearly half the gap, and below it."""
    pair = [
        pm.Block(vertices=[(1.4, -1), (1.6, -1), (1.6, -0.1), (1.4, -0.1)]),
        pm.Block(vertices=[(1.4, gap - 0.1), (1.6, gap - 0.1), (1.6, 1), (1.4, 1)]),
    ]
    region = [(-0.5, -1), (3.5, -1), (3.5, 1), (-0.5, 1)]
    asked = maneuver(goal=pm.State(position=(3, 0)), duration=4, obstacles=pair, region=region, margin=0.16)
    why = pm.explain(asked, COARSE.model_copy(update={"time_limit": 20}))
    assert set(why.conflict) == {"obstacles[0]", "obstacles[1]", "region", "margin"}
    fields = [one.field for one in why.repairs]
    first = why.repairs[fields.index("margin")]
    assert fields.index("margin") < fields.index("obstacles[0]")
    assert first.text == f"margin 0.16 m is too wide: {first.maneuver.margin:g} m would do"
    assert 0.96 * gap / 2 < first.maneuver.margin < gap / 2
    assert pm.solve(first.maneuver, COARSE.model_copy(update={"time_limit": 4})).keeps


def test_the_terminal_says_why(tmp_path, capsys):
    file = tmp_path / "spec.json"
    file.write_text(pm.Spec(maneuver=maneuver(max_peak=5)).to_json())
    with pytest.raises(SystemExit) as left:
        main(["solve", str(file)])
    said = capsys.readouterr().out
    assert left.value.code == 3
    assert re.search(r"duration 1 s is too short: 1\.\d+ s would do", said)
    assert re.search(r"lower obstacles\[0\].tip by 0\.\d+ m", said)
    assert re.search(r"raise max_peak to 6\.\d+ m/s²", said)
    with pytest.raises(SystemExit):
        main(["explain", str(file), "--json"])
    told = json.loads(capsys.readouterr().out)["explanation"]
    assert told["conflict"] == ["obstacles[0]", "max_peak", "duration"]
    assert len(told["repairs"]) == 3


def test_what_is_too_slow_between_moving_ends_is_too_long():
    """At 1 m/s from end to end: in 1 s no force is needed, in 1.25 s one must stop on the way."""
    asked = pm.Maneuver(
        start=pm.State(position=(0, 0), velocity=(1, 0)),
        goal=pm.State(position=(1, 0), velocity=(1, 0)),
        duration=1.25,
        max_peak=0.5,
    )
    first = pm.explain(asked).repairs[0]
    assert "too long" in first.text
    assert 1.1 < first.maneuver.duration < 1.25
    assert f"{first.maneuver.duration:g} s would do" in first.text
    assert pm.solve(first.maneuver).status == "solved"


def test_what_refuted_is_what_is_said_even_when_the_time_is_over():
    """Nine blocks in two seconds: the bound in the words is above max_peak, and nothing was found in this time."""
    spec = read_spec(Path(__file__).parent.parent.parent / "examples" / "cluttered.json")
    asked = spec.maneuver.model_copy(update={"max_peak": 2.2759})
    why = why_not(asked, pm.Settings(), 2.346, after(0.3))
    assert "max_peak 2.2759 m/s² is below 2.346 m/s²" in why.because
    assert why.repairs == ()
    assert not why.complete
    assert str(why).count("in this time") == 1


@pytest.mark.skipif(not ALL, reason="six seconds: `make proofs` runs it")
def test_a_speed_that_is_enough_is_nearly_the_least():
    """By 1.15 m/s it can be done, by 1.1 m/s it was not: a quick look alone asks for 1.3 m/s."""
    walls = [pm.Wall(tip=(0.6, 0.5)), pm.Wall(tip=(1.3, -0.2), direction=(0, 1))]
    asked = maneuver(goal=pm.State(position=(2, 0)), duration=2.5, max_speed=0.7, obstacles=walls)
    (speed,) = PointReasons(asked, 0.0, Trials(COARSE, math.inf)).repairs(("max_speed",))
    assert speed.maneuver.max_speed <= 1.2


def test_walls_that_cannot_be_neighbours_are_not_left_alone_with_each_other(monkeypatch):
    """Without the second one, the first and the third stand on one line: that is no maneuver, and no reason to refuse."""
    walls = [pm.Wall(tip=(0.5, 0.2)), pm.Wall(tip=(0.6, 0.3), direction=(0.01, -1)), pm.Wall(tip=(0.5, 0.3))]
    settings = pm.Settings(grid=pm.Aligned(steps=40), search=pm.GlobalSearch(gap=0.02))
    monkeypatch.setattr(PointReasons, "repairs", lambda *_: iter(()))
    why = why_not(maneuver(obstacles=walls, max_peak=5.5), settings, 5.6, after(60))
    assert why.conflict == ("obstacles[1]", "max_peak", "duration")


def test_quick_looks_end_with_the_explanation(monkeypatch):
    untils = []

    def told(*args, until=math.inf, **options):
        untils.append(until)
        return least_over_times(*args, until=until, **options)

    monkeypatch.setattr("peakmin.queries.point_reasons.least_over_times", told)
    assert pm.explain(CASES["speed past a wall"][0], pm.Settings(grid=pm.Aligned(steps=40), time_limit=2)) is not None
    assert untils
    assert all(np.isfinite(untils))
