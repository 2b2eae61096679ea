"""Tables of uncertainty studies as rows of text."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from ...core.wording import (
    chance_text,
    confidence_text,
    given_percent,
    in_years,
    interval_text,
    whole_percent,
    years_between,
    years_text,
)
from ..plan.estimates import middle_level
from ..text.reached import dispersion_texts, fraction_text, level_texts
from ..text.rows import Rows
from ..text.spread import sample_range
from ..text.words import display_unit, input_name


def median_rows(results: xr.Dataset) -> Rows:
    """Level at which half fall and dispersion with all uncertainties, and the spread of the samples' medians."""
    scale, unit = display_unit(results["level"])
    name = results["level"].attrs.get("long_name", "level")
    fractions = results["fraction"].values.tolist() if "fraction_level" in results else []
    rows = []
    for block in results["block"].values:
        for model in results["model"].values:
            one = results.sel(block=block, model=model)
            low, high = (end / scale for end in sample_range(one))
            cells = [*level_texts(one, "half_level", scale), dispersion_texts(one)[0]]
            cells += [fraction_text(one, p, scale) for p in fractions]
            if not bool(one["converged"]):
                cells = [str(one["status"].item()), *("" for _ in cells[1:])]
            rows.append((f"{block}, {model}", *cells, interval_text(low, high)))
    title = (
        f"{name[:1].upper()}{name[1:]}{f' ({unit})' if unit else ''} at which half fall, and dispersion β of the "
        "fitted curve, motions and inputs together"
    )
    more = [f"P = {given_percent(p)}" for p in fractions]
    percent = confidence_text(results)
    return Rows(title, ("", "half at", percent, "β", *more, "90 % of the samples' fitted medians"), rows)


def rate_rows(results: xr.Dataset) -> Rows:
    """Annual rates: of all samples together with its interval, and of the samples."""
    years = float(results.attrs["years"])
    rows = []
    for block in results["block"].values:
        for model in results["model"].values:
            one = results.sel(block=block, model=model)
            label = f"{block}, {model}"
            rate, low, high = (one[f"rate{end}"].item() for end in ("", "_lower", "_upper"))
            if not np.isfinite(rate):
                rows.append((label, "no curve", "", "", "", ""))
                continue
            alike = "no width" if low == high else years_between(high, low)
            own = one["sample_rate_quantile"]
            ends = years_between(own.values[-1], own.values[0])
            chance = one["sample_risk_probability_mean"].item()
            rows.append(
                (label, in_years(rate), alike, in_years(one["sample_rate_mean"].item()), ends, chance_text(chance))
            )
    percent = confidence_text(results)
    headings = ("", "all together", percent, "mean of samples", "90 % of samples", f"P in {years_text(years)}")
    rests_on = f"{percent} interval, for the given hazard curve"
    title = f"Mean return period of overturning, years (P: mean over the samples; {rests_on})"
    return Rows(title, headings, rows)


def share_rows(results: xr.Dataset) -> Rows:
    """Shares of the variance of ln capacity by component, or of the flags where capacities are not known."""
    known = "capacity_share" in results
    names = [str(one) for one in results["component"].values]
    words = [" × ".join(input_name(part) for part in one.split(" × ")) for one in names]
    columns = []
    for block in results["block"].values:
        one = results.sel(block=block)
        share = one["capacity_share"] if known else one["flag_share"].isel(level=middle_level(one["probability"]))
        columns.append([whole_percent(float(value)) for value in share.values])
    # where capacities are not known, the shares are taken at the level where the outcome is least certain
    what = "ln capacity" if known else "the outcome, where it is least certain,"
    rows = list(zip(words, *columns, strict=True))
    return Rows(f"Where the variance of {what} comes from", ("", *map(str, results["block"].values)), rows)


def index_rows(results: xr.Dataset) -> Rows | None:
    """Sobol' indices of the probability of overturning at the level where it is nearest to one half."""
    if "sobol_first" not in results:
        return None
    rows = []
    for block in results["block"].values:
        for model in results["model"].values:
            one = results.sel(block=block, model=model)
            at = one.isel(output=middle_level(one["probability"]))
            for i, which in enumerate(one["input"].values):
                cells = []
                for name in ("sobol_first", "sobol_total"):
                    value, upper = at[name][i], at[f"{name}_upper"][i]
                    text = f"{float(value):.2f} ± {float(upper - value):.2f}".replace("-", "−")
                    cells.append("–" if math.isnan(value) else text)
                rows.append((f"{block}, {model}: {input_name(str(which)).replace('$', '')}", *cells))
    title = "Sobol' indices of the probability of overturning, where it is nearest to one half"
    return Rows(title, ("", "alone", "with others"), rows)
