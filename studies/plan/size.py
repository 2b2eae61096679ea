"""Limits of the size of a study, checked from its tables before anything of that size is made."""

MOST_NUMBERS = 500_000_000
"""Samples of all motions together: 4 GB of eight bytes each."""


def refuse_samples(samples: float, what: str) -> None:
    """Raise a ValueError if motions would have more samples than fit into the memory of a computer."""
    if not samples <= MOST_NUMBERS:
        raise ValueError(
            f"{what} would hold {samples:,.3g} samples, allowed are {MOST_NUMBERS:,} (4 GB): "
            "fewer or shorter motions, a longer time step, or fewer floors"
        )


def refuse_factors(factors: int) -> None:
    """Raise a ValueError if there are too many motions at levels to be planned."""
    if factors > MOST_NUMBERS:
        raise ValueError(
            f"motions at levels are {_shown(factors)}, allowed are {MOST_NUMBERS:,}: fewer motions or levels, or "
            "several studies"
        )


def _shown(number: int) -> str:
    return f"{number:,}" if number < 10**15 else "over 10^15"
