"""Values of p at the kinks with which every clear wall pushes at all times of a box: proposed, and checked.

A control may pass a clear wall j beyond its tip, so f_j . l_j >= 0 must hold. With the values P and h_j as in
`peakmin.saddle` that is

    f_j . (P_{j+1} - P_j) h_j >= f_j . (P_j - P_{j-1}) h_{j+1}.

Between walls with the same free direction along which p stands still, as above a table, both sides are zero, but for
rounding errors: there p is said to be flat, and counts as standing still exactly.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array, Mask
from .moments import ROUNDING, PointMass

FLAT = 1e-6  # of the largest |P|: change along a wall's free direction that is none


def pushes(mass: PointMass, p: Array, flat: Mask, h: Array) -> bool:
    """Whether every clear wall pushes at all h, (K, q+1), with values that differ from p, (q+2, 2), by less than a
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
    """The values p, (q+2, 2), moved into the walls until each pushes at all h, (K, q+1), or nearly; and where flat.

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
