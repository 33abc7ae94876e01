"""What the terminal says: the same sentences for every kind of plan, tables of fixed width without colours."""

import json
from dataclasses import replace

import numpy as np
import pytest

import peakmin as pm
from peakmin import files
from peakmin.plan.reason import reason
from peakmin.queries.study.table import Study
from peakmin.view import hints, words
from tests.conftest import wall_maneuver
from tests.view.test_pictures import arm_plan

ROW = {"spec": "0", "a": 1, "status": "solved", "peak": 8.5, "lower_bound": 8.25, "gap": 0.02941, "scope": "all"}
ROW |= {"obstacle_times": [0.5, 0.75], "reason": None, "error": None}


def study(*rows):
    return Study(tuple({**ROW, **row} for row in rows), ("a",))


def test_a_study_is_columns_of_fixed_width():
    long = "x" * 300
    shown = words.study_table(
        study({}, {"a": 100.0, "status": "failed", "peak": None, "error": f"[red]a[/red] {long}"})
    )
    assert shown.splitlines() == [
        "  a  status  peak [m/s²]  lower bound      gap  T_obs [s]",
        "  1  solved          8.5         8.25  2.9e-02  0.5 0.75",
        f"100  failed                      8.25  2.9e-02  [red]a[/red] {long}",
        "Study(2 rows: 1 solved, 1 failed)",
    ]


def test_a_long_study_shows_its_first_rows(monkeypatch):
    monkeypatch.setattr(words, "ROWS", 2)
    assert words.study_table(study({}, {}, {})).splitlines()[3:] == ["  and 1 rows more", "Study(3 rows: 3 solved)"]


@pytest.mark.parametrize("kind", ["point", "arm"])
def test_every_kind_of_plan_is_told_in_the_same_lines(kind):
    plan = arm_plan() if kind == "arm" else pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10)))
    plan = replace(plan, maneuver=plan.maneuver.model_copy(update={"max_peak": plan.peak / 2}), status="unknown")
    lines = words.describe(plan).splitlines()
    assert lines[0].startswith(
        f"unknown: the path found, which does not keep all that was asked, has peak {plan.peak:.9g}"
    )
    assert lines[1] == f"  max_peak        {plan.peak / 2:.9g} m/s²: not proved to be impossible"
    names = [line[2:18].rstrip() for line in lines[1:]]
    assert names[:3] == ["max_peak", "lower bound", "gap"]
    assert "clearance" in names
    assert names[-1] == "made by"
    assert names.index("unknown") < names.index("try")
    assert all(line.startswith("  ") and line[16:18] == "  " for line in lines[1:])


def test_the_first_line_has_the_gap_of_what_keeps_everything():
    plan = pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10)))
    for status, more in (("solved", ""), ("feasible", ", more than the 0.05 accepted")):
        lines = words.describe(replace(plan, status=status)).splitlines()
        assert lines[0] == (
            f"{status}: peak {plan.peak:.9g} m/s², peak base force {plan.peak_force:.9g} N, gap {plan.gap:.2e}"
        )
        assert f"  gap             {plan.gap:.2e} of the peak{more}" in lines
    assert "gap" not in words.describe(replace(plan, status="unknown")).splitlines()[0]


def test_what_a_limit_left_of_the_gap_is_said():
    plan = pm.solve(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10)))
    assert not any(line.startswith("  stopped") for line in words.describe(plan).splitlines())
    ended = replace(plan, made=replace(plan.made, stopped=True, seconds=28.61))
    assert f"  stopped         after 28.6 s with a gap of {plan.gap:.2e}" in words.describe(ended).splitlines()
    none = replace(ended, trajectory=None, peak=np.inf, status="unknown")
    assert "  stopped         after 28.6 s" in words.describe(none).splitlines()
    assert reason(none) == f"no motion was found; no peak is below {plan.lower_bound:.6g} m/s²; stopped after 28.6 s"
    assert reason(plan) is None


def test_a_table_as_text_has_all_digits_and_quotes_what_must_be():
    rows = np.array([[0.1, 1e-300], [1 / 3, np.inf]]).tolist()
    assert files.csv_text(["a", "b, c"], rows) == 'a,"b, c"\n0.1,1e-300\n0.3333333333333333,inf\n'


def test_sweeps_and_plans_are_the_same_table_as_their_numbers():
    found = pm.sweep(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=10)), times=[0.4, 0.5])
    head, *rows = found.to_csv().splitlines()
    assert head == "T_1,peak,lower"
    assert [json.loads(f"[{row}]") for row in rows] == np.column_stack(
        [found.obstacle_times, found.peak, found.lower]
    ).tolist()
    head, *rows = found.best.to_csv().splitlines()
    assert head == "t,x,y,vx,vy,ax,ay"
    t = found.best.times
    assert [json.loads(f"[{row}]") for row in rows] == np.column_stack(
        [t, found.best.position(t), found.best.velocity(t), found.best.acceleration(t)]
    ).tolist()


def test_units_that_may_not_be_meant_are_pointed_out():
    link = {"length": 1.0, "mass": 1.0}
    ends = {"start": pm.Pose(joints=(0.1, 6.29)), "goal": pm.Pose(joints=(0.5, -6.28)), "duration": 1.0}
    links = [pm.Link(**link | {"length": 400.0}, max_speed=90.0), pm.Link(**link, max_speed=20.0)]
    assert hints.units(pm.ArmManeuver(arm=pm.Arm(links=[pm.Link(**link)] * 2), **ends | {"start": ends["goal"]})) == []
    assert [one.split(maxsplit=1)[1] for one in hints.units(pm.ArmManeuver(arm=pm.Arm(links=links), **ends))] == [
        "start.joints[1] is 6.29 rad, 1 turns",
        "arm.links[0].max_speed is 90 rad/s, 14.3 turns a second: not degrees?",
        "arm.links[0].length is 400 m: not mm?",
    ]
    far = wall_maneuver(goal=pm.State(position=(300, 400)), obstacles=())
    assert hints.units(far) == ["  metres          start and goal are 500 m apart, 2e+03 m/s² in 1 s: not mm?"]
    assert hints.units(far.model_copy(update={"duration": 100.0})) == []
    assert hints.units(wall_maneuver()) == []
    assert "not mm?" in words.facts(pm.solve(far))
