"""An arm's motions planned in joint space: from several first motions, with fewer holds, then the best with more."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..deadline import left, over, part
from ..plan.answer import plan_of
from ..plan.arm_plan import ArmPlan
from ..plan.found import Found
from ..programs.joint_step import JointStep, Limits
from ..robots.dynamics import PlanarRobot
from ..robots.joint_motion import JointMotion
from ..robots.joints import JointPath
from ..scenes.arm_proof import ArmProof
from ..scenes.kept import Excess
from ..scenes.kinds import ArmScene, allowed
from ..scenes.passages import Passage
from ..types import Array
from .job import Job
from .joint_space import COST, STEPS, JointSearch, bang

# up to so many links there are so many holds: compiling goes with the square of holds, the fourth power of links
HOLDS = ((6, 40), (10, 20), (math.inf, 10))
FINER = 2  # times as many holds has the answer
BENT, TRIED, WIDE = 120, 4, 1.2  # bent first motions: how many are looked at, tried, and how far they bend [rad]
QUICK = 12  # steps from every start, before the best are looked at
BEST, NEXT = 3, 3  # motions that are made finer, and those that are where none of these keeps what is asked
SLOWER = 0.999  # of the largest speeds, that a first motion takes
THROUGH = 0.01  # of the arm: how deep a link may be in something between the instants that a program looks at
WORSE = 0.99  # a motion with fewer holds above this share of a better one's peak is not made finer
MISSING = 1e-6  # [scaled] of what is not kept: what counts as nothing
ALIKE = 1e-3  # relative
LEFT = 0.4  # of the time: what is looked for in many starts leaves to what makes the best of them finer
COMPILING = 0.5  # s: in less no program is worth compiling
COMPILED = 2.0  # times what compiling takes: what is needed for a program to be of use
MENDED = 5  # rounds in which what a motion does not keep between instants is asked more of
MORE, LEAST = 1.5, 1e-5  # times what is missing, and of the arm at least
DEARER = 3  # times that what is missing costs, round after round
SPARED, ROUNDING = 0.01, 1e-4  # relative: of a peak, what may be given for less moment, and what is kept back of it


Joints = Found[JointMotion | JointPath]


def coarse(scene: ArmScene) -> int:
    """Holds of motions that are looked for."""
    return next(holds for links, holds in HOLDS if scene.workspace.chain.links <= links)


@dataclass(frozen=True)
class Way:
    """A start of the planner: between which configurations, and joint angles (m+1, n) at even times."""

    passage: Passage
    angles: Array


def ways(scene: ArmScene, passage: Passage, known: Iterator[Array]) -> Iterator[Way]:
    """First motions from a start to a goal configuration: straight in the joints, the centre of mass's straight line
    lifted to the joints, ways that are known, and bent ones.
    """
    begin = np.diff(passage.theta[0], prepend=0.0)
    for goal in _goals(scene, begin, np.diff(passage.theta[1], prepend=0.0)):
        s = bang(np.linspace(0, 1, coarse(scene) + 1))[:, None]
        yield Way(passage, begin + s * (goal - begin))
        if (steady := _steady(scene, begin, goal)) is not None:
            yield Way(passage, steady)
        yield Way(passage, _lifted(scene, begin, goal, s))
    for angles in known:
        yield Way(passage, angles)


def _goals(scene: ArmScene, begin: Array, goal: Array) -> list[Array]:
    """The goal's joint angles, within limits: those nearest the start, and with one joint the other way round."""
    links = scene.task.arm.links
    options = []
    for link, q, near in zip(links, goal.tolist(), begin.tolist(), strict=True):
        low, high = link.limits or (-math.inf, math.inf)
        every = [q + math.tau * (round((near - q) / math.tau) + k) for k in (-1, 0, 1)]
        options.append(sorted((x for x in every if low - 1e-9 <= x <= high + 1e-9), key=lambda x: abs(x - near)))
    if not all(options):
        return []
    first = np.array([each[0] for each in options])
    found = [first]
    free = not scene.workspace.obstacles and not scene.workspace.pairs
    for k, each in enumerate(options):
        if len(each) > 1 and abs(each[1] - begin[k]) <= (1.5 if free else 2) * math.pi:
            other = first.copy()
            other[k] = each[1]
            found.append(other)
    return found


def _steady(scene: ArmScene, begin: Array, goal: Array) -> Array | None:
    """Joint angles that speed up as late and as little as their largest speeds let them: trapezoids of their speeds.

    None where half of the time each, faster and slower, is within these.
    """
    t, T = np.linspace(0, 1, coarse(scene) + 1)[:, None], scene.task.duration
    most = np.array([link.max_speed or math.inf for link in scene.task.arm.links]) * T * SLOWER
    way = np.abs(goal - begin)
    if not np.any(way * 2 > most):
        return None
    ramp = np.clip(1 - way / most, 1 / coarse(scene), 0.5)  # of the time, faster and slower each
    reached = np.where(
        t < ramp, t**2 / (2 * ramp), np.where(t < 1 - ramp, t - ramp / 2, 1 - ramp - (1 - t) ** 2 / (2 * ramp))
    )
    return np.asarray(begin + (goal - begin) * reached / (1 - ramp))


def _lifted(scene: ArmScene, begin: Array, goal: Array, shares: Array) -> Array:
    """Joint angles whose centre of mass goes about straight: q' = J+ (c_1 - c_0) + (1 - J+ J) towards the goal."""
    robot = PlanarRobot(scene.workspace.chain)
    step, q = robot.centre(goal) - robot.centre(begin), begin.copy()
    places = [begin]
    for a, b in zip(shares[:-1, 0], shares[1:, 0], strict=True):
        jacobian, left = robot.jacobian(q), max(1 - a, 1e-9)
        inverse = np.linalg.pinv(jacobian, rcond=0.05)
        towards = (goal - q) / left
        q = q + (b - a) * (inverse @ step + towards - inverse @ (jacobian @ towards))
        places.append(q)
    way = np.array(places)
    way = way + shares * (goal - way[-1])
    return way if np.max(np.abs(way - begin)) < 2 * math.pi else begin + shares * (goal - begin)


@dataclass(frozen=True, eq=False)
class Motion:
    """What the planner has come to: accelerations (N, n) [scaled], peak [m/s^2] and what is missing at instants."""

    way: Way
    begin: Array
    held: Array
    peak: float
    missing: float

    @property
    def order(self) -> tuple[bool, float, float]:
        """The best first."""
        return self.missing > MISSING, self.missing if self.missing > MISSING else 0.0, self.peak


class Planner:
    """The planner of one task: all of its passages."""

    def __init__(self, scene: ArmScene, job: Job, until: float, floor: float) -> None:
        """floor: a peak [m/s^2] that no motion is below."""
        self.scene, self.job, self.until, self.floor = scene, job, until, floor
        self.programs: dict[tuple[object, ...], JointStep] = {}
        self.steps, self.coarse = 0, coarse(scene)
        self.fine = FINER * self.coarse
        self._scale = scene.size / scene.task.duration**2
        self._cost = COST * max(floor / self._scale, 1e-3)

    def limits(self, begin: Array, end: Array) -> Limits:
        """Those of the arm, in SI units; torques only where they are stated."""
        links, may, inf = self.scene.task.arm.links, allowed(self.scene.task, begin, end), math.inf
        torque = np.array([link.max_torque or inf for link in links])
        if self.scene.task.max_moment is not None:
            torque[0] = min(torque[0], self.scene.task.max_moment)
        low, high = np.transpose([link.limits or (-inf, inf) for link in links])
        return Limits(low, high, may.speed, may.acceleration, torque)

    def search(self, begin: Array, end: Array, holds: int, until: float | None = None) -> JointSearch:
        workspace, T = self.scene.workspace, self.scene.task.duration
        room, until = 1e-4 * self.scene.size if workspace.obstacles or workspace.pairs else 0.0, until or self.until
        return JointSearch(workspace, T, self.limits(begin, end), holds, until, room, programs=self.programs)

    def look(self, known: dict[tuple[int, int], list[Array]], passages: list[Passage]) -> list[Motion]:
        """Motions with few holds, best first: from every start in few steps, from what came out best in as many as pay.

        known: ways of joint angles (m+1, n) at even times, by the passage's indices.
        """
        for passage in passages:
            if np.all(passage.theta[0] == passage.theta[1]):  # to stay is the best that can be done
                begin = np.diff(passage.theta[0], prepend=0.0)
                way = Way(passage, np.tile(begin, (self.coarse + 1, 1)))
                return [Motion(way, begin, np.zeros((self.coarse, len(begin))), 0.0, 0.0)]
        found: list[Motion] = []
        until = part(self.until, LEFT, math.inf)
        for passage in passages:
            for way in self._every(passage, known.get(passage.indices, []), until):
                if found and (over(until) or self._least(found)):
                    break
                search = self.search(way.angles[0], way.angles[-1], self.coarse, until)
                found.append(self._further(search, way, search.along(way.angles), QUICK))
        every = _unlike(sorted(found, key=lambda one: one.order))
        best = _worth_it(every)[:BEST]
        others = [one for one in every if one not in best][:NEXT]
        for k, one in enumerate(best):
            if not self._least(best):
                search = self.search(one.begin, one.way.angles[-1], self.coarse, until)
                best[k] = self._further(search, one.way, one.held, STEPS)
        return sorted(best, key=lambda one: one.order) + others

    def _least(self, found: list[Motion]) -> bool:
        """Whether one is as good as none can be better than."""
        return any(one.missing <= MISSING and one.peak <= self.floor * (1 + 1e-3) for one in found)

    def _further(self, search: JointSearch, way: Way, held: Array, steps: int) -> Motion:
        """What some steps make of a motion."""
        begin = way.angles[0]
        if self.steps or left(self.until) > COMPILING:
            held = search.improved(begin, held, self._cost, self.floor / self._scale, steps)
        self.steps += search.count
        peak, missing = search.score(begin, held)
        through = float(np.max(search.short(begin, held))) / self.scene.size - THROUGH
        return Motion(way, begin, held, peak, missing + max(through, 0.0))

    def finished(self, motions: list[Motion]) -> list[Joints]:
        """The best of motions with more holds; none where there are none."""
        out: list[Joints] = []
        for motion in motions:
            if out and over(self.until):
                break
            least = min((one.peak for one in out if one.kept is not None and one.kept.passed), default=math.inf)
            if least <= max(self.floor * (1 + 2e-3), WORSE * motion.peak):
                break
            if math.isfinite(least) and motion.missing > MISSING:
                continue
            made = self._finer(motion) if self._pays and motion.peak > 0 else self.as_it_is(motion)
            if made is not None:
                out.append(made)
        return sorted(out, key=lambda one: (one.kept is None or not one.kept.passed, one.peak))[:1]

    @property
    def _pays(self) -> bool:
        """Whether the time left is enough for a program of the finest holds, which takes the longer to compile."""
        took = max((one.compiled for (holds, *_), one in self.programs.items() if holds == self.coarse), default=0.0)
        # none compiled: there was less time than for one, or nothing to make better with few holds
        return left(self.until) > (COMPILED * FINER**2 * took or COMPILING)

    def as_it_is(self, motion: Motion) -> Joints:
        """A motion with the holds that it has, with what it keeps."""
        return self._found(motion, self.search(motion.begin, motion.way.angles[-1], self.coarse), motion.held)

    def _found(self, motion: Motion, search: JointSearch, held: Array) -> Joints:
        made, passage = search.motion(motion.begin, held), motion.way.passage
        nothing, job = np.zeros(0), self.job.made(0)
        kept = self.scene.kept(made, rough=True)
        return Found(passage.maneuver, nothing, made, made.peak[0], job, indices=passage.indices, kept=kept)

    def _every(self, passage: Passage, known: list[Array], until: float) -> Iterator[Way]:
        every = list(ways(self.scene, passage, iter(known)))
        yield from every
        if not every:
            return
        straight, rng = every[0].angles, np.random.default_rng(0)
        s = math.pi * bang(np.linspace(0, 1, self.coarse + 1))[:, None]
        look = self.search(straight[0], straight[-1], self.coarse)
        links = self.scene.task.arm.links
        ranges = np.array([link.limits or (-math.inf, math.inf) for link in links])
        bent: list[tuple[float, float, Array]] = []
        for _ in range(BENT):
            if over(until):
                return
            once, twice = rng.normal(size=(2, straight.shape[1])) * WIDE
            angles = np.clip(straight + np.sin(s) * once + np.sin(2 * s) * twice / 2, *ranges.T)
            peak, missing = look.score(angles[0], look.along(angles))
            bent.append((missing, peak, angles))
        bent.sort(key=lambda one: (round(one[0], 2), one[1]))
        for _, _, angles in bent[:TRIED]:
            yield Way(passage, angles)

    def _finer(self, motion: Motion) -> Joints | None:
        """The same with more holds, as often as what it does not keep between instants asks for."""
        begin, end = motion.begin, motion.way.angles[-1]
        search = self.search(begin, end, self.fine)
        held = np.repeat(motion.held, FINER, axis=0)
        best: Joints | None = None
        for _ in range(MENDED):
            held = search.improved(begin, held, self._cost, self.floor / self._scale)
            now = self._found(motion, search, held)
            kept, made = now.kept, now.motion
            assert kept is not None
            assert isinstance(made, JointMotion)
            if best is None or (not kept.passed, now.peak) < (best.kept is None or not best.kept.passed, best.peak):
                best = now
            if kept.passed or over(self.until):
                break
            search = self._stricter(search, kept.excesses, made)
        self.steps += search.count
        return best

    def calmer(self, plan: ArmPlan) -> ArmPlan:
        """Of motions with a peak at most a hundredth above a plan's, one near it with the least base moment."""
        path, passage = plan.joints, self.scene.passages[plan.indices]
        if path is None or not plan.keeps:
            return plan
        begin, end, accept = path.angles(0.0), path.angles(path.duration), self.job.settings.search.accept
        most = min((1 + SPARED) * plan.peak, self.scene.task.limit)
        if plan.status == "solved":  # and stays so
            most = min(most, plan.lower_bound / (1 - accept))
        search = replace(self.search(begin, end, self.fine), until=self.job.until, peak=most * (1 - ROUNDING))
        angles = path.angles(np.linspace(0, path.duration, self.fine + 1))
        motion = Motion(Way(passage, angles), begin, search.along(angles), plan.peak, 0.0)
        held, best = motion.held, plan
        cost = COST * search.moment(begin, held)
        for k in range(MENDED):
            held = search.improved(begin, held, DEARER**k * cost)
            now = self._found(motion, search, held)
            made, kept = now.motion, now.kept
            assert kept is not None
            assert isinstance(made, JointMotion)
            if kept.passed and now.peak <= most:
                calm = with_proof(now, plan.proof, self.job, self, plan.made.nodes)
                other = plan_of(self.scene, self.job.settings, calm)
                best = other if other.keeps and other.peak_moment < best.peak_moment else best
                break
            if over(self.job.until):
                break
            stricter = self._stricter(search, kept.excesses, made)
            search = replace(
                stricter, peak=min(most / (now.peak or most), 1.0) * (search.peak or most) * (1 - ROUNDING)
            )
        self.steps += search.count
        return best

    def _stricter(self, search: JointSearch, excesses: tuple[Excess, ...], made: JointMotion) -> JointSearch:
        """A search that asks more of what was not kept."""
        limits, room = search.limits, search.room
        for one in excesses:
            if one.field in ("obstacles", "arm.self_margin"):
                short = search.short(made.begin, made.held * made.duration**2)[int(one.field == "arm.self_margin")]
                short = np.maximum(short + max(one.amount - float(np.max(short)), 0.0), 0.0)
                room = room + MORE * np.where(short > 0, short + LEAST * self.scene.size, 0.0)
            elif one.field.endswith("max_torque") or one.field == "max_moment":
                k = int(one.field.split("[")[1].split("]")[0]) if "[" in one.field else 0
                may = allowed(self.scene.task, made.begin, made.angles(made.duration)).torque[k]
                if one.field == "max_moment" and self.scene.task.max_moment is not None:
                    may = self.scene.task.max_moment
                torque = limits.torque.copy()
                torque[k] = min(torque[k], may) - MORE * min(one.amount, 0.1 * may)
                limits = replace(limits, torque=torque)
        return replace(search, limits=limits, room=room)


def _unlike(motions: list[Motion]) -> list[Motion]:
    """Those that are not about as good as one before, which they mostly are the same as."""
    out: list[Motion] = []
    for one in motions:
        if all(abs(one.peak - other.peak) > ALIKE * other.peak or one.missing > MISSING for other in out):
            out.append(one)
    return out


def _worth_it(motions: list[Motion]) -> list[Motion]:
    """Of the best first: without those that keep less than it does for a higher peak."""
    return [one for one in motions if one.missing <= MISSING or one.peak < motions[0].peak or one is motions[0]]


def with_proof(found: Joints, proof: ArmProof, job: Job, planner: Planner, boxes: int) -> Joints:
    """What was found, with what proves that there is no better one, to be looked at exactly."""
    made = job.made(boxes)
    told = replace(made, solves=made.solves + planner.steps, compilations=len(planner.programs))
    return replace(found, proof=proof, made=told, kept=None)
