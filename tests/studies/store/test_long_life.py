"""A result file of layout 1, as it was written when that layout was published: every later version opens it.

Where the layout changes, its number (`units.SCHEMA`) goes up, and a file of the new one comes beside this one.
"""

import gzip
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import toppling as tp
from toppling.studies.command.cli import main

STORED = Path(__file__).resolve().parents[2] / "data/results_layout_1.nc.gz"


@pytest.fixture
def results(tmp_path):
    path = tmp_path / "out/results.nc"
    path.parent.mkdir()
    path.write_bytes(gzip.decompress(STORED.read_bytes()))
    return path


def test_values_and_units(results):
    with xr.open_dataset(results) as stored:
        assert stored.attrs["schema"] == 1
        assert stored["median"].attrs["units"] == "m s-1"
        np.testing.assert_allclose(stored["median"], [[0.469375, 0.447214], [0.900106, 0.949752]], rtol=1e-5)
        np.testing.assert_allclose(stored["rate"], [[0.00568354, 0.00598762], [0.00144879, 0.00124941]], rtol=1e-5)
        assert stored["overturned"].dims == ("block", "model", "level", "motion")


@pytest.mark.slow
def test_commands_open_it(results, capsys):
    assert main(["report", str(results)]) == 0
    page = results.with_name("report.html").read_text(encoding="utf-8")
    assert "of layout 1" in page
    assert "0.47 m/s (0.34–0.68)." in page  # (read off its counts: it holds no level of half)
    assert "icelake-server" in page
    assert main(["export", str(results), "--format", "csv"]) == 0
    assert main(["status", str(results.parent)]) == 0
    assert "finished" in capsys.readouterr().out


def test_functions_take_it(results):
    with xr.open_dataset(results) as stored:
        ax = tp.plot.fragility(stored.load(), Figure().subplots(), block="bookcase-5-shelf")
        assert len(ax.lines) >= 2
        assert float(tp.fragility.curve_probability(stored, [0.5]).max()) > 0.4
