"""An arm's answer: the joints' motion of least peak base reaction force, what it keeps, and its bound."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.trajectory import Trajectory
from ..robots.joints import JointPath, base_moment, closely, torques
from ..robots.link_clearance import LinkClearance
from ..robots.workspace import Contact
from ..scenes.arm_proof import ArmProof
from ..spec.arm import ANGLE, ArmManeuver
from ..spec.maneuver import Maneuver
from ..spec.settings import Settings
from ..types import Array
from .plan import Made, Planned, Status, table_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..queries.explain import Explanation

NEAR = 1e-3  # of the arm: how close to the margin counts as a contact


@dataclass(frozen=True, eq=False, repr=False)
class ArmPlan(Planned):
    """A motion of an arm, from pose to pose.

    status: "solved" (checked, free of the obstacles, within reach and limits), "infeasible" (proved: every motion
        exceeds `max_peak`) or "unknown".
    indices: which of the configurations that start and goal allow, in the order up, down.
    crossing: the centre of mass's maneuver past the walls that the obstacles make, in the order of
        `obstacle_times` [s], shape (q,).
    joints: the joints' motion, None where there is none.
    clear: the least distance of the links from the obstacles at any instant.
    peak: bound on the centre of mass's acceleration [m/s^2];  lower_bound: no motion whatsoever has a smaller one.
    """

    maneuver: ArmManeuver
    settings: Settings
    status: Status
    indices: tuple[int, int]
    crossing: Maneuver
    obstacle_times: Array
    joints: JointPath | None
    clear: LinkClearance | None
    peak: float
    lower_bound: float
    proof: ArmProof
    made: Made
    scope: Literal["all"] = "all"

    @property
    def clearance(self) -> float:
        """Least distance of any link from any obstacle [m], at every instant; negative where one enters."""
        return math.inf if self.clear is None else self.clear.least

    @property
    def free(self) -> bool:
        """Whether there is a motion that keeps clear of the obstacles and within reach."""
        workspace = self.maneuver.workspace
        return self.clear is not None and self.clear.short(workspace) == 0

    @property
    def trajectory(self) -> Trajectory | None:
        """The motion of the centre of mass."""
        return None if self.joints is None else self.joints.motion

    def _path(self) -> JointPath:
        if self.joints is None:
            raise ValueError(f"this plan is {self.status}: it has no trajectory")
        return self.joints

    def angles(self, t: ArrayLike) -> Array:
        """Joint angles [rad] at t [s], shape (...) -> (..., n)."""
        return self._path().angles(t)

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
        """Times [s] at which the elbow turns over."""
        return () if self.joints is None else self.joints.changes

    @cached_property
    def explanation(self) -> Explanation | None:
        """Why a plan that is "infeasible" is so, and what would help, each tried out; None for others. Takes solves."""
        from ..queries.explain import explained

        return explained(self)

    @cached_property
    def contacts(self) -> list[Contact]:
        """What the arm is nearest to at the contact times."""
        if self.joints is None or not self.maneuver.obstacles:
            return []
        workspace = self.maneuver.workspace
        return [workspace.nearest(self.joints.absolute(t)) for t in self.contact_times]

    @cached_property
    def contact_times(self) -> list[float]:
        """Times [s] at which the arm is about as close to an obstacle as the margin allows: the obstacle times at which
        it is; where it is at none of them that of the closest approach, if it is there.
        """
        if self.joints is None or self.clear is None or not self.maneuver.obstacles:
            return []
        workspace = self.maneuver.workspace
        near = self.maneuver.margin + NEAR * workspace.size
        at = self.obstacle_times[
            np.min(workspace.clearance(self.joints.absolute(self.obstacle_times)), axis=-1) <= near
        ]
        return at.tolist() or ([self.clear.at] if self.clear.least <= near else [])

    @cached_property
    def exceeded(self) -> list[str]:
        """Joint limits and speeds that the motion does not keep, in words."""
        if self.joints is None:
            return []
        t = closely(self.joints)
        angles, rates = self.angles(t), np.diff(self.joints.rates(t)[1], axis=-1, prepend=0.0)
        out = []
        for k, link in enumerate(self.maneuver.arm.links):
            low, high = float(np.min(angles[:, k])), float(np.max(angles[:, k]))
            if link.limits is not None and not (link.limits[0] - ANGLE <= low and high <= link.limits[1] + ANGLE):
                out.append(f"arm.links[{k}].limits: the joint goes from {low:.6g} to {high:.6g} rad")
            fastest = float(np.max(np.abs(rates[:, k])))
            if link.max_speed is not None and fastest > link.max_speed:
                out.append(f"arm.links[{k}].max_speed: the joint reaches {fastest:.3g} rad/s")
        return out

    def plot(self, ax: Axes | None = None) -> Axes:
        """The arm's poses over its obstacles; see `peakmin.view.arm_plots` for more."""
        from ..view.arm_plots import poses

        return poses(self, ax=ax)

    def document(self) -> dict[str, Any]:
        """The plan as plain JSON data."""
        from .arm_document import of

        return of(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> ArmPlan:
        """The plan that `to_json` wrote, as it states itself: `peakmin.verify` tells whether that is true.

        Raises:
            SpecError: when the text is not a plan of an arm.
        """
        from ..spec.reading import load
        from .arm_document import read

        return read(load(text, finite=True))

    def to_csv(self) -> str:
        """Text: rows t, joint angles, speeds, torques, centre of mass, base force and moment at the nodes [SI]."""
        t, n = self.times, len(self.maneuver.arm.links)
        rates = np.diff(self._path().rates(t)[1], axis=-1, prepend=0.0)
        columns = [t, self.angles(t), rates, self.torques(t), self.position(t), self.base_force(t), self.base_moment(t)]
        names = [f"{name}{k + 1}" for name in ("q", "dq", "tau") for k in range(n)]
        return table_text(["t", *names, "x", "y", "fx", "fy", "moment"], columns)

    def __repr__(self) -> str:
        return (
            f"ArmPlan({self.status}, peak={self.peak:.9g}, lower_bound={self.lower_bound:.9g}, "
            f"clearance={self.clearance:.6g})"
        )
