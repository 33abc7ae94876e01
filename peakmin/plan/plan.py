"""The answer: a trajectory that has checked itself, its bounds, and how it was made."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.trajectory import Trajectory
from ..proofs.bounds import Leaf, Proof
from ..proofs.bracket import Bracket
from ..proofs.check import Check, check_motion
from ..proofs.double_integrator import PointMass
from ..proofs.sensitivity import Sensitivities, optimal, sensitivities
from ..scenes.blocks import WaysProof
from ..scenes.impossible import impossible
from ..scenes.kept import Keeping, keeping
from ..spec.control_set import Disc, Polygon
from ..spec.maneuver import Maneuver
from ..spec.obstacles import Wall
from ..spec.settings import Settings
from ..types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..queries.explain import Explanation

Status = Literal["solved", "infeasible", "unknown"]


class Planned:
    """Accessors over a plan's own fields."""

    status: Status
    obstacle_times: Array
    peak: float
    lower_bound: float

    if TYPE_CHECKING:

        @property
        def trajectory(self) -> Trajectory | None:
            """The motion of the centre of mass."""

        @property
        def crossing(self) -> Maneuver:
            """The centre of mass's maneuver past the walls that the obstacle times belong to."""

        def document(self) -> dict[str, Any]:
            """The plan as plain JSON data."""

    @property
    def gap(self) -> float:
        """(peak - lower_bound) / peak; 1 where the path is none that the bound speaks of."""
        if not math.isfinite(self.peak) or self.peak < self.lower_bound * (1 - 1e-9):
            return 1.0
        return (self.peak - self.lower_bound) / self.peak if self.peak else 0.0

    @property
    def peak_force(self) -> float:
        """Peak base reaction force, mass times peak [N]."""
        return self.crossing.mass * self.peak

    def _motion(self) -> Trajectory:
        if self.trajectory is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.trajectory

    @property
    def times(self) -> Array:
        """Nodes of the trajectory [s], shape (steps+1,); empty when there is none."""
        return np.zeros(0) if self.trajectory is None else self.trajectory.nodes

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

    def to_json(self, *, indent: int | None = None) -> str:
        """The plan as one JSON document (text; write it where you like)."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)


def table_text(head: list[str], columns: list[Array]) -> str:
    """Columns (m,) or (m, k) as CSV text under a head."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(np.column_stack(columns).tolist())
    return out.getvalue()


@cache
def _versions() -> dict[str, str]:
    return {name: version(name) for name in ("peakmin", "cvxpy", "clarabel", "numpy")}


@dataclass(frozen=True)
class Made:
    """How a plan was made: programs compiled and solved, boxes of obstacle times looked at, seconds, versions."""

    solver: str
    compilations: int
    solves: int
    nodes: int
    seconds: float
    versions: dict[str, str] = field(default_factory=lambda: dict(_versions()))

    def __post_init__(self) -> None:
        numbers = (self.compilations, self.solves, self.nodes, self.seconds)
        if not all(isinstance(one, int | float | np.number) for one in numbers):  # as a file may have them
            raise ValueError("made is not of numbers")


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Planned):
    """A maneuver's answer.

    status: "solved" (a checked control within `max_peak` whose path is free), "infeasible" (proved: every control
        exceeds `max_peak`) or "unknown" (neither proved: no control was found, or the one found exceeds `max_peak`
        or does not keep what was asked).
    walls: the q walls whose lines are crossed at the obstacle times; past blocks those that the search put up.
    obstacle_times: [s], shape (q,).
    clearance: distance of the path from all obstacles [m], at every instant; negative where it enters one.
    peak: bound on |acceleration| that the control keeps [m/s^2]; infinite when there is none.
    lower_bound: no control whatsoever has a smaller peak [m/s^2]; `scope` says over which obstacle times.
    proof: what proves it, and can be evaluated anew.
    multipliers: L at the plan's own obstacle times, shape (2+q, 2), scaled.
    """

    maneuver: Maneuver
    settings: Settings
    status: Status
    trajectory: Trajectory | None
    walls: tuple[Wall, ...]
    obstacle_times: Array
    clearance: float
    peak: float
    lower_bound: float
    proof: Proof | WaysProof
    multipliers: Array
    made: Made

    @property
    def scope(self) -> Literal["all", "these"]:
        """What the bound covers: "all" obstacle times, or "these" of the plan only."""
        return self.proof.scope

    @property
    def crossing(self) -> Maneuver:
        """The maneuver past the plan's walls alone: what its obstacle times belong to."""
        return self.maneuver.past(self.walls)

    def keeping(self) -> Keeping:
        """Distances from obstacles and region and the speed, computed anew between the nodes too."""
        return keeping(self.maneuver, self._motion())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Path with walls and crossing points; see `peakmin.view.plots` for more."""
        from ..view.plots import path  # matplotlib takes a second to import

        return path(self, ax=ax)

    def document(self) -> dict[str, Any]:
        """The plan as plain JSON data; `peakmin.verify` and `Plan.from_json` read it."""
        from .document import of

        return of(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> Plan:
        """The plan that `to_json` wrote, as it states itself: `peakmin.verify` tells whether that is true.

        Raises:
            SpecError: when the text is not a plan.
        """
        from .document import read

        return read(text)

    @cached_property
    def explanation(self) -> Explanation | None:
        """Why a plan that is "infeasible" is so, and what would help, each tried out; None for others. Takes solves."""
        from ..queries.explain import explained

        return explained(self)

    @property
    def sensitivities(self) -> Sensitivities:
        """Derivatives of the least peak at the plan's obstacle times, from the multipliers."""
        return sensitivities(self.crossing, self.obstacle_times, self.multipliers)

    def __repr__(self) -> str:
        times = ", ".join(f"{t:.6g}" for t in self.obstacle_times)
        return (
            f"Plan({self.status}, peak={self.peak:.9g}, lower_bound={self.lower_bound:.9g}, obstacle_times=[{times}])"
        )

    def to_csv(self) -> str:
        """Text: rows t, x, y, vx, vy, ax, ay at the nodes [SI]; the last row repeats the last acceleration."""
        t, motion = self.times, self._motion()
        columns = [t, motion.position(t), motion.velocity(t), motion.acceleration(t)]
        return table_text(["t", "x", "y", "vx", "vy", "ax", "ay"], columns)


def from_bracket(
    maneuver: Maneuver,
    settings: Settings,
    times: Array,
    bracket: Bracket,
    motion: Trajectory | None,
    proof: Proof | WaysProof | None,
    made: Made,
    walls: tuple[Wall, ...] | None = None,
) -> Plan:
    """The plan of a bracket [scaled] at placed obstacle times [scaled]: solved only if it passes its own checks.

    Args:
        motion: what attains the upper end, in SI units; None where nothing does.
        proof: of all obstacle times; without it the bracket's multipliers prove a bound at these.
        walls: whose lines are crossed at the times; default the maneuver's.
    """
    walls = maneuver.walls if walls is None else walls
    crossing = maneuver.past(walls)
    mass = PointMass.of(crossing)
    seconds = times * mass.time
    times = seconds / mass.time  # as who reads the plan has them
    multipliers = np.zeros((2 + mass.walls, 2)) if bracket.multipliers is None else bracket.multipliers
    if proof is None:
        place = tuple(times.tolist())
        proof = Proof("these" if mass.walls else "all", (Leaf(place, place, multipliers, place),))
    bound = proved(maneuver, walls, proof, times)
    peak, kept, distance = math.inf, False, math.inf
    if motion is not None:
        peak = max(peak_of(bracket, settings.circle) * mass.unit, motion.peak())
        if not check_motion(crossing, motion, seconds, peak).passed:
            motion, peak = None, math.inf
    if motion is not None:
        keeps = keeping(maneuver, motion)
        kept, distance = keeps.passed(maneuver), keeps.clearance
    multipliers = optimal(mass, times, multipliers, peak / mass.unit)
    status = status_of(maneuver, kept, peak, bound, proof.scope)
    return Plan(maneuver, settings, status, motion, walls, seconds, distance, peak, bound, proof, multipliers, made)


def status_of(maneuver: Maneuver, kept: bool, peak: float, bound: float, scope: Literal["all", "these"]) -> Status:
    """The status of a plan: kept, whether there is a path and it keeps all that was asked; peak and bound [m/s^2]."""
    limit = maneuver.max_peak or math.inf
    if impossible(maneuver) is not None or (bound > limit and scope == "all"):
        return "infeasible"
    return "solved" if kept and peak <= limit else "unknown"


def proved(maneuver: Maneuver, walls: tuple[Wall, ...], proof: Proof | WaysProof, times: Array) -> float:
    """The lower bound [m/s^2] that a proof gives, evaluated anew, for a plan past these walls at scaled times (q,)."""
    if isinstance(proof, WaysProof):
        return proof.bound(maneuver)
    mass = PointMass.of(maneuver.past(walls))
    return proof.bound(mass, times) * mass.unit


def peak_of(bracket: Bracket, circle: Disc | Polygon) -> float:
    """A bound on |u| [scaled]: the circle's M, except that a circumscribed polygon reaches beyond its M."""
    if isinstance(circle, Polygon) and circle.fit == "circumscribed":
        return math.inf if bracket.control is None else float(np.max(np.hypot(*bracket.control.T)))
    return bracket.upper
