"""Outlines of blocks and of walls, and distances of points from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import Array, Index

BATCH = 1 << 17  # pairs of point and edge held in memory at once


@dataclass(frozen=True)
class Outline:
    """Segments {corner + s along, 0 <= s <= length}: corner [m] and unit vector along (n, 2), length [m] (n,)."""

    corner: Array
    along: Array
    length: Array
    closed: bool

    @classmethod
    def polygon(cls, vertices: Array) -> Outline:
        vertices = np.asarray(vertices, dtype=float)
        corner = vertices[np.any(vertices != np.roll(vertices, -1, axis=0), axis=1)]
        edge = np.roll(corner, -1, axis=0) - corner
        length = np.hypot(*edge.T)
        return cls(corner, edge / length[:, None], length, True)

    @classmethod
    def ray(cls, tip: Array, direction: Array) -> Outline:
        tip, direction = np.asarray(tip, dtype=float), np.asarray(direction, dtype=float)
        return cls(tip[None], (direction / np.hypot(*direction))[None], np.array([np.inf]), False)

    def coordinates(self, points: Array) -> tuple[Array, Array]:
        """Distance [m] along each edge from its corner, and off its line to the left: (..., 2) -> (..., n)."""
        dx, dy = points[..., :1] - self.corner[:, 0], points[..., 1:] - self.corner[:, 1]
        ex, ey = self.along.T
        return dx * ex + dy * ey, ex * dy - ey * dx

    def distances(self, points: Array) -> Array:
        """Distance [m] from each edge: (m, 2) -> (m, n)."""
        s, off = self.coordinates(points)
        return np.asarray(np.sqrt(off * off + np.square(s - np.clip(s, 0, self.length))))

    def distance(self, j: Index, points: Array) -> Array:
        """Distance [m] of each point (m, 2) from its own edge j (m,)."""
        d, e = points - self.corner[j], self.along[j]
        s, off = np.sum(d * e, axis=1), e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]
        return np.asarray(np.hypot(off, s - np.clip(s, 0, self.length[j])))

    def signed(self, points: Array) -> Array:
        """Distance [m] from the outline, negative inside where it is closed: (m, 2) -> (m,)."""
        rows = max(1, BATCH // len(self.corner))
        parts = [self._signed(points[i : i + rows]) for i in range(0, len(points), rows)]
        return np.concatenate([np.zeros(0), *parts])

    def _signed(self, points: Array) -> Array:
        distance: Array = np.min(self.distances(points), axis=1)
        if not self.closed:
            return distance
        # inside, a horizontal ray to the right crosses the boundary an odd number of times
        above = self.corner[:, 1] > points[:, 1:]
        right = (self.coordinates(points)[1] > 0) == (self.along[:, 1] > 0)
        crossings = np.count_nonzero((above != np.roll(above, -1, axis=1)) & right, axis=1)
        return np.asarray(np.where(crossings % 2 == 1, -distance, distance))
