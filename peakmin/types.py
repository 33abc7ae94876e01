"""Names for the arrays of this package; shapes stand in the docstrings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]


Progress = Callable[[int, int], None]  # done, total as far as it is known
