"""What physics and mathematics demand of M, on random maneuvers at given obstacle times."""

import math

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.optimize import linprog

import peakmin as pm
from tests.conftest import least, wall_maneuver

SLOW = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
GRIDS = [pm.Uniform(steps=40), pm.Aligned(steps=42)]  # segments of equal steps: symmetric in time
coordinate = st.floats(-2, 2).map(lambda x: round(x, 3))
vector = st.tuples(coordinate, coordinate)
state = st.builds(pm.State, position=vector, velocity=vector)
direction = st.floats(0, 2 * math.pi).map(lambda a: (math.cos(a), math.sin(a)))
wall = st.builds(pm.Wall, tip=vector, direction=direction, contact=st.sampled_from(["touch", "clear"]))
times = st.floats(0.25, 0.75)


@st.composite
def maneuvers(draw, walls=(0, 1)):
    count = draw(st.integers(*walls))
    obstacles = tuple(draw(wall) for _ in range(count))
    try:
        maneuver = pm.Maneuver(start=draw(state), goal=draw(state), duration=1.0, obstacles=obstacles)
    except pm.SpecError:
        assume(False)
    at = (
        (draw(times),) if count == 1 else tuple(np.sort([draw(st.floats(0.2, 0.4)), draw(st.floats(0.6, 0.8))]))[:count]
    )
    return maneuver, at


def moved(maneuver, matrix, shift=(0.0, 0.0), length=1.0, time=1.0):
    """The maneuver under x -> length * matrix x + shift, and slower by `time`."""

    def place(p):
        return tuple(length * (matrix @ np.array(p)) + np.array(shift))

    def turn(v):
        return tuple(length / time * (matrix @ np.array(v)))

    return pm.Maneuver(
        start=pm.State(position=place(maneuver.start.position), velocity=turn(maneuver.start.velocity)),
        goal=pm.State(position=place(maneuver.goal.position), velocity=turn(maneuver.goal.velocity)),
        duration=maneuver.duration * time,
        obstacles=[
            pm.Wall(tip=place(w.tip), direction=tuple(matrix @ np.array(w.direction)), contact=w.contact)
            for w in maneuver.obstacles
        ],
    )


def reversed_in_time(maneuver):
    def back(s):
        return pm.State(position=s.position, velocity=tuple(-np.array(s.velocity)))

    return maneuver.model_copy(
        update={"start": back(maneuver.goal), "goal": back(maneuver.start), "obstacles": maneuver.obstacles[::-1]}
    )


def close(one, other):
    """Two brackets of the same number: both closed, and overlapping to 1e-6."""
    floor = 1e-9
    assert one[1] - one[0] <= 1e-6 * one[1] + floor
    assert other[1] - other[0] <= 1e-6 * other[1] + floor
    assert one[0] <= other[1] * (1 + 1e-6) + floor
    assert other[0] <= one[1] * (1 + 1e-6) + floor


@SLOW
@given(maneuvers(), st.floats(0, 7), vector, st.booleans(), st.sampled_from(GRIDS))
def test_rotation_translation_and_mirror_leave_m_unchanged(problem, angle, shift, mirror, grid):
    maneuver, at = problem
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s], [s, c]]) @ np.diag([1, -1 if mirror else 1])
    close(least(maneuver, at, grid=grid), least(moved(maneuver, matrix, shift), at, grid=grid))


@SLOW
@given(maneuvers(walls=(0, 2)), st.sampled_from(GRIDS))
def test_time_reversal_leaves_m_unchanged(problem, grid):
    maneuver, at = problem
    if grid.kind == "uniform":  # nodes are symmetric, halves are rounded to even
        at = tuple((np.floor(np.array(at) * 40) + 0.25) / 40)
    close(least(maneuver, at, grid=grid), least(reversed_in_time(maneuver), tuple(1 - np.array(at[::-1])), grid=grid))


@SLOW
@given(maneuvers(), st.floats(-6, 6), st.floats(-3, 4), st.sampled_from(GRIDS))
def test_scaling_length_and_time_scales_m(problem, length, time, grid):
    maneuver, at = problem
    length, time = 10.0**length, 10.0**time
    low, high = least(maneuver, at, grid=grid)
    other = least(moved(maneuver, np.eye(2), length=length, time=time), np.array(at) * time, grid=grid)
    unit = length / time**2
    close((low, high), (other[0] / unit, other[1] / unit))


@SLOW
@given(maneuvers(), st.integers(1, 12), st.sampled_from(GRIDS))
def test_polygons_bracket_the_disc(problem, n, grid):
    maneuver, at = problem
    shrink = math.cos(math.pi / (4 * n))
    disc = least(maneuver, at, grid=grid)
    inside = least(maneuver, at, grid=grid, circle=pm.Polygon(segments=n))
    outside = least(maneuver, at, grid=grid, circle=pm.Polygon(segments=n, fit="circumscribed"))
    room = 1 + 1e-9
    assert disc[0] <= inside[1] * room
    assert inside[0] <= disc[1] / shrink * room
    assert outside[0] <= disc[1] * room
    assert disc[0] * shrink <= outside[1] * room


def by_linprog(maneuver, at, polygon, edges):
    """min M with the states as variables, HiGHS: another formulation, another code path."""
    steps, n = len(edges) - 1, 4 * polygon.segments
    size = 4 * (steps + 1) + 2 * steps + 1 + 1  # x, vx, y, vy per node; u; slack of the wall; M
    rows, right = [], []

    def state(k, i):
        return 4 * k + i

    def control(k, axis):
        return 4 * (steps + 1) + 2 * k + axis

    def equation(terms, value):
        row = sparse.lil_matrix((1, size))
        for index, factor in terms:
            row[0, index] += factor
        rows.append(row.tocsr())
        right.append(value)

    for k, dt in enumerate(np.diff(edges)):
        for axis in (0, 1):
            p, v, u = state(k, 2 * axis), state(k, 2 * axis + 1), control(k, axis)
            equation([(state(k + 1, 2 * axis), 1), (p, -1), (v, -dt), (u, -0.5 * dt * dt)], 0)
            equation([(state(k + 1, 2 * axis + 1), 1), (v, -1), (u, -dt)], 0)
    for axis in (0, 1):
        for k, end in ((0, maneuver.start), (steps, maneuver.goal)):
            equation([(state(k, 2 * axis), 1)], end.position[axis])
            equation([(state(k, 2 * axis + 1), 1)], end.velocity[axis])
    for t, w in zip(at, maneuver.obstacles, strict=True):
        k = int(np.argmin(np.abs(edges - t)))
        away = -np.array(w.direction) / np.hypot(*w.direction)
        for axis in (0, 1):
            equation([(state(k, 2 * axis), 1), (size - 2, -away[axis])], w.tip[axis])
    limits = sparse.lil_matrix((steps * n, size))
    for k in range(steps):
        for j, normal in enumerate(polygon.normals):
            limits[k * n + j, control(k, 0)], limits[k * n + j, control(k, 1)] = normal
            limits[k * n + j, size - 1] = -polygon.inradius
    touch = any(w.contact == "touch" for w in maneuver.obstacles)
    bounds = [(None, None)] * (size - 2) + [(0, 0 if touch else None), (0, None)]
    cost = np.zeros(size)
    cost[-1] = 1
    answer = linprog(
        cost, limits.tocsr(), np.zeros(steps * n), sparse.vstack(rows).tocsr(), right, bounds, method="highs"
    )
    assert answer.status == 0
    return answer.fun


@SLOW
@given(maneuvers(), st.integers(1, 5), st.sampled_from([pm.Uniform(steps=24), pm.Aligned(steps=24)]))
def test_direct_bisection_and_an_independent_linprog_agree(problem, n, grid):
    maneuver, at = problem
    polygon = pm.Polygon(segments=n)
    placed = grid.place(np.array(at))
    peer = by_linprog(maneuver, placed, polygon, grid.edges(placed))
    direct = least(maneuver, at, grid=grid, circle=polygon)
    bisected = least(maneuver, at, grid=grid, circle=polygon, method=pm.Bisection())
    close(direct, bisected)
    assert direct[0] - 1e-7 <= peer * (1 + 1e-6)
    assert peer <= direct[1] * (1 + 1e-6) + 1e-7


@pytest.mark.parametrize("distance", [1e-3, 1.0, 250.0])
@pytest.mark.parametrize("duration", [0.5, 40.0])
def test_rest_to_rest_over_a_distance_is_bang_bang(distance, duration):
    maneuver = pm.Maneuver(
        start=pm.State(position=(1, 1)),
        goal=pm.State(position=(1 + 0.6 * distance, 1 - 0.8 * distance)),
        duration=duration,
    )
    exact = 4 * distance / duration**2
    for grid in (pm.Aligned(), pm.Uniform()):
        plan = pm.solve(maneuver, pm.Settings(grid=grid))
        assert plan.status == "solved"
        assert plan.lower_bound <= exact * (1 + 1e-9)
        assert plan.peak == pytest.approx(exact, rel=1e-8)  # even steps: the switch is a node
    odd = pm.solve(maneuver, pm.Settings(grid=pm.Uniform(steps=199)))
    assert exact < odd.peak <= exact * (1 + 1e-4)


@pytest.mark.parametrize("grid", GRIDS, ids=str)
@pytest.mark.parametrize("circle", [pm.Disc(), pm.Polygon(segments=3)], ids=str)
@pytest.mark.parametrize("walls", [0, 1, 2, 3])
def test_programs_are_dpp_and_change_only_in_m_and_the_times(grid, circle, walls):
    obstacles = [pm.Wall(tip=(0.2 + 0.2 * i, 0.5), contact=("touch", "clear")[i % 2]) for i in range(walls)]
    maneuver = wall_maneuver(obstacles=obstacles)
    program = pm.FeasibilityProgram(maneuver, circle, grid)
    assert program.problem.is_dcp(dpp=True)
    set_by_hand = [p for p in program.problem.parameters() if not isinstance(p, cp.CallbackParam)]
    expected = {"M", "obstacle_times"} if walls else {"M"}
    assert {p.name() for p in set_by_hand} <= expected
    program.M.value = 1e3
    if walls:
        program.obstacle_times.value = np.linspace(0.2, 0.7, walls)
    program.problem.solve(solver="CLARABEL")
    assert program.problem.status == "optimal"
    program.M.value = 1e-2
    program.problem.solve(solver="CLARABEL")
    assert program.problem.status == "infeasible"
