"""Tables of fragility studies: curves, annual rates, sizes that meet a target, measures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
import xarray as xr

from ...core.units import PER_YEAR
from ...core.wording import given_percent, percent, years_text
from ...fragility.hazard.rates import probability_in
from ...fragility.risk.modelling import LOWER, UPPER
from ...motions.intensity.naming import GROUND
from ..buildings.recommendations import Range
from ..plan.estimates import LOW_SHARE, ranking_of_measures
from ..text.block_order import RATE, shown
from ..text.curve_notes import infinitive_of, verb_in
from ..text.reached import within_levels
from ..text.spread import sample_range
from ..text.words import axis_of, by_place, display_unit, floor_name, level_name, measure_at
from .table import ENDS, Column, Marked, Row, Table, chosen, dispersion_of, ends_of, intervals, range_of


def curves(results: xr.Dataset) -> Table:
    """Return the levels at which half fall, dispersions and annual rates, the laws of each block together."""
    yearly = "rate" in results
    here = shown(results, RATE) if yearly else shown(results)
    years = years_text(float(here.attrs["years"])) if yearly else ""
    scale, unit = display_unit(axis_of(here))
    fractions = here["fraction"].values.tolist() if "fraction_level" in here else []
    rows: list[Row | str] = []
    for label, place in by_place(here, here["half_level"].dims):
        rows.append(label)
        for j, model in enumerate(here["model"].values):
            curve = here.isel(place).isel(model=j)
            row: Row = {"law": str(model), "level": str(curve["status"].item())}
            if "sample_median" in here:
                row["samples"] = ends_of(*(end / scale for end in sample_range(curve)))
            if bool(curve["converged"]):
                row |= {"level": range_of(curve, "half_level", scale), "dispersion": dispersion_of(curve)}
                row |= {f"P = {p:g}": range_of(curve.sel(fraction=p), "fraction_level", scale) for p in fractions}
            rows.append(row | (_rates(curve) if yearly else {}))
    fall = infinitive_of(verb_in(here))
    columns = (
        *(Column("law", "law"), Column("level", f"half {fall} at {level_name(here)}", "level", unit)),
        Column("dispersion", "dispersion β", "dispersion"),
        *(Column(f"P = {p:g}", f"{given_percent(p)} {fall} at", "level", unit, priority=2) for p in fractions),
        Column("samples", "medians of 90 % of the samples", "level", unit),
        *(Column("rate", "once in", "years3", "years"), Column("chance", f"in {years}", "chance3")),
        Column("sample_rates", "mean of the samples, 90 % of them", "years3", "years"),
    )
    notes = (
        "Dispersions are of the blocks that uplift." if "uplift_median" in here else "",
        "Motions and inputs vary together." if "sample_median" in here else "",
        f"Chances in {years} are means over the samples." if "sample_rate_mean" in here else "",
    )
    title = "Fragility curves and rates" if yearly else "Fragility curves"
    return Table.of(title, columns, rows, intervals(here), *notes, chosen(here))


def _rates(curve: xr.Dataset) -> Row:
    """Return the annual rate of one curve and the chance in the study's years; of samples, their means."""
    rate = range_of(curve, "rate")
    if not math.isfinite(rate.value):
        return {"rate": "no curve"}
    row: Row = {"rate": rate, "chance": range_of(curve, "risk_probability")}
    if "sample_rate_mean" in curve:
        ends = curve["sample_rate_quantile"].values.tolist()
        row["sample_rates"] = Range(curve["sample_rate_mean"].item(), ends[0], ends[-1])
        row["chance"] = curve["sample_risk_probability_mean"].item()
    return row


def low_level(curve: xr.Dataset) -> float:
    """Return the level at which one curve reaches the low share, NaN if the study has none."""
    known_there = "fraction_level" in curve and LOW_SHARE in curve["fraction"].values
    return float(curve["fraction_level"].sel(fraction=LOW_SHARE)) if known_there else math.nan


def exported_rates(results: xr.Dataset, laws: Sequence[int] | None = None) -> Table:
    """Return the rates of the blocks as values, for a spreadsheet; levels in SI; `laws` are positions, None for all."""
    results = within_levels(results)
    years, level = float(results.attrs["years"]), str(axis_of(results).attrs.get("units", "1"))
    in_all, modelling = (
        f"chance_in_{years:g}_years",
        [end for end in (LOWER, UPPER) if f"risk_probability{end}" in results],
    )
    columns = (
        *(Column("block"), Column("floor"), Column("damping_law"), Column("rate", unit=PER_YEAR, ends=ENDS)),
        *(Column(name, unit="1", ends=ENDS) for name in ("chance_in_a_year", in_all)),
        *(Column(f"{in_all}{end}", unit="1") for end in modelling),
        *(Column(f"level_at_{share}_percent", unit=level) for share in (10, 50)),
    )
    floors = results["floor"].values.tolist() if "floor" in results["rate"].dims else [None]
    rows: list[Row] = []
    for i, k, j in product(range(results.sizes["block"]), range(len(floors)), laws or range(results.sizes["model"])):
        curve = results.isel(block=i, model=j)
        curve = curve if floors[k] is None else curve.isel(floor=k)
        rate = range_of(curve, "rate")
        rows.append({
            "block": str(results["block"].values[i]),
            "floor": "" if floors[k] is None else str(floors[k]),
            "damping_law": str(curve["model"].item()),
            "rate": rate,
            "chance_in_a_year": Range(*(float(probability_in(np.float64(end), 1.0)) for end in rate)),
            in_all: range_of(curve, "risk_probability"),
            **{f"{in_all}{end}": curve[f"risk_probability{end}"].item() for end in modelling},
            "level_at_10_percent": low_level(curve),
            "level_at_50_percent": curve["half_level"].item(),
        })  # fmt: skip
    return Table("Rates", columns, rows)


def sizes(results: xr.Dataset) -> Table:
    """Return the size of the blocks that meets the study's target."""
    along, target = str(results.attrs["size_along"]), float(results.attrs["size_probability"])
    size = f"size_{along}"
    floors = results["floor"].values.tolist() if "floor" in results[size].dims else [None]
    rows: list[Row] = []
    for (k, floor), model in product(enumerate(floors), range(results.sizes["model"])):
        law = results.isel(model=model) if floor is None else results.isel(model=model, floor=k)
        where = "" if floor is None else f", {floor_name(floor)}"
        status = str(law["size_status"].item())
        value = range_of(law, size)
        rows.append({
            "law": f"{law['model'].item()}{where}",
            "size": value if math.isfinite(value.value) else None,
            "status": "" if status == "ok" else status,
        })  # fmt: skip
    columns = Column("law", "law"), Column("size", along, "three", str(results[size].attrs["units"])), Column("status")
    years = years_text(float(results.attrs["years"]))
    goal = f"A block of this size {verb_in(results)} with a chance of {percent(target)} in {years}."
    return Table.of("Size for the target", columns, rows, goal, intervals(results))


def measures(results: xr.Dataset, most: int = 4) -> Table:
    """Return the most efficient measures of each block: the dispersion in each measure under every law, best first."""
    ranking = ranking_of_measures(shown(results))
    names = [str(model) for model in ranking["model"].values]
    rows: list[Row | str] = []
    number = 0
    for name, place in by_place(ranking, ranking.dims):
        here = ranking.isel(place)
        rank = here["rank"].mean("model").values
        finite = np.isfinite(here["amplitude_dispersion"].values)
        known = finite.any(axis=here["amplitude_dispersion"].dims.index("model"))
        ranked = [i for i in np.argsort(rank) if np.isfinite(rank[i]) and known[i]]
        number = max(number, len(ranked))
        rows.append(name)
        for i in ranked[:most]:
            # (the dispersion is of the root of the measure that grows with the amplitude)
            label, long_name = (str(here[key].values[i]) for key in ("measure", "measure_long_name"))
            row: Row = {"measure": measure_at(label, long_name, float(here["power"].values[i]))}
            for j, law in enumerate(names):
                value = here.isel(model=j, measure=i)
                dispersion = dispersion_of(value, "amplitude_dispersion")
                row[law] = dispersion if bool(value["distinguishable"]) else Marked(dispersion, "≈")
            rows.append(row)
    common = f" of the {GROUND}"
    lines = [row for row in rows if not isinstance(row, str)]
    common = common if all(str(row["measure"]).endswith(common) for row in lines) else ""
    for row in lines:
        row["measure"] = str(row["measure"]).removesuffix(common)
    columns = Column("measure", f"measure{common}"), *(Column(law, law, "dispersion") for law in names)
    best = f"The table has the best {most} of up to {number} measures." if number > most else ""
    return Table("Dispersion by intensity measure", columns, rows, [*filter(None, (SAME, best, chosen(ranking)))])


SAME = "≈: not distinguished from the best."
