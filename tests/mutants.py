"""Does every proof have a test that fails when it is wrong? `make mutants` spoils each in turn, one place at a time.

A mutant is a place of the package with another sign, factor, comparison, end of a range, or without its clip, absolute
value, negation or guard. Of the tests that `mutants.toml` names for its module those that call its function are run, in a
process of its own, forked when they are collected, the fastest first. Those that no test notices are listed, and make the
exit status 1. Equivalent ones, which change no proof, are listed in `mutants.toml` with the reason; what is noticed after
all does not belong there.

    python -m tests.mutants [MODULE ...]    # such as least_over_times arm.proof; default all of them
"""

from __future__ import annotations

import ast
import json
import os
import signal
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any, NamedTuple

import pytest

HERE = Path(__file__).parent
PACKAGE = HERE.parent / "peakmin"
PROCESSES = 2
PATIENCE, SECONDS = 10, 2  # times as long as a test takes of the processor, and seconds more: then it counts as failed

PAIRS = ((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.BitAnd, ast.BitOr), (ast.And, ast.Or))
SWAPPED = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
REVERSED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
CLOSED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OTHER = {a: b for pair in (("min", "max"), ("minimum", "maximum"), ("any", "all")) for a, b in (pair, pair[::-1])}
DROPPED = ("abs", "clip")
# types, indices, messages, and what is made when the module is loaded
LEFT = ("annotation", "returns", "decorator_list", "defaults", "kw_defaults", "slice", "keywords", "exc", "msg")


class Mutant(NamedTuple):
    """One change of a function: the child of `parent` in its `field`, at `index` of a list or None, becomes `new`."""

    module: str
    function: str
    tree: ast.Module
    parent: ast.AST
    field: str
    index: int | None
    new: ast.AST
    line: int
    change: str

    @property
    def key(self) -> str:
        """By which the list of equivalent ones knows it, wherever its line has gone."""
        return f"{self.module}.{self.function}: {self.change}"

    @property
    def target(self) -> FunctionType:
        """The function itself, out of properties and class methods."""
        here: Any = import_module(f"peakmin.{self.module}")
        for name in self.function.split("."):
            here = vars(here)[name]
        while not isinstance(here, FunctionType):
            here = next(
                getattr(here, name) for name in ("fget", "func", "__func__", "__wrapped__") if hasattr(here, name)
            )
        return here

    def spoil(self) -> None:
        """In this process: the function gets other code, wherever it was imported to."""
        if self.index is None:
            setattr(self.parent, self.field, self.new)
        else:
            getattr(self.parent, self.field)[self.index] = self.new
        code = compile(ast.fix_missing_locations(self.tree), self.target.__code__.co_filename, "exec")
        for name in self.function.split("."):
            code = next(one for one in code.co_consts if isinstance(one, CodeType) and one.co_name == name)
        self.target.__code__ = code


def variants(node: ast.AST, exact: bool) -> Iterator[ast.AST]:
    """What may stand in place of a node. exact: whether `<` and `<=` differ, as they do where numbers are exact."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in SWAPPED:
            yield ast.BinOp(left, SWAPPED[type(op)](), right)
        case ast.AugAssign(target, op, value) if type(op) in SWAPPED:
            yield ast.AugAssign(target, SWAPPED[type(op)](), value)
        case ast.BoolOp(op, values):
            yield ast.BoolOp(SWAPPED[type(op)](), values)
        case ast.Compare(left, ops, right):
            for table in (REVERSED, CLOSED) if exact else (REVERSED,):
                for i, op in enumerate(ops):
                    if type(op) in table:
                        yield ast.Compare(left, [*ops[:i], table[type(op)](), *ops[i + 1 :]], right)
        case ast.UnaryOp(ast.USub() | ast.Not() | ast.Invert(), operand):
            yield operand
        case ast.Call(ast.Name(name) | ast.Attribute(_, name), [first, *_]) if name in DROPPED:
            yield first
        case ast.Name(name) if name in OTHER:
            yield ast.Name(OTHER[name], node.ctx)
        case ast.Attribute(value, name) if name in OTHER:
            yield ast.Attribute(value, OTHER[name], node.ctx)
        case ast.Constant(value) if type(value) in (int, float):
            yield ast.Constant(2 * value if value else type(value)(1))
        case ast.If(_, [*_, ast.Return() | ast.Continue() | ast.Break()], []):
            yield ast.If(ast.Constant(False), node.body, [])


def places(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """All nodes below one that are looked at: (parent, field, index, node)."""
    for field, value in ast.iter_fields(node):
        for index, child in enumerate(value if isinstance(value, list) else [value]):
            if field not in LEFT and isinstance(child, ast.AST) and not isinstance(child, ast.JoinedStr):
                yield node, field, index if isinstance(value, list) else None, child
                yield from places(child)


def mutants(module: str, functions: list[str], exact: bool | list[str]) -> list[Mutant]:
    """All of them in the functions named, methods with their class; of all functions where none is named.

    exact: whether `<` and `<=` differ, or in which functions.
    """
    tree = ast.parse(PACKAGE.joinpath(*module.split(".")).with_suffix(".py").read_text())
    homes = [("", tree), *((f"{c.name}.", c) for c in tree.body if isinstance(c, ast.ClassDef))]
    own = {home + f.name: f for home, body in homes for f in body.body if isinstance(f, ast.FunctionDef)}
    out = []
    for name in functions or own:
        for parent, field, index, node in places(own[name]):
            for new in variants(node, exact if isinstance(exact, bool) else name in exact):
                change = " -> ".join(ast.unparse(one).partition("\n")[0] for one in (node, new))
                out.append(Mutant(module, name, tree, parent, field, index, new, getattr(node, "lineno", 0), change))
    return out


def run(items: list[pytest.Item], before: Callable[[pytest.Item], None], after: Callable[[pytest.Item], None]) -> bool:
    """Whether all these tests pass."""
    for item, following in zip(items, [*items[1:], None], strict=True):
        before(item)
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        after(item)
        if item.session.testsfailed:
            return False
    return True


def called(items: list[pytest.Item]) -> dict[str, tuple[float, list[str]]] | None:
    """For each test its seconds of the processor and the package's functions that it calls; None where one fails."""
    out, codes, begun = {}, set(), 0.0

    def see(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            codes.add(frame.f_code)

    def before(_: pytest.Item) -> None:
        nonlocal begun
        begun = time.process_time()
        codes.clear()
        sys.setprofile(see)

    def after(item: pytest.Item) -> None:
        sys.setprofile(None)
        names = {f"{code.co_filename}:{code.co_qualname.partition('.<locals>')[0]}" for code in codes}
        out[item.nodeid] = time.process_time() - begun, [name for name in names if name.startswith(str(PACKAGE))]

    return out if run(items, before, after) else None


def forked(work: Callable[[], Any]) -> tuple[int, int]:
    """A process that does the work, silently, and the end of a pipe that its result comes out of, as JSON."""
    end, begin = os.pipe()
    if child := os.fork():
        os.close(begin)
        return child, end
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    try:
        with os.fdopen(begin, "w") as out:
            json.dump(work(), out)
    finally:
        os._exit(0)


def result(end: int) -> Any:
    """What came out; None where the process was killed."""
    with os.fdopen(end) as file:
        return json.loads(file.read() or "null")


class Mutation:
    """The plugin that runs mutants once the tests are collected."""

    def __init__(self, settings: dict[str, Any], modules: list[str]):
        self.settings, self.modules = settings, modules
        self.equivalent = {key for group in settings["equivalent"] for key in group["mutants"]}
        self.passed: list[str] = []
        self.total = 0

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        seen = result(forked(lambda: called(session.items))[1])
        os.wait()
        if seen is None:
            raise pytest.UsageError("the tests fail as it is")
        items = sorted(session.items, key=lambda item: seen[item.nodeid][0])
        for module in self.modules:
            of, begun = self.settings["modules"][module], time.monotonic()
            every = mutants(module, of.get("functions", []), of.get("exact", False))
            self.all_of(every, [item for item in items if item.nodeid.partition("::")[0] in of["tests"]], seen)
            print(f"{module}: {len(every)} mutants, {time.monotonic() - begun:.0f} s", flush=True)
        return True

    def all_of(self, every: list[Mutant], items: list[pytest.Item], seen: dict[str, Any]) -> None:
        def limit(item: pytest.Item) -> None:
            signal.setitimer(signal.ITIMER_PROF, PATIENCE * seen[item.nodeid][0] + SECONDS)

        def passes(mutant: Mutant, own: list[pytest.Item]) -> bool:
            mutant.spoil()
            return run(own, limit, lambda _: None)

        left, running = every[::-1], {}
        while left or running:
            while left and len(running) < PROCESSES:
                mutant = left.pop()
                name = f"{mutant.target.__code__.co_filename}:{mutant.function}"
                own = [item for item in items if name in seen[item.nodeid][1]]
                child, end = forked(lambda mutant=mutant, own=own: passes(mutant, own))
                running[child] = mutant, end
            mutant, end = running.pop(os.wait()[0])
            if result(end):
                self.passed.append(mutant.key)
                if mutant.key not in self.equivalent:
                    file = f"peakmin/{mutant.module.replace('.', '/')}.py"
                    print(f"{file}:{mutant.line}: {mutant.function}: {mutant.change}", flush=True)
        self.total += len(every)


def main() -> int:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    os.chdir(HERE.parent)
    settings = tomllib.loads((HERE / "mutants.toml").read_text())
    modules = sys.argv[1:] or list(settings["modules"])
    tests = sorted({test for module in modules for test in settings["modules"][module]["tests"]})
    mutation = Mutation(settings, modules)
    options = ["-q", "-s", *(f"-pno:{name}" for name in ("cacheprovider", "benchmark", "xdist", "cov"))]
    if pytest.main([*options, *tests], [mutation]) not in (0, 5):
        return 2
    allowed = [key for key in mutation.passed if key in mutation.equivalent]
    stale = {
        key for key in mutation.equivalent.difference(allowed) if key.startswith(tuple(f"{one}." for one in modules))
    }
    for key in sorted(stale):
        print(f"mutants.toml: noticed, or no longer there: {key}")
    survivors = len(mutation.passed) - len(allowed)
    print(f"{mutation.total} mutants, {survivors} survivors, {len(allowed)} equivalent")
    return 1 if survivors or stale else 0


if __name__ == "__main__":
    sys.exit(main())
