"""Performance assessment: what falls together, in the building and in a year, and what anchoring saves."""

import math
from dataclasses import replace
from itertools import pairwise

import distributed
import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from assessed import anchoring, assess, assessed
from check_results import check_results

import toppling as tp
from toppling.core.wording import short_digits
from toppling.fragility import wilson_interval
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.uncertainty.joint import Variability
from toppling.models.friction import FixedFriction
from toppling.motions import Building
from toppling.studies.buildings import assessment as module
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.notes import notes
from toppling.studies.facts import answer_building as building
from toppling.studies.facts.say import say
from toppling.studies.inventory.consequences import Consequence
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.tables.assessment import annual, at_level

mpl.use("Agg")

LAW = tp.EnergyConsistent()
FRAME = Building.flexural_shear(0.5, storeys=4)
Z = 1.959963984540054  # (95 %)
LEVELS = np.geomspace(0.8, 12.0, 7)
CURVE = tp.HazardCurve(np.geomspace(0.2, 20.0, 12), 0.02 * np.geomspace(0.2, 20.0, 12) ** -1.8, "pga")
SHELF, CASE, FILES = (tp.catalogue[n] for n in ("bookcase-5-shelf", "display-cabinet-glass", "file-vertical-4-drawer"))

INVENTORY = Inventory(
    (
        Contents("shelf", SHELF, 3, 4, value=300.0, consequences=("injury",), anchoring_cost=20.0),
        Contents("case", CASE, 0, 2, value=900.0, consequences=("blocks-exit", "injury"), anchoring_cost=40.0),
        Contents("files", FILES, 3, 5, e=0.85, value=100.0, anchoring_cost=10.0),
        Contents("fixed", SHELF, 1, 3, value=5000.0, consequences=("blocks-exit",), anchored=True),
        Contents("other shelf", SHELF, 3, 1, value=50.0, consequences=("blocks-exit",), anchoring_cost=0.0),
    ),
    "EUR",
)


def shaking(n=24, seed=2):
    return tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(n, seed=seed)


@pytest.fixture(scope="module")
def found():
    return assess(INVENTORY, Assessment([LAW, tp.DiscreteDamping()], shaking(), LEVELS, "pga", FRAME, CURVE))


@pytest.fixture(scope="module")
def anchored():
    """The building with one item anchored, for each."""
    buildings = {}
    for free in (row for row in INVENTORY.rows if not row.anchored):
        rows = tuple(replace(row, anchored=row.anchored or row is free) for row in INVENTORY.rows)
        buildings[free.label] = assess(
            replace(INVENTORY, rows=rows), Assessment(LAW, shaking(), LEVELS, "pga", FRAME, CURVE)
        )
    return buildings


@pytest.fixture(scope="module")
def drawn():
    return assess(
        INVENTORY, Assessment(LAW, shaking(), LEVELS, "pga", FRAME, CURVE, variability=Variability(0.02, 0.05))
    )


def known(monkeypatch, flags, inventory, levels, hazard=None, **options):
    """An assessment on the ground whose runs give these flags (oscillator, level, motion)."""
    flags = np.array(flags, bool)
    monkeypatch.setattr(module, "outputs_of", lambda _, pieces, *__: {"overturned": flags[: len(pieces)]})
    return assess(inventory, Assessment(LAW, shaking(flags.shape[2]), levels, "pga", None, hazard, **options))


class TestAgainstIda:
    """The same runs, asked for one by one: levels of the ground motion, floor by floor."""

    def runs(self, block, model, floor):
        ground = shaking()
        return tp.ida(block, model, FRAME.floor_motions(ground, [floor]), LEVELS, "pga", "overturned", ground=ground)

    @pytest.mark.slow
    def test_flags(self, found):
        for row in INVENTORY.rows:
            for k, law in enumerate((LAW, tp.DiscreteDamping())):
                model = law if row.e is None else replace(law, e=row.e)
                flags = self.runs(row.block, model, row.floor).overturned.values[0, 0]
                mine = found.overturned.isel(model=k).sel(block=row.label).values
                np.testing.assert_array_equal(mine, np.zeros_like(flags) if row.anchored else flags)
        assert found.overturned.any()
        assert not found.overturned.isel(level=0).any()

    def test_one_item_is_its_fragility(self, found):
        counts = tp.overturning_probability(self.runs(SHELF, LAW, 3).drop_vars("floor"))
        one = found.isel(model=0).sel(block="shelf")
        for name in ("probability", "lower", "upper"):
            mine = one["probability" if name == "probability" else f"probability_{name}"]
            np.testing.assert_allclose(mine, counts[name].values[0, 0], atol=1e-14)

    def test_one_item_in_a_year_is_its_risk(self, found):
        weights = level_weights(LEVELS, CURVE).weights
        one = found.isel(model=0).sel(block="shelf")
        rate = float(weights @ one.probability.values)
        assert rate > 0.0
        assert float(one.rate) == pytest.approx(rate, rel=1e-12)
        assert float(one.block_annual_number) == pytest.approx(4.0 * rate, rel=1e-12)
        assert float(one.block_annual_loss) == pytest.approx(1200.0 * rate, rel=1e-12)

    def test_number_and_loss_of_each_motion(self, found):
        flags = found.overturned.values.astype(float)
        count = np.array([row.count for row in INVENTORY.rows])
        value = np.array([row.value for row in INVENTORY.rows])
        for place, here in (("building", [0, 1, 2, 3, 4]), ("floor 0", [1]), ("floor 3", [0, 2, 4]), ("floor 1", [3])):
            number = np.einsum("kilm,i->klm", flags[:, here], count[here])
            np.testing.assert_array_equal(found.number.sel(place=place), number)
            np.testing.assert_allclose(found.number_mean.sel(place=place), number.mean(axis=-1), rtol=1e-13)
            loss = np.einsum("kilm,i->klm", flags[:, here], (count * value)[here])
            np.testing.assert_allclose(found.loss.sel(place=place), loss, rtol=1e-13)
            np.testing.assert_array_equal(found.any_probability.sel(place=place), (number > 0).mean(axis=-1))
        assert found.place.values.tolist() == ["building", "floor 0", "floor 1", "floor 3"]


class TestConditional:
    def test_known_flags(self, monkeypatch):
        """Two items under five motions: every number by hand."""
        flags = [[[0, 0, 1, 1, 1]], [[0, 0, 0, 0, 1]]]
        rows = (
            Contents("a", SHELF, 0, 2, value=10.0, consequences=("exit",)),
            Contents("b", CASE, 0, 3, value=100.0, consequences=("exit", "injury")),
        )
        found = known(monkeypatch, flags, Inventory(rows), [1.0], quantiles=[0.2, 0.5, 0.9], losses=[0.0, 20.0, 319.0])
        here = found.isel(model=0, level=0).sel(place="building")
        assert here.number.values.tolist() == [0, 0, 2, 2, 5]
        assert here.loss.values.tolist() == [0, 0, 20, 20, 320]
        assert float(here.number_mean) == pytest.approx(9 / 5)
        assert here.number_quantile.values.tolist() == [0, 2, 5]
        assert here.number_exceedance.values.tolist() == [0.6, 0.6, 0.2, 0.2, 0.2]
        assert here.loss_exceedance.values.tolist() == [0.6, 0.2, 0.2]
        assert here.consequence_probability.values.tolist() == [0.6, 0.2]
        lower, upper = wilson_interval(np.array([3]), np.array([5]))
        assert (float(here.any_probability_lower), float(here.any_probability_upper)) == (lower[0], upper[0])
        assert found.loss.attrs["units"] == "1"

    def test_what_cannot_happen_has_no_uncertainty(self, found):
        assert (found.probability_upper.sel(block="fixed") == 0.0).all()
        assert (found.consequence_probability_upper.sel(place="floor 1") == 0.0).all()
        assert (found.number_mean_upper.sel(place="floor 1") == 0.0).all()
        # at the lowest level nothing fell, which 24 motions do not prove
        assert (found.any_probability_upper.isel(level=0).sel(place="building") > 0.1).all()

    def test_correlation_is_kept(self, found):
        """The variance of the sum over floors is not the sum of variances: the same motions shake all floors."""
        here = found.isel(model=0, level=3)
        parts = here.number.sel(place=["floor 0", "floor 3"])
        whole = here.number.sel(place="building")
        np.testing.assert_array_equal(parts.sum("place"), whole)
        covariance = np.cov(parts.values, ddof=0)
        assert covariance[0, 1] > 0.1 * np.sqrt(covariance[0, 0] * covariance[1, 1])
        assert float(whole.var()) == pytest.approx(covariance.sum(), rel=1e-12)
        joint = float(here.any_probability.sel(place="building"))
        apart = 1.0 - np.prod(1.0 - here.any_probability.sel(place=["floor 0", "floor 3"]).values)
        assert joint < apart


class TestInAYear:
    def test_step_under_a_power_law(self, monkeypatch):
        """All pieces fall from one level on, under every motion: the ramp between two levels in closed form."""
        flags = np.zeros((1, 2, 6), bool)
        flags[:, 1:] = True
        inventory = Inventory((Contents("a", SHELF, 0, 5, value=20.0),), "EUR")
        curve = tp.HazardCurve([0.01, 100.0], [1e-4 * 0.01**-2.5, 1e-4 * 100.0**-2.5], "pga")
        found = known(monkeypatch, flags, inventory, [0.4, 0.8], curve)
        z = 2.5 * np.log(2.0)
        rate = 1e-4 * (0.4**-2.5 * ((1.0 - np.exp(-z)) / z - np.exp(-z)) + 0.8**-2.5)
        here = found.isel(model=0).sel(place="building")
        assert float(here.annual_loss) == pytest.approx(100.0 * rate, rel=1e-12)
        assert float(here.annual_number) == pytest.approx(5.0 * rate, rel=1e-12)
        assert float(here.any_rate) == pytest.approx(rate, rel=1e-12)
        np.testing.assert_allclose(here.number_rate, rate, rtol=1e-12)
        np.testing.assert_allclose(here.loss_rate, np.where(found.loss_threshold < 100.0, rate, 0.0), rtol=1e-12)
        assert float(here.annual_loss_above) == pytest.approx(100.0 * 1e-4 * 0.8**-2.5, rel=1e-12)
        assert float(here.annual_loss_below) == 0.0
        assert found.attrs["basis"] == "time"

    def test_adds_up(self, found):
        """Expectations over floors and items, and the area under the curve of the number."""
        whole = found.sel(place="building")
        floors = found.sel(place=["floor 0", "floor 1", "floor 3"])
        for name in ("annual_number", "annual_loss"):
            np.testing.assert_allclose(floors[name].sum("place"), whole[name], rtol=1e-12)
            np.testing.assert_allclose(found[f"block_{name}"].sum("block"), whole[name], rtol=1e-12)
        np.testing.assert_allclose(whole.number_rate.sum("number_threshold"), whole.annual_number, rtol=1e-12)
        np.testing.assert_allclose(whole.number_rate.isel(number_threshold=0), whole.any_rate, rtol=1e-12)
        np.testing.assert_allclose(whole.loss_rate.isel(loss_threshold=0), whole.any_rate, rtol=1e-12)
        assert (whole.number_rate.diff("number_threshold") <= 1e-15).all()
        assert (whole.loss_rate.diff("loss_threshold") <= 1e-15).all()

    @pytest.mark.slow
    def test_against_simulated_earthquakes(self):
        """Earthquakes drawn from the hazard, each with a motion and one of the two levels about it, by their distance.

        Some 0.067 a year exceed the foot below the first level; the outcomes of 400,000 of them are counted.  A
        quarter of the levels gives the same values in a year to within 8 %.
        """
        levels = np.geomspace(LEVELS[0], LEVELS[-1], 49)
        noise = shaking().isel(time=slice(0, 1001))
        dense = assess(INVENTORY, Assessment(LAW, noise, levels, "pga", FRAME, CURVE))
        few = assess(INVENTORY, Assessment(LAW, noise, levels[::4], "pga", FRAME, CURVE))
        for name in ("annual_number", "annual_loss", "any_rate"):
            np.testing.assert_allclose(few[name], dense[name], rtol=0.08)
        here = dense.isel(model=0).sel(place="building")
        generator = np.random.default_rng(6)
        n = 400_000
        foot = levels[0] ** 2 / levels[1]
        logs = np.log(CURVE.rates)[::-1], np.log(CURVE.levels)[::-1]
        rate = np.exp(np.interp(-np.log(foot), -logs[1], logs[0]))
        drawn_rates = np.log(rate * generator.random(n))
        slope = (logs[1][1] - logs[1][0]) / (logs[0][1] - logs[0][0])
        beyond = logs[1][0] + slope * (drawn_rates - logs[0][0])
        x = np.exp(np.where(drawn_rates < logs[0][0], beyond, np.interp(drawn_rates, *logs)))
        at = np.clip((np.log(x) - np.log(foot)) / np.log(levels[1] / levels[0]), 0.0, levels.size)
        level = np.floor(at + generator.random(n)).astype(int)
        outcomes = np.concatenate([np.zeros((1, 24)), here.loss.values])
        loss = outcomes[np.minimum(level, levels.size), generator.integers(24, size=n)]
        assert float(here.annual_loss) == pytest.approx(rate * loss.mean(), abs=4.0 * rate * loss.std() / np.sqrt(n))
        for threshold in (0, 20, 40):
            p = (loss > dense.loss_threshold.values[threshold]).mean()
            error = 4.0 * rate * np.sqrt(p * (1.0 - p) / n)
            assert float(here.loss_rate[threshold]) == pytest.approx(rate * p, abs=error)
            assert error < 0.05 * rate * p

    def test_nothing_falls(self):
        low = assess(
            INVENTORY, Assessment(LAW, shaking(6), [0.01, 0.02], "pga", FRAME, replace_curve(levels=[0.001, 1.0]))
        )
        assert (low.annual_number == 0.0).all()
        assert (low.annual_number_lower == 0.0).all()
        # (Wilson's upper end of 0 of 6, at each level, of every piece that is not anchored)
        share = wilson_interval(0, 6)[1] * float(low.level_weight.sum())
        pieces = low["count"].values * ~low["anchored"].values.astype(bool)
        np.testing.assert_allclose(low.annual_number_upper.sel(place="building"), share * pieces.sum(), rtol=1e-12)
        np.testing.assert_allclose(low.rate_upper[0], np.where(pieces, share, 0.0), rtol=1e-12)
        np.testing.assert_allclose(low.any_rate_upper.sel(place="building"), share, rtol=1e-12)
        assert "building.no_fall" in {fact.what for fact in notes(low)}
        scenario = assess(INVENTORY, Assessment(LAW, shaking(6), [0.02], "pga", FRAME))
        assert "building.no_fall" not in {fact.what for fact in notes(scenario)}  # (there are no annual values)

    def test_bounds_of_amounts_without_a_fall(self):
        """Wilson's end of 0 of 6 motions between the levels, and all above the last one; all pieces then fall."""
        of = replace_curve(levels=[0.001, 1.0])  # (0.1 to 1e-4 per year: the rate is 1e-4 over the level)
        low = assess(INVENTORY, Assessment(LAW, shaking(6), [0.01, 0.02], "pga", FRAME, of))
        assert float(low.level_weight_above) == pytest.approx(5e-3)
        rate = Z * Z / (6 + Z * Z) * (float(low.level_weight.sum()) - 5e-3) + 5e-3
        rows = {row["place"]: row for row in annual(low).lines}
        for place, number, loss in (("building", 12, 4 * 300 + 2 * 900 + 5 * 100 + 50), ("ground", 2, 2 * 900)):
            assert rows[place]["number"] == (0.0, pytest.approx(math.nan, nan_ok=True), pytest.approx(number * rate))
            assert rows[place]["loss"].upper == pytest.approx(loss * rate)
        assert rows["floor 1"]["loss"].upper == 0.0  # (what is anchored cannot fall)
        texts = dict(zip(rows, annual(low).texts("loss"), strict=True))
        assert texts["building"].startswith("at most ")
        assert texts["floor 1"] == "0"
        facts = {fact.what: fact for fact in (*building.answer(low), *building.details(low))}
        assert facts["building.nothing_falls"].upper == pytest.approx(rate)
        assert facts["consequence.loss"].upper == pytest.approx(rows["building"]["loss"].upper)
        assert f"at most {rate * 3550:.2g} EUR" in say(facts["consequence.loss"], "page")

    def test_amounts_that_no_piece_of_a_floor_states(self):
        """Not 0 days: the case on the ground states no downtime, the shelves of 8 exp(0.5²/2) days each do."""
        rows = [replace(row, downtime=Consequence(8.0, 0.5)) if row.label == "shelf" else row for row in INVENTORY.rows]
        of = replace_curve(levels=[0.001, 1.0])
        low = assess(replace(INVENTORY, rows=tuple(rows)), Assessment(LAW, shaking(6), [0.01, 0.02], "pga", FRAME, of))
        cells = {row["place"]: row["downtime"] for row in annual(low).lines}
        assert cells["ground"] == "not stated"
        assert cells["floor 1"].value == 0.0  # (what is anchored cannot fall)
        rate = float(next(building.answer(low)).upper)
        assert cells["building"].upper == pytest.approx(rate * 4 * 8.0 * math.exp(0.125) * 1000.0)
        assert annual(low).texts("downtime")[0].startswith("at most ")

    def test_amounts_without_an_interval_say_so(self, found):
        alike = found.copy(deep=True)
        for end in ("_lower", "_upper"):
            alike[f"annual_number{end}"][:] = np.nan
        assert annual(alike).texts("number")[0].endswith(" (no interval)")
        assert "all motions agree" in annual(alike).note
        assert "all motions agree" not in annual(found).note

    def test_levels_that_begin_too_high_are_noted(self):
        high = assess(INVENTORY, Assessment(LAW, shaking(6), [6.0, 12.0], "pga", FRAME, CURVE))
        assert (high.annual_number_below.sel(place="building") > 0.0).all()
        (fact,) = (fact for fact in notes(high) if fact.what == "rate.share_below_levels")
        share = high.annual_number_below.sel(place="building") / high.annual_number.sel(place="building")
        assert fact.more["shares"][0] == [pytest.approx(share.max().item(), rel=1e-12), "overturnings"]


def replace_curve(**changes):
    return replace(CURVE, rates=[0.1, 1e-4], **changes)


class TestPieces:
    def test_means_are_shares_of_variants(self, drawn):
        assert drawn.overturned.dims == ("model", "block", "variant", "level", "motion")
        share = drawn.overturned.mean("variant")
        np.testing.assert_allclose(drawn.probability, share.mean("motion"), rtol=1e-12, atol=1e-15)
        count = xr.DataArray([row.count for row in INVENTORY.rows], dims="block")
        mean = (share.mean("motion") * count).sum("block")
        np.testing.assert_allclose(drawn.number_mean.sel(place="building"), mean, rtol=1e-12)
        # as drawn, the number has that mean but for the noise of 20 fillings
        np.testing.assert_allclose(drawn.number.sel(place="building").mean(["motion", "realisation"]), mean, atol=0.25)

    def test_independent_pieces_differ_and_pieces_together_do_not(self, drawn):
        together = assess(
            INVENTORY,
            Assessment(LAW, shaking(), LEVELS, "pga", FRAME, variability=Variability(0.02, 0.05, pieces="together")),
        )
        xr.testing.assert_equal(drawn.overturned, together.overturned)
        xr.testing.assert_allclose(drawn.number_mean, together.number_mean)
        assert set(np.unique(together.number.sel(place="floor 0"))) <= {0.0, 2.0}
        assert 1.0 in np.unique(drawn.number.sel(place="floor 0"))
        level = {"level": 3, "model": 0}
        q = drawn.overturned.isel(level).mean("variant").sel(block=["shelf", "other shelf"]).values
        apart = 1.0 - (1.0 - q[0]) ** 4 * (1.0 - q[1])
        one = drawn.overturned.isel(level).mean("variant").sel(block="files").values
        expected = (1.0 - (1.0 - apart) * (1.0 - one) ** 5).mean()
        assert float(drawn.any_probability.isel(level).sel(place="floor 3")) == pytest.approx(expected, rel=1e-12)
        assert float(together.any_probability.isel(level).sel(place="floor 3")) < expected

    @pytest.mark.slow
    def test_draws_of_a_line_stay_the_same_without_another(self, drawn):
        """What anchoring a line saves is what falls of it alone, filling by filling."""
        row, *others = INVENTORY.rows
        options = {"variability": Variability(0.02, 0.05)}
        less, alone = (
            assess(Inventory(rows, "EUR"), Assessment(LAW, shaking(), LEVELS, "pga", FRAME, **options))["number"].sel(
                place="building"
            )
            for rows in ((replace(row, anchored=True), *others), (row,))
        )
        np.testing.assert_array_equal(drawn["number"].sel(place="building") - less, alone)
        assert set(np.unique(alone)) == {0.0, 1.0, 2.0, 3.0, 4.0}

    def test_errors_of_draws_are_written_where_they_matter(self, drawn, found):
        assert not [name for name in found.variables if name.endswith("_sampling_error")]
        name = "number_quantile_sampling_error"
        assert drawn["number_exceedance_sampling_error"].max() < 0.1
        wide = drawn.assign({name: 0.11 * drawn["number_quantile"]})
        small = drawn.assign({name: 0.09 * drawn["number_quantile"]})
        place = wide.sel(place="building").isel(level=4, model=0)
        value, error = float(place["number_quantile"][-1]), float(place[name][-1])
        table = at_level(wide, float(LEVELS[4]))
        assert table.texts(table.columns[-3].key)[0] == f"{short_digits(value)} ± {short_digits(error)}"
        assert "±" in table.note
        assert "±" not in at_level(small, float(LEVELS[4])).note

    def test_vanishing_variation_is_none(self, found):
        tiny = assess(
            INVENTORY,
            Assessment(LAW, shaking(), LEVELS, "pga", FRAME, CURVE, variability=Variability(1e-7, 1e-9, variants=2)),
        )
        xr.testing.assert_allclose(tiny.annual_loss, found.annual_loss.isel(model=[0]))
        for i in range(20):
            np.testing.assert_array_equal(tiny.number.isel(realisation=i), found.number.isel(model=[0]))


class TestAssessment:
    def test_alike_items_of_a_floor_run_once(self):
        seen = []
        assess(
            INVENTORY, Assessment(LAW, shaking(5), LEVELS, "pga", FRAME), progress=lambda *counts: seen.append(counts)
        )
        # the shelves of floor 3 are one block, the fixed ones none
        assert seen[-1] == (3 * 7 * 5, 3 * 7 * 5)
        assert all(a[0] < b[0] for a, b in pairwise(seen))

    @pytest.mark.slow
    def test_order_of_the_rows_does_not_matter(self, found, drawn):
        turned = Inventory(INVENTORY.rows[::-1], "EUR")
        other = assess(
            turned, Assessment(LAW, shaking(), LEVELS, "pga", FRAME, CURVE, variability=Variability(0.02, 0.05))
        )
        for name in ("overturned", "number", "annual_loss", "rate_lower"):
            left, right = xr.align(other[name], drawn[name], join="right")
            xr.testing.assert_allclose(left, right, rtol=1e-12)

    def test_on_a_cluster(self, found):
        options = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": None}
        with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
            far = assess(
                INVENTORY,
                Assessment([LAW, tp.DiscreteDamping()], shaking(), LEVELS, "pga", FRAME, CURVE),
                client=client,
            )
        xr.testing.assert_identical(far, found)

    @pytest.mark.slow
    def test_floor_motions_of_another_program(self, found):
        ground = shaking()
        models = [LAW, tp.DiscreteDamping()]
        whole = assess(INVENTORY, Assessment(models, FRAME.floor_motions(ground), LEVELS, "pga", None, CURVE))
        xr.testing.assert_equal(whole.number.drop_vars("source"), found.number.drop_vars("source"))
        assert whole.place.values.tolist() == found.place.values.tolist()
        upper = Inventory(tuple(row for row in INVENTORY.rows if row.floor == 3), "EUR")
        floors = FRAME.floor_motions(ground, [4, 3])
        alone = assess(upper, Assessment(models, floors, LEVELS, "pga", None, CURVE, ground=ground))
        np.testing.assert_array_equal(alone.number.sel(place="floor 3"), found.number.sel(place="floor 3"))
        with pytest.raises(ValueError, match=r"ground must be given .* do not hold floor 0.*they hold 4, 3"):
            assess(upper, Assessment(LAW, floors, LEVELS, "pga", None))
        as_it_is = assess(upper, Assessment(LAW, floors, [1.0], "scale", None))
        assert as_it_is.motion.values.tolist() == ground.motion.values.tolist()
        named = floors.assign_coords(floor=["roof", "third"])
        moved = Inventory(tuple(replace(row, floor="third") for row in upper.rows), "EUR")
        third = assess(moved, Assessment(models, named, LEVELS, "pga", None, CURVE, ground=ground))
        np.testing.assert_array_equal(third.number.sel(place="floor third"), found.number.sel(place="floor 3"))

    def test_motions_of_different_steps(self):
        other = tp.motions.KanaiTajimi(duration=8.0, dt=0.005).sample(3).assign_coords(motion=["a", "b", "c"])
        found = assess(INVENTORY, Assessment(LAW, [shaking(4), other], LEVELS, "pgv", FRAME))
        assert found.sizes["motion"] == 7
        assert found.dt.values.tolist() == [0.01] * 4 + [0.005] * 3
        assert found.ground_pgv.attrs["long_name"] == "peak ground velocity"


class TestAnchoring:
    """Three motions, one level that stands for 0.01 a year: every saving by hand."""

    rows = (
        Contents("left", SHELF, 0, value=100.0, consequences=("exit",), anchoring_cost=50.0),
        Contents("right", CASE, 0, value=300.0, consequences=("exit",), anchoring_cost=300.0),
        Contents("heap", FILES, 0, 10, value=5.0, anchoring_cost=1.0),
        Contents("held", FILES, 0, value=1000.0, consequences=("exit",), anchored=True),
    )
    flags = ([[1, 1, 0, 0]], [[1, 1, 1, 0]], [[0, 0, 1, 1]])
    curve = tp.HazardCurve([1.0, 2.0], [0.01, 0.005], "pga")

    def found(self, monkeypatch, **options):
        return known(monkeypatch, self.flags, Inventory(self.rows, "EUR"), [1.0], self.curve, **options)

    def test_loss(self, monkeypatch):
        ranked = anchoring(self.found(monkeypatch)).isel(model=0)
        assert ranked.block.values.tolist() == ["left", "right", "heap"]
        np.testing.assert_allclose(ranked.saving, [0.5, 2.25, 0.25], rtol=1e-12)
        np.testing.assert_allclose(ranked.saving_share, np.array([0.5, 2.25, 0.25]) / 3.0, rtol=1e-12)
        assert ranked["rank"].values.tolist() == [2, 1, 3]
        assert ranked.anchored_block.values.tolist() == ["", "right", "left", "heap"]
        np.testing.assert_allclose(ranked.left, [3.0, 0.75, 0.25, 0.0], atol=1e-15)
        np.testing.assert_allclose(ranked.total_cost, [0.0, 300.0, 350.0, 360.0])
        assert ranked.saving.attrs["units"] == "EUR year-1"
        assert ranked.saving_per_cost.attrs["units"] == "year-1"

    def test_per_cost(self, monkeypatch):
        ranked = anchoring(self.found(monkeypatch), per_cost=True).isel(model=0)
        assert ranked.anchored_block.values.tolist() == ["", "heap", "left", "right"]
        np.testing.assert_allclose(ranked.total_cost, [0.0, 10.0, 60.0, 360.0])
        assert ranked["rank"].values.tolist() == [2, 3, 1]

    def test_number_at_a_level(self, monkeypatch):
        ranked = anchoring(self.found(monkeypatch), "number", level=1.0).isel(model=0)
        np.testing.assert_allclose(ranked.saving, [0.5, 0.75, 5.0])
        assert ranked.saving.attrs["units"] == "1"
        assert ranked.saving_per_cost.attrs["units"] == "EUR-1"

    def test_a_consequence_of_which_either_is_enough(self, monkeypatch):
        """Left falls only where right falls: alone it saves nothing, after right it saves what is left."""
        ranked = anchoring(self.found(monkeypatch), "exit").isel(model=0)
        np.testing.assert_allclose(ranked.saving, [0.0, 0.0025], atol=1e-17)
        np.testing.assert_allclose(ranked.alone, [0.005, 0.0075], rtol=1e-12)
        np.testing.assert_allclose(ranked.left, [0.0075, 0.005, 0.0], atol=1e-17)
        assert ranked.anchored_block.values.tolist() == ["", "right", "left"]

    @pytest.mark.slow
    def test_what_stands_on_a_piece_is_lost_with_it(self, monkeypatch):
        """Four motions by hand: the vase falls by itself in 1 and 3, its pedestal in 1 and 2, the clock is fixed."""
        slides = {"friction": FixedFriction(0.9)}
        vase, clock = (
            Contents(name, CASE, 0, value=value, **slides) for name, value in (("vase", 1e3), ("clock", 500))
        )
        rows = (
            Contents("pedestal", SHELF, 0, value=100.0, **slides),
            replace(vase, stands_on="pedestal"),
            replace(clock, stands_on="pedestal", anchored=True),
        )
        flags = [[[1, 1, 0, 0]], [[1, 0, 1, 0]]]
        inventory = Inventory(rows, "EUR")
        found = known(monkeypatch, flags, inventory, [1.0], self.curve).isel(model=[0])
        lost = 0.01 * np.array([0.5 * 100.0, 0.75 * 1000.0, 0.5 * 500.0])
        np.testing.assert_allclose(found.block_annual_loss[0], lost, rtol=1e-12)
        np.testing.assert_allclose(found.annual_loss.sel(place="building"), lost.sum(), rtol=1e-12)
        assert found.loss.sel(place="building").values[0, 0].tolist() == [1600.0, 1600.0, 1000.0, 0.0]
        assert found.number.sel(place="building").values[0, 0].tolist() == [2.0, 1.0, 1.0, 0.0]
        ranked = anchoring(found).isel(model=0)
        # (of the vase the pedestal saves what falls with it alone, motion 2, and the vase the rest, motion 3)
        np.testing.assert_allclose(ranked.saving, 0.01 * np.array([50.0 + 250.0 + 250.0, 250.0]), rtol=1e-12)
        np.testing.assert_allclose(ranked.alone, 0.01 * np.array([50.0 + 500.0 + 250.0, 500.0]), rtol=1e-12)
        np.testing.assert_allclose(ranked.left, [10.5, 5.0, 0.0], atol=1e-12)
        assert ranked.anchored_block.values.tolist() == ["", "pedestal", "vase"]
        for label in ("pedestal", "vase"):
            held = [replace(row, anchored=row.anchored or row.label == label) for row in rows]
            free = [runs for row, runs in zip(rows, flags, strict=False) if row.label != label]
            after = known(monkeypatch, free, replace(inventory, rows=tuple(held)), [1.0], self.curve)
            saved = found.annual_loss - after.annual_loss
            np.testing.assert_allclose(ranked.saving.sel(block=label), saved.values[0, 0], rtol=1e-12)

    def test_steps_where_nothing_alone_saves(self, monkeypatch):
        rows = tuple(replace(row, label=f"{row.label} {i}") for i in range(2) for row in self.rows[:1])
        found = known(monkeypatch, self.flags[:1], Inventory(rows), [1.0])
        ranked = anchoring(found, "any", level=1.0).isel(model=0)
        np.testing.assert_array_equal(ranked.saving, 0.0)
        np.testing.assert_allclose(ranked.left, [0.5, 0.5, 0.0])

    @pytest.mark.parametrize("objective", ["loss", "number", "any", "blocks-exit", "injury"])
    def test_saves_what_an_assessment_of_the_anchored_building_says(self, found, anchored, objective):
        """One by one: the building with that item anchored, assessed again."""
        names = {"loss": "annual_loss", "number": "annual_number", "any": "any_rate"}

        def value(result):
            here = result.isel(model=0).sel(place="building")
            if objective in names:
                return float(here[names[objective]])
            return float(here.consequence_rate.sel(consequence=objective))

        ranked = anchoring(found, objective).isel(model=0)
        assert float(ranked.left[0]) == pytest.approx(value(found), rel=1e-12)
        for label in ranked.block.values:
            saved = value(found) - value(anchored[label])
            assert float(ranked.saving.sel(block=label)) == pytest.approx(saved, rel=1e-9, abs=1e-12)
        assert float(ranked.left[-1]) == pytest.approx(0.0, abs=1e-15)
        assert (ranked.left.diff("step") <= 1e-15).all()

    def test_with_variability(self, drawn):
        ranked = anchoring(drawn, "blocks-exit").isel(model=0)
        rate = drawn.consequence_rate.isel(model=0).sel(place="building", consequence="blocks-exit")
        assert float(ranked.left[0]) == pytest.approx(float(rate), rel=1e-12)
        assert (ranked.saving <= ranked.alone + 1e-15).all()

    def test_intervals_and_ranks_are_paired(self, found):
        ranked = anchoring(found)
        base = found.annual_loss.sel(place="building").values
        np.testing.assert_allclose(ranked.left[:, 0], base, rtol=1e-12)
        np.testing.assert_allclose(ranked.left_lower[:, 0], found.annual_loss_lower.sel(place="building"), rtol=1e-9)
        assert (ranked.rank_lower <= ranked["rank"]).all()
        assert (ranked.rank_upper >= ranked["rank"]).all()
        np.testing.assert_allclose(ranked.saving, found.block_annual_loss.sel(block=ranked.block), rtol=1e-12)
        np.testing.assert_allclose(
            ranked.saving_lower, found.block_annual_loss_lower.sel(block=ranked.block), rtol=1e-9
        )


GROUND = Inventory((Contents("a", SHELF, 0),))


@pytest.fixture
def plain(monkeypatch):
    return known(monkeypatch, TestAnchoring.flags[:1], GROUND, [1.0])


def asked(**options):
    """An assessment of a shelf on the ground, which has all that is needed."""
    given = {"inventory": GROUND, "motions": shaking(2), "levels": [1.0], "im": "pga", "models": LAW, "building": None}
    return assessed(**given | options)


class TestTablesAndFigures:
    def test_values_at_a_level(self, found):
        table = at_level(found, LEVELS[3], 1)
        assert table.title.endswith(f" = {LEVELS[3] / 9.80665:.3g} g")
        assert [column.heading for column in table.columns][3:6] == ["10 %", "50 %", "90 %"]
        assert table.cells(table.lines[2])[2:] == ["0 (0–0)", "0", "0", "0", "0 (0–0)", "–"]
        with pytest.raises(ValueError, match="level must be one of"):
            at_level(found, 1.234)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_part_has_ends_above_those_of_the_building(seed):
    """Under six motions no piece falls on some floors, or every piece does: bounds of another kind than elsewhere."""
    items = Inventory((Contents("shelf", SHELF, 1, 20), Contents("case", CASE, 2, 2), Contents("files", FILES, 4, 3)))
    years = assess(items, Assessment(LAW, shaking(6, seed), [0.8, 2.0, 3.0, 4.0, 6.0], "pga", FRAME, CURVE))
    for name in ("number_mean", "number_rate", "any_rate", "any_probability", "annual_number"):
        for end in ("_lower", "_upper"):
            building = years[name + end].sel(place="building")
            assert not (years[name + end] > building).any(), name + end
    check_results(years)


def test_no_event_has_a_higher_end_than_one_that_it_implies():
    """Forward falls, larger amounts and farther slips under few motions: their own ends were up to 4 times as high."""
    items = Inventory((Contents("shelf", SHELF, 1, 20), Contents("case", CASE, 2, 2), Contents("files", FILES, 4, 3)))
    for seed in range(4):
        asked = Assessment(LAW, shaking(4, seed), [0.8, 2.0, 3.0, 4.0, 6.0], "pga", FRAME, CURVE)
        check_results(assess(items, asked, sides=True))


def test_refused(refusal):
    refusal()
