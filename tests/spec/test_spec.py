import copy
import json

import numpy as np
import pytest

import peakmin as pm

GOOD = {
    "version": 1,
    "maneuver": {
        "start": {"position": [0.0, 0.0], "velocity": [0.0, 0.0]},
        "goal": {"position": [1.0, 0.0]},
        "duration": 1.0,
        "mass": 2.0,
        "obstacles": [{"kind": "wall", "tip": [0.5, 0.5]}],
    },
    "settings": {
        "circle": {"kind": "polygon", "segments": 3},
        "grid": {"kind": "uniform", "steps": 50},
        "method": {"kind": "bisection", "upper": 15.0, "tolerance": 0.01},
        "search": {"kind": "sweep", "start": 0.1, "stop": 0.9, "count": 5},
        "solver": "CLARABEL",
    },
}


def changed(path, value):
    spec = copy.deepcopy(GOOD)
    here = spec
    for key in path[:-1]:
        here = here[key]
    here[path[-1]] = value
    return json.dumps(spec)


def test_json_round_trip():
    spec = pm.Spec.from_json(json.dumps(GOOD))
    assert pm.Spec.from_json(spec.to_json()) == spec
    assert spec.maneuver.obstacles[0].direction == (0.0, -1.0)


def test_no_time_limit_is_written_as_null():
    assert pm.Settings().time_limit == 30
    for limit in (None, 30.0, 2.0):
        settings = pm.Settings.from_json(json.dumps({"time_limit": limit}))
        assert settings.time_limit == limit
        assert json.loads(settings.to_json())["time_limit"] == limit
        spec = pm.Spec.from_json(json.dumps(GOOD)).model_copy(update={"settings": settings})
        assert pm.Spec.from_json(spec.to_json()) == spec


def test_every_search_accepts_a_gap():
    for search in (pm.GlobalSearch, pm.SweepSearch, pm.RefineSearch):
        assert search().accept == 0.05
        assert search(accept=0.5).accept == 0.5


def test_schema_names_every_field_and_refuses_others():
    schema = pm.schema()
    assert schema["additionalProperties"] is False
    assert set(schema["$defs"]["Maneuver"]["properties"]) == set(pm.Maneuver.model_fields)


@pytest.mark.parametrize(
    ("path", "value", "names"),
    [
        (("maneuver", "duration"), 0, "maneuver.duration: was 0, must be a number above zero"),
        (("maneuver", "duration"), -1.5, "maneuver.duration: was -1.5, must be a number above zero"),
        (("maneuver", "duration"), float("nan"), "maneuver.duration: was nan, must be a finite number"),
        (("maneuver", "duration"), float("inf"), "maneuver.duration: was inf, must be a finite number"),
        (("maneuver", "duration"), "1", "maneuver.duration: was '1', must be a number"),
        (("maneuver", "duration"), True, "maneuver.duration: was True, must be a number"),
        (("maneuver", "mass"), 0, "maneuver.mass: was 0, must be a number above zero"),
        (("maneuver", "mass"), None, "maneuver.mass: was None, must be a number"),
        (("maneuver", "extra"), 1, "maneuver.extra: was 1, must be left out"),
        (("maneuver", "start"), {"velocity": [0, 0]}, "maneuver.start.position: was missing, must be given"),
        (("maneuver", "start", "position"), [0, float("nan")], "maneuver.start.position[1]: was nan"),
        (("maneuver", "start", "position"), [0], "maneuver.start.position[1]: was missing"),
        (("maneuver", "start", "position"), [0, 1, 2], "maneuver.start.position: was [0, 1, 2]"),
        (("maneuver", "goal", "position"), [0, 1e200], "maneuver.goal.position[1]: was 1e+200, must be a number of at"),
        (("maneuver", "obstacles", 0, "tip"), ["0", 1], "maneuver.obstacles[0].tip[0]: was '0', must be a number"),
        (("maneuver", "obstacles", 0, "kind"), "hole", "maneuver.obstacles[0].kind: was 'hole'"),
        (
            ("maneuver", "obstacles", 0, "direction"),
            [0, 0],
            "maneuver.obstacles[0].direction: was [0.0, 0.0], must not",
        ),
        (("maneuver", "obstacles"), [{"tip": [0.5, 1]}] * 2, "maneuver.obstacles[1]: was the same wall"),
        (
            ("maneuver", "obstacles"),
            [{"tip": [0.7, 1]}, {"tip": [0.2, 1]}],
            "maneuver.obstacles[1].tip: was [0.2, 1.0]",
        ),
        (("maneuver", "obstacles"), [{"tip": [0.1 * i, 1]} for i in range(1, 9)], "settings.search.count: was 5, must"),
        (("settings", "grid", "steps"), 0, "settings.grid.steps: was 0"),
        (("settings", "grid", "steps"), 2, "settings.grid.steps: was 2, must be at least 3"),
        (("settings", "grid", "steps"), 1.5, "settings.grid.steps: was 1.5, must be a"),
        (("settings", "circle", "segments"), 0, "settings.circle.segments: was 0"),
        (("settings", "circle", "kind"), "square", "settings.circle.kind: was 'square', must be one of"),
        (("settings", "search", "start"), 0, "settings.search.start: was 0, must be"),
        (("settings", "search", "start"), 1.0, "settings.search.start: was 1.0, must be between 0 and the duration"),
        (("settings", "search", "stop"), 2.0, "settings.search.stop: was 2.0, must be between 0 and the duration"),
        (("settings", "search", "accept"), 0, "settings.search.accept: was 0, must be a number above zero"),
        (("settings", "search", "accept"), 1, "settings.search.accept: was 1, must be less than 1"),
        (("settings", "time_limit"), 0, "settings.time_limit: was 0, must be a number above zero"),
        (("settings", "search", "start"), 0.95, "settings.search.start: was 0.95, must not be after stop"),
        (("settings", "solver"), "GUROBI", "settings.solver: was 'GUROBI', must be"),
        (("version",), 2, "version: was 2, must be 1"),
    ],
)
def test_each_wrong_field_gives_one_line_with_its_path(path, value, names):
    with pytest.raises(pm.SpecError) as error:
        pm.Spec.from_json(changed(path, value))
    message = str(error.value)
    assert message.startswith(names), message
    assert "\n" not in message
    assert len(message) < 400
    assert " must" in message


def test_a_solver_that_cannot_do_discs_is_refused():
    with pytest.raises(pm.SpecError, match=r"^solver: was 'OSQP', must be CLARABEL or SCS for a disc$"):
        pm.Settings(solver="OSQP")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[",
        "3",
        "null",
        '{"maneuver": NaN}',
        '{"version": 1, "version": 1}',
        "[" * 100_000,
        b"\xff\xfe",
        '"' + "x" * 10**6,
    ],
)
def test_what_is_no_spec_gives_one_short_line(text):
    with pytest.raises(pm.SpecError) as error:
        pm.Spec.from_json(text)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_construction_in_python_refuses_in_one_line_and_takes_arrays():
    with pytest.raises(pm.SpecError, match=r"^duration: was -1, must be a number above zero"):
        pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=-1)
    assert pm.State(position=np.array([1, 2])).position == (1.0, 2.0)


def test_specs_are_frozen():
    with pytest.raises(Exception, match="frozen"):
        pm.State(position=(0, 0)).position = (1, 1)


@pytest.mark.parametrize(
    "far",
    [
        {"goal": pm.State(position=(1e80, 0))},
        {"goal": pm.State(position=(1, 0), velocity=(0, 1e86))},
        {"obstacles": [pm.Wall(tip=(0.5, -1e80))]},
    ],
)
def test_plans_whose_numbers_no_file_holds_are_not_asked_for(far):
    ask = {"start": pm.State(position=(0, 0)), "goal": pm.State(position=(1, 0)), "duration": 1e-6} | far
    with pytest.raises(pm.SpecError, match=r"^duration: was 1e-06, must be longer for a way of 1e\+80 m$"):
        pm.Maneuver(**ask)
    pm.Maneuver(**(ask | {"duration": 1.0}))
