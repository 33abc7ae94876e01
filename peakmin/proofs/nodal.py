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

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.integrals import assembly, derivatives
from ..types import Array, Mask
from .double_integrator import PointMass


@dataclass(frozen=True)
class Nodal:
    """The problem in nodal form; n = q+2 kinks. Stacked maneuvers with kinks (m, n) have a first axis everywhere."""

    mass: PointMass
    kinks: Array

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

    def derivatives(self, p: Array) -> tuple[float, Array, Array]:
        """I, dI/dP (n d,) and d2I/dP2 (n d, n d) at P (n, d); not of stacked maneuvers."""
        n, size, values = len(p), p.size, p.tolist()
        pieces = [derivatives(a, b) for a, b in zip(values, values[1:], strict=False)]
        total = (self.h[:, None] * pieces).ravel() @ assembly(n, size // n)
        return float(total[0]), total[1 : 1 + size], total[1 + size :].reshape(size, size)

    def masses(self) -> Array:
        """int phi_i phi_j dt of the hat functions, shape (n, n)."""
        h, i = self.h, np.arange(self.kinks.shape[-1])
        out = np.zeros((*self.kinks.shape, len(i)))
        out[..., i[:-1], i[:-1]] += h / 3
        out[..., i[1:], i[1:]] += h / 3
        out[..., i[:-1], i[1:]] = out[..., i[1:], i[:-1]] = h / 6
        return out

    def basis(self, idle: Mask, silent: Mask) -> Array:
        """Columns that span the P with f_j . l_j = 0 at idle walls (q,) and P_j = 0 at silent kinks (n,)."""
        *lead, n = self.kinks.shape
        d = self.mass.free.shape[-1]
        one = np.broadcast_to(np.eye(n * d), (*lead, n * d, n * d))
        jumps = self.multipliers_matrix()[..., :, None] * self.mass.free[..., None, :]
        rows = [jumps[..., j, :, :].reshape(*lead, n * d) for j in np.flatnonzero(idle).tolist()]
        rows += [one[..., j * d + i, :] for j in np.flatnonzero(silent).tolist() for i in range(d)]
        if not rows:
            return one
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
