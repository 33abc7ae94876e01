"""The largest joint speeds, accelerations and torques of a motion at any instant, not only at those looked at.

Of a `JointMotion` they follow from its parabolas. Of a `JointPath` two angles follow the centre of mass through the
inverse of their Jacobian, which is large near the stretched and the folded arm: with sigma at most its least singular
value on an interval, |det| / sqrt(c_i^2 + c_j^2) <= sigma,

    |theta'| <= (|r'| + sum_rest c |theta'|) / sigma
    |theta''| <= (|u| + sum c theta'^2 + sum_rest c |theta''|) / sigma
    |theta'''| <= (|u'| + sum c (3 |theta' theta''| + |theta'|^3) + sum_rest c |theta'''|) / sigma

so on an interval of half width t a speed is within t max|theta''| of that in the middle, and so on. Intervals are
halved until what lies between no longer matters; where a joint passes through the singular posture that never happens,
and what is not bounded is infinite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.trajectory import HoldTrajectory
from ..types import Array
from .dynamics import inverse_dynamics
from .joint_motion import JointMotion
from .joints import JointPath
from .kinematics import Chain, unit

FIRST = 400  # intervals
FINE = 1e-3  # relative to the largest value, to which it is found
CLOSE = 1e-10  # rad: to which the largest and the least angles are found
MOST = 60_000  # intervals
INSTANTS = 4000  # at which the distance of a joint motion from the singular posture is looked at


@dataclass(frozen=True)
class Extremes:
    """Of every joint, (n,) each, at any instant: least and largest angle [rad], largest |q'| [rad/s], |q''| [rad/s^2],
    |tau| [N m], and about when [s]; infinite where they are not bounded.

    singular: a lower bound on the least singular value of the centre of mass's Jacobian [m], zero in singular postures.
    """

    low: Array
    high: Array
    speed: Array
    acceleration: Array
    torque: Array
    when: dict[str, Array]
    singular: float

    @property
    def moment(self) -> float:
        """The largest base moment [N m]."""
        return float(self.torque[0])


def extremes(motion: JointMotion | JointPath) -> Extremes:
    """Those of a motion."""
    return _of_motion(motion) if isinstance(motion, JointMotion) else _of_path(motion)


def _of_motion(motion: JointMotion) -> Extremes:
    low, high = motion.ranges
    torque, when = motion.torque_peaks
    speeds, held = np.abs(motion.at_nodes[1]), np.abs(motion.held)
    times = {
        "speed": motion.nodes[np.argmax(speeds, axis=0)],
        "acceleration": motion.nodes[np.argmax(held, axis=0)],
        "torque": when,
    }
    cuts = np.linspace(0, motion.duration, INSTANTS + 1)
    a, b = cuts[:-1], cuts[1:]
    moved = motion.spread(a, b) @ motion.chain.c * np.sqrt(motion.chain.links)
    least = _least_singular(motion.chain, motion.absolute((a + b) / 2)) - moved
    return Extremes(
        low, high, np.max(speeds, axis=0), np.max(held, axis=0), torque, times, max(float(np.min(least)), 0.0)
    )


def _least_singular(chain: Chain, theta: Array) -> Array:
    """Of dc/dq [m], (m, n) -> (m,)."""
    along = chain.c[:, None] * unit(theta)
    beyond = np.cumsum(along[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(np.linalg.svd(beyond, compute_uv=False)[:, -1])


def _of_path(path: JointPath) -> Extremes:
    n = path.chain.links
    cuts = np.unique(np.concatenate([np.linspace(0, path.duration, FIRST + 1), path.motion.nodes, path.changes]))
    if path.others is not None:
        cuts = np.union1d(cuts, path.others.x)
    a, b = cuts[:-1], cuts[1:]
    best, proved, when = np.zeros((3, n)), np.zeros((3, n)), np.zeros((3, n))
    seen_at = path.angles(np.append(a, path.duration))
    low, high = np.min(seen_at, axis=0), np.max(seen_at, axis=0)
    least, most, singular, count = low.copy(), high.copy(), np.inf, 0
    while len(a):
        count += len(a)
        seen = _on_intervals(path, a, b)
        at = np.argmax(seen.value, axis=1)  # (3, n)
        top = np.take_along_axis(seen.value, at[:, None], axis=1)[:, 0]
        when = np.where(top > best, ((a + b) / 2)[at], when)
        best = np.maximum(best, top)
        loose = np.any(seen.bound > best[:, None] * (1 + FINE) + 1e-12, axis=(0, 2))
        low, high = np.minimum(low, np.min(seen.angles, axis=0)), np.maximum(high, np.max(seen.angles, axis=0))
        loose |= np.any((seen.low < low - CLOSE) | (seen.high > high + CLOSE), axis=1)
        more = loose & (b - a > 1e-9 * path.duration) & (count < MOST)
        proved = np.maximum(proved, np.max(np.where(more[None, :, None], 0.0, seen.bound), axis=1))
        kept = ~more
        if np.any(kept):
            least, most = (
                np.minimum(least, np.min(seen.low[kept], axis=0)),
                np.maximum(most, np.max(seen.high[kept], axis=0)),
            )
            singular = min(singular, float(np.min(seen.sigma[kept])))
        a, b = a[more], b[more]
        middle = (a + b) / 2
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    proved = np.where(proved <= best * (1 + 2 * FINE) + 1e-12, np.maximum(best, proved), np.inf)
    names = ("speed", "acceleration", "torque")
    speed, acceleration, torque = proved
    return Extremes(least, most, speed, acceleration, torque, dict(zip(names, when, strict=True)), singular)


@dataclass(frozen=True)
class _Seen:
    """Of intervals (m,): speeds, accelerations and torques in the middle and their bounds, (3, m, n); angles in the
    middle and the least and largest, (m, n);  sigma: (m,).
    """

    value: Array
    bound: Array
    angles: Array
    low: Array
    high: Array
    sigma: Array


@np.errstate(all="ignore")  # what is not bounded is infinite
def _on_intervals(path: JointPath, a: Array, b: Array) -> _Seen:
    chain, pair, rest = path.chain, list(path.pair), path.rest
    c, t, middle = chain.c, (b - a)[:, None] / 2, (a + b) / 2
    theta, first, second = path.rates(middle)
    peak = path.motion.peak()
    held = isinstance(path.motion, HoldTrajectory)
    W, A, B = (np.zeros_like(theta) for _ in range(3))
    if path.others is not None:
        knots = path.others.x
        third = np.abs(path.others.derivative(3)((knots[:-1] + knots[1:]) / 2))
        for column, k in enumerate(rest):
            W[:, k] = path._largest(a, b, column, 1)
            A[:, k] = path._largest(a, b, column, 2)
            B[:, k] = np.max(third[:, column])
    along = np.hypot(*path.motion.velocity(middle).T)[:, None] + t * peak
    left = path.left(middle)
    rho = np.hypot(*left.T)[:, None]
    radius = t * (along + W @ c[:, None])
    ends = [path.two.bend(np.clip(x, path.two.inner, path.two.outer)) for x in (rho - radius, rho + radius)]
    bend = np.minimum(*(np.sin(x) for x in ends))
    sigma = np.maximum(c[pair[0]] * c[pair[1]] * bend / np.hypot(*c[pair]), 0.0)
    W[:, pair] = (along + (W[:, rest] @ c[rest])[:, None]) / sigma
    for _ in range(3):
        A[:, pair] = (peak + (W**2 @ c + A[:, rest] @ c[rest])[:, None]) / sigma
        W[:, pair] = np.fmin(W[:, pair], np.abs(first[:, pair]) + t * A[:, pair])
    if held:
        B[:, pair] = ((3 * W * A + W**3) @ c + B[:, rest] @ c[rest])[:, None] / sigma
        A[:, pair] = np.fmin(A[:, pair], np.abs(second[:, pair]) + t * B[:, pair])
    values = [np.abs(np.diff(x, axis=1, prepend=0.0)) for x in (first, second)]
    tau = np.abs(inverse_dynamics(chain, theta, first, second))
    if held:
        bounds = [values[0] + t * _joint(A), values[1] + t * _joint(B), tau + t * _torque_rate(chain, W, A, B)]
    else:  # the control may turn as it likes
        bounds = [values[0] + t * _joint(A), _joint(A), _torque_most(chain, W, A)]
        values[1] = np.maximum(_joint(np.abs(second)), bounds[1] / (1 + FINE))
        tau = np.maximum(tau, bounds[2] / (1 + FINE))
    every = [np.where(np.isnan(x), np.inf, x) for x in bounds]
    # an angle is within h^2/8 max|q''| of the line between its ends, and within what it may turn of the middle
    angles = path.angles(middle)
    edges: Array = np.array([path.angles(a), path.angles(np.nextafter(b, 0))])
    bent = np.where(np.isnan(A), np.inf, _joint(A)) * t**2 / 2
    turned = _joint(path.spread(a, b))
    least = np.fmax(np.min(edges, axis=0) - bent, angles - turned)
    most = np.fmin(np.max(edges, axis=0) + bent, angles + turned)
    return _Seen(np.array([*values, tau]), np.array(every), angles, least, most, sigma[:, 0])


def _joint(x: Array) -> Array:
    """Of joints at most, by absolute angles' own (m, n): that of the link and of the one before."""
    return np.asarray(x + np.concatenate([np.zeros_like(x[:, :1]), x[:, :-1]], axis=1))


def _torque_most(chain: Chain, W: Array, A: Array) -> Array:
    """|tau| at most: sum of m |P| |r''| and I |theta''|."""
    weight = np.append(chain.mass, chain.payload)
    pushed = np.cumsum(chain.length * (A + W**2), axis=1)
    pushed = np.column_stack([pushed, pushed[:, -1]])
    out = np.zeros_like(W)
    for j in range(chain.links):
        far = np.cumsum(chain.length[j:])
        out[:, j] = (np.append(far, far[-1]) * pushed[:, j:]) @ weight[j:] + A[:, j:] @ chain.inertia[j:]
    return out


def _torque_rate(chain: Chain, W: Array, A: Array, B: Array) -> Array:
    """|tau'| at most: sum of m (|P'| |r''| + |P| |r'''|) and I |theta'''|."""
    weight = np.append(chain.mass, chain.payload)
    push = [np.cumsum(chain.length * x, axis=1) for x in (A + W**2, B + 3 * W * A + W**3)]
    push = [np.column_stack([x, x[:, -1]]) for x in push]
    out = np.zeros_like(W)
    for j in range(chain.links):
        far = [np.cumsum((chain.length * x)[:, j:], axis=1) for x in (np.ones_like(W), W)]
        far = [np.column_stack([x, x[:, -1]]) for x in far]
        out[:, j] = (far[1] * push[0][:, j:] + far[0] * push[1][:, j:]) @ weight[j:] + B[:, j:] @ chain.inertia[j:]
    return out
