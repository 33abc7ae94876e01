"""A motion of the joints whose accelerations are held: everything about it is known at every instant.

On a hold an absolute angle is a parabola, w = theta' and b = theta'' with b constant. Of one link's end
z = l e^{i theta} the acceleration and its derivatives are

    z'' = l (i b - w^2) e,      |z'''| = l |3 w b + i w^3|,      |z''''| <= l (w^4 + 6 w^2 |b| + 3 b^2)

so a function f of them is, between two instants h apart, within h^2/8 max|f''| of the straight line between its values:
the peaks stated here hold at every instant, none is only sampled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.norm import norm
from ..types import Array, Index
from .dynamics import PlanarRobot, inverse_dynamics, turned
from .kinematics import Chain

FINE = 1e-7  # relative: how much of a peak may come from what lies between instants
MOST = 2000  # instants of one hold


@dataclass(frozen=True)
class JointMotion:
    """nodes [s] (N+1,), held joint accelerations [rad/s^2] (N, n), joint angles at the start [rad] (n,), at rest."""

    chain: Chain
    nodes: Array
    held: Array
    begin: Array

    @property
    def duration(self) -> float:
        return float(self.nodes[-1])

    @property
    def changes(self) -> tuple[float, ...]:
        """None: the joints pass through a straight arm without a jump."""
        return ()

    @property
    def elbow(self) -> float:
        """Sign of joint 2 at the start, up to full turns."""
        return 1.0 if np.sin(self.begin[1]) >= 0 else -1.0

    @property
    def straight(self) -> tuple[float, ...]:
        """Times [s] at which two links come in line, stretched or folded, and go on to the other side."""
        if self.chain.links != 2:
            return ()
        (q, v), (low, high) = self.at_nodes, self.ranges
        crossed = []
        for k in range(math.ceil(low[1] / math.pi), math.floor(high[1] / math.pi) + 1):
            for i, (begin, speed, held, dt) in enumerate(
                zip(q[:, 1] - k * math.pi, v[:, 1], self.held[:, 1], np.diff(self.nodes), strict=False)
            ):
                roots = np.roots([held / 2, speed, begin]) if held or speed else np.zeros(0)
                crossed += [float(self.nodes[i] + s.real) for s in roots if abs(s.imag) < 1e-12 and 0 < s.real <= dt]
        sides = np.sin(self.angles(np.array([[t - 1e-6, t + 1e-6] for t in crossed]).reshape(-1, 2))[..., 1])
        return tuple(sorted(t for t, (a, b) in zip(crossed, sides, strict=True) if a * b < 0))

    @cached_property
    def at_nodes(self) -> tuple[Array, Array]:
        """q and q' at the nodes, (N+1, n) each."""
        dt = np.diff(self.nodes)[:, None]
        speed = np.vstack([np.zeros_like(self.begin), np.cumsum(dt * self.held, axis=0)])
        moved = np.cumsum(dt * (speed[:-1] + dt / 2 * self.held), axis=0)
        return np.vstack([self.begin, self.begin + moved]), speed

    def hold(self, t: ArrayLike) -> tuple[Index, Array]:
        """Which hold an instant is in, and how long it has lasted [s], (...) and (..., 1)."""
        at: Array = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        k = np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, len(self.held) - 1)
        return k, np.asarray((at - self.nodes[k])[..., None])

    def joint_rates(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """q, q', q'' at t [s], (..., n) each; at a node the acceleration of the hold it begins."""
        k, s = self.hold(t)
        (q, v), a = self.at_nodes, self.held[k]
        return q[k] + s * (v[k] + s / 2 * a), v[k] + s * a, a

    def rates(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """theta, theta', theta'' of the absolute angles at t [s], (..., n) each."""
        q, v, a = (np.cumsum(x, axis=-1) for x in self.joint_rates(t))
        return q, v, a

    def angles(self, t: ArrayLike) -> Array:
        """Joint angles [rad] at t [s], (...) -> (..., n)."""
        return self.joint_rates(t)[0]

    def absolute(self, t: ArrayLike) -> Array:
        """theta(t) [rad], (...) -> (..., n)."""
        return self.rates(t)[0]

    def spread(self, low: Array, high: Array) -> Array:
        """How far absolute angles are from those at the middle of [low, high] [s] at most, (m,) -> (m, n) [rad]."""
        half = (high - low)[:, None] / 2
        middle = (low + high) / 2
        speed = np.abs(self.rates(middle)[1])
        return np.asarray(half * (speed + half * self._largest_acceleration(low, high)))

    def _largest_acceleration(self, low: Array, high: Array) -> Array:
        """|theta''| on [low, high] at most, (m, n): over the holds that it meets."""
        absolute = np.abs(np.cumsum(self.held, axis=-1))
        first, last = self.hold(low)[0], self.hold(high)[0]
        out = np.maximum(absolute[first], absolute[last])
        for i in np.flatnonzero(last - first > 1):
            out[i] = np.max(absolute[first[i] : last[i] + 1], axis=0)
        return out

    @cached_property
    def motion(self) -> CentreMotion:
        """Of the centre of mass."""
        return CentreMotion(self)

    @cached_property
    def _bounds(self) -> tuple[Array, Array, Array]:
        """|w| at most, |b| and the length of every hold, (N, n), (N, n) and (N,)."""
        speed = np.abs(np.cumsum(self.at_nodes[1], axis=-1))
        return np.maximum(speed[:-1], speed[1:]), np.abs(np.cumsum(self.held, axis=-1)), np.diff(self.nodes)

    def _cut(self, second: Array, scale: float) -> tuple[Index, Array, Array]:
        """Instants in every hold, close enough for a function with |f''| at most `second`, (N,), beside its `scale`.

        Returns the hold of each (m,), how long it has lasted (m,), and what may lie between it and the next (m,).
        """
        dt = self._bounds[2]
        need = np.sqrt(second * dt**2 / 8 / (FINE * scale or 1.0))
        count = np.clip(np.ceil(np.nan_to_num(need, nan=MOST, posinf=MOST)), 1, MOST).astype(int)
        k = np.repeat(np.arange(len(dt)), count + 1)
        place = np.arange(len(k)) - np.repeat(np.cumsum(count + 1) - (count + 1), count + 1)
        return k, dt[k] * place / count[k], second[k] * (dt[k] / count[k]) ** 2 / 8

    def _within(self, k: Index, s: Array) -> tuple[Array, Array, Array]:
        """theta, theta', theta'' so long into a hold, (m, n) each."""
        (q, v), a, s = self.at_nodes, self.held[k], s[:, None]
        return (
            np.cumsum(q[k] + s * (v[k] + s / 2 * a), axis=-1),
            np.cumsum(v[k] + s * a, axis=-1),
            np.cumsum(a, axis=-1),
        )

    @cached_property
    def peak(self) -> tuple[float, float]:
        """The largest |u| [m/s^2] at any instant, and about when [s]."""
        w, b, _ = self._bounds
        second = (w**4 + 6 * w**2 * b + 3 * b**2) @ self.chain.c
        rough = float(np.max(norm(self._centre(*self._within(np.arange(len(w)), np.zeros(len(w)))))))
        k, s, between = self._cut(second, rough)
        u = norm(self._centre(*self._within(k, s))) + between
        worst = int(np.argmax(u))
        return float(u[worst]), float(self.nodes[k[worst]] + s[worst])

    def _centre(self, theta: Array, first: Array, second: Array) -> Array:
        return np.asarray(np.einsum("k,...kx->...x", self.chain.c, turned(theta, first, second)))

    @cached_property
    def torque_peaks(self) -> tuple[Array, Array]:
        """The largest |tau| of every joint [N m] at any instant, (n,), and about when [s], (n,).

        tau'' of one body: m (P'' x A + 2 P' x A' + P x A''), P from the joint to it and A its acceleration; each
        factor is at most the sum of its links' own.
        """
        chain, (w, b, _) = self.chain, self._bounds
        n, length = chain.links, chain.length
        place = [np.ones_like(w), w, b + w**2]  # |e|, |e'|, |e''| of each link
        push = [b + w**2, 3 * w * b + w**3, w**4 + 6 * w**2 * b + 3 * b**2]
        weight = np.append(chain.mass, chain.payload)
        pushed = [np.cumsum(length * x, axis=1) for x in push]  # of bodies on each link at most
        pushed = [np.column_stack([x, x[:, -1]]) for x in pushed]
        out, when = np.zeros(n), np.zeros(n)
        rough = float(np.max(np.abs(inverse_dynamics(chain, *self._within(np.arange(len(w)), np.zeros(len(w)))))))
        for j in range(n):
            far = [np.cumsum((length * x)[:, j:], axis=1) for x in place]
            far = [np.column_stack([x, x[:, -1]]) for x in far]
            second = sum((1, 2, 1)[i] * far[2 - i] * pushed[i][:, j:] for i in range(3)) @ weight[j:]
            k, s, between = self._cut(np.asarray(second), rough)
            tau = np.abs(inverse_dynamics(chain, *self._within(k, s))[:, j]) + between
            worst = int(np.argmax(tau))
            out[j], when[j] = tau[worst], self.nodes[k[worst]] + s[worst]
        return out, when

    @cached_property
    def ranges(self) -> tuple[Array, Array]:
        """The least and the largest angle of every joint [rad], (n,) each: at a node, or where q' = 0."""
        (q, v), a, dt = self.at_nodes, self.held, np.diff(self.nodes)[:, None]
        s = np.clip(-v[:-1] / np.where(a == 0, 1.0, a), 0.0, dt)
        turn = q[:-1] + np.where(a == 0, 0.0, s * (v[:-1] + s / 2 * a))
        every = np.vstack([q, turn])
        return np.min(every, axis=0), np.max(every, axis=0)

    @property
    def fastest(self) -> Array:
        """The largest |q'| of every joint [rad/s], (n,): at a node."""
        return np.asarray(np.max(np.abs(self.at_nodes[1]), axis=0))


@dataclass(frozen=True)
class CentreMotion:
    """The centre of mass of a joints' motion, as a trajectory."""

    joints: JointMotion

    @property
    def nodes(self) -> Array:
        return self.joints.nodes

    def position(self, t: ArrayLike) -> Array:
        return self.joints.chain.centre(self.joints.absolute(t))

    def velocity(self, t: ArrayLike) -> Array:
        q, v, _ = self.joints.joint_rates(t)
        return np.asarray(np.einsum("...xk,...k->...x", PlanarRobot(self.joints.chain).jacobian(q), v))

    def acceleration(self, t: ArrayLike) -> Array:
        return PlanarRobot(self.joints.chain).acceleration(self.joints.joint_rates(t))

    def peak(self) -> float:
        """[m/s^2] at any instant."""
        return self.joints.peak[0]

    def panels(self) -> Array:
        """The holds, each in two."""
        nodes = self.joints.nodes
        return np.union1d(nodes, (nodes[:-1] + nodes[1:]) / 2)
