"""The least distance of the links from the obstacles over a whole motion, proved between the instants looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .joints import JointPath
from .workspace import Workspace

FIRST = 200  # intervals looked at first
FINE = 1e-6  # of the arm: to which the least distance is found
MOST = 200_000  # intervals; where they do not do, the bound found so far is stated


@dataclass(frozen=True)
class LinkClearance:
    """least: no link is nearer to an obstacle at any instant [m], negative inside;  at: where it is about reached [s].

    within: how far the path of the centre of mass is from the edges of what the arm reaches [m].
    """

    least: float
    at: float
    within: float


def link_clearance(workspace: Workspace, path: JointPath) -> LinkClearance:
    """The distance of every link from every obstacle over the motion, to a millionth of the arm.

    On an interval a link is no nearer than it is at the middle less what it may move there, `Workspace.swept`.
    """
    within = reach_clearance(path)
    if not workspace.maneuver.obstacles:
        return LinkClearance(np.inf, 0.0, within)
    cuts = np.union1d(np.linspace(0, path.duration, FIRST + 1), path.changes)
    low, high = cuts[:-1], cuts[1:]
    fine = FINE * workspace.size
    least, at, proved, count = np.inf, 0.0, np.inf, 0
    while len(low):
        count += len(low)
        middle = (low + high) / 2
        theta = path.absolute(middle)
        links = workspace.clearance(theta)
        now = np.min(links, axis=1)
        if np.min(now) < least:
            least, at = float(np.min(now)), float(middle[np.argmin(now)])
        bound = np.min(links - workspace.swept(path.spread(low, high)), axis=1)
        done = (bound >= least - fine) | (high - low <= 1e-9 * path.duration) | (count > MOST)
        proved = min(proved, float(np.min(bound[done], initial=np.inf)))
        low, middle, high = low[~done], middle[~done], high[~done]
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return LinkClearance(proved, at, within)


def reach_clearance(path: JointPath) -> float:
    """How far the way of the two links that follow stays from the edges of their annulus [m], negative outside.

    Between samples |s| moves by less than speed times time; touching an edge counts as zero.
    """
    pair, motion = path.two, path.motion
    t = np.union1d(np.linspace(0, path.duration, 20 * FIRST + 1), motion.nodes)
    rho = np.hypot(*np.asarray(path.left(t)).T)
    room: Array = np.minimum(pair.outer - rho, rho - pair.inner if pair.inner > 0 else np.inf)
    return float(np.min(room))
