"""Branch and bound over the obstacle times: best first, with the bounds of `peakmin.proofs.bounds`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

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
    q = mass.walls
    at = inside(np.zeros(q), np.ones(q)) if start is None else apart(start)
    if start is None and q and (crossed := unhindered(mass)) is not None:
        free, at_free = crossed
        leaf = _past_idle(Leaf((), (), free.multipliers[:2], ()), np.zeros(q, dtype=bool), at_free)
        if (bound := leaf.bound(mass)) >= (1 - gap) * free.upper:
            return Certificate([leaf], min(bound, free.upper), free, at_free, 1, True)
    first = extremal(mass, at)
    root = Leaf((0.0,) * q, (1.0,) * q, first.multipliers, tuple(at.tolist()))
    if math.isfinite(enough) and (bound := root.bound(mass)) >= enough:
        return Certificate([root], min(bound, first.upper), first, at, 1, first.upper * (1 - gap) <= bound)
    best, at = descend(mass, first, at, until)
    root = Leaf((0.0,) * q, (1.0,) * q, best.multipliers, tuple(at.tolist()))
    bound = root.bound(mass)
    size, nodes, begun = norm(best.multipliers), 1, [root]
    push = size[2:] > IDLE * np.max(size, initial=0.0)
    if 0 < best.upper < math.inf and not np.all(push) and bound < (1 - gap) * best.upper:
        few = least_over_times(mass.only(push), gap / 2, node_limit, until, progress, at[push], enough)
        nodes, leaves = few.nodes, [_past_idle(leaf, push, at) for leaf in few.leaves]
        if few.lower >= (1 - gap) * best.upper:
            return Certificate(leaves, min(few.lower, best.upper), best, at, nodes, True)
        if few.lower > bound:
            begun = leaves
    own = [leaf.bound(mass) for leaf in begun]
    if start is None and 0 < q < len(FEW) and min(own) < WEAK * best.upper < math.inf:
        for other in _without(mass, gap, at, until):
            proved = [leaf.bound(mass) for leaf in other]
            if min(proved) > min(own):
                begun, own = other, proved
    if start is None and min(own) < (1 - gap) * best.upper:
        best, at = elsewhere(mass, best, at, until)
    waiting = Frontier((x, (leaf, leaf.multipliers, x)) for x, leaf in zip(own, begun, strict=True))
    while q and waiting.lowest < min((1 - gap) * best.upper, enough) and best.upper > 0:
        if nodes >= node_limit or over(until) or max(np.subtract(waiting.first[0].high, waiting.first[0].low)) < APART:
            break
        bound, (leaf, optimal, _) = waiting.pop()
        for low, high in halves(leaf.low, leaf.high, optimal):
            if out_of_order(low, high):
                continue
            nodes += 1
            search = _Box(mass, Leaf(low, high, leaf.multipliers, leaf.at))
            for found, there in search.improve(min((1 - gap) * best.upper, enough), until):
                if found.upper < best.upper * (1 - WORTH_A_DESCENT):
                    best, at = descend(mass, found, there, until)
            # what holds for the parent's box holds for its half
            likely = max(search.bound, bound)
            waiting.push(likely, (search.leaf, search.optimal, search.bound))
        if progress:
            progress(nodes, nodes + len(waiting))
    leaves = [leaf for leaf, *_ in waiting.items]
    lower = min(proved for *_, proved in waiting.items)  # what each proves by itself
    complete = best.upper == 0 or lower >= (1 - gap) * best.upper
    return Certificate(leaves, min(lower, best.upper), best, at, nodes, complete)


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
