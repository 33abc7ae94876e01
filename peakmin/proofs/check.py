"""A motion against its maneuver: the control integrated anew, by quadrature, and compared with what was asked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..geometry.integrals import GAUSS_NODES, GAUSS_WEIGHTS
from ..geometry.norm import norm
from ..geometry.trajectory import Trajectory
from ..spec.maneuver import Maneuver
from ..types import Array
from .double_integrator import PointMass

CHECK = 1e-9  # largest error of a state or a crossing, relative to the distances and speeds asked for there
GRAIN = 1e-14  # of a coordinate or of what a velocity covers: its own rounding errors, which no plan can undo


@dataclass(frozen=True)
class Check:
    """What a plan's control does; errors relative to the size of what is asked (distances covered, speeds).

    goal : error of position and velocity at the end, and of the positions that the motion gives;  walls : distance off
    a wall's line, or short of its tip;  peak : how far the control exceeds the stated peak, relative.
    """

    goal: float
    walls: float
    peak: float

    @property
    def passed(self) -> bool:
        """Whether every error is a rounding error."""
        return max(self.goal, self.walls) <= CHECK and self.peak <= 1e-12


def check_motion(maneuver: Maneuver, motion: Trajectory, obstacle_times: Array, peak: float) -> Check:
    """Errors of a motion against its maneuver, its acceleration integrated by an eight-point Gauss rule.

    Args:
        obstacle_times: [s], shape (q,).
        peak: the stated bound [m/s^2].
    """
    mass = PointMass.of(maneuver)
    speed = mass.length / mass.time
    ordered = np.concatenate([[0.0], obstacle_times, [maneuver.duration]])
    ends = motion.panels()
    if (
        len(obstacle_times) != mass.walls
        or not np.all(np.diff(ordered) > 0)
        or not np.all(np.diff(motion.nodes) > 0)
        or (ends[0], ends[-1]) != (0, maneuver.duration)
    ):
        return Check(math.inf, math.inf, math.inf)
    cuts = np.union1d(ends, obstacle_times)
    dt = np.diff(cuts)[:, None]
    u = motion.acceleration(cuts[:-1, None] + dt * GAUSS_NODES)  # (panels, 8, d)
    gained = dt * np.einsum("pgi,g->pi", u, GAUSS_WEIGHTS)
    moved = dt * dt * np.einsum("pgi,g->pi", u, GAUSS_WEIGHTS * (1 - GAUSS_NODES))
    v = np.vstack([maneuver.start.velocity, np.array(maneuver.start.velocity) + np.cumsum(gained, axis=0)])
    r = np.vstack([np.zeros_like(mass.v0), np.cumsum(dt * v[:-1] + moved, axis=0)])  # from the start
    v0, vf, pf = np.abs(mass.v0), np.abs(mass.vf), np.abs(mass.pf)
    # rounding errors of the goal, and of each wall's own tip: none of a wall far away
    moving = float(max(np.max(v0), np.max(vf), np.max(pf)))
    grain = GRAIN * (float(np.max(np.abs(mass.origin))) + moving * mass.length)
    wall_grain = grain + GRAIN * np.max(np.abs(mass.tips), axis=1) * mass.length
    speed_grain = GRAIN * float(max(np.max(v0), np.max(vf))) * speed
    miss = r[np.searchsorted(cuts, obstacle_times)] - mass.tips * mass.length
    off = miss - mass.windows.scaled(mass.length).nearest(miss)
    position = float(np.max(np.abs(r[-1] - mass.pf * mass.length)))
    asked = moving * mass.length or mass.length
    # what the motion says of itself, by which its distances are measured, against the quadrature
    said = np.abs(motion.position(cuts) - mass.origin - r)
    astray = max(float(np.max(said)) - grain, 0.0) / max(asked, float(np.max(np.abs(r))))
    velocity = float(np.max(np.abs(v[-1] - maneuver.goal.velocity)))
    largest = max(motion.peak(), float(np.max(norm(u))))
    # an error counts against the size of what is asked there, not of a wall far away
    there = np.maximum(asked, norm(r[np.searchsorted(cuts, obstacle_times)]))
    wall_errors = np.maximum(np.max(np.abs(off), axis=1, initial=0.0) - wall_grain, 0.0) / there
    fastest = float(np.max(np.abs(v))) or speed
    return Check(
        goal=max(max(position - grain, 0.0) / asked, max(velocity - speed_grain, 0.0) / fastest, astray),
        walls=float(np.max(wall_errors, initial=0.0)),
        peak=largest / peak - 1 if peak else largest,
    )
