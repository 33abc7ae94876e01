"""Lower bounds that hold for every control, and need no trust in a solver.

At given obstacle times T any admissible multipliers L prove M >= D(L, T) = <L, b(T)> / I(L, T). Over a box of times:
for fixed L the Hessian of I in T is positive semidefinite but for the terms l_i . p(T_i)/|p(T_i)| on its diagonal,
so I + sum |l_i| T_i^2 / 2 is convex, and <L, b> is affine. Interpolating between the corners, with w_i the widths,

    M*(T) >= min over the corners of  <L, b(corner)> / ( I(L, corner) + sum_i |l_i| w_i^2 / 8 )

for every T in the closed box, the ends 0 and 1 included (g_i is as good there as anywhere; nothing is divided by a
length of time), provided that every numerator is positive.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..geometry.norm import ROUNDING, norm
from ..types import Array
from .double_integrator import PointMass, impulse, normalized
from .saddle import saddle


def lower_bound(mass: PointMass, times: Array, multipliers: Array) -> float:
    """D(L, T): no control at all has a smaller peak [scaled] at these times.

    Args:
        mass: the maneuver in scaled units.
        times: obstacle times [scaled], shape (q,).
        multipliers: any L, shape (2+q, d); made admissible first.
    """
    return float(_ratios(mass, times, times, np.zeros(mass.walls), multipliers))


def lower_bounds(masses: PointMass, times: Array, multipliers: Array) -> Array:
    """`lower_bound` of stacked maneuvers, shape (m,), at times (m, q) with multipliers (m, 2+q, d)."""
    return _ratios(masses, times, times, np.zeros(masses.walls), multipliers)


def box_bound(mass: PointMass, low: Array, high: Array, multipliers: Array) -> float:
    """The bound above for low <= T <= high [scaled], shape (q,) each; zero where it proves nothing."""
    ends = [(a,) if a == b else (a, b) for a, b in zip(low, high, strict=True)]
    corners = np.array(list(itertools.product(*ends)), dtype=float)
    return float(np.min(_ratios(mass, corners, np.asarray(high), np.asarray(high) - np.asarray(low), multipliers)))


def _ratios(mass: PointMass, times: Array, latest: Array, width: Array, multipliers: Array) -> Array:
    """<L, b> / (I + sum |l_i| w_i^2 / 8) at times (..., q), less what rounding may have done; zero where not above."""
    mass = mass.facing_for(multipliers)
    trial = mass.admissible(normalized(multipliers))
    size = np.abs(trial)
    b = mass.targets(times)
    error = np.sum(size * (ROUNDING * np.abs(b) + mass.target_errors(latest)), axis=(-2, -1))
    work = np.sum(trial * b, axis=(-2, -1)) - error
    bulge = np.sum(norm(trial[..., 2:, :]) * width**2, axis=-1) / 8
    area = (impulse(trial, times) + bulge) * (1 + ROUNDING) + ROUNDING * np.sum(size, axis=(-2, -1))
    with np.errstate(all="ignore"):
        bound = work / area * (1 - ROUNDING)
    return np.asarray(np.where((work > 0) & np.isfinite(bound), bound, 0.0))


@dataclass(frozen=True)
class Leaf:
    """A box of obstacle times [scaled] and the multipliers that bound M on it: low, high (q,), (2+q, d).

    at: the times for which the multipliers were found, (q,), in the box or not.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    multipliers: Array
    at: tuple[float, ...]

    def bound(self, mass: PointMass) -> float:
        """No control crosses the walls at ordered times in this box with a smaller peak [scaled]."""
        low, high = np.array(self.low), np.array(self.high)
        fixed = box_bound(mass, low, high, self.multipliers)
        return max(fixed, saddle(mass, low, high, np.array(self.at), self.multipliers)[0])


def out_of_order(low: Sequence[float], high: Sequence[float]) -> bool:
    """Whether no T with T_1 < ... < T_q lies in the box."""
    running = -np.inf
    for a, b in zip(low, high, strict=True):
        running = max(running, a)
        if running >= b and (running > a or a == b):
            return True
    return False


def covers(leaves: Sequence[Leaf], low: Sequence[float], high: Sequence[float]) -> bool:
    """Whether the leaves cover every ordered T in the box, by cutting it until leaves are met. Exact in floats."""
    if out_of_order(low, high):
        return True
    inside = [
        leaf
        for leaf in leaves
        if all(a < d and c < b for a, b, c, d in zip(low, high, leaf.low, leaf.high, strict=True))
    ]
    if any(
        all(c <= a and b <= d for a, b, c, d in zip(low, high, leaf.low, leaf.high, strict=True)) for leaf in inside
    ):
        return True
    for axis in range(len(low)):
        edges = {leaf.low[axis] for leaf in inside} | {leaf.high[axis] for leaf in inside}
        for cut in sorted(edges, key=lambda edge: abs(edge - 0.5 * (low[axis] + high[axis]))):
            if low[axis] < cut < high[axis] and not any(leaf.low[axis] < cut < leaf.high[axis] for leaf in inside):
                left, right = list(high), list(low)
                left[axis], right[axis] = cut, cut
                return covers(inside, low, left) and covers(inside, right, high)
    return False


def global_bound(mass: PointMass, leaves: Sequence[Leaf]) -> float:
    """The least bound over leaves that cover all 0 < T_1 < ... < T_q < 1; zero where they leave a gap."""
    if not covers(leaves, [0.0] * mass.walls, [1.0] * mass.walls):
        return 0.0
    return min((leaf.bound(mass) for leaf in leaves), default=0.0)


@dataclass(frozen=True)
class Proof:
    """Why no control has a smaller peak: leaves that cover every obstacle time ("all") or a plan's own ("these")."""

    scope: Literal["all", "these"]
    leaves: tuple[Leaf, ...]

    def bound(self, mass: PointMass, times: Array) -> float:
        """The lower bound [scaled], evaluated anew; zero where the leaves leave a gap.

        Args:
            times: the plan's obstacle times [scaled], shape (q,); matter to the scope "these" only.
        """
        if self.scope == "all":
            return global_bound(mass, self.leaves)
        return max((lower_bound(mass, times, leaf.multipliers) for leaf in self.leaves), default=0.0)
