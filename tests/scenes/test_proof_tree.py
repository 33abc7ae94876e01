"""The bound of a tree of branches, for classes of paths whose least peaks are known."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

import peakmin as pm
from peakmin.proofs.bounds import Leaf
from peakmin.proofs.double_integrator import PointMass
from peakmin.proofs.extremal import extremal
from peakmin.scenes.proof_tree import Branch, leaves_bound
from tests.conftest import wall_maneuver

inf = math.inf


def straight(far, duration=2.0):
    return wall_maneuver(goal=pm.State(position=(far, 0)), obstacles=(), duration=duration)


MASS = PointMass.of(straight(1.0))
LEAVES = (Leaf((), (), extremal(MASS, np.zeros(0)).multipliers, ()),)  # prove far, 4 far / duration^2, of any way


@dataclass
class Toy:
    """Classes named by how far their paths go, 0 where there are none; a cut makes what is listed of it."""

    cuts: dict[str, list[float | None]] = field(default_factory=dict)

    def past(self, one, lift=0.0):
        return straight(one) if one else None

    def splits(self, one, cut):
        return cut in self.cuts

    def parts(self, one, cut):
        return self.cuts[cut]

    def seen(self, part, looks):
        return None if part is None else part * looks

    def empty(self, part):
        return not part


def tree(looks=1.0, cut=None, *children, leaves=LEAVES):
    return Branch(leaves, looks, cut, children)


CLASSES = Toy({"two": [3.0, 4.0], "one gone": [None, 5.0], "none": [], "gone": [0.0, None], "same": [2.0]})


@pytest.mark.parametrize(
    ("part", "branch", "bound"),
    [
        (2.0, tree(), 2),
        (2.0, tree(0.5), 1),
        (2.0, tree(leaves=()), 0),
        (None, tree(), inf),
        (0.0, tree(), inf),
        (None, tree(1.0, "two", tree(), tree()), inf),
        (0.0, tree(1.0, "two", tree(), tree()), inf),
        # the least of the children's, if they prove more than the branch itself
        (2.0, tree(1.0, "two", tree(), tree()), 3),
        (2.0, tree(1.0, "two", tree(1.5), tree()), 4),
        (2.0, tree(1.0, "two", tree(0.5), tree()), 2),
        (2.0, tree(1.0, "two", tree(leaves=()), tree()), 2),
        (2.0, tree(1.0, "two", tree(), tree(0.1)), 2),
        # what is left out counts as zero, unless it is empty
        (2.0, tree(1.0, "two", None, tree()), 2),
        (0.5, tree(1.0, "two", None, tree()), 0.5),
        (2.0, tree(1.0, "two", tree(), None), 2),
        (2.0, tree(1.0, "one gone", None, tree()), 5),
        (2.0, tree(1.0, "one gone", tree(), tree()), 5),
        (2.0, tree(1.0, "one gone", None, None), 2),
        (2.0, tree(1.0, "gone", None, None), inf),
        # no part, no path
        (2.0, tree(1.0, "none"), inf),
        # a cut that does not hold every path, and children of other parts
        (2.0, tree(1.0, "wrong", tree(), tree()), 2),
        (2.0, tree(1.0, "two"), 2),
        (2.0, tree(1.0, "two", tree(9.0)), 2),
        (2.0, tree(1.0, "two", tree(9.0), tree(9.0), tree(9.0)), 2),
        (2.0, tree(1.0, "none", tree(9.0)), 2),
        # deeper
        (2.0, tree(1.0, "two", tree(1.0, "same", tree(6.0)), tree(5.0)), 12),
        (2.0, tree(1.0, "two", tree(1.0, "same", tree(5.0)), tree(1.0, "two", tree(3.0), tree())), 4),
    ],
)
def test_a_branch_bounds_what_is_seen_of_it_or_the_least_of_its_parts(part, branch, bound):
    assert branch.bound(CLASSES, part) == pytest.approx(bound, rel=1e-9, abs=1e-12)


def test_leaves_prove_in_the_units_of_their_maneuver():
    assert leaves_bound(None, LEAVES) == leaves_bound(None, ()) == inf
    for far, duration in ((1.0, 1.0), (3.0, 0.5), (1e-3, 40.0)):
        assert leaves_bound(straight(far, duration), LEAVES) == pytest.approx(4 * far / duration**2, rel=1e-9)
        assert leaves_bound(straight(far, duration), ()) == 0
