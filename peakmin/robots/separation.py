"""How far links are from convex polygons, and how that changes with the joints: what a planner's step goes by.

For a direction g of length one a segment p_0 p_1 and a polygon with corners v are apart by

    s(g) = min_j g . p_j - max_v g . v,      and their signed distance is the largest s

which is reached at an edge's normal, at the segment's own, or from a corner to an end. A link's distance changes by
g . dp with p the point of it that is nearest. What a plan keeps is not judged by these but by `link_clearance`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..geometry.norm import norm
from ..types import Array
from .kinematics import Chain, unit

NEAREST = 6  # convex pieces that every link is kept from


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


def self_separations(chain: Chain, theta: Array, pairs: list[tuple[int, int]]) -> tuple[Array, Array]:
    """Signed distances [m] of the links of every pair i < j from each other, and their derivatives by absolute angles.

    theta: (m, n) -> (m, p) and (m, p, n). With both links' ends, s(g) = min g . p - max g . r as above, and of
    p - r = (1 - share_i) step_i + sum_{i<k<j} step_k + share_j step_j.
    """
    i, j = np.array(pairs, dtype=int).reshape(-1, 2).T
    places, along = chain.joints(theta), unit(theta)
    ends = np.stack([places[:, :-1], places[:, 1:]], axis=2)
    first, other = ends[:, i], ends[:, j]  # (m, p, 2, 2)
    own = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    between = (other[:, :, :, None] - first[:, :, None]).reshape(*first.shape[:2], 4, 2)
    far = norm(between)[..., None]
    normals = np.stack([own[:, i], -own[:, i], own[:, j], -own[:, j]], axis=2)
    axes = np.concatenate([normals, between / np.where(far > 0, far, 1.0)], axis=2)  # (m, p, g, 2)
    reach, deep = (np.einsum("mpgx,mpex->mpge", axes, x) for x in (other, first))
    apart = np.min(reach, axis=-1) - np.max(deep, axis=-1)
    best = np.argmax(apart, axis=-1)[..., None]
    out = np.take_along_axis(apart, best, axis=-1)[..., 0]
    g = np.take_along_axis(axes, best[..., None], axis=2)[:, :, 0]
    reach, deep = (np.take_along_axis(x, best[..., None], axis=2)[:, :, 0] for x in (reach, deep))
    # the nearest points: ends, or beside the other's end where a link lies along its own side
    share_j, share_i = np.argmin(reach, axis=-1).astype(float), np.argmax(deep, axis=-1).astype(float)
    end_i, end_j = (
        np.take_along_axis(x, at.astype(int)[..., None, None], axis=2)[:, :, 0]
        for x, at in ((first, share_i), (other, share_j))
    )
    for share, values, link, end, base in (
        (share_j, reach, j, end_i, other[:, :, 0]),
        (share_i, deep, i, end_j, first[:, :, 0]),
    ):
        flat = np.abs(values[..., 0] - values[..., 1]) <= 1e-9 * chain.length[link]
        beside = np.einsum("mpx,mpx->mp", end - base, along[:, link]) / chain.length[link]
        share[flat] = np.clip(beside, 0.0, 1.0)[flat]
    across = np.einsum("mpx,mkx->mpk", g, own) * chain.length
    k = np.arange(chain.links)
    part = ((i[:, None] < k) & (k < j[:, None])).astype(float)
    part = part + (1 - share_i)[..., None] * (k == i[:, None]) + share_j[..., None] * (k == j[:, None])
    return out - chain.half_width[i] - chain.half_width[j], part * across


def apart(
    chain: Chain, q: Array, pieces: Sequence[Array], margin: float, pairs: list[tuple[int, int]], self_margin: float
) -> tuple[Array, Array]:
    """Distances [m] of links from the nearest convex pieces, then of pairs of links, less their margins.

    q: relative joint angles (m, n) -> rows (r, m) and their derivatives by q, (r, m, n).
    """
    rows, by_q = zip(_from_pieces(chain, q, pieces), _from_links(chain, q, pairs), strict=True)
    return np.concatenate([rows[0] - margin, rows[1] - self_margin]), np.concatenate(by_q)


def _from_pieces(chain: Chain, q: Array, pieces: Sequence[Array]) -> tuple[Array, Array]:
    """Of each link from the `NEAREST` pieces, as `apart` without margins."""
    m, n = q.shape
    if not pieces:
        return np.zeros((0, m)), np.zeros((0, m, n))
    every = [separations(chain, np.cumsum(q, axis=1), piece) for piece in pieces]
    far, by = np.stack([x for x, _ in every], axis=-1), np.stack([x for _, x in every], axis=-1)  # (m, n, p)
    nearest = np.argsort(far, axis=-1)[..., : min(len(pieces), NEAREST)]
    far = np.take_along_axis(far, nearest, axis=-1)
    by = np.take_along_axis(by, nearest[:, :, None, :], axis=-1)
    joints = np.cumsum(by[:, :, ::-1], axis=2)[:, :, ::-1]  # theta = cumsum(q)
    return far.transpose(1, 2, 0).reshape(-1, m), joints.transpose(1, 3, 0, 2).reshape(-1, m, n)


def _from_links(chain: Chain, q: Array, pairs: list[tuple[int, int]]) -> tuple[Array, Array]:
    """Of each pair of links from each other, as `apart` without margins."""
    if not pairs:
        return np.zeros((0, len(q))), np.zeros((0, *q.shape))
    far, by = self_separations(chain, np.cumsum(q, axis=1), pairs)
    joints = np.cumsum(by[:, :, ::-1], axis=2)[:, :, ::-1]
    return far.T, joints.transpose(1, 0, 2)
