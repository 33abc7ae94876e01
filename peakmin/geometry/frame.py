"""The frame of a maneuver: the start at the origin, the goal on the x axis (the paper's displaced and turned axes)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..spec.maneuver import Maneuver, State
from ..spec.obstacles import Block, Wall
from ..types import Array

Map = Callable[[ArrayLike], Array]  # of points or vectors, (..., 2) -> (..., 2)


@dataclass(frozen=True)
class Frame:
    """origin [m] (2,) and the unit vector along its x axis (2,), both seen from outside."""

    origin: Array
    along: Array

    @classmethod
    def from_maneuver(cls, maneuver: Maneuver) -> Frame:
        """From start to goal; unturned where the two are at the same place."""
        origin = np.array(maneuver.start.position)
        way = np.array(maneuver.goal.position) - origin
        length = math.hypot(*way)
        return cls(origin, way / length if length else np.array([1.0, 0.0]))

    @property
    def angle(self) -> float:
        """By which the frame is turned [rad]."""
        return math.atan2(self.along[1], self.along[0])

    def vector(self, vectors: ArrayLike) -> Array:
        """Velocities, accelerations, directions (..., 2) as seen in the frame."""
        v, (c, s) = np.asarray(vectors, dtype=float), self.along
        return np.stack([c * v[..., 0] + s * v[..., 1], c * v[..., 1] - s * v[..., 0]], axis=-1)

    def position(self, positions: ArrayLike) -> Array:
        """Positions [m] (..., 2) as seen in the frame."""
        return self.vector(np.asarray(positions, dtype=float) - self.origin)

    def vector_back(self, vectors: ArrayLike) -> Array:
        """Vectors in the frame (..., 2) as seen from outside."""
        v, (c, s) = np.asarray(vectors, dtype=float), self.along
        return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]], axis=-1)

    def position_back(self, positions: ArrayLike) -> Array:
        """Positions in the frame [m] (..., 2) as seen from outside."""
        return self.vector_back(positions) + self.origin

    def maneuver(self, maneuver: Maneuver) -> Maneuver:
        """The same maneuver as seen in the frame: states, walls, blocks and region."""
        return self._moved(maneuver, self.position, self.vector)

    def maneuver_back(self, maneuver: Maneuver) -> Maneuver:
        """A maneuver given in the frame as seen from outside."""
        return self._moved(maneuver, self.position_back, self.vector_back)

    @staticmethod
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
