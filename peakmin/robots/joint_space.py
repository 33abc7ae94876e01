"""Can a two-link arm get from start to goal at all? Its joint space, flooded cell by cell.

The absolute angles (theta_1, theta_2) fill a square that closes on itself. A cell is BLOCKED where some link touches in
each of its configurations, FREE where none does in any of them; what is neither is cut into four. A motion goes from
cell to neighbour, corners included, and through none that is BLOCKED: where these part start from goal there is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from ..deadline import over
from ..geometry.trajectory import Polynomial
from ..types import Array
from .kinematics import unit
from .workspace import BLOCKED, FREE, OPEN, Workspace

FLOODS = (32, 64, 128, 256, 512)  # cells to a turn
MOST_PLACES, PIECES = 24, 60  # of a way that is followed


@dataclass(frozen=True)
class Flood:
    """found: FREE, OPEN or BLOCKED of every cell of m to a turn, (m, m), from -pi on."""

    workspace: Workspace
    found: NDArray[np.int_]

    @property
    def cells(self) -> int:
        """m"""
        return len(self.found)

    @cached_property
    def middles(self) -> Array:
        """(m,) [rad]"""
        return np.asarray(-np.pi + (np.arange(self.cells) + 0.5) * 2 * np.pi / self.cells)

    def cell(self, theta: Array) -> tuple[int, int]:
        """Where a configuration (2,) [rad] is."""
        k = np.floor((np.asarray(theta) + np.pi) * self.cells / (2 * np.pi)).astype(int) % self.cells
        return int(k[0]), int(k[1])

    def sheet(self, elbow: float) -> Array:
        """Cells with some configuration of this elbow or in line, (m, m)."""
        apart = (self.middles - self.middles[:, None] + np.pi) % (2 * np.pi) - np.pi
        room = 2 * np.pi / self.cells * (1 + 1e-9)
        return np.asarray((elbow * apart >= -room) | (np.abs(apart) >= np.pi - room))

    def parts(self, ends: tuple[Array, ...], elbow: float | None = None) -> bool:
        """Whether it is proved that no motion, or none that keeps this elbow, joins two configurations (2,)."""
        open_ = self.found != BLOCKED
        if elbow is not None:
            open_ &= self.sheet(elbow)
        # the square closes on itself: names that meet across its sides are one
        names, count = label(open_, np.ones((3, 3)))
        same = [
            (names[i, 0], names[(i + shift) % self.cells, -1]) for i in range(self.cells) for shift in (-1, 0, 1)
        ] + [(names[0, j], names[-1, (j + shift) % self.cells]) for j in range(self.cells) for shift in (-1, 0, 1)]
        pairs = np.array([pair for pair in same if 0 not in pair]).reshape(-1, 2)
        graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count + 1, count + 1))
        a, b = (names[self.cell(end)] for end in ends)
        return bool(not np.isfinite(dijkstra(graph, directed=False, indices=a, unweighted=True)[b]))

    def finer(self) -> Flood:
        """The same with twice as many cells to a turn."""
        found = np.kron(self.found, np.ones((2, 2), dtype=self.found.dtype))
        return _decided(Flood(self.workspace, found))

    def way(
        self, ends: tuple[Array, ...], elbow: float | None = None, limits: tuple[float, float] | None = None
    ) -> Array | None:
        """Configurations (k, 2) from cell to FREE neighbour, on which the centre of mass goes the shortest way.

        limits: of joint 2 [rad], which cells in the middle of the way keep.
        """
        free, m = self.found == FREE, self.cells
        if limits is not None:
            bent = np.mod(self.middles - self.middles[:, None] - limits[0], 2 * np.pi) + limits[0]
            free &= bent <= limits[1]
        if elbow is not None:
            free &= self.sheet(elbow)
        for end in ends:
            free[self.cell(end)] = True
        names = np.where(free, np.arange(m * m).reshape(m, m), -1)
        c = self.workspace.chain.c
        at = c[0] * unit(self.middles)[:, None, :] + c[1] * unit(self.middles)[None, :, :]
        rows, columns, steps = [], [], []
        for shift in ((1, 0), (0, 1), (1, 1), (1, -1)):
            other, there = np.roll(names, shift, (0, 1)), np.roll(at, shift, (0, 1))
            both = (names >= 0) & (other >= 0)
            rows.append(names[both])
            columns.append(other[both])
            steps.append(np.hypot(*np.moveaxis((at - there)[both], -1, 0)) + 1e-9)
        graph = coo_array((np.concatenate(steps), (np.concatenate(rows), np.concatenate(columns))), (m * m, m * m))
        a, b = (names[self.cell(end)] for end in ends)
        far, before = dijkstra(graph, directed=False, indices=a, return_predecessors=True)
        if not np.isfinite(far[b]):
            return None
        way = [int(b)]
        while way[-1] != a:
            way.append(int(before[way[-1]]))
        i, j = np.divmod(np.array(way[::-1]), m)
        return np.vstack([ends[0], np.stack([self.middles[i], self.middles[j]], axis=1)[1:-1], ends[1]])


def flood(workspace: Workspace, cells: int = FLOODS[0]) -> Flood:
    """The joint space of a two-link arm with so many cells to a turn, one of FLOODS."""
    found = _decided(Flood(workspace, np.full((FLOODS[0], FLOODS[0]), OPEN)))
    while found.cells < cells:
        found = found.finer()
    return found


def decisive_flood(
    workspace: Workspace, ends: list[tuple[tuple[Array, ...], float | None]], until: float = math.inf
) -> Flood:
    """The coarsest flood, of FLOODS, that parts or joins each two configurations, keeping the elbow given with them.

    After the deadline `until` it gets no finer.
    """
    found = flood(workspace)
    while found.cells < FLOODS[-1] and not over(until):
        if all(found.parts(*one) or found.way(*one) is not None for one in ends):
            break
        found = found.finer()
    return found


@dataclass(frozen=True)
class JointWay:
    """Configurations (k, 2) from start to goal, from each to the next free: to follow within a duration [s]."""

    workspace: Workspace
    angles: Array
    duration: float

    @cached_property
    def shares(self) -> Array:
        """Of the centre of mass's whole way, (k,)."""
        steps = np.hypot(*np.diff(self.workspace.chain.centre(self.angles), axis=0).T) + 1e-9 * self.workspace.size
        return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / np.sum(steps))

    @cached_property
    def motion(self) -> Polynomial:
        """About along it, speeding up half of the time and slowing down the other."""
        every = np.linspace(0, len(self.angles) - 1, min(len(self.angles), MOST_PLACES)).round().astype(int)
        t = np.linspace(0, 1, PIECES + 1)
        eased = np.where(t < 0.5, 2 * t**2, 1 - 2 * (1 - t) ** 2)
        places = PchipInterpolator(self.shares[every], self.workspace.chain.centre(self.angles[every]))(eased)
        return Polynomial(CubicSpline(t * self.duration, places, bc_type="clamped"))

    def timed(self, pieces: int) -> Array:
        """Joint angles (pieces+1, 2) at even times along it, speeding up half of the time, without jumps."""
        joints = np.diff(np.unwrap(self.angles, axis=0), axis=1, prepend=0.0)
        size = np.abs(np.diff(joints, axis=0)).sum(axis=1) + 1e-9
        shares = np.concatenate([[0.0], np.cumsum(size) / np.sum(size)])
        s = np.linspace(0, 1, pieces + 1)
        eased = np.where(s < 0.5, 2 * s * s, 1 - 2 * (1 - s) ** 2)
        return np.stack([np.interp(eased, shares, column) for column in joints.T], axis=1)

    @property
    def turns(self) -> list[tuple[float, float, float]]:
        """Where the elbow turns over: time as a share of the duration, angle of the centre of mass seen from the base
        [rad], and the cosine of the elbow's angle, near 1 where the arm is stretched and near -1 where it is folded.
        """
        apart = self.angles[:, 1] - self.angles[:, 0]
        out = []
        for k in np.flatnonzero(np.diff(np.sin(apart) > 0)).tolist():
            share = float(self.shares[k : k + 2].mean())
            t = math.sqrt(share / 2) if share < 0.5 else 1 - math.sqrt((1 - share) / 2)
            s = self.workspace.chain.centre(self.angles[k : k + 2]).mean(axis=0) - self.workspace.chain.base
            out.append((t, math.atan2(s[1], s[0]), math.cos(float(apart[k]))))
        return out


def _decided(flood: Flood) -> Flood:
    """The same with all OPEN cells looked at."""
    i, j = np.nonzero(flood.found == OPEN)
    theta = np.stack([flood.middles[i], flood.middles[j]], axis=1)
    half = np.full(theta.shape, np.pi / flood.cells * (1 + 1e-9))
    found = flood.found.copy()
    found[i, j] = flood.workspace.decide(theta, half) if len(i) else OPEN
    return Flood(flood.workspace, found)
