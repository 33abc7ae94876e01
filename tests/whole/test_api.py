import ast
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import peakmin as pm

ROOT = Path(__file__).parent.parent.parent


def test_all_is_what_the_stub_names():
    """`__init__.pyi` is read when a name is first asked for: each is there, and of the package's own."""
    stub = ast.parse((Path(pm.__file__).parent / "__init__.pyi").read_text())
    named = [one.asname for node in stub.body if isinstance(node, ast.ImportFrom) for one in node.names]
    assert sorted(named) == sorted(pm.__all__)
    assert all(getattr(pm, name).__module__.startswith("peakmin.") for name in pm.__all__)


def test_no_public_name_is_a_module_s():
    """A function that its module shadows, or that shadows it, depends on what was imported first."""
    modules = {one.name for one in pkgutil.iter_modules(pm.__path__)}
    assert modules.isdisjoint(pm.__all__)


def test_one_exception_base_class():
    assert issubclass(pm.SpecError, pm.PeakminError)
    assert issubclass(pm.NotDPPError, pm.PeakminError)


# of cvxpy and matplotlib what is only there once they are really read: before that they are promised
READ = "{'cvxpy.expressions', 'matplotlib.axes'} & set(sys.modules)"


@pytest.mark.parametrize(
    "code",
    [
        "import peakmin",
        "import peakmin.cli, peakmin.view.report",
        "import peakmin as pm; [getattr(pm, name) for name in pm.__all__]",
        "import peakmin as pm; from peakmin.paper import GENERAL\n"
        "assert pm.solve(GENERAL, pm.Settings(method=pm.Exact())).status == 'solved'",
    ],
    ids=["the package", "the terminal", "all names", "an answer in continuous time"],
)
def test_what_takes_long_to_read_is_not_waited_for(code):
    code = f"import sys\n{code}\nsys.exit(bool({READ}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_readme_example_prints_what_it_says():
    text = (ROOT / "README.md").read_text()
    code, printed = re.search(r"```python\n(.*?)```\n+```text\n(.*?)```", text, re.S).groups()
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == printed
    assert len(code.strip().splitlines()) <= 6
