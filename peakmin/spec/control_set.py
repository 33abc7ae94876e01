"""The bound |u| <= M as a disc or as a regular 4n-gon: constraint, gauge, support, error.

A shape is named for M = 1; `M * shape` is the set that the control may lie in. Two functions of it carry
every proof in this package:

    gauge(u)   = min { M : u in M * shape }          (an upper end needs it)
    support(p) = max { p . u : u in shape }          (a lower end needs it)
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from ..errors import SpecError
from ..types import Array
from .model import Count, Model


class Disc(Model):
    """The circle itself, |u| <= M: a second-order cone per hold."""

    kind: Literal["disc"] = "disc"

    def facing(self, angle: float) -> Self:
        """Itself: a disc looks the same from everywhere."""
        return self

    @property
    def error(self) -> float:
        """Largest relative distance between the shape and the circle: none."""
        return 0.0

    def gauge(self, u: Array) -> Array:
        """Smallest M that allows u, shape (..., 2) -> (...)."""
        return np.hypot(u[..., 0], u[..., 1])

    def support(self, p: Array) -> Array:
        """Largest p . u over the shape, shape (..., 2) -> (...)."""
        return np.hypot(p[..., 0], p[..., 1])


class Polygon(Model):
    """The regular 4n-gon with a vertex on each axis, n `segments` in each quadrant (the paper's figure 3).

    Args:
        segments: n, edges in one quadrant.
        fit: "inscribed" has its vertices on the circle (M can only come out larger than the disc's);
            "circumscribed" has its edges on it (M can only come out smaller).
        align: "axes" has a vertex on each axis, "frame" on the way from start to goal and across it.
    """

    kind: Literal["polygon"] = "polygon"
    segments: Annotated[Count, Field(le=10_000)] = 5
    fit: Literal["inscribed", "circumscribed"] = "inscribed"
    align: Literal["axes", "frame"] = "axes"
    _turn: float = 0.0  # [rad], of the vertices against the axes

    def facing(self, angle: float) -> Self:
        """The polygon for a way from start to goal at this angle [rad]."""
        if self.align == "axes":
            return self
        turned = self.model_copy()
        turned._turn = angle
        return turned

    @classmethod
    def for_error(cls, error: float, fit: Literal["inscribed", "circumscribed"] = "inscribed") -> Self:
        """The polygon with the fewest edges whose `error` is at most the wanted one.

        Raises:
            SpecError: unless 0 < error < 1.
        """
        if not 0 < error < 1:
            raise SpecError(f"error: was {error}, must be between 0 and 1")
        # 1 - cos(a) = 2 sin^2(a/2) keeps its digits for small errors
        half = math.asin(math.sqrt(error / 2))
        segments = max(1, math.ceil(math.pi / (8 * half) - 1e-9))
        smallest = segments if cls._error(segments) <= error else segments + 1
        return cls(segments=smallest, fit=fit)

    @staticmethod
    def _error(segments: int) -> float:
        return 2 * math.sin(math.pi / (8 * segments)) ** 2

    @property
    def error(self) -> float:
        """Largest relative distance between edge and circle, 1 - cos(pi/(4n)) (the paper's figure 11)."""
        return self._error(self.segments)

    @property
    def inradius(self) -> float:
        """Distance of the edges from the centre for M = 1."""
        return math.cos(math.pi / (4 * self.segments)) if self.fit == "inscribed" else 1.0

    @property
    def circumradius(self) -> float:
        """Distance of the vertices from the centre for M = 1."""
        return self.inradius / math.cos(math.pi / (4 * self.segments))

    @property
    def normals(self) -> Array:
        """Outward unit normals a_j of the edges, at the angles (j + 1/2) pi/(2n); shape (4n, 2)."""
        angle = (np.arange(4 * self.segments) + 0.5) * (np.pi / (2 * self.segments)) + self._turn
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)

    @property
    def vertices(self) -> Array:
        """Vertices for M = 1, at the angles j pi/(2n); shape (4n, 2)."""
        angle = np.arange(4 * self.segments) * (np.pi / (2 * self.segments)) + self._turn
        return self.circumradius * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def gauge(self, u: Array) -> Array:
        """Smallest M that allows u, max_j a_j . u / inradius; shape (..., 2) -> (...)."""
        return self._along(u, offset=0.5) / self.inradius

    def support(self, p: Array) -> Array:
        """Largest p . u over the shape, max over the vertices; shape (..., 2) -> (...)."""
        return self._along(p, offset=0.0) * self.circumradius

    def _along(self, u: Array, offset: float) -> Array:
        """max_j u . e((j + offset) step): |u| times the cosine of the angle to the nearest e."""
        step = np.pi / (2 * self.segments)
        turns = (np.arctan2(u[..., 1], u[..., 0]) - self._turn) / step - offset
        away = (turns - np.round(turns)) * step
        along: Array = np.hypot(u[..., 0], u[..., 1]) * np.cos(away)
        return along


Circle = Annotated[Disc | Polygon, Field(discriminator="kind")]
