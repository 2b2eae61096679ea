"""Tables of fragility studies for a terminal: curves, annual rates, sizes that meet a target, measures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import product

import numpy as np
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from ...core.units import PER_YEAR
from ...core.wording import (
    chance_text,
    chances_between,
    confidence_text,
    given_percent,
    in_years,
    interval_text,
    percent,
    three_digits,
    two_digits,
    years_between,
    years_text,
)
from ...fragility.fitting.states import OVERTURNED, state_name
from ...fragility.hazard.rates import probability_in
from ...fragility.risk.modelling import LOWER, UPPER
from ..plan.estimates import LOW_SHARE, ranking_of_measures
from ..text.block_order import chosen_of
from ..text.curve_notes import held_apart, infinitive_of, reached_of, state_in, verb_in
from ..text.reached import dispersion_texts, fraction_text, level_texts, levels_run, other_levels, within_levels
from ..text.rows import Rows
from ..text.words import axis_of, by_place, display_unit, floor_name, level_name, measure_at
from .values import Cell, ValueTable, known, with_units

# Advice where there is no curve, by the status of the fit (separated data have a curve, and a note).
ADVICE = {
    "no overturning": "nothing {did} at any level: {higher}",
    "all overturned": "everything {did} at every level: {lower}",
    "one level": "one level gives no curve: take more levels",
    "not increasing": "fewer blocks {did} at higher levels: look at the motions",
    "flat": "barely more blocks {did} at higher levels: take more motions or a wider range of levels",
    "not converged": "the likelihood has no clear maximum: take more motions",
}


def hints(results: xr.Dataset) -> list[str]:
    """One line for each reason why a curve is missing."""
    status = results["status"].values.ravel().astype(str)
    state = state_in(results)
    did = "fell" if state == state_name(OVERTURNED) else reached_of(state)
    study = json.loads(str(results.attrs["study"]))
    run = levels_run(results)
    cures = {"higher": other_levels(study, True, run), "lower": other_levels(study, False, run)}
    lines = []
    for one in dict.fromkeys(status.tolist()):
        if one in ADVICE:
            number = int((status == one).sum())
            of = f" ({number:,} of {status.size:,} curves)" if status.size > 1 else ""
            lines.append(f"{one}{of}: {ADVICE[one].format(did=did, **cures)}")
    return lines


def _table(title: str, headings: Sequence[str]) -> Table:
    """Return a table without rows: names of laws and words to the left, numbers to the right."""
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    for heading in headings:
        table.add_column(heading, justify="left" if heading in ("law", "") else "right", overflow="fold")
    return table


def fragility_table(results: xr.Dataset) -> Table:
    """Levels at which half fall, and dispersions of the fitted curves, with intervals, for a terminal."""
    scale, unit = display_unit(axis_of(results))
    name = axis_of(results).attrs.get("long_name", "level")
    percent = confidence_text(results)
    fall = infinitive_of(verb_in(results))
    less = held_apart(results)
    fractions = results["fraction"].values.tolist() if "fraction_level" in results else []
    table = _table(
        f"{name[:1].upper()}{name[1:]}{f' ({unit})' if unit else ''} at which half of the runs {fall}, and "
        f"dispersion β of {'what uplifted' if 'uplift_median' in results else 'the fitted curve'}, with {percent} "
        f"intervals{less}{_chosen(results)}",
        ("law", "half at", percent, "β", percent, *(f"P = {given_percent(p)}" for p in fractions)),
    )
    for label, place in by_place(results, results.dims):
        table.add_row(f"[bold]{escape(label)}[/]")
        for j, model in enumerate(results["model"].values):
            one = results.isel(place).isel(model=j)
            if bool(one["converged"]):
                cells: tuple[str, ...] = (*level_texts(one, "half_level", scale), "", "")
                if "dispersion" in one:
                    cells = (*cells[:2], *dispersion_texts(one))
                cells += tuple(fraction_text(one, p, scale) for p in fractions)
            else:
                cells = ("", f"[italic]{one['status'].item()}[/]", "", "", *("" for _ in fractions))
            table.add_row(f" {escape(str(model))}", *cells, end_section=j == results.sizes["model"] - 1)
    return table


def risk_table(results: xr.Dataset) -> Table:
    """Annual rates, and probabilities in the study's years, for a terminal."""
    years = float(results.attrs["years"])
    percent = confidence_text(results)
    scale, unit = display_unit(axis_of(results))
    measure = f"{level_name(results)}{f', {unit}' if unit else ''}"
    both = "fraction_level" in results and LOW_SHARE in results["fraction"].values
    shares = f"{100.0 * LOW_SHARE:g} / 50 %" if both else "50 %"
    table = _table(
        f"How often each {verb_in(results)}, and with what probability in {years_text(years)} ({percent} intervals, "
        f"for the given hazard curve){_chosen(results)}",
        ("law", "once in, years", "in a year", f"in {years_text(years)}", f"{shares} at {measure}"),
    )
    for label, place in by_place(results, results["rate"].dims):
        table.add_row(f"[bold]{escape(label)}[/]")
        for j, model in enumerate(results["model"].values):
            one = results.isel(place).isel(model=j)
            rate = one["rate"].item()
            if np.isfinite(rate):
                low, high = one["rate_lower"].item(), one["rate_upper"].item()
                chance, least, most = (one[f"risk_probability{end}"].item() for end in ("", "_lower", "_upper"))
                # (a note says why)
                once = "[italic]no width[/]" if low == high else years_between(high, low)
                chances = "[italic]no width[/]" if low == high else chances_between(least, most)
                found = [value for value in (_low_level(one), one["half_level"].item()) if 0.0 < value < np.inf]
                cells: tuple[str, ...] = (
                    f"{in_years(rate)} ({once})",
                    chance_text(float(probability_in(np.float64(rate), 1.0))),
                    f"{chance_text(chance)} ({chances})".replace("\u00a0%)", ")"),
                    " / ".join(two_digits(value / scale) for value in found),
                )
            else:
                cells = ("[italic]no curve[/]", "", "", "")
            table.add_row(f" {escape(str(model))}", *cells, end_section=j == results.sizes["model"] - 1)
    return table


def _low_level(one: xr.Dataset) -> float:
    """Return the level at which one curve reaches the low share, NaN where that was not asked for."""
    known_there = "fraction_level" in one and LOW_SHARE in one["fraction"].values
    return float(one["fraction_level"].sel(fraction=LOW_SHARE)) if known_there else np.nan


def rate_values(results: xr.Dataset, laws: Sequence[int] | None = None) -> ValueTable:
    """Return the rates of the blocks as values, for a spreadsheet; levels in SI; `laws` are positions, None for all."""
    results = within_levels(results)
    years, level = float(results.attrs["years"]), str(axis_of(results).attrs.get("units", "1"))
    in_all = f"chance_in_{years:g}_years"
    ends = ("", "_lower", "_upper")
    headings = ["block", "floor", "damping_law"]
    for name, units in (("rate", PER_YEAR), ("chance_in_a_year", "1"), (in_all, "1")):
        headings += [with_units(f"{name}{end}", units) for end in ends]
    ranged = [f"risk_probability{end}" for end in (LOWER, UPPER) if f"risk_probability{end}" in results]
    headings += [with_units(name.replace("risk_probability", in_all), "1") for name in ranged]
    headings += [with_units(f"level_at_{share}_percent", level) for share in (10, 50)]
    floors = results["floor"].values.tolist() if "floor" in results["rate"].dims else [None]
    rows: list[list[Cell]] = []
    for i, k, j in product(range(results.sizes["block"]), range(len(floors)), laws or range(results.sizes["model"])):
        one = results.isel(block=i, model=j)
        one = one if floors[k] is None else one.isel(floor=k)
        rates = [one[f"rate{end}"].item() for end in ends]
        chances = [float(probability_in(np.float64(rate), 1.0)) for rate in rates]
        chances += [one[f"risk_probability{end}"].item() for end in ends]
        chances += [one[name].item() for name in ranged]
        values = [*rates, *chances, _low_level(one), one["half_level"].item()]
        where = "" if floors[k] is None else str(floors[k])
        rows.append([str(results["block"].values[i]), where, str(one["model"].item()), *map(known, values)])
    return ValueTable(headings, rows)


def size_table(results: xr.Dataset) -> Table:
    """The size of the blocks that meets the study's target, for a terminal."""
    along, target = results.attrs["size_along"], float(results.attrs["size_probability"])
    years = float(results.attrs["years"])
    units = results[f"size_{along}"].attrs["units"]
    table = _table(
        f"Which {along} ({units}) {verb_in(results)} with a probability of {percent(target)} in {years:g} years "
        f"({confidence_text(results)} intervals, for the given hazard curve)",
        ("law", along, "interval", ""),
    )
    floors = results["floor"].values.tolist() if "floor" in results[f"size_{along}"].dims else [None]
    for k, floor in enumerate(floors):
        for j, model in enumerate(results["model"].values):
            one = results.isel(model=j) if floor is None else results.isel(model=j, floor=k)
            where = "" if floor is None else f", {floor_name(floor)}"
            found = one[f"size_{along}"].item()
            low, high = (one[f"size_{along}_{end}"].item() for end in ("lower", "upper"))
            status = str(one["size_status"].item())
            shown = three_digits(found) if np.isfinite(found) else ""
            interval = interval_text(low, high) if shown else ""
            table.add_row(escape(str(model) + where), shown, interval, "" if status == "ok" else status)
    return table


def measure_rows(results: xr.Dataset, most: int = 8) -> list[Rows]:
    """The most efficient measures of each block: the dispersion in each measure under every law, best first."""
    found = ranking_of_measures(results)
    tables = []
    for name, place in by_place(found, found.dims):
        here = found.isel(place)
        rank = here["rank"].mean("model").values
        rows = []
        known = np.isfinite(here["amplitude_dispersion"].values).any(
            axis=here["amplitude_dispersion"].dims.index("model")
        )
        there = [i for i in np.argsort(rank) if np.isfinite(rank[i]) and known[i]]
        for i in there[:most]:
            cells = []
            for j in range(here.sizes["model"]):
                one = here.isel(model=j, measure=i)
                near = "" if bool(one["distinguishable"]) else "≈ "
                cells.append("{}{} ({})".format(near, *dispersion_texts(one, "amplitude_dispersion")))
            # (the dispersion is of the root of the measure that grows with the amplitude)
            label, long_name = (str(here[key].values[i]) for key in ("measure", "measure_long_name"))
            rows.append((measure_at(label, long_name, float(here["power"].values[i])), *cells))
        shown = f"the best {most} of {len(there)} measures, " if len(there) > most else ""
        title = f"Dispersion by measure: {name} ({shown}≈: not distinguished from the best)"
        tables.append(Rows(title, ("", *map(str, here["model"].values)), rows))
    return tables


def _chosen(results: xr.Dataset) -> str:
    """The ending of a table's title where the table does not hold all blocks."""
    return f"; {chosen_of(results)}" if chosen_of(results) else ""
