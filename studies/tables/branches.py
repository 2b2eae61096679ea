"""Tables of rates over weighted branches: of blocks or pieces, and of the annual numbers and losses of a building."""

from __future__ import annotations

from itertools import product

import numpy as np
import xarray as xr

from ...core.wording import about_years, currency_of, given_percent, two_digits, whole_percent
from ...fragility.fitting.states import OVERTURNED, state_name
from ..buildings.assessment import BUILDING
from ..text.curve_notes import branches_beyond, state_in, verb_in
from ..text.rows import Rows
from ..text.spread import SOURCES, building_spread, rates_of_consequences, sources
from ..text.words import by_place
from .assessment import place_name, span


def spread_rows(results: xr.Dataset) -> Rows | None:
    """Return the rates over all branches, and what spreads them, for a terminal or a report; None without branches."""
    if "epistemic_rate" not in results:
        return None
    names = [str(one) for one in results["epistemic_source"].values]
    there = [one for one in names if float(results["epistemic_spread"].sel(epistemic_source=one).max()) > 0.0]
    fractiles = results["epistemic_fractile"].values.tolist()
    rows = []
    for name, place in by_place(results, results["epistemic_rate"].dims):
        one = results.isel(place)
        mean = one["epistemic_rate"].item()
        years = [about_years(rate) for rate in one["epistemic_rate_fractile"].values]
        shares = [float(one["epistemic_spread"].sel(epistemic_source=source)) for source in there]
        rows.append((
            name,
            about_years(mean),
            *years[::-1],
            *(_share(share) if np.isfinite(share) else "–" for share in shares),
        ))  # fmt: skip
    ends = [f"{given_percent(1.0 - p)}" for p in fractiles[::-1]]
    headings = ("", "1 / mean rate", *ends, *(SOURCES[name][0] for name in there))
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    held = f", β_m = {beta:g}" if beta and str(results.attrs.get("modelling")) == "fractiles" else ""
    over = f"{results.sizes['branch']:,} weighted branches{held}"
    fallen = state_in(results) == state_name(OVERTURNED)
    events = "falls" if fallen else f"times that a block {verb_in(results)}"
    title = f"Mean years between two {events} over {over}, and where their range comes from"
    beyond = branches_beyond(results)
    title += f" ({beyond})" if beyond else ""
    return Rows(title, headings, rows)


def amount_spread_rows(results: xr.Dataset) -> Rows | None:
    """Return the annual numbers and losses of a building over all branches; None without them."""
    named = {
        "annual_number": "pieces",
        "annual_loss": currency_of(results) or "loss",
        "annual_downtime": "days out of use",
        "annual_injuries": "injured",
    }
    found = [(name, unit) for name, unit in named.items() if f"epistemic_{name}" in results]
    if not found:
        return None
    rows = []
    places = [str(one) for one in results["place"].values]
    for (name, unit), place in product(found, (places[:1] if len(places) == 2 else places)):
        one = building_spread(results, name, place)
        if not float(one["epistemic_rate"]) > 0.0:
            continue
        shown = unit
        if name in ("annual_downtime", "annual_injuries"):
            years, words = span(results[f"epistemic_{name}"])
            one = one.assign({kind: years * one[kind] for kind in _VALUES})
            shown = f"{unit} {words}"
        parts = [f"{_share(share)} {what}" for what, share in sources(one)[:2]]
        values = [two_digits(float(value)) for value in one["epistemic_rate_fractile"].values]
        rows.append(
            (f"{place_name(place)}, {shown}", two_digits(float(one["epistemic_rate"])), *values, ", ".join(parts))
        )
    ends = [given_percent(float(p)) for p in results["epistemic_fractile"].values]
    title = f"Expected per year over {results.sizes['branch']:,} weighted branches, and where the range comes from"
    return Rows(title, ("", "mean", *ends, "largest parts of the range"), rows)


_VALUES = ("epistemic_rate", "epistemic_rate_fractile")


def consequence_spread_rows(results: xr.Dataset) -> Rows | None:
    """Return how often each consequence comes about in the building over all branches; None without any."""
    rates = rates_of_consequences(results, BUILDING)
    rows = None if rates is None else spread_rows(rates)
    if rows is None:
        return None
    return rows._replace(title=f"Consequences: {rows.title[:1].lower()}{rows.title[1:]}")


def _share(share: float) -> str:
    """A share of a variance in whole per cent, as its sampling allows."""
    return "below 1 %" if 0.0 < share < 0.005 else whole_percent(share)
