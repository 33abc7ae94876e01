import re
import subprocess
import sys
from pathlib import Path

import peakmin as pm

ROOT = Path(__file__).parent.parent.parent


def test_all_is_what_is_public():
    public = {
        n for n, v in vars(pm).items() if not n.startswith("_") and getattr(v, "__module__", "").startswith("peakmin.")
    }
    later = {name for names in pm._LATER.values() for name in names}
    assert public | later == set(pm.__all__)
    assert all(getattr(pm, name) is not None for name in pm.__all__)
    assert pm.__all__ == sorted(pm.__all__, key=lambda n: (n[0].islower(), n))


def test_one_exception_base_class():
    assert issubclass(pm.SpecError, pm.PeakminError)
    assert issubclass(pm.NotDPPError, pm.PeakminError)


def test_reading_a_spec_does_not_load_the_heavy_libraries():
    code = "import sys, peakmin; sys.exit(bool({'cvxpy', 'matplotlib'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_answer_in_continuous_time_does_not_wait_for_cvxpy():
    code = (
        "import sys, peakmin as pm; from peakmin.paper import GENERAL; plan = pm.solve(GENERAL, "
        "pm.Settings(method=pm.Exact())); sys.exit(plan.status != 'solved' or 'cvxpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_readme_example_prints_what_it_says():
    text = (ROOT / "README.md").read_text()
    code, printed = re.search(r"```python\n(.*?)```\n+```text\n(.*?)```", text, re.S).groups()
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == printed
    assert len(code.strip().splitlines()) <= 6
