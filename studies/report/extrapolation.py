"""Sentences on annual rates that rest on the form of a curve, beside the numbers that they are about."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...core.doubts import first_of
from ...core.wording import about_percent, whole_percent
from ..text.curve_notes import NOTABLE, extrapolated_shares
from ..text.precision import FITTED_RATE
from ..text.words import block_title, floor_name, reference_law

STRENGTHS = {"below": "weaker", "above": "stronger"}
"""How shaking beyond each end of the levels compares with what was run."""


def part_sentence(one: xr.Dataset, of: str) -> list[str]:
    """Return how much of one rate, named `of`, rests on a curve where nothing was run; none where that is little."""
    shares = {side: float(share) for side, share in extrapolated_shares(one).items()}
    parts = [
        f"{about_percent(share)} of {of} comes from shaking {STRENGTHS[side]} than any that was run"
        for side, share in shares.items()
        if share > NOTABLE
    ]
    return [f"About {' and about '.join(parts)}, where the fitted curve is extrapolated."] if parts else []


def rate_sentences(results: xr.Dataset) -> list[str]:
    """Return which rates rest on curves where nothing was run, under the law that the answer is given for."""
    at, _ = reference_law(results)
    said = []
    for side, share in extrapolated_shares(results).items():
        here = share.isel(model=at).transpose("block", ...)
        far = [tuple(map(int, where)) for where in np.argwhere(here.values > NOTABLE)]
        if not far:
            continue
        values = [float(here.values[where]) for where in far]
        ends = " to ".join(dict.fromkeys(about_percent(one) for one in (min(values), max(values))))
        names = [
            f"“{block_title(str(here['block'].values[i]))}”"
            + "".join(f" on {floor_name(str(here['floor'].values[k]))}" for k in rest)
            for i, *rest in far
        ]
        rates = "rate" if len(far) == 1 else "rates"
        said.append(
            f"{ends} of the annual {rates} of {first_of(names)} comes from shaking {STRENGTHS[side]} than any that was "
            "run, where the fitted curve is extrapolated."
        )
    return said


def second_opinions(results: xr.Dataset) -> list[str]:
    """Return which fitted curves give another rate than the runs without a form, beyond the error of both."""
    if FITTED_RATE not in results:
        return []
    one = results.isel(model=reference_law(results)[0])
    apart = one["rate_misfit"].values
    named = [
        f"“{block_title(str(block))}” ({whole_percent(float(share), signed=True)})"
        for block, share in zip(one["block"].values, apart, strict=True)
        if share
    ]
    if not named:
        return []
    return [
        "The lognormal curve gives another annual rate than the runs without a form, by more than the limited number "
        f"of motions explains, of {first_of(named)}: rely on the rate given here."
    ]
