"""What a plan's check and its verification measure, against motions whose errors are known."""

import dataclasses
import json
import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.document import digest
from peakmin.plan.verify import SAME, bounded, moved, unlike
from peakmin.proofs.bounds import Leaf, Proof
from peakmin.proofs.check import CHECK, Check, check_motion
from peakmin.proofs.double_integrator import PointMass
from tests.conftest import wall_maneuver

T = 2.0
START, GOAL = pm.State(position=(3, -1), velocity=(0.25, 0.5)), pm.State(position=(5, 0), velocity=(-0.75, 1.25))


def parabolas(end, velocity, at=None, time=1.0, first=None):
    """Two holds from START to end [m] with velocity [m/s] at T; the first one's control is given or follows."""
    v0, r0 = np.array(START.velocity), np.array(START.position)
    dv, dr = np.array(velocity) - v0, np.array(end) - r0 - T * v0
    # h u + h w = dv and (3/2 h^2) u + (1/2) h^2 w = dr, h = 1
    u = dr - dv / 2
    return HoldTrajectory(np.array([0.0, 1.0, 2.0]), np.array([u, dv - u]), r0, v0)


EXACT = parabolas(GOAL.position, GOAL.velocity)
WAY = EXACT.position(0.75)  # where it is, within the first hold


def asked(**changes):
    wall = pm.Wall(tip=tuple(WAY), direction=(0, -1), contact="touch")
    return pm.Maneuver(**{"start": START, "goal": GOAL, "duration": T, "obstacles": (wall,), **changes})


def found(maneuver, motion=EXACT, times=(0.75,), peak=None):
    return check_motion(maneuver, motion, np.array(times), motion.peak() if peak is None else peak)


def test_a_motion_as_asked_has_no_errors():
    result = found(asked())
    assert result == Check(0.0, 0.0, 0.0)
    assert result.passed


def sizes(maneuver):
    """Largest distance and speed that are asked for, in the plan's terms: goal and what the ends' speeds cover."""
    way = np.array(maneuver.goal.position) - np.array(maneuver.start.position)
    v = T * np.abs([maneuver.start.velocity, maneuver.goal.velocity])
    return max(np.max(np.abs(way)), np.max(v))


@pytest.mark.parametrize("axis", [0, 1])
def test_errors_at_the_goal_are_measured_in_what_is_asked(axis):
    shift = np.eye(2)[axis] * 1e-3
    missed = found(asked(obstacles=()), parabolas(GOAL.position + shift, GOAL.velocity), ())
    assert missed.goal == pytest.approx(1e-3 / sizes(asked()), rel=1e-9)
    motion = parabolas(GOAL.position, GOAL.velocity - shift)
    fast = found(asked(obstacles=()), motion, ())
    fastest = np.max(np.abs(motion.velocity(np.array([0.0, 1.0, 2.0]))))
    assert fast.goal == pytest.approx(1e-3 / fastest, rel=1e-9)
    assert not missed.passed
    both = found(asked(obstacles=()), parabolas(GOAL.position + shift, GOAL.velocity - 10 * shift), ())
    assert both.goal > missed.goal


@pytest.mark.parametrize("along", [(0, -1), (3, 4)])
def test_errors_at_walls_are_off_the_line_or_short_of_the_tip(along):
    free, across = -np.array(along) / np.hypot(*along), np.array([along[1], -along[0]]) / np.hypot(*along)
    there = max(sizes(asked()), np.hypot(*(WAY - START.position)))
    for contact, opening in (("touch", None), ("clear", None), ("clear", 0.5)):
        for past, off in ((0, 0), (0.1, 0), (0.7, 0), (-0.1, 0), (0, 0.1), (0, -0.2), (0.2, 0.1)):
            wall = pm.Wall(
                tip=tuple(WAY - past * free - off * across), direction=along, contact=contact, opening=opening
            )
            missed = found(asked(obstacles=(wall,)))
            kept = 0 if contact == "touch" else min(max(past, 0), opening or math.inf)
            error = np.max(np.abs(WAY - np.array(wall.tip) - kept * free))
            assert missed.walls == pytest.approx(error / there, rel=1e-9, abs=1e-12)
            assert missed.passed == (error < 1e-9)
            assert missed.goal == 0


def test_the_farthest_wall_counts_in_its_own_distance():
    far = pm.Maneuver(start=START, goal=pm.State(position=(4, -1)), duration=T, obstacles=())
    out = HoldTrajectory(
        np.array([0.0, 1.0, 2.0]), np.array([[50.0, 0.0], [-50, 0]]), EXACT.start_position, EXACT.start_velocity
    )
    at = out.position(1.0)
    result = found(far.past([pm.Wall(tip=tuple(at - [0.1, 0]), contact="touch")]), out, (1.0,))
    assert result.walls == pytest.approx(0.1 / np.hypot(*(at - START.position)), rel=1e-9)


@pytest.mark.parametrize("origin", [0.0, 1e5])
def test_rounding_errors_of_coordinates_are_no_errors(origin):
    """As many of them as the place needs, and no more."""
    shift = np.array([origin, -origin])
    start = pm.State(position=START.position + shift, velocity=START.velocity)
    goal = pm.State(position=GOAL.position + shift, velocity=GOAL.velocity)
    wall = pm.Wall(tip=tuple(WAY + shift), contact="touch")
    maneuver = pm.Maneuver(start=start, goal=goal, duration=T, obstacles=(wall,))
    for error in (1e-16, 1e-14, 1e-12, 1e-10):
        end = np.array(GOAL.position) + error * np.array([1, 0])
        motion = replace(parabolas(end, GOAL.velocity), start_position=np.array(start.position))
        ends = np.abs([START.velocity, GOAL.velocity]) * T
        grain = 1e-14 * (
            np.max(np.abs(np.array(start.position))) + max(np.max(ends), 2.0, np.max(np.abs(WAY - START.position)))
        )
        rounding = 2e-15
        exact = max(error - grain, 0) / sizes(maneuver)
        assert abs(found(maneuver, motion).goal - exact) <= rounding + 2e-16 * origin


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("grow", ["v0", "vf", "pf", "tip"])
def test_coarse_grains_are_those_of_what_is_asked(sign, grow, monkeypatch):
    """A thousandth of place and ways, and of the speeds, in whichever of them is largest, above zero or below."""
    monkeypatch.setattr("peakmin.proofs.check.GRAIN", 1e-3)
    size = {name: sign * (10.0 if name == grow else 1.0) for name in ("v0", "vf", "pf", "tip")}
    r0, pf, tip = sign * np.array([3.0, 1.0]), size["pf"] * np.array([2.0, 1.0]), size["tip"] * np.array([0.7, 0.4])
    v0, vf = size["v0"] * np.array([0.25, 0.5]), size["vf"] * np.array([0.75, 1.25])
    wall = pm.Wall(tip=tuple(r0 + tip), contact="touch", direction=(0, -sign))
    maneuver = pm.Maneuver(
        start=pm.State(position=r0, velocity=v0), goal=pm.State(position=r0 + pf, velocity=vf), duration=T
    ).past([wall])
    off, quick = -sign * np.array([0.5, 0.25]), -sign * np.array([0.25, 0.125])
    dv, dr = vf + quick - v0, pf + off - T * v0
    u = dr - dv / 2
    motion = HoldTrajectory(np.array([0.0, 1.0, 2.0]), np.array([u, dv - u]), r0, v0)
    speeds = max(np.max(abs(v0)), np.max(abs(vf)))
    asked = max(np.max(abs(pf)), T * speeds)
    grain = 1e-3 * (3 + asked)
    fastest = np.max(np.abs(motion.velocity(np.array([0.0, 0.75, 1.0, 2.0]))))
    result = check_motion(maneuver, motion, np.array([0.75]), 1.0)
    assert result.goal == pytest.approx(max((0.5 - grain) / asked, (0.25 - 1e-3 * speeds) / fastest), rel=1e-9)
    at = motion.position(0.75) - r0
    there = max(asked, np.hypot(*at))
    assert result.walls == pytest.approx(
        max(np.max(abs(at - tip)) - grain - 1e-3 * np.max(abs(tip)), 0) / there, rel=1e-9
    )
    alone = replace(motion, control=np.array([dr - (vf - v0) / 2, (vf - v0) - (dr - (vf - v0) / 2)]))
    missed = check_motion(maneuver, alone, np.array([0.75]), 1.0)
    assert missed.goal == pytest.approx((0.5 - grain) / asked, rel=1e-9)
    dr = pf - T * v0
    alone = replace(motion, control=np.array([dr - dv / 2, dv - (dr - dv / 2)]))
    missed = check_motion(maneuver, alone, np.array([0.75]), 1.0)
    fastest = np.max(np.abs(alone.velocity(np.array([0.0, 0.75, 1.0, 2.0]))))
    assert missed.goal == pytest.approx((0.25 - 1e-3 * speeds) / fastest, rel=1e-9)


def test_rounding_errors_of_speeds_are_no_errors():
    quick = pm.Maneuver(
        start=pm.State(position=(0, 0), velocity=(1e3, 0)),
        goal=pm.State(position=(1e3, 0), velocity=(1e3, 0)),
        duration=1.0,
    )
    for error, passes in ((0.5e-11, 0), (3e-11, 2e-14)):
        motion = HoldTrajectory(np.array([0.0, 1.0]), np.array([[error, 0.0]]), np.zeros(2), np.array([1e3, 0.0]))
        assert check_motion(quick, motion, np.array([]), error).goal == pytest.approx(passes, abs=2.5e-15)


def test_a_peak_above_what_is_stated_is_an_error():
    peak = EXACT.peak()
    assert found(asked(), peak=peak * 0.9).peak == pytest.approx(1 / 0.9 - 1)
    assert found(asked(), peak=peak * 1.1).peak < 0
    assert found(asked(), peak=0.0).peak == peak
    still = pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(0, 0)), duration=1.0)
    rest = HoldTrajectory(np.array([0.0, 1.0]), np.zeros((1, 2)), np.zeros(2), np.zeros(2))
    assert check_motion(still, rest, np.array([]), 0.0) == Check(0, 0, 0)

    class Hidden(HoldTrajectory):
        """States a smaller peak than it has."""

        def peak(self):
            return 0.1

    hidden = Hidden(EXACT.nodes, EXACT.control, EXACT.start_position, EXACT.start_velocity)
    assert found(asked(), hidden, peak=0.1).peak == pytest.approx(peak / 0.1 - 1)

    class Careful(HoldTrajectory):
        """States a larger one."""

        def peak(self):
            return 100.0

    careful = Careful(EXACT.nodes, EXACT.control, EXACT.start_position, EXACT.start_velocity)
    assert found(asked(), careful, peak=50.0).peak == 1


@pytest.mark.parametrize(
    ("motion", "times"),
    [
        (EXACT, (0.75, 1.0)),
        (EXACT, ()),
        (EXACT, (0.0,)),
        (EXACT, (2.0,)),
        (EXACT, (2.5,)),
        (EXACT, (math.nan,)),
        (replace(EXACT, nodes=np.array([0.0, 1.0, 1.0])), (0.75,)),
        (replace(EXACT, nodes=np.array([0.0, 1.0, 2.5])), (0.75,)),
        (replace(EXACT, nodes=np.array([-1.0, 1.0, 2.0])), (0.75,)),
        (replace(EXACT, nodes=np.array([0.0, 3.0, 2.0])), (0.75,)),
    ],
)
def test_times_that_do_not_fit_are_no_motion(motion, times):
    result = found(asked(), motion, times)
    assert result == Check(math.inf, math.inf, math.inf)
    assert not result.passed


def test_what_passes():
    assert Check(CHECK, CHECK, 1e-12).passed
    for one in (Check(2 * CHECK, 0, 0), Check(0, 2 * CHECK, 0), Check(0, 0, 1.5e-12), Check(0, 0, math.nan)):
        assert not one.passed


# ---- verification


@lru_cache
def plan(**changes):
    return pm.solve(wall_maneuver(**changes), pm.Settings(grid=pm.Aligned(steps=20)))


def test_a_true_bound_has_no_problems_and_a_false_one_has():
    solved = plan()
    bound = solved.lower_bound
    assert bounded(solved, bound, False) == []
    assert bounded(solved, bound * (1 + SAME / 2), False) == []
    for other in (bound * (1 + 2 * SAME), bound * (1 - 2 * SAME), 0.0, -bound, math.nan):
        assert [one.split(":")[0] for one in bounded(solved, other, False)] == ["lower_bound"]
    boundless = replace(solved, lower_bound=math.inf)
    assert bounded(boundless, math.inf, False) == []


def test_a_status_rests_on_the_limit():
    limit = 9.0
    solved = plan(max_peak=limit)
    bound = solved.lower_bound
    assert bounded(solved, bound, False) == []
    assert bounded(replace(solved, peak=limit), bound, False) == []
    assert [one[:6] for one in bounded(replace(solved, peak=9.001), bound, False)] == ["status"]
    assert bounded(replace(solved, peak=9.001, status="unknown"), bound, False) == []
    refused = replace(solved, status="infeasible")
    assert [one[:6] for one in bounded(refused, bound, False)] == ["status"]
    assert bounded(refused, bound, True) == []
    low = refused.maneuver.model_copy(update={"max_peak": bound})
    assert bounded(replace(refused, maneuver=low), bound, False) != []  # not above it
    lower = refused.maneuver.model_copy(update={"max_peak": 8.0})
    proved = replace(refused, maneuver=lower)
    assert bounded(proved, bound, False) == []
    these = replace(proved, proof=Proof("these", proved.proof.leaves))
    assert [one[:6] for one in bounded(these, bound, False)] == ["status"]
    assert bounded(these, bound, True) == []
    assert bounded(replace(plan(), status="infeasible"), plan().lower_bound, False) != []


def test_errors_of_a_motion_are_named():
    solved = plan()

    def problems(result=None, **changes):
        class Measured(pm.Plan):
            def check(self):
                return result or Check(0, 0, 0)

        values = {field.name: getattr(solved, field.name) for field in dataclasses.fields(solved)}
        stated = Measured(**{**values, **changes})
        return [one.split(":")[0] for one in moved(stated, solved.trajectory)]

    assert problems() == []
    assert problems(Check(CHECK, CHECK, 1e-12)) == []
    assert problems(Check(0, 0, 1.5e-12)) == ["peak"]
    for value in (2 * CHECK, math.nan, math.inf):
        assert problems(Check(value, 0, 0)) == ["goal"]
        assert problems(Check(0, value, 0)) == ["walls"]
        assert problems(Check(0, 0, value)) == ["peak"]
    bound = solved.lower_bound
    assert problems(peak=bound) == problems(peak=bound * (1 - SAME / 2)) == []
    assert problems(peak=bound * (1 - 2 * SAME)) == ["peak"]
    assert problems(peak=math.nan) == ["peak"]
    assert problems(peak=bound / 2, status="unknown") == []


UNITS = {"position": 2.0, "time": 0.5}


@pytest.mark.parametrize(
    ("data", "again", "names"),
    [
        ({"a": 1}, {"a": 1}, []),
        ({"a": 1}, {"a": 2}, ["a"]),
        ({"a": 1}, {}, ["a"]),
        ({}, {"a": 1}, ["a"]),
        ({"digest": 1, "made": 2}, {"digest": 3, "made": 4}, []),
        ({"position": [[1.0, 2.0]]}, {"position": [[1.0, 2.0]]}, []),
        ({"position": [[1.0, 2.0 + 1.9 * SAME]]}, {"position": [[1.0, 2.0]]}, []),
        ({"position": [[1.0, 2.0 - 2.1 * SAME]]}, {"position": [[1.0, 2.0]]}, ["position"]),
        ({"position": [[0.0, 1.9 * SAME]]}, {"position": [[0.0, 0.0]]}, []),
        ({"position": [[0.0, 2.1 * SAME]]}, {"position": [[0.0, 0.0]]}, ["position"]),
        ({"position": [-50.0, 0.0 + 49 * SAME]}, {"position": [-50.0, 0.0]}, []),
        ({"position": [-50.0, 0.0 + 51 * SAME]}, {"position": [-50.0, 0.0]}, ["position"]),
        ({"position": [1.0, 2.0]}, {"position": [[1.0, 2.0]]}, ["position"]),
        ({"position": ["1.0", "2.0"]}, {"position": [1.0, 2.0]}, ["position"]),
        ({"position": [True, True]}, {"position": [1.0, 1.0]}, ["position"]),
        ({"position": [[1.0], [1.0, 2.0]]}, {"position": [1.0, 2.0]}, ["position"]),
        ({"position": [1, 2]}, {"position": [1.0, 2.0]}, []),
        ({"position": []}, {"position": []}, []),
        ({"position": None}, {"position": None}, []),
        ({"position": None}, {"position": [1.0]}, ["position"]),
        ({"position": [1.0]}, {"position": None}, ["position"]),
        ({"time": 1.0 + 0.9 * SAME}, {"time": 1.0}, []),
        ({"time": math.nan}, {"time": 1.0}, ["time"]),
        ({"joint": {"torque": [1.0, -3.0 + 2.9 * SAME]}}, {"joint": {"torque": [1.0, -3.0]}}, []),
        ({"joint": {"torque": [1.0, -3.0 + 3.1 * SAME]}}, {"joint": {"torque": [1.0, -3.0]}}, ["joint"]),
        ({"joint": {"torque": 1.0}}, {"joint": {"torque": 1.0, "speed": 1.0}}, ["joint"]),
        ({"joint": {"torque": 1.0, "fast": 9.0}}, {"joint": {"torque": 1.0 + 2 * SAME, "fast": 9.0}}, ["joint"]),
        ({"joint": [{"a": 1.0}]}, {"joint": [{"a": 1.0 + 2 * SAME}]}, ["joint"]),
        ({"joint": [{"a": 1.0}]}, {"joint": [{"a": 1.0 + SAME / 2}]}, []),
        ({"joint": None}, {"joint": 0.0}, ["joint"]),
        ({"joint": 1}, {"joint": True}, ["joint"]),
        ({"said": "end at (0.0000, 1.5001)"}, {"said": "end at (-0.0000, 1.5002)"}, []),
        ({"said": "end at (0.0000, 1.5000)"}, {"said": "end at (0.0000, 1.5002)"}, ["said"]),
        ({"said": "1.23e-05 N m"}, {"said": "1.24e-05 N m"}, []),
        ({"said": "1.23e-05 N m"}, {"said": "1.25e-05 N m"}, ["said"]),
        ({"said": "1e-05 N m"}, {"said": "0.00014 N m"}, ["said"]),
        ({"said": "1.23-999 s"}, {"said": "1.23 s"}, ["said"]),
        ({"said": "link 2"}, {"said": "link 3"}, ["said"]),
        ({"said": "up 1"}, {"said": "down 1"}, ["said"]),
        ({"small": [1e-12]}, {"small": [2e-12]}, ["small"]),
        ({"joint": {"a": 1.0}}, {"joint": ["a"]}, ["joint"]),
        ({"joint": ["a"]}, {"joint": {"a": 1.0}}, ["joint"]),
        ({"joint": [{"a": 1.0}]}, {"joint": [["a"]]}, ["joint"]),
        ({"joint": [["a"]]}, {"joint": [{"a": 1.0}]}, ["joint"]),
    ],
)
def test_fields_that_differ_are_named(data, again, names):
    assert [one.split(":")[0] for one in unlike(data, again, UNITS)] == names


def test_words_tell_what_is_missing():
    assert unlike({"a": 1}, {"b": 1}, {}) == ["a: must be left out", "b: must be given"]
    assert unlike({"a": 1}, {"a": 2}, UNITS) == ["a: was 1, must be 2"]
    assert unlike({"time": 1.0}, {"time": 2.0}, UNITS) == ["time: not what the control gives"]
    assert unlike({"time": None}, {"time": 2.0}, UNITS) == ["time: was None, must be 2.0"]
    assert unlike({"time": 1.0}, {"time": None}, UNITS) == ["time: was 1.0, must be None"]


def changed(solved, **changes):
    data = json.loads(solved.to_json()) | changes
    data["digest"] = digest(data)
    return pm.verify(json.dumps(data))


def test_a_plan_file_is_verified_with_its_numbers():
    solved = plan()
    found = pm.verify(solved.to_json())
    assert found.passed
    assert found.problems == ()
    assert found.peak == solved.trajectory.peak()
    assert found.lower_bound == pytest.approx(solved.lower_bound, rel=1e-12)
    data = json.loads(solved.to_json())
    data["digest"] = data["digest"][::-1]
    assert [one.split(":")[0] for one in pm.verify(json.dumps(data)).problems] == ["digest"]
    for nudge, passes in ((0.5, True), (4.0, False)):  # of the largest speed, and of distance over duration
        slow = plan(duration=2.0)
        speeds = json.loads(slow.to_json())["velocity"]
        most = max(max(map(abs, row)) for row in speeds)
        nudged = [[x + nudge * SAME * max(most, 0.5) for x in row] for row in speeds]
        assert changed(slow, velocity=nudged).passed == passes
    far = [[x + 1e-5 for x in row] for row in data["position"]]
    assert not changed(solved, position=far).passed


def test_no_motion_no_peak_and_no_solution():
    refused = plan(max_peak=8.0)
    assert pm.verify(refused.to_json()).passed
    none = {"times": [], "position": [], "velocity": [], "acceleration": [], "peak": None}
    for status, peak, fine in (("unknown", None, True), ("unknown", 9.0, False), ("solved", None, False)):
        problems = changed(plan(), **{**none, "status": status, "peak": peak}).problems
        assert any("no motion" in one for one in problems) == (not fine)


def test_a_proof_of_these_times_has_no_boxes():
    solved = plan(duration=2.0)
    leaf = solved.proof.leaves[0]
    place = tuple((solved.obstacle_times / 2.0).tolist())
    point, box = Leaf(place, place, leaf.multipliers, place), Leaf(leaf.low, leaf.high, leaf.multipliers, place)
    for leaves, boxed in (((box,), True), ((point,), False), ((point, box), True)):
        these = replace(solved, proof=Proof("these", leaves))
        bound = these.proof.bound(PointMass.of(these.crossing), np.array(place)) * PointMass.of(these.crossing).unit
        problems = pm.verify(replace(these, lower_bound=bound).to_json()).problems
        assert [one.split(":")[0] for one in problems] == ["scope"] * boxed


def test_clearances_are_found_anew():
    block = pm.Block(vertices=[(0.4, -0.2), (0.6, -0.2), (0.6, 0.2), (0.4, 0.2)])
    past = plan(obstacles=(block,))
    assert pm.verify(past.to_json()).passed
    assert pm.verify(replace(past, clearance=past.clearance + 1e-11).to_json()).passed
    far = replace(past, clearance=past.clearance + 2 * SAME)
    assert not pm.verify(far.to_json()).passed
    large = plan(
        goal=pm.State(position=(1e3, 0)),
        obstacles=(pm.Block(vertices=[(400, -200), (600, -200), (600, 200), (400, 200)]),),
    )
    assert pm.verify(replace(large, clearance=large.clearance + 500 * SAME).to_json()).passed
    for wrong in (past.clearance + 1e-5, past.clearance - 1e-5, math.inf):
        problems = pm.verify(replace(past, clearance=wrong).to_json()).problems
        assert any(one.startswith("clearance") for one in problems)
    straight = plan(obstacles=())
    assert pm.verify(replace(straight, clearance=1.0).to_json()).problems
    through = replace(
        past,
        trajectory=straight.trajectory,
        crossing=past.maneuver.past(()),
        obstacle_times=np.zeros(0),
        multipliers=np.zeros((2, 2)),
    )
    assert any("not all is kept" in one for one in pm.verify(through.to_json()).problems)
    unknown = replace(through, status="unknown")
    assert not any("not all is kept" in one for one in pm.verify(unknown.to_json()).problems)


class Said(HoldTrajectory):
    """A motion that gives other positions than those of its control."""

    def position(self, t):
        return super().position(t) + self.off * np.sin(np.pi * np.asarray(t) / 4)[..., None] * np.array([0.0, 1.0])


@pytest.mark.parametrize("off", [1e-3, -1e-3])
@pytest.mark.parametrize("side", [3.0, -3.0])
def test_positions_that_a_motion_says_are_held_against_the_quadrature(off, side):
    """Against the size of the way, here a swing three times as far as the goal."""
    maneuver = pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=4.0)
    control = np.array([[0.25, side], [0.25, -side], [-0.25, -side], [-0.25, side]])
    motion = Said(np.arange(5.0), control, np.zeros(2), np.zeros(2))
    object.__setattr__(motion, "off", off)
    found = check_motion(maneuver, motion, np.array([]), 10.0)
    assert found.goal == pytest.approx(1e-3 / 3, rel=1e-6)
    object.__setattr__(motion, "off", 0.0)
    assert check_motion(maneuver, motion, np.array([]), 10.0).goal < 1e-14
    near = Said(np.arange(5.0), control * [1, 1e-3], np.zeros(2), np.zeros(2))
    object.__setattr__(near, "off", off)
    assert check_motion(maneuver, near, np.array([]), 10.0).goal == pytest.approx(1e-3, rel=1e-6)
