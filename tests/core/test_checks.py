"""Foreign types of labelled data: refused at every entrance, before they become numbers or tracebacks."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import toppling as tp
from toppling import fragility, motions
from toppling.core import checks
from toppling.models import BlockArray

SHELF = {"block": ["shelf", "rack"]}
RUNS = xr.Dataset(
    {
        "overturned": (("block", "model", "level", "motion"), np.ones((2, 1, 2, 3))),
        "direction": (("block", "model", "level", "motion"), np.ones((2, 1, 2, 3))),
    },
    {"level": [1.0, 2.0], "alpha": ("block", [0.2, 0.3], {"units": "rad"}), "motion": ["a", "b", "c"], **SHELF},
)
COUNTS = xr.Dataset(
    {"overturnings": (("block", "level"), [[1, 3], [0, 2]]), "runs": ("level", [4, 4])},
    {"level": ("level", [1.0, 2.0], {"units": "m s-2"}), **SHELF},
)
CURVES = xr.Dataset(
    {
        name: ("block", [value, value], {"units": unit})
        for name, value, unit in (
            ("median", 2.0, "m s-2"),
            ("median_lower", 1.6, "m s-2"),
            ("median_upper", 2.4, "m s-2"),
            ("dispersion", 0.5, "1"),
        )
    },
    {"alpha": ("block", [0.1, 0.3], {"units": "rad"}), **SHELF},
    {"im": "pga"},
)
RATES = CURVES.assign(rate=("block", [1e-2, 1e-4], {"units": "year-1"}))
SHAKING = motions.from_array([[0.0, 1.0, 0.0], [0.0, 2.0, 0.0]], 0.01)
HAZARD = fragility.HazardCurve.power_law(1e-3, 2.0, im="pga")
ENTRANCES = {
    "overturning_probability": (RUNS, "overturned", tp.overturning_probability),
    "reached": (RUNS, "direction", lambda runs: fragility.reached(runs, "front")),
    "overturning_capacity": (RUNS, "overturned", fragility.overturning_capacity),
    "rank_measures": (RUNS, "alpha", fragility.rank_measures),
    "screen": (RUNS, "alpha", fragility.screen),
    "fit_fragility": (COUNTS, "overturnings", tp.fit_fragility),
    "curve_probability": (CURVES, "median", lambda curves: fragility.curve_probability(curves, [1.0])),
    "annual_rate": (CURVES, "dispersion", lambda curves: tp.annual_rate(curves, HAZARD)),
    "median_ratio": (CURVES, "median_upper", lambda curves: fragility.median_ratio(curves, CURVES)),
    "published medians": (CURVES, "median", lambda curves: fragility.median_ratio(CURVES, curves)),
    "write_curve_csv": (CURVES, "median_lower", lambda curves: fragility.write_curve_csv(curves, "never.csv")),
    "size_for_rate": (RATES, "rate", lambda rates: fragility.size_for_rate(rates, rate=1e-3)),
    "plot": (CURVES, "median", tp.plot.fragility),
    "measures": (SHAKING, "dt", motions.measures),
    "highpass": (SHAKING, "acceleration", lambda array: motions.highpass(array, 1.0)),
}
FOREIGN = {
    "times": lambda values: np.ones(values.shape, "timedelta64[ns]"),
    "half precision": lambda values: values.astype(np.float16),
    "extended precision": lambda values: values.astype(np.longdouble),
    "complex": lambda values: values.astype(complex),
    "objects": lambda values: values.astype(object),
    "bytes": lambda values: values.astype("S"),
    "text": lambda values: values.astype(str),
}


def changed(data, name, values):
    if name == getattr(data, "name", None):
        return data.copy(data=values)
    variable = data[name].variable.copy(data=values)
    return data.assign_coords({name: variable}) if name in data.coords else data.assign({name: variable})


@pytest.mark.parametrize(
    "function",
    [
        lambda value: motions.from_array([[0.0, 1.0, 0.0], [0.0, 2.0, 0.0]], 0.01, labels=value),
        lambda value: motions.from_array([[0.0, 1.0, 0.0], [0.0, 2.0, 0.0]], 0.01, source=value),
        lambda value: motions.measures(SHAKING, value),
        lambda value: motions.Building.flexural_shear(0.5, damping=0.05, storeys=3).floor_motions(value),
        motions.AvgSa,
        lambda value: motions.Target(value, [1.0], [0.5]),
        lambda value: tp.adaptive_ida(tp.Block(0.4, 1.8), value, SHAKING),
        lambda value: fragility.rank_measures(RUNS, SHAKING, also=value),
        lambda value: fragility.write_nrml(CURVES, "never.xml", ids=value),
    ],
)
@pytest.mark.parametrize("value", [np.array("pga"), np.array(None), xr.DataArray(1.0)])
def test_arrays_without_dimensions_are_no_sequences(function, value):
    with pytest.raises((TypeError, ValueError), match=r"^(?!iteration over)"):
        function(value)


@pytest.mark.parametrize("kind", FOREIGN)
@pytest.mark.parametrize("entrance", ENTRANCES)
def test_every_entrance_refuses_foreign_types(entrance, kind):
    data, name, function = ENTRANCES[entrance]
    wrong = changed(data, name, FOREIGN[kind]((data if name == getattr(data, "name", None) else data[name]).values))
    allowed = "numbers" if kind == "text" else "flags, numbers of 32 or 64 bits, or text,"
    with pytest.raises(TypeError, match=rf"^{name} of .* must be {allowed}"):
        function(wrong)


@pytest.mark.parametrize(
    "values",
    [
        np.array(["a", "b", "c"]),
        np.array(["a", None, np.nan], dtype=object),
        np.array(["roof", 1, 2], dtype=object),
        np.array(["2011-03-11", "2016-08-24", "2016-10-30"], "datetime64[ns]"),
        np.array([1, 2, 3], ">i4"),
        np.array([1.0, 2.0, 3.0], np.float32),
        np.array([True, False, True]),
    ],
    ids=["text", "gaps", "floors", "dates", "big-endian", "float32", "flags"],
)
def test_what_a_coordinate_may_be(values):
    checks.plain("runs", RUNS.assign_coords(station=("motion", values)))


@pytest.mark.parametrize(
    "values",
    [
        np.array([1, 2], "m8[s]"),
        np.array([1, 2], "M8[s]"),
        np.array([1, 2j]),
        np.array(["1", "2"]),
        b"12",
        [[1.0], [2, 3]],
    ],
    ids=["times", "dates", "complex", "text", "bytes", "ragged"],
)
@pytest.mark.parametrize(
    "function",
    [
        lambda values: fragility.wilson_interval(values, 100),
        lambda values: fragility.probability_in(values, 50),
        lambda values: fragility.rate_from_probability(values, 50),
        HAZARD.rate_at,
        lambda values: BlockArray(values, [1.8, 1.8]),
        motions.AvgSa,
    ],
    ids=["wilson_interval", "probability_in", "rate_from_probability", "rate_at", "BlockArray", "AvgSa"],
)
def test_numbers_of_other_types_are_refused(function, values):
    with pytest.raises(TypeError, match=r"must be (a number|a sequence|real numbers|numbers or arrays)"):
        function(values)


def test_columns_of_a_table_are_numbers():
    rates = pd.Series([0.01, 0.1], index=["a", "b"])
    np.testing.assert_allclose(fragility.rate_from_probability(fragility.probability_in(rates)), rates)


def test_refused(refusal):
    refusal()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([0.0, 1.0], "levels must be > 0, got 0 g"),
        ([-1.0], "levels must be > 0, got -1 g"),
        ([np.nan], "levels must be > 0, got nan g"),
        ([1.0, 1.0], "levels must be strictly increasing, got 1 g after 1 g"),
        ([1.0, 2.0, 0.5], "levels must be strictly increasing, got 0.5 g after 2 g"),
    ],
)
def test_increasing(values, message):
    for right in ([], [0.1], [1e-9, 1e9], [1, 2, 3], np.array([0.5, 0.6])):
        checks.increasing("levels", right, "g")
    with pytest.raises(ValueError, match=f"^{message}$"):
        checks.increasing("levels", values, "g")
