"""Tables of studies of blocks: curves, rates, precision, selected motions, sizes, measures, sources of variance."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.parameters import USUAL_CONFIDENCE
from ...core.units import ENDS, PER_YEAR
from ...core.wording import given_percent, percent, years_text
from ...fragility import curve_probability
from ...fragility.adaptive.until import MEDIAN, PROBABILITY, RATE as UNTIL_RATE
from ...fragility.risk.modelling import LOWER, UPPER
from ...motions.intensity.naming import GROUND
from ..buildings.recommendations import Range
from ..plan.estimates import LOW_SHARE, middle_level, ranking_of_measures
from ..plan.selections import MEASURE, PREFIX, STRIPE
from ..text.block_order import RATE, shown
from ..text.curve_notes import infinitive_of, state_in, verb_in
from ..text.precision import FITTED_RATE, asked_of, curves_of, reached_by
from ..text.reached import within_levels
from ..text.spread import sample_range
from ..text.words import (
    axis_of,
    block_title,
    by_place,
    display_of,
    display_unit,
    floor_name,
    input_name,
    level_name,
    measure_at,
    measure_name,
)
from .table import (
    Cells,
    Column,
    Marked,
    Row,
    Table,
    Value,
    chance_in,
    chosen,
    dispersion_of,
    ends_of,
    footnote,
    intervals,
    range_of,
)


def curves(results: xr.Dataset) -> Table:
    """Return the levels at which half fall, dispersions and annual rates, the laws of each block together."""
    yearly = "rate" in results
    selected = shown(results, RATE) if yearly else shown(results)
    years = years_text(float(selected.attrs["years"])) if yearly else ""
    scale, unit = display_unit(axis_of(selected))
    fractions = selected["fraction"].values.tolist() if "fraction_level" in selected else []
    fall = infinitive_of(verb_in(selected))
    rows: list[Cells | str] = []
    for label, place in by_place(selected, selected["half_level"].dims):
        rows.append(label)
        for j, model in enumerate(selected["model"].values):
            curve = selected.isel(place).isel(model=j)
            known, status = bool(curve["converged"]), str(curve["status"].item())
            row: Cells = {
                Column("law", "law"): str(model),
                Column("level", f"half {fall} at {level_name(selected)}", "level", unit): (
                    range_of(curve, "half_level", scale) if known else status
                ),
                Column("dispersion", "dispersion β", "dispersion"): dispersion_of(curve) if known else None,
            }
            for p in fractions:
                column = Column(f"P = {p:g}", f"{given_percent(p)} {fall} at", "level", unit, priority=2)
                row[column] = range_of(curve.sel(fraction=p), "fraction_level", scale) if known else None
            if "sample_median" in selected:
                samples = ends_of(*(end / scale for end in sample_range(curve)))
                row[Column("samples", "medians of 90 % of the samples", "level", unit)] = samples
            rows.append(row | (_rates(curve, years) if yearly else {}))
    notes = (
        footnote("uplifted") if "uplift_median" in selected else "",
        footnote("inputs") if "sample_median" in selected else "",
    )
    title = "Fragility curves and rates" if yearly else "Fragility curves"
    return Table.of(title, rows, intervals(selected), *notes, chosen(selected))


def _rates(curve: xr.Dataset, years: str) -> Cells:
    """Return the annual rate of one curve and the chance in the study's years; of samples the mean rate, too."""
    rate, means = range_of(curve, "rate"), None
    known = math.isfinite(rate.value)
    chance: Value = range_of(curve, "risk_probability") if known else None
    if known and "sample_rate_mean" in curve:
        ends = curve["sample_rate_quantile"].values.tolist()
        means = Range(curve["sample_rate_mean"].item(), ends[0], ends[-1])
    return {
        Column("rate", "once in", "years3", "years"): rate if known else "no curve",
        Column("chance", f"in {years}", "chance3"): chance,
        Column("sample_rates", "mean of the samples, 90 % of them", "years3", "years"): means,
    }


def curves_at(results: xr.Dataset, levels: Array) -> xr.DataArray:
    """Return the probabilities of the fitted curves at the levels of the runs; NaN without a curve."""
    fit = results.assign_attrs(form=results.attrs.get("form", "lognormal"))
    if "curve_probability" in fit:
        fit = fit.drop_vars(["probability", "lower", "upper"], errors="ignore").rename(curve_probability="probability")
    return curve_probability(fit, levels, outside="most")


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
        low = "fraction_level" in curve and LOW_SHARE in curve["fraction"].values
        rows.append({
            "block": str(results["block"].values[i]),
            "floor": "" if floors[k] is None else str(floors[k]),
            "damping_law": str(curve["model"].item()),
            "rate": rate,
            "chance_in_a_year": chance_in(rate, 1.0),
            in_all: range_of(curve, "risk_probability"),
            **{f"{in_all}{end}": curve[f"risk_probability{end}"].item() for end in modelling},
            "level_at_10_percent": float(curve["fraction_level"].sel(fraction=LOW_SHARE)) if low else math.nan,
            "level_at_50_percent": curve["half_level"].item(),
        })  # fmt: skip
    return Table("Rates", columns, rows)


def sizes(results: xr.Dataset) -> Table:
    """Return the size of the blocks that meets the study's target."""
    along, target = str(results.attrs["size_along"]), float(results.attrs["size_probability"])
    size = f"size_{along}"
    units = str(results[size].attrs["units"])
    floors = results["floor"].values.tolist() if "floor" in results[size].dims else [None]
    rows: list[Cells] = []
    for (k, floor), model in product(enumerate(floors), range(results.sizes["model"])):
        law = results.isel(model=model) if floor is None else results.isel(model=model, floor=k)
        where = "" if floor is None else f", {floor_name(floor)}"
        status = str(law["size_status"].item())
        value = range_of(law, size)
        rows.append({
            Column("law", "law"): f"{law['model'].item()}{where}",
            Column("size", along, "three", units): value if math.isfinite(value.value) else None,
            Column("status"): "" if status == "ok" else status,
        })  # fmt: skip
    years = years_text(float(results.attrs["years"]))
    return Table.of(f"Size for a {percent(target)} chance of {state_in(results)} in {years}", rows, intervals(results))


def measures(results: xr.Dataset, most: int = 4) -> Table:
    """Return the most efficient measures of each block: the dispersion in each measure under every law, best first."""
    ranking = ranking_of_measures(shown(results))
    names = [str(model) for model in ranking["model"].values]
    rows: list[Row | str] = []
    number = 0
    for name, place in by_place(ranking, ranking.dims):
        of_block = ranking.isel(place)
        rank = of_block["rank"].mean("model").values
        finite = np.isfinite(of_block["amplitude_dispersion"].values)
        known = finite.any(axis=of_block["amplitude_dispersion"].dims.index("model"))
        ranked = [i for i in np.argsort(rank) if np.isfinite(rank[i]) and known[i]]
        number = max(number, len(ranked))
        rows.append(name)
        for i in ranked[:most]:
            # (the dispersion is of the root of the measure that grows with the amplitude)
            label, long_name = (str(of_block[key].values[i]) for key in ("measure", "measure_long_name"))
            row: Row = {"measure": measure_at(label, long_name, float(of_block["power"].values[i]))}
            for j, law in enumerate(names):
                value = of_block.isel(model=j, measure=i)
                dispersion = dispersion_of(value, "amplitude_dispersion")
                row[law] = dispersion if bool(value["distinguishable"]) else Marked(dispersion, "≈")
            rows.append(row)
    common = f" of the {GROUND}"
    lines = [row for row in rows if not isinstance(row, str)]
    common = common if all(str(row["measure"]).endswith(common) for row in lines) else ""
    for row in lines:
        row["measure"] = str(row["measure"]).removesuffix(common)
    columns = Column("measure", f"measure{common}"), *(Column(law, law, "dispersion") for law in names)
    best = footnote("best_measures", most, number) if number > most else ""
    return Table(
        "Dispersion by intensity measure",
        columns,
        rows,
        [*filter(None, (footnote("same_measures"), best, chosen(ranking)))],
    )


def precision(results: xr.Dataset) -> Table:
    """Return the requested and the reached precision of each curve."""
    selected = shown(results)
    target, allowed = asked_of(selected)
    chance = target == PROBABILITY
    scale, unit = (
        display_unit(axis_of(selected)) if target == MEDIAN else (1.0, "1/year" if target == UNTIL_RATE else "")
    )
    fitted = [curve for _, curve in curves_of(selected)] if target == UNTIL_RATE and FITTED_RATE in selected else []
    name = "half level" if target == MEDIAN else target
    rows: list[Cells] = []
    for k, curve in enumerate(reached_by(selected)):
        value = Range(*(end / scale for end in curve.target))
        known = math.isfinite(curve.half_width) and math.isfinite(value.value)
        rows.append({
            Column("curve", "curve"): curve.name,
            Column("value", name, "plain", unit): value if known else None,
            Column("reached", "reached", "error" if chance else "precision"): curve.half_width if known else None,
            Column("motions", "motions", "count"): curve.motions,
            Column("runs", "runs", "count"): curve.runs,
            Column("stopped", "stopped because"): curve.stopped,
        })  # fmt: skip
        if k < len(fitted):
            rows[-1][Column("fitted", "of the fitted curve", "three", unit)] = range_of(fitted[k], FITTED_RATE)
            rows[-1][Column("apart", "which differs by", "signed")] = float(fitted[k]["rate_misfit"]) or "within error"
    request = footnote("half_width", f"{allowed:g}" if chance else f"{100.0 * allowed:g} %", name)
    free = footnote("form_free") if target == UNTIL_RATE else ""
    return Table.of(
        "Precision at adaptive levels", rows, request, footnote("intervals", given_percent(USUAL_CONFIDENCE)), free
    )


def selections(results: xr.Dataset) -> Table:
    """Return the agreement of each stripe's motions with the hazard, a row per stripe."""
    given = str(results[STRIPE].attrs["long_name"])
    known = given in results[MEASURE]
    scale, unit = display_of(str(results["selected_unit"].sel({MEASURE: given}).item()) if known else "1")
    rows: list[Cells] = []
    for i, level in enumerate(results[STRIPE].values):
        stripe = results.isel({STRIPE: i})
        bias, ratio = stripe[f"{PREFIX}bias"], stripe[f"{PREFIX}sigma_ratio"]
        velocity = float(bias.sel({MEASURE: "pgv"}))
        rows.append({
            Column("level", measure_at(given, GROUND), "plain", unit): level / scale,
            Column("epsilon", "ε", "tenths"): float(stripe[f"{PREFIX}epsilon"]),
            Column("median", "largest error of a median"): _furthest(bias, abs(bias), Column("", format="signed")),
            Column("scatter", "largest ratio of scatters"): _furthest(
                ratio, abs(ratio - 1.0), Column("", format="hundredths")
            ),
            Column("pgv", "error of the median PGV", "signed"): "not asked" if math.isnan(velocity) else velocity,
            Column("factors", "scale factors", "two"): ends_of(
                *(float(stripe[f"{PREFIX}factor_{end}"]) for end in ("least", "greatest"))
            ),
            Column("agrees", "agrees"): "yes" if bool(stripe[f"{PREFIX}consistent"]) else "no",
        })  # fmt: skip
    note = footnote("epsilon")
    return Table.of("Agreement of the selected motions with the hazard", rows, note)


def _furthest(values: xr.DataArray, distance: xr.DataArray, column: Column) -> str | None:
    """Return the value furthest off, and of which measure it is; None if nothing is known."""
    if not bool(distance.notnull().any()):
        return None
    at = int(np.nanargmax(distance.values))
    return f"{column.text(float(values[at]))} {measure_name(str(values[MEASURE].values[at]))}"


def shares(results: xr.Dataset) -> Table:
    """Return shares of the variance of ln capacity by component, or of the flags if capacities are not known."""
    selected = shown(results)
    capacities = "capacity_share" in selected
    columns = {
        label: Column(f"of {label}", block_title(label), "share") for label in map(str, selected["block"].values)
    }
    rows: list[Row] = []
    for name in map(str, selected["component"].values):
        row: Row = {"name": " × ".join(input_name(part) for part in name.split(" × "))}
        for label, column in columns.items():
            block = selected.sel(block=label)
            share = block["capacity_share"] if capacities else block["flag_share"]
            share = share if capacities else share.isel(level=middle_level(block["probability"]))
            row[column.key] = float(share.sel(component=name))
        rows.append(row)
    notes = [footnote("variance_of_capacity" if capacities else "variance_of_outcome"), chosen(selected)]
    return Table("Sources of the variance", (Column("name"), *columns.values()), rows, notes)


def indices(results: xr.Dataset) -> Table:
    """Return Sobol' indices of the probability of overturning at the level at which it is nearest to one half."""
    selected = shown(results)
    rows: list[Cells | str] = []
    for block in selected["block"].values:
        for model in selected["model"].values:
            curve = selected.sel(block=block, model=model)
            at = curve.isel(output=middle_level(curve["probability"]))
            rows.append(f"{block_title(str(block))}, {model}")
            for i, name in enumerate(curve["input"].values):
                row: Cells = {Column("name"): input_name(str(name))}
                for key, title in (("sobol_first", "alone"), ("sobol_total", "with others")):
                    value, upper = float(at[key][i]), float(at[f"{key}_upper"][i])
                    row[Column(key, title, "plus_minus")] = Range(value, upper - value, np.nan)
                rows.append(row)
    ends = percent(float(results.attrs.get("confidence", 0.95)))
    note = footnote("variance_of_chance", ends)
    return Table.of("Sobol’ indices", rows, note, chosen(selected))
