"""Tasks drawn before they are solved, also those that are refused."""

import copy
import io
import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

import peakmin as pm
from peakmin import cli
from peakmin.spec.spec import spec_of
from peakmin.view import pictures, refused
from peakmin.view.style import RED

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SQUARE = [[0.4, -0.1], [0.6, -0.1], [0.6, 0.2], [0.4, 0.2]]
POINT = {
    "maneuver": {
        "start": {"position": [0, 0]},
        "goal": {"position": [1, 0]},
        "duration": 1.0,
        "region": [[-0.5, -0.5], [1.5, -0.5], [1.5, 1], [-0.5, 1]],
        "obstacles": [{"kind": "wall", "tip": [0.2, 0.3]}, {"kind": "block", "vertices": SQUARE}],
    }
}
LINK = {"length": 1.0, "mass": 1.0}
ARM = {
    "arm": {"links": [LINK, LINK]},
    "maneuver": {
        "start": {"joints": [0.0, 1.0]},
        "goal": {"tip": [1.2, 0.9], "elbow": "up"},
        "duration": 1.0,
        "obstacles": [{"vertices": [[3, 0], [4, 0], [4, 1]]}],
    },
}


def changed(data, path, value):
    data = copy.deepcopy(data)
    *way, last = path
    here = data
    for key in way:
        here = here[key]
    here[last] = value
    return data


def sketched(data):
    """The drawing of a spec that is refused, and the names of what is red in it."""
    with pytest.raises(pm.SpecError) as said:
        spec_of(data)
    ax = refused.sketch(data, str(said.value))
    drawn = [*((line, line.get_color()) for line in ax.lines), *((one, one.get_edgecolor()) for one in ax.patches)]
    red = {one.get_label() for one, colour in drawn if to_hex(colour).upper() == RED}
    assert ax.get_title().replace("\n", " ") == str(said.value)
    assert to_hex(ax.title.get_color()).upper() == RED
    ax.figure.canvas.draw()
    names = set(ax.get_legend_handles_labels()[1])
    plt.close("all")
    return names, {name for name in red if not name.startswith("_")}


@pytest.mark.parametrize(
    ("data", "red"),
    [
        (changed(POINT, ("maneuver", "obstacles", 1, "vertices"), [[0.9, -1], [1.1, -1], [1.1, 1], [0.9, 1]]), "block"),
        (changed(POINT, ("maneuver", "obstacles", 0, "contact"), "near"), "wall"),
        (changed(POINT, ("maneuver", "goal", "position"), [2, 0]), "goal"),
        (changed(POINT, ("maneuver", "start", "velocity"), [0, "fast"]), "start"),
        (changed(POINT, ("maneuver", "region", 3), [-0.5, None]), "region"),
        (changed(ARM, ("maneuver", "goal", "tip"), [1.9, 0.9]), "tip at the goal"),
        (changed(ARM, ("maneuver", "start", "joints"), [0.0, 1.0, 2.0]), "arm at the start"),
        (changed(ARM, ("maneuver", "obstacles", 0, "vertices"), [[0.5, -1], [0.6, -1], [0.6, 1]]), "block"),
        (changed(ARM, ("arm", "base"), [0.0, 0.0, 0.0]), None),
        (changed(POINT, ("maneuver", "duration"), -1.0), None),
        (changed(POINT, ("settings",), {"solver": "$x$"}), None),
    ],
)
def test_what_is_wrong_is_red_and_nothing_else(data, red):
    names, found = sketched(data)
    assert found == (set() if red is None else {f"{red}, refused"})
    assert found <= names
    if data is not None and red is not None:
        assert len(names) >= 4


def test_a_link_that_is_wrong_is_red_in_both_poses():
    data = changed(ARM, ("arm", "links"), [LINK, LINK | {"com": 3.0}])
    with pytest.raises(pm.SpecError) as said:
        spec_of(data)
    ax = refused.sketch(data, str(said.value))
    red = [line.get_xydata() for line in ax.lines if to_hex(line.get_color()).upper() == RED]
    plt.close("all")
    assert len(red) == 2
    np.testing.assert_allclose(red[0], [[1, 0], [1 + np.cos(1), np.sin(1)]])
    np.testing.assert_allclose(red[1][1], [1.2, 0.9])


@pytest.mark.parametrize(
    "data",
    [
        {"maneuver": None},
        {"maneuver": []},
        {"maneuver": {"obstacles": {"tip": 1}, "start": 3, "region": "here"}},
        {"maneuver": {"obstacles": [None, {"tip": [float("nan"), 1]}, {"tip": [1e300, 0]}, {"vertices": [1, [2]]}]}},
        {"arm": None, "maneuver": {}},
        {"arm": {"links": 3, "base": "x"}, "maneuver": {"start": {"joints": "all"}}},
        {"arm": {"links": [{"length": -1}, {"length": None}]}, "maneuver": {"start": {"joints": [[], True]}}},
        {"arm": {"links": []}, "maneuver": {"start": {"joints": [1, 2]}, "goal": {"tip": [1, 1], "elbow": []}}},
        {"arm": {"links": [LINK, LINK]}, "maneuver": {"goal": {"tip": [1, 1], "elbow": 7}, "start": {"joints": []}}},
    ],
)
def test_anything_is_drawn_without_an_error(data):
    sketched(data)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.json")), ids=lambda path: path.stem)
def test_examples_are_drawn_whole_and_as_they_are(path):
    data = json.loads(path.read_text())
    if "maneuver" not in data:
        pytest.skip("a study")
    ax = pictures.problem(spec_of(data).task)
    beside = refused.sketch(data, "")
    shapes = [sorted(len(one.get_xy()) for one in each.patches) for each in (ax, beside)]
    plt.close("all")
    obstacles = data["maneuver"].get("obstacles", [])
    assert len(shapes[1]) == sum("vertices" in one for one in obstacles) + ("region" in data["maneuver"])
    assert len(shapes[0]) >= len(shapes[1])


def call(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        cli.main([str(one) for one in arguments])
    said = capsys.readouterr()
    return end.value.code, said.out, said.err


def test_the_terminal_draws_what_it_refuses_too(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, data in (
        ("good", POINT),
        ("arm", ARM),
        ("bad", changed(POINT, ("maneuver", "goal", "position"), [2, 0])),
    ):
        (tmp_path / f"{name}.json").write_text(json.dumps(data))
    assert call(capsys, "show", "good.json") == (0, "wrote good.png\n", "")
    assert call(capsys, "show", "arm.json", "--out", "o/arm.png") == (0, "wrote o/arm.png\n", "")
    status, out, err = call(capsys, "show", "bad.json")
    assert (status, out, err.count("\n")) == (2, "wrote bad.png\n", 1)
    assert err.startswith("peakmin: maneuver.goal.position: was [2.0, 0.0]")
    for name, red in (("good.png", False), ("bad.png", True)):
        pixels = np.asarray(Image.open(io.BytesIO((tmp_path / name).read_bytes())).convert("RGB"))
        assert np.any(np.all(pixels == tuple(bytes.fromhex(RED[1:])), axis=-1)) == red
    for wrong in (("good.json", "--out", "good.pdf"), ("none.json",)):
        status, out, err = call(capsys, "show", *wrong)
        assert (status, out, err.count("\n")) == (2, "", 1)
    assert {file.name for file in tmp_path.glob("*.p*")} == {"good.png", "bad.png"}
