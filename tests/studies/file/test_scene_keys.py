"""Walls and restraints in study files and CSV files of blocks: what is built, and the sentence where nothing can be."""

import json
import math

import pytest
from study_texts import study_in

import toppling as tp
from toppling.motions.arrays import digest
from toppling.studies.file.blocks import RESTRAINTS, read_blocks
from toppling.studies.store.worker_motions import motions_again
from toppling.studies.text.error import StudyError

STUDY = """
title = "Scenes"
{blocks}
[[models]]
law = "housner"
geometry = "linear"
[motions]
generator = "kanai-tajimi"
number = 4
[ida]
levels = {{ values = [1.0, 4.0], unit = "m/s2" }}
"""
SIZES = '[[blocks]]\nname = "shelf"\nwidth_m = 0.3\nheight_m = 1.8\n'
KIT = '[restraints.kit]\nkind = "strap"\nheight_m = 1.75\nstrength_n = 267\nslack_mm = 5\n'


def study(tmp_path, blocks):
    return study_in(tmp_path, STUDY.format(blocks=blocks))


class TestBlocks:
    def test_all_keys(self, tmp_path):
        more = "mass_kg = 100\ncm_offset_mm = 30\nlean_deg = -1\nwall_gap_mm = 20\nwall_height_m = 1.7\n"
        more += 'wall_restitution = 0.4\nfront_gap_mm = 600\nrestraint = "kit"\n'
        (block,) = study(tmp_path, SIZES + more + KIT).blocks
        assert block.wall == tp.Wall(0.02, 1.7, 0.4, 0.6)
        assert block.restraint == tp.Restraint.strap(1.75, 267.0, 20e3, 0.005)
        assert (block.mass, block.cm_offset, block.lean) == (100.0, 0.03, math.radians(-1.0))

    def test_inline(self, tmp_path):
        inline = 'mass_kg = 50\nrestraint = { kind = "bracket", height_m = 1.5, strength_n = 400 }\n'
        (block,) = study(tmp_path, SIZES + inline).blocks
        assert block.restraint == tp.Restraint.bracket(1.5, 400.0)

    def test_runs_to_the_front(self, tmp_path):
        found = study(tmp_path, SIZES + "wall_gap_mm = 0\n" + '[fit]\nstate = "front"\n')
        assert "wall.pushes" in {fact.what for fact in found.facts}


class TestPlaced:
    """Items of the catalogue as they usually stand."""

    ITEM = '[[blocks]]\ncatalogue = "bookcase-5-shelf"\nplaced = true\n'

    def test_back_to_a_wall(self, tmp_path):
        """It has a name of its own, so that both may be in one study; the free block is the default."""
        free = '[[blocks]]\ncatalogue = "bookcase-5-shelf"\n'
        one, two = study(tmp_path, self.ITEM + "wall_restitution = 0.4\n" + free).blocks
        assert one.label.startswith("bookcase-5-shelf, ")
        assert one.wall == tp.Wall(0.02, None, 0.4)
        assert two == tp.catalogue["bookcase-5-shelf"]

    def test_stands_free(self, tmp_path):
        (block,) = study(tmp_path, '[[blocks]]\ncatalogue = "server-rack-42u"\nplaced = true\n').blocks
        assert block == tp.catalogue["server-rack-42u"]

    def test_csv(self, tmp_path):
        file = tmp_path / "blocks.csv"
        file.write_text("name,catalogue,placed\n,bookcase-5-shelf,yes\nmine,bookcase-5-shelf,no\n", encoding="utf-8")
        one, two = read_blocks(file)
        assert one == tp.catalogue.placed("bookcase-5-shelf")
        assert (two.label, two.wall) == ("mine", None)


class TestRestraintTable:
    @pytest.mark.parametrize("kind", RESTRAINTS)
    def test_every_kind(self, kind):
        values = {
            "height_m": 1.5, "strength_n": 300.0, "stiffness_n_per_mm": 30.0, "preload_n": 100.0, "count": 2,
            "front_m": 0.25, "back_m": 0.2, "width_m": 0.4, "angle_deg": 10.0,
        }  # fmt: skip
        table = RESTRAINTS[kind]
        restraint = table(kind=kind, **{key: one for key, one in values.items() if key in table.model_fields}).build()
        assert restraint.kind == kind
        assert restraint.strength == 300.0
        assert restraint.rigid == (kind == "adhesive")


class TestCsv:
    HEADER = "name,width_m,height_m,mass_kg,cm_offset_mm,lean_deg,wall_gap_mm,restraint\n"

    def read(self, tmp_path, line):
        file = tmp_path / "blocks.csv"
        file.write_text(self.HEADER + line, encoding="utf-8")
        return read_blocks(file, {"kit": tp.Restraint.strap(1.75)})

    def test_columns(self, tmp_path):
        one, two = self.read(tmp_path, "a,0.3,1.8,100,-20,1,5,kit\nb,0.3,1.8,,,,,\n")
        assert (one.mass, one.cm_offset, one.wall, one.restraint.kind) == (100.0, -0.02, tp.Wall(0.005), "strap")
        assert two == tp.Block(0.3, 1.8, name="b")


class TestPolarity:
    """Motions are run both ways where front and back of a block differ, and the study says so."""

    @pytest.mark.parametrize(("more", "both"), [
        ("", False),
        ("wall_gap_mm = 20\n", True),
        ("wall_gap_mm = 20\nfront_gap_mm = 20\n", False),
        ("cm_offset_mm = 10\n", True),
        ("lean_deg = 1\n", True),
        ('mass_kg = 100\nrestraint = "kit"\n' + KIT, True),
        ('mass_kg = 100\nrestraint = { kind = "bracket", height_m = 1.5, strength_n = 400 }\n', False),
    ])  # fmt: skip
    def test_the_default(self, tmp_path, more, both):
        found = study(tmp_path, SIZES + more)
        assert found.design.both_ways == both
        assert found.runs == (16 if both else 8)
        assert ("4 motions both" in found.words) == both

    def test_as_asked(self, tmp_path):
        def asked(blocks, word):
            text = STUDY.replace("[ida]", f'[ida]\npolarity = "{word}"').format(blocks=blocks)
            return study_in(tmp_path, text)

        assert asked(SIZES, "both").design.both_ways
        assert not asked(SIZES + "wall_gap_mm = 20\n", "as recorded").design.both_ways
        with pytest.raises(StudyError, match="polarity: must be one of as recorded, both, got 'reversed'"):
            asked(SIZES, "reversed")

    @pytest.mark.slow
    def test_results(self, tmp_path):
        results = study(tmp_path, SIZES + "wall_gap_mm = 20\n").run(tmp_path / "out")
        assert results["polarity"].values.tolist() == [1, -1] * 4
        assert (results["runs"] == 8).all()
        again = study(tmp_path, SIZES + "wall_gap_mm = 20\n").run(tmp_path / "out")
        assert again.equals(results)
        free, walled = study(tmp_path, SIZES), study(tmp_path, SIZES + "wall_gap_mm = 20\n")
        assert free.identity.split("-")[1] != walled.identity.split("-")[1]  # (the motions)

    def test_workers_make_both(self, tmp_path):
        found = study(tmp_path, SIZES + "wall_gap_mm = 20\n")
        made = motions_again(json.dumps(found.configuration), both=True)
        assert [digest(one) for one in made] == found._digests


class TestUncertainRestraints:
    INPUTS = """
[uncertainty]
samples = 8
[uncertainty.inputs]
{inputs}
"""

    def uncertain(self, tmp_path, blocks, inputs):
        text = STUDY.format(blocks=blocks) + self.INPUTS.format(inputs=inputs)
        return study_in(tmp_path, text)

    def test_each_sample_has_its_own(self, tmp_path):
        held = SIZES + 'mass_kg = 100\nrestraint = "kit"\n' + KIT
        inputs = 'restraint_strength_n = { distribution = "least", medians = [900, 400], dispersions = [0.3, 0.2] }\n'
        inputs += 'restraint_stiffness_n_per_mm = { distribution = "lognormal", median = 20, dispersion = 0.5 }'
        found = self.uncertain(tmp_path, held, inputs)
        restraints = [row[0][0].restraint for row in found._pairs[0]]
        assert len({one.strength for one in restraints}) == len({one.stiffness for one in restraints}) == 8
        assert 250.0 < min(one.strength for one in restraints) < max(one.strength for one in restraints) < 700.0
        assert 5e3 < min(one.stiffness for one in restraints) < 20e3 < max(one.stiffness for one in restraints) < 80e3
        assert {one.slack for one in restraints} == {0.005}
        results = found.run()
        assert results["restraint_strength"].attrs["units"] == "N"
        assert results["restraint_stiffness"].attrs["units"] == "N m-1"
        assert "polarity" in results.coords
