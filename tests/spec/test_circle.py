import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import peakmin as pm

SHAPES = [
    pm.Disc(),
    *(pm.Polygon(segments=n, fit=fit) for n in (1, 2, 5, 20) for fit in ("inscribed", "circumscribed")),
]
vectors = st.tuples(st.floats(-10, 10), st.floats(-10, 10)).map(np.array)


@pytest.mark.parametrize("n", [1, 2, 3, 5, 17])
def test_gauge_and_support_are_those_of_the_edges_and_vertices(n):
    points = np.random.default_rng(n).normal(size=(500, 2))
    for fit in ("inscribed", "circumscribed"):
        for shape in (pm.Polygon(segments=n, fit=fit), pm.Polygon(segments=n, fit=fit, align="frame").facing(0.3)):
            np.testing.assert_allclose(
                shape.gauge(points), (points @ shape.normals.T).max(axis=1) / shape.inradius, rtol=1e-13
            )
            np.testing.assert_allclose(shape.support(points), (points @ shape.vertices.T).max(axis=1), rtol=1e-13)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@given(u=vectors, p=vectors)
def test_gauge_and_support_are_polar(shape, u, p):
    assert u @ p <= shape.gauge(u) * shape.support(p) * (1 + 1e-12) + 1e-300


@pytest.mark.parametrize("n", [1, 2, 5, 64])
def test_vertices_lie_on_the_axes_and_the_polygons_bracket_the_circle(n):
    inside, outside = pm.Polygon(segments=n), pm.Polygon(segments=n, fit="circumscribed")
    np.testing.assert_allclose(inside.vertices[[0, n]], np.eye(2), atol=1e-15)
    assert len(inside.vertices) == len(inside.normals) == 4 * n
    assert inside.error == pytest.approx(1 - math.cos(math.pi / (4 * n)), rel=1e-9)
    assert inside.inradius == pytest.approx(1 - inside.error)
    assert outside.inradius == 1
    assert outside.circumradius == pytest.approx(1 / (1 - inside.error))


@given(st.floats(1e-7, 0.9))
def test_for_error_picks_the_smallest_n(error):
    polygon = pm.Polygon.for_error(error)
    assert polygon.error <= error
    assert polygon.segments == 1 or pm.Polygon(segments=polygon.segments - 1).error > error


def test_for_error_at_a_polygon_s_own_error_gives_that_polygon():
    for n in (1, 2, 3, 7, 50):
        assert pm.Polygon.for_error(pm.Polygon(segments=n).error).segments == n


@pytest.mark.parametrize("error", [0, -1, 1, math.nan])
def test_for_error_refuses_what_no_polygon_has(error):
    with pytest.raises(pm.SpecError, match="must be between 0 and 1"):
        pm.Polygon.for_error(error)
