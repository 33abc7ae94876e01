"""One choice of start and goal configuration, seen by the centre of mass: its lines, gaps, edges and walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Literal

import numpy as np

from ..deadline import over
from ..geometry.norm import length, norm
from ..geometry.trajectory import Trajectory
from ..robots.joints import JointPath
from ..robots.kinematics import unit
from ..robots.link_clearance import link_clearance
from ..robots.workspace import Sheets, Workspace, bends_within
from ..spec.arm import ArmManeuver, postures
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver, State
from ..spec.obstacles import Wall
from ..types import Array
from .scene import Bounded, Manner, Plane, Samples

FINEST = 1e-8  # of the arm: to which the gaps on a line are found
NEAR, TURNED = 0.02, 0.3  # of the arm, and rad: lines less apart replace each other
MOST_LINES = 2  # conditions of one class
CLOSE = 1e-3  # of the arm: how close to its base a folded arm comes at most on a way that is kept out of things
STEP = 1e-6  # of the arm: for the slope of a clearance
BOXES, MORE = 60, 4  # of obstacle times at first; times as many where a class's own gap is what is left
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
class Whole:
    """An order with all that its paths are known to cross; the condition at `place` is the one that came last."""

    place: int
    order: Order


@dataclass(frozen=True)
class Looks:
    """Which ends of the last condition's gap count, and which conditions, that one included, are not looked at."""

    ends: tuple[bool, bool] = (True, True)
    dropped: tuple[int, ...] = ()


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

    def __init__(
        self, asked: ArmManeuver, workspace: Workspace, start: int, goal: int, any_elbow: bool = False
    ) -> None:
        self.asked, self.workspace, self.indices, self.any_elbow = asked, workspace, (start, goal), any_elbow
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
        """The circles on which the elbow can turn over, straight or folded, as far as the second joint may."""
        bends = [bend for elbow in (-1.0, 1.0) for bend in bends_within(self.limits, elbow)]
        reached = {"outer": any(near == 0 for near, _ in bends), "inner": any(far == math.pi for _, far in bends)}
        return [edge for edge in ("outer", "inner") if reached[edge]]

    @property
    def limits(self) -> tuple[float, float] | None:
        """Of the second joint [rad], which tells how far the centre of mass is from the base."""
        return self.asked.arm.links[1].limits

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
        return Sheets(self.workspace, (-1.0, 1.0) if self.any_elbow else (self.elbow,), self.limits)

    @cached_property
    def whole(self) -> Passage:
        """The same with any elbow."""
        return Passage(self.asked, self.workspace, *self.indices, any_elbow=True)

    def _gaps(self, line: Line) -> list[tuple[float, float]]:
        """The gaps on a line, as intervals of the distance to the left of the point nearest to the start [m]."""
        origin, along = self.points(line)
        outer, middle = self.workspace.chain.reach[1], float(along @ (self.workspace.chain.base - origin))
        return self.sheets.gaps(origin, along, middle - outer, middle + outer, FINEST * self.workspace.size)

    def points(self, line: Line) -> tuple[Array, Array]:
        """The line's point nearest to the start [m] and its unit vector to the left of the way, (2,) each."""
        normal = unit(line.angle)
        return self.maneuver.start.position + line.offset * normal, np.array([-normal[1], normal[0]])

    def between(self, line: Line) -> bool:
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

    # the path classes: an order of gaps each, split by one line at a time

    manner = Manner(samples=400, deep=0.03, first_lift=2e-6, lifts=10, patience=6, worth=0.9, waiting=False)

    @property
    def size(self) -> float:
        """Length of the stretched arm [m]."""
        return self.workspace.size

    @property
    def first(self) -> tuple[Whole, Looks]:
        """Every path, looked at without any line."""
        return Whole(0, ()), Looks()

    @property
    def motions(self) -> bool:
        return self.keeps

    def splits(self, one: Order, cut: Line) -> bool:
        """Whether every path crosses the line."""
        return self.between(cut)

    def parts(self, one: Order, cut: Line) -> list[Whole]:
        """The classes by the gap of one more line and its place among the conditions."""
        return [
            Whole(place, (*one[:place], Through(cut, gap, (True, True)), *one[place:]))
            for gap in range(len(self.gaps(cut)))
            for place in self.places(one, cut)
        ]

    def seen(self, part: Whole, looks: Looks) -> Order:
        """An order with these ends of one gap counted alone, and without some of its conditions."""
        every = enumerate(part.order)
        ends = looks.ends
        return tuple(replace(one, ends=ends) if k == part.place else one for k, one in every if k not in looks.dropped)

    def empty(self, part: Whole) -> bool:
        return self.past(part.order) is None

    def samples(self, one: Order, motion: Trajectory) -> Samples:
        """A path and how far from touching or unreachable the arm is there."""
        n = self.manner.samples
        places = motion.position(self.asked.duration * np.arange(n + 1) / n)
        room = self.sheets.slack(places)
        return Samples(places, -float(np.min(room)), room)

    def crossings(self, one: Order, path: Samples) -> Array:
        at = [np.argmax(self._beyond(each.line, path.places) >= 0) / self.manner.samples for each in one]
        return np.maximum.accumulate(np.array(at))

    def _beyond(self, line: Line, places: Array) -> Array:
        """How far beyond a line places (..., 2) are [m]."""
        return np.asarray((places - np.array(self.maneuver.start.position)) @ unit(line.angle) - line.offset)

    def boxes(self, walls: int, more: bool) -> int:
        return BOXES * (MORE if more else 1)

    def quick_short(self, motion: Trajectory) -> float:
        return self.samples((), motion).depth

    def short(self, motion: Trajectory) -> float:
        return link_clearance(self.workspace, self.joints(motion)).short(self.workspace)

    def step(self, here: Bounded[Order], path: Samples, until: float) -> Line | None:
        """The line through the place where the path is deepest in something, turned so that the path must go furthest
        along it to get out; or, where the path cuts in by a little only, the one on which a contact stands best.
        """
        if path.depth <= SHALLOW * self.size:
            return None
        line = None
        if path.depth <= self.manner.deep * self.size:
            line = slid(self, here.one, here.certificate.best.multipliers)
        assert path.room is not None
        return line or deepest(self, here.one, path.places, path.room, until)

    def child(
        self, part: Whole, above: Bounded[Order], path: Samples, solve: Callable[[Looks], Bounded[Order] | None]
    ) -> tuple[Looks, Bounded[Order] | None]:
        """With as few conditions, and ends of the last gap, as prove what more of them would."""
        place, line = part.place, part.order[part.place].line
        origin, along = self.points(line)
        low, high = self.gaps(line)[part.order[place].gap]
        first = int(np.argmax(self._beyond(line, path.places) >= 0))
        below = float(along @ (path.places[first] - origin)) < (low + high) / 2
        looks = Looks((below, not below), self._dropped(above, place, line))
        child = solve(looks)
        weak = child is not None and child.own < above.own * (1 - 1e-9)
        if weak and (fewer := self._dropped(above, place)) != looks.dropped:
            looks = replace(looks, dropped=fewer)
            child = solve(looks)
        if child is None:
            return looks, None
        now = place - sum(k < place for k in looks.dropped)
        at = child.motion.position(child.certificate.times[now] * self.asked.duration)
        room = 1e-9 * self.size
        if not low - room <= float(along @ (at - origin)) <= high + room:
            looks = replace(looks, ends=(True, True))
            child = solve(looks)
        return looks, child

    def planes(self, path: JointPath, t: Array, near: float) -> list[Plane]:
        """Half-planes that keep every place at times t [s], (n,), that is within `near` [m] of something, or inside, on
        the outside of it, to first order; those of an edge that is not convex among them.
        """
        workspace, r = self.workspace, path.motion.position(t)
        signs = path.elbows(t)
        out: list[Plane] = []
        s = r - workspace.chain.base
        rho, inner = norm(s), max(workspace.chain.reach[0], CLOSE * workspace.size)
        for k in np.flatnonzero(rho < inner + near):
            n = s[k] / (rho[k] or 1.0)
            if np.min(rho) < CLOSE * workspace.size:  # over the base: to one side of it
                v = path.motion.velocity(t[np.argmin(rho)])
                n = np.array([-v[1], v[0]]) / (length(v) or 1.0)
            out.append(Plane(int(k), n, inner + float(n @ workspace.chain.base)))
        if not workspace.obstacles and self.limits is None:
            return out
        step = STEP * workspace.size

        def slack(at: Array) -> Array:
            each = {sign: Sheets(workspace, (sign,), self.limits).slack(at) for sign in np.unique(signs).tolist()}
            return np.select([signs == sign for sign in each], list(each.values()))

        here = slack(r)
        slope = np.stack([(slack(r + step * e) - slack(r - step * e)) / (2 * step) for e in np.eye(2)], axis=-1)
        for k in np.flatnonzero(here < near):
            size = length(slope[k])
            if size > 1e-3:
                n = slope[k] / size
                out.append(Plane(int(k), n, float(n @ r[k]) - float(here[k]) / size))
        return out

    def _dropped(self, above: Bounded[Order], place: int, line: Line | None = None) -> tuple[int, ...]:
        """Of the conditions with a new one at `place` those that do not matter to the path, of too many those that
        matter least, and those that the new one's line comes in place of, if it is given.
        """
        size = norm(above.certificate.best.multipliers)
        push = size[2:]
        near = NEAR * self.size
        idle = set(np.flatnonzero(push <= IDLE * np.max(size, initial=0.0)).tolist())
        for k, one in enumerate(above.one):
            if line and abs(one.line.offset - line.offset) < near and abs(one.line.angle - line.angle) < TURNED:
                idle.add(k)
        for k in np.argsort(push).tolist():
            if len(push) - len(idle) >= MOST_LINES:
                idle.add(k)
        return tuple(sorted(k + (k >= place) for k in idle))

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
        return Wall(tip=tip, direction=-step / length(step), opening=length(step))

    def _must_come_in(self, branch: Turned) -> bool:
        """Whether start or goal is outside of what arc and segments enclose, so that a path to the arc crosses them."""
        (a, b), (inner, outer) = branch.arc, self.workspace.chain.reach
        room = 1e-12 * self.workspace.size
        for state in (self.maneuver.start, self.maneuver.goal):
            s = np.array(state.position) - self.workspace.chain.base
            if branch.edge == "inner" and inner == 0:
                outside = length(s) > room
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


ENDS: tuple[Literal["start", "goal"], ...] = ("start", "goal")


def passages(asked: ArmManeuver, workspace: Workspace) -> list[Passage]:
    """Every free start configuration with every free goal configuration."""
    free = [
        [
            k
            for k, theta in enumerate(postures(asked.arm, getattr(asked, name)))
            if not asked.unfit(name, theta, workspace)
        ]
        for name in ENDS
    ]
    return [Passage(asked, workspace, a, b) for a in free[0] for b in free[1]]


SHALLOW = 1e-6  # of the arm: a path no further inside counts as touching
TURNS, PLACES, STEPS = 24, 16, 120  # lines looked at: directions, places of the path, steps along each
AT_ONCE = 64  # lines
WINDOW, GRID = 0.03, 21  # of the arm: how far around a contact a better place is looked for; grid points each way
IDLE = 1e-6  # of the largest multiplier


def deepest(passage: Passage, order: Order, path: Array, slack: Array, until: float = math.inf) -> Line | None:
    """The line through a place where the path hits something along which it is furthest to the next free place.

    Args:
        order: conditions whose lines are not to come again.
        path, slack: places of the centre of mass [m], (m, 2), and how far from touching the arm is there [m], (m,).
        until: a deadline, after which the best of the lines looked at is taken.
    """
    shallow = SHALLOW * passage.workspace.size
    bad = np.flatnonzero(slack < -shallow)
    bad = bad[np.unique(np.linspace(0, len(bad) - 1, PLACES).astype(int))]
    bad = np.unique(np.append(bad, np.argmin(slack)))
    turned = passage.frame.angle + math.pi * (np.arange(TURNS) / TURNS - 0.5)
    lines = []
    for at in bad.tolist():
        for angle in turned.tolist():
            line = Line(angle, float(unit(angle) @ (path[at] - passage.maneuver.start.position)))
            known = any(
                abs(one.line.angle - angle) < 1e-9 and abs(one.line.offset - line.offset) < shallow for one in order
            )
            if passage.between(line) and not known:
                lines.append((at, line))
    if not lines:
        return None
    reach = 2 * passage.workspace.chain.reach[1]
    step = reach * (np.arange(1, STEPS + 1) / STEPS) ** 2  # finer close to the path
    step = np.concatenate([-step[::-1], step])
    found, most = None, -1.0
    for some in (lines[k : k + AT_ONCE] for k in range(0, len(lines), AT_ONCE)):
        across = np.array([[-math.sin(line.angle), math.cos(line.angle)] for _, line in some])
        r = path[[at for at, _ in some]][:, None, :] + step[:, None] * across[:, None, :]
        away = np.min(np.where(passage.sheets.slack(r) >= 0, np.abs(step), np.inf), axis=1)
        away[np.isinf(away)] = -1.0
        if np.max(away) > most:
            found, most = some[int(np.argmax(away))][1], float(np.max(away))
        if over(until):
            break
    return found


def slid(passage: Passage, order: Order, multipliers: Array) -> Line | None:
    """The line on which the contact that gives way most by sliding stands best; None where all stand well.

    The least peak grows with the place w of a contact along its multiplier l. So the best place of what blocks the
    line there is the one furthest along l, and the best line the one through it along l.

    Args:
        order: the conditions;  multipliers: of their optimum, the conditions' from the third row on.
    """
    found, most = None, SHALLOW * passage.workspace.size
    for one, push in zip(order, multipliers[2:], strict=True):
        if not length(push) > IDLE * np.max(np.abs(multipliers)):
            continue
        f = push / length(push)
        origin, along = passage.points(one.line)
        low, high = passage.gaps(one.line)[one.gap]
        w = origin + (low if f @ along > 0 else high) * along
        best = _furthest(passage, w, f)
        gain, normal = float(f @ (best - w)), np.array([f[1], -f[0]])
        normal = normal if normal @ passage.frame.along > 0 else -normal
        line = Line(math.atan2(normal[1], normal[0]), float(normal @ (best - passage.maneuver.start.position)))
        if gain > most and passage.between(line):
            most, found = gain, line
    return found


def _furthest(passage: Passage, w: Array, f: Array) -> Array:
    """The place near w furthest along f where the arm is blocked, by grids that close in on it."""
    across, half = np.array([-f[1], f[0]]), WINDOW * passage.workspace.size
    side = np.linspace(-1, 1, GRID)
    while half > 0.1 * SHALLOW * passage.workspace.size:
        r = w + half * (side[:, None, None] * f + side[None, :, None] * across)
        blocked = passage.sheets.slack(r) < 0
        if np.any(blocked):
            w = r[np.unravel_index(np.argmax(np.where(blocked, side[:, None], -np.inf)), blocked.shape)]
        half *= 4 / GRID
    return np.asarray(w)
