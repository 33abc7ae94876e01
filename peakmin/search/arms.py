"""The least peak of a two-link arm's motions, over all elbows, with its proof.

Motions that keep their elbow first (`search.arm_tree`); where start and goal have different elbows, motions that turn
it over (`search.turns`). Then what no motion that touches an edge of the annulus can undercut: by arcs, and by a
tree of gaps in which a place counts as blocked only where it is so with both elbows.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..deadline import over
from ..proofs.branch_and_bound import Certificate, least_over_times
from ..proofs.double_integrator import PointMass
from ..robots.joint_space import Flood, JointWay, decisive_flood
from ..robots.workspace import Workspace
from ..scenes.arm_proof import ArmProof, PassageProof, Touching
from ..scenes.passages import Edge, Passage, passages
from ..spec.arm import ArmManeuver
from ..spec.maneuver import Maneuver
from ..types import Array, Progress
from .arm_tree import BOXES, PATIENCE, WORTH, Candidate, Tree
from .course import Steered
from .turns import turn_along, turn_on

ARCS, FEWEST = 6, 3  # of each edge at first
FINEST_GAP = 1e-5  # what lifts and clearances of paths leave of any smaller one
NARROW = 1e-3  # rad: an arc is not split further
MOST_TURNS = 2  # motions with a change of elbow that are looked for on one edge
SPLITS = 16  # arcs split before the rest is left to the tree


@dataclass(frozen=True)
class Found:
    """What a search found: the proof of a bound on all free motions, and motions.

    best: the best free motion met that keeps its elbow, or None;  steered: one that was kept out of everything node by
    node;  turned: one that turns its elbow over;  nearest: a motion that keeps its elbow and hits something.
    """

    maneuver: ArmManeuver
    proof: ArmProof
    best: Candidate | None
    steered: Steered | None
    turned: Steered | None
    nearest: Candidate | None
    nodes: int

    @cached_property
    def bound(self) -> float:
        """The proof's bound [m/s^2], evaluated anew."""
        return self.proof.bound(self.maneuver)


@dataclass
class _Arc:
    """The paths that touch an arc: the bound [m/s^2], its proof, and how the best of them does so."""

    bound: float
    proof: Touching
    certificate: Certificate
    past: Maneuver


class ArmSearch:
    """The search over all passages of one maneuver of a two-link arm."""

    def __init__(
        self, asked: ArmManeuver, workspace: Workspace, gap: float, node_limit: int, until: float = math.inf
    ) -> None:
        self.asked, self.workspace, self.gap = asked, workspace, gap
        self._boxes, self._until = node_limit, until
        self.boxes = self.rounds = 0
        self.best: Candidate | None = None
        self.steered: Steered | None = None
        self.turned: Steered | None = None
        self._flood: Flood | None = None
        self._most = 0
        self._progress: Progress | None = None

    @property
    def upper(self) -> float:
        """The least peak of a free motion that is known [m/s^2]."""
        return min((one.peak for one in (self.best, self.steered, self.turned) if one is not None), default=math.inf)

    @property
    def enough(self) -> float:
        """A bound [m/s^2] above which nothing more is asked: of the best motion, or a no to max_peak."""
        return min((1 - self.gap) * self.upper, (self.asked.max_peak or math.inf) * (1 + 1e-9))

    def run(self, rounds: int, progress: Progress | None = None) -> Found:
        """Search until the gap is reached or comes down no more, or for so many rounds, boxes and seconds."""
        self._most, self._progress = rounds, progress
        every = passages(self.asked, self.workspace)
        if self.asked.obstacles:
            ends = [(one.theta, one.elbow if one.keeps else None) for one in every]
            self._flood = decisive_flood(self.workspace, ends, self._until)
        every, flooded = [one for one in every if self._joined(one)], len(every)
        parted = len(every) < flooded or any(one.keeps and not self._joined(one, one.elbow) for one in every)
        trees = {
            one.indices: Tree(self._seen(one), self.gap, self._certify, self._until, self._way(one, one.elbow))
            for one in every
            if one.keeps and self._joined(one, one.elbow)
        }
        for tree in sorted(trees.values(), key=lambda tree: tree.lower):
            tree.run(self.upper, self._over)
            if tree.best is not None and (self.best is None or tree.best.peak < self.best.peak):
                self.best = tree.best
            if tree.steered is not None and (self.steered is None or tree.steered.peak < self.steered.peak):
                self.steered = tree.steered
        arcs = {passage.indices: self._arcs(passage) for passage in every if not self._alone(passage)}
        for passage in every:
            if not passage.keeps:
                self._turn(passage, arcs[passage.indices])
        proofs = []
        for passage in every:
            if self._alone(passage):
                tree = trees[passage.indices]
                proofs.append(PassageProof(passage.indices, None, (), tree.root.branch()))
                continue
            kept = trees.get(passage.indices)
            own = self._split(passage, arcs[passage.indices])
            whole = None
            if min(arc.bound for arc in own) < self.enough:
                whole = Tree(passage.whole, self.gap, self._certify, self._until)
                whole.run(min(self.upper, math.inf if kept is None else kept.lower), self._over)
            touching = tuple(arc.proof for arc in own)
            trunks = [None if tree is None else tree.root.branch() for tree in (kept, whole)]
            proofs.append(PassageProof(passage.indices, trunks[0], touching, trunks[1]))
        nearest = None
        if trees:
            first = min(trees.values(), key=lambda tree: tree.lower)
            last = first.last
            nearest = Candidate(first.passage, last.order, 0.0, last.past, last.certificate.times, last.bound)
        proof = ArmProof(tuple(proofs), self._flood.cells if parted and self._flood is not None else 0)
        return Found(self.asked, proof, self.best, self.steered, self.turned, nearest, self.boxes)

    def _joined(self, passage: Passage, elbow: float | None = None) -> bool:
        """Whether a motion, or one that keeps this elbow, is not proved impossible."""
        return self._flood is None or not self._flood.parts(passage.theta, elbow)

    def _way(self, passage: Passage, elbow: float | None = None) -> JointWay | None:
        """A way of free configurations, if one is known."""
        way = None if self._flood is None else self._flood.way(passage.theta, elbow)
        return None if way is None else JointWay(self.workspace, way, self.asked.duration)

    def _alone(self, passage: Passage) -> bool:
        """Whether a tree of all motions is enough: without obstacles both elbows see the same."""
        return passage.keeps and not self.asked.obstacles

    def _seen(self, passage: Passage) -> Passage:
        return passage.whole if self._alone(passage) else passage

    def _over(self) -> bool:
        return self.rounds >= self._most or self._late

    @property
    def _late(self) -> bool:
        return self.boxes >= self._boxes or over(self._until)

    def _certify(self, past: Maneuver, boxes: int, start: Array | None = None, enough: float = math.inf) -> Certificate:
        """The least peak past walls, or a bound of `enough` [m/s^2], to no smaller gap than paths can keep."""
        self.rounds += 1
        mass, gap = PointMass.of(past), max(self.gap, FINEST_GAP) / 4
        # more than max_peak is enough to say no; once the time is over any bound is
        limit = (self.asked.max_peak or math.inf) * (1 + 1e-6)
        level = min(enough, self.upper, limit) / mass.unit if not self._late else 0.0
        boxes = max(min(boxes, self._boxes - self.boxes), 1)
        found = least_over_times(mass, gap, node_limit=boxes, until=self._until, start=start, enough=level)
        self.boxes += found.nodes
        if self._progress:
            self._progress(self.rounds, self._most)
        return found

    def _arcs(self, passage: Passage) -> list[_Arc]:
        arcs = []
        for edge in passage.edges:
            point = edge == "inner" and self.workspace.chain.reach[0] == 0
            cuts = np.linspace(-math.pi, math.pi, (FEWEST if point else ARCS) + 1).tolist()
            arcs += [self._arc(passage, edge, arc) for arc in itertools.pairwise(cuts)]
        return arcs

    def _arc(self, passage: Passage, edge: Edge, arc: tuple[float, float]) -> _Arc:
        """The paths that touch an arc."""
        solved = []
        for one in Touching(edge, arc, ()).paths:
            past = passage.past(one)
            assert past is not None
            found = self._certify(past, BOXES, np.full(len(past.walls), 0.5))
            solved.append((found.lower * PointMass.of(past).unit, found, past))
        bound, found, past = min(solved, key=lambda one: one[0])
        return _Arc(bound, Touching(edge, arc, tuple(tuple(one.leaves) for _, one, _ in solved)), found, past)

    def _split(self, passage: Passage, arcs: list[_Arc]) -> list[_Arc]:
        """The arcs, the lowest split until each bounds more than the best motion, or splitting gains no more."""
        heap = [(arc.bound, k, arc) for k, arc in enumerate(arcs)]
        heapq.heapify(heap)
        stalled, left = 0, 1.0
        for k in range(len(arcs), len(arcs) + 2 * SPLITS, 2):
            bound, _, arc = heap[0]
            a, b = arc.proof.arc
            if bound >= self.enough or b - a < NARROW or self._late:
                break
            stalled, left = (0, now) if (now := 1 - bound / self.upper) < WORTH * left else (stalled + 1, left)
            if stalled >= PATIENCE:
                break
            heapq.heappop(heap)
            for i, half in enumerate(((a, (a + b) / 2), ((a + b) / 2, b))):
                found = self._arc(passage, arc.proof.edge, half)
                heapq.heappush(heap, (found.bound, k + i, found))
        return [arc for _, _, arc in heap]

    def _turn(self, passage: Passage, arcs: list[_Arc]) -> None:
        """Free motions of this passage that turn the elbow over, the cheapest bound first."""
        way = self._way(passage)
        if way is not None and (found := turn_along(passage, way, self._until)) is not None and found.peak < self.upper:
            self.turned = found
        tries = {"outer": 0, "inner": 0}
        for arc in sorted(arcs, key=lambda arc: arc.bound):
            if arc.bound >= self.enough or self._late:
                return
            point = arc.proof.edge == "inner" and self.workspace.chain.reach[0] == 0
            if not arc.past.walls or point or tries[arc.proof.edge] >= MOST_TURNS:
                continue
            tries[arc.proof.edge] += 1
            found = turn_on(passage, arc.proof.edge, arc.certificate, arc.past, self._until)
            if found is not None and found.peak < self.upper:
                self.turned = found
