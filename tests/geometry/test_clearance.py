import math

import numpy as np
import pytest
import shapely

import peakmin as pm
from peakmin.geometry.clearance import TOLERANCE, block_clearance, wall_clearance
from peakmin.geometry.trajectory import HoldTrajectory
from peakmin.scenes.kept import least_clearance

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ELL = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])
COMB = np.array([[0, 0], [3, 0], [3, 2], [2.5, 2], [2.4, 0.3], [1.5, 0.4], [1.4, 2], [1, 1.5], [0.8, 0.2], [0.1, 2]])


class Opaque:
    """A hold trajectory that only shows what every trajectory does: bounded by chords."""

    def __init__(self, motion):
        self.motion = motion

    def __getattr__(self, name):
        return getattr(self.motion, name)


both = pytest.mark.parametrize("wrap", [lambda m: m, Opaque], ids=["exact", "chords"])


def star(rng, corners=60):
    angles = np.sort(rng.uniform(0, 2 * math.pi, corners))
    return (rng.uniform(0.3, 1.0, corners) * np.stack([np.cos(angles), np.sin(angles)])).T


def hold(position, velocity, *control, dt=1.0):
    control = np.array(control, dtype=float)
    return HoldTrajectory(
        dt * np.arange(len(control) + 1), control, np.array(position, float), np.array(velocity, float)
    )


def random_motion(rng, holds=20, scale=2.0):
    nodes = np.concatenate([[0], np.cumsum(rng.uniform(0.02, 0.2, holds))])
    control = rng.normal(size=(holds, 2)) * rng.choice([0.0, 1.0, 30.0], size=(holds, 1))
    return HoldTrajectory(nodes, control, rng.normal(size=2) * scale, rng.normal(size=2))


def sampled(motion, vertices, samples=5_001):
    """Signed distance of the densest sampling, and how far the path moves from one sample to the next."""
    t = np.linspace(motion.nodes[0], motion.nodes[-1], samples)
    points = shapely.points(motion.position(t))
    polygon = shapely.Polygon(vertices)
    distance = shapely.distance(points, polygon.exterior)
    inside = shapely.contains_properly(polygon, points)
    step = np.max(np.hypot(*motion.velocity(t).T)) * (t[1] - t[0])
    return float(np.min(np.where(inside, -distance, distance))), bool(inside.any()), step


@both
@pytest.mark.parametrize("seed", range(12))
def test_it_agrees_with_dense_sampling(seed, wrap):
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(8, 2))
    hull = np.array(shapely.convex_hull(shapely.MultiPoint(cloud)).exterior.coords)
    for vertices in (SQUARE, ELL[::-1], COMB, hull, star(rng)):
        motion = random_motion(rng)
        clearance = block_clearance(wrap(motion), vertices)
        seen, inside, step = sampled(motion, vertices)
        slack = 2e-9 * (1 + motion.peak() * motion.nodes[-1] ** 2)  # what chords may lose
        if inside:
            assert clearance < 0
        if clearance < -slack:
            assert seen <= step
        if clearance >= 0:
            assert not inside
        if seen > step:  # else whether it enters may be hidden between the samples
            assert seen - step <= clearance <= seen + 1e-12
        elif inside:
            assert clearance <= 0.2 * seen + step  # the deepest of the points looked at, not of all


@pytest.mark.parametrize("seed", range(30))
def test_chords_bound_the_exact_clearance_from_below(seed):
    rng = np.random.default_rng(seed)
    motion, vertices = random_motion(rng), star(rng, 12)
    exact, bound = block_clearance(motion, vertices), block_clearance(Opaque(motion), vertices)
    extent = np.max(np.ptp(motion.position(np.linspace(0, motion.nodes[-1], 2001)), axis=0))
    tolerance = TOLERANCE * (extent + motion.peak() * motion.nodes[-1] ** 2)
    if exact > tolerance:
        assert exact - tolerance <= bound <= exact + 1e-12
    else:
        assert bound < tolerance


@both
@pytest.mark.parametrize("height", [1e-6, 0.01, 0.3, 1.0])
def test_a_parabola_above_a_corner(height, wrap):
    """y = height - x^2/2 above the corner (0, 0) of a downward spike: the vertex is nearest while height <= 1."""
    motion = wrap(hold((-1, height - 0.5), (1, 1), (0, -1), dt=2.0))
    spike = np.array([[0, 0], [1e-3, -50], [-1e-3, -50]])
    assert block_clearance(motion, spike) == pytest.approx(height, abs=2e-8)
    assert block_clearance(motion, spike) <= height + 1e-14


def test_a_parabola_is_nearest_to_a_point_beside_its_apex():
    """y = x^2/2 seen from (0, 2): nearest at x^2 = 2, at distance sqrt(3); the apex is further away."""
    spike = np.array([[0, 2], [0.01, 90], [-0.01, 90]])
    assert block_clearance(hold((-3, 4.5), (1, -3), (0, 1), dt=6.0), spike) == pytest.approx(math.sqrt(3), abs=1e-14)


@both
def test_a_straight_path_beside_an_edge(wrap):
    beside = wrap(hold((-1, 1.25), (1, 0), (0, 0), (0, 0), (0, 0)))
    assert block_clearance(beside, SQUARE) == pytest.approx(0.25, abs=1e-8)
    along = wrap(hold((-1, 1), (1, 0), (0, 0), (0, 0), (0, 0)))
    assert block_clearance(along, SQUARE) == pytest.approx(0, abs=1e-8)
    through = wrap(hold((-1, 0.25), (1, 0), (0, 0), (0, 0), (0, 0)))
    assert block_clearance(through, SQUARE) == pytest.approx(-0.25, abs=1e-8)
    at_rest = wrap(hold((3, 1), (0, 0), (0, 0)))
    assert block_clearance(at_rest, SQUARE) == 2
    assert block_clearance(wrap(hold((0.5, 0.6), (0, 0), (0, 0))), SQUARE) == pytest.approx(-0.4)


@both
@pytest.mark.parametrize("cut", [1e-1, 1e-3, 1e-6])
def test_a_corner_cut_between_two_nodes(cut, wrap):
    """A line past (1, 1) that enters by cut on both sides of it: every node is outside."""
    motion = wrap(hold((3, -1 - cut), (-4, 4), (0, 0)))
    assert np.all(shapely.distance(shapely.points(motion.position(motion.nodes)), shapely.Polygon(SQUARE)) > 1)
    assert -cut / 2 - 2e-8 <= block_clearance(motion, SQUARE) < -cut / 4
    missed = wrap(hold((3, -1 + cut), (-4, 4), (0, 0)))
    assert block_clearance(missed, SQUARE) == pytest.approx(cut / math.sqrt(2), abs=2e-8)


def test_a_dip_through_an_edge_between_two_nodes():
    """An arch over y = 1 with its apex 1e-7 beyond it: shallower than what nodes or chords' ends see."""
    dip = hold((0.5 - 0.4, 1.08 - 1e-7), (0.4, -0.16), (0, 0.16), dt=2.0)
    assert block_clearance(dip, SQUARE) == pytest.approx(-1e-7, rel=1e-6)
    assert block_clearance(dip, SQUARE[::-1] - np.array([0, 2e-7])) == pytest.approx(1e-7, rel=1e-6)


def test_closed_and_reversed_vertices_are_the_same_polygon():
    motion = random_motion(np.random.default_rng(3))
    expected = block_clearance(motion, COMB)
    assert block_clearance(motion, np.vstack([COMB, COMB[:1]])) == pytest.approx(expected, abs=1e-14)
    assert block_clearance(motion, COMB[::-1]) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("shift", [0.0, 1e5])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e7])
def test_units_and_places_do_not_matter(unit, shift):
    for seed in range(10):
        motion = random_motion(np.random.default_rng(seed))
        moved = HoldTrajectory(
            motion.nodes,
            motion.control * unit,
            (motion.start_position + shift) * unit,
            motion.start_velocity * unit,
        )
        expected = block_clearance(motion, ELL)
        assert block_clearance(moved, (ELL + shift) * unit) == pytest.approx(expected * unit, abs=1e-9 * unit)


TIP, DOWN = np.array([0.5, 0.5]), np.array([0.0, -2.0])


@both
def test_over_and_under_the_tip(wrap):
    assert wall_clearance(wrap(hold((0, 0.75), (1, 0), (0, 0))), TIP, DOWN, 0.0) == pytest.approx(0.25, abs=1e-8)
    assert wall_clearance(wrap(hold((0, 0.2), (1, 0), (0, 0))), TIP, DOWN, 0.0) == pytest.approx(-0.3, abs=1e-12)
    arch = wrap(hold((0, 0), (1, 2.4), (0, -4.8)))  # its apex (0.5, 0.6)
    over = wall_clearance(arch, TIP, DOWN, 0.0)
    t = np.linspace(0, 1, 200_001)
    assert over == pytest.approx(np.min(np.hypot(*(arch.position(t) - TIP).T)), abs=1e-8)
    assert wall_clearance(arch, TIP, -DOWN, 0.0) == pytest.approx(-0.1, abs=1e-12)


@both
def test_touching_the_tip_and_what_counts_as_touching(wrap):
    touching = wrap(hold((0, 0.5), (1, 0), (0, 0)))
    assert wall_clearance(touching, TIP, DOWN, 0.0) == 0
    below = wrap(hold((0, 0.5 - 1e-7), (1, 0), (0, 0)))
    assert wall_clearance(below, TIP, DOWN, 0.0) == pytest.approx(-1e-7, rel=1e-6)
    assert wall_clearance(below, TIP, DOWN, 2e-7) == 0
    node = wrap(hold((0, 0.2), (0.5, 0), (0, 0), (0, 0)))  # changes sides at a node
    assert wall_clearance(node, TIP, DOWN, 0.1) == pytest.approx(-0.3, abs=1e-12)


@both
def test_it_crosses_twice(wrap):
    """x = 0.5 at y = 0.28 and again at y = -0.28: the deeper crossing counts."""
    there_and_back = wrap(hold((0, 0.4), (2, -0.4), (-2, 0), dt=2.0))  # x = 2t - t^2, y = 0.4 (1 - t)
    deeper = 0.5 - 0.4 * (1 - (1 + math.sqrt(0.5)))
    assert wall_clearance(there_and_back, TIP, DOWN, 0.0) == pytest.approx(-deeper, abs=1e-12)
    seen = np.min(np.hypot(*(there_and_back.position(np.linspace(0, 2, 100_001)) - TIP).T))
    assert wall_clearance(there_and_back, TIP, -DOWN, 0.0) == pytest.approx(seen, abs=1e-8)


@both
def test_what_meets_the_ray_and_stays_on_its_side_touches(wrap):
    grazing = wrap(hold((0, 0), (1, 0), (-1, 0), dt=2.0))  # x = t - t^2/2 <= 1/2
    assert wall_clearance(grazing, TIP, DOWN, 0.0) == 0
    arriving = wrap(hold((0, 0), (0.5, 0), (0, 0)))
    assert wall_clearance(arriving, TIP, DOWN, 0.0) == 0
    leaving = wrap(hold((0.5, 0), (0.5, 0), (0, 0)))
    assert wall_clearance(leaving, TIP, DOWN, 0.0) == 0
    falling = wrap(hold((0.5, 0.4), (0, -1), (0, 0)))  # along the ray
    assert wall_clearance(falling, TIP, DOWN, 0.0) == 0
    above = wrap(hold((0.5, 2), (0, -1), (0, 0)))
    assert wall_clearance(above, TIP, DOWN, 0.0) == pytest.approx(0.5, abs=1e-8)
    beyond = wrap(hold((0.4, 0), (0, -1), (0, 0)))
    assert wall_clearance(beyond, TIP, DOWN, 0.0) == pytest.approx(0.1, abs=1e-8)


def test_it_changes_sides_along_the_ray():
    """Onto the ray 0.1 below the tip, down it by 0.25, and off on the other side."""
    motion = hold((0.4, 0.4), (0.2, 0), (-0.4, 0), (0, -0.5), (0.4, 0.5), dt=1.0)
    motion = HoldTrajectory(np.array([0, 0.5, 1.5, 2.5]), motion.control, motion.start_position, np.array([0.2, 0]))
    np.testing.assert_allclose(motion.node_position[1], [0.45, 0.4])
    moved = HoldTrajectory(motion.nodes, motion.control, np.array([0.45, 0.4]), motion.start_velocity)
    assert wall_clearance(moved, TIP, DOWN, 0.0) == pytest.approx(-0.35, abs=1e-12)


@both
@pytest.mark.parametrize("seed", range(15))
def test_walls_agree_with_dense_sampling(seed, wrap):
    rng = np.random.default_rng(seed)
    motion, direction = random_motion(rng, scale=0.5), rng.normal(size=2)
    tip = rng.normal(size=2)
    clearance = wall_clearance(wrap(motion), tip, direction, 0.0)
    r = motion.position(np.linspace(0, motion.nodes[-1], 100_001))
    e = direction / np.hypot(*direction)
    along, off = (r - tip) @ e, (r - tip) @ np.array([-e[1], e[0]])
    crossed = np.flatnonzero(off[1:] * off[:-1] < 0)
    step = np.max(np.hypot(*np.diff(r, axis=0).T))
    if len(crossed) and np.max(along[crossed]) > step:
        assert clearance == pytest.approx(-np.max(along[crossed]), abs=step)
    else:
        seen = np.min(np.hypot(off, along - np.maximum(along, 0)))
        assert seen - step <= clearance <= seen + 1e-12


def test_an_optimal_motion_touches_its_wall():
    wall = pm.Wall(tip=(0.5, 0.5))
    maneuver = pm.Maneuver(
        start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=1.0, obstacles=[wall]
    )
    motion = pm.solve(maneuver, pm.Settings(method=pm.Exact())).trajectory
    tolerance = TOLERANCE * (1.5 + motion.peak())
    assert wall_clearance(motion, TIP, DOWN, 1e-9) == pytest.approx(0, abs=2 * tolerance)
    assert wall_clearance(motion, TIP, -DOWN, 1e-9) == pytest.approx(0, abs=2 * tolerance)
    assert wall_clearance(motion, TIP + np.array([0, 0.1]), DOWN, 1e-9) == pytest.approx(-0.1, abs=1e-8)
    for vertices in (ELL * 0.2 + [0.45, 0.55], SQUARE * 0.1 + [0.1, 0.5], SQUARE * [1, 0.2] - [0, 0.5]):
        seen, inside, step = sampled(motion, vertices, 100_001)
        clearance = block_clearance(motion, vertices)
        assert not inside
        assert seen - step - tolerance <= clearance <= seen
    low = np.array([[0.49, -0.1], [0.51, -0.1], [0.51, 0.45], [0.49, 0.45]])
    assert block_clearance(motion, low) == pytest.approx(sampled(motion, low, 100_001)[0], abs=1e-7)
    high = low + np.array([0, 0.2])
    seen, inside, _ = sampled(motion, high, 100_001)
    assert inside
    assert block_clearance(motion, high) == pytest.approx(seen, abs=1e-4)


def test_many_holds_fit_in_memory():
    angle = np.linspace(0, 6 * math.pi, 20_000)  # round and round the star at its own distance
    control = -4 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    motion = HoldTrajectory(
        angle[1] * np.arange(20_001) / 1.0, control / 1.0, np.array([4.0, 0.0]), np.array([0.0, 4.0])
    )
    vertices = star(np.random.default_rng(0))
    seen, _, step = sampled(motion, vertices)
    assert seen - step <= block_clearance(motion, vertices) <= seen


@both
def test_what_is_no_number_has_no_clearance(wrap):
    motion = wrap(hold((0, 3), (1, 0), (0, 0), (0, math.nan)))
    assert math.isnan(block_clearance(motion, SQUARE))
    assert math.isnan(wall_clearance(motion, TIP, DOWN, 0.0))


# ---- against polynomials' roots, and at any angle


def parts(motion):
    """Each hold as coefficients (3, 2) of its fraction x: r = c_0 + c_1 x + c_2 x^2."""
    dt = np.diff(motion.nodes)[:, None]
    return np.stack([motion.node_position[:-1], dt * motion.node_velocity[:-1], dt * dt * motion.control / 2], axis=1)


def real(*coefficients):
    """Roots in (0, 1) of the polynomial, lowest power first."""
    roots = np.roots(np.trim_zeros(np.array(coefficients)[::-1], "f"))
    roots = roots[np.abs(roots.imag) < 1e-9].real
    return roots[(roots > 0) & (roots < 1)].tolist()


def by_roots(motion, vertices):
    """Least distance from the polygon's outline, and whether the path is inside anywhere."""
    outline, polygon = shapely.LinearRing(vertices), shapely.Polygon(vertices)
    least, inside = math.inf, False
    for c in parts(motion):
        at, crossed = [0.0, 1.0], [0.0, 1.0]
        for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
            normal = np.array([a[1] - b[1], b[0] - a[0]])
            d = c[0] - a
            crossed += real(normal @ d, normal @ c[1], normal @ c[2])
            at += real(normal @ c[1], 2 * normal @ c[2])
            at += real(d @ c[1], c[1] @ c[1] + 2 * d @ c[2], 3 * c[1] @ c[2], 2 * c[2] @ c[2])
        cuts = np.sort(crossed)
        points = [c[0] + x * (c[1] + x * c[2]) for x in [*at, *crossed, *(cuts[1:] + cuts[:-1]) / 2]]
        least = min(least, *shapely.distance(shapely.points(points), outline))
        inside = inside or bool(np.any(shapely.contains_properly(polygon, shapely.points(points))))
    return float(least), inside


def turned(motion, angle, shift=(0, 0)):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    return HoldTrajectory(
        motion.nodes, motion.control @ turn, motion.start_position @ turn + shift, motion.start_velocity @ turn
    )


@pytest.mark.parametrize("seed", range(60))
def test_it_agrees_with_roots_of_polynomials(seed):
    """Few long holds past few corners, so that what is nearest is mostly between the nodes."""
    rng = np.random.default_rng(seed)
    motion = HoldTrajectory(
        np.array([0.0, 0.7, 1.5]), 6 * rng.normal(size=(2, 2)), 2 * rng.normal(size=2), 3 * rng.normal(size=2)
    )
    for vertices in (SQUARE, ELL - 1, COMB[[0, 1, 2, 4, 6]], 0.1 * SQUARE, 10 * SQUARE + rng.normal(size=2)):
        least, inside = by_roots(motion, vertices)
        clearance = block_clearance(motion, vertices)
        if inside:
            assert clearance < 0
        else:
            assert clearance == pytest.approx(least, abs=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_the_nearer_of_two_places_beside_the_apex(seed):
    """A parabola around a point, nearest to it on either of its arms or at its apex, in units of any size."""
    rng = np.random.default_rng(seed)
    unit = rng.choice([1e-3, 1.0, 1e3])
    motion = hold((-3 * unit, 4.5 * unit), (unit, -3 * unit), (0, unit), dt=6.0)  # y = x^2/2
    tip = rng.uniform([-1, 0.2], [1, 3]) * unit
    spike = np.array([tip, tip + unit * np.array([0.01, 90]), tip + unit * np.array([-0.01, 90])])
    least, inside = by_roots(motion, spike)
    assert not inside
    assert block_clearance(motion, spike) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("seed", range(60))
def test_above_and_below_a_straight_shore(seed):
    """Depth and distance are exact where there is but one edge: against each parabola's own least height."""
    rng = np.random.default_rng(seed)
    motion = HoldTrajectory(
        np.cumsum([0, *rng.uniform(0.1, 0.6, 3)]), 6 * rng.normal(size=(3, 2)), np.zeros(2), 2 * rng.normal(size=2)
    )
    heights = [
        (c[0] + x * (c[1] + x * c[2]))[1] for c in parts(motion) for x in [0.0, 1.0, *real(c[1, 1], 2 * c[2, 1])]
    ]
    wanted = rng.choice([-1, -1e-6, 1e-6, 0.5]) * rng.uniform(0.2, 1)
    angle, away = rng.uniform(0, 2 * math.pi), rng.normal(size=2)
    motion = HoldTrajectory(motion.nodes, motion.control, np.array([0, wanted - min(heights)]), motion.start_velocity)
    c, s = math.cos(angle), math.sin(angle)
    shore = np.array([[-1e3, 0], [-1e3, -1e3], [1e3, -1e3], [1e3, 0]]) @ np.array([[c, s], [-s, c]]) + away
    assert block_clearance(turned(motion, angle, away), shore) == pytest.approx(wanted, abs=1e-10)


@both
@pytest.mark.parametrize("seed", range(40))
def test_a_dip_through_the_line_of_a_ray(seed, wrap):
    """In the ray's frame the path is off = 3 (t - tau)^2 - depth: it crosses, touches or stays on its side."""
    rng = np.random.default_rng(seed)
    tau, slope = rng.uniform(0.2, 0.8), rng.uniform(-1, 1)
    depth = [-1e-6, 1e-6, 1e-3, 0.1][seed % 4]
    along = 1.5 + slope * tau  # distance beyond the tip at the dip
    motion = hold((1.5, 3 * tau**2 - depth), (slope, -6 * tau), (0, 6.0))
    angle, tip = rng.uniform(0, 2 * math.pi), rng.normal(size=2)
    side = 1 if seed % 3 else -1
    if side < 0:
        motion = HoldTrajectory(
            motion.nodes, -motion.control, motion.start_position * [1, -1], motion.start_velocity * [1, -1]
        )
    direction = np.array([math.cos(angle), math.sin(angle)])
    found = wall_clearance(wrap(turned(motion, angle, tip)), tip, direction, 0.0)
    half = math.sqrt(max(depth, 0) / 3)
    deepest = max(1.5 + slope * t for t in (tau - half, tau + half) if 0 <= t <= 1) if depth > 0 else None
    if depth < 0:
        assert 0 <= found <= 1.01e-6
    else:
        assert found == pytest.approx(-deepest, abs=1e-7)
    assert abs(along) > 0.5


@pytest.mark.parametrize("seed", [37, 66, 101, 163, 169, 198, 216, 236, 287])
def test_what_bulges_towards_a_corner_between_slow_ends(seed):
    """Chords shorter than the path's deviation from them, past one corner where it turns and another elsewhere."""
    rng = np.random.default_rng(seed)
    deviation = 40 / 64**2 / 8
    motion = hold((0, 0), (rng.uniform(0.02, 0.4), -20 + rng.uniform(-0.3, 0.3)), (0, 40))
    turn = -motion.start_velocity[1] / 40
    t = np.array([turn + rng.uniform(-1, 1) / 128, rng.uniform(0.2, 0.4)])
    velocity = motion.velocity(t)
    normal = np.stack([-velocity[:, 1], velocity[:, 0]], axis=1) / np.hypot(*velocity.T)[:, None]
    a, b = motion.position(t) - normal * (deviation * rng.uniform(0.01, 1.5, 2))[:, None]
    spikes = np.array([a, [a[0] + 1e-6, -50], [b[0] - 30, -50], b, [a[0] - (a[0] - b[0]) * 0.02, a[1] - 0.5]])
    assert block_clearance(Opaque(motion), spikes) <= block_clearance(motion, spikes) + 1e-12


@pytest.mark.parametrize("duration", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("seed", range(4))
def test_chords_are_as_close_in_any_unit_of_time(seed, duration):
    motion = random_motion(np.random.default_rng(seed))
    k = duration / motion.nodes[-1]
    motion = HoldTrajectory(motion.nodes * k, motion.control / k**2, motion.start_position, motion.start_velocity / k)
    vertices = SQUARE + np.array([20, 0])
    exact, bound = block_clearance(motion, vertices), block_clearance(Opaque(motion), vertices)
    extent = np.max(np.ptp(motion.position(np.linspace(0, duration, 2001)), axis=0))
    assert exact - TOLERANCE * (extent + motion.peak() * duration**2) <= bound <= exact + 1e-12


@pytest.mark.parametrize("fraction", [0.97, 0.98, 0.99])
@pytest.mark.parametrize("bend", [0.6, 1.2, -1.2])
def test_a_corner_just_before_the_end_of_a_bent_hold(bend, fraction):
    """At constant speed around a bend, then straight on: the corner is nearer to the bend than to any node."""
    turn = np.array([math.cos(bend) - 1, math.sin(bend)])
    for off in (1e-4, 1e-2):
        motion = hold((0, 0), (1, 0), turn, (0, 0))
        r, v = motion.position(fraction), motion.velocity(fraction)
        normal = np.array([-v[1], v[0]]) / np.hypot(*v) * -np.sign(bend)  # outside the bend
        tip = r + off * normal
        ahead = normal + 2 * v / np.hypot(*v)
        spike = np.array([tip, tip + 9 * ahead + 0.01 * v, tip + 9 * ahead - 0.01 * v])
        least, inside = by_roots(motion, spike)
        assert not inside
        assert block_clearance(motion, spike) == pytest.approx(least, abs=1e-12)


@pytest.mark.parametrize("seed", range(40))
def test_a_dip_just_below_the_tip(seed):
    """Between the ends of chords, a rounding of the chords below the tip: it crosses all the same."""
    rng = np.random.default_rng(seed)
    tau, slope = rng.uniform(0.2, 0.8), rng.choice([-1, 0, 1])
    along = 1e-4 if slope == 0 else rng.uniform(1e-4, 3e-3)
    depth = 1e-6
    motion = hold((along - slope * tau, 3 * tau**2 - depth), (slope, -6 * tau), (0, 6.0))
    half = math.sqrt(depth / 3)
    deepest = max(along + slope * half, along - slope * half)
    found = wall_clearance(Opaque(motion), np.zeros(2), np.array([1.0, 0]), 0.0)
    assert found == pytest.approx(-deepest, abs=1e-7)


@pytest.mark.parametrize("seed", range(40))
def test_a_dip_little_deeper_than_what_chords_may_lose(seed):
    rng = np.random.default_rng(seed)
    tau, bend = rng.uniform(0.2, 0.8), rng.uniform(1, 20)

    def dip(depth):  # off = bend (t - tau)^2 - depth
        return hold((1.5, bend * tau**2 - depth), (0, -2 * bend * tau), (0, 2 * bend))

    tolerance = TOLERANCE * (bend * max(tau, 1 - tau) ** 2 + 2 * bend)
    motion = Opaque(dip(0.6 * tolerance))
    assert wall_clearance(motion, np.zeros(2), np.array([1.0, 0]), 0.0) == pytest.approx(-1.5, abs=1e-7)
    # holds lose nothing
    assert wall_clearance(dip(1e-12), np.zeros(2), np.array([1.0, 0]), 0.0) == pytest.approx(-1.5, abs=1e-7)


@pytest.mark.parametrize("seed", range(60))
def test_rounding_errors_are_no_sides_of_a_wall_anywhere(seed):
    """Along a ray, of which the tip is far from the origin, or the path, or both; and across one in the smallest units."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * math.pi)
    e = np.array([math.cos(angle), math.sin(angle)])
    far, tip = [(1e6, 0.0), (0.0, 1.0), (1e6, 1e6)][seed % 3]
    tip = -tip * e if seed % 2 else tip * rng.choice([-1, 1], size=2)
    begin = tip + max(far, 1e6 if seed % 3 == 0 else 1.0) * e
    motion = hold(begin, 0.1 * e, *([(0, 0)] * 7))
    assert wall_clearance(motion, tip, e, 0.0) == 0
    unit = 1e-8
    across = hold(unit * (2 * e + [-e[1], e[0]]), -2 * unit * np.array([-e[1], e[0]]), (0, 0))
    assert wall_clearance(across, np.zeros(2), e, 0.0) == pytest.approx(-2 * unit, rel=1e-9)


def test_it_changes_sides_up_along_the_ray():
    """Onto the ray 0.35 below the tip, up it, and off on the other side."""
    motion = HoldTrajectory(
        np.array([0, 0.5, 1.0, 1.5]), np.zeros((3, 2)), np.array([0.45, 0.15]), np.array([0.1, 0.0])
    )
    up = HoldTrajectory(
        np.array([0, 0.5, 1.5, 2.5]),
        np.array([[-0.2, 0.0], [0, 0.5], [0.4, -0.5]]),
        np.array([0.475, 0.15]),
        np.array([0.1, 0]),
    )
    np.testing.assert_allclose(up.node_position[1], [0.5, 0.15])
    assert wall_clearance(motion, TIP, DOWN, 0.0) == pytest.approx(-0.35, abs=1e-12)
    assert wall_clearance(up, TIP, DOWN, 0.0) == pytest.approx(-0.35, abs=1e-12)


@both
@pytest.mark.parametrize("seed", range(12))
def test_the_least_clearance_of_many_is_that_of_each(seed, wrap):
    rng = np.random.default_rng(seed)
    motion = wrap(random_motion(rng, holds=6))
    spread = rng.choice([0.5, 3.0, 30.0])
    blocks = [0.2 * COMB + rng.normal(size=2) * spread for _ in range(30)]
    assert least_clearance(motion, blocks) == min(block_clearance(motion, block) for block in blocks)
    assert least_clearance(motion, []) == math.inf
    far = [SQUARE + np.array([0, 10.0 * k]) for k in range(3, 9)]
    assert least_clearance(motion, far[::-1]) == block_clearance(motion, far[0])
