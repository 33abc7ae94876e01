"""The same spec gives the same bytes of plan.json, timings aside, in any process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ALL

ROOT = Path(__file__).parent.parent.parent
EXAMPLES = ["moving_start", "non_convex_block"]
EXAMPLES += ["three_link", "two_link_cm", "over_and_under", "satellite_arm"] if ALL else []
ARMS = [5, 20] if ALL else [5]
SOLVES = """
import json, sys
import peakmin as pm
from peakmin.spec.spec import read_spec
from tests.random_arms import task

def written(maneuver, settings=None):
    data = json.loads(pm.solve(maneuver, settings).to_json())
    assert data["made"].pop("seconds") > 0
    print(json.dumps(data))

for name in sys.argv[1:]:
    spec = read_spec(f"examples/{name}.json")
    written(spec.task, spec.settings)
for seed in {arms}:
    written(task(seed), pm.Settings(grid=pm.Aligned(steps=40), rounds=20))
"""


@pytest.fixture(scope="module")
def runs():
    """What two processes with other hashes and other histories write, a line for each plan."""
    processes = []
    for seed, names in (("1", EXAMPLES), ("2", EXAMPLES[::-1])):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        arguments = [sys.executable, "-c", SOLVES.replace("{arms}", repr(ARMS)), *names]
        processes.append(subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT))
    first, second = (process.communicate(timeout=300)[0].splitlines() for process in processes)
    count = len(EXAMPLES)
    return dict(zip([*EXAMPLES, *ARMS], zip(first, [*second[:count][::-1], *second[count:]], strict=True), strict=True))


@pytest.mark.parametrize("name", [*EXAMPLES, *ARMS])
def test_the_same_spec_gives_the_same_bytes(runs, name):
    first, second = runs[name]
    assert first == second
    assert first.startswith('{"version": 3, ')
