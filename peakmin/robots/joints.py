"""The joints' motion that makes the centre of mass follow a path, with its speeds and accelerations in closed form.

Two links i, j carry what the others leave: with theta_k(t) given for the others, theta_i and theta_j follow from the
path (`peakmin.robots.kinematics.Pair`). With e'(a) = (-sin a, cos a),

    c_i e'(theta_i) theta_i' + c_j e'(theta_j) theta_j' = r' - sum_k c_k e'(theta_k) theta_k'
    c_i e'(theta_i) theta_i'' + c_j e'(theta_j) theta_j''
        = r'' + sum_all c e(theta) theta'^2 - sum_k c_k e'(theta_k) theta_k''

Torques are those of `peakmin.robots.dynamics`; tau_1 is the base moment, and the base force is  sum m_m r_m'' = m u
whatever the inertias.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PPoly

from ..geometry.trajectory import Trajectory
from ..types import Array
from .dynamics import inverse_dynamics
from .joint_motion import JointMotion
from .kinematics import Chain, Pair, unit

STRAIGHT = 1e-6  # |sin delta| below which speeds are taken a little beside the instant
BESIDE = 1e-6  # of the duration
GRID = 2000  # samples that the turns of the angles are counted along


@dataclass(frozen=True)
class JointPath:
    """Absolute angles theta(t) of all links along a motion of the centre of mass.

    pair: which two links follow;  elbow: sign of theta_j - theta_i at the start;  changes: times [s] at which it turns
    over, in order;  others: theta_k(t) of the rest, in order, as one spline (t) -> (n-2,), None for two links;
    start: absolute angles that the motion begins with, shape (n,), whose full turns are kept.
    """

    chain: Chain
    motion: Trajectory
    pair: tuple[int, int]
    elbow: float
    changes: tuple[float, ...]
    others: CubicSpline | None
    start: Array

    @cached_property
    def two(self) -> Pair:
        c = self.chain.c
        return Pair(float(c[self.pair[0]]), float(c[self.pair[1]]))

    @cached_property
    def rest(self) -> list[int]:
        return [k for k in range(self.chain.links) if k not in self.pair]

    @property
    def duration(self) -> float:
        return float(self.motion.nodes[-1])

    def _other(self, t: Array, order: int = 0) -> Array:
        if self.others is None:
            return np.zeros((*t.shape, 0))
        return np.asarray(self.others(t, order))

    def elbows(self, t: ArrayLike) -> Array:
        """Sign of the elbow at t [s], shape (...)."""
        turned = np.searchsorted(np.array(self.changes), np.asarray(t, dtype=float), side="right")
        return np.asarray(self.elbow * (1.0 - 2.0 * (turned % 2)))

    def left(self, t: Array) -> Array:
        """s [m]: what the two links must reach, shape (..., 2)."""
        others = self.chain.c[self.rest] @ unit(self._other(t)) if self.rest else 0.0
        return np.asarray(self.motion.position(t) - self.chain.base - others)

    def _raw(self, t: Array) -> Array:
        out = np.empty((*t.shape, self.chain.links))
        out[..., [*self.pair]] = self.two.angles(self.left(t), self.elbows(t))
        out[..., self.rest] = self._other(t)
        return out

    @cached_property
    def _turns(self) -> tuple[Array, Array]:
        """Instants and angles there without jumps, shape (m,) and (m, n)."""
        t = np.union1d(np.linspace(0, self.duration, GRID + 1), self.motion.nodes)
        theta = np.unwrap(self._raw(t), axis=0)
        return t, theta + 2 * np.pi * np.round((self.start - theta[0]) / (2 * np.pi))

    def absolute(self, t: ArrayLike) -> Array:
        """theta(t) [rad], shape (...) -> (..., n)."""
        t = np.asarray(t, dtype=float)
        raw, (at, known) = self._raw(t), self._turns
        near = np.stack([np.interp(t, at, column) for column in known.T], axis=-1)
        return np.asarray(raw + 2 * np.pi * np.round((near - raw) / (2 * np.pi)))

    def angles(self, t: ArrayLike) -> Array:
        """Joint angles [rad] at t [s], shape (...) -> (..., n): each link against the one before."""
        return np.diff(self.absolute(t), axis=-1, prepend=0.0)

    def rates(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """theta, theta', theta'' at t [s], shape (..., n) each [rad, rad/s, rad/s^2].

        Where the two links are in line, speeds are those of an instant beside it.
        """
        t = np.asarray(t, dtype=float)
        theta = self.absolute(t)
        bend = np.abs(np.sin(theta[..., self.pair[1]] - theta[..., self.pair[0]]))
        if np.any(bend < STRAIGHT):
            step = BESIDE * self.duration * np.where(t > self.duration / 2, -1, 1)
            t = np.where(bend < STRAIGHT, t + step, t)
            theta = self.absolute(t)
        c, (i, j) = self.chain.c, self.pair
        along = unit(theta)
        across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        det = c[i] * c[j] * np.sin(theta[..., j] - theta[..., i])

        def solve(right: Array) -> Array:
            """x_i, x_j with c_i e'_i x_i + c_j e'_j x_j = right, by Cramer's rule."""
            with np.errstate(divide="ignore", invalid="ignore"):  # in line all along: no speed, and the check says so
                x_i = c[j] * (right[..., 0] * across[..., j, 1] - right[..., 1] * across[..., j, 0]) / det
                x_j = c[i] * (across[..., i, 0] * right[..., 1] - across[..., i, 1] * right[..., 0]) / det
            return np.stack([x_i, x_j], axis=-1)

        first, second = np.empty_like(theta), np.empty_like(theta)
        rest = self.rest
        first[..., rest], second[..., rest] = self._other(t, 1), self._other(t, 2)
        taken = np.einsum("...k,...kx->...x", c[rest] * first[..., rest], across[..., rest, :])
        first[..., [i, j]] = solve(self.motion.velocity(t) - taken)
        taken = np.einsum("...k,...kx->...x", c[rest] * second[..., rest], across[..., rest, :])
        inward = np.einsum("...k,...kx->...x", c * first**2, along)
        second[..., [i, j]] = solve(self.motion.acceleration(t) + inward - taken)
        return theta, first, second

    def bend(self, low: Array, high: Array) -> Array:
        """A bound on |s''| on each interval [m/s^2], shape (m,): |r''| + sum c_k (theta_k'^2 + |theta_k''|)."""
        out = np.full(len(low), self.motion.peak())
        for column, k in enumerate(self.rest):
            turned = self._largest(low, high, column, 2)
            out = out + self.chain.c[k] * (self._largest(low, high, column, 1) ** 2 + turned)
        return out

    def spread(self, low: Array, high: Array) -> Array:
        """How far the angles can be from those at the middle of [low, high] [s], shape (m,) -> (m, n) [rad]."""
        middle, half = (low + high) / 2, (high - low) / 2
        speed = np.hypot(*self.motion.velocity(middle).T)
        radius = half * speed + half**2 / 2 * self.motion.peak()
        out = np.zeros((len(low), self.chain.links))
        for column, k in enumerate(self.rest):
            out[:, k] = half * self._largest(low, high, column, 1)
            radius = radius + self.chain.c[k] * out[:, k]
        left = self.left(middle)
        out[:, list(self.pair)] = self.two.spread(left, radius * (1 + 1e-9))
        for at in self.changes:  # both elbows, through the straight or folded arm
            inside = (low <= at) & (at <= high)
            both = self._through(left[inside], radius[inside])
            out[inside, self.pair[0]], out[inside, self.pair[1]] = both.T
        return out

    def _through(self, left: Array, radius: Array) -> Array:
        """The same where the elbow turns over within: |delta| from one side of its end to the other."""
        both = [self.two.angles(left, sign) for sign in (-1.0, 1.0)]
        apart = np.abs((both[0] - both[1] + np.pi) % (2 * np.pi) - np.pi)
        return np.asarray(np.minimum(apart + self.two.spread(left, radius * (1 + 1e-9)), np.pi))

    def _largest(self, low: Array, high: Array, column: int, order: int) -> Array:
        """The largest |derivative of that order of theta_k| on each interval: at an end, at a knot, or where the next
        derivative is zero.
        """
        assert self.others is not None
        value, after = self.others.derivative(order), self.others.derivative(order + 1)
        roots = PPoly(after.c[..., column], after.x).roots(extrapolate=False)
        t = np.unique(np.concatenate([self.others.x, roots[np.isfinite(roots)]]))
        out = np.maximum(np.abs(value(low)[:, column]), np.abs(value(high)[:, column]))
        for at, size in zip(t.tolist(), np.abs(value(t)[:, column]).tolist(), strict=True):
            out = np.where((low <= at) & (at <= high), np.maximum(out, size), out)
        return np.asarray(out)


def torques(path: JointPath | JointMotion, t: ArrayLike) -> Array:
    """tau [N m] at t [s], shape (...) -> (..., n); at a node those of the hold that begins there."""
    return inverse_dynamics(path.chain, *path.rates(t))


def base_moment(path: JointPath | JointMotion, t: ArrayLike) -> Array:
    """Moment about the first joint that the base exerts on the arm [N m], shape (...)."""
    return np.asarray(torques(path, t)[..., 0])
