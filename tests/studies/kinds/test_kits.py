"""Studies of inventories with kits: what is read and refused, what tables, reports and files hold, what is kept."""

import csv
import io
import re

import numpy as np
import openpyxl
import pytest
import xarray as xr
from check_facts import facts_of, numbers_in
from rich.console import Console
from study_texts import motions, study_in

from toppling.studies.buildings.pieces import pieces_of
from toppling.studies.buildings.recommendations import Range
from toppling.studies.command.cli import main
from toppling.studies.facts import answer_building as building
from toppling.studies.facts.say import say
from toppling.studies.tables import pieces
from toppling.studies.tables.kits import exported_kits, kit_lines, kits, short_kits
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
    return study_in(tmp_path, f"{text}{more}{after}", things=inventory)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    more = f"{KITS}budget = 200\ntarget = {{ falls = 0.01, front_falls = 0.008 }}\n"
    return study(tmp_path_factory.mktemp("kits"), more).run()


class TestReading:
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

    def test_falls_saved_are_those_without_the_kit_less_those_with_it(self, results):
        """Of any fall and of falls to the front; the shelf has no wall behind it and also falls to the back."""
        now = {}
        for row in exported_kits(results).lines:
            now.setdefault(row["item"], row)  # (as it is comes first)
            for name in ("falls", "front_falls"):
                saved = now[row["item"]][name].value - row[name].value
                assert row[f"{name}_saved"].value == pytest.approx(saved, rel=1e-12, abs=1e-15), (row["item"], name)

    def test_the_report_says_what_to_buy(self, results):
        """Once that several pieces may fall together; its facts are those of `tests/golden/studies/kits`."""
        actions = facts_of(building.actions, results)
        budget, target = (say(actions[what], "page") for what in ("kit.for_budget", "kit.for_target"))
        assert "budget of 200" in budget
        assert [text.count("Several pieces") for text in (budget, target)] == [1, 0]
        kept = "keep falls to at most one in 100 years and falls into the room to at most one in 125 years"
        assert kept in target.replace("\u00a0", " ")

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
        assert np.isfinite(results["rate_lower"]).all()
        assert np.isfinite(results["rate_upper"]).all()
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


def test_refused(refusal):
    refusal()
