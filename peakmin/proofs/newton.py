"""Newton's method for the nodal values P at which  F(P) = I^2/2 - <P, c>  is least, see `peakmin.proofs.nodal`.

Over the span of a basis B, P = B y, with

    g = B'(I grad I - c)     H = B'(grad I grad I' + I hess I) B     (H + damping mean(diag H) 1) step = -g,

y becomes y + step where that lowers F, or |g| while F stands still; elsewhere the damping is raised. All maneuvers of a
stack take their steps at the same time, each with a damping of its own, until there is no gradient left, F is at a
kink, or no damping helps. One maneuver is a stack of one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..types import Array, Index, Mask
from .nodal import Kernel, Nodal

STEPS = 60
TRIES = 40  # dampings of one step
DAMPED = 1e-12  # the least damping; the next is ten times as large
FLAT = 1e-15  # |g| of the size of c that is none
STILL = 1e-13  # change of F, relative, that is none
PATIENCE = 5  # steps without progress, in F and in its gradient, that mean a kink, where no gradient vanishes
SLOW, SHARE = 1e-3, 0.5  # progress in so many steps: a change of F, relative, or |g| down to this share


def newton(nodal: Nodal, p: Array, basis: Array | None, steps: int = STEPS) -> Array:
    """Values P, (..., n, d), where F is about least over the span of a basis, from the projection of p.

    Args:
        nodal: one maneuver or stacked ones.
        p: where to begin, (..., n, d).
        basis: orthonormal columns, (..., n d, k); None where all values may change.
        steps: not more of them.
    """
    n, d = p.shape[-2:]
    c = nodal.forces(np.zeros(nodal.mass.walls)).reshape(-1, n * d)
    span = None if basis is None else basis.reshape(len(c), n * d, -1)
    space = _Space(nodal.h.reshape(-1, n - 1), c, span, nodal.kernel)
    here = space.at(space.projected(p.reshape(c.shape)))
    if (lost := here.lost).any():
        here = space.at(np.where(lost[:, None], space.projected(nodal.least_energy().reshape(c.shape)), here.y))
        lost = here.lost
    # the best multiple of the start
    multiple = here.work / np.where(lost, 1.0, here.impulse) ** 2
    here = space.at(here.y * np.where(lost, 1.0, multiple)[:, None])
    y, live = here.y.copy(), np.flatnonzero(~lost)
    descent = _Descent(space, here).part(live)
    while len(live):
        done = descent.step(steps)
        if done.any():
            y[live[done]] = descent.best[done]
            live, descent = live[~done], descent.part(np.flatnonzero(~done))
    return space.values(y).reshape(p.shape)


@dataclass(frozen=True)
class _Points:
    """F, its gradient g with its size, and its Hessian at P = B y of m maneuvers, with <P, c> and I."""

    y: Array
    work: Array
    impulse: Array
    f: Array
    g: Array
    size: Array
    hessian: Array

    @property
    def lost(self) -> Mask:
        """Where no multiple of P is better than nothing, (m,)."""
        return np.asarray((self.work <= 0) | (self.impulse == 0))

    def part(self, k: Index) -> _Points:
        return _Points(*(getattr(self, field.name)[k] for field in fields(self)))


@dataclass(frozen=True)
class _Space:
    """The spans (m, n d, k) of m maneuvers, with their h (m, n-1) and c (m, n d); None for the whole."""

    h: Array
    c: Array
    basis: Array | None
    kernel: Kernel

    def part(self, k: Index) -> _Space:
        return _Space(self.h[k], self.c[k], None if self.basis is None else self.basis[k], self.kernel)

    def values(self, y: Array) -> Array:
        """P = B y, (m, k) -> (m, n d)."""
        return y if self.basis is None else np.asarray((self.basis @ y[..., None])[..., 0])

    def projected(self, p: Array) -> Array:
        """B'P, (m, n d) -> (m, k)."""
        return p if self.basis is None else np.asarray((np.swapaxes(self.basis, 1, 2) @ p[..., None])[..., 0])

    def at(self, y: Array) -> _Points:
        p = self.values(y)
        impulse, gradient, hessian = self.kernel(self.h, p)
        work = np.vecdot(self.c, p)
        g = self.projected(impulse[:, None] * gradient - self.c)
        curved = gradient[:, :, None] * gradient[:, None, :] + impulse[:, None, None] * hessian
        if self.basis is not None:
            curved = np.swapaxes(self.basis, 1, 2) @ curved @ self.basis
        return _Points(y, work, impulse, 0.5 * impulse**2 - work, g, np.sqrt(np.vecdot(g, g)), curved)


class _Descent:
    """m maneuvers on their way: where they are, the best of where they were, and by how much they are damped."""

    def __init__(self, space: _Space, here: _Points) -> None:
        self.space, self.here = space, here
        self.best, self.least = here.y, here.size
        self.flat = FLAT * np.sqrt(np.vecdot(space.c, space.c))
        self.damping = self.tries = self.taken = np.zeros(len(here.y))
        self.rounds, self.damped = 0, False
        self.past: list[tuple[Array, Array]] = []  # F and |g| up to PATIENCE steps before

    def part(self, k: Index) -> _Descent:
        """Some of them."""
        if len(k) == len(self.best):
            return self
        out = _Descent(self.space.part(k), self.here.part(k))
        out.best, out.least = self.best[k], self.least[k]
        out.damping, out.tries, out.taken = self.damping[k], self.tries[k], self.taken[k]
        out.rounds, out.damped = self.rounds, self.damped
        out.past = [(f[k], size[k]) for f, size in self.past]
        return out

    def step(self, steps: int) -> Mask:
        """One step of each, where it is better; which are done, (m,)."""
        here, y, self.rounds = self.here, self._tried(), self.rounds + 1
        stuck = (y == here.y).all(axis=1)  # a larger damping changes nothing either
        if stuck.all():
            return np.asarray(stuck)
        trial = self.space.at(y)
        better = trial.f < here.f
        if not better.all():
            # close to the optimum F stands still in its last digits while its gradient still falls
            better |= (trial.f <= here.f + STILL * np.abs(here.f)) & (trial.size < here.size)
        gone = _Either(better)
        if not gone.all:
            self._raise(~better)
        if self.damped and not gone.none:
            self.damping = np.where(better, np.where(self.damping > DAMPED, self.damping / 10, 0.0), self.damping)
            self.tries = np.where(better, 0, self.tries)
            self.damped = bool(self.damping.any())
        self.here, self.taken = gone.points(trial, here), self.taken + better
        before = [*self.past, (here.f, here.size)]
        if not gone.all:
            none = np.full_like(here.f, np.inf)
            pairs = zip(before, [(none, none), *self.past], strict=True)
            before = [(gone(f, a), gone(size, b)) for (f, size), (a, b) in pairs]
        self.past = before[-PATIENCE:]
        here = self.here
        nearer = _Either(here.size < self.least)
        self.best, self.least = nearer(here.y, self.best), nearer(here.size, self.least)
        return np.asarray(better & self._settled(steps) | stuck | (self.tries >= TRIES))

    def _settled(self, steps: int) -> Mask:
        """Where there is no gradient left, or no progress, or no step."""
        here = self.here
        done = here.size <= self.flat
        if len(self.past) == PATIENCE:
            f, size = self.past[0]
            done |= (f - here.f < SLOW * np.abs(here.f)) & (here.size > SHARE * size)
        return np.asarray(done | (self.taken >= steps) if self.rounds >= steps else done)

    def _tried(self) -> Array:
        """y - (H + damping mean(diag H) 1)^-1 g, (m, k), with more damping where the matrix is singular."""
        y, g, hessian = self.here.y, self.here.g, self.here.hessian
        for _ in range(TRIES):
            damped = hessian
            if self.damped:
                mean = np.trace(hessian, axis1=1, axis2=2) / g.shape[1]
                damped = hessian + (self.damping * mean)[:, None, None] * np.eye(g.shape[1])
            try:
                return np.asarray(y - np.linalg.solve(damped, g[..., None])[..., 0])
            except np.linalg.LinAlgError:
                self._raise(np.array([_singular(matrix) for matrix in damped]))
        return y

    def _raise(self, which: Mask) -> None:
        """More damping where marked, (m,)."""
        self.damping = np.where(which, np.maximum(10 * self.damping, DAMPED), self.damping)
        self.tries, self.damped = self.tries + which, True


def _singular(matrix: Array) -> bool:
    try:
        np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return True
    return False


class _Either:
    """Rows of one array where marked, (m,), and of another elsewhere; mostly it is all of one of them."""

    def __init__(self, which: Mask) -> None:
        self.which, self.all = which, bool(which.all())
        self.none = not self.all and not which.any()

    def __call__(self, a: Array, b: Array) -> Array:
        if self.all or self.none:
            return a if self.all else b
        return np.where(self.which.reshape(-1, *(1,) * (a.ndim - 1)), a, b)

    def points(self, a: _Points, b: _Points) -> _Points:
        if self.all or self.none:
            return a if self.all else b
        return _Points(*(self(getattr(a, field.name), getattr(b, field.name)) for field in fields(a)))
