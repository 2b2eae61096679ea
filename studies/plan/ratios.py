"""Meaning of the ratio of two numbers, with its interval over motions."""

import math

HIGHER, LOWER, SAME, OPEN, UNKNOWN = "higher", "lower", "the same", "not resolved", ""
"""B against A: the interval of the ratio lies above 1, or below; both are equal; it holds 1; there is no interval."""


def verdict_of(ratio: tuple[float, float, float]) -> str:
    """Return in words the meaning of a ratio with its interval for the second number compared with the first."""
    value, lower, upper = ratio
    if math.isnan(lower) or math.isnan(upper):
        return UNKNOWN
    if lower == upper == value == 1.0:
        return SAME
    return HIGHER if lower > 1.0 else LOWER if upper < 1.0 else OPEN
