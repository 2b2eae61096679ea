"""Tables of a performance assessment as rows of text, for a terminal or a report."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Flags
from ...core.units import DIMENSIONLESS
from ...core.wording import (
    about_years,
    confidence_text,
    currency_of,
    given_percent,
    short_digits,
    three_digits,
    value_text,
    whole_percent,
    years_between,
)
from ...fragility.risk.modelling import MODELLING
from ..buildings.variables import DOUBTFUL, DRAWING, FALLEN, OF_DRAWS, PER_YEAR, level_index
from ..plan.estimates import MEAN as IN_MEAN
from ..text.rows import Rows
from ..text.words import consequence_name, floor_cell, floor_name, level_name, level_text
from .unseen import most_rate

ABOVE = "above "
"""Before the fewest years between two events of which no motion showed one."""
DRAWN = {"downtime": "out of use, days", "injuries": "injured"}
"""Headings of amounts that only some inventories give; of amounts in a year with the `span` of time."""
MARK, MARKED = " ‡", "‡ outside the model, or on a support that moves: no ground for advice"
"""After the name of a piece whose chance of falling is no ground for advice, and why."""
TENTH = 0.1
"""Share of a value above which the error of its draws is written."""
SELDOM = 0.1
"""Amount a year below which it is written as that of 1,000 years."""


def annual_rows(assessment: xr.Dataset, model: str | None = None) -> Rows:
    """Expected values in a year, by place."""
    here = of_model(assessment, model)
    if "annual_number" not in here:
        raise ValueError("annual values need an assessment with a hazard curve, got one without")
    has_loss = "annual_loss" in here
    amounts = {name: f"annual_{name}" for name in DRAWN if f"annual_{name}" in here}
    spans = {name: span(here[one]) for name, one in amounts.items()}
    headings = ["", "unanchored pieces", f"{fallen_word(here)} a year", *(["lost a year"] if has_loss else [])]
    headings += [*(drawn_heading(name, spans[name][1]) for name in amounts), "anything falls, once in"]
    rows = []
    for place in here["place"].values:
        one = here.sel(place=place)
        cells = [place_name(str(place)), str(pieces_at(here, str(place))), _interval(one, "annual_number")]
        cells += [_interval(one, "annual_loss")] if has_loss else []
        cells += [_interval(one, variable, spans[name][0]) for name, variable in amounts.items()]
        rows.append((*cells, _period(one, "any_rate")))
    money = currency_of(here)
    sure = f"{confidence_text(here)} intervals, for the given hazard curve"
    title = f"In a year{f', {money}' if money and has_loss else ''} ({sure})"
    return Rows(_dashed(title, rows), tuple(headings), rows)


def level_rows(assessment: xr.Dataset, level: float, model: str | None = None) -> Rows:
    """Overturned pieces and losses at one of the levels, by place."""
    at = level_index(assessment, level)
    here = of_model(assessment, model).isel(level=at)
    has_loss = "loss_mean" in here
    amounts = {f"{name}_mean": heading for name, heading in DRAWN.items() if f"{name}_mean" in here}
    ends = [given_percent(float(q)) for q in here["quantile"].values]
    headings = ["", "unanchored pieces", fallen_word(here), " / ".join(ends), *(["lost"] if has_loss else [])]
    headings += [*amounts.values(), "anything falls"]
    rows = []
    for place in here["place"].values:
        one = here.sel(place=place)
        cells = [place_name(str(place)), str(pieces_at(here, str(place))), _interval(one, "number_mean")]
        cells.append(" / ".join(_quantiles(one)))
        cells += [_interval(one, name) for name in (*(["loss_mean"] if has_loss else []), *amounts)]
        rows.append((*cells, _percent(one, "any_probability")))
    shaken = f"{level_name(assessment)} = {level_text(float(here['level']), assessment['level'])}"
    money = currency_of(here)
    said = f"{confidence_text(here)} intervals"
    said += f"; ±: {OF_DRAWS} of pieces" if any("±" in cell for row in rows for cell in row) else ""
    title = f"At {shaken}{f', {money}' if money and has_loss else ''} ({said})"
    return Rows(_dashed(title, rows), tuple(headings), rows)


def consequence_rows(assessment: xr.Dataset, level: float | None = None, model: str | None = None) -> Rows | None:
    """Rates of each consequence by place, or its probabilities at a level; None where nothing has a consequence."""
    here = of_model(assessment, model)
    words = [str(word) for word in here["consequence"].values] if "consequence" in here.coords else []
    if not words:
        return None
    if level is not None:
        here = here.isel(level=level_index(assessment, level))
    said, name, title = (
        (_years, "consequence_rate", "Consequences: mean return period, years")
        if level is None
        else (_percent, "consequence_probability", "Consequences: probability")
    )
    places = [str(place) for place in here["place"].values]
    rows = []
    for word in words:
        one = here.sel(consequence=word)
        # (floors have no interval in the table, which must fit a page)
        whole, *floors = (said(one.sel(place=place), name) for place in places)
        rows.append((consequence_name(word), whole, *(text.partition(" (")[0] for text in floors)))
    return Rows(_dashed(title, rows, "nothing there has it"), ("", *map(place_name, places)), rows)


def ranking_rows(ranking: xr.Dataset, model: str | None = None, most: int = 10) -> Rows:
    """The items whose anchoring saves most, as `anchoring` ranks them, with a mark on those that no advice rests on."""
    here = of_model(ranking, model)
    paid = bool(np.isfinite(here["cost"].values).any())
    scale, unit = objective_unit(ranking)
    saves = f"saves, {unit}" if unit else "saves"
    headings = ["rank", "item", "floor", "pieces", saves, "share", *(["cost"] if paid else [])]
    rows = []
    order = np.argsort(here["rank"].values)
    doubtful, marked = doubtful_items(here), False
    for i in order[: checks.count("most", most, at_least=1)]:
        one = here.isel(item=int(i))
        first, last = int(one["rank_lower"]), int(one["rank_upper"])
        rank = f"{int(one['rank'])}" + (f" ({first}–{last})" if first < last else "")
        share = float(one["saving_share"])
        name = f"{one['item'].item()}{MARK if doubtful[i] else ''}"
        marked = marked or bool(doubtful[i])
        cells = [rank, name, floor_cell(str(one["floor"].item())), str(int(one["count"]))]
        cells += [_interval(one, "saving", scale), "–" if math.isnan(share) else whole_percent(share)]
        if paid:
            cost = float(one["cost"])
            cells.append(short_digits(cost) if math.isfinite(cost) else "–")
        rows.append(tuple(cells))
    common = common_modelling(ranking)
    title = f"What anchoring saves of the {ranking.attrs['objective_text']}{f' ({common})' if common else ''}"
    return Rows(f"{title} ({MARKED})" if marked else title, tuple(headings), rows)


def doubtful_items(ranking: xr.Dataset) -> Flags:
    """Return True for the items of a ranking on whose chance of falling no advice can rest."""
    known = DOUBTFUL in ranking.coords
    return np.asarray(ranking[DOUBTFUL].values if known else np.zeros(ranking.sizes["item"], np.bool_))


def common_modelling(ranking: xr.Dataset) -> str:
    """Return the clause on the modelling uncertainty that a ranking holds for all pieces together; '' for none."""
    held = float(ranking.attrs.get(MODELLING, 0.0)) > 0.0
    yearly = "at_level" not in ranking.attrs and str(ranking.attrs.get("modelling", IN_MEAN)) == IN_MEAN
    return "the modelling uncertainty β_m is taken as common to all pieces" if held and yearly else ""


def span(annual: xr.DataArray) -> tuple[float, str]:
    """Return the years for which an annual amount is written, so that it is no small fraction, and those in words."""
    return (1000.0, "in 1,000 years") if float(annual.max()) < SELDOM else (1.0, "a year")


def drawn_heading(name: str, years: str) -> str:
    """Return the heading of a downtime or of injuries in so many years."""
    return f"{DRAWN[name]} {years}"


def fallen_word(results: xr.Dataset) -> str:
    """Return what pieces have done that fell: overturned, or where any stands near an edge, fallen."""
    return "fallen" if FALLEN in results else "overturned"


def place_name(place: str) -> str:
    """The written name of a place."""
    return floor_name(place.removeprefix("floor ")) if place.startswith("floor ") else place


def of_model(dataset: xr.Dataset, model: str | None) -> xr.Dataset:
    """Return the part of a dataset under one model, the first where none is named."""
    labels = [str(one) for one in dataset["model"].values]
    return dataset.isel(model=labels.index(checks.choice("model", model or labels[0], labels)))


def _dashed(title: str, rows: list[tuple[str, ...]], why: str = "nothing there can fall") -> str:
    """Return a title that explains the dash where the rows hold one."""
    return f"{title} (–: {why})" if any("–" in row for row in rows) else title


def pieces_at(here: xr.Dataset, place: str) -> int:
    """The number of pieces in a place that can overturn."""
    free = ~here["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= here["floor"].values == place.removeprefix("floor ")
    return int(here["count"].values[free].sum())


def objective_unit(ranking: xr.Dataset) -> tuple[float, str]:
    """Return the factor that converts an objective to its display unit, and that unit."""
    units = str(ranking["saving"].attrs["units"])
    if units == DIMENSIONLESS:
        return 1.0, ""
    if units == PER_YEAR:
        return span(ranking["left"])
    return 1.0, units.replace(f" {PER_YEAR}", " per year")


def _interval(one: xr.Dataset, name: str, scale: float = 1.0) -> str:
    value, lower, upper = (scale * float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    if math.isnan(lower) or math.isnan(upper):
        return three_digits(value)
    return value_text(value, lower, upper)


def _quantiles(one: xr.Dataset) -> Iterator[str]:
    """Yield the quantiles of the number of pieces, with the errors of their draws where these are above a tenth."""
    values = one["number_quantile"].values
    errors = one[f"number_quantile{DRAWING}"].values if f"number_quantile{DRAWING}" in one else np.zeros(values.size)
    for value, error in zip(values.tolist(), errors.tolist(), strict=True):
        yield short_digits(value) + (f" ± {short_digits(error)}" if error > TENTH * value else "")


def _percent(one: xr.Dataset, name: str) -> str:
    value, lower, upper = (100.0 * float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    if value == 0.0 and upper > 0.0:
        return f"at most {upper:.0f} %"
    return "–" if upper == 0.0 else f"{value:.0f} % ({lower:.0f}–{upper:.0f})"


def _period(one: xr.Dataset, name: str, unit: str = " years") -> str:
    """The mean number of years between two events of a rate, with its interval."""
    rate, lower, upper = (float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    if rate == 0.0:
        probability = name.replace("_rate", "_probability_upper")
        possible = probability in one and float(one[probability].max()) > 0.0
        return f"{ABOVE}{about_years(most_rate(one))}{unit}" if possible else "–"
    text = f"{three_digits(1.0 / rate)}{unit}"
    return text if math.isnan(lower) else f"{text} ({years_between(upper, lower)})"


def _years(one: xr.Dataset, name: str) -> str:
    return _period(one, name, "")
