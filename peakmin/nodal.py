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

from .arrays import Array, Mask
from .integrals import assembly, derivatives
from .moments import PointMass


@dataclass(frozen=True)
class Nodal:
    """The problem in nodal form; n = q+2 kinks."""

    mass: PointMass
    kinks: Array

    @cached_property
    def h(self) -> Array:
        return np.diff(self.kinks)

    def forces(self, beyond: Array) -> Array:
        """c, shape (n, 2), for wall points s_j (q,) beyond the tips."""
        mass = self.mass
        r = np.vstack([np.zeros(2), mass.tips + beyond[:, None] * mass.free, mass.pf])
        speeds = np.vstack([mass.v0, np.diff(r, axis=0) / self.h[:, None], mass.vf])
        return np.diff(speeds, axis=0)

    def multipliers(self, p: Array) -> Array:
        """L, shape (2+q, 2), of the nodal values (n, 2)."""
        slopes = np.diff(p, axis=0) / self.h[:, None]
        return np.vstack([-slopes[-1:], p[-1:], np.diff(slopes, axis=0)])

    def derivatives(self, p: Array) -> tuple[float, Array, Array]:
        """I, dI/dP (2n,) and d2I/dP2 (2n, 2n)."""
        n, values = len(p), p.tolist()
        pieces = [derivatives(a, b) for a, b in zip(values, values[1:], strict=False)]
        total = (self.h[:, None] * pieces).ravel() @ assembly(n)
        return float(total[0]), total[1 : 1 + 2 * n], total[1 + 2 * n :].reshape(2 * n, 2 * n)

    def masses(self) -> Array:
        """int phi_i phi_j dt of the hat functions, shape (n, n)."""
        h = self.h
        return np.diag(np.r_[h, 0] / 3 + np.r_[0, h] / 3) + np.diag(h / 6, 1) + np.diag(h / 6, -1)

    def basis(self, idle: Mask, silent: Mask) -> Array:
        """Columns that span the P with f_j . l_j = 0 at idle walls (q,) and P_j = 0 at silent kinks (n,)."""
        n = len(self.kinks)
        jumps = self.multipliers_matrix()
        rows = [np.kron(jumps[j], self.mass.free[j]) for j in np.flatnonzero(idle)]
        rows += [np.eye(2 * n)[2 * j + i] for j in np.flatnonzero(silent) for i in (0, 1)]
        if not rows:
            return np.eye(2 * n)
        _, size, v = np.linalg.svd(np.array(rows) / np.linalg.norm(rows, axis=1, keepdims=True))
        return np.asarray(v[int(np.sum(size > 1e-12)) :].T)

    def multipliers_matrix(self) -> Array:
        """The matrix that takes nodal values to jumps of the slope at the walls, shape (q, n)."""
        h, q = self.h, len(self.kinks) - 2
        out = np.zeros((q, q + 2))
        for j in range(q):
            out[j, j : j + 3] = [1 / h[j], -1 / h[j] - 1 / h[j + 1], 1 / h[j + 1]]
        return out
