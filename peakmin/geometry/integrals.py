"""Closed-form integrals along a straight piece p(x) = p_0 + x (p_1 - p_0), 0 <= x <= 1, of vectors in any dimension.

With g = |p_1 - p_0|, c = (p_1 - p_0)/g, s = p . c (which grows from s_0 by g), e n = p - s c (constant; n a unit vector
across c) and r = |p| = sqrt(s^2 + e^2), everything is an integral of s^m / r^k over s:

    int r ds     = (s r + e^2 a) / 2        int 1/r ds   = a        a = asinh(s/|e|)
    int s/r ds   = r                        int s^2/r ds = (s r - e^2 a) / 2

Where g is small against |p| the differences lose their digits; there the zeros of |p|^2 are ten piece lengths
away and an eight-point Gauss rule is exact to rounding. All functions take p_0, p_1 of shape (..., d).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from ..types import Array, Mask
from .norm import across, dot, norm

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
GAUSS_NODES, GAUSS_WEIGHTS = (1 + _NODES) / 2, _WEIGHTS / 2  # on [0, 1]
STRAIGHT = 0.1  # g / |p| up to which the Gauss rule serves
NO_STEP = 1e-100  # g up to which its cube is none
NO_OFFSET = 1e-150  # |e| below which the line runs through zero for all purposes

Number = TypeVar("Number", float, Array)  # of one piece, or of many at once


@dataclass(frozen=True)
class _Piece:
    """The coordinates above, s and r and a at both ends; `bent` says where the closed forms apply."""

    bent: Mask
    g: Array
    c: Array
    n: Array
    e: Array
    s: tuple[Array, Array]
    r: tuple[Array, Array]
    a: tuple[Array, Array]

    @classmethod
    def of(cls, first: Array, last: Array) -> _Piece:
        step = last - first
        g, r = norm(step), (norm(first), norm(last))
        bent = g > STRAIGHT * np.minimum(*r)
        g = np.where(bent, g, 1.0)
        c = np.where(bent[..., None], step, 0.0) / g[..., None]
        n, e = across(c, np.where((r[0] < r[1])[..., None], first, last))
        s, safe = (dot(first, c), dot(last, c)), np.where(np.abs(e) > NO_OFFSET, np.abs(e), 1.0)
        return cls(bent, g, c, n, e, s, r, (np.arcsinh(s[0] / safe), np.arcsinh(s[1] / safe)))


def _between(first: Array, last: Array) -> Array:
    """p at the Gauss nodes, shape (..., 8, d)."""
    return np.asarray(first[..., None, :] + GAUSS_NODES[:, None] * (last - first)[..., None, :])


def _unit(p: Array) -> tuple[Array, Array]:
    """p/|p| and |p| as what it is divided by, which is 1 where p is zero."""
    r = norm(p)
    r = np.where(r > 0, r, 1.0)
    return p / r[..., None], r


def mean_norm(first: Array, last: Array) -> Array:
    """int |p| dx, shape (...)."""
    k = _Piece.of(first, last)
    exact = _size(k.s, k.r, k.e, k.a[1] - k.a[0]) / k.g
    if np.all(k.bent):
        return np.asarray(exact)
    return np.asarray(np.where(k.bent, exact, norm(_between(first, last)) @ GAUSS_WEIGHTS))


def mean_direction(first: Array, last: Array) -> tuple[Array, Array]:
    """int p/|p| dx and int x p/|p| dx, shape (..., d) each."""
    k = _Piece.of(first, last)
    exact = [
        (on_c[..., None] * k.c + on_n[..., None] * k.n) / k.g[..., None] ** power
        for power, (on_c, on_n) in enumerate(_directions(k.s, k.r, k.e, k.a[1] - k.a[0]), start=1)
    ]
    if np.all(k.bent):
        return exact[0], exact[1]
    unit, _ = _unit(_between(first, last))
    bent = k.bent[..., None]
    return (
        np.asarray(np.where(bent, exact[0], np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS))),
        np.asarray(np.where(bent, exact[1], np.einsum("...gi,g->...i", unit, GAUSS_WEIGHTS * GAUSS_NODES))),
    )


def derivatives(first: Sequence[float], last: Sequence[float]) -> list[float]:
    """int |p| dx of one piece (d,) and what its derivatives consist of, for loops over few pieces.

    Returns 1 + 2 d + 3 d(d+1)/2 numbers: int |p| dx; int p/|p| dx and int x p/|p| dx; and for m = 0, 1, 2 the entries
    on and above the diagonal of int x^m K dx, K = (1 - p p'/|p|^2)/|p|. `assembly` makes gradient and Hessian of them,
    with the weights 1-x and x. In the plane they are computed as numbers, without arrays: in 5 us, not 110.
    """
    if len(first) != 2:
        return [float(x) for x in all_derivatives(np.asarray(first), np.asarray(last))]
    (x0, y0), (x1, y1) = first, last
    dx, dy = x1 - x0, y1 - y0
    g, r0, r1 = math.hypot(dx, dy), math.hypot(x0, y0), math.hypot(x1, y1)
    if g <= max(STRAIGHT * min(r0, r1), NO_STEP):
        return [float(x) for x in _smooth(np.asarray(first), np.asarray(last))]
    cx, cy = dx / g, dy / g
    e = y0 * cx - x0 * cy if r0 < r1 else y1 * cx - x1 * cy  # n = (-cy, cx)
    s0, s1 = x0 * cx + y0 * cy, x1 * cx + y1 * cy
    small = abs(e) if abs(e) > NO_OFFSET else 1.0
    over_r = math.asinh(s1 / small) - math.asinh(s0 / small)
    floor = 1e-14 * max(r0, r1)
    off = max(abs(e), floor if floor > 0 else 1.0)
    cubes = _cubes(s0, off, math.hypot, math.asinh), _cubes(s1, off, math.hypot, math.asinh)
    return _closed((cx, cy), (-cy, cx), g, (s0, s1), (r0, r1), over_r, e, off if e >= 0 else -off, cubes)


def all_derivatives(first: Array, last: Array) -> Array:
    """`derivatives` of pieces (..., d) at once, shape (..., 1 + 2 d + 3 d(d+1)/2)."""
    k = _Piece.of(first, last)
    floor = 1e-14 * np.maximum(*k.r)
    off = np.maximum(np.abs(k.e), np.where(floor > 0, floor, 1.0))
    cubes = _cubes(k.s[0], off, np.hypot, np.arcsinh), _cubes(k.s[1], off, np.hypot, np.arcsinh)
    c, n, signed = list(np.moveaxis(k.c, -1, 0)), list(np.moveaxis(k.n, -1, 0)), np.where(k.e >= 0, off, -off)
    closed = np.stack(_closed(c, n, k.g, k.s, k.r, k.a[1] - k.a[0], k.e, signed, cubes), axis=-1)
    return closed if np.all(k.bent) else np.where(k.bent[..., None], closed, _smooth(first, last))


def _size(s: tuple[Number, Number], r: tuple[Number, Number], e: Number, over_r: Number) -> Number:
    """int r ds = g int |p| dx, of over_r = int 1/r ds."""
    return 0.5 * (s[1] * r[1] - s[0] * r[0] + e * e * over_r)


def _directions(
    s: tuple[Number, Number], r: tuple[Number, Number], e: Number, over_r: Number
) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
    """g int p/|p| dx and g^2 int x p/|p| dx, each along c and along n, of over_r = int 1/r ds."""
    s_over_r, ss_over_r = r[1] - r[0], 0.5 * (s[1] * r[1] - s[0] * r[0] - e * e * over_r)
    return (s_over_r, e * over_r), (ss_over_r - s[0] * s_over_r, e * (s_over_r - s[0] * over_r))


def _closed(
    c: Sequence[Number],
    n: Sequence[Number],
    g: Number,
    s: tuple[Number, Number],
    r: tuple[Number, Number],
    over_r: Number,
    e: Number,
    signed: Number,
    cubes: tuple[tuple[Number, ...], tuple[Number, ...]],
) -> list[Number]:
    """The closed forms, of numbers or of arrays: what they are along c and n, turned.

    Args:
        c, n: their d components.
        over_r: int 1/r ds.
        signed: e, kept off zero.
        cubes: those of `_cubes` at both ends.
    """
    (plain_c, plain_n), (weighted_c, weighted_n) = _directions(s, r, e, over_r)
    q0, q1, j2, j3, j4 = (b - a for a, b in zip(*cubes, strict=True))
    s0, off = s[0], abs(signed)
    sign = signed / off
    vectors: list[tuple[Number, Number]] = [(plain_c / g, plain_n / g), (weighted_c / g**2, weighted_n / g**2)]
    matrices: list[tuple[Number, Number, Number]] = [
        (q0 / g, sign * q1 / g, j2 / g),
        ((off * q1 - s0 * q0) / g**2, sign * (off * j2 - s0 * q1) / g**2, (j3 - s0 * j2) / g**2),
        (
            (off * off * j2 - 2 * s0 * off * q1 + s0 * s0 * q0) / g**3,
            sign * (off * j3 - 2 * s0 * off * j2 + s0 * s0 * q1) / g**3,
            (j4 - 2 * s0 * j3 + s0 * s0 * j2) / g**3,
        ),
    ]
    out: list[Number] = [_size(s, r, e, over_r) / g]
    out += _turned_in_the_plane(c, vectors, matrices) if len(c) == 2 else _turned(c, n, vectors, matrices)
    return out


def _turned(
    c: Sequence[Number],
    n: Sequence[Number],
    vectors: Iterable[tuple[Number, Number]],
    matrices: Iterable[tuple[Number, Number, Number]],
) -> list[Number]:
    """Components of vectors given along c and n, and of K's moments given by those of v v', v = e c - s n across p:

        K = (v v'/r^2 + 1 - c c' - n n') / r,

    the three integrals of e^2/r^3, e s/r^3 and s^2/r^3; the first and the last add up to that of 1/r. Where p runs
    through zero n is none, and all that lies across c counts alike, as n does in the plane.
    """
    out = [on_c * a + on_n * b for on_c, on_n in vectors for a, b in zip(c, n, strict=True)]
    rows = range(len(c))
    entries = [(c[i] * c[j], c[i] * n[j] + n[i] * c[j], n[i] * n[j], i == j) for i in rows for j in rows[i:]]
    across = sum(b * b for b in n)  # 1, or 0
    for ee, es, ss in matrices:
        out += [ee * cc - es * cn + ss * nn + (across * ee + ss) * (one - cc - nn) for cc, cn, nn, one in entries]
    return out


def _turned_in_the_plane(
    c: Sequence[Number],
    vectors: Iterable[tuple[Number, Number]],
    matrices: Iterable[tuple[Number, Number, Number]],
) -> list[Number]:
    """The same, where n = (-cy, cx) and nothing lies across both, written out: a piece takes 5 us, not 8."""
    cx, cy = c
    out: list[Number] = []
    for on_c, on_n in vectors:
        out += (on_c * cx - on_n * cy, on_c * cy + on_n * cx)
    xx, xy, yy, xy2, square = cx * cx, cx * cy, cy * cy, 2 * cx * cy, cx * cx - cy * cy
    for ee, es, ss in matrices:
        out += (ee * xx + es * xy2 + ss * yy, ee * xy - es * square - ss * xy, ee * yy - es * xy2 + ss * xx)
    return out


def _cubes(
    s: Number, e: Number, hypot: Callable[[Number, Number], Number], asinh: Callable[[Number], Number]
) -> tuple[Number, ...]:
    """int s^m/r^3 ds up to s for m = 0 .. 4, the first two times e^2 and e, so that nothing is divided by e:

    s/r, -e/r, a - s/r, r + e^2/r, s r/2 - 3/2 e^2 a + e^2 s/r. e is kept off zero here, where a has no limit.
    """
    r, a = hypot(s, e), asinh(s / e)
    return s / r, -e / r, a - s / r, r + e * e / r, 0.5 * s * r - 1.5 * e * e * a + e * e * s / r


def _smooth(first: Array, last: Array) -> Array:
    """The same by the Gauss rule, (..., d) -> (..., 1 + 2 d + 3 d(d+1)/2)."""
    unit, r = _unit(p := _between(first, last))
    u = list(np.moveaxis(unit, -1, 0))
    # on the diagonal 1 - u_i^2 as the squares of the others, which cancel nothing
    square, rows, none = [x * x for x in u], range(len(u)), np.zeros_like(r)
    entries = [sum(square[:i] + square[i + 1 :], none) if i == j else -u[i] * u[j] for i in rows for j in rows[i:]]
    weights = GAUSS_WEIGHTS * GAUSS_NODES ** np.arange(3)[:, None]
    curved = weights @ (np.stack(entries, axis=-1) / r[..., None])
    means = (weights[:2] @ unit).reshape(*r.shape[:-1], -1), curved.reshape(*r.shape[:-1], -1)
    return np.concatenate([(norm(p) @ GAUSS_WEIGHTS)[..., None], *means], axis=-1)


@lru_cache(maxsize=64)
def assembly(n: int, d: int) -> Array:
    """The matrix that adds up the n-1 pieces' `derivatives` at n values P_j, shape (n, d).

    Row vectors: all numbers of all pieces, times the pieces' lengths, become I = sum h int |p| dx, dI/dP and d2I/dP2:
    1 + n d + (n d)^2 numbers.
    """
    rows, columns = np.triu_indices(d)
    size, each = n * d, 1 + 2 * d + 3 * len(rows)
    out = np.zeros((n - 1, each, 1 + size + size**2))
    one_less_x = {(0, 0): (1, -2, 1), (0, 1): (0, 1, -1), (1, 0): (0, 1, -1), (1, 1): (0, 0, 1)}
    axes = np.arange(d)
    for j in range(n - 1):
        out[j, 0, 0] = 1
        gradient = out[j, :, 1 : 1 + size].reshape(each, n, d)
        gradient[1 + axes, j, axes], gradient[1 + d + axes, j, axes] = 1, -1
        gradient[1 + d + axes, j + 1, axes] = 1
        hessian = out[j, :, 1 + size :].reshape(each, n, d, n, d)
        for (a, b), powers in one_less_x.items():
            for m, factor in enumerate(powers):
                entry = 1 + 2 * d + m * len(rows) + np.arange(len(rows))
                hessian[entry, j + a, rows, j + b, columns] = factor
                hessian[entry, j + a, columns, j + b, rows] = factor
    return out.reshape((n - 1) * each, -1)
