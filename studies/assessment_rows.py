"""Rows of text that say what a performance assessment found: for a terminal or a report."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from .. import checks
from ..units import DIMENSIONLESS
from .distributions import PER_YEAR, level_index
from .rows import Rows
from .words import display_unit, floor_name, interval_text, three, years_between


def annual_rows(assessment: xr.Dataset, model: str | None = None) -> Rows:
    """What is expected in a year, by place.

    Raises
    ------
    ValueError
        An assessment without a hazard curve, no such model.
    """
    here = of_model(assessment, model)
    if "annual_number" not in here:
        raise ValueError("annual values need an assessment with a hazard curve, got one without")
    has_loss = "annual_loss" in here
    headings = [
        "",
        "free pieces",
        "overturned a year",
        *(["lost a year"] if has_loss else []),
        "anything falls, once in",
    ]
    rows = []
    for place in here["place"].values:
        one = here.sel(place=place)
        cells = [place_name(str(place)), str(pieces_at(here, str(place))), _interval(one, "annual_number")]
        if has_loss:
            cells.append(_interval(one, "annual_loss"))
        cells.append(_period(one, "any_rate"))
        rows.append(tuple(cells))
    money = _money(here)
    title = f"In a year{f', {money}' if money and has_loss else ''} ({_sure(here)} over motions, hazard as given)"
    return Rows(_dashed(title, rows), tuple(headings), rows)


def level_rows(assessment: xr.Dataset, level: float, model: str | None = None) -> Rows:
    """What overturns at one of the levels, by place.

    Raises
    ------
    ValueError
        No such level or model.
    """
    at = level_index(assessment, level)
    here = of_model(assessment, model).isel(level=at)
    has_loss = "loss_mean" in here
    ends = [f"{100.0 * float(q):g} %" for q in here["quantile"].values]
    headings = [
        "",
        "free pieces",
        "overturned",
        f"{' / '.join(ends)}",
        *(["lost"] if has_loss else []),
        "anything falls",
    ]
    rows = []
    for place in here["place"].values:
        one = here.sel(place=place)
        quantiles = " / ".join(figure_text(float(value)) for value in one["number_quantile"].values)
        cells = [place_name(str(place)), str(pieces_at(here, str(place))), _interval(one, "number_mean"), quantiles]
        if has_loss:
            cells.append(_interval(one, "loss_mean"))
        cells.append(_percent(one, "any_probability"))
        rows.append(tuple(cells))
    scale, unit = display_unit(assessment["level"])
    shaken = f"{assessment.attrs['im']} = {float(here['level']) / scale:.3g}{f' {unit}' if unit else ''}"
    money = _money(here)
    title = f"At {shaken}{f', {money}' if money and has_loss else ''} ({_sure(here)} over motions)"
    return Rows(_dashed(title, rows), tuple(headings), rows)


def consequence_rows(assessment: xr.Dataset, level: float | None = None, model: str | None = None) -> Rows | None:
    """How often each consequence comes about, by place: in a year, or given a level; None where nothing has one."""
    here = of_model(assessment, model)
    words = _words(here)
    if not words:
        return None
    if level is not None:
        here = here.isel(level=level_index(assessment, level))
    said, name, title = (
        (_years, "consequence_rate", "What it means: once in so many years")
        if level is None
        else (_percent, "consequence_probability", "What it means: probability")
    )
    places = [str(place) for place in here["place"].values]
    rows = []
    for word in words:
        one = here.sel(consequence=word)
        # (of floors without the interval: a table must fit a page)
        whole, *floors = (said(one.sel(place=place), name) for place in places)
        rows.append((word, whole, *(text.partition(" (")[0] for text in floors)))
    return Rows(_dashed(title, rows), ("", *map(place_name, places)), rows)


def ranking_rows(ranking: xr.Dataset, model: str | None = None, most: int = 10) -> Rows:
    """The items that save most, as `anchoring` ranks them.

    Raises
    ------
    ValueError
        No such model.
    """
    here = of_model(ranking, model)
    paid = bool(np.isfinite(here["cost"].values).any())
    scale, unit = objective_unit(ranking)
    saves = f"saves, {unit}" if unit else "saves"
    headings = ["rank", "item", "floor", "pieces", saves, "share", *(["cost"] if paid else [])]
    pays = "payback" in here and paid
    headings += ["pays back in"] if pays else []
    rows = []
    order = np.argsort(here["rank"].values)
    for i in order[: checks.count("most", most, at_least=1)]:
        one = here.isel(item=int(i))
        first, last = int(one["rank_lower"]), int(one["rank_upper"])
        rank = f"{int(one['rank'])}" + (f" ({first}–{last})" if first < last else "")
        share = float(one["saving_share"])
        cells = [rank, str(one["item"].item()), str(one["floor"].item()), str(int(one["count"]))]
        cells += [_interval(one, "saving", scale), "–" if math.isnan(share) else f"{100.0 * share:.0f} %"]
        if paid:
            cells.append(figure_text(float(one["cost"])))
        if pays:
            years = float(one["payback"])
            cells.append(f"{three(years)} years" if math.isfinite(years) else "never")
        rows.append(tuple(cells))
    return Rows(f"Anchoring saves of: {ranking.attrs['objective_text']}", tuple(headings), rows)


def place_name(place: str) -> str:
    """A place as people say it."""
    return floor_name(place.removeprefix("floor ")) if place.startswith("floor ") else place


def of_model(dataset: xr.Dataset, model: str | None) -> xr.Dataset:
    """One model of a dataset, the first where none is said."""
    labels = [str(one) for one in dataset["model"].values]
    return dataset.isel(model=labels.index(checks.choice("model", model or labels[0], labels)))


def _words(here: xr.Dataset) -> list[str]:
    return [str(word) for word in here["consequence"].values] if "consequence" in here.coords else []


def _money(here: xr.Dataset) -> str:
    return str(here.attrs.get("currency", ""))


def _dashed(title: str, rows: list[tuple[str, ...]]) -> str:
    """A title that says what a dash in the rows means."""
    return f"{title} (–: nothing fell under any motion)" if any("–" in row for row in rows) else title


def _sure(here: xr.Dataset) -> str:
    return f"{100.0 * float(here.attrs['confidence']):g} %"


def pieces_at(here: xr.Dataset, place: str) -> int:
    """Number of pieces that can overturn."""
    free = ~here["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= here["floor"].values == place.removeprefix("floor ")
    return int(here["count"].values[free].sum())


def objective_unit(ranking: xr.Dataset) -> tuple[float, str]:
    """What to multiply an objective by for people, and its unit."""
    units = str(ranking["saving"].attrs["units"])
    if units == DIMENSIONLESS:
        return 1.0, ""
    if units == PER_YEAR:
        return (1000.0, "in 1000 years") if float(ranking["left"].max()) < 0.1 else (1.0, "a year")
    return 1.0, units.replace(f" {PER_YEAR}", " a year")


def _interval(one: xr.Dataset, name: str, scale: float = 1.0) -> str:
    value, lower, upper = (scale * float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    if math.isnan(lower) or math.isnan(upper):
        return three(value)
    return f"{three(value)} ({interval_text(lower, upper)})"


def _percent(one: xr.Dataset, name: str) -> str:
    value, lower, upper = (100.0 * float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    return "–" if upper == 0.0 else f"{value:.0f} % ({lower:.0f}–{upper:.0f})"


def _period(one: xr.Dataset, name: str, unit: str = " years") -> str:
    """A rate as the years between two events."""
    rate, lower, upper = (float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    if rate == 0.0:
        return "–"
    text = f"{three(1.0 / rate)}{unit}"
    return text if math.isnan(lower) else f"{text} ({years_between(upper, lower)})"


def _years(one: xr.Dataset, name: str) -> str:
    return _period(one, name, "")


def figure_text(value: float) -> str:
    """Three figures, no exponent where people do without."""
    if value == 0.0:
        return "0"
    if abs(value) >= 1e9 or abs(value) < 1e-4:
        return f"{value:.2e}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    rounded = round(value, 2 - math.floor(math.log10(abs(value))))
    return f"{rounded:,.{digits}f}".rstrip("0").rstrip(".") if digits else f"{rounded:,.0f}"
