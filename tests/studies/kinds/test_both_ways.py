"""Inventory studies that run every motion both ways: by default, counted, kept apart, compared, and said."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from study_texts import laws, motions, power_law, study_in, tower

from toppling.motions.arrays import digest
from toppling.studies.buildings.shaking import Shaking
from toppling.studies.comparison.inputs import notes_on_inputs
from toppling.studies.comparison.pieces import compare_pieces, fallen
from toppling.studies.comparison.sides import same_motions, two_sides
from toppling.studies.store.worker_motions import motions_again
from toppling.studies.text.error import StudyError

SIDED = """item,width_m,height_m,floor,count,mass_kg,wall_gap_mm,anchored,value,currency,consequence
case,0.30,1.80,0,3,100,20,no,100,EUR,injury
low,0.30,1.40,2,2,60,,no,50,EUR,
strapped,0.30,1.80,1,1,100,20,strap,10,EUR,injury
"""
ALIKE = "\n".join(
    line.replace(",20,", ",,").replace(",strap,", ",no,") for line in SIDED.replace("strapped", "tall").splitlines()
)
LINEAR = laws("housner") + 'geometry = "linear"\n'
STUDY = 'title = "Both ways"\n' + LINEAR + motions(9, 8) + tower(0.4, 2) + power_law(1e-3, 2)
STRAP = """[restraints.strap]
kind = "strap"
height_m = 1.3
strength_n = 267
slack_mm = 5
cost = 15
"""
PERFORMANCE = """[performance]
inventory = "things.csv"
levels = { from = 1.0, to = 12.0, number = 6, spacing = "log", unit = "m/s2" }
replicates = 200
"""
AS_RECORDED, BOTH = 'polarity = "as recorded"\n', 'polarity = "both"\n'
SETS = """[[motion_sets]]
name = "other"
motions = { generator = "clough-penzien", number = 5, seed = 2, duration_s = 8, dt_s = 0.02 }
[[branches]]
of = "motions"
names = ["motions", "other"]
weights = [0.5, 0.5]
"""


def study(folder, more="", inventory=SIDED, after="", strap=None):
    folder.mkdir(exist_ok=True)
    held = STRAP if strap or (strap is None and "strap," in inventory) else ""
    return study_in(folder, f"{STUDY}{held}{PERFORMANCE}{more}{after}", things=inventory)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Finished studies of sided pieces: both ways, and as recorded."""
    found = tmp_path_factory.mktemp("ways")
    for name, more in (("both", ""), ("recorded", AS_RECORDED)):
        study(found / name, more).run(found / name / "out")
    return found


class TestAsking:
    def test_by_default(self, tmp_path):
        assert study(tmp_path).polarity == "both"
        assert study(tmp_path, inventory=ALIKE).polarity == "as recorded"
        # (a kit on one side makes front and back differ)
        assert study(tmp_path, 'kits = ["strap"]\n', ALIKE, strap=True).polarity == "both"
        assert study(tmp_path, AS_RECORDED).polarity == "as recorded"
        assert study(tmp_path, BOTH, ALIKE).polarity == "both"
        with pytest.raises(StudyError, match="polarity: must be one of as recorded, both, got 'reversed'"):
            study(tmp_path, 'polarity = "reversed"\n')

    @pytest.mark.slow
    def test_words_and_runs(self, tmp_path):
        made = study(tmp_path, after=SETS)
        assert made.runs == 270  # (two lines twice, one once)
        assert "9 motions both ways" in made.words
        assert made.further_runs == 5 * 5 * 6
        counted = []
        made.run(progress=lambda done, total: counted.append((done, total)))
        assert counted[-1] == (made.work, made.work)
        assert [done for done, _ in counted] == sorted(done for done, _ in counted)
        plain = study(tmp_path, AS_RECORDED)
        assert plain.runs == 9 * 3 * 6
        assert "both ways" not in plain.words
        assert study(tmp_path, BOTH, ALIKE).runs == study(tmp_path, AS_RECORDED, ALIKE).runs

    def test_memory_and_disk_are_those_of_twice_as_many_motions(self, tmp_path):
        both = study(tmp_path)
        text = (tmp_path / "study.toml").read_text(encoding="utf-8").replace("number = 9", "number = 18")
        twice = study_in(tmp_path, text + AS_RECORDED)
        for name in ("together", "arrays_aside", "stored_bytes"):
            assert getattr(both, name) == pytest.approx(getattr(twice, name), rel=1e-12), name


class TestResults:
    def test_workers_make_the_motions_and_their_reverses(self, tmp_path):
        made = study(tmp_path)
        assert made.both_ways
        shaking = Shaking.of(made.building, made.motions, None, False, made.polarity)
        known = {digest(one) for one in motions_again(json.dumps(made.configuration), made.both_ways)}
        for at in shaking.supports(made.inventory):
            assert {digest(one) for one in shaking.on(at)} <= known


class TestComparison:
    def test_both_ways_with_as_recorded(self, folder):
        """Replicates draw motions: both outcomes of one side beside the only one of the other."""
        with two_sides(folder / "recorded/out", folder / "both/out") as (a, b):
            assert same_motions(a, b)
            motions, *_ = notes_on_inputs(a, b, True, True)
            assert (motions.what, motions.more["motions"]) == ("comparison.same_motions", (9, 9))
            assert motions.more["both_ways"] == ["B"]
            one, other = fallen(a, 0), fallen(b, 0)
            assert one["chance"].shape == other["chance"].shape == (3, 9)
            assert_allclose(other["chance"][1], one["chance"][1])  # (the symmetric line)
            assert_allclose(other["any"].mean(), float(b.results["any_rate"][0, 0]), rtol=1e-12)
            lines = {(line.quantity, line.name): line for line in compare_pieces(a, b).lines}
        for i, name in enumerate(("case", "low", "strapped")):
            ratio = lines["chance", name].ratio
            rng = np.random.default_rng(3)
            drawn = rng.multinomial(9, np.full(9, 1 / 9), 4000) / 9
            samples = [1.0 - np.exp(-50.0 * (side["chance"][i] @ drawn.T)) for side in (one, other)]
            if name == "low":
                assert tuple(ratio) == pytest.approx((1.0, 1.0, 1.0))
            elif np.isfinite(ratio.lower):
                low, high = np.quantile(samples[1] / samples[0], [0.025, 0.975])
                assert ratio.lower == pytest.approx(low, rel=0.1)
                assert ratio.upper == pytest.approx(high, rel=0.1)
