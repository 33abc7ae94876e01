"""Every example of README.md and of the pages in docs/ is run, and prints what stands below it.

The blocks of a page are one session, in order: `python` in one namespace, the `peakmin` lines of `sh` in one folder, with
examples/ in it; `json spec.json` is a file there. A `text` block is what the block above it prints, "..." in it any text;
python without one prints nothing. A command's exit status is the one its comment names, or 0.
"""

import doctest
import io
import re
import runpy
import shlex
from contextlib import redirect_stdout
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import pytest

import peakmin as pm
from peakmin import cli
from peakmin.view import animation
from tests.solved import solved

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCED = re.compile(r"^```(.*)\n((?:.*\n)*?)```$", re.MULTILINE)
STATUS = re.compile(r"#.*exit status (\d+)")
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")
DEFAULT = pm.Settings()
EXTRAS = {"arms": ["mujoco"], "studies": ["distributed", "pyarrow"]}
STAND_INS = {  # for what a test has not
    'Client("tcp://scheduler:8786")': "Client(processes=False, dashboard_address=None)",
}


class Example(NamedTuple):
    language: str
    code: str
    printed: str | None
    line: int


def examples(text):
    """The blocks of a page, each with the text block that follows it at once."""
    found = []
    blocks = list(FENCED.finditer(text))
    for block, after in zip(blocks, [*blocks[1:], None], strict=False):
        if block[1] != "text":
            follows = after is not None and after[1] == "text" and not text[block.end() : after.start()].strip()
            found.append(Example(block[1], block[2], after[2] if follows else None, text[: block.start(2)].count("\n")))
    assert len(found) + sum(one.printed is not None for one in found) == len(blocks), "a text block has no example"
    return found


def commands(code):
    """The `peakmin` commands of a block: arguments and exit status."""
    for line in code.splitlines():
        status = STATUS.search(line)
        words, last = shlex.split(line, comments=True), []
        for word in [*words, "&&"]:
            if word != "&&":
                last.append(word)
                continue
            if last and last[0] == "peakmin":
                yield last[1:], int(status[1]) if status else 0
            last = []


def python(example, page, namespace):
    """What a block prints."""
    code = example.code
    for given, stand_in in STAND_INS.items():
        code = code.replace(given, stand_in)
    with redirect_stdout(io.StringIO()) as out:
        exec(compile("\n" * example.line + code, page.name, "exec"), namespace)
    return out.getvalue()


def terminal(example, page, capsys):
    """What the commands of a block print."""
    out = ""
    for arguments, status in commands(example.code):
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
        said = capsys.readouterr()
        assert end.value.code == status, f"{page.name}: {' '.join(arguments)}: {said.err}"
        out += said.out
    return out


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_examples_print_what_the_page_says(page, tmp_path, monkeypatch, capsys):
    for extra in EXTRAS.get(page.stem, []):
        pytest.importorskip(extra)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    # what one example has solved the next takes as it is: several commands are shown on one spec
    for module in (cli, pm):
        monkeypatch.setattr(module, "solve", lambda task, settings=None, *_, **__: solved(task, settings or DEFAULT))
    monkeypatch.setattr(animation, "FEW", 2)  # films are looked at by tests of pictures
    monkeypatch.setattr(animation, "MANY", 4)
    namespace = {"__name__": page.stem}
    for example in examples(page.read_text()):
        match example.language:
            case "python":
                printed = python(example, page, namespace)
            case "sh":
                printed = terminal(example, page, capsys)
            case other:
                assert other.startswith("json "), f"{page.name}:{example.line}: a block is called {other!r}"
                (tmp_path / other.removeprefix("json ")).write_text(example.code)
        if example.language == "python" or example.printed is not None:
            wanted = example.printed or ""
            same = doctest.OutputChecker().check_output(wanted, printed, doctest.ELLIPSIS)
            assert same, f"{page.name}:{example.line}:\n{example.code}\nprinted\n{printed}\nnot\n{wanted}"
    plt.close("all")
    if "client" in namespace:
        namespace["client"].close()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    for place, anchor in LINK.findall(page.read_text()):
        target = (page.parent / place).resolve() if place else page
        assert target.is_relative_to(ROOT), place
        assert target.exists(), place
        assert not anchor or anchor in anchors(target), f"{place}#{anchor}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_and_names_of_the_code_are_there(page):
    text = page.read_text()
    for file in re.findall(r"`((?:\w+/)*\w+\.py)`", text):
        assert any((place / file).exists() for place in (ROOT, ROOT / "peakmin", ROOT / "tests")), file
    if page.stem == "method":  # its names in `code` are places in the package
        code = "\n".join(file.read_text() for file in (ROOT / "peakmin").rglob("*.py"))
        for name in re.findall(r"`([A-Za-z]+(?:_[a-z]+)*(?:\.[a-z]+)?)`", FENCED.sub("", text)):
            assert name == "code" or all(re.search(rf"\b{part}\b", code) for part in name.split(".")), name


def test_the_table_of_random_arms_is_that_of_its_lines(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    made = runpy.run_path(str(ROOT / "benchmarks" / "arms_table.py"))
    rows = made["rows_of"](ROOT / "benchmarks" / "random_arms.jsonl")
    assert "\n".join(made["table"](rows)) in (ROOT / "docs" / "arms.md").read_text()


def test_the_house_is_drawn_from_the_code():
    drawn = runpy.run_path(str(ROOT / "docs" / "house.py"))["drawn"]
    assert (ROOT / "docs" / "house.svg").read_text() == drawn(), "run `python docs/house.py`"


def anchors(page):
    """What the headings of a page can be linked by."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


def test_the_readme_is_a_page():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 150


def test_every_page_can_be_found_from_the_readme():
    found, waiting = set(), [ROOT / "README.md"]
    while waiting:
        page = waiting.pop()
        found.add(page)
        linked = {(page.parent / place).resolve() for place, _ in LINK.findall(page.read_text())}
        waiting += [one for one in linked - found if one.suffix == ".md"]
    assert found >= set(PAGES)


def test_examples_are_told_from_each_other():
    text = (
        "```python\nprint(1)\n```\n\n```text\n1\n```\n\n```sh\npeakmin a b && peakmin c  # exit status 3\nmake d\n```\n"
    )
    first, second = examples(text)
    assert first == ("python", "print(1)\n", "1\n", 1)
    assert list(commands(second.code)) == [(["a", "b"], 3), (["c"], 3)]
    with pytest.raises(AssertionError):
        examples("```text\n1\n```\n")
