"""What no control can do, however large its peak: shown by lengths and areas of the maneuver's own numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.optimize import minimize

from ..geometry.norm import length, norm
from ..robots.kinematics import ANGLE
from ..spec.arm import ArmManeuver
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Block, Wall
from ..types import Array

SLACK = 1e-9  # relative: by how much lengths and areas are counted against the verdict
ULPS = 64  # units in the last place of coordinates, likewise
COARSEST = 1e-3  # of the region: where that is more, nothing is said


@dataclass(frozen=True)
class Impossible:
    """Entries of the maneuver that leave no motion, by their paths, and why in words."""

    fields: tuple[str, ...]
    because: str


def impossible(maneuver: Maneuver) -> Impossible | None:
    """Why there is no motion at all, or None where nothing of it is shown.

    - `max_speed`: the way past the walls is longer than what the duration allows.
    - `region`: the free part of a wall's line lies outside; or blocks close it between start and goal.
    """
    return _too_far(maneuver) or _cut_off(maneuver) or _closed(maneuver)


def too_slow(task: ArmManeuver, ends: Iterable[tuple[Array, Array]]) -> Impossible | None:
    """Which joint cannot turn far enough between any start and goal, (n,) absolute angles each; None where all can.

    From rest to rest in T a joint turns by less than V T with |q'| <= V, and by at most

        A T^2 / 4  where V >= A T / 2,      else V T - V^2 / A      with |q''| <= A too.
    """
    found: dict[str, str] = {}
    for start, goal in ends:
        slow = next((one for k in range(len(task.arm.links)) if (one := _joint_slow(task, k, start, goal))), None)
        if slow is None:
            return None
        found |= slow
    fields = tuple(dict.fromkeys(name for names in found for name in names.split(" ")))
    return Impossible((*fields, "duration"), "; ".join(dict.fromkeys(found.values()))) if found else None


def _joint_slow(task: ArmManeuver, k: int, start: Array, goal: Array) -> dict[str, str]:
    """What keeps joint k from turning far enough, by the entries that do; nothing where it can."""
    link, T = task.arm.links[k], task.duration
    low, high = link.limits or (-math.inf, math.inf)
    begin, end = (float(np.diff(x, prepend=0.0)[k]) for x in (start, goal))
    begins = [begin] if task.start.joints else [begin + math.tau * i for i in (-1, 0, 1)]
    begins = [x for x in begins if low - ANGLE <= x <= high + ANGLE]
    turns = [end + math.tau * (round((begin - end) / math.tau) + i) for i in (-2, -1, 0, 1, 2)]
    ways = [abs(x - y) for x in turns if low - ANGLE <= x <= high + ANGLE for y in begins]
    V, A = link.max_speed or math.inf, link.max_acceleration or math.inf
    most = A * T**2 / 4 if A * T / 2 <= V else V * T - V**2 / A
    if not ways or min(ways) * (1 - SLACK) <= most:
        return {}
    names = [name for name in ("max_speed", "max_acceleration") if getattr(link, name) is not None]
    reach = f"and can by {most:.6g} rad with its {' and '.join(names)}"
    because = f"joint {k + 1} must turn by {min(ways):.6g} rad in {T:g} s, {reach}"
    return {" ".join(f"arm.links[{k}].{name}" for name in names): because}


def least_way(maneuver: Maneuver) -> float:
    """No path from start to goal that crosses the walls' free parts in order is shorter [m].

    With P_0 the start, P_i = tip_i + s_i f_i on the free part of wall i, P_{q+1} the goal, and any |y_i| <= 1,

        sum |P_{i+1} - P_i|  >=  sum y_i . (P_{i+1} - P_i)  =  affine in s,

    least at the ends of each s_i. A path no longer than the one found has s_i <= |tip_i - start| + its length.
    """
    walls, start, goal = maneuver.walls, np.array(maneuver.start.position), np.array(maneuver.goal.position)
    tips = np.array([wall.tip for wall in walls]).reshape(-1, len(start))
    free = np.array([-np.array(wall.direction) / length(wall.direction) for wall in walls]).reshape(-1, len(start))
    widest = np.array([_width(wall) for wall in walls])
    size = float(np.max(np.ptp(np.vstack([start, goal, tips]), axis=0))) or 1.0

    def places(s: Array) -> Array:
        return np.vstack([start, tips + s[:, None] * free, goal])

    def way(s: Array) -> float:
        return float(np.sum(norm(np.diff(places(s * size), axis=0))))

    s = np.zeros(len(walls))
    if len(walls) and np.any(widest > 0):
        bounds = [(0.0, None if math.isinf(width) else width / size) for width in widest]
        s = minimize(lambda x: way(x) / size, s, method="L-BFGS-B", bounds=bounds).x
    found = way(s)
    step = np.diff(places(s * size), axis=0)
    y = step / np.maximum(norm(step), 1e-300)[:, None]
    slope = np.sum((y[:-1] - y[1:]) * free, axis=1)
    most = np.minimum(widest, norm(tips - start) + found) if len(walls) else widest
    bound = float(np.sum(y * np.diff(places(np.zeros(len(walls))), axis=0)) + np.sum(np.minimum(0.0, slope * most)))
    return max(bound, math.dist(start, goal)) * (1 - SLACK)


def _width(wall: Wall) -> float:
    if wall.contact == "touch":
        return 0.0
    return math.inf if wall.opening is None else wall.opening


def _too_far(maneuver: Maneuver) -> Impossible | None:
    if maneuver.max_speed is None:
        return None
    way, most = least_way(maneuver), maneuver.max_speed * maneuver.duration
    if not way > most * (1 + SLACK):
        return None
    walls = _names(maneuver, Wall)
    past = f" past {' and '.join(walls)}" if walls else ""
    because = f"the way{past} is at least {way:.6g} m long, max_speed {maneuver.max_speed:.6g} m/s allows {most:.6g} m"
    return Impossible(("max_speed", "duration", *walls), f"{because} in {maneuver.duration:.6g} s")


def _cut_off(maneuver: Maneuver) -> Impossible | None:
    if maneuver.region is None:
        return None
    # seen from the start, so that places far from the origin are as exact as their numbers
    start = np.array(maneuver.start.position)
    region = shapely.Polygon(np.array(maneuver.region) - start)
    size = length(np.ptp(np.array(maneuver.region), axis=0))
    for wall, name in zip(maneuver.walls, _names(maneuver, Wall), strict=True):
        tip, free = np.array(wall.tip) - start, -np.array(wall.direction) / length(wall.direction)
        far = size + region.distance(shapely.Point(tip))
        part = shapely.LineString([tip, tip + min(_width(wall), 2 * far) * free])
        if part.distance(region) > SLACK * (far + float(np.max(np.abs(tip)))) + _rounding(maneuver):
            return Impossible(("region", name), f"the free part of the line of {name} lies outside of the region")
    return None


def _closed(maneuver: Maneuver) -> Impossible | None:
    if maneuver.region is None or not maneuver.blocks:
        return None
    start = np.array(maneuver.start.position)
    size = length(np.ptp(np.array(maneuver.region), axis=0))
    slack = SLACK * size + _rounding(maneuver)
    if slack > COARSEST * size:
        return None
    # a little is given away on every side: what only touches may be passed between
    grown = [block.grown(maneuver.margin, maneuver.start.position) for block in maneuver.blocks]
    shrunk = [shapely.Polygon(rings[0], rings[1:]).buffer(-slack) for rings in grown]
    room = shapely.Polygon(np.array(maneuver.region) - start).buffer(slack)
    left = shapely.difference(room, shapely.union_all(shrunk))
    ends = [shapely.Point(np.array(state.position) - start) for state in (maneuver.start, maneuver.goal)]
    for part in getattr(left, "geoms", [left]):
        if all(part.distance(end) <= 2 * slack for end in ends):
            return None
    fields = (*_names(maneuver, Block), *(["margin"] if maneuver.margin else []))
    return Impossible(("region", *fields), "the obstacles close the region between start and goal")


def _rounding(maneuver: Maneuver) -> float:
    """What coordinates far from the origin leave open [m]."""
    places = [maneuver.start.position, maneuver.goal.position, *(maneuver.region or ())]
    return ULPS * float(np.finfo(float).eps) * float(np.max(np.abs(np.array(places))))


def _names(maneuver: Maneuver, kind: type[Wall] | type[Block]) -> tuple[str, ...]:
    return tuple(f"obstacles[{i}]" for i, one in enumerate(maneuver.obstacles) if isinstance(one, kind))
