"""What guards a proof while it is read: its shapes, its ways and lines, its passages, and its version."""

import json
import math
from functools import cache

import numpy as np
import pytest

import peakmin as pm
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.document import (
    ArmsProof,
    BlocksProof,
    LeafDocument,
    LeavesProof,
    LineBranch,
    ListProof,
    PointDocument,
    TouchingDocument,
    WayBranch,
    arm_proof_of,
    leaves_of,
    point_proof_of,
    shaped,
    unknown,
)
from peakmin.plan.older import SINCE_3, stated
from peakmin.scenes.blocks import BlockProof, ListedProof
from peakmin.scenes.kinds import scene_of
from peakmin.scenes.passages import Line, Looks, Passage, Turned
from tests.conftest import wall_maneuver
from tests.whole.strategies import VERSION_1


def leaf(walls, **changes):
    whole = {
        "low": [0.0] * walls,
        "high": [1.0] * walls,
        "at": [0.5] * walls,
        "multipliers": [[1.0, 0.0]] * (2 + walls),
    }
    return LeafDocument(**{**whole, **changes})


def refused(words):
    return pytest.raises(ValueError, match=words)


def test_numbers_that_are_not_known_are_infinite():
    assert unknown(None) == math.inf
    assert unknown(0.0) == 0.0
    assert unknown(2.5) == 2.5


def test_arrays_have_their_shape():
    assert shaped([[1, 2], [3, 4], [5, 6]], 3, 2).tolist() == [[1, 2], [3, 4], [5, 6]]
    for empty in ([], [[]], [[], []]):
        assert shaped(empty, 0, 2).shape == (0, 2)
        assert shaped(empty, 0).shape == (0,)
    for wrong, shape in (
        ([[1, 2], [3, 4]], (3, 2)),
        ([1, 2, 3, 4], (2, 2)),
        ([[1, 2, 3, 4]], (2, 2)),
        ([], (1, 2)),
        ([], (1,)),
        ([[1, 2]], (0, 2)),
        ([1.0], (0,)),
    ):
        with refused("an array is of shape"):
            shaped(wrong, *shape)
    with pytest.raises(ValueError, match="inhomogeneous"):
        shaped([[1, 2], [3]], 2, 2)


def test_leaves_are_of_the_walls_there_are():
    for walls in (0, 1, 3):
        (one,) = leaves_of([leaf(walls)], walls, 2)
        assert (one.low, one.high, one.at) == ((0.0,) * walls, (1.0,) * walls, (0.5,) * walls)
        assert one.multipliers.tolist() == [[1.0, 0.0]] * (2 + walls)
        for others in {0, 1, 2, 3, 4} - {walls}:
            with refused("a leaf of the proof is of other walls"):
                leaves_of([leaf(walls)], others, 2)
            with refused("a leaf of the proof is of other walls"):
                leaves_of([leaf(walls), leaf(others)], walls, 2)
    for field in ("low", "high", "at"):
        for length in (0, 1, 3):
            with refused("a leaf of the proof is of other walls"):
                leaves_of([leaf(2, **{field: [0.5] * length})], 2, 2)
    for rows in (2, 3, 5):
        with refused("an array is of shape"):
            leaves_of([leaf(2, multipliers=[[1.0, 0.0]] * rows)], 2, 2)
    with refused("an array is of shape"):
        leaves_of([leaf(2, multipliers=[[1.0, 0.0, 0.0]] * 4)], 2, 2)
    assert leaves_of([leaf(2, multipliers=[[1.0, 0.0, 0.0]] * 4)], 2, 3)[0].multipliers.shape == (4, 3)
    assert leaves_of([], 2, 2) == ()


# ---- past blocks


@cache
def two():
    """Over or under each of two boxes."""
    corners = [[(x, y), (x + 0.2, y), (x + 0.2, y + 0.7), (x, y + 0.7)] for x, y in ((0.2, -0.5), (0.6, -0.2))]
    return scene_of(wall_maneuver(obstacles=[pm.Block(vertices=each) for each in corners])).classes


def branch(lines=(), walls=None, strip=None, children=(), leaves=1):
    own = [leaf(len(lines) if walls is None else walls)] * leaves
    return WayBranch(lines=list(lines), leaves=own, strip=strip, children=list(children))


def tree(root):
    return point_proof_of(BlocksProof(kind="blocks", root=root), "all", two(), 0, 2)


UNDER, OVER = branch([(0.3, 1)]), branch([(0.4, 1)])


def test_proofs_of_walls_and_of_blocks_are_not_mixed_up():
    walls, blocks = LeavesProof(kind="walls", leaves=[leaf(1)]), BlocksProof(kind="blocks", root=branch())
    listed = ListProof(kind="listed", branches=[])
    for scope in ("all", "these"):
        proof = point_proof_of(walls, scope, None, 1, 2)
        assert (proof.scope, len(proof.leaves)) == (scope, 1)
        for other in (blocks, listed):
            with refused("the proof is of blocks, and there are none"):
                point_proof_of(other, scope, None, 1, 2)
    with refused("the proof is of walls alone, and there are blocks"):
        point_proof_of(walls, "all", two(), 1, 2)
    assert type(point_proof_of(blocks, "all", two(), 0, 2)) is BlockProof
    assert type(point_proof_of(listed, "all", two(), 0, 2)) is ListedProof
    for other in (blocks, listed, walls):
        with refused("the proof past blocks is of all times"):
            point_proof_of(other, "these", two(), 0, 2)
    with refused("a leaf of the proof is of other walls"):
        point_proof_of(walls, "all", None, 2, 2)


def test_a_tree_is_read_with_the_walls_of_its_ways():
    root = tree(branch(strip=1, children=[UNDER, branch([(0.4, 1), (0.5, 2)], walls=1, leaves=2)])).root
    assert (root.looks, root.cut, len(root.leaves)) == ((), 1, 1)
    under, over = root.children
    assert (under.looks, under.cut, under.children) == (((0.3, 1),), None, ())
    assert over.looks == ((0.4, 1), (0.5, 2))  # nothing stands at 0.5
    assert len(over.leaves) == 2
    assert tree(branch(leaves=0)).root.leaves == ()
    deep = tree(branch(strip=1, children=[branch([(0.3, 1)], strip=3, children=[None, UNDER]), None])).root
    assert deep.children[1] is None
    assert deep.children[0].children[0] is None
    assert deep.children[0].children[1].looks == ((0.3, 1),)


@pytest.mark.parametrize("line", [(0.0, 0), (1.0, 4), (0.3, 2), (0.5, 1), (0.3, 9)], ids=str)
def test_lines_stand_in_their_strips(line):
    for wrong in (branch([line]), branch([(0.3, 1), line]), branch(strip=1, children=[branch([line]), None])):
        with refused("a line of the proof is not between start and goal"):
            tree(wrong)


def test_branches_have_the_walls_of_their_lines_and_strips_that_there_are():
    for wrong in (
        branch(walls=1),
        branch([(0.3, 1)], walls=1),
        branch(strip=1, children=[branch([(0.3, 1)], 0), None]),
    ):
        with refused("a leaf of the proof is of other walls"):
            tree(wrong)  # every way: above and below, so that no wall stands there
    for strip in (5, 99):
        with refused("a strip of the proof is none of these blocks"):
            tree(branch(strip=strip, children=[UNDER, OVER]))
    for children in ([], [UNDER], [UNDER, OVER, None]):
        with refused("zip"):
            tree(branch(strip=1, children=children))


def test_a_tree_where_there_is_no_way_is_none():
    """Nothing has a strip there, and no wall stands."""
    sides = [
        pm.Block(vertices=[(0.4, y), (0.6, y), (0.6, y + 0.2), (0.4, y + 0.2)], side=side)
        for y, side in ((0.1, "left"), (-0.3, "right"))
    ]
    closed = scene_of(wall_maneuver(obstacles=sides)).classes
    assert closed.cells.ways is None
    root = point_proof_of(BlocksProof(kind="blocks", root=branch(strip=1, children=[UNDER])), "all", closed, 0, 2).root
    assert (root.cut, root.children, len(root.leaves)) == (None, (), 1)
    with refused("a leaf of the proof is of other walls"):
        point_proof_of(BlocksProof(kind="blocks", root=branch(walls=1)), "all", closed, 0, 2)


def listed(way, lines=(), walls=0):
    given = [{"way": way, "lines": list(lines), "leaves": [leaf(walls)]}]
    return point_proof_of(ListProof(kind="listed", branches=given), "all", two(), 0, 2)


def test_listed_ways_lead_through_these_blocks():
    (one,) = listed([[0], [1], [0], [0, 1], [0]], [(0.3, 1)], walls=1).branches
    assert (one.way, one.lines, len(one.leaves)) == (((0,), (1,), (0,), (0, 1), (0,)), ((0.3, 1),), 1)
    assert listed([[0], [], [0], [0, 1], [0]]).branches[0].way[1] == ()
    for way in (
        [[0], [1], [0], [0]],
        [[0], [1], [0], [0], [0], [0]],
        [],
        [[0], [2], [0], [0, 1], [0]],
        [[1], [0], [0], [0, 1], [0]],
        [[0], [1], [0], [0, 9], [0]],
    ):
        with refused("a way of the proof is not through these blocks"):
            listed(way)
    with refused("a leaf of the proof is of other walls"):
        listed([[0], [], [0], [0, 1], [0]], walls=1)
    with refused("a line of the proof is not between start and goal"):
        listed([[0], [1], [0], [0, 1], [0]], [(0.3, 2)], walls=1)


# ---- arms


@cache
def arm(name):
    return pm.ArmPlan.from_json((VERSION_1 / f"{name}.json").read_text())


def passages(name="two_link"):
    return arm(name).scene.passages


def line_branch(walls=0, ends=(True, True), dropped=(), line=None, children=(), leaves=1):
    own = [leaf(walls)] * leaves
    return LineBranch(ends=ends, dropped=list(dropped), leaves=own, line=line, children=list(children))


def arms(kept=None, whole=None, touching=(), indices=(0, 0), cells=0, name="two_link"):
    one = {"indices": indices, "kept": kept, "whole": whole, "touching": list(touching)}
    return arm_proof_of(ArmsProof(kind="arm", passages=[one], cells=cells), passages(name))


def split(name="two_link"):
    """A line of the plan's own proof, and the parts that it makes."""
    cut = arm(name).proof.passages[0].kept.cut
    return cut, passages(name)[0, 0].parts((), cut)


def test_an_arm_s_tree_is_read_with_the_walls_of_its_orders():
    cut, parts = split()
    children = [line_branch(1, ends=(True, True)), line_branch(1, ends=(True, False), leaves=2)]
    assert len(parts) == len(children)
    (proof,) = arms(line_branch(line=(cut.angle, cut.offset), children=children)).passages
    root = proof.kept
    assert (proof.indices, proof.whole, proof.touching) == ((0, 0), None, ())
    assert (root.cut, root.looks, len(root.leaves)) == (cut, Looks(), 1)
    assert [one.looks for one in root.children] == [Looks((True, True)), Looks((True, False))]
    assert [len(one.leaves) for one in root.children] == [1, 2]
    free = line_branch(0, ends=(False, False)), line_branch(0, dropped=[0])  # of no wall
    again = arms(line_branch(line=(cut.angle, cut.offset), children=free)).passages[0].kept
    assert [one.looks for one in again.children] == [Looks((False, False)), Looks((True, True), (0,))]
    for wrong in (line_branch(0), line_branch(2), line_branch(1, ends=(False, False)), line_branch(1, dropped=[0])):
        with refused("a leaf of the proof is of other walls"):
            arms(line_branch(line=(cut.angle, cut.offset), children=[wrong, None]))
    with refused("a leaf of the proof is of other walls"):
        arms(line_branch(1))
    for children in ([], [None], [None] * 3):
        with refused("zip"):
            arms(line_branch(line=(cut.angle, cut.offset), children=children))
    empty = arms(line_branch(line=(cut.angle, cut.offset), children=[None, None])).passages[0].kept
    assert empty.children == (None, None)


def test_the_whole_of_a_passage_is_read_with_any_elbow():
    """Both elbows are blocked in fewer places: other gaps."""
    (passage,) = passages().values()
    way = math.dist(passage.maneuver.start.position, passage.maneuver.goal.position)
    lines = ((angle / 4, share * way) for angle in range(12) for share in (0.2, 0.4, 0.6, 0.8))
    counts = {
        line: tuple(len(one.gaps(Line(*line))) for one in (passage.whole, passage))
        for line in lines
        if passage.between(Line(*line))
    }
    line, (free, some) = next(one for one in counts.items() if one[1][0] != one[1][1])
    (proof,) = arms(whole=line_branch(line=line, children=[None] * free)).passages
    assert (proof.kept, len(proof.whole.children)) == (None, free)
    with refused("zip"):
        arms(whole=line_branch(line=line, children=[None] * some))
    with refused("zip"):
        arms(kept=line_branch(line=line, children=[None] * free))


def test_lines_are_between_start_and_goal():
    cut, _ = split()
    for line in ((cut.angle, -cut.offset), (cut.angle, 0.0), (cut.angle + math.pi, cut.offset), (cut.angle, 9.0)):
        assert not passages()[0, 0].between(Line(*line))
        with refused("a line is not between start and goal"):
            arms(line_branch(line=line, children=[None, None]))


def test_passages_are_of_configurations_that_there_are():
    for indices in ((0, 1), (1, 0), (5, 5)):
        with refused("a proof is of configurations that are none"):
            arms(line_branch(), indices=indices)


def test_arcs_have_leaves_for_each_way_in():
    stated = arm("two_link").document()["proof"]["passages"][0]["touching"]
    inner = TouchingDocument(**next(one for one in stated if one["edge"] == "inner"))
    outer = TouchingDocument(**next(one for one in stated if one["edge"] == "outer"))
    for one, count in ((inner, 2), (outer, 1)):
        (touched,) = arms(touching=[one]).passages[0].touching
        assert (touched.edge, touched.arc, len(touched.leaves)) == (one.edge, one.arc, count)
        assert [len(own) for own in touched.leaves] == [len(own) for own in one.leaves]
        for leaves in ([], one.leaves[1:], [*one.leaves, []]):
            with refused("an arc's leaves are missing"):
                arms(touching=[one.model_copy(update={"leaves": leaves})])
        for walls in (0, 2):
            with refused("a leaf of the proof is of other walls"):
                arms(touching=[one.model_copy(update={"leaves": [[leaf(walls)]] * count})])
    # an arc around start and goal is reached without a wall
    bare = [leaf(0)]
    there = next(
        arc
        for arc in ((k / 10, k / 10 + 2.0) for k in range(-40, 40))
        if not passages()[0, 0].past(Turned("outer", arc)).walls
    )
    (touched,) = arms(touching=[TouchingDocument(edge="outer", arc=there, leaves=[bare])]).passages[0].touching
    assert len(touched.leaves[0]) == 1
    with refused("a leaf of the proof is of other walls"):
        arms(touching=[TouchingDocument(edge="outer", arc=there, leaves=[[leaf(1)]])])


def test_where_there_are_no_paths_no_wall_stands(monkeypatch):
    """A gap without width, say."""
    monkeypatch.setattr(Passage, "past", lambda self, paths, lift=0.0: None)
    assert len(arms(line_branch(0)).passages[0].kept.leaves) == 1
    arc = TouchingDocument(edge="outer", arc=(0.0, 1.0), leaves=[[leaf(0)]])
    assert len(arms(touching=[arc]).passages[0].touching[0].leaves[0]) == 1


def test_cells_are_as_many_as_a_flood_has_and_of_two_links():
    for cells in (0, 32, 512):
        assert arms(line_branch(), cells=cells).cells == cells
    for cells in (1, 31, 33, 1024):
        with refused("cells of a flood are not as many as one has"):
            arms(line_branch(), cells=cells)
    assert arm_proof_of(ArmsProof(kind="arm", passages=[], cells=32), {}).cells == 32
    with refused("cells of a flood are not as many as one has"):
        arms(whole=line_branch(), cells=32, name="three_link")


def test_more_links_are_proved_by_the_centre_of_mass_alone():
    (proof,) = arms(whole=line_branch(leaves=2, line=(0.0, 1.0), children=[None]), name="three_link").passages
    assert (proof.kept, proof.touching, proof.indices) == (None, (), (0, 0))
    assert (len(proof.whole.leaves), proof.whole.looks, proof.whole.cut, proof.whole.children) == (2, Looks(), None, ())
    with refused("a proof is missing"):
        arms(kept=line_branch(), name="three_link")
    with refused("a leaf of the proof is of other walls"):
        arms(whole=line_branch(1), name="three_link")
    assert arms(name="two_link").passages[0].whole is None


# ---- the motion, and versions


@cache
def written(method):
    return pm.solve(wall_maneuver(), pm.Settings(method=method, grid=pm.Aligned(steps=8))).document()


def motion(data, maneuver=None):
    return PointDocument(**data).motion(maneuver or wall_maneuver())


def test_a_motion_is_what_is_listed():
    held = written(pm.Direct())
    there = motion(held)
    assert isinstance(there, HoldTrajectory)
    assert there.nodes.tolist() == held["times"]
    assert there.control.tolist() == held["acceleration"]
    moving = wall_maneuver(start=pm.State(position=(2, 3), velocity=(4, 5)))
    assert motion(held, moving).position(0.0).tolist() == [2, 3]
    assert motion(held, moving).velocity(0.0).tolist() == [4, 5]
    smooth = written(pm.Exact())
    np.testing.assert_allclose(motion(smooth).position(smooth["times"]), smooth["position"], rtol=1e-12, atol=1e-14)
    for data in (held, smooth):
        assert motion(data | {"times": [], "position": [], "velocity": [], "acceleration": []}) is None
    for count in (-2, -1, 1):
        less = held["acceleration"][:count] if count < 0 else [*held["acceleration"], [0.0, 0.0]]
        with refused("an array is of shape"):
            motion(held | {"acceleration": less})
    for name in ("first", "last", "size", "first_error", "last_error"):
        for rows in (smooth["costate"][name][:-1], [*smooth["costate"][name], smooth["costate"][name][0]]):
            with refused("an array is of shape"):
                motion(smooth | {"costate": smooth["costate"] | {name: rows}})


def version_1(name):
    return json.loads((VERSION_1 / f"{name}.json").read_text())


def test_versions_are_whole_numbers_that_are_known():
    for version in (0, 4, 1.0, 2.0, True, "1", None, [1]):
        with pytest.raises(pm.SpecError, match=r"^version: was .*, must be 1, 2 or 3 \(the versions so far\)$"):
            stated(json.dumps({"version": version}))
    data = written(pm.Direct())
    as_it_is, new = stated(json.dumps(data))
    assert as_it_is is new
    assert new == data


def test_files_of_version_1_become_what_they_are_in_version_2():
    data, new = stated((VERSION_1 / "general_problem.json").read_text())
    assert data == version_1("general_problem")
    assert (new["version"], new["kind"], new["costate"]) == (3, "point", None)
    assert new["proof"] == {"kind": "walls", "leaves": data["proof"]}
    assert [wall["tip"] for wall in new["walls"]] == [[0.5, 0.5]]
    data, new = stated((VERSION_1 / "wide_box.json").read_text())
    assert new["proof"] == {"kind": "listed", "branches": data["proof"]}
    assert new["walls"] == data["walls"]
    data, new = stated((VERSION_1 / "two_link.json").read_text())
    assert new["proof"] == {"kind": "arm", "passages": data["proof"], "cells": 0}
    assert (new["kind"], new["path"]) == ("arm", data["path"])
    _, new = stated(json.dumps(data | {"flooded": 64}))
    assert new["proof"]["cells"] == 64
    assert "flooded" not in new
    bare = {key: value for key, value in data.items() if key not in ("path", "flooded")}
    new = stated(json.dumps(bare))[1]
    assert (new["path"], new["proof"]["cells"]) == (None, 0)
    for spec in (None, 3):
        assert stated(json.dumps({"version": 1, "spec": spec}))[1]["walls"] == []


@pytest.mark.parametrize("name", ["general_problem", "two_link"])
def test_files_of_version_2_keep_their_proof_as_it_is(name):
    second = stated((VERSION_1 / f"{name}.json").read_text())[1] | {"version": 2}
    second = {key: value for key, value in second.items() if key not in SINCE_3}
    new = stated(json.dumps(second))[1]
    assert new["version"] == 3
    assert (new["proof"], new["walls"], new["kind"]) == (second["proof"], second["walls"], second["kind"])


@pytest.mark.parametrize("name", SINCE_3)
def test_what_is_stated_since_version_3_is_in_no_older_file(name):
    data = json.loads((VERSION_1 / "two_link.json").read_text())
    with pytest.raises(pm.SpecError, match=f"{name}: was given, must be left out in version 1"):
        stated(json.dumps(data | {name: None}))
