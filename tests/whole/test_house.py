"""The walls of the house hold: a forbidden import, put into a copy of the package, breaks the contract that forbids it."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
WALLS = [  # contract, file, what it must not import
    ("floors", "geometry/norm.py", "from ..spec import maneuver"),
    ("floors", "scenes/kept.py", "from ..plan import plan"),
    ("floors", "queries/budget.py", "from ..view import words"),
    ("floors", "robots/kinematics.py", "from ..spec import arm"),
    ("arithmetic", "plan/verify.py", "from ..search import solve"),
    ("arithmetic", "proofs/bounds.py", "import cvxpy"),
    ("arithmetic", "scenes/blocks.py", "def later():\n    from ..programs import program"),
    (
        "arithmetic",
        "plan/plan.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..programs import states",
    ),
    ("pictures", "search/sweep.py", "def drawn():\n    import matplotlib.pyplot"),
    ("pictures", "queries/budget.py", "import matplotlib"),
    ("programs", "search/held.py", "import cvxpy"),
    ("painters", "paper.py", "import matplotlib.pyplot"),
    ("circles", "plan/found.py", "from . import plan"),
    ("circles", "search/job.py", "def later():\n    from . import tree"),
]


def broken(folder, *contracts):
    """The names of the contracts that do not hold in a copy of the project."""
    options = [word for one in contracts for word in ("--contract", one)]
    code = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    environment = {"PYTHONPATH": str(folder), "PATH": "", "HOME": str(folder)}
    asked = [sys.executable, "-c", code, "--no-cache", *options]
    found = subprocess.run(asked, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert "Contracts:" in found.stdout, found.stdout + found.stderr
    return found.returncode


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("house")
    shutil.copytree(ROOT / "peakmin", folder / "peakmin", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_all_walls_hold(copy):
    assert broken(copy) == 0


@pytest.mark.parametrize(("contract", "file", "line"), WALLS, ids=[f"{one}: {file}" for one, file, _ in WALLS])
def test_a_forbidden_import_breaks_its_wall(copy, contract, file, line):
    path = copy / "peakmin" / file
    before = path.read_text()
    try:
        path.write_text(f"{before}\n{line}\n")
        assert broken(copy, contract) == 1
    finally:
        path.write_text(before)


# the plane is known to polygons and strips, to what users write, to an arm's links and passages, and to pictures
KNOW_THE_PLANE = (
    "geometry/clearance.py",
    "geometry/frame.py",
    "geometry/integrals.py",
    "geometry/norm.py",
    "geometry/polygon.py",
    "geometry/trapezoids.py",
    "geometry/window.py",
    "proofs/double_integrator.py",
    "queries/compare.py",
    "queries/given.py",
    "queries/simulate.py",
    "robots/",
    "scenes/blocks.py",
    "scenes/cells.py",
    "scenes/kept.py",
    "scenes/passages.py",
    "spec/",
    "view/",
)
PLANAR = re.compile(r"hypot|(zeros|ones|empty|full|eye|reshape)\([^()]*\b2\)|, 2\)\)|\[\.\.\., [01]\]|\[:, [01]\]")
NOT_A_PLACE = re.compile(
    r"simplex\[|points\[:, 0\] if walls == 1|total\[:, 0\]|norms\(\)|\[\.\.\., None\]\)\[\.\.\., 0\]|axis=\(1, 2\)"
)


def test_arrays_end_in_d_outside_of_what_knows_the_plane():
    found = []
    for path in sorted((ROOT / "peakmin").rglob("*.py")):
        name = path.relative_to(ROOT / "peakmin").as_posix()
        if not name.startswith(KNOW_THE_PLANE):
            lines = enumerate(path.read_text().splitlines(), 1)
            found += [f"{name}:{k}: {x.strip()}" for k, x in lines if PLANAR.search(x) and not NOT_A_PLACE.search(x)]
    assert not found
