"""What a search has come to, before it is a plan."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import Generic, TypeVar

from ..scenes.arm_proof import ArmProof
from ..scenes.kept import Kept
from ..scenes.kinds import PointProof
from ..spec.maneuver import Maneuver
from ..types import Array

Motion = TypeVar("Motion")


@cache
def _versions() -> dict[str, str]:
    return {name: version(name) for name in ("peakmin", "cvxpy", "clarabel", "numpy")}


@dataclass(frozen=True)
class Made:
    """How a plan was made: programs compiled and solved, boxes of obstacle times looked at, seconds, versions.

    stopped: whether the time limit, or Ctrl-C, ended any of it.
    """

    solver: str
    compilations: int
    solves: int
    nodes: int
    seconds: float
    versions: dict[str, str] = field(default_factory=lambda: dict(_versions()))
    stopped: bool = False


@dataclass(frozen=True)
class Found(Generic[Motion]):
    """What a search has come to.

    crossing: the centre of mass's maneuver past q walls;  times: when their lines are crossed [s], (q,);
    motion: of the centre of mass, or of the joints that move it, None where there is none;  peak: bound on its
    acceleration [m/s^2];  multipliers: L at these times, (2+q, d), scaled, where they are known;  proof: of a lower
    bound; without one the multipliers prove it at these times;  indices: of the configurations of an arm's start and
    goal;  kept: what the motion keeps, where it is known.
    """

    crossing: Maneuver
    times: Array
    motion: Motion | None
    peak: float
    made: Made
    proof: PointProof | ArmProof | None = None
    multipliers: Array | None = None
    indices: tuple[int, int] = (0, 0)
    kept: Kept | None = None
