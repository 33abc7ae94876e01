"""Closed-form integrals along a straight piece p(x) = p_0 + x d, 0 <= x <= 1, d = p_1 - p_0.

With c = d/|d|, n its left normal, s = p . c (which grows from s_0 by |d|), e = p . n (constant) and
r = |p| = sqrt(s^2 + e^2), everything is an integral of s^m / r^k over s:

    int r ds     = (s r + e^2 a) / 2        int 1/r ds   = a        a = asinh(s/|e|)
    int s/r ds   = r                        int s^2/r ds = (s r - e^2 a) / 2

Where |d| is small against |p| the differences lose their digits; there the zeros of |p|^2 are ten piece lengths
away and an eight-point Gauss rule is exact to rounding. All functions take p_0, p_1 of shape (..., 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..types import Array, Mask

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
GAUSS_NODES, GAUSS_WEIGHTS = (1 + _NODES) / 2, _WEIGHTS / 2  # on [0, 1]
STRAIGHT = 0.1  # |d| / |p| up to which the Gauss rule serves
NO_STEP = 1e-100  # |d| up to which its cube is none
NO_OFFSET = 1e-150  # |e| below which the line runs through zero for all purposes


@dataclass(frozen=True)
class _Piece:
    """The coordinates above at both ends; `bent` says where the closed forms apply."""

    bent: Mask
    d: Array
    c: Array
    n: Array
    e: Array
    s: tuple[Array, Array]
    r: tuple[Array, Array]
    a: tuple[Array, Array]

    @classmethod
    def of(cls, first: Array, last: Array) -> _Piece:
        step = last - first
        d = np.hypot(step[..., 0], step[..., 1])
        r = np.hypot(first[..., 0], first[..., 1]), np.hypot(last[..., 0], last[..., 1])
        bent = d > STRAIGHT * np.minimum(*r)
        c = step / np.where(bent, d, 1.0)[..., None]
        n = np.stack([-c[..., 1], c[..., 0]], axis=-1)
        e = np.sum(np.where((r[0] < r[1])[..., None], first, last) * n, axis=-1)
        s = np.sum(first * c, axis=-1), np.sum(last * c, axis=-1)
        safe = np.where(np.abs(e) > NO_OFFSET, np.abs(e), 1.0)
        a = np.arcsinh(s[0] / safe), np.arcsinh(s[1] / safe)
        return cls(bent, np.where(bent, d, 1.0), c, n, e, s, r, a)


def _between(first: Array, last: Array) -> Array:
    """p at the Gauss nodes, shape (..., 8, 2)."""
    return np.asarray(first[..., None, :] + GAUSS_NODES[:, None] * (last - first)[..., None, :])


def mean_norm(first: Array, last: Array) -> Array:
    """int |p| dx, shape (...)."""
    k = _Piece.of(first, last)
    exact = 0.5 * (k.s[1] * k.r[1] - k.s[0] * k.r[0] + k.e**2 * (k.a[1] - k.a[0])) / k.d
    if np.all(k.bent):
        return np.asarray(exact)
    p = _between(first, last)
    return np.asarray(np.where(k.bent, exact, np.hypot(p[..., 0], p[..., 1]) @ GAUSS_WEIGHTS))


def mean_direction(first: Array, last: Array) -> tuple[Array, Array]:
    """int p/|p| dx and int x p/|p| dx, shape (..., 2) each."""
    k = _Piece.of(first, last)
    over_r = k.a[1] - k.a[0]
    s_over_r = k.r[1] - k.r[0]
    ss_over_r = 0.5 * (k.s[1] * k.r[1] - k.s[0] * k.r[0] - k.e**2 * over_r)

    def along(on_c: Array, on_n: Array, power: int) -> Array:
        return np.asarray((on_c[..., None] * k.c + (k.e * on_n)[..., None] * k.n) / k.d[..., None] ** power)

    plain = along(s_over_r, over_r, 1)
    weighted = along(ss_over_r - k.s[0] * s_over_r, s_over_r - k.s[0] * over_r, 2)
    if np.all(k.bent):
        return plain, weighted
    p = _between(first, last)
    size = np.hypot(p[..., 0], p[..., 1])
    unit = p / np.where(size > 0, size, 1.0)[..., None]
    bent = k.bent[..., None]
    return (
        np.asarray(np.where(bent, plain, np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS))),
        np.asarray(np.where(bent, weighted, np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS * GAUSS_NODES))),
    )


def derivatives(first: Sequence[float], last: Sequence[float]) -> list[float]:
    """int |p| dx of one piece (2,) and what its derivatives consist of, for loops over few pieces: scalars, no arrays.

    Returns 14 numbers: int |p| dx; int p/|p| dx and int x p/|p| dx; and for m = 0, 1, 2 the entries xx, xy, yy of
    int x^m K dx, K = (1 - p p'/|p|^2)/|p|. `assembly` makes gradient and Hessian of them, with the weights 1-x and x.

    1 - p p'/|p|^2 = w w' with w = (e c - s n)/r across p: the integrals of s^m/r^3 are, for m = 0 .. 4,
    s/(e^2 r), -1/r, a - s/r, r + e^2/r, s r/2 - 3/2 e^2 a + e^2 s/r. |e| is kept off zero there, where a has no limit.
    """
    (x0, y0), (x1, y1) = first, last
    dx, dy = x1 - x0, y1 - y0
    d, r0, r1 = math.hypot(dx, dy), math.hypot(x0, y0), math.hypot(x1, y1)
    if d <= max(STRAIGHT * min(r0, r1), NO_STEP):
        return [float(x) for x in _smooth(np.asarray(first), np.asarray(last))]
    cx, cy = dx / d, dy / d
    e = y0 * cx - x0 * cy if r0 < r1 else y1 * cx - x1 * cy  # n = (-cy, cx)
    s0, s1 = x0 * cx + y0 * cy, x1 * cx + y1 * cy
    small = abs(e) if abs(e) > NO_OFFSET else 1.0
    over_r = math.asinh(s1 / small) - math.asinh(s0 / small)
    floor = 1e-14 * max(r0, r1)
    off = max(abs(e), floor if floor > 0 else 1.0)
    cubes = _cubes(s0, off, math.hypot, math.asinh), _cubes(s1, off, math.hypot, math.asinh)
    return _closed((cx, cy), d, (s0, s1), (r0, r1), over_r, e, off if e >= 0 else -off, cubes)


def all_derivatives(first: Array, last: Array) -> Array:
    """`derivatives` of pieces (..., 2) at once, shape (..., 14)."""
    k = _Piece.of(first, last)
    floor = 1e-14 * np.maximum(*k.r)
    off = np.maximum(np.abs(k.e), np.where(floor > 0, floor, 1.0))
    cubes = _cubes(k.s[0], off, np.hypot, np.arcsinh), _cubes(k.s[1], off, np.hypot, np.arcsinh)
    c, signed = (k.c[..., 0], k.c[..., 1]), np.where(k.e >= 0, off, -off)
    out = np.stack(_closed(c, k.d, k.s, k.r, k.a[1] - k.a[0], k.e, signed, cubes), axis=-1)
    return out if np.all(k.bent) else np.where(k.bent[..., None], out, _smooth(first, last))


def _closed(c: Any, d: Any, s: Any, r: Any, over_r: Any, e: Any, off: Any, cubes: Any) -> list[Any]:
    """The closed forms, of numbers or of arrays: over_r = int 1/r ds;  off: e, kept off zero;  cubes: at both ends."""
    (cx, cy), (s0, s1), (r0, r1) = c, s, r  # n = (-cy, cx)
    s_over_r, ss_over_r = r1 - r0, 0.5 * (s1 * r1 - s0 * r0 - e * e * over_r)
    norm = 0.5 * (s1 * r1 - s0 * r0 + e * e * over_r) / d
    on_c, on_n = s_over_r / d, e * over_r / d
    out = [norm, on_c * cx - on_n * cy, on_c * cy + on_n * cx]
    on_c, on_n = (ss_over_r - s0 * s_over_r) / d**2, e * (s_over_r - s0 * over_r) / d**2
    out += (on_c * cx - on_n * cy, on_c * cy + on_n * cx)
    # e^2 times the zeroth, |e| times the first: no division by e
    q0, q1, j2, j3, j4 = (b - a for a, b in zip(*cubes, strict=True))
    size = abs(off)
    sign = off / size
    xx, xy, yy, xy2, square = cx * cx, cx * cy, cy * cy, 2 * cx * cy, cx * cx - cy * cy
    for cc, cn, nn in (
        (q0 / d, sign * q1 / d, j2 / d),
        ((size * q1 - s0 * q0) / d**2, sign * (size * j2 - s0 * q1) / d**2, (j3 - s0 * j2) / d**2),
        (
            (size * size * j2 - 2 * s0 * size * q1 + s0 * s0 * q0) / d**3,
            sign * (size * j3 - 2 * s0 * size * j2 + s0 * s0 * q1) / d**3,
            (j4 - 2 * s0 * j3 + s0 * s0 * j2) / d**3,
        ),
    ):
        out += (cc * xx + cn * xy2 + nn * yy, cc * xy - cn * square - nn * xy, cc * yy - cn * xy2 + nn * xx)
    return out


def _cubes(s: Any, e: Any, hypot: Any, asinh: Any) -> tuple[Any, ...]:
    r, a = hypot(s, e), asinh(s / e)
    return s / r, -e / r, a - s / r, r + e * e / r, 0.5 * s * r - 1.5 * e * e * a + e * e * s / r


def _smooth(first: Array, last: Array) -> Array:
    """The same by the Gauss rule, (..., 2) -> (..., 14)."""
    p = _between(first, last)
    r = np.hypot(p[..., 0], p[..., 1])
    size = np.where(r > 0, r, 1.0)[..., None]
    x, y = np.moveaxis(p / size, -1, 0)
    entries = np.stack([y**2, -x * y, x**2], axis=-1) / size
    weights = GAUSS_WEIGHTS * GAUSS_NODES ** np.arange(3)[:, None]
    means = (weights[:2] @ (p / size)).reshape(*r.shape[:-1], 4), (weights @ entries).reshape(*r.shape[:-1], 9)
    return np.concatenate([(r @ GAUSS_WEIGHTS)[..., None], *means], axis=-1)


@lru_cache(maxsize=64)
def assembly(n: int) -> Array:
    """The matrix (14 (n-1), 1 + 2n + 4n^2) that adds up the pieces' `derivatives` at n values P_j, shape (n, 2).

    Row vectors: 14 numbers of each piece, times its length, become I = sum h int |p| dx, dI/dP and d2I/dP2.
    """
    out = np.zeros((n - 1, 14, 1 + 2 * n + 4 * n * n))
    one_less_x = {(0, 0): (1, -2, 1), (0, 1): (0, 1, -1), (1, 0): (0, 1, -1), (1, 1): (0, 0, 1)}
    for j in range(n - 1):
        out[j, 0, 0] = 1
        for i in (0, 1):
            out[j, [1 + i, 3 + i], 1 + 2 * j + i] = 1, -1
            out[j, 3 + i, 3 + 2 * j + i] = 1
        hessian = out[j, :, 1 + 2 * n :].reshape(14, n, 2, n, 2)
        for (a, b), powers in one_less_x.items():
            for m, factor in enumerate(powers):
                for entry, (i, k) in ((0, (0, 0)), (1, (0, 1)), (1, (1, 0)), (2, (1, 1))):
                    hessian[5 + 3 * m + entry, j + a, i, j + b, k] = factor
    return out.reshape(14 * (n - 1), -1)
