"""Closed-form integrals along a straight piece p(x) = p_0 + x d, 0 <= x <= 1, d = p_1 - p_0.

With c = d/|d|, n its left normal, s = p . c (which grows from s_0 by |d|), e = p . n (constant) and
r = |p| = sqrt(s^2 + e^2), everything is an integral of s^m / r^k over s:

    int r ds     = (s r + e^2 a) / 2        int 1/r ds   = a        a = asinh(s/|e|)
    int s/r ds   = r                        int s^2/r ds = (s r - e^2 a) / 2

Where |d| is small against |p| the differences lose their digits; there the zeros of |p|^2 are ten piece lengths
away and an eight-point Gauss rule is exact to rounding. All functions take p_0, p_1 of shape (..., 2).
"""

from __future__ import annotations

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
    p = _between(first, last)
    size = np.hypot(p[..., 0], p[..., 1])
    unit = p / np.where(size > 0, size, 1.0)[..., None]
    bent = k.bent[..., None]
    return (
        np.asarray(np.where(bent, plain, np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS))),
        np.asarray(np.where(bent, weighted, np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS * GAUSS_NODES))),
    )


def mean_curvature(first: Array, last: Array) -> Array:
    """int x^m (1 - p p'/|p|^2)/|p| dx for m = 0, 1, 2, shape (..., 3, 2, 2): second derivatives of |p|.

    With w = (e c - s n)/r across p this is int x^m w w'/r; the integrals of s^m/r^3 are, for m = 0 .. 4,
    s/(e^2 r), -1/r, a - s/r, r + e^2/r, s r/2 - 3/2 e^2 a + e^2 s/r. |e| is kept off zero, where a has no limit.
    """
    k = _Piece.of(first, last)
    floor = 1e-14 * np.maximum(k.r[0], k.r[1])
    e = np.maximum(np.abs(k.e), np.where(floor > 0, floor, 1.0))
    sign = np.where(k.e < 0, -1.0, 1.0)
    ends = []
    for s in k.s:
        r = np.hypot(s, e)
        a = np.arcsinh(s / e)
        # e^2 times the zeroth, e times the first: no division by e
        ends.append([s / r, -e / r, a - s / r, r + e * e / r, 0.5 * s * r - 1.5 * e * e * a + e * e * s / r])
    q0, q1, j2, j3, j4 = (b - a for a, b in zip(*ends, strict=True))
    s0, d = k.s[0], k.d
    # integrals of x^m s^i, x = (s - s0)/d, over r^3: i = 0 (times e^2), 1 (times e), 2
    cc = [q0, (e * q1 - s0 * q0) / d, (e * e * j2 - 2 * s0 * e * q1 + s0**2 * q0) / d**2]
    cn = [q1, (e * j2 - s0 * q1) / d, (e * j3 - 2 * s0 * e * j2 + s0**2 * q1) / d**2]
    nn = [j2, (j3 - s0 * j2) / d, (j4 - 2 * s0 * j3 + s0**2 * j2) / d**2]
    c, n = k.c, k.n * sign[..., None]

    def outer(u: Array, v: Array) -> Array:
        return np.asarray(u[..., :, None] * v[..., None, :])

    exact = np.stack(
        [
            (
                cc[m][..., None, None] * outer(c, c)
                - cn[m][..., None, None] * (outer(c, n) + outer(n, c))
                + nn[m][..., None, None] * outer(n, n)
            )
            / d[..., None, None]
            for m in range(3)
        ],
        axis=-3,
    )
    p = _between(first, last)
    size = np.where((r := np.hypot(p[..., 0], p[..., 1])) > 0, r, 1.0)
    across = np.stack([-p[..., 1], p[..., 0]], axis=-1) / size[..., None]
    weights = np.stack([GAUSS_WEIGHTS * GAUSS_NODES**m for m in range(3)])
    smooth = np.einsum("mg,...gi,...gj,...g->...mij", weights, across, across, 1 / size)
    return np.asarray(np.where(k.bent[..., None, None, None], exact, smooth))
