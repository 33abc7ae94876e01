import contextlib
import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import peakmin as pm
from peakmin.queries.study import table, workers
from peakmin.queries.study.journal import Journal
from peakmin.queries.study.row import solved_row, spec_hash
from tests.conftest import ALL
from tests.queries.dying import dies
from tests.search.test_sweep import compilations  # noqa: F401  a fixture

ROOT = Path(__file__).parent.parent.parent
STATES = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}}
WALL = {"kind": "wall", "tip": [0.5, 0.5]}
BASE = {
    "maneuver": {**STATES, "duration": 1.0, "obstacles": [WALL]},
    "settings": {"grid": {"steps": 40, "kind": "aligned"}},
}
STRAIGHT = {**BASE, "maneuver": {**STATES, "duration": 1.0}}
POSES = {"start": {"joints": [0, 1]}, "goal": {"joints": [1, 1]}, "duration": 1.0}
ARM = {"arm": {"links": [{"length": 1, "mass": 1}] * 2}, "maneuver": POSES, "settings": BASE["settings"]}
ONE = ThreadPoolExecutor(1)  # solves in this process


def durations(count, base=BASE):
    return pm.StudySpec(base=base, grid={"maneuver.duration": np.linspace(1.0, 2.0, count)})


def journal(store):
    """The whole lines of a store's journal."""
    with contextlib.suppress(FileNotFoundError):
        return [json.loads(line) for line in store.with_name(store.name + ".journal").read_bytes().split(b"\n")[:-1]]
    return []


def peakmin(*arguments, **more):
    code = "from peakmin.cli import main; main()"
    return subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, start_new_session=True, **more)  # fmt: skip


def begun(study_file, store, count, rows=5):
    """A study at the terminal in a process group of its own, when so many rows are finished, or none is yet."""
    process = peakmin("study", study_file, "--out", store, "--workers", count)
    until = time.monotonic() + 60
    path = store.with_name(store.name + ".journal")
    while (len(journal(store)) < rows or not path.exists()) and time.monotonic() < until:
        time.sleep(0.005)
    time.sleep(0 if rows else 0.4)  # its processes are starting
    assert process.poll() is None
    return process


def all_gone(group):
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    os.killpg(group, signal.SIGKILL)
    return False


# what is asked


def test_a_grid_is_every_combination_and_what_is_zipped_goes_together():
    studied = pm.StudySpec(
        base=BASE,
        grid={"maneuver.duration": [1, 2], "maneuver.obstacles[0].tip[1]": [0.5, 0.6]},
        zip={"maneuver.mass": [3, 4], "settings.search.gap": [1e-3, 1e-4]},
    )
    got = [
        (s.maneuver.duration, s.maneuver.obstacles[0].tip, s.maneuver.mass, s.settings.search.gap)
        for s in studied.specs
    ]
    assert got == [
        (t, (0.5, h), *both) for t in (1, 2) for h in (0.5, 0.6) for both in ((3, 1e-3), (4, 1e-4))
    ]  # fmt: skip
    assert studied.varied[1] == {
        "maneuver.duration": 1, "maneuver.obstacles[0].tip[1]": 0.5, "maneuver.mass": 4, "settings.search.gap": 1e-4,
    }  # fmt: skip


def test_values_may_be_arrays_and_models_and_a_field_may_be_absent_from_the_base():
    circles = [pm.Disc(), pm.Polygon(segments=2)]
    studied = pm.StudySpec(base=pm.Spec(**STRAIGHT), grid={"settings.circle": circles})
    assert [s.settings.circle for s in studied.specs] == circles
    bare = {"maneuver": {**STATES, "duration": 1.0, "obstacles": [{"tip": [0.5, 0.5]}]}}
    grid = {
        "maneuver.start.velocity[0]": np.array([1.0]),
        "settings.grid.steps": [7],
        "maneuver.obstacles[0].direction[0]": [2],
    }
    (spec,) = pm.StudySpec(base=bare, grid=grid).specs
    assert (spec.maneuver.start.velocity, spec.settings.grid.steps) == ((1.0, 0.0), 7)
    assert spec.maneuver.obstacles[0].direction == (2, -1)
    lacking = {"maneuver": STATES}
    assert len(pm.StudySpec(base=lacking, grid={"maneuver.duration": [1, 2]}).specs) == 2


def test_a_base_may_be_a_file_seen_from_the_study_file(tmp_path):
    (tmp_path / "specs").mkdir()
    (tmp_path / "specs" / "base.json").write_text(json.dumps(BASE))
    (tmp_path / "study.json").write_text(json.dumps({"base": "specs/base.json", "grid": {"maneuver.mass": [1, 2]}}))
    assert [s.maneuver.mass for s in pm.StudySpec.read(tmp_path / "study.json").specs] == [1, 2]
    (tmp_path / "study.json").write_text(json.dumps({"base": "specs/none.json"}))
    with pytest.raises(pm.SpecError, match=r"none\.json: cannot be read"):
        pm.StudySpec.read(tmp_path / "study.json")


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"base": None}, "base: was None, must be"),
        ({"version": 2}, "version: was 2, must be 1"),
        ({"gird": {}}, "gird: was {}, must be left out"),
        ({"grid": {"maneuver.duration": 1}}, "grid['maneuver.duration']: was 1, must be a list"),
        ({"grid": {"maneuver.duration": []}}, "grid['maneuver.duration']: was [], must be a list of at least 1"),
        ({"grid": {"maneuver..duration": [1]}}, "grid['maneuver..duration']: was 'maneuver..duration', must be a field's path like"),
        ({"grid": {"maneuver.obstacles[1].tip": [1]}}, "maneuver.obstacles[1].tip: was varied, must be a field of the base"),
        ({"grid": {"settings.node_limit.x": [1]}}, "settings.node_limit.x: was varied, must be a field of the base"),
        ({"grid": {"maneuver.weight": [1]}}, "maneuver.weight: was 1, must be left out (no such field) (row 0: maneuver.w"),
        ({"grid": {"maneuver.duration": [1, 0]}}, "maneuver.duration: was 0, must be a number above zero"),
        ({"grid": {"maneuver.duration": [1, float("nan")]}}, "maneuver.duration: was nan"),
        ({"zip": {"maneuver.mass": [1], "maneuver.duration": [1, 2]}}, "zip: was lists of 1 and 2 values, must"),
        ({"zip": {"maneuver.mass": [1]}, "grid": {"maneuver.mass": [1]}}, "zip: was given maneuver.mass, must"),
        ({"grid": {"maneuver.mass": [1] * 1000, "maneuver.duration": [1] * 1000}}, "grid: was 1000000 rows, must"),
    ],
)  # fmt: skip
def test_a_wrong_study_is_one_line_before_anything_is_solved(tmp_path, change, line):
    with pytest.raises(pm.SpecError) as refused:
        pm.StudySpec(**{"base": BASE, **change})
    assert str(refused.value).startswith(line), str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_hash_is_of_the_problem_not_of_how_it_is_written():
    keys = {
        spec_hash(pm.Spec(**data)) for data in (STRAIGHT, {**STRAIGHT, "version": 1}, dict(reversed(STRAIGHT.items())))
    }
    whole = json.loads(json.dumps(STRAIGHT).replace("1.0", "1"))
    assert keys == {spec_hash(pm.Spec(**whole))}
    assert keys != {spec_hash(pm.Spec(**BASE))}


# what comes out


def test_twenty_durations_are_one_compilation_and_the_same_as_solved_alone(compilations):  # noqa: F811
    studied = durations(20)
    found = pm.study(studied, ONE)
    assert len(compilations) == 1
    assert list(found["compilations"]) == [1] + 19 * [0]
    for row, spec in list(zip(found.rows, studied.specs, strict=True))[::6]:
        plan = pm.solve(spec.maneuver, spec.settings)
        assert (row["peak"], row["lower_bound"], row["gap"]) == (plan.peak, plan.lower_bound, plan.gap)
        assert row["obstacle_times"] == plan.obstacle_times.tolist()
    # M goes as 1/T^2
    assert np.allclose(found["peak"] * found["maneuver.duration"] ** 2, found["peak"][0], rtol=1e-6)


@pytest.mark.parametrize(
    ("method", "grid"),
    [("bisection", "aligned"), ("bisection", "uniform"), ("direct", "uniform"), ("exact", "aligned")],
)
def test_a_shared_program_forgets_the_maneuver_before(method, grid):
    settings = {
        "method": {"kind": method},
        "grid": {"kind": grid, "steps": 40},
        "search": {"kind": "sweep", "count": 3},
    }
    moving = {"start": {"position": [1, 2], "velocity": [1, 0]}, "goal": {"position": [4, 2]}, "mass": 3}
    zipped = {"maneuver.obstacles[0].tip": [[0.5, 0.5], [2.5, 4.0], [0.5, 0.5]], "maneuver.duration": [1, 3, 2]}
    zipped |= {
        f"maneuver.{name}": [BASE["maneuver"].get(name, 1), moving[name], BASE["maneuver"].get(name, 1)]
        for name in moving
    }
    studied = pm.StudySpec(base={**BASE, "settings": settings}, zip=zipped)
    found = pm.study(studied, ThreadPoolExecutor(1))
    assert list(found["compilations"][1:]) == [0, 0]
    for row, spec in zip(found.rows, studied.specs, strict=True):
        alone = pm.solve(spec.maneuver, spec.settings)
        assert (row["peak"], row["lower_bound"]) == (alone.peak, alone.lower_bound)


def test_a_shared_program_scales_each_maneuver_anew():
    starts = [{"position": [0, 0], "velocity": [v, 1 - v]} for v in (0.0, 40.0, -3.0)]
    studied = pm.StudySpec(base=STRAIGHT, grid={"maneuver.start": starts})
    for row, spec in zip(pm.study(studied, ThreadPoolExecutor(1)).rows, studied.specs, strict=True):
        assert row["peak"] == pm.solve(spec.maneuver, spec.settings).peak


def test_what_is_compiled_in_is_compiled_anew(compilations):  # noqa: F811
    wall = "maneuver.obstacles[0]"
    ways = [{**WALL, "contact": "touch"}, WALL, {**WALL, "direction": [0.1, -1]}, {**WALL, "opening": 1.0}]
    found = pm.study(pm.StudySpec(base=BASE, grid={wall: ways, "maneuver.duration": [1, 2]}), ThreadPoolExecutor(1))
    assert len(compilations) == 4
    assert {row["status"] for row in found.rows} == {"solved"}


def test_masses_and_arms_mix_and_equal_specs_are_solved_once(tmp_path):
    mass, heavy = pm.Spec(**STRAIGHT), pm.Spec(**{**STRAIGHT, "maneuver": {**STRAIGHT["maneuver"], "mass": 2.0}})
    found = pm.study([mass, pm.ArmSpec(**ARM), heavy, mass], ONE, tmp_path / "mixed.csv")
    assert [row["status"] for row in found.rows] == ["solved"] * 4
    assert found.rows[0] == found.rows[3]
    assert Counter(row["spec"] for row in journal(tmp_path / "mixed.csv")) == {row["spec"]: 1 for row in found.rows}
    assert found.rows[2]["peak_force"] == 2 * found.rows[0]["peak_force"]
    assert found.rows[1]["peak"] == pm.solve(pm.ArmSpec(**ARM).task, pm.ArmSpec(**ARM).settings).peak
    assert "maneuver.mass" in found.varied
    assert "maneuver.duration" not in found.varied


def test_threads_take_turns():
    alone, threads = pm.study(durations(6), ONE), pm.study(durations(6), ThreadPoolExecutor(3))
    assert list(threads["peak"]) == list(alone["peak"])


def test_a_row_that_fails_is_a_row_and_is_tried_again(tmp_path, monkeypatch):
    def fails(text):
        return 1 / 0 if '"duration":2.0' in text else solved_row(text)

    store = tmp_path / "r.csv"
    monkeypatch.setattr(workers, "solved_row", fails)
    first = pm.study(durations(3, STRAIGHT), ONE, store)
    assert [row["status"] for row in first.rows] == ["solved", "solved", "failed"]
    assert first.rows[2]["error"] == "ZeroDivisionError: division by zero"
    assert not first.answered
    assert np.isnan(first["peak"][2])
    monkeypatch.undo()
    again = pm.study(durations(3, STRAIGHT), ONE, store)
    assert again.answered
    assert len(journal(store)) == 4  # three, and the failed one anew
    closed = [pm.Block(vertices=[(0.4, -1e9), (0.6, -1e9), (0.6, y), (0.4, y)], side="right") for y in (0.1, 0.2)]
    shut = pm.StudySpec(
        base=STRAIGHT,
        grid={"maneuver.obstacles": [[closed[0], {**json.loads(closed[1].to_json()), "side": "left"}], []]},
    )
    rows = pm.study(shut, ONE).rows
    assert {row["status"] for row in rows} <= {"failed", "solved", "feasible", "unknown"}
    assert rows[1]["status"] == "solved"


def test_tables(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    studied = pm.StudySpec(
        base=BASE, grid={"maneuver.max_peak": [1.0, 50.0], "settings.circle": [pm.Disc(), pm.Polygon(segments=1)]}
    )
    found = pm.study(studied, ONE, tmp_path / "t.parquet")
    assert [row["status"] for row in found.rows] == ["infeasible"] * 2 + ["solved", "feasible"]
    assert found.answered
    whole = parquet.read_table(tmp_path / "t.parquet").to_pylist()
    lines = list(csv.DictReader(io.StringIO(found.to_csv())))
    assert [tuple(line) for line in (*whole, *lines)] == [found.columns] * 8
    for row, one, line in zip(found.rows, whole, lines, strict=True):
        assert one["obstacle_times"] == row["obstacle_times"] == json.loads(line["obstacle_times"])
        assert one["peak"] == row["peak"] == (float(line["peak"]) if line["peak"] else None)
        assert json.loads(one["settings.circle"]) == row["settings.circle"] == json.loads(line["settings.circle"])
    assert json.loads(found.to_json())["rows"] == json.loads(json.dumps(found.rows))
    assert found._repr_html_().count("<tr>") == 5
    assert "&quot;disc&quot;" in found._repr_html_()
    assert repr(found) == "Study(4 rows: 2 infeasible, 1 solved, 1 feasible)"


def test_rows_that_keep_nothing_say_why(tmp_path):
    """In words, in the table and in the CSV; the others say nothing."""
    region = [[-0.1, -0.1], [1.1, -0.1], [1.1, 0.6], [-0.1, 0.6]]
    asked = [{}, {"max_peak": 8.0}, {"max_peak": 8.54}, {"max_speed": 1.2}, {"region": region}]
    specs = [pm.Spec(**{**BASE, "maneuver": {**BASE["maneuver"], **one}}) for one in asked]
    found = pm.study(specs, ONE, tmp_path / "t.csv")
    assert [row["status"] for row in found.rows] == ["solved", "infeasible", "unknown", "infeasible", "solved"]
    reasons = [row["reason"] for row in found.rows]
    assert reasons[0] is reasons[4] is None
    bound = f"{found.rows[1]['lower_bound']:.6g} m/s²"
    assert reasons[1] == f"max_peak: 8 m/s² is below {bound}, the least that any motion needs"
    peak = f"{found.rows[2]['peak']:.6g} m/s²"
    assert reasons[2] == f"max_peak: the path found has {peak} in place of 8.54; no peak is below {bound}"
    assert reasons[3].startswith("max_speed, duration, obstacles[0]: ")
    with open(tmp_path / "t.csv") as file:
        assert [row["reason"] or None for row in csv.DictReader(file)] == reasons
    assert not found.answered


def test_stores_that_cannot_be_written_are_refused_before_anything_is_solved(tmp_path, monkeypatch):
    def refused(store):
        with pytest.raises(pm.SpecError) as error:
            pm.study(durations(2), ThreadPoolExecutor(1), store)
        return str(error.value)

    assert "must end in .csv or .parquet" in refused(tmp_path / "r.txt")
    (tmp_path / "file").touch()
    assert "cannot be written" in refused(tmp_path / "file" / "r.csv")
    monkeypatch.setattr(table, "find_spec", lambda name: None)
    assert "must be a .csv without pyarrow" in refused(tmp_path / "r.parquet")
    for specs in ([], [BASE]):
        with pytest.raises(pm.SpecError, match=r"^specs"):
            pm.study(specs)
    with pytest.raises(pm.SpecError, match=r"^workers: was 0"):
        pm.study(durations(2), workers=0)


# what is kept


def test_a_killed_study_goes_on_where_it_was(tmp_path):
    file, store = tmp_path / "study.json", tmp_path / "rows.csv"
    file.write_text(durations(12).to_json())
    process = begun(file, store, 2)
    with pytest.raises(pm.SpecError, match="in use by another study"):
        pm.study(durations(2), ONE, store)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert all_gone(process.pid), "its workers outlived it"
    process.communicate()
    kept = journal(store)
    assert 5 <= len(kept) < 12
    assert not store.exists()
    with open(f"{store}.journal", "ab") as torn:
        torn.write(json.dumps(kept[0]).encode()[:-30])
    out, err = (again := peakmin("study", file, "--out", store, "--json", "--workers", 1)).communicate()
    assert (again.returncode, err) == (0, "")
    assert len(json.loads(out)["rows"]) == 12
    lines = Path(f"{store}.journal").read_bytes().split(b"\n")[:-1]
    assert [json.loads(line) for line in lines[: len(kept)]] == kept
    assert not lines[len(kept)].endswith(b"}")  # the torn line, by itself
    after = [json.loads(line) for line in lines[len(kept) + 1 :]]
    assert len(kept) + len(after) == 12  # nothing lost, nothing twice
    assert Counter(row["spec"] for row in kept + after) == Counter(spec_hash(spec) for spec in durations(12).specs)
    assert sum(row["compilations"] for row in after) == 1
    with open(store) as written:
        rows = list(csv.DictReader(written))
    assert [float(row["maneuver.duration"]) for row in rows] == np.linspace(1, 2, 12).tolist()
    assert {row["status"] for row in rows} == {"solved"}


def test_a_journal_outlives_what_a_power_cut_leaves(tmp_path):
    whole = [json.dumps({"spec": name, "status": "solved"}).encode() for name in "abc"]
    for torn in (b"", whole[2][:9], whole[2][:-1], b"\0\0\0", b"[1]", b"\xff"):
        (tmp_path / "r.csv.journal").write_bytes(b"\n".join([*whole[:2], torn]))
        for names in ("ab", "abd"):
            with Journal(tmp_path / "r.csv") as kept:
                assert "".join(kept.rows) == names
                kept.add("d", {"status": "failed"})
                assert kept.done("abcd") == {"a", "b"}
    (tmp_path / "r.csv.journal").write_bytes(b"\n".join(whole))  # but for its line break the last one is whole
    with Journal(tmp_path / "r.csv") as kept:
        assert "".join(kept.rows) == "abc"
        kept.add("d", {"status": "solved"})
    with Journal(tmp_path / "r.csv") as kept:
        assert "".join(kept.rows) == "abcd"


@pytest.mark.parametrize("rows", [0, 5] if ALL else [5])
def test_ctrl_c_keeps_what_is_done_and_says_so(tmp_path, rows):
    file, store = tmp_path / "study.json", tmp_path / "rows.csv"
    file.write_text(durations(400).to_json())
    process = begun(file, store, 1, rows)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    done = len(journal(store))
    assert rows <= done < 200  # it does not go on to the end, however loaded the computer is
    assert err == f"peakmin: stopped, {done} of 400 rows done; the same study run again goes on from there\n"
    assert all_gone(process.pid)
    assert not store.exists()


def test_a_process_that_dies_costs_its_own_row_only(monkeypatch):
    monkeypatch.setattr(workers, "solved_row", dies)
    found = pm.study(durations(4, STRAIGHT), workers=2)
    assert [row["status"] for row in found.rows] == ["solved", "solved", "failed", "solved"]
    assert found.rows[2]["error"] == "the process that solved it died"


def test_an_executor_that_ends_is_said_in_one_line(tmp_path):
    class Ends(ThreadPoolExecutor):
        def submit(self, *arguments):
            future = super().submit(*arguments)
            if self._work_queue.qsize() > 1:
                future.cancel()
            return future

    with pytest.raises(
        pm.PeakminError, match=r"the executor ended: \d of 6 rows done; the same study run again goes on"
    ):
        pm.study(durations(6), Ends(1), tmp_path / "r.csv")
    assert len(pm.study(durations(6), ONE, tmp_path / "r.csv")) == 6


def test_a_script_without_its_guard_is_told(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import peakmin as pm\npm.study(pm.StudySpec(base={STRAIGHT!r}), workers=1)\n")
    result = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert result.stderr.endswith(
        'study: its processes end as they start; a script must call it below `if __name__ == "__main__":`\n'
    )


def test_bad_studies_at_the_terminal_are_one_line_and_exit_status_2(tmp_path):
    (tmp_path / "study.json").write_text(json.dumps({"base": BASE, "grid": {"maneuver.duration": [1, -1]}}))
    out, err = (process := peakmin("study", tmp_path / "study.json", "--out", tmp_path / "o")).communicate()
    assert (process.returncode, out) == (2, "")
    assert (
        err
        == "peakmin: maneuver.duration: was -1, must be a number above zero (from 1e-100 to 1e+100) (row 1: maneuver.duration = -1)\n"
    )
    assert not (tmp_path / "o").exists()


def test_the_example_is_a_study_of_n():
    studied = pm.StudySpec.read(ROOT / "examples" / "study_n.json")
    assert [spec.settings.circle.segments for spec in studied.specs] == list(range(1, 17))


# on a cluster


@pytest.mark.skipif(not ALL, reason="eight seconds: `make proofs` runs it")
def test_dask_solves_the_page_s_study(tmp_path):
    pytest.importorskip("distributed")
    page = (ROOT / "docs" / "studies.md").read_text()
    here, there = re.findall(r"```python\n(.*?)```", page, re.S)
    printed = re.search(r"```text\n(.*?)```", page, re.S)[1]
    (tmp_path / "cluster.py").write_text(CLUSTER)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    cluster = subprocess.Popen([sys.executable, tmp_path / "cluster.py"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               env=environment, start_new_session=True)  # fmt: skip
    try:
        assert '"tcp://scheduler:8786"' in there
        on_cluster = there.replace('"tcp://scheduler:8786"', "input()").replace(
            '"results.parquet"', '"cluster.parquet"'
        )
        here = here.replace('store="results.csv"', "ThreadPoolExecutor(1)")  # processes are tried above
        code = f"from concurrent.futures import ThreadPoolExecutor\nimport peakmin as pm\n{here}\nfirst = study\n{on_cluster}\n{COMPARE}"
        result = subprocess.run([sys.executable, "-c", code], stdin=cluster.stdout, capture_output=True, text=True,
                                cwd=tmp_path, env=environment, timeout=120, check=False)  # fmt: skip
        assert result.returncode == 0, result.stderr
        assert result.stdout == printed
    finally:
        cluster.stdin.close()
        cluster.wait(timeout=30)
        cluster.stdout.close()
    kept = journal(tmp_path / "cluster.parquet")
    assert 1 <= sum(row["compilations"] for row in kept) <= 2


CLUSTER = """
import sys
from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""
COMPARE = """
assert len(client.scheduler_info()["workers"]) == 2
assert list(study["peak"]) == list(first["peak"])
assert study.rows[0]["seconds"] != first.rows[0]["seconds"]
"""


def test_a_script_out_of_a_pipe_is_told_why_its_processes_cannot_start():
    code = """
import peakmin as pm
if __name__ == "__main__":
    ends = pm.State(position=(0, 0)), pm.State(position=(1, 0))
    pm.study([pm.Spec(maneuver=pm.Maneuver(start=ends[0], goal=ends[1], duration=1), settings=pm.Settings())])
"""
    result = subprocess.run([sys.executable], input=code, capture_output=True, text=True, timeout=120, check=False)
    assert result.stderr.rstrip().endswith("the script must be a file, which they can read too")
