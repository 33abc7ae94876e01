"""The terminal: `peakmin solve | explain | shortest | sweep | budget | study | compare | simulate | verify | ...`.

Results go to stdout, progress and errors to stderr.

Exit status: 0 solved or feasible, 1 `paper` differs from the paper, 2 bad input, 3 proved infeasible, 4 nothing proved,
130 stopped by Ctrl-C; `solve`, `sweep` and `explain` then give what they have, at a second one nothing.
"""

from __future__ import annotations

import json
import math
import sys
import threading
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal, NoReturn

import numpy as np
import typer
from typer.exceptions import TyperException

from . import files, paper
from .deadline import ended_by_interrupt
from .errors import PeakminError, SpecError
from .plan.arm_plan import ArmPlan
from .plan.document import Status, digest
from .plan.document import schema as plan_schema
from .plan.export import FORMATS
from .plan.plan import Plan
from .plan.verify import verify
from .queries.budget import error_budget
from .queries.compare import compare, table
from .queries.explain import explained
from .queries.shortest import shortest
from .queries.simulate import simulate
from .queries.study.study import study
from .queries.study.table import KINDS as TABLES
from .search.solve import solve
from .search.sweep import sweep
from .spec.reading import called, load, named, of_kind, read_file
from .spec.settings import GlobalSearch
from .spec.spec import AnySpec, ArmSpec, Spec, read_spec, schema, spec_of
from .spec.study import StudySpec
from .view import curves, output, pictures, refused, words
from .view.streams import answer, aside, only_answers

EXIT = {"solved": 0, "feasible": 0, "infeasible": 3, "unknown": 4}
BAD_INPUT, DIFFERS, STOPPED = 2, 1, 130
DRAWN = (7.0, 5.6)  # inches of a task's picture

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False, help=__doc__)
SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="Spec file (JSON), - for stdin; see `peakmin schema`.")]
PlanFile = Annotated[Path, typer.Argument(metavar="PLAN", help="plan.json as `peakmin solve --out` writes it.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write plots, JSON and CSV there.")]


def _say_version(asked: bool) -> None:
    if asked:
        with only_answers():
            answer(f"peakmin {version('peakmin')}")
        raise typer.Exit


@app.callback()
def about(
    _: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_say_version, help="Print the version and exit.")
    ] = False,
) -> None:
    """What stands before a verb."""


@app.command("solve")
@only_answers()
def solve_command(
    spec: SpecFile,
    as_json: Json = False,
    out: Out = None,
    gif: Annotated[
        bool | None, typer.Option("--gif/--no-gif", help="With --out, animate the plan; default: an arm's only.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write one HTML page: spec, answer, figures, verification.")
    ] = None,
) -> None:
    """The maneuver of least peak, over the obstacle times that the spec's search visits."""
    asked = read_spec(spec)
    if gif and out is None:
        raise SpecError("--gif: was given, must come with --out, where the animation is written")
    files.ready(out)
    files.ready_for(report)
    with ended_by_interrupt() as stopped:
        plan = _solved(asked, "solve", stopped)
        if out:
            output.write_plan(plan, out, gif)
        if report:
            output.write_report(plan, report, Path(called(spec)).stem)
        answer(plan.to_json(indent=2) if as_json else words.describe(plan))
        _say_where(as_json, out, report)
        if plan.status == "infeasible" and not as_json and not stopped.is_set():
            with output.bar("explain", stopped):
                why = explained(plan, stopped)
            answer(str(why))
    _end(plan.status, stopped, words.so_far(plan))


@app.command("show")
@only_answers()
def show_command(
    spec: SpecFile,
    as_json: Json = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="The picture, .png; default named as the spec, here.")
    ] = None,
) -> None:
    """The task drawn, before anything is solved; of a refused spec what can be read, what is wrong in red."""
    target = Path(f"{Path(called(spec)).stem}.png") if out is None else out
    if target.suffix != ".png":
        raise SpecError(f"--out: was {str(target)!r}, must end in .png")
    files.ready_for(target)
    with named(spec):
        data = load(read_file(spec))
        of_kind(data, "spec")
        try:
            asked = spec_of(data)
        except SpecError as error:
            output.write_figure(partial(refused.sketch, data, words.one_line(str(error))), target, DRAWN)
            _say_wrote(as_json, target)
            raise
    output.write_figure(partial(pictures.problem, asked.task), target, DRAWN)
    _say_wrote(as_json, target)


@app.command("explain")
@only_answers()
def explain_command(spec: SpecFile, as_json: Json = False) -> None:
    """Why a spec is proved infeasible: which entries conflict, and the smallest changes that were solved."""
    asked = read_spec(spec)
    with ended_by_interrupt() as stopped:
        plan = _solved(asked, "explain", stopped)
        with output.bar("explain", stopped):
            why = explained(plan, stopped)
    if as_json:
        answer(_json({"status": plan.status, "explanation": None if why is None else why.document()}))
    else:
        answer(f"{plan.status}: " + ("nothing to explain" if why is None else str(why)))
    _end(plan.status, stopped, words.so_far(plan))


@app.command("shortest")
@only_answers()
def shortest_command(
    spec: SpecFile,
    peak: Annotated[float, typer.Option(help="Bound on the acceleration [m/s²].")],
    as_json: Json = False,
    out: Out = None,
) -> None:
    """The least duration for a given peak, past walls; the spec's own duration does not matter."""
    asked = _of_a_point(spec, "shortest")
    files.ready(out)
    search = asked.settings.search if isinstance(asked.settings.search, GlobalSearch) else GlobalSearch()
    with output.bar("shortest"):
        found = shortest(asked.maneuver, peak, search.gap, asked.settings.node_limit)
    if out:
        output.write_plan(found.plan, out)
        files.write(out / "shortest.json", found.to_json(indent=2) + "\n")
    answer(found.to_json(indent=2) if as_json else words.least_duration(found))
    _say_where(as_json, out)
    raise typer.Exit(EXIT[found.plan.status])


@app.command("compare")
@only_answers()
def compare_command(spec: SpecFile, as_json: Json = False) -> None:
    """An arm's least peak beside the same move by joint quintics, minimum jerk and a smooth path."""
    asked = read_spec(spec)
    if asked.task.kind != "arm":
        raise SpecError(f"{called(spec)}: was a spec of a centre of mass, must be one of an arm for `compare`")
    plan = _solved(asked, "compare")
    if plan.trajectory is None:
        raise PeakminError("compare: was a task without a free motion, must have one")
    assert isinstance(plan, ArmPlan)
    rows = compare(plan)
    answer(_json([vars(row) for row in rows]) if as_json else table(rows))


@app.command("simulate")
@only_answers()
def simulate_command(plan: PlanFile, as_json: Json = False) -> None:
    """Drive the simulated arm (MuJoCo, gravity off) along a plan and print planned and simulated peak base force."""
    with named(plan):
        text = read_file(plan)
        data = load(text, finite=True)
        of_kind(data, "plan")
        if data.get("kind") != "arm":
            raise SpecError("the document: was a plan of a centre of mass, must be one of an arm for `simulate`")
        if data.get("digest") != digest(data):
            raise SpecError("digest: was that of another text, must be as it was written (`peakmin verify` tells more)")
        asked = ArmPlan.from_json(text)
    found = simulate(asked)
    numbers = {
        "planned_peak": found.planned_peak,
        "simulated_peak": found.felt_peak,
        "peak_error": found.felt_peak / found.planned_peak - 1 if found.planned_peak else 0.0,
        "curve_error": found.error,
        "drift": found.drift,
        "agrees": found.agrees,
    }
    answer(_json(numbers) if as_json else words.felt(found))
    raise typer.Exit(0 if found.agrees else EXIT["unknown"])


@app.command("sweep")
@only_answers()
def sweep_command(spec: SpecFile, as_json: Json = False, out: Out = None) -> None:
    """The least M at every obstacle time of a sweep (the paper's outer loop)."""
    asked = _of_a_point(spec, "sweep")
    files.ready(out)
    with ended_by_interrupt() as stopped, output.bar("sweep", stopped) as progress:
        found = sweep(asked.maneuver, asked.settings, progress=progress, stopped=stopped)
    if out:
        output.write_plan(found.best, out)
        files.write(out / "sweep.json", found.to_json(indent=2) + "\n")
        files.write(out / "sweep.csv", found.to_csv())
        if found.obstacle_times.ndim == 1:
            output.write_figure(partial(curves.peak_over_time, found), out / "sweep.png")
    answer(found.to_json(indent=2) if as_json else words.sweep_table(found))
    _say_where(as_json, out)
    _end(found.best.status, stopped, words.done(found))


@app.command("budget")
@only_answers()
def budget_command(spec: SpecFile, as_json: Json = False, out: Out = None) -> None:
    """What the polygon, the grid, the tolerance and the obstacle times each cost, adding up to the whole error."""
    asked = _of_a_point(spec, "budget")
    files.ready(out)
    errors = error_budget(asked.maneuver, asked.settings)
    if out:
        output.write_figure(partial(curves.error_parts, errors), out / "budget.png", (8, 3))
        files.write(out / "budget.json", _json(vars(errors)) + "\n")
    answer(_json(vars(errors)) if as_json else errors.table())
    _say_where(as_json, out)


@app.command("study")
@only_answers()
def study_command(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (JSON): base, grid, zip.")],
    as_json: Json = False,
    out: Annotated[
        Path, typer.Option("--out", metavar="PATH", help="Table to write, .csv or .parquet, or a folder for it.")
    ] = Path("out"),
    workers: Annotated[int | None, typer.Option(help="Processes; default one for each processor.")] = None,
) -> None:
    """Solve a grid of specs, one row each; run again, it goes on where it was stopped."""
    asked = StudySpec.read(study_file)
    if out.suffix[1:].isalpha() and out.suffix not in TABLES and not out.is_dir():
        raise SpecError(f"--out: was {str(out)!r}, must be a folder, or end in {' or '.join(TABLES)}")
    store = out if out.suffix in TABLES else out / f"{Path(called(study_file)).stem}.csv"
    try:
        with output.bar("study") as progress:
            found = study(asked, store=store, workers=workers, progress=progress)
    except KeyboardInterrupt as stopped:
        aside(f"peakmin: stopped, {stopped}")
        sys.exit(STOPPED)
    answer(found.to_json(indent=2) if as_json else f"{words.study_table(found)}\nwrote {store}")
    raise typer.Exit(0 if found.answered else EXIT["unknown"])


@app.command("verify")
@only_answers()
def verify_command(plan: PlanFile, as_json: Json = False) -> None:
    """Compute anew everything that a plan file states, from the file alone; exit status 4 if any of it is not so."""
    with named(plan):
        text = read_file(plan)
        of_kind(load(text), "plan")
        found = verify(text)
    stated = found.plan
    if as_json:
        numbers = {"peak": stated.peak, "lower_bound": found.lower_bound, "gap": stated.gap, "scope": stated.scope}
        answer(
            _json({"verified": found.passed, **numbers, "problems": list(found.problems), "since": list(found.since)})
        )
    else:
        for problem in found.problems:
            answer(f"  {words.one_line(problem)}")
        for one in found.since:
            answer(f"  asked since its version, and not kept: {words.one_line(one)}")
        answer("verified" if found.passed else "NOT so; what is stated:")
        with np.errstate(all="ignore"):
            answer(words.facts(stated))
    raise typer.Exit(0 if found.passed else EXIT["unknown"])


@app.command("export")
@only_answers()
def export_command(
    plan: PlanFile,
    as_json: Json = False,
    form: Annotated[Literal["csv", "joint_trajectory"], typer.Option("--format", help="Of what is written.")] = "csv",
    rate: Annotated[float | None, typer.Option(help="Rows a second; default a row for each node.")] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write it there, not to stdout.")] = None,
) -> None:
    """A plan's motion for a controller, once the file is verified: CSV, or ROS's JointTrajectory as JSON."""
    if as_json and out is None and form == "csv":
        raise SpecError("--json: was given for csv, must come with --out, or with --format joint_trajectory")
    files.ready_for(out)
    with named(plan):
        text = read_file(plan)
        of_kind(load(text), "plan")
        found = verify(text)
    if not found.passed:
        raise PeakminError(f"{plan}: was not as it states (`peakmin verify` tells more), must be for `export`")
    made = FORMATS[form](found.plan, rate)
    if out is None:
        answer(made, end="")
    else:
        files.write(out, made)
        _say_wrote(as_json, out)


@app.command("paper")
@only_answers()
def paper_command(as_json: Json = False, out: Out = Path("out")) -> None:
    """Table 1 and the figures of the paper, computed anew; exit status 1 if a printed digit differs."""
    files.ready(out)
    with output.bar("paper") as progress:
        result = paper.compute(progress)
    output.headless()
    made = paper.figures(result, out) if out else []
    if as_json:
        answer(_json(result.document()))
    else:
        answer(paper.text(result), end="")
        for file in made:
            answer(f"wrote {file}")
    raise typer.Exit(0 if result.agrees else DIFFERS)


@app.command("schema")
@only_answers()
def schema_command(
    of_arm: Annotated[bool, typer.Option("--arm", help="Of a spec file with an arm.")] = False,
    of_study: Annotated[bool, typer.Option("--study", help="Of a study file.")] = False,
    of_plan: Annotated[bool, typer.Option("--plan", help="Of a plan file.")] = False,
    _: Json = False,
) -> None:
    """The JSON Schema of a spec file."""
    kinds = ((of_plan, plan_schema), (of_study, StudySpec.model_json_schema), (of_arm, ArmSpec.model_json_schema))
    made = next((made for wanted, made in kinds if wanted), schema)
    answer(_json(made()))


def _of_a_point(path: Path, verb: str) -> Spec:
    """The spec of a file for a verb that is of a centre of mass only. Raises `SpecError` for an arm's."""
    asked = read_spec(path)
    if not isinstance(asked, Spec):
        raise SpecError(f"{called(path)}: was a spec of an arm, must be one of a centre of mass for `{verb}`")
    return asked


def _solved(asked: AnySpec, name: str, stopped: threading.Event | None = None) -> Plan:
    """The plan of a spec, with a bar of this name while it is made; it ends when it is stopped."""
    with output.bar(name, stopped) as progress:
        return solve(asked.task, asked.settings, progress, stopped=stopped)


def _json(data: object) -> str:
    """One JSON document, with null for numbers that are none."""

    def plain(part: object) -> object:
        if isinstance(part, dict):
            return {name: plain(value) for name, value in part.items()}
        if isinstance(part, list | tuple):
            return [plain(value) for value in part]
        return None if isinstance(part, float) and not math.isfinite(part) else part

    return json.dumps(plain(data), indent=2, allow_nan=False)


def _say_where(as_json: bool, *places: Path | None) -> None:
    """Under an answer, where its files are."""
    if any(places) and not as_json:
        answer("wrote " + ", ".join(words.one_line(str(place)) for place in places if place))


def _say_wrote(as_json: bool, file: Path) -> None:
    """Of a verb whose answer is a file."""
    if as_json:
        answer(_json({"wrote": [str(file)]}))
    else:
        _say_where(as_json, file)


def _end(status: Status, stopped: threading.Event, so_far: str) -> NoReturn:
    """The exit status, after Ctrl-C with a line on how far this came."""
    if stopped.is_set():
        aside(f"peakmin: stopped, {so_far}")
        sys.exit(STOPPED)
    raise typer.Exit(EXIT[status])


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line; every refusal is one line on stderr and exit status 2."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        status = app(args=arguments or ["--help"], prog_name="peakmin", standalone_mode=False) or 0
        if status == STOPPED:  # Ctrl-C where nothing was said of it
            aside("peakmin: stopped")
        sys.exit(status)
    except PeakminError as error:
        aside(f"peakmin: {words.one_line(str(error))}")
    except TyperException as error:
        message = getattr(error, "format_message", error.__str__)()
        aside(f"peakmin: {words.one_line(' '.join(message.split()))}")
    except typer.Abort:
        aside("peakmin: stopped")
        sys.exit(STOPPED)
    sys.exit(BAD_INPUT)
