"""Pontryagin's control u = M p/|p|, with p linear between the walls, as a trajectory in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..types import Array, Index
from .integrals import mean_direction
from .norm import norm
from .units import Units

REACH = 45  # halvings towards the place where p is smallest: 2^-45 of a segment is a rounding error of its length


@dataclass(frozen=True)
class CostateTrajectory:
    """u(t) = size p(t)/|p(t)| + e(t) on each of K segments, p and e linear in time on each.

    nodes [s] (K+1,); first, last: p at the segments' ends, any unit, (K, d); size [m/s^2] (K,); first_error,
    last_error: e at the segments' ends [m/s^2] (K, d), the small control that makes the motion exact;
    start position [m] and velocity [m/s] (d,). Times outside the maneuver count as its ends.
    """

    nodes: Array
    first: Array
    last: Array
    size: Array
    first_error: Array
    last_error: Array
    start_position: Array
    start_velocity: Array

    @classmethod
    def holding(cls, nodes: Array, control: Array, velocity: Array) -> CostateTrajectory:
        """A piecewise constant control (K, d) as such a trajectory from the origin: p constant on each segment."""
        none = np.zeros_like(control)
        return cls(nodes, control, control, norm(control), none, none, np.zeros_like(velocity), velocity)

    def in_units(self, units: Units) -> CostateTrajectory:
        """The scaled motion in SI units."""
        return CostateTrajectory(
            self.nodes * units.time,
            self.first,
            self.last,
            self.size * units.unit,
            self.first_error * units.unit,
            self.last_error * units.unit,
            self.start_position * units.length + units.origin,
            self.start_velocity * (units.length / units.time),
        )

    def peak(self) -> float:
        """A bound on |acceleration| [m/s^2]: size + |e|, and e is largest at an end."""
        errors = np.maximum(norm(self.first_error), norm(self.last_error))
        return float(np.max(self.size + errors))

    @cached_property
    def _p(self) -> tuple[Array, Array]:
        """p at the segments' ends, in units of the larger: its unit is no matter."""
        unit = np.maximum(np.max(np.abs(self.first), axis=1), np.max(np.abs(self.last), axis=1))[:, None]
        unit = np.where(unit > 0, unit, 1.0)
        return self.first / unit, self.last / unit

    def _moved(self, k: Index, x: Array) -> tuple[Array, Array]:
        """Velocity and position gained from the start of segments k to their fraction x; (..., d) each."""
        first, last, x = self._p[0][k], self._p[1][k], x[..., None]
        part = x * (last - first)
        h = np.diff(self.nodes)[k][..., None] * x
        plain, weighted = mean_direction(first, first + part)
        size, e0 = self.size[k][..., None], self.first_error[k]
        e1 = e0 + x * (self.last_error[k] - e0)
        velocity = h * (size * plain + (e0 + e1) / 2)
        position = h * h * (size * (plain - weighted) + e0 / 3 + e1 / 6)
        return velocity, position

    @cached_property
    def node_states(self) -> tuple[Array, Array]:
        """Velocity and position at the nodes, shape (K+1, d) each."""
        k = np.arange(len(self.size))
        velocity, position = self._moved(k, np.ones(len(k)))
        v = np.vstack([self.start_velocity, self.start_velocity + np.cumsum(velocity, axis=0)])
        steps = np.diff(self.nodes)[:, None] * v[:-1] + position
        return v, np.vstack([self.start_position, self.start_position + np.cumsum(steps, axis=0)])

    def _segment(self, t: ArrayLike) -> tuple[Index, Array]:
        at: Array = np.clip(np.asarray(t, dtype=float), self.nodes[0], self.nodes[-1])
        k = np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, len(self.size) - 1)
        return k, np.asarray((at - self.nodes[k]) / np.diff(self.nodes)[k])

    def position(self, t: ArrayLike) -> Array:
        """Position [m] at t [s], shape (...) -> (..., d)."""
        k, x = self._segment(t)
        v, r = self.node_states
        return np.asarray(r[k] + (x * np.diff(self.nodes)[k])[..., None] * v[k] + self._moved(k, x)[1])

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity [m/s] at t [s], shape (...) -> (..., d)."""
        k, x = self._segment(t)
        return np.asarray(self.node_states[0][k] + self._moved(k, x)[0])

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration [m/s^2] at t [s], shape (...) -> (..., d)."""
        k, x = self._segment(t)
        x = x[..., None]
        first, last = self._p[0][k], self._p[1][k]
        p = first + x * (last - first)
        r = norm(p)[..., None]
        step = last - first  # where p is zero, the direction it leaves with
        p = np.where(r > 0, p, step)
        r = np.where(r > 0, r, np.maximum(norm(step), 1e-300)[..., None])
        e = self.first_error[k] + x * (self.last_error[k] - self.first_error[k])
        return np.asarray(self.size[k][..., None] * p / r + e)

    def panels(self) -> Array:
        """Times [s] between which an eight-point Gauss rule integrates the acceleration to rounding.

        |p| has a zero near the real axis where p is smallest; panels that halve towards it keep their distance.
        """
        cuts = [self.nodes]
        for begin, end, p0, p1 in zip(self.nodes, self.nodes[1:], *self._p, strict=False):
            d = p1 - p0
            square = float(d @ d)
            nearest = float(np.clip(-(p0 @ d) / square, 0, 1)) if square > 0 else 0.5
            for side in (-nearest, 1 - nearest):
                cuts.append(begin + (end - begin) * (nearest + side * 0.5 ** np.arange(REACH)))
            cuts.append(np.array([begin + (end - begin) * nearest]))
        return np.unique(np.clip(np.concatenate(cuts), self.nodes[0], self.nodes[-1]))
