"""What an explanation asks of each kind of task: one object for one task that is proved impossible."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import NamedTuple

from ..plan.plan import Plan
from ..spec.task import Task
from .repairs import Repair, Trials


class InTheWay(NamedTuple):
    """Entries in the way of the motions that were found, though nothing is proved; why; and what helps."""

    fields: tuple[str, ...]
    because: str
    repairs: list[Repair]


class Reasons(ABC):
    """Why one task cannot be done, in terms of its entries.

    bounds: by the entries that are left, what no control of the task with these alone undercuts [m/s^2] and is more
    than is allowed; infinite where no peak would do.
    """

    task: Task

    def __init__(self, task: Task, proved: float, trials: Trials) -> None:
        self.task, self.trials = task, trials
        refuted = proved > task.limit or math.isinf(proved)
        self.bounds = {tuple(self.entries): proved} if refuted else {}

    @property
    def obstacles(self) -> list[str]:
        """The obstacles' names."""
        return [f"obstacles[{i}]" for i in range(len(self.task.obstacles))]

    def refuted(self, kept: list[str]) -> bool:
        """Whether the task with these entries alone is proved impossible."""
        if tuple(kept) not in self.bounds:
            bound = self.bound(kept)
            if bound is None:
                return False
            self.bounds[tuple(kept)] = bound
        return True

    @staticmethod
    def in_the_way(plan: Plan, trials: Trials) -> InTheWay | None:
        """What is in the way of a plan that is "unknown"; None where nothing is known to be."""
        return None

    @property
    @abstractmethod
    def entries(self) -> list[str]:
        """What can be left out of the task."""

    @abstractmethod
    def bound(self, kept: list[str]) -> float | None:
        """What refutes the task with these entries alone, as in `bounds`; None where nothing does."""

    @abstractmethod
    def named(self, kept: list[str]) -> tuple[tuple[str, ...], str]:
        """All entries that conflict, of those that can be left out these, and why in words."""

    @abstractmethod
    def repairs(self, fields: tuple[str, ...]) -> Iterator[Repair]:
        """Changes of single entries, among those that conflict, that help."""
