"""An arm's answer: the joints' motion of least peak base reaction force, what it keeps, and its bound."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ..byname import found
from ..files import csv_text
from ..geometry.trajectory import Trajectory
from ..proofs.sensitivity import Sensitivities
from ..robots.extremes import Extremes, extremes
from ..robots.joint_motion import JointMotion
from ..robots.joints import JointPath, base_moment, torques
from ..robots.link_clearance import LinkClearance, link_clearance
from ..robots.workspace import Contact, Workspace
from ..scenes.arm_proof import ArmProof
from ..scenes.kept import Kept
from ..scenes.kinds import Allowed, ArmKept, ArmScene, allowed, scene_of
from ..scenes.passages import Passage
from ..spec.arm import ArmManeuver, ArmTask
from ..spec.settings import Settings
from ..spec.spec import ArmSpec
from ..types import Array, Axes, Json
from .document import (
    ArmDocument,
    ExtremesDocument,
    HeldDocument,
    PathDocument,
    Status,
    arm_proof_document,
    arm_proof_of,
    known,
    knowns,
    shaped,
    signed,
    unknown,
)
from .found import Found, Made
from .older import read_as
from .plan import Plan

NEAR = 1e-3  # of the arm: how close to the margin counts as a contact
LOOKS = 1000  # at a motion, for links that pass over one another


@dataclass(frozen=True, eq=False, repr=False)
class ArmPlan(Plan):
    """A motion of an arm, from pose to pose.

    As `Plan`, and
    indices: which of the configurations that start and goal allow, in the order up, down.
    joints: the joints' motion, None where there is none.
    clear: the least distance of the links from the obstacles at any instant.
    lower_bound: no motion whatsoever has a smaller peak.
    """

    kind: ClassVar[str] = "arm"

    maneuver: ArmManeuver  # type: ignore[assignment]
    proof: ArmProof  # type: ignore[assignment]
    indices: tuple[int, int]
    joints: JointMotion | JointPath | None
    clear: LinkClearance | None

    @classmethod
    def of(  # type: ignore[override]
        cls, scene: ArmScene, settings: Settings, status: Status, bound: float, given: Found[JointMotion | JointPath]
    ) -> Self:
        path, kept = given.motion, given.kept
        assert given.multipliers is not None
        assert isinstance(given.proof, ArmProof)
        return cls(
            scene.task,
            settings,
            status,
            None if path is None else path.motion,
            given.crossing,
            given.times,
            np.inf if kept is None else kept.clearance,
            given.peak,
            bound,
            given.proof,
            given.multipliers,
            given.made,
            given.indices,
            path,
            kept.clear if isinstance(kept, ArmKept) else None,
        )

    @cached_property
    def scene(self) -> ArmScene:  # type: ignore[override]
        """What the arm moves in."""
        return scene_of(self.maneuver)

    @property
    def free(self) -> bool:
        """Whether there is a motion that keeps clear of the obstacles and within reach."""
        return self.clear is not None and self.clear.short(self.scene.workspace) == 0

    @cached_property
    def kept(self) -> Kept | None:
        """What the motion keeps of what was asked, computed anew between the nodes too; None where there is none."""
        return None if self.joints is None else self.scene.kept(self.joints)

    @property
    def sensitivities(self) -> Sensitivities:
        """An arm's walls are not its user's: there are none."""
        raise AttributeError("an arm's plan has no sensitivities")

    def _path(self) -> JointMotion | JointPath:
        if self.joints is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.joints

    def angles(self, t: ArrayLike) -> Array:
        """Joint angles [rad] at t [s], shape (...) -> (..., n)."""
        return self._path().angles(t)

    def joint_positions(self, t: ArrayLike, *, clamp: bool = False) -> Array:
        """Joint angles q(t) [rad], each link against the one before, shape (...) -> (..., n).

        Args:
            t: instants [s], from 0 to the duration.
            clamp: take instants outside as the nearer end.

        Raises:
            ValueError: for an instant outside, or where the plan has no motion.
        """
        return self._path().angles(self._within(t, clamp))

    def joint_velocities(self, t: ArrayLike, *, clamp: bool = False) -> Array:
        """Joint speeds q'(t) [rad/s], shape (...) -> (..., n); arguments and errors as of `joint_positions`."""
        return np.diff(self._path().rates(self._within(t, clamp))[1], axis=-1, prepend=0.0)

    def joint_accelerations(self, t: ArrayLike, *, clamp: bool = False) -> Array:
        """Joint accelerations q''(t) [rad/s^2], shape (...) -> (..., n), at a switch of the control those after it;
        arguments and errors as of `joint_positions`.
        """
        return np.diff(self._path().rates(self._within(t, clamp))[2], axis=-1, prepend=0.0)

    def _within(self, t: ArrayLike, clamp: bool) -> Array:
        """The instants as an array [s]. Raises `ValueError` where one is outside of the motion."""
        end, t = self._path().duration, np.asarray(t, dtype=float)
        t = np.clip(t, 0, end) if clamp else t
        outside = t[~((t >= 0) & (t <= end))]
        if outside.size:
            raise ValueError(f"t: was {float(outside[0])!r} s, must be from 0 to {end!r} s (clamp=True takes the ends)")
        return t

    def tip(self, t: ArrayLike) -> Array:
        """Position of the tip [m] at t [s], shape (...) -> (..., 2)."""
        path = self._path()
        return path.chain.tip(path.absolute(t))

    def base_moment(self, t: ArrayLike) -> Array:
        """Moment about the first joint that the base exerts on the robot [N m], shape (...)."""
        return base_moment(self._path(), t)

    def torques(self, t: ArrayLike) -> Array:
        """Joint torques [N m] at t [s] by inverse dynamics, shape (...) -> (..., n)."""
        return torques(self._path(), t)

    @property
    def elbow_changes(self) -> tuple[float, ...]:
        """Times [s] at which the elbow turns over: of two links where they are in line."""
        if self.joints is None:
            return ()
        return self.joints.changes if isinstance(self.joints, JointPath) else self.joints.straight

    @cached_property
    def contacts(self) -> list[Contact]:
        """What the arm is nearest to at the contact times."""
        if self.joints is None or not self.maneuver.obstacles:
            return []
        return [self.scene.workspace.nearest(self.joints.absolute(t)) for t in self.contact_times]

    @cached_property
    def contact_times(self) -> list[float]:
        """Times [s] at which the arm is about as close to an obstacle as the margin allows: the obstacle times at which
        it is; where it is at none of them that of the closest approach, if it is there.
        """
        if self.joints is None or self.clear is None or not self.maneuver.obstacles:
            return []
        workspace = self.scene.workspace
        near = self.maneuver.margin + NEAR * workspace.size
        at = self.obstacle_times[
            np.min(workspace.clearance(self.joints.absolute(self.obstacle_times)), axis=-1) <= near
        ]
        return at.tolist() or ([self.clear.at] if self.clear.least <= near else [])

    @cached_property
    def exceeded(self) -> list[str]:
        """What of its own limits, of the base's moment and of links' distances the motion does not keep, in words."""
        excesses = () if self.kept is None else self.kept.excesses
        return [one.words for one in excesses if one.field not in ("obstacles", "arm")]

    @cached_property
    def extremes(self) -> Extremes | None:
        """What the joints do at most at any instant; None where there is no motion."""
        if self.joints is None:
            return None
        kept = self.kept
        return kept.extremes if isinstance(kept, ArmKept) else extremes(self.joints)

    @property
    def allowed(self) -> Allowed | None:
        """What the joints may do: their limits, or what counts where the arm states none; None without a motion."""
        path = self.joints
        return None if path is None else allowed(self.maneuver, path.angles(0.0), path.angles(path.duration))

    @cached_property
    def passing_over(self) -> list[tuple[int, int, float]]:
        """Links i < j, counted from 0, that share no joint and pass over one another, and the middle of the first time
        [s] that they do; of an arm without a `self_margin`.
        """
        if self.joints is None or self.maneuver.arm.self_margin is not None:
            return []
        alone, t = Workspace(self.joints.chain, (), 0.0, 0.0), np.linspace(0, self.joints.duration, LOOKS + 1)
        out = []
        for (i, j), over in zip(alone.pairs, (alone.apart(self.joints.absolute(t)) <= 0).T, strict=True):
            if np.any(over):
                first = int(np.argmax(over))
                out.append((i, j, float(t[first] + t[first + int(np.argmin([*over[first:], False])) - 1]) / 2))
        return out

    @property
    def peak_moment(self) -> float:
        """The largest moment that the base feels at any instant [N m]; infinite where it is not bounded."""
        return np.inf if self.extremes is None else self.extremes.moment

    def plot(self, ax: Axes | None = None) -> Axes:
        """The arm's poses over its obstacles; see `peakmin.view` for more."""
        return found("peakmin.view.paths:poses")(self, ax=ax)

    def document(self) -> Json:
        """The plan as plain JSON data."""
        task, path = self.maneuver, self.joints
        fields = self._fields()
        spec = ArmSpec(
            arm=task.arm,
            maneuver=ArmTask(**{name: getattr(task, name) for name in ArmTask.model_fields}),
            settings=self.settings,
        )
        return signed(
            ArmDocument,
            **fields,
            indices=self.indices,
            contacts=[str(contact) for contact in self.contacts],
            exceeded=self.exceeded,
            joints=[] if path is None else path.angles(np.array(fields["times"])).tolist(),
            path=_path_document(path) if isinstance(path, JointPath) else None,
            held=_held_document(path) if isinstance(path, JointMotion) else None,
            peak_moment=known(self.peak_moment),
            extremes=None if self.extremes is None else _extremes_document(self.extremes),
            proof=arm_proof_document(self.proof),
            spec=spec,
        )

    @classmethod
    def stated_by(cls, document: ArmDocument) -> Self:  # type: ignore[override]
        """The plan that a document states. Raises `ValueError` where it states none."""
        task, q = document.spec.task, len(document.walls)
        scene = scene_of(task)
        if document.indices not in scene.passages:
            raise ValueError("a plan is of configurations that are none")
        passage = scene.passages[document.indices]
        held = None if document.held is None else _held_of(document.held, passage)
        motion: Trajectory | None = None if held is None else held.motion
        path: JointMotion | JointPath | None = held
        if document.path is not None:
            if held is not None:
                raise ValueError("joints follow a path or hold accelerations, not both")
            motion = document.motion(passage.maneuver)
            if motion is None:
                raise ValueError("joints without a motion")
            path = _path_of(document.path, motion, passage)
        clear = None if path is None else link_clearance(scene.workspace, path)
        return cls(
            task,
            document.spec.settings,
            document.status,
            motion,
            passage.maneuver.past(document.walls),
            shaped(document.obstacle_times, q),
            np.inf if clear is None else clear.least,
            unknown(document.peak),
            unknown(document.lower_bound),
            arm_proof_of(document.proof, scene.passages),
            np.zeros((2 + q, passage.maneuver.dimension)),
            Made(**document.made.model_dump()),
            document.indices,
            path,
            clear,
        )

    @property
    def size(self) -> float:
        return self.scene.size

    @property
    def units(self) -> dict[str, float]:
        size, T = self.scene.size, self.maneuver.duration
        centre = {"position": size, "velocity": size / T, "acceleration": size / T**2}
        return centre | {"joints": 1.0, "clearance": size, "others": 1.0}

    @property
    def joined(self) -> bool:
        return self.joints is None or self.scene.joins(self.joints, self.indices)

    def misstated(self) -> list[str]:
        """Nothing: an arm's plan states no multipliers."""
        return []

    @classmethod
    def from_json(cls, text: str | bytes) -> Self:
        """The plan that `to_json` wrote, as `Plan.from_json`."""
        return read_as(ArmDocument, cls.stated_by, text)

    def to_csv(self, rate: float | None = None) -> str:
        """Text: rows t, joint angles, speeds, accelerations, torques, centre of mass, base force and moment [SI].

        Args:
            rate: as of `instants`, which the rows are at.
        """
        t, n = self.instants(rate), len(self.maneuver.arm.links)
        joints = [self.angles(t), *(np.diff(x, axis=-1, prepend=0.0) for x in self._path().rates(t)[1:])]
        columns = [t, *joints, self.torques(t), self.position(t), self.base_force(t), self.base_moment(t)]
        names = [f"{name}{k + 1}" for name in ("q", "dq", "ddq", "tau") for k in range(n)]
        return csv_text(["t", *names, "x", "y", "fx", "fy", "moment"], np.column_stack(columns).tolist())

    def __repr__(self) -> str:
        return (
            f"ArmPlan({self.status}, peak={self.peak:.9g}, lower_bound={self.lower_bound:.9g}, "
            f"clearance={self.clearance:.6g})"
        )


def _held_document(motion: JointMotion) -> HeldDocument:
    return HeldDocument(nodes=motion.nodes.tolist(), begin=motion.begin.tolist(), held=motion.held.tolist())


def _held_of(stated: HeldDocument, passage: Passage) -> JointMotion:
    """The motion of the joints that a document states. Raises `ValueError` where it is none of this arm."""
    chain, nodes = passage.workspace.chain, np.array(stated.nodes, dtype=float)
    if len(nodes) < 2 or nodes[0] != 0 or nodes[-1] != passage.asked.duration or np.any(np.diff(nodes) <= 0):
        raise ValueError("nodes do not go from the start to the end")
    held = shaped(stated.held, len(nodes) - 1, chain.links)
    return JointMotion(chain, nodes, held, shaped(stated.begin, chain.links))


def _extremes_document(found: Extremes) -> ExtremesDocument:
    every = {
        name: knowns(np.where(np.isfinite(value), value, np.nan))
        for name, value in ((name, getattr(found, name)) for name in ("low", "high", "speed", "acceleration", "torque"))
    }
    return ExtremesDocument(**every, singular=found.singular)


def _path_document(path: JointPath) -> PathDocument:
    others = path.others
    knots = None if others is None else (others.x.tolist(), others(others.x).tolist())
    elbow = 1 if path.elbow > 0 else -1
    return PathDocument(pair=path.pair, elbow=elbow, changes=list(path.changes), others=knots)


def _path_of(stated: PathDocument, motion: Trajectory, passage: Passage) -> JointPath:
    """The motion of the joints that a document states. Raises `ValueError` where it is none of this arm."""
    chain, duration, pair = passage.workspace.chain, passage.asked.duration, stated.pair
    if not pair[0] < pair[1] < chain.links:
        raise ValueError("a pair of links is none")
    others = None
    if chain.links > 2:
        if stated.others is None:
            raise ValueError("the other links' angles are missing")
        knots = np.array(stated.others[0], dtype=float)
        if knots[0] != 0 or knots[-1] != duration or np.any(np.diff(knots) <= 0):
            raise ValueError("knots do not go from the start to the end")
        values = shaped(stated.others[1], len(knots), chain.links - 2)
        others = CubicSpline(knots, values, bc_type="clamped")
    if np.any(np.diff([0.0, *stated.changes, duration]) <= 0):
        raise ValueError("changes of elbow are not in order between start and end")
    return JointPath(chain, motion, pair, float(stated.elbow), tuple(stated.changes), others, passage.theta[0])
