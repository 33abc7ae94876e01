"""What every kind of task has: a start, a goal, a time, and what stands in the way."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from .model import Model, Number, Positive


class Task(Model):
    """From start to goal in the given time, clear of the obstacles.

    Args:
        start, goal: of the task's own kind.
        duration: T [s].
        obstacles: what is not touched.
        margin: distance [m] that is kept from every block.
        max_peak: optional bound on the acceleration of the centre of mass [m/s^2].
    """

    kind: ClassVar[str]

    start: Model
    goal: Model
    duration: Positive
    obstacles: tuple[Model, ...] = ()
    margin: Annotated[Number, Field(ge=0)] = 0.0
    max_peak: Positive | None = None

    @property
    def limit(self) -> float:
        """`max_peak`, infinite where there is none [m/s^2]."""
        return self.max_peak or math.inf
