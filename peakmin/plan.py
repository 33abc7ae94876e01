"""The answer: a trajectory that has checked itself, its bounds, and how it was made."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .bracket import Bracket
from .certify import lower_bound
from .circle import Array, Disc, Polygon
from .moments import PointMass, transition
from .spec import Maneuver, Settings, Spec
from .trajectory import HoldTrajectory, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHECK = 1e-9  # largest error of a state or a crossing, in units of the maneuver's length (and length/duration)
Status = Literal["solved", "infeasible", "unknown"]


@dataclass(frozen=True)
class Check:
    """What a plan's control does, propagated anew in numpy; errors in units of the maneuver's length.

    goal : error of position and velocity at the end;  walls : distance off a wall's line, or short of its tip;
    peak : how far the control exceeds the stated peak, relative.
    """

    goal: float
    walls: float
    peak: float

    @property
    def passed(self) -> bool:
        """Whether every error is a rounding error."""
        return max(self.goal, self.walls) <= CHECK and self.peak <= 1e-12


@dataclass(frozen=True)
class Made:
    """How a plan was made."""

    solver: str
    compilations: int
    solves: int
    seconds: float
    versions: dict[str, str] = field(
        default_factory=lambda: {name: version(name) for name in ("peakmin", "cvxpy", "clarabel", "numpy")}
    )


@dataclass(frozen=True)
class Plan:
    """A maneuver's answer.

    status: "solved" (a checked control within `max_peak`), "infeasible" (proved: every control exceeds
        `max_peak`) or "unknown" (nothing proved).
    obstacle_times: [s], shape (q,). Empty when there is no trajectory.
    peak: bound on |acceleration| that the control keeps [m/s^2]; infinite when there is none.
    lower_bound: no control whatsoever has a smaller peak [m/s^2]; `scope` says over which obstacle times.
    scope: "all" (every obstacle time) or "these" (the plan's own obstacle times).
    multipliers: L of the bound, shape (2+q, 2), scaled.
    """

    maneuver: Maneuver
    settings: Settings
    status: Status
    trajectory: Trajectory | None
    obstacle_times: Array
    peak: float
    lower_bound: float
    scope: Literal["all", "these"]
    multipliers: Array
    made: Made

    @property
    def gap(self) -> float:
        """(peak - lower_bound) / peak."""
        if not math.isfinite(self.peak):
            return 1.0
        return (self.peak - self.lower_bound) / self.peak if self.peak else 0.0

    @property
    def peak_force(self) -> float:
        """Peak base reaction force, mass times peak [N]."""
        return self.maneuver.mass * self.peak

    def position(self, t: ArrayLike) -> Array:
        """Position of the centre of mass [m] at t [s], shape (...) -> (..., 2)."""
        return self._motion().position(t)

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity of the centre of mass [m/s] at t [s], shape (...) -> (..., 2)."""
        return self._motion().velocity(t)

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration of the centre of mass [m/s^2] at t [s], shape (...) -> (..., 2)."""
        return self._motion().acceleration(t)

    def base_force(self, t: ArrayLike) -> Array:
        """Force on the base, -mass times the acceleration's opposite: m u(t) [N], shape (...) -> (..., 2)."""
        return self.maneuver.mass * self.acceleration(t)

    def _motion(self) -> Trajectory:
        if self.trajectory is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.trajectory

    @property
    def times(self) -> Array:
        """Nodes of the trajectory [s], shape (steps+1,); empty when there is none."""
        return np.zeros(0) if self.trajectory is None else self.trajectory.nodes

    def check(self) -> Check:
        """Propagate the control anew, hold by hold, and compare with everything the plan states."""
        return check(self.maneuver, self._motion(), self.obstacle_times, self.peak)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Path with walls and crossing points; see `peakmin.plots` for more."""
        from .plots import path  # matplotlib takes a second to import

        return path(self, ax=ax)

    def document(self) -> dict[str, Any]:
        """The plan as plain JSON data; numbers that are not known are null."""
        motion = self.trajectory
        t = self.times
        return {
            "version": 1,
            "status": self.status,
            "peak": _number(self.peak),
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "scope": self.scope,
            "peak_force": _number(self.peak_force),
            "obstacle_times": self.obstacle_times.tolist(),
            "times": t.tolist(),
            "position": motion.position(t).tolist() if motion else [],
            "velocity": motion.velocity(t).tolist() if motion else [],
            "acceleration": motion.acceleration(t[:-1]).tolist() if motion else [],
            "multipliers": self.multipliers.tolist(),
            "spec": json.loads(Spec(maneuver=self.maneuver, settings=self.settings).to_json()),
            "made": vars(self.made),
        }

    def to_json(self, indent: int | None = None) -> str:
        """The plan as one JSON document."""
        return json.dumps(self.document(), indent=indent, allow_nan=False)

    def to_csv(self) -> str:
        """Rows t, x, y, vx, vy, ax, ay at the nodes [SI]; the last row repeats the last acceleration."""
        t, motion = self.times, self._motion()
        table = np.column_stack([t, motion.position(t), motion.velocity(t), motion.acceleration(t)])
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["t", "x", "y", "vx", "vy", "ax", "ay"])
        writer.writerows(table.tolist())
        return out.getvalue()


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def check(maneuver: Maneuver, motion: Trajectory, obstacle_times: Array, peak: float) -> Check:
    """Errors of a hold trajectory against its maneuver, by the recursion x(k+1) = Phi x(k) + Gamma u(k).

    Args:
        obstacle_times: [s], shape (q,).
        peak: the stated bound [m/s^2].
    """
    mass = PointMass.of(maneuver)
    state = np.array([maneuver.start.position, maneuver.start.velocity])  # rows: position, velocity
    nodes, control = motion.nodes, motion.acceleration(motion.nodes[:-1])
    speed = mass.length / mass.time
    # a position this far from the origin has no more digits than that
    grain = 1e-14 * float(np.max(np.abs(mass.origin), initial=0.0))
    walls = 0.0
    ordered = np.concatenate([[0.0], obstacle_times, [maneuver.duration]])
    if np.any(np.diff(ordered) <= 0):
        walls = math.inf
    pending = list(zip(obstacle_times, mass.tips * mass.length + mass.origin, mass.free, mass.clear, strict=True))
    for k, u in enumerate(control):
        while pending and pending[0][0] <= nodes[k + 1]:
            at, tip, free, clear = pending.pop(0)
            phi, gamma = transition(at - nodes[k])
            miss = (phi @ state + np.outer(gamma, u))[0] - tip
            along, across = float(miss @ free), float(miss @ [-free[1], free[0]])
            walls = max(walls, abs(across), max(-along, 0.0) if clear else abs(along))
        phi, gamma = transition(nodes[k + 1] - nodes[k])
        state = phi @ state + np.outer(gamma, u)
    goal = np.array([maneuver.goal.position, maneuver.goal.velocity])
    error = np.max(np.abs(state - goal), axis=1)
    if pending or nodes[0] != 0 or nodes[-1] != maneuver.duration:
        walls = math.inf
    return Check(
        goal=max(max(float(error[0]) - grain, 0.0) / mass.length, float(error[1]) / speed),
        walls=max(walls - grain, 0.0) / mass.length,
        peak=motion.peak() / peak - 1 if peak else motion.peak(),
    )


def from_bracket(
    maneuver: Maneuver, settings: Settings, mass: PointMass, times: Array, bracket: Bracket, made: Made
) -> Plan:
    """The plan of a bracket [scaled] at placed obstacle times [scaled]: solved only if it passes its own check."""
    multipliers = np.zeros((2 + mass.walls, 2)) if bracket.multipliers is None else bracket.multipliers
    bound = lower_bound(mass, times, multipliers) * mass.unit
    seconds = times * mass.time
    motion: HoldTrajectory | None = None
    status: Status = "unknown"
    peak = math.inf
    if bracket.control is not None:
        nodes = settings.grid.edges(times) * mass.time
        motion = HoldTrajectory(
            nodes,
            bracket.control * mass.unit,
            np.array(maneuver.start.position),
            np.array(maneuver.start.velocity),
        )
        peak = peak_of(bracket, settings.circle) * mass.unit
        if not check(maneuver, motion, seconds, peak).passed:
            motion, peak = None, math.inf
    if motion is not None and (maneuver.max_peak is None or peak <= maneuver.max_peak):
        status = "solved"
    scope: Literal["all", "these"] = "these" if mass.walls else "all"
    if maneuver.max_peak is not None and bound > maneuver.max_peak and scope == "all":
        status = "infeasible"
    return Plan(maneuver, settings, status, motion, seconds, peak, bound, scope, multipliers, made)


def peak_of(bracket: Bracket, circle: Disc | Polygon) -> float:
    """A bound on |u| [scaled]: the circle's M, except that a circumscribed polygon reaches beyond its M."""
    if isinstance(circle, Polygon) and circle.fit == "circumscribed":
        return math.inf if bracket.control is None else float(np.max(np.hypot(*bracket.control.T)))
    return bracket.upper
