"""Studies of inventories with kits: what is read and refused, what tables, reports and files hold, what is kept."""

import csv
import io
import math
import re

import numpy as np
import openpyxl
import pytest
import xarray as xr
from check_facts import facts_of, numbers_in
from rich.console import Console
from study_texts import motions

import toppling as tp
from toppling.studies.buildings.pieces import pieces_of
from toppling.studies.buildings.recommendations import Range
from toppling.studies.command.cli import main
from toppling.studies.facts import building
from toppling.studies.facts.method import method_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import say
from toppling.studies.tables import pieces
from toppling.studies.tables.files import cells
from toppling.studies.tables.kits import exported_kits, kit_breaks, kit_lines, kits, short_kits, static_checks
from toppling.studies.tables.registry import TABLES, tables
from toppling.studies.tables.terminal import rendered

COLUMNS = "item,width_m,height_m,floor,count,mass_kg,wall_gap_mm,cm_offset_mm,lean_deg,value,currency,consequence"
INVENTORY = f"""{COLUMNS},anchored
case,0.3,1.8,0,3,100,20,,,400,EUR,injury,no
desk shelf,0.35,1.5,1,1,60,,-10,0.5,100,EUR,,no
strapped,0.3,1.8,1,1,100,0,,,50,EUR,,strap
fixed,0.3,1.8,1,2,100,,,,900,EUR,,yes
"""
STUDY = f"""
title = "Kits"
[[models]]
law = "housner"
geometry = "linear"
[restraints.strap]
kind = "strap"
height_m = 1.4
strength_n = 267
slack_mm = 5
cost = 15
[restraints.bracket]
kind = "bracket"
height_m = 1.4
strength_n = 900
count = 2
cost = 60
{motions(8)}[building]
kind = "flexural-shear"
period_s = 0.4
storeys = 2
[performance]
inventory = "things.csv"
levels = {{ from = 1.0, to = 12.0, number = 5, spacing = "log", unit = "m/s2" }}
replicates = 100
"""
KITS = 'kits = ["strap", "bracket"]\n'
HAZARD = '[hazard]\nk0 = 1e-3\nk = 2\nunit = "g"\n'


def study(tmp_path, more=KITS, after=HAZARD, inventory=INVENTORY, text=STUDY):
    (tmp_path / "things.csv").write_text(inventory, encoding="utf-8")
    file = tmp_path / "study.toml"
    file.write_text(f"{text}{more}{after}", encoding="utf-8")
    return tp.Study.from_toml(file)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    more = f"{KITS}budget = 200\ntarget = {{ falls = 0.01, front_falls = 0.008 }}\n"
    return study(tmp_path_factory.mktemp("kits"), more).run()


class TestReading:
    def test_an_inventory_with_scenes(self, tmp_path):
        rows = {row.label: row for row in study(tmp_path).inventory.rows}
        assert rows["case"].block == tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02))
        assert rows["desk shelf"].block.cm_offset == -0.01
        assert rows["desk shelf"].block.lean == pytest.approx(np.radians(0.5))
        assert rows["strapped"].kit == "strap"
        assert not rows["strapped"].anchored
        assert rows["strapped"].block.restraint == tp.Restraint.strap(1.4, 267.0, 20e3, 0.005)
        assert rows["fixed"].anchored

    @pytest.mark.parametrize(
        ("more", "cost", "said"),
        [
            (KITS, "cost = 15\n", ""),
            (KITS, "cost = 150000\n", "kits cost more than 100 times what is lost (strap: 150,000 for 400)"),
            (f"{KITS}target = {{ falls = 0.1, loss = 50 }}\n", "cost = 15\n", ""),
            # (five pieces that are not anchored, the whole inventory is worth 3,150)
            (f"{KITS}target = {{ falls = 50 }}\n", "cost = 15\n", "without a kit (falls = 50, all pieces give 5)"),
            (f"{KITS}target = {{ front_falls = 6 }}\n", "cost = 15\n", "(front_falls = 6, all pieces give 5)"),
            (f"{KITS}target = {{ loss = 4000 }}\n", "cost = 15\n", "(loss = 4000, all pieces give 3150)"),
        ],
    )
    def test_costs_and_targets_of_another_size(self, tmp_path, more, cost, said):
        doubts = study(tmp_path, more, text=STUDY.replace("cost = 15\n", cost)).doubts
        found = [one.sentence for one in doubts if "kit" in one.sentence and one.kind == "units"]
        assert [said in sentence for sentence in found] == [True] * bool(said)

    def test_laws_that_know_no_restraint_name_the_line(self, tmp_path):
        with pytest.raises(
            ValueError, match=r"inventory: 'case' with kit .*, 'desk shelf' with kit 'bracket' under housner"
        ):
            study(tmp_path, text=STUDY.replace('geometry = "linear"', 'geometry = "exact"'), inventory="\n".join(
                line for line in INVENTORY.splitlines() if "strapped" not in line
            ))  # fmt: skip

    def test_notes(self, tmp_path):
        low = STUDY.replace('kind = "bracket"\nheight_m = 1.4', 'kind = "bracket"\nheight_m = 1.6')
        notes = {fact.what: fact for fact in study(tmp_path, text=low).facts}
        left = notes["kit.not_tried"]
        assert (left.names, left.more["kit"]) == (("desk shelf",), "bracket")
        assert numbers_in(left.more["why"])[0] == 1.6
        assert notes["wall.pushes"].value == 0.005


class TestResults:
    def test_a_piece_below_the_table_that_falls_more_often_is_said(self, results, monkeypatch):
        """Rates of 0.001 are shown, one of 0.004 is not: 1 - exp(-0.2) in 50 years."""
        piece = pieces_of(results)[0]
        rates = [0.001] * 8 + [0.004, 0.0005]
        every = [piece._replace(recommendation="small effect", chance=Range(rate, rate, rate)) for rate in rates]
        monkeypatch.setattr(pieces, "pieces_of", lambda *_: every)
        table = pieces.short_pieces(results)
        assert len(table.lines) == 8
        assert "8 of 10" in table.note
        assert re.search(r"1 of.*to 18", table.note)
        monkeypatch.setattr(pieces, "pieces_of", lambda *_: every[:8] + every[9:])
        assert "more often" not in pieces.short_pieces(results).note

    @pytest.mark.slow
    def test_the_runs_are_counted(self, tmp_path):
        """4 pieces as they are less the fixed one, and with kits: two on two lines, one on the strapped one."""
        made = study(tmp_path)
        assert made.kit_runs == (2 + 2 + 1) * 2 * 8 * 5
        assert made.runs == (3 + 5) * 2 * 8 * 5
        counted = []
        made.run(progress=lambda done, total: counted.append((done, total)))
        assert counted[-1] == (made.work, made.work)
        assert [done for done, _ in counted] == sorted(done for done, _ in counted)

    def test_tables(self, results):
        table = kits(results)
        keys = ["kit", "falls", "front_falls", "share_saved", "effect", "breaks"]
        assert [column.key for column in table.columns][:6] == keys
        names = [(piece.item, kit) for piece, kit, _ in kit_lines(results)]
        assert sorted(names) == sorted(
            [(name, kit) for name in ("case", "desk shelf") for kit in ("", "strap", "bracket")]
            + [("strapped", ""), ("strapped", "bracket")]
        )
        assert len(table.lines) == len(names)
        assert any(kit.endswith("(strap)") for kit in table.column("kit"))
        assert [heading.partition(" (")[0] for heading, _ in table.groups] == [
            *dict.fromkeys(name for name, _ in names)
        ]
        checks = static_checks(results)
        assert len(checks.rows) == 5
        assert "in 50 years" in checks.note
        by_level = kit_breaks(results)
        assert len(by_level.rows) == results.sizes["level"]
        assert [column.key for column in by_level.columns][1:] == [
            "strapped: strap", "case: strap", "case: bracket", "desk shelf: strap", "desk shelf: bracket",
            "strapped: bracket",
        ]  # fmt: skip
        headings, *rows = cells(exported_kits(results))
        assert {"falls (1/year)", "breaks (1/year)", "breaks_lower (1/year)"} <= set(headings)
        assert all(len(row) == len(headings) for row in rows)

    def test_falls_saved_are_those_without_the_kit_less_those_with_it(self, results):
        """Of any fall and of falls to the front; the shelf has no wall behind it and also falls to the back."""
        now = {}
        for row in exported_kits(results).lines:
            now.setdefault(row["item"], row)  # (as it is comes first)
            for name in ("falls", "front_falls"):
                saved = now[row["item"]][name].value - row[name].value
                assert row[f"{name}_saved"].value == pytest.approx(saved, rel=1e-12, abs=1e-15), (row["item"], name)

    def test_one_motion_gives_shares_no_interval_and_the_table_says_why(self, tmp_path):
        """Chances and rates have the interval that Wilson's of one trial permits."""
        results = study(tmp_path, text=STUDY.replace("number = 8", "number = 1")).run()
        lower, share, upper = (results[f"kit_share_saved{end}"].values for end in ("_lower", "", "_upper"))
        part = (share > 0.0) & (share < 1.0)
        assert part.any()
        assert np.isnan(lower[part]).all()
        assert np.isnan(upper[part]).all()
        assert "(no interval)" in str([*kits(results).groups])
        assert any("missing where all motions agree" in note for note in kits(results).notes)
        assert np.isfinite(results["item_rate_lower"]).all()
        assert np.isfinite(results["item_rate_upper"]).all()
        assert "(no interval)" not in str([*pieces.pieces(results).groups])

    def test_the_terminal_has_80_columns(self, results):
        """The chosen kits are marked."""
        table = short_kits(results)
        console = Console(width=80, file=io.StringIO())
        console.print(*rendered(table, 80), sep="\n")
        text = console.file.getvalue()
        assert max(map(len, text.splitlines())) <= 80
        assert len(table.lines) == len(kit_lines(results))
        for piece, _, _ in kit_lines(results):
            assert piece.item in text
        chosen = {name for name in ("budget", "target") if "yes" in table.column(name)}
        assert chosen == {name for name in ("budget", "target") if any(results[f"{name}_kit"].values.ravel() != "")}
        assert len(short_kits(results, 4).lines) == 4

    def test_a_study_without_kits_has_no_tables(self, tmp_path):
        start, _, rest = STUDY.partition("[restraints.bracket]")
        alone = start + "[motions]" + rest.partition("[motions]")[2]
        found = study(tmp_path, "", text=alone).run()
        titles = {table.title for table in tables(found, TABLES)}
        assert "Pieces" in titles
        assert not any("Kits" in title or "Static" in title for title in titles)
        assert found["anchored_with"].values.tolist() == ["", "", "strap", ""]
        assert "front_probability" in found

    def test_the_report_says_what_to_buy(self, results):
        actions = facts_of(building.actions, results)
        budget, target = actions["kit.for_budget"], actions["kit.for_target"]
        bought = zip(results["budget_kit"][0].values.tolist(), results["item"].values.tolist(), strict=True)
        assert (budget.more["budget"], budget.value) == (200.0, float(results["budget_cost"][0]))
        assert say(budget, "page").startswith("For the budget of 200")
        assert [say(fact, "page").count("Several pieces") for fact in (budget, target)] == [1, 0]
        assert {*budget.more["pairs"]} == {pair for pair in bought if pair[0]}
        assert budget.more["now"][0] == pytest.approx(math.fsum((results["item_rate"][0] * results["count"]).values))
        assert budget.more["then"] == [float(results[f"budget_{name}"][0]) for name in ("falls", "front_falls")]
        assert target.more["target"] == {"falls": 0.01, "front_falls": 0.008}
        kept = "keep falls to at most one in 100 years and falls into the room to at most one in 125 years"
        assert kept in say(target, "page").replace("\u00a0", " ")
        assert facts_of(method_of, results)["anchoring.assumed"].more["kits"]
        assert "kit.tried" in facts_of(method_of, results)
        (held,) = (fact for fact in notes_of(results) if fact.what == "anchoring.with_kit")
        assert (held.value, held.more) == (1, {"of": 7, "lines": [[1, "strapped", "strap"]], "others": 0})

    @pytest.mark.slow
    def test_files(self, tmp_path):
        made = study(tmp_path, f"{KITS}budget = 100\n")
        made.run(tmp_path / "out")
        for format_ in ("csv", "xlsx"):
            assert not main(["export", str(tmp_path / "out"), "--format", format_, "--out", str(tmp_path / "files")])
        with (tmp_path / "files/kits.csv").open(encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
        assert len(rows) == 8
        sheet = openpyxl.load_workbook(tmp_path / "files/pieces.xlsx")["kits"]
        assert [cell.value for cell in sheet[1]] == [*rows[0]]
        assert not main(["report", str(tmp_path / "out"), "--format", "md", "--out", str(tmp_path / "report")])

    @pytest.mark.slow
    def test_costs_target_and_budget_change_no_run(self, tmp_path, monkeypatch):
        study(tmp_path).run(tmp_path / "out")
        other = STUDY.replace("cost = 60", "cost = 30")
        more = f"{KITS}budget = 70\ntarget = {{ falls = 0.01 }}\n"
        (tmp_path / "fresh").mkdir()
        fresh = study(tmp_path / "fresh", more, text=other).run(tmp_path / "fresh/out")
        changed = study(tmp_path, more, text=other)
        monkeypatch.setattr(type(changed), "_compute", None)
        xr.testing.assert_identical(changed.run(tmp_path / "out"), fresh)

    @pytest.mark.slow
    def test_at_a_level(self, tmp_path):
        found = study(tmp_path, f"{KITS}target = {{ falls = 1.0 }}\n", "").run()
        assert found["kit_falls"].attrs["units"] == "1"
        at = found["kit_probability"].sel(level=found.attrs["at_level"])
        np.testing.assert_array_equal(found["kit_falls"], at)
        assert "at the level" in kits(found).columns[1].title
        target = facts_of(building.actions, found)["kit.for_target"]
        assert (target.more["target"], target.more["yearly"]) == ({"falls": 1.0}, False)
