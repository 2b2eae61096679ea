"""What a signing engineer is told: notes of curves and rates, hazards of another place, rates of uncertain blocks."""

import json
import math

import numpy as np
import pytest
import scipy
import xarray as xr
from check_facts import check as check_of, notes_named, numbers_in
from study_texts import BLOCKS, CABINET, HAZARD, IDA, laws, motions, study_of, tower

import toppling as tp
from toppling.fragility import uncertain_ida
from toppling.studies import StudyError
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import notes_said
from toppling.studies.plan.estimates import Fit
from toppling.studies.plan.samples import pooled_curves
from toppling.studies.tables.fragility import curves, measures, sizes
from toppling.studies.text.curve_notes import (
    curve_notes,
    misfit_notes,
    rate_bounds,
    rate_notes,
    spacing_notes,
)
from toppling.studies.text.one_side import one_side_notes

MODELS = laws("housner", "discrete")
MOTIONS = motions(20)
BUILDING = tower(0.5, 2)
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
CURVES = "[fit]\nfractiles = [0.1, 0.9]\nreplicates = 100\n"


def shakes(n=20):
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(n, seed=1)


def study(folder, *parts):
    return study_of(folder, *parts, things=INVENTORY)


@pytest.fixture(scope="module")
def of_all(tmp_path_factory):
    parts = (BLOCKS, MODELS, MOTIONS, IDA, HAZARD, SCREEN, CURVES, "[measures]\n")
    return study(tmp_path_factory.mktemp("all"), *parts).run()


def fitted(status, lower, upper, fell, runs=40):
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

    def test_counts_are_of_every_floor(self, tmp_path):
        low = IDA.replace("to = 12.0", "to = 3.0")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, BUILDING, "floors = [1, 2]\n", low, SCREEN).run()
        few = int((found["overturnings"].sum("level") < 5).sum())
        assert few > 0
        (note,) = notes_named(found, "curve.few_reached")
        assert (note.value, note.more["of"]) == (few, 8)


class TestRates:
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
        assert ("above", "raise ida.levels.to") in extrapolated(notes_of(found))
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
        parts = IDA.replace("from = 1.0", "from = 3.0"), HAZARD.replace("k = 2.5", "k = 4.0")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, *parts, SCREEN).run()
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
        for side, end, of_formula in (("below", "0.1", False), ("above", "1", True)):
            rates["rate_share_below"][:], rates["rate_share_above"][:] = 0.0, 0.0
            rates[f"rate_share_{side}"][:] = [0.07, 0.0]
            (note,) = rate_notes(rates, settled, (0.1, 1.0), ("lower it", "raise it"), of_formula=of_formula)
            assert (note.what, note.value, note.names) == ("rate.beyond_hazard", 0.07, ("a",))
            assert (note.more["side"], note.more["end"], note.more["formula"]) == (side, end, of_formula)

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
        assert "uplift" in sizes(found).title
        assert curves(found).columns[1].title.startswith("half uplift at ")
        housner = found.isel(model=0)
        assert (housner["rate_lower"] == housner["rate_upper"]).all()
        assert sum("no width" in cell for cell in curves(found).texts("rate")) == 2
        (note,) = notes_named(found, "rate.no_width")
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
        ends = own.quantile([0.05, 0.5, 0.95], "sample")
        np.testing.assert_allclose(
            found["sample_rate_quantile"].isel(block=0).transpose("quantile", ...), ends, rtol=1e-12
        )
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
        sample = runs.isel(sample=[0])
        again = xr.concat([sample] * 3, "sample")
        own, pooled = (pooled_curves(data, Fit(replicates=100), keep=False) for data in (sample, again))
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
    def test_a_sample_without_a_curve_is_said(self, tmp_path):
        low = IDA.replace("to = 12.0", "to = 2.6")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, low, UNCERTAIN, HAZARD).run()
        missing = int(found["sample_rate"].isnull().sum())
        assert missing > 0
        (note,) = notes_named(found, "uncertainty.samples_without_rate")
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


INVENTORY = "item,width_m,height_m,floor,count,value,currency\nshelf,0.35,1.8,0,3,100,EUR\n"
GIVEN = 'levels = { values = [1.0, 2.0, 4.0, 8.0], unit = "m/s2" }\n'
PERFORMANCE = f'[performance]\ninventory = "things.csv"\nim = "pga"\nreplicates = 100\n{GIVEN}'


class TestPerformance:
    @pytest.mark.parametrize(("number", "coarse"), [(5, True), (25, False)])
    def test_coarse_levels_are_said(self, tmp_path, number, coarse):
        """Lines and cubics through few levels differ, and which of them is right nobody knows."""
        levels = f'levels = {{ from = 0.5, to = 30.0, number = {number}, spacing = "log", unit = "m/s2" }}\n'
        asked = PERFORMANCE.replace(GIVEN, levels) + '[hazard]\nunit = "g"\nk0 = 1e-4\nk = 3.5\n'
        found = notes_named(study(tmp_path, MODELS, MOTIONS, asked).run(), "hazard.levels_coarse")
        assert bool(found) == coarse, found
        if coarse:
            assert min(share for share, _ in found[0].more["shares"]) > 0.1
            assert "overturnings" in {text for _, text in found[0].more["shares"]}

    def test_the_level_of_the_ranking_is_said(self, tmp_path):
        for more, names in (("", [("0.408 g",)]), ("at_level = 8.0\n", [])):
            found = study(tmp_path, MODELS, MOTIONS, PERFORMANCE + more).run()
            assert [fact.names for fact in notes_named(found, "building.middle_level")] == names


class TestTables:
    def test_fractiles_are_printed(self, of_all):
        table = curves(of_all)
        assert [column.key for column in table.columns if column.key.startswith("P")] == ["P = 0.1", "P = 0.9"]
        level = [float(of_all[f"fraction_level{end}"][0, 0, 0]) / 9.80665 for end in ("", "_lower", "_upper")]
        assert level[1] == 0.0  # (of 24 motions two fall on average: none at all is no surprise)
        assert table.lines[0]["P = 0.1"] == pytest.approx(level)
        assert " (below " in table.texts("P = 0.1")[0]

    def test_rates_have_three_digits_and_open_intervals_are_words(self, of_all):
        found, g = of_all.copy(deep=True), 9.80665
        for name, values in {
            "rate": (1 / 2137.0, 0.0, 1 / 1804.0),
            "risk_probability": (0.023456, 0.0, 0.0271),
            "half_level": (3.0 * g, 2.1 * g, np.inf),
            "dispersion": (0.4, 0.0, np.inf),
            "fraction_level": (1.0, 0.5, np.inf),
        }.items():
            for end, value in zip(("", "_lower", "_upper"), values, strict=True):
                found[f"{name}{end}"][0, 0] = value
        table = curves(found)
        assert [table.texts(key)[0] for key in ("rate", "chance", "level")] == [
            *("2,140 (above 1,800)", "2.35\u00a0% (0–2.71)", "3.00 (above 2.10)"),
        ]
        assert table.texts("dispersion")[0].endswith(" (not known)")
        assert "inf" not in str([*table.groups])

    def test_the_table_of_measures_says_how_many_it_leaves_out(self, of_all):
        few, every = measures(of_all, 3), measures(of_all, 50)
        groups = [len(rows) for _, rows in every.groups]
        assert [len(rows) for _, rows in few.groups] == [3] * len(groups)
        assert numbers_in(few.note) == [3, max(groups)]
        assert "measures" not in every.note
        assert any(measure.startswith("√(Arias intensity)") for measure in every.column("measure"))

    def test_the_remedy_of_curves_that_are_not_fitted_is_of_the_levels(self, tmp_path):
        low = IDA.replace("to = 12.0", "to = 1.1")
        found = study(tmp_path, BLOCKS, laws("housner"), MOTIONS, low, SCREEN, "[fit]\nstate = 0.5\n").run()
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


FIRST = '[fit]\nmethod = "first-overturning"\nreplicates = 100\n'


def test_a_study_says_how_much_its_levels_decide(tmp_path):
    found = study_of(tmp_path, CABINET, motions(40), IDA, FIRST).run()
    (fact,) = (one for one in notes_of(found) if one.what == "curve.first_overturnings")
    later = math.expm1(found["level_shift"].item())
    assert fact.value == pytest.approx(12.0 ** (1.0 / 6.0) - 1.0, rel=1e-9)
    assert (fact.lower, fact.upper) == pytest.approx((later, later), rel=1e-12)


def test_without_a_shift_no_number_is_given():
    curves = xr.Dataset({"level_shift": ("block", [math.nan])}, attrs={"level_spacing": math.nan})
    (fact,) = spacing_notes(curves)
    assert fact.what == "curve.first_overturnings"
    assert all(math.isnan(one) for one in (fact.value, fact.lower, fact.upper))
    assert notes_said([fact])[0].endswith("without an end.")
    assert spacing_notes(xr.Dataset()) == []
