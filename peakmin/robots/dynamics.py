"""A robot as its planner sees it: what its joints' motion does to the centre of mass and to the joints themselves.

With joint angles q (n,), their speeds v and accelerations a, all scaled alike or all in SI units,

    u(q, v, a): acceleration of the centre of mass,      tau(q, v, a): joint torques, tau_1 the base moment

and the derivatives of both. A robot of another library stands here once it has the methods of `Robot`. Of a planar
chain, with absolute angles theta = cumsum(q), speeds w and accelerations b, and e''_i = b_i e'(theta_i) - w_i^2 e,

    u = sum_i c_i e''_i,      tau_k = sum_{m>=k} ( I_m b_m + (r_m - joint_k) x m_m r_m'' ) + the payload's

without gravity. Derivatives are taken by complex steps, exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..types import Array
from .kinematics import Chain, unit

STEP = 1e-30  # of the complex step
Rates = tuple[Array, Array, Array]  # q, q', q''


class Robot(Protocol):
    """n joints. Arrays of joints are (..., n), their derivatives stand side by side: by q, q', q'', (..., 3n)."""

    @property
    def joints(self) -> int:
        """n"""

    def centre(self, q: Array) -> Array:
        """The centre of mass [m], (..., n) -> (..., d)."""

    def jacobian(self, q: Array) -> Array:
        """Its derivative by q [m], (..., n) -> (..., d, n)."""

    def acceleration(self, at: Rates) -> Array:
        """u [m/s^2], (..., d)."""

    def torques(self, at: Rates) -> Array:
        """tau [N m], (..., n)."""

    def acceleration_by(self, at: Rates) -> Array:
        """The derivative of u, (..., d, 3n)."""

    def torques_by(self, at: Rates) -> Array:
        """The derivative of tau, (..., n, 3n)."""


@dataclass(frozen=True)
class PlanarRobot:
    """A planar chain as a `Robot`."""

    chain: Chain

    @property
    def joints(self) -> int:
        return self.chain.links

    def centre(self, q: Array) -> Array:
        return self.chain.centre(np.cumsum(q, axis=-1))

    def jacobian(self, q: Array) -> Array:
        along = self.chain.c[:, None] * unit(np.cumsum(q, axis=-1))
        beyond = np.cumsum(along[..., ::-1, :], axis=-2)[..., ::-1, :]  # what joint k turns, and e'(a) = (-y, x)
        return np.stack([-beyond[..., 1], beyond[..., 0]], axis=-2)

    def acceleration(self, at: Rates) -> Array:
        theta, first, second = (np.cumsum(x, axis=-1) for x in at)
        return np.asarray(np.einsum("k,...kx->...x", self.chain.c, turned(theta, first, second)))

    def torques(self, at: Rates) -> Array:
        theta, first, second = (np.cumsum(x, axis=-1) for x in at)
        return inverse_dynamics(self.chain, theta, first, second)

    def acceleration_by(self, at: Rates) -> Array:
        return _derivative(self.acceleration, at)

    def torques_by(self, at: Rates) -> Array:
        return _derivative(self.torques, at)


def _derivative(function: Callable[[Rates], Array], at: Rates) -> Array:
    """df/d(q, q', q''), (..., m, 3n), by df/dx = Im f(x + i h) / h."""
    n = at[0].shape[-1]
    flat = np.concatenate(at, axis=-1)[..., None, :] + 1j * STEP * np.eye(3 * n)
    q, v, a = np.split(flat, 3, axis=-1)
    return np.asarray(np.moveaxis(function((q, v, a)).imag / STEP, -2, -1))


def turned(theta: Array, first: Array, second: Array) -> Array:
    """e''(theta(t)) = theta'' e' - theta'^2 e, shape (..., n) -> (..., n, 2)."""
    along = unit(theta)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    return np.asarray(second[..., None] * across - first[..., None] ** 2 * along)


def inverse_dynamics(chain: Chain, theta: Array, first: Array, second: Array) -> Array:
    """tau [N m] of absolute angles, speeds and accelerations, (..., n) each -> (..., n)."""
    along, bent = unit(theta), turned(theta, first, second)
    steps = np.cumsum(chain.length[:, None] * along, axis=-2)
    gained = np.cumsum(chain.length[:, None] * bent, axis=-2)
    joints, accelerations = (
        np.concatenate([np.zeros_like(x[..., :1, :]), x], axis=-2) for x in (steps, gained)
    )  # from the base
    places = joints[..., :-1, :] + chain.com[:, None] * along
    forces = chain.mass[:, None] * (accelerations[..., :-1, :] + chain.com[:, None] * bent)
    out = np.zeros_like(theta)
    last = chain.payload * accelerations[..., -1, :]
    for k in range(chain.links):
        arm, load = places[..., k:, :] - joints[..., k : k + 1, :], forces[..., k:, :]
        moments = chain.inertia[k:] * second[..., k:] + arm[..., 0] * load[..., 1] - arm[..., 1] * load[..., 0]
        tip = joints[..., -1, :] - joints[..., k, :]
        out[..., k] = np.sum(moments, axis=-1) + tip[..., 0] * last[..., 1] - tip[..., 1] * last[..., 0]
    return out
