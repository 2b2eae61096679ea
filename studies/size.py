"""How large a study may be: judged from its tables, before anything of that size is made."""

from __future__ import annotations

MOST_NUMBERS = 500_000_000
"""Samples of all motions together: 4 GB of eight bytes each."""
MOST_BYTES = 2**20
"""Of a study file, those that it includes each for themselves."""


def refuse_samples(samples: float, what: str) -> None:
    """ValueError where motions hold more samples than a computer's memory."""
    if not samples <= MOST_NUMBERS:
        raise ValueError(
            f"{what} would hold {samples:,.3g} samples, allowed are {MOST_NUMBERS:,} (4 GB): "
            "fewer or shorter motions, a longer time step, or fewer floors"
        )


def refuse_factors(factors: int) -> None:
    """ValueError where motions at levels are too many to be planned."""
    if factors > MOST_NUMBERS:
        raise ValueError(
            f"motions at levels are {_shown(factors)}, allowed are {MOST_NUMBERS:,}: fewer motions or levels, or "
            "several studies"
        )


def size_text(size: float) -> str:
    """Bytes for people."""
    for unit, scale in (("EB", 1e18), ("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:,.1f} {unit}"
    return f"{max(size / 1e3, 1.0):.0f} kB"


def _shown(number: int) -> str:
    return f"{number:,}" if number < 10**15 else "over 10^15"
