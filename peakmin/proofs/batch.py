"""The optimum of many maneuvers at given obstacle times at once: `proofs.extremal` along a first axis of all arrays.

Where Newton's method settles and p is nowhere silent, as it mostly is, this is all there is to do; of the rest the gap
shows that it is not done. Bounds are those of `proofs.bounds`; what attains them is checked as in `proofs.primal`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..geometry.integrals import all_derivatives, assembly, mean_direction
from ..geometry.norm import norm
from ..types import Array, Index, Mask
from .bounds import lower_bounds
from .double_integrator import PointMass
from .extremal import NEWTON_STEPS, SETTLED, least_energy
from .nodal import Nodal
from .primal import LANDED

FLAT = 1e-13  # gradient, of the size of c, at which Newton's method is done
FIRST = 1e-3  # damping, of the Hessian's mean, where Newton's own step is not better
STUCK = 1e3  # damping, of the Hessian's mean, beyond which no step is better


@dataclass(frozen=True)
class Extremals:
    """lower <= M* <= upper [scaled], (m,), upper infinite where not found; multipliers that prove it, (m, 2+q, d)."""

    lower: Array
    upper: Array
    multipliers: Array

    @property
    def settled(self) -> Mask:
        """Which need no more, (m,)."""
        return np.isfinite(self.upper) & (self.lower >= (1 - SETTLED) * self.upper)


def extremals(mass: PointMass, times: Array) -> Extremals:
    """The least peaks of stacked maneuvers at given times, for those that are not difficult.

    Args:
        mass: the maneuvers in scaled units, without openings.
        times: strictly increasing in (0, 1), shape (m, q).
    """
    m, q = times.shape
    every = Nodal(mass, np.concatenate([np.zeros((m, 1)), times, np.ones((m, 1))], axis=1))
    out = Extremals(np.zeros(m), np.full(m, np.inf), np.zeros((m, 2 + q, mass.v0.shape[-1])))
    p, idle, left = least_energy(every), np.zeros((m, q), dtype=bool), np.arange(m)
    for _ in range(1 + q):
        following = idle.copy()
        for walls in np.unique(idle[left], axis=0):
            k = left[np.all(idle[left] == walls, axis=1)]
            nodal = _part(every, k)
            p[k] = newton(nodal, p[k], nodal.basis(walls, np.zeros(q + 2, dtype=bool)))
            multipliers = nodal.multipliers(p[k])
            upper, beyond = attained(nodal, p[k], walls)
            lower = lower_bounds(nodal.mass, times[k], multipliers)
            push = nodal.mass.windows.along(multipliers[:, 2:])
            following[k] = nodal.mass.clear & np.where(walls, beyond >= 0, push < 0)
            out.upper[k] = np.minimum(out.upper[k], upper)
            better = lower > out.lower[k]
            out.lower[k[better]], out.multipliers[k[better]] = lower[better], multipliers[better]
        left = left[~out.settled[left] & np.any(following != idle, axis=1)[left]]
        idle = following
        if not len(left):
            break
    return out


def _part(every: Nodal, k: Index) -> Nodal:
    return Nodal(every.mass.part(k), every.kinks[k])


def newton(nodal: Nodal, p: Array, basis: Array) -> Array:
    """Values P, (m, n, d), where F is about least over the span of the basis (m, n d, k), from the projection of p."""
    m = len(p)
    h, c = nodal.h, nodal.forces(np.zeros(nodal.mass.tips.shape[:-1])).reshape(m, -1)
    y = np.einsum("mij,mi->mj", basis, p.reshape(m, -1))
    here = _Points.of(h, basis, c, y)
    with np.errstate(all="ignore"):
        multiple = here.work / here.impulse**2  # the best of the start
    here = _Points.of(h, basis, c, y * np.where((multiple > 0) & np.isfinite(multiple), multiple, 1.0)[:, None])
    flat = FLAT * np.linalg.norm(c, axis=1)
    damping, live = np.zeros(m), np.arange(m)
    for _ in range(NEWTON_STEPS):
        live = live[(here.size[live] > flat[live]) & (damping[live] < STUCK)]
        if not len(live):
            break
        damped = here.hessian[live]
        mean = np.trace(damped, axis1=1, axis2=2) / damped.shape[-1]
        damped += (damping[live] * mean)[:, None, None] * np.eye(damped.shape[-1])
        more = np.maximum(10 * damping[live], FIRST)
        try:
            step = -np.linalg.solve(damped, here.g[live][..., None])[..., 0]
        except np.linalg.LinAlgError:
            damping[live] = more
            continue
        trial = _Points.of(h[live], basis[live], c[live], here.y[live] + step)
        f, size = here.f[live], here.size[live]
        # close to the optimum F stands still in its last digits while its gradient still falls
        better = (trial.f < f) | ((trial.f <= f + 1e-13 * np.abs(f)) & (trial.size < size))
        damping[live] = np.where(better, np.where(damping[live] > FIRST, damping[live] / 10, 0.0), more)
        here.take(live[better], trial, better)
    return np.asarray(np.einsum("mij,mj->mi", basis, here.y).reshape(p.shape))


def derivatives(h: Array, p: Array) -> tuple[Array, Array, Array]:
    """I, (m,), dI/dP, (m, n d), and d2I/dP2, (m, n d, n d), of the values P, (m, n, d), h apart, (m, n-1)."""
    m, n, d = p.shape
    total = (h[..., None] * all_derivatives(p[:, :-1], p[:, 1:])).reshape(m, -1) @ assembly(n, d)
    return total[:, 0], total[:, 1 : 1 + n * d], total[:, 1 + n * d :].reshape(m, n * d, n * d)


@dataclass(frozen=True)
class _Points:
    """F, its gradient g with its size, and its Hessian at P = basis y of m maneuvers, with <P, c> and I."""

    y: Array
    work: Array
    impulse: Array
    f: Array
    g: Array
    size: Array
    hessian: Array

    @classmethod
    def of(cls, h: Array, basis: Array, c: Array, y: Array) -> _Points:
        p = np.einsum("mij,mj->mi", basis, y)
        impulse, gradient, hessian = derivatives(h, p.reshape(*h.shape[:1], h.shape[1] + 1, -1))
        curved = impulse[:, None, None] * hessian + gradient[:, :, None] * gradient[:, None, :]
        turned = np.swapaxes(basis, 1, 2)
        work = np.sum(c * p, axis=1)
        g = np.einsum("mji,mi->mj", turned, impulse[:, None] * gradient - c)
        return cls(y, work, impulse, 0.5 * impulse**2 - work, g, np.linalg.norm(g, axis=1), turned @ curved @ basis)

    def take(self, k: Index, other: _Points, which: Mask) -> None:
        """Those of the others that are marked, in place of the k-th."""
        for field in fields(self):
            getattr(self, field.name)[k] = getattr(other, field.name)[which]


def attained(nodal: Nodal, p: Array, idle: Mask) -> tuple[Array, Array]:
    """Peaks (m,) of Pontryagin's controls of the values P, (m, n, d), made exact, infinite where they miss even so; and
    how far beyond its tip each wall is passed, (m, q), where it is idle, (q,).
    """
    mass, h = nodal.mass, nodal.h[..., None]
    impulse, impulses, _ = derivatives(nodal.h, p)
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
        e = np.linalg.solve(nodal.masses(), nodal.forces(np.maximum(beyond, 0.0)) - m * impulses.reshape(p.shape))
        v, r = states(e)
        at = r[:, 1:-1] - mass.tips
        short = r[:, -1:] - mass.pf[:, None], v[:, -1:] - mass.vf[:, None], at - mass.windows.nearest(at)
        missed = np.concatenate(short, axis=1)
        upper = peak + np.max(norm(e), axis=1)
        lands = np.max(np.abs(missed), axis=(1, 2)) <= LANDED * (1 + peak)
    return np.where(lands & np.isfinite(upper), upper, np.inf), beyond
