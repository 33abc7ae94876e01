"""Plan files as version 1 wrote them are read, verified, and refused where they were changed."""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import peakmin as pm
from peakmin.plan.document import digest
from tests.conftest import ALL
from tests.solved import example

FILES = sorted((Path(__file__).parent / "version_1").glob("*.json"))


def changed(data, **fields):
    data = {**data, **fields}
    return json.dumps(data | {"digest": digest(data)})


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_files_of_version_1_are_verified(file):
    data = json.loads(file.read_text())
    assert data["version"] == 1
    found = pm.verify(json.dumps(data))
    assert found.problems == ()
    far = data["status"] == "solved" and data["gap"] > 0.05  # "solved" told nothing of the gap then
    assert found.plan.status == ("feasible" if far else data["status"])
    again = json.loads(found.plan.to_json())
    assert again["version"] == 3
    assert (again["peak"], again["lower_bound"]) == (data["peak"], data["lower_bound"])
    # what joints may do at most where a spec states nothing is asked since version 3
    assert pm.verify(json.dumps(again)).passed == (found.plan.kept is None or found.plan.kept.passed)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_was_changed_in_them_is_found(file):
    data = json.loads(file.read_text())
    if data["peak"] is not None and data["status"] == "solved":
        assert not pm.verify(changed(data, peak=0.9 * data["peak"])).passed
    if data["lower_bound"]:
        assert not pm.verify(changed(data, lower_bound=1.1 * data["lower_bound"])).passed
    assert "digest" in pm.verify(json.dumps({**data, "made": data["made"], "gap": 0.5})).problems[0]


def test_there_are_files_of_every_kind():
    assert {"two_tables", "arm_turns", "three_link", "region_speed", "sweep_polygon", "impossible"} <= {
        file.stem for file in FILES
    }


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names processors of this kind")
@pytest.mark.parametrize("processor", ["Haswell", "Nehalem"] if ALL else ["Haswell"])
def test_a_file_is_true_on_another_processor(processor, tmp_path):
    """Its sums are rounded otherwise there."""
    written = tmp_path / "three_link.json"
    written.write_text(example("three_link").to_json())
    script = "import sys, peakmin as pm\nfor name in sys.argv[1:]: print(pm.verify(open(name).read()).problems)"
    names = [written, *(file for file in FILES if file.stem in ("region_speed", "two_tables"))]
    found = subprocess.run(
        [sys.executable, "-c", script, *map(str, names)],
        env={**os.environ, "OPENBLAS_CORETYPE": processor},
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.split("\n") == ["()"] * 3 + [""]
