"""The double integrator r'' = u as a few linear equations in the control, in scaled units.

Units: T = 1 and the largest |b| = 1; an acceleration of 1 here is `PointMass.unit` m/s^2. With the responses

    g_pos(t) = 1 - t,   g_vel(t) = 1,   g_i(t) = max(T_i - t, 0)

a control u takes the mass from start to goal through the walls' tips w_i at the times T_i exactly when

    int g_pos u dt = pf - p0 - v0 =: b_pos     int g_vel u dt = vf - v0 =: b_vel
    int g_i u dt = w_i - p0 - T_i v0 =: b_i                                           ("touch")
    int g_i u dt = b_i + s_i f_i with s_i >= 0, f_i the free direction of the wall    ("clear")

Rows always come in the order pos, vel, wall 1, ..., wall q. Multipliers L of these equations, shape (2+q, d) in d
dimensions, are admissible when f_i . l_i >= 0 for every clear wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.integrals import mean_norm
from ..geometry.norm import ROUNDING, norm
from ..geometry.units import Units
from ..geometry.window import Windows
from ..spec.maneuver import Maneuver
from ..types import Array, Index, Mask


@dataclass(frozen=True)
class PointMass(Units):
    """A maneuver in scaled units, which it knows, origin at the start.

    v0, pf, vf (d,) : the states;  windows : the free parts of q walls' lines. Stacked maneuvers have a first axis
    everywhere; their units are not kept.
    """

    v0: Array
    pf: Array
    vf: Array
    windows: Windows

    @classmethod
    def of(cls, maneuver: Maneuver) -> PointMass:
        """The maneuver in units of its duration and of its largest |b|."""
        start, goal, walls = maneuver.start, maneuver.goal, maneuver.walls
        openings = [math.inf if wall.opening is None else wall.opening for wall in walls]
        p0, v0, pf, vf = map(np.array, (start.position, start.velocity, goal.position, goal.velocity))
        windows = Windows(
            tips=np.array([wall.tip for wall in walls]).reshape(-1, len(p0)),
            free=-np.array([wall.direction for wall in walls]).reshape(-1, len(p0)),
            clear=np.array([wall.contact == "clear" for wall in walls], dtype=bool),
            width=np.array(openings, dtype=float),
        )
        return cls.between(p0, v0, pf, vf, maneuver.duration, windows)

    @classmethod
    def between(cls, p0: Array, v0: Array, pf: Array, vf: Array, duration: float, windows: Windows) -> PointMass:
        """From one state to another past windows, in units of the duration and of the largest |b|.

        Args:
            p0, v0, pf, vf: positions [m] and velocities [m/s], shape (d,) each.
            duration: [s].
            windows: in SI units, free directions of any length.
        """
        v0, vf, pf, windows = v0 * duration, vf * duration, pf - p0, windows.moved(-p0)
        sizes = norm(np.vstack([pf - v0, vf - v0, windows.tips, windows.tips - v0]))
        # no smaller than the rounding errors of the numbers it comes from
        grain = np.finfo(float).eps * max(float(np.max(np.abs(x), initial=0.0)) for x in (pf, v0, vf, windows.tips))
        length = max(float(np.max(sizes)), grain) or 1.0
        # divided, where `scaled` would multiply
        free = windows.free / norm(windows.free)[:, None]
        windows = replace(windows, tips=windows.tips / length, free=free, width=windows.width / length)
        return cls(length, duration, p0, v0 / length, pf / length, vf / length, windows)

    @classmethod
    def stacked(cls, masses: Sequence[PointMass]) -> PointMass:
        """Many of equally many walls as one, along a first axis of every array: for what says that it takes such."""
        v0, pf, vf = (np.stack(every) for every in zip(*((one.v0, one.pf, one.vf) for one in masses), strict=True))
        return replace(masses[0], v0=v0, pf=pf, vf=vf, windows=Windows.stacked([one.windows for one in masses]))

    def part(self, k: Index) -> PointMass:
        """Some of stacked maneuvers, by their numbers."""
        return replace(self, v0=self.v0[k], pf=self.pf[k], vf=self.vf[k], windows=self.windows.only(k))

    @property
    def dimension(self) -> int:
        """d, of the space that the mass moves in."""
        return int(self.v0.shape[-1])

    @property
    def walls(self) -> int:
        """Number q of walls."""
        return len(self.windows)

    @property
    def tips(self) -> Array:
        """Where the windows begin, shape (q, d)."""
        return self.windows.tips

    @property
    def free(self) -> Array:
        """Unit free directions f_i, shape (q, d)."""
        return self.windows.free

    @property
    def clear(self) -> Mask:
        """Which walls may be passed beyond the tip, shape (q,)."""
        return self.windows.clear

    @property
    def width(self) -> Array:
        """Up to which s_i, shape (q,), infinite but for openings."""
        return self.windows.width

    def only(self, walls: Mask) -> PointMass:
        """The same maneuver past some of its walls, a mask (q,): no control is lost."""
        return replace(self, windows=self.windows.only(walls))

    def facing(self, far: Mask) -> PointMass:
        """Every opening seen as one wall alone: as the one at its far end where `far`, shape (q,), is set.

        Both are weaker than the opening; at given times the least peak is that of one of them.
        """
        windows = self.windows.facing(far)
        return self if windows is self.windows else replace(self, windows=windows)

    def facing_for(self, multipliers: Array) -> PointMass:
        """The openings' walls that the multipliers L, shape (2+q, d), push against."""
        windows = self.windows.face(multipliers[..., 2:, :])
        return self if windows is self.windows else replace(self, windows=windows)

    def targets(self, times: Array, end: ArrayLike = 1.0) -> Array:
        """b(T), shape (..., 2+q, d), affine in the obstacle times (..., q) and in the end of the maneuver (...).

        Leading axes broadcast, also those of stacked maneuvers.
        """
        times, end = np.asarray(times, dtype=float), np.asarray(end, dtype=float)
        out = self._rows(np.broadcast_shapes(times.shape[:-1], end.shape))
        out[..., 0, :] = self.pf - end[..., None] * self.v0
        out[..., 1, :] = self.vf - self.v0
        out[..., 2:, :] = self.tips - times[..., None] * self.v0[..., None, :]
        return out

    def target_errors(self, times: Array) -> Array:
        """Bound on the rounding error of `targets`, shape (..., 2+q, d)."""
        v0, times = np.abs(self.v0), np.asarray(times)
        out = self._rows(times.shape[:-1])
        out[..., 0, :] = np.abs(self.pf) + v0
        out[..., 1, :] = np.abs(self.vf) + v0
        out[..., 2:, :] = np.abs(self.tips) + times[..., None] * v0[..., None, :]
        return ROUNDING * out

    def _rows(self, lead: tuple[int, ...]) -> Array:
        """Room for a vector for each equation: (..., 2+q, d)."""
        *stack, dimension = self.v0.shape
        return np.empty((*np.broadcast_shapes(lead, tuple(stack)), 2 + self.walls, dimension))

    def admissible(self, multipliers: Array) -> Array:
        """The multipliers (..., 2+q, d) with f_i . l_i raised to zero where a clear wall has it below."""
        out = multipliers.copy()
        out[..., 2:, :] = self.windows.admissible(multipliers[..., 2:, :])
        return out

    def reached(self, times: Array, moments: Array) -> Array:
        """The targets closest to the given moments, s_i >= 0 chosen for clear walls; shape (2+q, d)."""
        b = self.targets(times)
        b[2:] += self.windows.nearest(moments[2:] - b[2:])
        return b

    def floor(self, times: Array) -> float:
        """About the size of M: the largest |b| / int |g| dt of one equation at a time, openings counted as if they had
        no far end while that is above zero. Not a proof, but zero says that coasting satisfies every equation to
        rounding.
        """
        return self._without_ends()._floor(times) or self._floor(times)

    def _floor(self, times: Array) -> float:
        """`floor` past the windows as they are."""
        b, t = self.targets(times), np.asarray(times)
        needed = np.vstack([b[:2], self._blocked(b[2:])])
        # by the largest error of all axes: a wall's frame is turned against them
        if np.all(np.abs(needed) <= np.max(self.target_errors(times), axis=1, keepdims=True)):
            return 0.0
        walls = norm(needed[2:]) / (0.5 * t**2)
        back = norm(self._blocked(self._behind(t))) / (0.5 * (1 - t) ** 2)
        ends = norm(needed[:2]) / np.array([0.5, 1.0])
        return float(max(np.max(ends), np.max(walls, initial=0.0), np.max(back, initial=0.0)))

    def elementary(self, times: Array) -> list[Array]:
        """Multipliers, (2+q, d) each, of one equation at a time: the ends, each wall from the start and from the goal.

        Seen from the goal a wall is met 1 - T_i before the end, with (t - T_i)_+ = g_i - g_pos + (1 - T_i) g_vel.
        Openings are counted as if they had no far end.
        """
        b, t, rays = self.targets(times), np.asarray(times), self._without_ends()
        out = []
        for k, row in enumerate(np.vstack([b[:2], rays._blocked(b[2:])])):
            out.append(np.zeros_like(b))
            out[-1][k] = row
        for i, row in enumerate(rays._blocked(self._behind(t))):
            out.append(np.zeros_like(b))
            out[-1][2 + i], out[-1][0], out[-1][1] = row, -row, (1 - t[i]) * row
        return out

    def _without_ends(self) -> PointMass:
        """Past openings as if they had no far end."""
        if not np.any(np.isfinite(self.width)):
            return self
        return replace(self, windows=replace(self.windows, width=np.full_like(self.width, math.inf)))

    def _behind(self, times: Array) -> Array:
        """What (t - T_i)_+ must integrate u to, shape (q, d)."""
        return np.asarray(self.tips - self.pf + np.multiply.outer(1 - times, self.vf))

    def _blocked(self, b: Array) -> Array:
        """The part of b that a wall does not give away, (q, d): what is left of it from its window's nearest place."""
        return np.asarray(b + self.windows.nearest(-b))


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
    """The kinks 0, T_1 .. T_q, end in order, shape (..., q+2), and p = sum l g there, shape (..., q+2, d).

    p is linear between the kinks. Leading axes of times (..., q), multipliers (..., 2+q, d) and end (...) broadcast;
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
    """The multipliers (..., 2+q, d) over their largest entry: D(L, T) does not depend on their size."""
    largest = np.max(np.abs(multipliers), axis=(-2, -1), keepdims=True)
    return np.asarray(multipliers / np.where(largest == 0, 1.0, largest))


def impulse(multipliers: Array, times: Array, end: ArrayLike = 1.0) -> Array:
    """I = int_0^end |p(t)| dt in closed form, shape (...), for times (..., q) and multipliers (..., 2+q, d)."""
    kinks, p = costate_at_kinks(multipliers, times, end)
    return np.asarray(np.sum(np.diff(kinks, axis=-1) * mean_norm(p[..., :-1, :], p[..., 1:, :]), axis=-1))
