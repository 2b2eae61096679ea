"""Questions of owners, engineers and reviewers: where a page answers each, by facts and tables of the examples."""

import json
import math
import shutil
from pathlib import Path

import pytest

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.facts.sections import sections
from toppling.studies.tables.registry import LEAD, TABLES, tables

pytestmark = pytest.mark.slow
EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"


class Page:
    def __init__(self, results, folder):
        self.results, self.folder = results, folder
        self.facts = {name: {fact.what: fact for fact in facts} for name, facts in sections(results).items()}
        self.tables = {table.title: table for table in tables(results, (*LEAD, *TABLES))}

    def table(self, beginning):
        return next(table for title, table in self.tables.items() if beginning in title)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("questions"), {}
    shutil.copytree(EXAMPLES, folder / "examples")

    def of(name):
        if name not in made:
            study = tp.Study.from_toml(folder / "examples" / f"{name}.toml")
            made[name] = Page(study.run(folder / name), folder / name)
        return made[name]

    return of


def test_what_must_be_anchored_and_what_does_it_cost(page):
    codes, lines, pieces = (page("clinic").table(title) for title in ("Code requirem", "What to anchor", "Pieces"))
    assert "required" in codes.column("status")
    assert all(codes.column("clause"))
    forces = {row["item"]: codes.cells(row)[-1] for row in codes.lines}
    assert all(lines.cells(row)[-2] == forces[row["item"]] for row in lines.lines[:-1])
    after = page("clinic").facts["answer"]["anchoring.after"]
    assert after.more["cost"] == sum(lines.column("cost")[:-1]) == lines.column("cost")[-1]
    assert all(row["recommendation"] for row in pieces.lines if row["item"] == "filing cabinet")
    table = page("clinic").table("Consequences")
    (row,) = (cells for cells in table.lines if "exit" in str(table.cells(cells)[0]))
    assert len(table.cells(row)) == 1 + 1 + 4  # (the building and each floor)


def test_what_changed_afterwards_and_is_it_more_than_chance(page, capsys):
    """The clinic beside the clinic with the pieces of its first table anchored."""
    clinic = page("clinic")
    folder, lines = clinic.folder.parent, clinic.table("What to anchor").column("item")
    inventory = (EXAMPLES / "inventory.csv").read_text(encoding="utf-8").splitlines()
    held = [
        line.replace(",no,", ",yes,") if any(line.lstrip('"').startswith(f) for f in lines) else line
        for line in inventory
    ]
    (folder / "examples" / "inventory.csv").write_text("\n".join(held) + "\n", encoding="utf-8")
    tp.Study.from_toml(folder / "examples" / "clinic.toml").run(folder / "after")
    sides = [str(folder / name / "results.nc") for name in ("clinic", "after")]
    assert main(["compare", *sides, "--out", str(folder / "compared"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    (verdict,) = (fact for fact in found["answer"] if "any" in fact["names"])
    assert verdict["word"] == "lower"
    (row,) = (row for table in found["tables"] for row in table["rows"] if "anything falls" in str(row.get("name")))
    after = clinic.facts["answer"]["anchoring.after"]
    chances = [-math.expm1(-50.0 * rate) for rate in (after.value, after.more["now"])]
    assert row["ratio"]["value"] == pytest.approx(chances[0] / chances[1], rel=1e-9)
    assert row["ratio"]["upper"] < 1.0
    assert all(path.startswith(str(folder / "compared")) for path in found["written"])
