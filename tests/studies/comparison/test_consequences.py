"""Losses, downtimes and injuries of two buildings, held to both result files and to brute force; what is left out."""

import numpy as np
import pytest
import xarray as xr
from study_texts import motions

import toppling as tp
from toppling.studies.comparison import pieces, sides
from toppling.studies.comparison.compare import compare

BUILDING = """
title = "{title}"
[[models]]
law = "housner"
[performance]
inventory = "{inventory}.csv"
im = "pga"
levels = {{ values = [1.5, 3.0, 5.0, 9.0], unit = "m/s2" }}
replicates = 200
{more}
"""
HAZARD = '[hazard]\nk0 = 2e-3\nk = 2.5\nunit = "m/s2"\n'
AT_LEVEL = "at_level = 5.0\n"
HEAD = (
    "item,width_m,height_m,floor,count,currency,cost_median,cost_dispersion,downtime_median_days,downtime_dispersion,"
    "persons_exposed,injury_probability,value\n"
)
RACK = "rack,{width},2.0,0,2,{currency},9000,0.4,12,0.5,0.5,0.2,\n"
SHELF = "shelf,0.35,1.7,0,4,{currency},400,0.6,2,0.3,,,\n"
PLAIN = "rack,0.5,2.0,0,2,EUR,,,,,,,9000\n"
STUDIES = {
    "narrow": ("narrow", HAZARD),
    "wide": ("wide", HAZARD),
    "plain": ("plain", HAZARD),
    "dollars": ("dollars", HAZARD),
    "narrow-level": ("narrow", AT_LEVEL),
    "wide-level": ("wide", AT_LEVEL),
}


def left_out(found):
    return [(fact.what, *fact.names) for fact in found.notes if fact.what.startswith("comparison.no_")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with small finished studies, by name."""
    here = tmp_path_factory.mktemp("consequences")
    for name, width, currency in (("narrow", 0.5, "EUR"), ("wide", 0.6, "EUR"), ("dollars", 0.5, "USD")):
        text = HEAD + RACK.format(width=width, currency=currency) + SHELF.format(currency=currency)
        (here / f"{name}.csv").write_text(text, encoding="utf-8")
    (here / "plain.csv").write_text(HEAD + PLAIN, encoding="utf-8")
    for name, (inventory, more) in STUDIES.items():
        text = BUILDING.format(title=name, inventory=inventory, more=more + motions(16))
        (here / f"{name}.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(here / f"{name}.toml").run(here / name)
    return here


def found_in(folder, first, second):
    with sides.two_sides(folder / first, folder / second) as (a, b):
        return pieces.compare_pieces(a, b)


def drawn(replicates, motions):
    """How often each motion is drawn: replicate r from SeedSequence(0, spawn_key=(r,))."""
    found = []
    for r in range(replicates):
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(0, spawn_key=(r,))))
        found.append(np.bincount(rng.integers(0, motions, motions), minlength=motions))
    return np.array(found) / motions


@pytest.mark.slow
@pytest.mark.parametrize(("quantity", "name"), [("loss", "loss"), ("downtime", "downtime"), ("injuries", "injuries")])
def test_in_a_year(folder, quantity, name):
    """Values are those of the files; intervals are of motions drawn again, the same for both sides."""
    (line,) = [one for one in found_in(folder, "narrow", "wide").lines if one.quantity == quantity]
    samples, values = [], []
    for study in ("narrow", "wide"):
        results = xr.open_dataset(folder / study / "results.nc").isel(model=0)
        values.append(float(results[f"annual_{name}"].sel(place="building")))
        if quantity == "downtime":
            given = results["downtime"].sel(place="building").mean("realisation")
            # (the mean at each level is no mean of draws)
            given = (given * results["downtime_mean"].sel(place="building") / given.mean("motion")).fillna(0.0)
        else:
            mean = {
                "loss": results["value"],
                "injuries": (results["persons_exposed"] * results["injury_probability"]).fillna(0.0),
            }[quantity]
            given = (results["overturned"] * results["count"] * mean).sum("block")
        of_motion = (given * results["level_weight"]).sum("level").values
        assert of_motion.mean() == pytest.approx(values[-1], rel=1e-9)
        samples.append(drawn(200, 16) @ of_motion)
    assert (line.a.value, line.b.value) == pytest.approx(values, rel=1e-12)
    assert line.ratio.value == pytest.approx(values[1] / values[0], rel=1e-12)
    ratio = np.sort(samples[1] / samples[0])
    assert (line.ratio.lower, line.ratio.upper) == pytest.approx((ratio[4], ratio[-5]), rel=1e-9)
    assert line.verdict == "lower"


@pytest.mark.parametrize("name", ["loss", "downtime", "injuries"])
def test_at_a_level(folder, name):
    found = found_in(folder, "narrow-level", "wide-level")
    (line,) = [one for one in found.lines if one.quantity == name]
    values = []
    for study in ("narrow-level", "wide-level"):
        results = xr.open_dataset(folder / study / "results.nc").isel(model=0).sel(place="building")
        values.append(float(results[f"{name}_mean"].sel(level=results.attrs["at_level"], method="nearest")))
    assert (line.a.value, line.b.value) == pytest.approx(values, rel=1e-12)
    (quantity,) = [one for one in found.quantities if one.name == name]
    assert quantity.stored == {"loss": "EUR", "downtime": "day", "injuries": "1"}[name]


@pytest.mark.slow
def test_what_is_printed(folder, tmp_path):
    found = compare(folder / "narrow", folder / "wide", tmp_path)
    (whole,) = [table for table in found.tables if table.title == "The whole building"]
    named = whole.column("name")
    assert "Expected downtime (days per year)" in named
    assert "Injured persons expected (in 1,000 years)" in named
    assert {"number", "loss", "downtime", "injuries", "any"} < {name for fact in found.answer for name in fact.names}
    assert [fact.names for fact in found.notes if fact.what == "precision.coverage"] == [("ratio of totals",)]
    assert left_out(found) == []


@pytest.mark.slow
def test_what_only_one_side_has(folder, tmp_path):
    found = compare(folder / "narrow", folder / "plain", tmp_path)
    assert left_out(found) == [("comparison.no_amount", name, "A") for name in ("downtime", "injuries")]


@pytest.mark.slow
def test_losses_in_two_currencies(folder, tmp_path):
    found = compare(folder / "narrow", folder / "dollars", tmp_path)
    assert left_out(found) == [("comparison.no_losses",)]
    assert not any(name.startswith("Expected loss") for table in found.tables for name in table.column("name"))
    assert any(name.startswith("Expected downtime") for table in found.tables for name in table.column("name"))
    prices = [fact.names for fact in found.inputs if fact.more.get("of") == "rack"]
    assert ("cost_median", "9000 EUR", "9000 USD") in prices
    assert not any("nan" in text for names in prices for text in names)
