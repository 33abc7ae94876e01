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

import numpy as np

from .arrays import Array, Mask

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
GAUSS_NODES, GAUSS_WEIGHTS = (1 + _NODES) / 2, _WEIGHTS / 2  # on [0, 1]
STRAIGHT = 0.1  # |d| / |p| up to which the Gauss rule serves
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


def derivatives(first: Sequence[float], last: Sequence[float]) -> tuple[float, list[float], list[list[float]]]:
    """int |p| dx of one piece (2,), its gradient (4,) and its Hessian (4, 4) in (p_0, p_1). Scalar and fast.

    The gradient is int (1-x, x) p/|p| dx; the Hessian int (1-x, x)(1-x, x)' (1 - p p'/|p|^2)/|p| dx, where
    1 - p p'/|p|^2 = w w' with w = (e c - s n)/r across p: the integrals of s^m/r^3 are, for m = 0 .. 4,
    s/(e^2 r), -1/r, a - s/r, r + e^2/r, s r/2 - 3/2 e^2 a + e^2 s/r. |e| is kept off zero there, where a has no limit.
    """
    (x0, y0), (x1, y1) = first, last
    dx, dy = x1 - x0, y1 - y0
    d, r0, r1 = math.hypot(dx, dy), math.hypot(x0, y0), math.hypot(x1, y1)
    if d <= STRAIGHT * min(r0, r1) or d == 0:
        return _smooth(first, last)
    c = cx, cy = dx / d, dy / d
    n = -cy, cx
    e = x0 * n[0] + y0 * n[1] if r0 < r1 else x1 * n[0] + y1 * n[1]
    s0, s1 = x0 * cx + y0 * cy, x1 * cx + y1 * cy
    small = abs(e) if abs(e) > NO_OFFSET else 1.0
    over_r = math.asinh(s1 / small) - math.asinh(s0 / small)
    s_over_r, ss_over_r = r1 - r0, 0.5 * (s1 * r1 - s0 * r0 - e * e * over_r)
    norm = 0.5 * (s1 * r1 - s0 * r0 + e * e * over_r) / d
    plain = [(s_over_r * c[i] + e * over_r * n[i]) / d for i in (0, 1)]
    on_c, on_n = (ss_over_r - s0 * s_over_r) / d**2, e * (s_over_r - s0 * over_r) / d**2
    weighted = [on_c * c[i] + on_n * n[i] for i in (0, 1)]
    gradient = [plain[0] - weighted[0], plain[1] - weighted[1], *weighted]
    floor = 1e-14 * max(r0, r1)
    sign, e = (-1.0 if e < 0 else 1.0), max(abs(e), floor if floor > 0 else 1.0)
    # e^2 times the zeroth, e times the first: no division by e
    q0, q1, j2, j3, j4 = (b - a for a, b in zip(_cubes(s0, e), _cubes(s1, e), strict=True))
    cc = q0, (e * q1 - s0 * q0) / d, (e * e * j2 - 2 * s0 * e * q1 + s0 * s0 * q0) / d**2
    cn = q1, (e * j2 - s0 * q1) / d, (e * j3 - 2 * s0 * e * j2 + s0 * s0 * q1) / d**2
    nn = j2, (j3 - s0 * j2) / d, (j4 - 2 * s0 * j3 + s0 * s0 * j2) / d**2
    square, mixed = (cx * cx, cx * cy, cy * cy), (-2 * cx * cy, cx * cx - cy * cy, 2 * cx * cy)
    across = square[2], -square[1], square[0]
    moments = [
        [(cc[m] * square[i] - sign * cn[m] * mixed[i] + nn[m] * across[i]) / d for i in range(3)] for m in range(3)
    ]
    return norm, gradient, _block(*moments)


def _cubes(s: float, e: float) -> tuple[float, float, float, float, float]:
    r, a = math.hypot(s, e), math.asinh(s / e)
    return s / r, -e / r, a - s / r, r + e * e / r, 0.5 * s * r - 1.5 * e * e * a + e * e * s / r


def _smooth(first: Sequence[float], last: Sequence[float]) -> tuple[float, list[float], list[list[float]]]:
    """The same by the Gauss rule."""
    p = _between(np.asarray(first), np.asarray(last))
    r = np.hypot(p[:, 0], p[:, 1])
    size = np.where(r > 0, r, 1.0)
    along = p / size[:, None]
    x, w = GAUSS_NODES, GAUSS_WEIGHTS
    entries = np.stack([along[:, 1] ** 2, -along[:, 0] * along[:, 1], along[:, 0] ** 2]) / size
    moments = [(entries @ (w * x**m)).tolist() for m in range(3)]
    return float(w @ r), [*((w * (1 - x)) @ along).tolist(), *((w * x) @ along).tolist()], _block(*moments)


def _block(zeroth: list[float], linear: list[float], square: list[float]) -> list[list[float]]:
    """int (1-x, x)(1-x, x)' k dx, rows of (4, 4), from the entries xx, xy, yy of int k, int x k and int x^2 k."""
    a = [z - 2 * m + s for z, m, s in zip(zeroth, linear, square, strict=True)]
    b = [m - s for m, s in zip(linear, square, strict=True)]
    c = square
    return [
        [a[0], a[1], b[0], b[1]],
        [a[1], a[2], b[1], b[2]],
        [b[0], b[1], c[0], c[1]],
        [b[1], b[2], c[1], c[2]],
    ]
