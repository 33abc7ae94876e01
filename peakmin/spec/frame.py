"""The frame of a maneuver, and the maneuver as seen in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from numpy.typing import ArrayLike

from ..geometry import frame
from ..types import Array
from .maneuver import Maneuver, State
from .obstacles import Block, Wall

Map = Callable[[ArrayLike], Array]  # of points or vectors, (..., 2) -> (..., 2)


@dataclass(frozen=True)
class Frame(frame.Frame):
    """origin [m] (2,) and the unit vector along its x axis (2,), both seen from outside."""

    @classmethod
    def from_maneuver(cls, maneuver: Maneuver) -> Frame:
        """From start to goal; unturned where the two are at the same place."""
        return cls.between(maneuver.start.position, maneuver.goal.position)

    def maneuver(self, maneuver: Maneuver) -> Maneuver:
        """The same maneuver as seen in the frame: states, walls, blocks and region."""
        return _moved(maneuver, self.position, self.vector)

    def maneuver_back(self, maneuver: Maneuver) -> Maneuver:
        """A maneuver given in the frame as seen from outside."""
        return _moved(maneuver, self.position_back, self.vector_back)


def _moved(maneuver: Maneuver, position: Map, vector: Map) -> Maneuver:
    def state(s: State) -> State:
        return State(position=position(s.position), velocity=vector(s.velocity))

    def obstacle(o: Wall | Block) -> Wall | Block:
        if isinstance(o, Block):
            return o.model_copy(update={"vertices": tuple(map(tuple, position(o.vertices).tolist()))})
        tip, direction = position(o.tip).tolist(), vector(o.direction).tolist()
        return o.model_copy(update={"tip": tuple(tip), "direction": tuple(direction)})

    region = maneuver.region
    return maneuver.model_copy(
        update={
            "start": state(maneuver.start),
            "goal": state(maneuver.goal),
            "obstacles": tuple(map(obstacle, maneuver.obstacles)),
            "region": None if region is None else tuple(map(tuple, position(region).tolist())),
        }
    )
