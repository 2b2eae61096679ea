"""Soft supports: keys of study files that give delta, refusals, and the screen, which takes their mode for real."""

import numpy as np
import pytest
from study_texts import study_in

import toppling as tp
from toppling.fragility import screen
from toppling.fragility.validity.notes import screen_facts
from toppling.fragility.validity.reasons import REASONS
from toppling.models import delta_from_frequency, delta_from_settlement
from toppling.studies.facts.notes import notes_of

STUDY = """
title = "Feet"
{blocks}
[[models]]
{law}
[motions]
generator = "kanai-tajimi"
number = 4
[{kind}]
{levels}
"""
BLOCK = tp.Block(0.4, 1.8, name="cabinet")
CABINET = '[[blocks]]\nname = "cabinet"\nwidth_m = 0.4\nheight_m = 1.8\n'
LEVELS = 'levels = { values = [1.0, 4.0], unit = "m/s2" }'


def study(tmp_path, law, blocks=CABINET, kind="ida", levels=LEVELS):
    return study_in(tmp_path, STUDY.format(law=law, blocks=blocks, kind=kind, levels=levels))


class TestKeys:
    @pytest.mark.parametrize("law", ["discrete", "energy-consistent"])
    @pytest.mark.parametrize(
        ("key", "delta"),
        [
            ("settlement_mm = 2", delta_from_settlement(BLOCK, 2e-3)),
            ("rocking_frequency_hz = 3", delta_from_frequency(BLOCK, 3.0)),
            ("rocking_frequency_hz = 6\nbody_frequency_hz = 8", delta_from_frequency(BLOCK, 6.0, 8.0)),
        ],
    )
    def test_delta_of_the_support(self, tmp_path, law, key, delta):
        (model,) = study(tmp_path, f'law = "{law}"\ne = 0.9\n{key}\n').models
        assert model.delta == pytest.approx(delta, rel=1e-12)
        assert model.rest == "soft"
        assert "rest=soft" in model.label

    def test_alike_blocks_share_it(self, tmp_path):
        again = CABINET.replace("cabinet", "again")
        (model,) = study(tmp_path, 'law = "discrete"\nsettlement_mm = 2\n', CABINET + again).models
        assert model.delta == pytest.approx(delta_from_settlement(BLOCK, 2e-3), rel=1e-12)

    def test_note_of_the_study(self, tmp_path):
        """After its runs a study says that the mode is that of the support."""
        run = study(tmp_path, 'law = "discrete"\ne = 0.9\nsettlement_mm = 2\n').run()
        (mode,) = (fact for fact in notes_of(run) if fact.what == "support.soft")
        assert mode.more == {"bed": False}


class TestScreen:
    SHAKES = tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(4)

    def screened(self, rest):
        law = tp.DiscreteDamping(e=0.9, delta=delta_from_settlement(BLOCK, 2e-3), rest=rest)
        runs = tp.ida(BLOCK, law, self.SHAKES, [1.0, 2.0])
        return runs, screen(runs, self.SHAKES)

    def test_the_runs_are_those_of_an_elastic_rest(self):
        (soft, _), (elastic, _) = self.screened("soft"), self.screened("elastic")
        for name in ("overturned", "peak_rotation"):
            np.testing.assert_array_equal(soft[name], elastic[name])

    def test_the_mode_is_no_reason_and_has_a_note(self):
        (_, soft), (_, elastic) = self.screened("soft"), self.screened("elastic")
        mode = next(one for one in REASONS if one.name == "elastic_mode")
        assert elastic["outside"].sel(reason=mode.name).item() == 1.0
        assert soft["outside"].sel(reason=mode.name).item() == 0.0
        assert not (soft["verdict"].values & mode.bit).any()
        np.testing.assert_array_equal(soft["elastic_frequency"], elastic["elastic_frequency"])
        assert float(soft["elastic_frequency"].item()) == pytest.approx(2.0452763262, rel=5e-3)
        found, resonates = ({fact.what: fact for fact in screen_facts(one)} for one in (soft, elastic))
        assert found["support.soft"].lower == pytest.approx(2.0452763262, rel=5e-3)
        assert "law.elastic_mode" not in found
        assert resonates["law.elastic_mode"].value == 1.0
