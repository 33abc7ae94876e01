"""A plan's document: what it says it says again when it is read, and its schema says what it is."""

import dataclasses
import json
import re
from functools import cache
from pathlib import Path

import jsonschema
import pytest

import peakmin as pm
from peakmin.plan.answer import plan_of
from peakmin.plan.document import VERSION, ArmDocument, PointDocument, digest, schema
from peakmin.plan.found import Found
from peakmin.plan.verify import plan_stated
from peakmin.proofs.bounds import Proof
from peakmin.scenes.arm_proof import ArmProof
from peakmin.scenes.blocks import BlockProof
from peakmin.scenes.kinds import scene_of
from peakmin.scenes.proof_tree import Branch
from tests.conftest import wall_maneuver
from tests.plan.test_version_1 import FILES
from tests.random_arms import task
from tests.solved import solved as solve_once
from tests.whole.strategies import VERSION_1

PROOFS = {"no walls": Proof("all", ()), "walls": Proof("all", ()), "two_link": ArmProof(())}  # of no more than zero
EXAMPLES = Path(__file__).parents[2] / "examples"
FEW = pm.Aligned(steps=20)


def box(left, right, low, high):
    return pm.Block(vertices=[(left, low), (right, low), (right, high), (left, high)])


def asked(name):
    """A task and its settings."""
    two = [box(0.2, 0.4, -0.5, 0.2), box(0.6, 0.8, -0.2, 0.5)]
    points = {
        "walls": ({}, {}),
        "no walls": ({"obstacles": ()}, {}),
        "exact": ({}, {"method": pm.Exact()}),
        "at these times": ({}, {"search": pm.SweepSearch(count=2)}),
        "infeasible": ({"max_peak": 8.0}, {}),
        "impossible": ({"max_speed": 0.1}, {}),
        "unknown": ({"max_peak": 8.55}, {}),
        "blocks": ({"obstacles": two}, {}),
        "a way by itself": ({"obstacles": [box(0.4, 0.6, 0.5, 0.6)]}, {}),
    }
    if name in points:
        changes, how = points[name]
        return wall_maneuver(**changes), pm.Settings(**{"grid": FEW, **how})
    if name == "straight arm":
        return task(1), pm.Settings(grid=FEW)
    spec = pm.ArmSpec.read(EXAMPLES / f"{name}.json")
    return spec.task, spec.settings


POINTS = [
    *("walls", "no walls", "exact", "at these times", "infeasible", "impossible", "unknown", "blocks"),
    "a way by itself",
]
ARMS = ["two_link", "three_link", "straight arm"]
NAMES = [*POINTS, *ARMS]
every = pytest.mark.parametrize("name", NAMES)


def solved(name):
    return solve_once(*asked(name))


@every
def test_a_file_gives_the_plan_back_to_the_byte(name):
    plan = solved(name)
    text = plan.to_json()
    again = type(plan).from_json(text)
    assert again.to_json() == text
    assert pm.verify(text).plan.to_json() == text
    data = json.loads(text)
    assert (next(iter(data)), data["version"], data["kind"]) == ("version", VERSION, plan.kind)
    assert data["digest"] == digest(data)


def test_kinds_of_proofs_and_of_plans_are_all_there():
    kinds = {(data["status"], data["proof"]["kind"], data["scope"]) for data in (solved(n).document() for n in NAMES)}
    assert {
        *(("solved", "walls", "all"), ("solved", "walls", "these"), ("infeasible", "walls", "all")),
        *(("unknown", "walls", "all"), ("solved", "blocks", "all"), ("solved", "arm", "all")),
    } <= kinds


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_files_of_version_1_are_written_as_of_the_present_one_and_come_back_to_the_byte(file):
    text = pm.verify(file.read_text()).plan.to_json()
    kind = pm.ArmPlan if json.loads(text)["kind"] == "arm" else pm.Plan
    assert kind.from_json(text).to_json() == text
    valid(json.loads(text))


@every
def test_a_plan_is_not_read_as_one_of_another_kind(name):
    plan = solved(name)
    other = pm.Plan if isinstance(plan, pm.ArmPlan) else pm.ArmPlan
    with pytest.raises(pm.SpecError, match=r"^the document: was not a plan \(kind: was "):
        other.from_json(plan.to_json())
    bare = {key: value for key, value in plan.document().items() if key != "kind"}
    for read in (pm.verify, type(plan).from_json):
        with pytest.raises(pm.SpecError, match=r"^the document: was not a plan \("):
            read(json.dumps(bare))


def test_every_key_of_a_plan_file_stands_in_its_document():
    table = (EXAMPLES.parent / "docs" / "files.md").read_text().split("## Plan files")[1].split("###")[0]
    listed = re.findall(r"^\| (`.*?`) \|", table, re.MULTILINE)
    keys = {key for cell in listed for key in re.findall(r"`(\w+)`", cell)}
    assert keys == {*PointDocument.model_fields, *ArmDocument.model_fields}
    assert f"| `version`, `kind` | {VERSION}, " in table


# ---- the schema


@cache
def validator():
    jsonschema.Draft202012Validator.check_schema(schema())
    return jsonschema.Draft202012Validator(schema())


def valid(data):
    validator().validate(data)


@every
def test_the_schema_accepts_plans_and_nothing_that_misses_a_key(name):
    """Wherever the key is missing: what may be left out of a wall or a spec is not written."""
    data = solved(name).document()
    valid(data)
    rows = len(data["times"] or ())
    data = {k: v[:3] if isinstance(v, list) and len(v) >= rows - 1 > 3 else v for k, v in data.items()}
    valid(data)
    for key in data:
        assert not validator().is_valid({k: value for k, value in data.items() if k != key}), key
    for inside in ("made", "sensitivities", "costate", "path", "proof"):
        for key in data.get(inside) or ():
            less = {k: value for k, value in data[inside].items() if k != key}
            assert not validator().is_valid(data | {inside: less}), (inside, key)


@pytest.mark.parametrize(
    "change",
    [
        {"extra": 1},
        {"version": 1},
        {"version": 4},
        {"kind": "wall"},
        {"status": "optimal"},
        {"scope": "some"},
        {"peak": -1.0},
        {"peak": "8.5"},
        {"lower_bound": True},
        {"gap": None},
        {"times": [0.0, 1e200]},
        {"position": [0.0]},
        {"digest": None},
        {"spec": {}},
        {"walls": [{}]},
        {"proof": []},
        {"proof": {"kind": "walls", "leaves": [{"low": [-0.1], "high": [1.0], "at": [0.5], "multipliers": []}]}},
        {"proof": {"kind": "walls", "leaves": [{"low": [0.0], "high": [1.1], "at": [0.5], "multipliers": []}]}},
    ],
    ids=str,
)
def test_the_schema_refuses_what_is_none_as_reading_does(change):
    data = solved("walls").document() | change
    assert not validator().is_valid(data)
    with pytest.raises(pm.SpecError):
        pm.Plan.from_json(json.dumps(data))


@pytest.mark.parametrize("name", ["blocks", "two_link"])
def test_the_schema_refuses_branches_that_miss_a_key(name):
    for where, branch in branches(solved(name).document()["proof"]):
        for key in branch:
            data = solved(name).document()
            inside = data["proof"]
            for step in where:
                inside = inside[step]
            del inside[key]
            assert not validator().is_valid(data), (where, key)


def branches(proof, where=()):
    """The branches of all trees of a proof, each with the way to it."""
    if isinstance(proof, dict):
        if "children" in proof:
            yield where, proof
        for key, value in proof.items():
            yield from branches(value, (*where, key))
    elif isinstance(proof, list):
        for k, value in enumerate(proof):
            yield from branches(value, (*where, k))


# ---- what an untrue document is not


@pytest.mark.parametrize("text", ["", "[]", "null", "{}", '{"version": 2}', '{"version": 2, "kind": "arm"}', "\x1b[2J"])
def test_what_is_no_plan_is_refused_in_one_line(text):
    for read in (pm.verify, pm.Plan.from_json, pm.ArmPlan.from_json):
        with pytest.raises(pm.SpecError) as error:
            read(text)
        assert str(error.value).isprintable()


def test_words_of_an_arm_s_file_are_shown_without_their_control_characters():
    for name in ("contacts", "exceeded"):
        problems = pm.verify(json.dumps(solved("two_link").document() | {name: ["\x1b[2J\n"]})).problems
        assert any(one.startswith(f"{name}: was ") for one in problems)
        assert all(one.isprintable() for one in problems)


def test_a_motion_that_no_document_can_state_is_untrue():
    """Finite controls over times whose squares are not."""
    data = solved("walls").document()
    data["acceleration"] = [[1e100, 0.0]] * len(data["acceleration"])
    data["times"] = [2e4 * t for t in data["times"]]
    problems = pm.verify(json.dumps(data)).problems
    assert any(one.startswith("the document: cannot be written anew (") for one in problems)


ROOF = ((-0.1, -0.05), (1.1, -0.05), (0.5, 0.52))
TWO_LINKS = pm.ArmSpec.read(EXAMPLES / "two_link.json").arm.links


def nearer(block, by):
    """A block that much further up."""
    return block.model_copy(update={"vertices": tuple((x, y + by) for x, y in block.vertices)})


@cache
def by_hand(name):
    """A plan without its proof: straight ahead, over the wall, and an arm's as a file has it."""
    if name == "two_link":
        return pm.ArmPlan.from_json((VERSION_1 / "two_link.json").read_text())
    return pm.solve(asked(name)[0], pm.Settings(method=pm.Exact()))


@pytest.mark.parametrize(
    ("name", "changes", "units"),
    [
        ("walls", {"obstacles": (pm.Wall(tip=(0.5, 0.6)),)}, {"obstacles[0]": "m"}),
        ("no walls", {"obstacles": (box(0.4, 0.6, -0.1, 0.1),)}, {"blocks": "m"}),
        ("no walls", {"max_speed": 1.9}, {"max_speed": "m/s"}),
        ("walls", {"region": ROOF}, {"region": "m"}),
        (
            "walls",
            {"obstacles": (pm.Wall(tip=(0.5, 0.51)),), "max_speed": 1.9, "region": ROOF},
            {"obstacles[0]": "m", "max_speed": "m/s", "region": "m"},
        ),
        ("two_link", {"obstacles": 0.01}, {"obstacles": "m"}),
        ("two_link", {"max_speed": 0.26}, {"arm.links[1].max_speed": "rad/s"}),
        ("two_link", {"limits": (-2.29, 0.0)}, {"arm.links[1].limits": "rad"}),
        ("two_link", {"turned": (2.0, 2.5)}, {"arm": "m"}),
    ],
    ids=str,
)
def test_a_motion_that_does_not_keep_all_is_no_solution(name, changes, units):
    """Each excess has the entry of the spec, an amount in a unit, and the same in words."""
    plan, joints = by_hand(name), None
    if name == "two_link":
        task, joints = plan.maneuver, dataclasses.replace(plan.joints, changes=changes.get("turned", ()))
        limits = {key: changes[key] for key in ("max_speed", "limits") if key in changes}
        links = (TWO_LINKS[0], TWO_LINKS[1].model_copy(update=limits))
        obstacles = tuple(nearer(one, changes.get("obstacles", 0.0)) for one in task.obstacles)
        changes = {"arm": task.arm.model_copy(update={"links": links}), "obstacles": obstacles}
    asked = plan.maneuver.model_copy(update=changes)
    found = Found(plan.crossing, plan.obstacle_times, joints or plan.trajectory, plan.peak, plan.made, PROOFS[name])
    scene = scene_of(asked)
    if isinstance(asked, pm.Maneuver) and asked.blocks:
        found = dataclasses.replace(found, proof=BlockProof(Branch((), ())))
    kept = scene.kept(found.motion)
    assert {one.field: one.unit for one in kept.excesses} == units
    assert all(one.amount > 0 and one.words.startswith(one.field) for one in kept.excesses)
    assert [kept.of(one.field) for one in kept.excesses] == [one.amount for one in kept.excesses]
    assert not kept.passed
    assert plan_of(scene, plan.settings, found).status == "unknown"
    said = dataclasses.replace(plan_of(scene, plan.settings, found), status="solved")
    problems = pm.verify(said.to_json()).problems
    assert [one for one in problems if "not all is kept" in one] == [
        f"status: solved, but not all is kept ({one.words})" for one in kept.excesses
    ]


@every
def test_what_is_solved_keeps_all(name):
    plan = solved(name)
    assert (plan.kept is None) == (plan.trajectory is None)
    if plan.keeps:
        assert plan.kept.passed
        assert plan.kept.excesses == ()
        assert plan.kept.of("obstacles[0]") == 0


def test_documents_of_either_kind_are_read_by_their_kind():
    for name in ("walls", "blocks", "two_link"):
        plan = solved(name)
        assert type(plan_stated(plan.document())) is type(plan)
