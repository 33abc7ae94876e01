"""How the house stands, in figures: `make figures`, or `python -m tests.figures FOLDER` for another tree's.

An import counts wherever it stands: in a function, or for type checkers only. A function's length is from its first line
to its last, and `if`, `for`, `while` and `except` are its branches.
"""

from __future__ import annotations

import ast
import re
import sys
from functools import cache
from pathlib import Path

import grimp

BRANCHES = (ast.If, ast.For, ast.While, ast.ExceptHandler)


def circles(taken: dict[str, set[str]]) -> list[set[str]]:
    """The modules that reach each other, as sets of two or more."""

    def reached(module: str) -> set[str]:
        found, left = set(), [module]
        while left:
            new = taken[left.pop()] - found
            found |= new
            left += new
        return found

    all_reached = {module: reached(module) for module in taken}
    rings = {
        frozenset(other for other in reach if module in all_reached[other]) | {module}
        for module, reach in all_reached.items()
        if module in reach
    }
    return sorted((set(ring) for ring in rings), key=len, reverse=True)


def longest(taken: dict[str, set[str]], rings: list[set[str]]) -> int:
    """How many files hang below each other at most, each circle counted as one."""
    ring_of = {module: frozenset(ring) for ring in rings for module in ring}

    @cache
    def depth(ring: frozenset[str]) -> int:
        below = {ring_of.get(other, frozenset({other})) for module in ring for other in taken[module]} - {ring}
        return 1 + max(map(depth, below), default=0)

    return max(depth(ring_of.get(module, frozenset({module}))) for module in taken)


def long_functions(path: Path) -> list[str]:
    """The functions of a file over 50 lines or ten branches."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or 0) - node.lineno + 1
            branches = sum(isinstance(inner, BRANCHES) for inner in ast.walk(node))
            if lines > 50 or branches > 10:
                found.append(f"{path.stem}.{node.name} ({lines} lines, {branches} branches)")
    return found


def words_any(path: Path) -> int:
    """How often a file says `Any` where it is a type."""
    return sum(isinstance(node, ast.Name) and node.id == "Any" for node in ast.walk(ast.parse(path.read_text())))


def main() -> None:
    root = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    sys.path.insert(0, str(root))
    graph = grimp.build_graph("peakmin", cache_dir=None)
    taken = {module: set(graph.find_modules_directly_imported_by(module)) for module in graph.modules}
    rings = circles(taken)
    files = sorted((root / "peakmin").rglob("*.py"))
    sizes = {path: len(path.read_text().splitlines()) for path in files}
    tests = [path.read_text() for path in sorted((root / "tests").rglob("test_*.py"))]
    print(f"files                        {len(files)}, of them __init__ {sum(p.stem == '__init__' for p in files)}")
    print(f"lines                        {sum(sizes.values())}")
    print(f"files under 100 lines        {sum(n < 100 and p.stem != '__init__' for p, n in sizes.items())}")
    print(f"circles, files in each       {', '.join(str(len(ring)) for ring in rings) or 'none'}")
    print(f"longest chain of imports     {longest(taken, rings)}")
    print(f"Any                          {sum(map(words_any, files))}")
    print(f"test functions, in files     {sum(len(re.findall(r'^def test_', t, re.M)) for t in tests)}, {len(tests)}")
    print("functions over 50 lines or ten branches:")
    for path in files:
        for words in long_functions(path):
            print(f"  {words}")


if __name__ == "__main__":
    main()
