"""The largest rotation of a run: of both sides together, or of each side where an oscillator is sided."""

from ...compiled import kernel
from .tables import BACK, FRONT, SIDED


@kernel(inline="always")
def raise_peak(x, k, theta):
    """Note a rotation in the largest so far."""
    both = k[SIDED] == 0
    x[FRONT] = max(x[FRONT], abs(theta) if both else theta)
    x[BACK] = max(x[BACK], abs(theta) if both else -theta)


@kernel(inline="always")
def lesser_peak(x):
    """Return the height below which no rotation to either side is a new largest one."""
    return min(x[FRONT], x[BACK])
