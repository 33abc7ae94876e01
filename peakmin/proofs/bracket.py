"""A solver's answer becomes proved bounds. Solvers propose, arithmetic decides.

For fixed obstacle times the holds u, shape (steps, d), must satisfy A u = b with 2+q rows. Then

    any u, moved onto the equations by u - A'(A A')^-1 (A u - b), is a control: M <= gauge of it;
    any admissible multipliers L prove  M >= <L, b> / sum_k support((A' L)_k)   (weak duality),

whatever the solver that proposed them said of itself. A solver's multipliers of the circle constraints are the
costate p_k = (A' L)_k; L is fitted to them. (Its multipliers of the equations would be L itself, but cvxpy 1.9
returns equations of one problem with different signs.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np

from ..geometry.norm import ROUNDING
from ..spec.control_set import Disc, Polygon
from ..types import Array
from .double_integrator import PointMass, hold_rows

LANDED = 1e-10  # largest residual of A u = b, in units of the largest |b|, for u to count as a control


class Verdict(StrEnum):
    """What is proved about one M."""

    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Answer:
    """What a solver returned, in scaled units: a control and a costate, shape (steps, d), either or none."""

    control: Array | None = None
    costate: Array | None = None
    status: str = "no answer"


@dataclass(frozen=True)
class Bracket:
    """lower <= M <= upper (scaled), the control that attains `upper` and the multipliers that prove `lower`."""

    lower: float = 0.0
    upper: float = math.inf
    control: Array | None = None
    multipliers: Array | None = None

    @property
    def gap(self) -> float:
        """(upper - lower) / upper; 0 where upper is 0, 1 where nothing is proved."""
        if not math.isfinite(self.upper):
            return 1.0
        return max(self.upper - self.lower, 0.0) / self.upper if self.upper else 0.0

    def verdict(self, peak: float) -> Verdict:
        """Whether a control of this peak (scaled) is proved to exist, or proved not to."""
        if self.upper <= peak:
            return Verdict.FEASIBLE
        return Verdict.INFEASIBLE if self.lower > peak else Verdict.UNKNOWN


@dataclass(frozen=True)
class HoldProblem:
    """The finite problem at fixed obstacle times (q,) [scaled], on holds with the given edges (steps+1,)."""

    mass: PointMass
    circle: Disc | Polygon
    times: Array
    edges: Array

    @cached_property
    def rows(self) -> Array:
        """A, shape (2+q, steps)."""
        return hold_rows(self.edges, self.times)

    @cached_property
    def targets(self) -> Array:
        """b, shape (2+q, d), and what rounding may have done to it."""
        return np.stack([self.mass.targets(self.times), self.mass.target_errors(self.times)])

    def land(self, control: Array) -> Array | None:
        """The control closest to the given one that satisfies the equations; None where none does."""
        rows = self.rows
        size = np.linalg.norm(rows, axis=1, keepdims=True)  # rows near the ends of the time are tiny
        scaled = rows / size
        landed = control
        try:
            for _ in range(2):  # the second step removes the rounding error of the first
                moments = rows @ landed
                residual = self.mass.reached(self.times, moments) - moments
                landed = landed + np.linalg.lstsq(scaled, residual / size, rcond=None)[0]
        except np.linalg.LinAlgError:
            return None
        moments = rows @ landed
        residual = np.abs(self.mass.reached(self.times, moments) - moments)
        return landed if np.all(residual <= LANDED) else None

    def upper(self, control: Array) -> tuple[float, Array | None]:
        """Proved upper end and the control that attains it."""
        landed = self.land(control)
        if landed is None or not np.all(np.isfinite(landed)):
            return math.inf, None
        return float(np.max(self.circle.gauge(landed))), landed

    def fit(self, costate: Array) -> Array:
        """The multipliers L, shape (2+q, d), whose A' L is closest to the costate (steps, d)."""
        rows = self.rows
        size = np.linalg.norm(rows, axis=1)
        try:
            fitted = np.linalg.lstsq((rows / size[:, None]).T, costate, rcond=None)[0]
        except np.linalg.LinAlgError:
            return np.zeros((len(rows), costate.shape[-1]))
        return np.asarray(fitted / size[:, None])

    def lower(self, multipliers: Array) -> tuple[float, Array]:
        """Proved lower end and the admissible multipliers (2+q, d) that prove it; both signs are tried."""
        if not np.all(np.isfinite(multipliers)):
            return 0.0, np.zeros_like(multipliers)
        rows, (_, error_b) = self.rows, self.targets
        best, best_multipliers = 0.0, np.zeros_like(multipliers)
        # both signs, as solvers differ in theirs; the wrong one proves nothing and costs nothing
        for signed in (multipliers, -multipliers):
            mass = self.mass.facing_for(signed)
            trial, b = mass.admissible(signed / (np.max(np.abs(signed)) or 1.0)), mass.targets(self.times)
            size = np.abs(trial)
            work = np.sum(trial * b) - np.sum(size * (ROUNDING * np.abs(b) + error_b))
            if work <= 0:
                continue
            impulse = np.sum(self.circle.support(rows.T @ trial)) + ROUNDING * np.sum(np.abs(rows).T @ size)
            bound = float(work / (impulse * (1 + ROUNDING)))
            if bound > best:
                best, best_multipliers = bound, trial
        return best, best_multipliers

    def tighten(self, bracket: Bracket, answer: Answer) -> Bracket:
        """The bracket with whatever the answer proves; an end never moves without proof."""
        with np.errstate(all="ignore"):  # of absurd answers: what comes out not finite proves nothing
            if answer.control is not None and np.all(np.isfinite(answer.control)):
                upper, control = self.upper(answer.control)
                if upper < bracket.upper:
                    bracket = replace(bracket, upper=upper, control=control)
            if answer.costate is not None and np.all(np.isfinite(answer.costate)):
                bracket = self.raise_lower(bracket, self.fit(answer.costate))
            return bracket

    def raise_lower(self, bracket: Bracket, multipliers: Array) -> Bracket:
        """The bracket with the lower end that these multipliers, (2+q, d), prove, if that is higher."""
        lower, admissible = self.lower(multipliers)
        return replace(bracket, lower=lower, multipliers=admissible) if lower > bracket.lower else bracket

    def begin(self) -> Bracket:
        """What is proved before any solver was asked: all of it where coasting will do, else one equation at a time."""
        if self.mass.floor(self.times) == 0:
            d = len(self.mass.v0)
            return Bracket(0.0, 0.0, np.zeros((len(self.edges) - 1, d)), np.zeros((2 + self.mass.walls, d)))
        bracket = Bracket()
        for multipliers in self.mass.elementary(self.times):
            bracket = self.raise_lower(bracket, multipliers)
        return bracket
