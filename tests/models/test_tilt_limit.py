"""A tilt limit of a block: what reaches it counts as overturned, in every analysis, and the page says so."""

import csv
import math

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.models.block_array import BlockArray
from toppling.studies.command.cli import main

LAWS = (tp.HousnerImpact(), tp.DiscreteDamping(), tp.EnergyConsistent())
LIMIT = math.radians(3.0)
LEVELS = (1.0, 2.0, 3.0, 4.0)


@pytest.fixture(scope="module")
def shakes():
    return tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(12, seed=1)


@pytest.mark.parametrize("outputs", [("overturned", "peak_rotation"), ("overturned",)])
@pytest.mark.parametrize("around", [{}, {"wall": tp.Wall(0.02)}, {"lean": 0.02}])
def test_runs_that_reach_it_are_those_of_the_same_block_whose_peak_does(shakes, outputs, around):
    plain, limited = (tp.Block(0.4, 1.8, name="a", tilt_limit=limit, **around) for limit in (None, LIMIT))
    peaks = tp.ida(plain, LAWS, shakes, LEVELS, screen=False)
    runs = tp.ida(limited, LAWS, shakes, LEVELS, outputs=outputs, screen=False)
    reached = (peaks["peak_rotation"] >= LIMIT).values
    assert int(peaks["overturned"].sum()) < reached.sum() < reached.size
    np.testing.assert_array_equal(runs["overturned"].values, reached)
    if "peak_rotation" in outputs:
        np.testing.assert_array_equal(runs["peak_rotation"].values, peaks["peak_rotation"].values)


def test_blocks_with_and_without_one_run_together(shakes):
    blocks = [tp.Block(0.4, 1.8, name="a"), tp.Block(0.4, 1.8, name="b", tilt_limit=LIMIT)]
    runs = tp.ida(blocks, LAWS, shakes, LEVELS, screen=False)
    alone = [tp.ida(block, LAWS, shakes, LEVELS, screen=False)["overturned"].values for block in blocks]
    np.testing.assert_array_equal(runs["overturned"].values, np.concatenate(alone))


def test_both_axes():
    pair = tp.motions.both_axes(tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample_pairs(8, seed=2))
    plain, limited = (tp.Block(0.4, 1.8, name="a", depth=0.6, tilt_limit=limit) for limit in (None, LIMIT))
    outputs = ("overturned", "peak_rotation", "axis")
    options = {"im": "RotD50(pga)", "outputs": outputs, "screen": False}
    peaks, runs = (tp.ida(block, LAWS, pair, LEVELS, **options) for block in (plain, limited))
    np.testing.assert_array_equal(runs["overturned"].values, (peaks["peak_rotation"] >= LIMIT).values)
    np.testing.assert_array_equal(runs["axis"].values > 0, runs["overturned"].values)
    fell = peaks["overturned"].values
    np.testing.assert_array_equal(runs["axis"].values[fell], peaks["axis"].values[fell])


def test_bounds():
    for wrong in (0.0, -0.1, 0.5 * math.pi, math.nan):
        with pytest.raises(ValueError, match="tilt_limit must be"):
            tp.Block(0.4, 1.8, tilt_limit=wrong)
    assert tp.Block(0.4, 1.8, tilt_limit=LIMIT).label == "0.4 m × 1.8 m, fails at a tilt of 3°"
    with pytest.raises(ValueError, match="fails at a tilt of 3°"):
        BlockArray.of([tp.Block(0.4, 1.8, name="a", tilt_limit=LIMIT)])


def study(folder, limits):
    """Write a study of a building with tilt limits of some lines, and return its results."""
    assert main(["new", "inventory", str(folder)]) == 0
    file = folder / "inventory.csv"
    rows = list(csv.reader(file.read_text("utf-8").splitlines()))
    heading = next(i for i, row in enumerate(rows) if row and row[0] == "item")
    for i, row in enumerate(rows[heading:]):
        if i == 0 or (row and not row[0].startswith("#")):
            row.append("tilt_limit_deg" if i == 0 else limits.get(row[0], ""))
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)
    text = (folder / "study.toml").read_text("utf-8").replace("inventory.xlsx", "inventory.csv")
    (folder / "study.toml").write_text(text, encoding="utf-8")
    for record in sorted(folder.glob("records/*"))[8:]:
        record.unlink()
    assert main(["run", str(folder / "study.toml"), "--out", str(folder / "results")]) == 0
    return xr.open_dataset(folder / "results" / "results.nc")


@pytest.mark.slow
def test_a_line_of_an_inventory(tmp_path, capsys):
    name = "solvent cabinet"
    with study(tmp_path / "plain", {}) as plain, study(tmp_path / "limited", {name: "2"}) as limited:
        rates = [one["rate"].sel(block=name).max().item() for one in (plain, limited)]
        assert rates[1] > 1.5 * rates[0]
        others = [item for item in plain["block"].values.tolist() if item != name]
        np.testing.assert_array_equal(limited["rate"].sel(block=others), plain["rate"].sel(block=others))
    capsys.readouterr()
    assert main(["report", str(tmp_path / "limited/results")]) == 0
    page = (tmp_path / "limited/results/report.html").read_text("utf-8")
    assert "“solvent cabinet” counts as overturned at a tilt of 2°, even if returning upright." in page
    assert "fails at a tilt of 2°" in page
