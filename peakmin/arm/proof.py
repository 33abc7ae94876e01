"""Why no motion of a two-link arm has a smaller peak: branches that cover every path of its centre of mass.

A motion keeps its elbow, or turns it over where the centre of mass touches an edge of the annulus it can reach.

Kept: the path lies in one sheet. Every path from start to goal crosses each line that has them on different sides, and
where it first does, it is in one of the gaps that obstacles and annulus leave on that line. So all its paths fall into
classes by gaps, and by the order of the first crossings where lines meet inside the annulus; the maneuver past the
gaps of a class in their order bounds it. A tree that splits by one line at a time covers all paths.

Turned over: a path that touches the outer edge on an arc comes in over the arc's chord; one that touches the inner
edge on an arc comes in over one of the two tangents at the arc's ends, each up to where they meet. Either is a wall's
opening that is crossed at some time. Where neither start nor goal lies outside, there is no wall and M is that of the
way without any.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from ..arrays import Array
from ..certify import Leaf, global_bound
from ..frame import Frame
from ..moments import PointMass
from ..obstacles import Wall
from ..spec import Maneuver, State
from .kinematics import unit
from .spec import ArmManeuver, postures
from .workspace import Sheet, Workspace

FINEST = 1e-8  # of the arm: to which the gaps on a line are found
Edge = Literal["outer", "inner"]


@dataclass(frozen=True)
class Line:
    """Points r with unit(angle) . (r - start) = offset [m]: the start is before it, the goal beyond."""

    angle: float
    offset: float


@dataclass(frozen=True)
class Through:
    """A gap of a line, and which of its ends count: (low, high). Fewer ends are a weaker condition."""

    line: Line
    gap: int
    ends: tuple[bool, bool]


Order = tuple[Through, ...]  # in the order of first crossings


@dataclass(frozen=True)
class Turned:
    """Paths that touch an edge of the annulus between two angles [rad].

    tangent: at which end of an inner arc the tangent is that they come in over, 0 or 1; 0 for an outer one's chord.
    """

    edge: Edge
    arc: tuple[float, float]
    tangent: int = 0


class Passage:
    """One choice of start and goal configuration: its centre of mass's maneuver, lines and gaps."""

    def __init__(self, workspace: Workspace, start: int, goal: int) -> None:
        asked = workspace.maneuver
        self.workspace, self.indices = workspace, (start, goal)
        self.theta = tuple(
            np.array(postures(asked.arm, pose)[k]) for pose, k in ((asked.start, start), (asked.goal, goal))
        )
        chain = workspace.chain
        ends = [State(position=chain.centre(theta)) for theta in self.theta]
        self.maneuver = Maneuver(
            start=ends[0], goal=ends[1], duration=asked.duration, mass=chain.total, max_peak=asked.max_peak
        )
        self.frame = Frame.from_maneuver(self.maneuver)
        self.length = math.dist(ends[0].position, ends[1].position)
        self.elbows = tuple(_elbow(theta) for theta in self.theta)
        self.gaps = cache(self._gaps)

    @property
    def edges(self) -> list[Edge]:
        """The circles on which an elbow can turn over."""
        return ["outer", "inner"] if self.workspace.chain.reach[0] > 0 else ["outer"]

    @property
    def keeps(self) -> bool:
        """Whether start and goal have the same elbow; straight arms have both."""
        one, other = self.elbows
        return one == other or 0 in (one, other)

    @property
    def elbow(self) -> float:
        """The elbow of a motion that keeps it."""
        return self.elbows[0] or self.elbows[1] or -1.0

    @property
    def sheet(self) -> Sheet:
        """The configurations of a motion that keeps its elbow."""
        return Sheet(self.workspace, self.elbow)

    def _gaps(self, line: Line) -> list[tuple[float, float]]:
        """The gaps on a line, as intervals of the distance to the left of the point nearest to the start [m]."""
        origin, along = self.points(line)
        outer, middle = self.workspace.chain.reach[1], float(along @ (self.workspace.chain.base - origin))
        return self.sheet.gaps(origin, along, middle - outer, middle + outer, FINEST * self.workspace.size)

    def points(self, line: Line) -> tuple[Array, Array]:
        """The line's point nearest to the start [m] and its unit vector to the left of the way, (2,) each."""
        normal = unit(line.angle)
        return self.maneuver.start.position + line.offset * normal, np.array([-normal[1], normal[0]])

    def parts(self, line: Line) -> bool:
        """Whether start and goal are on different sides of it."""
        way = np.subtract(self.maneuver.goal.position, self.maneuver.start.position)
        return 0 < line.offset < float(unit(line.angle) @ way)

    def before(self, one: Line, other: Line) -> bool:
        """Whether every path crosses `one` before `other`, which lies wholly beyond it within the outer edge."""
        origin, along = self.points(other)
        outer, s = self.workspace.chain.reach[1], origin - self.workspace.chain.base
        half = math.sqrt(max(outer**2 - float(s @ s) + float(s @ along) ** 2, 0.0))
        ends = origin + (np.array([[-half], [half]]) - float(s @ along)) * along
        away = (ends - self.maneuver.start.position) @ unit(one.angle) - one.offset
        return bool(np.all(away > 1e-9 * self.workspace.size))

    def places(self, order: Order, line: Line) -> list[int]:
        """Where a line can stand in the order of first crossings."""
        first = max((k + 1 for k, one in enumerate(order) if self.before(one.line, line)), default=0)
        last = min((k for k, one in enumerate(order) if self.before(line, one.line)), default=len(order))
        return list(range(first, last + 1))

    def wall(self, through: Through, lift: float = 0.0) -> Wall | None:
        """What a gap leaves of its line, narrowed by `lift` [m] at each end that counts; None where that is nothing."""
        low, high = self.gaps(through.line)[through.gap]
        if not high - low > 2 * lift:
            return None
        origin, along = self.points(through.line)
        opening = high - low - 2 * lift if all(through.ends) else None
        if through.ends[0]:
            return Wall(tip=origin + (low + lift) * along, direction=-along, opening=opening)
        return Wall(tip=origin + (high - lift) * along, direction=along)

    def past(self, paths: Order | Turned, lift: float = 0.0) -> Maneuver | None:
        """The maneuver whose least peak bounds these paths; None where there are none."""
        walls: list[Wall | None]
        if isinstance(paths, Turned):
            walls = [self._opening(paths)] if self._must_come_in(paths) else []
        else:
            walls = [self.wall(one, lift) for one in paths if any(one.ends)]
        if any(wall is None for wall in walls):
            return None
        return self.maneuver.past([wall for wall in walls if wall is not None])

    def _opening(self, branch: Turned) -> Wall:
        """The segment that a path to this arc comes in over: its chord, or a tangent up to where both meet."""
        (a, b), (inner, outer) = branch.arc, self.workspace.chain.reach
        if branch.edge == "outer":
            first, last = outer * unit(a), outer * unit(b)
        else:
            first, last = inner * unit((a, b)[branch.tangent]), inner / math.cos((b - a) / 2) * unit((a + b) / 2)
        step = last - first
        tip = self.workspace.chain.base + first
        return Wall(tip=tip, direction=-step / math.hypot(*step), opening=math.hypot(*step))

    def _must_come_in(self, branch: Turned) -> bool:
        """Whether start or goal lies outside of what arc and segments enclose, so that a path to the arc crosses them."""
        (a, b), (inner, outer) = branch.arc, self.workspace.chain.reach
        room = 1e-12 * self.workspace.size
        for state in (self.maneuver.start, self.maneuver.goal):
            s = np.array(state.position) - self.workspace.chain.base
            if branch.edge == "outer":
                outside = float(unit((a + b) / 2) @ s) < outer * math.cos((b - a) / 2) - room
            else:
                turned = abs((math.atan2(s[1], s[0]) - (a + b) / 2 + math.pi) % (2 * math.pi) - math.pi)
                beyond = max(float(unit(a) @ s), float(unit(b) @ s)) > inner + room
                outside = beyond or turned > (b - a) / 2 + 1e-12
            if outside:
                return True
        return False


def _elbow(theta: Array) -> float:
    bend = math.sin(theta[1] - theta[0])
    return 0.0 if abs(bend) < 1e-9 else math.copysign(1.0, bend)


@dataclass(frozen=True)
class Branch:
    """Boxes of obstacle times that bound some paths' peak, and the classes that these paths fall into.

    leaves: prove the bound of all of them;  line: by which they are split, or None;  children: for every gap and every
    place in the order, None where a class is empty;  ends: which ends of its own gap a child counts;  dropped: which of
    its conditions, its own included, a child does not look at.
    """

    leaves: tuple[Leaf, ...]
    line: Line | None = None
    children: tuple[Branch | None, ...] = ()
    ends: tuple[bool, bool] = (True, True)
    dropped: tuple[int, ...] = ()

    def bound(self, passage: Passage, order: Order) -> float:
        """The bound [m/s^2] of the paths with this order, evaluated anew; infinite where there are none."""
        own = leaves_bound(passage, order, self.leaves)
        if self.line is None or math.isinf(own) or not passage.parts(self.line):
            return own
        classes = split(passage, order, self.line)
        if len(classes) != len(self.children):
            return own
        below = [
            (math.inf if passage.past(whole) is None else 0.0)
            if child is None
            else child.bound(passage, looked_at(whole, place, child.ends, child.dropped))
            for (place, whole), child in zip(classes, self.children, strict=True)
        ]
        return max(own, min(below, default=math.inf))


def leaves_bound(passage: Passage, paths: Order | Turned, leaves: tuple[Leaf, ...]) -> float:
    """What boxes prove of these paths [m/s^2]; infinite where there are none."""
    past = passage.past(paths)
    if past is None:
        return math.inf
    mass = PointMass.of(past)
    return global_bound(mass, leaves) * mass.unit


def split(passage: Passage, order: Order, line: Line) -> list[tuple[int, Order]]:
    """The classes by the gap of one more line and its place among the conditions: (place, order)."""
    return [
        (place, (*order[:place], Through(line, gap, (True, True)), *order[place:]))
        for gap in range(len(passage.gaps(line)))
        for place in passage.places(order, line)
    ]


def looked_at(order: Order, place: int, ends: tuple[bool, bool], dropped: tuple[int, ...]) -> Order:
    """A class with these ends of one gap counted alone, and without some of its conditions: weaker, never stronger."""
    return tuple(
        replace(one, ends=ends) if k == place else one for k, one in enumerate(order) if k not in dropped
    )


@dataclass(frozen=True)
class Touching:
    """Boxes that bound the peak of the paths that touch an arc of an edge, an inner one's for both tangents."""

    edge: Edge
    arc: tuple[float, float]
    leaves: tuple[tuple[Leaf, ...], ...]

    @property
    def paths(self) -> list[Turned]:
        return [Turned(self.edge, self.arc, k) for k in range(1 if self.edge == "outer" else 2)]

    def bound(self, passage: Passage) -> float:
        """The bound [m/s^2], evaluated anew."""
        if len(self.leaves) != len(self.paths):
            return 0.0
        return min(leaves_bound(passage, one, own) for one, own in zip(self.paths, self.leaves, strict=True))


@dataclass(frozen=True)
class PassageProof:
    """What is proved of one choice of configurations, by their indices: paths that keep the elbow, and all others."""

    indices: tuple[int, int]
    kept: Branch | None
    touching: tuple[Touching, ...]

    def bound(self, passage: Passage) -> float:
        """The bound [m/s^2], evaluated anew; zero where some motion is left out."""
        if passage.workspace.chain.links > 2:
            return 0.0 if self.kept is None else leaves_bound(passage, (), self.kept.leaves)
        least = math.inf
        if passage.keeps:
            least = 0.0 if self.kept is None else self.kept.bound(passage, ())
        if not all(self._around(edge) for edge in passage.edges):
            return 0.0
        return min(least, *(one.bound(passage) for one in self.touching))

    def _around(self, edge: Edge) -> bool:
        """Whether the arcs go all the way around an edge."""
        at = -math.pi
        for low, high in sorted(one.arc for one in self.touching if one.edge == edge):
            if low > at or not 0 < high - low <= 2 * math.pi / 3:
                return False
            at = max(at, high)
        return at >= math.pi


@dataclass(frozen=True)
class ArmProof:
    """Why no motion of the arm has a smaller peak, for every start and goal configuration that the poses allow.

    More than two links: by the centre of mass's maneuver alone, whatever stands in the way.
    """

    passages: tuple[PassageProof, ...]
    scope: Literal["all"] = "all"

    def bound(self, maneuver: ArmManeuver) -> float:
        """The lower bound [m/s^2], evaluated anew; zero where some motion is left out."""
        least, own = math.inf, {one.indices: one for one in self.passages}
        for passage in passages(Workspace(maneuver)):
            proof = own.get(passage.indices)
            least = min(least, 0.0 if proof is None else proof.bound(passage))
        return least if math.isfinite(least) else 0.0


def passages(workspace: Workspace) -> list[Passage]:
    """Every free start configuration with every free goal configuration."""
    asked = workspace.maneuver
    free = [
        [k for k, theta in enumerate(postures(asked.arm, pose)) if workspace.touched(np.array(theta)) is None]
        for pose in (asked.start, asked.goal)
    ]
    return [Passage(workspace, a, b) for a in free[0] for b in free[1]]
