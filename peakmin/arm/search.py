"""The least peak of a two-link arm's motions: best bound first over gaps, edges and elbows, with their proof.

A node stands for the paths of one order of gaps, or for those that touch an arc of an edge; its certified least peak
bounds them. Where a node's path hits something, a line is put through the place and turned so that the path must go
furthest along it to get out: the node falls into one for every gap of that line. A path that is free is an upper end;
one that cuts in by a little has its gaps narrowed by a little.
"""

from __future__ import annotations

import heapq
import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array
from ..branch import Certificate, certify
from ..certify import Leaf
from ..circle import Disc, Polygon
from ..exact import extremal
from ..moments import PointMass
from ..progress import Progress
from ..spec import Maneuver
from ..trajectory import Trajectory
from .clearance import link_clearance
from .joints import JointPath
from .kinematics import unit
from .proof import (
    ArmProof,
    Branch,
    Edge,
    Line,
    Order,
    Passage,
    PassageProof,
    Through,
    Touching,
    Turned,
    looked_at,
    passages,
    split,
)
from .turn import Turn, turn_on
from .workspace import Workspace

SAMPLES = 400  # of a path when looking for its worst place; what is free is proved by `link_clearance`
TURNS, PLACES, STEPS = 24, 16, 120  # lines looked at: directions, places of the path, steps along each
WINDOW, GRID = 0.03, 21  # of the arm: how far around a contact a better place is looked for; grid points each way
NEAR, TURNED = 0.02, 0.3  # of the arm, and rad: lines less apart replace each other
MOST_LINES = 4  # conditions of one node
IDLE = 1e-6  # of the largest multiplier
SHALLOW = 1e-6  # of the arm: a path no further inside is left to be raised
A_LITTLE = 0.03  # of the arm: a path no further inside is raised clear of what it touches
FIRST_LIFT = 2e-6  # of the arm: above what a clearance is proved to
LIFTS = 10
ARCS = 6  # of each edge at first
NARROW = 1e-3  # rad: an arc is not split further
MOST_TURNS = 6  # motions with a change of elbow that are looked for
PATIENCE, WORTH = 15, 0.9
BOXES, MORE = 12, 20  # of obstacle times at first; times as many where a node's own gap is what is left


@dataclass(frozen=True)
class Candidate:
    """A motion past walls: its passage, its order and lift, obstacle times [scaled] and peak [m/s^2]."""

    passage: Passage
    paths: Order
    lift: float
    past: Maneuver
    times: Array
    peak: float


@dataclass(frozen=True)
class Found:
    """lower <= the least peak of all free motions [m/s^2], with its proof.

    best: the best free motion met that keeps its elbow, or None;  turned: that turns it over;  nearest: a motion that
    keeps its elbow and hits something, or None.
    """

    lower: float
    proof: ArmProof
    best: Candidate | None
    turned: Turn | None
    nearest: Candidate | None
    nodes: int
    rounds: int


@dataclass
class Arc:
    """The paths that touch an arc: the bound [m/s^2], its proof, and how the best of them does so."""

    passage: Passage
    bound: float
    proof: Touching
    certificate: Certificate
    past: Maneuver


@dataclass
class _Node:
    """The paths with one order: the bound [m/s^2] is its own one or its parent's."""

    passage: Passage
    order: Order
    bound: float
    own: float
    leaves: tuple[Leaf, ...]
    certificate: Certificate
    past: Maneuver
    ends: tuple[bool, bool] = (True, True)
    dropped: tuple[int, ...] = ()
    line: Line | None = None
    children: list[_Node | None] = field(default_factory=list)

    def branch(self) -> Branch:
        """The proof of this node and all below it."""
        below = tuple(None if child is None else child.branch() for child in self.children)
        return Branch(self.leaves, self.line, below, self.ends, self.dropped)


class ArmSearch:
    """Best-first search over all passages of one maneuver of a two-link arm."""

    def __init__(self, workspace: Workspace, gap: float, circle: Disc | Polygon) -> None:
        self.workspace, self.gap, self.circle = workspace, gap, circle
        self.boxes = self.rounds = 0
        self.best: Candidate | None = None
        self._heap: list[tuple[float, int, _Node | Arc]] = []
        self._closed: list[_Node | Arc] = []
        self._roots: dict[tuple[int, int], _Node] = {}
        self._serial = itertools.count()
        self._until = math.inf
        self.turned: Turn | None = None
        self._turns = 0

    @property
    def upper(self) -> float:
        """The least peak of a free motion that is known [m/s^2]."""
        best, turned = self.best, self.turned
        return min(math.inf if best is None else best.peak, math.inf if turned is None else turned.peak)

    @property
    def _nodes(self) -> list[_Node | Arc]:
        """The nodes that together stand for every motion."""
        return [node for _, _, node in self._heap] + self._closed

    @property
    def lower(self) -> float:
        """No free motion has a smaller peak [m/s^2]."""
        return min(self.upper, *(node.bound for node in self._nodes))

    def run(self, rounds: int, time_limit: float, progress: Progress | None = None) -> Found:
        """Search until the gap is reached or comes down no more, or for so many rounds and seconds."""
        self._until = time.perf_counter() + time_limit
        every = passages(self.workspace)
        if not self._roots and not self._heap:
            self._begin(every)
        stalled, gap, last = 0, 1.0, None
        while self._heap and self._heap[0][0] < (1 - self.gap) * self.upper:
            if stalled >= PATIENCE or self.rounds >= rounds or time.perf_counter() > self._until:
                break
            node = heapq.heappop(self._heap)[2]
            last = node if isinstance(node, _Node) else last
            for child in self._halves(node) if isinstance(node, Arc) else self._expand(node):
                self._push(child)
            left = 1 - self.lower / self.upper
            stalled, gap = (0, left) if left < WORTH * gap else (stalled + 1, gap)
            if progress:
                progress(self.rounds, self.rounds + len(self._heap))
        arcs = sorted((node for node in self._nodes if isinstance(node, Arc)), key=lambda arc: arc.bound)
        proofs = tuple(
            PassageProof(
                passage.indices,
                self._roots[passage.indices].branch() if passage.indices in self._roots else None,
                tuple(arc.proof for arc in arcs if arc.passage.indices == passage.indices),
            )
            for passage in every
        )
        nearest = None
        if last is not None:
            nearest = Candidate(last.passage, last.order, 0.0, last.past, last.certificate.times, last.bound)
        return Found(self.lower, ArmProof(proofs), self.best, self.turned, nearest, self.boxes, self.rounds)

    def _begin(self, every: list[Passage]) -> None:
        for passage in every:
            if passage.keeps:
                root = self._solve(passage, ())
                assert root is not None
                self._roots[passage.indices] = root
                self._push(root)
            for edge in passage.edges:
                for arc in itertools.pairwise(np.linspace(-math.pi, math.pi, ARCS + 1).tolist()):
                    self._push(self._arc(passage, edge, arc))

    def _push(self, node: _Node | Arc | None) -> None:
        if node is not None:
            heapq.heappush(self._heap, (node.bound, next(self._serial), node))

    def _certify(self, past: Maneuver, boxes: int, start: Array | None = None) -> Certificate:
        mass = PointMass.of(past)
        self.rounds += 1
        left = self._until - time.perf_counter()
        found = certify(mass, self.gap / 4, node_limit=boxes, time_limit=left, start=start)
        self.boxes += found.nodes
        return found

    def _arc(self, passage: Passage, edge: Edge, arc: tuple[float, float]) -> Arc:
        """The paths that touch an arc."""
        solved = []
        for one in Touching(edge, arc, ()).paths:
            past = passage.past(one)
            assert past is not None
            found = self._certify(past, BOXES, np.full(len(past.walls), 0.5))
            solved.append((found.lower * PointMass.of(past).unit, found, past))
        bound, found, past = min(solved, key=lambda one: one[0])
        proof = Touching(edge, arc, tuple(tuple(one.leaves) for _, one, _ in solved))
        return Arc(passage, bound, proof, found, past)

    def _halves(self, arc: Arc) -> Iterator[Arc]:
        """An arc's two halves; where a motion of least bound has to turn its elbow over, one such motion first."""
        a, b = arc.proof.arc
        if not arc.passage.keeps and self._turns < MOST_TURNS:
            self._turns += 1
            found = turn_on(self.workspace, arc.passage, arc.proof.edge, arc.certificate, arc.past, self.circle)
            if found is not None and found.peak < self.upper:
                self.turned = found
        if b - a <= NARROW:
            self._closed.append(arc)
            return
        for half in ((a, (a + b) / 2), ((a + b) / 2, b)):
            yield self._arc(arc.passage, arc.proof.edge, half)

    def _solve(
        self, passage: Passage, order: Order, parent: _Node | None = None, path: Array | None = None, effort: int = 1
    ) -> _Node | None:
        """The node of the paths with this order; None where there are none."""
        past = passage.past(order)
        if past is None:
            return None
        start = None
        if path is not None:
            at = [np.argmax(self._ahead(passage, one.line, path) >= 0) / SAMPLES for one in order]
            start = np.maximum.accumulate(np.array(at))
        found = self._certify(past, effort * BOXES, start)
        own = found.lower * PointMass.of(past).unit
        bound = max(own, 0.0 if parent is None else parent.bound)
        return _Node(passage, order, bound, own, tuple(found.leaves), found, past)

    @staticmethod
    def _ahead(passage: Passage, line: Line, path: Array) -> Array:
        """How far beyond a line places (..., 2) are [m]."""
        return np.asarray((path - np.array(passage.maneuver.start.position)) @ unit(line.angle) - line.offset)

    def motion(self, past: Maneuver, times: Array) -> tuple[Trajectory, float]:
        """The continuous motion of least peak past these walls at these times, and its peak [m/s^2]."""
        mass = PointMass.of(past)
        found = extremal(mass, times)
        return found.motion.in_units(mass), found.upper * mass.unit

    def joints(self, passage: Passage, motion: Trajectory) -> JointPath:
        """The joints' motion that belongs to a motion of the centre of mass that keeps its elbow."""
        return JointPath(self.workspace.chain, motion, (0, 1), passage.elbow, (), None, passage.theta[0])

    def _expand(self, node: _Node) -> Iterator[_Node | None]:
        """The nodes that together stand for this one; it is closed where nothing can be done for it."""
        path, slack = self.samples(node.passage, node.certificate.best.motion.in_units(PointMass.of(node.past)))
        if np.min(slack) >= -A_LITTLE * self.workspace.size:
            self._raise(node)
        if node.bound >= (1 - self.gap) * self.upper:
            self._closed.append(node)
            return
        line = None
        if np.min(slack) < -SHALLOW * self.workspace.size:
            if np.min(slack) >= -A_LITTLE * self.workspace.size:
                line = self._slid(node)
            line = line or self._line(node, path, slack)
        if line is None:
            if node.certificate.complete or node.certificate.nodes >= MORE * BOXES:
                self._closed.append(node)
                return
            again = self._solve(node.passage, node.order, node, path, MORE)
            assert again is not None
            node.certificate, node.leaves = again.certificate, again.leaves
            node.own, node.bound = again.own, again.bound
            yield node
            return
        node.line = line
        for place, order in split(node.passage, node.order, line):
            child = self._child(node, place, order, path)
            node.children.append(child)
            yield child

    def _child(self, node: _Node, place: int, order: Order, path: Array) -> _Node | None:
        """The node of one class: with as few conditions, and ends of its gap, as prove what more of them would."""
        passage, line = node.passage, order[place].line
        if passage.past(order) is None:
            return None
        origin, along = passage.points(line)
        low, high = passage.gaps(line)[order[place].gap]
        first = int(np.argmax(self._ahead(passage, line, path) >= 0))
        below = float(along @ (path[first] - origin)) < (low + high) / 2
        dropped, ends = self._dropped(node, place, line), (below, not below)
        child = self._solve(passage, looked_at(order, place, ends, dropped), node, path)
        assert child is not None
        if child.own < node.own * (1 - 1e-9) and (fewer := self._dropped(node, place)) != dropped:
            dropped = fewer
            child = self._solve(passage, looked_at(order, place, ends, dropped), node, path)
            assert child is not None
        now = place - sum(k < place for k in dropped)
        motion = child.certificate.best.motion.in_units(PointMass.of(child.past))
        at = motion.position(child.certificate.times[now] * self.workspace.maneuver.duration)
        room = 1e-9 * self.workspace.size
        if not low - room <= float(along @ (at - origin)) <= high + room:
            ends = (True, True)
            child = self._solve(passage, looked_at(order, place, ends, dropped), node, path)
            assert child is not None
        child.ends, child.dropped = ends, dropped
        return child

    def samples(self, passage: Passage, motion: Trajectory) -> tuple[Array, Array]:
        """Places of the centre of mass, (SAMPLES + 1, 2), and how far the arm is from touching or unreachable there."""
        path = motion.position(self.workspace.maneuver.duration * np.arange(SAMPLES + 1) / SAMPLES)
        return path, self._slack(passage, path)

    def _slack(self, passage: Passage, r: Array) -> Array:
        """How far [m] the arm with its centre of mass at r is from what it must not touch, and r from the edges."""
        chain, asked = self.workspace.chain, self.workspace.maneuver
        rho, (inner, outer) = np.hypot(*np.moveaxis(r - chain.base, -1, 0)), chain.reach
        slack = np.minimum(outer - rho, rho - inner if inner > 0 else np.inf)
        if asked.obstacles:
            theta = passage.sheet.angles(r)
            slack = np.minimum(slack, np.min(self.workspace.clearance(theta), axis=-1) - asked.margin)
        return np.asarray(slack)

    def _line(self, node: _Node, path: Array, slack: Array) -> Line | None:
        """The line through a place where the path hits something along which it is furthest to the next free place."""
        passage, shallow = node.passage, SHALLOW * self.workspace.size
        bad = np.flatnonzero(slack < -shallow)
        bad = bad[np.unique(np.linspace(0, len(bad) - 1, PLACES).astype(int))]
        bad = np.unique(np.append(bad, np.argmin(slack)))
        way = np.subtract(passage.maneuver.goal.position, passage.maneuver.start.position)
        turned = math.atan2(way[1], way[0]) + math.pi * (np.arange(TURNS) / TURNS - 0.5)
        lines = []
        for at in bad.tolist():
            for angle in turned.tolist():
                line = Line(angle, float(unit(angle) @ (path[at] - passage.maneuver.start.position)))
                known = any(
                    abs(one.line.angle - angle) < 1e-9 and abs(one.line.offset - line.offset) < shallow
                    for one in node.order
                )
                if passage.parts(line) and not known:
                    lines.append((at, line))
        if not lines:
            return None
        reach = 2 * passage.workspace.chain.reach[1]
        step = reach * (np.arange(1, STEPS + 1) / STEPS) ** 2  # finer close to the path
        step = np.concatenate([-step[::-1], step])
        across = np.array([[-math.sin(line.angle), math.cos(line.angle)] for _, line in lines])
        r = path[[at for at, _ in lines]][:, None, :] + step[:, None] * across[:, None, :]
        free = self._slack(passage, r) >= 0
        away = np.min(np.where(free, np.abs(step), np.inf), axis=1)
        return lines[int(np.argmax(np.where(np.isfinite(away), away, -1.0)))][1] if np.any(np.isfinite(away)) else None

    def _slid(self, node: _Node) -> Line | None:
        """The line on which the contact that gives way most by sliding stands best; None where all stand well.

        The least peak grows with the place w of a contact along its multiplier l. So the best place of what blocks the
        line there is the one furthest along l, and the best line the one through it along l.
        """
        passage, certificate, found = node.passage, node.certificate, None
        most = SHALLOW * self.workspace.size
        for k, one in enumerate(node.order):
            push = certificate.best.multipliers[2 + k]
            if not np.hypot(*push) > IDLE * np.max(np.abs(certificate.best.multipliers)):
                continue
            f = push / np.hypot(*push)
            origin, along = passage.points(one.line)
            low, high = passage.gaps(one.line)[one.gap]
            w = origin + (low if f @ along > 0 else high) * along
            best = self._furthest(passage, w, f)
            gain = float(f @ (best - w))
            normal = np.array([f[1], -f[0]])
            way = np.subtract(passage.maneuver.goal.position, passage.maneuver.start.position)
            normal = normal if normal @ way > 0 else -normal
            line = Line(math.atan2(normal[1], normal[0]), float(normal @ (best - passage.maneuver.start.position)))
            if gain > most and passage.parts(line):
                most, found = gain, line
        return found

    def _furthest(self, passage: Passage, w: Array, f: Array) -> Array:
        """The place near w furthest along f where the arm is blocked, by grids that close in on it."""
        across, half = np.array([-f[1], f[0]]), WINDOW * self.workspace.size
        side = np.linspace(-1, 1, GRID)
        while half > 0.1 * SHALLOW * self.workspace.size:
            r = w + half * (side[:, None, None] * f + side[None, :, None] * across)
            blocked = self._slack(passage, r) < 0
            if np.any(blocked):
                ahead = np.where(blocked, side[:, None], -np.inf)
                w = r[np.unravel_index(np.argmax(ahead), blocked.shape)]
            half *= 4 / GRID
        return np.asarray(w)

    def _dropped(self, node: _Node, place: int, line: Line | None = None) -> tuple[int, ...]:
        """Of the conditions with a new one at `place` those that do not matter to the node's path, of too many those
        that matter least, and those that the new one's line comes in place of, if it is given.
        """
        size = np.hypot(*node.certificate.best.multipliers.T)
        push = size[2:]
        near = NEAR * self.workspace.size
        idle = set(np.flatnonzero(push <= IDLE * np.max(size, initial=0.0)).tolist())
        for k, one in enumerate(node.order):
            if line and abs(one.line.offset - line.offset) < near and abs(one.line.angle - line.angle) < TURNED:
                idle.add(k)
        for k in np.argsort(push).tolist():
            if len(push) - len(idle) >= MOST_LINES:
                idle.add(k)
        return tuple(sorted(k + (k >= place) for k in idle))

    def _raise(self, node: _Node) -> None:
        """A free motion near the node's, its gaps narrowed as little as it takes; kept where it is the best."""
        size, lift = self.workspace.size, FIRST_LIFT * self.workspace.size if node.order else 0.0
        for _ in range(LIFTS):
            past = node.passage.past(node.order, lift)
            if past is None or lift > 2 * A_LITTLE * size:
                return
            motion, peak = self.motion(past, node.certificate.times)
            if not peak < self.upper:
                return
            _, slack = self.samples(node.passage, motion)
            short = -float(np.min(slack))
            if short <= 0:
                clear = link_clearance(self.workspace, self.joints(node.passage, motion))
                short = max(self.workspace.maneuver.margin - clear.least, -clear.within)
                if short <= 0:
                    self.best = Candidate(node.passage, node.order, lift, past, node.certificate.times, peak)
                    return
            if not node.order:
                return
            lift += max(1.3 * short, FIRST_LIFT * size)
