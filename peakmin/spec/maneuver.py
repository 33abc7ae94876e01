"""What is asked of a centre of mass: the maneuver. The JSON keys are the field names."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from ..errors import SpecError
from ..geometry.norm import length
from .model import Model, Positive, Vector, in_reach
from .obstacles import Block, Obstacles, Region, Wall, covers
from .task import Task


class State(Model):
    """Position [m] and velocity [m/s] of the centre of mass."""

    position: Vector
    velocity: Vector = (0.0, 0.0)


class Maneuver(Task):
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

    kind: ClassVar[str] = "point"

    start: State
    goal: State
    mass: Positive = 1.0
    obstacles: Obstacles = ()
    region: Region | None = None
    max_speed: Positive | None = None

    @property
    def dimension(self) -> int:
        """d, of its places."""
        return len(self.start.position)

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
            if self.max_speed is not None and length(state.velocity) > self.max_speed:
                raise ValueError(
                    f".{name}.velocity: was {list(state.velocity)}, must not be faster than max_speed, {self.max_speed}"
                )
        return self


def walls_only(maneuver: Maneuver, what: str) -> None:
    """Refuse blocks, regions and speeds where only walls are understood. Raises `SpecError`."""
    if not maneuver.simple:
        field = "obstacles" if maneuver.blocks else "region" if maneuver.region is not None else "max_speed"
        had = "with blocks" if maneuver.blocks else "given"
        raise SpecError(f"maneuver.{field}: was {had}, must be left out for {what} (walls only)")
