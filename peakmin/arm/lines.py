"""Where a line is put: through the place that a path is deepest in, or where a contact that slid stands best."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from ..deadline import over
from .kinematics import unit
from .passage import Line, Order, Passage

SHALLOW = 1e-6  # of the arm: a path no further inside counts as touching
TURNS, PLACES, STEPS = 24, 16, 120  # lines looked at: directions, places of the path, steps along each
AT_ONCE = 64  # lines
WINDOW, GRID = 0.03, 21  # of the arm: how far around a contact a better place is looked for; grid points each way
IDLE = 1e-6  # of the largest multiplier


def deepest(passage: Passage, order: Order, path: Array, slack: Array, until: float = math.inf) -> Line | None:
    """The line through a place where the path hits something along which it is furthest to the next free place.

    Args:
        order: conditions whose lines are not to come again.
        path, slack: places of the centre of mass [m], (m, 2), and how far from touching the arm is there [m], (m,).
        until: a deadline, after which the best of the lines looked at is taken.
    """
    shallow = SHALLOW * passage.workspace.size
    bad = np.flatnonzero(slack < -shallow)
    bad = bad[np.unique(np.linspace(0, len(bad) - 1, PLACES).astype(int))]
    bad = np.unique(np.append(bad, np.argmin(slack)))
    turned = passage.frame.angle + math.pi * (np.arange(TURNS) / TURNS - 0.5)
    lines = []
    for at in bad.tolist():
        for angle in turned.tolist():
            line = Line(angle, float(unit(angle) @ (path[at] - passage.maneuver.start.position)))
            known = any(
                abs(one.line.angle - angle) < 1e-9 and abs(one.line.offset - line.offset) < shallow for one in order
            )
            if passage.parts(line) and not known:
                lines.append((at, line))
    if not lines:
        return None
    reach = 2 * passage.workspace.chain.reach[1]
    step = reach * (np.arange(1, STEPS + 1) / STEPS) ** 2  # finer close to the path
    step = np.concatenate([-step[::-1], step])
    found, most = None, -1.0
    for some in (lines[k : k + AT_ONCE] for k in range(0, len(lines), AT_ONCE)):
        across = np.array([[-math.sin(line.angle), math.cos(line.angle)] for _, line in some])
        r = path[[at for at, _ in some]][:, None, :] + step[:, None] * across[:, None, :]
        away = np.min(np.where(passage.sheets.slack(r) >= 0, np.abs(step), np.inf), axis=1)
        away[np.isinf(away)] = -1.0
        if np.max(away) > most:
            found, most = some[int(np.argmax(away))][1], float(np.max(away))
        if over(until):
            break
    return found


def slid(passage: Passage, order: Order, multipliers: Array) -> Line | None:
    """The line on which the contact that gives way most by sliding stands best; None where all stand well.

    The least peak grows with the place w of a contact along its multiplier l. So the best place of what blocks the
    line there is the one furthest along l, and the best line the one through it along l.

    Args:
        order: the conditions;  multipliers: of their optimum, the conditions' from the third row on.
    """
    found, most = None, SHALLOW * passage.workspace.size
    for one, push in zip(order, multipliers[2:], strict=True):
        if not np.hypot(*push) > IDLE * np.max(np.abs(multipliers)):
            continue
        f = push / np.hypot(*push)
        origin, along = passage.points(one.line)
        low, high = passage.gaps(one.line)[one.gap]
        w = origin + (low if f @ along > 0 else high) * along
        best = _furthest(passage, w, f)
        gain, normal = float(f @ (best - w)), np.array([f[1], -f[0]])
        normal = normal if normal @ passage.frame.along > 0 else -normal
        line = Line(math.atan2(normal[1], normal[0]), float(normal @ (best - passage.maneuver.start.position)))
        if gain > most and passage.parts(line):
            most, found = gain, line
    return found


def _furthest(passage: Passage, w: Array, f: Array) -> Array:
    """The place near w furthest along f where the arm is blocked, by grids that close in on it."""
    across, half = np.array([-f[1], f[0]]), WINDOW * passage.workspace.size
    side = np.linspace(-1, 1, GRID)
    while half > 0.1 * SHALLOW * passage.workspace.size:
        r = w + half * (side[:, None, None] * f + side[None, :, None] * across)
        blocked = passage.sheets.slack(r) < 0
        if np.any(blocked):
            w = r[np.unravel_index(np.argmax(np.where(blocked, side[:, None], -np.inf)), blocked.shape)]
        half *= 4 / GRID
    return np.asarray(w)
