"""A lower bound over all ways past blocks, as a proof that can be checked again: a branch for every way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .cells import Cells, Line, Way
from .certify import Leaf, global_bound
from .moments import PointMass
from .spec import Maneuver


@dataclass(frozen=True)
class Branch:
    """Part of the proof: every path with this way has at least the peak that the leaves prove.

    way: gaps left, by strip;  lines: where walls were put;  leaves: boxes of obstacle times.
    """

    way: Way
    lines: tuple[Line, ...]
    leaves: tuple[Leaf, ...]

    def bound(self, cells: Cells) -> float:
        """The bound [m/s^2], evaluated anew; infinite where no path has such a way."""
        way = cells.through(self.way)
        past = None if way is None else cells.maneuver_past(way, self.lines)
        if past is None:
            return math.inf
        mass = PointMass.of(past)
        return global_bound(mass, self.leaves) * mass.unit


@dataclass(frozen=True)
class WaysProof:
    """Why no free path has a smaller peak: branches that cover every way past the blocks."""

    branches: tuple[Branch, ...]
    scope: Literal["all"] = "all"

    def bound(self, maneuver: Maneuver) -> float:
        """The lower bound [m/s^2], evaluated anew; zero where the branches leave a way out."""
        cells = Cells.of(maneuver)
        if not covered(cells, [branch.way for branch in self.branches], cells.ways):
            return 0.0
        bound = min((branch.bound(cells) for branch in self.branches), default=0.0)
        return bound if math.isfinite(bound) else 0.0


def covered(cells: Cells, ways: Sequence[Way], way: Way | None) -> bool:
    """Whether every path with this way has one of the others, by splitting it gap by gap where those differ."""
    if way is None:
        return True
    inside = [w for w in ways if all(set(a) & set(b) for a, b in zip(w, way, strict=True))]
    if any(all(set(b) <= set(a) for a, b in zip(w, way, strict=True)) for w in inside):
        return True
    for k, gaps in enumerate(way):
        if len(gaps) > 1 and any(not set(gaps) <= set(w[k]) for w in inside):
            parts = (cells.through((*way[:k], (gap,), *way[k + 1 :])) for gap in gaps)
            return all(covered(cells, inside, part) for part in parts)
    return False
