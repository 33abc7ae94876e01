"""The walls of the house hold: a forbidden import, put into a copy of the package, breaks the contract that forbids it."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
PACKAGE = ROOT / "peakmin"
WALLS = [  # contract, file, what it must not import
    ("floors", "geometry/norm.py", "from ..spec import maneuver"),
    ("floors", "scenes/kept.py", "from ..plan import plan"),
    ("floors", "queries/budget.py", "from ..view import words"),
    ("floors", "robots/kinematics.py", "from ..spec import arm"),
    ("root", "plan/verify.py", "def later():\n    from peakmin import solve"),
    ("root", "proofs/bounds.py", "import peakmin"),
    ("root", "queries/study/row.py", "from ... import solve"),
    ("arithmetic", "plan/verify.py", "from ..search import solve"),
    ("arithmetic", "scenes/impossible.py", "import clarabel"),
    ("arithmetic", "robots/joints.py", "def later():\n    import osqp"),
    ("arithmetic", "proofs/bounds.py", "import cvxpy"),
    ("arithmetic", "scenes/blocks.py", "def later():\n    from ..programs import program"),
    (
        "arithmetic",
        "plan/plan.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..programs import states",
    ),
    ("mathematics", "proofs/bounds.py", "import shapely"),
    ("mathematics", "proofs/primal.py", "from pydantic import BaseModel"),
    ("mathematics", "proofs/check.py", "from ..robots import joints"),
    ("mathematics", "geometry/polygon.py", "import shapely"),
    ("mathematics", "geometry/norm.py", "import pydantic"),
    ("arrays", "robots/kinematics.py", "import pydantic"),
    ("pictures", "search/sweep.py", "def drawn():\n    import matplotlib.pyplot"),
    ("pictures", "queries/budget.py", "import matplotlib"),
    ("programs", "search/held.py", "import cvxpy"),
    ("programs", "programs/bisection.py", "import cvxpy"),
    ("programs", "programs/another.py", "import cvxpy"),
    ("programs", "queries/oracle.py", "import highspy"),
    ("view", "view/words.py", "from ..programs import program"),
    ("painters", "paper.py", "import matplotlib.pyplot"),
    ("painters", "view/words.py", "import matplotlib"),
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
    shutil.copytree(PACKAGE, folder / "peakmin", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_all_walls_hold(copy):
    assert broken(copy) == 0


@pytest.mark.parametrize(("contract", "file", "line"), WALLS, ids=[f"{one}: {file}" for one, file, _ in WALLS])
def test_a_forbidden_import_breaks_its_wall(copy, contract, file, line):
    path = copy / "peakmin" / file
    before = path.read_text() if path.exists() else None
    try:
        path.write_text(f"{before or ''}\n{line}\n")
        assert broken(copy, contract) == 1
    finally:
        path.unlink() if before is None else path.write_text(before)


TEXTS = {path.relative_to(PACKAGE).as_posix(): path.read_text() for path in sorted(PACKAGE.rglob("*.py"))}
TREES = {name: ast.parse(text) for name, text in TEXTS.items()}


def imported(tree):
    """What is imported from outside, or by its full name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module


def test_modules_know_each_other_by_relative_names():
    """`import peakmin.types` is an import of `peakmin.types` to the linter, but gives `peakmin.solve`, too."""
    assert not [name for name, tree in TREES.items() for one in imported(tree) if one.split(".")[0] == "peakmin"]


PAINTERS = {"paths:path", "paths:poses", "curves:peak_over_time", "curves:error_parts"}


def test_only_painters_are_found_by_name():
    calls = [node for tree in TREES.values() for node in ast.walk(tree) if isinstance(node, ast.Call)]
    named = [one for one in calls if ast.unparse(one.func).split(".")[-1] == "found"]
    assert {ast.unparse(one.args[0]).strip("'").removeprefix("peakmin.view.") for one in named} == PAINTERS
    loads = re.compile(r"pkgutil|import_module|__import__|lazy_loader")
    able = [name for name, text in TEXTS.items() if loads.search(text)]
    assert able == ["__init__.py", "byname.py", "programs/convex.py", "view/pyplot.py"]


def test_what_decides_has_no_linear_program():
    floors = ("geometry/", "robots/", "spec/", "proofs/", "scenes/", "plan/")
    assert not [x for x, text in TEXTS.items() if x.startswith(floors) and re.search(r"linprog|milp", text)]


PACKAGES = {"PIL": "pillow", "pydantic_core": "pydantic", "cycler": "matplotlib", "lazy_loader": "cvxpy"}


def test_floors_take_from_outside_what_their_document_says():
    rows = re.findall(r"^\| (\w+) \|.*\| (.*) \|$", (ROOT / "docs" / "architecture.md").read_text(), re.MULTILINE)
    said = {floor: set(re.findall(r"\w+", outside)) for floor, outside in rows}
    own = {"numpy", "scipy", *sys.stdlib_module_names}
    for path in sorted(PACKAGE.glob("*/__init__.py")):
        floor = path.parent.name
        trees = [tree for name, tree in TREES.items() if name.startswith(f"{floor}/")]
        taken = {PACKAGES.get(top := one.split(".")[0], top) for tree in trees for one in imported(tree)} - own
        assert taken == said[floor] - {"nothing"}, floor


KINDS = re.compile(r"(Arm)?(Maneuver|Spec)|ArmPlan|(Point|Arm)(Scene|Document)")
ASK_THE_KIND = {
    "cli.py": "verbs of arms only",
    "plan/export.py": "a format of joints only",
    "plan/older.py": "older files had fields of their own for each kind",
    "plan/verify.py": "a file may state anything for its kind",
    "scenes/kinds.py": "the place to ask a task",
    "search/solve.py": "an arm's search is another one",
    "spec/spec.py": "a spec file says its kind by having an arm",
    "view/refused.py": "so does one that is refused",
}


def asks_the_kind(node):
    """Whether it is `isinstance` of a kind of task, plan, scene or file, or a comparison with a kind's name."""
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance":
        return any(isinstance(one, ast.Name) and KINDS.fullmatch(one.id) for one in ast.walk(node.args[1]))
    sides = (node.left, *node.comparators) if isinstance(node, ast.Compare) else ()
    return any(isinstance(one, ast.Constant) and one.value in ("point", "arm") for one in sides)


def test_few_places_ask_which_kind_a_task_or_a_plan_is_of():
    assert {name for name, tree in TREES.items() if any(map(asks_the_kind, ast.walk(tree)))} == set(ASK_THE_KIND)


# the plane is known to polygons and strips, to what users write, to an arm's links and passages, to the near and far
# side of a wall, and to pictures
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
    "search/held.py",
    "search/turns.py",
    "spec/",
    "view/",
)
PLANAR = re.compile(
    r"hypot|atan2|arctan2|(zeros|ones|empty|full|eye|reshape)\([^()]*\b2\)|, 2\)\)|\[\.\.\., [01]\]|\[:, [01]\]"
    r"|Variable\(\(?2|\bd: int = |\[-\w+\[1\], \w+\[0\]\]|\[\w+\[1\], -\w+\[0\]\]"
)
NOT_A_PLACE = re.compile(
    r"simplex\[|points\[:, 0\] if walls == 1|total\[:, 0\]|norms\(\)|\[\.\.\., None\]\)\[\.\.\., 0\]|axis=\(1, 2\)"
    r"|tau\[\.\.\., 0\]"
)


def test_arrays_end_in_d_outside_of_what_knows_the_plane():
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if not name.startswith(KNOW_THE_PLANE):
            lines = enumerate(path.read_text().splitlines(), 1)
            found += [f"{name}:{k}: {x.strip()}" for k, x in lines if PLANAR.search(x) and not NOT_A_PLACE.search(x)]
    assert not found
