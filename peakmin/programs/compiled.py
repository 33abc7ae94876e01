"""Compiled programs by their structure, so that maneuvers that differ in numbers only share one."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.settings import Aligned, Uniform

if TYPE_CHECKING:
    from .program import DirectProgram, FeasibilityProgram

MOST = 8  # programs that are kept; one of 20,000 holds takes some 100 MB
P = TypeVar("P", "DirectProgram", "FeasibilityProgram")


@dataclass
class Count:
    """How much work the programs did."""

    compilations: int = 0
    solves: int = 0


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
        from .program import structure  # cvxpy takes a second to import

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
