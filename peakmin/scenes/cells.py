"""The ways past blocks, seen in the frame of the maneuver (start at the origin, goal at (D, 0)).

Vertical lines through all corners cut 0 <= x <= D into strips; in a strip the free part falls into gaps, each between
two edges: a trapezoid. Let a_k be the last time at which a path crosses the left end of strip k, and b_k the first time
after it at the right end. From a_k to b_k it is in the strip, and hence in one gap; b_k <= a_{k+1}; and what it does in
between stays to the right of the left end of strip k. So every free path has a way: a gap for each strip, the next one
to be reached from it without going back. It crosses any line put into a strip, or at either end of it, within its gap
there, in order. These are necessary conditions, of every free path without exception, also of one that turns back on
its way and goes forward again elsewhere. That a path keeps to 0 <= x <= D is not, and nothing here says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..errors import SpecError
from ..geometry.trapezoids import Gap, Interval, edges_of, heights, lines_through, snapped, trapezoids
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Block, Wall
from ..types import Array

SAME = 1e-12  # of the scene's extent: gaps that overlap by minus this much meet
WIDE = 100.0  # times the way's length: what is further away does not tell how large the scene is
GRAIN = 1e-12  # of the way's length: lines closer than this are one
ULPS = 8  # of the start's and the goal's coordinates, by which given corners may be off

Way = tuple[tuple[int, ...], ...]  # the gaps that are left in each strip, by their numbers from below
Mark = tuple[float, int]  # its x [m] and the strip whose gap it is crossed in: at a strip's end there is a choice


@dataclass(frozen=True)
class Cells:
    """All strips and gaps of a maneuver with blocks."""

    maneuver: Maneuver

    @cached_property
    def frame(self) -> Frame:
        return Frame.from_maneuver(self.maneuver)

    @cached_property
    def length(self) -> float:
        """D [m]."""
        return math.hypot(*(np.array(self.maneuver.goal.position) - np.array(self.maneuver.start.position)))

    @cached_property
    def rings(self) -> list[list[Array]]:
        """For each block the corners in the frame, (n, 2), of what its margin keeps out, and of its holes."""
        margin, start = self.maneuver.margin, self.maneuver.start.position
        return [[self.frame.vector(ring) for ring in block.grown(margin, start)] for block in self.maneuver.blocks]

    @cached_property
    def size(self) -> float:
        """Of what a path can meet [m]: of everything there is, if that is not very far away."""
        return min(self.extent, WIDE * self.length) or self.extent

    @cached_property
    def extent(self) -> float:
        """Of everything there is [m]."""
        return max([self.length, *(float(np.max(np.abs(ring))) for rings in self.rings for ring in rings)])

    @cached_property
    def solid(self) -> list[Array]:
        """The rings of all blocks together, (n, 2) each: a point is in a block where it is inside an odd number."""
        parts = [shapely.Polygon(rings[0], rings[1:]) for rings in self.rings]
        joined = shapely.unary_union(parts)
        polygons = [part for part in getattr(joined, "geoms", [joined]) if part.geom_type == "Polygon"]
        return [np.array(ring.coords)[:-1] for p in polygons for ring in (p.exterior, *p.interiors)]

    @cached_property
    def grain(self) -> float:
        """How far corners may be off in x [m], by rounding errors of what is given."""
        states = self.maneuver.start, self.maneuver.goal
        largest = max(abs(x) for state in states for x in state.position)
        return GRAIN * self.length + ULPS * math.ulp(largest)

    @property
    def _one_sided(self) -> list[tuple[Block, list[Array]]]:
        """The blocks that are passed on one side only, with their rings."""
        every = zip(self.maneuver.blocks, self.rings, strict=True)
        return [(block, rings) for block, rings in every if block.side != "either"]

    @cached_property
    def sided(self) -> list[tuple[Block, Array]]:
        """Those with their edges (E, 4)."""
        lines = np.array(self.lines)
        return [(block, edges_of([snapped(ring, lines) for ring in rings])) for block, rings in self._one_sided]

    @cached_property
    def walls(self) -> list[tuple[float, Wall]]:
        """The user's walls in the order met, with their x; each stands across the way."""
        out = []
        for i, wall in enumerate(self.maneuver.obstacles):
            if not isinstance(wall, Wall):
                continue
            across = self.frame.vector(wall.direction) / math.hypot(*wall.direction)
            x, _ = self.frame.position(wall.tip)
            if abs(across[0]) > 1e-9 or not 0 < x < self.length:
                raise SpecError(
                    f"maneuver.obstacles[{i}]: was a wall from {list(wall.tip)} along {list(wall.direction)}, must "
                    "stand square across the way between start and goal where there are blocks (or be a block itself)"
                )
            if wall.contact == "touch":
                raise SpecError(f"maneuver.obstacles[{i}].contact: was 'touch', must be 'clear' where there are blocks")
            out.append((float(x), wall))
        return out

    @cached_property
    def lines(self) -> list[float]:
        """The x of all strips' ends, 0 and D included."""
        sided = [ring for _, rings in self._one_sided for ring in rings]
        corners = [x for ring in (*self.solid, *sided) for x in ring[:, 0].tolist()]
        return lines_through(corners, [x for x, _ in self.walls], self.length, self.grain)

    @cached_property
    def gaps(self) -> list[list[Gap]]:
        """For each strip its gaps from below, without those on a side that a block does not allow."""
        lines = np.array(self.lines)
        every = trapezoids(edges_of([snapped(ring, lines) for ring in self.solid]), lines)
        return [[gap for gap in gaps if self._allowed(gap)] for gaps in every]

    def _allowed(self, gap: Gap) -> bool:
        """Whether no block that has a side is between the gap and that side: what is above its top is wholly so."""
        x, room = 0.5 * (gap.across[0] + gap.across[1]), SAME * self.extent
        low, high = gap.at(x)
        for block, edges in self.sided:
            there = edges[(edges[:, 0] < x) & (x < edges[:, 2])]
            section = heights(there, np.full(len(there), x))
            if len(section) and (
                (block.side == "left" and high < np.max(section) - room)
                or (block.side == "right" and low > np.min(section) + room)
            ):
                return False
        return True

    @cached_property
    def ways(self) -> Way | None:
        """Every way: the gaps through which one leads, or None where none does.

        A path that keeps the region has no gap that lies outside of it. Where this leaves none, all of them are given.
        """
        every = tuple(tuple(range(len(gaps))) for gaps in self.gaps)
        inside = tuple(
            tuple(g for g in kept if self._in_region(gaps[g])) for gaps, kept in zip(self.gaps, every, strict=True)
        )
        return self.through(inside) or self.through(every)

    @cached_property
    def _region(self) -> tuple[shapely.Polygon, float] | None:
        """The region in the frame, a polygon, and the extent of it and of everything else [m]; or None."""
        if self.maneuver.region is None:
            return None
        corners = self.frame.position(np.array(self.maneuver.region))
        return shapely.Polygon(corners), max(self.extent, float(np.max(np.abs(corners))))

    def _in_region(self, gap: Gap) -> bool:
        """Whether a path that keeps the region can be in the gap, but for rounding errors."""
        if self._region is None:
            return True
        region, extent = self._region
        (a, c), (b, d) = (np.clip(ends, -2 * extent, 2 * extent) for ends in (gap.low, gap.high))
        x, y = gap.across
        there = shapely.Polygon([(x, a), (y, c), (y, d), (x, b)])
        return bool(there.distance(region) <= SAME * extent + self.grain)

    def through(self, way: Way) -> Way | None:
        """The way without gaps that lead nowhere; None where nothing is left."""
        kept = [list(gaps) for gaps in way]
        for k in range(1, len(kept)):
            reached = {h for g in kept[k - 1] for h in self.follow[k - 1][g]}
            kept[k] = [h for h in kept[k] if h in reached]
        for k in range(len(kept) - 2, -1, -1):
            after = set(kept[k + 1])
            kept[k] = [g for g in kept[k] if not after.isdisjoint(self.follow[k][g])]
        return tuple(map(tuple, kept)) if all(kept) else None

    @cached_property
    def follow(self) -> list[list[frozenset[int]]]:
        """For each gap of each strip but the last those of the next that are reached without leaving to its left."""
        last = len(self.gaps) - 1
        label = [0] * len(self.gaps[last])  # beyond the goal's line everything may be connected
        out: list[list[frozenset[int]]] = []
        for k in range(last - 1, -1, -1):
            own = list(range(-1, -1 - len(self.gaps[k]), -1))
            for g, h in self._met(k):
                old, new = own[g], label[h]
                own = [new if name == old else name for name in own]
                label = [new if name == old else name for name in label]
            out.append([frozenset(h for h, name in enumerate(label) if name == own[g]) for g in range(len(own))])
            names = {name: i for i, name in enumerate(dict.fromkeys(own))}
            label = [names[name] for name in own]
        return out[::-1]

    def _met(self, k: int) -> list[tuple[int, int]]:
        """Which gaps of a strip and of the next have a point of the line between them in common."""
        x, room, out = self.lines[k + 1], SAME * self.extent, []
        before, after = ([self._past_walls(x, *gap.at(x)) for gap in self.gaps[i]] for i in (k, k + 1))
        for g, (a, b) in enumerate(before):
            for h, (c, d) in enumerate(after):
                if min(b, d) >= max(a, c) - room:
                    out.append((g, h))
        return out

    def _past_walls(self, x: float, low: float, high: float) -> Interval:
        """What the user's wall at x, if there is one, leaves of an interval there."""
        for at, wall in self.walls:
            if at == x:
                a, b = self._free(wall)
                low, high = max(low, a), min(high, b)
        return low, high

    def _free(self, wall: Wall) -> Interval:
        """Where a wall across the way lets the path through."""
        tip = float(self.frame.position(wall.tip)[1])
        up = float(self.frame.vector(wall.direction)[1]) < 0
        far = math.inf if wall.opening is None else wall.opening
        return (tip, tip + far) if up else (tip - far, tip)

    def interval(self, way: Way, line: Mark) -> Interval:
        """Where a path with one of these ways crosses the line: the hull of the gaps', and of any wall there."""
        x, k = line
        sections = [self.gaps[k][g].at(x) for g in way[k]]
        return self._past_walls(x, min(s[0] for s in sections), max(s[1] for s in sections))

    @cached_property
    def fixed(self) -> list[Mark]:
        """The lines of the user's walls."""
        return [(x, self.lines.index(x) - 1) for x, _ in self.walls]

    def has(self, line: Mark) -> bool:
        """Whether there is such a line: strictly between start and goal, in its strip or at its end."""
        x, k = line
        return 0 <= k < len(self.gaps) and self.lines[k] <= x <= self.lines[k + 1] and 0 < x < self.length

    def wall(self, interval: Interval, x: float) -> Wall | None:
        """The wall, seen from outside, that leaves this interval of the line at x free; None where all of it is."""
        low, high = interval
        if math.isinf(low) and math.isinf(high):
            return None
        up = math.isfinite(low)
        tip = self.frame.position_back([x, low if up else high])
        direction = self.frame.vector_back([0.0, -1.0 if up else 1.0])
        opening = high - low if up and math.isfinite(high) else None
        if opening is not None and opening <= self.grain:
            return Wall(tip=tip, direction=direction, contact="touch")
        return Wall(tip=tip, direction=direction, opening=opening)

    def maneuver_past(self, way: Way, lines: Sequence[Mark], lift: float = 0.0) -> Maneuver | None:
        """The maneuver with walls on these lines and the user's own; None where an interval is empty.

        Args:
            lift: by how much the intervals are narrowed at every finite end [m].
        """
        walls = []
        for line in sorted({*lines, *self.fixed}):
            low, high = self.interval(way, line)
            if high - low > SAME * self.extent or lift == 0:
                low, high = low + lift, high - lift
            if high < low - SAME * self.extent:
                return None
            wall = self.wall((low, max(low, high)), line[0])
            if wall is not None:
                walls.append(wall)
        return self.maneuver.past(walls)

    def marks(self, way: Way, lines: Sequence[Mark]) -> list[Mark]:
        """The lines of the walls that `maneuver_past` puts up, in order."""
        every = sorted({*lines, *self.fixed})
        return [line for line in every if any(map(math.isfinite, self.interval(way, line)))]
