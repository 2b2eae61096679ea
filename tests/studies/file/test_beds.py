"""Soft beds in study files, CSV files and inventories: what is built, refusals, and the screen and notes."""

import math
import re

import numpy as np
import pytest
from study_texts import study_in

import toppling as tp
from toppling.fragility import screen
from toppling.fragility.validity.notes import screen_facts
from toppling.fragility.validity.reasons import REASONS
from toppling.studies.command.cli import main
from toppling.studies.facts.notes import notes_of
from toppling.studies.file.blocks import read_blocks
from toppling.studies.inventory.reading import read_inventory
from toppling.studies.text.error import StudyError

STUDY = """
title = "Carpet"
{blocks}
[[models]]
{law}
[motions]
generator = "kanai-tajimi"
number = 4
[ida]
levels = {{ values = [1.0, 4.0], unit = "m/s2" }}
"""
CARPET = '[[blocks]]\nname = "cabinet"\nwidth_m = 0.4\nheight_m = 1.8\nbed_settlement_mm = 2\n'
FLOOR = '[[blocks]]\nname = "other"\nwidth_m = 0.4\nheight_m = 1.8\n'
VISCOUS = 'law = "viscous"\nzeta = 0.05\n'


def study(tmp_path, law=VISCOUS, blocks=CARPET, more=""):
    return study_in(tmp_path, STUDY.format(law=law, blocks=blocks) + more)


class TestKeys:
    def test_block(self, tmp_path):
        (block,) = study(tmp_path).blocks
        assert block.bed == tp.Bed(0.002)
        assert not study(tmp_path).design.both_ways  # (front and back are alike)

    def test_csv(self, tmp_path):
        file = tmp_path / "blocks.csv"
        file.write_text("name,width_m,height_m,bed_settlement_mm\na,0.4,1.8,2\nb,0.4,1.8,\n", encoding="utf-8")
        one, two = read_blocks(file)
        assert (one.bed, two.bed) == (tp.Bed(0.002), None)
        for value in ("0", "-1", "x", "30"):
            file.write_text(f"name,width_m,height_m,bed_settlement_mm\na,0.4,1.8,{value}\n", encoding="utf-8")
            with pytest.raises(StudyError, match=r"line 2.*bed_settlement_mm"):
                read_blocks(file)

    def test_inventory(self, tmp_path):
        file = tmp_path / "inventory.csv"
        file.write_text("item,width_m,height_m,floor,bed_settlement_mm\na,0.4,1.8,1,2\n", encoding="utf-8")
        assert read_inventory(file).rows[0].block.bed == tp.Bed(0.002)


class TestScreen:
    """The mode of a bed is physical; that of δ on a rigid floor beside it is not."""

    def runs(self):
        self.shakes = tp.motions.KanaiTajimi(duration=10.0, dt=0.01).sample(6, seed=1)
        blocks = [tp.Block(0.4, 1.8, name="carpet", bed=tp.Bed(0.002)), tp.Block(0.4, 1.8, name="floor")]
        return tp.ida(blocks, tp.DiscreteDamping(e=0.9), self.shakes, [1.0, 3.0])

    def test_frequency_and_verdict(self):
        found = screen(self.runs(), self.shakes)
        mode = next(one for one in REASONS if one.name == "elastic_mode")
        assert found["outside"].sel(reason=mode.name).values[0] == 0.0
        assert found["outside"].sel(reason=mode.name).values[1] > 0.0
        assert not (found["verdict"].values[0] & mode.bit).any()
        carpet, floor = found["elastic_frequency"].values[:, 0]
        stiffness = tp.ViscousDamping(0.0).oscillator(tp.Block(0.4, 1.8, bed=tp.Bed(0.002))).regions[7].stiffness
        assert carpet == pytest.approx(math.sqrt(stiffness) / (2.0 * math.pi), rel=1e-12)
        assert floor != pytest.approx(carpet, rel=0.1)
        (mode,) = (fact for fact in screen_facts(found) if fact.what == "support.soft")
        assert (mode.lower, mode.upper, mode.more) == (carpet, carpet, {"bed": True})

    def test_runs_know_their_beds(self):
        runs = self.runs()
        np.testing.assert_array_equal(runs["bed_settlement"].values, [0.002, np.nan])
        assert runs["bed_settlement"].attrs["units"] == "m"
        found = tp.fragility.runs.provenance.blocks_of(runs)
        assert [block.bed for block in found] == [tp.Bed(0.002), None]

    def test_study_says_so(self, tmp_path):
        found = study(tmp_path, 'law = "discrete"\ne = 0.9\n', CARPET + FLOOR)
        assert "support.bed" in {fact.what for fact in found.facts}
        assert {"support.bed", "support.soft"} <= {fact.what for fact in notes_of(found.run())}


def test_inventory_study(tmp_path):
    """Floors with and without beds are joined; a kit does not fit a piece on a bed."""
    results = study_in(
        tmp_path,
        """
title = "Office"
[[models]]
law = "viscous"
zeta = 0.1
[motions]
generator = "kanai-tajimi"
number = 6
[building]
kind = "flexural-shear"
period_s = 0.5
alpha0 = 8
storeys = 3
[performance]
inventory = "inventory.csv"
im = "pga"
levels = { values = [1.0, 6.0], unit = "m/s2" }
""",
        inventory="item,width_m,height_m,floor,mass_kg,bed_settlement_mm\n"
        "carpet,0.4,1.8,1,90,2\nfloor,0.4,1.8,1,90,\nup,0.4,1.8,2,90,\n",
    ).run()
    np.testing.assert_array_equal(results["bed_settlement"].values, [0.002, np.nan, np.nan])
    frequency = results["elastic_frequency"].values[:, 0]
    assert frequency[0] < 0.9 * frequency[1] == 0.9 * frequency[2]


@pytest.mark.slow
def test_simulate(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = "simulate --width 40cm --height 1.8m one-cycle-sine --period 1s --pga 0.2g --law viscous --zeta 0.05"
    assert main([*words.split(), "--bed-settlement", "2mm"]) == 0
    assert re.search(r"settles 2 mm;.*0\.0457", capsys.readouterr().out)
    assert main([*words.split(), "--bed-settlement", "20cm"]) == 2
    error = capsys.readouterr().err
    assert "bed settlement" in error
    assert error.count("\n") == 1


def test_refused(refusal):
    refusal()
