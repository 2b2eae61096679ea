"""What pages say of results, inventories, hazard files and commands."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.studies.inventory.reading import COLUMNS

ROOT = Path(tp.__file__).parent
EXAMPLES = ROOT / "studies/examples"
SPEC = importlib.util.spec_from_file_location("made_results", ROOT / "docs/made_results.py")
made_results = importlib.util.module_from_spec(SPEC)
sys.modules["made_results"] = made_results
SPEC.loader.exec_module(made_results)


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
