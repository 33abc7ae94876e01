"""What each kind of task is moved in: the only place that asks of which kind a task is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import ClassVar, Literal, Protocol, TypeVar, overload

import numpy as np

from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Proof
from ..proofs.double_integrator import PointMass
from ..robots.dynamics import PlanarRobot
from ..robots.extremes import Extremes, extremes
from ..robots.joint_motion import JointMotion
from ..robots.joints import JointPath
from ..robots.kinematics import ANGLE
from ..robots.link_clearance import LinkClearance, link_clearance, self_clearance
from ..robots.workspace import Workspace
from ..spec.arm import ArmManeuver, postures
from ..spec.maneuver import Maneuver
from ..spec.task import Task
from ..types import Array
from .arm_proof import ArmProof
from .blocks import BlockClasses, BlockProof, ListedProof
from .cells import Cells
from .impossible import Impossible, impossible, too_slow
from .kept import Closed, Excess, Keeping, Kept, closed_behind, extent, keeping, verdict
from .passages import Passage, passages

Motion = TypeVar("Motion", contravariant=True)
Why = TypeVar("Why", contravariant=True)
PointProof = Proof | BlockProof | ListedProof

LIMITED, UNITS = ("max_speed", "max_acceleration", "max_torque"), ("rad/s", "rad/s^2", "N m")
TIMES = 10.0  # what the straight motion of the joints needs: the most where an arm states nothing
INSTANTS = 400  # of the straight motion
GRAIN, TINY = 1e-9, 1e-12  # relative, and of the task's own units: rounding errors of a joint at its limit
ARRIVED = 1e-9  # of the largest joint speed: what a sum of held accelerations may leave at the goal
BESIDE, REST = 1e-7, 1e-3  # of the duration, and of the largest joint speed: what counts as at rest
LANDED = 1e-5  # rad: close to a stretched arm angles go with the root of a distance


class Setting(Protocol[Motion, Why]):
    """What a task moves in, made once for its search, its plan and its verification.

    A motion is one of the centre of mass, or of the joints that move it.
    """

    @property
    def task(self) -> Task:
        """What is asked."""

    @property
    def size(self) -> float:
        """What lengths are measured by [m]."""

    def centre(self, motion: Motion) -> Trajectory:
        """The motion of the centre of mass."""

    def joins(self, motion: Motion, indices: tuple[int, int]) -> bool:
        """Whether a motion leads from the start to the goal, of these configurations of each."""

    def kept(self, motion: Motion) -> Kept:
        """What a motion keeps at every instant, proved between the nodes."""

    def bound(self, proof: Why, times: Array) -> float:
        """The lower bound [m/s^2] that a proof gives, evaluated anew, at a plan's obstacle times [s], (q,).

        Infinite where there is no motion.
        """

    def impossible(self) -> Impossible | None:
        """Why there is no motion at all, or None where nothing of it is shown."""


@dataclass(frozen=True)
class ArmKept(Kept):
    """clear: the distances that are behind it;  extremes: what the joints do at most."""

    clear: LinkClearance
    extremes: Extremes


@dataclass(frozen=True)
class PointScene:
    """A centre of mass among walls and blocks."""

    kind: ClassVar[Literal["point"]] = "point"

    task: Maneuver

    @cached_property
    def size(self) -> float:
        """[m]"""
        return extent(self.task)

    @cached_property
    def mass(self) -> PointMass:
        """The maneuver past its own walls, in scaled units."""
        return PointMass.of(self.task.past(self.task.walls))

    @cached_property
    def classes(self) -> BlockClasses | None:
        """The classes of paths past the blocks; None without blocks, where there is one class."""
        return BlockClasses(Cells(self.task), self._keeping) if self.task.blocks else None

    @cached_property
    def _closed(self) -> Closed:
        return cache(partial(closed_behind, self.task))

    def _keeping(self, motion: Trajectory) -> Keeping:
        return keeping(self.task, motion, self._closed)

    def centre(self, motion: Trajectory) -> Trajectory:
        return motion

    def joins(self, motion: Trajectory, indices: tuple[int, int]) -> bool:
        """Always: `check_motion` looks at the ends of a centre of mass's motion."""
        return True

    def kept(self, motion: Trajectory) -> Kept:
        return verdict(self.task, self._keeping(motion))

    def impossible(self) -> Impossible | None:
        return impossible(self.task)

    def bound(self, proof: PointProof, times: Array) -> float:
        if self.classes is not None:
            assert not isinstance(proof, Proof)
            return proof.bound(self.classes)
        assert isinstance(proof, Proof)
        return proof.bound(self.mass, times / self.mass.time) * self.mass.unit


@dataclass(frozen=True)
class ArmScene:
    """An arm among obstacles."""

    kind: ClassVar[Literal["arm"]] = "arm"

    task: ArmManeuver

    @cached_property
    def workspace(self) -> Workspace:
        """The arm and the polygons that no link may touch."""
        return self.task.workspace

    @property
    def size(self) -> float:
        """Length of the stretched arm [m]."""
        return self.workspace.size

    @cached_property
    def passages(self) -> dict[tuple[int, int], Passage]:
        """Every free start configuration with every free goal configuration, by their indices."""
        return {one.indices: one for one in passages(self.task, self.workspace)}

    def centre(self, motion: JointMotion | JointPath) -> Trajectory:
        return motion.motion

    def joins(self, motion: JointMotion | JointPath, indices: tuple[int, int]) -> bool:
        """At rest at both ends; full turns of the start included, up to full turns of the goal."""
        # a stretched arm's joints may turn where its centre of mass rests, and so may those of three links
        inside = np.linspace(BESIDE, 1 - BESIDE, INSTANTS + 1) * motion.duration
        speeds = np.max(np.abs(np.diff(motion.rates(inside)[1], axis=-1, prepend=0.0)), axis=-1)
        if not max(speeds[0], speeds[-1]) <= REST * np.max(speeds):
            return False
        if isinstance(motion, JointMotion) and not np.max(np.abs(motion.at_nodes[1][-1])) <= ARRIVED * np.max(speeds):
            return False
        begun = np.max(np.abs(motion.absolute(0.0) - self.passages[indices].theta[0])) < LANDED
        wanted, last = postures(self.task.arm, self.task.goal), motion.absolute(motion.duration)
        apart = [np.abs((last - one + np.pi) % (2 * np.pi) - np.pi) for one in wanted]
        return bool(begun) and min(float(np.max(one)) for one in apart) < LANDED

    def kept(self, motion: JointMotion | JointPath, rough: bool = False) -> ArmKept:
        """rough: whether distances above what is asked need not be found exactly."""
        clear, most = link_clearance(self.workspace, motion, rough), extremes(motion)
        out = [] if clear.short(self.workspace) == 0 else [_too_close(clear, self.workspace)]
        least, at = self_clearance(self.workspace, motion)
        short = (self.task.arm.self_margin or 0.0) - least
        if short > 0:
            said = f"arm.self_margin: two links come {short:.6g} m too close to each other about {at:.4g} s"
            out.append(Excess("arm.self_margin", short, "m", said))
        return ArmKept(clear.least, clear.at, (*out, *beyond_limits(self.task, motion, most)), clear, most)

    def impossible(self) -> Impossible | None:
        return too_slow(self.task, [(one.theta[0], one.theta[1]) for one in self.passages.values()])

    def bound(self, proof: ArmProof, times: Array) -> float:
        return proof.bound(self.workspace, self.passages)


def _too_close(clear: LinkClearance, workspace: Workspace) -> Excess:
    """Why a motion does not keep clear of the obstacles, within reach and steady."""
    short = clear.short(workspace)
    if not clear.steady:
        return Excess("arm", short, "m", "arm: a joint jumps, as where a folded arm passes its base")
    if workspace.margin - clear.least >= short:
        return Excess("obstacles", short, "m", f"obstacles: a link comes {short:.6g} m too close")
    return Excess("arm", short, "m", f"arm: the path leaves its reach by {-clear.within:.6g} m")


@dataclass(frozen=True)
class Allowed:
    """What the joints may do, (n,) each: |q'| [rad/s], |q''| [rad/s^2], |tau| [N m].

    Where the arm states nothing it is TIMES what the straight motion of the joints, a quintic from rest to rest, asks
    of that joint which it asks most of.
    """

    speed: Array
    acceleration: Array
    torque: Array


def allowed(task: ArmManeuver, begin: Array, end: Array) -> Allowed:
    """For motions from one configuration to another, joint angles (n,) each.

    q = q_0 + (q_1 - q_0) (10 s^3 - 15 s^4 + 6 s^5), s = t/T, has |q'| <= 15/8 |dq|/T and |q''| <= 10/sqrt(3) |dq|/T^2.
    """
    T, turn, robot = task.duration, end - begin, PlanarRobot(task.arm.chain)
    s = np.linspace(0, 1, INSTANTS + 1)[:, None]
    way = (
        begin + turn * s**3 * (10 - 15 * s + 6 * s**2),
        turn * 30 * s**2 * (1 - s) ** 2 / T,
        turn * 60 * s * (1 - s) * (1 - 2 * s) / T**2,
    )
    asked = (15 / 8 * np.abs(turn) / T, 10 / 3**0.5 * np.abs(turn) / T**2, np.abs(robot.torques(way)))
    stated = [[getattr(link, name) for link in task.arm.links] for name in LIMITED]
    return Allowed(
        *(
            np.array([TIMES * float(np.max(most)) if own is None else own for own in every])
            for most, every in zip(asked, stated, strict=True)
        )
    )


def beyond_limits(task: ArmManeuver, motion: JointMotion | JointPath, found: Extremes) -> list[Excess]:
    """What of the joints' limits, and of the bound on the base moment, a motion does not keep at some instant."""
    return beyond(task, motion.angles(0.0), motion.angles(motion.duration), found)


def beyond(task: ArmManeuver, begin: Array, end: Array, found: Extremes) -> list[Excess]:
    """The same of what joints do at most from one configuration to another, joint angles (n,) each."""
    out = []
    for k, link in enumerate(task.arm.links):
        low, high = float(found.low[k]), float(found.high[k])
        if link.limits is not None and not (link.limits[0] - ANGLE <= low and high <= link.limits[1] + ANGLE):
            most = max(link.limits[0] - low, high - link.limits[1])
            name = f"arm.links[{k}].limits"
            out.append(Excess(name, most, "rad", f"{name}: the joint goes from {low:.6g} to {high:.6g} rad"))
    may = allowed(task, begin, end)
    T, chain = task.duration, task.arm.chain
    units = (1 / T, 1 / T**2, chain.total * (chain.size / T) ** 2)
    for name, what, unit, size in zip(LIMITED, ("speed", "acceleration", "torque"), UNITS, units, strict=True):
        reached, most = getattr(found, what), getattr(may, what)
        for k in np.flatnonzero(~(reached <= most * (1 + GRAIN) + TINY * size)).tolist():
            field, at = f"arm.links[{k}].{name}", float(found.when[what][k])
            stated = getattr(task.arm.links[k], name) is not None
            why = "" if stated else f", above {most[k]:.3g} (not given: {TIMES:g} times the straight joint motion's)"
            much = f"{reached[k]:.4g} {unit}" if np.isfinite(reached[k]) else f"no bounded {what}"
            said = f"{field}: the joint reaches {much} about {at:.4g} s{why}"
            out.append(Excess(field, float(reached[k] - most[k]), unit, said, stated))
    if task.max_moment is not None and not found.moment <= task.max_moment * (1 + GRAIN):
        said = f"max_moment: the base feels {found.moment:.6g} N m"
        out.append(Excess("max_moment", found.moment - task.max_moment, "N m", said))
    return out


@overload
def scene_of(task: Maneuver) -> PointScene: ...
@overload
def scene_of(task: ArmManeuver) -> ArmScene: ...
@overload
def scene_of(task: Task) -> PointScene | ArmScene: ...
def scene_of(task: Task) -> PointScene | ArmScene:
    """What a task moves in."""
    if isinstance(task, ArmManeuver):
        return ArmScene(task)
    assert isinstance(task, Maneuver)
    return PointScene(task)
