"""Medians above the strongest shaking that was run: not reached in every table and sentence, kept where curves are."""

import warnings

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of, facts_of
from study_texts import blocks, laws, motions, study_of

import toppling as tp
from toppling.core.facts import UNKNOWN
from toppling.studies.facts import answer_curves as curves
from toppling.studies.tables.blocks import lead_blocks, short_blocks
from toppling.studies.tables.registry import tables
from toppling.studies.tables.table import Column, dispersion_of
from toppling.studies.text.block_order import places
from toppling.studies.text.reached import highest_level, open_ends, within_levels
from toppling.studies.text.words import level_name, measure_at, measure_name

REST = """
[ida]
im = "pga"
levels = { from = 0.1, to = 0.7, number = 7, unit = "g" }
[fit]
replicates = 200
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The shelf falls within the levels; the chest's curve is set above them, as a fit extrapolates it."""
    parts = blocks(shelf=0.4, chest=0.9), laws("housner"), motions(20), REST
    found = study_of(tmp_path_factory.mktemp("reached"), *parts).run().copy(deep=True)
    chest = {"block": 1, "model": 0}
    top = float(found["level"].max())
    half = {"half_level": np.inf, "half_level_lower": top, "half_level_upper": np.inf}
    for name, value in {"median": 14.7, "median_lower": 7.5, "median_upper": 400.0, "dispersion": 0.6, **half}.items():
        found[name][chest] = value
    found["status"] = found["status"].astype(object)
    found["status"][chest], found["converged"][chest] = "ok", True
    return found


@pytest.mark.parametrize(
    ("ends", "shown"),
    [
        ((0.8, 5.0), (0.8, 5.0)),
        ((0.02, 5.0), (-np.inf, 5.0)),
        ((0.8, 7.6e17), (0.8, np.inf)),
        ((0.0, np.inf), (-np.inf, np.inf)),
    ],
)
def test_ends_beyond_what_was_run_are_open(ends, shown):
    """The runs of a cloud reached 0.1 to 7 m/s2."""
    cloud = xr.Dataset(coords={"intensity": ("motion", [0.1, 2.0, 7.0])})
    assert open_ends(*ends, cloud) == shown


def test_flat_curves(results):
    flat = results.isel(block=0, model=0).copy(deep=True)
    write = Column("", format="dispersion").text
    assert write(dispersion_of(flat)).startswith(f"{flat['dispersion'].item():.3f} (")
    flat["dispersion"][()], flat["dispersion_upper"][()] = 4.57e15, 7.6e17
    assert write(dispersion_of(flat)).startswith("above 10 (")
    flat["dispersion"][()], flat["dispersion_lower"][()] = 0.5, 0.2
    assert write(dispersion_of(flat)) == "0.500 (above 0.200)"
    flat["dispersion_lower"][()], flat["dispersion_upper"][()] = 6.4e-17, 1.57
    assert write(dispersion_of(flat)) == "0.500 (below 1.57)"  # (a step is no dispersion of 6e-17)


class TestWithinLevels:
    def test_of_samples(self):
        """Fitted medians of samples above the levels are not reached; the level itself is, but for rounding."""
        medians = [2.0, 2.0 * (1.0 + 1e-12), 2.001, np.nan]
        found = xr.Dataset({"sample_median": ("sample", medians, {"units": "m s-2"})}, {"level": [1.0, 2.0]})
        now = within_levels(found)
        assert np.isinf(now["sample_median"].values).tolist() == [False, False, True, False]
        assert now["sample_median"].attrs == {"units": "m s-2"}
        xr.testing.assert_identical(now, within_levels(now))
        assert found["sample_median"].values[2] == 2.001  # (what is given is not changed)

    def test_of_a_cloud_and_of_curves_without_levels(self):
        curves = xr.Dataset({"sample_median": ("sample", [2.0, 5.0])})
        assert highest_level(curves) == np.inf
        assert within_levels(curves) is curves
        cloud = curves.assign_coords(intensity=("motion", [0.5, 3.0]))
        assert within_levels(cloud)["sample_median"].values.tolist() == [2.0, np.inf]

    def test_of_ratios(self):
        """A ratio of what is not reached is infinite; one to what is not reached says nothing."""
        ratio = xr.DataArray([[2.0, 0.5], [4.0, 0.5]], dims=("block", "comparison"))
        found = xr.Dataset({"median": ("block", [2.0, 5.0]), "median_ratio": ratio}, {"level": [1.0, 3.0]})
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            now = within_levels(found)["median_ratio"].values
        # (the references are at 1 and 4, and at 1.25 and 10)
        np.testing.assert_array_equal(now, [[2.0, np.nan], [np.inf, np.nan]])


class TestWhereItIsRead:
    def test_tables(self, results):
        assert lead_blocks(results).texts("level")[1].endswith("(above 0.70)")
        (table,) = (table for table in tables(results) if table.title == "Fragility curves")
        assert [text.startswith("not reached") for text in table.texts("level")] == [False, True]

    def test_where_nothing_is_reached(self, results):
        chest = results.isel(block=[1])
        facts, last = facts_of(curves.answer, chest), chest.isel(block=0, model=0, level=-1)
        assert (facts["curve.unknown"].value, facts["curve.unknown"].more["cases"]) == (1, 1)
        end = facts["curve.at_end"]
        assert (end.value, end.level, end.unit) == (float(last["probability"]), pytest.approx(0.7), "g")
        assert (end.lower, end.upper, end.more["end"]) == (float(last["lower"]), float(last["upper"]), "strongest")
        assert "curve.half_level" not in facts
        assert facts_of(curves.answer, results)["curve.half_level"].names == ("“shelf”",)

    def test_widths_of_intervals(self, results):
        """What is not reached has no interval whose width could be judged."""
        assert check_of(results, "intervals").names[0] == "shelf"
        alone = check_of(results.isel(block=[1]), "intervals")
        assert (alone.what, alone.word) == ("curve.half_not_reached", UNKNOWN)

    def test_order(self, results):
        lower = results.copy(deep=True)
        lower["half_level"][:, 0] = [6.8, np.inf]
        assert places(lower).values.ravel().tolist() == [0, 1]

    def test_the_curve_ends_at_the_highest_level(self, results):
        ax = tp.plot.fragility(results, block="chest")
        line = max(ax.lines, key=lambda one: one.get_xdata().size)
        assert line.get_xdata().max() == pytest.approx(0.7, rel=1e-12)
        assert ax.get_xlim()[1] > 0.71


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("Sa(0.5)", "Sa(0.5 s)"),
        ("Sa(1.0, 0.02)", "Sa(1 s, 2 % damping)"),
        ("RotD50(Sa(0.5))", "RotD50(Sa(0.5 s))"),
        ("AvgSa(0.2:2.0:10, 0.02)", "AvgSa(0.2–2 s, 10 periods, 2 % damping)"),
        ("FIV3(1.0)", "FIV3(1 s)"),
        ("pgv", "PGV"),
    ],
)
def test_periods_have_their_unit(label, name):
    assert measure_name(label) == name


VELOCITY, SPECTRAL = "peak {} velocity", "spectral acceleration at 0.5 s, 5 % damping, {} motion"


@pytest.mark.parametrize(
    ("label", "long_name", "floors", "name"),
    [
        ("pgv", VELOCITY.format("ground"), ["", ""], "PGV of the ground"),
        ("pgv", VELOCITY.format("ground"), ["3", "3"], "PGV of the ground"),
        ("pgv", VELOCITY.format("floor"), ["3", "3"], "PGV of floor 3"),
        ("pgv", VELOCITY.format("floor"), ["2", "3"], "PGV of the floor"),
        ("Sa(0.5)", SPECTRAL.format("ground"), None, "Sa(0.5 s) of the ground"),
        ("Sa(0.5)", SPECTRAL.format("floor"), None, "Sa(0.5 s) of the floor"),
        ("Sa(0.5)", "spectral acceleration at 0.5 s, 5 % damping", None, "Sa(0.5 s)"),
        ("scale", "scale factor", ["3", "3"], "scale factor"),
        ("", "", None, "level"),
    ],
)
def test_levels_are_of_the_ground_or_of_a_floor(label, long_name, floors, name):
    """`floors` are those of the motions; what an earlier version wrote may say no place."""
    found = xr.Dataset(coords={"level": ("level", [1.0], {"im": label, "long_name": long_name})})
    if floors is not None:
        found = found.assign_coords(motion_floor=("motion", floors))
    assert level_name(found) == name
    without = xr.Dataset({"median": ((), 1.0, {"long_name": f"median of the fragility curve: {long_name}"})})
    assert level_name(without.assign_attrs(im=label)) == measure_at(label or "level", long_name)


def test_tables_and_figures_say_of_what(results):
    for table in (short_blocks(results), lead_blocks(results)):
        assert table.columns[1].heading.endswith("the ground, g")
    curves = results[["median", "dispersion", "status", "converged"]].drop_vars("level", errors="ignore")
    assert tp.plot.fragility(curves.assign_attrs(im="pga"), block="shelf").get_xlabel().endswith("the ground (g)")
