"""What a best-first search has yet to look at: the least bound comes first."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterable
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Frontier(Generic[Item]):
    """Items that wait with a lower bound each; of equal bounds the one that came first goes first.

    Items are never compared with each other.
    """

    def __init__(self, begun: Iterable[tuple[float, Item]] = ()) -> None:
        self._serial = itertools.count()
        self._heap = [(bound, next(self._serial), item) for bound, item in begun]
        heapq.heapify(self._heap)

    def __len__(self) -> int:
        return len(self._heap)

    @property
    def lowest(self) -> float:
        """The least bound that waits; infinite where nothing does."""
        return self._heap[0][0] if self._heap else math.inf

    @property
    def first(self) -> Item:
        """The item with the least bound, which goes on waiting."""
        return self._heap[0][2]

    @property
    def items(self) -> list[Item]:
        """All that wait, in no order that means anything, but always the same one."""
        return [item for _, _, item in self._heap]

    def push(self, bound: float, item: Item) -> None:
        """Let an item wait."""
        heapq.heappush(self._heap, (bound, next(self._serial), item))

    def pop(self) -> tuple[float, Item]:
        """The least bound and its item, which waits no more."""
        bound, _, item = heapq.heappop(self._heap)
        return bound, item
