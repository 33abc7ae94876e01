"""The tree of a proof cannot be cut down: whatever is left out or put elsewhere is refused, found, or proves no more."""

import json
from copy import deepcopy
from functools import cache

import pytest

import peakmin as pm
from peakmin.plan.document import digest
from tests.conftest import ALL
from tests.plan.test_document import asked, branches
from tests.whole.strategies import VERSION_1

NAMES = ["blocks", "two_link"]
EVERY = [(name, k) for name in NAMES for k in range({"blocks": 5, "two_link": 7}[name])]  # every branch of each
# of the arm's one
SOME = [(name, k) for name, k in EVERY if ALL or name == "blocks" or k == 3]


@cache
def document(name):
    """A plan past blocks, found in continuous time, and an arm's as a file has it."""
    if name == "blocks":
        return pm.solve(asked(name)[0], pm.Settings(method=pm.Exact())).document()
    return pm.ArmPlan.from_json((VERSION_1 / f"{name}.json").read_text()).document()


def places(name):
    """The ways to all branches of a proof, and to what holds them."""
    return [where for where, _ in branches(document(name)["proof"])]


def at(data, where):
    inside = data["proof"]
    for step in where:
        inside = inside[step]
    return inside


def put(data, where, value):
    at(data, where[:-1])[where[-1]] = value


def bound(data):
    """What the proof of a document proves [m/s^2], or None where it is none of its task."""
    kind = pm.ArmPlan if data["kind"] == "arm" else pm.Plan
    try:
        plan = kind.from_json(json.dumps(data))
    except pm.SpecError:
        return None
    return plan.scene.bound(plan.proof, plan.obstacle_times)


def restated(data, lower):
    """With the bound that the proof does prove, and what follows from it."""
    gap = (data["peak"] - lower) / data["peak"] if data["peak"] else 0.0
    data = {**data, "lower_bound": lower, "gap": gap, "status": "solved" if gap <= 0.05 else "feasible"}
    return json.dumps(data | {"digest": digest(data)})


def proves_less(data, before):
    """Refused, or of a bound that is smaller, and found out where it is stated as before."""
    lower = bound(data)
    if lower is None:
        return
    assert lower < before["lower_bound"] * (1 - 1e-9)
    problems = pm.verify(json.dumps(data | {"digest": digest(data)})).problems
    assert any(one.startswith("lower_bound: was stated as ") for one in problems)


def proves_no_more(data, before):
    """Refused, or as true as before: what is proved of every motion is no more than the one found has."""
    lower = bound(data)
    if lower is not None:
        assert lower <= before["peak"]


def test_every_branch_is_changed():
    assert [(name, k) for name in NAMES for k in range(len(places(name)))] == EVERY
    for name in NAMES:
        lower = bound(document(name))
        assert lower == pytest.approx(document(name)["lower_bound"], rel=1e-12)
        assert pm.verify(restated(document(name), lower)).passed


@pytest.mark.parametrize(("name", "k"), EVERY)
def test_a_child_is_not_left_out(name, k):
    """Only a part without paths has none."""
    where = places(name)[k]
    for i in range(len(at(document(name), where)["children"])):
        data = deepcopy(document(name))
        at(data, where)["children"][i] = None
        proves_less(data, document(name))


@pytest.mark.parametrize(("name", "k"), SOME)
@pytest.mark.parametrize("many", ["none", "one too few", "one too many", "without a cut"])
def test_children_are_as_many_as_parts(name, k, many):
    data = deepcopy(document(name))
    branch = at(data, places(name)[k])
    cut = "strip" if name == "blocks" else "line"
    if branch[cut] is None:  # what is not split has no parts
        branch["children"] = [None] if many == "one too many" else []
        problems = pm.verify(json.dumps(data | {"digest": digest(data)})).problems
        assert [one.split(":")[0] for one in problems] == ["proof"] * (many == "one too many")
        return
    if many == "without a cut":
        branch[cut] = None
    else:
        branch["children"] = {
            "none": [],
            "one too few": branch["children"][:-1],
            "one too many": [*branch["children"], None],
        }[many]
    lower = bound(data)
    assert (lower is None) == (many != "without a cut")
    if lower is not None:
        assert lower < document(name)["lower_bound"] * (1 - 1e-9)
        problems = pm.verify(restated(data, lower)).problems  # nor is it stated so
        assert [one.split(":")[0] for one in problems] == ["proof"]


@pytest.mark.parametrize(("name", "k"), EVERY)
def test_children_stand_in_their_order(name, k):
    data = deepcopy(document(name))
    at(data, places(name)[k])["children"].reverse()
    proves_no_more(data, document(name))


@pytest.mark.parametrize(("name", "k"), SOME)
def test_leaves_are_of_their_own_branch_and_cover_all_times(name, k):
    where = places(name)[k]
    for other in places(name):
        data = deepcopy(document(name))
        at(data, where)["leaves"] = deepcopy(at(data, other)["leaves"])
        proves_no_more(data, document(name))
    data = deepcopy(document(name))
    branch = at(data, where)
    split = bool(branch["children"])
    for leaves in (
        [],
        branch["leaves"][1:],
        [{**one, "high": [0.9 * x for x in one["high"]]} for one in branch["leaves"]],
    ):
        branch["leaves"] = leaves
        if split or leaves == at(document(name), where)["leaves"]:  # the children prove it
            proves_no_more(data, document(name))
        else:
            proves_less(data, document(name))
    branch["leaves"] = [
        {**one, "multipliers": [[0.0, 0.0] for _ in one["multipliers"]]} for one in at(document(name), where)["leaves"]
    ]
    (proves_no_more if split else proves_less)(data, document(name))


@pytest.mark.parametrize("k", range(5))
def test_strips_and_lines_of_blocks_are_their_own(k):
    where = places("blocks")[k]
    strips = range(-1, 7)
    for strip in strips:
        data = deepcopy(document("blocks"))
        branch = at(data, where)
        if strip == branch["strip"]:
            continue
        for children in (branch["children"], [], [None], [None, None]):
            branch["strip"], branch["children"] = strip, children
            (proves_no_more if branch["leaves"] and not at(document("blocks"), where)["children"] else proves_less)(
                data, document("blocks")
            )
    for lines in (
        [],
        [[0.5, 2]],
        [[0.3, 1]],
        [[0.7, 3]],
        [[0.2, 1], [0.8, 3]],
        [[0.2, 1], [0.3, 1]],
        [[2.0, 4]],
        [[0.3, 3]],
    ):
        data = deepcopy(document("blocks"))
        branch = at(data, where)
        branch["lines"] = lines
        proves_no_more(data, document("blocks"))
        branch["leaves"] = []
        if not branch["children"]:
            proves_less(data, document("blocks"))


@pytest.mark.parametrize("k", [k for name, k in SOME if name == "two_link"])
def test_lines_and_conditions_of_arms_are_their_own(k):
    """Ends and conditions that are not looked at weaken a branch, and its bound."""
    where, before = places("two_link")[k], document("two_link")
    for ends in ([False, False], [True, False], [False, True], [True, True]):
        for dropped in ([], [0], [0, 1], [7]):
            data = deepcopy(before)
            branch = at(data, where)
            branch["ends"], branch["dropped"] = ends, dropped
            proves_no_more(data, before)
            if not any(ends) and not branch["children"]:
                weak = bound(data)
                assert weak is None or weak <= before["lower_bound"] * (1 + 1e-9)
    angle, offset = at(before, where)["line"] or (0.0, 1.0)
    for line in (
        [angle + 0.1, offset],
        [angle, 0.9 * offset],
        [angle, -offset],
        [angle, 9 * offset],
        [angle + 3, offset],
    ):
        data = deepcopy(before)
        at(data, where)["line"] = line
        proves_no_more(data, before)


def test_motions_that_turn_their_elbow_over_are_not_left_out():
    before = document("two_link")
    (passage,) = before["proof"]["passages"]
    edges = [one["edge"] for one in passage["touching"]]
    first = edges.index("inner"), edges.index("outer")
    for i, touching in enumerate(passage["touching"]):
        if not ALL and i not in (*first, len(edges) - 1):
            continue
        data = deepcopy(before)
        del data["proof"]["passages"][0]["touching"][i]
        assert bound(data) == 0
        if i not in first:
            continue
        for change in (
            {"leaves": [[] for _ in touching["leaves"]]},
            {"leaves": touching["leaves"][:-1]},
            {"leaves": [*touching["leaves"], touching["leaves"][0]]},
            {"edge": {"inner": "outer", "outer": "inner"}[touching["edge"]]},
            {"arc": [touching["arc"][0] + 0.01, touching["arc"][1]]},
            {"arc": [touching["arc"][0], touching["arc"][1] - 0.01]},
            {"arc": touching["arc"][::-1]},
            {"arc": [touching["arc"][0], touching["arc"][0] + 2.2]},
        ):
            data = deepcopy(before)
            data["proof"]["passages"][0]["touching"][i] |= change
            proves_less(data, before)
    data = deepcopy(before)
    data["proof"]["passages"][0]["kept"] = None
    proves_less(data, before)
    data["proof"]["passages"] = []
    proves_less(data, before)


def test_passages_are_those_of_the_arm():
    before = document("two_link")
    for change in ({"indices": [0, 1]}, {"indices": [-1, 0]}, {"whole": None, "kept": None}):
        data = deepcopy(before)
        data["proof"]["passages"][0] |= change
        proves_less(data, before)
    for cells in (1, 7, 100, 10**6):
        data = deepcopy(before)
        data["proof"]["cells"] = cells
        assert bound(data) is None
