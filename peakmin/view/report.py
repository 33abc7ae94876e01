"""One page on one plan: spec, answer with its bounds, figures, explanation, verification. Nothing is fetched."""

from __future__ import annotations

import base64
import io
import json
import math
from html import escape
from typing import TYPE_CHECKING

from ..plan.plan import Plan
from ..view import words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..plan.arm_plan import ArmPlan

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #111; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; } td, th { text-align: left; padding: .2rem 1.2rem .2rem 0; vertical-align: top; }
th { font-weight: 600; } td.number { font-variant-numeric: tabular-nums; }
pre { background: #f5f5f5; padding: .8rem; overflow-x: auto; font-size: .85rem; }
img { max-width: 100%; height: auto; } .solved, .verified { color: #00694b; } .infeasible, .wrong { color: #a03000; }
"""


def report(plan: Plan | ArmPlan, title: str = "peakmin") -> str:
    """The page as HTML text.

    Every number on it is the plan's; the plan's document is verified anew for it. For an infeasible plan its
    explanation is made, which takes solves.

    Args:
        title: heading, plain text.
    """
    from ..api import verify

    found = verify(plan.to_json())
    why = plan.explanation
    said = "verified: all of it was computed anew from the plan's document, without a solver"
    checked = [f'<p class="verified">{said}</p>'] if found.passed else []
    checked += [f'<p class="wrong">not as stated: {escape(problem)}</p>' for problem in found.problems]
    parts = [
        f'<h1>{escape(title)}</h1><p id="status" class="{plan.status}">{plan.status}</p>',
        "<h2>Answer</h2>",
        _table(_rows(plan)),
        *(["<h2>Why not</h2>", f'<pre id="explanation">{escape(str(why))}</pre>'] if why is not None else []),
        "<h2>In words</h2>",
        f"<pre>{escape(_words(plan))}</pre>",
        "<h2>Figures</h2>" if plan.trajectory is not None else "",
        *(_image(name, figure) for name, figure in _figures(plan).items()),
        "<h2>Verification</h2>",
        *checked,
        "<h2>Spec</h2>",
        f'<pre id="spec">{escape(_spec(plan))}</pre>',
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n' + "\n".join(parts) + "\n</body></html>\n"


def _rows(plan: Plan | ArmPlan) -> list[tuple[str, str, str, str]]:
    """Id, name, number and unit."""
    of = "peak acceleration" if plan.status == "solved" else "peak of the path found, which is not as asked"
    rows = [
        ("peak", of, f"{plan.peak:.9g}", "m/s²"),
        ("lower_bound", "no motion has less than", f"{plan.lower_bound:.9g}", "m/s²"),
        ("gap", "gap", f"{plan.gap:.2e}", "of the peak"),
        ("peak_force", "peak base reaction force", f"{plan.peak_force:.9g}", "N"),
    ]
    times = ", ".join(f"{t:.6g}" for t in plan.obstacle_times)
    rows += [("obstacle_times", "obstacle times", times, "s")] if times else []
    if math.isfinite(plan.clearance):
        rows.append(("clearance", "clearance at every instant", f"{plan.clearance:.6g}", "m"))
    return [row for row in rows if row[2] != "inf" or row[0] == "lower_bound"]


def _table(rows: list[tuple[str, str, str, str]]) -> str:
    cells = (
        f'<tr><th>{escape(name)}</th><td class="number" id="{key}">{escape(number)}</td><td>{escape(unit)}</td></tr>'
        for key, name, number, unit in rows
    )
    return "<table>" + "".join(cells) + "</table>"


def _words(plan: Plan | ArmPlan) -> str:
    if isinstance(plan, Plan):
        return words.describe(plan)
    from ..view import arm_words as terminal

    return terminal.describe(plan)


def _figures(plan: Plan | ArmPlan) -> dict[str, Figure]:
    if plan.trajectory is None:
        return {}
    if isinstance(plan, Plan):
        from .plots import overview

        return {"path and acceleration": overview(plan)}
    from .arm_plots import figures

    return {name.replace("_", " "): figure for name, figure in figures(plan).items() if name != "plan"}


def _image(name: str, figure: Figure) -> str:
    import matplotlib.pyplot as plt

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120, metadata={"Software": None})
    plt.close(figure)
    return (
        f'<p><img alt="{escape(name)}" src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"></p>'
    )


def _spec(plan: Plan | ArmPlan) -> str:
    return json.dumps(plan.document()["spec"], indent=2)
