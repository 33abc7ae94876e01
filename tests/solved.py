"""What several tests look at, made once in a run of the tests, whichever of its processes asks first."""

import functools
import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock

import peakmin as pm
from peakmin.search.solve import solve
from peakmin.spec.spec import read_spec
from tests.conftest import shared

EXAMPLES = Path(__file__).parent.parent / "examples"
DEFAULT = pm.Settings()
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID")  # of all processes of a run; without one a process is alone


def once(name: str, make: Callable[[], object]):
    """What `make` returns, under a name of its own."""
    if RUN is None:
        return make()
    shared(RUN).mkdir(exist_ok=True)
    file = shared(RUN) / hashlib.sha256(name.encode()).hexdigest()
    with FileLock(f"{file}.lock"):
        if not file.exists():
            file.write_bytes(pickle.dumps(make()))
        return pickle.loads(file.read_bytes())


@functools.cache
def solved(task, settings=DEFAULT):
    """The plan of a task."""
    asked = f"{type(task).__name__} {task.model_dump_json()} {settings.model_dump_json()}"
    return once(asked, lambda: solve(task, settings))


def example(name):
    """The plan of a file in examples/."""
    spec = read_spec(EXAMPLES / f"{name}.json")
    return solved(spec.task, spec.settings)
