"""Sequential convex programming over the joints' motion: one planner for every arm, with all of its limits.

About the motion before, what is not linear is linear within a trust region that grows and shrinks with the ratio of the
true to the promised gain. The merit is the program's cost with nothing linearised:

    M(q) + mu sum_holds(the largest torque's excess + the largest distance's)

or, where a peak is given that may be taken, that with the largest |tau_1| in place of M and what is above that peak
among what is not kept. A motion that comes out keeps nothing by promise: the plan's own checks, which hold between
instants too, decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..deadline import over
from ..geometry.norm import norm
from ..programs.joint_step import SHARES, JointStep, Limits, Linear, by_hold
from ..robots.dynamics import PlanarRobot
from ..robots.joint_motion import JointMotion
from ..robots.separation import NEAREST, apart, convex_pieces
from ..robots.workspace import Workspace
from ..types import Array

TRUST, MOST_TRUST, LEAST_TRUST = 0.4, 2.0, 1e-5  # rad
STEPS = 60  # programs for one start
CALM = 3e-5  # of the peak: what changes of speeds and accelerations cost, squared, so that idle joints stay calm
ENOUGH = 1e-4  # relative: a promised gain below which a motion is as good as it gets
NOTHING = 1e-9  # [scaled] of what is not kept
COST = 20.0  # of what is not kept, relative to the peak
LOOKS = 9  # instants of each hold at which distances are looked at that a program sees in the middle
INSIDE = 1e-6  # relative: by which limits are drawn in, for what bends between nodes and for rounding


@dataclass
class JointSearch:
    """The planner of one arm on N holds, all of it scaled: duration 1, lengths by the arm's, masses by its own.

    limits: in SI units;  room: that links keep beyond their margin [m], always or on each hold (N,);  count: programs
    solved;  programs: those that are compiled, by their number of holds, by which limits there are and by what is made
    least;  peak: that may be taken [m/s^2], the base moment is made least then.
    """

    workspace: Workspace
    duration: float
    limits: Limits
    holds: int
    until: float = math.inf
    room: float | Array = 0.0
    count: int = 0
    programs: dict[tuple[object, ...], JointStep] = field(default_factory=dict)
    peak: float | None = None

    @cached_property
    def robot(self) -> PlanarRobot:
        return PlanarRobot(self.workspace.chain)

    @cached_property
    def _unit(self) -> float:
        """Of accelerations [m/s^2]."""
        return self.workspace.size / self.duration**2

    @cached_property
    def _torque(self) -> float:
        """Of torques [N m]."""
        return self.workspace.chain.total * self.workspace.size * self._unit

    @cached_property
    def _pieces(self) -> list[Array]:
        return [piece for corners in self.workspace.obstacles for piece in convex_pieces(corners)]

    @cached_property
    def _scaled(self) -> Limits:
        T, one = self.duration, self.limits
        return Limits(
            one.low + INSIDE,
            one.high - INSIDE,
            one.speed * T * (1 - INSIDE),
            one.acceleration * T**2 * (1 - INSIDE),
            one.torque / self._torque * (1 - 1e3 * INSIDE),
        )

    @cached_property
    def _program(self) -> JointStep:
        n, finite, moment = self.robot.joints, self._scaled.finite, self.peak is not None
        known = self.programs.get((self.holds, finite, moment))
        if known is None:
            rows = n * min(len(self._pieces), NEAREST) + len(self.workspace.pairs)
            known = self.programs[self.holds, finite, moment] = JointStep(n, 2, self.holds, rows, finite, moment)
        return known

    @cached_property
    def _ends(self) -> Array:
        """What the last speed and angles are of the accelerations, (2, N)."""
        h = 1.0 / self.holds
        return np.stack([np.full(self.holds, h), h * h * (self.holds - np.arange(self.holds) - 0.5)])

    def states(self, begin: Array, held: Array) -> tuple[Array, Array]:
        """q and q' at the nodes [scaled], (N+1, n) each."""
        h = 1.0 / self.holds
        v = np.vstack([np.zeros_like(begin), np.cumsum(h * held, axis=0)])
        return np.vstack([begin, begin + np.cumsum(h * (v[:-1] + h / 2 * held), axis=0)]), v

    def landed(self, begin: Array, goal: Array, held: Array) -> Array:
        """The accelerations nearest to these that lead from rest to rest."""
        missing = np.stack([np.zeros_like(begin), goal - begin]) - self._ends @ held
        return np.asarray(held + np.linalg.lstsq(self._ends, missing, rcond=None)[0])

    def along(self, way: Array) -> Array:
        """The accelerations (N, n) about along configurations at the nodes (N+1, n), smooth, from rest to rest."""
        h, N = 1.0 / self.holds, self.holds
        k = np.arange(N + 1)[:, None] - np.arange(N)[None]
        reached = np.where(k > 0, h * h * (k - 0.5), 0.0)
        smooth = 3e-3 * h * np.diff(np.eye(N), axis=0)
        held = np.linalg.lstsq(
            np.vstack([reached, smooth]), np.vstack([way - way[0], np.zeros((N - 1, way.shape[1]))]), rcond=None
        )[0]
        return self.landed(way[0], way[-1], held)

    def _linear(self, begin: Array, held: Array, derivatives: bool = True) -> Linear:
        q, v = self.states(begin, held)
        h, n, unit = 1.0 / self.holds, self.robot.joints, self.workspace.size
        limited = self.peak is not None or np.any(np.isfinite(self.limits.torque))
        u, u_by, tau, tau_by = [], [], [], []
        for share in SHARES:
            s = share * h
            at = (q[:-1] + s * (v[:-1] + s / 2 * held), v[:-1] + s * held, held)
            u.append(self.robot.acceleration(at) / unit)
            tau.append(
                self.robot.torques(at) / (self.workspace.chain.total * unit**2) if limited else np.zeros_like(held)
            )
            if derivatives:
                u_by.append(by_hold(self.robot.acceleration_by(at) / unit, share, h, n))
                if limited:
                    by = self.robot.torques_by(at) / (self.workspace.chain.total * unit**2)
                    tau_by.append(by_hold(by, share, h, n))
                else:
                    tau_by.append(np.zeros((*held.shape, 3 * n)))
        apart, apart_by = self._apart(q[:-1] + h / 2 * (v[:-1] + h / 4 * held), h)
        if not derivatives:
            return Linear(np.array(u), np.zeros(0), np.array(tau), np.zeros(0), apart, apart_by)
        return Linear(np.array(u), np.array(u_by), np.array(tau), np.array(tau_by), apart, apart_by)

    def _apart(self, q: Array, h: float) -> tuple[Array, Array]:
        """Distances of links from the nearest pieces, then from each other, less what is to be kept, at the middles of
        the holds.
        """
        space = self.workspace
        rows, by_q = apart(space.chain, q, self._pieces, space.margin, space.pairs, space.self_margin or 0.0)
        return (rows - self.room) / space.size, by_hold(by_q / space.size, 0.5, h, self.robot.joints)

    def short(self, begin: Array, held: Array) -> Array:
        """What is missing of distances from obstacles and of links from each other on each hold [m], (2, N)."""
        q, v = self.states(begin, held)
        s = np.linspace(0, 1, LOOKS)[:, None, None] / self.holds
        theta, workspace = np.cumsum(q[:-1] + s * (v[:-1] + s / 2 * held), axis=-1), self.workspace
        out = [np.full((1, self.holds, 1), -np.inf)] * 2
        if workspace.obstacles:
            out = [workspace.margin - workspace.clearance(theta), *out[1:]]
        if workspace.pairs:
            out = [*out[:1], (workspace.self_margin or 0.0) - workspace.apart(theta)]
        return np.stack([np.max(one, axis=-1).max(axis=0) for one in out])

    def _merit(self, about: Linear) -> tuple[float, float]:
        """What is made least, and what is not kept."""
        over_torque = np.max(np.abs(about.tau) / self._scaled.torque - 1, axis=(0, 2), initial=0.0)
        missing, u = float(np.sum(over_torque) + np.sum(np.max(-about.apart, axis=0, initial=0.0))), norm(about.u)
        if self.peak is None:
            return float(np.max(u)), missing
        over_peak = np.max(u - self.peak / self._unit, axis=0, initial=0.0)
        return float(np.max(np.abs(about.tau[..., 0]))), missing + float(np.sum(over_peak))

    def improved(self, begin: Array, held: Array, cost: float, best: float = 0.0, steps: int = STEPS) -> Array:
        """What steps make of the accelerations [scaled] (N, n), as long as their gain is worth it.

        Args:
            cost: mu;  best: what no motion is below [scaled];  steps: how many at most.
        """
        trust, about, allowed = TRUST, self._linear(begin, held), (self.peak or math.inf) / self._unit
        least, missing = self._merit(about)
        for _ in range(steps):
            if over(self.until) or trust < LEAST_TRUST:
                break
            q, v = self.states(begin, held)
            self.count += 1
            calm, known = CALM * least, (q, v, held)
            step = self._program.solve(known, about, self._scaled, trust, cost, self.until, allowed, calm)
            if step is None:
                trust *= 0.4
                continue
            trial = self.landed(begin, q[-1], step[0])
            now = self._linear(begin, trial, derivatives=False)
            new_least, new_missing = self._merit(now)
            promised = least + cost * missing - step[1]
            gained = least + cost * missing - new_least - cost * new_missing
            if promised <= (0.1 * cost * missing if missing > NOTHING else ENOUGH * least):
                break
            if gained > 0.1 * promised:
                held, about, least, missing = trial, self._linear(begin, trial), new_least, new_missing
            if gained > 0.6 * promised:
                trust = min(2 * trust, MOST_TRUST)
            elif gained < 0.2 * promised:
                trust *= 0.4
            if missing == 0 and least <= best * (1 + ENOUGH):
                break
        return held

    def motion(self, begin: Array, held: Array) -> JointMotion:
        """In SI units."""
        nodes = np.linspace(0, self.duration, self.holds + 1)
        return JointMotion(self.workspace.chain, nodes, held / self.duration**2, begin)

    def moment(self, begin: Array, held: Array) -> float:
        """The largest |tau_1| [scaled] at the instants looked at."""
        about = replace(self, peak=math.inf)._linear(begin, held, derivatives=False)
        return float(np.max(np.abs(about.tau[..., 0])))

    def score(self, begin: Array, held: Array) -> tuple[float, float]:
        """M [m/s^2] and what is not kept, at the instants looked at."""
        peak, missing = self._merit(self._linear(begin, held, derivatives=False))
        return peak * self._unit, missing


def bang(s: Array) -> Array:
    """Half of the time faster and faster, half slower."""
    return np.where(s < 0.5, 2 * s * s, 1 - 2 * (1 - s) ** 2)
