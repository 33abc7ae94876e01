"""What a path keeps at every instant: its distances, its region, its speed. Proved between nodes, not sampled."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..geometry.clearance import block_clearance, pieces, wall_clearance
from ..geometry.norm import length, norm
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..types import Array

ROOM = 1e-9  # of the scene's size: how close to a tip a crossing counts as being at it
GRAIN = 1e-12  # relative: rounding errors of positions on the region's edge and of speeds at their bound
ENDS = 1e-7  # of the way
FAR = 1e3  # of the scene's size: how far behind a block it counts as closed at least
Closed = Callable[[float], tuple[Array, ...]]  # `closed_behind` by how far away
CHORDS = 20_000  # of a continuous control's path; what bends between them is charged in full


@dataclass(frozen=True)
class Excess:
    """What is not kept: the entry of the spec, by how much of which unit, and the same in words.

    stated: whether the spec has that entry, or it is what counts where it has none.
    """

    field: str
    amount: float
    unit: str
    words: str
    stated: bool = True


@dataclass(frozen=True)
class Kept:
    """What a motion keeps of all that was asked, at every instant.

    clearance: least distance from any obstacle [m], negative inside;  at: where it is about reached [s], NaN where that
    is not known;  excesses: what is not kept.
    """

    clearance: float
    at: float
    excesses: tuple[Excess, ...]

    @property
    def passed(self) -> bool:
        """Whether all of it is kept."""
        return not self.excesses

    def of(self, field: str) -> float:
        """By how much an entry is not kept, in its unit; zero where it is."""
        return max((one.amount for one in self.excesses if one.field == field), default=0.0)


@dataclass(frozen=True)
class Keeping:
    """clearance: distance from walls and blocks [m], negative inside;  each_wall: from every wall, by its place among
    the obstacles;  blocks: from blocks less the margin [m], from what lies behind blocks whose side is given, and from
    where blocks meet;  region: from the region's edge [m], negative outside;  speed: the largest [m/s]. Infinite or
    zero where nothing is asked.
    """

    clearance: float
    each_wall: dict[int, float]
    blocks: float
    region: float
    speed: float

    @property
    def walls(self) -> float:
        """From the walls alone [m]."""
        return min(self.each_wall.values(), default=math.inf)


def extent(maneuver: Maneuver) -> float:
    """Largest coordinate of start, goal and obstacles, seen from the start [m]."""
    start = np.array(maneuver.start.position)
    points = [
        maneuver.goal.position,
        *(w.tip for w in maneuver.walls),
        *(v for b in maneuver.blocks for v in b.vertices),
    ]
    return float(np.max(np.abs(np.array(points) - start))) or 1.0


def kept(maneuver: Maneuver, motion: Trajectory, closed: Closed | None = None) -> Kept:
    """What a motion [SI] keeps of a maneuver's obstacles, margin, region and bound on the speed."""
    return verdict(maneuver, keeping(maneuver, motion, closed))


def verdict(maneuver: Maneuver, found: Keeping) -> Kept:
    """What of the numbers is not as asked. Each comparison is written so that a number that is none fails it."""
    out = []
    for i, depth in found.each_wall.items():
        if not depth >= 0:
            said = f"obstacles[{i}]: this path crosses it {-depth:.6g} m beyond its tip"
            out.append(Excess(f"obstacles[{i}]", -depth, "m", said))
    if not found.blocks >= 0:
        said = f"blocks: this path comes {-found.blocks:.6g} m too close, or passes one on the other side"
        out.append(Excess("blocks", -found.blocks, "m", said))
    there = np.array([maneuver.goal.position, *(maneuver.region or ())]) - np.array(maneuver.start.position)
    if not found.region >= -GRAIN * float(np.max(np.abs(there))):
        out.append(Excess("region", -found.region, "m", f"region: this path leaves it by {-found.region:.6g} m"))
    most = math.inf if maneuver.max_speed is None else maneuver.max_speed
    if not found.speed <= most * (1 + GRAIN):
        said = f"max_speed {most:.6g} m/s: this path reaches {found.speed:.6g} m/s"
        out.append(Excess("max_speed", found.speed - most, "m/s", said))
    return Kept(found.clearance, math.nan, tuple(out))


def keeping(maneuver: Maneuver, motion: Trajectory, closed: Closed | None = None) -> Keeping:
    """What a motion [SI] keeps of a maneuver's obstacles, region and speed, in numbers.

    Args:
        closed: `closed_behind` of this maneuver, where it is known for several motions.
    """
    walls = wall_clearances(maneuver, motion)
    blocks = least_clearance(motion, [np.array(block.vertices) for block in maneuver.blocks])
    far = _far(maneuver, motion)
    behind = least_clearance(motion, closed_behind(maneuver, far) if closed is None else closed(far))
    return Keeping(
        min([blocks, *walls.values()]),
        walls,
        min(blocks - maneuver.margin, behind),
        math.inf if maneuver.region is None else _inside(motion, np.array(maneuver.region)),
        0.0 if maneuver.max_speed is None else _fastest(motion),
    )


def wall_clearances(maneuver: Maneuver, motion: Trajectory) -> dict[int, float]:
    """The distance from each wall [m], by its place among the obstacles; negative where the motion crosses it."""
    return {
        i: min(
            # room of the wall's own size: others may be far away
            wall_clearance(motion, tip, along, ROOM * extent(maneuver.past([wall])))
            for tip, along in wall.rays
        )
        for i, wall in enumerate(maneuver.obstacles)
        if isinstance(wall, Wall)
    }


def least_clearance(motion: Trajectory, polygons: Sequence[Array]) -> float:
    """The least `block_clearance` [m] of polygons (n, 2); infinite of none.

    No point of the path is further than some reach from the nearest of the times looked at: what even the corners' box
    is further from than the least so far is not looked at more closely.
    """
    if not polygons:
        return math.inf
    times = pieces(motion)
    r, dt = motion.position(times), np.diff(times)
    reach = float(np.max(norm(np.diff(r, axis=0)) / 2 + motion.peak() * dt**2 / 8))
    far = np.empty(len(polygons))
    for k, corners in enumerate(polygons):
        off = np.maximum(np.maximum(np.min(corners, axis=0) - r, r - np.max(corners, axis=0)), 0.0)
        far[k] = np.min(norm(off)) - reach
    best = math.inf
    for k in np.argsort(far):
        if far[k] > 0 and best <= far[k]:
            break
        best = float(np.minimum(best, block_clearance(motion, polygons[k])))  # unlike min, keeps what is no number
    return best


def _far(maneuver: Maneuver, motion: Trajectory) -> float:
    """How far away [m] a block closes what is behind it: further than the motion goes, and than anything is."""
    times = pieces(motion)
    from_start = motion.position(times) - np.array(maneuver.start.position)
    gone = float(np.max(norm(from_start)) + motion.peak() * np.max(np.diff(times), initial=0.0) ** 2)
    far = FAR * extent(maneuver)
    while far < 2 * gone < math.inf:  # doubled, so that few are made anew
        far *= 2
    return far


def closed_behind(maneuver: Maneuver, far: float) -> tuple[Array, ...]:
    """Corners (n, 2) of what else is closed: behind blocks with a side, between start and goal; joints of blocks.

    Margins included, as in `scenes.blocks`: what the bound counts as closed must be closed to a plan too. A start or
    goal behind a block is at the edge of what is closed, and a bound by chords loses a little there. So a little of
    the way is left out at that end, behind a block that reaches further: who is behind it there comes from before the
    start, or is seen behind it a little later.
    """
    start, goal = np.array(maneuver.start.position), np.array(maneuver.goal.position)
    if not maneuver.blocks or not np.any(goal - start):
        return ()
    along = (goal - start) / length(goal - start)
    left = np.array([-along[1], along[0]])
    closed = []
    little = ENDS * (goal - start)
    near = 1e-3 * length(little)
    for block in maneuver.blocks:
        if block.side == "either":
            continue
        shadow = shapely.Polygon(block.shadow(maneuver.margin, -left if block.side == "left" else left, far))
        first, last = (
            end + step if all(shadow.distance(shapely.Point(end + part * step)) < near for part in (0, 2)) else end
            for end, step in ((start, little), (goal, -little))
        )
        between = shapely.Polygon([first + far * left, last + far * left, last - far * left, first - far * left])
        closed += _parts(shadow.intersection(between))
    joined = _parts(shapely.union_all([shapely.Polygon(b.grown(maneuver.margin)[0]) for b in maneuver.blocks]))
    if len(joined) < len(maneuver.blocks):
        closed += [part for part in joined if not part.interiors]
    return tuple(np.array(part.exterior.coords)[:-1] for part in closed)


def _parts(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """The polygons of a geometry."""
    return [part for part in getattr(shape, "geoms", [shape]) if part.geom_type == "Polygon" and part.area > 0]


def inward(region: Array) -> tuple[Array, Array]:
    """Unit normals n (k, 2) into a counterclockwise convex polygon and offsets c (k,): inside n . r >= c."""
    step = np.roll(region, -1, axis=0) - region
    normals = np.stack([-step[:, 1], step[:, 0]], axis=1) / norm(step)[:, None]
    return normals, np.sum(normals * region, axis=1)


def _inside(motion: Trajectory, region: Array) -> float:
    """Least distance of the path from the region's edges [m]: n . r is a parabola on each hold."""
    normals, offsets = inward(region)
    if not isinstance(motion, HoldTrajectory):
        t = np.linspace(motion.nodes[0], motion.nodes[-1], CHORDS + 1)
        bend = motion.peak() * (t[1] - t[0]) ** 2 / 8
        return float(np.min(motion.position(t) @ normals.T - offsets) - bend)
    r, v, u = motion.node_position, motion.node_velocity, motion.control
    least = float(np.min(r @ normals.T - offsets))
    a, b = u @ normals.T, v[:-1] @ normals.T
    dt = np.diff(motion.nodes)[:, None]
    s = np.clip(-b / np.where(a > 0, a, 1.0), 0.0, dt)
    lowest = r[:-1] @ normals.T - offsets + np.where(a > 0, s * (b + 0.5 * s * a), 0.0)
    return min(least, float(np.min(lowest)))


def _fastest(motion: Trajectory) -> float:
    """Largest speed [m/s]: |v| is convex on each hold."""
    if isinstance(motion, HoldTrajectory):
        return float(np.max(norm(motion.node_velocity)))
    t = np.linspace(motion.nodes[0], motion.nodes[-1], CHORDS + 1)
    return float(np.max(norm(motion.velocity(t))) + motion.peak() * (t[1] - t[0]) / 2)
