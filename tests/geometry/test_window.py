"""Windows against what they are: points tip + s f, 0 <= s <= width, looked at one by one."""

from dataclasses import replace

import numpy as np
import pytest

from peakmin.geometry.norm import ROUNDING
from peakmin.geometry.window import Windows

FAR = 50.0  # beyond which a ray is not sampled


def windows(seed, d):
    """A point, two rays and two segments, in any order."""
    rng = np.random.default_rng(seed)
    free = rng.normal(size=(5, d))
    kind = rng.permutation([0, 1, 1, 2, 2])
    width = np.where(kind == 2, rng.uniform(0.1, 2, 5), np.inf)
    return rng, Windows(rng.normal(size=(5, d)), free / np.linalg.norm(free, axis=1, keepdims=True), kind > 0, width)


def places(own):
    """Places of each window, ends among them: (5, n, d)."""
    s = np.minimum(np.where(own.clear, own.width, 0.0), FAR)[:, None] * np.linspace(0, 1, 10_001) ** 3
    return own.tips[:, None] + s[..., None] * own.free[:, None]


def cases(count=10):
    return [windows(seed, d) for seed in range(count) for d in (2, 3)]


@pytest.mark.parametrize(("rng", "own"), cases())
def test_the_nearest_place_is_in_the_window_and_none_is_nearer(rng, own):
    offsets = rng.normal(size=(40, *own.tips.shape)) * 3
    nearest = own.nearest(offsets)
    assert nearest.shape == offsets.shape
    s = np.sum(nearest * own.free, axis=-1)
    np.testing.assert_allclose(nearest, s[..., None] * own.free, atol=1e-14)
    assert np.all((s >= 0) & (s <= np.where(own.clear, own.width, 0) + 1e-14))
    distance = np.linalg.norm(offsets - nearest, axis=-1)
    others = np.linalg.norm((own.tips + offsets)[:, :, None] - places(own), axis=-1)
    np.testing.assert_allclose(np.min(others, axis=-1), distance, atol=1e-4)
    assert np.all(distance <= np.min(others, axis=-1) + 1e-12)
    assert {tuple(row) for row in np.stack([s > 0, s < own.width - 1e-9], axis=-1).reshape(-1, 2)} == {
        (True, True),
        (True, False),
        (False, True),
    }


@pytest.mark.parametrize(("rng", "own"), cases())
def test_the_least_of_a_linear_form_is_that_over_all_places(rng, own):
    forms = rng.normal(size=(40, *own.tips.shape))
    least = own.least(forms)
    forced = np.min(np.sum(forms[:, :, None] * places(own), axis=-1), axis=-1)
    finite = np.isfinite(least)
    np.testing.assert_allclose(least[finite], forced[finite], atol=1e-12)
    pulled = own.clear & np.isinf(own.width) & (np.sum(forms * own.free, axis=-1) < 0)
    np.testing.assert_array_equal(~finite, pulled)
    assert np.all(least[pulled] < 0)
    assert np.any(pulled)
    # the face is where it is attained, and what lies behind it is admissible there
    for form, expected in zip(forms, least, strict=True):
        face = own.face(form)
        assert np.all(np.isinf(face.width))
        narrow = np.isfinite(own.width)
        np.testing.assert_allclose(np.sum(face.tips * form, axis=-1)[narrow], expected[narrow], atol=1e-12)
        assert np.all(np.sum(face.free * form, axis=-1)[narrow] >= 0)
        for kept in (face.tips, face.free):
            assert kept.shape == own.tips.shape
        np.testing.assert_array_equal(face.tips[~narrow], own.tips[~narrow])
        np.testing.assert_array_equal(face.free[~narrow], own.free[~narrow])
        np.testing.assert_array_equal(face.clear, own.clear)


@pytest.mark.parametrize(("rng", "own"), cases(4))
def test_admissible_multipliers_have_a_least_and_are_the_nearest_that_do(rng, own):
    own = replace(own, width=np.full(5, np.inf))
    forms = rng.normal(size=(40, *own.tips.shape))
    admissible = own.admissible(forms)
    assert np.all(np.isfinite(own.least(admissible)))
    along = np.sum(own.free * forms, axis=-1)
    pulled = own.clear & (along < 0)
    np.testing.assert_array_equal(admissible[~pulled], forms[~pulled])
    moved = (admissible - forms)[pulled]
    free = np.broadcast_to(own.free, forms.shape)[pulled]
    np.testing.assert_allclose(moved, np.sum(moved * free, axis=-1, keepdims=True) * free, atol=1e-13)
    left = np.sum(own.free * admissible, axis=-1)[pulled]
    size = np.linalg.norm(forms, axis=-1)[pulled]
    assert np.all((left > 0) & (left < 1.1 * ROUNDING * size))  # above zero for certain, and hardly
    assert np.any(pulled)


def test_openings_seen_from_either_end():
    _, own = windows(0, 3)
    narrow = np.isfinite(own.width)
    far = np.array([True, True, True, True, True])
    there = own.facing(far)
    np.testing.assert_allclose(there.tips[narrow], (own.tips + own.width[:, None] * own.free)[narrow])
    np.testing.assert_array_equal(there.free[narrow], -own.free[narrow])
    np.testing.assert_array_equal(there.tips[~narrow], own.tips[~narrow])
    here = own.facing(~far)
    np.testing.assert_array_equal(here.tips, own.tips)
    np.testing.assert_array_equal(here.free, own.free)
    assert np.all(np.isinf(np.concatenate([here.width, there.width])))
    assert here.facing(far) is here


def test_some_many_moved_and_in_other_units():
    rng, own = windows(1, 3)
    some = own.only(np.array([False, True, True, False, False]))
    assert (len(own), len(some)) == (5, 2)
    for name in ("tips", "free", "clear", "width"):
        np.testing.assert_array_equal(getattr(some, name), getattr(own, name)[1:3])
    many = Windows.stacked([own, own.moved(np.ones(3)), own])
    assert (len(many), many.tips.shape, many.clear.shape) == (5, (3, 5, 3), (3, 5))
    np.testing.assert_array_equal(many.only(np.array([1])).tips[0], own.tips + 1)
    offsets = rng.normal(size=(3, 5, 3))
    np.testing.assert_array_equal(many.nearest(offsets), [own.nearest(one) for one in offsets])
    long = own.scaled(10.0)
    np.testing.assert_allclose(long.nearest(10 * offsets), 10 * own.nearest(offsets), rtol=1e-14)
    np.testing.assert_allclose(long.least(offsets), 10 * own.least(offsets), rtol=1e-14)
    np.testing.assert_array_equal(long.free, own.free)
