"""The same move in three other ways, so that what the least peak saves can be seen.

Joint quintic: every joint angle by the polynomial 10 s^3 - 15 s^4 + 6 s^5. Minimum jerk: the centre of mass on the path
of least  int |r'''|^2 dt  through the plan's contacts, at the times that make it least, at rest at both ends. Smooth:
on quintic pieces with continuous second derivative through the contacts, whose times, velocities and accelerations
there, and accelerations at the ends, make the peak least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BPoly
from scipy.optimize import minimize

from ..geometry.norm import norm
from ..geometry.trajectory import SAMPLES, Polynomial
from ..plan.arm_plan import ArmPlan
from ..robots.dynamics import inverse_dynamics
from ..robots.extremes import Extremes
from ..robots.joints import JointPath
from ..robots.kinematics import unit
from ..scenes.kept import Excess, Kept
from ..scenes.kinds import beyond
from ..types import Array

RESTARTS = 4  # of a simplex that has shrunk too early
APART = 0.02  # of the duration: least distance of contact times
TURNS = Excess("arm", math.nan, "m", "arm: the elbow would turn over elsewhere, which is not looked at")
LEADS = Excess("arm", math.nan, "m", "arm: no joints are known that would follow it")
LEFT = np.array([[0.0, 1.0], [-1.0, 0.0]])  # turns a row by a right angle


@dataclass(frozen=True)
class Compared:
    """One way: its peak [m/s^2] and base force [N], times the least possible peak, and clearance [m].

    Of the other ways than the plan's, peaks are those of samples, and the joint quintic's clearance too.
    excess: the first of what it does not keep of what was asked, in words; None where it keeps all. The plan's own row
    is "least peak" where it does, else "plan".
    """

    name: str
    peak: float
    force: float
    ratio: float
    clearance: float
    excess: str | None = None


def compare(plan: ArmPlan) -> list[Compared]:
    """The plan beside the other ways. Raises `ValueError` where the plan has no motion."""
    if plan.joints is None:
        raise ValueError(f"this plan is {plan.status}: it has no trajectory")
    joints, mass, least = plan.joints, plan.crossing.mass, plan.lower_bound or 1.0
    rows: list[Compared] = []

    def add(name: str, peak: float, clearance: float, excesses: Sequence[Excess]) -> None:
        said = [one.words for one in excesses if one.stated]  # the other ways are no plans: what is asked counts
        if peak > plan.maneuver.limit:
            said.append(f"max_peak {plan.maneuver.limit:.6g} m/s²: this motion reaches {peak:.6g} m/s²")
        called = "plan" if said and not rows else name
        rows.append(Compared(called, peak, mass * peak, peak / least, clearance, next(iter(said), None)))

    assert plan.kept is not None
    add("least peak", plan.peak, plan.clearance, plan.kept.excesses)
    add("joint quintic", *_joint_quintic(plan))
    contacts = np.array([plan.position(t) for t in plan.obstacle_times]).reshape(-1, 2)
    began = plan.obstacle_times
    for name, motion in (
        ("minimum jerk", _minimum_jerk(plan, contacts, began)),
        ("smooth C2, tuned", _smooth(plan, contacts, began)),
    ):
        # joints that hold their accelerations do not follow another way of the centre of mass
        if isinstance(joints, JointPath) and not joints.changes:
            kept: Kept = plan.scene.kept(replace(joints, motion=motion))
        else:
            kept = Kept(math.nan, math.nan, (TURNS if isinstance(joints, JointPath) else LEADS,))
        add(name, motion.peak(), kept.clearance, kept.excesses)
    return rows


def _joint_quintic(plan: ArmPlan) -> tuple[float, float, list[Excess]]:
    """Peak [m/s^2], clearance [m] and what is not kept, on samples."""
    assert plan.joints is not None
    chain, T = plan.joints.chain, plan.joints.duration
    s = np.linspace(0, 1, SAMPLES + 1)[:, None]
    first, last = plan.joints.absolute(0.0), plan.joints.absolute(T)
    theta = first + (10 * s**3 - 15 * s**4 + 6 * s**5) * (last - first)
    rate = (30 * s**2 - 60 * s**3 + 30 * s**4) * (last - first) / T
    second = (60 * s - 180 * s**2 + 120 * s**3) * (last - first) / T**2
    along = unit(theta)
    acceleration = chain.c @ (second[..., None] * (along @ LEFT) - rate[..., None] ** 2 * along)
    clear = float(np.min(plan.maneuver.workspace.clearance(theta[::10])))
    short = plan.maneuver.margin - clear
    close = [Excess("obstacles", short, "m", f"obstacles: a link comes {short:.6g} m too close")] if short > 0 else []
    q, speeds, accelerations = (np.diff(one, axis=-1, prepend=0.0) for one in (theta, rate, second))
    every = [np.abs(speeds), np.abs(accelerations), np.abs(inverse_dynamics(chain, theta, rate, second))]
    when = {
        name: T * s[np.argmax(x, axis=0), 0] for name, x in zip(("speed", "acceleration", "torque"), every, strict=True)
    }
    speed, acceleration_most, torque = (np.max(x, axis=0) for x in every)
    most = Extremes(np.min(q, axis=0), np.max(q, axis=0), speed, acceleration_most, torque, when, 0.0)
    return float(np.max(norm(acceleration))), clear, close + beyond(plan.maneuver, q[0], q[-1], most)


def _pieces(plan: ArmPlan, points: Array, times: Array, inner: Array, outer: Array) -> Polynomial:
    """Quintic pieces through points (q, 2) at times (q,) with velocities and accelerations inner (q, 2, 2) there, which
    begin and end with accelerations outer (2, 2) and without velocity.
    """
    none = np.zeros(2)
    first, last = np.array([[none, outer[0]]]), np.array([[none, outer[1]]])
    ends = np.array([plan.position(0.0), plan.position(plan.maneuver.duration)])
    places = np.vstack([ends[:1], points, ends[1:]])
    values = np.concatenate([places[:, None, :], np.concatenate([first, inner, last])], axis=1)
    nodes = np.concatenate([[0.0], times, [plan.maneuver.duration]])
    return Polynomial(BPoly.from_derivatives(nodes, values))


def _best(
    plan: ArmPlan, points: Array, began: Array, outer: Array | None, value: Callable[[Polynomial], float]
) -> Polynomial:
    """The pieces of least value over times, velocities and accelerations at the points, from the plan's own ones.

    Args:
        outer: accelerations at the ends to start from, (2, 2); None keeps them at zero.
    """
    start = np.array([[plan.velocity(t), plan.acceleration(t)] for t in began]).reshape(-1, 2, 2)
    q, T = len(points), plan.maneuver.duration
    size = float(np.max(np.ptp(np.vstack([plan.position(0.0), points, plan.position(T)]), axis=0))) or 1.0
    scale = np.concatenate([np.full(q, T), np.tile(np.repeat([size / T, size / T**2], 2), q), np.full(4, size / T**2)])

    def made(x: Array) -> Polynomial | None:
        times, inner, ends = np.split(np.concatenate([x, np.zeros(scale.size - x.size)]) * scale, [q, 5 * q])
        if np.any(np.diff([0, *times, T]) < APART * T):
            return None
        return _pieces(plan, points, times, inner.reshape(q, 2, 2), ends.reshape(2, 2))

    def cost(x: Array) -> float:
        motion = made(x)
        return 1e9 if motion is None else value(motion)

    free = [began, start.ravel()] + ([] if outer is None else [outer.ravel()])
    x = np.concatenate(free) / scale[: sum(one.size for one in free)]
    options = {"maxfev": 300 * x.size, "xatol": 1e-6, "fatol": 1e-9}
    for _ in range(RESTARTS if x.size else 0):
        x = minimize(cost, x, method="Nelder-Mead", options=options).x
    motion = made(x)
    assert motion is not None
    return motion


def _minimum_jerk(plan: ArmPlan, points: Array, began: Array) -> Polynomial:
    """Of all pieces the minimum-jerk path is the one of least int |r'''|^2 dt: its pieces are quintic."""

    def jerk(motion: Polynomial) -> float:
        third = motion.pieces.derivative(3)
        t = np.unique(
            np.concatenate([np.linspace(a, b, 33) for a, b in zip(motion.nodes, motion.nodes[1:], strict=False)])
        )
        middle = (t[:-1] + t[1:]) / 2
        return float(np.sum(np.diff(t)[:, None] * third(middle) ** 2))

    return _best(plan, points, began, None, jerk)


def _smooth(plan: ArmPlan, points: Array, began: Array) -> Polynomial:
    t = np.linspace(0, plan.maneuver.duration, 241)

    def peak(motion: Polynomial) -> float:
        return float(np.max(norm(motion.acceleration(t))))

    ends = np.array([plan.acceleration(0.0), plan.acceleration(plan.maneuver.duration)])
    return _best(plan, points, began, ends, peak)


def table(rows: list[Compared]) -> str:
    """The rows as text."""
    lines = [f"  {'way':18}  peak [m/s²]   base force [N]   times the bound   clearance [m]   not kept"]
    for row in rows:
        clear = f"{row.clearance:13.4f}" if np.isfinite(row.clearance) else " " * 12 + "-"
        ratio = "-" if row.excess else f"{row.ratio:.4f}"  # of what does not keep all it says nothing
        line = f"  {row.name:18}  {row.peak:11.5f}   {row.force:14.5f}   {ratio:>15}   {clear}"
        lines.append(f"{line}   {row.excess}" if row.excess else line)
    return "\n".join(lines)
