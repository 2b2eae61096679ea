"""Every script of the corpus runs, answers in all its functions, and gives numbers."""

import runpy
import sys

import netCDF4
import numpy as np
import pytest
import script_cases

KEY = {
    "models": ("free_rocking.housner.rotation", "laws.discrete.restitution", "simulate.sliding.slide_path"),
    "motions": ("simulated.ac156.sample.values", "buildings.yielding.values", "intensity.measures.pgv"),
    "fragility": ("estimates.fit_fragility.median", "risk.annual_rate.rate", "uncertainty.sobol_indices.total"),
    "studies": ("assessments.assess.number_mean", "kinds.curves.results.median", "consequences.mean"),
}
"""Variables that are finite throughout, of each script."""


@pytest.mark.slow
@pytest.mark.parametrize("case", script_cases.cases(), ids=lambda case: case.name)
def test_all_functions_answer(case, tmp_path, monkeypatch):
    case.write(tmp_path / "case")
    monkeypatch.chdir(tmp_path / "case")
    ((_, *arguments),) = case.commands
    monkeypatch.setattr(sys, "argv", arguments)
    runpy.run_path(arguments[0], run_name="__main__")
    name = arguments[1]
    lines = (tmp_path / "case" / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    assert not [line for line in lines if "FAILED" in line]
    with netCDF4.Dataset(f"{name}.nc") as file:
        assert len(file.variables) > 100
        for key in KEY[name]:
            assert np.isfinite(np.asarray(file[key])).all(), key
