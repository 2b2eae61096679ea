"""Studies of pieces near edges: how likely they slide off, and fall at all, in results and on pages; refusals."""

import numpy as np
import pytest
from study_texts import YEAR, motions

import toppling as tp
from toppling.core.facts import Fact
from toppling.fragility import fit_fragility, overturning_probability, slide_runs
from toppling.models.friction import Contact, FixedFriction, LognormalFriction
from toppling.studies.facts.notes import notes_of
from toppling.studies.file.blocks import read_blocks
from toppling.studies.tables.slides import slides

BENCH = """[[blocks]]
name = "analyser"
width_m = 0.2
height_m = 0.6
edge_distance_mm = 40
falls_when = "foot"
"""
TEXT = """
title = "A bench"
{blocks}
[[blocks]]
name = "cabinet"
width_m = 0.3
height_m = 1.8
[[models]]
law = "housner"
[[models]]
law = "discrete"
delta = 0.01
[ida]
im = "pga"
levels = {{ values = [0.1, 0.3, 0.5, 0.8, 1.2], unit = "g" }}
{polarity}
[screen]
undecided = 0.0
[fit]
replicates = 100
{fit}
{more}
"""
SHAKES = motions(20, 12, 0.01, 0)
FRICTION = "[friction]\nstatic = 0.35\ndispersion = 0.3\nkinetic_ratio = 0.85\n"


def study(folder, more=FRICTION + YEAR, blocks=BENCH, polarity="", fit="", name="study"):
    (folder / f"{name}.toml").write_text(TEXT.format(blocks=blocks, more=more, polarity=polarity, fit=fit) + SHAKES)
    return tp.Study.from_toml(folder / f"{name}.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("edges")


@pytest.fixture(scope="module")
def bench(folder):
    return study(folder)


@pytest.fixture(scope="module")
def results(bench, folder):
    return bench.run(folder / "out")


@pytest.fixture(scope="module")
def rocking(bench):
    return tp.ida(bench.blocks[:1], bench.models, bench.design.motions, bench.design.levels)


@pytest.fixture(scope="module")
def slid(bench, rocking):
    friction = LognormalFriction(0.35, 0.3)
    return slide_runs(rocking, bench.design.motions, Contact(friction, 0.85), polarity="both")


class TestResults:
    def test_the_rocking_runs_stay_one_way(self, bench):
        assert not bench.design.both_ways

    def test_falls_over_the_edge_are_those_of_slide_runs_both_ways(self, results, slid):
        found = overturning_probability(slid, state="fallen_off")
        for ours, theirs in (("", "probability"), ("_lower", "lower"), ("_upper", "upper")):
            np.testing.assert_array_equal(results[f"fall_off_probability{ours}"][0], found[theirs][0, 0])
        assert 0.0 < float(found["probability"].max()) < 1.0

    def test_either_is_counted_run_by_run(self, results, slid, rocking):
        """Overturned as if it could not slide, or over the edge, under the same motion: by brute force."""
        fell = slid["fallen_off"].values[0, 0].reshape(5, 20, 200)
        for k in range(2):
            either = rocking["overturned"].values[0, k][:, :, None] | fell
            np.testing.assert_allclose(results["falls_probability"][0, k], either.mean(axis=(1, 2)), rtol=1e-12)
        alone = results["probability"][0].values
        product = 1.0 - (1.0 - alone) * (1.0 - results["fall_off_probability"][0].values)
        assert (results["falls_probability"][0].values >= alone).all()
        assert (results["falls_probability"][0].values != product).any()

    def test_rate_of_falls_over_the_edge(self, results, slid, bench):
        options = {"replicates": 100, "seed": bench.fit.seed, "keep_replicates": True}
        rates = bench.risk.rates(fit_fragility(slid, state="fallen_off", **options), 0.95)
        above = bench.risk.hazard.rate_at(1.2 * 9.80665)  # (where a block with friction above b/h stays)
        expected = float(rates["rate"].squeeze()) - (1.0 - float(results["slides_instead"][0])) * above
        assert float(results["fall_off_rate"][0]) == pytest.approx(expected, rel=1e-12)
        for end in ("", "_lower", "_upper"):
            chance = -np.expm1(-50.0 * float(results[f"fall_off_rate{end}"][0]))
            assert float(results[f"fall_off_risk_probability{end}"][0]) == pytest.approx(chance, rel=1e-12)

    def test_either_has_the_rate_of_overturning_and_its_raise(self, results, bench):
        """The raise between the levels: the difference of the two isotonic curves against the hazard."""
        x = np.geomspace(0.1, 1.2, 400_001)
        at = np.log(np.array([0.1, 0.3, 0.5, 0.8, 1.2]))
        rates = bench.risk.hazard.rate_at(9.80665 * x)
        for k in range(2):
            names = ("falls_probability", "probability")
            either, alone = (np.maximum.accumulate(results[name][0, k].values) for name in names)
            more = np.interp(np.log(x), at, either - alone)
            inside = np.sum(0.5 * (more[1:] + more[:-1]) * (rates[:-1] - rates[1:]))
            below = float(either[0]) * (float(bench.risk.hazard.rate_at(9.80665e-6)) - rates[0]) if either[0] else 0.0
            above = (1.0 - float(alone[-1])) * rates[-1]
            raised = float(results["falls_rate"][0, k] - results["rate"][0, k])
            assert raised == pytest.approx(inside + below + above, rel=1e-4)
            assert raised > 0.0


def test_slips_have_words_that_are_called_judgement(results):
    """Those of a study's own slips have none (`test_sliding`)."""
    words = "over 5 cm it touches a neighbour, over 10 cm it tears its service line, over 30 cm it blocks an aisle"
    assert any(note.endswith(f" by slip: {words}.") for note in slides(results).notes)


class TestOwnFriction:
    """Blocks with friction or a contact of their own, beside that of the study."""

    OWN = BENCH + "friction = 0.2\nfriction_dispersion = 0.1\n"

    @pytest.mark.slow
    def test_slips_and_chances_are_of_it(self, folder, results):
        found = study(folder, blocks=self.OWN, name="own").run()
        below = LognormalFriction(0.2, 0.1).below(np.array([0.2 / 0.6]))
        assert float(found["slides_instead"][0]) == pytest.approx(float(below[0]), rel=1e-12)
        assert float(found["fall_off_rate"][0]) > float(results["fall_off_rate"][0])
        for name in ("slides_instead", "slip_probability", "slip_rate"):
            np.testing.assert_array_equal(found[name][1], results[name][1])

    def test_a_contact_brings_its_kinetic_friction(self, folder):
        own = study(folder, blocks=BENCH + 'contact = "vinyl"\n', more="[friction]\nstatic = 0.6\n", name="contact")
        assert own.slides.ratio_of(own.blocks[0]) == 0.85
        assert own.slides.friction_of(own.blocks[0]) == LognormalFriction(0.35, 0.30)
        assert own.slides.ratio_of(own.blocks[1]) == 1.0
        assert own.friction["cabinet"] == FixedFriction(0.6)
        known = study(folder, blocks=BENCH + "friction = 0.4\n", name="known")
        assert known.slides.ratio_of(known.blocks[0]) == 0.85


def of_edges(found):
    return [fact for fact in notes_of(found) if fact.what == "sliding.edge_unknown"]


def unknown(why):
    return Fact("sliding.edge_unknown", names=("analyser",), more={"why": why})


class TestNotes:
    def test_an_edge_without_friction_is_told(self, folder):
        found = study(folder, YEAR, name="unknown").run()
        assert of_edges(found) == [unknown("friction")]
        assert "fall_off_probability" not in found

    @pytest.mark.slow
    def test_other_states_and_clouds(self, folder):
        found = study(folder, fit='state = "uplifted"', name="uplifted").run()
        assert of_edges(found) == [unknown("state")]
        text = (TEXT.format(blocks=BENCH, more=FRICTION, polarity="", fit="") + SHAKES).replace("[ida]", "[cloud]")
        (folder / "cloud.toml").write_text("\n".join(one for one in text.splitlines() if not one.startswith("levels")))
        found = tp.Study.from_toml(folder / "cloud.toml").run()
        assert of_edges(found) == [unknown("cloud")]


class TestKeys:
    def test_files_of_blocks(self, folder):
        file = folder / "blocks.csv"
        head = "name,width_m,height_m,wall_gap_mm,edge_distance_mm,edge_distance_back_mm,falls_when\n"
        file.write_text(f"{head}a,0.4,0.6,,40,,foot\nb,0.4,0.6,,,10,\nc,0.4,0.6,,,,\n")
        assert [one.edge for one in read_blocks(file)] == [tp.Edge(0.04, None, "foot"), tp.Edge(None, 0.01), None]


@pytest.mark.slow
def test_a_block_that_never_overturns_may_fall_off(folder):
    """Its curve of overturning has no rate, which counts as 0."""
    found = study(folder, blocks=BENCH.replace("0.2", "0.4"), name="squat").run()
    assert (found["probability"][0] == 0.0).all()
    assert np.isnan(found["rate"][0]).all()
    np.testing.assert_allclose(found["falls_rate"][0], found["fall_off_rate"][0], rtol=1e-12)
