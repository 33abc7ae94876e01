"""The least distance of the links from the obstacles over a whole motion, proved between the instants looked at."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..types import Array
from .joint_motion import JointMotion
from .joints import JointPath
from .workspace import Workspace

FIRST = 200  # intervals looked at first
FINE = 1e-6  # of the arm: to which the least distance is found
ROUGH = 0.02  # of what is missing: to which it is found where it is less than the margin
SPARE, ENOUGH = 0.1, 1e-4  # of what is more than the margin, and of the arm at most: to which it is found else
EDGE = 1e-9  # of the arm: to which touching an edge of the annulus counts as staying within
JUMP, HALVINGS = 0.05, 9  # rad between instants a millionth of the duration apart count as a jump
TURN = 1e-3  # rad: so far from the straight or folded arm an elbow may be where it turns over
UNSTEADY = 0.01  # of the arm: what a path whose joints jump is moved by
MOST = 200_000  # intervals; where they do not do, the bound found so far is stated


@dataclass(frozen=True)
class LinkClearance:
    """least: no link is nearer to an obstacle at any instant [m], negative inside;  at: where it is about reached [s].

    within: how far the centre of mass stays from the edges of what the arm reaches [m];  steady: no joint jumps.
    """

    least: float
    at: float
    within: float
    steady: bool

    def short(self, workspace: Workspace) -> float:
        """By how much [m] the motion does not keep its margin and reach; zero where it does."""
        if not self.steady:
            return UNSTEADY * workspace.size
        return max(workspace.margin - self.least, -self.within - 2 * EDGE * workspace.size, 0.0)


def link_clearance(workspace: Workspace, path: JointPath | JointMotion, rough: bool = False) -> LinkClearance:
    """The distance of every link from every obstacle over the motion, from below, to a millionth of the arm.

    Where it is less than the margin it is found less exactly; where rough will do, so it is where it is more.

    On an interval a link is no nearer than it is at the middle less what it may move there, `Workspace.swept`.
    """
    within, calm = (math.inf, True) if isinstance(path, JointMotion) else (reach_clearance(path), steady(path))
    if not workspace.obstacles:
        return LinkClearance(np.inf, 0.0, within, calm)
    proved, at = _least(workspace, path, workspace.clearance, workspace.swept, workspace.margin, rough)
    return LinkClearance(proved, at, within, calm)


def self_clearance(workspace: Workspace, path: JointPath | JointMotion) -> tuple[float, float]:
    """The same, roughly, of links that keep clear of each other [m], and about when [s]; infinite where none do."""
    if not workspace.pairs:
        return math.inf, 0.0
    return _least(workspace, path, workspace.apart, workspace.turned_apart, workspace.self_margin or 0.0, True)


def _least(
    workspace: Workspace,
    path: JointPath | JointMotion,
    apart: Callable[[Array], Array],
    moved: Callable[[Array], Array],
    margin: float,
    rough: bool,
) -> tuple[float, float]:
    """The least of distances over the whole motion [m], from below, and about when [s].

    Args:
        apart: distances of absolute angles, (m, n) -> (m, p);  moved: what they change by at most within a spread.
        margin: below which they are found less exactly;  rough: whether above it, too.
    """
    cuts = np.union1d(np.linspace(0, path.duration, FIRST + 1), path.changes)
    low, high = cuts[:-1], cuts[1:]
    size = workspace.size
    least, at, proved, count = np.inf, 0.0, np.inf, 0
    while len(low):
        count += len(low)
        middle = (low + high) / 2
        links = apart(path.absolute(middle))
        now = np.min(links, axis=1)
        if np.min(now) < least:
            least, at = float(np.min(now)), float(middle[np.argmin(now)])
        bound = np.min(links - moved(path.spread(low, high)), axis=1)
        beyond = min(SPARE * (least - margin), ENOUGH * size) if rough else 0.0
        fine = max(FINE * size, ROUGH * (margin - least) if least < margin else beyond)
        done = (bound >= least - fine) | (high - low <= 1e-9 * path.duration) | (count > MOST)
        proved = min(proved, float(np.min(bound[done], initial=np.inf)))
        low, middle, high = low[~done], middle[~done], high[~done]
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return proved, at


def reach_clearance(path: JointPath) -> float:
    """How far the way of the two links that follow stays from the edges of their annulus [m], negative outside.

    Between two instants h apart the way leaves its chord by no more than (peak + sum c theta'^2 ...) h^2 / 8; for two
    links that is |r''| h^2 / 8. Intervals are halved until that does not matter; the lower end is stated.
    """
    pair, fine = path.two, EDGE * (path.two.outer or 1.0)
    t = np.union1d(np.linspace(0, path.duration, 20 * FIRST + 1), path.motion.nodes)
    low, high = t[:-1], t[1:]
    least, proved, count = np.inf, np.inf, 0
    while len(low):
        count += len(low)
        a, b = path.left(low), path.left(high)
        bend = path.bend(low, high) * (high - low) ** 2 / 8
        ends = np.hypot(*np.stack([a, b]).transpose(2, 0, 1))
        inner = pair.inner if pair.inner > 0 else -np.inf
        room = np.minimum(pair.outer - np.max(ends, axis=0), _nearest(a, b) - inner)
        least = min(least, float(np.min(np.minimum(pair.outer - ends, ends - inner))))  # at instants, not on chords
        done = (room - bend >= least - fine) | (bend <= fine / 2) | (count > MOST)
        proved = min(proved, float(np.min((room - bend)[done], initial=np.inf)))
        low, high = low[~done], high[~done]
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return proved


def _nearest(a: Array, b: Array) -> Array:
    """Distance of the origin from the segments a b, (m, 2) each."""
    step = b - a
    square = np.sum(step**2, axis=1)
    share = np.clip(-np.sum(a * step, axis=1) / np.where(square > 0, square, 1.0), 0, 1)
    return np.asarray(np.hypot(*(a + share[:, None] * step).T))


def steady(path: JointPath) -> bool:
    """Whether no joint jumps: where an angle changes by more than JUMP between instants, these are moved together."""
    at = np.array(path.changes)
    if np.any(np.abs(path.absolute(at) - path.absolute(np.nextafter(at, 0))) > TURN):
        return False
    cuts = np.unique(np.concatenate([np.linspace(0, path.duration, 20 * FIRST + 1), path.motion.nodes, path.changes]))
    low, high = cuts[:-1], cuts[1:]
    for _ in range(HALVINGS):
        # just before the upper end: an elbow that turns over there has not yet done so
        end = np.nextafter(high, 0)
        far = np.max(np.abs(path.absolute(end) - path.absolute(low)), axis=1) > JUMP
        far |= np.max(np.abs(path.absolute(high) - path.absolute(end)), axis=1) > JUMP
        low, high = low[far], high[far]
        if not len(low):
            return True
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return False
