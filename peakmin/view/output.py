"""What the terminal writes besides text: files of a plan, figures, a bar of progress."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .. import files

if TYPE_CHECKING:
    from ..plan.arm_plan import ArmPlan
    from ..plan.plan import Plan
    from ..queries.budget import ErrorBudget
    from ..search.sweep import Sweep
    from ..types import Progress


def write_plan(plan: Plan | ArmPlan, out: Path, gif: bool | None = False) -> None:
    """plan.json, plan.csv, the figures; an animation if asked for, an arm's unless told otherwise."""
    from ..plan.plan import Plan

    if not isinstance(plan, Plan):
        from ..view import arm_words as terminal

        headless()
        return terminal.write(plan, out, gif is not False)
    files.write(out / "plan.json", plan.to_json(indent=2) + "\n")
    if plan.trajectory is not None:
        files.write(out / "plan.csv", plan.to_csv())
        save(out / "plan.png", plan)
        if gif:
            from .plots import animate

            files.write(out / "plan.gif", animate(plan))


def write_report(plan: Plan | ArmPlan, path: Path, title: str) -> None:
    headless()
    from .report import report

    files.write(path, report(plan, title))


def save(path: Path, thing: Plan | Sweep | ErrorBudget) -> None:
    import io

    headless()
    import matplotlib.pyplot as plt

    from ..plan.plan import Plan
    from ..view import plots

    if isinstance(thing, Plan):
        figure = plots.overview(thing)
    else:
        with plt.rc_context(plots.STYLE):
            figure = plt.figure()
            thing.plot(ax=figure.add_subplot())
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    plt.close(figure)
    files.write(path, buffer.getvalue())


def headless() -> None:
    import matplotlib

    matplotlib.use("Agg")


@contextmanager
def bar(name: str) -> Iterator[Progress | None]:
    """A bar on stderr when that is a terminal, nothing otherwise."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
