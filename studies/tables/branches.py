"""Tables of rates over weighted branches: of blocks or pieces, and of the annual numbers and losses of a building."""

from itertools import product

import xarray as xr

from ...core.wording import currency_of, given_percent, whole_percent
from ...fragility.fitting.states import OVERTURNED, state_name
from ..buildings.assessment import BUILDING
from ..text.block_order import RATE, shown
from ..text.curve_notes import branches_beyond, state_in, verb_in
from ..text.spread import SOURCES, building_spread, rates_of_building, rates_of_consequences, sources
from ..text.words import by_place
from .assessment import place_name, span
from .table import Cells, Column, Table, footnote

MOST = 30
"""Most places and pieces in the table of rates over branches; the results have all of them."""
AMOUNTS = {"number": "pieces", "loss": "loss", "downtime": "days out of use", "injuries": "injured"}


def branch_rates(results: xr.Dataset) -> Table:
    """Return the rates over all branches, and the sources of their spread."""
    rated = rates_of_building(results).isel(block=slice(MOST)) if "place" in results.dims else shown(results, RATE)
    return _rates("Return periods over all branches", rated)


def consequence_branches(results: xr.Dataset) -> Table:
    """Return the return periods of the consequences in the building over all branches."""
    rated = rates_of_consequences(results, BUILDING)
    title = "Return periods of consequences over all branches"
    return Table(title, (), ()) if rated is None else _rates(title, rated)


def _rates(title: str, rated: xr.Dataset) -> Table:
    fractiles = rated["epistemic_fractile"].values[::-1].tolist()
    names = [str(source) for source in rated["epistemic_source"].values]
    spread = rated["epistemic_spread"]
    parts = [name for name in names if float(spread.sel(epistemic_source=name).max()) > 0.0]
    rows: list[Cells] = []
    for name, place in by_place(rated, rated["epistemic_rate"].dims):
        block = rated.isel(place)
        row: Cells = {
            Column("name"): name,
            Column("mean", "1 / mean rate", "years", "years"): block["epistemic_rate"].item(),
        }
        for p in fractiles:
            percent = given_percent(1.0 - p)
            row[Column(percent, percent, "years")] = float(block["epistemic_rate_fractile"].sel(epistemic_fractile=p))
        for part in parts:
            share = float(block["epistemic_spread"].sel(epistemic_source=part))
            row[Column(part, SOURCES[part][0], "share", priority=2)] = share
        rows.append(row)
    fallen = state_in(rated) == state_name(OVERTURNED)
    events = "falls" if fallen else f"times that a block {verb_in(rated)}"
    beyond, beta = branches_beyond(rated), float(rated.attrs.get("modelling_dispersion", 0.0))
    return Table.of(
        title,
        rows,
        footnote("years_between", events, rated.sizes["branch"]),
        footnote("parts_of_spread"),
        footnote("branches_modelling", beta) if beta and str(rated.attrs.get("modelling")) == "fractiles" else "",
        f"{beyond}." if beyond else "",
    )


def amount_branches(results: xr.Dataset) -> Table:
    """Return the annual numbers and losses of a building over all branches."""
    places = [str(place) for place in results["place"].values]
    percents = [given_percent(p) for p in results["epistemic_fractile"].values.tolist()]
    rows: list[Cells] = []
    names = [name for name in AMOUNTS if f"epistemic_annual_{name}" in results]
    for name, place in product(names, places[:1] if len(places) == 2 else places):
        spread = building_spread(results, f"annual_{name}", place)
        if not float(spread["epistemic_rate"]) > 0.0:
            continue
        unit = (currency_of(results) if name == "loss" else "") or AMOUNTS[name]
        few = name in ("downtime", "injuries")
        years, words = span(results[f"epistemic_annual_{name}"]) if few else (1.0, "")
        values = (years * spread["epistemic_rate_fractile"]).values.tolist()
        largest = [f"{whole_percent(share)} {source}" for source, share in sources(spread)[:2]]
        rows.append({
            Column("name"): f"{place_name(place)}, {unit} {words}".rstrip(),
            Column("mean", "mean", "two"): years * float(spread["epistemic_rate"]),
            **{Column(percent, percent, "two"): end for percent, end in zip(percents, values, strict=True)},
            Column("parts", "largest parts of the range"): ", ".join(largest),
        })  # fmt: skip
    note = footnote("branches", results.sizes["branch"])
    return Table.of("Expected per year over all branches", rows, note)
