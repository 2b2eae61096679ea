"""Inventory studies that run every motion both ways: by default, counted, kept apart, compared, and said."""

import json

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from study_texts import motions

import toppling as tp
from toppling.core.facts import Fact
from toppling.fragility.runs.provenance import number_of_motions
from toppling.motions.arrays import digest
from toppling.studies.buildings.shaking import Shaking
from toppling.studies.comparison.inputs import notes_on_inputs
from toppling.studies.comparison.pieces import compare_pieces, fallen
from toppling.studies.comparison.sides import same_motions, two_sides
from toppling.studies.facts.method import inputs_of, method_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.plots.assessment import levels_figure
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
STUDY = f"""title = "Both ways"
[[models]]
law = "housner"
geometry = "linear"
{motions(9, 8)}[building]
kind = "flexural-shear"
period_s = 0.4
storeys = 2
[hazard]
k0 = 1e-3
k = 2
unit = "g"
"""
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
    (folder / "things.csv").write_text(inventory, encoding="utf-8")
    file = folder / "study.toml"
    held = STRAP if strap or (strap is None and "strap," in inventory) else ""
    file.write_text(f"{STUDY}{held}{PERFORMANCE}{more}{after}", encoding="utf-8")
    return tp.Study.from_toml(file)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Finished studies: sided pieces both ways, as recorded, and symmetric ones both ways."""
    found = tmp_path_factory.mktemp("ways")
    for name, more, inventory in (
        ("both", "", SIDED),
        ("recorded", AS_RECORDED, SIDED),
        ("alike", BOTH, ALIKE),
        ("alike recorded", "", ALIKE),
    ):
        study(found / name, more, inventory).run(found / name / "out")
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
        (tmp_path / "study.toml").write_text(text + AS_RECORDED, encoding="utf-8")
        twice = tp.Study.from_toml(tmp_path / "study.toml")
        for name in ("together", "arrays_aside", "stored_bytes"):
            assert getattr(both, name) == pytest.approx(getattr(twice, name), rel=1e-12), name

    def test_notes(self, tmp_path):
        def of_polarity(made):
            return [fact for fact in made.facts if fact.what.startswith("motion.polarity")]

        assert of_polarity(study(tmp_path)) == [Fact("motion.polarity_both")]
        (said,) = of_polarity(study(tmp_path, AS_RECORDED))
        assert (said.what, said.names) == ("motion.polarity_as_recorded", ("case", "strapped"))
        assert not of_polarity(study(tmp_path, inventory=ALIKE))


class TestResults:
    @pytest.mark.slow
    def test_what_they_say(self, folder):
        with xr.open_dataset(folder / "both/out/results.nc") as results:
            assert number_of_motions(results) == 9
            assert results.sizes["motion"] == 18
            given = next(inputs_of(results))
            assert given.value == 9
            assert "motion.polarity_both" in {fact.what for fact in method_of(results)}
            notes = {fact.what: fact.more for fact in notes_of(results)}
            assert notes["validity.few_motions"]["motions"] == 9
            undecided = notes["stability.undecided"]
            assert (undecided["motions"], undecided["reversed"]) == (18, True)
            assert "9 motions, each also reversed" in levels_figure(results).get_label()

    @pytest.mark.slow
    def test_stopped_and_gone_on_with(self, folder, tmp_path):
        """The same bytes after an interruption."""
        made = study(tmp_path)
        calls = []

        def stop(done, total):
            calls.append(done)
            if done > total // 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            made.run(tmp_path / "out", progress=stop)
        made.run(tmp_path / "out")
        assert (tmp_path / "out/results.nc").read_bytes() == (folder / "both/out/results.nc").read_bytes()

    def test_workers_make_the_motions_and_their_reverses(self, tmp_path):
        made = study(tmp_path)
        assert made.both_ways
        shaking = Shaking.of(made.building, made.motions, None, False, made.polarity)
        known = {digest(one) for one in motions_again(json.dumps(made.configuration), made.both_ways)}
        for at in shaking.supports(made.inventory):
            assert {digest(one) for one in shaking.on(at)} <= known

    def test_symmetric_pieces(self, folder):
        """All annual values, savings and their intervals as those of motions as recorded."""
        paths = [folder / name / "out/results.nc" for name in ("alike", "alike recorded")]
        with xr.open_dataset(paths[0]) as twice, xr.open_dataset(paths[1]) as once:
            tested = [name for name, one in once.data_vars.items() if "motion" not in one.dims]
            for name in tested:
                if not str(name).startswith(("undecided", "outside")):  # (other runs are tested)
                    assert_array_equal(twice[name].values, once[name].values, err_msg=str(name))
            assert len(tested) > 80

    @pytest.mark.slow
    def test_branches(self, tmp_path):
        """Rates over branches of a study are the means of those of its motions and of their reverses."""
        both = study(tmp_path, after=SETS).run()
        assert "epistemic_item_rate" in both
        own = both["item_rate"].values[0]
        branches = both["branch_item_rate"].values
        assert_allclose(branches[:, 0], own, rtol=1e-12)
        other = STUDY.replace("number = 9\nseed = 1", "number = 5\nseed = 2")
        (tmp_path / "study.toml").write_text(f"{other}{STRAP}{PERFORMANCE}", encoding="utf-8")
        alone = tp.Study.from_toml(tmp_path / "study.toml").run()
        assert number_of_motions(alone) == 5
        assert_allclose(branches[:, 1], alone["item_rate"].values[0], rtol=1e-12)


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

    def test_equal_outcomes_are_one(self, folder):
        with two_sides(folder / "alike recorded/out", folder / "alike/out") as (a, b):
            for line in compare_pieces(a, b).lines:
                if np.isfinite(line.ratio.lower):
                    assert tuple(line.ratio) == pytest.approx((1.0, 1.0, 1.0), rel=1e-12)
