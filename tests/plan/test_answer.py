"""What was found becomes a plan, of a status that its own checks give."""

import itertools
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.answer import _follows, plan_of, proof_at, status_of
from peakmin.plan.found import Found, Made
from peakmin.proofs.bounds import Leaf, Proof
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from peakmin.scenes.arm_proof import ArmProof
from peakmin.scenes.kept import Excess, Kept
from peakmin.scenes.kinds import scene_of
from tests.conftest import wall_maneuver
from tests.whole.strategies import VERSION_1

SETTINGS = pm.Settings(method=pm.Exact())
STRAIGHT = wall_maneuver(obstacles=(), duration=2.0)  # peak 4 D / T^2 = 1
ONE = HoldTrajectory(np.array([0.0, 1.0, 2.0]), np.array([[1.0, 0.0], [-1.0, 0.0]]), np.zeros(2), np.zeros(2))
WALL = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -0.25)),), duration=2.0)
AT = 1.0  # [s], when ONE crosses it
MADE = Made("none", 0, 0, 0, 0.0)


@cache
def exact(maneuver):
    """The optimum's multipliers at the time of the crossing."""
    mass = PointMass.of(maneuver)
    return extremal(mass, np.full(mass.walls, 0.5)).multipliers


def found(maneuver=STRAIGHT, **changes):
    walls = len(maneuver.walls)
    given = Found(maneuver.past(maneuver.walls), np.full(walls, AT), ONE, 1.0, MADE, multipliers=exact(maneuver))
    return replace(given, **changes)


def planned(maneuver=STRAIGHT, **changes):
    return plan_of(scene_of(maneuver), SETTINGS, found(maneuver, **changes))


def test_statuses():
    either = (False, True)
    for kept, near, refuted, scope, closed in itertools.product(either, either, either, ("all", "these"), either):
        no = closed or (refuted and scope == "all")
        expected = "infeasible" if no else "unknown" if not kept else "solved" if near else "feasible"
        assert status_of(kept, near, refuted, scope, closed) == expected


@pytest.mark.parametrize("search", [pm.GlobalSearch, pm.SweepSearch, pm.RefineSearch])
def test_a_plan_is_solved_up_to_the_gap_that_is_accepted(search):
    gap = planned(peak=1.5).gap
    for accept, status in ((gap, "solved"), (gap * (1 - 1e-12), "feasible")):
        settings = SETTINGS.model_copy(update={"search": search(accept=accept)})
        plan = plan_of(scene_of(STRAIGHT), settings, found(peak=1.5))
        assert (plan.status, plan.gap, plan.keeps) == (status, gap, True)
    assert planned(peak=1 / 0.95001).status == "solved"  # 0.05 where nothing is said
    assert planned(peak=1 / 0.94999).status == "feasible"
    assert not planned(motion=None, peak=math.inf).keeps


def test_without_a_bound_a_plan_is_feasible():
    plan = planned(proof=Proof("all", ()))
    assert (plan.lower_bound, plan.gap, plan.status) == (0.0, 1.0, "feasible")
    assert pm.verify(plan.to_json()).problems == ()


@pytest.mark.parametrize("maneuver", [STRAIGHT, WALL], ids=["no wall", "a wall"])
def test_a_motion_that_passes_its_checks_is_solved(maneuver):
    plan = planned(maneuver)
    assert (plan.status, plan.peak, plan.trajectory, plan.settings) == ("solved", 1.0, ONE, SETTINGS)
    assert (plan.maneuver, plan.crossing.walls) == (maneuver, maneuver.walls)
    assert plan.lower_bound == pytest.approx(1.0, rel=1e-9)
    assert plan.clearance == (math.inf if maneuver is STRAIGHT else pytest.approx(0.25))
    assert pm.verify(plan.to_json()).problems == ()


@pytest.mark.parametrize(
    "changes",
    [
        {"motion": replace(ONE, control=np.array([[1.0, 0.0], [-1.0, 1e-6]]))},
        {"motion": replace(ONE, nodes=np.array([0.0, 1.0, 1.9]))},
        {"motion": None, "peak": math.inf},
        {"times": np.array([0.9])},
        {"peak": 0.999},
    ],
    ids=str,
)
def test_a_motion_that_does_not_lead_there_is_none(changes):
    """Its peak is none either; the bound holds all the same."""
    plan = planned(WALL, proof=Proof("all", ()), **changes)
    assert (plan.status, plan.trajectory, plan.kept) == ("unknown", None, None)
    assert (plan.peak, plan.clearance) == (math.inf, math.inf)


def test_what_a_motion_keeps_is_looked_at_once_where_it_is_known():
    known = Kept(0.5, math.nan, (Excess("region", 1.0, "m", "region: left"),))
    plan = planned(kept=known)
    assert plan.kept is known
    assert (plan.status, plan.clearance) == ("unknown", 0.5)
    missed = planned(kept=known, peak=0.5)
    assert (missed.status, missed.kept, missed.clearance) == ("unknown", None, math.inf)
    plan = planned()
    assert vars(plan)["kept"].passed


@pytest.mark.parametrize(
    ("limit", "peak", "status"),
    [
        (1.0, 1.0, "solved"),
        (1.5, 1.5, "feasible"),
        (1.5, 1.5 + 1e-9, "unknown"),
        (1.0, 1.0 + 1e-9, "unknown"),
        (0.999, 1.0, "infeasible"),
        (0.5, 1.0, "infeasible"),
    ],
)
def test_a_plan_is_within_its_limit_or_the_limit_is_refuted(limit, peak, status):
    asked = STRAIGHT.model_copy(update={"max_peak": limit})
    plan = planned(asked, peak=peak)
    assert plan.status == status
    assert plan.trajectory is ONE


def test_a_bound_at_these_times_refutes_nothing_and_one_of_all_does():
    """Past the wall at its time the peak is above 1: later or earlier it may be less."""
    high = wall_maneuver(obstacles=(pm.Wall(tip=(0.5, 0.25)),), duration=2.0, max_peak=1.05)
    plan = planned(high)
    assert plan.trajectory is None
    assert plan.lower_bound > 1.05
    assert (plan.scope, plan.status) == ("these", "unknown")
    leaf = Leaf((0.0,), (1.0,), exact(high), (0.5,))
    every = planned(high.model_copy(update={"max_peak": 1e-3}), proof=Proof("all", (leaf,)))
    assert every.lower_bound > 1e-3
    assert (every.scope, every.status) == ("all", "infeasible")


def test_what_is_impossible_is_infeasible_whatever_was_found():
    asked = STRAIGHT.model_copy(update={"max_speed": 0.4})
    assert planned(asked, motion=None, peak=math.inf).status == "infeasible"
    assert planned(asked.model_copy(update={"max_speed": 0.6})).status == "unknown"  # too fast, but not impossible


def test_without_a_proof_the_multipliers_are_one_of_the_times_found():
    for maneuver, scope, place in ((STRAIGHT, "all", ()), (WALL, "these", (0.5,))):
        mass = PointMass.of(maneuver)
        proof = proof_at(mass, found(maneuver))
        (leaf,) = proof.leaves
        assert (proof.scope, leaf.low, leaf.high, leaf.at) == (scope, place, place, place)
        assert leaf.multipliers is exact(maneuver)
        assert planned(maneuver).proof == proof


def test_without_multipliers_none_are_known():
    proof = Proof("all", ())
    for maneuver in (STRAIGHT, WALL):
        plan = planned(maneuver, multipliers=None, proof=proof)
        assert plan.proof is proof
        assert plan.lower_bound == 0
        assert plan.multipliers.shape == (2 + len(maneuver.walls), 2)
        assert planned(maneuver, multipliers=None, motion=None).lower_bound == 0


# ---- arms


@cache
def arm():
    return pm.ArmPlan.from_json((VERSION_1 / "two_link.json").read_text())


def of_arm(**changes):
    plan = arm()
    given = Found(
        plan.crossing, plan.obstacle_times, plan.joints, plan.peak, plan.made, plan.proof, indices=plan.indices
    )
    return replace(given, **changes)


def test_an_arm_s_motion_leads_from_start_to_goal():
    plan = plan_of(arm().scene, arm().settings, of_arm())
    assert plan.to_json() == arm().to_json()
    assert type(plan) is pm.ArmPlan
    path = arm().joints
    for changes in (
        {"motion": replace(path, elbow=-path.elbow)},
        {"motion": replace(path, changes=(2.0,))},
        {"peak": 0.9 * arm().peak},
        {"times": arm().obstacle_times - 0.1},
    ):
        assert not _follows(arm().scene, of_arm(**changes))
        missed = plan_of(arm().scene, arm().settings, of_arm(**changes))
        assert (missed.status, missed.joints, missed.trajectory, missed.peak) == ("unknown", None, None, math.inf)
        assert missed.lower_bound == pytest.approx(arm().lower_bound, rel=1e-12)
        assert pm.verify(missed.to_json()).problems == ()
    assert _follows(arm().scene, of_arm())


def test_an_arm_without_a_way_is_infeasible():
    class Closed(ArmProof):
        def bound(self, workspace, every):
            return math.inf

    plan = plan_of(arm().scene, arm().settings, of_arm(motion=None, peak=math.inf, proof=Closed(())))
    assert (plan.status, plan.lower_bound) == ("infeasible", math.inf)
