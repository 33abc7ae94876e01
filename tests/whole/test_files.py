"""Files are written whole or not at all, carry a version, and are data."""

import errno
import json
import os
import pickle
import subprocess
import sys

import pytest

import peakmin as pm
from peakmin import files
from peakmin.errors import SpecError
from tests.conftest import wall_maneuver
from tests.random_arms import task
from tests.whole.test_cli import call, spec  # noqa: F401

SETTINGS = pm.Settings(grid=pm.Aligned(steps=20))


@pytest.fixture(scope="module")
def plans():
    """Documents of a plan past a wall, past a block and of an arm."""
    block = pm.Block(vertices=[(0.45, -0.5), (0.55, -0.5), (0.55, 0.2), (0.45, 0.2)])
    asked = {"wall": wall_maneuver(), "block": wall_maneuver(obstacles=[block]), "arm": task(1)}
    return {name: pm.solve(one, SETTINGS).document() for name, one in asked.items()}


def limited(tmp_path, size):
    """A plan written where no file may grow beyond so many bytes: exit status, stdout, stderr."""
    file = tmp_path / "spec.json"
    file.write_text(pm.Spec(maneuver=wall_maneuver(), settings=SETTINGS).to_json())
    code = (
        "import resource, signal\nfrom peakmin.cli import main\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))\nmain()"
    )
    arguments = [sys.executable, "-c", code, "solve", file, "--out", tmp_path / "o"]
    found = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False)
    return found.returncode, found.stdout, found.stderr


def test_a_disk_that_takes_no_more_leaves_nothing_half_written(tmp_path):
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "plan.json").write_text("of before")
    status, _, err = limited(tmp_path, 1000)
    assert (status, err) == (2, f"peakmin: {tmp_path}/o/plan.json: cannot be written (File too large)\n")
    assert {file.name: file.read_text() for file in (tmp_path / "o").iterdir()} == {"plan.json": "of before"}


@pytest.mark.parametrize("at", ["fsync", "replace", "chmod"])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), KeyboardInterrupt()], ids=repr)
def test_an_interrupted_write_leaves_the_file_of_before(tmp_path, monkeypatch, at, error):
    target = tmp_path / "plan.json"
    files.write(target, "of before")

    def fails(*_):
        raise error

    monkeypatch.setattr(os, at, fails)
    with pytest.raises(SpecError if isinstance(error, OSError) else KeyboardInterrupt):
        files.write(target, "half")
    monkeypatch.undo()
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"plan.json": "of before"}


def test_a_folder_that_cannot_be_written_is_told_before_anything_is_solved(spec, tmp_path, capsys, monkeypatch):  # noqa: F811
    monkeypatch.setattr("peakmin.cli.solve", None)
    monkeypatch.setattr("peakmin.cli.sweep", None)
    (tmp_path / "file").write_text("")
    path = spec(obstacles=[{"tip": [0.5, 0.5]}])
    for command in ("solve", "sweep"):
        for out in (tmp_path / "file", tmp_path / "file" / "o"):
            status, text, err = call(capsys, command, path, "--out", out)
            assert (status, text) == (2, "")
            assert err.startswith(f"peakmin: {out}: cannot be written (")
            assert err.count("\n") == 1


@pytest.mark.parametrize("version", [0, 2, 1.0, True, "1", None])
def test_other_versions_of_specs_are_refused_with_the_reason(plans, version):
    maneuver = json.loads(wall_maneuver().to_json())
    arm = plans["arm"]["spec"]
    for read in (
        lambda: pm.Spec(version=version, maneuver=maneuver),
        lambda: pm.ArmSpec(**{**arm, "version": version}),
        lambda: pm.StudySpec(version=version, base={"maneuver": maneuver}),
    ):
        with pytest.raises(SpecError, match=r"^version: was .*, must be ") as error:
            read()
        assert version not in (0, 2) or "1 (the only version so far)" in str(error.value)


@pytest.mark.parametrize("version", [0, 4, -1, 1.0, 2.0, True, "2", None, [2]])
def test_other_versions_of_plans_are_refused_with_the_reason(plans, version):
    for data in plans.values():
        for read in (pm.verify, pm.Plan.from_json, pm.ArmPlan.from_json):
            with pytest.raises(SpecError, match=r"^version: was .*, must be 1, 2 or 3 \(the versions so far\)$"):
                read(json.dumps({**data, "version": version}))


def test_every_file_says_its_version(plans):
    for data in plans.values():
        assert (data["version"], data["spec"]["version"]) == (3, 1)
    assert json.loads(pm.sweep(wall_maneuver(), SETTINGS, times=[0.5]).to_json())["version"] == 1


def test_a_plan_without_a_version_is_refused(plans):
    for data in plans.values():
        bare = {key: value for key, value in data.items() if key != "version"}
        with pytest.raises(SpecError, match=r"^version: was None, must be 1"):
            pm.verify(json.dumps(bare))


class Bomb:
    def __reduce__(self):
        return os.mkdir, ("exploded",)


HOSTILE = [
    pickle.dumps(Bomb()),
    b"__import__('os').mkdir('exploded')",
    b"{\"version\": __import__('os').mkdir('exploded')}",
    b"!!python/object/apply:os.mkdir ['exploded']",
    b'{"$ref": "other.json"}',
    b'{"maneuver": {"$include": "other.json"}}',
]


WATCHED = """
import sys
import peakmin as pm
from peakmin.spec.reading import read_file
from peakmin.spec.spec import read_spec

def read(path):
    for reads in (read_spec, pm.StudySpec.read, lambda path: pm.verify(read_file(path))):
        try:
            reads(path)
        except pm.SpecError as error:
            assert len(str(error).splitlines()) == 1
        else:
            raise AssertionError("was read")

first, *paths = sys.argv[1:]
read(first)  # what python itself reads at first is read
sys.addaudithook(lambda event, what: event in EVENTS and print(event, what[0]))
for path in paths:
    read(path)
"""
EVENTS = ("open", "exec", "compile", "import", "os.mkdir", "os.system", "subprocess.Popen", "pickle.find_class")


def test_nothing_but_the_file_named_is_opened_and_nothing_executed(tmp_path):
    (tmp_path / "other.json").write_text("{}")
    paths = [tmp_path / str(k) for k in range(len(HOSTILE))]
    for path, text in zip(paths, HOSTILE, strict=True):
        path.write_bytes(text)
    code = WATCHED.replace("EVENTS", repr(EVENTS))
    arguments = [sys.executable, "-c", code, *map(str, [paths[-1], *paths])]
    found = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path)
    assert found.returncode == 0, found.stderr
    assert found.stdout.splitlines() == [f"open {path}" for path in paths for _ in range(3)]
    assert not (tmp_path / "exploded").exists()
