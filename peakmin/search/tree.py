"""The least peak past blocks: ways through the gaps between them, best bound first, walls where a path needs them.

A node has gaps left in every strip and a few lines; on each line a wall leaves the hull of the gaps free. Its certified
least peak bounds every path with such a way from below. Where its path leaves the hull, a line is put in at the worst
place; where it is in the hull but in no gap, the node falls into one for each gap of that strip. A path found free
is an upper end; where it cuts into a block by a little, its walls are raised by a little.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..deadline import over
from ..proofs.branch_and_bound import Certificate, least_over_times
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal
from ..scenes.blocks import Branch, Cells, Line, Way
from ..scenes.kept import keeping
from ..spec.maneuver import Maneuver
from ..spec.spec import MOST_CERTIFIED
from ..types import Array, Progress

SAMPLES = 2000  # of a path when looking for its worst place; what is free is proved by `peakmin.geometry.clearance`
SNAP = 0.05  # of a strip: a line this close to the strip's end is put there, where the corner is
A_LITTLE = 0.05  # of the scene: a path that is no deeper in a block is raised clear of it
NEAR = 0.03  # of the way: lines closer than this replace each other
IDLE = 1e-6  # of the largest multiplier
FEW = 3  # samples in a strip, below which its ends are looked at
LEVEL = 1e-6  # relative: places that are so nearly as far off as each other count as equal
SHALLOW = 1e-7  # of the scene: a path no deeper in a block is left to be raised
FIRST_LIFT = 1e-8  # of the scene
LIFTS = 8
PATIENCE, WORTH = 12, 0.9  # steps in which the gap must have come down to this share of itself, or the search ends
BOXES, MORE = 80, 10  # of obstacle times at first, for one wall; times as many where a node's own gap is what is left


@dataclass(frozen=True)
class Free:
    """A path past walls: the maneuver with them, the obstacle times [scaled] (q,), and its peak [m/s^2].

    way, lines, lift: what `Cells.maneuver_past` makes the walls from.
    """

    way: Way
    lines: tuple[Line, ...]
    lift: float
    past: Maneuver
    times: Array
    peak: float


@dataclass(frozen=True)
class Found:
    """What the search proved: lower <= the least peak of all free paths [m/s^2], with the branches that prove it.

    best: the best free path met, or None;  nearest: else the path of the best bound.
    """

    lower: float
    branches: tuple[Branch, ...]
    best: Free | None
    nearest: Free
    nodes: int
    rounds: int


@dataclass(frozen=True)
class _Node:
    way: Way
    lines: tuple[Line, ...]
    past: Maneuver
    certificate: Certificate
    bound: float  # and the branch that proves it, this node's own or an ancestor's
    branch: Branch
    tried: frozenset[Line] = frozenset()  # lines that were put in on the way here

    @property
    def mass(self) -> PointMass:
        return PointMass.of(self.past)


def _boxes(walls: int, effort: int) -> int:
    """Boxes for so many walls: each takes longer the more there are, and another line may do more."""
    return effort * max(BOXES // max(walls, 1) ** 2, 4)


class Search:
    """Best-first search over the ways of one maneuver with blocks."""

    def __init__(self, cells: Cells, gap: float, node_limit: int, until: float = math.inf) -> None:
        self.maneuver, self.gap, self.cells = cells.maneuver, gap, cells
        self._most, self._until = node_limit, until
        self.boxes = self.rounds = 0
        self.best: Free | None = None
        self._serial = itertools.count()
        self._heap: list[tuple[float, int, _Node]] = []
        self._closed: list[_Node] = []

    @property
    def upper(self) -> float:
        """The least peak of a free path that is known [m/s^2]."""
        return math.inf if self.best is None else self.best.peak

    @property
    def _nodes(self) -> list[_Node]:
        """The nodes that together stand for every way."""
        return [node for _, _, node in self._heap] + self._closed

    @property
    def lower(self) -> float:
        """No free path has a smaller peak [m/s^2]."""
        return min(self.upper, *(node.bound for node in self._nodes))

    def run(self, way: Way, rounds: int, progress: Progress | None) -> Found:
        """Search until the gap is reached or comes down no more, or for so many rounds, boxes and seconds."""
        self._push(self._solve(way, ()))
        last, stalled, gap = self._heap[0][2], 0, 1.0
        while self._heap and self._heap[0][0] < (1 - self.gap) * self.upper:
            if stalled >= PATIENCE or self.rounds >= rounds or self.boxes >= self._most or over(self._until):
                break
            last = heapq.heappop(self._heap)[2]
            for child in self._expand(last):
                self._push(child)
            left = 1 - self.lower / self.upper if self.upper else 0.0
            stalled, gap = (0, left) if math.isinf(self.upper) or left < WORTH * gap else (stalled + 1, gap)
            if progress:
                progress(self.rounds, self.rounds + len(self._heap))
        branches = tuple(node.branch for node in self._nodes)
        return Found(self.lower, branches, self.best, self._as_free(last), self.boxes, self.rounds)

    def _as_free(self, node: _Node) -> Free:
        found = node.certificate
        return Free(node.way, node.lines, 0.0, node.past, found.times, found.best.upper * node.mass.unit)

    def _push(self, node: _Node | None) -> None:
        if node is not None:
            heapq.heappush(self._heap, (node.bound, next(self._serial), node))

    def _solve(
        self,
        way: Way,
        lines: tuple[Line, ...],
        parent: _Node | None = None,
        path: Array | None = None,
        effort: int = 1,
    ) -> _Node | None:
        """The certified least peak past these lines; None where no path has such a way.

        Args:
            parent: whose bound holds too.
            path: samples of a path that crosses the lines at about the right times.
            effort: times as many boxes of obstacle times as at first.
        """
        past = self.cells.maneuver_past(way, lines)
        if past is None:
            return None
        self.rounds += 1
        mass, start = PointMass.of(past), None
        if path is not None:
            start = np.array([np.argmax(path[:, 0] >= x) / SAMPLES for x, _ in self.cells.marks(way, lines)])
        boxes = min(_boxes(mass.walls, effort), max(self._most - self.boxes, 1))
        found = least_over_times(mass, self.gap / 4, node_limit=boxes, until=self._until, start=start)
        self.boxes += found.nodes
        bound, branch = found.lower * mass.unit, Branch(way, lines, tuple(found.leaves))
        tried = frozenset(lines)
        if parent is not None:
            tried |= parent.tried
            if parent.bound > bound:
                bound, branch = parent.bound, parent.branch
        return _Node(way, lines, past, found, bound, branch, tried)

    def _expand(self, node: _Node) -> Iterator[_Node | None]:
        """The nodes that together stand for this one; it is closed where nothing can be done for it."""
        path = self._path(node)
        outside = self._outside(node.way, path)
        if outside.depth <= A_LITTLE * self.cells.size:
            self._raise(node)
        room = SHALLOW * self.cells.size
        if node.bound >= (1 - self.gap) * self.upper:
            self._closed.append(node)
        elif outside.hull > room and len(node.past.walls) < MOST_CERTIFIED and outside.line not in node.lines:
            yield self._solve(node.way, self._with(node, outside.line), node, path)
        elif outside.depth > room and len(node.way[outside.strip]) > 1:
            for gap in node.way[outside.strip]:
                if over(self._until):  # the rest of its ways stays with the node
                    self._closed.append(node)
                    return
                way = self.cells.through(tuple((gap,) if k == outside.strip else g for k, g in enumerate(node.way)))
                if way is None:
                    continue
                there = self._outside(way, path)
                lines = self._with(node, there.line) if there.hull > room else node.lines
                yield self._solve(way, lines, node, path)
        elif not node.certificate.complete and node.certificate.nodes < _boxes(len(node.past.walls), MORE):
            yield self._solve(node.way, node.lines, node, path, MORE)
        else:
            self._closed.append(node)

    def _with(self, node: _Node, line: Line) -> tuple[Line, ...]:
        """The lines that matter and this one, in place of those close to it unless it has been tried already.

        Around a rounded corner the one line that is needed is so found; lines side by side make times coincide.
        """
        lines = [other for other in self._pushing(node) if other != line]
        if line not in node.tried:
            lines = [other for other in lines if abs(other[0] - line[0]) > NEAR * self.cells.length]
        return (*lines, line)

    def _pushing(self, node: _Node) -> tuple[Line, ...]:
        """The lines whose walls matter to the node's path; without the others it is the same."""
        size = np.hypot(*node.certificate.best.multipliers.T)
        push = size[2:] > IDLE * np.max(size)
        marks = self.cells.marks(node.way, node.lines)
        return tuple(x for x, pushes in zip(marks, push, strict=True) if pushes)

    def _path(self, node: _Node) -> Array:
        """Samples of the node's path in the frame, shape (SAMPLES + 1, 2)."""
        motion = node.certificate.best.motion.in_units(node.mass)
        return self.cells.frame.position(motion.position(self.maneuver.duration * np.arange(SAMPLES + 1) / SAMPLES))

    def _outside(self, way: Way, path: Array) -> _Outside:
        """Where the path is furthest from the gaps, and where a line with the hull of the gaps would move it most."""
        cells, worst = self.cells, _Outside()
        for k, (left, right) in enumerate(zip(cells.lines, cells.lines[1:], strict=False)):
            inside = (path[:, 0] >= left) & (path[:, 0] <= right) & (path[:, 0] > 0) & (path[:, 0] < cells.length)
            there = path[inside]
            if len(there) < FEW:  # a strip so thin that a path crosses it between two samples
                there = np.concatenate([there, *(_crossings(path, x) for x in (left, right) if 0 < x < cells.length)])
            if not len(there) or not way[k]:
                continue
            x, y = there.T
            sections = [cells.gaps[k][g].at(x) for g in way[k]]
            low, high = (np.array([np.broadcast_to(ends[i], x.shape) for ends in sections]) for i in (0, 1))
            depth = np.min(np.maximum(np.maximum(low - y, y - high), 0.0), axis=0)
            at = int(np.argmax(depth))
            if depth[at] > worst.depth:
                worst = replace(worst, depth=float(depth[at]), strip=k)
            off = np.maximum(np.maximum(np.min(low, axis=0) - y, y - np.max(high, axis=0)), 0.0)
            # where a path runs along an edge, all of it is as far off: then where a corner is
            furthest = np.flatnonzero(off >= np.max(off) * (1 - LEVEL))
            at = int(furthest[np.argmin(np.minimum(x[furthest] - left, right - x[furthest]))])
            if off[at] > worst.hull:
                worst = replace(worst, hull=float(off[at]), line=(self._snapped(float(x[at]), left, right), k))
        return worst

    def _snapped(self, x: float, left: float, right: float) -> float:
        near = SNAP * (right - left)
        if x - left < near and left > 0:
            return left
        if right - x < near and right < self.cells.length:
            return right
        return x

    def _raise(self, node: _Node) -> None:
        """A free path near the node's, its walls raised as little as it takes; kept where it is the best."""
        size, lift = self.cells.size, FIRST_LIFT * self.cells.size
        for _ in range(LIFTS):
            past = self.cells.maneuver_past(node.way, node.lines, lift)
            if past is None or lift > 2 * A_LITTLE * size or over(self._until):
                return
            mass = PointMass.of(past)
            found = extremal(mass, node.certificate.times)
            peak = found.upper * mass.unit
            if not peak < self.upper:
                return
            kept = keeping(self.maneuver, found.motion.in_units(mass))
            short = -min(kept.walls, kept.blocks)
            if not short > 0:
                self.best = Free(node.way, node.lines, lift, past, node.certificate.times, peak)
                return
            if not node.past.walls:
                return
            lift += max(1.3 * short, FIRST_LIFT * size)


def _crossings(path: Array, x: float) -> Array:
    """Where a path through samples (n, 2) crosses the line at x, (m, 2)."""
    k = np.flatnonzero((path[:-1, 0] < x) != (path[1:, 0] < x))
    share = (x - path[k, 0]) / (path[k + 1, 0] - path[k, 0])
    return np.stack([np.full(len(k), x), path[k, 1] + share * (path[k + 1, 1] - path[k, 1])], axis=1)


@dataclass(frozen=True)
class _Outside:
    """depth: how far [m] the path is from any gap, in `strip`;  hull: from the hull of the gaps, at `line`."""

    depth: float = 0.0
    strip: int = 0
    hull: float = 0.0
    line: Line = (0.0, 0)
