"""stdout has the answer and nothing else, whatever libraries print."""

import json
import os
import pty
import subprocess
import sys

import pytest

import peakmin as pm
from peakmin import cli, paper
from peakmin.spec.settings import SOLVERS
from tests.conftest import ALL, wall_maneuver

# every file that is opened lets Python and C print, at once and into their buffers; the solvers print what they will
NOISY = """
import builtins, ctypes, json, os, sys
from peakmin import cli

libc, plainly = ctypes.CDLL(None), builtins.open

def noisy(*arguments, **options):
    libc.puts(b"C, in a while")
    print("Python")
    os.write(1, b"C, at once\\n")
    return plainly(*arguments, **options)

if __name__ == "__main__":
    builtins.open = noisy
    for arguments in json.loads(sys.argv[1]):
        try:
            cli.main(arguments)
        except SystemExit as end:
            os.write(1, f"\\0{end.code}\\0".encode())
"""
NOISE = {"C, in a while", "Python", "C, at once"}
SETTINGS = {
    "circle": {"kind": "polygon", "segments": 1},
    "grid": {"kind": "aligned", "steps": 8},
    "search": {"kind": "sweep", "count": 2},
}
LINK = {"length": 1.0, "mass": 1.0}
ARM = {
    "arm": {"links": [LINK, LINK]},
    "maneuver": {"start": {"joints": [0.0, 1.0]}, "goal": {"joints": [0.5, 1.0]}, "duration": 1.0},
}
THIN = {  # two holds are too few for the three segments of the way past it
    "maneuver": {
        "start": {"position": [0, 0]},
        "goal": {"position": [1, 0]},
        "duration": 1.0,
        "obstacles": [{"kind": "block", "vertices": [[0.49, -0.3], [0.51, -0.3], [0.51, 0.3], [0.49, 0.3]]}],
    },
    "settings": {"grid": {"kind": "aligned", "steps": 2}},
}


def run(*calls):
    """In one noisy process: a list of exit status and stdout for each call."""
    child = [sys.executable, "-c", NOISY, json.dumps([list(map(str, call)) for call in calls])]
    found = subprocess.run(child, capture_output=True, text=True, timeout=300, check=True)
    *parts, after = found.stdout.split("\0")
    assert after == ""
    said = found.stderr.splitlines()
    assert set(said) >= NOISE
    return [(int(status), out) for out, status in zip(parts[::2], parts[1::2], strict=True)], said


def written(path, data):
    path.write_text(json.dumps(data))
    return path


@pytest.fixture
def specs(tmp_path):
    """A spec file of a centre of mass and one of an arm, for every solver."""
    maneuver = json.loads(wall_maneuver().to_json())
    arm = {name: value for name, value in SETTINGS.items() if name != "search"}
    return {
        solver: (
            written(tmp_path / f"{solver}.json", {"maneuver": maneuver, "settings": {**SETTINGS, "solver": solver}}),
            written(tmp_path / f"arm_{solver}.json", {**ARM, "settings": {**arm, "solver": solver}}),
        )
        for solver in SOLVERS["polygon"]
    }


def test_every_verb_prints_one_document_with_every_solver(specs, tmp_path):
    calls = []
    for solver, (point, arm) in specs.items():
        out = tmp_path / solver
        calls += [("solve", point, "--out", out, "--json"), ("verify", out / "plan.json", "--json")]
        calls += [(verb, point, "--json") for verb in ("sweep", "budget", "explain")]
        calls += [("solve", arm, "--json")] if solver in ("HIGHS", "CLARABEL") or ALL else []
    calls += [("solve", arm, "--out", out, "--no-gif", "--json"), ("compare", arm, "--json")]
    calls += [("simulate", out / "plan.json", "--json"), ("export", out / "plan.json", "--format", "joint_trajectory")]
    base = json.loads(specs["HIGHS"][0].read_text())
    study = written(tmp_path / "study.json", {"base": base, "grid": {"settings.solver": list(specs)}})
    calls += [("study", study, "--workers", "1", "--out", tmp_path / "rows.csv", "--json"), ("schema", "--json")]
    calls += [("export", out / "plan.json", "--out", tmp_path / "rows.txt", "--json"), ("schema",)]
    calls += [("show", point, "--out", tmp_path / "task.png", "--json"), ("shortest", point, "--peak", "9", "--json")]
    found, said = run(*calls)
    assert not any("HiGHS" in line for line in said)
    assert {call[0] for call in calls} == {command.name for command in cli.app.registered_commands} - {"paper"}
    for call, (status, out) in zip(calls, found, strict=True):
        assert status == 0, call
        assert isinstance(json.loads(out), dict | list), call


@pytest.mark.parametrize("grid", ["aligned", "uniform"] if ALL else ["aligned"])
def test_no_program_is_asked_for_a_control_on_too_few_holds(grid, tmp_path):
    spec = THIN | {"settings": {"grid": {"kind": grid, "steps": 2}}}
    ((status, out),), said = run(("solve", written(tmp_path / "thin.json", spec), "--json"))
    assert set(said) == NOISE
    made = json.loads(out)["made"]
    assert (status, json.loads(out)["status"], made["compilations"], made["solves"]) == (4, "unknown", 0, 0)


@pytest.mark.parametrize("way", ["capsys", "capfd"])
def test_the_paper_is_one_document_too(way, request, monkeypatch, tmp_path):
    class Result:
        agrees = True

        def document(self):
            return {"table": 1}

    def noisy(*_):
        print("Python")
        os.write(1, b"C\n")
        return Result()

    monkeypatch.setattr(paper, "compute", noisy)
    monkeypatch.setattr(paper, "figures", noisy)
    captured = request.getfixturevalue(way)
    with pytest.raises(SystemExit) as end:
        cli.main(["paper", "--json", "--out", str(tmp_path)])
    print("afterwards")
    out = captured.readouterr()
    assert end.value.code == 0
    assert out.out == '{\n  "table": 1\n}\nafterwards\n'
    assert "Python\n" in out.err


SCHEMA = [sys.executable, "-m", "peakmin", "schema"]


def test_a_file_gets_the_document(tmp_path):
    with open(tmp_path / "out", "wb") as file:
        subprocess.run(SCHEMA, stdout=file, check=True, timeout=60)
    assert json.loads((tmp_path / "out").read_bytes()) == json.loads(json.dumps(pm.schema()))


def test_a_terminal_gets_the_document():
    ours, theirs = pty.openpty()
    process = subprocess.Popen(SCHEMA, stdout=theirs, stderr=subprocess.DEVNULL)
    os.close(theirs)
    shown = b""
    try:
        while some := os.read(ours, 65536):
            shown += some
    except OSError:  # how Linux says that nobody has the terminal any more
        pass
    os.close(ours)
    assert process.wait(timeout=60) == 0
    assert json.loads(shown) == json.loads(json.dumps(pm.schema()))


@pytest.mark.parametrize("closed", ["2>&-", "<&- >&- 2>&-"] if ALL else ["<&- >&- 2>&-"])
def test_descriptors_may_be_closed(closed, tmp_path):
    out = tmp_path / "o"
    calls = json.dumps([["solve", str(written(tmp_path / "thin.json", THIN)), "--out", str(out)]])
    child = ["sh", "-c", f'"$0" -c "$1" "$2" {closed}', sys.executable, NOISY, calls]
    found = subprocess.run(child, capture_output=True, text=True, timeout=120, check=True)
    assert found.stderr == ""
    if ">&- 2" in closed:
        assert found.stdout == ""
    else:
        assert found.stdout.startswith("unknown: ")
        assert found.stdout.endswith(f"\nwrote {out}\n\0{4}\0")
    assert {file.name for file in out.iterdir()} == {"plan.json", "plan.png"}
    for file in out.iterdir():  # one that was opened in place of a stream would have what is printed
        assert not any(line.encode() in found.stdout.encode() + file.read_bytes() for line in NOISE)


def test_a_reader_that_goes_away_ends_it_without_a_word():
    process = subprocess.Popen(SCHEMA, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait(timeout=60) == 1


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this machine")
def test_a_full_disk_is_told_in_one_line():
    with open("/dev/full", "wb") as full:
        found = subprocess.run(SCHEMA, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert (found.returncode, found.stderr) == (2, "peakmin: stdout: cannot be written (No space left on device)\n")
