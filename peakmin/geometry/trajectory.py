"""A control and the motion it makes, callable at any time, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly, PPoly

from ..types import Array, Index
from .norm import norm


class Trajectory(Protocol):
    """Position [m], velocity [m/s] and acceleration [m/s^2] at times t [s]: shape (...) -> (..., d)."""

    @property
    def nodes(self) -> Array:
        """Times [s] between which the motion is smooth, shape (N+1,)."""

    def position(self, t: ArrayLike) -> Array: ...
    def velocity(self, t: ArrayLike) -> Array: ...
    def acceleration(self, t: ArrayLike) -> Array: ...
    def peak(self) -> float:
        """A bound on |acceleration| [m/s^2]."""

    def panels(self) -> Array:
        """Times [s] between which an eight-point Gauss rule integrates the acceleration to rounding."""


@dataclass(frozen=True)
class HoldTrajectory:
    """Piecewise constant control: parabolas between the nodes.

    nodes [s] (steps+1,), control [m/s^2] (steps, d), start position [m] and velocity [m/s] (d,).
    Times outside the maneuver count as its ends.
    """

    nodes: Array
    control: Array
    start_position: Array
    start_velocity: Array

    @property
    def node_velocity(self) -> Array:
        """Velocity at the nodes, shape (steps+1, d)."""
        steps = np.diff(self.nodes)[:, None] * self.control
        return np.vstack([self.start_velocity, self.start_velocity + np.cumsum(steps, axis=0)])

    @property
    def node_position(self) -> Array:
        """Position at the nodes, shape (steps+1, d)."""
        dt, v = np.diff(self.nodes)[:, None], self.node_velocity
        steps = dt * (v[:-1] + 0.5 * dt * self.control)
        return np.vstack([self.start_position, self.start_position + np.cumsum(steps, axis=0)])

    def _hold(self, t: ArrayLike) -> tuple[Index, Array]:
        at: Array = np.clip(np.asarray(t, dtype=float), self.nodes[0], self.nodes[-1])
        k = np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, len(self.control) - 1)
        return k, np.asarray((at - self.nodes[k])[..., None])

    def position(self, t: ArrayLike) -> Array:
        """Position [m] at t [s], shape (...) -> (..., d)."""
        k, s = self._hold(t)
        return np.asarray(self.node_position[k] + s * self.node_velocity[k] + 0.5 * s * s * self.control[k])

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity [m/s] at t [s], shape (...) -> (..., d)."""
        k, s = self._hold(t)
        return np.asarray(self.node_velocity[k] + s * self.control[k])

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration [m/s^2] at t [s], shape (...) -> (..., d); at a node that of the hold it begins."""
        return np.asarray(self.control[self._hold(t)[0]])

    def peak(self) -> float:
        """Largest |acceleration| [m/s^2]."""
        return float(np.max(norm(self.control)))

    def panels(self) -> Array:
        """Times [s] between which the acceleration is constant."""
        return self.nodes


SAMPLES = 4000  # of a motion when its peak is looked for


@dataclass(frozen=True)
class Polynomial:
    """A motion of the centre of mass in polynomial pieces, as a trajectory."""

    pieces: BPoly | PPoly

    @property
    def nodes(self) -> Array:
        return np.asarray(self.pieces.x)

    def position(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces(np.asarray(t, dtype=float)))

    def velocity(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces.derivative(1)(np.asarray(t, dtype=float)))

    def acceleration(self, t: ArrayLike) -> Array:
        return np.asarray(self.pieces.derivative(2)(np.asarray(t, dtype=float)))

    def peak(self) -> float:
        """Largest |acceleration| at SAMPLES + 1 instants [m/s^2]."""
        return float(np.max(norm(self.acceleration(np.linspace(0, self.nodes[-1], SAMPLES + 1)))))

    def panels(self) -> Array:
        return self.nodes
