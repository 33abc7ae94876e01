"""Why no path of a class has a smaller peak: boxes of obstacle times for the class, and the same for each of its parts.

A class of paths stands for all paths that cross some windows in an order. It is split by a cut into parts which
together hold every path of it; each part is bounded as the class that is seen of it, which may look at less of what
its paths cross: weaker, never stronger. The search splits by the same `parts` as the proof that is evaluated anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from ..proofs.bounds import Leaf, global_bound
from ..proofs.double_integrator import PointMass
from ..spec.maneuver import Maneuver

One = TypeVar("One")  # a class of paths
Part = TypeVar("Part")  # what a cut makes of one
Cut = TypeVar("Cut", contravariant=True)
Looks = TypeVar("Looks", contravariant=True)  # how much is looked at of what the paths of a part cross


class PathClasses(Protocol[One, Part, Cut, Looks]):
    """The classes of paths that one scene has."""

    def past(self, one: One, lift: float = 0.0) -> Maneuver | None:
        """The maneuver past walls whose least peak bounds these paths, its openings narrowed by `lift` [m]; None where
        there are no such paths."""

    def splits(self, one: One, cut: Cut) -> bool:
        """Whether the cut's parts hold every path of the class."""

    def parts(self, one: One, cut: Cut) -> list[Part]:
        """What the class falls into."""

    def seen(self, part: Part, looks: Looks) -> One | None:
        """The class that is bounded for a part; None where the part is empty."""

    def empty(self, part: Part) -> bool:
        """Whether no path falls into the part."""


C = TypeVar("C")
L = TypeVar("L")


@dataclass(frozen=True)
class Branch(Generic[C, L]):
    """Boxes of obstacle times that bound the peak of the paths of one part, and a branch for each of its own parts.

    leaves: prove the bound of all of them;  looks: at what of the part;  cut: by which it is split, or None;
    children: one for each part, None where that is empty.
    """

    leaves: tuple[Leaf, ...]
    looks: L
    cut: C | None = None
    children: tuple[Branch[C, L] | None, ...] = ()

    def bound(self, classes: PathClasses[One, Part, C, L], part: Part) -> float:
        """The bound [m/s^2] of the paths of this part, evaluated anew; infinite where there are none."""
        one = classes.seen(part, self.looks)
        own = math.inf if one is None else leaves_bound(classes.past(one), self.leaves)
        if one is None or self.cut is None or math.isinf(own) or not classes.splits(one, self.cut):
            return own
        parts = classes.parts(one, self.cut)
        if len(parts) != len(self.children):
            return own
        below = [
            (math.inf if classes.empty(each) else 0.0) if child is None else child.bound(classes, each)
            for each, child in zip(parts, self.children, strict=True)
        ]
        return max(own, min(below, default=math.inf))


def leaves_bound(past: Maneuver | None, leaves: tuple[Leaf, ...]) -> float:
    """What boxes prove of the paths past these walls [m/s^2]; infinite where there are none."""
    if past is None:
        return math.inf
    mass = PointMass.of(past)
    return float(global_bound(mass, leaves) * mass.unit)
