"""Compiled programs by their structure, so that maneuvers that differ in numbers only share one."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

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
    """The programs of one thread; those used last are kept."""

    def __init__(self) -> None:
        self._kept: dict[object, DirectProgram | FeasibilityProgram] = {}

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


class _Here(threading.local):
    lasting: Programs | None = None
    shared = False


_here = _Here()


@contextmanager
def shared() -> Iterator[None]:
    """Inside, all solves of this thread take their programs from one place, which the next time finds them again."""
    _here.lasting, _here.shared = _here.lasting or Programs(), True
    try:
        yield
    except BaseException:
        _here.lasting = None  # what was interrupted is not used again
        raise
    finally:
        _here.shared = False


def programs() -> Programs:
    """Where a new `LeastPeak` takes its programs from: a place of its own, or the shared one."""
    return _here.lasting if _here.shared and _here.lasting is not None else Programs()
