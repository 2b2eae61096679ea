"""Tables of runs: every row is the run that it names, and what follows takes the runs."""

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.fragility import run_table, screen
from toppling.fragility.analyses import waves

SHAKES = tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(6, seed=2)
BLOCKS = [tp.Block(0.4, 1.6, name="narrow", depth=0.5), tp.Block(0.6, 1.8, name="wide", depth=0.7)]
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
LEVELS = [1.5, 2.5, 3.5, 5.0]
OUTPUTS = ["overturned", "peak_rotation", "impacts"]


def grid(levels=LEVELS):
    """Columns of every block, law and motion at every level."""
    places = np.indices((2, 2, 6, len(levels))).reshape(4, -1)
    return dict(zip(("block", "model", "motion"), places[:3], strict=True)) | {"level": np.array(levels)[places[3]]}


@pytest.fixture(scope="module")
def dense():
    return tp.ida(BLOCKS, LAWS, SHAKES, LEVELS, outputs=OUTPUTS)


@pytest.fixture(scope="module")
def found():
    return run_table(BLOCKS, LAWS, SHAKES, grid(), outputs=OUTPUTS)


@pytest.mark.lowest
def test_common_levels_have_the_bits_of_ida(dense, found):
    for name in (*OUTPUTS, "verdict", "friction_rocking_demand", "friction_uplift_demand"):
        values = dense[name].transpose("block", "model", "motion", "level", missing_dims="ignore")
        on_runs = values.broadcast_like(dense["overturned"].transpose("block", "model", "motion", "level"))
        assert np.array_equal(
            found[name].values, on_runs.transpose(*("block", "model", "motion", "level")).values.ravel()
        )
    for name in ("outside", "squat", "band_low", "elastic_frequency"):
        xr.testing.assert_equal(found[name].variable, dense[name].variable)


def test_rows_in_any_order_and_number(dense):
    """Runs of a table that is shuffled, repeated in part and cut in part stand where their rows do."""
    columns = grid()
    rows = np.random.default_rng(1).permutation(np.append(np.arange(70), [3, 3, 40]))
    table = {name: values[rows] for name, values in columns.items()}
    runs = run_table(BLOCKS, LAWS, SHAKES, table, outputs=OUTPUTS, screen=False)
    places = [table["block"], table["model"], [LEVELS.index(level) for level in table["level"]], table["motion"]]
    for name in OUTPUTS:
        assert np.array_equal(
            runs[name], dense[name].transpose("block", "model", "level", "motion").values[tuple(places)]
        )


def test_many_numbers_of_runs(dense, monkeypatch):
    """Grids that lack runs, or repeat them, give the results of each run by itself."""
    rows = np.random.default_rng(2).integers(0, 96, 200)
    table = {name: values[rows] for name, values in grid().items()}
    alone = run_table(BLOCKS, LAWS, SHAKES, table, outputs=OUTPUTS, screen=False)
    monkeypatch.setattr(waves, "MOST_GRIDS", 10**9)
    again = run_table(BLOCKS, LAWS, SHAKES, table, outputs=OUTPUTS, screen=False)
    xr.testing.assert_identical(alone, again)


def test_labels_and_measures_of_the_block():
    columns = grid([1.2, 2.4])
    named = {
        "block": np.array(["narrow", "wide"])[columns["block"]],
        "model": np.array([law.label for law in LAWS])[columns["model"]],
        "motion": SHAKES["motion"].values[columns["motion"]],
        "level": columns["level"],
    }
    runs = run_table(BLOCKS, LAWS, SHAKES, named, "pga_normalised", "peak_rotation")
    same = tp.ida(BLOCKS, LAWS, SHAKES, [1.2, 2.4], "pga_normalised", "peak_rotation")
    assert np.array_equal(
        runs["peak_rotation"], same["peak_rotation"].transpose("block", "model", "motion", "level").values.ravel()
    )
    factors = same["scale_factor"].transpose("block", "motion", "level").values
    assert np.array_equal(runs["scale_factor"].values.reshape(2, 2, 6, 2)[:, 0], factors)


def test_pairs_and_sliding():
    (pairs,) = tp.motions.both_axes(tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample_pairs(3))
    table = {"motion": [0, 1, 2, 0], "level": [2.0, 3.0, 4.0, 5.0]}
    for law, output in ((LAWS[0], "overturned"), (tp.Sliding(0.1), "slide_peak")):
        runs = run_table(BLOCKS[0], law, pairs, table, "RotD50(pga)", output)
        for i, (motion, level) in enumerate(zip(table["motion"], table["level"], strict=True)):
            alone = tp.ida(BLOCKS[0], law, pairs.isel(motion=[motion]), [level], "RotD50(pga)", output)
            assert runs[output][i] == alone[output].item()


def test_fits_and_screens_take_the_runs(found):
    curve = tp.fit_fragility(found, replicates=50)
    dense = tp.fit_fragility(tp.ida(BLOCKS, LAWS, SHAKES, LEVELS), intervals="wald")
    assert curve["median"].values == pytest.approx(dense["median"].values, rel=1e-6, nan_ok=True)
    again = screen(found, SHAKES, friction=0.4)
    assert again["verdict"].dims == ("run",)
    told = []
    run_table(BLOCKS, LAWS, SHAKES, grid(), progress=lambda done, total: told.append((done, total)), screen=False)
    assert told[-1] == (96, 96)


def test_refused(refusal):
    refusal()
