"""Tables of a performance assessment: totals per year or at a level, consequences, and bounds without any fall."""

import math

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import about_percent, currency_of, given_percent
from ...fragility.hazard.poisson import probability_in
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.runs.provenance import number_of_motions
from ..buildings.notes import of_a_piece
from ..buildings.recommendations import YEARS, Range
from ..buildings.variables import DOUBTFUL, DRAWING, FALLEN, OF_DRAWS, level_index
from ..inventory.consequences import Consequence
from ..text.words import axis_of, consequence_name, floor_name, level_name, level_text
from .table import Cells, Column, Row, Table, Value, footnote, intervals, range_of

DRAWN = {"downtime": "out of use, days", "injuries": "injured"}
"""Headings of amounts that only some inventories give; of amounts in a year with the `span` of time."""
MARK, MARKED = "‡", "‡ outside the model, or on a support that moves: no ground for advice"
"""Text after the name of a piece whose probability of falling is no basis for advice, with the reason."""
TENTH = 0.1
"""Share of a value above which the error of its draws is written."""
SELDOM = 0.1
"""Amount per year below which it is written for 1,000 years."""
NOT_STATED = "not stated"
"""Cell of an amount that no piece of a place states."""
CANNOT_FALL = "nothing in that place can fall"


def totals(results: xr.Dataset, model: int = 0) -> Table:
    """Return the expected values by place, per year or at the study's level."""
    yearly = "annual_number" in results
    return annual(results, model) if yearly else at_level(results, float(results.attrs["at_level"]), model)


def annual(assessment: xr.Dataset, model: int = 0) -> Table:
    """Return the expected values per year by place."""
    of_law = assessment.isel(model=model)
    if "annual_number" not in of_law:
        raise ValueError("annual values need an assessment with a hazard curve, got one without")
    spans = {name: span(of_law[f"annual_{name}"]) for name in DRAWN if f"annual_{name}" in of_law}
    rows: list[Cells] = []
    for place in of_law["place"].values:
        values = of_law.sel(place=place)
        row: Cells = {
            Column("place"): place_name(str(place)),
            Column("number", f"{fallen_word(of_law)} per year", "amount"): amount(values, "annual_number"),
            Column("loss", "lost per year", "amount", currency_of(of_law)): _stated(values, "annual_loss"),
        }
        for name, (years, words) in spans.items():
            row[Column(name, f"{DRAWN[name]} {words}", "amount")] = _stated(values, f"annual_{name}", 1.0 / years)
        rows.append(row | {Column("any", "anything falls, once in", "years3", "years"): _rate(values, "any_rate")})
    return Table.of("Expected per year", rows, intervals(of_law, rows), dash=CANNOT_FALL)


def at_level(assessment: xr.Dataset, level: float, model: int = 0) -> Table:
    """Return the numbers of fallen pieces and losses at one of the levels, by place."""
    at_its_level = assessment.isel(model=model).isel(level=level_index(assessment, level))
    ends = [f"{given_percent(float(q))}" for q in at_its_level["quantile"].values]
    rows: list[Cells] = []
    drawn = False
    for place in at_its_level["place"].values:
        values = at_its_level.sel(place=place)
        row: Cells = {
            Column("place"): place_name(str(place)),
            Column("pieces", "unanchored pieces", "count"): pieces_at(at_its_level, str(place)),
            Column("number", fallen_word(at_its_level), "amount"): amount(values, "number_mean"),
        }
        errors = values.get(f"number_quantile{DRAWING}", xr.zeros_like(values["number_quantile"])).values.tolist()
        for end, value, error in zip(ends, values["number_quantile"].values.tolist(), errors, strict=True):
            drawn |= error > TENTH * value
            row[Column(end, end, "drawn")] = Range(value, error, math.nan) if error > TENTH * value else value
        row[Column("loss", "lost", "amount", currency_of(at_its_level))] = _stated(values, "loss_mean")
        row |= {Column(name, heading, "amount"): _stated(values, f"{name}_mean") for name, heading in DRAWN.items()}
        rows.append(row | {Column("any", "anything falls", "share"): _chance(values, "any_probability")})
    note = footnote("draws", OF_DRAWS) if drawn else ""
    return Table.of(
        f"Expected {at_the_level(assessment, level)}", rows, intervals(at_its_level), note, dash=CANNOT_FALL
    )


def at_the_level(results: xr.Dataset, level: float) -> str:
    """Return a level with its measure for a title: "at PGA of the ground = 0.3 g"."""
    return f"at {level_name(results)} = {level_text(level, axis_of(results))}"


def consequences(assessment: xr.Dataset, model: int = 0) -> Table:
    """Return the rates of each consequence by place, or its probabilities at the study's level."""
    of_law = assessment.isel(model=model)
    yearly = "annual_number" in of_law
    if not yearly:
        of_law = of_law.isel(level=level_index(assessment, float(assessment.attrs["at_level"])))
    places = [str(place) for place in of_law["place"].values]
    rows: list[Row] = []
    for word in of_law["consequence"].values:
        row: Row = {"name": consequence_name(str(word))}
        for k, place in enumerate(places):
            values = of_law.sel(consequence=word, place=place)
            value = _rate(values, "consequence_rate") if yearly else _chance(values, "consequence_probability")
            # (floors have no interval in the table, which must fit a page)
            row[place] = value.value if value is not None and k > 0 and value.value > 0.0 else value
        rows.append(row)
    columns = [Column(place, place_name(place), "years3" if yearly else "share") for place in places]
    title = "Consequences, return periods in years" if yearly else "Consequences"
    return Table(title, [Column("name"), *columns], rows, [intervals(of_law)], "no piece with this consequence")


def doubtful_items(ranking: xr.Dataset) -> Flags:
    """Return True for the items of a ranking whose probability of falling is no basis for advice."""
    known = DOUBTFUL in ranking.coords
    return np.asarray(ranking[DOUBTFUL].values if known else np.zeros(ranking.sizes["block"], np.bool_))


def span(annual: xr.DataArray) -> tuple[float, str]:
    """Return the years for which an annual amount is written, so that it is no small fraction, and those in words."""
    return (1000.0, "in 1,000 years") if float(annual.max()) < SELDOM else (1.0, "per year")


def fallen_word(results: xr.Dataset) -> str:
    """Return the word for pieces that fell: overturned, or fallen if any piece is near an edge."""
    return "fallen" if FALLEN in results else "overturned"


def place_name(place: str) -> str:
    """The written name of a place."""
    return floor_name(place.removeprefix("floor ")) if place.startswith("floor ") else place


def pieces_at(results: xr.Dataset, place: str) -> int:
    """The number of pieces in a place that can overturn."""
    return int(_free_pieces(results, place).sum())


def _free_pieces(results: xr.Dataset, place: str) -> Array:
    """Return the number of pieces of each item in a place that can overturn."""
    free = ~results["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= results["floor"].values == place.removeprefix("floor ")
    return np.where(free, results["count"].values, 0)


def objective_unit(ranking: xr.Dataset) -> tuple[float, str]:
    """Return the factor that converts an objective to its display unit, and that unit."""
    units = str(ranking["saving"].attrs["units"])
    if units == DIMENSIONLESS:
        return 1.0, ""
    if units == PER_YEAR:
        return span(ranking["left"])
    return 1.0, units.replace(f" {PER_YEAR}", " per year")


def _chance(values: xr.Dataset, name: str) -> Range | None:
    """Return a probability at a level with its interval; None for an impossible event."""
    chance = range_of(values, name)
    return chance if chance.upper > 0.0 else None


def _rate(values: xr.Dataset, name: str) -> Range:
    """Return an annual rate with its interval; without a fall in any motion 0 with the upper end, NaN if impossible."""
    rate = range_of(values, name)
    if rate.value > 0.0:
        return rate
    probability = name.replace("_rate", "_probability_upper")
    possible = probability in values and float(values[probability].max()) > 0.0
    return Range(0.0, math.nan, most_rate(values) if possible else math.nan)


def amount(values: xr.Dataset, name: str, scale: float = 1.0) -> Range:
    """Return a mean amount of a place with its interval, divided by `scale`; 0 with a bound if no run has any of it.

    The bound is the amount of all pieces of the place that can fall, times the largest rate or probability of an event
    in no motion. (The longest downtime of several pieces is at most their sum.)
    """
    mean = range_of(values, name, scale)
    yearly = name.startswith("annual_")
    if mean.value != 0.0 or not (yearly or math.isnan(mean.upper)):
        return mean
    unseen = most_rate(values) if yearly else most_probability(values)
    return Range(0.0, math.nan, unseen * _of_all(values, name) / scale)


def _stated(values: xr.Dataset, name: str, scale: float = 1.0) -> Value:
    """Return an `amount`, or in words that no piece of the place that can fall states it."""
    mean = amount(values, name, scale)
    free = _free_pieces(values, str(values["place"].values)).any()
    return NOT_STATED if mean.value == 0.0 and free and _of_all(values, name) == 0.0 else mean


def _of_all(values: xr.Dataset, name: str) -> float:
    """Return the mean amount if all pieces of a place fall that can."""
    quantity = name.removeprefix("annual_").removesuffix("_mean")
    return float((_free_pieces(values, str(values["place"].values)) * _mean_of_a_piece(values, quantity)).sum())


def _mean_of_a_piece(values: xr.Dataset, quantity: str) -> Array:
    """Return the mean amount of a falling piece of each item."""
    if quantity != "downtime":
        return np.broadcast_to(np.asarray(of_a_piece(values, quantity)), values.sizes["block"])
    given = [values[f"downtime_{name}"].values.tolist() for name in ("median", "dispersion", "distribution")]
    return np.array([Consequence(*of).mean if of[0] > 0.0 else 0.0 for of in zip(*given, strict=True)])


def most_probability(results: xr.Dataset) -> float:
    """Return the largest probability of an event in no motion: the upper end of Wilson's interval for 0 of n."""
    trials = np.array([number_of_motions(results)])
    return float(wilson_interval(np.zeros(1, np.int64), trials, float(results.attrs["confidence"]))[1][0])


def most_rate(results: xr.Dataset) -> float:
    """Return the largest unseen annual rate: rates of levels times `most_probability`, and all above the last."""
    probability = most_probability(results)
    above = float(results["level_weight_above"])
    return probability * (float(results["level_weight"].sum()) - above) + above


def bound_of(results: xr.Dataset) -> float:
    """Return the largest probability of an event in no motion, in `YEARS` or at the study's level."""
    if "level_weight" in results:
        return float(probability_in(np.float64(most_rate(results)), YEARS))
    return most_probability(results)


def at_most(results: xr.Dataset) -> str:
    """Return the bound of the probability of an event in no motion, in words."""
    return f"at most {about_percent(bound_of(results))}"
