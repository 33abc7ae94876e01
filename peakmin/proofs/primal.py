"""From nodal multipliers to a motion that satisfies every equation: corrected where p speaks, filled in where not.

The control M p/|p| of nearly optimal multipliers misses the equations by a little. The small control
e(t) = sum phi_j(t) e_j of hat functions, with (int phi_i phi_j) e = what is missed, makes it exact; |e| is what the
motion's peak exceeds M by, and the gap shows it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.costate import CostateTrajectory
from ..geometry.integrals import mean_direction
from ..geometry.norm import norm
from ..types import Array, Mask
from .double_integrator import PointMass
from .nodal import Nodal

LANDED = 1e-10  # largest error of a state [scaled] at the end of a motion


def coasting(nodal: Nodal) -> CostateTrajectory:
    """The motion without any force."""
    k, v0 = len(nodal.kinks) - 1, nodal.mass.v0
    none, ones = np.zeros((k, len(v0))), np.ones((k, len(v0)))
    return CostateTrajectory(nodal.kinks, ones, ones, np.zeros(k), none, none, np.zeros_like(v0), v0)


def motion(
    nodal: Nodal,
    p: Array,
    silent: Mask,
    peak: float,
    impulses: Array,
    idle: Mask,
    fill: Callable[[PointMass, Array], CostateTrajectory],
) -> tuple[CostateTrajectory | None, Array]:
    """The motion of the nodal values p, shape (n, d), and how far beyond its tip each idle wall is passed, (q,).

    Args:
        silent: kinks where p is zero by assumption, (n,).
        peak: M [scaled];  impulses: dI/dP there, shape (n, d).
        idle: clear walls that do not push, (q,).
        fill: gives the motion of least peak for a stretch by itself.

    Raises:
        LinAlgError: where nothing fixes the velocity of a stretch.
    """
    n, mass = len(nodal.kinks), nodal.mass
    quiet = silent[:-1] & silent[1:]
    points = np.vstack([np.zeros_like(mass.pf), mass.tips, mass.pf])
    speaking = _Speaking(nodal, p, silent, peak, impulses, idle, points, np.zeros(mass.walls))
    runs = _runs(quiet)
    parts = {a: speaking.part(a, b) for a, b, is_quiet in runs if not is_quiet}
    for a, b, is_quiet in runs:
        if is_quiet:
            left = next((m for i, m in parts.items() if i < a and m.nodes[-1] == nodal.kinks[a]), None)
            v_a = mass.v0 if left is None else left.node_states[0][-1]
            v_b = mass.vf if b == n - 1 else parts[b].start_velocity
            parts[a] = _stretch(mass, nodal.kinks[a : b + 1], points[a : b + 1], a, v_a, v_b, fill)
    joined = _join([parts[a] for a in sorted(parts)])
    v, r = joined.node_states
    miss = max(float(np.max(np.abs(r[-1] - mass.pf))), float(np.max(np.abs(v[-1] - mass.vf))))
    kinks = nodal.kinks[1:-1]
    at = (joined.position(kinks) if np.any(quiet) else r[1:-1]) - mass.tips
    miss = max(miss, float(np.max(np.abs(at - mass.windows.nearest(at)), initial=0.0)))
    lands = miss <= LANDED * (1 + peak) and math.isfinite(joined.peak())
    return (joined if lands else None), speaking.beyond


def _runs(quiet: Mask) -> list[tuple[int, int, bool]]:
    """Maximal runs of segments as (first kink, last kink, quiet)."""
    cuts = [0, *(np.flatnonzero(quiet[1:] != quiet[:-1]) + 1).tolist(), len(quiet)]
    return [(a, b, bool(quiet[a])) for a, b in zip(cuts, cuts[1:], strict=False)]


@dataclass(frozen=True)
class _Speaking:
    """The stretches where p is not silent, with the arguments of `motion`.

    points, (n, d): the positions at the kinks;  beyond, (q,): how far beyond the tips. Of idle walls both are set when
    the stretch that passes them is made.
    """

    nodal: Nodal
    p: Array
    silent: Mask
    peak: float
    impulses: Array
    idle: Mask
    points: Array
    beyond: Array

    def part(self, a: int, b: int) -> CostateTrajectory:
        """M p/|p| + e from kink a to kink b."""
        plain = self._plain(a, b)
        self._pass_idle_walls(plain, a, b)
        exact = self._run(a, b, plain.start_velocity, self._corrections(a, b))
        return replace(exact, start_velocity=self._velocity(exact, a, b))

    def _run(self, a: int, b: int, velocity: Array, e: Array) -> CostateTrajectory:
        """M p/|p| + e with a start velocity, e given at all kinks, (n, d)."""
        nodes, size = self.nodal.kinks[a : b + 1], np.full(b - a, self.peak)
        p, start = self.p, self.points[a]
        return CostateTrajectory(nodes, p[a:b], p[a + 1 : b + 1], size, e[a:b], e[a + 1 : b + 1], start, velocity)

    def _plain(self, a: int, b: int) -> CostateTrajectory:
        """M p/|p| from where this stretch is fixed: forwards from the start, else to the next fixed point, or backwards
        from the goal, which also says where an idle wall at kink a is passed.
        """
        mass, kinks, last = self.nodal.mass, self.nodal.kinks, len(self.p) - 1
        plain = self._run(a, b, np.zeros_like(mass.v0) if a else mass.v0, np.zeros_like(self.p))
        if not (a and b == last):
            return replace(plain, start_velocity=self._velocity(plain, a, b))
        v, r = plain.node_states
        v_a = mass.vf - v[-1]
        return replace(plain, start_velocity=v_a, start_position=mass.pf - (r[-1] - r[0]) - v_a * (kinks[b] - kinks[a]))

    def _velocity(self, trial: CostateTrajectory, a: int, b: int) -> Array:
        """The start velocity with which the next fixed point is met."""
        mass, kinks, last = self.nodal.mass, self.nodal.kinks, len(self.p) - 1
        if a == 0:
            return mass.v0
        j = next((j for j in range(a + 1, b + 1) if j == last or not self.idle[j - 1]), None)
        if j is None:
            raise np.linalg.LinAlgError("nothing fixes the velocity of this stretch")
        miss = self.points[j] - trial.position(kinks[j])
        return np.asarray(trial.start_velocity + miss / (kinks[j] - kinks[a]))

    def _pass_idle_walls(self, plain: CostateTrajectory, a: int, b: int) -> None:
        """Set where the idle walls of this stretch are passed."""
        mass, last = self.nodal.mass, len(self.p) - 1
        for j in range(max(a, 1), min(b, last - 1) + 1):
            if self.idle[j - 1] and (j > a or b == last):
                at = plain.position(self.nodal.kinks[j])
                self.beyond[j - 1] = float(mass.free[j - 1] @ (at - mass.tips[j - 1]))
                self.points[j] = mass.tips[j - 1] + max(self.beyond[j - 1], 0.0) * mass.free[j - 1]

    def _corrections(self, a: int, b: int) -> Array:
        """e at all kinks, (n, d): of those that p is not silent at, for what M p/|p| still misses."""
        mass, silent, last = self.nodal.mass, self.silent, len(self.p) - 1
        used = np.array([j for j in range(a, b + 1) if not (silent[j] and (j in (a, b)) and 0 < j < last)], dtype=int)
        speeds = np.vstack([mass.v0, np.diff(self.points, axis=0) / self.nodal.h[:, None], mass.vf])
        missed = np.diff(speeds, axis=0)[used] - self.peak * self.impulses[used]
        e = np.zeros_like(self.p)
        e[used] = np.linalg.solve(self.nodal.masses()[np.ix_(used, used)], missed)
        return e


def _stretch(
    mass: PointMass,
    kinks: Array,
    points: Array,
    a: int,
    v_a: Array,
    v_b: Array,
    fill: Callable[[PointMass, Array], CostateTrajectory],
) -> CostateTrajectory:
    """The least-peak motion of a silent stretch by itself, between the states that its neighbours leave it."""
    span = kinks[-1] - kinks[0]
    inner = np.arange(a, a + len(kinks) - 2)
    windows = mass.windows.only(inner).moved(-points[0])
    part = replace(mass, v0=v_a * span, vf=v_b * span, pf=points[-1] - points[0], windows=windows)
    own = fill(part, (kinks[1:-1] - kinks[0]) / span)
    scale = 1 / span**2
    return CostateTrajectory(
        np.r_[kinks[0], kinks[0] + span * own.nodes[1:-1], kinks[-1]],
        own.first,
        own.last,
        own.size * scale,
        own.first_error * scale,
        own.last_error * scale,
        points[0],
        v_a,
    )


def _join(parts: list[CostateTrajectory]) -> CostateTrajectory:
    first = parts[0]
    if len(parts) == 1:
        return first
    return CostateTrajectory(
        np.concatenate([first.nodes, *(m.nodes[1:] for m in parts[1:])]),
        np.vstack([m.first for m in parts]),
        np.vstack([m.last for m in parts]),
        np.concatenate([m.size for m in parts]),
        np.vstack([m.first_error for m in parts]),
        np.vstack([m.last_error for m in parts]),
        first.start_position,
        first.start_velocity,
    )


def attained(nodal: Nodal, p: Array, idle: Mask) -> tuple[Array, Array]:
    """Peaks (m,) of Pontryagin's controls of the values P, (m, n, d), made exact, infinite where they miss even so; and
    how far beyond its tip each wall is passed, (m, q), where it is idle, (q,).
    """
    mass, h = nodal.mass, nodal.h[..., None]
    impulse, impulses = nodal.derivatives(p)
    none = np.zeros(mass.tips.shape[:-1])
    with np.errstate(all="ignore"):
        peak = np.maximum(np.sum(p * nodal.forces(none), axis=(1, 2)), 0.0) / impulse
        plain, weighted = mean_direction(p[:, :-1], p[:, 1:])
        m = peak[:, None, None]

        def states(e: Array) -> tuple[Array, Array]:
            """Velocities and positions at the kinks under M p/|p| + e."""
            gained = h * (m * plain + (e[:, :-1] + e[:, 1:]) / 2)
            v = np.cumsum(np.concatenate([mass.v0[:, None], gained], axis=1), axis=1)
            moved = h * v[:, :-1] + h * h * (m * (plain - weighted) + e[:, :-1] / 3 + e[:, 1:] / 6)
            return v, np.cumsum(np.concatenate([np.zeros_like(moved[:, :1]), moved], axis=1), axis=1)

        r = states(np.zeros_like(p))[1]
        beyond = mass.windows.along(r[:, 1:-1] - mass.tips) * idle
        e = np.linalg.solve(nodal.masses(), nodal.forces(np.maximum(beyond, 0.0)) - m * impulses)
        v, r = states(e)
        at = r[:, 1:-1] - mass.tips
        short = r[:, -1:] - mass.pf[:, None], v[:, -1:] - mass.vf[:, None], at - mass.windows.nearest(at)
        missed = np.concatenate(short, axis=1)
        upper = peak + np.max(norm(e), axis=1)
        lands = np.max(np.abs(missed), axis=(1, 2)) <= LANDED * (1 + peak)
    return np.where(lands & np.isfinite(upper), upper, np.inf), beyond
