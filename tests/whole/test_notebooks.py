"""The committed notebooks show what the present code says."""

import json
import re
import shutil
from pathlib import Path

import pytest

from notebooks.remake import remake
from tests.conftest import ALL

ROOT = Path(__file__).parents[2]
BOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SOME = {"03_global_proof"}  # the others are run again by `make proofs`
NUMBER = re.compile(r"[-+]?\d+(?:\.(\d+))?(?:[eE]([-+]\d+))?")
CLOSE, NOTHING = 0.02, 1e-9  # relative; below the latter a number is rounding


@pytest.fixture(params=BOOKS, ids=lambda path: path.stem)
def book(request):
    return request.param


def code(path):
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]


def printed(cell):
    return "".join("".join(out["text"]) for out in cell["outputs"] if out["output_type"] == "stream")


def test_there_are_six():
    assert [path.name[:2] for path in BOOKS] == ["01", "02", "03", "04", "05", "06"]
    assert sum(path.stat().st_size for path in BOOKS) < 3e6


def test_output_is_there_and_no_more_than_a_reader_needs(book):
    text = book.read_text()
    assert not re.search(r"/home/|/root/|/tmp/|/Users/|site-packages", text)
    data = json.loads(text)
    assert set(data["metadata"]) == {"kernelspec", "language_info"}
    for cell in data["cells"]:
        assert set(cell["metadata"]) <= {"tags"}
    for order, cell in enumerate(code(book), 1):
        assert cell["execution_count"] == order
        kinds = {out.get("name", out["output_type"]) for out in cell["outputs"]}
        assert kinds <= {"stdout", "display_data", "execute_result"}
        source = "".join(cell["source"])
        assert ("stdout" in kinds) == bool(re.search(r"^ *print\(", source, re.MULTILINE))
        assert ("display_data" in kinds) == ("plt.show()" in source)


@pytest.mark.parametrize("book", [one for one in BOOKS if ALL or one.stem in SOME], ids=lambda path: path.stem)
def test_what_it_says_is_what_the_present_code_says(book, tmp_path):
    ran = Path(shutil.copy(book, tmp_path))
    remake(ran)
    for shown, now in zip(code(book), code(ran), strict=True):
        assert shown["source"] == now["source"]
        if "timing" in shown["metadata"].get("tags", []):
            continue
        for line, other in zip(printed(shown).splitlines(), printed(now).splitlines(), strict=True):
            assert agree(line, other), f"`make notebooks`: {line!r} is now {other!r}"


def agree(line, other):
    """Whether two lines have the same words, and numbers that differ by 2 % or two units of the last digit at most."""
    if NUMBER.sub("#", line).split() != NUMBER.sub("#", other).split():
        return False
    for a, b in zip(NUMBER.finditer(line), NUMBER.finditer(other), strict=True):
        last = 10.0 ** (int(a[2] or 0) - len(a[1] or ""))
        if abs(float(a[0]) - float(b[0])) > max(CLOSE * abs(float(a[0])), 2 * last, NOTHING):
            return False
    return True


@pytest.mark.parametrize(
    ("line", "other", "same"),
    [
        ("M = 8.5374 at 3 s", "M = 8.5375 at 3 s", True),
        ("M = 8.5374 at 3 s", "M =  8.9 at 3 s", False),
        ("M = 8.5374 at 3 s", "N = 8.5374 at 3 s", False),
        ("gap 2.0e-11", "gap 7.0e-12", True),
        ("gap 2.0e-05", "gap 7.0e-05", False),
    ],
)
def test_agreement(line, other, same):
    assert agree(line, other) == same
