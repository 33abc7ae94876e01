"""What a centre of mass moves in: how its paths fall into classes, and where a class is split next.

`PathClasses` of `peakmin.scenes.proof_tree` is what a proof needs of it; here is what a search asks besides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, Protocol, TypeVar

from ..geometry.trajectory import Trajectory
from ..proofs.branch_and_bound import Certificate
from ..proofs.double_integrator import PointMass
from ..spec.maneuver import Maneuver
from ..types import Array
from .proof_tree import PathClasses

One = TypeVar("One")
Part = TypeVar("Part")
Cut = TypeVar("Cut")
Looks = TypeVar("Looks")


@dataclass(frozen=True)
class Bounded(Generic[One]):
    """A class of paths and the least peak past its walls, over all obstacle times.

    own: what is proved of the class itself;  bound: that, or what is proved of one that it is part of [m/s^2];
    before: the class that led to it.
    """

    one: One
    past: Maneuver
    certificate: Certificate
    own: float
    bound: float
    before: Bounded[One] | None = None

    @cached_property
    def mass(self) -> PointMass:
        """The maneuver past the walls in scaled units."""
        return PointMass.of(self.past)

    @property
    def motion(self) -> Trajectory:
        """The optimum past the walls [SI]."""
        return self.certificate.best.motion.in_units(self.mass)


@dataclass(frozen=True)
class Samples:
    """A path at even times, the start and the goal included.

    places: (m, 2) [m];  depth: how far inside something the deepest of them is, below zero where none is [m].
    room: how far from touching each is [m], (m,), where that is known.
    """

    places: Array
    depth: float
    room: Array | None = None


class Plane(NamedTuple):
    """A half-plane that a held control keeps its path in at one of its nodes: normal . r >= level [m]."""

    node: int
    normal: Array
    level: float


@dataclass(frozen=True)
class Manner:
    """How a search goes about its classes; lengths are shares of the scene's size.

    samples: of a path when its worst place is looked for;  deep: how far inside a path may be to be raised clear of
    what it cuts into, in how many steps (`lifts`) of at least `first_lift`;  patience: steps in which the gap must
    have come down to the share `worth` of itself, or the search ends, `waiting` for a first free path or not.
    """

    samples: int
    deep: float
    first_lift: float
    lifts: int
    patience: int
    worth: float
    waiting: bool


@dataclass(frozen=True)
class Again(Generic[Looks]):
    """The same paths are to be looked at in another way."""

    looks: Looks


class Scene(PathClasses[One, Part, Cut, Looks], Protocol[One, Part, Cut, Looks]):
    """The path classes of one scene, with what a search asks of them."""

    manner: Manner

    @property
    def size(self) -> float:
        """What lengths are measured by [m]."""

    @property
    def first(self) -> tuple[Part, Looks]:
        """The part that holds every path, and what is looked at of it at first."""

    def samples(self, one: One, motion: Trajectory) -> Samples:
        """A motion's path, and how far inside something it is; none of a place that the class allows counts."""

    def crossings(self, one: One, path: Samples) -> Array:
        """About when a path crosses the walls of the class, as shares of the duration, (q,)."""

    @property
    def motions(self) -> bool:
        """Whether a free path of these classes is a motion of what is asked."""

    def step(self, here: Bounded[One], path: Samples, until: float) -> Again[Looks] | Cut | None:
        """What would raise the bound most: the same paths past other walls, or a cut; None where neither would.

        until: a deadline, after which the best that was met is taken.
        """

    def child(
        self, part: Part, above: Bounded[One], path: Samples, solve: Callable[[Looks], Bounded[One] | None]
    ) -> tuple[Looks, Bounded[One] | None]:
        """A part with as few walls as prove what more of them would, and how much is looked at so.

        Args:
            above: the class that the part is of;  path: of its optimum.
            solve: bounds the part with so much looked at; None where nothing crosses the walls, and there is no path.
        """

    def boxes(self, walls: int, more: bool) -> int:
        """Boxes of obstacle times for a class with so many walls: at first, or where its own gap is what is left."""

    def short(self, motion: Trajectory) -> float:
        """By how much [m] a motion cuts into something; zero or less where it is free, proved between samples."""

    def quick_short(self, motion: Trajectory) -> float:
        """The same on samples, which may miss something, where that is quicker; zero where it is not."""
