"""Studies with friction: chances of sliding and of slips beside those of falling, in results and on pages."""

import numpy as np
import pytest
from check_facts import facts_of
from scipy.stats import norm
from study_texts import YEAR, blocks, ida, laws, motions, study_in

import toppling as tp
from toppling.fragility import Slip, fit_fragility, overturning_probability, slide_runs
from toppling.models.friction import Contact, LognormalFriction
from toppling.studies.facts.method import method_of
from toppling.studies.facts.notes import notes_of

TEXT = (
    'title = "A trolley and a shelf"\n'
    + blocks(1.0, trolley=0.6)
    + blocks(shelf=0.3)
    + blocks(**{"at a wall": 0.3})
    + "wall_gap_mm = 0\n"
    + laws("housner")
    + motions(20, 12, 0.01, 0)
    + ida(0.1, 0.3, 0.5, 0.8, 1.2)
    + 'polarity = "as recorded"\n[screen]\nundecided = 0.0\n[fit]\nreplicates = 100\n'
    + "[friction]\nstatic = 0.35\ndispersion = 0.3\nkinetic_ratio = 0.85\nslips_m = [0.02, 0.1]\n"
)
FRICTION = LognormalFriction(0.35, 0.3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sliding")


@pytest.fixture(scope="module")
def study(folder):
    return study_in(folder, TEXT + YEAR)


@pytest.fixture(scope="module")
def results(study, folder):
    return study.run(folder / "out")


@pytest.fixture(scope="module")
def slid(study):
    runs = tp.ida(study.blocks[:2], study.models, study.design.motions, study.design.levels)
    return slide_runs(runs, study.design.motions, Contact(FRICTION, 0.85))


class TestResults:
    def test_chances_of_friction(self, results):
        for i, level in enumerate((0.6, 0.3 / 1.8)):
            below, near = (norm.cdf(np.log(level * times / 0.35) / 0.3) for times in (1.0, 1.3))
            assert float(results["slides_instead"][i]) == pytest.approx(below, rel=1e-12)
            assert float(results["friction_near_uplift"][i]) == pytest.approx(near - below, rel=1e-12)
        assert np.isnan(results["slides_instead"][2])

    def test_slips_are_those_of_slide_runs(self, results, slid):
        for j, distance in enumerate((0.02, 0.1)):
            found = overturning_probability(slid, state=Slip(distance))
            for ours, theirs in (("", "probability"), ("_lower", "lower"), ("_upper", "upper")):
                np.testing.assert_array_equal(results[f"slip_probability{ours}"][:2, j], found[theirs][:, 0])
        assert np.isnan(results["slip_probability"][2]).all()
        np.testing.assert_allclose(results["slide_probability"][:2], (slid["mode"] == 1).mean("motion")[:, 0])

    def test_rates_are_those_of_the_isotonic_curve(self, results, slid, study):
        """Above the highest level a block slides if its friction is below b/h: the rule counts every block there."""
        above, compared = study.risk.hazard.rate_at(1.2 * 9.80665), 0
        options = {"form": "isotonic", "replicates": 100, "seed": study.fit.seed, "keep_replicates": True}
        for i in range(2):  # (the curves of each block are drawn for themselves)
            share = float(results["slides_instead"][i])
            curve = fit_fragility(slid.isel(block=[i]), state=Slip(0.02), **options)
            if float(curve["probability"].max()) <= share:  # (draws of the friction leave no more than it has)
                rate = float(study.risk.rates(curve, 0.95)["rate"].squeeze())
                assert float(results["slip_rate"][i, 0]) == pytest.approx(rate - (1.0 - share) * above, rel=1e-12)
                compared += 1
            limited = {name: (curve[name] / share).clip(max=1.0) for name in ("probability", "probability_sample")}
            rules = {"": "most", "_lower": "least", "_upper": "most"}  # (of what is above the highest level)
            for end, rule in rules.items():
                ends = study.risk.rates(curve.assign(limited), 0.95, rule)
                expected = share * float(ends[f"rate{end}"].squeeze())
                assert float(results[f"slip_rate{end}"][i, 0]) == pytest.approx(expected, rel=1e-12)
        assert compared

    def test_gated_chances_are_what_is_left(self, results):
        rocks = 1.0 - results["slides_instead"]
        for gated, plain in (("gated_rate", "rate"), ("gated_probability", "probability")):
            expected = (results[plain] * rocks).transpose(*results[plain].dims)
            np.testing.assert_array_equal(results[gated], expected)

    def test_falls_stay_those_of_blocks_that_cannot_slide(self, results, folder):
        (folder / "plain.toml").write_text(TEXT.partition("[friction]")[0] + YEAR)
        plain = tp.Study.from_toml(folder / "plain.toml").run()
        for name in ("probability", "median", "rate"):
            np.testing.assert_array_equal(results[name], plain[name])
        assert "slides_instead" not in plain

    def test_notes(self, results):
        said = {fact.what: fact for fact in notes_of(results)}
        assert said["sliding.held"].names == ("at a wall",)
        assert said["sliding.squat"].names == ("trolley",)
        assert "sliding.model" in facts_of(method_of, results)

    def test_known_friction_and_no_hazard(self, folder):
        text = TEXT.replace("dispersion = 0.3\n", "").replace('"pga"\n', '"pgv"\n').replace('"g"', '"m/s"')
        (folder / "known.toml").write_text(text)
        found = tp.Study.from_toml(folder / "known.toml").run()
        assert found["slides_instead"].values[:2].tolist() == [1.0, 0.0]
        assert (found["gated_probability"][0] == 0.0).all()
        assert (found["slip_probability"][1] == 0.0).all()
        assert "slip_rate" not in found
