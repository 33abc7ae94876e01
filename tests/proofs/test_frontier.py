"""The frontier of a best-first search: least bound first, of equals the first come, items never compared."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from peakmin.proofs.frontier import Frontier

few = st.integers(0, 3).map(float)  # so that many are equal


@given(begun=st.lists(few), pushed=st.lists(few))
def test_least_bound_first_and_of_equals_the_first_come(begun, pushed):
    frontier = Frontier((bound, (bound, object(), k)) for k, bound in enumerate(begun))  # objects cannot be compared
    for k, bound in enumerate(pushed, start=len(begun)):
        frontier.push(bound, (bound, object(), k))
    assert len(frontier) == len(begun) + len(pushed) == len(frontier.items)
    expected = sorted((bound, k) for k, bound in enumerate([*begun, *pushed]))
    met = []
    while frontier:
        lowest, first = frontier.lowest, frontier.first
        bound, item = frontier.pop()
        assert (bound, item) == (lowest, first)
        assert item not in frontier.items
        met.append((bound, item[2]))
    assert met == expected


def test_pushing_between_pops():
    frontier = Frontier([(2.0, "b"), (3.0, "c")])
    frontier.push(1.0, "a")
    assert frontier.pop() == (1.0, "a")
    frontier.push(2.0, "later")
    assert [frontier.pop()[1] for _ in range(3)] == ["b", "later", "c"]


def test_an_empty_one_has_an_infinite_bound_and_nothing_to_give():
    empty: Frontier[str] = Frontier()
    assert not empty
    assert empty.lowest == math.inf
    assert empty.items == []
    with pytest.raises(IndexError):
        empty.pop()
