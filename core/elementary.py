"""exp, log, power, products and the like of arrays, with the same bits on every processor that fuses multiply and add.

numpy's loops are as wide as the processor's vectors, and their last digits differ by that width.  These functions have
numpy's names and values, at 0, infinity and NaN too, where they do not warn; they call the C library, whose variants
for such processors agree: in Python for a few values, else in a compiled loop.  Sums of products have one order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .aliases import Array as Array, Flags as Flags, Index as Index  # noqa: PLC0414 - for one line of imports
from .kernels import elementary as engine

FEW = 32
"""Values up to which Python is as fast as a compiled loop, which would also have to be loaded."""
PYTHON = (math.exp, math.log, math.expm1, math.log1p, math.tan, math.asin, math.acos, math.atan, math.pow, math.atan2)
"""Python's functions in the order of the compiled loops, those of two numbers last."""


def _of(at: int, *given: Any) -> Any:
    """Return a function of one or two numbers or arrays, which are broadcast; of numbers it is one of numpy's."""
    x = np.broadcast_arrays(*(np.asarray(values, dtype=np.float64) for values in given))
    flat = [values.ravel() for values in x]
    if flat[0].size <= FEW:
        try:
            return np.array([*map(PYTHON[at], *(values.tolist() for values in flat))]).reshape(x[0].shape)[()]
        except (ValueError, OverflowError):  # (NaN or infinite, which Python refuses)
            pass
    found = np.empty(flat[0].size)
    with np.errstate(all="ignore"):  # (of numpy, where nothing is compiled)
        engine.fill(at, flat[0], flat[-1], found)
    return found.reshape(x[0].shape)[()]


_all: list[Callable[..., Array]] = [partial(_of, at) for at in range(len(PYTHON))]
exp, log, expm1, log1p, tan, arcsin, arccos, arctan, power, arctan2 = _all


def geomspace(low: float, high: float, number: int) -> Array:
    """Return `number` values from `low` to `high`, both among them, at equal ratios."""
    found = power(10.0, np.linspace(math.log10(low), math.log10(high), number))
    found[[0, -1]] = low, high
    return found


def times(one: Any, other: Any) -> Array:
    """Return the sums over the last axis of `one` and the first of `other`, a vector (j,) or matrix (j, k)."""
    return np.asarray(np.einsum("...j,j->..." if np.ndim(other) == 1 else "...j,jk->...k", one, other))
