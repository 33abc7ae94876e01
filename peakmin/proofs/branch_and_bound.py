"""Branch and bound over the obstacle times: best first, with the bounds of `peakmin.proofs.bounds`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..deadline import over
from ..geometry.norm import norm
from ..types import Array, Mask, Progress
from .bounds import Leaf, lower_bound, out_of_order
from .descent import descend, elsewhere, unhindered
from .double_integrator import PointMass
from .extremal import APART, Extremal, ascend, extremal, far_apart
from .frontier import Frontier
from .nodal import Nodal
from .saddle import saddle

WORTH_A_DESCENT = 1e-9  # relative improvement of the best peak after which local descent starts from there
MOST_MOVES = 4  # optima looked at in one box
WEAK = 0.9  # of the best peak: with a bound below it at first, bounds with fewer walls are tried
FEW = (1, 1, 12, 8)  # boxes for each of them, by the number of walls; none with more walls
IDLE = 1e-4  # of the largest multiplier: below it a wall is tried without
ROOM = 1e-3  # least distance of the times that a search starts from
EDGE = 0.1  # of a box: how far around a place its times are looked for, so as not to end on a side
WORTH_A_MOVE = 1e-4  # relative improvement of a box's bound after which another one is


@dataclass(frozen=True)
class Certificate:
    """A global bound: leaves that cover all ordered times, the best times found, and what it took.

    lower, upper: [scaled], lower <= min over T of M*(T) <= upper;  times: where `best` attains upper, (q,).
    complete: whether the gap asked for was reached (a node or time limit stops earlier).
    """

    leaves: list[Leaf]
    lower: float
    best: Extremal
    times: Array
    nodes: int
    complete: bool

    @property
    def gap(self) -> float:
        """(upper - lower) / upper."""
        upper = self.best.upper
        return max(upper - self.lower, 0.0) / upper if upper > 0 and math.isfinite(upper) else float(upper > 0)


def least_over_times(
    mass: PointMass,
    gap: float,
    node_limit: int = 100_000,
    until: float = math.inf,
    progress: Progress | None = None,
    start: Array | None = None,
    enough: float = math.inf,
) -> Certificate:
    """The least peak over all obstacle times to a relative gap, with its proof.

    Args:
        mass: the maneuver in scaled units, q walls.
        gap: relative gap between the best peak and the bound at which to stop.
        node_limit: boxes to look at.
        until: a deadline, see `peakmin.deadline`.
        progress: called with (nodes done, nodes done and waiting).
        start: times near the best ones, shape (q,); default evenly spread.
        enough: a bound [scaled] at which to stop too, whatever the gap.
    """
    fresh = start is None
    if fresh and (found := _unhindered(mass, gap)) is not None:
        return found
    at = inside(np.zeros(mass.walls), np.ones(mass.walls)) if start is None else apart(start)
    first = extremal(mass, at)
    root = _everywhere(first, at)
    if math.isfinite(enough) and (bound := root.bound(mass)) >= enough:
        return Certificate([root], min(bound, first.upper), first, at, 1, first.upper * (1 - gap) <= bound)
    search = _Search(mass, gap, node_limit, until, progress, enough, *descend(mass, first, at, until))
    root = _everywhere(search.best, search.at)
    begun, bound = [root], root.bound(mass)
    few = search.past_those_that_push(bound)
    if few is not None:
        search.nodes = few.nodes
        if few.lower >= search.wanted:
            return search.certificate(few.leaves, few.lower)
        begun = few.leaves if few.lower > bound else begun
    return search.run(search.better_begun(begun) if fresh else search.bounded(begun))


def _unhindered(mass: PointMass, gap: float) -> Certificate | None:
    """The optimum without any wall, where it crosses all their lines and meets none; None elsewhere."""
    crossed = unhindered(mass) if mass.walls else None
    if crossed is None:
        return None
    free, at = crossed
    leaf = _past_idle(Leaf((), (), free.multipliers[:2], ()), np.zeros(mass.walls, dtype=bool), at)
    bound = leaf.bound(mass)
    return Certificate([leaf], min(bound, free.upper), free, at, 1, True) if bound >= (1 - gap) * free.upper else None


def _everywhere(found: Extremal, at: Array) -> Leaf:
    """All times as one box, with the multipliers of an optimum at some of them."""
    q = len(at)
    return Leaf((0.0,) * q, (1.0,) * q, found.multipliers, tuple(at.tolist()))


class _Open(NamedTuple):
    """A box that waits: its leaf, the multipliers it is cut by, and what it proves by itself."""

    leaf: Leaf
    optimal: Array
    bound: float


@dataclass
class _Search:
    """Boxes of obstacle times, the one with the least bound looked at first; the arguments of `least_over_times`, the
    best that was met, at which times, and how many boxes were looked at.
    """

    mass: PointMass
    gap: float
    node_limit: int
    until: float
    progress: Progress | None
    enough: float
    best: Extremal
    at: Array
    nodes: int = 1

    @property
    def wanted(self) -> float:
        """The bound with which the gap is reached."""
        return (1 - self.gap) * self.best.upper

    def certificate(self, leaves: list[Leaf], lower: float) -> Certificate:
        """What is known, with the leaves that prove `lower`."""
        complete = self.best.upper == 0 or lower >= self.wanted
        return Certificate(leaves, min(lower, self.best.upper), self.best, self.at, self.nodes, complete)

    def past_those_that_push(self, bound: float) -> Certificate | None:
        """The search past the walls that push at the best times; None where all do, or the bound [scaled] will do."""
        size = norm(self.best.multipliers)
        push = size[2:] > IDLE * np.max(size, initial=0.0)
        if not 0 < self.best.upper < math.inf or np.all(push) or bound >= self.wanted:
            return None
        own = self.mass.only(push), self.gap / 2, self.node_limit, self.until, self.progress, self.at[push], self.enough
        few = least_over_times(*own)
        return replace(few, leaves=[_past_idle(leaf, push, self.at) for leaf in few.leaves])

    def bounded(self, leaves: list[Leaf]) -> list[tuple[Leaf, float]]:
        """Leaves with what each proves."""
        return [(leaf, leaf.bound(self.mass)) for leaf in leaves]

    def better_begun(self, leaves: list[Leaf]) -> list[tuple[Leaf, float]]:
        """The cover of all times that proves the most; better times, where it does not prove these to be the best."""
        mass, begun = self.mass, self.bounded(leaves)
        if 0 < mass.walls < len(FEW) and _least(begun) < WEAK * self.best.upper < math.inf:
            others = (self.bounded(other) for other in _without(mass, self.gap, self.at, self.until))
            begun = max([begun, *others], key=_least)
        if _least(begun) < self.wanted:
            self.best, self.at = elsewhere(mass, self.best, self.at, self.until)
        return begun

    def run(self, begun: list[tuple[Leaf, float]]) -> Certificate:
        """Until the gap is reached, or the bound is enough, or boxes or time are used up."""
        waiting = Frontier((bound, _Open(leaf, leaf.multipliers, bound)) for leaf, bound in begun)
        while self.mass.walls and waiting.lowest < min(self.wanted, self.enough) and self.best.upper > 0:
            if self._spent(waiting.first.leaf):
                break
            bound, opened = waiting.pop()
            for low, high in halves(opened.leaf.low, opened.leaf.high, opened.optimal):
                if not out_of_order(low, high):
                    half = self._looked_at(Leaf(low, high, opened.leaf.multipliers, opened.leaf.at))
                    waiting.push(max(half.bound, bound), half)  # what holds for the parent's box holds for its half
            if self.progress:
                self.progress(self.nodes, self.nodes + len(waiting))
        return self.certificate([one.leaf for one in waiting.items], min(one.bound for one in waiting.items))

    def _spent(self, leaf: Leaf) -> bool:
        """Whether no more boxes may be looked at, or this one is too small to be cut."""
        return self.nodes >= self.node_limit or over(self.until) or max(np.subtract(leaf.high, leaf.low)) < APART

    def _looked_at(self, leaf: Leaf) -> _Open:
        """A box with the best multipliers found for it; where optima met on the way promise it, times are descended."""
        self.nodes += 1
        box = _Box(self.mass, leaf)
        for found, there in box.improve(min(self.wanted, self.enough), self.until):
            if found.upper < self.best.upper * (1 - WORTH_A_DESCENT):
                self.best, self.at = descend(self.mass, found, there, self.until)
        return _Open(box.leaf, box.optimal, box.bound)


def _least(bounded: list[tuple[Leaf, float]]) -> float:
    return min(bound for _, bound in bounded)


def _without(mass: PointMass, gap: float, at: Array, until: float) -> Iterator[list[Leaf]]:
    """Covers of all times by what is proved without one of the walls, and without any.

    Walls that play against each other, or the ends, at times that nearly coincide have multipliers without bounds.
    """
    fewer = np.vstack([~np.eye(mass.walls, dtype=bool), np.zeros(mass.walls, dtype=bool)])
    for push in np.unique(fewer, axis=0):
        few = least_over_times(mass.only(push), gap, FEW[mass.walls], until, start=at[push])
        yield [_past_idle(leaf, push, at) for leaf in few.leaves]


def _past_idle(leaf: Leaf, push: Mask, at: Array) -> Leaf:
    """A leaf without the idle walls as one with them: zero multipliers, and any time at which their lines are crossed.

    A path that a wall does not touch does not depend on when it crosses the wall's line, and neither does its bound.
    """
    low, high, place = np.zeros(len(push)), np.ones(len(push)), at.copy()
    low[push], high[push], place[push] = leaf.low, leaf.high, leaf.at
    multipliers = np.zeros((2 + len(push), leaf.multipliers.shape[-1]))
    multipliers[np.r_[True, True, push]] = leaf.multipliers
    return Leaf(tuple(low.tolist()), tuple(high.tolist()), multipliers, tuple(place.tolist()))


class _Box:
    """One box on its way to the best bound that is worth its time."""

    def __init__(self, mass: PointMass, leaf: Leaf) -> None:
        self.mass, self.leaf, self.bound = mass, leaf, leaf.bound(mass)
        self.low, self.high = np.array(leaf.low), np.array(leaf.high)
        self.optimal = leaf.multipliers

    def improve(self, enough: float, until: float) -> Iterator[tuple[Extremal, Array]]:
        """Try better and dearer multipliers until the bound is enough; yields the optima met on the way."""
        mass, centre = self.mass, inside(self.low, self.high)
        if self.bound >= enough or not far_apart(centre):
            return
        # cheap multipliers first: far from the optimum they are good enough
        nodal = Nodal(mass, np.concatenate([[0.0], centre, [1.0]]))
        self._try(max(mass.elementary(centre), key=lambda trial: lower_bound(mass, centre, trial)), centre)
        self._try(nodal.multipliers(nodal.least_energy()), centre)
        if self.bound >= enough:
            return
        self._try(ascend(mass, centre), centre)
        place = centre
        for _ in range(MOST_MOVES):
            if self.bound >= enough or lower_bound(mass, place, self.optimal) >= enough / (1 - WORTH_A_MOVE):
                return
            if over(until):
                return
            before, found = self.bound, extremal(mass, place)
            yield found, place
            self._try(found.multipliers, place)
            # where these multipliers prove least, others may prove more
            bound, place = saddle(mass, self.low, self.high, place, found.multipliers)
            if bound < self.bound or bound <= before * (1 + WORTH_A_MOVE):
                return
            room = EDGE * (self.high - self.low)
            place = inside(np.maximum(self.low, place - room), np.minimum(self.high, place + room))
            if not far_apart(place):
                return

    def _try(self, multipliers: Array, at: Array) -> None:
        self.optimal = multipliers
        other = Leaf(self.leaf.low, self.leaf.high, multipliers, tuple(at.tolist()))
        bound = other.bound(self.mass)
        if bound > self.bound:
            self.leaf, self.bound = other, bound


Box = tuple[tuple[float, ...], tuple[float, ...]]


def halves(low: tuple[float, ...], high: tuple[float, ...], optimal: Array) -> tuple[Box, Box]:
    """Two boxes, cut where the bound of the centre's multipliers loses most: the largest |l_i| w_i^2.

    (The multipliers that a box is bounded with may stem from a parent and know nothing of the walls that matter here.)
    """
    width = np.array(high) - np.array(low)
    loss = (norm(optimal[2:]) + 1e-3 * np.max(np.abs(optimal))) * width**2
    axis = int(np.argmax(loss))
    middle = 0.5 * (low[axis] + high[axis])
    return (low, (*high[:axis], middle, *high[axis + 1 :])), ((*low[:axis], middle, *low[axis + 1 :]), high)


def inside(low: Array, high: Array) -> Array:
    """A strictly increasing T well inside the box's ordered part, shape (q,)."""
    q = len(low)
    floors = np.maximum.accumulate(low)
    ceilings = np.minimum.accumulate(high[::-1])[::-1]
    times = 0.5 * (floors + ceilings)
    for i in range(q):  # where centres coincide, share what room is left
        same = [j for j in range(q) if abs(times[j] - times[i]) < APART]
        if len(same) > 1:
            lowest, highest = floors[same[0]], ceilings[same[-1]]
            times[same] = lowest + (highest - lowest) * np.arange(1, len(same) + 1) / (len(same) + 1)
    for i in range(1, q):
        times[i] = max(times[i], times[i - 1] + APART)
    return np.asarray(times)


def apart(times: Array) -> Array:
    """The times in order, moved from each other and the ends by at least ROOM, shape (q,)."""
    steps = np.maximum(np.diff(np.concatenate([[0.0], times, [1.0]])), ROOM)
    return np.asarray(np.cumsum(steps)[:-1] / np.sum(steps))
