"""Classes of paths past blocks: by the gaps they go through, strip by strip, and the proof that covers all of them.

On each line that is looked at, a wall leaves the hull of the gaps free. The least peak past these walls bounds every
path with such a way. Where its path leaves the hull, a line is put in at the worst place; where it is in the hull but
in no gap, the class falls into one for each gap of that strip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..geometry.norm import norm
from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Leaf
from ..spec.maneuver import Maneuver
from ..spec.spec import MOST_CERTIFIED
from ..types import Array
from .cells import Cells, Mark, Way
from .kept import Keeping
from .proof_tree import Branch, leaves_bound
from .scene import Again, Bounded, Manner, Plane, Samples

SNAP = 0.05  # of a strip: a line this close to the strip's end is put there, where the corner is
NEAR = 0.03  # of the way: lines closer than this replace each other
IDLE = 1e-6  # of the largest multiplier
FEW = 3  # samples in a strip, below which its ends are looked at
LEVEL = 1e-6  # relative: places that are so nearly as far off as each other count as equal
SHALLOW = 1e-7  # of the scene: a path no deeper in a block is left to be raised
BOXES, MORE = 80, 10  # of obstacle times at first, for one wall; times as many where a class's own gap is left

Marks = tuple[Mark, ...]


@dataclass(frozen=True)
class WayClass:
    """The paths with one of these ways, and the lines on which they are looked at."""

    way: Way
    lines: Marks


@dataclass(frozen=True)
class Outside:
    """depth: how far [m] a path is from any gap, in `strip`;  hull: from the hull of the gaps, at `line`."""

    depth: float = 0.0
    strip: int = 0
    hull: float = 0.0
    line: Mark = (0.0, 0)


@dataclass(frozen=True)
class BlockClasses:
    """The classes of paths past the blocks of one maneuver. A part is a way, None where none leads through; a cut is
    the strip whose gaps are told apart; what is looked at are lines.
    """

    cells: Cells
    keeping: Callable[[Trajectory], Keeping]
    manner = Manner(samples=2000, deep=0.05, first_lift=1e-8, lifts=8, patience=12, worth=0.9, waiting=True)

    @property
    def size(self) -> float:
        """[m]"""
        return self.cells.size

    @property
    def first(self) -> tuple[Way | None, Marks]:
        """Every way, looked at on the lines of the user's own walls."""
        return self.cells.ways, ()

    def past(self, one: WayClass, lift: float = 0.0) -> Maneuver | None:
        return self.cells.maneuver_past(one.way, one.lines, lift)

    def splits(self, one: WayClass, cut: int) -> bool:
        return 0 <= cut < len(one.way)

    def parts(self, one: WayClass, cut: int) -> list[Way | None]:
        """For each gap of a strip the ways through it."""
        return [self.cells.through((*one.way[:cut], (gap,), *one.way[cut + 1 :])) for gap in one.way[cut]]

    def seen(self, part: Way | None, looks: Marks) -> WayClass | None:
        return None if part is None else WayClass(part, looks)

    def empty(self, part: Way | None) -> bool:
        return part is None or self.past(WayClass(part, ())) is None

    @property
    def motions(self) -> bool:
        return True

    def samples(self, one: WayClass, motion: Trajectory) -> Samples:
        """Samples of a path in the frame of the way."""
        n = self.manner.samples
        places = self.cells.frame.position(motion.position(self.cells.maneuver.duration * np.arange(n + 1) / n))
        return Samples(places, self.outside(one.way, places).depth)

    def crossings(self, one: WayClass, path: Samples) -> Array:
        along = path.places[:, 0]
        return np.array([np.argmax(along >= x) for x, _ in self.cells.marks(one.way, one.lines)]) / self.manner.samples

    def boxes(self, walls: int, more: bool) -> int:
        """Each box takes longer the more walls there are, and another line may do more."""
        return (MORE if more else 1) * max(BOXES // max(walls, 1) ** 2, 4)

    def short(self, motion: Trajectory) -> float:
        kept = self.keeping(motion)
        return -min(kept.walls, kept.blocks)

    def quick_short(self, motion: Trajectory) -> float:
        return 0.0

    def step(self, here: Bounded[WayClass], path: Samples, until: float) -> Again[Marks] | int | None:
        outside, room = self.outside(here.one.way, path.places), SHALLOW * self.size
        few = len(here.past.walls) < MOST_CERTIFIED
        if outside.hull > room and few and outside.line not in here.one.lines:
            return Again(self._with(here, outside.line))
        if outside.depth > room and len(here.one.way[outside.strip]) > 1:
            return outside.strip
        return None

    def planes(self, way: Way, positions: Array, room: float) -> list[Plane]:
        """For every node, positions (n, 2) [m], the edges of the gap of the way that it is over or nearest to."""
        out: list[Plane] = []
        frame, lines = self.cells.frame, self.cells.lines
        for node, (x, y) in enumerate(frame.position(positions)):
            if not 0 < x < self.cells.length:
                continue
            for k in {int(np.searchsorted(lines, x + shift)) - 1 for shift in (-room, room)}:
                if not 0 <= k < len(way):
                    continue
                sections = [(g, self.cells.gaps[k][g].at(x)) for g in way[k]]
                best = min(sections, key=lambda one: max(one[1][0] - y, y - one[1][1]))[0]
                gap = self.cells.gaps[k][best]
                for sign, (begin, end) in ((1, gap.low), (-1, gap.high)):
                    if math.isfinite(begin):
                        step = np.array([gap.across[1] - gap.across[0], end - begin])
                        normal = sign * np.array([-step[1], step[0]]) / np.hypot(*step)
                        turned = frame.vector_back(normal)
                        level = float(turned @ frame.position_back([gap.across[0], begin])) + room
                        out.append(Plane(node, turned, level))
        return out

    def child(
        self,
        part: Way | None,
        above: Bounded[WayClass],
        path: Samples,
        solve: Callable[[Marks], Bounded[WayClass] | None],
    ) -> tuple[Marks, Bounded[WayClass] | None]:
        """A part on the lines of the class it is of, and one where its path is outside of all that the part leaves."""
        assert part is not None
        there = self.outside(part, path.places)
        lines = self._with(above, there.line) if there.hull > SHALLOW * self.size else above.one.lines
        return lines, solve(lines)

    def _with(self, here: Bounded[WayClass], line: Mark) -> Marks:
        """The lines that matter and this one, in place of those close to it unless it has been tried already.

        Around a rounded corner the one line that is needed is so found; lines side by side make times coincide.
        """
        lines = [other for other in self._pushing(here) if other != line]
        if not _tried(here, line):
            lines = [other for other in lines if abs(other[0] - line[0]) > NEAR * self.cells.length]
        return (*lines, line)

    def _pushing(self, here: Bounded[WayClass]) -> Marks:
        """The lines whose walls matter to the class's path; without the others it is the same."""
        size = norm(here.certificate.best.multipliers)
        push = size[2:] > IDLE * np.max(size)
        marks = self.cells.marks(here.one.way, here.one.lines)
        return tuple(x for x, pushes in zip(marks, push, strict=True) if pushes)

    def outside(self, way: Way, places: Array) -> Outside:
        """Where a path is furthest from the gaps, and where a line with the hull of the gaps would move it most."""
        cells, worst = self.cells, Outside()
        for k, (left, right) in enumerate(zip(cells.lines, cells.lines[1:], strict=False)):
            there = self._in_strip(places, left, right)
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

    def _in_strip(self, places: Array, left: float, right: float) -> Array:
        """The places (m, 2) of a path between two lines, and between start and goal."""
        x, length = places[:, 0], self.cells.length
        there = places[(x >= left) & (x <= right) & (x > 0) & (x < length)]
        if len(there) < FEW:  # a strip so thin that a path crosses it between two samples
            there = np.concatenate([there, *(_crossings(places, x) for x in (left, right) if 0 < x < length)])
        return there

    def _snapped(self, x: float, left: float, right: float) -> float:
        near = SNAP * (right - left)
        if x - left < near and left > 0:
            return left
        if right - x < near and right < self.cells.length:
            return right
        return x


def _tried(here: Bounded[WayClass] | None, line: Mark) -> bool:
    """Whether the line was put in on the way here."""
    while here is not None:
        if line in here.one.lines:
            return True
        here = here.before
    return False


def _crossings(path: Array, x: float) -> Array:
    """Where a path through samples (n, 2) crosses the line at x, (m, 2)."""
    k = np.flatnonzero((path[:-1, 0] < x) != (path[1:, 0] < x))
    share = (x - path[k, 0]) / (path[k + 1, 0] - path[k, 0])
    return np.stack([np.full(len(k), x), path[k, 1] + share * (path[k + 1, 1] - path[k, 1])], axis=1)


@dataclass(frozen=True)
class BlockProof:
    """Why no free path has a smaller peak: a tree of branches over every way past the blocks."""

    root: Branch[int, Marks]
    scope: Literal["all"] = "all"

    def bound(self, classes: BlockClasses) -> float:
        """The lower bound [m/s^2], evaluated anew; zero where there is no way at all."""
        bound = self.root.bound(classes, classes.cells.ways)
        return bound if math.isfinite(bound) else 0.0


@dataclass(frozen=True)
class ListedBranch:
    """Part of a listed proof: every path with this way has at least the peak that the leaves prove.

    way: gaps left, by strip;  lines: where walls were put;  leaves: boxes of obstacle times.
    """

    way: Way
    lines: tuple[Mark, ...]
    leaves: tuple[Leaf, ...]

    def bound(self, cells: Cells) -> float:
        """The bound [m/s^2], evaluated anew; infinite where no path has such a way."""
        way = cells.through(self.way)
        return leaves_bound(None if way is None else cells.maneuver_past(way, self.lines), self.leaves)


@dataclass(frozen=True)
class ListedProof:
    """The same as plan files of version 1 state it: a list of branches that cover every way past the blocks."""

    branches: tuple[ListedBranch, ...]
    scope: Literal["all"] = "all"

    def bound(self, classes: BlockClasses) -> float:
        """The lower bound [m/s^2], evaluated anew; zero where the branches leave a way out."""
        cells = classes.cells
        if not covered(cells, [branch.way for branch in self.branches], cells.ways):
            return 0.0
        bound = min((branch.bound(cells) for branch in self.branches), default=0.0)
        return bound if math.isfinite(bound) else 0.0


def covered(cells: Cells, ways: Sequence[Way], way: Way | None) -> bool:
    """Whether every path with this way has one of the others, by splitting it gap by gap where those differ."""
    if way is None:
        return True
    inside = [w for w in ways if all(set(a) & set(b) for a, b in zip(w, way, strict=True))]
    if any(all(set(b) <= set(a) for a, b in zip(w, way, strict=True)) for w in inside):
        return True
    for k, gaps in enumerate(way):
        if len(gaps) > 1 and any(not set(gaps) <= set(w[k]) for w in inside):
            parts = (cells.through((*way[:k], (gap,), *way[k + 1 :])) for gap in gaps)
            return all(covered(cells, inside, part) for part in parts)
    return False
