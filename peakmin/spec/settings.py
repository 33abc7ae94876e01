"""How to answer: the circle, the grid, the inner and the outer loop, the solver. The JSON keys are the field names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from ..types import Array, Json
from .control_set import Circle, Disc
from .model import Count, Model, Positive, Switch


class Uniform(Model):
    """Equal holds (the paper). An obstacle time is moved to the nearest node inside."""

    kind: Literal["uniform"] = "uniform"
    steps: Count = 200

    def place(self, times: Array) -> Array:
        """The times moved to distinct inner nodes, shape (q,); needs steps > q."""
        count = len(times)
        node = np.clip(np.round(np.asarray(times) * self.steps), 1, self.steps - 1)
        for i in range(1, count):  # one node each, in order
            node[i] = max(node[i], node[i - 1] + 1)
        for i in reversed(range(count)):
            node[i] = min(node[i], self.steps - (count - i))
        return np.asarray(node / self.steps, dtype=float)

    def edges(self, times: Array) -> Array:
        """Ends of the holds, shape (steps+1,)."""
        return np.arange(self.steps + 1) / self.steps


class Aligned(Model):
    """Equal holds between one obstacle time and the next, so that each obstacle time is a node."""

    kind: Literal["aligned"] = "aligned"
    steps: Count = 200

    def place(self, times: Array) -> Array:
        """The times as they are, shape (q,)."""
        return np.asarray(times, dtype=float)

    def holds(self, walls: int) -> list[int]:
        """Number of holds N_j of each of the q+1 segments; they add up to `steps`."""
        return [self.steps * (j + 1) // (walls + 1) - self.steps * j // (walls + 1) for j in range(walls + 1)]

    def edges(self, times: Array) -> Array:
        """Ends of the holds, shape (steps+1,)."""
        ends = np.concatenate([[0.0], times, [1.0]])
        parts = [
            a + (b - a) * np.arange(n) / n for a, b, n in zip(ends, ends[1:], self.holds(len(times)), strict=False)
        ]
        return np.concatenate([*parts, [1.0]])


Grid = Annotated[Uniform | Aligned, Field(discriminator="kind")]


Share = Annotated[Positive, Field(lt=1)]  # of a peak
MOST_ROWS = 1_000_000  # of a program: about 1.5 GB, and minutes for one solve
SOLVERS = {"disc": ("CLARABEL", "SCS"), "polygon": ("CLARABEL", "HIGHS", "OSQP", "SCS")}


class Bisection(Model):
    """Bisection on M over feasibility problems (the paper's inner loop).

    Args:
        upper: first M asked for [m/s^2], doubled until a control is found. Default: five times an a-priori bound.
            Verified bisection asks for it at the first obstacle time only, then starts from what it has proved.
        tolerance: width of the bracket [m/s^2] at which to stop. Default: 1e-6 of its upper end.
        verified: move the ends by proofs (far fewer solves) instead of to midpoints (the paper).
    """

    kind: Literal["bisection"] = "bisection"
    upper: Positive | None = None
    tolerance: Positive | None = None
    verified: Switch = True


class Direct(Model):
    """One program with M as a variable."""

    kind: Literal["direct"] = "direct"


class Exact(Model):
    """The optimum in continuous time, u = M p/|p|: no grid, no polygon (needs the disc)."""

    kind: Literal["exact"] = "exact"


class SweepSearch(Model):
    """The paper's outer loop: `count` obstacle times from `start` to `stop` [s], both included.

    Default ends: a tenth of the duration from either end (the paper). Several walls take every ordered choice.
    """

    kind: Literal["sweep"] = "sweep"
    start: Positive | None = None
    stop: Positive | None = None
    count: Count = 18
    accept: Share = 0.05

    def span(self, duration: float) -> tuple[float, float]:
        """First and last obstacle time [s]."""
        return (
            0.1 * duration if self.start is None else self.start,
            0.9 * duration if self.stop is None else self.stop,
        )


class RefineSearch(Model):
    """A sweep with one edge per quadrant over the whole duration, then closer around the winner."""

    kind: Literal["refine"] = "refine"
    count: Count = 18
    accept: Share = 0.05


class GlobalSearch(Model):
    """Branch and bound over all obstacle times, until the proved relative gap is at most `gap`."""

    kind: Literal["global"] = "global"
    gap: Share = 1e-6
    accept: Share = 0.05


class Settings(Model):
    """How to answer: the circle, the grid, the inner loop (`method`), the outer loop (`search`), the solver.

    Args:
        search: every one has `accept`: a plan that keeps all that was asked is "solved" where its gap is at most that,
            by default 0.05, and "feasible" where it is larger.
        node_limit: boxes of obstacle times that a global search looks at before it stops with the gap it has.
        time_limit: seconds after which any search stops, with the obstacle times it has seen; default 30, None is none.
        rounds: ways past blocks, each with its walls, or problems of an arm's centre of mass past gaps, that are
            solved before the search stops likewise; it also stops where the gap comes down no more.
    """

    circle: Circle = Disc()
    grid: Grid = Aligned()
    method: Annotated[Bisection | Direct | Exact, Field(discriminator="kind")] = Direct()
    search: Annotated[SweepSearch | RefineSearch | GlobalSearch, Field(discriminator="kind")] = GlobalSearch()
    solver: Literal["CLARABEL", "HIGHS", "OSQP", "SCS"] = "CLARABEL"
    node_limit: Count = 2000
    time_limit: Positive | None = 30.0
    rounds: Count = 60

    @model_validator(mode="after")
    def _fit_one_another(self) -> Settings:
        circle, steps, able = self.circle, self.grid.steps, SOLVERS[self.circle.kind]
        if self.solver not in able:
            raise ValueError(f".solver: was {self.solver!r}, must be {' or '.join(able)} for a {circle.kind}")
        if isinstance(self.method, Exact) and not isinstance(circle, Disc):
            raise ValueError(f".circle.kind: was {circle.kind!r}, must be 'disc' for the exact method")
        most = MOST_ROWS // (3 if isinstance(circle, Disc) else 4 * circle.segments)
        if steps > most:
            raise ValueError(f".grid.steps: was {steps}, must be at most {most} for this {circle.kind}")
        return self

    @model_serializer(mode="wrap")
    def _no_limit_is_written(self, fields: SerializerFunctionWrapHandler) -> Json:
        """None is left out of files where it is what is meant without it, and here it is not."""
        return {**fields(self), "time_limit": self.time_limit}

    @property
    def solvers(self) -> Iterator[str]:
        """The solver asked for, then what to fall back to: CLARABEL with more care, then other solvers."""
        yield self.solver
        yield "CLARABEL CAREFUL"
        yield from (name for name in SOLVERS[self.circle.kind] if name != self.solver)
