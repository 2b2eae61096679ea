"""Type aliases that the whole package shares."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array of real numbers."""

Index = NDArray[np.int64]
"""Array of whole numbers: indices and counts."""

Flags = NDArray[np.bool_]
"""Array of truth values."""

Progress = Callable[[int, int], None]
"""Function that is called with the number of finished units of work and their total number."""
