"""One page on one plan: spec, answer with its bounds, figures, explanation, verification. Nothing is fetched."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterator
from typing import NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from ..plan.plan import Plan
from ..plan.verify import verify
from ..queries.explain import explained
from .kinds import kind_of
from .pictures import figures
from .style import png
from .words import describe

PAGES = Environment(loader=PackageLoader("peakmin", "view"), autoescape=True, undefined=StrictUndefined)


class Row(NamedTuple):
    """A row of the answer's table; its key is its id on the page."""

    key: str
    name: str
    number: str
    unit: str


def page(plan: Plan, title: str = "peakmin") -> str:
    """The page as HTML text.

    Every number on it is the plan's; the plan's document is verified anew for it. For an infeasible plan its
    explanation is made, which takes solves.

    Args:
        title: heading, plain text.
    """
    drawn = figures(plan) if plan.trajectory is not None else {}
    if len(drawn) > 1:  # the overview shows the others again
        drawn.pop("plan")
    return PAGES.get_template("report.html.jinja").render(
        title=title,
        plan=plan,
        rows=_rows(plan),
        beside=kind_of(plan).beside(plan),
        why=explained(plan),
        words=describe(plan),
        pictures={name.replace("_", " "): base64.b64encode(png(figure)).decode() for name, figure in drawn.items()},
        found=verify(plan.to_json()),
        spec=list(_entries("", plan.document()["spec"])),
    )


def _entries(path: str, value: object) -> Iterator[tuple[str, str]]:
    """The entries of a spec and their values as JSON; lists of numbers are one value."""
    if isinstance(value, dict) and value:
        for key, part in value.items():
            yield from _entries(f"{path}.{key}".removeprefix("."), part)
    elif isinstance(value, list) and any(isinstance(part, dict) for part in value):
        for i, part in enumerate(value):
            yield from _entries(f"{path}[{i}]", part)
    else:
        yield path, json.dumps(value, ensure_ascii=False)


def _rows(plan: Plan) -> list[Row]:
    of = "peak acceleration" if plan.keeps else "peak of the path found, which is not as asked"
    rows = [
        Row("peak", of, f"{plan.peak:.9g}", "m/s²"),
        Row("lower_bound", "no motion has less than", f"{plan.lower_bound:.9g}", "m/s²"),
        Row("gap", "gap", f"{plan.gap:.2e}", "of the peak"),
        Row("peak_force", "peak base reaction force", f"{plan.peak_force:.9g}", "N"),
    ]
    times = ", ".join(f"{t:.6g}" for t in plan.obstacle_times)
    rows += [Row("obstacle_times", "obstacle times", times, "s")] if times else []
    if math.isfinite(plan.clearance):
        rows.append(Row("clearance", "clearance at every instant", f"{plan.clearance:.6g}", "m"))
    return [row for row in rows if row.number != "inf" or row.key == "lower_bound"]
