"""The dual in terms of p's values at the kinks.

With p's values P_j at the kinks 0 = t_0 < t_1 < ... < t_{q+1} = 1, h_j = t_j - t_{j-1}, and the
positions r_j at the kinks (start, wall points r_j = tip_j + s_j f_j, goal),

    <L, b> = <P, c>,    c_0     = (r_1 - r_0)/h_1 - v_0
                        c_j     = (r_{j+1} - r_j)/h_{j+1} - (r_j - r_{j-1})/h_j
                        c_{q+1} = v_f - (r_{q+1} - r_q)/h_{q+1}

and the dual is  max <P, c> / I(P),  I(P) = sum_j h_j int |p| dx; the same maximum has  F(P) = I^2/2 - <P, c>,  whose
gradient I grad I - c is what Pontryagin's control u = M p/|p| misses of the equations (I = M there). A clear
wall's multiplier is the jump of p's slope, l_j = (P_{j+1} - P_j)/h_{j+1} - (P_j - P_{j-1})/h_j, with f_j . l_j >= 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.integrals import all_derivatives, assembly, derivatives
from ..types import Array, Index, Mask
from .double_integrator import PointMass

Kernel = Callable[[Array, Array], tuple[Array, Array, Array]]


def derivatives_of_all(h: Array, p: Array) -> tuple[Array, Array, Array]:
    """I, (m,), dI/dP, (m, n d), and d2I/dP2, (m, n d, n d), of stacked values P, (m, n d), h apart, (m, n-1)."""
    (m, size), n = p.shape, h.shape[1] + 1
    values = p.reshape(m, n, -1)
    total = (h[..., None] * all_derivatives(values[:, :-1], values[:, 1:])).reshape(m, -1) @ assembly(n, size // n)
    return total[:, 0], total[:, 1 : 1 + size], total[:, 1 + size :].reshape(m, size, size)


def derivatives_of_one(h: Array, p: Array) -> tuple[Array, Array, Array]:
    """The same of one maneuver, m = 1, in the plane: with one wall in 15 us, not 130; with three in 25 us, not 130."""
    size, n = p.shape[1], h.shape[1] + 1
    values = p.reshape(n, -1).tolist()
    pieces = [derivatives(a, b) for a, b in zip(values, values[1:], strict=False)]
    total = (h[0, :, None] * pieces).reshape(1, -1) @ assembly(n, size // n)
    return total[:, 0], total[:, 1 : 1 + size], total[:, 1 + size :].reshape(1, size, size)


@dataclass(frozen=True)
class Nodal:
    """The problem in nodal form; n = q+2 kinks. Stacked maneuvers with kinks (m, n) have a first axis everywhere."""

    mass: PointMass
    kinks: Array

    def part(self, k: Index) -> Nodal:
        """Some of stacked maneuvers, by their numbers."""
        return Nodal(self.mass.part(k), self.kinks[k])

    @cached_property
    def h(self) -> Array:
        return np.diff(self.kinks)

    def forces(self, beyond: Array) -> Array:
        """c, shape (n, d), for wall points s_j (q,) beyond the tips."""
        mass = self.mass
        walls = mass.tips + beyond[..., None] * mass.free
        ends = np.zeros_like(mass.pf)[..., None, :], mass.pf[..., None, :]
        r = np.concatenate([ends[0], walls, ends[1]], axis=-2)
        mean = np.diff(r, axis=-2) / self.h[..., None]
        return np.diff(np.concatenate([mass.v0[..., None, :], mean, mass.vf[..., None, :]], axis=-2), axis=-2)

    def multipliers(self, p: Array) -> Array:
        """L, shape (2+q, d), of the nodal values (n, d)."""
        slopes = np.diff(p, axis=-2) / self.h[..., None]
        return np.concatenate([-slopes[..., -1:, :], p[..., -1:, :], np.diff(slopes, axis=-2)], axis=-2)

    @property
    def kernel(self) -> Kernel:
        """What evaluates I and its derivatives the fastest."""
        plane = self.mass.free.shape[-1] == 2
        return derivatives_of_one if plane and self.kinks.size == self.kinks.shape[-1] else derivatives_of_all

    def derivatives(self, p: Array) -> tuple[Array, Array]:
        """I, (...), and dI/dP, (..., n, d), at P, (..., n, d)."""
        *lead, n, d = p.shape
        impulse, gradient, _ = self.kernel(self.h.reshape(-1, n - 1), p.reshape(-1, n * d))
        return impulse.reshape(lead), gradient.reshape(p.shape)

    def least_energy(self) -> Array:
        """Nodal values, shape (n, d), of the control of least int |u|^2: a start that is never far off."""
        return np.asarray(np.linalg.solve(self.masses(), self.forces(np.zeros(self.mass.walls))))

    def masses(self) -> Array:
        """int phi_i phi_j dt of the hat functions, shape (n, n)."""
        h, i = self.h, np.arange(self.kinks.shape[-1])
        out = np.zeros((*self.kinks.shape, len(i)))
        out[..., i[:-1], i[:-1]] += h / 3
        out[..., i[1:], i[1:]] += h / 3
        out[..., i[:-1], i[1:]] = out[..., i[1:], i[:-1]] = h / 6
        return out

    def basis(self, idle: Mask, silent: Mask) -> Array | None:
        """Columns (n d, k) that span the P with f_j . l_j = 0 at idle walls (q,) and P_j = 0 at silent kinks (n,); None
        for all P.
        """
        if not np.any(idle) and not np.any(silent):
            return None
        *lead, n = self.kinks.shape
        d = self.mass.free.shape[-1]
        one = np.broadcast_to(np.eye(n * d), (*lead, n * d, n * d))
        jumps = self.multipliers_matrix()[..., :, None] * self.mass.free[..., None, :]
        rows = [jumps[..., j, :, :].reshape(*lead, n * d) for j in np.flatnonzero(idle).tolist()]
        rows += [one[..., j * d + i, :] for j in np.flatnonzero(silent).tolist() for i in range(d)]
        every = np.stack(rows, axis=-2)
        _, size, v = np.linalg.svd(every / np.linalg.norm(every, axis=-1, keepdims=True))
        return np.asarray(np.swapaxes(v[..., int(np.max(np.sum(size > 1e-12, axis=-1))) :, :], -1, -2))

    def multipliers_matrix(self) -> Array:
        """The matrix that takes nodal values to jumps of the slope at the walls, shape (q, n)."""
        h, j = self.h, np.arange(self.kinks.shape[-1] - 2)
        out = np.zeros((*self.kinks.shape[:-1], len(j), len(j) + 2))
        out[..., j, j] = 1 / h[..., :-1]
        out[..., j, j + 1] = -1 / h[..., :-1] - 1 / h[..., 1:]
        out[..., j, j + 2] = 1 / h[..., 1:]
        return out
