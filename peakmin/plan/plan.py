"""The answer: a motion that has checked itself, its bounds, and how it was made."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from ..byname import found
from ..errors import SpecError
from ..files import csv_text
from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Proof, lower_bound
from ..proofs.check import Check, check_motion
from ..proofs.double_integrator import PointMass
from ..proofs.extremal import extremal, far_apart
from ..proofs.sensitivity import Sensitivities, optimal, sensitivities, without_idle
from ..scenes.arm_proof import ArmProof
from ..scenes.blocks import BlockProof, ListedProof
from ..scenes.kept import Kept, extent
from ..scenes.kinds import PointScene, scene_of
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..spec.settings import Settings
from ..spec.spec import Spec
from ..types import Array, Axes, Json
from .document import (
    PointDocument,
    Status,
    known,
    knowns,
    motion_fields,
    point_proof_of,
    proof_document,
    shaped,
    signed,
    unknown,
)
from .found import Found, Made
from .older import read_as

KEEPS: tuple[Status, ...] = ("solved", "feasible")
MOST_ROWS = 1_000_000  # of a table at a rate
ROUNDED = 1e-12  # of the duration: rows closer to its end are the end
NEARLY = 1e-7  # relative: how far the multipliers' own bound may be below the best at the plan's times


def gap_between(peak: float, bound: float) -> float:
    """(peak - bound) / peak; 1 where the peak is infinite, or below the bound."""
    if not math.isfinite(peak) or peak < bound * (1 - 1e-9):
        return 1.0
    return (peak - bound) / peak if peak else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """The answer to a task; `ArmPlan` is an arm's.

    status: "solved" (a checked control within `max_peak` whose path is free, `gap` at most what `search.accept` takes),
        "feasible" (such a control, with a larger gap), "infeasible" (proved: every control exceeds `max_peak`) or
        "unknown" (neither proved: no control was found, or the one found exceeds `max_peak` or does not keep what was
        asked).
    trajectory: the motion of the centre of mass, None where there is none.
    crossing: the centre of mass's maneuver past the q walls that it takes: what the obstacle times belong to.
    obstacle_times: [s], shape (q,).
    clearance: distance from all obstacles [m], at every instant; negative where one is entered.
    peak: bound on |acceleration| that the control keeps [m/s^2]; infinite when there is none.
    lower_bound: no control whatsoever has a smaller peak [m/s^2]; `scope` says over which obstacle times.
    proof: what proves it, and can be evaluated anew.
    multipliers: L at the plan's own obstacle times, shape (2+q, d), scaled.
    """

    kind: ClassVar[str] = "point"

    maneuver: Maneuver
    settings: Settings
    status: Status
    trajectory: Trajectory | None
    crossing: Maneuver
    obstacle_times: Array
    clearance: float
    peak: float
    lower_bound: float
    proof: Proof | BlockProof | ListedProof
    multipliers: Array
    made: Made

    @classmethod
    def of(cls, scene: PointScene, settings: Settings, status: Status, bound: float, given: Found[Trajectory]) -> Self:
        """The plan of what was found, checked already; `bound`: the proof's [m/s^2]."""
        mass = PointMass.of(given.crossing)
        times = given.times / mass.time
        assert given.multipliers is not None
        assert not isinstance(given.proof, ArmProof | None)
        multipliers = optimal(mass, times, given.multipliers, given.peak / mass.unit)
        clearance = math.inf if given.kept is None else given.kept.clearance
        return cls(
            scene.task,
            settings,
            status,
            given.motion,
            given.crossing,
            given.times,
            clearance,
            given.peak,
            bound,
            given.proof,
            multipliers,
            given.made,
        )

    @cached_property
    def scene(self) -> PointScene:
        """What the task moves in."""
        return scene_of(self.maneuver)

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The q walls whose lines are crossed at the obstacle times; past blocks those that the search put up."""
        return self.crossing.walls

    @property
    def scope(self) -> Literal["all", "these"]:
        """What the bound covers: "all" obstacle times, or "these" of the plan only."""
        return self.proof.scope

    @property
    def gap(self) -> float:
        """(peak - lower_bound) / peak; 1 where the path is none that the bound speaks of."""
        return gap_between(self.peak, self.lower_bound)

    @property
    def keeps(self) -> bool:
        """Whether the motion keeps all that was asked, however large the gap: "solved" or "feasible"."""
        return self.status in KEEPS

    @property
    def peak_force(self) -> float:
        """Peak base reaction force, mass times peak [N]."""
        return self.crossing.mass * self.peak

    @cached_property
    def kept(self) -> Kept | None:
        """What the motion keeps of what was asked, computed anew between the nodes too; None where there is none."""
        return None if self.trajectory is None else self.scene.kept(self.trajectory)

    def _motion(self) -> Trajectory:
        if self.trajectory is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.trajectory

    @property
    def times(self) -> Array:
        """Nodes of the trajectory [s], shape (steps+1,); empty when there is none."""
        return np.zeros(0) if self.trajectory is None else self.trajectory.nodes

    def instants(self, rate: float | None = None) -> Array:
        """Times [s] of a table's rows, shape (m,): the nodes, or with a rate k / rate for whole k, and the end.

        Args:
            rate: rows a second [1/s].

        Raises:
            SpecError: where the rate is no number above zero, or makes more than a million rows.
            ValueError: where the plan has no motion.
        """
        if rate is None:
            return self.times
        end = float(self._motion().nodes[-1])
        if isinstance(rate, bool) or not isinstance(rate, int | float) or not 0 < rate < math.inf:
            raise SpecError(f"rate: was {rate!r}, must be a finite number above zero [1/s]")
        if not end * rate <= MOST_ROWS:
            raise SpecError(f"rate: was {rate!r}, must be at most {MOST_ROWS / end:.6g} 1/s (a million rows)")
        k = np.arange(math.ceil(end * rate * (1 - ROUNDED)))  # none so close to the end that it is the end, rounded
        return np.append(k / rate, end)

    def position(self, t: ArrayLike) -> Array:
        """Position of the centre of mass [m] at t [s], shape (...) -> (..., 2); beyond the ends as at the ends."""
        return self._motion().position(t)

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity of the centre of mass [m/s] at t [s], shape (...) -> (..., 2)."""
        return self._motion().velocity(t)

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration of the centre of mass [m/s^2] at t [s], shape (...) -> (..., 2)."""
        return self._motion().acceleration(t)

    def base_force(self, t: ArrayLike) -> Array:
        """Force that the base exerts on the robot, m u(t) [N], shape (...) -> (..., 2); the robot's is its opposite."""
        return self.crossing.mass * self.acceleration(t)

    def check(self) -> Check:
        """Propagate the control anew, hold by hold, and compare with everything the plan states."""
        return check_motion(self.crossing, self._motion(), self.obstacle_times, self.peak)

    @property
    def sensitivities(self) -> Sensitivities:
        """Derivatives of the least peak at the plan's obstacle times, from the multipliers."""
        return sensitivities(self.crossing, self.obstacle_times, self.multipliers)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The path with what stands in its way and where it crosses; `peakmin.view` has more."""
        return found("peakmin.view.paths:path")(self, ax=ax)

    def document(self) -> Json:
        """The plan as plain JSON data; `peakmin.verify` and `from_json` read it."""
        slopes = {name: knowns(value) for name, value in vars(self.sensitivities).items()}
        return signed(
            PointDocument,
            **self._fields(),
            multipliers=self.multipliers.tolist(),
            sensitivities=slopes,
            proof=proof_document(self.proof),
            spec=Spec(maneuver=self.maneuver, settings=self.settings),
        )

    def _fields(self) -> Json:
        """What the document of any plan has."""
        return {
            "kind": self.kind,
            "status": self.status,
            "peak": known(self.peak),
            "lower_bound": known(self.lower_bound),
            "gap": self.gap,
            "scope": self.scope,
            "peak_force": known(self.peak_force),
            "obstacle_times": self.obstacle_times.tolist(),
            "clearance": known(self.clearance),
            **motion_fields(self.trajectory, self.maneuver.duration),
            "walls": list(self.walls),
            "made": vars(self.made),
        }

    @classmethod
    def stated_by(cls, document: PointDocument) -> Self:
        """The plan that a document states. Raises `ValueError` where it states none."""
        maneuver = document.spec.maneuver
        scene = scene_of(maneuver)
        walls = document.walls if maneuver.blocks else maneuver.walls  # without blocks a file cannot choose them
        q, d = len(walls), maneuver.dimension
        return cls(
            maneuver,
            document.spec.settings,
            document.status,
            document.motion(maneuver),
            maneuver.past(walls),
            shaped(document.obstacle_times, q),
            unknown(document.clearance),
            unknown(document.peak),
            unknown(document.lower_bound),
            point_proof_of(document.proof, document.scope, scene.classes, q, d),
            shaped(document.multipliers, 2 + q, d),
            Made(**document.made.model_dump()),
        )

    @property
    def size(self) -> float:
        """What errors of positions are measured by when the plan is verified [m]: not what its file lists."""
        return extent(self.maneuver.past(()))

    @property
    def units(self) -> dict[str, float]:
        """The sizes of what a document lists, by which rounding errors may differ [SI]."""
        own = PointMass.of(self.maneuver.past(()))  # not of walls that the file lists
        return {"position": own.length, "velocity": own.length / own.time, "acceleration": own.unit}

    @property
    def joined(self) -> bool:
        """Whether the motion begins in the start's configuration and ends in the goal's."""
        return True  # `check` looks at a centre of mass's

    def misstated(self) -> list[str]:
        """Whether the multipliers are the best at the plan's times: its sensitivities are made from them."""
        mass = PointMass.of(self.crossing)
        times = self.obstacle_times / mass.time
        if not far_apart(times):
            return []
        own, best = lower_bound(mass, times, self.multipliers), extremal(mass, times).lower
        if not own >= (1 - NEARLY) * best:
            return [f"multipliers: prove {own * mass.unit!r} m/s² at these times, others {best * mass.unit!r}"]
        if without_idle(mass, times, self.multipliers) is not self.multipliers:
            return ["multipliers: are of walls that can be left out"]
        return []

    def to_json(self, *, indent: int | None = None) -> str:
        """The plan as one JSON document (text; write it where you like)."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    @classmethod
    def from_json(cls, text: str | bytes) -> Self:
        """The plan that `to_json` wrote, as it states itself: `peakmin.verify` tells whether that is true.

        Raises:
            SpecError: when the text is not a plan, or one of another kind.
        """
        return read_as(PointDocument, cls.stated_by, text)

    def to_csv(self, rate: float | None = None) -> str:
        """Text: rows t, x, y, vx, vy, ax, ay [SI]; the last row repeats the last acceleration.

        Args:
            rate: as of `instants`, which the rows are at.
        """
        t, motion = self.instants(rate), self._motion()
        columns = [t, motion.position(t), motion.velocity(t), motion.acceleration(t)]
        return csv_text(["t", "x", "y", "vx", "vy", "ax", "ay"], np.column_stack(columns).tolist())

    def __repr__(self) -> str:
        times = ", ".join(f"{t:.6g}" for t in self.obstacle_times)
        return (
            f"Plan({self.status}, peak={self.peak:.9g}, lower_bound={self.lower_bound:.9g}, obstacle_times=[{times}])"
        )
