"""Blocks: random scenes against dense sampling, frames, and proofs that were tampered with."""

import json

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.geometry.clearance import block_clearance
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.plan.document import digest
from peakmin.programs.least_peak import LeastPeak
from peakmin.scenes.blocks import BlockProof
from peakmin.scenes.cells import Cells
from peakmin.scenes.kept import keeping, kept
from peakmin.scenes.kinds import scene_of
from peakmin.search.tree import Effort, Tree
from tests.conftest import ALL, wall_maneuver
from tests.random_scenes import scene
from tests.scenes.test_ways import DENTED

# of 300 scenes, as many at once: two of them take longer than all others of `make test`, 200 and 225
CHUNKS = [range(k, k + 30) for k in range(0, 300, 30)] if ALL else [range(25, 200, 25)]


def box(left, right, low, high, **more):
    return pm.Block(vertices=[(left, low), (right, low), (right, high), (left, high)], **more)


def past(*blocks, **more):
    return wall_maneuver(obstacles=blocks, **more)


def assert_free(plan, samples=20_000):
    """An independent check: shapely at 100 times the grid."""
    maneuver = plan.maneuver
    points = shapely.points(plan.position(np.linspace(0, maneuver.duration, samples + 1)))
    for block in maneuver.blocks:
        polygon = shapely.Polygon(block.vertices)
        assert not np.any(shapely.contains(polygon, points))
        assert np.min(shapely.distance(polygon, points)) >= maneuver.margin * (1 - 1e-9)
    assert np.min(
        shapely.distance(shapely.union_all([shapely.Polygon(b.vertices) for b in maneuver.blocks]), points)
    ) >= (plan.clearance - 1e-12 * np.max(np.abs(plan.position(maneuver.duration))))


@pytest.mark.parametrize("seed", [130, 267])
def test_the_tree_s_proof_proves_its_bound(seed, monkeypatch):
    """Also where a class was looked at past other walls that proved less of it than before; more boxes are for the
    walls that it was looked at last."""
    bounded = Tree._bounded

    def watched(self, one, above=None, path=None, more=False):
        assert not more or one == above.one
        return bounded(self, one, above, path, more)

    monkeypatch.setattr(Tree, "_bounded", watched)
    classes = scene_of(scene(seed)).classes
    tree = Tree(classes, Effort(gap=1e-4, most_boxes=100, most_rounds=12))
    tree.run()
    assert min(tree.lower, tree.upper) == pytest.approx(BlockProof(tree.root.trunk.branch()).bound(classes), rel=1e-12)


@pytest.mark.parametrize("seeds", CHUNKS, ids=str)
def test_random_scenes(seeds):
    """Every plan called solved is free, none beats its bound, and nearly all are solved."""
    solved = refused = 0
    for seed in seeds:
        try:
            plan = pm.solve(scene(seed))
        except pm.SpecError:  # the sides leave no way
            assert Cells(scene(seed)).ways is None
            refused += 1
            continue
        assert plan.lower_bound <= plan.peak, seed
        if plan.keeps:
            solved += 1
            assert_free(plan)
    assert solved >= 0.9 * (len(seeds) - refused) - 1


def test_a_free_path_needs_no_wall():
    plan = pm.solve(past(box(0.4, 0.6, 0.5, 0.6)))
    assert plan.walls == ()
    assert plan.peak == pytest.approx(4.0, rel=1e-8)
    assert plan.clearance == pytest.approx(0.5, rel=1e-6)


def test_the_better_side_is_not_the_nearer_one():
    """A spike that reaches further up than the broad bottom reaches down."""
    vertices = [(0.1, -0.1), (0.9, -0.1), (0.52, 0.0), (0.5, 0.13), (0.48, 0.0)]
    left, right, either = (
        pm.solve(past(pm.Block(vertices=vertices, side=side))) for side in ("left", "right", "either")
    )
    assert left.peak < right.peak
    assert either.peak == pytest.approx(left.peak, rel=1e-6)
    assert either.lower_bound <= left.peak


def test_sides_are_seen_along_the_way():
    block = box(0.4, 0.6, -0.1, 0.3, side="left")
    assert pm.solve(past(block)).position(0.5)[1] > 0.29
    back = {"start": pm.State(position=(1, 0)), "goal": pm.State(position=(0, 0))}
    assert pm.solve(past(block, **back)).position(0.5)[1] < -0.09


def test_a_coarse_grid_would_cut_the_corner_between_its_nodes():
    """No node of the plan past the lines alone is in the block, but its path is; the plan itself is free."""
    settings = pm.Settings(grid=pm.Aligned(steps=6))
    alone = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(0.35, 0.3)),)), pm.Settings(method=pm.Exact()))
    t = np.linspace(0, 1, 100_001)
    x, y = alone.position(t).T
    second = float(np.interp(0.5, x, y)) - 1e-4  # a corner just below the continuous path
    corners = np.array([(0.35, -0.2), (0.5, -0.2), (0.5, second), (0.35, 0.3)])
    maneuver = past(pm.Block(vertices=corners, side="left"))
    motion = LeastPeak(alone.maneuver, settings).motion(alone.obstacle_times)
    inside = shapely.Polygon(corners).buffer(-1e-9)
    assert not np.any(shapely.contains(inside, shapely.points(motion.node_position)))
    assert block_clearance(motion, corners) < -1e-4
    plan = pm.solve(maneuver, settings)
    assert plan.keeps
    assert plan.clearance >= 0
    assert_free(plan)


@pytest.mark.parametrize("angle", [0.4, 2.5, -1.2])
def test_every_frame_gives_the_same(angle):
    given = pm.solve(
        past(
            pm.Block(vertices=[(0.4, -0.1), (0.6, -0.2), (0.55, 0.3)]), start=pm.State(position=(0, 0), velocity=(0, 1))
        ),
        pm.Settings(method=pm.Exact()),
    )
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    corners = np.array([(0.4, -0.1), (0.6, -0.2), (0.55, 0.3)]) @ turn + [5.0, -3.0]
    plan = pm.solve(
        pm.Maneuver(
            start=pm.State(position=(5, -3), velocity=turn[1]),
            goal=pm.State(position=[5, -3] + turn[0]),
            duration=1.0,
            obstacles=[pm.Block(vertices=corners.tolist())],
        ),
        pm.Settings(method=pm.Exact()),
    )
    assert plan.peak == pytest.approx(given.peak, rel=1e-6)
    frame = pm.Frame.from_maneuver(plan.maneuver)
    assert frame.angle == pytest.approx(angle)
    np.testing.assert_allclose(frame.maneuver(plan.maneuver).goal.position, (1, 0), atol=1e-12)
    np.testing.assert_allclose(
        frame.maneuver_back(frame.maneuver(plan.maneuver)).blocks[0].vertices, corners, atol=1e-12
    )
    np.testing.assert_allclose(frame.vector_back(frame.vector(plan.acceleration(0.3))), plan.acceleration(0.3))


def test_a_polygon_of_the_circle_turns_with_the_way():
    turn = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    wall = pm.Wall(tip=np.array([0.5, 0.5]) @ turn, direction=np.array([0, -1]) @ turn)
    turned = wall_maneuver(goal=pm.State(position=turn[0]), obstacles=(wall,))
    for align, same in (("frame", True), ("axes", False)):
        circle = pm.Polygon(segments=3, align=align)
        one, other = (pm.sweep(m, pm.Settings(circle=circle), times=[0.4]).best for m in (wall_maneuver(), turned))
        assert (abs(one.peak - other.peak) <= 1e-6 * one.peak) == same


@pytest.mark.parametrize("seed", range(0, 6, 1 if ALL else 3))
def test_no_path_past_two_points_beats_the_bound(seed):
    """Free paths made another way, through two given points, against the bound of the scene."""
    rng = np.random.default_rng(seed)
    maneuver = past(box(0.35, 0.5, -0.15, 0.2), start=pm.State(position=(0, 0), velocity=rng.normal(size=2)))
    bound, polygon, free = pm.solve(maneuver).lower_bound, shapely.Polygon(maneuver.blocks[0].vertices), 0
    for _ in range(40 if ALL else 15):
        points = rng.uniform((-0.3, -0.4), (1.2, 0.5), (2, 2))
        walls = tuple(pm.Wall(tip=p, direction=rng.normal(size=2), contact="touch") for p in points)
        try:
            via = pm.sweep(maneuver.past(walls), times=[np.sort(rng.uniform(0.1, 0.9, 2))]).best
        except pm.SpecError:
            continue
        if via.trajectory is None:
            continue
        path = shapely.LineString(via.position(np.linspace(0, 1, 4001)))
        if path.distance(polygon) > 0:
            free += 1
            assert via.peak >= bound
    assert free >= 3


def test_walls_that_hang_from_above_slits_and_walls_behind():
    above = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -0.2), direction=(0, 1)),)))
    below = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(0.5, 0.2)),)))
    assert above.peak == pytest.approx(below.peak, rel=1e-9)
    slit = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -0.3), opening=0.1),)), pm.Settings(method=pm.Exact()))
    assert slit.status == "solved"
    assert slit.position(slit.obstacle_times)[0, 1] == pytest.approx(-0.2, abs=1e-9)
    assert slit.peak == pytest.approx(above.lower_bound, rel=1e-6)
    wide = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -0.3), opening=0.6),)))
    assert wide.peak == pytest.approx(4.0, rel=1e-6)
    with pytest.raises(pm.SpecError, match=r"obstacles\[1\].*opening"):
        wall_maneuver(obstacles=(pm.Wall(tip=(0.5, -0.2), direction=(0, 1)), pm.Wall(tip=(0.5, 0.2))))
    behind = pm.solve(wall_maneuver(obstacles=(pm.Wall(tip=(-0.2, 0.3)),)), pm.Settings(grid=pm.Aligned(steps=40)))
    assert behind.status in ("solved", "feasible", "unknown")
    assert behind.lower_bound > 4.0
    if behind.keeps:
        assert behind.clearance >= 0


def test_a_line_met_again_below_its_tip_is_kept_from():
    """A fast start would pass below the tip, turn and come back over it."""
    fast = wall_maneuver(start=pm.State(position=(0, 0), velocity=(6, 0)), obstacles=(pm.Wall(tip=(0.5, 0.3)),))
    plan = pm.solve(fast, pm.Settings(grid=pm.Aligned(steps=40)))
    assert plan.keeps
    assert plan.clearance >= 0
    assert plan.peak == pytest.approx(6**2 / (2 * 0.5), rel=1e-3)  # it must stop in front of the wall
    x = plan.position(np.linspace(0, plan.obstacle_times[0] - 1e-9, 2001))[:, 0]
    assert np.max(x) <= 0.5 + 1e-9


def test_region_and_speed_are_kept_between_nodes():
    upward = pm.State(position=(0, 0), velocity=(0, 3))
    region = ((-0.1, -0.2), (1.1, -0.2), (1.1, 0.45), (-0.1, 0.45))
    plan = pm.solve(wall_maneuver(start=upward, obstacles=(), region=region), pm.Settings(grid=pm.Aligned(steps=20)))
    assert plan.keeps
    assert np.max(plan.position(np.linspace(0, 1, 5001))[:, 1]) <= 0.45 + 1e-12
    slow = pm.solve(wall_maneuver(obstacles=(), max_speed=1.6))
    assert slow.keeps
    assert np.max(np.hypot(*slow.velocity(np.linspace(0, 1, 5001)).T)) <= 1.6 * (1 + 1e-12)
    # accelerate for t1, cruise, brake: 1.6 (1 - t1) = 1 and M = 1.6 / t1
    assert slow.peak == pytest.approx(1.6 / (1 - 1 / 1.6), rel=1e-3)
    assert pm.solve(wall_maneuver(obstacles=(), max_speed=0.9)).status == "infeasible"
    assert pm.verify(slow.to_json()).passed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": {"position": [0.5, 0.0]}}, r"obstacles\[0\]: was a block around the start"),
        ({"goal": {"position": [0.65, 0.0]}, "margin": 0.1}, r"obstacles\[0\]: was a block around the goal"),
        ({"region": [[0, 0], [1, 0], [0.5, 0.1], [1, 1]]}, "region: was"),
        ({"region": [[2, 0], [3, 0], [3, 1]]}, "start.position: was"),
        ({"max_speed": 1.0, "start": {"position": [0, 0], "velocity": [2, 0]}}, "start.velocity: was"),
        ({"margin": -1.0}, "margin: was -1.0"),
    ],
)
def test_refusals_in_one_line(change, message):
    whole = {
        "start": {"position": [0, 0]},
        "goal": {"position": [1, 0]},
        "duration": 1.0,
        "obstacles": [{"kind": "block", "vertices": [[0.4, -0.1], [0.6, -0.1], [0.6, 0.1], [0.4, 0.1]]}],
    }
    with pytest.raises(pm.SpecError, match=message) as refused:
        pm.Maneuver(**{**whole, **change})
    assert "\n" not in str(refused.value)


def test_refusals_of_what_does_not_go_together():
    block = box(0.4, 0.6, -0.1, 0.1)
    for wall, message in (
        (pm.Wall(tip=(0.8, 0.1), direction=(1, -1)), "square"),
        (pm.Wall(tip=(0.8, 0.1), contact="touch"), "touch"),
    ):
        with pytest.raises(pm.SpecError, match=message):
            pm.solve(past(block, wall))
    with pytest.raises(pm.SpecError, match="global"):
        pm.solve(past(block), pm.Settings(search=pm.SweepSearch()))
    with pytest.raises(pm.SpecError, match="a sweep"):
        pm.sweep(past(block))
    with pytest.raises(pm.SpecError, match="walls only"):
        pm.shortest(past(block), peak=9.0)
    closed = past(box(0.4, 0.6, 0.1, 0.3, side="left"), box(0.4, 0.6, -0.3, -0.1, side="right"))
    with pytest.raises(pm.SpecError, match="must leave a way"):
        pm.solve(closed)


BESIDE = [{"max_speed": 0.3}, {"region": ((-0.1, -1), (4.1, -1), (4.1, 0.36), (-0.1, 0.36))}]


@pytest.mark.parametrize("bound", BESIDE if ALL else BESIDE[:1], ids=lambda one: next(iter(one)))
def test_a_region_or_a_speed_beside_a_block(bound):
    square = box(1.5, 2.5, -0.5, 0.3)
    common = {"goal": pm.State(position=(4, 0)), "duration": 20.0, "margin": 0.05}
    settings = pm.Settings(grid=pm.Aligned(steps=24))
    plan = pm.solve(past(square, **common, **bound), settings)
    assert plan.keeps
    assert plan.lower_bound <= plan.peak
    assert_free(plan)


def test_walls_across_the_way_stand_beside_blocks():
    plan = pm.solve(past(box(0.2, 0.3, -0.1, 0.2), pm.Wall(tip=(0.7, 0.4))))
    assert plan.status == "solved"
    assert plan.clearance >= 0
    assert pm.verify(plan.to_json()).passed


def test_a_path_that_turns_back_has_a_way():
    """Between two hooks, forward, back and forward again: no gap on its way meets the next, and still it is counted."""
    floor = [(0.5, -40), (0.7, -40), (0.7, 0.5), (2.5, 0.5), (2.5, 0.7), (0.5, 0.7)]
    ceiling = [(3.3, 40), (3.5, 40), (3.5, -0.7), (1.5, -0.7), (1.5, -0.5), (3.3, -0.5)]
    hooks = past(pm.Block(vertices=floor), pm.Block(vertices=ceiling), goal=pm.State(position=(4, 0)))
    corners = np.array([(0, 0), (0.4, 0.9), (2.9, 0.9), (2.9, 0.0), (1.1, 0.0), (1.1, -1.0), (3.8, -1.0), (4, 0)])
    path = shapely.LineString(corners)
    assert all(not path.intersects(shapely.Polygon(block.vertices)) for block in hooks.blocks)
    cells = Cells(hooks)
    points = np.array([path.interpolate(s, normalized=True).coords[0] for s in np.linspace(0, 1, 20_001)])
    way = []
    for k, (left, right) in enumerate(zip(cells.lines, cells.lines[1:], strict=False)):
        last = np.flatnonzero(points[:, 0] <= left)[-1]
        x, y = next(point for point in points[last:] if point[0] >= 0.5 * (left + right))
        way.append(tuple(g for g, gap in enumerate(cells.gaps[k]) if gap.at(x)[0] < y < gap.at(x)[1]))
    assert all(len(gaps) == 1 for gaps in way)
    assert cells.through(tuple(way)) == tuple(way)
    assert all(set(gaps) <= set(every) for gaps, every in zip(way, cells.ways, strict=True))


def test_a_side_is_kept_even_where_the_other_is_free():
    low = box(0.4, 0.6, -0.03, -0.01, side="right")
    plan = pm.solve(past(low))
    assert plan.status == "solved"
    assert plan.peak > 4.014
    assert plan.position(0.5)[1] < -0.03
    # the path of the other side does not pass for it
    other = json.loads(pm.solve(past(low.model_copy(update={"side": "left"}))).to_json())
    right = json.loads(plan.to_json())
    for name in ("spec", "proof", "lower_bound"):
        other[name] = right[name]
    other["gap"] = (other["peak"] - other["lower_bound"]) / other["peak"]
    other["digest"] = digest(other)
    assert not pm.verify(json.dumps(other)).passed


def test_the_joint_of_two_blocks_is_no_way():
    plan = pm.solve(past(box(0.3, 0.7, 0, 1), box(0.3, 0.7, -1, 0)))
    assert plan.lower_bound > 15
    straight = pm.solve(past())
    assert not kept(plan.maneuver, straight.trajectory).passed


def test_the_shadow_of_a_block_is_as_wide_as_its_margin():
    """Below the left end of a block to be passed on the left, within its margin: closed to the bound, and to a plan."""
    maneuver = past(box(0.4, 0.6, 0.1, 0.3, side="left"), margin=0.05)
    points = np.array([(0, 0), (0.37, -0.3), (0.3, 0.2), (0.3, 0.5), (0.7, 0.5), (1, 0)])
    dips = HoldTrajectory(np.linspace(0, 1, 6), np.zeros((5, 2)), points[0], 5 * (points[1] - points[0]))
    assert not kept(maneuver, dips).passed
    cells = Cells(maneuver)
    k = int(np.searchsorted(cells.lines, 0.37)) - 1
    assert all(gap.at(0.37)[0] > 0 for gap in cells.gaps[k])


def test_closed_rings_are_polygons_too():
    square = [(0, -1), (1, -1), (1, 1), (0, 1), (0, -1)]
    assert pm.Block(vertices=square).vertices == tuple(map(tuple, np.array(square[:-1], dtype=float).tolist()))
    assert len(past(region=square).region) == 4
    assert pm.solve(past(region=square)).status == "solved"


@pytest.fixture(scope="module")
def written():
    return pm.solve(past(box(0.2, 0.4, -0.5, 0.2), box(0.6, 0.8, -0.2, 0.5))).to_json()


@pytest.mark.parametrize("forged", [False, True])
@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: data["proof"]["root"]["children"].pop(0),
        lambda data: data["proof"]["root"]["children"].__setitem__(0, None),
        lambda data: data["proof"]["root"]["children"][1]["lines"].__setitem__(0, [0.75, 3]),
        lambda data: data["proof"]["root"]["children"].reverse(),
        lambda data: data["walls"][0].__setitem__("tip", [0.3, -0.4]),
        lambda data: data.__setitem__("clearance", 0.1),
        lambda data: data["spec"]["maneuver"]["obstacles"][0]["vertices"].__setitem__(2, [0.45, 0.3]),
        lambda data: data["spec"]["maneuver"].__setitem__("margin", 0.01),
        lambda data: data["obstacle_times"].__setitem__(0, data["obstacle_times"][0] + 0.01),
    ],
)
def test_a_changed_plan_past_blocks_is_refused(written, spoil, forged):
    assert pm.verify(written).passed
    data = json.loads(written)
    spoil(data)
    if forged:
        data["digest"] = digest(data)
    try:
        found = pm.verify(json.dumps(data))
    except pm.SpecError:
        return
    assert not found.passed


def test_a_passage_past_a_dent_is_not_called_closed():
    """By hand over one waypoint, at rest there: it keeps the margin, so its peak is none below the bound."""
    a, between, b = np.array([(-3.0, -1.26), (0.151, -0.99253), (4.0, -1.09)])
    legs = np.sqrt([np.hypot(*(between - a)), np.hypot(*(b - between))])
    first, second = legs / np.sum(legs)
    control = [4 * (between - a) / first**2, -4 * (between - a) / first**2]
    control += [4 * (b - between) / second**2, -4 * (b - between) / second**2]
    nodes = np.array([0, first / 2, first, first + second / 2, 1])
    motion = HoldTrajectory(nodes, np.array(control), a, np.zeros(2))
    for region in (None, [(-20, -20), (20, -20), (20, 20), (-20, 20)]):
        maneuver = pm.Maneuver(
            start=pm.State(position=tuple(a)),
            goal=pm.State(position=tuple(b)),
            duration=1,
            obstacles=[pm.Block(vertices=DENTED)],
            margin=1.0,
            region=region,
        )
        assert kept(maneuver, motion).passed
        plan = pm.solve(maneuver, pm.Settings(time_limit=1))
        assert plan.status != "infeasible"
        assert plan.lower_bound <= motion.peak()


def test_a_wall_far_away_gives_the_others_no_room():
    """With a tip at 1e9 a crossing 0.4 m beyond another's tip counted as being at it."""
    maneuver = pm.Maneuver(
        start=pm.State(position=(0, 0), velocity=(4, 0)),
        goal=pm.State(position=(1, 0)),
        duration=1,
        obstacles=[pm.Wall(tip=(0.5, 0.5)), pm.Wall(tip=(0.7, -1e9))],
    )
    plan = pm.solve(maneuver, pm.Settings(method=pm.Exact(), time_limit=5))
    assert plan.status == "unknown" or keeping(plan.maneuver, plan.trajectory).walls >= -1e-9


@pytest.mark.parametrize("wide", [1e-3, 1e-5, 1e-7, 1e-9])
def test_a_plate_thinner_than_the_way_between_two_samples_is_seen(wide):
    plan = pm.solve(past(box(0.4123, 0.4123 + wide, -0.4, 0.3)), pm.Settings(time_limit=20))
    assert plan.status == "solved"
    assert plan.peak == pytest.approx(5.88, rel=2e-3)
    assert plan.gap < 1e-3


def test_a_block_with_a_side_counts_within_another_one_too():
    """In front of the strip's middle, where the larger one hides its corners."""
    for left in (0.6, 0.45):
        plan = pm.solve(past(box(0.3, 0.7, -0.1, 0.5), box(left, left + 0.05, 0, 0.1, side="left")))
        assert plan.status == "solved"
        assert plan.lower_bound > 9.3
