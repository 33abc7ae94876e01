"""One step of sequential convex programming over joint accelerations held on N intervals, compiled once.

In scaled units (duration 1, lengths by the arm, torques by mass size^2 / T^2), about a motion (q, v, a) known at nodes,

    minimise  M + mu sum(slack) + nu (sum |dv_k|^2 + |da_k|^2) / N   subject to
    |u + du| <= M at both ends and the middle of every hold,
    tau + dtau within +- (1 + slack) limit there,   distance + ddistance >= room - slack in the middle,
    q_k, q_k + h v_k / 2 within limits (the control points of its parabolas),   v_k, a_k within limits,
    |dq_k| <= trust,
    q_{k+1} = q_k + h v_k + h^2 a_k / 2,   v_{k+1} = v_k + h a_k,   both ends given, at rest

with nu so small that of steps which promise the same the calmest is taken, a slack for all torques and one for all
distances of a hold (a slack of its own for each would be most of the variables), or, once a peak is known
that may be taken,

    minimise  m + mu sum(slack) + nu (...)   subject to the same with M a number, + slack, and |tau_1 + dtau_1| <= m,

with du, dtau, ddistance linear in dq, dv, da of their hold: parameters, as the limits are, so that only numbers change
from step to step and from start to start.
"""

from __future__ import annotations

import itertools
import math
import warnings
from dataclasses import dataclass

import numpy as np

from ..types import Array
from .convex import cp
from .program import options_of

# of a step that its motion is judged without
ROUGH = {"tol_gap_abs": 1e-6, "tol_gap_rel": 1e-6, "tol_feas": 1e-7}
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


def _flat(x: cp.Expression) -> cp.Expression:
    """Its entries side by side."""
    return cp.vec(x, order="F")


class JointStep:
    """The program of n joints in d dimensions on N holds with r rows of distances at every hold.

    finite: which limits there are, as `Limits.finite` says;  moment: whether the base moment is what is made least.
    """

    def __init__(
        self, joints: int, dimension: int, holds: int, rows: int, finite: tuple[tuple[bool, ...], ...], moment: bool
    ) -> None:
        n, N, h, cuts = joints, holds, 1.0 / holds, len(SHARES)
        self._some = [np.flatnonzero(one) for one in finite]
        self._bounds = [cp.Parameter((1, len(some))) for some in self._some]
        low, high, speed, acceleration = zip(self._some[:-1], self._bounds[:-1], strict=True)
        self._q, self._v, self._a = cp.Variable((N + 1, n)), cp.Variable((N + 1, n)), cp.Variable((N, n))  # changes
        self._least = cp.Variable()
        self._peak = cp.Parameter(nonneg=True) if moment else self._least
        self._known = [cp.Parameter((N + 1, n)), cp.Parameter((N + 1, n)), cp.Parameter((N, n))]
        self._trust, self._cost, self._calm = (cp.Parameter(nonneg=True) for _ in range(3))
        q, v, a = (x + known for x, known in zip((self._q, self._v, self._a), self._known, strict=True))

        # what is linear about the motion before: values and slopes by a hold's own dq, dv, da
        self._limited, self._moment = self._some[-1], moment
        counts = [cuts * dimension, cuts * len(self._limited), cuts * moment, rows]
        self._at = [cp.Parameter(N) for _ in range(sum(counts))]
        self._by = [cp.Parameter((N, 3 * n)) for _ in self._at]
        whole = cp.hstack([self._q[:-1], self._v[:-1], self._a])
        linear = [x + cp.sum(cp.multiply(p, whole), axis=1) for x, p in zip(self._at, self._by, strict=True)]
        ends = np.cumsum([0, *counts]).tolist()
        u, tau, turning, apart = (linear[i:j] for i, j in itertools.pairwise(ends))

        kinds = (moment, len(self._limited) > 0, rows > 0)
        slacks = [cp.Variable(N, nonneg=True) if one else np.zeros(N) for one in kinds]
        beyond, over, short = slacks  # of the peak, of torques, of distances
        kept = [self._trust - _flat(self._q[1:-1]), self._trust + _flat(self._q[1:-1])]
        for sign, (some, bound) in ((1, high), (-1, low)):
            # the ends are as asked, and may be at a limit
            for x in (q[1:-1], q[1:-1] + h / 2 * v[1:-1]) if len(some) else ():
                kept.append(sign * _flat(np.ones((x.shape[0], 1)) @ bound - x[:, some]))
        for x, (some, bound) in ((v, speed), (a, acceleration)):
            if len(some):
                most = np.ones((x.shape[0], 1)) @ bound
                kept += [_flat(most - x[:, some]), _flat(most + x[:, some])]
        kept += [1 + over + sign * x for x in tau for sign in (-1, 1)]
        kept += [self._least + sign * x for x in turning for sign in (-1, 1)]
        kept += [x + short for x in apart]
        peak = self._peak * np.ones(cuts * N) + cp.hstack([beyond] * cuts)
        # one rule of a kind: what compiling takes goes with their number, times parameters, times variables
        same = [
            *(x[i] for x in (self._q, self._v) for i in (0, -1)),
            _flat(self._q[1:] - self._q[:-1] - h * self._v[:-1] - h * h / 2 * self._a),
            _flat(self._v[1:] - self._v[:-1] - h * self._a),
        ]
        sides = cp.vstack([cp.hstack(u[k::dimension]) for k in range(dimension)])
        rules = [cp.hstack(same) == 0, cp.hstack(kept) >= 0, cp.SOC(peak, sides, axis=0)]
        missing = sum(cp.sum(slack) for slack in slacks)
        self.compiled = 0.0  # seconds that it took
        self._promised = self._least + self._cost * missing
        calm = self._calm * (cp.sum_squares(self._a) + cp.sum_squares(self._v)) / N
        self._problem = cp.Problem(cp.Minimize(self._promised + calm), rules)

    def solve(
        self,
        known: tuple[Array, Array, Array],
        about: Linear,
        limits: Limits,
        trust: float,
        cost: float,
        until: float = math.inf,
        peak: float = math.inf,
        calm: float = 0.0,
    ) -> tuple[Array, float] | None:
        """The accelerations (N, n) of the next motion and the cost that it is promised to have; None where the solver
        finds none.

        Args:
            trust, cost, calm: the trust region [rad], mu and nu;  until: a deadline.
            peak: that may be taken, where the base moment is made least.
        """
        every = (limits.low, limits.high, limits.speed, limits.acceleration, limits.torque)
        for bound, some, value in zip(self._bounds, self._some, every, strict=True):
            bound.value = value[None, some]
        for parameter, value in zip(self._known, known, strict=True):
            parameter.value = value
        self._trust.value, self._cost.value, self._calm.value = trust, cost, calm
        if self._moment:
            self._peak.value = peak
        some, n3 = self._limited, about.u_by.shape[-1]
        tau, tau_by = about.tau[..., some] / limits.torque[some], about.tau_by[..., some, :] / limits.torque[some, None]
        at = [about.u.transpose(0, 2, 1), tau.transpose(0, 2, 1)]
        by = [about.u_by.transpose(0, 2, 1, 3), tau_by.transpose(0, 2, 1, 3)]
        if self._moment:
            at.append(about.tau[..., 0])
            by.append(about.tau_by[..., 0, :])
        N = about.apart.shape[-1]
        for parameter, value in zip(
            self._at, np.concatenate([x.reshape(-1, N) for x in (*at, about.apart)]), strict=True
        ):
            parameter.value = value
        for parameter, value in zip(
            self._by, np.concatenate([x.reshape(-1, N, n3) for x in (*by, about.apart_by)]), strict=True
        ):
            parameter.value = value
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self._problem.solve(solver="CLARABEL", **ROUGH | options_of("CLARABEL", until))
        except (cp.SolverError, ValueError, ArithmeticError):
            return None
        finally:
            self.compiled = max(self.compiled, self._problem.compilation_time or 0.0)
        if self._a.value is None or self._promised.value is None or not np.all(np.isfinite(self._a.value)):
            return None
        return known[2] + self._a.value, float(self._promised.value)
