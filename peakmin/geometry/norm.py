"""Products and lengths of vectors, and what of one lies across another: along the last axis, in any dimension.

In the plane, where most of the work is, written out: the same digits, several times as fast.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ..types import Array

ROUNDING = 64 * np.finfo(float).eps  # relative error allowed for a sum of products before it is a proof
PARALLEL = 1e-14  # |e| / |p| up to which what is left of p across a direction is rounding errors of p


def dot(a: Array, b: Array) -> Array:
    """a . b, shapes (..., d) -> (...)."""
    if a.shape[-1] == 2:
        return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])
    return np.asarray(np.sum(a * b, axis=-1))


def norm(a: Array) -> Array:
    """|a|, shape (..., d) -> (...); no square of it overflows or vanishes."""
    if a.shape[-1] == 2:
        return np.asarray(np.hypot(a[..., 0], a[..., 1]))
    return np.asarray(np.hypot.reduce(a, axis=-1))


def length(vector: Iterable[float]) -> float:
    """|vector| of one vector of any dimension, as a number."""
    return math.hypot(*vector)


def across(c: Array, p: Array) -> tuple[Array, Array]:
    """n and e with  p - (p . c) c = e n,  n a unit vector across the unit vector c; shapes (..., d) -> (..., d), (...).

    In the plane n is c's left normal, whatever p, and e has a sign. Elsewhere e >= 0, and n = 0 where p lies along c.
    """
    if c.shape[-1] == 2:
        n = np.empty_like(c)
        n[..., 0], n[..., 1] = -c[..., 1], c[..., 0]
        return n, dot(n, p)
    rest = p
    for _ in range(2):  # the first leaves rounding errors of p along c, and they may be all there is
        rest = rest - dot(rest, c)[..., None] * c
    e = norm(rest)
    some = e > PARALLEL * norm(p)
    e = np.where(some, e, 0.0)
    return np.asarray(np.where(some[..., None], rest, 0.0) / np.where(some, e, 1.0)[..., None]), e
