"""What stands in the way: walls, which are rays, and blocks, which are polygons."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
import shapely
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from ..geometry.norm import length, norm
from ..types import Array
from .model import Model, Positive, Vector, few

MOST_OBSTACLES = 100
MOST_CORNERS = 2000  # of all blocks together: the strips between them are as many, and each is compared with every edge
ROUND = 32  # edges of a quarter circle around a corner that a margin rounds off, inside the true one


class Wall(Model):
    """A ray from `tip` [m] along `direction`; the path crosses its line on the free side of the tip, at one instant.

    Args:
        tip: end of the ray, (d, h) of the paper.
        direction: from the tip into the wall, any length but zero; the paper's wall hangs down, (0, -1).
        contact: "touch" crosses the line at the tip (the paper), "clear" at the tip or beyond it.
        opening: width [m] of the free part of the line, beyond which another wall begins (a slit); default no end.
    """

    kind: Literal["wall"] = "wall"
    tip: Vector
    direction: Vector = (0.0, -1.0)
    contact: Literal["touch", "clear"] = "clear"
    opening: Positive | None = None

    @model_validator(mode="after")
    def _has_a_direction(self) -> Wall:
        if length(self.direction) < 1e-150:
            raise ValueError(f".direction: was {list(self.direction)}, must not be zero")
        if self.opening is not None and self.contact == "touch":
            raise ValueError(f".opening: was {self.opening}, must be left out where the tip is touched")
        return self

    @property
    def rays(self) -> list[tuple[Array, Array]]:
        """Tip and unit direction of the ray, and of the one across the opening."""
        tip, along = np.array(self.tip), np.array(self.direction) / length(self.direction)
        return [(tip, along)] + ([(tip - self.opening * along, -along)] if self.opening is not None else [])


def _corners(vertices: tuple[Vector, ...]) -> tuple[Vector, ...]:
    if len(vertices) > 3 and vertices[0] == vertices[-1]:  # a closed ring
        vertices = vertices[:-1]
    for i, (a, b) in enumerate(zip(vertices, (*vertices[1:], vertices[0]), strict=True)):
        if a == b:
            place = (i + 1) % len(vertices)
            raise ValueError(f"corners that differ from the one before (vertices[{place}] does not)")
    polygon = shapely.Polygon(vertices)
    if not polygon.is_valid or polygon.area == 0:
        raise ValueError("the corners of a polygon in order, with an area and without crossing edges")
    return vertices


Corners = Annotated[tuple[Vector, ...], Field(min_length=3, max_length=1000), few(1000), AfterValidator(_corners)]


class Block(Model):
    """A polygon that the path stays out of, convex or not.

    Args:
        vertices: corners in order, either way round, [m], shape (n, 2); the first may be repeated at the end.
        side: on which side of it the path goes, seen along the way from start to goal: "left" leaves the block on
            the right hand; "either" finds the better one.
    """

    kind: Literal["block"] = "block"
    vertices: Corners
    side: Literal["left", "right", "either"] = "either"

    def grown(self, margin: float, origin: Vector = (0.0, 0.0)) -> list[Array]:
        """The corners, shape (n, 2), of the polygon that a distance of `margin` [m] keeps out, and of its holes.

        Corners are rounded by chords of the true arc, so that the polygon is never too large. One with dents is put
        together of itself, a circle's chords about each corner and a rectangle along each edge: shapely's buffer would
        straighten dents to either side.

        Args:
            origin: [m], from where the corners are seen.
        """
        corners = np.array(self.vertices) - origin
        polygon: Any = shapely.Polygon(corners)
        if margin > 0 and polygon.convex_hull.equals(polygon):
            polygon = polygon.buffer(margin, quad_segs=ROUND)
        elif margin > 0:
            after = np.roll(corners, -1, axis=0)
            step = after - corners
            out = margin * np.stack([step[:, 1], -step[:, 0]], axis=1) / norm(step)[:, None]
            sides = np.stack([corners - out, after - out, after + out, corners + out], axis=1)
            around: Any = shapely.buffer(shapely.points(corners), margin, quad_segs=ROUND)
            polygon = shapely.union_all([polygon, *around, *np.asarray(shapely.polygons(sides))])
        return [np.array(ring.coords)[:-1] for ring in (polygon.exterior, *polygon.interiors)]

    def shadow(self, margin: float, across: Array, far: float) -> Array:
        """The corners, shape (n, 2), of what the margin keeps out with all that lies behind it, up to `far` [m] away.

        Args:
            margin: [m].
            across: unit vector (2,) away from the side on which the path goes.
        """
        corners, push = self.grown(margin)[0], far * across
        polygon, after = shapely.Polygon(corners), np.roll(corners, -1, axis=0)
        parts = [shapely.Polygon([a, b, b + push, a + push]) for a, b in zip(corners, after, strict=True)]
        whole: Any = shapely.union_all([polygon, *(part for part in parts if part.area > 0 and part.is_valid)])
        return np.array(whole.exterior.coords)[:-1]

    def holds(self, point: Vector, margin: float) -> bool:
        """Whether the point is nearer than the margin [m], or inside."""
        polygon, at = shapely.Polygon(self.vertices), shapely.Point(point)
        return bool(polygon.contains(at)) or bool(polygon.distance(at) < margin * (1 - 1e-12))


def _kind(value: object) -> object:
    if isinstance(value, Mapping):
        return value.get("kind", "block" if "vertices" in value else "wall")
    return getattr(value, "kind", None)


Obstacle = Annotated[
    Annotated[Wall, Tag("wall")] | Annotated[Block, Tag("block")],
    Discriminator(_kind),
]


Some = TypeVar("Some", bound="tuple[Wall | Block, ...]")


def _few_corners(obstacles: Some) -> Some:
    """The obstacles. Raises `ValueError` where their corners are too many."""
    corners = sum(len(one.vertices) for one in obstacles if isinstance(one, Block))
    if corners > MOST_CORNERS:
        raise ValueError(f"blocks of at most {MOST_CORNERS} corners together, not {corners}")
    return obstacles


_Most = Field(max_length=MOST_OBSTACLES)
Obstacles = Annotated[tuple[Obstacle, ...], _Most, few(MOST_OBSTACLES), AfterValidator(_few_corners)]
Blocks = Annotated[tuple[Block, ...], _Most, few(MOST_OBSTACLES), AfterValidator(_few_corners)]


def convex(corners: tuple[Vector, ...]) -> tuple[Vector, ...]:
    """The corners of a convex polygon, counterclockwise. Raises `ValueError` where they are not."""
    corners = _corners(corners)
    points = np.array(corners)
    step = np.roll(points, -1, axis=0) - points
    turn = step[:, 0] * np.roll(step[:, 1], -1) - step[:, 1] * np.roll(step[:, 0], -1)
    if not (np.all(turn >= 0) or np.all(turn <= 0)):
        raise ValueError("the corners of a convex polygon in order")
    return corners if np.sum(turn) > 0 else corners[::-1]


def covers(region: tuple[Vector, ...], point: Vector) -> bool:
    """Whether the point lies in the polygon or on its edge."""
    return bool(shapely.Polygon(region).covers(shapely.Point(point)))


Region = Annotated[tuple[Vector, ...], Field(min_length=3, max_length=100), few(100), AfterValidator(convex)]
