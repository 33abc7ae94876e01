"""Inputs at the edge of having an answer: the table in docs/edges.md says what is answered, and this is so."""

import re
from pathlib import Path

import pytest

import peakmin as pm

EDGES = (Path(__file__).parent.parent.parent / "docs" / "edges.md").read_text()
SETTINGS = pm.Settings(grid=pm.Aligned(steps=40), search=pm.GlobalSearch(gap=1e-4), time_limit=3.0)


def state(x, y=0.0, v=0.0):
    return pm.State(position=(x, y), velocity=(v, 0.0))


def wall(x, y, **changes):
    return pm.Wall(tip=(x, y), **changes)


def plan(*obstacles, start=None, goal=None, **changes):
    ends = {"start": start or state(0), "goal": goal or state(1)}
    return pm.solve(pm.Maneuver(**{**ends, "duration": 1.0, "obstacles": obstacles, **changes}), SETTINGS)


def at(time, grid):
    maneuver = pm.Maneuver(start=state(0), goal=state(1), duration=1.0, obstacles=[wall(0.5, 0.5)])
    return pm.sweep(maneuver, pm.Settings(grid=grid), times=[time]).best


BESIDE = pm.Block(vertices=[(0.2, -0.1), (0.3, -0.1), (0.3, 0.1)])
AHEAD = pm.Block(vertices=[(0.4, -0.5), (0.6, -0.5), (0.5, 0.2)])
CASES = {
    "start is goal, at rest": lambda: plan(goal=state(0)),
    "start is goal, at rest, a block beside": lambda: plan(BESIDE, goal=state(0)),
    "start is goal, at rest, a wall 0.5 m off": lambda: plan(wall(0.5, 0.5), goal=state(0)),
    "start is goal, moving the same": lambda: plan(start=state(0, v=1), goal=state(0, v=1)),
    "opposite velocities at one place": lambda: plan(start=state(0, v=1), goal=state(0, v=-1)),
    "both velocities away from the goal": lambda: plan(wall(0.5, 0.5), start=state(0, v=-1), goal=state(1, v=-1)),
    "a wall's tip on the start": lambda: plan(wall(0, 0)),
    "the same, touched": lambda: plan(wall(0, 0, contact="touch")),
    "a wall's line through the start, its tip below": lambda: plan(wall(0, -0.5)),
    "a wall's line through the start, its tip above": lambda: plan(wall(0, 0.5)),
    "a wall's tip on the goal": lambda: plan(wall(1, 0)),
    "a wall's tip on the straight way": lambda: plan(wall(0.5, 0)),
    "a wall along the straight way, ending on it": lambda: plan(wall(0.5, 0, direction=(-1, 0))),
    "two walls at one abscissa": lambda: plan(wall(0.5, 0.2), wall(0.5, 0.3)),
    "two walls 1e-9 m apart": lambda: plan(wall(0.5, 0.3), wall(0.5 + 1e-9, 0.3)),
    "a slit 1e-6 m wide, to be passed along": lambda: plan(wall(0.5, 0.2), wall(0.5 + 1e-6, -0.2, direction=(0, 1))),
    "an obstacle time at an end": lambda: at(0.0, pm.Aligned(steps=20)),
    "an obstacle time 1e-12 from an end, aligned": lambda: at(1e-12, pm.Aligned(steps=20)),
    "an obstacle time 1e-12 from an end, uniform with 20 steps": lambda: at(1e-12, pm.Uniform(steps=20)),
    "a duration of 1e-9 s": lambda: plan(wall(0.5, 0.5), duration=1e-9),
    "a duration of 1e-9 s, a block": lambda: plan(AHEAD, duration=1e-9),
    "a duration of 1e9 s": lambda: plan(wall(0.5, 0.5), duration=1e9),
    "a duration of 1e9 s, a block": lambda: plan(AHEAD, duration=1e9),
    "1 m/s for 1e9 s, a wall 0.5 m off": lambda: plan(wall(0.5, 0.5), start=state(0, v=1), duration=1e9),
    "a way of 1e-9 m": lambda: plan(wall(5e-10, 5e-10), goal=state(1e-9)),
    "1e9 m from the origin": lambda: plan(wall(1e9 + 0.5, 0.5), start=state(1e9), goal=state(1e9 + 1)),
}
TABLE = re.findall(r"^\| (.+?) \| (solved|feasible|unknown|refused) \| ?(\S*) \|", EDGES, re.M)


def test_every_case_is_in_the_table():
    assert [name for name, _, _ in TABLE] == list(CASES)


@pytest.mark.parametrize(("name", "status", "peak"), TABLE, ids=[name for name, _, _ in TABLE])
def test_the_answer_is_that_of_the_table(name, status, peak):
    if status == "refused":
        with pytest.raises(pm.SpecError, match=r"^\S+: was .*, must "):
            CASES[name]()
        return
    found = CASES[name]()
    assert found.status == status
    assert found.lower_bound <= found.peak
    assert pm.verify(found.to_json()).passed
    if peak:
        assert found.peak == pytest.approx(float(peak), rel=3e-3, abs=1e-12 * float(peak))
        assert found.gap < 0.01
