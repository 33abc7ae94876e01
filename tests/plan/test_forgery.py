"""Plan documents that state what is not so, with a digest that fits."""

import dataclasses
import json

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.document import digest
from peakmin.proofs.bounds import lower_bound
from peakmin.proofs.check import check_motion
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from peakmin.proofs.sensitivity import optimal
from peakmin.robots.dynamics import PlanarRobot
from peakmin.robots.joint_motion import JointMotion
from peakmin.spec.spec import read_spec
from tests.conftest import wall_maneuver
from tests.solved import EXAMPLES, example, solved

NOWHERE = {"low": [-1e80], "high": [1e80], "at": [0.5], "multipliers": [[1, 0], [0, 0], [0, 0]]}
POINT = {"low": [0.001], "high": [0.001], "at": [0.001], "multipliers": [[1, 0], [0, 0], [0, 1]]}
HUGE = {"low": [0.0], "high": [1.0], "at": [0.5], "multipliers": [[1e308, 1e308], [-1e308, 0], [1e308, 1e308]]}
LARGE = {"low": [0.0], "high": [1.0], "at": [0.5], "multipliers": [[1e99, 1e99], [-1e99, 0], [1e99, 1e99]]}


def leaves(*several):
    """A proof of walls with these leaves."""
    return {"kind": "walls", "leaves": list(several)}


@pytest.fixture(scope="module", params=["direct", "exact"])
def written(request):
    return pm.solve(wall_maneuver(), pm.Settings(method={"kind": request.param})).to_json()


@pytest.mark.parametrize(
    "lie",
    [
        {"proof": leaves(NOWHERE), "lower_bound": 1000.0},
        {"proof": leaves(POINT, NOWHERE)},
        {"proof": leaves(POINT)},
        {"proof": leaves()},
        {"proof": leaves(HUGE)},
        {"proof": leaves(LARGE)},
        {"proof": []},
        {"proof": {"kind": "blocks", "root": {"lines": [], "leaves": [], "strip": None, "children": []}}},
        {"proof": {"kind": "listed", "branches": []}},
        {"lower_bound": float("inf")},
        {"lower_bound": float("nan")},
        {"lower_bound": "8.5"},
        {"lower_bound": -1.0},
        {"status": "infeasible"},
        {"status": "unknown", "peak": 1e-3, "times": [], "position": [], "velocity": [], "acceleration": []},
        {"position": [[float("nan")] * 2] * 201},
        {"position": [["0", "0"]] * 201},
        {"velocity": []},
        {"peak": None},
        {"times": [0.0, 1.0]},
        {"extra": 1},
        {"version": 1},
        {"version": 4},
        {"spec": {}},
        {"scope": "some"},
        {"multipliers": [[1, 2]]},
    ],
    ids=str,
)
def test_forged_documents_are_refused(written, lie):
    """Found untrue, or no plan at all."""
    data = json.loads(written) | lie
    if lie.get("times") == []:
        data["costate"] = None
    data["digest"] = digest(data)
    try:
        passed = pm.verify(json.dumps(data)).passed
    except pm.SpecError:
        passed = False
    assert not passed


@pytest.mark.parametrize("name", ["general_problem", "tunnel", "two_link"])
def test_what_a_proof_gives_is_told_as_a_plain_number(name):
    data = json.loads(example(name).to_json())
    given = data["lower_bound"]
    data["lower_bound"] += 0.1
    data["digest"] = digest(data)
    (said,) = (one for one in pm.verify(json.dumps(data)).problems if one.startswith("lower_bound: "))
    assert float(said.split("the proof gives ")[1].split()[0]) == pytest.approx(given)


def test_a_negative_size_is_no_costate():
    data = json.loads(pm.solve(wall_maneuver(obstacles=()), pm.Settings(method=pm.Exact())).to_json())
    data["costate"]["size"] = [-1000.0] * len(data["costate"]["size"])
    with pytest.raises(pm.SpecError, match=r"costate.size\[0\]: was -1000.0, must be greater than or equal to 0"):
        pm.verify(json.dumps(data))


def test_errors_count_against_what_is_asked_not_against_a_far_wall():
    """A hold that stops half a metre short must not pass because a wall's tip is a million kilometres away."""
    far = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -1e9)),))
    hold = HoldTrajectory(np.array([0.0, 1.0]), np.array([[1e-3, 0.0]]), np.zeros(2), np.zeros(2))
    assert not check_motion(far, hold, np.array([0.5]), 1e-3).passed


def test_more_walls_than_a_box_can_have_corners_for_are_refused():
    walls = [pm.Wall(tip=(0.1 * i, 1.0)) for i in range(1, 10)]
    with pytest.raises(pm.SpecError, match=r"^maneuver.obstacles: was 9 walls, must be at most 8"):
        pm.solve(wall_maneuver(obstacles=walls))


@pytest.mark.parametrize(("duration", "shift"), [(100.0, 1e-8), (0.01, 1e-4)])
def test_velocities_are_held_to_their_own_unit(duration, shift):
    """A slow maneuver's are small: what would be rounding of a fast one is a lie there."""
    data = json.loads(pm.solve(wall_maneuver(duration=duration)).to_json())
    data["velocity"][7][0] += shift
    data["digest"] = digest(data)
    assert pm.verify(json.dumps(data)).problems == ("velocity: not what the control gives",)


BEHIND = pm.Maneuver(
    start=pm.State(position=(0, 0)),
    goal=pm.State(position=(1, 0)),
    duration=1,
    obstacles=[pm.Block(vertices=[(0.4, -0.2), (0.6, -0.2), (0.6, 0.2), (0.4, 0.2)])],
)


def forged(data):
    """The forged document as peakmin itself would write it: listed numbers, clearance and digest fit."""
    plan = pm.Plan.from_json(json.dumps(data))
    assert plan.kept is not None
    return dataclasses.replace(plan, clearance=plan.kept.clearance).to_json()


def test_walls_that_a_file_lists_give_no_room_for_errors():
    """Past blocks the file says which walls its times belong to: one at 1e60 made everything small beside it."""
    data = json.loads(pm.solve(BEHIND).to_json())
    data |= {
        "walls": [{"kind": "wall", "tip": [0.0, 1e60], "direction": [0.0, 1.0], "contact": "clear"}],
        "obstacle_times": [0.5],
        "multipliers": [[1, 0], [0, 0], [0, -1]],
        "peak": data["lower_bound"],
        "times": [0.0, 1.0],
        "acceleration": [[0.0, 0.0]],
    }
    problems = pm.verify(forged(data)).problems
    assert any(problem.startswith("goal: missed by 1.00e+00") for problem in problems)


def test_the_unit_of_a_costate_is_no_matter():
    """|p| of 1e-151: closed forms and quadrature must speak of the same path, through the block."""
    plan = pm.solve(BEHIND, pm.Settings(method=pm.Exact()))
    motion = plan.trajectory
    for unit in (1e-151, 1e-300, 1e150):
        tiny = dataclasses.replace(motion, first=motion.first * unit, last=motion.last * unit)
        t = np.linspace(0, 1, 50)
        np.testing.assert_allclose(tiny.position(t), motion.position(t), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(tiny.acceleration(t), motion.acceleration(t), rtol=1e-6, atol=1e-6)


def test_positions_that_a_motion_says_are_held_against_its_control(monkeypatch):
    plan = pm.solve(BEHIND, pm.Settings(method=pm.Exact()))
    assert plan.check().passed
    before = type(plan.trajectory).position
    monkeypatch.setattr(
        type(plan.trajectory),
        "position",
        lambda self, t: before(self, t) + 1e-6 * np.sin(np.pi * np.asarray(t))[..., None],
    )
    assert not plan.check().passed


def test_a_leaf_whose_costate_nearly_vanishes_proves_no_more():
    """P of 1e-152: multipliers that nearly cancel at kinks next to the start."""
    maneuver = BEHIND.model_copy(update={"obstacles": (pm.Wall(tip=(0.5, 0.5)),), "max_peak": 9.0})
    plan = pm.solve(maneuver, pm.Settings(method=pm.Exact()))
    data = json.loads(plan.to_json())
    data["proof"] = leaves(
        {
            "low": [0.0],
            "high": [1.0],
            "at": [1.835653448023075e-152],
            "multipliers": [
                [8.213718438626438e-153, -1.8357936492198508e-152],
                [-8.216469094175601e-153, 8.281434682100154e-153],
                [0.44786027766688613, 1.0],
            ],
        }
    )
    found = pm.Plan.from_json(json.dumps(data))
    bound = found.proof.bound(PointMass.of(maneuver), np.array([0.5])) * PointMass.of(maneuver).unit
    assert bound <= plan.peak
    data |= {"status": "infeasible", "lower_bound": 9.717242662824727}
    assert not pm.verify(json.dumps(data)).passed


@pytest.mark.parametrize("circle", [pm.Disc(), pm.Polygon(segments=1)], ids=lambda circle: circle.kind)
@pytest.mark.parametrize("duration", [1.0, 100.0])
@pytest.mark.parametrize(("short", "passes"), [(2e-7, False), (0.5e-7, True)])
def test_multipliers_are_the_best_at_the_plan_s_times(circle, duration, short, passes):
    """The sensitivities are made from them: others, that prove less, are found out."""
    plan = pm.solve(wall_maneuver(duration=duration), pm.Settings(circle=circle))
    assert pm.verify(plan.to_json()).passed
    forged = dataclasses.replace(plan, multipliers=np.array([[3.0, 4.0], [0, 0], [0, 0]]))
    (problem,) = pm.verify(forged.to_json()).problems
    assert problem.startswith("multipliers: prove ")
    none = dataclasses.replace(plan, multipliers=np.zeros((3, 2)))
    assert pm.verify(none.to_json()).problems[0].startswith("multipliers: prove 0.0 ")
    # a little less than optimal is a rounding error, more is not
    best, away = plan.multipliers, np.array([[0.0, 0], [1, 0], [0, 0]])
    mass = PointMass.of(plan.crossing)

    def proved(share):
        return lower_bound(mass, plan.obstacle_times / mass.time, best + share * away) * mass.unit

    least = (1 - short) * proved(0.0)
    low, high = 0.0, float(np.max(np.abs(best)))
    for _ in range(60):
        share = (low + high) / 2
        low, high = (share, high) if proved(share) > least else (low, share)
    near = dataclasses.replace(plan, multipliers=best + low * away)
    assert pm.verify(near.to_json()).passed == passes


@pytest.mark.parametrize("times", [(0.077, 0.386, 0.433), (0.166, 0.586, 0.688), (0.059, 0.61, 0.723)])
def test_multipliers_that_do_not_settle_at_once_are_no_forgeries(times):
    """Newton's method goes on from its own result there; what is written must not fall short of it."""
    walls = [
        pm.Wall(tip=(-1.1, -1.42), direction=(-0.5, 1.2)),
        pm.Wall(tip=(-0.3, 0.78)),
        pm.Wall(tip=(0.0, -1.79), direction=(1.82, 1.62), opening=0.37),
    ]
    ends = {"start": pm.State(position=(-0.45, 1.93)), "goal": pm.State(position=(0, 0), velocity=(0, -0.5))}
    asked, times = wall_maneuver(**ends, duration=1e6, obstacles=walls), np.array(times)
    plan = pm.sweep(asked, pm.Settings(method=pm.Exact()), times=[1e6 * times]).best
    mass = PointMass.of(plan.crossing)
    best = optimal(mass, times, np.zeros((5, 2)), np.inf)
    again = lower_bound(mass, times, optimal(mass, times, best, np.inf))
    assert lower_bound(mass, times, best) >= (1 - 1e-8) * again
    there = dataclasses.replace(plan, obstacle_times=times * mass.time, multipliers=best)
    assert not [one for one in pm.verify(there.to_json()).problems if one.startswith("multipliers")]


@pytest.mark.parametrize(
    ("velocity", "settings"),
    [
        ((3.384, 0.018), pm.Settings(circle=pm.Polygon(segments=1, align="frame"), grid=pm.Uniform(steps=8))),
        ((-3.085, -0.42), pm.Settings(circle=pm.Polygon(segments=1, fit="circumscribed"), grid=pm.Aligned(steps=12))),
    ],
)
def test_plans_of_coarse_circles_have_the_optimum_s_multipliers(velocity, settings):
    """Their programs' own look along one edge: the slopes would be those of another direction."""
    asked = wall_maneuver(goal=pm.State(position=(1, 0), velocity=velocity), obstacles=[])
    plan, exact = pm.solve(asked, settings), pm.solve(asked, pm.Settings(method=pm.Exact()))
    assert pm.verify(plan.to_json()).passed
    np.testing.assert_allclose(plan.sensitivities.goal_velocity, exact.sensitivities.goal_velocity, rtol=1e-6)


def test_how_a_plan_was_made_is_numbers_and_problems_are_printable(written, tmp_path, capsys):
    from peakmin.cli import main

    path = tmp_path / "plan.json"
    data = json.loads(written)
    for made, words in (({"nodes": [1]}, "made.nodes: was [1]"), ({"seconds": "1"}, "made.seconds: was '1'")):
        path.write_text(json.dumps(data | {"made": data["made"] | made}))
        with pytest.raises(SystemExit):
            main(["verify", str(path)])
        assert words in capsys.readouterr().err
    for key, words in (
        ("\ud800", "was '\\ud800', must be a valid string"),
        ("extra", "extra: was 1, must be left out"),
    ):
        path.write_text(json.dumps(data | {key: 1}))
        with pytest.raises(SystemExit) as stopped:
            main(["verify", str(path)])
        assert stopped.value.code == 2
        assert words in capsys.readouterr().err


@pytest.mark.parametrize("asked", [{}, {"max_peak": 5.0}], ids=["solved", "infeasible"])
def test_what_is_known_is_not_stated_as_unknown(asked):
    plan = pm.solve(wall_maneuver(**asked))
    assert plan.status == ("infeasible" if asked else "solved")
    (problem,) = pm.verify(dataclasses.replace(plan, status="unknown").to_json()).problems
    assert problem == f"status: unknown, but it is {plan.status}"


def test_what_is_feasible_is_not_stated_as_solved_nor_the_reverse():
    asked = pm.Settings(grid=pm.Aligned(steps=20), search=pm.GlobalSearch(accept=0.5))
    plan = pm.solve(wall_maneuver(), asked)
    less = asked.model_copy(update={"search": pm.GlobalSearch(accept=plan.gap / 2)})
    for settings, status, false in ((asked, "solved", "feasible"), (less, "feasible", "solved")):
        true = dataclasses.replace(plan, settings=settings, status=status)
        assert pm.verify(true.to_json()).passed
        (problem,) = pm.verify(dataclasses.replace(true, status=false).to_json()).problems
        stated = f"with a gap of {plan.gap:.6g} and accept at {settings.search.accept:g}"
        assert problem == f"status: {false}, but {stated} it is {status}"


@pytest.mark.parametrize(
    ("settings", "most"),
    [({}, 1.0), ({"circle": pm.Polygon(segments=2)}, 1 / np.cos(np.pi / 8)), ({"method": pm.Exact()}, 1.0)],
    ids=["disc", "polygon", "exact"],
)
def test_a_peak_is_not_stated_too_large(settings, most):
    plan = pm.solve(wall_maneuver(), pm.Settings(**settings, search=pm.GlobalSearch(accept=0.2)))
    largest = float(most * plan.trajectory.peak())
    for peak, passes in ((largest, True), (largest * (1 + 1e-6), False), (1e6, False)):
        found = pm.verify(dataclasses.replace(plan, peak=peak).to_json())
        assert found.passed == passes
        assert passes or found.problems[0].startswith(f"peak: was stated as {peak!r}, the control has no more than ")


def test_the_last_peak_that_was_asked_for_may_be_stated():
    """The paper's bisection stops with one that its program could keep, and the control keeps a smaller one."""
    plan = pm.solve(wall_maneuver(), pm.Settings(method=pm.Bisection(verified=False, tolerance=0.05)))
    assert plan.peak > plan.trajectory.peak() * (1 + 1e-6)
    assert pm.verify(plan.to_json()).passed


def test_multipliers_of_walls_that_can_be_left_out_are_refused():
    """They prove as much, and make other slopes."""
    plan = pm.solve(wall_maneuver(obstacles=[pm.Wall(tip=(0.3, -0.2))]), pm.Settings(method=pm.Exact()))
    assert not np.any(plan.multipliers[2])
    # those of a moment later, on one side of the kink
    others = extremal(PointMass.of(plan.crossing), plan.obstacle_times + 1e-6).multipliers
    assert np.any(others[2])
    forged = dataclasses.replace(plan, multipliers=others)
    assert pm.verify(forged.to_json()).problems == ("multipliers: are of walls that can be left out",)


def test_multipliers_of_times_that_coincide_are_not_looked_at():
    """Nothing is known there: any slopes over them are said to be unknown."""
    plan = pm.solve(wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.3)), pm.Wall(tip=(0.7, 0.5))]))
    for times, problems in (([0.5, 0.5 + 1e-10], 0), ([0.5, 0.6], 1)):
        there = dataclasses.replace(plan, obstacle_times=np.array(times), multipliers=np.zeros((4, 2)))
        assert len(there.misstated()) == problems


def _no_wall(spec):
    spec["obstacles"] = []


def _turned(spec):
    spec["obstacles"][0]["direction"] = [0, 1]


def _lower(spec):
    spec["obstacles"][0]["tip"] = [0.5, 0.1]


@pytest.mark.parametrize("other", [_no_wall, _turned, _lower])
@pytest.mark.parametrize("limit", [None, 6.0])
def test_walls_that_a_file_lists_are_those_of_its_question(written, other, limit):
    """Past other walls than the question's a bound is true of another question: 8.5 m/s^2 where 4 are enough."""
    document = json.loads(written)
    other(document["spec"]["maneuver"])
    document["clearance"] = None
    if limit is not None:
        document["spec"]["maneuver"]["max_peak"], document["status"] = limit, "infeasible"
    document["digest"] = digest(document)
    try:
        passed = pm.verify(json.dumps(document)).passed
    except pm.SpecError:  # it lists times of walls that are not there
        passed = False
    assert not passed


def test_a_file_cannot_list_other_walls(written):
    document = json.loads(written)
    document["walls"][0]["tip"] = [0.5, 0.4]
    document["digest"] = digest(document)
    assert any(line.startswith("walls: ") for line in pm.verify(json.dumps(document)).problems)


@pytest.mark.parametrize("turning", [0, 1e-3, 1])
def test_an_arm_whose_joints_still_turn_at_the_goal_has_not_arrived(turning):
    """Its centre of mass rests there: three joints have a speed that moves it not at all."""
    spec = read_spec(EXAMPLES / "three_link.json")
    plan = solved(spec.task.model_copy(update={"obstacles": ()}), spec.settings)
    chain, T, N = plan.maneuver.arm.chain, plan.maneuver.duration, 200
    start, goal = (np.array(pose.joints) for pose in (plan.maneuver.start, plan.maneuver.goal))
    end = turning * np.linalg.svd(PlanarRobot(chain).jacobian(goal))[2][-1]  # rad/s
    dt, s = T / N, (np.arange(N)[:, None] + 0.5) / N
    held = ((goal - start) * (6 - 12 * s) + end * T * (6 * s - 2)) / T**2
    to_end = np.stack([np.full(N, dt), dt * (T - dt * (np.arange(N) + 0.5))])
    held += np.linalg.lstsq(to_end, np.stack([end, goal - start]) - to_end @ held, rcond=None)[0]
    joints = JointMotion(chain, np.linspace(0, T, N + 1), held, start)
    motion = joints.motion
    lie = dataclasses.replace(plan, status="feasible", trajectory=motion, peak=motion.peak(), joints=joints)
    problems = pm.verify(lie.to_json()).problems
    assert ("joints: do not lead from the start's configuration to the goal's" in problems) == bool(turning)
