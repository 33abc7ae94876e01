"""The inner loop: the least M for fixed obstacle times, by bisection over feasibility problems or directly."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from ..deadline import over
from ..proofs.bracket import Bracket, HoldProblem, Verdict
from ..spec.settings import Bisection, Settings
from ..types import Array
from .program import DirectProgram, FeasibilityProgram

RELATIVE = 1e-6  # width of a bracket, relative to its upper end, at which it counts as closed
MAX_STEPS = 1100  # halvings or doublings: from one end of the floats to the middle; a problem takes some 40
LARGEST_PEAK = 1e150  # [scaled]; nothing above it is asked for
GROWTH = 1.2  # from a lower end to the next M asked, while no upper end is known
STUCK = 0.9  # of the width before: an unknown verdict that leaves more is none to go on from
TOWARDS_LOWER = 1 / 16  # where verified bisection asks next: lower ends from proofs are the better of the two


def direct(program: DirectProgram, times: Array, settings: Settings, until: float = math.inf) -> Bracket:
    """The bracket [scaled] from `direct`; further solvers are asked while it is not closed.

    Args:
        program: compiled for the maneuver, circle and grid.
        times: obstacle times [s], shape (q,).
        until: a deadline, after which no further solver is asked.
    """
    problem, bracket = _start(program, times)
    for asked, solver in enumerate(settings.solvers):
        if bracket.gap <= RELATIVE or (asked and over(until)):
            break
        bracket = problem.tighten(bracket, program.solve(solver, until))
    return bracket


def bisect(
    program: FeasibilityProgram,
    times: Array,
    settings: Settings,
    hint: Array | None = None,
    until: float = math.inf,
) -> Bracket:
    """The bracket [scaled] from the paper's five steps, `verified` or plain.

    Plain bisection moves an end to the midpoint, and only when the midpoint's verdict is proved; verified
    bisection moves both ends as far as the proofs allow, and asks nearer to the lower end. An M whose verdict
    stays unknown with every solver ends the loop with the bracket as it is, and so does the deadline `until`.

    Args:
        program: compiled for the maneuver, circle and grid.
        times: obstacle times [s], shape (q,).
        hint: multipliers (2+q, d) of a similar problem, a first lower end for verified bisection.
    """
    problem, bracket = _start(program, times)
    if bracket.upper == 0:
        return bracket
    assert isinstance(settings.method, Bisection)
    if settings.method.verified:
        return _verified(program, problem, bracket, settings, hint, until)
    return _plain(program, problem, bracket, settings, until)


def _plain(
    program: FeasibilityProgram, problem: HoldProblem, bracket: Bracket, settings: Settings, until: float
) -> Bracket:
    method, unit = settings.method, program.mass.unit
    assert isinstance(method, Bisection)
    # five: halvings of it do not end on the a-priori bound itself, where no verdict can be proved
    left, right = 0.0, method.upper / unit if method.upper else 5 * bracket.lower
    # 1. If the initial M is not feasible, it is increased until a feasible solution is found.
    for _ in range(MAX_STEPS):
        bracket, verdict = _ask(program, problem, bracket, right, settings.solvers, until)
        if verdict is Verdict.FEASIBLE:
            break
        if verdict is Verdict.UNKNOWN or not right < LARGEST_PEAK or over(until):
            return bracket
        left, right = right, 2 * right
    else:
        return bracket
    # 2. to 5. Halve the bracket until it is as small as asked for.
    for _ in range(MAX_STEPS):
        if right - left <= (method.tolerance / unit if method.tolerance else RELATIVE * right):
            break
        if over(until):
            return replace(bracket, lower=max(left, bracket.lower), upper=min(right, bracket.upper))
        middle = (left + right) / 2
        bracket, verdict = _ask(program, problem, bracket, middle, settings.solvers, until)
        if verdict is Verdict.UNKNOWN:
            return replace(bracket, lower=max(left, bracket.lower), upper=min(right, bracket.upper))
        left, right = (left, middle) if verdict is Verdict.FEASIBLE else (middle, right)
    return replace(bracket, lower=left, upper=right)


def _verified(
    program: FeasibilityProgram,
    problem: HoldProblem,
    bracket: Bracket,
    settings: Settings,
    hint: Array | None,
    until: float,
) -> Bracket:
    method, unit = settings.method, program.mass.unit
    assert isinstance(method, Bisection)
    if hint is not None:
        bracket = problem.raise_lower(bracket, hint)
    for _ in range(MAX_STEPS):
        before = bracket
        width = bracket.upper - bracket.lower
        tolerance = method.tolerance / unit if method.tolerance else RELATIVE * bracket.upper
        if math.isinf(width):
            asked = method.upper / unit if method.upper and hint is None else 0.0
            middle = asked if asked > bracket.lower else GROWTH * bracket.lower
            hint = bracket.multipliers if hint is None else hint
        elif width <= tolerance:
            break
        else:  # a feasible answer this close to the lower end is the last one needed
            middle = bracket.lower + max(TOWARDS_LOWER * width, 0.9 * tolerance)
        bracket, verdict = _ask(program, problem, bracket, middle, [settings.solver], until)
        if verdict is Verdict.UNKNOWN and _stuck(bracket, before):
            # the least M is closer to this one than the solver's accuracy: ask further off, then ask others
            further = middle if math.isinf(width) else bracket.lower + 0.5 * width
            bracket, verdict = _ask(program, problem, bracket, further, settings.solvers, until)
            if verdict is Verdict.UNKNOWN and _stuck(bracket, before):
                break
        if over(until):
            break
    return bracket


def _stuck(bracket: Bracket, before: Bracket) -> bool:
    """Whether the ends have come no closer, or so little that an inaccurate solver could go on for ever."""
    if math.isinf(bracket.upper):
        return bracket.lower == before.lower
    return bracket.upper - bracket.lower > STUCK * (before.upper - before.lower)


def _start(program: DirectProgram | FeasibilityProgram, times: Array) -> tuple[HoldProblem, Bracket]:
    placed = program.place(times)
    problem = HoldProblem(program.mass, program.circle, placed, program.grid.edges(placed))
    return problem, problem.begin()


def _ask(
    program: FeasibilityProgram,
    problem: HoldProblem,
    bracket: Bracket,
    peak: float,
    solvers: Iterable[str],
    until: float,
) -> tuple[Bracket, Verdict]:
    """Whether M = peak [scaled] is feasible, from the first solver whose answer proves it either way."""
    program.M.value = peak * program.mass.unit
    for asked, solver in enumerate(solvers):
        if bracket.verdict(peak) is not Verdict.UNKNOWN or (asked and over(until)):
            break
        bracket = problem.tighten(bracket, program.solve(solver, until))
    return bracket, bracket.verdict(peak)
