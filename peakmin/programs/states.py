"""The program of a held control with its position and velocity at the nodes, for fixed obstacle times.

    maximise kappa = 1/M  subject to  v_k in shape,  A v = kappa b,
                                      V_{k+1} = V_k + h_k v_k,  r_{k+1} = r_k + h_k V_k + h_k^2 v_k / 2

with r and V kappa times as large; where a wall may be passed beyond its tip, its row has a slack along the free side.
Rooms that ask more of the nodes append their own rows to `constraints`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np

from ..proofs.bracket import Bracket, HoldProblem
from ..proofs.double_integrator import PointMass
from ..spec.control_set import Disc, Polygon
from ..types import Array, Index
from .convex import cp
from .program import hold_constraints, options_of

SMALLEST = 1e-9  # kappa below which there is no answer


class StateProgram:
    """The program at times [scaled], (q,), on holds with edges [scaled], (steps+1,).

    position, velocity: (steps+1, d) each, and `kappa`, by which all of them are multiplied.
    """

    def __init__(self, mass: PointMass, circle: Disc | Polygon, times: Array, edges: Array) -> None:
        self._problem = HoldProblem(mass, circle, times, edges)
        d = len(mass.v0)
        self._v, self._share = cp.Variable((len(edges) - 1, d)), cp.Variable()
        self._size = 1.0 / (mass.floor(times) or 1.0)  # keeps the variable near one
        self.mass, self.kappa = mass, self._share * self._size
        v, b, rows = self._v, mass.targets(times), self._problem.rows
        self.constraints: list[cp.Constraint] = [*hold_constraints(circle, v), rows[:2] @ v == self.kappa * b[:2]]
        for i in range(mass.walls):
            s = cp.Variable(nonneg=True)
            beyond = s * mass.free[i] if mass.clear[i] else np.zeros(d)
            self.constraints.append(rows[2 + i] @ v == self.kappa * b[2 + i] + beyond)
            if math.isfinite(mass.width[i]):
                self.constraints.append(s <= self.kappa * mass.width[i])
        self.position, self.velocity = r, speed = cp.Variable((len(edges), d)), cp.Variable((len(edges), d))
        dt = np.diff(edges)[:, None] @ np.ones((1, d))
        self.constraints += [
            r[0] == 0,
            speed[0] == self.kappa * mass.v0,
            speed[1:] == speed[:-1] + cp.multiply(dt, v),
            r[1:] == r[:-1] + cp.multiply(dt, speed[:-1]) + cp.multiply(dt**2 / 2, v),
        ]

    def inside(self, normals: Array, levels: Array) -> None:
        """Ask for n . r >= c at every node, normals (k, d) and levels (k,) [scaled]."""
        self.constraints.append(self.position @ normals.T >= self.kappa * levels)

    def beyond(self, nodes: Index, normal: Array, level: float, room: Array) -> None:
        """Ask for n . r_k >= c + room_k at some nodes, (k,), all [scaled]."""
        self.constraints.append(self.position[nodes] @ normal - self.kappa * level >= self.kappa * room)

    def keep(self, planes: Sequence[tuple[int, Array, float]]) -> None:
        """Ask for n . r_k >= c at nodes k, planes (k, n, c) with c in [m]."""
        if planes:
            normals = np.array([n for _, n, _ in planes])
            levels = (np.array([c for _, _, c in planes]) - normals @ self.mass.origin) / self.mass.length
            reached = cp.sum(cp.multiply(normals, self.position[[k for k, _, _ in planes]]), axis=1)
            self.constraints.append(reached >= self.kappa * levels)

    def within(self, vectors: cp.Expression, radius: float) -> None:
        """Ask for |vector| <= kappa radius of every row, (m, 2), of scaled vectors."""
        self.constraints.append(cp.SOC(self.kappa * radius * np.ones(vectors.shape[0]), vectors, axis=1))

    def solve(self, until: float = math.inf) -> Bracket:
        """The upper end and its control [scaled], landed on the equations; without control where there is none.

        Args:
            until: a deadline.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                cp.Problem(cp.Maximize(self._share), self.constraints).solve(
                    solver="CLARABEL", **options_of("CLARABEL CAREFUL", until)
                )
        except (cp.SolverError, ValueError, ArithmeticError):
            return Bracket()
        if self._v.value is None or self._share.value is None or not self._share.value > SMALLEST:
            return Bracket()
        with np.errstate(all="ignore"):  # of absurd answers: what comes out not finite is no control
            upper, control = self._problem.upper(self._v.value / (self._share.value * self._size))
        return Bracket(upper=upper, control=control)
