"""The least peak of an arm's motions, with its proof, then the settings' own control.

Of two links, motions that keep their elbow first (`search.tree`); where start and goal have different elbows, motions
that turn it over (`search.turns`). Then what no motion that touches an edge of the annulus can undercut: by arcs, and
by a tree of gaps in which a place counts as blocked only where it is so with both elbows.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..deadline import part
from ..plan.answer import plan_of
from ..plan.arm_plan import ArmPlan
from ..plan.found import Found
from ..proofs.branch_and_bound import Certificate
from ..proofs.double_integrator import PointMass
from ..proofs.frontier import Frontier
from ..robots.joint_space import Flood, JointWay, decisive_flood
from ..scenes.arm_proof import ArmProof, PassageProof, Touching
from ..scenes.kinds import ArmScene
from ..scenes.passages import Edge, Line, Looks, Order, Passage, Whole
from ..scenes.scene import Bounded
from ..spec.frame import Frame
from ..spec.maneuver import Maneuver
from ..spec.settings import GlobalSearch
from ..types import Array
from .course import Steered, steered
from .job import Job
from .planned import Joints, Planner, coarse, with_proof
from .redundant import redundant
from .tree import Candidate, Effort, Tree, raised
from .turns import turn_along, turn_on

ARCS, FEWEST = 6, 3  # of each edge at first
FINEST_GAP = 1e-5  # what lifts and clearances of paths leave of any smaller one
NARROW = 1e-3  # rad: an arc is not split further
MOST_TURNS = 2  # motions with a change of elbow that are looked for on one edge
SPLITS = 16  # arcs split before the rest is left to the tree
STEERED = (3, 6, 12)  # classes looked at without a free motion at which one is looked for
PATIENCE, WORTH = 6, 0.9  # splits in which the gap must have come down to this share of itself, or they end

GapTree = Tree[Order, Whole, Line, Looks]


def arm_plan(scene: ArmScene, job: Job) -> ArmPlan:
    """The motion of least peak base reaction force of an arm, with its proof."""
    if scene.workspace.chain.links > 2 or scene.impossible() is not None:
        return redundant(scene, job)
    settings = job.settings
    assert isinstance(settings.search, GlobalSearch)
    effort = Effort(
        settings.search.gap,
        settings.node_limit,
        settings.rounds,
        part(job.until),
        FINEST_GAP,
        scene.task.limit * (1 + 1e-6),
        hasty=True,
        progress=job.progress,
    )
    floor, search = _floor(scene), ArmSearch(scene, effort)
    planner = Planner(scene, job, part(job.until), floor)
    looked = planner.look(search.ways(), search.joined)
    # the tree finds the least peak of what stands free; what is in the way, or limited, is the planner's first
    first = bool(scene.task.obstacles) or scene.task.limited
    planned = planner.finished(looked) if first else [planner.as_it_is(one) for one in looked]
    search.planned = min((one.peak for one in planned if one.kept and one.kept.passed), default=math.inf)
    search.run()
    proof = search.proof()
    every = [plan_of(scene, settings, replace(one, proof=proof)) for one in search.motions(job)]
    if not first and not any(plan.status == "solved" for plan in every):
        planned = planner.finished(looked)
    made = [with_proof(one, proof, job, planner, effort.boxes) for one in planned]
    plan = best_plan([*every, *(plan_of(scene, settings, one) for one in made)])
    return planner.calmer(plan) if scene.task.then == "moment" else plan


def best_plan(every: list[ArmPlan]) -> ArmPlan:
    """The one that keeps all that was asked, then that of least peak; of those that do not, one that stands free."""

    def order(plan: ArmPlan) -> tuple[bool, bool, bool, bool, float]:
        passed = plan.kept is not None and plan.kept.passed
        return not plan.keeps, not passed, not plan.free, not passed and math.isinf(plan.peak_moment), plan.peak

    return min(every, key=order)


def _floor(scene: ArmScene) -> float:
    """A peak [m/s^2] that no motion is below: 4 D / T^2, with D the least distance from a start to a goal."""
    return 4 * min(one.length for one in scene.passages.values()) / scene.task.duration**2


@dataclass
class _Arc:
    """The paths that touch an arc: the bound [m/s^2], its proof, and how the best of them does so."""

    bound: float
    proof: Touching
    certificate: Certificate
    past: Maneuver


class ArmSearch:
    """The search over all passages of one task of a two-link arm.

    best: the best free motion met that keeps its elbow, with its passage, or None;  steered: one that was kept out of
    everything node by node;  turned: one that turns its elbow over;  planned: the peak of one that is known [m/s^2].
    """

    def __init__(self, scene: ArmScene, effort: Effort) -> None:
        self.scene, self.effort, self.planned = scene, effort, math.inf
        self.best: tuple[Passage, Candidate[Order]] | None = None
        self.steered: Steered | None = None
        self.turned: Steered | None = None
        self._nearest: tuple[Passage, Candidate[Order]] | None = None
        self._flood: Flood | None = None
        self._proofs: list[PassageProof] = []
        self._parted = False

    @property
    def upper(self) -> float:
        """The least peak of a free motion that is known [m/s^2]."""
        kept = math.inf if self.best is None else self.best[1].peak
        return min([kept, self.planned, *(one.peak for one in (self.steered, self.turned) if one is not None)])

    @property
    def _no(self) -> float:
        """A bound [m/s^2] that says no to max_peak."""
        return self.scene.task.limit * (1 + 1e-9)

    @property
    def _enough(self) -> float:
        """A bound [m/s^2] above which nothing more is asked: of the best motion, or a no."""
        return min((1 - self.effort.gap) * self.upper, self._no)

    def proof(self) -> ArmProof:
        """Why no motion has a smaller peak."""
        return ArmProof(tuple(self._proofs), self._flood.cells if self._parted and self._flood is not None else 0)

    def _flooded(self) -> None:
        """Joint space, looked at once, where something stands in the way."""
        if self.scene.task.obstacles and self._flood is None:
            ends = [(one.theta, one.elbow if one.keeps else None) for one in self.scene.passages.values()]
            self._flood = decisive_flood(self.scene.workspace, ends, self.effort.until)

    @property
    def joined(self) -> list[Passage]:
        """The passages whose motions are not proved impossible."""
        self._flooded()
        return [one for one in self.scene.passages.values() if self._joined(one)]

    def ways(self) -> dict[tuple[int, int], list[Array]]:
        """Ways of free joint angles (m+1, n) at even times, by the passage's indices; none without obstacles."""
        self._flooded()
        if self._flood is None:
            return {}
        limits, found = self.scene.task.arm.links[1].limits, {}
        for passage in self.joined:
            keeping = [passage.elbow] if passage.keeps else []
            every = [self._flood.way(passage.theta, elbow, limits) for elbow in (None, *keeping)]
            found[passage.indices] = [
                JointWay(self.scene.workspace, way, self.scene.task.duration).timed(coarse(self.scene))
                for way in every
                if way is not None
            ]
        return found

    def run(self) -> None:
        """Search until the gap is reached or comes down no more, or until the effort is over."""
        every, joined = list(self.scene.passages.values()), self.joined
        kept = [one for one in joined if one.keeps and self._joined(one, one.elbow)]
        self._parted = len(joined) < len(every) or any(one.keeps and one not in kept for one in joined)
        trees = {one.indices: GapTree(one.whole if self._alone(one) else one, self.effort) for one in kept}
        for tree in sorted(trees.values(), key=lambda tree: tree.lower):
            self._run(tree)
        arcs = {passage.indices: self._arcs(passage) for passage in joined if not self._alone(passage)}
        for passage in joined:
            if not passage.keeps:
                self._turn(passage, arcs[passage.indices])
        for passage in joined:
            proved = self._proved(passage, trees.get(passage.indices), arcs.get(passage.indices))
            self._proofs.append(proved)
        if trees:
            first = min(trees.values(), key=lambda tree: tree.lower)
            self._nearest = _passage_of(first), first.nearest

    def _run(self, tree: GapTree) -> None:
        """Look for the best motion that keeps its elbow, past gaps or node by node."""
        passage = _passage_of(tree)

        def steer(here: Bounded[Order]) -> None:
            way = self._way(passage, passage.elbow)
            found = steered(passage, here.past, here.certificate.times, way, self.effort.until)
            if found is not None and found.peak < min(self.upper, tree.upper):
                self.steered = found

        def told(here: Bounded[Order], count: int) -> None:
            if tree.best is None and passage.keeps and count in STEERED:
                steer(here)

        tree.run(lambda: self.upper, self._no, told)
        if passage.keeps and math.isinf(min(self.upper, tree.upper)) and tree.lower < self._no:
            steer(tree.last.here)
        if tree.best is not None and (self.best is None or tree.best.peak < self.best[1].peak):
            self.best = passage, tree.best

    def _proved(self, passage: Passage, kept: GapTree | None, arcs: list[_Arc] | None) -> PassageProof:
        """What is proved of one passage: of all its motions at once, or of those that keep their elbow and the rest."""
        if arcs is None:
            assert kept is not None
            return PassageProof(passage.indices, None, (), kept.root.trunk.branch())
        own = self._split(passage, arcs)
        whole = None
        if min((arc.bound for arc in own), default=math.inf) < self._enough:
            whole = GapTree(passage.whole, self.effort)
            upper = min(self.upper, math.inf if kept is None else kept.lower)
            whole.run(lambda: upper, self._no)
        trunks = [None if tree is None else tree.root.trunk.branch() for tree in (kept, whole)]
        return PassageProof(passage.indices, trunks[0], tuple(arc.proof for arc in own), trunks[1])

    def motions(self, job: Job) -> Iterator[Joints]:
        """The settings' control of every motion that was met; one without motion where none was."""
        kept = self.best or self._nearest
        any_motion = False
        if kept is not None:
            passage, best = kept
            least, times = raised(passage, best, job, again=self.best is not None)
            motion = least.motion(times)
            if motion is not None:
                any_motion = True
                placed, made = least.place(times) * least.mass.time, job.made(self.effort.boxes, least.count)
                path, indices = passage.joints(motion), passage.indices
                yield Found(least.maneuver, placed, path, least.peak(times), made, indices=indices)
        for one in (self.steered, self.turned):
            if one is not None:
                any_motion = True
                yield self._finer(one, job)
        if not any_motion:
            passage = next(iter(self.scene.passages.values())) if kept is None else kept[0]
            crossing = passage.maneuver if kept is None else kept[1].past
            none = np.zeros(len(crossing.walls))
            yield Found(crossing, none, None, math.inf, job.made(self.effort.boxes), indices=passage.indices)

    def _finer(self, one: Steered, job: Job) -> Joints:
        """The settings' control of a motion that is kept out of everything node by node."""
        settings = job.settings
        circle = settings.circle.facing(Frame.from_maneuver(one.course.past).angle)
        course = replace(one.course, circle=circle)
        fine = replace(one, course=course).finer(settings.grid.steps, job.until) or one
        times, made = fine.times * course.past.duration, job.made(self.effort.boxes)
        return Found(course.past, times, fine.joints, fine.peak, made, indices=course.passage.indices)

    def _joined(self, passage: Passage, elbow: float | None = None) -> bool:
        """Whether a motion, or one that keeps this elbow, is not proved impossible."""
        return self._flood is None or not self._flood.parts(passage.theta, elbow)

    def _way(self, passage: Passage, elbow: float | None = None) -> JointWay | None:
        """A way of free configurations, if one is known."""
        way = None if self._flood is None else self._flood.way(passage.theta, elbow)
        return None if way is None else JointWay(self.scene.workspace, way, self.scene.task.duration)

    def _alone(self, passage: Passage) -> bool:
        """Whether a tree of all motions is enough: without obstacles and limits both elbows see the same."""
        return passage.keeps and not self.scene.task.obstacles and passage.limits is None

    def _arcs(self, passage: Passage) -> list[_Arc]:
        arcs = []
        for edge in passage.edges:
            point = edge == "inner" and self.scene.workspace.chain.reach[0] == 0
            cuts = np.linspace(-math.pi, math.pi, (FEWEST if point else ARCS) + 1).tolist()
            arcs += [self._arc(passage, edge, arc) for arc in itertools.pairwise(cuts)]
        return arcs

    def _arc(self, passage: Passage, edge: Edge, arc: tuple[float, float]) -> _Arc:
        """The paths that touch an arc."""
        solved = []
        for one in Touching(edge, arc, ()).paths:
            past = passage.past(one)
            assert past is not None
            found = self.effort.least(past, passage.boxes(1, False), np.full(len(past.walls), 0.5), self.upper)
            solved.append((found.lower * PointMass.of(past).unit, found, past))
        bound, found, past = min(solved, key=lambda one: one[0])
        return _Arc(bound, Touching(edge, arc, tuple(tuple(one.leaves) for _, one, _ in solved)), found, past)

    def _split(self, passage: Passage, arcs: list[_Arc]) -> list[_Arc]:
        """The arcs, the lowest split until each bounds more than the best motion, or splitting gains no more."""
        waiting = Frontier((arc.bound, arc) for arc in arcs)
        if not arcs:
            return arcs
        stalled, left = 0, 1.0
        for _ in range(SPLITS):
            bound, arc = waiting.lowest, waiting.first
            a, b = arc.proof.arc
            if bound >= self._enough or b - a < NARROW or self.effort.late:
                break
            stalled, left = (0, now) if (now := 1 - bound / self.upper) < WORTH * left else (stalled + 1, left)
            if stalled >= PATIENCE:
                break
            waiting.pop()
            for half in ((a, (a + b) / 2), ((a + b) / 2, b)):
                found = self._arc(passage, arc.proof.edge, half)
                waiting.push(found.bound, found)
        return waiting.items

    def _turn(self, passage: Passage, arcs: list[_Arc]) -> None:
        """Free motions of this passage that turn the elbow over, the cheapest bound first."""
        way = self._way(passage)
        if (
            way is not None
            and (found := turn_along(passage, way, self.effort.until)) is not None
            and found.peak < self.upper
        ):
            self.turned = found
        tries = {"outer": 0, "inner": 0}
        for arc in sorted(arcs, key=lambda arc: arc.bound):
            if arc.bound >= self._enough or self.effort.late:
                return
            point = arc.proof.edge == "inner" and self.scene.workspace.chain.reach[0] == 0
            if not arc.past.walls or point or tries[arc.proof.edge] >= MOST_TURNS:
                continue
            tries[arc.proof.edge] += 1
            found = turn_on(passage, arc.proof.edge, arc.certificate, arc.past, self.effort.until)
            if found is not None and found.peak < self.upper:
                self.turned = found


def _passage_of(tree: GapTree) -> Passage:
    assert isinstance(tree.scene, Passage)
    return tree.scene
