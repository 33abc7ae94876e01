"""The other direction: the least duration D in which a maneuver can be made with a given peak.

Time-optimal and least-peak control are the same (the paper's equivalence), but with moving starts and goals M*(D) need
not fall with D, so the first D with M*(D) <= peak is what is looked for. With the obstacle times as shares x_i of D and
multipliers L of the maneuver scaled to one unit of time, the bound of `peakmin.proofs.bounds` separates, z = 1/D:

    M*(D, x) >= ( A z^2 + B(x) z ) / I(L, x),      A    = l_pos . (pf - p0) + sum l_i . (tip_i - p0)
                                                   B(x) = l_vel . (vf - v0) - l_pos . v0 - sum x_i l_i . v0

and over a box of x, corner by corner, with I + sum |l_i| w_i^2 / 8 below. One L so rules out every D with
A z^2 + B z > peak (I + ..) at all corners: for A >= 0 all D below 1/z, z the positive root. At the best L that root is
the least D itself, so D -> 1/z climbs to it from below, and a box of x has a bound on D just as it has one on M.
"""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import dataclass

import numpy as np

from ..errors import SpecError
from ..geometry.norm import ROUNDING, norm
from ..plan.plan import Plan
from ..proofs.bounds import out_of_order
from ..proofs.branch_and_bound import halves, inside
from ..proofs.descent import descend
from ..proofs.double_integrator import PointMass, impulse
from ..proofs.extremal import extremal
from ..proofs.frontier import Frontier
from ..search.solve import solve
from ..spec.maneuver import Maneuver, walls_only
from ..spec.settings import Exact, GlobalSearch, Settings
from ..spec.spec import refuse_other
from ..types import Array, Json

CLIMBS = 60  # steps of D -> 1/z; they converge quadratically
START = 1e-6  # of the maneuver's own duration: where the climb begins where speeds do not say
ALTERNATIONS = 8  # between the least D at given shares and the best shares at that D


@dataclass(frozen=True)
class ShareBox:
    """Shares low <= x <= high, (q,) each, and multipliers, (2+q, 2) each, that rule out durations one after another."""

    low: tuple[float, ...]
    high: tuple[float, ...]
    chain: tuple[Array, ...]


@dataclass(frozen=True, repr=False)
class Shortest:
    """duration: in which `plan` keeps the peak [s];  lower_bound: no maneuver of that peak is shorter [s].

    peak: what was asked for [m/s^2].

    leaves: boxes of the shares T_i/D that cover all ordered ones, with the multipliers that prove the bound.
    """

    peak: float
    duration: float
    lower_bound: float
    plan: Plan
    leaves: tuple[ShareBox, ...]
    nodes: int

    @property
    def gap(self) -> float:
        """(duration - lower_bound) / duration."""
        return (self.duration - self.lower_bound) / self.duration if self.duration else 0.0

    def document(self) -> Json:
        """The answer as plain JSON data."""
        own = {name: getattr(self, name) for name in ("peak", "duration", "lower_bound", "gap", "nodes")}
        return {"version": 1, "status": self.plan.status, **own, "plan": self.plan.document()}

    def to_json(self, *, indent: int | None = None) -> str:
        """The answer as one JSON document."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    def __repr__(self) -> str:
        return f"Shortest(duration={self.duration:.9g}, lower_bound={self.lower_bound:.9g}, plan={self.plan})"


def shortest(maneuver: Maneuver, peak: float, gap: float = 1e-6, node_limit: int = 2000) -> Shortest:
    """The least duration for a given peak, with its proof.

    Args:
        maneuver: its own duration does not matter.
        peak: bound on the acceleration [m/s^2].
        gap: relative gap between duration and bound at which to stop.
        node_limit: boxes of the obstacle times' shares to look at.

    Raises:
        SpecError: when it is no maneuver of a centre of mass, when the peak is not a positive number, or no duration
            keeps it that could be found.
    """
    _refuse(maneuver, peak)
    search = _Search(maneuver, peak)
    while maneuver.walls and search.waiting.lowest < (1 - gap) * search.duration and search.nodes < node_limit:
        search.halve()
    leaves = tuple(box for box, _ in search.waiting.items)
    lower = min(_ruled_out(search.units, box, peak) for box in leaves)
    asked = maneuver.model_copy(update={"duration": search.duration, "max_peak": None})
    plan = solve(asked, Settings(method=Exact(), search=GlobalSearch(gap=min(gap, 1e-6))))
    return Shortest(peak, search.duration, min(lower, search.duration), plan, leaves, search.nodes)


def _refuse(maneuver: Maneuver, peak: float) -> None:
    refuse_other(maneuver, Maneuver)
    if isinstance(peak, bool) or not isinstance(peak, int | float) or not 0 < peak < math.inf:
        raise SpecError(f"peak: was {peak!r}, must be a finite number above zero")
    walls_only(maneuver, "the least duration")
    if any(wall.opening is not None for wall in maneuver.walls):
        raise SpecError("maneuver.obstacles: was a wall with an opening, must be without one for the least duration")
    units = PointMass.of(maneuver)
    if not np.any(units.pf) and not np.any(units.vf - units.v0) and not units.walls:
        raise SpecError("maneuver.goal: was the start, must differ from it (no time is needed)")


class _Search:
    """Branch and bound over the shares: the least duration met [s], and the boxes that wait, with what rules out most.

    Raises:
        SpecError: when no duration is found that keeps the peak [m/s^2].
    """

    def __init__(self, maneuver: Maneuver, peak: float) -> None:
        self.maneuver, self.peak, self.units, self.nodes = maneuver, peak, PointMass.of(maneuver), 1
        q = len(maneuver.walls)
        centre = inside(np.zeros(q), np.ones(q))
        first, chain = _climb(maneuver, peak, centre, math.inf)
        if math.isinf(first):
            raise SpecError(f"peak: was {peak}, must allow some duration (none was found)")
        self.duration, met = _settle(maneuver, peak, centre, first)
        root = ShareBox((0.0,) * q, (1.0,) * q, met or chain)
        self.waiting = Frontier([(_ruled_out(self.units, root, peak), (root, root.chain))])

    def halve(self) -> None:
        """Two boxes for the one that rules out least."""
        bound, (leaf, met) = self.waiting.pop()
        for low, high in halves(leaf.low, leaf.high, met[-1]):
            if not out_of_order(low, high):
                self.nodes += 1
                self._look_at(low, high, leaf.chain, bound)

    def _look_at(self, low: tuple[float, ...], high: tuple[float, ...], chain: tuple[Array, ...], bound: float) -> None:
        """Let a box wait with its own multipliers or those of the box around it, whose bound it keeps."""
        centre = inside(np.array(low), np.array(high))
        there, met = _climb(self.maneuver, self.peak, centre, self.duration)
        if there < self.duration:
            self.duration, _ = _settle(self.maneuver, self.peak, centre, there)
        boxes = ShareBox(low, high, chain), ShareBox(low, high, met)
        score, box = max(((_ruled_out(self.units, box, self.peak), box) for box in boxes), key=lambda pair: pair[0])
        self.waiting.push(max(bound, score), (box, met))


def _ruled_out(units: PointMass, box: ShareBox, peak: float) -> float:
    """A duration [s] below which no maneuver with shares in the box keeps the peak [m/s^2]; 0 if none."""
    reached = 0.0
    for begin, end in sorted(_interval(units, box, multipliers, peak) for multipliers in box.chain):
        if begin > reached:
            break
        reached = max(reached, end)
    return reached * units.time


def _interval(units: PointMass, box: ShareBox, multipliers: Array, peak: float) -> tuple[float, float]:
    """The durations, in units.time, that one L rules out on the whole box: all D between the two ends."""
    trial = units.admissible(multipliers / (np.max(np.abs(multipliers)) or 1.0))
    width = np.array(box.high) - np.array(box.low)
    corners = np.array(list(itertools.product(*zip(box.low, box.high, strict=True))), dtype=float)
    size = float(np.sum(np.abs(trial)))
    error = ROUNDING * size * (1 + float(np.max(np.abs(units.v0))) + float(np.max(np.abs(units.vf))))
    far = float(np.sum(trial[0] * units.pf) + np.sum(trial[2:] * units.tips))
    far = 0.0 if not np.any(trial[0]) and not np.any(trial[2:]) else far - error
    drift = trial[1] @ (units.vf - units.v0) - trial[0] @ units.v0 - corners @ (trial[2:] @ units.v0) - error
    bulge = np.sum(norm(trial[2:]) * width**2) / 8
    area = (impulse(trial, corners) + bulge) * (1 + ROUNDING) + ROUNDING * size
    limit = peak / units.unit * area * (1 + ROUNDING)
    # A z^2 + B z > limit where |A z^2 + B z - limit| has its roots, in the forms that do not cancel
    discriminant = drift**2 + 4 * far * limit
    if np.any(discriminant <= 0) or (far <= 0 and np.any(drift <= 0)):
        return math.inf, 0.0
    root = np.sqrt(discriminant)
    if far > 0:
        least = np.where(drift > 0, 2 * limit / np.abs(drift + root), (root - drift) / (2 * far))
        return 0.0, float(np.min(1 / least))
    least = 2 * limit / (drift + root)
    if far == 0:
        return 0.0, float(np.min(1 / least))
    return float(np.max(-2 * far / (drift + root))), float(np.min(1 / least))


def _climb(maneuver: Maneuver, peak: float, shares: Array, ceiling: float) -> tuple[float, tuple[Array, ...]]:
    """The least D [s] at these shares (infinite if above the ceiling), and the multipliers met on the way, scaled."""
    units = PointMass.of(maneuver)
    place = tuple(shares.tolist())
    by_speed = np.zeros((2 + len(place), units.dimension))
    by_speed[1] = units.vf - units.v0  # D >= |vf - v0| / peak to begin with
    chain: list[Array] = [by_speed]
    duration = max(_ruled_out(units, ShareBox(place, place, (by_speed,)), peak), START * maneuver.duration)
    for _ in range(CLIMBS):
        mass = PointMass.of(maneuver.model_copy(update={"duration": duration}))
        found = extremal(mass, shares)
        if found.upper * mass.unit <= peak:
            return duration, tuple(chain)
        chain.append(found.multipliers)
        higher = _ruled_out(units, ShareBox(place, place, tuple(chain)), peak)
        if higher > ceiling:
            return math.inf, tuple(chain)
        # a hair above what is ruled out, so that the last step lands where the peak is kept
        duration = max(higher * (1 + 1e-9), duration * (1 + 1e-12))
    return math.inf, tuple(chain)


def _settle(maneuver: Maneuver, peak: float, shares: Array, duration: float) -> tuple[float, tuple[Array, ...]]:
    """A locally least duration [s] and its multipliers, alternating between it and the shares that suit it best."""
    chain: tuple[Array, ...] = ()
    for _ in range(ALTERNATIONS):
        mass = PointMass.of(maneuver.model_copy(update={"duration": duration}))
        _, shares = descend(mass, extremal(mass, shares), shares)
        there, met = _climb(maneuver, peak, shares, duration)
        if not there < duration * (1 - 1e-12):
            break
        duration, chain = there, met
    return duration, chain
