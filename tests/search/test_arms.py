"""Arms: mapping, proofs of clearance, search with changes of elbow, simulation, files."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from scipy.interpolate import CubicSpline

import peakmin as pm
from peakmin import cli
from peakmin.deadline import after
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.document import digest
from peakmin.queries.compare import compare, table
from peakmin.queries.explain import why_not
from peakmin.queries.simulate import simulate
from peakmin.robots.extremes import extremes
from peakmin.robots.joint_motion import JointMotion
from peakmin.robots.joints import JointPath, torques
from peakmin.robots.kinematics import Pair
from peakmin.robots.link_clearance import link_clearance
from peakmin.robots.workspace import BLOCKED, FREE, Sheets
from peakmin.scenes.kinds import scene_of
from peakmin.scenes.passages import Turned, passages
from peakmin.search.course import Course
from peakmin.spec.arm import postures
from peakmin.view import pictures, words
from peakmin.view.hints import advice
from tests.conftest import ALL
from tests.solved import example as solved_example
from tests.solved import solved

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
ROD = {"length": 1.0, "mass": 1.0}
TABLE = pm.Block(vertices=[(0.1, 0.75), (0.6, 0.75), (0.6, 1.3), (0.1, 1.3)])


def example(name):
    return pm.ArmSpec.read(EXAMPLES / f"{name}.json")


@pytest.fixture(scope="module")
def two_link():
    return solved_example("two_link")


@pytest.fixture(scope="module")
def three_link():
    return solved_example("three_link")


def small(**changes):
    """Two equal rods past a table."""
    task = {
        "arm": pm.Arm(links=[pm.Link(**ROD), pm.Link(**ROD)]),
        "start": pm.Pose(tip=(1.2, -0.6), elbow="up"),
        "goal": pm.Pose(tip=(1.2, 0.9), elbow="up"),
        "duration": 2.0,
    }
    return pm.ArmManeuver(**{**task, **changes})


@pytest.mark.parametrize(
    ("tip", "centre"),
    [((2.22, -2.693), (2.5, -0.2)), ((7.0394, 0.5228), (3.45, 1.2)), ((5.478, -0.306), (2.82, 1.3))],
)
def test_the_papers_tips_map_to_its_centres_of_mass(tip, centre):
    arm = example("two_link").arm
    (theta,) = postures(arm, pm.Pose(tip=tip, elbow="up"))
    chain = arm.chain
    assert chain.tip(theta) == pytest.approx(tip, abs=1e-12)
    assert chain.centre(theta) == pytest.approx(centre, abs=2e-3)
    assert chain.reach == (2.0, 4.0)


def test_payload_and_uneven_links_count_in_the_centre_of_mass():
    arm = pm.Arm(links=[pm.Link(length=2, mass=3, com=0.5), pm.Link(length=1, mass=2)], base=(1, -1), payload=5)
    chain, theta = arm.chain, np.array([0.3, -0.9])
    e = [np.array([np.cos(a), np.sin(a)]) for a in theta]
    places = [0.5 * e[0], 2 * e[0] + 0.5 * e[1], 2 * e[0] + e[1]]
    wanted = np.array([1, -1]) + sum(m * r for m, r in zip((3, 2, 5), places, strict=True)) / 10
    assert chain.centre(theta) == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("seed", range(30))
def test_two_links_reach_what_they_are_asked_and_their_spread_is_a_bound(seed):
    rng = np.random.default_rng(seed)
    pair = Pair(*rng.uniform(0.3, 2, 2))
    rho, phi = rng.uniform(pair.inner, pair.outer), rng.uniform(-np.pi, np.pi)
    s, elbow = rho * np.array([np.cos(phi), np.sin(phi)]), rng.choice([-1.0, 1.0])
    theta = pair.angles(s, elbow)
    reached = pair.a * np.array([np.cos(theta[0]), np.sin(theta[0])])
    reached += pair.b * np.array([np.cos(theta[1]), np.sin(theta[1])])
    assert reached == pytest.approx(s, abs=1e-13)
    radius = 10 ** rng.uniform(-4, -0.3)
    turn = rng.uniform(0, 2 * np.pi, 4000)
    around = s + radius * np.sqrt(rng.uniform(0, 1, (4000, 1))) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    size = np.hypot(*around.T)
    around = around[(size >= pair.inner) & (size <= pair.outer)]
    apart = np.abs((pair.angles(around, elbow) - theta + np.pi) % (2 * np.pi) - np.pi)
    assert np.all(apart <= pair.spread(s, np.array(radius)) + 1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_decided_of_a_ball_holds_in_all_of_it(seed):
    rng = np.random.default_rng(seed)
    workspace = example("two_link").task.workspace
    sheets = Sheets(workspace, (-1.0,))
    middle = rng.uniform([1.5, -1], [4, 2], (300, 2))
    radius = 10 ** rng.uniform(-3, -0.5, 300)
    decided = sheets.decide(middle, radius)
    turn = rng.uniform(0, 2 * np.pi, (300, 40))
    around = middle[:, None] + (radius * np.sqrt(rng.uniform(0, 1, (40, 300)))).T[..., None] * np.stack(
        [np.cos(turn), np.sin(turn)], axis=-1
    )
    slack = sheets.slack(around)
    assert np.all(slack[decided == FREE] >= 0)
    assert np.all(slack[decided == BLOCKED] <= 0)
    assert np.any(decided == FREE)
    assert np.any(decided == BLOCKED)


def test_gaps_leave_out_only_what_is_blocked():
    workspace = example("two_link").task.workspace
    sheets = Sheets(workspace, (-1.0,))
    for x in (2.6, 2.9, 3.2, 3.6):
        gaps = sheets.gaps(np.array([x, 0.0]), np.array([0.0, 1.0]), -4.0, 4.0, 1e-8)
        y = np.linspace(-4, 4, 20_001)
        free = sheets.slack(np.stack([np.full_like(y, x), y], axis=-1)) >= 0
        inside = np.any([(y >= low) & (y <= high) for low, high in gaps], axis=0)
        assert np.all(inside[free])
        assert np.mean(inside) - np.mean(free) < 1e-3
        assert len(gaps) == {2.6: 1, 2.9: 2, 3.2: 2, 3.6: 2}[x]


def test_two_link_example_is_solved_from_its_workspace(two_link):
    plan = two_link
    assert plan.status == "solved"
    assert plan.clearance >= 0
    assert plan.gap <= 1e-4
    assert plan.peak == pytest.approx(0.50042, abs=5e-5)
    (contact,) = plan.contacts
    assert (contact.link, contact.obstacle) == (1, 0)
    assert contact.along == pytest.approx(1, abs=1e-9)
    assert contact.at == pytest.approx((5.478, -0.306), abs=1e-9)
    assert plan.obstacle_times == pytest.approx([3.1227], abs=1e-3)
    assert plan.position(plan.obstacle_times[0]) == pytest.approx((2.82, 1.3), abs=1e-3)
    assert plan.joints.chain.tip(plan.joints.absolute(plan.maneuver.duration)) == pytest.approx((7.0394, 0.5228))


def test_stated_clearance_is_a_bound_and_close(two_link):
    workspace, path = two_link.maneuver.workspace, two_link.joints
    world = shapely.union_all([shapely.Polygon(block.vertices) for block in two_link.maneuver.obstacles])
    points = path.chain.joints(path.absolute(np.linspace(0, 5, 200_001)))
    near = min(float(np.min(shapely.distance(shapely.linestrings(points[:, k : k + 2]), world))) for k in (0, 1))
    found = link_clearance(workspace, path)
    assert found.least <= near <= found.least + 1e-5 * workspace.size
    assert two_link.clearance == found.least


def test_no_free_motion_beats_the_bound(two_link):
    """Motions by way of random places at random times, kept out of everything node by node."""
    rng, found = np.random.default_rng(0), []
    (passage,) = passages(two_link.maneuver, two_link.maneuver.workspace)
    for _ in range(5):
        places = rng.uniform([2.4, 1.2], [3.0, 1.7], (12, 2))
        via = places[np.argmax(passage.sheets.slack(places) > 0)]
        past = passage.maneuver.past([pm.Wall(tip=tuple(via), contact="touch")])
        found.append(Course(passage, past, pm.Disc(), 40).free(rng.uniform(0.4, 0.7, 1)))
    peaks = [one.peak for one in found if one is not None]
    assert len(peaks) >= 3
    assert min(peaks) >= two_link.lower_bound


def test_a_path_to_an_edge_comes_in_over_its_segments():
    """Of random curves to a place on either edge each crosses a segment of the arc that it ends on."""
    (passage,) = passages(small(), small().workspace)
    chain, rng = passage.workspace.chain, np.random.default_rng(0)
    first = np.array(passage.maneuver.start.position) - chain.base
    met = dict.fromkeys(passage.edges, 0)
    for edge, radius in (("outer", passage.workspace.chain.reach[1]), ("inner", passage.workspace.chain.reach[0])):
        for _ in range(60):
            a = rng.uniform(-np.pi, np.pi)
            b = a + rng.uniform(0.05, 1.0)
            branches = [Turned(edge, (a, b), k) for k in range(2 if edge == "inner" else 1)]
            if not passage._must_come_in(branches[0]):
                continue
            end = radius * np.array([np.cos(x := rng.uniform(a, b)), np.sin(x)])
            s = np.linspace(0, 1, 4001)[:, None]
            rho = np.clip(
                np.hypot(*first) + s * (radius - np.hypot(*first)) + rng.normal() * 0.3 * s * (1 - s),
                *passage.workspace.chain.reach,
            )
            turn = np.arctan2(first[1], first[0]) * (1 - s) + np.arctan2(end[1], end[0]) * s
            curve = shapely.LineString(np.hstack([rho * np.cos(turn), rho * np.sin(turn)]))
            segments = []
            for branch in branches:
                wall = passage._opening(branch)
                tip = np.array(wall.tip) - chain.base
                along = -np.array(wall.direction) / np.hypot(*wall.direction)
                segments.append(shapely.LineString([tip, tip + wall.opening * along]))
            assert any(curve.distance(segment) < 1e-3 for segment in segments)
            met[edge] += 1
    assert min(met.values()) >= 20


def test_the_elbow_turns_over_where_only_that_helps():
    blocked = small(goal=pm.Pose(tip=(1.2, 0.9), elbow="either"), obstacles=[TABLE])
    plan = pm.solve(blocked)
    assert plan.status == "solved"
    (at,) = plan.elbow_changes
    assert plan.gap < 0.05
    reach = plan.joints.chain.reach
    r, v = plan.position(at), plan.velocity(at)
    assert np.min(np.abs(np.hypot(*r) - reach)) < 1e-9
    assert abs(r @ v) < 1e-6 * np.hypot(*v)
    assert np.sign(plan.angles(0.0)[1]) == -np.sign(plan.angles(2.0)[1])
    assert pm.verify(plan.to_json()).passed
    with pytest.raises(
        pm.SpecError, match=r"obstacles\[0\]: was -0.\d+ m from link 2 at the goal, must leave the arm 0 m free there"
    ):
        small(goal=pm.Pose(tip=(1.2, 0.9), elbow="up"), obstacles=[TABLE])


def test_a_change_of_elbow_is_not_taken_where_keeping_it_is_cheaper():
    plan = pm.solve(small(goal=pm.Pose(tip=(1.2, 0.9), elbow="either")))
    assert plan.status == "solved"
    assert plan.elbow_changes == ()
    assert plan.gap < 1e-6


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"goal": pm.Pose(tip=(3, 0), elbow="up")}, r"^goal.tip: was \[3.0, 0.0\], must be 0 to 2 m from the base"),
        ({"goal": pm.Pose(joints=(0, 0, 0))}, r"^goal.joints: was 3 angles, must be 2"),
        (
            {"obstacles": [pm.Block(vertices=[(1.1, -0.7), (1.3, -0.7), (1.3, -0.5), (1.1, -0.5)])]},
            r"^obstacles\[0\]: was -0.\d+ m from link 2 at the start",
        ),
        (
            {"obstacles": [pm.Block(vertices=[(3, 3), (4, 3), (4, 4)], side="left")]},
            r"^obstacles\[0\].side: was 'left', must be left out",
        ),
    ],
)
def test_impossible_tasks_are_refused_in_one_line(changes, words):
    with pytest.raises(pm.SpecError, match=words):
        small(**changes)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"elbow": "up"}, "tip: was missing"),
        ({"joints": (0, 1), "tip": (1, 1)}, "tip: was given beside joints"),
        ({"joints": (0, 1), "elbow": "up"}, "elbow: was 'up', must be left out"),
    ],
)
def test_poses_are_joints_or_a_tip(data, words):
    with pytest.raises(pm.SpecError, match=words):
        pm.Pose(**data)


def test_a_peak_below_the_bound_is_proved_infeasible():
    plan = solved(small(max_peak=0.1))
    assert plan.status == "infeasible"
    assert plan.lower_bound > 0.1
    assert pm.verify(plan.to_json()).passed


def test_limits_of_joints_are_reported():
    links = [pm.Link(**ROD, max_speed=0.5), pm.Link(**ROD, limits=(-1.7, 0.0))]  # 0.994 rad in 2 s
    plan = pm.solve(small(arm=pm.Arm(links=links)), pm.Settings(time_limit=2))
    assert plan.status == "unknown"
    assert "arm.links[0].max_speed" in [one.split(":")[0] for one in plan.exceeded]


@pytest.mark.parametrize("name", ["two_link", "three_link"] if ALL else ["two_link"])
def test_the_base_feels_the_planned_force(name, request):
    plan = request.getfixturevalue(name)
    found = simulate(plan)
    assert found.agrees
    assert found.felt_peak == pytest.approx(found.planned_peak, rel=5e-4)
    assert found.error <= 5e-4
    assert found.drift < 1e-3


def test_the_simulation_can_disagree(three_link, monkeypatch):
    """Torques for links of twice the inertia drive the arm elsewhere."""
    path = three_link.joints
    chain = dataclasses.replace(path.chain, inertia=2 * path.chain.inertia)
    wrong = torques(dataclasses.replace(path, chain=chain), np.linspace(0, 2, 20_000))
    monkeypatch.setattr(type(three_link), "torques", lambda self, t: wrong)
    found = simulate(three_link)
    assert not found.agrees
    assert found.error > 0.05


def test_three_links_follow_the_best_path(three_link):
    plan = three_link
    assert plan.status == "solved"
    assert plan.gap < 0.01
    assert plan.clearance > 0
    assert plan.angles(0.0) == pytest.approx((0.2, 1.3, 0.9), abs=1e-9)
    assert plan.angles(2.0) == pytest.approx((1.1, 0.5, -0.6), abs=1e-9)
    t = np.linspace(0, 2, 999)
    assert plan.joints.chain.centre(plan.joints.absolute(t)) == pytest.approx(plan.position(t), abs=1e-12)
    assert pm.verify(plan.to_json()).passed


def test_speeds_are_derivatives(three_link):
    path, h = three_link.joints, 1e-5
    t = np.linspace(0.05, 1.95, 33)
    _, first, second = path.rates(t)
    away = np.min(np.abs(t[:, None] - path.nodes), axis=1) > 2 * h  # where an acceleration ends
    assert np.sum(away) > 20
    change = (path.absolute(t + h) - path.absolute(t - h)) / (2 * h)
    assert change[away] == pytest.approx(first[away], abs=1e-7)
    change = (path.rates(t + h)[1] - path.rates(t - h)[1]) / (2 * h)
    assert change[away] == pytest.approx(second[away], abs=1e-6)


def test_what_it_saves(two_link):
    rows = {row.name: row for row in compare(two_link)}
    assert set(rows) == {"least peak", "joint quintic", "minimum jerk", "smooth C2, tuned"}
    assert all(row.ratio >= 1 for row in rows.values())
    assert rows["least peak"].peak < rows["smooth C2, tuned"].peak < rows["minimum jerk"].peak
    assert rows["joint quintic"].clearance < 0
    said = {name: row.excess for name, row in rows.items()}
    assert said.pop("joint quintic").startswith("obstacles: a link comes 0.14")
    assert set(said.values()) == {None}


def test_what_does_not_keep_all_is_never_called_least():
    """Joint 2 has to move by 2 rad in 2 s: by 1.005 rad/s only one that starts and stops too suddenly does."""
    arm = pm.Arm(links=[pm.Link(**ROD), pm.Link(**ROD, max_speed=1.005)])
    ends = {"start": pm.Pose(joints=(0.2, 0.5)), "goal": pm.Pose(joints=(1.0, 2.5))}
    settings = pm.Settings(grid=pm.Aligned(steps=40), time_limit=2)
    plan = pm.solve(pm.ArmManeuver(arm=arm, duration=2, **ends), settings)
    rows = compare(plan)
    assert [row.name for row in rows] == ["plan", "joint quintic", "minimum jerk", "smooth C2, tuned"]
    assert all(row.excess.startswith("arm.links[1].max_speed: the joint reaches") for row in rows)
    assert rows[1].excess.endswith("reaches 1.875 rad/s about 1 s")  # 15/8 of the mean speed
    assert table(rows).count("arm.links[1].max_speed") == 4


@pytest.mark.skipif(not ALL, reason="it searches until its time limits; a speed in the way is proved in other tests")
def test_a_joint_speed_in_the_way_is_named_with_one_that_would_do():
    """Joint 2 has to move by 2 rad in 2 s: by 1.005 rad/s only one that starts and stops too suddenly does."""
    arm = pm.Arm(links=[pm.Link(**ROD, max_speed=9), pm.Link(**ROD, max_speed=1.005)])
    ends = {"start": pm.Pose(joints=(0.2, 0.5)), "goal": pm.Pose(joints=(1.0, 2.5))}
    settings = pm.Settings(grid=pm.Aligned(steps=40), time_limit=2.5)
    task = pm.ArmManeuver(arm=arm, duration=2, **ends)
    why = pm.explain(task, settings)
    assert why.conflict[0] == "arm.links[1].max_speed"
    assert not why.proved
    wider, longer = (next(one for one in why.repairs if one.field == name) for name in (why.conflict[0], "duration"))
    enough = wider.maneuver.arm.links[1].max_speed
    assert enough > 1  # its mean
    assert f"arm.links[1].max_speed 1.005 rad/s: {enough:g} rad/s would do" in str(why)
    assert "the joint reaches" in str(why)
    assert longer.maneuver.duration > 2
    plan = pm.solve(wider.maneuver, settings)
    assert plan.keeps
    assert pm.explain(wider.maneuver, settings) is None


def changed(plan, change):
    data = json.loads(plan.to_json())
    change(data)
    return json.dumps(data)


def _control(data):
    data["acceleration"][40][0] += 1e-3


def _multiplier(data):
    data["proof"]["passages"][0]["kept"]["children"][0]["leaves"][0]["multipliers"][0][0] *= 1.5


def _child(data):
    children = data["proof"]["passages"][0]["kept"]["children"]
    children[1] = None


def _arc(data):
    del data["proof"]["passages"][0]["touching"][0]


def _pose(data):
    data["spec"]["maneuver"]["goal"]["tip"][0] -= 1e-3


def _table(data):
    data["spec"]["maneuver"]["obstacles"][0]["vertices"][0][1] += 1e-3


def _changes(data):
    data["path"]["changes"] = [2.5]


@pytest.mark.parametrize("change", [_control, _multiplier, _child, _arc, _pose, _table, _changes])
@pytest.mark.parametrize("signed", [False, True])
def test_changed_files_are_refused(two_link, change, signed):
    from peakmin.plan.document import digest

    data = json.loads(changed(two_link, change))
    if signed:
        data["digest"] = digest(data)
    assert not pm.verify(json.dumps(data)).passed


def test_a_file_gives_the_plan_back(two_link):
    again = pm.ArmPlan.from_json(two_link.to_json())
    assert again.to_json() == two_link.to_json()
    assert pm.verify(two_link.to_json()).passed


JOINTS = {f"joint_{what}" for what in ("angles", "speeds", "accelerations", "torques")}


def test_figures_and_animation(two_link):
    drawn = pictures.figures(two_link)
    assert set(drawn) == {"plan", "poses", *JOINTS, "path", "base_force", "peak_over_time"}
    for figure in drawn.values():
        assert all(ax.get_xlabel() and ax.get_ylabel() for ax in figure.axes)
    assert pictures.animate(two_link, frames=3)[:6] == b"GIF89a"


def test_the_terminal_solves_verifies_simulates(two_link, tmp_path, capsys, monkeypatch):
    spec = example("two_link")
    known = {(spec.task, spec.settings): two_link}  # the same question is not solved again
    monkeypatch.setattr(cli, "solve", lambda task, settings, *_, **__: known[task, settings])
    monkeypatch.setattr(pictures.animate, "__defaults__", (2,))

    def run(*arguments):
        with pytest.raises(SystemExit) as stopped:
            cli.main([str(a) for a in arguments])
        return stopped.value.code or 0, capsys.readouterr()

    status, said = run("solve", EXAMPLES / "two_link.json", "--out", tmp_path)
    assert status == 0
    assert "link 2 (its end) at obstacles[0] (5.4780, -0.3060)" in said.out
    assert {"plan.json", "plan.csv", "plan.png", "poses.png", "arm.gif"} <= {file.name for file in tmp_path.iterdir()}
    assert run("verify", tmp_path / "plan.json")[0] == 0
    status, said = run("simulate", tmp_path / "plan.json", "--json")
    assert status == 0
    found = json.loads(said.out)
    assert found["simulated_peak"] == pytest.approx(found["planned_peak"], rel=0.005)
    status, said = run("compare", EXAMPLES / "general_problem.json")
    assert status == 2
    assert said.err.endswith("was a spec of a centre of mass, must be one of an arm for `compare`\n")


def equal_shares():
    """Both links carry the same share of the centre of mass: folded, it is at the base, and joint 1 is free there."""
    return pm.Arm(links=[pm.Link(length=1, mass=1, com=0.5), pm.Link(length=2, mass=1, com=1.5)])


def test_the_bound_knows_of_motions_through_the_base():
    """Straight through the base the elbow turns over in the folded arm: peak 4 D / T^2."""
    d, e = np.pi - 0.6, np.pi + 0.6
    start, goal = pm.Pose(joints=(np.pi / 2 - d / 2, d)), pm.Pose(joints=(np.pi / 2 - e / 2, e))
    plan = pm.solve(pm.ArmManeuver(arm=equal_shares(), start=start, goal=goal, duration=1.0))
    chain = equal_shares().chain
    way = np.hypot(*(chain.centre(np.cumsum(start.joints)) - chain.centre(np.cumsum(goal.joints))))
    assert plan.lower_bound <= 4 * way * (1 + 1e-9)
    assert plan.keeps


@pytest.mark.parametrize("more", [0.0, 4e-4] if ALL else [4e-4])
def test_joints_do_not_jump_over_the_base(more):
    arm = pm.Arm(links=[pm.Link(length=1, mass=1), pm.Link(length=2, mass=1, com=1.5 + more)])
    pair = Pair(*arm.chain.c)
    ends = [pair.angles(np.array([x, 0.0]), 1.0) for x in (1.1, -0.6)]
    poses = [pm.Pose(joints=(a, b - a)) for a, b in ends]
    plan = pm.solve(pm.ArmManeuver(arm=arm, start=poses[0], goal=poses[1], duration=1.0))
    assert plan.keeps
    theta = plan.joints.absolute(np.linspace(0, 1, 100_001))
    assert np.max(np.abs(np.diff(theta, axis=0))) < 0.05
    assert plan.gap < 0.1


def test_start_at_the_goal_is_no_motion():
    plan = pm.solve(small(goal=pm.Pose(tip=(1.2, -0.6), elbow="up")))
    assert (plan.status, plan.peak, plan.lower_bound) == ("solved", 0.0, 0.0)


def test_forged_changes_of_elbow_are_refused():
    plan = pm.solve(small(goal=pm.Pose(tip=(1.2, 0.9), elbow="up")), pm.Settings(node_limit=60))
    data = json.loads(plan.to_json())
    data["path"]["changes"] = [0.5, 1.0]
    data["joints"] = pm.ArmPlan.from_json(json.dumps(data)).document()["joints"]
    found = pm.verify(json.dumps(data | {"digest": digest(data)}))
    assert any("a joint jumps" in one for one in found.problems)


@pytest.mark.parametrize(
    ("field", "index", "said"),
    [("begin", (1,), "do not lead"), ("held", (3, 0), "goal: missed"), ("nodes", (4,), "goal: missed")],
)
def test_forged_motions_of_joints_are_refused(three_link, field, index, said):
    """Also where everything else in the file is made to fit."""
    data = json.loads(three_link.to_json())
    part = data["held"][field]
    for i in index[:-1]:
        part = part[i]
    part[index[-1]] += 1e-3
    forged = pm.ArmPlan.from_json(json.dumps(data)).document()
    found = pm.verify(json.dumps(forged))
    assert any(said in one for one in found.problems)


def test_what_joints_do_at_most_is_part_of_what_is_verified(three_link):
    for name in ("speed", "acceleration", "torque"):
        data = json.loads(three_link.to_json())
        data["extremes"][name][0] *= 0.9
        found = pm.verify(json.dumps(data | {"digest": digest(data)}))
        assert any(one.startswith("extremes") for one in found.problems)


def test_full_turns_of_the_start_count():
    """Those of the goal do not: its angles are what the motion makes them."""
    arm = pm.Arm(links=[pm.Link(**ROD, limits=(-1, 2)), pm.Link(**ROD)])
    near, far = pm.Pose(joints=(0.2, 1.0)), pm.Pose(joints=(1 + 2 * np.pi, 0.7))
    plan = pm.solve(small(arm=arm, start=near, goal=far, obstacles=()))
    assert plan.status == "solved"
    assert plan.angles(plan.maneuver.duration) == pytest.approx([1, 0.7])
    turned = pm.Pose(joints=(0.2 + 2 * np.pi, 1.0))
    with pytest.raises(
        pm.SpecError, match=r"^start.joints\[0\]: was 6.48319 rad, must be within arm.links\[0\].limits"
    ):
        small(arm=arm, start=turned, goal=far)
    free = pm.Arm(links=[pm.Link(**ROD), pm.Link(**ROD)])
    assert pm.solve(small(arm=free, start=turned, goal=far)).angles(0.0) == pytest.approx(turned.joints)


@pytest.mark.parametrize(
    ("limits", "poses", "words"),
    [
        ((-0.5, 0.6), {"goal": pm.Pose(joints=(0.7, 1.0))}, r"^goal.joints\[0\]: was 0.7 rad"),
        ((-0.5, 0.6), {"goal": pm.Pose(tip=(0.1, 1.7))}, r"^goal.tip: was \[0.1, 1.7\], joint 1 2.06\d+ rad"),
        ((2.0, 3.0), {"start": pm.Pose(tip=(1.9, 0.1))}, r"^start.tip: was \[1.9, 0.1\], joint 1 \S+ rad"),
    ],
)
def test_poses_outside_of_the_limits_are_refused(limits, poses, words):
    arm = pm.Arm(links=[pm.Link(**ROD, limits=limits), pm.Link(**ROD)])
    fitting = pm.Pose(joints=(sum(limits) / 2, 1.0))
    with pytest.raises(pm.SpecError, match=words):
        small(arm=arm, **({"start": fitting, "goal": fitting} | poses))


@pytest.mark.parametrize(("short", "kept"), [(1e-12, True), (1e-6, False)])
def test_a_limit_may_be_where_a_motion_ends(short, kept):
    """Up to rounding errors of sums and differences; and one of two elbows within its limits is enough."""
    ends = {"start": pm.Pose(joints=(0.7, 0.1)), "goal": pm.Pose(joints=(0.2, 1.2))}
    free = pm.solve(small(**ends, obstacles=()))
    highest = float(np.max(free.angles(np.linspace(0, 2, 2001))[:, 0]))
    arm = pm.Arm(links=[pm.Link(**ROD, limits=(-1, highest - short)), pm.Link(**ROD)])
    same = dataclasses.replace(free, maneuver=free.maneuver.model_copy(update={"arm": arm}))
    assert (same.exceeded == []) == kept
    elbows = pm.Arm(links=[pm.Link(**ROD), pm.Link(**ROD, limits=(0, 2))])
    small(arm=elbows, start=ends["start"], goal=pm.Pose(tip=(1.2, 0.9)))


def test_an_arm_spec_is_no_spec_of_a_centre_of_mass():
    with pytest.raises(pm.SpecError, match=r"^arm: .*ArmSpec"):
        pm.Spec.read(EXAMPLES / "two_link.json")


def test_derivatives_of_free_angles_are_bounded_between_knots():
    rng = np.random.default_rng(3)
    knots = np.sort(np.concatenate([[0.0, 1.0], rng.uniform(0, 1, 5)]))
    spline = CubicSpline(knots, rng.normal(size=(7, 1)), bc_type="clamped")
    arm = pm.Arm(links=[pm.Link(length=1, mass=1)] * 3)
    path = JointPath(arm.chain, None, (0, 1), 1.0, (), spline, np.zeros(3))
    low = np.linspace(0, 1, 8)[:-1]
    for order in (1, 2):
        bound = path._largest(low, low + 1 / 7, 0, order)
        dense = np.abs(spline(low[:, None] + np.linspace(0, 1 / 7, 5001), order)[..., 0]).max(axis=1)
        assert np.all(bound >= dense * (1 - 1e-12))
        assert bound == pytest.approx(dense, rel=1e-2)


def straight(arm, ends):
    """The joints that follow a centre of mass's straight way, half of the time faster and faster."""
    nodes = np.array([0.0, 1.0, 2.0])
    start, goal = (arm.chain.centre(theta) for theta in ends)
    held = np.outer([1.0, -1.0], goal - start)
    return JointPath(arm.chain, HoldTrajectory(nodes, held, start, np.zeros(2)), (0, 1), 1.0, (), None, ends[0])


def test_a_fast_joint_between_samples_is_seen():
    """Close by its base a folded arm turns within a few millionths of the duration: the next best motion is taken."""
    pair = Pair(0.25, 0.25)
    ends = [pair.angles(np.array([x, 3e-5]), 1.0) for x in (0.31, -0.2113)]
    first, last = (pm.Pose(joints=(float(a), float(b - a))) for a, b in ends)
    arm = pm.Arm(links=[pm.Link(length=0.5, mass=1, com=0), pm.Link(length=1, mass=1)])
    fast = extremes(straight(arm, ends))
    assert fast.speed[0] > 1.5e4
    plan = pm.solve(pm.ArmManeuver(arm=arm, start=first, goal=last, duration=2))
    assert plan.kept.passed
    assert np.max(plan.extremes.speed) < 100
    assert plan.extremes.singular < 0.1


def test_an_elbow_that_turns_over_beside_its_edge_jumps():
    arm = pm.Arm(links=[pm.Link(**ROD), pm.Link(**ROD)])
    reach = arm.chain.reach[1]
    nodes, start = np.array([0.0, 1.0, 2.0]), np.array([0.9 * reach, 0.0])
    out = HoldTrajectory(nodes, np.array([[-0.2 * reach, 0.0]] * 2), start, np.array([0.2 * reach, 0.0]))
    theta = Pair(*arm.chain.c).angles(start, -1.0)
    task = small(obstacles=())
    for at, calm in ((1.0, True), (1.1, False)):
        path = JointPath(arm.chain, out, (0, 1), -1.0, (at,), None, theta)
        assert link_clearance(task.workspace, path).steady == calm


def test_explanations_of_arms_are_tried_out():
    plan = solved(small(max_peak=0.1))
    why = pm.explain(plan)
    assert {"max_peak", "duration"} <= set(why.conflict)
    assert {one.field for one in why.repairs} == {"max_peak", "duration"}
    for one in why.repairs:
        assert pm.solve(one.maneuver).status == "solved"


def test_an_explanation_of_an_arm_that_has_no_time_says_so():
    plan = solved(small(max_peak=0.1))
    why = why_not(plan.maneuver, plan.settings, plan.lower_bound, after(0.0))
    assert not why.complete
    assert not why.repairs
    assert "it ended before" in str(why)


def test_angles_that_look_like_degrees_are_pointed_out():
    plan = pm.solve(small(start=pm.Pose(joints=(90, -45)), goal=pm.Pose(joints=(1, -0.5)), obstacles=()))
    said = words.facts(plan)
    assert "start.joints[0] is 90 rad, 14.3 turns" in said
    assert "start.joints[1] is -45 rad, 7.16 turns" in said
    assert "goal.joints" not in said


def test_limits_that_look_like_degrees_are_pointed_out():
    links = [pm.Link(**ROD, limits=(-150, 150)), pm.Link(**ROD)]
    said = words.facts(pm.solve(small(arm=pm.Arm(links=links))))
    assert "arm.links[0].limits is 150 rad, 23.9 turns" in said


def test_contacts_are_where_the_arm_is_close():
    """An obstacle time at which an obstacle, as a wall, only bends the path is none."""
    links = [pm.Link(length=4, mass=0.5, half_width=0.15), pm.Link(length=4, mass=0.5, half_width=0.1)]
    ends = {"start": pm.Pose(tip=(2.22, -2.693), elbow="up"), "goal": pm.Pose(tip=(6.6, 0.8), elbow="up")}
    table = example("two_link").task.obstacles[:1]
    past = pm.ArmManeuver(arm=pm.Arm(links=links), **ends, duration=5, obstacles=table, margin=0.1)
    block = pm.Block(vertices=[(1.1, 0.0), (1.5, 0.0), (1.5, 0.15), (1.1, 0.15)])
    for task, far in ((past, 0.1), (small(obstacles=[block]), 0.0))[not ALL :]:
        plan = pm.solve(task, pm.Settings(rounds=20))
        workspace = task.workspace
        assert plan.contacts
        for t, contact in zip(plan.contact_times, plan.contacts, strict=True):
            theta = plan.joints.absolute(t)
            assert np.min(workspace.clearance(theta)) <= far + 2e-3 * workspace.size
            link = shapely.LineString(workspace.chain.joints(theta)[contact.link : contact.link + 2])
            width = task.arm.links[contact.link].half_width
            assert link.distance(shapely.Point(contact.at)) <= width + far + 2e-3 * workspace.size
        early = dataclasses.replace(plan, obstacle_times=np.array([0.01, task.duration - 0.01]))
        assert early.contact_times == pytest.approx([plan.clear.at])


def test_what_an_arm_does_not_keep_has_its_own_advice():
    links = [pm.Link(**ROD, max_speed=0.5), pm.Link(**ROD)]
    plan = pm.solve(small(arm=pm.Arm(links=links), obstacles=()), pm.Settings(time_limit=2))
    assert plan.status == "unknown"
    assert plan.free
    assert advice(plan)[-1] == "a larger max_speed, or a longer duration"


def test_the_simulation_refuses_what_it_cannot_follow(tmp_path, two_link):
    path = dataclasses.replace(two_link.clear, within=-0.1)
    with pytest.raises(pm.PeakminError, match="leaves what is in reach"):
        simulate(dataclasses.replace(two_link, clear=path))
    data = json.loads(two_link.to_json())
    data["joints"][30][0] += 0.01
    (tmp_path / "plan.json").write_text(json.dumps(data))
    with pytest.raises(pm.SpecError, match=r"^digest: was that of another text"):
        cli.simulate_command(tmp_path / "plan.json")


@pytest.mark.parametrize("seed", [0, 2, 3, 7])
def test_extremes_hold_at_every_instant_and_are_reached(seed):
    """Of motions that follow the centre of mass, and of such that hold their accelerations."""
    rng = np.random.default_rng(seed)
    links = [pm.Link(length=x, mass=m) for x, m in rng.uniform(0.5, 2, (2, 2))]
    chain = pm.Arm(links=links).chain
    ends = [np.cumsum([rng.uniform(-3, 3), rng.uniform(0.6, 2.4)]) for _ in range(2)]
    start, goal = (chain.centre(theta) for theta in ends)
    held = HoldTrajectory(np.array([0.0, 1.0, 2.0]), np.outer([1.0, -1.0], goal - start) / 1.0, start, np.zeros(2))
    following = JointPath(chain, held, (0, 1), 1.0, (), None, ends[0])
    motion = JointMotion(chain, np.linspace(0, 2, 9), rng.normal(size=(8, 2)) * 3, np.diff(ends[0], prepend=0.0))
    for path in (following, motion):
        found, t = extremes(path), np.linspace(0, 2, 100_001)[:-1]
        _, first, second = path.rates(t)
        angles = path.angles(t)
        seen = [np.max(np.abs(np.diff(x, axis=-1, prepend=0.0)), axis=0) for x in (first, second)]
        seen.append(np.max(np.abs(torques(path, t)), axis=0))
        for name, most in zip(("speed", "acceleration", "torque"), seen, strict=True):
            stated = getattr(found, name)
            assert np.all(stated >= most * (1 - 1e-12))
            assert np.all(np.isinf(stated) | (stated <= most * (1 + 3e-3)))
        assert np.all(found.low <= np.min(angles, axis=0) + 1e-12)
        assert np.all(found.high >= np.max(angles, axis=0) - 1e-12)
        if np.all(np.isfinite(found.speed)):
            assert found.high == pytest.approx(np.max(angles, axis=0), abs=1e-4)
    peak, u = motion.peak[0], np.hypot(*motion.motion.acceleration(t).T)
    assert np.max(u) * (1 - 1e-12) <= peak <= np.max(u) * (1 + 1e-4)


ROUND = {"start": pm.Pose(tip=(0.5, -1.2), elbow="up"), "goal": pm.Pose(tip=(-0.9, -1.0), elbow="up"), "duration": 2}


def test_a_tip_is_reached_with_the_turn_that_limits_leave():
    """The same posture as angles is -1.47 rad of joint 1, or 4.82 rad."""
    first = pm.Link(length=1, mass=1, limits=(0, 6.2), max_speed=2)
    task = pm.ArmManeuver(arm=pm.Arm(links=[first, pm.Link(length=1, mass=1)]), **ROUND)
    (passage,) = scene_of(task).passages.values()
    assert 0 <= passage.theta[0][0] <= 6.2
    assert scene_of(task).impossible() is None
    plan = pm.solve(task)
    assert plan.status == "solved"
    assert 0 <= plan.extremes.low[0] <= plan.extremes.high[0] <= 6.2


def test_postures_outside_of_limits_are_none():
    first = pm.Link(length=1, mass=1, limits=(-0.7, 0.5))
    ends = {"start": pm.Pose(tip=(1.5, 0.2), elbow="either"), "goal": pm.Pose(tip=(1.2, 1.2), elbow="either")}
    task = pm.ArmManeuver(arm=pm.Arm(links=[first, pm.Link(length=1, mass=1)]), duration=2, **ends)
    assert list(scene_of(task).passages) == [(1, 1)]
    with pytest.raises(pm.SpecError, match=r"goal\.tip"):  # no elbow will do
        pm.ArmManeuver(arm=task.arm, duration=2, start=ends["start"], goal=pm.Pose(tip=(-1.2, 1.2), elbow="either"))


def test_a_joint_may_start_at_its_limit():
    links = [pm.Link(length=1, mass=1, limits=(0, 2)), pm.Link(length=1, mass=1), pm.Link(length=1, mass=1)]
    ends = {"start": pm.Pose(joints=(0, 1, 0.5)), "goal": pm.Pose(joints=(1, 0.3, -1))}
    plan = pm.solve(pm.ArmManeuver(arm=pm.Arm(links=links), duration=2, **ends), pm.Settings(time_limit=3))
    assert plan.status == "solved"


def test_what_stands_in_the_only_other_posture_is_named_with_a_speed():
    """With its elbow up at the goal joint 1 has less to turn; a block stands there."""
    links = [pm.Link(length=1, mass=1, max_speed=0.6), pm.Link(length=1, mass=1)]
    block = pm.Block(vertices=[(0.6, 0.5), (0.7, 0.5), (0.7, 0.6), (0.6, 0.6)])
    ends = {"start": pm.Pose(joints=(1.3, -1)), "goal": pm.Pose(tip=(1.5, 0), elbow="either")}
    task = pm.ArmManeuver(arm=pm.Arm(links=links), duration=2, obstacles=[block], **ends)
    why = pm.explain(task, pm.Settings(time_limit=3))
    assert why.proved
    assert set(why.conflict) == {"obstacles[0]", "arm.links[0].max_speed", "duration"}
    assert "leave out obstacles[0]" in [one.text for one in why.repairs]


@pytest.mark.parametrize("links", [2, 3])
def test_to_stay_beside_something_is_the_best_motion(links):
    block = pm.Block(vertices=[(0.5, -0.3), (1, -0.3), (1, -1e-5), (0.5, -1e-5)])
    there = pm.Pose(joints=(0, 1, 0.2)[:links])
    arm = pm.Arm(links=[pm.Link(length=1, mass=1)] * links)
    plan = pm.solve(pm.ArmManeuver(arm=arm, start=there, goal=there, duration=2, obstacles=[block]))
    assert (plan.status, plan.peak, plan.gap) == ("solved", 0.0, 0.0)


def test_a_small_arm_keeps_its_torque():
    links = [pm.Link(length=1e-3, mass=1e-6, max_torque=2.6e-12), pm.Link(length=1e-3, mass=1e-6)]
    ends = {"start": pm.Pose(joints=(0, 1)), "goal": pm.Pose(joints=(1, 0.5))}
    plan = pm.solve(pm.ArmManeuver(arm=pm.Arm(links=links), duration=2, **ends), pm.Settings(time_limit=3))
    assert plan.keeps
    assert plan.extremes.torque[0] <= 2.6e-12 * (1 + 1e-8)
