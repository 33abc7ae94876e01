"""The optimum in continuous time for given obstacle times: max <P, c> / I(P), see `peakmin.proofs.nodal`.

The same maximum has  F(P) = I^2/2 - <P, c>,  whose gradient I grad I - c is what Pontryagin's control u = M p/|p|
misses of the equations of motion (I = M there). A clear wall's multiplier has f_j . l_j >= 0.

Newton's method does the rest. Where F has a kink at the optimum, p is zero along whole segments: there less than
M is needed, the control is not determined, and the least-peak control of that stretch by itself is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.costate import CostateTrajectory
from ..geometry.norm import norm
from ..spec.settings import Aligned
from ..types import Array, Mask
from .bounds import lower_bound, lower_bounds
from .bracket import Bracket
from .double_integrator import PointMass, costate_at_kinks, normalized
from .newton import newton
from .nodal import Nodal
from .primal import LANDED, attained, coasting, motion

A_FEW = 4  # Newton steps to multipliers that are good enough for a box of times
SILENT = 1e-3  # p below this share of its maximum at both ends of a segment: perhaps zero at the optimum
DEEPEST = 1  # silent stretches one in another that are looked for; each more multiplies the work
APART = 1e-9  # least distance of obstacle times from each other and the ends at which M* is evaluated
SETTLED = 1e-9  # relative gap at which nothing further is tried


@dataclass(frozen=True)
class Extremal:
    """The best that is known at fixed obstacle times [scaled]: lower <= M* <= upper.

    multipliers: L, shape (2+q, d), which prove `lower`;  motion: a trajectory [scaled] of peak `upper`.
    """

    lower: float
    upper: float
    multipliers: Array
    motion: CostateTrajectory

    @property
    def gap(self) -> float:
        """(upper - lower) / upper."""
        if not math.isfinite(self.upper):
            return 1.0
        return max(self.upper - self.lower, 0.0) / self.upper if self.upper else 0.0

    @property
    def bracket(self) -> Bracket:
        """The two ends as a bracket, without a hold control."""
        return Bracket(self.lower, self.upper, None, self.multipliers)


def far_apart(times: Array) -> bool:
    """Whether M* can be evaluated at these times, (q,): in a box at an end, or of times that coincide, it cannot."""
    return bool(np.all(np.diff(np.concatenate([[0.0], times, [1.0]])) >= 0.5 * APART))


def extremal(mass: PointMass, times: Array, start: Array | None = None, depth: int = 0) -> Extremal:
    """The least peak at given obstacle times, its multipliers and its control in closed form.

    Always returns: where Newton's method does not settle, with the best multipliers and the honest gap.

    Args:
        mass: the maneuver in scaled units.
        times: strictly increasing in (0, 1), shape (q,).
        start: multipliers (2+q, d) to start from; default those of the control of least energy.
        depth: how many silent stretches this one lies in.
    """
    if np.any(np.isfinite(mass.width)):
        return _through(mass, times, start, depth)
    nodal = Nodal(mass, np.concatenate([[0.0], times, [1.0]]))
    n = len(nodal.kinks)
    if mass.floor(times) == 0:
        return Extremal(0.0, 0.0, np.zeros((n, len(mass.v0))), coasting(nodal))
    p = nodal.least_energy() if start is None else costate_at_kinks(normalized(start), times)[1]
    best = _from(nodal, p, depth)
    if start is None and best.gap > SETTLED:
        # one equation may decide alone, with p silent wherever it does not look
        single = max(mass.elementary(times), key=lambda multipliers: lower_bound(mass, times, multipliers))
        best = _join(best, _from(nodal, costate_at_kinks(single, times)[1], depth))
    return best


def _through(mass: PointMass, times: Array, start: Array | None, depth: int) -> Extremal:
    """`extremal` through openings: each is one of its two walls, and which one the path past the others shows."""
    narrow = np.isfinite(mass.width)
    far = np.zeros(mass.walls, dtype=bool)
    if start is not None:
        far = (mass.windows.along(start[2:]) < 0) & narrow
    best: Extremal | None = None
    tried: set[bytes] = set()
    while far.tobytes() not in tried:
        tried.add(far.tobytes())
        found = extremal(mass.facing(far), times, start, depth)
        at = mass.windows.along(found.motion.position(times) - mass.tips)
        over, under = (at > mass.width + LANDED) & narrow, (at < -LANDED) & narrow
        free = not np.any(over | under)
        found = found if free else replace(found, upper=math.inf)
        best = found if best is None else _join(best, found)
        if free:
            return best
        far = (far & ~under) | over
    assert best is not None
    # walls that play against each other: the tips that were missed, touched
    windows = replace(mass.windows.facing(over), clear=mass.clear & ~(over | under))
    touched = extremal(replace(mass, windows=windows), times, depth=depth)
    at = mass.windows.along(touched.motion.position(times) - mass.tips)
    if not np.any(narrow & ((at > mass.width + LANDED) | (at < -LANDED))):
        best = _join(best, replace(touched, lower=0.0))
    return best


def _from(nodal: Nodal, p: Array, depth: int) -> Extremal:
    """The best that Newton's method reaches from the nodal values p, with and without silent stretches."""
    silent = np.zeros(len(p), dtype=bool)
    p, best = _with_walls(nodal, p, silent, depth)
    for _ in range(2 if depth < DEEPEST else 0):
        size = norm(p)
        small = size < SILENT * np.max(size)
        runs = small[:-1] & small[1:]
        quiet = np.r_[runs, False] | np.r_[False, runs]
        if best.gap <= SETTLED or not np.any(quiet & ~silent):
            break
        silent = quiet
        p, found = _with_walls(nodal, p, silent, depth)
        best = _join(best, found)
    return best


def ascend(mass: PointMass, times: Array) -> Array:
    """Good multipliers, shape (2+q, d), at these times without their motion: a fraction of the work of `extremal`."""
    nodal = Nodal(mass, np.concatenate([[0.0], times, [1.0]]))
    none = np.zeros(len(nodal.kinks), dtype=bool)
    idle = np.zeros(mass.walls, dtype=bool)
    p = nodal.least_energy()
    for _ in range(2):
        p = newton(nodal, p, nodal.basis(idle, none), steps=A_FEW)
        pulls = mass.clear & (mass.windows.along(nodal.multipliers(p)[2:]) < 0)
        if not np.any(pulls & ~idle):
            break
        idle = idle | pulls
    return nodal.multipliers(p)


def _join(one: Extremal, other: Extremal) -> Extremal:
    """The better end of each."""
    upper = one if one.upper <= other.upper else other
    lower = one if one.lower >= other.lower else other
    return replace(upper, lower=lower.lower, multipliers=lower.multipliers)


def extremal_or_proposed(mass: PointMass, times: Array, propose: Callable[[Array], Bracket]) -> Extremal:
    """`extremal`, started again from a conic solver's multipliers where it does not settle by itself.

    Where that does not settle either, the solver's own holds are taken if their peak is less.

    Args:
        propose: gives the bracket of a hold program on the aligned grid at scaled times.
    """
    best = extremal(mass, times)
    if best.gap <= SETTLED:
        return best
    proposed = propose(times)
    if proposed.multipliers is not None:
        best = _join(best, extremal(mass, times, mass.admissible(proposed.multipliers)))
    if proposed.control is not None and proposed.upper < best.upper:
        u = proposed.control
        nodes = Aligned(steps=len(u)).edges(times)
        held = CostateTrajectory.holding(nodes, u, mass.v0)
        best = _join(best, replace(best, upper=held.peak(), motion=held))
    return best


def _with_walls(nodal: Nodal, p: Array, silent: Mask, depth: int) -> tuple[Array, Extremal]:
    """Newton's method with the clear walls sorted into those that push and those that are passed beyond."""
    mass = nodal.mass
    idle = np.zeros(mass.walls, dtype=bool)
    seen: set[bytes] = set()
    nearest, best = p, None
    while idle.tobytes() not in seen:
        seen.add(idle.tobytes())
        trial = newton(nodal, p, nodal.basis(idle, silent))
        found, beyond = assemble(nodal, trial, silent, idle, depth)
        if best is None or found.gap < best.gap:
            nearest = trial
        best = found if best is None else _join(best, found)
        push = mass.windows.along(nodal.multipliers(trial)[2:])
        idle = mass.clear & np.where(idle, beyond >= 0, push < 0)
    assert best is not None
    return nearest, best


def assemble(nodal: Nodal, p: Array, silent: Mask, idle: Mask, depth: int = 0) -> tuple[Extremal, Array]:
    """Both ends from the nodal values p, shape (n, d), and how far beyond its tip each idle wall is passed."""
    times, mass = nodal.kinks[1:-1], nodal.mass
    multipliers = nodal.multipliers(p)
    work = float(np.sum(p * nodal.forces(np.zeros(mass.walls))))
    impulse, impulses = nodal.derivatives(p)
    peak = max(work, 0.0) / (float(impulse) or 1.0)

    def fill(part: PointMass, at: Array) -> CostateTrajectory:
        return extremal(part, at, depth=depth + 1).motion

    try:
        made, beyond = motion(nodal, p, silent, peak, impulses, idle, fill)
    except np.linalg.LinAlgError:
        made, beyond = None, np.full(mass.walls, -np.inf)
    lower = lower_bound(mass, times, multipliers)
    if made is None:
        return Extremal(lower, math.inf, multipliers, coasting(nodal)), beyond
    return Extremal(lower, made.peak(), multipliers, made), beyond


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
    p, idle, left = every.least_energy(), np.zeros((m, q), dtype=bool), np.arange(m)
    for _ in range(1 + q):
        following = idle.copy()
        for walls in np.unique(idle[left], axis=0):
            k = left[np.all(idle[left] == walls, axis=1)]
            nodal = every.part(k)
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
