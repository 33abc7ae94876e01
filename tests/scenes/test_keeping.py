"""What a path keeps: region and speed in closed form and by chords, what is closed beside blocks, and the verdict."""

import math

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.geometry.clearance import block_clearance
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.scenes.kept import (
    Keeping,
    _far,
    closed_behind,
    extent,
    inward,
    keeping,
    kept,
    least_clearance,
    verdict,
    wall_clearances,
)
from tests.conftest import wall_maneuver
from tests.geometry.test_clearance import hold, random_motion


class Opaque:
    """A motion that shows no more than every trajectory does."""

    def __init__(self, motion):
        self.nodes, self.position, self.velocity, self.peak = (
            motion.nodes,
            motion.position,
            motion.velocity,
            motion.peak,
        )


both = pytest.mark.parametrize("wrap", [lambda m: m, Opaque], ids=["exact", "chords"])
REGION = np.array([(-1.0, -2.0), (3.0, -1.0), (2.0, 2.0), (-2.0, 1.5)])
FREE = wall_maneuver(obstacles=())


def numbers(motion, **fields):
    """What a motion keeps where nothing but these fields is asked."""
    return keeping(FREE.model_copy(update=fields), motion)


@both
@pytest.mark.parametrize("seed", range(20))
def test_the_region_is_as_near_as_it_is(seed, wrap):
    """Each edge's line against the least height of each parabola above it, sampled finely."""
    motion = random_motion(np.random.default_rng(seed), holds=5)
    normals, offsets = inward(REGION)
    np.testing.assert_allclose(np.hypot(*normals.T), 1)
    r = motion.position(np.linspace(0, motion.nodes[-1], 200_001))
    seen = float(np.min(r @ normals.T - offsets))
    fastest = float(np.max(np.hypot(*motion.velocity(motion.nodes).T)))
    found = numbers(wrap(motion), region=tuple(map(tuple, REGION.tolist())))
    peak = motion.peak()
    step = motion.nodes[-1] / 200_000
    assert seen - 2e-8 * (1 + peak) * (1 + motion.nodes[-1] ** 2) - fastest * step <= found.region <= seen + 1e-12


def test_the_region_is_met_between_the_nodes():
    """y = 0.5 - t + t^2 falls to 0.25 halfway; the edge is at 0.3, then at 0.2."""
    motion = hold((0, 0.5), (1, -1), (0, 2))
    for level in (0.3, 0.2):
        region = ((-9.0, level), (9.0, level), (9.0, 9.0), (-9.0, 9.0))
        assert numbers(motion, region=region).region == pytest.approx(0.25 - level, abs=1e-14)
        by_chords = numbers(Opaque(motion), region=region).region
        assert 0.25 - level - 1e-8 <= by_chords <= 0.25 - level
    turning = hold((0, 0.5), (1, 1), (0, 2))  # rises all the time: least at its start
    assert numbers(turning, region=((-9.0, 0.0), (9.0, 0.0), (9.0, 9.0), (-9.0, 9.0))).region == 0.5
    late = hold((0, 0.5), (1, -4), (0, 2))  # still falling at its end
    assert numbers(late, region=((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0))).region == pytest.approx(6.5)
    assert numbers(late).region == math.inf


@both
def test_the_largest_speed(wrap):
    motion = wrap(hold((0, 0), (3, 4), (0, -8), (-6, 8), dt=1.0))  # (3, 4), (3, -4), (-3, 4)
    found = numbers(motion, max_speed=5.0).speed
    assert 5 <= found <= 5 + 1e-3
    slow_in_between = wrap(hold((0, 0), (3, 0), (-6, 0)))
    assert 3 <= numbers(slow_in_between, max_speed=1.0).speed <= 3 + 1e-3
    assert numbers(motion).speed == 0
    assert numbers(hold((0, 0), (3, 4), (0, -8), (-6, 8)), max_speed=5.0).speed == 5
    late = HoldTrajectory(np.array([0, 0.500025, 1]), np.array([[10.0, 0], [-10, 0]]), np.zeros(2), np.zeros(2))
    assert numbers(wrap(late), max_speed=5.0).speed >= 5.00025 * (1 - 1e-12)  # between the times that chords look at
    swift = wrap(hold((0, 0), (0, 0), (10, 0), (-10, 0)))
    assert 10 <= numbers(swift, max_speed=1.0).speed <= 10 + 2e-3


def test_speeds_between_the_times_that_are_looked_at_are_charged():
    rng = np.random.default_rng(0)
    for _ in range(20):
        motion = random_motion(rng, holds=3)
        exact = float(np.max(np.hypot(*motion.velocity(motion.nodes).T)))
        assert exact <= numbers(Opaque(motion), max_speed=1.0).speed <= exact * (1 + 1e-9) + motion.peak() * 1e-4


def test_the_verdict():
    base = {"clearance": 1.0, "each_wall": {0: 0.0}, "blocks": 0.0, "region": 0.0, "speed": 2.0}
    asked = wall_maneuver(
        obstacles=(pm.Wall(tip=(0.5, -3)), pm.Block(vertices=[(5, 5), (6, 5), (6, 4)])),
        max_speed=2.0,
        region=[(-9, -9), (9, -9), (9, 9), (-9, 9)],
    )
    assert extent(asked) == 6
    assert extent(wall_maneuver(start=pm.State(position=(0.5, -1)), obstacles=(pm.Wall(tip=(0.5, -3)),))) == 2
    assert extent(wall_maneuver(goal=pm.State(position=(0, 0)), obstacles=())) == 1
    for change, passes in (
        ({}, True),
        ({"each_wall": {0: -1e-15}}, False),
        ({"blocks": -1e-15}, False),
        ({"each_wall": {0: math.nan}}, False),
        ({"blocks": math.nan}, False),
        ({"region": -8e-12}, True),
        ({"region": -1e-11}, False),
        ({"region": math.nan}, False),
        ({"speed": 2 * (1 + 5e-13)}, True),
        ({"speed": 2 * (1 + 2e-12)}, False),
        ({"speed": math.nan}, False),
        ({"clearance": -1.0}, True),
    ):
        assert verdict(asked, Keeping(**(base | change))).passed == passes
    assert verdict(asked.model_copy(update={"max_speed": None}), Keeping(**(base | {"speed": 1e9}))).passed


def box(left, right, low, high, side="either"):
    return pm.Block(vertices=[(left, low), (right, low), (right, high), (left, high)], side=side)


def holds_points(maneuver, *points):
    closed = [shapely.Polygon(corners) for corners in closed_behind(maneuver, 1e3 * extent(maneuver))]
    return [any(polygon.contains(shapely.Point(point)) for polygon in closed) for point in points]


@pytest.mark.parametrize(("angle", "unit", "shift"), [(0.0, 1.0, 0.0), (2.1, 0.01, 0.0), (2.1, 100.0, -0.5)])
def test_what_lies_behind_a_block_with_a_side_is_closed_between_start_and_goal(angle, unit, shift):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, s], [-s, c]])

    def at(*points):
        return [tuple(point) for point in (unit * (np.array(points) + np.array([shift, 0.0])) @ turn).tolist()]

    def scene(*blocks, **fields):
        turned = [pm.Block(vertices=at(*one.vertices), side=one.side) for one in blocks]
        start, goal = (pm.State(position=end) for end in at((0, 0), (1, 0)))
        return wall_maneuver(start=start, goal=goal, obstacles=turned, **fields)

    left = scene(box(0.4, 0.6, -0.2, 0.1, "left"))
    assert holds_points(left, *at((0.5, -0.3), (0.5, -500), (0.5, 0.2), (0.3, -0.3), (0.7, -0.3))) == [
        True, True, False, False, False,
    ]  # fmt: skip
    right = scene(box(0.4, 0.6, -0.2, 0.1, "right"))
    assert holds_points(right, *at((0.5, 0.3), (0.5, 500), (0.5, -0.3), (0.3, 0.3))) == [True, True, False, False]
    assert closed_behind(scene(box(0.4, 0.6, -0.2, 0.1)), 1e3 * unit) == ()
    wide = scene(box(0.4, 0.6, -0.2, 0.1, "left"), margin=0.05 * unit)
    assert holds_points(wide, *at((0.36, -0.3), (0.34, -0.3), (0.5, 0.13), (0.5, 0.16))) == [True, False, True, False]
    # no further than start and goal
    over = scene(box(-0.4, 0.6, -0.2, -0.1, "left"), box(0.9, 1.4, -0.2, -0.1, "left"))
    assert holds_points(over, *at((-0.1, -5), (0.1, -5), (0.95, -5), (1.1, -5))) == [False, True, True, False]


@both
def test_a_start_and_a_goal_behind_a_block_are_beside_what_is_closed(wrap):
    """Above a block that is passed below: away from the way one may go, along it not."""
    ends = {"start": pm.State(position=(5, 3)), "goal": pm.State(position=(6, 3))}
    for place, away in (((5, 3), -1), ((6, 3), 1)):
        x = place[0]
        asked = wall_maneuver(obstacles=[box(x - 0.1, x + 0.1, 2.7, 2.95, "right")], **ends)
        assert keeping(asked, wrap(hold(place, (away, 0), (0, 0)))).blocks == pytest.approx(1e-7, rel=0.1)
        assert keeping(asked, wrap(hold(place, (-away, 0), (0, 0)))).blocks < -1e-3


@both
@pytest.mark.parametrize("block", [(2e-8, 8e-8), (-1, 5e-8), (1 - 8e-8, 1 - 2e-8), (1 - 5e-8, 2)])
def test_blocks_that_end_near_start_or_goal_are_passed_on_their_side(wrap, block):
    """Nothing is left out of what is closed behind those that reach no further."""
    asked = wall_maneuver(obstacles=[box(*block, 0.1, 0.3, "left")])
    found = keeping(asked, wrap(hold((0, 0), (1, 0), (0, 0))))
    assert -4e-8 < found.blocks < -1e-8
    assert not verdict(asked, found).passed


@both
@pytest.mark.parametrize(("block", "deep"), [((2e-8, 3e-7), 1.4e-7), ((-1, 3e-7), 1e-7)])
def test_only_who_starts_behind_a_block_is_left_out(wrap, block, deep):
    """In the middle of what is closed, which begins with the block, or a little behind the start."""
    for left, right in (block, (1 - block[1], 1 - block[0])):
        asked = wall_maneuver(obstacles=[box(left, right, 0.1, 0.3, "left")])
        assert keeping(asked, wrap(hold((0, 0), (1, 0), (0, 0)))).blocks == pytest.approx(-deep, rel=0.1)


@pytest.mark.parametrize("speed", [20.0, 2e4, 2e7])
def test_what_is_behind_a_block_is_closed_however_far_away(speed):
    asked = wall_maneuver(obstacles=[box(0.4, 0.6, -0.2, 0.2, "left")])
    below = hold((0, 0), (1, -speed), (0, 2 * speed))
    assert keeping(asked, below).blocks < -0.09
    assert keeping(asked, Opaque(below)).blocks < -0.09
    above = hold((0, 0), (1, speed), (0, -2 * speed))
    assert kept(asked, above).passed
    assert 0.5 * speed <= _far(asked, below) < max(2e3, 4 * speed)
    wide = wall_maneuver(goal=pm.State(position=(50, 0)), obstacles=asked.blocks)
    assert _far(wide, hold((0, 0), (50, 0), (0, 0))) == 5e4


def test_where_blocks_meet_is_closed():
    pair = wall_maneuver(obstacles=[box(0.4, 0.6, -2, 0.1), box(0.4, 0.6, 0.1, 2)])
    assert holds_points(pair, (0.5, 0.1), (0.5, -1), (0.7, 0.1)) == [True, True, False]
    through = hold((0, 0.1), (1, 0), (0, 0), (0, 0))  # along the joint: clear of each block, not of both
    assert keeping(pair, through).walls == math.inf
    assert keeping(pair, through).blocks == pytest.approx(-0.1)
    assert keeping(pair, through).clearance == 0
    apart = wall_maneuver(obstacles=[box(0.4, 0.6, -2, 0.05), box(0.4, 0.6, 0.15, 2)])
    assert closed_behind(apart, 1e3) == ()
    assert keeping(apart, through).blocks == pytest.approx(0.05)
    near = apart.model_copy(update={"margin": 0.06})
    assert keeping(near, through).blocks == pytest.approx(-0.1 - math.sqrt(0.06**2 - 0.05**2), abs=1e-4)
    assert closed_behind(wall_maneuver(goal=pm.State(position=(0, 0)), obstacles=pair.blocks), 1e3) == ()
    # a ring leaves its inside open
    ring = [box(0, 1, 0, 0.1), box(0, 1, 0.9, 1), box(0, 0.1, 0.05, 0.95), box(0.9, 1, 0.05, 0.95)]
    assert holds_points(wall_maneuver(start=pm.State(position=(-1, 0)), obstacles=ring), (0.5, 0.5)) == [False]


def test_distances_of_walls_openings_and_blocks():
    through = hold((0, 0.2), (1, 0), (0, 0))
    slit = wall_maneuver(obstacles=[pm.Wall(tip=(0.5, 0.1), opening=0.3)])
    assert keeping(slit, through).walls == pytest.approx(0.1)
    assert keeping(slit, hold((0, 0.35), (1, 0), (0, 0))).walls == pytest.approx(0.05)
    assert keeping(slit, hold((0, 0.5), (1, 0), (0, 0))).walls == pytest.approx(-0.1)
    both = wall_maneuver(obstacles=[pm.Wall(tip=(0.3, 0.1)), box(0.2, 0.3, 2, 3), pm.Wall(tip=(0.6, 0.15))])
    assert keeping(both, through).walls == pytest.approx(0.05)
    assert wall_clearances(both, through) == pytest.approx({0: 0.1, 2: 0.05})
    mixed = wall_maneuver(obstacles=[pm.Wall(tip=(0.5, 0.1)), box(0.2, 0.3, 0.25, 0.4)], margin=0.02)
    found = keeping(mixed, through)
    assert (found.walls, found.blocks, found.clearance) == pytest.approx((0.1, 0.03, 0.05))
    # within a billionth of the scene's size a crossing is at the tip
    for size in (1.0, 50.0):
        goal, across = pm.State(position=(size, 0)), hold((0, 0.2), (size, 0), (0, 0))
        for below, touches in ((0.9e-9, True), (1.1e-9, False)):
            asked = wall_maneuver(goal=goal, obstacles=[pm.Wall(tip=(0.5, 0.2 + below * size))])
            assert (keeping(asked, across).walls == 0) == touches


def beside(motion, t, gap, wide=0.01):
    """A spike with its tip at a distance from the path at t, on its left."""
    v = motion.velocity(t) / np.hypot(*motion.velocity(t))
    normal = np.array([-v[1], v[0]])
    tip = motion.position(t) + gap * normal
    return np.array([tip, tip + 0.3 * normal + wide * v, tip + 0.3 * normal - wide * v])


@pytest.mark.parametrize("seed", range(60))
def test_none_that_is_nearest_is_left_out(seed):
    """Spikes and long boxes beside paths in unequal holds, at distances of the order of what the path moves at a time."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        motion = HoldTrajectory(np.array([0, 0.01, 1.0]), np.zeros((2, 2)), np.zeros(2), np.array([60.0, 0]))
    else:
        motion = random_motion(rng, holds=4)
    blocks = []
    for t in rng.uniform(0.02, 0.98, 8) * motion.nodes[-1]:
        moved = np.hypot(*motion.velocity(t)) * motion.nodes[-1] / 64
        blocks.append(beside(motion, t, abs(rng.normal()) * rng.choice([0.01, 0.1, 0.5]) * moved))
    if seed % 4 == 1:  # along the straight path
        blocks += [np.array([(5, -y), (50, -y), (50, -y - 40), (5, -y - 40)]) for y in rng.uniform(0.001, 0.5, 3)]
        blocks += [
            np.array([(60, -30), (61, -30), (61, 30), (60, 30)]) + np.array([y, 0]) for y in rng.uniform(0.001, 0.5, 3)
        ]
    every = [block_clearance(motion, block) for block in blocks]
    assert least_clearance(motion, blocks) == min(every)


def test_what_bulges_between_the_times_looked_at_is_nearest():
    """Up and down again within each of 64 holds: at the nodes the path is always back."""
    dt, push = 1 / 64, 100.0
    control = np.array([[0, push], [0, -push]] * 32)
    motion = HoldTrajectory(dt * np.arange(65), control, np.zeros(2), np.array([1e-3, -push * dt / 2]))
    bulge = push * dt**2 / 8
    gap = bulge
    above = np.array([(-1, bulge + gap), (1, bulge + gap), (1, 5), (-1, 5)])
    first = gap + 0.3 * bulge
    before = np.array([(-first, 0), (-first - 1, 0.01), (-first - 1, -0.01)])
    assert block_clearance(motion, before) == pytest.approx(first)
    assert least_clearance(motion, [above, before]) == pytest.approx(gap)


def test_room_at_the_region_s_edge_is_of_what_is_seen_from_the_start():
    asked = wall_maneuver(
        start=pm.State(position=(9, 9)),
        goal=pm.State(position=(8, 8)),
        obstacles=(),
        region=[(0, 0), (9, 0), (9, 9), (0, 9)],
    )
    for outside, passes in ((8e-12, True), (1.2e-11, False)):
        assert verdict(asked, Keeping(1.0, {}, 0.0, -outside, 0.0)).passed == passes


def test_a_verdict_says_by_how_much():
    """The amounts that advice is made of, each of its own."""
    asked = wall_maneuver(max_speed=2.0, region=[(-1, -1), (2, -1), (2, 1), (-1, 1)])
    found = Keeping(clearance=-0.3, each_wall={0: -0.1}, blocks=-0.2, region=-0.3, speed=2.5)
    amounts = {one.field: (one.amount, one.words) for one in verdict(asked, found).excesses}
    assert {name: amount for name, (amount, _) in amounts.items()} == pytest.approx(
        {"obstacles[0]": 0.1, "blocks": 0.2, "region": 0.3, "max_speed": 0.5}
    )
    for name, words in {"obstacles[0]": "0.1 m beyond", "blocks": "0.2 m too close", "region": "by 0.3 m"}.items():
        assert words in amounts[name][1]
    assert "reaches 2.5 m/s" in amounts["max_speed"][1]
