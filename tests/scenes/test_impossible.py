"""What is proved impossible is: shortest ways by brute force, regions and blocks that close by hand."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize

import peakmin as pm
from peakmin.scenes.impossible import impossible, least_way
from tests.conftest import wall_maneuver


def shortest(maneuver, points=401, reach=4.0):
    """The least length over crossings on a grid of each free part, (length, what the grid may miss)."""
    places = [np.array([maneuver.start.position])]
    for wall in maneuver.walls:
        far = 0.0 if wall.contact == "touch" else reach if wall.opening is None else wall.opening
        free = -np.array(wall.direction) / math.hypot(*wall.direction)
        places.append(np.array(wall.tip) + np.linspace(0, far, points)[:, None] * free)
    places.append(np.array([maneuver.goal.position]))
    cost = np.zeros(1)
    for before, after in itertools.pairwise(places):
        cost = np.min(cost[:, None] + np.hypot(*(before[:, None] - after[None]).T).T, axis=0)
    return float(cost[0])


def random_walls(seed):
    rng, walls = np.random.default_rng(seed), []
    for x in np.sort(rng.uniform(0.1, 0.9, seed % 3 + 1)):
        angle = rng.choice([0, math.pi]) + rng.uniform(-0.6, 0.6)
        kind = rng.choice(["clear", "touch", "opening"])
        walls.append(
            pm.Wall(
                tip=(x, rng.uniform(-1, 1)),
                direction=(3 * math.sin(angle), -3 * math.cos(angle)),
                **({"opening": 0.3} if kind == "opening" else {"contact": kind}),
            )
        )
    return wall_maneuver(obstacles=walls)


@pytest.mark.parametrize("seed", range(60))
def test_no_way_is_shorter_and_it_is_nearly_attained(seed):
    maneuver = random_walls(seed)
    bound, best = least_way(maneuver), shortest(maneuver)
    assert bound <= best * (1 + 1e-12)
    assert bound >= 1 - 1e-9
    if all(wall.contact == "touch" for wall in maneuver.walls):
        assert bound == pytest.approx(best, rel=1e-8)


def test_ways_that_are_known():
    up = {"direction": (0, -2)}
    for unit in (1e-3, 1.0, 1e3):

        def past(*walls, unit=unit):
            return pm.Maneuver(
                start=pm.State(position=(0, 0)), goal=pm.State(position=(unit, 0)), duration=1, obstacles=walls
            )

        assert least_way(past()) == pytest.approx(unit, rel=1e-8)
        assert least_way(past(pm.Wall(tip=(0.5 * unit, -unit), **up))) == pytest.approx(unit, rel=1e-6)
        over = 2 * math.hypot(0.5, 0.5) * unit
        assert least_way(past(pm.Wall(tip=(0.5 * unit, 0.5 * unit), **up))) == pytest.approx(over, rel=1e-6)
        slit = pm.Wall(tip=(0.5 * unit, -0.5 * unit), opening=0.2 * unit, **up)
        assert least_way(past(slit)) == pytest.approx(2 * math.hypot(0.5, 0.3) * unit, rel=1e-6)
        twice = past(pm.Wall(tip=(0.25 * unit, 0.3 * unit), **up), pm.Wall(tip=(0.75 * unit, 0.3 * unit), **up))
        assert least_way(twice) == pytest.approx((2 * math.hypot(0.25, 0.3) + 0.5) * unit, rel=1e-6)


def test_the_speed_that_the_way_needs():
    maneuver = wall_maneuver(duration=2.0)
    way = 2 * math.hypot(0.5, 0.5)
    assert impossible(maneuver.model_copy(update={"max_speed": way / 2 * (1 + 1e-6)})) is None
    found = impossible(maneuver.model_copy(update={"max_speed": way / 2 * (1 - 1e-6)}))
    assert found.fields == ("max_speed", "duration", "obstacles[0]")
    assert (
        "the way past obstacles[0] is at least 1.41421 m long, max_speed 0.707106 m/s allows 1.41421 m" in found.because
    )
    free = maneuver.model_copy(update={"obstacles": (), "max_speed": 0.4})
    assert impossible(free).fields == ("max_speed", "duration")
    assert "the way is at least 1 m long, max_speed 0.4 m/s allows 0.8 m in 2 s" in impossible(free).because
    assert impossible(maneuver) is None


SQUARE = np.array([(-1.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-1.0, 1.0)])


def within(*obstacles, region=SQUARE, shift=(0.0, 0.0), unit=1.0, **fields):
    """From (0, 0) to (1, 0), all of it moved and in other units."""
    shift = np.array(shift)

    def moved(one):
        if isinstance(one, pm.Wall):
            width = {"opening": one.opening * unit} if one.opening else {"contact": one.contact}
            tip = (np.array(one.tip) + shift) * unit
            return pm.Wall(tip=tuple(tip), direction=one.direction, **width)
        return pm.Block(vertices=((np.array(one.vertices) + shift) * unit).tolist())

    return pm.Maneuver(
        start=pm.State(position=tuple(shift * unit)),
        goal=pm.State(position=tuple((shift + np.array([1, 0])) * unit)),
        duration=1,
        obstacles=[moved(one) for one in obstacles],
        region=((region + shift) * unit).tolist(),
        **fields,
    )


PLACES = [((0.0, 0.0), 1.0), ((-7.0, 3.0), 1e-4), ((40.0, -90.0), 1e4)]


@pytest.mark.parametrize(("shift", "unit"), PLACES)
def test_walls_whose_free_part_is_outside(shift, unit):
    def verdict(wall):
        found = impossible(within(wall, shift=shift, unit=unit))
        assert found is None or found.fields == ("region", "obstacles[0]")
        return found is not None

    for past in (1e-3, 1e-6):
        assert verdict(pm.Wall(tip=(0.5, 1 + past)))
        assert not verdict(pm.Wall(tip=(0.5, 1 - past)))
        assert verdict(pm.Wall(tip=(0.5, -1 - past), direction=(0, 5)))
        assert not verdict(pm.Wall(tip=(0.5, -1 + past), direction=(0, 5)))
        # an opening that ends before the region begins, one that reaches it
        assert verdict(pm.Wall(tip=(0.5, -1.5), direction=(0, -3), opening=0.5 - past))
        assert not verdict(pm.Wall(tip=(0.5, -1.5), direction=(0, -3), opening=0.5 + past))
        assert verdict(pm.Wall(tip=(0.5, 1 + past), contact="touch"))
    # free towards a region far away, and along a slope
    assert not verdict(pm.Wall(tip=(0.5, -900.0)))
    assert not verdict(pm.Wall(tip=(-9.0, 9.5), direction=(-1, 1)))
    assert verdict(pm.Wall(tip=(-9.0, 9.5), direction=(1, -1)))
    assert verdict(pm.Wall(tip=(-9.0, 9.5), direction=(-1, 2.5)))


def block(left, right, low, high):
    return pm.Block(vertices=[(left, low), (right, low), (right, high), (left, high)])


@pytest.mark.parametrize(("shift", "unit"), PLACES)
def test_blocks_that_close_the_region(shift, unit):
    def verdict(*blocks, **fields):
        found = impossible(within(*blocks, shift=shift, unit=unit, **fields))
        return None if found is None else found.fields

    both = ("region", "obstacles[0]", "obstacles[1]")
    assert verdict(block(0.4, 0.6, -2, 2)) == ("region", "obstacles[0]")
    assert verdict(block(0.4, 0.6, -2, 0.999)) is None
    assert verdict(block(0.4, 0.6, -2, 1.001)) == ("region", "obstacles[0]")
    assert verdict(block(0.4, 0.6, -2, 0.1), block(0.4, 0.6, 0.101, 2)) is None
    assert verdict(block(0.4, 0.6, -2, 0.1), block(0.4, 0.6, 0.099, 2)) == both
    # what only touches may be passed between
    assert verdict(block(0.4, 0.6, -2, 0.1), block(0.4, 0.6, 0.1, 2)) is None
    assert verdict(block(0.4, 0.6, -2, 1.0)) is None
    # with a margin
    gap = block(0.4, 0.6, -2, 0.1), block(0.4, 0.6, 0.2, 2)
    assert verdict(*gap, margin=0.049 * unit) is None
    assert verdict(*gap, margin=0.051 * unit) == (*both, "margin")
    # beside the way, or open on one side; around the start alone, or start and goal together
    assert verdict(block(1.2, 1.6, -2, 2)) is None
    ring = block(-0.3, -0.2, -0.3, 0.3), block(0.2, 0.3, -0.3, 0.3), block(-0.3, 0.3, 0.2, 0.3)
    assert verdict(*ring) is None
    assert verdict(*ring, block(-0.3, 0.3, -0.3, -0.2)) is not None
    wide = block(-0.3, -0.2, -0.3, 0.3), block(1.2, 1.3, -0.3, 0.3), block(-0.3, 1.3, 0.2, 0.3)
    assert verdict(*wide, block(-0.3, 1.3, -0.3, -0.2)) is None


@pytest.mark.parametrize("shift", [(5e9, 0), (-5e9, 0), (-5e9, -5e9), (0, 5e9)])
def test_far_from_the_origin_little_is_said(shift):
    """At 5e9 m from the origin a metre has few digits left: what is within their rounding proves nothing."""
    closing = block(0.4, 0.6, -2, 2)
    assert impossible(within(closing, shift=shift)) is not None
    for far in (100, 20_000):  # of the region first a 500th is in doubt, then all
        assert impossible(within(closing, shift=np.array(shift) * far)) is None
    for past, said in ((1e-5, False), (1e-3, True)):
        wall = pm.Wall(tip=(0.5, 1 + past))
        assert (impossible(within(wall, shift=shift)) is not None) == said


def test_far_from_the_start_little_is_said():
    """Of a tip 900 m away the last digits count for less."""
    for short, said in ((1.2e-6, False), (1e-5, True)):
        wall = pm.Wall(tip=(0.5, -900.0), direction=(0, -3), opening=899 - short)
        assert (impossible(within(wall)) is not None) == said


def test_without_a_region_or_blocks_nothing_is_closed():
    assert impossible(within()) is None
    assert impossible(within(block(0.4, 0.6, -2, 2)).model_copy(update={"region": None})) is None


@pytest.mark.parametrize("seed", range(60))
def test_wherever_the_shortest_way_is_sought_no_way_is_shorter(seed, monkeypatch):
    """The minimiser only says where the bound is evaluated."""
    rng, asked = np.random.default_rng(seed), random_walls(seed)
    start = rng.uniform(-3, 0, 2)
    maneuver = asked.model_copy(update={"start": pm.State(position=tuple(start))})

    def anywhere(_, s, bounds, **__):
        return SimpleNamespace(x=np.array([rng.choice([0, 0.5, 1]) * (high or 3.0) for _, high in bounds]))

    monkeypatch.setattr(optimize, "minimize", anywhere)
    assert least_way(maneuver) <= shortest(maneuver, points=201, reach=9.0) * (1 + 1e-12)


def test_crossings_far_from_their_tips_count(monkeypatch):
    """The tip is 900 m below the way; sought 20 m below it."""
    maneuver = pm.Maneuver(
        start=pm.State(position=(0, 100)),
        goal=pm.State(position=(1, 100)),
        duration=1,
        obstacles=[pm.Wall(tip=(0.5, -800))],
    )
    monkeypatch.setattr(optimize, "minimize", lambda *_, **__: SimpleNamespace(x=np.array([880 / 900])))
    assert least_way(maneuver) <= 1
