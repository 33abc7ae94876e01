"""Best bound first over the classes of paths of one scene, with its proof.

A node stands for the paths of one class; the certified least peak past its walls bounds them. Where its path goes
through something, it is looked at with another wall, or falls into the parts of a cut. A path that is free is an upper
end; one that cuts into something by a little has its walls raised by a little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from ..deadline import over
from ..programs.least_peak import LeastPeak
from ..proofs.bounds import Leaf
from ..proofs.branch_and_bound import Certificate, least_over_times
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal
from ..proofs.frontier import Frontier
from ..scenes.proof_tree import Branch
from ..scenes.scene import Again, Bounded, Samples, Scene
from ..spec.maneuver import Maneuver
from ..types import Array, Progress
from .job import Job

One = TypeVar("One")
Part = TypeVar("Part")
Cut = TypeVar("Cut")
Looks = TypeVar("Looks")


@dataclass
class Effort:
    """How much a search may do, and what it has done.

    gap: relative, at which it ends;  most_boxes, most_rounds: boxes of obstacle times, and classes bounded;  until: a
    deadline;  finest: no class is bounded to a smaller gap;  limit: a bound [m/s^2] above which nothing is asked;
    hasty: whether a class is left as soon as its bound is above what is known or asked, and at once when it is late.
    """

    gap: float
    most_boxes: int
    most_rounds: int
    until: float = math.inf
    finest: float = 0.0
    limit: float = math.inf
    hasty: bool = False
    progress: Progress | None = None
    boxes: int = 0
    rounds: int = 0

    @property
    def late(self) -> bool:
        """Whether boxes or time are used up."""
        return self.boxes >= self.most_boxes or over(self.until)

    @property
    def over(self) -> bool:
        """Whether to come to an end."""
        return self.rounds >= self.most_rounds or self.late

    def least(self, past: Maneuver, boxes: int, start: Array | None = None, known: float = math.inf) -> Certificate:
        """The least peak past walls by so many boxes, to a quarter of the gap.

        Args:
            start: about the best times [scaled], (q,).
            known: a peak [m/s^2] that is had already.
        """
        self.rounds += 1
        mass, enough = PointMass.of(past), math.inf
        if self.hasty:
            enough = 0.0 if self.late else min(known, self.limit) / mass.unit
        found = least_over_times(
            mass,
            max(self.gap, self.finest) / 4,
            node_limit=max(min(boxes, self.most_boxes - self.boxes), 1),
            until=self.until,
            start=start,
            enough=enough,
        )
        self.boxes += found.nodes
        if self.progress:
            self.progress(self.rounds, self.most_rounds)
        return found


@dataclass(frozen=True)
class Candidate(Generic[One]):
    """A path past the walls of a class, narrowed by `lift` [m], at obstacle times [scaled], (q,); its peak [m/s^2]."""

    one: One
    lift: float
    past: Maneuver
    times: Array
    peak: float


@dataclass
class Trunk(Generic[Cut, Looks]):
    """What grows into a branch of the proof: a node's leaves, the cut it is split by and a trunk for each part.

    proved: by the leaves [m/s^2], which are those of the node's best class.
    Parts that look at the same are one trunk, with how much of each is looked at where that is not the trunk's own.
    """

    leaves: tuple[Leaf, ...]
    looks: Looks
    proved: float
    cut: Cut | None = None
    children: list[tuple[Looks | None, Trunk[Cut, Looks]] | None] = field(default_factory=list)

    def branch(self) -> Branch[Cut, Looks]:
        """The proof of this node and all below it."""
        below: list[Branch[Cut, Looks] | None] = []
        for child in self.children:
            made = None if child is None else child[1].branch()
            looks = None if child is None else child[0]
            below.append(made if made is None or looks is None else replace(made, looks=looks))
        return Branch(self.leaves, self.looks, self.cut, tuple(below))


@dataclass(frozen=True)
class Node(Generic[One, Part, Cut, Looks]):
    """A class that waits, how much is looked at of the part that it is of, and where it stands in the proof."""

    here: Bounded[One]
    part: Part
    looks: Looks
    trunk: Trunk[Cut, Looks]


class Tree(Generic[One, Part, Cut, Looks]):
    """The search over one scene's classes.

    best: the best free path met, or None;  last: the node looked at last.
    """

    def __init__(self, scene: Scene[One, Part, Cut, Looks], effort: Effort) -> None:
        self.scene, self.effort = scene, effort
        self.best: Candidate[One] | None = None
        self._known = math.inf
        self._waiting: Frontier[Node[One, Part, Cut, Looks]] = Frontier()
        self._closed: list[Node[One, Part, Cut, Looks]] = []
        part, looks = scene.first
        first = scene.seen(part, looks)
        here = None if first is None else self._bounded(first)
        assert here is not None
        trunk: Trunk[Cut, Looks] = Trunk(tuple(here.certificate.leaves), looks, here.own)
        self.root: Node[One, Part, Cut, Looks] = Node(here, part, looks, trunk)
        self.last = self.root
        self._wait(self.root)

    @property
    def lower(self) -> float:
        """No path has a smaller peak [m/s^2]; infinite where none is left."""
        return min((node.here.bound for node in (*self._waiting.items, *self._closed)), default=math.inf)

    @property
    def upper(self) -> float:
        """The least peak of a free path that was met [m/s^2]."""
        return math.inf if self.best is None else self.best.peak

    @property
    def nearest(self) -> Candidate[One]:
        """The path of the node looked at last, free or not."""
        here = self.last.here
        return Candidate(here.one, 0.0, here.past, here.certificate.times, here.certificate.best.upper * here.mass.unit)

    def run(
        self,
        upper: Callable[[], float] = lambda: math.inf,
        no: float = math.inf,
        told: Callable[[Bounded[One], int], None] = lambda here, count: None,
    ) -> None:
        """Search until the gap to the best peak is reached or comes down no more, or until the effort is over.

        Args:
            upper: a peak that is known from elsewhere [m/s^2];  no: a bound [m/s^2] that says no.
            told: called with each class that is looked at, and how many have been.
        """
        manner, gap, stalled, best, count = self.scene.manner, self.effort.gap, 0, 1.0, 0
        while self._waiting and not self.effort.over:
            known = min(upper(), self.upper)
            self._known = known
            if self._waiting.lowest >= min((1 - gap) * known, no) or stalled >= manner.patience:
                break
            self.last, count = self._waiting.pop()[1], count + 1
            told(self.last.here, count)
            for child in self._expand(self.last, known):
                self._wait(child)
            known = min(known, upper(), self.upper)
            left = 1 - min(self.lower, known) / known if known > 0 else 0.0
            better = (manner.waiting and math.isinf(known)) or left < manner.worth * best
            stalled, best = (0, left) if better else (stalled + 1, best)

    def _wait(self, node: Node[One, Part, Cut, Looks]) -> None:
        self._waiting.push(node.here.bound, node)

    def _bounded(
        self, one: One, above: Bounded[One] | None = None, path: Samples | None = None, more: bool = False
    ) -> Bounded[One] | None:
        """The certified least peak of a class; None where it has no paths.

        Args:
            above: whose bound holds too;  path: one that crosses the walls at about the right times.
            more: whether to look at more boxes.
        """
        past = self.scene.past(one)
        if past is None:
            return None
        start = None if path is None else self.scene.crossings(one, path)
        found = self.effort.least(past, self.scene.boxes(len(past.walls), more), start, self._known)
        own = found.lower * PointMass.of(past).unit
        return Bounded(one, past, found, own, max(own, 0.0 if above is None else above.bound), above)

    def _expand(self, node: Node[One, Part, Cut, Looks], known: float) -> Iterator[Node[One, Part, Cut, Looks]]:
        """The nodes that together stand for this one; it is closed where nothing can be done for it."""
        here, scene = node.here, self.scene
        path = scene.samples(here.one, here.motion)
        if path.depth <= scene.manner.deep * scene.size and scene.motions:
            self._raise(here, known)
        if here.bound >= (1 - self.effort.gap) * min(known, self.upper) or over(self.effort.until):
            self._closed.append(node)
            return
        step = scene.step(here, path, self.effort.until)
        if isinstance(step, Again):
            yield from self._again(node, path, step.looks, more=False)
        elif step is not None:
            yield from self._split(node, path, step)
        elif not here.certificate.complete and here.certificate.nodes < scene.boxes(len(here.past.walls), True):
            yield from self._again(node, path, node.looks, more=True)
        else:
            self._closed.append(node)

    def _again(
        self, node: Node[One, Part, Cut, Looks], path: Samples, looks: Looks, more: bool
    ) -> Iterator[Node[One, Part, Cut, Looks]]:
        """The same paths, looked at in another way or with more boxes; the better proof stays."""
        one = self.scene.seen(node.part, looks)
        here = None if one is None else self._bounded(one, node.here, path, more)
        trunk = node.trunk
        if here is None:  # nothing crosses the walls: that is the proof
            trunk.leaves, trunk.looks, trunk.proved = (), looks, math.inf
            return
        if here.own >= trunk.proved:
            trunk.leaves, trunk.looks, trunk.proved = tuple(here.certificate.leaves), looks, here.own
        yield replace(node, here=here, looks=looks)

    def _split(
        self, node: Node[One, Part, Cut, Looks], path: Samples, cut: Cut
    ) -> Iterator[Node[One, Part, Cut, Looks]]:
        """A node for each part of a cut that is not empty; parts that look at the same are one node."""
        here, scene = node.here, self.scene
        same: dict[One, Node[One, Part, Cut, Looks]] = {}
        trunks: list[tuple[Looks | None, Trunk[Cut, Looks]] | None] = []
        for part in scene.parts(here.one, cut):
            if over(self.effort.until) and scene.manner.waiting:  # what is left of it stays with the node
                self._closed.append(node)
                return
            if scene.empty(part):
                trunks.append(None)
                continue
            trunk, looks, child = self._child(here, part, path, same)
            trunks.append((looks if child is None else None, trunk))
            if child is not None:
                yield child
        node.trunk.cut, node.trunk.children = cut, trunks

    def _child(
        self, above: Bounded[One], part: Part, path: Samples, same: dict[One, Node[One, Part, Cut, Looks]]
    ) -> tuple[Trunk[Cut, Looks], Looks, Node[One, Part, Cut, Looks] | None]:
        """The proof of a part, with how much is looked at, and its node where it is a new one."""
        tried: dict[One, Bounded[One] | None] = {}

        def solve(looks: Looks) -> Bounded[One] | None:
            one = self.scene.seen(part, looks)
            assert one is not None
            if one not in tried:
                tried[one] = same[one].here if one in same else self._bounded(one, above, path)
            return tried[one]

        looks, here = self.scene.child(part, above, path, solve)
        if here is None:  # nothing crosses the walls: that is the proof
            return Trunk((), looks, math.inf), looks, None
        if here.one in same:
            return same[here.one].trunk, looks, None
        trunk: Trunk[Cut, Looks] = Trunk(tuple(here.certificate.leaves), looks, here.own)
        node: Node[One, Part, Cut, Looks] = Node(here, part, looks, trunk)
        same[here.one] = node
        return trunk, looks, node

    def _raise(self, here: Bounded[One], known: float) -> None:
        """A free path near the class's, its walls raised as little as it takes; kept where it is the best."""
        manner, size = self.scene.manner, self.scene.size
        lift = manner.first_lift * size
        for _ in range(manner.lifts):
            past = self.scene.past(here.one, lift)
            if past is None or lift > 2 * manner.deep * size or over(self.effort.until):
                return
            mass = PointMass.of(past)
            found = extremal(mass, here.certificate.times)
            peak = found.upper * mass.unit
            if not peak < min(known, self.upper):
                return
            motion = found.motion.in_units(mass)
            short = self.scene.quick_short(motion)
            short = short if short > 0 else self.scene.short(motion)
            if not short > 0:
                self.best = Candidate(here.one, lift, past, here.certificate.times, peak)
                return
            if not here.past.walls:
                return
            lift += max(1.3 * short, manner.first_lift * size)


def raised(scene: Scene[One, Part, Cut, Looks], best: Candidate[One], job: Job, again: bool) -> tuple[LeastPeak, Array]:
    """The settings' own M past a candidate's walls, raised until its path is free, and the candidate's times [s], (q,).

    A held control bends a little otherwise than the one that was proved free.

    Args:
        again: whether to raise them at all.
    """
    past, lift, times = best.past, best.lift, best.times * best.past.duration
    least = job.least(past)
    for _ in range(scene.manner.lifts if again else 0):
        motion = least.motion(times)
        if motion is None or over(job.until):
            break
        short = scene.short(motion)
        if not short > 0:
            break
        lift += max(1.3 * short, scene.manner.first_lift * scene.size)
        higher = scene.past(best.one, lift)
        if higher is None or not higher.walls:
            break
        further = job.least(higher)
        if further.motion(times) is None:
            break
        least = further
    return least, times
