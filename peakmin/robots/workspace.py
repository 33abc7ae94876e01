"""What the links may not touch: distances, and what is proved of all configurations near one.

While every angle theta_k stays within d_k of a configuration, no point of link k moves by more than
D_k = sum_{i<=k} l_i d_i. So a link further than D_k from the obstacles there is free of them everywhere near, and one
with a point deeper than D_k inside touches them everywhere near.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ..types import Array
from .kinematics import ANGLE, Chain, Pair
from .separation import self_separations

Geometries = NDArray[np.object_]  # of shapely
FREE, OPEN, BLOCKED = 1, 0, -1
PROBES = np.linspace(0.1, 0.9, 5)  # fractions of a link's part inside an obstacle at which its depth is looked for
FIRST_CELLS = 64
ROUNDED = 1e-12  # relative: by which radii that come out of angles are drawn out
MOST_CELLS = 4000  # open cells of one level; more are left open


@dataclass(frozen=True)
class Workspace:
    """An arm among obstacles.

    obstacles: the corners of polygons, (k, 2) [m] each;  margin: that every link keeps from them [m];  self_margin:
    that links which share no joint keep from each other [m], None where they may pass over one another.
    """

    chain: Chain
    obstacles: tuple[Array, ...]
    margin: float
    self_margin: float | None = None

    @property
    def size(self) -> float:
        """Length of the stretched arm [m]."""
        return self.chain.size

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Links i < j that keep clear of each other."""
        n = self.chain.links
        return [] if self.self_margin is None else [(i, j) for i in range(n) for j in range(i + 2, n)]

    @cached_property
    def _polygons(self) -> list[shapely.Polygon]:
        return [shapely.Polygon(corners) for corners in self.obstacles]

    @cached_property
    def _world(self) -> BaseGeometry:
        return shapely.union_all(self._polygons)

    def clearance(self, theta: Array, world: BaseGeometry | None = None) -> Array:
        """Distance [m] of every link from the obstacles, (..., n) -> (..., n); negative where it is inside.

        Inside, a point of the link is at least this deep.
        """
        world = self._world if world is None else world
        if shapely.is_empty(world):
            return np.full(theta.shape, np.inf)
        lines = self._lines(theta)
        shapely.prepare(world)
        out = shapely.distance(lines, world)
        inside = out == 0
        if np.any(inside):
            out[inside] = -_depth(lines[inside], world)
        return np.asarray(out - self.chain.half_width)

    def _lines(self, theta: Array) -> Geometries:
        """Every link's own, (..., n) -> (..., n)."""
        points = self.chain.joints(theta)
        return np.asarray(shapely.linestrings(np.stack([points[..., :-1, :], points[..., 1:, :]], axis=-2)))

    def apart(self, theta: Array) -> Array:
        """Distance [m] of the links of every pair from each other, (..., n) -> (..., p); negative where they meet."""
        lines, width = self._lines(theta), self.chain.half_width
        i, j = np.array(self.pairs, dtype=int).reshape(-1, 2).T
        out = np.asarray(shapely.distance(lines[..., i], lines[..., j]) - width[i] - width[j])
        crossed = np.any(out <= -width[i] - width[j], axis=-1)
        if np.any(crossed):  # by how much they do
            deep, _ = self_separations(self.chain, np.asarray(theta)[crossed].reshape(-1, self.chain.links), self.pairs)
            out[crossed] = np.minimum(out[crossed], deep)
        return out

    def turned_apart(self, spread: Array) -> Array:
        """How far [m] the links of a pair may move against each other, angles within d_k [rad]; (..., n) -> (..., p).

        Seen from the joint at the end of link i, that link moves by l_i d_i and link j by sum_{i<k<=j} l_k d_k.
        """
        swept = self.swept(spread)
        before = np.concatenate([np.zeros_like(swept[..., :1]), swept], axis=-1)
        i, j = np.array(self.pairs, dtype=int).reshape(-1, 2).T
        return np.asarray(swept[..., j] - before[..., i])

    def touched(self, theta: Array) -> tuple[int, int, float] | None:
        """An obstacle nearer than the margin in a configuration (n,): its index, the link's, their distance [m]."""
        for i, polygon in enumerate(self._polygons):
            links = self.clearance(theta, polygon)
            if np.min(links) < self.margin * (1 - 1e-12):
                return i, int(np.argmin(links)), float(np.min(links))
        return None

    def nearest(self, theta: Array) -> Contact:
        """Which part of the arm is nearest to which obstacle, shape (n,)."""
        link = int(np.argmin(self.clearance(theta)))
        points = self.chain.joints(theta)
        line = shapely.LineString(points[link : link + 2])
        block = int(np.argmin([line.distance(polygon) for polygon in self._polygons]))
        on_arm, on_block = shapely.shortest_line(line, self._polygons[block]).coords
        along = float(np.hypot(*(np.array(on_arm) - points[link])) / self.chain.length[link])
        return Contact(link, along, block, (float(on_block[0]), float(on_block[1])))

    def swept(self, spread: Array) -> Array:
        """D_k [m] for angles within d_k [rad], (..., n) -> (..., n)."""
        return np.asarray(np.cumsum(self.chain.length * spread, axis=-1))

    def decide(self, theta: Array, spread: Array) -> Array:
        """FREE where every configuration within the spread is, BLOCKED where none is, else OPEN; (..., n) -> (...)."""
        slack = self.clearance(theta) - self.margin
        moved = self.swept(spread)
        free = np.all(slack > moved, axis=-1)
        blocked = np.any(slack < -moved, axis=-1)
        return np.where(free, FREE, np.where(blocked, BLOCKED, OPEN))


@dataclass(frozen=True)
class Contact:
    """What touches, or is nearest: the fraction `along` of a link, and a place [m] on an obstacle's edge."""

    link: int
    along: float
    obstacle: int
    at: tuple[float, float]

    def __str__(self) -> str:
        part = (
            "its end"
            if self.along > 1 - 1e-6
            else "its first joint"
            if self.along < 1e-6
            else f"{self.along:.3f} of it"
        )
        return f"link {self.link + 1} ({part}) at obstacles[{self.obstacle}] ({self.at[0]:.4f}, {self.at[1]:.4f})"


def _depth(lines: Geometries, world: BaseGeometry) -> Array:
    """How deep inside some point of each line is [m], zero for a line that only touches."""
    parts = shapely.intersection(lines, world)
    probes = shapely.line_interpolate_point(_longest(parts)[:, None], PROBES, normalized=True)
    depth = shapely.distance(probes, world.boundary)
    return np.asarray(np.max(np.nan_to_num(depth), axis=1))


EMPTY = shapely.LineString()


def _longest(parts: Geometries) -> Geometries:
    """The longest line of each geometry; a point where there is none."""
    out = np.array(parts, dtype=object)
    for i in np.flatnonzero(shapely.get_type_id(parts) != shapely.GeometryType.LINESTRING).tolist():
        pieces = [piece for piece in getattr(parts[i], "geoms", []) if piece.geom_type == "LineString"]
        out[i] = max(pieces, key=lambda piece: piece.length) if pieces else EMPTY
    return out


@dataclass(frozen=True)
class Sheets:
    """The configurations of a two-link arm with elbows -1, 1 or both: maps of the annulus of its centre of mass.

    A place is blocked where it is so in every sheet, or beyond what the second joint's limits leave of it there.

    limits: least and largest angle of the second joint [rad], or None.
    """

    workspace: Workspace
    elbows: tuple[float, ...]
    limits: tuple[float, float] | None = None

    @cached_property
    def pair(self) -> Pair:
        return Pair(*self.workspace.chain.c.tolist())

    @cached_property
    def rings(self) -> list[list[tuple[float, float]]]:
        """For each elbow, inner and outer radii [m] of where the limits leave the centre of mass."""
        return [
            [(self.pair.radius(far) * (1 - ROUNDED), self.pair.radius(near) * (1 + ROUNDED)) for near, far in bends]
            if self.limits
            else [(self.pair.inner, self.pair.outer)]
            for bends in (bends_within(self.limits, elbow) for elbow in self.elbows)
        ]

    def slack(self, r: Array) -> Array:
        """How far the arm is from touching or r from its rings' edges [m], negative beyond; (..., 2) -> (...)."""
        s = r - self.workspace.chain.base
        rho = np.hypot(s[..., 0], s[..., 1])
        free = []
        for elbow, rings in zip(self.elbows, self.rings, strict=True):
            room = np.full(rho.shape, -np.inf)
            for inner, outer in rings:
                room = np.maximum(room, np.minimum(outer - rho, rho - inner if inner > 0 else np.inf))
            if self.workspace.obstacles:
                apart = np.min(self.workspace.clearance(self.pair.angles(s, elbow)), axis=-1)
                room = np.minimum(room, apart - self.workspace.margin)
            free.append(room)
        return np.asarray(np.max(free, axis=0))

    def decide(self, r: Array, radius: Array) -> Array:
        """FREE, BLOCKED or OPEN for all centres of mass in balls around r, (..., 2) and (...) [m] -> (...)."""
        s = r - self.workspace.chain.base
        rho, spread = np.hypot(s[..., 0], s[..., 1]), self.pair.spread(s, radius)
        out = np.full(rho.shape, BLOCKED)
        for elbow, rings in zip(self.elbows, self.rings, strict=True):
            here = self.workspace.decide(self.pair.angles(s, elbow), spread)
            beyond, reached = np.ones(rho.shape, dtype=bool), np.zeros(rho.shape, dtype=bool)
            for inner, outer in rings:
                beyond &= (rho - radius > outer) | (rho + radius < inner)
                reached |= (rho + radius <= outer) & (rho - radius >= inner)
            here = np.where((here == FREE) & ~reached, OPEN, here)
            out = np.maximum(out, np.where(beyond, BLOCKED, here))
        return out

    def gaps(self, origin: Array, along: Array, low: float, high: float, finest: float) -> list[tuple[float, float]]:
        """The intervals of y in [low, high] where origin + y along, (2,) each [m], is not proved blocked.

        Their ends are proved to about `finest` [m]: what is left out is blocked for certain.
        """
        edges = np.linspace(low, high, FIRST_CELLS + 1)
        cells = np.stack([edges[:-1], edges[1:]], axis=1)
        kept: list[Array] = []
        while len(cells):
            middle, half = cells.mean(axis=1), (cells[:, 1] - cells[:, 0]) / 2
            found = self.decide(origin + middle[:, None] * along, half * (1 + 1e-9))
            fine = (2 * half <= finest) | (len(cells) > MOST_CELLS)
            kept.append(cells[(found == FREE) | ((found == OPEN) & fine)])
            cells = cells[(found == OPEN) & ~fine]
            middle = cells.mean(axis=1)
            cells = np.vstack([np.stack([cells[:, 0], middle], axis=1), np.stack([middle, cells[:, 1]], axis=1)])
        return _merged(np.vstack(kept))


def bends_within(limits: tuple[float, float] | None, elbow: float) -> list[tuple[float, float]]:
    """The intervals of |bend| in [0, pi] that a second joint within limits [rad] can have with an elbow, -1 or 1.

    Whole turns of the joint are the same bend. Drawn out by ANGLE, to which limits are kept.
    """
    if limits is None:
        return [(0.0, math.pi)]
    low, high = (limits[0] - ANGLE, limits[1] + ANGLE) if elbow > 0 else (-limits[1] - ANGLE, -limits[0] + ANGLE)
    out: list[tuple[float, float]] = []
    for turn in range(math.floor(low / math.tau), math.ceil(high / math.tau) + 1):
        near, far = max(low - turn * math.tau, 0.0), min(high - turn * math.tau, math.pi)
        if near <= far and (near, far) not in out:
            out.append((near, far))
    return out


def _merged(cells: Array) -> list[tuple[float, float]]:
    out: list[tuple[float, float]] = []
    for low, high in cells[np.argsort(cells[:, 0])].tolist():
        if out and low <= out[-1][1] + 1e-12 * abs(high):
            out[-1] = (out[-1][0], max(out[-1][1], high))
        else:
            out.append((low, high))
    return out
