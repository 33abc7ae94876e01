"""How far links are from convex polygons, and how that changes with the joints: what a planner's step goes by.

For a direction g of length one a segment p_0 p_1 and a polygon with corners v are apart by

    s(g) = min_j g . p_j - max_v g . v,      and their signed distance is the largest s

which is reached at an edge's normal, at the segment's own, or from a corner to an end. A link's distance changes by
g . dp with p the point of it that is nearest. What a plan keeps is not judged by these but by `link_clearance`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..types import Array
from .kinematics import Chain, unit


def convex_pieces(corners: Array) -> list[Array]:
    """A polygon (k, 2) as convex ones, counterclockwise."""
    shape = shapely.Polygon(corners)
    parts: Iterable[BaseGeometry] = [shape]
    if shape.convex_hull.area > shape.area * (1 + 1e-9):
        parts = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    return [shapely.get_coordinates(shapely.orient_polygons(part))[:-1] for part in parts]


def separations(chain: Chain, theta: Array, polygon: Array) -> tuple[Array, Array]:
    """Signed distances [m] of all links from a convex polygon (k, 2), and their derivatives by the absolute angles.

    theta: (m, n) -> (m, n) and (m, n, n). Half widths are taken off.
    """
    places = chain.joints(theta)  # (m, n+1, 2)
    a, b = places[:, :-1], places[:, 1:]
    ends = np.stack([a, b], axis=2)  # (m, n, 2, 2)
    step = np.roll(polygon, -1, axis=0) - polygon
    edges = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.hypot(*step.T)[:, None]
    along = unit(theta)
    own = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    between = (ends[:, :, :, None] - polygon).reshape(*theta.shape, -1, 2)
    far = np.hypot(between[..., 0], between[..., 1])
    between = between / np.where(far > 0, far, 1.0)[..., None]
    axes = np.concatenate(
        [np.broadcast_to(edges, (*theta.shape, *edges.shape)), own[:, :, None], -own[:, :, None], between], axis=2
    )  # (m, n, g, 2)
    reach = np.einsum("mngx,mnjx->mngj", axes, ends)
    deep = axes @ polygon.T  # (m, n, g, k)
    apart = np.min(reach, axis=-1) - np.max(deep, axis=-1)
    best = np.argmax(apart, axis=-1)[..., None]
    out = np.take_along_axis(apart, best, axis=-1)[..., 0]
    g = np.take_along_axis(axes, best[..., None], axis=2)[:, :, 0]
    # the nearest point of the link: an end, or beside the corner that the link's own normal meets
    corner = polygon[np.argmax(np.take_along_axis(deep, best[..., None], axis=2)[:, :, 0], axis=-1)]
    gap = np.einsum("mnx,mnjx->mnj", g, ends)
    beside = np.clip(np.einsum("mnx,mnx->mn", corner - a, along) / chain.length, 0.0, 1.0)
    flat = np.abs(gap[..., 0] - gap[..., 1]) <= 1e-9 * chain.length
    share = np.where(flat, beside, (gap[..., 1] < gap[..., 0]).astype(float))
    across = np.einsum("mnx,mkx->mnk", g, own) * chain.length  # g . d(step of link k)
    part = np.tril(np.ones((chain.links, chain.links)), -1) + share[..., None] * np.eye(chain.links)
    return out - chain.half_width, part * across
