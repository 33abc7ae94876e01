"""One choice of start and goal configuration, seen by the centre of mass: its lines, gaps, edges and walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

import numpy as np

from ..arrays import Array
from ..frame import Frame
from ..obstacles import Wall
from ..spec import Maneuver, State
from ..trajectory import Trajectory
from .joints import JointPath
from .kinematics import unit
from .maneuver import postures
from .workspace import Sheets, Workspace

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

    def __init__(self, workspace: Workspace, start: int, goal: int, any_elbow: bool = False) -> None:
        asked = workspace.maneuver
        self.workspace, self.indices, self.any_elbow = workspace, (start, goal), any_elbow
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
        return ["outer", "inner"]

    @property
    def keeps(self) -> bool:
        """Whether start and goal have the same elbow; straight arms have both."""
        one, other = self.elbows
        return one == other or 0 in (one, other)

    @property
    def elbow(self) -> float:
        """The elbow of a motion that keeps it."""
        return self.elbows[0] or self.elbows[1] or -1.0

    def joints(self, motion: Trajectory, changes: tuple[float, ...] = ()) -> JointPath:
        """The joints' motion of two links along a motion of the centre of mass, the elbow turning over at `changes`."""
        elbow = self.elbows[0] if changes else self.elbow
        return JointPath(self.workspace.chain, motion, (0, 1), elbow, changes, None, self.theta[0])

    @cached_property
    def sheets(self) -> Sheets:
        """The configurations of a motion that keeps its elbow, or with `any_elbow` of every motion."""
        return Sheets(self.workspace, (-1.0, 1.0) if self.any_elbow else (self.elbow,))

    @cached_property
    def whole(self) -> Passage:
        """The same with any elbow."""
        return Passage(self.workspace, *self.indices, any_elbow=True)

    def _gaps(self, line: Line) -> list[tuple[float, float]]:
        """The gaps on a line, as intervals of the distance to the left of the point nearest to the start [m]."""
        origin, along = self.points(line)
        outer, middle = self.workspace.chain.reach[1], float(along @ (self.workspace.chain.base - origin))
        return self.sheets.gaps(origin, along, middle - outer, middle + outer, FINEST * self.workspace.size)

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
        """What a path to this arc comes in over: its chord, or a tangent up to where both meet, or the base."""
        (a, b), (inner, outer) = branch.arc, self.workspace.chain.reach
        if branch.edge == "inner" and inner == 0:
            return Wall(tip=self.workspace.chain.base, contact="touch")
        if branch.edge == "outer":
            first, last = outer * unit(a), outer * unit(b)
        else:
            first, last = inner * unit((a, b)[branch.tangent]), inner / math.cos((b - a) / 2) * unit((a + b) / 2)
        step = last - first
        tip = self.workspace.chain.base + first
        return Wall(tip=tip, direction=-step / math.hypot(*step), opening=math.hypot(*step))

    def _must_come_in(self, branch: Turned) -> bool:
        """Whether start or goal is outside of what arc and segments enclose, so that a path to the arc crosses them."""
        (a, b), (inner, outer) = branch.arc, self.workspace.chain.reach
        room = 1e-12 * self.workspace.size
        for state in (self.maneuver.start, self.maneuver.goal):
            s = np.array(state.position) - self.workspace.chain.base
            if branch.edge == "inner" and inner == 0:
                outside = math.hypot(*s) > room
            elif branch.edge == "outer":
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


def passages(workspace: Workspace) -> list[Passage]:
    """Every free start configuration with every free goal configuration."""
    asked = workspace.maneuver
    free = [
        [k for k, theta in enumerate(postures(asked.arm, pose)) if workspace.touched(np.array(theta)) is None]
        for pose in (asked.start, asked.goal)
    ]
    return [Passage(workspace, a, b) for a in free[0] for b in free[1]]
