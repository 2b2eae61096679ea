"""Studies at adaptive levels: what they run, what they keep over kills, what they say, and what they refuse."""

import csv
import json
import re

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of, facts_of, notes_named, numbers_in
from real_processes import killed_at, same_after_ten_kills
from study_texts import motions, study_in

import toppling as tp
from toppling.fragility import Slip
from toppling.fragility.adaptive.stopping import usual_motions
from toppling.fragility.adaptive.until import Until
from toppling.fragility.analyses import adaptive
from toppling.fragility.analyses.sparse import weighted_rate_samples
from toppling.models import RandomSliding
from toppling.models.friction import FixedFriction
from toppling.studies.command.cli import main
from toppling.studies.command.forecast import forecast
from toppling.studies.command.status import status_of
from toppling.studies.command.verdict import verdict
from toppling.studies.comparison.curves import compare_curves
from toppling.studies.comparison.sides import two_sides
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import remedy, say
from toppling.studies.plan.designs import KeptMotions
from toppling.studies.plots.fragility import fragility_figure
from toppling.studies.report.page import write_report
from toppling.studies.tables.blocks import lead_blocks, short_blocks
from toppling.studies.tables.fragility import precision
from toppling.studies.tables.slides import slides
from toppling.studies.text.error import StudyError

STUDY = f"""
title = "As many as needed"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[blocks]]
width_m = 0.6
height_m = 1.8
[[models]]
law = "energy-consistent"
{motions(200, 6, 0.02, 4)}[ida]
im = "pga"
levels = "adaptive"
[until]
median = 0.15
motions = {{ least = 32 }}
"""
RATE = STUDY.replace("median = 0.15", "rate = 0.5")
PRECISE = STUDY.replace("median = 0.15", "median = 0.05")
FRICTION = "[friction]\nstatic = 0.3\ndispersion = 0.3\nkinetic_ratio = 0.85\nslips_m = [0.05, 0.2]\n"
HAZARD = '[hazard]\nk0 = 1e-3\nk = 2\nunit = "g"\n'


@pytest.fixture
def study(tmp_path):
    return lambda text=STUDY: study_in(tmp_path, text)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("adaptive")
    return study_in(folder, STUDY).run(folder / "out"), folder / "out/results.nc"


@pytest.fixture(scope="module")
def until_a_rate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rate")
    asked = HAZARD + 'probability = 0.1\nalong = "width"\n'
    return study_in(folder, RATE + asked).run(folder / "out"), folder / "out/results.nc"


SITE = tp.HazardCurve.power_law(1e-3 * 9.80665**2, 2.0, "pga")
BLOCKS, LAW = [tp.Block(0.4, 1.8), tp.Block(0.6, 1.8)], tp.EnergyConsistent()


def in_python(until, blocks=BLOCKS, law=LAW, **options):
    """The analysis of the study without a study."""
    until = {**until, "motions": {"least": 32, "most": 200}}
    return tp.adaptive_ida(blocks, law, tp.motions.CloughPenzien(duration=6.0, dt=0.02), seed=4, until=until, **options)


def own_rates(**options):
    return in_python({"rate": 0.5, "hazard": SITE}, **options)


@pytest.mark.slow
def test_the_rate_that_was_asked_for_is_the_rate_of_the_results(until_a_rate):
    """Rates and chances are without a form of curve, with its interval; the fitted curve's have names of their own."""
    results, _ = until_a_rate
    own = own_rates()
    for end in ("", "_lower", "_upper"):
        np.testing.assert_allclose(results[f"rate{end}"], own[f"rate{end}"], rtol=1e-9)
        np.testing.assert_array_equal(results[f"rate{end}"], results[f"sequential_rate{end}"])
        chance = -np.expm1(-50.0 * own[f"rate{end}"].values)
        np.testing.assert_allclose(results[f"risk_probability{end}"], chance, rtol=1e-9)
        fitted = -np.expm1(-50.0 * results[f"fitted_rate{end}"].values)
        np.testing.assert_allclose(results[f"fitted_risk_probability{end}"], fitted, rtol=1e-9)
    curves = tp.fit_fragility(own, replicates=1000, keep_replicates=True)
    fitted = tp.annual_rate(curves, SITE)
    for end in ("", "_lower", "_upper"):
        np.testing.assert_allclose(results[f"fitted_rate{end}"], fitted[f"rate{end}"], rtol=1e-9)
    # (two estimates of the same)
    assert (np.abs(np.log(results["fitted_rate"] / results["rate"])) < 0.5).all()
    assert "form of curve" in results["rate"].attrs["long_name"]
    for name in ("fitted_rate", "rate_share", "rate_share_above", "rate_share_above_levels", "intensity_mean"):
        assert results[name].attrs["long_name"].endswith("fitted curve")
    assert len(notes_named(results, "rate.form_free")) == 1


def test_tables_say_what_was_asked(finished, until_a_rate):
    assert "15 %" in precision(finished[0]).note
    assert any("form of curve" in note for note in short_blocks(until_a_rate[0]).notes)


def test_a_size_is_found_by_the_rates_without_a_form(until_a_rate):
    results, _ = until_a_rate
    target = -np.log1p(-0.1) / 50.0
    wide, narrow = results["rate"].values[[1, 0], 0]
    assert wide < target < narrow
    share = np.log(narrow / target) / np.log(narrow / wide)
    np.testing.assert_allclose(results["size_width"], 0.4 + 0.2 * share, rtol=1e-9)
    assert results["size_width_lower"].item() < results["size_width"].item() < results["size_width_upper"].item()


def test_replicates_of_a_rate_without_a_form_draw_motions():
    own = own_rates()
    drawn = weighted_rate_samples(own, 2000, seed=3)
    mean, spread = (getattr(drawn, name)("replicate").values for name in ("mean", "std"))
    np.testing.assert_allclose(mean, own["rate"], rtol=0.02)
    # (the lower end of the interval is of the scatter between motions alone)
    reach = own["rate"].values - own["rate_lower"].values
    np.testing.assert_allclose(1.97 * spread, reach, rtol=0.08)
    alone = weighted_rate_samples(own.isel(block=[1]), 2000, seed=3)
    np.testing.assert_array_equal(alone.values[0], drawn.values[1])
    with pytest.raises(ValueError, match="need the weights of runs at adaptive levels, until a rate"):
        weighted_rate_samples(own.drop_vars("weight"), 10)


@pytest.mark.slow
def test_motions_run_both_ways_count_once_in_a_rate():
    """The rate of a block that both ways are alike for is that of the motions as they are."""
    both, plain = own_rates(polarity="both"), own_rates()
    np.testing.assert_allclose(both["rate"], plain["rate"], rtol=0.25)
    np.testing.assert_allclose(both["rate"] / both["rate_of_curve"], 1.0, atol=0.2)
    drawn = weighted_rate_samples(both, 500).mean("replicate")
    np.testing.assert_allclose(drawn, both["rate"], rtol=0.03)


@pytest.mark.slow
def test_modelling_uncertainty_is_in_the_rate_without_a_form(study, until_a_rate):
    """Under a power law it multiplies any rate by exp(k² β²/2)."""
    plain, _ = until_a_rate
    text = RATE + HAZARD + "[fit]\nmodelling_dispersion = 0.4\n"
    results = study(text).run()
    factor = np.exp(0.5 * (2.0 * 0.4) ** 2)
    for name in ("rate", "rate_lower", "rate_upper", "fitted_rate"):
        np.testing.assert_allclose(results[name], factor * plain[name], rtol=1e-6)


@pytest.mark.slow
def test_ratios_at_walls_are_those_of_the_rates_without_a_form(study):
    """Blocks at walls are shaken both ways, which count as one motion."""
    text = RATE.replace(
        "width_m = 0.6\nheight_m = 1.8", 'width_m = 0.4\nheight_m = 1.8\nwall_gap_mm = 20\nname = "at a wall"'
    )
    results = study(text.replace('"energy-consistent"', '"housner"\ngeometry = "linear"') + HAZARD).run()
    free, held = results["risk_probability"].values[:, 0]
    np.testing.assert_allclose(results["chance_ratio"].values[1, 0], held / free, rtol=1e-9)
    assert results["chance_ratio_lower"][1, 0] < held / free < results["chance_ratio_upper"][1, 0]
    np.testing.assert_allclose(results["rate"] / results["fitted_rate"], 1.0, atol=0.15)


@pytest.mark.slow
def test_too_few_falls_leave_a_rate_without_an_interval(study, tmp_path):
    """Fewer than two hundred falls do not show what lies below them, so that the interval has no upper end."""
    text = RATE.replace("number = 200", "number = 40") + HAZARD
    results = study(text).run(tmp_path / "out")
    assert np.isfinite(results["rate"]).all()
    assert np.isinf(results["sequential_rate_upper"]).all()
    for name in ("rate_lower", "rate_upper", "risk_probability_upper"):
        assert results[name].isnull().all()
    fact = next(curves.answer(results))
    assert np.isnan([fact.lower, fact.upper]).all()
    assert "(interval not known)" in say(fact, "page")
    assert "no interval" in lead_blocks(results).texts("chance")[0]
    assert write_report(tmp_path / "out/results.nc", tmp_path / "report.html")


def test_a_curve_that_differs_beyond_error_is_named(until_a_rate):
    results = until_a_rate[0].copy(deep=True)
    results["rate_misfit"][0] = 0.3
    fact = facts_of(curves.answer, results)["rate.fitted_differs"]
    assert fact.value == float(results["fitted_risk_probability"][0, 0])
    assert say(fact, "page") in verdict(results, True)[0]
    assert precision(results).lines[0]["apart"] == 0.3


@pytest.mark.slow
def test_rates_without_a_form_are_compared_and_exported(study, until_a_rate, tmp_path):
    text = RATE.replace("seed = 4", "seed = 5") + HAZARD
    study(text).run(tmp_path / "other")
    with two_sides(until_a_rate[1].parent, tmp_path / "other") as sides:
        lines = [one for one in compare_curves(*sides)[0].lines if one.quantity == "rate"]
        for k, line in enumerate(lines):
            assert line.a.value == sides[0].results["rate"].values[k, 0]
            assert 0.4 < line.ratio.lower < line.b.value / line.a.value < line.ratio.upper < 2.5
    assert main(["export", str(until_a_rate[1]), "--format", "csv", "--out", str(tmp_path / "csv")]) == 0
    (page,) = (tmp_path / "csv").glob("*.csv")
    head, *rows = csv.reader(page.read_text(encoding="utf-8").splitlines())
    found = dict(zip(head, rows[0], strict=True))
    results = until_a_rate[0]
    for name in ("rate", "fitted_rate"):
        (own,) = (value for key, value in found.items() if key.split(" ")[0] == name)
        assert float(own) == pytest.approx(results[name].values[0, 0], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("state", "output"), [('"uplifted"', "uplifted"), ("0.5", "peak_rotation")])
def test_curves_of_other_states(study, state, output):
    results = study(STUDY + f"[fit]\nstate = {state}\n").run()
    own = in_python({"median": 0.15, "state": json.loads(state)})
    np.testing.assert_array_equal(results["half_level"], own["half_level"])
    assert results.attrs["state"] == own.attrs["state"]
    (panel, *_) = fragility_figure(results).axes
    marks = [np.asarray(line.get_ydata()) for line in panel.lines if line.get_marker() == "|"]
    of_runs = [ys for ys in marks if ys.min() > -0.1]  # (the rail of medians lies below)
    assert {round(float(y), 3) for ys in of_runs for y in ys} == {-0.02, 1.02, -0.042, 1.042}  # of both blocks
    one = results.isel(run=results["run_block"].values == 0)
    reached = one[output].values > (0.5 * results["alpha"].values[0] if output == "peak_rotation" else 0)
    assert (of_runs[0] > 0.5).tolist() == reached.tolist()


def counted(monkeypatch):
    """The numbers of the motions made from now on, call by call."""
    made, sample = [], tp.motions.CloughPenzien.sample

    def counting(self, n, seed=0, first=0):
        made.append(range(first, first + n))
        return sample(self, n, seed, first)

    monkeypatch.setattr(tp.motions.CloughPenzien, "sample", counting)
    return made


@pytest.mark.slow
def test_a_generator_makes_only_the_motions_that_are_taken(study, monkeypatch):
    """And the 64 that are looked at before."""
    made = counted(monkeypatch)
    results = study(STUDY.replace("number = 200", "number = 1000000")).run()
    assert sum(map(len, made)) == 64 + results.sizes["motion"] < 400


@pytest.mark.slow
def test_motions_that_are_matched_one_by_one_are_made_before(study):
    scenario = 'generator = "site-based-scenario"\nmagnitude = 6.8\ndistance_m = 15000\nvs30_m_s = 620\n'
    plain = STUDY.replace('generator = "clough-penzien"', scenario).replace("duration_s = 6\ndt_s = 0.02\n", "")
    assert study(plain).design.generator is not None
    assert study(plain).design.motions[0].sizes["motion"] == 64
    matched = study(plain.replace("number = 200", "number = 40\nmatch_gmm = true"))
    assert matched.design.generator is None
    assert matched.design.motions[0].sizes["motion"] == 40


@pytest.mark.slow
def test_both_ways_and_the_weakest_axis_take_a_motion_once(study):
    both = study(STUDY.replace('im = "pga"', 'im = "pga"\npolarity = "both"'))
    assert both.design.until.most == 200
    results = both.run()
    assert (results["motions_run"] >= 32).all()
    assert results.sizes["run"] % 2 == 0


@pytest.mark.slow
@pytest.mark.parametrize("at", [1, 2, 4])
def test_an_interrupted_study_goes_on_and_has_the_same_bytes(at, study, finished, tmp_path, monkeypatch):
    with killed_at(at, monkeypatch, adaptive, "run_rows"):
        study().run(tmp_path / "out")
    found = status_of(tmp_path / "out")
    assert found.state == "interrupted"
    assert bool(found.reached) == (at > 1)
    assert found.lines(tmp_path / "out")[0].endswith(f"at most {study().all_runs:,}")
    if at > 1:
        assert "±15 % asked" in found.lines(tmp_path / "out")[1]
    study().run(tmp_path / "out")
    assert (tmp_path / "out/results.nc").read_bytes() == finished[1].read_bytes()


@pytest.mark.slow
def test_what_was_reached_does_not_go_back_while_waves_are_repeated(study, tmp_path, monkeypatch):
    """A study that goes on repeats its waves from the first one: killed among them, it has what it had."""
    said = []
    for at in (4, 2, 3, 5):
        with killed_at(at, monkeypatch, adaptive, "run_rows") as raised:
            study(PRECISE).run(tmp_path / "out")
        found = status_of(tmp_path / "out")
        # (among the repeated waves, too, it says what is kept, and not how far it has come)
        assert f"interrupted with {found.runs:,} runs kept" in str(raised.value)
        said.append((found.runs, found.reached))
    assert said[0] == said[1] == said[2]
    assert numbers_in(said[0][1])[:3] == [96, 0, 2]
    assert said[3][1].startswith("128 motions,")
    assert said[3][0] > said[0][0]


@pytest.mark.slow
def test_the_log_counts_runs_and_how_many_there_may_be(study, tmp_path, monkeypatch):
    monkeypatch.setattr("toppling.studies.store.watch.LOG_SECONDS", 0.0)
    made = study(STUDY + FRICTION)
    told = []
    made.run(tmp_path / "out", progress=lambda *counts: told.append(counts))
    lines = (tmp_path / "out/run.log").read_text().splitlines()
    on_the_way = [re.search(r"([0-9,]+) runs \(at most ([0-9,]+)\)", one) for one in lines]
    assert {int(one[2].replace(",", "")) for one in on_the_way if one} == {made.all_runs}
    done = re.search(r"finished: ([0-9,]+) runs, ", lines[-1])
    assert done is not None
    assert told[-1][0] < int(done[1].replace(",", "")) < made.all_runs  # (slips are not told, and are runs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("until", "hazard"), [("median = 0.02", ""), ("rate = 0.1", HAZARD), ("median = 0.05", FRICTION)]
)
def test_ten_kills_change_nothing(until, hazard, tmp_path):
    """Killed ten times, whenever it has kept something new, a study has the bytes of an undisturbed run."""
    text = STUDY.replace("number = 200", "number = 2000").replace("median = 0.15", until) + hazard
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    assert same_after_ten_kills(tmp_path)


def test_the_level_of_a_probability_has_the_unit_of_other_levels(study):
    at = 'probability = { level = 0.4, unit = "g", within = 0.05 }'
    assert re.search(r"0\.4 g .*±0\.05", study(STUDY.replace("median = 0.15", at)).words)


def test_the_forecast_has_a_range_that_holds_the_runs(study, finished):
    results, _ = finished
    one = study()
    few, _, many = one.expected.runs
    every = results.sizes["run"] + 4 * int(results["undecided_tested"].sum())
    assert 0.5 * few <= every <= many
    lines = forecast(one)
    assert "at most" in lines[0]
    assert "of runs on" in lines[2]
    # (two curves; 16 motions, 3 of those that look for the curve, are run again four times)
    assert one.work == 2 * (3 * 200 + 3 * 32) + 2 * 4 * (3 * 16 + 3 * 3)
    assert int(results["undecided_tested"].sum()) * 4 <= one.perturbed_runs


@pytest.mark.parametrize(
    ("until", "measured"),
    [
        # means of benchmarks.sequential.promises over lognormal truths of dispersion 0.4
        (Until("median", 0.05, most=20_000), (475, 625)),
        (Until("median", 0.02, most=20_000), (2600, 4350)),
        (Until("dispersion", 0.1, most=20_000), (824, 832)),
        (Until("rate", 0.1, most=20_000), (4149, 4224)),
        (Until("probability", 0.03, 1.5, most=20_000), (912, 1432)),
    ],
)
def test_motions_forecast_are_those_measured(until, measured):
    few, usual, many = usual_motions(until)
    assert few < measured[0] < measured[1] < many
    assert 0.75 * measured[0] < usual < 1.35 * measured[1]


def test_what_is_not_reached_is_a_note(study):
    results = study(STUDY.replace("median = 0.15", "median = 0.01").replace("number = 200", "number = 64")).run()
    accounts = [fact.names[1] for fact in notes_of(results) if fact.what == "adaptive.account"]
    assert [bool(re.search("±1 .*asked; 64", account)) for account in accounts] == [True, True]


@pytest.fixture(scope="module")
def slipping(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slipping")
    return study_in(folder, STUDY + FRICTION).run(folder / "out"), folder / "out/results.nc"


@pytest.mark.slow
def test_the_table_and_the_report_say_how_far_blocks_slide(slipping):
    results, path = slipping
    table = slides(results)
    assert [numbers_in(column.title) for column in table.columns][1:] == [[], [5], [20]]
    level = [float(results[f"slip_half_level{end}"][0, 0]) / 9.80665 for end in ("", "_lower", "_upper")]
    assert table.lines[0]["0.05"] == pytest.approx(level)
    write_report(path)
    html = path.with_name("report.html").read_text(encoding="utf-8")
    check = check_of(results, "sliding")
    assert (check.what, check.remedy) == ("sliding.share", "remedy_sliding_table")
    assert remedy(check, "checks") in html


def test_the_precision_of_slips_stands_beside_that_of_falls(slipping, study):
    results, _ = slipping
    rows = precision(results).lines
    assert len(rows) == 2 + 4
    name, median, reached, motions, runs, why = rows[2].values()
    assert name.startswith(results["block"].values[0])
    assert "over 5 cm" in name
    assert [*median] == pytest.approx(
        [float(results[f"slip_target{end}"][0, 0]) / 9.80665 for end in ("", "_lower", "_upper")]
    )
    assert reached == float(results["slip_half_width"][0, 0])
    assert reached < 0.15
    assert (int(motions), int(runs)) == (results["slip_motions_run"][0, 0], results["slip_runs"][0, 0])
    assert why == "precision reached"


@pytest.mark.slow
def test_slips_that_missed_their_precision_are_named(study):
    """Those within what was asked that stopped before a second look are not: their intervals hold."""
    coarse = STUDY.replace("number = 200", "number = 48")
    for tolerance, missed in (("0.02", 4), ("0.3", 0)):
        results = study(coarse.replace("median = 0.15", f"median = {tolerance}") + FRICTION).run()
        stopped = results["slip_stopped_because"].values.ravel().tolist()
        assert "precision reached" not in stopped
        wide = results["slip_half_width"].values > float(tolerance)
        assert wide.sum() == missed
        said = [fact.names[1] for fact in notes_named(results, "adaptive.account") if "slides" in fact.names[0]]
        assert len(said) == min(3, missed)
        check = check_of(results, "precision")
        assert check.more["missed"] == (6 if missed else 0)
        if missed:
            assert check.more["curves"] == 6
            assert "6 of 6" in " ".join(verdict(results, True)[0])
            assert [fact.value for fact in notes_named(results, "adaptive.further_slips")] == [1]
            assert "takes about" in said[0]
        else:
            assert check.word == "good"
            assert check.more["unsure"] > 0
            assert "confirming it" in str(results["slip_account"].values[0, 0])


@pytest.mark.slow
def test_motions_are_made_once_for_falls_and_slips(study, slipping, monkeypatch):
    """Frictions of their own are analyses of their own, of the same motions: their results do not change."""
    text = STUDY.replace("width_m = 0.6\n", "width_m = 0.6\nfriction = 0.4\n") + FRICTION
    one = study(text)
    made = counted(monkeypatch)
    results = one.run()
    numbers = [i for part in made for i in part]
    assert len(numbers) == len(set(numbers)) == max(results.sizes["motion"], int(results["slip_motions_run"].max()))
    for name in ("slip_half_level", "slip_dispersion", "slip_account"):
        np.testing.assert_array_equal(results[name][0], slipping[0][name][0])
    assert one.together > study(STUDY).together + 200 * 300 * 8
    monkeypatch.setattr("toppling.studies.plan.designs.KEPT_BYTES", 0.0)
    xr.testing.assert_identical(one.run(), results)


def test_kept_motions_are_those_of_the_seed():
    generator = tp.motions.KanaiTajimi(duration=1.0, dt=0.01)
    kept = KeptMotions(generator)
    for seed in (1, 2, 1):
        np.testing.assert_array_equal(kept.sample(2, seed=seed).values, generator.sample(2, seed=seed).values)


@pytest.mark.slow
def test_each_block_is_screened_with_its_own_friction(study):
    own = STUDY.replace("width_m = 0.6\n", "width_m = 0.6\nfriction = 2.0\n") + FRICTION
    results = study(own).run()
    slides = results["outside"].sel(reason=["slides_at_uplift", "slides_while_rocking", "slides_at_impact"]).values
    assert slides[0].max() > 0.1
    assert slides[1].max() == 0.0
    assert sorted(json.loads(results.attrs["screen"])["friction"]) == sorted(results["block"].values)


@pytest.mark.slow
def test_rates_of_slips_are_weighed_with_the_chance_of_sliding(study):
    """With a known friction that lies between the two b/h one block always slides, and the other never."""
    results = study(STUDY + HAZARD + "[friction]\nstatic = 0.3\nslips_m = [0.1]\n").run()
    assert results["slides_instead"].values.tolist() == [0.0, 1.0]
    own = in_python({"median": 0.15, "state": Slip(0.1)}, BLOCKS[1], RandomSliding(FixedFriction(0.3)))
    curves = tp.fit_fragility(own, state=Slip(0.1), keep_replicates=True)
    rates = tp.annual_rate(curves, SITE)
    assert results["slip_rate"][:, 0].values == pytest.approx([0.0, float(rates["rate"].squeeze())], rel=1e-9)
    assert float(results["slip_rate_upper"][1, 0]) == pytest.approx(float(rates["rate_upper"].squeeze()), rel=1e-9)
    assert results["slip_stopped_because"][:, 0].values.tolist() == ["", "precision reached"]
    np.testing.assert_array_equal(results["gated_rate"], results["rate"] * [[1.0], [0.0]])
    table = slides(results)
    assert numbers_in(table.title) == [50]
    assert [column.key for column in table.columns][2:4] == ["falls", "rests"]
    assert table.cells(table.lines[0])[-1] == "0\u00a0%"


@pytest.mark.slow
def test_slips_that_are_not_reached_are_a_note_and_held_blocks_have_none(study):
    text = STUDY.replace("median = 0.15", "median = 0.02").replace("number = 200", "number = 40")
    text = text.replace("height_m = 1.8", "height_m = 1.8\nwall_gap_mm = 20\nwall_restitution = 0.2", 1)
    results = study(text + FRICTION).run()
    assert np.isnan(results["slip_half_level"][0]).all()
    assert np.isnan(results["slides_instead"][0])
    (said,) = (fact.names for fact in notes_named(results, "adaptive.account") if "slip over 5 cm" in fact.names[0])
    assert re.search("±2 .*asked; 40.*about", said[1])
    table = slides(results)
    assert {*table.cells(table.lines[0])[1:]} == {"–"}


@pytest.mark.slow
def test_slips_are_run_one_way(study):
    """A slip to either side is as long under the reversed motion: runs both ways would tell nothing more."""
    text = STUDY.replace('levels = "adaptive"', 'levels = "adaptive"\npolarity = "both"') + FRICTION
    results = study(text).run()
    assert (results["slip_motions_run"] <= 200).all()
    assert study(text).slide_runs == study(STUDY + FRICTION).slide_runs


@pytest.mark.slow
@pytest.mark.parametrize(("static", "word"), [(0.15, "not valid"), (0.3, "use with care"), (2.0, "good")])
def test_the_check_of_sliding(static, word, study):
    results = study(STUDY + FRICTION.replace("static = 0.3", f"static = {static}")).run()
    assert check_of(results, "sliding").word == word
    if word == "good":
        assert (results["slip_motions_run"] == 0).all()


def test_a_table_that_is_cut_says_so(slipping):
    results, _ = slipping
    many = results.isel(block=np.zeros(130, int))
    table = slides(many)
    assert len(table.rows) == 100
    assert "100 of 130" in table.note


@pytest.mark.slow
def test_slips_beyond_any_shaking_are_a_note(study):
    """So far no motion takes a block at 50 g."""
    results = study(STUDY + FRICTION.replace("[0.05, 0.2]", "[0.05, 10.0]")).run()
    assert float(results["slip_half_level"].max()) > 50.0
    assert any("the highest median" in one for one in results.attrs["notes"].splitlines())


def test_the_forecast_counts_slides(study):
    whole = study(STUDY + FRICTION)
    assert whole.slide_runs == 4 * (3 * 200 + 3 * 32)
    assert f"about {4 * (3 * 96 + 3 * 32):,} runs" in "\n".join(forecast(whole))
    assert study().slide_runs == 0


@pytest.mark.slow
def test_a_law_that_is_elastic_at_rest_is_named_where_uplift_is_sought(study):
    text = STUDY.replace('law = "energy-consistent"', 'law = "energy-consistent"\n[[models]]\nlaw = "discrete"')
    (early,) = notes_named(study(text + '[fit]\nstate = "uplifted"\n').run(), "law.uplifts_early")
    assert [name.partition(" ")[0] for name in early.names] == ["discrete"]


@pytest.mark.parametrize(("state", "tested"), [('"uplifted"', False), ("0.5", False), ('"front"', True)])
def test_stability_is_that_of_falls_at_common_levels_too(study, state, tested):
    text = STUDY[: STUDY.index("[until]")].replace('"adaptive"', '{ values = [0.2, 0.4, 0.8], unit = "g" }')
    text += f"[fit]\nstate = {state}\n"
    results = study(text.replace("number = 200", "number = 30")).run()
    assert ("undecided" in results) == tested
    asked = text.replace("[fit]", "[screen]\nundecided = 0.1\n[fit]")
    if tested:
        assert study(asked).perturbed_runs > 0
        return
    with pytest.raises(StudyError, match=r"screen.undecided tests falls: leave it out with fit.state = "):
        study(asked)
    check = check_of(results, "stability")
    assert (check.what, check.more["state"]) == ("stability.not_tested", results.attrs["state"])
    assert check.remedy == "remedy_stability"


@pytest.mark.slow
def test_the_status_can_be_read_as_json(study, tmp_path, capsys, monkeypatch):
    from toppling.studies.store import folder

    monkeypatch.setattr("toppling.studies.kinds.study.remove_shards", lambda _: None)
    study().run(tmp_path / "out")
    monkeypatch.setattr(folder, "is_locked", lambda _: False)
    assert main(["status", str(tmp_path / "out"), "--json"]) == 0
    assert "all 2 curves" in json.loads(capsys.readouterr().out)["reached"]
