"""The table of a report's first part: each piece or block under the reference law, in two digits, without symbols."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import xarray as xr

from ...core.wording import (
    UNKNOWN,
    about_percent,
    about_years,
    chances_between,
    confidence_text,
    estimate_text,
    interval_text,
    two_digits,
    years_text,
)
from ...fragility.fitting.states import ALL, NONE
from ...fragility.hazard.rates import probability_in
from ...fragility.risk.modelling import LOWER, UPPER
from ..text.block_order import RATE, chosen_of, shown
from ..text.curve_notes import NOTABLE, action_of, extrapolated_shares, verb_in
from ..text.one_side import falling_both_ways
from ..text.reached import BELOW, within_levels
from ..text.rows import Rows
from ..text.spread import (
    MODEL_RANGE,
    NOT_GIVEN,
    OUTER,
    amount_range,
    has_model_range,
    model_range,
    of_what,
    range_text,
    sample_range,
)
from ..text.words import NOT_REACHED, axis_of, block_title, display_unit, floor_cell, level_name, reference_law, roof_of
from .pieces import piece_rows
from .sensitivity import level_rows

MOST = 30
"""Most blocks of the table."""
NEVER, ALWAYS = "never seen", "at every level"


def lead_rows(results: xr.Dataset) -> list[Rows]:
    """Return the tables of a report's first part: of its pieces; levels of a sensitivity study."""
    results = within_levels(results)
    if str(results.attrs["kind"]) == "sensitivity":
        return [level_rows(results)]
    return [client_rows(results)]


def client_rows(results: xr.Dataset) -> Rows:
    """Return the table of the pieces of a performance study, or of the blocks of a fragility or uncertainty study."""
    if str(results.attrs["kind"]) == "performance":
        return piece_rows(results, reference_law(results)[0], branches=True)
    return _blocks(within_levels(results))


def _blocks(results: xr.Dataset) -> Rows:
    """Return the level at which half of the motions reach the state, and how often in a year, of each block."""
    yearly = "rate" in results
    here = shown(results, RATE, MOST) if yearly else shown(results, most=MOST)
    at, _ = reference_law(here)
    axis = axis_of(here)
    scale, unit = display_unit(axis)
    floors = here["floor"].values.tolist() if "floor" in here["half_level"].dims else [None]
    rows: list[tuple[str, ...]] = []
    starred: list[float] = []
    extrapolated: list[float] = []
    either = falling_both_ways(here)
    sampled, roof = "sample_median" in here, roof_of(here)
    ranged = has_model_range(here, "risk_probability" if yearly else "half_level")
    for i, (k, floor) in product(range(here.sizes["block"]), enumerate(floors)):
        every = here.isel(block=i) if floor is None else here.isel(block=i, floor=k)
        one = every.isel(model=at)
        cells = [block_title(str(here["block"].values[i]))]
        cells += [] if floor is None else [floor_cell(floor, roof)]
        mark = " †" if str(here["block"].values[i]) in either else ""
        cells.append(f"{_half(one, scale, float(axis.max()))}{mark}")
        cells += [_properties(one, scale)] if sampled else []
        if yearly:
            known = np.isfinite(float(one["rate"])) and "rate_share_above" in one
            far = bool(known and float(one["rate_share_above"]) > NOTABLE)
            starred += [float(one["rate_share_above"])] if far else []
            shares = [float(share) for share in extrapolated_shares(one).values() if float(share) > NOTABLE]
            extrapolated += shares
            marks = f"{' *' if far else ''}{' ‡' if shares else ''}"
            cells += [_years(one, every) + marks, _chance(one, every, float(results.attrs["years"]))]
        if ranged:
            cells.append(
                _model_range(one, every, scale, float(results.attrs["years"]) if yearly else None) or NOT_GIVEN
            )
        rows.append(tuple(cells))
    verb = verb_in(here)
    unit = f", {unit}" if unit else ""
    headings = [
        "piece",
        *([] if floors == [None] else ["floor"]),
        f"{level_name(here)} at which half of the motions {action_of(verb, 'it')}{unit}",
        *([f"90 % range over its uncertain properties{unit}"] if sampled else []),
    ]
    years = years_text(float(results.attrs["years"])) if yearly else ""
    period = "return period, years (90 % range)" if "epistemic_rate" in here else "mean return period, years"
    headings += [period, f"chance in {years}"] if yearly else []
    headings += [f"{MODEL_RANGE} of this {'chance' if yearly else 'level'}"] if ranged else []
    said = [f"{confidence_text(here)} intervals"]
    if "epistemic_rate" in here:
        said = [f"level: {said[0]}; return period and chance: 90 % ranges over all stated uncertainties"]
    said += [of_what(here)] if ranged else []
    said += [chosen_of(here)] if chosen_of(here) else []
    for mark, shares, where in (
        ("*", starred, "beyond the end of the hazard curve, an extrapolation"),
        ("‡", extrapolated, "at which nothing was run: the fitted curve is extrapolated there"),
    ):
        if shares:
            share = " to ".join(dict.fromkeys(about_percent(one) for one in (min(shares), max(shares))))
            said.append(f"{mark}: {share} of the rate comes from shaking {where}")
    if either:
        said.append(
            "†: it may fall the other way as well; such falls are not counted, so that half of the motions need not "
            f"{action_of(verb, 'it')} at any level"
        )
    often = ", and how often" if yearly else ""
    title = f"Shaking under which each piece {verb}{often} ({'; '.join(said)})"
    return Rows(title, tuple(headings), rows)


def _half(one: xr.Dataset, scale: float, most: float) -> str:
    middle, low, high = (float(one[f"half_level{end}"]) / scale for end in ("", "_lower", "_upper"))
    if middle == 0.0:
        return BELOW
    if np.isfinite(middle):
        return estimate_text(middle, low or -np.inf, high)
    if middle == np.inf:  # (fewer than half of the motions do so at any level)
        return f"{NOT_REACHED} (above {two_digits(most / scale)})"
    return {ALL: ALWAYS, NONE: NEVER}.get(str(one["status"].item()), UNKNOWN)


def _properties(one: xr.Dataset, scale: float) -> str:
    """Return between which levels the fitted medians of nine tenths of a block's samples lie."""
    low, high = sample_range(one)
    return interval_text(low / scale, high / scale, two_digits) if math.isfinite(low) else UNKNOWN


def _years(one: xr.Dataset, every: xr.Dataset) -> str:
    if "epistemic_rate" in every:
        return range_text(every).removesuffix(" years") if np.isfinite(every["epistemic_rate"]) else UNKNOWN
    rate = float(one["rate"])
    least = float(one.get("rate_lower", np.nan))
    if math.isnan(rate) and 0.0 < least < np.inf:
        return f"{UNKNOWN}, at most {about_years(least)}"
    return about_years(rate) if np.isfinite(rate) and rate > 0.0 else UNKNOWN


def _model_range(one: xr.Dataset, every: xr.Dataset, scale: float, years: float | None) -> str:
    """Return the model range of the chance in so many years, or of the level."""
    if years is None:
        return model_range(one, "half_level", amount_range, 1.0 / scale)
    if "epistemic_rate" not in every:
        return model_range(one, "risk_probability")
    chances = every[[f"epistemic_rate{end}" for end in (LOWER, UPPER)]].map(probability_in, args=(years,))
    return model_range(chances, "epistemic_rate")


def _chance(one: xr.Dataset, every: xr.Dataset, years: float) -> str:
    if "epistemic_rate" in every:
        rates = [float(every["epistemic_rate"])]
        rates += [float(every["epistemic_rate_fractile"].sel(epistemic_fractile=end)) for end in OUTER]
        chance, low, high = (float(probability_in(np.float64(rate), years)) for rate in rates)
    else:
        chance, low, high = (float(one[f"risk_probability{end}"]) for end in ("", "_lower", "_upper"))
    if not np.isfinite(chance):
        return f"{UNKNOWN}, at least {about_percent(low)}" if low > 0.0 else UNKNOWN
    ends = "" if low == high else f" ({chances_between(low, high, about_percent)})"
    return f"{about_percent(chance)}{ends}"
