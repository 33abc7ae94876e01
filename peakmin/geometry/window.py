"""The windows that a path has to pass: the free part of each wall's line, a convex set of places.

Window i is  W_i = {tip_i + s f_i, 0 <= s <= width_i}:  a point where a wall is to be touched, a ray where it may be
passed beyond its tip, a segment where that ends at another wall, an opening. A path passes it at the time T_i when
r(T_i) = w for a w in W_i, and multipliers l_i of that equation prove what they do with

    least(l_i) = min over W_i of l_i . w,

which is finite for those that are admissible (f_i . l_i >= 0 on a ray) and attained on a face of the window, which is
all that they push against: of an opening the end at which they do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..types import Array, Index, Mask
from .norm import ROUNDING, dot, norm


@dataclass(frozen=True)
class Windows:
    """q windows: tips (q, d), unit free directions f_i (q, d), whether there is more than the tip (q,), width (q,),
    infinite but for openings. Stacked ones have a first axis everywhere.
    """

    tips: Array
    free: Array
    clear: Mask
    width: Array

    @classmethod
    def stacked(cls, every: Sequence[Windows]) -> Windows:
        """Equally many of each, along a first axis of every array."""
        return cls(
            np.stack([one.tips for one in every]),
            np.stack([one.free for one in every]),
            np.stack([one.clear for one in every]),
            np.stack([one.width for one in every]),
        )

    def __len__(self) -> int:
        return int(self.tips.shape[-2])

    def only(self, k: Mask | Index) -> Windows:
        """Some of them, by a mask (q,) or their numbers; of stacked ones some of the stack."""
        return Windows(self.tips[k], self.free[k], self.clear[k], self.width[k])

    def scaled(self, unit: float) -> Windows:
        """The same windows with lengths in other units, of which `unit` make one of these."""
        return replace(self, tips=self.tips * unit, width=self.width * unit)

    def moved(self, by: Array) -> Windows:
        """The same windows elsewhere, all moved by a vector (d,)."""
        return replace(self, tips=self.tips + by)

    def along(self, offsets: Array) -> Array:
        """f_i . x_i of offsets x from the tips, or of multipliers: (..., q, d) -> (..., q)."""
        return dot(self.free, offsets)

    def nearest(self, offsets: Array) -> Array:
        """The place of each window nearest to tip_i + x_i, seen from its tip: s_i f_i; x (..., q, d) -> (..., q, d)."""
        s = np.minimum(np.maximum(self.along(offsets), 0.0), self.width) * self.clear
        return np.asarray(s[..., None] * self.free)

    def least(self, multipliers: Array) -> Array:
        """min over W_i of l_i . w, (..., q, d) -> (..., q), minus infinity for l that are not admissible."""
        along = self.along(multipliers)
        reach = np.where(self.clear & (along < 0), self.width, 0.0)  # from the tip to where l_i . w is least
        return np.asarray(dot(self.tips, multipliers) + along * reach)

    def admissible(self, multipliers: Array) -> Array:
        """The multipliers l (..., q, d) with f_i . l_i raised to zero where a ray has it below."""
        along = self.along(multipliers)
        # raised a rounding error above zero, so that f_i . l_i >= 0 holds in exact arithmetic too
        raised = np.where(self.clear & (along < 0), ROUNDING * norm(multipliers) - along, 0.0)
        return np.asarray(multipliers + raised[..., None] * self.free)

    def face(self, multipliers: Array) -> Windows:
        """The face of each window on which l_i . w is least, with what is free behind it, (..., q, d)."""
        return self.facing(self.along(multipliers) < 0)

    def facing(self, far: Mask) -> Windows:
        """Every opening seen as one wall alone: as the one at its far end where `far`, shape (q,), is set.

        Both are larger than the opening: what is proved past them is proved of it.
        """
        narrow = np.isfinite(self.width)
        if not np.any(narrow):
            return self
        flip = (far & narrow)[..., None]
        over = np.where(flip, np.where(narrow, self.width, 0.0)[..., None] * self.free, 0.0)
        return replace(
            self,
            tips=self.tips + over,
            free=np.where(flip, -self.free, self.free),
            width=np.full_like(self.width, math.inf),
        )
