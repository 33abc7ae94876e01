"""The double integrator r'' = u as a few linear equations in the control, in scaled units.

Units: T = 1 and the largest |b| = 1; an acceleration of 1 here is `PointMass.unit` m/s^2. With the responses

    g_pos(t) = 1 - t,   g_vel(t) = 1,   g_i(t) = max(T_i - t, 0)

a control u takes the mass from start to goal through the walls' tips (d_i, h_i) at the times T_i exactly when

    int g_pos u dt = pf - p0 - v0 =: b_pos     int g_vel u dt = vf - v0 =: b_vel
    int g_i u dt = (d_i, h_i) - p0 - T_i v0 =: b_i                                    ("touch")
    int g_i u dt = b_i + s_i f_i with s_i >= 0, f_i the free direction of the wall    ("clear")

Rows always come in the order pos, vel, wall 1, ..., wall q. Multipliers L, shape (2+q, 2), of these equations
are admissible when f_i . l_i >= 0 for every clear wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.integrals import mean_norm
from ..spec.maneuver import Maneuver
from ..types import Array, Mask

ROUNDING = 64 * np.finfo(float).eps  # relative error allowed for a sum of products before it is a proof


@dataclass(frozen=True)
class PointMass:
    """A maneuver in scaled units, origin at the start.

    length [m], time [s] : the units;  v0, pf, vf (2,), tips (q, 2) : the states and walls;
    free (q, 2) : unit free directions f_i;  clear (q,) : which walls may be passed beyond the tip;  width (q,) : up to
    which s_i, infinite but for openings.
    """

    length: float
    time: float
    origin: Array
    v0: Array
    pf: Array
    vf: Array
    tips: Array
    free: Array
    clear: Array
    width: Array

    @classmethod
    def of(cls, maneuver: Maneuver) -> PointMass:
        """The maneuver in units of its duration and of its largest |b|."""
        time = maneuver.duration
        origin = np.array(maneuver.start.position)
        v0, vf = np.array(maneuver.start.velocity) * time, np.array(maneuver.goal.velocity) * time
        pf = np.array(maneuver.goal.position) - origin
        walls = maneuver.walls
        tips = np.array([w.tip for w in walls]).reshape(-1, 2) - origin
        free = -np.array([w.direction for w in walls]).reshape(-1, 2)
        sizes = [pf - v0, vf - v0, *tips, *(tips - v0)]
        # no smaller than the rounding errors of the numbers it comes from
        grain = np.finfo(float).eps * max(float(np.max(np.abs(x), initial=0.0)) for x in (pf, v0, vf, tips))
        length = max(*(float(np.hypot(*size)) for size in sizes), grain) or 1.0
        return cls(
            length=length,
            time=time,
            origin=origin,
            v0=v0 / length,
            pf=pf / length,
            vf=vf / length,
            tips=tips / length,
            free=free / np.hypot(free[:, :1], free[:, 1:]),
            clear=np.array([w.contact == "clear" for w in walls], dtype=bool),
            width=np.array([math.inf if w.opening is None else w.opening / length for w in walls], dtype=float),
        )

    def facing(self, far: Mask) -> PointMass:
        """Every opening seen as one wall alone: as the one at its far end where `far`, shape (q,), is set.

        Both are weaker than the opening; at given times the least peak is that of one of them.
        """
        if not np.any(np.isfinite(self.width)):
            return self
        flip = (far & np.isfinite(self.width))[..., None]
        across = np.where(flip, np.where(np.isfinite(self.width), self.width, 0.0)[..., None] * self.free, 0.0)
        return replace(
            self,
            tips=self.tips + across,
            free=np.where(flip, -self.free, self.free),
            width=np.full_like(self.width, math.inf),
        )

    def only(self, walls: Mask) -> PointMass:
        """The same maneuver past some of its walls, a mask (q,): no control is lost."""
        own = {name: getattr(self, name)[walls] for name in ("tips", "free", "clear", "width")}
        return replace(self, **own)

    def facing_for(self, multipliers: Array) -> PointMass:
        """The openings' walls that the multipliers L, shape (2+q, 2), push against."""
        return self.facing(np.sum(self.free * multipliers[..., 2:, :], axis=-1) < 0)

    @classmethod
    def stacked(cls, masses: Sequence[PointMass]) -> PointMass:
        """Many of equally many walls as one, along a first axis of every array: for what says that it takes such."""
        own: Any = {field.name: np.stack([getattr(one, field.name) for one in masses]) for field in fields(cls)}
        return cls(**own)

    @property
    def walls(self) -> int:
        """Number q of walls."""
        return int(self.tips.shape[-2])

    @property
    def unit(self) -> float:
        """Size of the scaled acceleration 1 [m/s^2]."""
        return self.length / self.time**2

    def targets(self, times: Array, end: ArrayLike = 1.0) -> Array:
        """b(T), shape (..., 2+q, 2), affine in the obstacle times (..., q) and in the end of the maneuver (...).

        Leading axes broadcast, also those of stacked maneuvers.
        """
        times, end = np.asarray(times, dtype=float), np.asarray(end, dtype=float)
        out = np.empty((*np.broadcast_shapes(times.shape[:-1], end.shape, self.v0.shape[:-1]), 2 + self.walls, 2))
        out[..., 0, :] = self.pf - end[..., None] * self.v0
        out[..., 1, :] = self.vf - self.v0
        out[..., 2:, :] = self.tips - times[..., None] * self.v0[..., None, :]
        return out

    def target_errors(self, times: Array) -> Array:
        """Bound on the rounding error of `targets`, shape (..., 2+q, 2)."""
        v0, times = np.abs(self.v0), np.asarray(times)
        out = np.empty((*np.broadcast_shapes(times.shape[:-1], v0.shape[:-1]), 2 + self.walls, 2))
        out[..., 0, :] = np.abs(self.pf) + v0
        out[..., 1, :] = np.abs(self.vf) + v0
        out[..., 2:, :] = np.abs(self.tips) + times[..., None] * v0[..., None, :]
        return ROUNDING * out

    def admissible(self, multipliers: Array) -> Array:
        """The multipliers (..., 2+q, 2) with f_i . l_i raised to zero where a clear wall has it below."""
        walls = multipliers[..., 2:, :]
        along = np.sum(self.free * walls, axis=-1)
        # raised a rounding error above zero, so that f_i . l_i >= 0 holds in exact arithmetic too
        size = np.hypot(walls[..., 0], walls[..., 1])
        raised = np.where(self.clear & (along < 0), ROUNDING * size - along, 0.0)
        out = multipliers.copy()
        out[..., 2:, :] += raised[..., None] * self.free
        return out

    def reached(self, times: Array, moments: Array) -> Array:
        """The targets closest to the given moments, s_i >= 0 chosen for clear walls; shape (2+q, 2)."""
        b = self.targets(times)
        along = np.sum(self.free * (moments[2:] - b[2:]), axis=1)
        beyond = np.minimum(np.maximum(along, 0.0), self.width) * self.clear
        b[2:] += beyond[:, None] * self.free
        return b

    def floor(self, times: Array) -> float:
        """About the size of M: the largest |b| / int |g| dt of one equation at a time. Not a proof, but zero says that
        coasting satisfies every equation to rounding.
        """
        b, t = self.targets(times), np.asarray(times)
        needed = np.vstack([b[:2], self._blocked(b[2:])])
        # by the larger error of the two axes: a wall's frame is turned against them
        if np.all(np.abs(needed) <= np.max(self.target_errors(times), axis=1, keepdims=True)):
            return 0.0
        walls = np.hypot(*needed[2:].T) / (0.5 * t**2)
        back = np.hypot(*self._blocked(self._behind(t)).T) / (0.5 * (1 - t) ** 2)
        ends = np.hypot(*needed[:2].T) / np.array([0.5, 1.0])
        return float(max(np.max(ends), np.max(walls, initial=0.0), np.max(back, initial=0.0)))

    def elementary(self, times: Array) -> list[Array]:
        """Multipliers, (2+q, 2) each, of one equation at a time: the ends, each wall from the start and from the goal.

        Seen from the goal a wall is met 1 - T_i before the end, with (t - T_i)_+ = g_i - g_pos + (1 - T_i) g_vel.
        """
        b, t = self.targets(times), np.asarray(times)
        out = []
        for k, row in enumerate(np.vstack([b[:2], self._blocked(b[2:])])):
            out.append(np.zeros_like(b))
            out[-1][k] = row
        for i, row in enumerate(self._blocked(self._behind(t))):
            out.append(np.zeros_like(b))
            out[-1][2 + i], out[-1][0], out[-1][1] = row, -row, (1 - t[i]) * row
        return out

    def _behind(self, times: Array) -> Array:
        """What (t - T_i)_+ must integrate u to, shape (q, 2)."""
        return np.asarray(self.tips - self.pf + np.multiply.outer(1 - times, self.vf))

    def _blocked(self, b: Array) -> Array:
        """The part of b that a wall does not give away: all of it, less -s f_i for clear walls."""
        beyond = np.maximum(-np.sum(self.free * b, axis=1), 0.0) * self.clear
        return np.asarray(b + beyond[:, None] * self.free)


def hold_rows(edges: Array, times: Array) -> Array:
    """Moments of one unit of control on each hold, shape (2+q, steps), exact for times between nodes too.

    The hold on [t_k, t_k+dt] acts for c = clip(s - t_k, 0, dt) before the time s and has moved the mass by
    c (s - t_k - c/2), its velocity by c: the last columns of the paper's Gamma, seen at s.

    Args:
        edges: ends of the holds, shape (steps+1,), from 0 to 1.
        times: obstacle times, shape (q,).
    """
    begin, dt = edges[:-1], np.diff(edges)
    moments = np.concatenate([[1.0], times])[:, None]
    acted = np.clip(moments - begin, 0.0, dt)
    position = acted * (moments - begin - acted / 2)
    return np.vstack([position[:1], dt[None, :], position[1:]])


def responses(t: Array, times: Array) -> Array:
    """g_pos, g_vel, g_1 .. g_q at the instants t; shape (2+q, len(t))."""
    return np.vstack([1 - t, np.ones_like(t), np.maximum(np.asarray(times)[:, None] - t, 0.0)])


def transition(dt: float) -> tuple[Array, Array]:
    """Phi (2, 2) and Gamma (2,) of one axis, state (position, velocity), for a hold of length dt.

    x(k+1) = Phi x(k) + Gamma u(k), the zero-order hold of x' = [[0, 1], [0, 0]] x + [0, 1] u.
    """
    return np.array([[1.0, dt], [0.0, 1.0]]), np.array([0.5 * dt * dt, dt])


def costate_at_kinks(multipliers: Array, times: Array, end: ArrayLike = 1.0) -> tuple[Array, Array]:
    """The kinks 0, T_1 .. T_q, end in order, shape (..., q+2), and p = sum l g there, shape (..., q+2, 2).

    p is linear between the kinks. Leading axes of times (..., q), multipliers (..., 2+q, 2) and end (...) broadcast;
    times beyond the end count as the end.
    """
    times, end = np.asarray(times, dtype=float), np.asarray(end, dtype=float)[..., None]
    shape = np.broadcast_shapes(times.shape[:-1], end.shape[:-1])
    inside = np.broadcast_to(np.minimum(times, end), (*shape, times.shape[-1]))
    ends = np.broadcast_to(end, (*shape, 1))
    kinks = np.sort(np.concatenate([np.zeros((*shape, 1)), inside, ends], axis=-1), axis=-1)
    hinges = np.maximum(times[..., None, :] - kinks[..., :, None], 0.0)  # (..., q+2, q)
    straight = (end - kinks)[..., None] * multipliers[..., None, 0, :] + multipliers[..., None, 1, :]
    return kinks, straight + hinges @ multipliers[..., 2:, :]


def normalized(multipliers: Array) -> Array:
    """The multipliers (..., 2+q, 2) over their largest entry: D(L, T) does not depend on their size."""
    largest = np.max(np.abs(multipliers), axis=(-2, -1), keepdims=True)
    return np.asarray(multipliers / np.where(largest == 0, 1.0, largest))


def impulse(multipliers: Array, times: Array, end: ArrayLike = 1.0) -> Array:
    """I = int_0^end |p(t)| dt in closed form, shape (...), for times (..., q) and multipliers (..., 2+q, 2)."""
    kinks, p = costate_at_kinks(multipliers, times, end)
    return np.asarray(np.sum(np.diff(kinks, axis=-1) * mean_norm(p[..., :-1, :], p[..., 1:, :]), axis=-1))
