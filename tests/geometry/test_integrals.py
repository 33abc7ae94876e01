"""Closed forms in space against quadrature, differences, and the vectors' own definitions."""

import numpy as np
import pytest
from scipy.integrate import quad_vec

from peakmin.geometry.integrals import all_derivatives, assembly, derivatives, mean_direction, mean_norm
from peakmin.geometry.norm import across, dot, norm


def curvature(p):
    """K = (1 - p p'/|p|^2)/|p|."""
    r = np.linalg.norm(p)
    return (np.eye(len(p)) - np.outer(p, p) / r**2) / r


def numbers(p0, p1):
    """What `derivatives` gives, by quadrature with the place nearest to zero as a break."""
    d, step = len(p0), p1 - p0
    upper = np.triu_indices(d)

    def integrand(x):
        p = p0 + x * step
        u, k = p / np.linalg.norm(p), curvature(p)[upper]
        return np.concatenate([[np.linalg.norm(p)], u, x * u, k, x * k, x * x * k])

    nearest = np.clip(-(p0 @ step) / max(step @ step, 1e-300), 0, 1)
    return quad_vec(integrand, 0, 1, points=[nearest], epsabs=1e-13, epsrel=1e-13, limit=2000)[0]


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("seed", range(6))
def test_a_piece_in_any_dimension(d, seed):
    rng = np.random.default_rng(seed)
    p0, p1 = rng.normal(size=(2, d))
    if seed == 0:
        p1 = p0 + 0.05 * p1  # where the rule serves
    if seed == 1:
        p1 = -p0 + 0.01 * p1  # close to zero
    expected = numbers(p0, p1)
    found = derivatives(p0.tolist(), p1.tolist())
    assert len(found) == 1 + 2 * d + 3 * d * (d + 1) // 2
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.max(np.abs(expected)))
    np.testing.assert_allclose(all_derivatives(p0, p1), found, rtol=1e-12, atol=1e-12)
    assert mean_norm(p0, p1) == pytest.approx(found[0], rel=1e-13)
    plain, weighted = mean_direction(p0, p1)
    np.testing.assert_allclose([*plain, *weighted], found[1 : 1 + 2 * d], atol=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_pieces_add_up_to_gradient_and_hessian(d):
    rng = np.random.default_rng(d)
    n = 4
    values, h = rng.normal(size=(n, d)), rng.uniform(0.1, 1, n - 1)

    def total(p):
        return (h[:, None] * all_derivatives(p[:-1], p[1:])).ravel() @ assembly(n, d)

    here, size = total(values), n * d
    assert len(here) == 1 + size + size**2
    assert here[0] == pytest.approx(h @ mean_norm(values[:-1], values[1:]), rel=1e-13)
    for k in range(size):
        step = 1e-6 * np.eye(size)[k].reshape(n, d)
        rate = (total(values + step) - total(values - step)) / 2e-6
        assert here[1 + k] == pytest.approx(rate[0], abs=1e-8)
        np.testing.assert_allclose(here[1 + size :].reshape(size, size)[k], rate[1 : 1 + size], atol=1e-7)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_products_lengths_and_what_lies_across(d):
    rng = np.random.default_rng(d)
    a, b = rng.normal(size=(2, 5, 7, d))
    np.testing.assert_allclose(dot(a, b), np.einsum("...i,...i", a, b), rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(norm(a), np.linalg.norm(a, axis=-1), rtol=1e-14)
    assert np.all(norm(1e200 * a) < np.inf)
    assert np.all(norm(1e-200 * a) > 0)
    c = a / norm(a)[..., None]
    b[0] = 3 * c[0]  # along it
    b[1] = 0
    b[2] = 2 * c[2] + 1e-9 * b[2]
    n, e = across(c, b)
    np.testing.assert_allclose(e[..., None] * n, b - dot(b, c)[..., None] * c, atol=1e-14)
    np.testing.assert_allclose(dot(n, c), 0, atol=1e-15)
    size = norm(n)
    if d == 2:
        np.testing.assert_allclose(size, 1, rtol=1e-14)
    else:
        assert np.all(e >= 0)
        np.testing.assert_allclose(size[2:], 1, rtol=1e-14)
        np.testing.assert_array_equal(size[:2], 0)
        np.testing.assert_array_equal(e[:2], 0)
