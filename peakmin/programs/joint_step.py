"""One step of sequential convex programming over joint accelerations held on N intervals, compiled once.

In scaled units (duration 1, lengths by the arm, torques by mass size^2 / T^2), about a motion (q, v, a) known at nodes,

    minimise  M + mu sum(slack)   subject to
    |u + du| <= M at both ends and the middle of every hold,
    tau + dtau within +- limit + slack,   distance + ddistance >= room - slack there,
    q_k, q_k + h v_k / 2 within limits (the control points of its parabolas),   v_k, a_k within limits,
    |dq_k| <= trust,
    q_{k+1} = q_k + h v_k + h^2 a_k / 2,   v_{k+1} = v_k + h a_k,   both ends given, at rest

or, once a peak is known that may be taken,

    minimise  m + mu sum(slack)   subject to the same with M a number, + slack, and |tau_1 + dtau_1| <= m,

with du, dtau, ddistance linear in dq, dv, da of their hold: parameters, as the limits are, so that only numbers change
from step to step and from start to start.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from ..types import Array
from .convex import cp
from .program import options_of

SHARES = (0.0, 0.5, 1.0)  # of a hold, at which what is not linear is looked at


@dataclass(frozen=True)
class Limits:
    """Of the joints, scaled, (n,) each, infinite where there is none: least and largest angle, |q'|, |q''|, |tau|."""

    low: Array
    high: Array
    speed: Array
    acceleration: Array
    torque: Array

    @property
    def finite(self) -> tuple[tuple[bool, ...], ...]:
        """Which there are, field by field."""
        every = (self.low, self.high, self.speed, self.acceleration, self.torque)
        return tuple(tuple(np.isfinite(one).tolist()) for one in every)


@dataclass(frozen=True)
class Linear:
    """What is not linear, at SHARES of every hold, with its derivatives by the hold's dq, dv, da side by side.

    u: (3, N, d) and (3, N, d, 3n);  tau: (3, N, n) and (3, N, n, 3n);  apart: distances less the room asked for,
    (r, N) of r rows, and (r, N, 3n).
    """

    u: Array
    u_by: Array
    tau: Array
    tau_by: Array
    apart: Array
    apart_by: Array


def by_hold(derivative: Array, share: float, step: float, joints: int) -> Array:
    """Derivatives by q, q', q'' at a share of a hold, (..., 3n) or by q alone (..., n), as those by its dq, dv, da.

    q = q_k + s v_k + s^2 a / 2.
    """
    s = share * step
    by_q, by_v, by_a = np.split(derivative, 3, axis=-1) if derivative.shape[-1] == 3 * joints else (derivative, 0, 0)
    zero = np.zeros_like(by_q)
    by_v, by_a = zero + by_v, zero + by_a
    return np.concatenate([by_q, s * by_q + by_v, s * s / 2 * by_q + s * by_v + by_a], axis=-1)


class JointStep:
    """The program of n joints in d dimensions on N holds with r rows of distances at every hold.

    finite: which limits there are, as `Limits.finite` says;  moment: whether the base moment is what is made least.
    """

    def __init__(
        self, joints: int, dimension: int, holds: int, rows: int, finite: tuple[tuple[bool, ...], ...], moment: bool
    ) -> None:
        n, N, h = joints, holds, 1.0 / holds
        self._some = [np.flatnonzero(one) for one in finite]
        self._bounds = [cp.Parameter((1, len(some))) for some in self._some]
        low, high, speed, acceleration = zip(self._some[:-1], self._bounds[:-1], strict=True)
        self._q, self._v, self._a = cp.Variable((N + 1, n)), cp.Variable((N + 1, n)), cp.Variable((N, n))  # changes
        self._least = cp.Variable()
        self._peak = cp.Parameter(nonneg=True) if moment else self._least
        self._known = [cp.Parameter((N + 1, n)), cp.Parameter((N + 1, n)), cp.Parameter((N, n))]
        self._trust, self._cost = cp.Parameter(nonneg=True), cp.Parameter(nonneg=True)
        q, v, a = (x + known for x, known in zip((self._q, self._v, self._a), self._known, strict=True))
        whole = cp.hstack([self._q[:-1], self._v[:-1], self._a])
        self._u = [[cp.Parameter(N) for _ in range(dimension)] for _ in SHARES]
        self._u_by = [[cp.Parameter((N, 3 * n)) for _ in range(dimension)] for _ in SHARES]
        rules = [
            self._q[0] == 0,
            self._v[0] == 0,
            self._q[-1] == 0,
            self._v[-1] == 0,
            self._q[1:] == self._q[:-1] + h * self._v[:-1] + h * h / 2 * self._a,
            self._v[1:] == self._v[:-1] + h * self._a,
            cp.abs(self._q) <= self._trust,
        ]
        slacks: list[cp.Variable] = []
        for at, by in zip(self._u, self._u_by, strict=True):
            u = cp.vstack([x + cp.sum(cp.multiply(p, whole), axis=1) for x, p in zip(at, by, strict=True)])
            if moment:
                slacks.append(cp.Variable(N, nonneg=True))
            rules.append(cp.SOC(self._peak * np.ones(N) + (slacks[-1] if moment else 0.0), u, axis=0))
        for sign, (some, bound) in ((1, high), (-1, low)):
            if len(some):
                rules += [sign * q[:, some] <= sign * np.ones((N + 1, 1)) @ bound]
                rules += [sign * (q[:-1, some] + h / 2 * v[:-1, some]) <= sign * np.ones((N, 1)) @ bound]
        for x, (some, bound) in ((v, speed), (a, acceleration)):
            if len(some):
                rules.append(cp.abs(x[:, some]) <= np.ones((x.shape[0], 1)) @ bound)
        self._limited = self._some[-1].tolist()
        self._tau = [[cp.Parameter(N) for _ in self._limited] for _ in SHARES]
        self._tau_by = [[cp.Parameter((N, 3 * n)) for _ in self._limited] for _ in SHARES]
        for at, by in zip(self._tau, self._tau_by, strict=True):
            for x, p in zip(at, by, strict=True):
                slacks.append(cp.Variable(N, nonneg=True))
                rules.append(cp.abs(x + cp.sum(cp.multiply(p, whole), axis=1)) <= 1 + slacks[-1])
        self._moment = [cp.Parameter(N) for _ in SHARES] if moment else []
        self._moment_by = [cp.Parameter((N, 3 * n)) for _ in self._moment]
        for x, p in zip(self._moment, self._moment_by, strict=True):
            rules.append(cp.abs(x + cp.sum(cp.multiply(p, whole), axis=1)) <= self._least)
        self._apart = [cp.Parameter(N) for _ in range(rows)]
        self._apart_by = [cp.Parameter((N, 3 * n)) for _ in range(rows)]
        for x, p in zip(self._apart, self._apart_by, strict=True):
            slacks.append(cp.Variable(N, nonneg=True))
            rules.append(x + cp.sum(cp.multiply(p, whole), axis=1) + slacks[-1] >= 0)
        missing = cp.sum(cp.hstack(slacks)) if slacks else 0.0
        self._problem = cp.Problem(cp.Minimize(self._least + self._cost * missing), rules)

    def solve(
        self,
        known: tuple[Array, Array, Array],
        about: Linear,
        limits: Limits,
        trust: float,
        cost: float,
        until: float = math.inf,
        peak: float = math.inf,
    ) -> tuple[Array, float] | None:
        """The accelerations (N, n) of the next motion and the cost that it is promised to have; None where the solver
        finds none.

        Args:
            peak: that may be taken, where the base moment is made least.
        """
        every = (limits.low, limits.high, limits.speed, limits.acceleration, limits.torque)
        for bound, some, value in zip(self._bounds, self._some, every, strict=True):
            bound.value = value[None, some]
        for parameter, value in zip(self._known, known, strict=True):
            parameter.value = value
        self._trust.value, self._cost.value = trust, cost
        if self._moment:
            self._peak.value = peak
        for i in range(len(SHARES)):
            for k, (at, by) in enumerate(zip(self._u[i], self._u_by[i], strict=True)):
                at.value, by.value = about.u[i, :, k], about.u_by[i, :, k]
            for j, at, by in zip(self._limited, self._tau[i], self._tau_by[i], strict=True):
                at.value, by.value = about.tau[i, :, j] / limits.torque[j], about.tau_by[i, :, j] / limits.torque[j]
            if self._moment:
                self._moment[i].value, self._moment_by[i].value = about.tau[i, :, 0], about.tau_by[i, :, 0]
        for k, (at, by) in enumerate(zip(self._apart, self._apart_by, strict=True)):
            at.value, by.value = about.apart[k], about.apart_by[k]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self._problem.solve(solver="CLARABEL", **options_of("CLARABEL", until))
        except (cp.SolverError, ValueError, ArithmeticError):
            return None
        if self._a.value is None or self._problem.value is None or not np.all(np.isfinite(self._a.value)):
            return None
        return known[2] + self._a.value, float(self._problem.value)
