"""Results of every kind of study: units, long names and dimensions of all variables, the same in memory and on disk."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.studies.inventory.reading import COLUMNS
from toppling.studies.store.content import ATTRIBUTE, content_digest

ROOT = Path(tp.__file__).parent
EXAMPLES = ROOT / "studies/examples"
SPEC = importlib.util.spec_from_file_location("made_results", ROOT / "docs/made_results.py")
made_results = importlib.util.module_from_spec(SPEC)
sys.modules["made_results"] = made_results
SPEC.loader.exec_module(made_results)
UNITS = {
    *("1", "Hz", "N", "m", "m s-1", "m s-2", "rad", "rad s-1", "s", "day", "year-1", "day year-1", "EUR", "EUR year-1"),
    "SI",  # (of selections: the coordinate `selected_unit` names that of each measure)
}
DIMENSIONS = {
    *("block", "model", "level", "motion", "floor", "run", "look", "trial", "bin", "fraction", "slip"),
    *("measure", "other_measure", "covariate", "selected_level", "selected_measure", "reason", "quantile"),
    *("branch", "epistemic_fractile", "epistemic_source", "sample", "input", "output", "component", "factor"),
    *("value", "comparison", "span", "replicate", "half_cycle", "scaled_time"),
    *("block", "place", "variant", "realisation", "consequence", "kit", "step"),
    *("number_threshold", "loss_threshold", "downtime_threshold", "injuries_threshold"),
    *("check", "variable", "vertex", "face", "face_term", "region_axis", "pooled_run", "degree_of"),
    *("near_term", "near_term_too", "curve_term", "curve_term_too", "rate_term", "rate_term_too"),
    *("event_level", "event_motion", "event_quantile"),
}


@pytest.mark.slow
@pytest.mark.longest
def test_results_of_every_kind(tmp_path):
    kinds = set()
    for name, kind, results in made_results.small_results(tmp_path):
        kinds.add(kind)
        with xr.open_dataset(tmp_path / name / "results.nc") as stored:
            assert content_digest(stored) == content_digest(results) == results.attrs[ATTRIBUTE], name
        for label, variable in results.data_vars.items():
            assert variable.attrs["units"] in UNITS, label
            assert variable.attrs["long_name"], label
            assert set(variable.dims) <= DIMENSIONS, label
    assert kinds == set(made_results.TITLES)


def test_rows_of_the_page():
    def variable(*dims):
        return xr.Variable(dims, np.zeros((1,) * len(dims)), {"units": "1", "long_name": f"of {dims[0]}"})

    ends = ("", "_lower", "_upper", "_modelling_lower", "_modelling_upper")
    of_floors = {f"rate{end}": variable("block", "floor") for end in ends}
    assert list(made_results.rows([{**of_floors, "lower": variable("block")}, {"rate": variable("block")}])) == [
        ("`lower`", "block", "1", "of block"),
        ("`rate` ± ≈", "block, [floor]", "1", "of block"),
    ]


def table_of(page, head):
    table = (ROOT / "docs" / page).read_text(encoding="utf-8").split(head)[1].partition("\n\n")[0]
    return [line.split("|")[1] for line in table.splitlines()]


def test_columns_of_an_inventory():
    cells = table_of("study_buildings.md", "| column | meaning |\n|---|---|\n")
    assert {name for cell in cells for name in re.findall(r"`(\w+)`", cell)} == set(COLUMNS)


def test_headings_of_a_hazard_file(tmp_path):
    """What the page says may stand in the first line is read, with the rates that it stands for."""
    headings = [cell.split("`")[1] for cell in table_of("study.md", "| first line | content |\n|---|---|\n")]
    plain = [heading for heading in headings if heading.startswith("pga")]
    cells = {
        "rate": ("0.01", "0.001"),
        "probability": ("0.3934693402873666", "0.04877057549928599"),
        "return": ("100", "1000"),
    }
    for heading in plain:
        kinds = [next(kind for kind in cells if column.startswith(kind)) for column in heading.split(",")[1:]]
        rows = [",".join([level, *(cells[kind][i] for kind in kinds)]) for i, level in enumerate(("0.1", "0.4"))]
        (tmp_path / "site.csv").write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")
        assert tp.read_hazard(tmp_path / "site.csv").rates == pytest.approx((0.01, 0.001), rel=1e-12)
    assert len(plain) == 4


def test_commands_are_given_as_toppling():
    """The README says how to activate the environment before the first command that needs it."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert ".venv/bin/toppling" not in text
    assert text.index("`. .venv/bin/activate`") < re.search(r"^toppling ", text, re.MULTILINE).start()


@pytest.mark.slow
def test_the_readme_counts_the_example_study():
    work = tp.Study.from_toml(EXAMPLES / "office.toml").work
    assert f"({work:,} analyses)" in (ROOT / "README.md").read_text(encoding="utf-8")
