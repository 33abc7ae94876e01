"""The ways past blocks: strips, gaps and their order, against points of the plane and paths drawn by hand."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.geometry.trapezoids import Gap, edges_of, lines_through, snapped, trapezoids
from peakmin.proofs.bounds import Leaf
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from peakmin.scenes.blocks import BlockProof, ListedBranch, ListedProof, WayClass, covered
from peakmin.scenes.cells import Cells
from peakmin.scenes.kinds import scene_of
from peakmin.scenes.proof_tree import Branch
from peakmin.spec.obstacles import convex, covers
from tests.conftest import ALL, wall_maneuver
from tests.random_scenes import scene


def box(left, right, low, high, **more):
    return pm.Block(vertices=[(left, low), (right, low), (right, high), (left, high)], **more)


def past(*blocks, **more):
    return wall_maneuver(obstacles=blocks, **more)


TWO = past(box(0.2, 0.4, -0.5, 0.2), box(0.6, 0.8, -0.2, 0.5))
inf = math.inf
POCKET = [(0.4, -0.5), (0.8, -0.5), (0.8, 0.5), (0.4, 0.5), (0.4, 0.3), (0.6, 0.3), (0.6, -0.3), (0.4, -0.3)]


def test_strips_and_gaps_of_two_boxes():
    cells = Cells(TWO)
    np.testing.assert_allclose(cells.lines, [0, 0.2, 0.4, 0.6, 0.8, 1])
    sections = [[gap.at(x + 0.1) for gap in gaps] for x, gaps in zip(cells.lines, cells.gaps, strict=False)]
    whole = [(-inf, inf)]
    expected = [whole, [(-inf, -0.5), (0.2, inf)], whole, [(-inf, -0.2), (0.5, inf)], whole]
    for one, other in zip(sections, expected, strict=True):
        np.testing.assert_allclose(one, other)
    assert cells.size == 1
    assert cells.length == 1
    assert cells.ways == ((0,), (0, 1), (0,), (0, 1), (0,))
    assert Cells(past(box(0.2, 0.4, -7, 0.2))).size == 7


def test_gaps_are_between_their_edges():
    assert Gap((2.0, 4.0), (5.0, 9.0), (3.0, 1.0)).at(3.0) == (7.0, 2.0)
    assert Gap((2.0, 4.0), (-inf, -inf), (inf, inf)).at(3.0) == (-inf, inf)
    assert Gap((-2.0, 2.0), (-inf, -inf), (3.0, 7.0)).at(-1.0) == (-inf, 4.0)
    steep = Gap((0.1, 0.1 + 1e-12), (-0.3, 0.7), (inf, inf))
    assert steep.at(0.1)[0] == -0.3
    assert steep.at(0.1 + 1e-12)[0] == 0.7
    low, high = Gap((2.0, 4.0), (5.0, 9.0), (inf, inf)).at(np.array([2.0, 3.0, 4.0]))
    np.testing.assert_allclose(low, [5, 7, 9])
    assert high == inf


def test_lines_through_corners_and_walls():
    def through(corners, walls=()):
        return lines_through(corners, walls, 1.0, 1e-12)

    assert through([0.5, -0.2, 1.3, 0.2, 0.5]) == [0.0, 0.2, 0.5, 1.0]
    near = [0.3, 0.3 + 0.9e-12, 0.3 + 1.8e-12, 0.9e-12, 1 - 0.9e-12]
    assert through(near) == [0.0, 0.3, 0.3 + 1.8e-12, 1.0]
    assert through(near, [0.3 + 0.5e-12]) == [0.0, 0.3 + 0.5e-12, 0.3 + 1.8e-12, 1.0]
    walls = [0.4e-12, 0.3, 0.3 + 0.5e-12, 1 - 0.4e-12]  # each has its own, also at the ends
    assert through([0.3, 0.6], walls) == [0.0, *walls[:3], 0.6, walls[3], 1.0]


def test_rounding_errors_grow_with_the_way_and_with_where_it_is():
    near = Cells(past(box(0.2, 0.4, -0.1, 0.1), goal=pm.State(position=(4, 0))))
    assert near.grain == pytest.approx(4e-12 + 8 * math.ulp(4.0))
    for start in ((-1e6, 3), (3, -1e6)):
        there = np.array([[0.2, -0.1], [0.4, -0.1], [0.4, 0.1], [0.2, 0.1]]) + start
        ends = {"start": pm.State(position=start), "goal": pm.State(position=np.add(start, (4, 0)))}
        far = Cells(past(pm.Block(vertices=there), **ends))
        assert far.grain == pytest.approx(4e-12 + 8 * 2**-33, rel=1e-6)
    wide = Cells(past(box(0.2, 0.4, 1e4, 2e4), goal=pm.State(position=(4, 0))))
    assert (wide.size, wide.extent) == (400, 2e4)


def test_corners_are_moved_to_the_nearest_line():
    lines = np.array([0.0, 0.3, 0.6, 1.0])
    ring = np.array([[-0.1, 1], [0.1, 2], [0.4, 3], [0.46, 4], [0.3, 5], [0.9, 6], [1.2, 7], [0.42, 8]])
    np.testing.assert_array_equal(snapped(ring, lines)[:, 0], [-0.1, 0, 0.3, 0.6, 0.3, 1, 1.2, 0.3])
    np.testing.assert_array_equal(snapped(ring, lines)[:, 1], ring[:, 1])


def test_trapezoids_between_steep_edges_and_cut_ones():
    """A triangle that begins before the first line and ends behind the last, and a needle within a strip."""
    rings = [np.array([[-1.0, 0.0], [3.0, 0.0], [2.0, 6.0]]), np.array([[0.4, 6.0], [0.4 + 1e-12, 8.0], [0.4, 7.0]])]
    (first, thin, last) = trapezoids(edges_of(rings), np.array([0.0, 0.4, 0.4 + 1e-12, 2.0]))
    assert first == [Gap((0.0, 0.4), (-inf, -inf), (0, 0)), Gap((0.0, 0.4), (2.0, 2.8), (inf, inf))]
    assert [(gap.low[0], gap.high[0]) for gap in thin] == [(-inf, 0), (pytest.approx(2.8), 6), (7, inf)]
    assert [(gap.low[1], gap.high[1]) for gap in thin] == [(-inf, 0), (pytest.approx(2.8), 8), (8, inf)]
    assert [gap.at(2.0) for gap in last] == [(-inf, 0), (6, inf)]
    assert trapezoids(edges_of([]), np.array([0.0, 1.0])) == [[Gap((0.0, 1.0), (-inf, -inf), (inf, inf))]]


def displaced(offset, degrees, gap, **changes):
    """Over one box and under another through a slit, seen from far away and turned."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def there(x, y):
        return (offset[0] + c * x - s * y, offset[1] + s * x + c * y)

    def rectangle(low, high, **side):
        return pm.Block(vertices=[there(x, y) for x, y in ((0.4, low), (0.6, low), (0.6, high), (0.4, high))], **side)

    sides = changes.pop("sides", ("either", "either"))
    return pm.Maneuver(
        start=pm.State(position=there(0, 0)),
        goal=pm.State(position=there(1, 0)),
        duration=1.0,
        obstacles=[rectangle(-0.5, 0.1, side=sides[0]), rectangle(0.1 + gap, 0.9, side=sides[1])],
        **changes,
    )


@pytest.mark.parametrize("degrees", [0, 20, 40, 60, 75, 130, 250])
def test_a_slit_far_from_the_origin_stays_open(degrees):
    """The sides of turned boxes are off by rounding errors of where they stand: steep, and not to be drawn out."""
    for offset in ((0, 0), (1e4, 5e3), (3e5, -2e6), (-1e7, 1e7)):
        for gap in (0.01, 0.05):
            cells = Cells(displaced(offset, degrees, gap))
            for k, gaps in enumerate(cells.gaps[1:-1], start=1):
                x = 0.5 * (cells.lines[k] + cells.lines[k + 1])
                slit = [g for g, one in enumerate(gaps) if one.at(x)[0] < 0.1 + gap / 2 < one.at(x)[1]]
                assert set(slit) <= set(cells.ways[k])
                assert len(slit) == 1


@pytest.mark.parametrize("changes", [{}, {"margin": 0.01}, {"sides": ("left", "right")}][:: 1 if ALL else 2])
def test_the_peak_is_the_same_far_from_the_origin(changes):
    settings = pm.Settings(search=pm.GlobalSearch(gap=1e-4))
    here = pm.solve(displaced((0, 0), 40, 0.05, **changes), settings)
    for offset in ((1e4, 5e3), (3e5, -2e6)):
        there = pm.solve(displaced(offset, 40, 0.05, **changes), settings)
        assert there.status == here.status == "solved"
        assert there.lower_bound <= here.peak
        assert there.peak == pytest.approx(here.peak, rel=1e-3)


@pytest.mark.parametrize("s", [1e-9, 1e-12, 5e-13, 1e-7][:: 1 if ALL else 2])
def test_features_of_the_size_of_rounding_errors_close_nothing(s):
    """A side that leans by s, corners nearer than lines are kept apart, with something far away or without."""
    leaning = [(0.5, -1.2), (0.5 + 2.5 * s, -1.2), (0.5 + 2.5 * s, -1.0), (0.5 + 0.8 * s, 0.0), (0.5, 0.0)]
    blocks = [pm.Block(vertices=leaning, side="left"), box(0.75, 0.9, -1.2, 0.05, side="left")]
    far = pm.Block(vertices=[(0.5, -1e5), (0.51, -1e5), (0.51, -1.1e5), (0.5, -1.1e5)])
    for several in (blocks, [*blocks, far]):
        plan = pm.solve(past(*several))
        assert plan.status == "solved"
        assert plan.lower_bound < 4.20693
        assert plan.peak < 4.207


@pytest.mark.parametrize(
    "corners",
    [
        [(0.5, -0.5), (0.6, -0.5), (0.6, 0.1), (0.5 + 1.2e-12, 0.1), (0.5 + 0.6e-12, 0.0)],
        [(0.5, -0.5), (0.6, -0.5), (0.6, 0.1), (0.5 - 1.2e-12, 0.1), (0.5 - 0.6e-12, 0.0)],
    ],
)
def test_corners_nearer_than_lines_make_gaps_all_the_same(corners):
    plan = pm.solve(past(pm.Block(vertices=corners), box(0.2, 0.3, 3e10, 4e10)))
    assert plan.status == "solved"
    assert pm.verify(plan.to_json()).passed


@pytest.mark.parametrize("seed", range(12))
def test_points_are_in_a_gap_where_they_are_free(seed):
    """Random scenes, turned and displaced, sides left out: a point between start and goal is free or in no gap."""
    maneuver = scene(seed)
    maneuver = maneuver.model_copy(
        update={"obstacles": tuple(b.model_copy(update={"side": "either"}) for b in maneuver.blocks)}
    )
    cells, rng = Cells(maneuver), np.random.default_rng(seed)
    start, goal = np.array(maneuver.start.position), np.array(maneuver.goal.position)
    assert cells.length == pytest.approx(np.hypot(*(goal - start)))
    along = (goal - start) / np.hypot(*(goal - start))
    across = np.array([-along[1], along[0]])
    solid = shapely.union_all([shapely.Polygon(b.vertices).buffer(maneuver.margin) for b in maneuver.blocks])
    for _ in range(60):
        x, y = rng.uniform(0, cells.length), rng.normal() * 0.3 * cells.length
        k = int(np.searchsorted(cells.lines, x)) - 1
        gaps = [g for g, gap in enumerate(cells.gaps[k]) if gap.at(x)[0] <= y <= gap.at(x)[1]]
        distance = solid.boundary.distance(shapely.Point(start + x * along + y * across))
        if distance > 1e-3 * cells.length:
            assert len(gaps) == (0 if solid.contains(shapely.Point(start + x * along + y * across)) else 1)


@pytest.mark.parametrize(("side", "gaps"), [("left", [1]), ("right", [0]), ("either", [0, 1])])
def test_sides_leave_their_gaps(side, gaps):
    sections = [(-inf, -0.1), (0.3, inf)]
    cells = Cells(past(box(0.4, 0.6, -0.1, 0.3, side=side)))
    np.testing.assert_allclose([gap.at(0.5) for gap in cells.gaps[1]], [sections[g] for g in gaps])
    # as far as the margin reaches beyond its ends
    wide = Cells(past(box(0.4, 0.6, -0.1, 0.3, side=side), margin=0.05))
    assert len(wide.gaps[1]) == len(gaps)
    assert wide.lines[1] == pytest.approx(0.35)


def test_a_side_counts_for_other_gaps_too():
    """Below a block that is passed on the left no gap of another block is left."""
    cells = Cells(past(box(0.3, 0.5, 0.1, 0.3, side="left"), box(0.3, 0.5, -0.3, -0.1)))
    assert [gap.at(0.4)[0] for gap in cells.gaps[1]] == pytest.approx([0.3])
    cells = Cells(past(box(0.3, 0.5, 0.1, 0.3), box(0.3, 0.5, -0.3, -0.1, side="right")))
    assert [gap.at(0.4)[1] for gap in cells.gaps[1]] == pytest.approx([-0.3])


def test_corners_of_blocks_that_have_a_side_have_lines_within_others_too():
    for side, lines in (("left", [0, 0.3, 0.6, 0.65, 0.7, 1]), ("either", [0, 0.3, 0.7, 1])):
        cells = Cells(past(box(0.3, 0.7, -0.1, 0.5), box(0.6, 0.65, 0, 0.1, side=side)))
        np.testing.assert_allclose(cells.lines, lines)


def test_sides_count_beyond_a_pocket():
    """A gap within a block is on neither side of it."""
    for side, end in (("left", 0.5), ("right", -0.5)):
        cells = Cells(past(pm.Block(vertices=POCKET, side=side)))
        (gap,) = cells.gaps[1]
        assert end in gap.at(0.5)


def strip_of(low, high):
    return [(-0.5, low), (1.5, low), (1.5, high), (-0.5, high)]


@pytest.mark.parametrize(
    ("low", "high", "first", "second"),
    [
        (-0.6, 0.6, (0, 1), (0, 1)),
        (-0.4, 0.6, (1,), (0, 1)),  # below the first box it leaves the region
        (-0.6, 0.4, (0, 1), (0,)),
        (-0.4, 0.4, (1,), (0,)),
        (-0.5, 0.5, (0, 1), (0, 1)),  # on its edge a path keeps it
        (-0.5 + 1e-13, 0.5 - 1e-13, (0, 1), (0, 1)),  # and may, by what rounding errors may be
        (-0.5 + 1e-11, 0.5 - 1e-11, (1,), (0,)),
        (-0.4, 300, (1,), (0, 1)),
        (-300, 0.4, (0, 1), (0,)),
        (-0.1, 0.1, (0, 1), (0, 1)),  # where nothing is left all are given: `impossible` tells
    ],
)
def test_gaps_outside_of_the_region_are_no_ways(low, high, first, second):
    cells = Cells(TWO.model_copy(update={"region": tuple(strip_of(low, high))}))
    assert cells.ways == ((0,), first, (0,), second, (0,))
    assert [len(gaps) for gaps in cells.gaps] == [1, 2, 1, 2, 1]


@pytest.mark.parametrize("region", [False, True])
@pytest.mark.parametrize(("off", "second"), [(5e-10, (0, 1)), (2e-9, (0,))])
def test_a_region_is_off_by_rounding_errors_of_all_there_is(region, off, second):
    """Of a region that goes far back, or of a block that goes far down."""
    first = box(0.2, 0.4, -0.5 if region else -1e3, 0.2)
    back = 1e3 if region else 0.5
    corners = [(-back, -0.6), (1.5, -0.6), (1.5, 0.5 - off), (-back, 0.5 - off)]
    assert Cells(past(first, TWO.blocks[1], region=corners)).ways[3] == second


def test_a_gap_that_widens_into_the_region_is_a_way():
    """Its section in the middle of the strip is outside, one of its ends is not; a small block in a large region."""
    slope = pm.Block(vertices=[(0.2, -0.5), (0.8, -0.5), (0.8, 0.6), (0.2, 0.1)])
    assert Cells(past(slope, region=strip_of(-0.6, 0.11))).ways == ((0,), (0, 1), (0,))
    assert Cells(past(slope, region=strip_of(-0.6, 0.09))).ways == ((0,), (0,), (0,))
    assert Cells(past(slope, region=strip_of(-0.4, 0.11))).ways == ((0,), (1,), (0,))


@pytest.mark.parametrize("degrees", [0, 20, 40, 60, 75, 130, 250])
def test_a_slit_along_the_edge_of_a_region_far_from_the_origin_stays_open(degrees):
    """Its upper end is where the region's lower edge is."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    for offset in ((0, 0), (1e4, 5e3), (3e5, -2e6), (-1e7, 1e7)):
        for edge, open_there in ((0.15, True), (0.16, False)):
            corners = [(offset[0] + c * x - s * y, offset[1] + s * x + c * y) for x, y in strip_of(edge, 2.0)]
            cells = Cells(displaced(offset, degrees, 0.05).model_copy(update={"region": tuple(corners)}))
            k = len(cells.gaps) // 2
            assert (1 in cells.ways[k]) == open_there


def listed(plan):
    """A plan's tree as the list of its ends."""
    classes = plan.scene.classes

    def ends(branch, way):
        if branch.cut is None:
            return [ListedBranch(way, branch.looks, branch.leaves)]
        parts = classes.parts(classes.seen(way, branch.looks), branch.cut)
        pairs = zip(branch.children, parts, strict=True)
        return [end for child, part in pairs if child is not None for end in ends(child, part)]

    return ListedProof(tuple(ends(plan.proof.root, classes.cells.ways)))


def test_the_bound_knows_of_the_side_that_the_region_leaves():
    common = {"goal": pm.State(position=(2, 0)), "duration": 2.0}
    region = [(-0.2, -0.6), (2.2, -0.6), (2.2, 0.15), (-0.2, 0.15)]
    either, right = (
        pm.solve(
            past(box(0.9, 1.1, -0.3, 0.2, side=side), region=region, **common), pm.Settings(grid=pm.Aligned(steps=60))
        )
        for side in ("either", "right")
    )
    assert either.status == right.status == "solved"
    assert either.peak == pytest.approx(right.peak, rel=1e-6)
    assert either.lower_bound == pytest.approx(right.lower_bound, rel=1e-6)
    assert pm.verify(either.to_json()).passed
    free = pm.solve(past(box(0.9, 1.1, -0.3, 0.2), **common))
    assert free.lower_bound < 0.95 * either.lower_bound
    # a tree with a child for each gap of the one is not read as more than it is of the other
    one, other = (scene_of(plan.maneuver).classes for plan in (either, free))
    straight = pm.solve(wall_maneuver(obstacles=(), **common)).lower_bound
    assert free.proof.bound(one) == pytest.approx(straight, rel=1e-9)
    with pytest.raises(pm.SpecError, match="a leaf of the proof is of other walls"):
        pm.verify(dataclasses.replace(free, proof=either.proof).to_json())
    # as a list, the proof of the free one is one of a smaller bound for this one, too
    assert listed(free).bound(one) == pytest.approx(free.lower_bound, rel=1e-9)
    # but not the other way around
    assert listed(either).bound(other) == 0


@pytest.mark.parametrize("size", [1.0, 1e3])
def test_rounding_errors_are_those_of_the_size(size):
    """Half of a rounding error and two of them, of the scene's size; along the way, of the way's length."""
    tall = box(0.2, 0.4, -size, 0.3, side="left")
    cells = Cells(past(tall))
    assert cells.extent == size
    assert cells.size == min(size, 100)
    for off, allowed in ((5e-13 * size, True), (2e-12 * size, False)):
        assert cells._allowed(Gap((0.2, 0.4), (-inf, -inf), (0.3 - off, 0.3 - off))) == allowed
        low = Cells(past(box(0.2, 0.4, -size, 0.3, side="right")))
        assert low._allowed(Gap((0.2, 0.4), (-size + off, -size + off), (inf, inf))) == allowed
        short = off / size
        near = Cells(
            past(tall, box(0.4 + short, 0.6, -0.5, 0.2), box(1 - short, 1.2, 0.1, 0.2), box(-0.2, short, 0.1, 0.2))
        )
        assert len(near.lines) == (5 if allowed else 8)
        meeting = Cells(past(box(0.2, 0.4, -size, 0.1 + off), box(0.4, 0.6, 0.1, size)))
        assert ((1, 0) in meeting._met(1)) == allowed
        assert (cells.wall((0.2, 0.2 + short), 0.3).contact == "touch") == allowed
        beside = Cells(past(box(0.2, 0.4, -size, -0.3), box(0.2, 0.4, 0.2, 0.4)))
        assert (beside.maneuver_past(((0,), (1,), (0,)), [(0.3, 1)], lift=0.25 + off / 2) is not None) == allowed


def test_lines_closer_than_rounding_are_one():
    near = Cells(past(box(0.2, 0.4, -0.5, 0.2), box(0.4 + 1e-14, 0.6, -0.5, 0.2)))
    np.testing.assert_allclose(near.lines, [0, 0.2, 0.4, 0.6, 1])
    ends = Cells(past(box(0.5, 1 - 1e-14, 0.1, 0.2), box(1e-14, 0.3, 0.1, 0.2)))
    np.testing.assert_allclose(ends.lines, [0, 0.3, 0.5, 1], atol=1e-13)
    behind = Cells(past(box(-0.5, -0.2, 0.1, 0.2), box(1.2, 1.4, 0.1, 0.2), box(0.5, 0.6, 0.1, 0.2)))
    np.testing.assert_allclose(behind.lines, [0, 0.5, 0.6, 1])


def test_walls_have_a_line_of_their_own():
    wall = pm.Wall(tip=(0.7, 0.3), opening=0.4)
    cells = Cells(past(box(0.2, 0.4, -0.5, 0.2), wall))
    np.testing.assert_allclose(cells.lines, [0, 0.2, 0.4, 0.7, 1])
    assert cells.fixed == [(cells.lines[3], 2)]
    way = cells.ways
    np.testing.assert_allclose(cells.interval(way, (0.7, 2)), (0.3, 0.7))
    np.testing.assert_allclose(cells.interval(way, (0.7, 3)), (0.3, 0.7))
    assert cells.interval(way, (0.5, 2)) == (-inf, inf)
    hanging = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.7, 0.3), direction=(0, 2), opening=0.4)))
    np.testing.assert_allclose(hanging.interval(way, (0.7, 2)), (-0.1, 0.3))
    endless = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.7, 0.3), direction=(0, 2))))
    np.testing.assert_allclose(endless.interval(way, (0.7, 2)), (-inf, 0.3))
    short = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.7, 0.3), direction=(0, 0.5))))
    np.testing.assert_allclose(short.interval(way, (0.7, 2)), (-inf, 0.3))
    on_edge = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.4 + 1e-14, 0.1))))
    assert on_edge.fixed[0][0] in on_edge.lines
    assert len(on_edge.lines) == 4
    np.testing.assert_allclose(on_edge.interval(on_edge.ways, on_edge.fixed[0]), (0.2, inf))


@pytest.mark.parametrize(
    "wall",
    [
        pm.Wall(tip=(0.7, 0.3), direction=(1.5e-9, -1)),
        pm.Wall(tip=(0.7, 0.3), direction=(-1.5e-9, -1)),
        pm.Wall(tip=(0.7, 0.3), contact="touch"),
    ],
)
def test_walls_that_are_refused(wall):
    with pytest.raises(pm.SpecError):
        _ = Cells(past(box(0.2, 0.4, -0.5, 0.2), wall)).walls
    for x in (0.0, 1.0, 1.5, -0.5):
        with pytest.raises(pm.SpecError):
            _ = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(x, 0.3)))).walls
    for along in ((0.9e-9, -1), (1e-7, -1e3)):
        assert len(Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.7, 0.3), direction=along))).walls) == 1


def test_a_way_leads_through_gaps_that_meet_and_into_no_pocket():
    """A slit that leads into a pocket, open to the left only: no way but around the slit's walls."""
    cells = Cells(past(box(0.2, 0.4, -50, -0.1), box(0.2, 0.4, 0.1, 50), pm.Block(vertices=POCKET)))
    assert [len(gaps) for gaps in cells.gaps] == [1, 3, 3, 2, 1]
    assert cells.follow[1] == [frozenset({0, 2}), frozenset({1}), frozenset({0, 2})]
    assert cells.follow[2] == [frozenset({0, 1}), frozenset(), frozenset({0, 1})]
    assert cells.ways == ((0,), (0, 2), (0, 2), (0, 1), (0,))
    assert cells.through(((0,), (1,), (0, 1, 2), (0, 1), (0,))) is None
    assert cells.through(((0,), (0, 1), (1, 2), (1,), (0,))) == ((0,), (0,), (2,), (1,), (0,))
    assert cells.through(((0,), (), (0, 2), (0, 1), (0,))) is None


def test_corners_that_touch_meet_and_what_lies_behind_a_wall_does_not():
    meeting = Cells(past(box(0.2, 0.4, -50, 0.1), box(0.4, 0.6, 0.1, 50)))
    assert meeting._met(1) == [(0, 0), (1, 0), (1, 1)]
    assert meeting._met(0) == [(0, 0), (0, 1)]
    assert (1, 0) in Cells(past(box(0.2, 0.4, -1, 0.1 + 1e-13), box(0.4, 0.6, 0.1, 1)))._met(1)
    assert (1, 0) not in Cells(past(box(0.2, 0.4, -1, 0.1 + 1e-11), box(0.4, 0.6, 0.1, 1)))._met(1)
    blocked = Cells(past(box(0.2, 0.4, -0.5, 0.1), pm.Wall(tip=(0.4, 0.3), opening=0.1)))
    assert blocked.follow[1] == [frozenset(), frozenset({0})]


def test_the_hull_of_what_is_left_is_the_wall():
    cells = Cells(past(box(0.2, 0.4, -0.5, -0.3), box(0.2, 0.4, 0.2, 0.4)))
    assert cells.interval(((0,), (1,), (0,)), (0.3, 1)) == pytest.approx((-0.3, 0.2))
    assert cells.interval(((0,), (0, 1), (0,)), (0.3, 1)) == (-inf, pytest.approx(0.2))
    assert cells.interval(((0,), (1, 2), (0,)), (0.3, 1)) == (pytest.approx(-0.3), inf)


def test_lines_that_there_are():
    cells = Cells(TWO)
    for line, there in (
        ((0.3, 1), True),
        ((0.2, 1), True),
        ((0.4, 1), True),
        ((0.4, 2), True),
        ((0.41, 1), False),
        ((0.19, 1), False),
        ((0.0, 0), False),
        ((1.0, 4), False),
        ((0.9, 4), True),
        ((0.1, 0), True),
        ((0.9, 5), False),
        ((0.1, -1), False),
    ):
        assert cells.has(line) == there


TURNED = scene(1)


@pytest.mark.parametrize("maneuver", [TWO, TURNED], ids=["boxes", "turned"])
@pytest.mark.parametrize("interval", [(-0.3, 0.2), (-inf, 0.2), (-0.3, inf)])
def test_walls_leave_their_interval_free(maneuver, interval):
    cells = Cells(maneuver)
    wall = cells.wall(interval, 0.25 * cells.length)
    low, high = interval
    frame = cells.frame
    tip, along = frame.position(wall.tip), frame.vector(wall.direction)
    assert tip[0] == pytest.approx(0.25 * cells.length)
    assert tip[1] == pytest.approx(low if math.isfinite(low) else high)
    np.testing.assert_allclose(along, (0, -1 if math.isfinite(low) else 1), atol=1e-12)
    assert wall.opening == (pytest.approx(high - low) if math.isfinite(high - low) else None)
    assert wall.contact == "clear"


def test_walls_of_no_width_and_of_no_end():
    cells = Cells(TWO)
    assert cells.wall((-inf, inf), 0.3) is None
    point = cells.wall((0.2, 0.2), 0.3)
    assert (point.contact, point.opening) == ("touch", None)
    assert cells.wall((0.2, 0.2 + 1e-13), 0.3).contact == "touch"
    assert cells.wall((0.2, 0.2 + 1e-11), 0.3).opening == pytest.approx(1e-11, rel=1e-4)


def test_maneuvers_past_the_lines_of_a_way():
    cells = Cells(TWO)
    way = ((0,), (1,), (0,), (0,), (0,))
    lines = [(0.7, 3), (0.4, 1), (0.5, 2)]
    past_ = cells.maneuver_past(way, lines)
    assert [wall.tip for wall in past_.walls] == [pytest.approx((0.4, 0.2)), pytest.approx((0.7, -0.2))]
    assert cells.marks(way, lines) == [(0.4, 1), (0.7, 3)]
    lifted = cells.maneuver_past(way, lines, lift=0.01)
    assert [wall.tip for wall in lifted.walls] == [pytest.approx((0.4, 0.21)), pytest.approx((0.7, -0.21))]
    beside = Cells(past(box(0.2, 0.4, -0.5, -0.3), box(0.2, 0.4, 0.2, 0.4)))
    narrow = ((0,), (1,), (0,))
    (wall,) = beside.maneuver_past(narrow, [(0.3, 1)], lift=0.2).walls
    assert wall.opening == pytest.approx(0.1)
    assert beside.maneuver_past(narrow, [(0.3, 1)], lift=0.3) is None
    (wall,) = beside.maneuver_past(narrow, [(0.3, 1)], lift=0.25).walls
    assert wall.contact == "touch"
    point = Cells(past(box(0.2, 0.4, -50, 0.1), box(0.2, 0.4, 0.1 + 1e-13, 50)))
    gap = (
        next(g for g, one in enumerate(point.gaps[1]) if math.isfinite(sum(one.at(0.3))))
        if len(point.gaps[1]) == 3
        else None
    )
    if gap is not None:
        assert point.maneuver_past(((0,), (gap,), (0,)), [(0.3, 1)], lift=0.01).walls[0].contact == "touch"
    ruled = Cells(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.7, 0.3))))
    both = ruled.maneuver_past(((0,), (1,), (0,), (0,)), [(0.3, 1)]).walls
    assert [wall.tip[0] for wall in both] == pytest.approx([0.3, 0.7])
    assert len(ruled.marks(((0,), (1,), (0,), (0,)), [(0.3, 1)])) == 2


# ---- the proof


def proof_of(cells, way, lines):
    mass = PointMass.of(cells.maneuver_past(way, lines))
    q = mass.walls
    times = (np.arange(q) + 1) / (q + 1)
    leaf = Leaf((0.0,) * q, (1.0,) * q, extremal(mass, times).multipliers, tuple(times))
    return ListedBranch(way, tuple(lines), (leaf,))


def test_a_branch_bounds_its_way_in_its_units():
    maneuver = past(box(0.4, 0.6, -0.1, 0.3), duration=2.0)
    classes = scene_of(maneuver).classes
    cells = classes.cells
    over = proof_of(cells, ((0,), (1,), (0,)), [(0.5, 1)])
    assert over.bound(cells) == pytest.approx(
        pm.solve(wall_maneuver(duration=2.0, obstacles=(pm.Wall(tip=(0.5, 0.3)),))).lower_bound, rel=1e-4
    )
    assert ListedBranch(((0,), (), (0,)), (), ()).bound(cells) == inf
    assert ListedBranch(over.way, over.lines, ()).bound(cells) == 0
    under = proof_of(cells, ((0,), (0,), (0,)), [(0.5, 1)])
    assert 0 < under.bound(cells) < over.bound(cells)
    assert ListedProof((over, under)).bound(classes) == under.bound(cells)
    assert (
        ListedProof((over,)).bound(classes)
        == ListedProof((under,)).bound(classes)
        == ListedProof(()).bound(classes)
        == 0
    )
    closed = scene_of(past(box(0.4, 0.6, 0.1, 0.3, side="left"), box(0.4, 0.6, -0.3, -0.1, side="right"))).classes
    assert ListedProof(()).bound(closed) == 0
    empty = ListedBranch(((0,), (), (0,)), (), ())
    assert ListedProof((empty, under, over)).bound(classes) == under.bound(cells)
    assert ListedProof((empty,)).bound(closed) == 0


def test_classes_fall_into_one_for_each_gap_of_a_strip():
    classes = scene_of(TWO).classes
    way, lines = classes.cells.ways, ((0.3, 1),)
    one = WayClass(way, lines)
    assert classes.first == (way, ())
    assert classes.seen(way, lines) == one
    assert classes.seen(None, lines) is None
    assert [classes.splits(one, cut) for cut in (-1, 0, 4, 5, 6)] == [False, True, True, False, False]
    assert classes.parts(one, 1) == [((0,), (gap,), (0,), (0, 1), (0,)) for gap in (0, 1)]
    assert classes.parts(one, 3) == [((0,), (0, 1), (0,), (gap,), (0,)) for gap in (0, 1)]
    assert classes.parts(one, 0) == [way]
    (wall,) = classes.past(WayClass(classes.parts(one, 1)[1], lines), lift=0.01).walls
    assert wall.tip == pytest.approx((0.3, 0.21))
    assert classes.past(one).walls == ()


def test_parts_that_no_path_falls_into_are_empty():
    classes = scene_of(past(box(0.2, 0.4, -0.5, 0.2), pm.Wall(tip=(0.3, 0.3)))).classes
    assert classes.empty(None)
    below, above = ((0,), (0,), (0,), (0,)), ((0,), (1,), (1,), (0,))
    assert classes.empty(below)  # the wall stands on the gap
    assert not classes.empty(above)
    assert classes.parts(WayClass(((0,), (0, 1), (0, 1), (0,)), ()), 1) == [None, ((0,), (1,), (0, 1), (0,))]


def test_a_tree_of_no_way_at_all_proves_nothing():
    closed = scene_of(past(box(0.4, 0.6, 0.1, 0.3, side="left"), box(0.4, 0.6, -0.3, -0.1, side="right"))).classes
    assert closed.cells.ways is None
    assert BlockProof(Branch((), ())).bound(closed) == 0
    assert BlockProof(Branch((), ())).bound(scene_of(TWO).classes) == 0


@pytest.mark.parametrize("seed", range(20))
def test_ways_are_covered_where_each_single_one_is(seed):
    rng = np.random.default_rng(seed)
    cells = Cells(
        TWO
        if seed % 2
        else past(box(0.2, 0.4, 0.1, 0.2), box(0.2, 0.4, -0.2, 0), box(0.5, 0.6, 0.1, 0.2), box(0.5, 0.6, -0.3, 0))
    )
    singles = list(itertools.product(*cells.ways))
    ways = [
        tuple(tuple(g for g in gaps if rng.random() < 0.7) or gaps[:1] for gaps in cells.ways)
        for _ in range(1 + seed % 5)
    ]
    true = all(any(all(g in gaps for g, gaps in zip(one, way, strict=True)) for way in ways) for one in singles)
    assert covered(cells, ways, cells.ways) == true
    apart = [tuple((g,) for g in one) for one in singles]
    rng.shuffle(apart)
    apart = [tuple(map(tuple, way)) for way in apart]
    assert covered(cells, apart, cells.ways)
    assert not covered(cells, apart[1:], cells.ways)
    assert covered(cells, [cells.ways], cells.ways)
    assert covered(cells, [], None)
    assert not covered(cells, [], cells.ways)


# ---- obstacles


def test_rays_of_walls():
    ((tip, along),) = pm.Wall(tip=(1, 2), direction=(3, -4)).rays
    np.testing.assert_allclose((*tip, *along), (1, 2, 0.6, -0.8))
    _, (tip, along) = pm.Wall(tip=(1, 2), direction=(3, -4), opening=10.0).rays
    np.testing.assert_allclose((*tip, *along), (-5, 10, -0.6, 0.8))
    for wrong in ({"direction": (0, 0)}, {"direction": (1e-151, 0)}, {"contact": "touch", "opening": 1.0}):
        with pytest.raises(ValueError, match="must"):
            pm.Wall(tip=(0, 0), **wrong)
    assert pm.Wall(tip=(0, 0), opening=1.0).contact == "clear"
    assert pm.Wall(tip=(0, 0), contact="touch").opening is None


SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))
ELL = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))


def test_corners_of_blocks():
    assert pm.Block(vertices=(*SQUARE, SQUARE[0])).vertices == SQUARE
    assert pm.Block(vertices=(SQUARE[0], *SQUARE[2:])).vertices == (SQUARE[0], *SQUARE[2:])
    for wrong, words in (
        ((*SQUARE[:2], *SQUARE[1:]), r"vertices\[2\] does not"),
        ((SQUARE[0], SQUARE[1], SQUARE[0]), "differ"),
        ((SQUARE[0], SQUARE[0], SQUARE[1], SQUARE[2]), r"vertices\[1\] does not"),
        (((0, 0), (1, 1), (1, 0), (0, 1)), "without crossing"),
        (((0, 0), (1, 1), (2, 2)), "area"),
    ):
        with pytest.raises(ValueError, match=words):
            pm.Block(vertices=wrong)


def test_grown_blocks_are_the_margin_from_their_edges_and_never_more():
    block = pm.Block(vertices=ELL)
    ((corners),) = block.grown(0)
    np.testing.assert_allclose(corners, pm.Block(vertices=ELL).vertices)
    (grown,) = block.grown(0.1)
    polygon = shapely.Polygon(block.vertices)
    far = shapely.distance(polygon, shapely.points(grown))
    assert np.all(far <= 0.1 + 1e-12)
    assert shapely.Polygon(grown).area == pytest.approx(polygon.buffer(0.1, quad_segs=500).area, rel=2e-5)
    ring = pm.Block(vertices=[(0, 0), (3, 0), (3, 3), (0, 3), (0, 1.05), (1, 1.05), (1, 2), (2, 2), (2, 1), (0, 0.95)])
    outer, hole = ring.grown(0.06)
    assert shapely.Polygon(outer).contains(shapely.Polygon(hole))


@pytest.mark.parametrize("across", [(0.0, 1.0), (0.6, -0.8)])
def test_shadows_are_all_that_lies_behind(across):
    block, rng = pm.Block(vertices=ELL), np.random.default_rng(0)
    across = np.array(across)
    shadow = shapely.Polygon(block.shadow(0.1, across, 7.0))
    grown = shapely.Polygon(block.grown(0.1)[0])
    for point in rng.uniform(-9, 9, (400, 2)):
        behind = shapely.LineString([point, point - 7 * across])
        if abs(grown.distance(behind)) > 1e-9 or grown.intersects(behind):
            assert shadow.contains(shapely.Point(point)) == grown.intersects(behind)


def test_points_that_a_block_holds():
    block = pm.Block(vertices=SQUARE)
    for point, margin, held in (
        ((0.5, 0.5), 0.0, True),
        ((1.2, 0.5), 0.0, False),
        ((1.2, 0.5), 0.3, True),
        ((1.2, 0.5), 0.1, False),
        ((1.0, 0.5), 0.0, False),
        ((1.2, 0.5), 0.2 * (1 + 1e-14), False),
        ((1.2, 0.5), 0.2 * (1 + 1.5e-12), True),
        ((1.2, 0.5), 0.2 * (1 + 0.5e-12), False),
    ):
        assert block.holds(point, margin) == held


def test_convex_regions():
    assert convex(SQUARE) == SQUARE
    assert convex(SQUARE[::-1]) == SQUARE
    small = tuple((0.1 * x, 0.1 * y) for x, y in SQUARE)
    assert convex(small) == small
    flat = ((0, 0), (0.5, 0), (1, 0), (1, 1), (0, 1))
    assert convex(flat) == flat
    assert convex(flat[::-1]) == flat
    for wrong in (ELL, ELL[::-1]):
        with pytest.raises(ValueError, match="convex"):
            convex(wrong)
    assert covers(SQUARE, (1, 0.5))
    assert not covers(SQUARE, (1.1, 0.5))


def test_what_kind_an_obstacle_is():
    data = {"start": {"position": [0, 0]}, "goal": {"position": [1, 0]}, "duration": 1.0}
    maneuver = pm.Maneuver(**data, obstacles=[{"tip": [0.5, 0.5]}])
    assert isinstance(maneuver.obstacles[0], pm.Wall)
    with pytest.raises(pm.SpecError):
        pm.Maneuver(**data, obstacles=[3])


# margins

DENTED = [(0, 5), (-0.4, 0.16), (0, 0), (0, 0.0098), (2, 0), (6, 1), (6, -12), (1.5, -12), (0.18, -1.995), (-1, -12), (-1, -13), (8, -13), (8, 5)]  # fmt: skip


@pytest.mark.parametrize("first", range(len(DENTED)))
@pytest.mark.parametrize("turned", [1, -1])
def test_margins_of_dented_blocks_are_never_too_large(first, turned):
    """A shallow dent is not filled on the way: shapely's buffer of this polygon is 0.9 % too large."""
    corners = (DENTED[first:] + DENTED[:first])[::turned]
    block = pm.Block(vertices=corners)
    polygon = shapely.Polygon(corners)
    for margin in (0.01, 0.3, 1.0, 3.0):
        # all along each edge, however short: what spans a dent is furthest from the corners
        ring = block.grown(margin)[0]
        edges = np.roll(ring, -1, axis=0) - ring
        points = shapely.points(ring + np.linspace(0, 1, 31)[:, None, None] * edges)
        assert np.max(shapely.distance(polygon, points)) <= margin * (1 + 1e-12)
        assert shapely.Polygon(ring).area > polygon.buffer(margin * 0.998).area
        seen = shapely.Polygon(block.grown(margin, (3.0, -7.0))[0] + np.array([3.0, -7.0]))
        assert seen.symmetric_difference(shapely.Polygon(ring)).area < 1e-9
    assert shapely.Polygon(block.grown(0.0)[0]).equals(polygon)


@pytest.mark.parametrize("tip", [-0.2, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("left", [0.4, 0.5])
def test_a_wall_on_the_line_of_a_block(tip, left):
    """A gap that the wall closes on the very line where they meet has no path: that is its proof, and no fault."""
    block = pm.Block(vertices=[(left, 0.2), (0.7, 0.2), (0.7, 0.4), (left, 0.4)])
    start, goal = pm.State(position=(0, 0)), pm.State(position=(1, 0))
    plan = pm.solve(pm.Maneuver(start=start, goal=goal, duration=1.0, obstacles=[pm.Wall(tip=(0.5, tip)), block]))
    assert plan.status == "solved"
    assert plan.lower_bound >= 0.99 * plan.peak
    assert pm.verify(plan.to_json()).passed
