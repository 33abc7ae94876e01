"""A tree of gaps: best bound first over the orders in which paths pass the gaps of lines, with its proof.

A node stands for the paths of one order; its certified least peak bounds them. Where a node's path hits something, a
line is put through the place and turned so that the path must go furthest along it to get out, or, where the path cuts
in by a little only, the contact is slid along to where it stands best. The node falls into one for every gap of that
line. A path that is free is an upper end; one that cuts in by a little has its gaps narrowed by a little.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..deadline import over
from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Leaf
from ..proofs.branch_and_bound import Certificate
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal
from ..robots.joint_space import JointWay
from ..robots.kinematics import unit
from ..robots.link_clearance import link_clearance
from ..scenes.arm_proof import Branch, looked_at, split
from ..scenes.passages import IDLE, SHALLOW, Line, Order, Passage, deepest, slid
from ..spec.maneuver import Maneuver
from ..types import Array
from .course import Steered, steered

SAMPLES = 400  # of a path when looking for its worst place; what is free is proved by `link_clearance`
NEAR, TURNED = 0.02, 0.3  # of the arm, and rad: lines less apart replace each other
MOST_LINES = 2  # conditions of one node
A_LITTLE = 0.03  # of the arm: a path no further inside is raised clear of what it touches
FIRST_LIFT = 2e-6  # of the arm: above what a clearance is proved to
LIFTS = 10
STEERED = (3, 6, 12)  # steps of a search without a free motion at which one is looked for
BOXES, MORE = 6, 20  # of obstacle times at first; times as many where a node's own gap is what is left
PATIENCE, WORTH = 6, 0.9  # steps in which the gap must have come down to this share of itself, or the search ends


@dataclass(frozen=True)
class Candidate:
    """A motion past walls: its passage, its order and lift, obstacle times [scaled] and peak [m/s^2]."""

    passage: Passage
    paths: Order
    lift: float
    past: Maneuver
    times: Array
    peak: float


@dataclass
class Node:
    """The paths with one order: the bound [m/s^2] is its own one or its parent's."""

    order: Order
    bound: float
    own: float
    leaves: tuple[Leaf, ...]
    certificate: Certificate
    past: Maneuver
    line: Line | None = None
    children: list[_Child | None] = field(default_factory=list)

    def branch(self) -> Branch:
        """The proof of this node and all below it."""
        below = [
            None if child is None else replace(child.node.branch(), ends=child.ends, dropped=child.dropped)
            for child in self.children
        ]
        return Branch(self.leaves, self.line, tuple(below))


@dataclass
class _Child:
    """A class that a node falls into, and the node that stands for it: with which ends and without which conditions."""

    node: Node
    ends: tuple[bool, bool]
    dropped: tuple[int, ...]


Certify = Callable[[Maneuver, int, Array | None, float], Certificate]  # boxes, times to start from, enough [m/s^2]


class Tree:
    """The search over one passage's orders; `way`: one that is free, if it is known."""

    def __init__(
        self, passage: Passage, gap: float, certify: Certify, until: float, way: JointWay | None = None
    ) -> None:
        self.passage, self.gap, self._certify, self._until, self.way = passage, gap, certify, until, way
        self.workspace = passage.workspace
        self.best: Candidate | None = None
        self.steered: Steered | None = None
        self._enough = math.inf
        self._heap: list[tuple[float, int, Node]] = []
        self._closed: list[Node] = []
        self._serial = itertools.count()
        root = self._solve(())
        assert root is not None
        self.root = self.last = root
        self._push(root)

    @property
    def lower(self) -> float:
        """No path has a smaller peak [m/s^2]; infinite where none is left."""
        return min((node.bound for node in [*(node for _, _, node in self._heap), *self._closed]), default=math.inf)

    @property
    def _limit(self) -> float:
        """A bound [m/s^2] that says no."""
        return (self.passage.asked.max_peak or math.inf) * (1 + 1e-9)

    @property
    def upper(self) -> float:
        """The least peak of a free motion that was met [m/s^2]."""
        return min((one.peak for one in (self.best, self.steered) if one is not None), default=math.inf)

    def _steer(self, node: Node) -> None:
        """A free motion around the node's, found in another way; kept where it is the best."""
        found = steered(self.passage, node.past, node.certificate.times, self.way, self._until)
        if found is not None and found.peak < self.upper:
            self.steered = found

    def run(self, upper: float, stop: Callable[[], bool]) -> None:
        """Search until the gap to a peak that is known, or to the best found, is reached or comes down no more."""
        stalled, gap, expanded = 0, 1.0, 0
        while self._heap and not stop():
            self._enough = known = min(upper, self.upper)
            if self._heap[0][0] >= min((1 - self.gap) * known, self._limit) or stalled >= PATIENCE:
                break
            self.last = heapq.heappop(self._heap)[2]
            expanded += 1
            if self.best is None and self.passage.keeps and expanded in STEERED:
                self._steer(self.last)
            for child in self._expand(self.last, known):
                self._push(child)
            known = min(known, self.upper)
            left = 1 - min(self.lower, known) / known if known > 0 else 0.0
            stalled, gap = (0, left) if left < WORTH * gap else (stalled + 1, gap)
        if self.passage.keeps and math.isinf(min(upper, self.upper)) and self.lower < self._limit:
            self._steer(self.last)

    def _push(self, node: Node | None) -> None:
        if node is not None:
            heapq.heappush(self._heap, (node.bound, next(self._serial), node))

    def _solve(
        self, order: Order, parent: Node | None = None, path: Array | None = None, effort: int = 1
    ) -> Node | None:
        """The node of the paths with this order; None where there are none."""
        past = self.passage.past(order)
        if past is None:
            return None
        start = None
        if path is not None:
            at = [np.argmax(self._ahead(one.line, path) >= 0) / SAMPLES for one in order]
            start = np.maximum.accumulate(np.array(at))
        found = self._certify(past, effort * BOXES, start, self._enough)
        own = found.lower * PointMass.of(past).unit
        bound = max(own, 0.0 if parent is None else parent.bound)
        return Node(order, bound, own, tuple(found.leaves), found, past)

    def _ahead(self, line: Line, path: Array) -> Array:
        """How far beyond a line places (..., 2) are [m]."""
        return np.asarray((path - np.array(self.passage.maneuver.start.position)) @ unit(line.angle) - line.offset)

    def motion(self, past: Maneuver, times: Array) -> tuple[Trajectory, float]:
        """The continuous motion of least peak past these walls at these times, and its peak [m/s^2]."""
        mass = PointMass.of(past)
        found = extremal(mass, times)
        return found.motion.in_units(mass), found.upper * mass.unit

    def _expand(self, node: Node, upper: float) -> Iterator[Node | None]:
        """The nodes that together stand for this one; it is closed where nothing can be done for it."""
        path, slack = self.samples(node.certificate.best.motion.in_units(PointMass.of(node.past)))
        if np.min(slack) >= -A_LITTLE * self.workspace.size and self.passage.keeps:
            self._raise(node, upper)
        if node.bound >= (1 - self.gap) * upper or over(self._until):
            self._closed.append(node)
            return
        line = None
        if np.min(slack) < -SHALLOW * self.workspace.size:
            if np.min(slack) >= -A_LITTLE * self.workspace.size:
                line = slid(self.passage, node.order, node.certificate.best.multipliers)
            line = line or deepest(self.passage, node.order, path, slack, self._until)
        if line is None:
            if node.certificate.complete or node.certificate.nodes >= MORE * BOXES:
                self._closed.append(node)
                return
            again = self._solve(node.order, node, path, MORE)
            assert again is not None
            node.certificate, node.leaves = again.certificate, again.leaves
            node.own, node.bound = again.own, again.bound
            yield node
            return
        node.line = line
        solved: dict[Order, Node] = {}  # classes that look at the same conditions are one node
        for place, order in split(self.passage, node.order, line):
            known = len(solved)
            child = self._child(node, place, order, path, solved)
            node.children.append(child)
            if child is not None and len(solved) > known:
                yield child.node

    def _child(self, node: Node, place: int, order: Order, path: Array, solved: dict[Order, Node]) -> _Child | None:
        """The node of one class: with as few conditions, and ends of its gap, as prove what more of them would."""
        passage, line = self.passage, order[place].line
        if passage.past(order) is None:
            return None
        origin, along = passage.points(line)
        low, high = passage.gaps(line)[order[place].gap]
        first = int(np.argmax(self._ahead(line, path) >= 0))
        below = float(along @ (path[first] - origin)) < (low + high) / 2

        def solve(ends: tuple[bool, bool], dropped: tuple[int, ...]) -> Node:
            own = looked_at(order, place, ends, dropped)
            if own not in tried and (found := solved.get(own) or self._solve(own, node, path)) is not None:
                tried[own] = found
            return tried[own]

        tried: dict[Order, Node] = {}
        dropped, ends = self._dropped(node, place, line), (below, not below)
        child = solve(ends, dropped)
        if child.own < node.own * (1 - 1e-9) and (fewer := self._dropped(node, place)) != dropped:
            dropped = fewer
            child = solve(ends, dropped)
        now = place - sum(k < place for k in dropped)
        motion = child.certificate.best.motion.in_units(PointMass.of(child.past))
        at = motion.position(child.certificate.times[now] * self.passage.asked.duration)
        room = 1e-9 * self.workspace.size
        if not low - room <= float(along @ (at - origin)) <= high + room:
            ends = (True, True)
            child = solve(ends, dropped)
        solved.setdefault(child.order, child)
        return _Child(child, ends, dropped)

    def samples(self, motion: Trajectory) -> tuple[Array, Array]:
        """Places of the centre of mass, (SAMPLES + 1, 2), and how far from touching or unreachable the arm is there."""
        path = motion.position(self.passage.asked.duration * np.arange(SAMPLES + 1) / SAMPLES)
        return path, self.passage.sheets.slack(path)

    def _dropped(self, node: Node, place: int, line: Line | None = None) -> tuple[int, ...]:
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

    def _raise(self, node: Node, upper: float) -> None:
        """A free motion near the node's, its gaps narrowed as little as it takes; kept where it is the best."""
        size, lift = self.workspace.size, FIRST_LIFT * self.workspace.size if node.order else 0.0
        for _ in range(LIFTS):
            past = self.passage.past(node.order, lift)
            if past is None or lift > 2 * A_LITTLE * size:
                return
            motion, peak = self.motion(past, node.certificate.times)
            if not peak < upper:
                return
            _, slack = self.samples(motion)
            short = -float(np.min(slack))
            if short <= 0:
                clear = link_clearance(self.workspace, self.passage.joints(motion))
                short = clear.short(self.workspace)
                if short <= 0:
                    self.best = Candidate(self.passage, node.order, lift, past, node.certificate.times, peak)
                    return
            if not node.order:
                return
            lift += max(1.3 * short, FIRST_LIFT * size)
