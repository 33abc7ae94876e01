"""Names for the arrays of this package; shapes stand in the docstrings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]
Json = dict[str, Any]  # an object of a JSON document: what is in it is found out by reading it
Axes = Any  # matplotlib's, which only view imports; others hand them on from their caller to their painter
Progress = Callable[[int, int], None]  # done, total as far as it is known
