"""How far a motion stays from blocks and walls all along its path, not only at its nodes.

Piecewise constant controls move along parabolas, and what is nearest on a parabola is a root of a polynomial.
Any other control is bounded: between two times dt apart its path stays within peak dt^2 / 8 of the chord.
Blocks have signed distances: positive outside, minus the distance to the boundary inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import Array, Index
from .norm import norm
from .polygon import BATCH, Outline
from .trajectory import HoldTrajectory, Trajectory

TOLERANCE = 1e-9  # what a bound by chords may lose, relative to the path's extent plus peak duration^2
GRAIN = 1e-14  # of the coordinates: their rounding errors, too small to be a side of a wall
PIECES = 64  # chords to begin with
HALVINGS = 60  # of an interval of floats: down to their rounding


@dataclass(frozen=True)
class _Arcs:
    """Parabolas r(x) = start + x step + x^2/2 bend, 0 <= x <= 1; chords where bend is zero; (m, d) each [m]."""

    start: Array
    step: Array
    bend: Array

    @classmethod
    def of(cls, motion: HoldTrajectory) -> _Arcs:
        dt = np.diff(motion.nodes)[:, None]
        return cls(motion.node_position[:-1], dt * motion.node_velocity[:-1], dt * dt * motion.control)

    @property
    def end(self) -> Array:
        return self.start + self.step + self.bend / 2

    @property
    def length(self) -> Array:
        """A bound on the arcs' lengths [m], (m,): |step + x bend| is largest at an end."""
        return np.asarray(np.maximum(norm(self.step), norm(self.step + self.bend)))

    def part(self, k: Index) -> _Arcs:
        return _Arcs(self.start[k], self.step[k], self.bend[k])

    def at(self, x: Array) -> Array:
        """Points (m, d) at one fraction for each arc."""
        x = x[:, None]
        return np.asarray(self.start + x * (self.step + x / 2 * self.bend))


def _fractions(x: Array) -> Array:
    """x where it lies on its arc, the arc's start elsewhere."""
    return np.where((x >= 0) & (x <= 1), x, 0.0)


def _quadratic(a: Array, b: Array, c: Array) -> Array:
    """Roots of a x^2 + b x + c on the arcs, (2, ...): q/a and c/q, which subtract nothing alike."""
    with np.errstate(all="ignore"):
        q = -(b + np.copysign(np.sqrt(b * b - 4 * a * c), b)) / 2
        return _fractions(np.stack([q / a, c / q]))


def _stationary(step: Array, bend: Array) -> Array:
    """Root of step + x bend on the arcs."""
    with np.errstate(all="ignore"):
        return _fractions(-step / bend)


def _nearest(arcs: _Arcs, corner: Array) -> tuple[Index, Array]:
    """Arcs and fractions at which an arc (m,) is nearest to its point corner (m, 2), where that is not an end.

    With d = start - corner, half the derivative of |r - corner|^2 is the cubic
        d.step + (step.step + d.bend) x + 3/2 step.bend x^2 + 1/2 bend.bend x^3,
    monotone between the roots of its own derivative: where it rises through zero is found by halving.
    """
    d = arcs.start - corner
    c0, c1 = np.sum(d * arcs.step, axis=1), np.sum(arcs.step**2 + d * arcs.bend, axis=1)
    c2, c3 = 1.5 * np.sum(arcs.step * arcs.bend, axis=1), 0.5 * np.sum(arcs.bend**2, axis=1)
    turns = np.sort(_quadratic(3 * c3, 2 * c2, c1), axis=0)
    cuts = np.vstack([np.zeros_like(c0), turns, np.ones_like(c0)])
    slope = c0 + cuts * (c1 + cuts * (c2 + cuts * c3))
    i, k = np.nonzero((slope[:-1] < 0) & (slope[1:] > 0))
    low, high = cuts[i, k], cuts[i + 1, k]
    c0, c1, c2, c3 = c0[k], c1[k], c2[k], c3[k]
    for _ in range(HALVINGS):
        x = (low + high) / 2
        falling = c0 + x * (c1 + x * (c2 + x * c3)) < 0
        low, high = np.where(falling, x, low), np.where(falling, high, x)
    return k, (low + high) / 2


def _clearances(arcs: _Arcs, outline: Outline, ends: Array, limit: Array) -> Array:
    """Least signed distance [m] of each arc (m,); anything above its limit (m,) where it is above that.

    A path of length l between points of signed distances a and b, the ends (2, m), has none below (a + b - l)/2.
    """
    least: Array = np.min(ends, axis=0)
    near = np.flatnonzero((ends[0] + ends[1] - arcs.length) / 2 <= limit)
    rows = max(1, BATCH // (8 * len(outline.corner)))
    for i in range(0, len(near), rows):
        k = near[i : i + rows]
        least[k] = np.minimum(least[k], _least(arcs.part(k), outline, limit[k]))
    return least


def _least(arcs: _Arcs, outline: Outline, limit: Array) -> Array:
    """Least signed distance [m] of the arcs strictly between their ends (m,), found where it is below limit."""
    bound = (outline.distances(arcs.start) + outline.distances(arcs.end) - arcs.length[:, None]) / 2
    k, j = np.nonzero(bound <= np.maximum(limit, 0)[:, None])
    pairs, e = arcs.part(k), outline.along[j]
    d = pairs.start - outline.corner[j]
    off, step, bend = (e[:, 0] * w[:, 1] - e[:, 1] * w[:, 0] for w in (d, pairs.step, pairs.bend))
    crossings = _quadratic(bend / 2, step, off)
    least: Array = np.full(len(limit), np.inf)
    for x in (_stationary(step, bend), *crossings):
        np.minimum.at(least, k, outline.distance(j, pairs.at(x)))
    at, x = _nearest(pairs, outline.corner[j])
    np.minimum.at(least, k[at], outline.distance(j[at], pairs.part(at).at(x)))
    if outline.closed:
        least = np.minimum(least, -_depth(arcs, outline, np.tile(k, 2), crossings.ravel()))
    return least


def _depth(arcs: _Arcs, outline: Outline, k: Index, crossings: Array) -> Array:
    """Depth [m] in the block of the deepest point looked at on each arc (m,), -inf where none is inside.

    Arcs k meet the boundary at crossings (p,), perhaps among other places: between two neighbours they are
    either inside or outside. What is inside is looked at where it is furthest from the line of an edge, too.
    """
    each = np.arange(len(arcs.start))
    arc, x = np.concatenate([k, each, each]), np.concatenate([crossings, np.zeros(len(each)), np.ones(len(each))])
    order = np.lexsort((x, arc))
    arc, x = arc[order], x[order]
    same = arc[1:] == arc[:-1]
    arc, x = arc[1:][same], (x[1:] + x[:-1])[same] / 2
    signed = outline.signed(arcs.part(arc).at(x))
    depth = np.full(len(each), -np.inf)
    np.maximum.at(depth, arc[signed < 0], -signed[signed < 0])
    inside = np.flatnonzero(depth > 0)
    ex, ey = outline.along.T
    step, bend = (ex * w[inside, 1:] - ey * w[inside, :1] for w in (arcs.step, arcs.bend))
    arc = np.repeat(inside, len(ex))
    np.maximum.at(depth, arc, -outline.signed(arcs.part(arc).at(_stationary(step, bend).ravel())))
    return depth


def pieces(motion: Trajectory) -> Array:
    """Times [s] between which to begin with chords: nodes, and others evenly spread."""
    return np.union1d(motion.nodes, np.linspace(motion.nodes[0], motion.nodes[-1], PIECES + 1))


def _tolerance(motion: Trajectory, times: Array) -> float:
    """What chords may lose [m], of a motion seen at these times."""
    extent = float(np.max(np.ptp(motion.position(times), axis=0)))
    return TOLERANCE * (extent + motion.peak() * float(times[-1] - times[0]) ** 2)


def _distance(motion: Trajectory, outline: Outline) -> float:
    """Least signed distance [m] of the path; for chords a bound below it, by at most the tolerance."""
    if isinstance(motion, HoldTrajectory):
        arcs = _Arcs.of(motion)
        nodes = outline.signed(motion.node_position)
        limit = np.full(len(arcs.start), np.min(nodes))
        return float(np.min(_clearances(arcs, outline, np.stack([nodes[:-1], nodes[1:]]), limit)))
    peak, times = motion.peak(), pieces(motion)
    tolerance = _tolerance(motion, times)
    begin, end = times[:-1], times[1:]
    best = bound = np.inf
    while len(begin):
        # signed distances change no faster than the point moves: those of path and chord differ by deviation at most
        deviation = peak * np.square(end - begin) / 8
        first, last = motion.position(begin), motion.position(end)
        ends = np.stack([outline.signed(first), outline.signed(last)])
        best = np.minimum(best, np.min(ends))  # unlike min, keeps what is no number
        chords = _Arcs(first, last - first, np.zeros_like(first))
        chord = _clearances(chords, outline, ends, best + deviation)
        best = np.minimum(best, np.min(chord + deviation))
        middle = (begin + end) / 2
        unsettled = (chord - deviation < best - tolerance) & (begin < middle) & (middle < end)
        bound = np.minimum(bound, np.min((chord - deviation)[~unsettled], initial=np.inf))
        begin, middle, end = begin[unsettled], middle[unsettled], end[unsettled]
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
    return float(np.minimum(bound, best))


def _sides(motion: Trajectory, ray: Outline, room: float) -> Array:
    """Times [s] between which the path changes its side of the ray's line once or not at all.

    Of chords beyond room only: two changes that stay within half the tolerance of the line are none.
    """
    if isinstance(motion, HoldTrajectory):
        arcs, (ex, ey) = _Arcs.of(motion), ray.along[0]
        step, bend = (ex * w[:, 1] - ey * w[:, 0] for w in (arcs.step, arcs.bend))
        turns = motion.nodes[:-1] + _stationary(step, bend) * np.diff(motion.nodes)
        return np.union1d(motion.nodes, turns)
    peak, times = motion.peak(), pieces(motion)
    tolerance = _tolerance(motion, times)
    begin, end = times[:-1], times[1:]
    while len(begin):
        s, off = (np.squeeze(w, -1) for w in ray.coordinates(motion.position(np.stack([begin, end]))))
        deviation = peak * np.square(end - begin) / 8
        near = (off[0] * off[1] <= 0) | (np.min(np.abs(off), axis=0) <= deviation)
        split = near & (np.max(s, axis=0) + deviation > room) & (deviation > tolerance / 2)
        begin, middle, end = begin[split], ((begin + end) / 2)[split], end[split]
        times = np.union1d(times, middle)
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
    return times


def block_clearance(motion: Trajectory, vertices: Array) -> float:
    """Distance [m] of the path from a simple polygon, vertices (n, 2) in order [m]; negative where it enters.

    Then it is minus the depth (distance to the boundary) of the deepest of the points looked at. Exact up to
    rounding for a HoldTrajectory; for others a bound below, by at most TOLERANCE of the path's size.
    """
    return _distance(motion, Outline.polygon(vertices)) + 0.0


def wall_clearance(motion: Trajectory, tip: Array, direction: Array, room: float) -> float:
    """Distance [m] of the path from the ray {tip + s direction, s >= 0}; negative where it crosses the ray.

    Then it is minus the largest distance from the tip at which the path changes sides. Changes no further than
    room [m] beyond the tip count as touching it (0), as does what meets the ray and stays on its side.
    """
    ray = Outline.ray(tip, direction)
    times = _sides(motion, ray, room)
    positions = motion.position(times)
    s, off = (w[:, 0] for w in ray.coordinates(positions))
    grain = GRAIN * float(np.max(np.abs(positions)) + np.max(np.abs(tip)))
    clear = np.flatnonzero(np.abs(off) > grain)
    changed = np.flatnonzero(off[clear[1:]] * off[clear[:-1]] < 0)
    before, after = clear[changed], clear[changed + 1]
    low, high = times[before], times[after]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if np.all((middle == low) | (middle == high)):
            break
        unchanged = ray.coordinates(motion.position(middle))[1][:, 0] * off[before] > 0
        low, high = np.where(unchanged, middle, low), np.where(unchanged, high, middle)
    crossed = ray.coordinates(motion.position((low + high) / 2))[0][:, 0]
    on_line = [float(np.max(s[i + 1 : j])) for i, j in zip(before, after, strict=True) if j > i + 1]
    furthest = float(np.max([*crossed, *on_line], initial=-np.inf))
    if furthest >= 0:
        return -furthest if furthest > room else 0.0
    distance = _distance(motion, ray)
    return 0.0 if distance <= grain else distance
