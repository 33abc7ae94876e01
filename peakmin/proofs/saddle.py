"""A lower bound for a box of obstacle times that loses nothing where the walls push, however wide the box is.

Keep the values P_j of p at the kinks T_0 = 0 < T_1 < ... < T_q < T_{q+1} = 1 while the kinks move. With
h_j = T_j - T_{j-1} and r_j the positions there, integration by parts gives for every control

    int p . u dt = P_{q+1} . v_f - P_0 . v_0 + sum_j a_j / h_j =: N(T),     a_j = -(P_j - P_{j-1}) . (r_j - r_{j-1})
    int |p| dt   = sum_j m_j h_j,                                           m_j = the mean of |p| on segment j

and hence M*(T) >= N(T) / sum_j m_j h_j, at clear walls as long as f_j . l_j >= 0, that is
f_j . (P_{j+1} - P_j) h_j >= f_j . (P_j - P_{j-1}) h_{j+1}. All of it is separable in the h_j, and its denominator is
affine: where every a_j >= 0 the bound is quasi-convex in T. Taken from the optimum at times that are optimal themselves
it is then stationary there, and proves in one box that no other times are better.

Values of p at the kinks with which every clear wall pushes at all times of a box: proposed, and checked.

A control may pass a clear wall j beyond its tip, so f_j . l_j >= 0 must hold. With the values P and h_j as in
`peakmin.proofs.saddle` that is

    f_j . (P_{j+1} - P_j) h_j >= f_j . (P_j - P_{j-1}) h_{j+1}.

Between walls with the same free direction along which p stands still, as above a table, both sides are zero, but for
rounding errors: there p is said to be flat, and counts as standing still exactly.
"""

from __future__ import annotations

import numpy as np

from ..geometry.integrals import mean_norm
from ..geometry.norm import ROUNDING
from ..types import Array, Mask
from .double_integrator import PointMass, costate_at_kinks

MOST_VERTICES = 2000  # of the ordered part of a box
SWEEPS = 12  # over the times, towards the least value of the bound in the box
HALVINGS = 40  # of the interval of one time
SHORTEST = 1e-7  # of the duration: segment at which the bound's tangent is taken


def saddle(mass: PointMass, low: Array, high: Array, at: Array, multipliers: Array) -> tuple[float, Array]:
    """A lower bound and where it is about attained: times at which better multipliers can be looked for, shape (q,).

    No control crosses the walls at ordered times in the box with a smaller peak [scaled]; zero where nothing is proved.

    Args:
        low, high: the box [scaled], shape (q,).
        at: the times for which the multipliers were found, shape (q,).
        multipliers: any L, shape (2+q, d); its costate's values at the kinks of `at` are P.
    """
    mass = mass.facing_for(multipliers)
    trial = mass.admissible(multipliers / (np.max(np.abs(multipliers)) or 1.0))
    push = np.any(trial[2:] != 0, axis=1)  # a wall without multiplier is none, whenever it is crossed
    place = np.clip(at, low, high)
    trial, low, high, at = trial[np.r_[True, True, push]], low[push], high[push], at[push]
    mass = mass.only(push)
    h = segments(vertices(low, high))
    if not len(h):
        return 0.0, place
    values = costate_at_kinks(trial, at)[1]
    if not np.any(values):
        return 0.0, place
    p, flat = pushing(mass, values / np.max(np.abs(values)), h)
    if not pushes(mass, p, flat, h):
        return 0.0, place
    (a, c), m = _work(mass, p), mean_norm(p[:-1], p[1:])
    least, most = np.min(h, axis=0), np.max(h, axis=0)
    concave = a < 0
    if np.any(concave & (least <= 0)):
        return 0.0, place
    # a/h from below by lines in h: its chord where it is concave
    convex, slope = np.maximum(a, 0.0), np.zeros_like(a)
    slope[concave] = -a[concave] / (least[concave] * most[concave])
    level = c + np.sum(a[concave] * (1 / least[concave] + 1 / most[concave]))
    best = 0.0
    start = place[push]
    place[push] = _lowest(convex, slope, level, m, low, high, start)
    for lowest in (start, place[push]):
        # ... and its tangent where it is convex
        there = np.maximum(segments(lowest), SHORTEST)
        steep = slope - convex / there**2
        height = level + 2 * np.sum(convex / there)
        work = height + h @ steep - ROUNDING * (np.abs(c) + np.abs(level) + np.abs(height) + h @ np.abs(steep))
        area = (h @ m) * (1 + ROUNDING) + ROUNDING * np.max(m)
        if np.all(work > 0):
            best = max(best, float(np.min(work / area)) * (1 - ROUNDING))
    return best if np.isfinite(best) else 0.0, place


def _work(mass: PointMass, p: Array) -> tuple[Array, float]:
    """a_j, shape (q+1,), and P_{q+1} . v_f - P_0 . v_0, less what rounding may have done: p may be another by a
    rounding error of its own size, see `pushes`.
    """
    r = np.vstack([np.zeros_like(mass.pf), mass.tips, mass.pf])
    dp, dr = np.diff(p, axis=0), np.diff(r, axis=0)
    grain = ROUNDING * np.sum((np.abs(p[1:]) + np.abs(p[:-1])) * (np.abs(r[1:]) + np.abs(r[:-1])), axis=1)
    a = -np.sum(dp * dr, axis=1) - grain
    c = p[-1] @ mass.vf - p[0] @ mass.v0 - ROUNDING * (np.abs(p[-1]) @ np.abs(mass.vf) + np.abs(p[0]) @ np.abs(mass.v0))
    return a, float(c)


def segments(times: Array) -> Array:
    """h_j, shape (..., q+1), of times (..., q)."""
    ends = np.zeros((*times.shape[:-1], 1))
    return np.diff(np.concatenate([ends, times, ends + 1], axis=-1), axis=-1)


def vertices(low: Array, high: Array) -> Array:
    """Points of the box in order, every vertex of its ordered part among them, shape (K, q); none if too many.

    At a vertex each time is at an end of its own interval or equal to a neighbour that is.
    """
    places = np.unique(np.concatenate([low, high]))
    points = np.zeros((1, 0))
    for a, b in zip(low, high, strict=True):
        own = places[(places >= a) & (places <= b)]
        points = np.hstack([np.repeat(points, len(own), axis=0), np.tile(own, len(points))[:, None]])
        if points.shape[1] > 1:
            points = points[points[:, -1] >= points[:, -2]]
        if len(points) > MOST_VERTICES:
            return np.zeros((0, len(low)))
    return points


def _lowest(convex: Array, slope: Array, level: float, m: Array, low: Array, high: Array, start: Array) -> Array:
    """Times in the box where (level + sum convex/h + slope h) / (sum m h) is about least, one time after the other."""
    t = [0.0, *start.tolist(), 1.0]
    q = len(start)
    for _ in range(SWEEPS if q > 1 else 3):
        h = np.maximum(segments(np.array(t[1:-1])), SHORTEST)
        value = (level + float(np.sum(convex / h + slope * h))) / float(m @ h)
        line = slope - value * m
        moved = 0.0
        for i in range(q):
            a, b = max(low[i], t[i]), min(high[i], t[i + 2])
            left, right, tilt = convex[i], convex[i + 1], line[i] - line[i + 1]
            for _ in range(HALVINGS):
                x = 0.5 * (a + b)
                gain = tilt - left / max(x - t[i], 1e-12) ** 2 + right / max(t[i + 2] - x, 1e-12) ** 2
                a, b = (a, x) if gain > 0 else (x, b)
            moved, t[i + 1] = max(moved, abs(t[i + 1] - 0.5 * (a + b))), 0.5 * (a + b)
        if moved < 1e-10:
            break
    return np.array(t[1:-1])


FLAT = 1e-6  # of the largest |P|: change along a wall's free direction that is none


def pushes(mass: PointMass, p: Array, flat: Mask, h: Array) -> bool:
    """Whether every clear wall pushes at all h, (K, q+1), with values that differ from p, (q+2, d), by less than a
    rounding error each and stand still on the segments `flat`, a mask (q+1,).
    """
    first = 0
    for j in range(mass.walls + 1):
        if not flat[j]:
            first = j + 1
        elif not (0 < j < mass.walls and _alike(mass, j - 1, j)):
            return False
        else:
            f, last = mass.free[j], p[j + 1]
            if abs(f @ (last - p[first])) > ROUNDING / 4 * (np.abs(f) @ (np.abs(last) + np.abs(p[first]))):
                return False
    return all(_short(mass, p, flat, h, j) <= 0 for j in np.flatnonzero(mass.clear).tolist())


def _short(mass: PointMass, p: Array, flat: Mask, h: Array, j: int) -> float:
    """By how much p would have to be moved into wall j for it to push at all h, (K, q+1); 0 where it does."""
    f, grain = mass.free[j], ROUNDING * float(np.max(np.abs(p)))
    before = 0.0 if flat[j] else f @ (p[j + 1] - p[j]) + grain
    after = 0.0 if flat[j + 1] else f @ (p[j + 2] - p[j + 1]) - grain
    span = h[:, j] + h[:, j + 1]
    short = before * h[:, j + 1] - after * h[:, j]
    return float(np.max(short[span > 0] / span[span > 0], initial=0.0))


def pushing(mass: PointMass, p: Array, h: Array) -> tuple[Array, Mask]:
    """The values p, (q+2, d), moved into the walls until each pushes at all h, (K, q+1), or nearly; and where flat.

    Walls that p stands still between are moved together.
    """
    p = p.copy()
    size = float(np.max(np.abs(p)))
    q, f = mass.walls, mass.free
    flat = np.zeros(q + 1, dtype=bool)
    for j in range(1, q):
        if _alike(mass, j - 1, j) and abs(step := f[j] @ (p[j + 1] - p[j])) <= FLAT * size:
            p[j + 1] -= step * f[j]
            flat[j] = True
    for _ in range(2 + 2 * q):
        moved = False
        for j in np.flatnonzero(mass.clear).tolist():
            short = _short(mass, p, flat, h, j)
            if short <= 0:
                continue
            moved = True
            if not flat[j + 1] and f[j] @ (p[j + 2] - p[j + 1]) < 0 and j + 1 < q and _alike(mass, j, j + 1):
                flat[j + 1] = True  # rather than past the next wall's
            elif not flat[j] and f[j] @ (p[j + 1] - p[j]) > 0 and j > 0 and _alike(mass, j - 1, j):
                flat[j] = True
            else:
                first, last = _flat_around(flat, j)
                p[first + 1 : last + 2] -= (short * (1 + 1e-9) + 4 * ROUNDING * size) * f[j]
                continue
            first, last = _flat_around(flat, j)
            level = p[first + 1 : last + 2] @ f[j]
            p[first + 1 : last + 2] += (np.min(level) - level)[:, None] * f[j]
        if not moved:
            break
    return p, flat


def _alike(mass: PointMass, i: int, j: int) -> bool:
    """Whether two walls are clear and have the same free direction."""
    return bool(mass.clear[i] and mass.clear[j] and np.all(mass.free[i] == mass.free[j]))


def _flat_around(flat: Mask, j: int) -> tuple[int, int]:
    """The first and the last wall that p stands still from and to, wall j among them."""
    first, last = j, j
    while flat[first]:
        first -= 1
    while flat[last + 1]:
        last += 1
    return first, last
