"""What the terminal says: of plans, sweeps, studies and simulations."""

from __future__ import annotations

import io
import math

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..plan.plan import Plan
from ..plan.reason import stopped
from ..queries.shortest import Shortest
from ..queries.simulate import Simulation
from ..queries.study.table import Study
from ..search.sweep import Sweep
from .hints import advice, units
from .kinds import kind_of
from .sentences import line

ROWS = 60  # of a study, on a terminal
FORMS = {"peak": ".6g", "lower_bound": ".6g", "gap": ".1e"}  # of a study's numbers


def one_line(text: str) -> str:
    """The text without what a terminal would take for a command or a new line, as file names may have it."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def describe(plan: Plan) -> str:
    """The plan in words, with how it was made."""
    return f"{facts(plan)}\n{line('made by', kind_of(plan).made(plan))}"


def facts(plan: Plan) -> str:
    """The plan in words: its answer, what it keeps, what is unknown and what to try."""
    kind = kind_of(plan)
    found = [line("try" if k else "unknown", one) for k, one in enumerate(advice(plan))]
    return "\n".join([*_answer(plan, kind.bounded(plan)), *kind.facts(plan), *units(plan.maneuver), *found])


def _answer(plan: Plan, bounded: str) -> list[str]:
    """Status, peak and gap, max_peak, bound (of what), gap, and the limit that ended the search."""
    found, ended = math.isfinite(plan.peak), stopped(plan)
    head = f"peak {plan.peak:.9g} m/s², peak base force {plan.peak_force:.9g} N" if found else "no motion"
    head += f", gap {plan.gap:.2e}" if plan.keeps else ""
    if plan.status == "infeasible":
        lines = [f"{plan.status}: nothing keeps all that was asked (proved)"]
        lines += [line("path found", f"{head}, does not keep it either")] if found else []
    else:
        other = "the path found, which does not keep all that was asked, has " if found else ""
        lines = [f"{plan.status}: {other if plan.status == 'unknown' else ''}{head}"]
    limit = plan.maneuver.max_peak
    if limit is not None and not plan.keeps:
        proved = "nothing keeps it (proved)" if plan.status == "infeasible" else "not proved to be impossible"
        lines.append(line("max_peak", f"{limit:.9g} m/s²: {proved}"))
    lines.append(line("lower bound", f"{plan.lower_bound:.9g} m/s² for {bounded}"))
    if found and plan.peak >= plan.lower_bound * (1 - 1e-9):
        accept = plan.settings.search.accept
        more = f", more than the {accept:g} accepted" if plan.status == "feasible" else ""
        lines.append(line("gap", f"{plan.gap:.2e} of the peak{more}"))
    return lines if ended is None else [*lines, line("stopped", ended)]


def so_far(plan: Plan) -> str:
    """What a search that was stopped has."""
    if plan.keeps:
        return f"the best plan so far has a peak of {plan.peak:.6g} m/s², {plan.gap:.1e} of it above the bound"
    return f"no plan so far, and none can have a peak below {plan.lower_bound:.6g} m/s²"


def done(sweep: Sweep) -> str:
    """How far a sweep came."""
    return f"{len(sweep.peak)} of {sweep.asked} obstacle times are done"


def least_duration(found: Shortest) -> str:
    """The least duration for a peak, and its plan in words."""
    return "\n".join(
        [
            f"shortest: {found.duration:.9g} s for a peak of {found.peak:.9g} m/s², gap {found.gap:.2e}",
            line("lower bound", f"{found.lower_bound:.9g} s for any control of that peak"),
            describe(found.plan),
        ]
    )


def sweep_table(sweep: Sweep) -> str:
    """A line for each point, then the winner's plan in words.

    By hand: a sweep may have 100,000 points, and rich takes a second for every 5,000 of them.
    """
    times = sweep.obstacle_times.reshape(len(sweep.peak), -1)
    lines = ["  T_obs [s]" + " " * (10 * max(times.shape[1] - 1, 0)) + "   least M [m/s²]   lower end"]
    for i, row in enumerate(times):
        mark = "  <- least" if i == sweep.winner else ""
        cells = " ".join(f"{t:9.4f}" for t in row) or " " * 9
        lines.append(f"  {cells}   {sweep.peak[i]:14.6f}   {sweep.lower[i]:9.4f}{mark}")
    if len(sweep.peak) < sweep.asked:
        lines.append(f"  {done(sweep)}")
    return "\n".join([*lines, describe(sweep.best)])


def study_table(study: Study) -> str:
    """What varies and what came out, one line for each of the first rows."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in (*study.varied, "status", "peak [m/s²]", "lower bound", "gap"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    table.add_column(Text("T_obs [s]"), no_wrap=True)
    for row in study.rows[:ROWS]:
        last = row["error"] or row["reason"] or " ".join(f"{t:.4g}" for t in row["obstacle_times"] or [])
        names = (*study.varied, "status", *FORMS)
        table.add_row(*(Text(_short(row[name], FORMS.get(name, ".6g"))) for name in names), Text(last))
    out = Console(file=io.StringIO(), width=100_000, color_system=None)  # no line is broken, no colour is set
    with out.capture() as shown:
        out.print(table)
    more = [f"  and {len(study) - ROWS} rows more"] if len(study) > ROWS else []
    return "\n".join([*(row.rstrip() for row in shown.get().splitlines()), *more, repr(study)])


def _short(value: object, form: str) -> str:
    if isinstance(value, float):
        return format(value, form)
    return "" if value is None else str(value)


def felt(found: Simulation) -> str:
    """A simulation in words."""
    return (
        f"planned peak base force    {found.planned_peak:.6g} N\n"
        f"simulated peak base force  {found.felt_peak:.6g} N\n"
        f"largest difference         {100 * found.error:.3f} % of the planned peak, at any instant\n"
        f"joint angles               within {found.drift:.2e} rad of the plan"
    )
