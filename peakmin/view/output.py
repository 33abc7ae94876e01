"""What the terminal writes besides text: files of a plan, figures, a bar of progress."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import Progress as Bar

from .. import files
from ..plan.plan import Plan
from ..types import Axes, Progress
from . import pyplot as plt
from .kinds import kind_of
from .pictures import animate, figures
from .report import page
from .style import png, sheet


def write_plan(plan: Plan, out: Path, film: bool | None = None) -> None:
    """plan.json, plan.csv, the figures; an animation if asked for, an arm's unless told otherwise."""
    kind = kind_of(plan)
    files.write(out / "plan.json", plan.to_json(indent=2) + "\n")
    headless()
    for name, figure in figures(plan).items():
        files.write(out / f"{name}.png", png(figure))
    if plan.trajectory is not None:
        files.write(out / "plan.csv", plan.to_csv())
        if kind.filmed if film is None else film:
            files.write(out / kind.film, animate(plan))


def write_report(plan: Plan, path: Path, title: str) -> None:
    """One HTML page."""
    headless()
    files.write(path, page(plan, title))


def write_figure(draw: Callable[[Axes], object], path: Path, size: tuple[float, float] = (6.4, 4.8)) -> None:
    """What a painter draws, in inches of this size."""
    headless()
    files.write(path, png(sheet(draw, size=size)))


def headless() -> None:
    """Draw without a screen: pictures go into files."""
    plt.switch_backend("Agg")


@contextmanager
def bar(name: str, stopped: threading.Event | None = None) -> Iterator[Progress | None]:
    """A bar on stderr when that is a terminal, nothing otherwise; full at the end, unless that came by `stopped`."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    with Bar(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(name, total=None)
        yield lambda done, total: shown.update(task, completed=done, total=total)
        if stopped is None or not stopped.is_set():  # a search may be done before all that it had room for
            shown.update(task, completed=1, total=1)
