"""What a signing engineer is told: notes of curves and rates, hazards of another place, rates of uncertain blocks."""

import json

import numpy as np
import pytest
import scipy
import xarray as xr
from check_facts import check as check_of, numbers_in
from study_texts import BLOCKS, HAZARD, IDA, motions

import toppling as tp
from toppling.fragility import uncertain_ida
from toppling.studies import StudyError
from toppling.studies.buildings.assessment import covering
from toppling.studies.command.cli import main
from toppling.studies.facts.notes import notes_of
from toppling.studies.tables.fragility import curves, measures, sizes
from toppling.studies.text.curve_notes import (
    curve_notes,
    misfit_notes,
    rate_bounds,
    rate_notes,
)
from toppling.studies.text.one_side import one_side_notes

MODELS = """
[[models]]
law = "housner"

[[models]]
law = "discrete"
"""
MOTIONS = motions(20)
POINTS = """
[hazard]
levels = [0.01, 0.05, 0.2]
rates = [1e-1, 1e-2, 1e-3]
unit = "g"
"""
BUILDING = """
[building]
kind = "flexural-shear"
period_s = 0.5
storeys = 2
"""
UNCERTAIN = """
[uncertainty]
samples = 6
seed = 3

[uncertainty.inputs]
e = { distribution = "uniform", lower = 0.85, upper = 1.0 }
R_factor = { distribution = "lognormal", median = 1.0, dispersion = 0.1, lower = 0.7, upper = 1.4 }
"""
LEVELS = np.exp(np.linspace(0.0, np.log(12.0), 7))
PIECES = [tp.Block(0.35, 1.6, name="narrow"), tp.Block(0.6, 1.6, name="wide")]
LAWS = [tp.HousnerImpact(), tp.DiscreteDamping()]
SCREEN = "[screen]\nundecided = 0.0\n"


def shakes(n=20):
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(n, seed=1)


def study(folder, *parts):
    path = folder / "study.toml"
    path.write_text('title = "a study"\n' + "".join(parts), encoding="utf-8")
    return tp.Study.from_toml(path)


def fitted(status, lower, upper, fell, runs=40):
    """One curve for each status, on block."""
    names = [f"block {i}" for i, _ in enumerate(status)]
    curves = xr.Dataset(
        {
            "status": ("block", status),
            "half_level": ("block", np.sqrt(np.array(lower) * np.array(upper))),
            "half_level_lower": ("block", lower),
            "half_level_upper": ("block", upper),
        },
        {"block": names},
    )
    return curves, xr.DataArray(fell, dims="block"), xr.DataArray(np.full(len(fell), runs), dims="block")


def extrapolated(facts):
    """The sides and the cures of rates from beyond the runs."""
    return {(fact.more["side"], fact.more["cure"]) for fact in facts if fact.what == "rate.extrapolated"}


class TestCurves:
    def test_nothing_is_said_of_sound_curves(self):
        assert curve_notes(*fitted(["ok", "ok"], [1.0, 2.0], [2.0, 4.0], [5, 35]), "overturning") == []

    def test_few_runs_on_either_side(self):
        few, many = curve_notes(*fitted(["ok"] * 3, [1.0] * 3, [1.5] * 3, [4, 20, 36]), "overturning")
        assert (few.what, few.value, few.names, few.more["values"]) == ("curve.few_reached", 1, ("block 0",), [[4, 40]])
        assert (many.what, many.names, many.more["values"]) == ("curve.few_stayed", ("block 2",), [[4, 40]])

    def test_more_than_three_are_counted(self):
        (note,) = curve_notes(*fitted(["ok"] * 5, [1.0] * 5, [1.5] * 5, [1] * 5), "uplift")
        assert (note.value, note.more["of"], note.more["state"], len(note.names)) == (5, 5, "uplift", 3)

    def test_wide_and_open_intervals(self):
        (note,) = curve_notes(*fitted(["ok"] * 4, [1.0] * 4, [2.0, 2.1, 1e9, 1.9], [20] * 4), "overturning")
        assert (note.what, note.names) == ("curve.wide_interval", ("block 1", "block 2"))
        assert note.more["values"] == pytest.approx([2.1, 1e9])
        # a curve that is not there has no interval, whatever bounds it has
        curves, fell, runs = fitted(["no overturning"], [1.0], [np.inf], [0])
        (note,) = curve_notes(curves.assign(half_level=("block", [np.nan])), fell, runs, "overturning")
        assert note.more["values"] == [[0, 40]]

    def test_fits_that_miss_their_runs(self):
        """Curves are named whose median, or level of 10 %, lies outside the interval of the runs' own."""
        curves, _, _ = fitted(["ok"] * 3, [1.0] * 3, [1.1] * 3, [20] * 3)
        found = curves.assign(misfit=("block", [0.0, 0.034, 0.0]), misfit_low=("block", [0.0, -0.2, 0.11]))
        half, low = misfit_notes(found, "overturning")
        assert (half.what, half.names, half.more["values"]) == ("curve.misfit", ("block 1",), [0.034])
        assert (low.what, low.value, low.more["values"]) == ("curve.misfit_low", 2, [-0.2, 0.11])
        assert misfit_notes(found.isel(block=[0]), "overturning") == []

    def test_separated_data_of_a_study(self, tmp_path):
        """A pulse overturns at one level and from there on: its curves are separated, and the study says so."""
        pulse = '[motions]\npulse = "one-cycle-sine"\nomega_rad_s = 4.0\n'
        found = study(tmp_path, BLOCKS, MODELS, pulse, IDA, SCREEN).run()
        assert (found["status"] == "separated").all()
        notes = {fact.what: fact for fact in notes_of(found)}
        assert notes["curve.separated"].value == notes["curve.separated"].more["of"] == 4
        assert notes["validity.few_motions"].more["motions"] == 1

    def test_one_value_is_no_range(self):
        one, two = (tp.ida(PIECES[:n], LAWS, shakes()[:1], [2.0]) for n in (1, 2))
        said = " ".join(tp.fragility.notes(one))
        assert "below 0.22 at" in said
        assert "of 1/2" in said
        assert "0.22 to 0.37" in " ".join(tp.fragility.notes(two))

    def test_counts_are_of_every_floor(self, tmp_path):
        building = BUILDING + "floors = [1, 2]\n"
        low = IDA.replace("to = 12.0", "to = 3.0")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, building, low, SCREEN).run()
        fell = found["overturnings"].sum("level")
        few = int((fell < 5).sum())
        assert few > 0
        (note,) = (fact for fact in notes_of(found) if fact.what == "curve.few_reached")
        assert (note.value, note.more["of"]) == (few, 8)


class TestRates:
    @pytest.mark.slow
    def test_shares_beyond_the_hazard_and_the_levels(self, tmp_path):
        """The shares are what annual_rate gives to bins there; the notes name the worst of them."""
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA.replace("12.0", "9.0"), POINTS, SCREEN).run()
        levels = np.exp(np.linspace(0.0, np.log(9.0), 7))
        curves = tp.fit_fragility(tp.ida(PIECES, LAWS, shakes(), levels))
        hazard = tp.HazardCurve.from_points([0.01, 0.05, 0.2], [1e-1, 1e-2, 1e-3], "pga", "g")
        direct = tp.annual_rate(curves, hazard, bins=[1e-12, levels[-1], 1e20])
        np.testing.assert_allclose(found["rate_share_above_levels"], direct["share"].isel(bin=1), rtol=1e-9)
        np.testing.assert_allclose(direct["share"].sum("bin"), 1.0, rtol=1e-9)
        notes = notes_of(found)
        worst = float(found["rate_share_above"].max())
        assert worst > 0.05
        (note,) = (one for one in notes if one.what == "rate.beyond_hazard")
        assert note.value == worst
        assert note.names[0].startswith("wide under ")
        assert (note.more["side"], note.more["end"], note.more["formula"]) == ("above", "0.2 g", False)
        assert ("above", "raise ida.levels.to") in extrapolated(notes)

    def test_what_lies_beyond_the_levels_is_known_to_bounds(self, tmp_path):
        """Shares add up, and no curve that rises on above the last level has a rate outside the bounds."""
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA.replace("12.0", "9.0"), HAZARD, SCREEN).run()
        levels = np.exp(np.linspace(0.0, np.log(9.0), 7))
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        curves = found[["median", "dispersion"]].assign_attrs(form="lognormal", im="pga")
        within = tp.annual_rate(curves, hazard, bins=[1e-12, levels[0], levels[-1], 1e20])["share"]
        np.testing.assert_allclose(found["rate_share_below_levels"], within.isel(bin=0), rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found["rate_share_above_levels"], within.isel(bin=2), rtol=1e-6)
        np.testing.assert_allclose(found["rate_above_highest_level"], hazard.rate_at(levels[-1]), rtol=1e-12)
        fell = scipy.stats.norm.cdf(np.log(levels[-1] / found["median"]) / found["dispersion"])
        np.testing.assert_allclose(found["probability_at_highest_level"], fell, rtol=1e-9)
        low, high = rate_bounds(found)
        assert (low < 1.0).all()
        assert (high > 1.0).all()
        # curves that stay where they are above the last level, and that jump to 1 there
        x = np.geomspace(1e-3, 1e5, 40_001)
        middles, masses = np.sqrt(x[1:] * x[:-1]), -np.diff(hazard.rate_at(x))
        for i, j in np.ndindex(2, 2):
            one = found.isel(block=i, model=j)
            curve = scipy.stats.norm.cdf(np.log(middles / one["median"].item()) / one["dispersion"].item())
            for end, above in ((low, fell[i, j]), (high, 1.0)):
                rate = float(masses @ np.where(middles > levels[-1], above, curve))
                assert end.values[i, j] == pytest.approx(rate / one["rate"].item(), rel=2e-3)

    def test_levels_that_begin_too_high_are_named(self, tmp_path):
        high = IDA.replace("from = 1.0", "from = 3.0")
        assert high != IDA
        steep = HAZARD.replace("k = 2.5", "k = 4.0")
        assert steep != HAZARD
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, high, steep, SCREEN).run()
        assert ("below", "lower ida.levels.from") in extrapolated(notes_of(found))

    def test_nothing_is_said_where_the_curve_has_risen(self):
        """All that shakes harder overturns it: that share of the rate is known."""
        shares = {
            "rate": [1e-4, 1e-4],
            "rate_share_below": [0.02, 0.05],
            "rate_share_above": [0.05, 0.04],
            "rate_share_above_levels": [0.3, 0.3],
        }
        rates = xr.Dataset(
            {name: ("block", values) for name, values in shares.items()},
            {"block": ["a", "b"], "bin": ("bin", [1.0], {"units": "1"})},
        )
        settled = xr.DataArray([0.951, 0.951], dims="block")
        assert rate_notes(rates, settled, (0.1, 1.0), ("lower it", "raise it")) == []
        (note,) = rate_notes(rates, settled - [0.0, 0.01], (0.1, 1.0), ("lower it", "raise it"))
        assert (note.what, note.value, note.names) == ("rate.extrapolated", 0.3, ("b",))
        assert (note.more["side"], note.more["cure"]) == ("above", "raise it")
        rates["rate_share_below"][:] = [0.07, 0.0]
        (note,) = rate_notes(rates, settled, (0.1, 1.0), ("lower it", "raise it"))
        assert (note.what, note.value, note.names) == ("rate.beyond_hazard", 0.07, ("a",))
        assert (note.more["side"], note.more["end"], note.more["formula"]) == ("below", "0.1", False)
        (note,) = rate_notes(rates, settled, (0.1, 1.0), ("lower it", "raise it"), of_formula=True)
        assert note.more["formula"]

    @pytest.mark.slow
    def test_levels_that_are_another_for_every_block(self, tmp_path):
        """In multiples of uplift the last level is another ground motion for each block."""
        ida = '[ida]\nim = "pga_normalised"\nlevels = { values = [0.8, 1.2, 2.0, 3.0], unit = "1" }\n'
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, ida, HAZARD, SCREEN).run()
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        for i, block in enumerate(PIECES):
            curves = tp.fit_fragility(tp.ida(block, LAWS, shakes(), [0.8, 1.2, 2.0, 3.0], "pga_normalised"))
            last = 3.0 * 9.80665 * np.tan(block.alpha)
            share = tp.annual_rate(curves, hazard, bins=[last, 1e9 * last])["share"].values[..., 0]
            np.testing.assert_allclose(found["rate_share_above_levels"].isel(block=i), share.reshape(-1), rtol=1e-9)

    def test_uplift_is_called_so(self, tmp_path):
        """What is counted is in titles and long names, and an interval without width has a sentence."""
        asked = HAZARD + 'probability = 0.2\nalong = "width"\n'
        fit = '[fit]\nstate = "uplifted"\nform = "isotonic"\n'
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, asked, SCREEN, fit).run()
        assert found["rate"].attrs["long_name"].endswith("rate of uplift")
        assert found["intensity_mean"].attrs["long_name"].endswith("that uplifts")
        assert not any("overturn" in str(one.attrs["long_name"]) for name, one in found.items() if "rate" in str(name))
        assert "uplifts" in sizes(found).note
        assert curves(found).columns[1].title.startswith("half uplift at ")
        housner = found.isel(model=0)
        assert (housner["rate_lower"] == housner["rate_upper"]).all()
        assert sum("no width" in cell for cell in curves(found).texts("rate")) == 2
        (note,) = (one for one in notes_of(found) if one.what == "rate.no_width")
        assert (note.value, note.more["of"]) == (2, 4)
        assert [name.split()[:3:2] for name in note.names] == [["narrow", "housner"], ["wide", "housner"]]

    def test_cloud(self, tmp_path):
        strong = MOTIONS.replace("seed = 1", "seed = 1\ns0_m2_s3 = 0.2")
        found = study(tmp_path, BLOCKS, MODELS, strong, '[cloud]\nim = "pga"\n', HAZARD, SCREEN).run()
        highest = float(found["intensity"].max())
        curves = found[["median", "dispersion"]].assign_attrs(form="lognormal", im="pga")
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        share = tp.annual_rate(curves, hazard, bins=[highest, 1e9 * highest])["share"].isel(bin=0)
        np.testing.assert_allclose(found["rate_share_above_levels"], share, rtol=1e-9)
        # (of the wide block none may fall)
        known = found["rate_share_above_levels"].max() > 0.05
        runs = {fact.more["side"]: fact.more["run"] for fact in notes_of(found) if fact.what == "rate.extrapolated"}
        assert ("above" in runs) == bool(known)
        assert {*runs.values()} <= {"motion"}


class TestPlaces:
    """A hazard of the ground and levels of floors are refused before anything runs."""

    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            ((BUILDING, IDA, HAZARD), r"floor 1, 2: set ida.im_at = 'ground', or give that floor's own hazard"),
            ((BUILDING + "floors = [2]\n", IDA, HAZARD), r"of floor 2: set ida.im_at = 'ground'"),
            ((BUILDING, '[cloud]\nim = "pga"\n', HAZARD), "set cloud.im_at = 'ground'"),
            ((BUILDING, IDA + 'im_at = "ground"\n', HAZARD + 'at = "floor"\n'), "hazard.at 'floor' does not go with"),
            ((IDA, HAZARD + 'at = "floor"\n'), "hazard.at 'floor' needs motions of a floor"),
            ((BUILDING, IDA, HAZARD + 'at = "floor"\n'), "is for blocks on one floor, got floors 0, 1, 2"),
            ((BUILDING, IDA, HAZARD, UNCERTAIN), "uncertainty needs the motions of one floor"),
            ((BUILDING + "floors = [2]\n", IDA, HAZARD, UNCERTAIN), "set ida.im_at = 'ground'"),
        ],
    )
    def test_refused(self, tmp_path, parts, message):
        with pytest.raises(StudyError, match=message) as error:
            study(tmp_path, BLOCKS, MODELS, MOTIONS, *parts)
        assert "\n" not in str(error.value)

    @pytest.mark.parametrize(
        "parts",
        [
            (BUILDING + "floors = [0]\n", IDA, HAZARD),
            (BUILDING + "floors = [2]\n", IDA, HAZARD + 'at = "floor"\n'),
            (BUILDING, IDA + 'im_at = "ground"\n', HAZARD),
            (BUILDING + "floors = [2]\n", IDA + 'im_at = "ground"\n', HAZARD, UNCERTAIN),
        ],
    )
    def test_allowed(self, tmp_path, parts):
        assert study(tmp_path, BLOCKS, MODELS, MOTIONS, *parts).risk.hazard.im == "pga"

    def test_floors_of_another_program(self, tmp_path):
        """Their ground motions are not known: only the floor's own hazard helps."""
        t = np.arange(0.0, 2.0, 0.02)
        rows = "\n".join(f"{one:.2f},{np.sin(6.0 * one) * 3.0:.5f}" for one in t)
        (tmp_path / "floors.csv").write_text(f"time,a/3 [m/s2]\n{rows}\n", encoding="utf-8")
        motions = '[motions]\nfloors_file = "floors.csv"\n'
        with pytest.raises(StudyError, match=r"of floor 3: give that floor's own hazard with hazard.at = 'floor'"):
            study(tmp_path, BLOCKS, MODELS, motions, IDA, HAZARD)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return study(tmp_path_factory.mktemp("rates"), BLOCKS, MODELS, MOTIONS, IDA, UNCERTAIN, HAZARD).run()


@pytest.fixture(scope="module")
def runs():
    """What the first block's samples do, by hand."""
    return sampled(PIECES[0])


def sampled(block):
    inputs = tp.fragility.RandomInputs(
        {"e": tp.fragility.Uniform(0.85, 1.0), "R_factor": tp.fragility.Lognormal(1.0, 0.1, 0.7, 1.4)}
    )
    return uncertain_ida(inputs, block, LAWS, shakes(), LEVELS, "pga", "overturned", samples=inputs.sample(6, 3))


class TestUncertainRates:
    def test_every_sample_has_the_rate_of_its_own_curve(self, found, runs):
        hazard = tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g")
        own = found["sample_rate"].isel(block=0)
        for sample in range(6):
            counts = tp.overturning_probability(runs.isel(sample=sample))
            direct = tp.annual_rate(tp.fit_fragility(counts, intervals="wald"), hazard)
            np.testing.assert_allclose(own.isel(sample=sample), direct["rate"], rtol=1e-9)
        np.testing.assert_allclose(found["sample_rate_mean"].isel(block=0), own.mean("sample"), rtol=1e-12)
        ends = np.quantile(own.values, [0.05, 0.5, 0.95], axis=1)
        np.testing.assert_allclose(found["sample_rate_quantile"].isel(block=0), ends, rtol=1e-12)
        chance = (-np.expm1(-50.0 * own.values)).mean(axis=1)
        np.testing.assert_allclose(found["sample_risk_probability_mean"].isel(block=0), chance, rtol=1e-9)

    def test_the_pooled_curve_and_its_rate(self, found, runs):
        """All samples' counts at each level make the curve; its interval is over motions."""
        counts = tp.overturning_probability(runs)[["overturnings", "runs"]].sum("sample", keep_attrs=True)
        curve = tp.fit_fragility(counts)
        own = found.isel(block=0)
        np.testing.assert_allclose(own["median"], curve["median"], rtol=1e-9)
        direct = tp.annual_rate(curve, tp.HazardCurve.power_law(1e-4, 2.5, "pga", "g"))
        np.testing.assert_allclose(own["rate"], direct["rate"], rtol=1e-8)
        assert ((own["rate_lower"] < own["rate"]) & (own["rate"] < own["rate_upper"])).all()
        # twenty motions, not 120 runs a level: independent runs would make the interval far narrower
        narrow = curve["median_upper"] / curve["median_lower"]
        assert (own["median_upper"] / own["median_lower"] > 1.05 * narrow).all()

    def test_the_interval_is_over_motions(self, runs):
        """With every sample alike, the pooled curve is the block's own, and so is its interval."""
        from toppling.studies.plan.estimates import Fit
        from toppling.studies.plan.samples import pooled_curves

        one = runs.isel(sample=[0])
        again = xr.concat([one, one, one], "sample")
        own, pooled = (pooled_curves(data, Fit(replicates=100), keep=False) for data in (one, again))
        np.testing.assert_allclose(pooled["median"], own["median"], rtol=1e-6)
        for end in ("lower", "upper"):
            np.testing.assert_allclose(pooled[f"median_{end}"], own[f"median_{end}"], rtol=0.05)

    def test_what_made_it_is_kept_of_every_block(self, found):
        configuration = json.loads(found.attrs["configuration"])
        assert [one["name"] for one in configuration["blocks"]] == ["narrow", "wide"]
        assert "block" not in configuration
        assert configuration["samples"]["seed"] == 3
        whole = 2 * 2 * 6 * 7 * 20 * (300 + 1062)  # (the motions come to rest)
        assert json.loads(found.attrs["skipped"])["samples"] == pytest.approx(whole, rel=0.01)

    @pytest.mark.slow
    def test_tables_and_export(self, tmp_path, capsys):
        path = tmp_path / "study.toml"
        fit = "[fit]\nfractiles = [0.1]\nreplicates = 100\n"
        study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, UNCERTAIN, HAZARD, fit)
        assert main(["run", str(path), "--out", str(tmp_path / "out"), "--verbose"]) == 0
        out = capsys.readouterr().out
        assert all(title in out for title in ("Fragility curves and rates", "once in"))
        assert main(["export", str(tmp_path / "out/results.nc"), "--format", "csv", "--model", "housner"]) == 0
        assert numbers_in(capsys.readouterr().out)[0] == 2
        rows = (tmp_path / "out/export/curves.csv").read_text(encoding="utf-8").splitlines()
        with xr.open_dataset(tmp_path / "out/results.nc") as stored:
            assert f"{stored['median'].values[0, 0]:.9g}" in f"{float(rows[1].split(',')[5]):.9g}"

    @pytest.mark.slow
    def test_a_sample_without_a_curve_is_said(self, tmp_path):
        low = IDA.replace("to = 12.0", "to = 2.6")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, low, UNCERTAIN, HAZARD).run()
        missing = int(found["sample_rate"].isnull().sum())
        assert missing > 0
        (note,) = (one for one in notes_of(found) if one.what == "uncertainty.samples_without_rate")
        assert (note.value, note.more["samples"]) == (missing, 24)

    @pytest.mark.slow
    def test_other_forms_and_methods(self, tmp_path):
        asked = '[fit]\nform = "log-logistic"\nmethod = "first-overturning"\nreplicates = 100\n'
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, UNCERTAIN, asked).run()
        direct = tp.fit_fragility(
            sampled(PIECES[1]).isel(sample=4), form="log-logistic", method="first-overturning", intervals="wald"
        )
        np.testing.assert_allclose(found["sample_median"].isel(block=1, sample=4), direct["median"], rtol=1e-9)
        assert found.attrs["form"] == "log-logistic"

    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            ((IDA, "[measures]\n"), "has no measures: measures are ranked for known blocks"),
            ((IDA, '[fit]\nform = "isotonic"\n'), "fit.form of a study with uncertainty must be one of lognormal"),
            ((IDA, '[fit]\nstate = "uplifted"\n'), "fit.state of a study with uncertainty must be 'overturned'"),
            ((IDA, HAZARD + 'probability = 0.1\nalong = "width"\n'), "hazard.probability is not for a study with unc"),
            (('[cloud]\nim = "pga"\n',), "uncertainty needs ida"),
            ((IDA.replace('"pga"', '"pga_normalised"').replace("m/s2", "1"), HAZARD), "set ida.im = 'pga'"),
            ((IDA, '[fit]\nform = "weibull"\n', HAZARD), "hazard needs curves whose rates are known exactly"),
        ],
    )
    def test_refused_with_the_reason(self, tmp_path, parts, message):
        with pytest.raises(StudyError, match=message) as error:
            study(tmp_path, BLOCKS, MODELS, MOTIONS, *parts, UNCERTAIN)
        assert "\n" not in str(error.value)


INVENTORY = "item,width_m,height_m,floor,count,value,currency\nshelf,0.35,1.8,0,3,100,EUR\n"
PERFORMANCE = """
[performance]
inventory = "things.csv"
im = "pga"
levels = { values = [1.0, 2.0, 4.0, 8.0], unit = "m/s2" }
replicates = 100
"""


class TestPerformance:
    def test_what_comes_from_beyond_the_hazard_curve(self, tmp_path):
        """The share of the rarer events alone, of straight lines between the levels, summed in small steps."""
        (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")
        plan = study(tmp_path, MODELS, MOTIONS, PERFORMANCE, POINTS)
        found = plan.run()
        at = np.log(found["level"].values)
        x = np.linspace(2.0 * at[0] - at[1], at[-1], 100_001)
        rates = covering(plan.hazard, found["level"].values).rate_at(np.exp(x))
        shares = []
        for number in found["number_mean"].sel(place="building").values:
            falls = np.interp(0.5 * (x[1:] + x[:-1]), [x[0], *at], [0.0, *number])
            every, rarer = (
                falls @ -np.diff(one) + number[-1] * one[-1]
                for one in (rates, np.minimum(rates, plan.hazard.rates[-1]))
            )
            shares.append(rarer / every)
        share = max(shares)
        assert share > 0.05
        (note,) = (one for one in notes_of(found) if one.what == "rate.share_beyond_hazard")
        assert (note.more["side"], note.more["formula"]) == ("above", False)
        (told,) = (part for part, text in note.more["shares"] if text == "overturnings")
        assert told == pytest.approx(share, rel=1e-3)

    @pytest.mark.parametrize(("number", "coarse"), [(5, True), (25, False)])
    def test_coarse_levels_are_said(self, tmp_path, number, coarse):
        """Lines and cubics through few levels differ, and which of them is right nobody knows."""
        (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")
        levels = f'levels = {{ from = 0.5, to = 30.0, number = {number}, spacing = "log", unit = "m/s2" }}\n'
        asked = f'[performance]\ninventory = "things.csv"\nim = "pga"\nreplicates = 100\n{levels}'
        found = study(tmp_path, MODELS, MOTIONS, asked, '[hazard]\nunit = "g"\nk0 = 1e-4\nk = 3.5\n').run()
        said = [fact for fact in notes_of(found) if fact.what == "hazard.levels_coarse"]
        assert bool(said) == coarse, said
        if coarse:
            assert min(share for share, _ in said[0].more["shares"]) > 0.1
            assert "overturnings" in {text for _, text in said[0].more["shares"]}

    def test_the_level_of_the_ranking_is_said(self, tmp_path):
        (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")
        found = study(tmp_path, MODELS, MOTIONS, PERFORMANCE).run()
        assert [fact.names for fact in notes_of(found) if fact.what == "building.middle_level"] == [("0.408 g",)]
        given = study(tmp_path, MODELS, MOTIONS, PERFORMANCE + "at_level = 8.0\n").run()
        assert "building.middle_level" not in {fact.what for fact in notes_of(given)}

    @pytest.mark.slow
    def test_pieces_are_exported_and_no_curves(self, tmp_path, capsys):
        (tmp_path / "things.csv").write_text(INVENTORY, encoding="utf-8")
        study(tmp_path, MODELS, MOTIONS, PERFORMANCE).run(tmp_path / "out")
        assert main(["export", str(tmp_path / "out/results.nc"), "--format", "csv"]) == 0
        table = (tmp_path / "out/export/pieces.csv").read_text(encoding="utf-8")
        columns = ["item", "room", "floor", "pieces", "damping_law", "level (m s-2)", "probability_at_level (1)"]
        assert table.splitlines()[0].split(",")[:7] == columns
        assert main(["export", str(tmp_path / "out/results.nc"), "--format", "nrml"]) == 2
        said = capsys.readouterr().err
        assert "performance study" in said
        assert "csv, xlsx or" in said


class TestTables:
    def test_fractiles_are_printed(self, tmp_path):
        fit = "[fit]\nfractiles = [0.1, 0.9]\nreplicates = 100\n"
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, SCREEN, fit).run()
        table = curves(found)
        assert [column.key for column in table.columns][3:] == ["P = 0.1", "P = 0.9"]
        level = [float(found[f"fraction_level{end}"][0, 0, 0]) / 9.80665 for end in ("", "_lower", "_upper")]
        assert level[1] == 0.0  # (of 24 motions two fall on average: none at all is no surprise)
        assert table.lines[0]["P = 0.1"] == pytest.approx(level)
        assert " (below " in table.texts("P = 0.1")[0]

    def test_rates_have_three_digits_and_say_what_their_intervals_hold(self, tmp_path):
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, HAZARD, SCREEN).run().copy(deep=True)
        found["rate"][0, 0], found["rate_lower"][0, 0], found["rate_upper"][0, 0] = 1 / 2137.0, 0.0, 1 / 1804.0
        for end, value in (("", 0.023456), ("_lower", 0.0), ("_upper", 0.0271)):
            found[f"risk_probability{end}"][0, 0] = value
        table = curves(found)
        texts = [table.texts(key)[0] for key in ("rate", "chance")]
        assert texts == ["2,140 (above 1,800)", "2.35\u00a0% (0–2.71)"]

    def test_open_intervals_are_words(self, tmp_path):
        """No terminal table says inf: of no level."""
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, SCREEN, "[fit]\nfractiles = [0.1]\nreplicates = 100\n")
        found = found.run().copy(deep=True)
        g = 9.80665
        for end, value in (("", 3.0 * g), ("_lower", 2.1 * g), ("_upper", np.inf)):
            found[f"half_level{end}"][0, 0] = value
        found["dispersion_lower"][0, 0], found["dispersion_upper"][0, 0] = 0.0, np.inf
        found["fraction_level_upper"][0, 0] = np.inf
        table = curves(found)
        assert table.texts("level")[0] == "3.00 (above 2.10)"
        assert table.texts("dispersion")[0].endswith(" (not known)")
        assert "inf" not in str([*table.groups])

    def test_the_table_of_measures_says_how_many_it_leaves_out(self, tmp_path):
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, SCREEN, "[measures]\n").run()
        few, every = measures(found, 3), measures(found, 50)
        groups = [len(rows) for _, rows in every.groups]
        assert [len(rows) for _, rows in few.groups] == [3] * len(groups)
        assert numbers_in(few.note) == [3, max(groups)]
        assert "measures" not in every.note
        assert any(measure.startswith("√(Arias intensity)") for measure in every.column("measure"))

    def test_the_remedy_of_curves_that_are_not_fitted_is_of_the_levels(self, tmp_path):
        low = IDA.replace("to = 12.0", "to = 1.1")
        found = study(
            tmp_path, BLOCKS, '[[models]]\nlaw = "housner"\n', MOTIONS, low, SCREEN, "[fit]\nstate = 0.5\n"
        ).run()
        check = check_of(found, "curves")
        assert (check.what, check.names) == ("curve.unfitted", ("no overturning",))
        assert (check.more["number"], check.more["higher"]) == (2, "raise ida.levels.to")


class TestOneSide:
    def test_a_curve_of_one_side_need_not_rise_to_1(self):
        free, touching = (tp.Block(0.3, 1.8, name=name, wall=wall) for name, wall in (("a", None), ("b", tp.Wall())))
        heavy = tp.Block(0.3, 1.8, name="c", cm_offset=0.03)
        every = [free, touching, heavy]
        (found,) = one_side_notes(every, "front", "lognormal")
        assert (found.what, found.names, found.more["state"]) == ("curve.forced", ("a", "c"), "a forward fall")
        assert len(one_side_notes(every, "back", "lognormal")) == 1
        for state, form in (("overturned", "lognormal"), (0.5, "lognormal")):
            assert one_side_notes(every, state, form) == []
        (counted,) = one_side_notes(every, "front", "isotonic")
        assert (counted.what, counted.names) == ("curve.one_side", ("a", "c"))
        assert one_side_notes([touching], "front", "lognormal") == []
