"""Spec to cvxpy: each program is compiled once; afterwards only `M` and `obstacle_times` are set.

Both programs hold unit controls v = u / M in the circle's shape and scale the equations by kappa = 1 / M:

    v_k in shape,    A(T) v = kappa b(T)      (clear walls: + s_i f_i, s_i >= 0)

With kappa a parameter this is the paper's feasibility problem; with kappa a variable to be maximised it is
`direct`: no dense column for M, and v = 0 is always feasible. Rows depend on the obstacle times T:

    uniform   one row of numbers per wall, a parameter of length `steps`;
    aligned   per segment j of length h_j = T_{j+1} - T_j, with N_j holds, only the two sums
              P_j = sum_k (N_j - k - 1/2) v_k / N_j^2 and S_j = sum_k v_k / N_j occur:
              r_{j+1} = r_j + h_j (V_j + h_j P_j),   V_{j+1} = V_j + h_j S_j,
              affine in h_j once a_j = h_j P_j is a variable. r and V are seen from the start as it moves on, so
              that r_j = kappa b_j and the size of the velocities does not matter.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self, TypeVar

import numpy as np

from ..deadline import left
from ..errors import NotDPPError, SpecError
from ..proofs.bracket import Answer
from ..proofs.double_integrator import PointMass, hold_rows
from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.settings import Aligned, Uniform
from ..types import Array, Json
from .convex import cp, silence_highs

# Tighter than the solvers' defaults: the proofs take what accuracy there is and a bracket shows what is missing.
OPTIONS: dict[str, Json] = {
    "CLARABEL": {
        "tol_gap_abs": 1e-9,
        "tol_gap_rel": 1e-9,
        "tol_feas": 1e-9,
        "accept_unknown": True,
        # A third of the time for the same brackets: what refinement would gain, landing gives anyway.
        "iterative_refinement_enable": False,
        "equilibrate_max_iter": 2,
        "presolve_enable": False,
    },
    # for the few problems that need what was left out above
    "CLARABEL CAREFUL": {"tol_gap_abs": 1e-9, "tol_gap_rel": 1e-9, "tol_feas": 1e-9, "accept_unknown": True},
    "HIGHS": {},
    "OSQP": {"eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 40_000, "polishing": True},
    "SCS": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iters": 20_000},
}
LIMITS = {"SCS": "time_limit_secs"}  # what else solvers call their `time_limit`
MOST = 8  # programs that are kept; one of 20,000 holds takes some 100 MB
LEAST_TIME = 0.1  # s: a solver is given no less, so that there is an answer at all


@dataclass
class Count:
    """How much work the programs did."""

    compilations: int = 0
    solves: int = 0


def hold_constraints(circle: Disc | Polygon, v: cp.Variable) -> list[cp.Constraint]:
    """cvxpy constraints that hold each row of v, (steps, d), in the shape: |v_k| <= 1, or a_j . v_k <= inradius."""
    if circle.kind == "disc":
        return [cp.SOC(np.ones(v.shape[0]), v, axis=1)]
    return [v @ circle.normals.T <= circle.inradius]


def hold_costate(circle: Disc | Polygon, constraints: list[cp.Constraint]) -> Array | None:
    """The p_k that the solved constraints' multipliers stand for, shape (steps, d), up to its sign."""
    dual = constraints[0].dual_value
    if circle.kind == "disc":
        return None if dual is None or dual[1] is None else np.reshape(dual[1], (np.size(dual[0]), -1))
    return None if dual is None else np.asarray(dual @ circle.normals)


def options_of(solver: str, until: float = math.inf) -> Json:
    """A solver's options, which end it at the deadline."""
    limit = {LIMITS.get(solver, "time_limit"): max(left(until), LEAST_TIME)} if math.isfinite(until) else {}
    return OPTIONS[solver] | limit


def structure(maneuver: Maneuver) -> tuple[bytes, ...]:
    """What of a maneuver is compiled into its programs: the walls' directions, contacts and which have an opening.

    All else (states, tips, widths, duration, mass) enters by parameters.
    """
    mass = PointMass.of(maneuver)
    return mass.free.tobytes(), mass.clear.tobytes(), np.isfinite(mass.width).tobytes()


class _Program(ABC):
    """What both programs share: v, the obstacle times, the compiled problem, the reading of answers."""

    def __init__(
        self, maneuver: Maneuver, circle: Disc | Polygon, grid: Uniform | Aligned, count: Count | None = None
    ) -> None:
        self.maneuver, self.circle, self.grid = maneuver, circle, grid
        self.mass = PointMass.of(maneuver)
        self.count = count or Count()
        self.obstacle_times: cp.Parameter | None = (
            cp.Parameter(self.mass.walls, name="obstacle_times", pos=True) if self.mass.walls else None
        )
        self.v: cp.Variable = cp.Variable((grid.steps, self.mass.dimension), name="v")
        self.problem: cp.Problem
        self._bound: list[cp.Constraint] = hold_constraints(self.circle, self.v)
        self._per_solver: Json = {}

    def turn_to(self, maneuver: Maneuver, count: Count) -> None:
        """Ask of another maneuver of the same `structure`; nothing is compiled again.

        Args:
            count: where the work from here on is counted.
        """
        self.maneuver, self.mass, self.count = maneuver, PointMass.of(maneuver), count

    def _scaled_times(self) -> Array:
        """The placed obstacle times. Raises `SpecError` unless they increase strictly inside the duration."""
        if self.obstacle_times is None:
            return np.zeros(0)
        asked = np.asarray(self.obstacle_times.value, dtype=float)
        if not np.all(np.diff([0.0, *asked, self.mass.time]) > 0):
            raise SpecError(f"obstacle_times: was {asked.tolist()}, must increase strictly from 0 to {self.mass.time}")
        return self.grid.place(asked / self.mass.time)

    def _build(
        self, objective: cp.Minimize | cp.Maximize, kappa: cp.Variable | float, size: Callable[[], float | None]
    ) -> None:
        """The problem with targets kappa * (b(T) * size()); the second factor is a parameter that follows T."""

        def targets() -> Array | None:
            value = size()
            return None if value is None else self.mass.targets(self._scaled_times()) * value

        aligned = isinstance(self.grid, Aligned)
        moments = self._segments(kappa, size, targets) if aligned else self._rows(kappa, size, targets)
        self.problem = cp.Problem(objective, self._bound + moments)
        if not self.problem.is_dcp(dpp=True):
            raise NotDPPError(f"{type(self).__name__} on {self.circle} and {self.grid} is not DPP")

    def _rows(
        self, kappa: cp.Variable | float, size: Callable[[], float | None], targets: Callable[[], Array | None]
    ) -> list[cp.Constraint]:
        q, edges = self.mass.walls, self.grid.edges(np.zeros(0))

        def norms() -> Array:  # rows of length one, or first-order solvers stall
            return np.asarray(np.linalg.norm(hold_rows(edges, self._scaled_times()), axis=1, keepdims=True))

        def unit_targets() -> Array | None:
            value = targets()
            return None if value is None else value / norms()

        def walls_rows() -> Array:
            return np.asarray((hold_rows(edges, self._scaled_times()) / norms())[2:])

        b = cp.CallbackParam(unit_targets, (2 + q, self.mass.dimension))
        fixed = hold_rows(edges, np.zeros(0))
        ends = (fixed / np.linalg.norm(fixed, axis=1, keepdims=True)) @ self.v == kappa * b[:2]
        if not q:
            return [ends]
        beyond, slack = self._beyond(kappa, size, lambda: 1 / norms()[2:, 0])
        walls = cp.CallbackParam(walls_rows, (q, self.grid.steps)) @ self.v == kappa * b[2:] + beyond
        return [ends, walls, *slack]

    def _beyond(
        self, kappa: cp.Variable | float, size: Callable[[], float | None], per_row: Callable[[], Array]
    ) -> tuple[cp.Expression, list[cp.Constraint]]:
        """s_i f_i of the clear walls, shape (q, 2), with 0 <= s_i <= kappa * size() * width_i per row."""
        if not np.any(self.mass.clear):
            return np.zeros((self.mass.walls, self.mass.dimension)), []
        s = cp.Variable(int(np.sum(self.mass.clear)), name="s")
        select = np.eye(self.mass.walls)[:, self.mass.clear]
        slack = [s >= 0]
        narrow = np.flatnonzero(np.isfinite(self.mass.width[self.mass.clear]))
        if len(narrow):

            def widths() -> Array | None:
                value = size()
                return (
                    None
                    if value is None
                    else np.asarray((self.mass.width * per_row())[self.mass.clear][narrow] * value)
                )

            slack.append(s[narrow] <= kappa * cp.CallbackParam(widths, (len(narrow),)))
        return cp.multiply(
            select @ cp.reshape(s, (s.size, 1), order="C") @ np.ones((1, self.mass.dimension)), self.mass.free
        ), slack

    def _segments(
        self, kappa: cp.Variable | float, size: Callable[[], float | None], targets: Callable[[], Array | None]
    ) -> list[cp.Constraint]:
        # in the frame that moves with the start's velocity: there a wall point is its target, whatever the speeds
        q = self.mass.walls
        beyond, constraints = self._beyond(kappa, size, lambda: np.ones(q))
        b = cp.CallbackParam(targets, (2 + q, self.mass.dimension))
        points = [np.zeros(self.mass.dimension), *(kappa * b[2 + i] + beyond[i] for i in range(q)), kappa * b[0]]
        speeds = [np.zeros(self.mass.dimension), *(cp.Variable(self.mass.dimension) for _ in range(q)), kappa * b[1]]
        inner = cp.CallbackParam(self._scaled_times, (q,)) if q else ()  # the duration may change with the maneuver
        ends = [0.0, *(inner[i] for i in range(q)), 1.0]
        first = 0
        for j, holds in enumerate(self.grid.holds(q)):  # type: ignore[union-attr]
            v = self.v[first : first + holds]
            first += holds
            h = ends[j + 1] - ends[j]
            later = holds - np.arange(holds) - 0.5
            a, s = cp.Variable(self.mass.dimension), cp.Variable(self.mass.dimension)
            # rows of length about one, also for 20,000 holds: sqrt(N_j) on both sides
            root = np.sqrt(holds)
            constraints.append(root * a == cp.multiply(h, (later / (root * holds)) @ v))
            constraints.append(root * s == np.full(holds, 1 / root) @ v)
            constraints.append(points[j + 1] - points[j] == cp.multiply(h, speeds[j] + a))
            constraints.append(speeds[j + 1] - speeds[j] == cp.multiply(h, s))
        return constraints

    def place(self, times: Sequence[float] | Array) -> Array:
        """Set the obstacle times [s], shape (q,); the scaled times that the grid makes of them."""
        if self.obstacle_times is not None:
            self.obstacle_times.value = np.asarray(times, dtype=float)
        return self._scaled_times()

    def solve(self, solver: str, until: float = math.inf) -> Answer:
        """Solve with the values set, and read off what the solver proposes, whatever its status.

        Args:
            solver: CLARABEL, HIGHS, OSQP or SCS; "CLARABEL CAREFUL" is CLARABEL at its own default care.
            until: a deadline.
        """
        self.count.solves += 1
        options = options_of(solver, until)
        solver = solver.split()[0]
        if solver == "HIGHS":
            silence_highs()
        if solver not in self._per_solver:  # a cvxpy problem keeps what it compiled for its last solver only
            fresh = cp.Problem(self.problem.objective, self.problem.constraints)
            self._per_solver[solver] = fresh if self._per_solver else self.problem
            self.count.compilations += 1
        problem = self._per_solver[solver]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # "may be inaccurate": the bracket measures by how much
                problem.solve(solver=solver, warm_start=False, enforce_dpp=True, **options)
        except SpecError:
            raise
        except (cp.SolverError, ValueError, ArithmeticError) as error:
            return Answer(status=f"failed: {error}")
        with np.errstate(all="ignore"):  # what is not finite then proves nothing
            return Answer(self._control(), hold_costate(self.circle, self._bound), str(problem.status))

    @abstractmethod
    def _control(self) -> Array | None:
        """The control that the last solve proposes [scaled], shape (steps, d), or None."""


class FeasibilityProgram(_Program):
    """Is there a control with |u| <= M that passes the walls at these times? (the paper's LP problem)

    `problem` is a cvxpy problem; set `M.value` [m/s^2] and `obstacle_times.value` (q,) [s], nothing else, and
    solve. `v`, shape (steps, d), is the control in units of M.
    """

    def __init__(
        self, maneuver: Maneuver, circle: Disc | Polygon, grid: Uniform | Aligned, count: Count | None = None
    ) -> None:
        super().__init__(maneuver, circle, grid, count)
        self.M: cp.Parameter = cp.Parameter(pos=True, name="M")

        def size() -> float | None:
            return None if self.M.value is None else self.mass.unit / float(self.M.value)

        self._build(cp.Minimize(0), 1.0, size)

    def _control(self) -> Array | None:
        return None if self.v.value is None else self.v.value * (self.M.value / self.mass.unit)


class DirectProgram(_Program):
    """The least M for these obstacle times, M a variable: maximises kappa = floor / M.

    Set `obstacle_times.value` (q,) [s]; `M` is the least peak [m/s^2] by the solver's account.
    """

    def __init__(
        self, maneuver: Maneuver, circle: Disc | Polygon, grid: Uniform | Aligned, count: Count | None = None
    ) -> None:
        super().__init__(maneuver, circle, grid, count)
        self.kappa: cp.Variable = cp.Variable(name="kappa")
        self._sized: tuple[PointMass, bytes, float] | None = None
        self._build(cp.Maximize(self.kappa), self.kappa, self._size)

    def _size(self) -> float:
        # about the size of M keeps kappa near one wherever the obstacle times are; cvxpy asks for it four times a solve
        times = self._scaled_times()
        if self._sized is None or self._sized[0] is not self.mass or self._sized[1] != times.tobytes():
            self._sized = self.mass, times.tobytes(), 1.0 / (self.mass.floor(times) or 1.0)
        return self._sized[2]

    @property
    def M(self) -> float:
        """Least peak [m/s^2] by the last solve."""
        return float(self.mass.unit / (self.kappa.value * self._size()))

    def _control(self) -> Array | None:
        if self.v.value is None or self.kappa.value is None or not self.kappa.value > 0:
            return None
        return np.asarray(self.v.value / (self.kappa.value * self._size()))


P = TypeVar("P", DirectProgram, FeasibilityProgram)


class Programs:
    """The programs of one thread, whose solves are handed them one after the other; those used last are kept.

    `with` them: what was interrupted inside is not used again.
    """

    def __init__(self) -> None:
        self._kept: dict[object, DirectProgram | FeasibilityProgram] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if kind is not None:
            self._kept.clear()

    def take(
        self, kind: type[P], maneuver: Maneuver, circle: Disc | Polygon, grid: Uniform | Aligned, count: Count
    ) -> P:
        """The program of this kind for the maneuver; use it before the next is taken.

        Args:
            circle, grid: compiled in, as is the maneuver's `structure`.
            count: where its work is counted.
        """
        key = kind, circle, grid, structure(maneuver)
        program = self._kept.pop(key, None)
        if not isinstance(program, kind):
            program = kind(maneuver, circle, grid, count)
        elif program.maneuver is not maneuver or program.count is not count:
            program.turn_to(maneuver, count)
        self._kept[key] = program
        if len(self._kept) > MOST:
            del self._kept[next(iter(self._kept))]
        return program
