"""Why no motion of a two-link arm has a smaller peak: branches that cover every path of its centre of mass.

A motion keeps its elbow, or turns it over where the centre of mass touches an edge of the annulus it can reach.

Kept: the path lies in one sheet. Every path from start to goal crosses each line that has them on different sides, and
where it first does, it is in one of the gaps that obstacles and annulus leave on that line. So all its paths fall into
classes by gaps, and by the order of the first crossings where lines meet inside the annulus; the maneuver past the
gaps of a class in their order bounds it. A tree that splits by one line at a time covers all paths.

Turned over: a path that touches the outer edge on an arc comes in over the arc's chord; one that touches the inner
edge on an arc comes in over one of the two tangents at the arc's ends, each up to where they meet. Either is a wall's
opening that is crossed at some time. Where neither start nor goal lies outside, there is no wall and M is that of the
way without any. A tree of gaps bounds these paths too, if a place counts as blocked only where both elbows are.

Where start and goal lie in parts of the joint space that are proved apart (`robots.joint_space`), there is no motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ..proofs.bounds import Leaf
from ..robots.joint_space import Flood, flood
from ..robots.workspace import Workspace
from .passages import Edge, Line, Looks, Passage, Turned, Whole
from .proof_tree import Branch, leaves_bound

Lined = Branch[Line, Looks]  # split by one line after the other
ALL = Whole(0, ())  # every path of a passage


@dataclass(frozen=True)
class Touching:
    """Boxes that bound the peak of the paths that touch an arc of an edge, an inner one's for both tangents."""

    edge: Edge
    arc: tuple[float, float]
    leaves: tuple[tuple[Leaf, ...], ...]

    @property
    def paths(self) -> list[Turned]:
        return [Turned(self.edge, self.arc, k) for k in range(1 if self.edge == "outer" else 2)]

    def bound(self, passage: Passage) -> float:
        """The bound [m/s^2], evaluated anew."""
        if len(self.leaves) != len(self.paths):
            return 0.0
        return min(leaves_bound(passage.past(one), own) for one, own in zip(self.paths, self.leaves, strict=True))


@dataclass(frozen=True)
class PassageProof:
    """What is proved of one choice of configurations, by their indices: of paths that keep their elbow, of those that
    touch an edge, and of all.
    """

    indices: tuple[int, int]
    kept: Lined | None
    touching: tuple[Touching, ...]
    whole: Lined | None

    def bound(self, passage: Passage, flooded: Flood | None = None) -> float:
        """The bound [m/s^2], evaluated anew; zero where some motion is left out.

        flooded: tells whether there are motions that keep their elbow.
        More than two links: by the centre of mass's maneuver alone, whatever stands in the way.
        """
        if passage.workspace.chain.links > 2:
            return 0.0 if self.whole is None else leaves_bound(passage.past(()), self.whole.leaves)
        every = 0.0 if self.whole is None else self.whole.bound(passage.whole, ALL)
        around = all(self._around(edge) for edge in passage.edges)
        parts = [one.bound(passage) for one in self.touching] if around else [0.0]
        if passage.keeps and not (flooded is not None and flooded.parts(passage.theta, passage.elbow)):
            parts.append(0.0 if self.kept is None else self.kept.bound(passage, ALL))
        return max(every, min(parts, default=math.inf))

    def _around(self, edge: Edge) -> bool:
        """Whether the arcs go all the way around an edge."""
        at = -math.pi
        for low, high in sorted(one.arc for one in self.touching if one.edge == edge):
            if low > at or not 0 < high - low <= 2 * math.pi / 3:
                return False
            at = max(at, high)
        return at >= math.pi


@dataclass(frozen=True)
class ArmProof:
    """Why no motion of the arm has a smaller peak, for every start and goal configuration that the poses allow.

    cells: to a turn, in the flood of joint space that tells which motions there are none of; 0 without one.
    """

    passages: tuple[PassageProof, ...]
    cells: int = 0
    scope: Literal["all"] = "all"

    def bound(self, workspace: Workspace, every: Mapping[tuple[int, int], Passage]) -> float:
        """The lower bound [m/s^2], evaluated anew; zero where some motion is left out, infinite where there is none.

        Args:
            every: all passages, by the indices of their configurations.
        """
        least, own = math.inf, {one.indices: one for one in self.passages}
        flooded = flood(workspace, self.cells) if self.cells else None
        for passage in every.values():
            if flooded is not None and flooded.parts(passage.theta):
                continue
            proof = own.get(passage.indices)
            least = min(least, 0.0 if proof is None else proof.bound(passage, flooded))
        return least
