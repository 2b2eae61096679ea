"""Long work in pieces: compiled code hears no interrupt, so that kernels are left between parts of a second."""

from collections.abc import Iterator

PIECE = 2e8
"""Cost of a piece, ns: a fifth of a second."""


def pieces(steps: int, cost: float) -> Iterator[tuple[int, int]]:
    """Return the first step of each piece of some steps, and the first after it; a step costs some ns."""
    size = max(1, int(PIECE / cost))
    return ((first, min(first + size, steps)) for first in range(0, steps, size))
