"""Limits are kept, with the best plan so far and an honest gap; Ctrl-C is one of them."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import peakmin as pm
from peakmin import deadline
from peakmin.search import solve  # noqa: F401  it and cvxpy are read before any clock runs
from peakmin.spec.spec import read_spec
from tests.conftest import ALL, wall_maneuver
from tests.random_arms import task

ROOT = Path(__file__).parent.parent.parent
OVER_UNDER_OVER = wall_maneuver(
    obstacles=[pm.Wall(tip=(0.25, 0.3)), pm.Wall(tip=(0.5, -0.3), direction=(0, 1)), pm.Wall(tip=(0.75, 0.3))]
)
PLAIN = pm.Bisection(verified=False)


def example(name):
    spec = read_spec(ROOT / "examples" / f"{name}.json")
    return spec.task


def hundred(seed):
    """A hundred small blocks on and beside the way."""
    rng, blocks = np.random.default_rng(seed), []
    while len(blocks) < 100:
        angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 7)))
        around = rng.uniform(0.005, 0.03) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        blocks.append(pm.Block(vertices=(rng.uniform([0.05, -0.6], [0.95, 0.6]) + around).tolist()))
    return wall_maneuver(obstacles=blocks)


HARD = {
    "speed": (OVER_UNDER_OVER.model_copy(update={"max_speed": 2.5}), {}),
    "uniform": (OVER_UNDER_OVER, {"grid": pm.Uniform(steps=400), "circle": pm.Polygon(segments=9)}),
    "sweep": (OVER_UNDER_OVER, {"search": pm.SweepSearch(), "method": PLAIN}),
    "refine": (OVER_UNDER_OVER, {"search": pm.RefineSearch()}),
    "slit": (wall_maneuver(obstacles=[pm.Wall(tip=(0.5, 0.2)), pm.Wall(tip=(0.5 + 1e-6, -0.2), direction=(0, 1))]), {}),
    "slalom": (example("slalom"), {}),
    "cluttered": (example("cluttered"), {}),
    "arm": (task(30), {}),
    "arm with a table": (example("two_link"), {}),
    "hundred blocks": (hundred(5), {}),
    "hundred blocks, another way": (hundred(8), {}),
}


LONGER = {"hundred blocks", "hundred blocks, another way"}  # in 0.2 s they are hardly read
SOME = {"arm"}  # 1 s for the others in `make proofs`


@pytest.mark.parametrize(
    ("name", "limit"),
    [(name, 0.2) for name in HARD if name not in LONGER]
    + [(name, 1.0) for name in HARD if ALL or name in LONGER | SOME],
)
def test_time_limits_are_kept(monkeypatch, name, limit):
    """Within 20 % or half a second, by the time of this process, the least of three: a loaded computer only adds."""
    monkeypatch.setattr(deadline, "time", SimpleNamespace(perf_counter=time.process_time))
    maneuver, settings = HARD[name]
    for _ in range(3):
        began = time.process_time()
        plan = pm.solve(maneuver, pm.Settings(**settings, time_limit=limit))
        took = time.process_time() - began
        if took <= max(1.2 * limit, limit + 0.5):
            break
    else:
        raise AssertionError(f"{took} s")
    assert plan.status in ("solved", "feasible", "unknown")
    assert pm.verify(plan.to_json()).passed
    assert plan.lower_bound >= 0


def test_a_time_limit_is_kept_by_a_search_with_many_boxes(monkeypatch):
    """Each box is bounded anew in the end: that takes some of the time, too."""
    monkeypatch.setattr(deadline, "time", SimpleNamespace(perf_counter=time.process_time))
    walls = [
        pm.Wall(tip=(0.275, -0.523), direction=(-0.076, -1)),
        pm.Wall(tip=(0.473, 1.278), direction=(-0.214, 1)),
        pm.Wall(tip=(0.764, -0.172), direction=(0, 1)),
    ]
    start = pm.State(position=(0, 0), velocity=(-0.457, -2.453))
    goal = pm.State(position=(1, 0), velocity=(0.021, 0.262))
    began = time.process_time()
    plan = pm.solve(wall_maneuver(start=start, goal=goal, obstacles=walls), pm.Settings(time_limit=4.0))
    assert time.process_time() - began <= 1.2 * 4
    assert plan.made.nodes > 100


def test_a_plan_says_whether_a_limit_ended_its_search():
    """Whatever a part of it was told; not where it came to its own end."""
    maneuver = OVER_UNDER_OVER.model_copy(update={"max_speed": 2.5})
    ended = pm.solve(maneuver, pm.Settings(time_limit=0.2))
    assert ended.made.stopped
    assert pm.Plan.from_json(ended.to_json()).made.stopped
    quick = pm.Settings(grid=pm.Aligned(steps=20))
    for limit in (30.0, None):
        assert not pm.solve(wall_maneuver(), quick.model_copy(update={"time_limit": limit})).made.stopped
    now, later = deadline.after(-1.0), deadline.after(100.0)
    early = deadline.part(later)
    assert not deadline.met(now)
    assert deadline.over(now)
    assert deadline.met(now)
    assert not deadline.over(early)
    assert not deadline.met(early)
    assert not deadline.met(np.inf)
    early.met.set()
    assert deadline.met(later)


def test_what_is_left_of_a_long_search_is_used(monkeypatch):
    """The limit is no excuse: a path is found in a few seconds, and found with a limit that is as long."""
    monkeypatch.setattr(deadline, "time", SimpleNamespace(perf_counter=time.process_time))
    plan = pm.solve(example("wide_box"), pm.Settings(time_limit=4.0))
    assert plan.status == "solved"
    assert plan.gap < 0.01


@pytest.mark.parametrize("limit", [1, 5, 30] if ALL else [30])
def test_node_limits_are_kept(limit):
    gap = pm.GlobalSearch(gap=1e-14)
    for maneuver in (OVER_UNDER_OVER, wall_maneuver("touch", goal=pm.State(position=(1, 0), velocity=(2, 3)))):
        plan = pm.solve(maneuver, pm.Settings(node_limit=limit, search=gap, grid=pm.Aligned(steps=40)))
        assert plan.made.nodes <= max(1.2 * limit, limit + 2)
        assert plan.status == "solved"
        assert plan.lower_bound > 0.9 * plan.peak


def test_node_limits_are_kept_past_blocks():
    free, limited = (pm.solve(example("wide_box"), pm.Settings(node_limit=k)) for k in (2000, 5))
    assert limited.made.nodes <= 7 < free.made.nodes
    assert limited.lower_bound <= free.lower_bound * (1 + 1e-9)
    assert pm.verify(limited.to_json()).passed


def test_a_sweep_ends_with_the_times_that_are_done(monkeypatch):
    ticks = iter(range(1000))
    monkeypatch.setattr(deadline, "time", SimpleNamespace(perf_counter=lambda: next(ticks)))
    found = pm.sweep(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=20), time_limit=15))
    assert 1 <= len(found.peak) < found.asked == 18
    assert len(found.obstacle_times) == len(found.lower) == len(found.peak)
    assert json.loads(found.to_json())["asked"] == 18
    whole = pm.sweep(wall_maneuver(), pm.Settings(grid=pm.Aligned(steps=20)))
    assert found.peak == pytest.approx(whole.peak[: len(found.peak)])


# Ctrl-C

HOOKED = """
import sys
from peakmin import cli
from peakmin.programs import least_peak
from peakmin.queries import repairs
from peakmin.search import tree

def told(kind, name, what="one more"):
    before = getattr(kind, name)
    def after(self, *args, **options):
        found = before(self, *args, **options)
        print(what, file=sys.stderr, flush=True)
        return found
    setattr(kind, name, after)

told(least_peak.LeastPeak, "__call__")
told(tree.Tree, "_bounded")
told(repairs.Repair, "__init__", "one more repair")
cli.main()
"""


def begun(tmp_path, command, spec, steps, *options, what="one more"):
    """A command that has done so many steps of its work."""
    path = tmp_path / "spec.json"
    path.write_text(spec.to_json())
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    process = subprocess.Popen([sys.executable, "-c", HOOKED, command, path, *options], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, env=environment)  # fmt: skip
    done = 0
    while done < steps:
        line = process.stderr.readline()
        assert line, "it came to its end before"
        done += line == f"{what}\n"
    return process


def ended(process):
    out, err = process.communicate(timeout=60)
    return out, "".join(line for line in err.splitlines(keepends=True) if not line.startswith("one more"))


LONG = pm.Spec(
    maneuver=wall_maneuver(obstacles=[pm.Wall(tip=(0.4, 0.5)), pm.Wall(tip=(0.6, 0.4))]),
    settings=pm.Settings(grid=pm.Aligned(steps=40), search=pm.SweepSearch(count=400)),
)


def test_ctrl_c_ends_a_sweep_with_what_is_done(tmp_path):
    process = begun(tmp_path, "sweep", LONG, 5, "--out", tmp_path / "o")
    process.send_signal(signal.SIGINT)
    out, err = ended(process)
    assert process.returncode == 130
    with open(tmp_path / "o" / "sweep.csv") as file:
        rows = list(csv.DictReader(file))
    assert 5 <= len(rows) < 1000
    assert err == f"peakmin: stopped, {len(rows)} of 79800 obstacle times are done\n"
    assert f"  {len(rows)} of 79800 obstacle times are done" in out
    written = json.loads((tmp_path / "o" / "sweep.json").read_text())
    assert len(written["peak"]) == len(rows)
    assert min(float(row["peak"]) for row in rows) == written["best"]["peak"]
    assert pm.verify((tmp_path / "o" / "plan.json").read_text()).passed
    assert {file.name for file in (tmp_path / "o").iterdir()} == {
        "plan.json", "plan.csv", "plan.png", "sweep.json", "sweep.csv"
    }  # fmt: skip


def test_ctrl_c_ends_solve_with_the_best_plan_so_far(tmp_path):
    process = begun(tmp_path, "solve", pm.Spec(maneuver=example("slalom")), 3, "--json")
    process.send_signal(signal.SIGINT)
    out, err = ended(process)
    assert process.returncode == 130
    assert err.startswith("peakmin: stopped, ")
    assert err.count("\n") == 1
    assert pm.verify(out).passed


@pytest.mark.parametrize("command", ["explain", "solve"] if ALL else ["solve"])
def test_ctrl_c_ends_an_explanation_with_the_repairs_found(tmp_path, command):
    impossible = pm.Spec.read(ROOT / "examples" / "impossible.json")
    process = begun(tmp_path, command, impossible, 1, what="one more repair")
    process.send_signal(signal.SIGINT)
    out, err = ended(process)
    assert process.returncode == 130
    assert err == "peakmin: stopped, no plan so far, and none can have a peak below 6.13296 m/s²\n"
    assert "\nraise max_peak to 6.14 m/s²\n(it ended before " in out


def test_a_second_ctrl_c_ends_at_once_and_leaves_files_as_they_were(tmp_path):
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "sweep.csv").write_text("of before\n")
    process = begun(tmp_path, "sweep", LONG, 2, "--out", tmp_path / "o")
    process.send_signal(signal.SIGINT)
    while process.poll() is None:
        process.send_signal(signal.SIGINT)
        time.sleep(0.005)
    ended(process)
    assert process.returncode in (130, -signal.SIGINT)
    for file in (tmp_path / "o").iterdir():  # whole, or as they were
        text = file.read_bytes()
        assert file.suffix == ".png" or text.endswith((b"\n", b"}\n"))
    assert not list((tmp_path / "o").glob(".*"))


def test_ctrl_c_in_the_library_is_left_alone():
    """Only the terminal takes it for the end of the time."""
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with deadline.ended_by_interrupt() as pressed:
        until = deadline.after(None, pressed)
        assert not deadline.over(until)
        signal.raise_signal(signal.SIGINT)
        assert pressed.is_set()
        assert deadline.over(until)
        assert not deadline.over(np.inf)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert not deadline.over(np.inf)
