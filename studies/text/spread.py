"""The spread of an annual rate in words: ranges over weighted branches, and the sources of the range."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...wording import about_percent, about_years, counted, one_digit

WORDS = {
    "models": "the choice of law",
    "motions": "the choice of motions",
    "hazard": "the hazard curve",
    "modelling": "the modelling uncertainty",
    "number of motions": "the number of motions",
    "together": "what these do together",
}
"""Sources of the spread of a rate in words."""
HEADINGS = {
    "models": "law",
    "motions": "motions",
    "hazard": "hazard",
    "modelling": "modelling",
    "number of motions": "few motions",
    "together": "together",
}
"""Sources in headings of tables."""
OUTER = (0.05, 0.95)
"""Fractiles between which the range is said."""


def range_text(here: xr.Dataset) -> str:
    """Return the range of years between two falls over all branches, such as 30 to 500 years, of one block."""
    low, high = (float(here["epistemic_rate_fractile"].sel(epistemic_fractile=end)) for end in OUTER)
    often, seldom = (about_years(rate, one_digit) for rate in (high, low))
    return f"{often} years" if often == seldom else f"{often} to {seldom} years"


def sources(here: xr.Dataset) -> list[tuple[str, float]]:
    """Return the sources of the spread of one block's rate in words with their shares, the largest first."""
    shares = here["epistemic_spread"].values
    names = [str(one) for one in here["epistemic_source"].values]
    found = [(WORDS[name], float(share)) for name, share in zip(names, shares, strict=True) if share > 0.0]
    return sorted(found, key=lambda one: -one[1])


def spread_sentence(here: xr.Dataset, name: str, verb: str, modelling: float) -> str:
    """Return the sentence on how often one block falls over all branches."""
    if not np.isfinite(here["epistemic_rate"]):
        return "How often that is cannot be told: a branch has no curve."
    branches = here.sizes["branch"]
    over = (
        f"{counted(branches, 'combination')} of laws, motions and hazard curves"
        if branches > 1
        else "what is not known"
    )
    beta = f" with a modelling uncertainty of {modelling:g}" if modelling else ""
    text = f"{name} {verb} about once in {range_text(here)} (with a probability of 90 %, over {over}{beta})"
    found = sources(here)
    if found:
        text += f"; the largest part of that range ({about_percent(found[0][1])}) comes from {found[0][0]}"
    rate = float(here["epistemic_rate"])
    mean = f" The mean of the rate is one fall in {about_years(rate)} years." if rate > 0.0 else ""
    return f"{text}.{mean}"
