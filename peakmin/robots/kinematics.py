"""Planar serial arms: where links and centre of mass are, and which angles put the centre of mass at a place.

With absolute angles theta_i, e(a) = (cos a, sin a), and total mass m (payload included),

    r = base + sum_i c_i e(theta_i),      c_i = (m_i a_i + l_i (sum_{j>i} m_j + payload)) / m

Two of the angles, i and j, follow from the others: with s = r - base - sum of the other links, rho = |s| and
delta = theta_j - theta_i,

    rho^2 = c_i^2 + c_j^2 + 2 c_i c_j cos delta,      theta_i = angle(s) - atan2(c_j sin delta, c_i + c_j cos delta)

so |delta| falls from pi to 0 as rho grows from |c_i - c_j| to c_i + c_j, and its sign is the elbow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..types import Array

ANGLE = 1e-9  # rad: up to which a joint counts as within its limits


@dataclass(frozen=True)
class Chain:
    """An arm in numbers, n links, shape (n,) each.

    base [m] (2,), length l [m], mass [kg], com a [m], inertia [kg m^2] about it, half_width w [m], payload [kg].
    """

    base: Array
    length: Array
    mass: Array
    com: Array
    inertia: Array
    half_width: Array
    payload: float

    @property
    def links(self) -> int:
        """Number n of links."""
        return len(self.length)

    @property
    def size(self) -> float:
        """Length of the stretched arm [m]."""
        return float(np.sum(self.length))

    @property
    def total(self) -> float:
        """Mass of links and payload [kg]."""
        return float(np.sum(self.mass)) + self.payload

    @property
    def c(self) -> Array:
        """The centre of mass's share of every link [m], shape (n,)."""
        beyond = np.cumsum(self.mass[::-1])[::-1] - self.mass + self.payload
        return np.asarray((self.mass * self.com + self.length * beyond) / self.total)

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest distance of the centre of mass from the base [m]."""
        c = self.c
        return max(0.0, float(2 * np.max(c) - np.sum(c))), float(np.sum(c))

    def joints(self, theta: ArrayLike) -> Array:
        """Positions [m] of base, joints and tip, (..., n) -> (..., n+1, 2)."""
        steps = self.length[:, None] * unit(theta)
        first = np.zeros_like(steps[..., :1, :])
        return np.asarray(self.base + np.concatenate([first, np.cumsum(steps, axis=-2)], axis=-2))

    def tip(self, theta: ArrayLike) -> Array:
        """Position of the tip [m], (..., n) -> (..., 2)."""
        return np.asarray(self.joints(theta)[..., -1, :])

    def centre(self, theta: ArrayLike) -> Array:
        """Position of the centre of mass [m], (..., n) -> (..., 2)."""
        return np.asarray(self.base + self.c @ unit(theta))


def unit(theta: ArrayLike) -> Array:
    """e(theta), shape (...) -> (..., 2)."""
    return np.stack([np.cos(theta), np.sin(theta)], axis=-1)


@dataclass(frozen=True)
class Pair:
    """Two links of shares a, b [m] that together reach s = a e(theta_i) + b e(theta_j)."""

    a: float
    b: float

    @property
    def inner(self) -> float:
        return abs(self.a - self.b)

    @property
    def outer(self) -> float:
        return self.a + self.b

    def radius(self, bend: float) -> float:
        """|a + b e(bend)| [m], between inner and outer: rho of a bend."""
        near, far = math.sin(bend / 2) ** 2, math.cos(bend / 2) ** 2
        return math.sqrt(far * self.outer**2 + near * self.inner**2)

    def bend(self, rho: Array) -> Array:
        """|delta| at a distance rho [m]; distances out of reach count as the nearest in reach."""
        out, into = self.outer**2 - rho**2, rho**2 - self.inner**2
        return np.asarray(2 * np.arctan2(np.sqrt(np.maximum(out, 0)), np.sqrt(np.maximum(into, 0))))

    def angles(self, s: Array, elbow: Array | float) -> Array:
        """theta_i, theta_j that reach s, (..., 2) -> (..., 2), with the sign of theta_j - theta_i given (...)."""
        delta = elbow * self.bend(np.hypot(s[..., 0], s[..., 1]))
        first = np.arctan2(s[..., 1], s[..., 0]) - np.arctan2(self.b * np.sin(delta), self.a + self.b * np.cos(delta))
        return np.stack([first, first + delta], axis=-1)

    def spread(self, s: Array, radius: Array) -> Array:
        """How far both angles can be from `angles(s)` while s moves in a ball, (..., 2) and (...) -> (..., 2) [rad].

        |delta| is monotone in rho; with delta,  d theta_i / d delta = -1/2 - (b^2 - a^2)/(2 rho^2)  and
        d theta_j / d delta = 1/2 - (b^2 - a^2)/(2 rho^2), both largest at an end.
        """
        rho = np.hypot(s[..., 0], s[..., 1])
        near = np.clip(rho - radius, self.inner, self.outer)
        far = np.clip(rho + radius, self.inner, self.outer)
        turn = np.where(rho > radius, np.arcsin(np.minimum(radius / np.where(rho > 0, rho, 1.0), 1.0)), np.pi)
        middle = self.bend(rho)
        bent = np.maximum(self.bend(near) - middle, middle - self.bend(far))
        skew = (self.b**2 - self.a**2) / 2
        out = []
        for half in (-0.5, 0.5):
            at = [half - skew / np.where(end > 0, end, 1.0) ** 2 for end in (near, far)]
            rate = np.maximum(np.abs(at[0]), np.abs(at[1]))
            out.append(np.where(near > 0, np.minimum(turn + rate * bent, np.pi), np.pi))
        return np.stack(out, axis=-1)
