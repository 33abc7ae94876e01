"""A plan on its way to a controller: instants, rows at a rate, files."""

import csv
import dataclasses
import io
import json

import numpy as np
import pytest

import peakmin as pm
from peakmin import cli
from peakmin.plan import export
from tests.conftest import wall_maneuver
from tests.robots.test_flood import between_bars

LINKS = [pm.Link(length=1.0, mass=1.0), pm.Link(length=0.8, mass=1.0), pm.Link(length=0.5, mass=0.5)]


@pytest.fixture(scope="module")
def arm():
    ends = {"start": pm.Pose(joints=(0.2, 1.3, 0.9)), "goal": pm.Pose(joints=(1.1, 0.5, -0.6))}
    plan = pm.solve(pm.ArmManeuver(arm=pm.Arm(links=LINKS), duration=2.0, **ends))
    assert plan.status == "solved"
    return plan


@pytest.fixture(scope="module")
def point():
    return pm.solve(wall_maneuver())


@pytest.fixture
def file(tmp_path):
    def write(plan):
        path = tmp_path / "plan.json"
        path.write_text(plan.to_json())
        return path

    return write


def call(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        cli.main([str(one) for one in arguments])
    said = capsys.readouterr()
    return end.value.code, said.out, said.err


def table(text):
    head, *rows = csv.reader(io.StringIO(text))
    return head, np.array(rows, dtype=float)


def test_an_arm_s_table_has_all_that_its_joints_do(arm):
    head, rows = table(arm.to_csv())
    of_joints = [f"{name}{k}" for name in ("q", "dq", "ddq", "tau") for k in (1, 2, 3)]
    assert head == ["t", *of_joints, "x", "y", "fx", "fy", "moment"]
    t = arm.times
    parts = [arm.joint_positions(t), arm.joint_velocities(t), arm.joint_accelerations(t), arm.torques(t)]
    parts += [arm.position(t), arm.base_force(t), arm.base_moment(t)[:, None]]
    np.testing.assert_array_equal(rows, np.column_stack([t, *parts]))


def test_joints_are_relative_and_derivatives_of_each_other(arm):
    q, dq, ddq = arm.joint_positions, arm.joint_velocities, arm.joint_accelerations
    assert q(0.0) == pytest.approx((0.2, 1.3, 0.9), abs=1e-9)
    assert q(2.0) == pytest.approx((1.1, 0.5, -0.6), abs=1e-9)
    assert dq([0.0, 2.0]) == pytest.approx(0, abs=1e-6)
    t, h = np.linspace(0.0512345, 1.9467891, 32).reshape(4, 8), 1e-5
    assert q(t).shape == dq(t).shape == ddq(t).shape == (4, 8, 3)
    jumps = arm.trajectory.nodes  # where the control may change
    away = np.min(np.abs(t[..., None] - jumps), axis=-1) > 2 * h
    assert np.sum(away) > 16
    assert ((q(t + h) - q(t - h)) / (2 * h))[away] == pytest.approx(dq(t)[away], abs=1e-6)
    assert ((dq(t + h) - dq(t - h)) / (2 * h))[away] == pytest.approx(ddq(t)[away], abs=1e-5)


@pytest.mark.parametrize("name", ["joint_positions", "joint_velocities", "joint_accelerations"])
def test_instants_outside_are_refused_or_clamped(arm, name):
    ask = getattr(arm, name)
    for outside in (-1e-3, 2.001, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"^t: was .* s, must be from 0 to 2\.0 s") as refused:
            ask([1.0, outside])
        assert "\n" not in str(refused.value)
    np.testing.assert_array_equal(ask([-1.0, 5.0], clamp=True), ask([0.0, 2.0]))
    with pytest.raises(ValueError, match="was nan"):
        ask(np.nan, clamp=True)
    with pytest.raises(ValueError, match="has no trajectory"):
        getattr(dataclasses.replace(arm, joints=None, status="unknown"), name)(0.0)


@pytest.mark.parametrize(
    ("rate", "rows"),
    [(10, 21), (2.5, 6), (0.3, 2), (0.7, 3), (1 / 3 * 1e3, 668), (1000, 2001), (np.nextafter(1, 2), 3)],
)
def test_rows_are_at_a_rate_and_the_last_is_the_end(arm, rate, rows):
    t = table(arm.to_csv(rate=rate))[1][:, 0]
    assert len(t) == rows
    np.testing.assert_array_equal(t[:-1], np.arange(rows - 1) / rate)
    assert t[-1] == 2.0
    assert np.all(np.diff(t) > 1e-9)


def test_rows_without_a_rate_are_the_nodes(arm, point):
    for plan in (arm, point):
        np.testing.assert_array_equal(table(plan.to_csv())[1][:, 0], plan.times)
    assert table(point.to_csv(rate=4.0))[1][:, 1:3] == pytest.approx(point.position(np.linspace(0, 1, 5)))


@pytest.mark.parametrize("rate", [0, -1.0, np.nan, np.inf, True, 1e6])
def test_no_rate_is_no_table(arm, rate):
    with pytest.raises(pm.SpecError, match=r"^rate: was .*, must be"):
        arm.to_csv(rate=rate)


def test_an_arm_s_table_goes_joint_by_joint(arm, file, capsys):
    status, out, err = call(capsys, "export", file(arm), "--rate", 100)
    assert (status, err) == (0, "")
    head, rows = table(out)
    kinds = ("", ".velocity", ".acceleration")
    assert head == ["t", *(f"joint_{k}{kind}" for k in (1, 2, 3) for kind in kinds)]
    t = rows[:, 0]
    asked = arm.joint_positions(t), arm.joint_velocities(t), arm.joint_accelerations(t)
    for kind, values in enumerate(asked):
        assert rows[:, 1 + kind :: 3] == pytest.approx(values, rel=1e-9, abs=1e-9)


def test_a_centre_of_mass_has_a_table_and_no_joints(point, file, tmp_path, capsys):
    status, out, _ = call(capsys, "export", file(point), "--format", "csv")
    head, rows = table(out)
    assert head == ["t", "x", "y", "x.velocity", "y.velocity", "x.acceleration", "y.acceleration"]
    assert status == 0
    assert rows == pytest.approx(table(point.to_csv())[1])
    target = tmp_path / "out.json"
    status, out, err = call(capsys, "export", file(point), "--format", "joint_trajectory", "--out", target)
    assert (status, out, err.count("\n"), target.exists()) == (2, "", 1, False)
    assert "must be one of an arm" in err


def test_ros_gets_its_message(arm, file, tmp_path, capsys):
    target = tmp_path / "new" / "trajectory.json"
    status, out, _ = call(capsys, "export", file(arm), "--rate", 8, "--format", "joint_trajectory", "--out", target)
    assert (status, out) == (0, f"wrote {target}\n")
    message = json.loads(target.read_text())
    assert set(message) == {"joint_names", "points"}
    assert message["joint_names"] == ["joint_1", "joint_2", "joint_3"]
    points = message["points"]
    assert len(points) == 17
    assert points[9]["time_from_start"] == {"sec": 1, "nanosec": 125_000_000}
    assert points[-1]["time_from_start"] == {"sec": 2, "nanosec": 0}
    assert points[9]["positions"] == pytest.approx(arm.joint_positions(1.125), abs=1e-9)
    assert points[9]["velocities"] == pytest.approx(arm.joint_velocities(1.125), abs=1e-9)
    assert points[9]["accelerations"] == pytest.approx(arm.joint_accelerations(1.125), abs=1e-9)


def test_times_that_ros_cannot_tell_apart_are_refused(arm):
    short = pm.solve(arm.maneuver.model_copy(update={"duration": 2e-8}))
    with pytest.raises(pm.PeakminError, match="nanosecond"):
        export.joint_trajectory(short, rate=3e9)
    assert len(json.loads(export.joint_trajectory(short, rate=1e9))["points"]) == 21


def test_what_a_robot_must_not_get_is_refused_in_one_line(arm, file, tmp_path, capsys):
    path = file(arm)
    changed = json.loads(path.read_text())
    changed["peak"] *= 0.9
    path.write_text(json.dumps(changed))
    none = pm.solve(between_bars(0.75, -1.8), pm.Settings(node_limit=1))
    assert none.trajectory is None
    link = LINKS[0].model_copy(update={"max_speed": 0.451})
    fast = pm.solve(
        arm.maneuver.model_copy(update={"arm": pm.Arm(links=[link, *LINKS[1:]])}), pm.Settings(time_limit=2)
    )
    assert fast.trajectory is not None
    assert fast.exceeded
    ways = [("was not as it states", path)]
    for k, (said, plan) in enumerate((("must have a motion", none), ("does not keep what was asked", fast))):
        (tmp_path / f"{k}.json").write_text(plan.to_json())
        ways.append((said, tmp_path / f"{k}.json"))
    for said, path in ways:
        status, out, err = call(capsys, "export", path, "--out", tmp_path / "out.csv")
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert said in err
        assert not (tmp_path / "out.csv").exists()
