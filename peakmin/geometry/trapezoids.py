"""Strips between vertical lines, and the free trapezoids that polygons leave in each.

Corners lie on the lines: what is nearer to a line than rounding errors is moved there. So an edge either spans whole
strips or stands upright between two of them, and every section is that of an edge between its own ends, however steep.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..types import Array

Interval = tuple[float, float]  # of y [m], either end may be infinite


@dataclass(frozen=True)
class Gap:
    """A free trapezoid between x = across[0] and across[1] [m]: y at both, of its lower and its upper edge [m].

    Without an edge both are infinite.
    """

    across: Interval
    low: Interval
    high: Interval

    def at(self, x: Any) -> Any:  # Any: numbers of a number; of an array arrays, but for infinite ends
        """Its section at x, or the two ends of those at all x of an array."""
        share = (x - self.across[0]) / ((self.across[1] - self.across[0]) or 1.0)
        return tuple(a if math.isinf(a) else a * (1 - share) + b * share for a, b in (self.low, self.high))


def lines_through(corners: Sequence[float], walls: Sequence[float], length: float, grain: float) -> list[float]:
    """The x of all strips' ends, 0 and D = length included [m]: walls, 0 < x < D, and corners further than grain [m]
    from the last line and from the goal's.
    """
    out, own = [0.0], frozenset(walls)
    for x in sorted({*corners, *own}):
        if x in own and len(out) > 1 and out[-1] not in own and x <= out[-1] + grain:
            out[-1] = x
        elif x in own or out[-1] + grain < x < length - grain:
            out.append(x)
    return [*out, length]


def snapped(ring: Array, lines: Array) -> Array:
    """A ring's corners (n, 2), those between the first and the last line on the nearest one."""
    x = ring[:, 0]
    after = np.clip(np.searchsorted(lines, x), 1, len(lines) - 1)
    nearest = np.where(lines[after] - x < x - lines[after - 1], lines[after], lines[after - 1])
    return np.stack([np.where((lines[0] < x) & (x < lines[-1]), nearest, x), ring[:, 1]], axis=1)


def edges_of(rings: Sequence[Array]) -> Array:
    """All edges of rings (n, 2) that do not stand upright, from left to right, (E, 4): x, y of either end [m]."""
    every = np.concatenate([np.zeros((0, 4)), *(np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings)])
    turned = np.where((every[:, 0] > every[:, 2])[:, None], every[:, [2, 3, 0, 1]], every)
    return np.asarray(turned[turned[:, 0] < turned[:, 2]])


def heights(edges: Array, x: Array) -> Array:
    """Where edges (E, 4) cross the lines at x (E,) that they reach [m]: exact at their ends."""
    share = (x - edges[:, 0]) / (edges[:, 2] - edges[:, 0])
    return np.asarray(edges[:, 1] * (1 - share) + edges[:, 3] * share)


def trapezoids(edges: Array, lines: Array) -> list[list[Gap]]:
    """For each strip what the edges (E, 4) of closed rings, corners on the lines, leave free, from below.

    An edge that begins before the first line or ends behind the last one is cut there.
    """
    first = np.searchsorted(lines, edges[:, 0], side="right") - 1
    last = np.minimum(np.searchsorted(lines, edges[:, 2]), len(lines) - 1)
    first = np.maximum(first, 0)
    count = np.maximum(last - first, 0)
    edge = np.repeat(np.arange(len(edges)), count)
    strip = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count - first, count)
    left, right = heights(edges[edge], lines[strip]), heights(edges[edge], lines[strip + 1])
    order = np.lexsort((left + right, strip))
    ends = np.stack([left, right], axis=1)[order].tolist()
    cuts = np.searchsorted(strip[order], np.arange(len(lines))).tolist()
    across, out = lines.tolist(), []
    for k, (i, j) in enumerate(zip(cuts, cuts[1:], strict=False)):
        bounds = [(-math.inf, -math.inf), *map(tuple, ends[i:j]), (math.inf, math.inf)]
        pairs = zip(bounds[::2], bounds[1::2], strict=True)
        out.append([Gap((across[k], across[k + 1]), low, high) for low, high in pairs])
    return out
