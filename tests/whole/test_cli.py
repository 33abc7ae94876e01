import io
import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import peakmin as pm
from peakmin import cli
from peakmin.view import output
from tests.robots.test_flood import between_bars
from tests.search.test_scenes import assert_free
from tests.solved import solved

EXAMPLES = sorted(
    p
    for p in (Path(__file__).parent.parent.parent / "examples").glob("*.json")
    if not p.name.startswith(("study_", "impossible"))
)
ARM = EXAMPLES[0].parent / "two_link.json"
SCENES = ["tunnel", "two_tables", "wide_box", "non_convex_block", "slalom", "cluttered"]


def run(*arguments):
    return subprocess.run([sys.executable, "-c", "from peakmin.cli import main; main()", *map(str, arguments)],
                          capture_output=True, text=True, timeout=300)  # fmt: skip


def call(capsys, *arguments):
    """In this process: exit status, stdout, stderr."""
    with pytest.raises(SystemExit) as end:
        cli.main([str(a) for a in arguments])
    out = capsys.readouterr()
    return end.value.code, out.out, out.err


@pytest.fixture
def spec(tmp_path):
    def write(**maneuver):
        base = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1.0}
        path = tmp_path / "spec.json"
        path.write_text(
            json.dumps({"maneuver": {**base, **maneuver}, "settings": {"grid": {"kind": "aligned", "steps": 40}}})
        )
        return path

    return write


def test_there_are_five_examples_and_more():
    assert len(EXAMPLES) >= 5


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_examples_solve(path, capsys, monkeypatch):
    """Those with blocks clear of everything: samples say so, too."""
    if "link" in path.stem or path.stem in ("cluttered", "tunnel", "general_problem"):  # other tests look at them, too
        monkeypatch.setattr(cli, "solve", lambda task, settings, *_, **__: solved(task, settings))
    status, out, err = call(capsys, "solve", path, "--json")
    document = json.loads(out)
    assert (status, document["status"], err) == (0, "solved", "")
    assert document["lower_bound"] <= document["peak"]
    for key in ("gap", "peak_force", "obstacle_times", "times", "position", "velocity", "acceleration"):
        assert key in document
    found = pm.verify(out)
    assert found.problems == ()
    if path.stem in SCENES:
        plan = found.plan
        assert plan.clearance >= plan.maneuver.margin
        assert plan.gap <= 1e-3
        assert plan.scope == "all"
        assert_free(plan)


def test_solve_writes_its_files(spec, tmp_path, capsys):
    status, out, _ = call(
        capsys, "solve", spec(obstacles=[{"kind": "wall", "tip": [0.5, 0.2]}]), "--out", tmp_path / "o"
    )
    assert status == 0
    assert "solved: peak" in out
    assert {p.name for p in (tmp_path / "o").iterdir()} == {"plan.json", "plan.csv", "plan.png"}


def test_a_centre_of_mass_is_animated_when_asked(spec, tmp_path, capsys):
    assert call(capsys, "solve", spec(), "--out", tmp_path / "o", "--gif")[0] == 0
    assert (tmp_path / "o" / "plan.gif").read_bytes().startswith(b"GIF89a")


def test_sweep_prints_m_over_the_obstacle_times(spec, tmp_path, capsys):
    path = spec(obstacles=[{"kind": "wall", "tip": [0.5, 0.5]}])
    status, out, _ = call(capsys, "sweep", path, "--json", "--out", tmp_path / "o")
    document = json.loads(out)
    assert status == 0
    assert len(document["obstacle_times"]) == len(document["peak"]) == 18
    assert document["best"]["peak"] == min(document["peak"])
    assert {"sweep.json", "sweep.csv", "sweep.png", "plan.json"} <= {p.name for p in (tmp_path / "o").iterdir()}
    status, out, _ = call(capsys, "sweep", path)
    assert "<- least" in out


def test_schema_is_json_schema(capsys):
    status, out, _ = call(capsys, "schema")
    assert status == 0
    assert json.loads(out) == json.loads(json.dumps(pm.schema()))


def test_infeasible_is_exit_status_3(spec, capsys):
    status, out, err = call(capsys, "solve", spec(max_peak=3.9), "--json")
    assert (status, json.loads(out)["status"], err) == (3, "infeasible", "")


def test_bad_input_is_one_line_and_exit_status_2(spec, tmp_path, capsys):
    ways = [("solve", spec(duration=0)), ("sweep", tmp_path / "none.json"), ("solve", tmp_path)]
    result = run(*ways[0])
    for status, out, err in ((result.returncode, result.stdout, result.stderr), *(call(capsys, *way) for way in ways)):
        assert (status, out) == (2, "")
        assert err.count("\n") == 1
        assert "Traceback" not in err


def test_a_refused_spec_does_not_wait_for_what_solves_and_draws(spec):
    code = (
        "import sys\nfrom peakmin.cli import main\ntry:\n    main()\n"
        "finally:\n    print(sorted({'cvxpy.expressions', 'matplotlib.axes'} & set(sys.modules)))"
    )
    child = [sys.executable, "-c", code, "solve", str(spec(duration=0))]
    result = subprocess.run(child, capture_output=True, text=True, timeout=60, check=False)
    assert (result.returncode, result.stdout) == (2, "[]\n")


def test_numbers_that_are_none_are_null(tmp_path, capsys):
    task = between_bars(0.75, -1.8)  # no way at all: neither the peak nor its bound is a number
    (tmp_path / "plan.json").write_text(pm.solve(task).to_json())
    status, out, _ = call(capsys, "verify", tmp_path / "plan.json", "--json")
    document = json.loads(out, parse_constant=pytest.fail)
    assert (status, document["verified"]) == (0, True)
    assert document["peak"] is document["lower_bound"] is None


def test_wrong_usage_is_exit_status_2(capsys):
    ways = [("solve",), ("fly",), ("solve", "a.json", "--fast")]
    result = run(*ways[0])
    for status, _, err in ((result.returncode, "", result.stderr), *(call(capsys, *way) for way in ways)):
        assert status == 2
        assert "Traceback" not in err


def test_a_folder_that_cannot_be_written_is_refused(spec, tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("")
    status, _, err = call(capsys, "solve", spec(), "--out", blocked / "o")
    assert status == 2
    assert err.count("\n") == 1


def test_the_impossible_example_is_explained(capsys):
    status, out, _ = call(capsys, "explain", EXAMPLES[0].parent / "impossible.json")
    assert status == 3
    assert "raise max_peak to 6.14 m/s²" in out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"durration": 2.5}, "maneuver.duration: was missing, must be given ('durration': no such field)"),
        ({"goal": {"pos": [1, 0]}}, "maneuver.goal.position: was missing, must be given ('pos': no such field)"),
        (
            {"obstacles": [{"tips": [1, 0]}]},
            "maneuver.obstacles[0].tip: was missing, must be given ('tips': no such fi",
        ),
    ],
)
def test_a_misspelt_field_is_named_beside_the_missing_one(tmp_path, capsys, change, words):
    data = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1} | change
    if "durration" in change:
        del data["duration"]
    path = tmp_path / "spec.json"
    path.write_text(json.dumps({"maneuver": data}))
    status, out, err = call(capsys, "solve", path)
    assert (status, out) == (2, "")
    assert err.startswith("peakmin: " + words)


def test_files_of_another_kind_are_called_so(spec, tmp_path, capsys):
    status, out, _ = call(capsys, "solve", spec(), "--out", tmp_path)
    assert status == 0
    assert f"\nwrote {tmp_path}\n" in out
    plan, study, other = tmp_path / "plan.json", tmp_path / "study.json", tmp_path / "plan.csv"
    study.write_text(json.dumps({"base": {}, "grid": {}}))
    for command, path, words in (
        ("solve", plan, "was a plan (see `peakmin verify`), must be a spec"),
        ("solve", study, "was a study file (see `peakmin study`), must be a spec"),
        ("solve", other, "was not JSON"),
        ("verify", other, "was not JSON"),
        ("verify", study, "was a study file (see `peakmin study`), must be a plan"),
        ("verify", spec(), "was a spec (see `peakmin solve`), must be a plan"),
        ("sweep", plan, "was a plan (see `peakmin verify`), must be a spec"),
        ("study", plan, "was a plan (see `peakmin verify`), must be a study file"),
        ("study", other, "was not JSON"),
        ("simulate", plan, "was a plan of a centre of mass, must be one of an arm for `simulate`"),
        ("compare", spec(), "was a spec of a centre of mass, must be one of an arm for `compare`"),
        ("sweep", ARM, "was a spec of an arm, must be one of a centre of mass for `sweep`"),
        ("budget", ARM, "was a spec of an arm, must be one of a centre of mass for `budget`"),
        (["shortest", "--peak", "5"], ARM, "was a spec of an arm, must be one of a centre of mass for `shortest`"),
    ):
        status, out, err = call(capsys, *([command] if isinstance(command, str) else command), path)
        assert (status, out) == (2, "")
        assert err.startswith(f"peakmin: {path}: {words}")
        assert err.count("\n") == 1


def test_what_cannot_be_written_is_refused_before_anything_is_solved(spec, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("peakmin.cli.solve", None)
    monkeypatch.setattr("peakmin.paper.compute", None)
    (tmp_path / "file").write_text("")
    study = tmp_path / "study.json"
    study.write_text(json.dumps({"base": json.loads(spec().read_text()), "grid": {"maneuver.mass": [1.0]}}))
    for arguments, words in (
        (["solve", spec(), "--gif"], "--gif: was given, must come with --out"),
        (["solve", spec(), "--report", tmp_path], f"{tmp_path}: was a folder, must be a file to write"),
        (["solve", spec(), "--report", tmp_path / "file" / "page.html"], "cannot be written"),
        (["study", study, "--out", tmp_path / "rows.txt"], "must be a folder, or end in .csv or .parquet"),
        (["paper", "--out", tmp_path / "file"], "cannot be written"),
        (["shortest", spec(), "--peak", "5", "--out", tmp_path / "file"], "cannot be written"),
        (["export", tmp_path / "file", "--json"], "--json: was given for csv, must come with --out"),
    ):
        status, out, err = call(capsys, *arguments)
        assert (status, out) == (2, "")
        assert words in err
        assert err.count("\n") == 1


def test_a_number_of_very_many_digits_is_called_so(tmp_path, capsys):
    path = tmp_path / "spec.json"
    path.write_text('{"maneuver": {"duration": ' + "1" * 5000 + "}}")
    status, _, err = call(capsys, "solve", path)
    assert status == 2
    assert err == f"peakmin: {path}: was one with a number of too many digits, must have at most 4300\n"


def test_the_version_is_the_package_s(capsys):
    assert call(capsys, "--version") == (0, f"peakmin {pm.__version__}\n", "")


@pytest.mark.parametrize("verb", ["solve", "explain", "sweep", "verify"])
def test_a_file_may_come_by_stdin(verb, spec, capsys, monkeypatch):
    path = spec(obstacles=[{"kind": "wall", "tip": [0.5, 0.2]}])
    if verb == "verify":
        path.write_text(pm.solve(pm.Spec.read(path).task).to_json())
    beside = call(capsys, verb, path)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(path.read_bytes())))
    status, out, err = call(capsys, verb, "-")
    assert (status, err) == (0, "")
    assert out.splitlines()[:4] == beside[1].splitlines()[:4]
    for given, said in ((b"{", "peakmin: stdin: was not JSON"), (b"", "peakmin: stdin: was not JSON")):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(given)))
        status, out, err = call(capsys, verb, "-")
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert err.startswith(said)
    monkeypatch.setattr("sys.stdin", None)
    assert call(capsys, verb, "-") == (2, "", "peakmin: stdin: cannot be read (it is closed)\n")


def test_a_shell_is_told_the_verbs():
    asked = {"_PEAKMIN_COMPLETE": "complete_bash", "COMP_WORDS": "peakmin ex", "COMP_CWORD": "1"}
    code = "from peakmin.cli import main; main()"
    child = [sys.executable, "-c", code]
    found = subprocess.run(child, capture_output=True, text=True, timeout=60, check=True, env=os.environ | asked)
    assert found.stdout.split() == ["explain", "export"]
    home = os.environ | {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    found = subprocess.run([*child, "--show-completion", "bash"], capture_output=True, text=True, timeout=60, env=home)
    assert found.returncode == 0
    assert "_PEAKMIN_COMPLETE=complete_bash" in found.stdout


def test_the_bar_is_full_at_the_end_unless_it_is_stopped(monkeypatch):
    for stop, last in ((False, 100), (True, 40)):
        screen = io.StringIO()
        screen.isatty = lambda: True
        monkeypatch.setattr("sys.stderr", screen)
        monkeypatch.setenv("TERM", "xterm")
        stopped = threading.Event()
        with output.bar("solve", stopped) as progress:
            progress(40, 100)
            if stop:
                stopped.set()
        assert int(re.findall(r"(\d+)%", screen.getvalue())[-1]) == last


def test_the_shortest_is_the_same_at_the_terminal(spec, tmp_path, capsys):
    path = spec(obstacles=[{"kind": "wall", "tip": [0.5, 0.5]}])
    found = pm.shortest(pm.Spec.read(path).task, 8.0)
    status, out, err = call(capsys, "shortest", path, "--peak", "8", "--json", "--out", tmp_path / "o")
    document = json.loads(out)
    assert (status, err, document) == (0, "", json.loads((tmp_path / "o" / "shortest.json").read_text()))
    numbers = {name: document[name] for name in ("peak", "duration", "lower_bound", "gap", "nodes", "status")}
    assert numbers == {name: getattr(found, name) for name in ("peak", "duration", "lower_bound", "gap", "nodes")} | {
        "status": "solved"
    }
    assert pm.verify((tmp_path / "o" / "plan.json").read_text()).passed
    status, out, _ = call(capsys, "shortest", path, "--peak", "8")
    assert out.startswith(f"shortest: {found.duration:.9g} s for a peak of 8 m/s², gap ")
    assert f"  lower bound     {found.lower_bound:.9g} s for any control of that peak\nsolved: peak 7.99999" in out
    for peak, words in (("0", "peak: was 0.0, must be"), ("nan", "peak: was nan, must be"), ("x", "Invalid value")):
        status, out, err = call(capsys, "shortest", path, "--peak", peak)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert words in err


def test_the_shortest_is_of_centres_of_mass():
    arm = pm.ArmSpec.read(ARM).task
    with pytest.raises(pm.SpecError, match=r"^maneuver: was a ArmManeuver, must be a peakmin\.Maneuver$"):
        pm.shortest(arm, 1.0)
