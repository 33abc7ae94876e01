"""What is asked: the maneuver, and the settings of how to answer. The JSON keys are the field names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from .circle import Circle, Disc
from .errors import SpecError
from .grid import Aligned, Grid
from .model import Count, Model, Number, Positive, Switch, Vector, in_reach
from .obstacles import Block, Obstacles, Region, Wall, covers

MAX_SWEEP_POINTS = 100_000  # ordered obstacle times; above it a sweep would take days
MOST_CERTIFIED = 8  # walls; a box of obstacle times has 2^q corners
MOST_ROWS = 1_000_000  # of a program: about 1.5 GB, and minutes for one solve
SOLVERS = {"disc": ("CLARABEL", "SCS"), "polygon": ("CLARABEL", "HIGHS", "OSQP", "SCS")}


class State(Model):
    """Position [m] and velocity [m/s] of the centre of mass."""

    position: Vector
    velocity: Vector = (0.0, 0.0)


class Maneuver(Model):
    """From start to goal in the given time, past the walls in the order listed.

    Args:
        start, goal: states of the centre of mass.
        duration: T [s].
        mass: m [kg]; the peak base reaction force is mass times the peak acceleration.
        obstacles: walls, crossed in the order listed at times 0 < T_1 < ... < T_q < T, and blocks.
        margin: distance [m] to be kept from every block.
        region: convex polygon [m] that the path stays in, corners (n, 2) in order.
        max_speed: bound on |velocity| [m/s], at every instant.
        max_peak: optional bound on the peak [m/s^2]; where the proved least peak is above it, the answer is
            "infeasible".
    """

    start: State
    goal: State
    duration: Positive
    mass: Positive = 1.0
    obstacles: Obstacles = ()
    margin: Annotated[Number, Field(ge=0)] = 0.0
    region: Region | None = None
    max_speed: Positive | None = None
    max_peak: Positive | None = None

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The walls among the obstacles, in order."""
        return tuple(o for o in self.obstacles if isinstance(o, Wall))

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks among the obstacles, in order."""
        return tuple(o for o in self.obstacles if isinstance(o, Block))

    def past(self, walls: Iterable[Wall]) -> Maneuver:
        """The same maneuver with these walls for all its obstacles, and without bounds on the path."""
        none = {"margin": 0.0, "region": None, "max_speed": None}
        return self.model_copy(update={"obstacles": tuple(walls), **none})

    @property
    def simple(self) -> bool:
        """Whether walls are all there is to it: no blocks, no region, no bound on the speed."""
        return not self.blocks and self.region is None and self.max_speed is None

    @model_validator(mode="after")
    def _walls_can_be_crossed_in_order(self) -> Maneuver:
        start, goal = np.array(self.start.position), np.array(self.goal.position)
        listed = [(i, o) for i, o in enumerate(self.obstacles) if isinstance(o, Wall)]
        for (before, first), (i, second) in zip(listed, listed[1:], strict=False):
            if first == second:
                raise ValueError(f".obstacles[{i}]: was the same wall as the one before, must be listed once")
            (ax, ay), (bx, by) = first.direction, second.direction
            if abs(ax * by - ay * bx) > 1e-12 * math.hypot(ax, ay) * math.hypot(bx, by):
                continue
            normal = np.array([-ay, ax]) / math.hypot(ax, ay)
            along = float(normal @ (goal - start))
            if abs(normal @ (np.array(first.tip) - second.tip)) <= 1e-12 * max(map(abs, (*first.tip, *second.tip))):
                raise ValueError(
                    f".obstacles[{i}]: was on the line of obstacles[{before}], must be one wall with it (see `opening`)"
                )
            places = [float(normal @ (np.array(w.tip) - start)) / along if along else -1 for w in (first, second)]
            if 1 > places[0] > places[1] > 0:
                raise ValueError(
                    f".obstacles[{i}].tip: was {list(second.tip)}, must be listed before obstacles[{before}] "
                    "(walls are crossed in the order listed, and the way to the goal meets this line first)"
                )
        return self

    @model_validator(mode="after")
    def _ends_are_free(self) -> Maneuver:
        ends = [x for s in (self.start, self.goal) for x in (s.position, tuple(self.duration * v for v in s.velocity))]
        in_reach([*ends, *(wall.tip for wall in self.walls)], self.duration)
        for name, state in (("start", self.start), ("goal", self.goal)):
            for i, block in enumerate(self.obstacles):
                if isinstance(block, Block) and block.holds(state.position, self.margin):
                    near = f" with its margin of {self.margin} m" if self.margin else ""
                    raise ValueError(f".obstacles[{i}]: was a block around the {name}{near}, must leave it free")
            if self.region is not None and not covers(self.region, state.position):
                raise ValueError(f".{name}.position: was {list(state.position)}, must lie in the region")
            if self.max_speed is not None and math.hypot(*state.velocity) > self.max_speed:
                raise ValueError(
                    f".{name}.velocity: was {list(state.velocity)}, must not be faster than max_speed, {self.max_speed}"
                )
        return self


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


class GlobalSearch(Model):
    """Branch and bound over all obstacle times, until the proved relative gap is at most `gap`."""

    kind: Literal["global"] = "global"
    gap: Annotated[Positive, Field(lt=1)] = 1e-6


class Settings(Model):
    """How to answer: the circle, the grid, the inner loop (`method`), the outer loop (`search`), the solver.

    Args:
        node_limit: boxes of obstacle times that a global search looks at before it stops with the gap it has.
        time_limit: seconds after which any search stops, with the obstacle times it has seen; default none.
        rounds: ways past blocks, each with its walls, or problems of an arm's centre of mass past gaps, that are
            solved before the search stops likewise; it also stops where the gap comes down no more.
    """

    circle: Circle = Disc()
    grid: Grid = Aligned()
    method: Annotated[Bisection | Direct | Exact, Field(discriminator="kind")] = Direct()
    search: Annotated[SweepSearch | RefineSearch | GlobalSearch, Field(discriminator="kind")] = GlobalSearch()
    solver: Literal["CLARABEL", "HIGHS", "OSQP", "SCS"] = "CLARABEL"
    node_limit: Count = 2000
    time_limit: Positive | None = None
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

    @property
    def solvers(self) -> Iterator[str]:
        """The solver asked for, then what to fall back to: CLARABEL with more care, then other solvers."""
        yield self.solver
        yield "CLARABEL CAREFUL"
        yield from (name for name in SOLVERS[self.circle.kind] if name != self.solver)


def known_version(version: int) -> int:
    """The version of a spec or plan file. Raises `ValueError` for one that is not known."""
    if version != 1:
        raise ValueError("1 (the only version so far)")
    return version


class Spec(Model):
    """A whole spec file of a centre of mass; `ArmSpec` reads those with an arm."""

    kind_of_file: ClassVar[str] = "spec"

    version: Annotated[int, Field(strict=True), AfterValidator(known_version)] = 1
    maneuver: Maneuver
    settings: Settings = Settings()

    @model_validator(mode="before")
    @classmethod
    def _is_of_a_point(cls, data: Any) -> Any:
        if isinstance(data, dict) and "arm" in data:
            raise ValueError(".arm: was given, must be left out here (peakmin.ArmSpec reads spec files with an arm)")
        return data

    @model_validator(mode="after")
    def _fit_together(self) -> Spec:
        try:
            check(self.maneuver, self.settings)
        except SpecError as error:
            raise ValueError(f".{error}") from None
        return self


def check(maneuver: Maneuver, settings: Settings) -> None:
    """Refuse settings that do not fit the maneuver. Raises `SpecError`."""
    for name, given, kind in (("maneuver", maneuver, Maneuver), ("settings", settings, Settings)):
        if not isinstance(given, kind):
            whole = " (a spec has both: .maneuver, .settings)" if isinstance(given, Spec) else ""
            raise SpecError(f"{name}: was a {type(given).__name__}, must be a peakmin.{kind.__name__}{whole}")
    walls, grid, search = len(maneuver.walls), settings.grid, settings.search
    if not maneuver.simple and not isinstance(search, GlobalSearch):
        what = "blocks" if maneuver.blocks else "a region" if maneuver.region is not None else "a max_speed"
        raise SpecError(f"settings.search.kind: was {search.kind!r}, must be 'global' for a maneuver with {what}")
    if grid.steps < walls + 2:
        raise SpecError(f"settings.grid.steps: was {grid.steps}, must be at least {walls + 2} (walls + 2)")
    if grid.steps * walls > MOST_ROWS:
        most = f"at most {MOST_ROWS // walls} for {walls} walls"
        raise SpecError(f"settings.grid.steps: was {grid.steps}, must be {most}")
    if isinstance(search, SweepSearch):
        start, stop = search.span(maneuver.duration)
        for name, value in (("start", start), ("stop", stop)):
            if not 0 < value < maneuver.duration:
                raise SpecError(
                    f"settings.search.{name}: was {value}, must be between 0 and the duration {maneuver.duration}"
                )
        if start > stop:
            raise SpecError(f"settings.search.start: was {start}, must not be after stop, {stop}")
    if isinstance(search, GlobalSearch):
        if walls > MOST_CERTIFIED:
            most = f"at most {MOST_CERTIFIED} for a global search"
            raise SpecError(f"maneuver.obstacles: was {walls} walls, must be {most}")
        return
    if walls > search.count:
        raise SpecError(f"settings.search.count: was {search.count}, must be at least the number of walls, {walls}")
    if math.comb(search.count, walls) > MAX_SWEEP_POINTS:
        raise SpecError(
            f"maneuver.obstacles: was {walls} walls, must be fewer for {search.count} obstacle times "
            f"(at most {MAX_SWEEP_POINTS} ordered choices)"
        )


def walls_only(maneuver: Maneuver, what: str) -> None:
    """Refuse blocks, regions and speeds where only walls are understood. Raises `SpecError`."""
    if not maneuver.simple:
        field = "obstacles" if maneuver.blocks else "region" if maneuver.region is not None else "max_speed"
        had = "with blocks" if maneuver.blocks else "given"
        raise SpecError(f"maneuver.{field}: was {had}, must be left out for {what} (walls only)")


def schema() -> dict[str, Any]:
    """The JSON Schema of a spec file."""
    return Spec.model_json_schema()
