"""Plans that several tests look at, solved once in a run of the tests, whichever of its processes asks first."""

import functools
import hashlib
import os
import pickle
from pathlib import Path

from filelock import FileLock

import peakmin as pm
from peakmin.search.solve import solve
from peakmin.spec.spec import read_spec
from tests.conftest import shared

EXAMPLES = Path(__file__).parent.parent / "examples"
DEFAULT = pm.Settings()
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID")  # of all processes of a run; without one a process is alone


@functools.cache
def solved(task, settings=DEFAULT):
    """What `solve` makes of a task."""
    if RUN is None:
        return solve(task, settings)
    shared(RUN).mkdir(exist_ok=True)
    asked = f"{type(task).__name__} {task.model_dump_json()} {settings.model_dump_json()}"
    file = shared(RUN) / hashlib.sha256(asked.encode()).hexdigest()
    with FileLock(f"{file}.lock"):
        if not file.exists():
            file.write_bytes(pickle.dumps(solve(task, settings)))
        return pickle.loads(file.read_bytes())


def example(name):
    """The plan of a file in examples/."""
    spec = read_spec(EXAMPLES / f"{name}.json")
    return solved(spec.task, spec.settings)
