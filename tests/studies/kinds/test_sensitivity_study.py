"""Sensitivity to delta and e: paired comparisons, studies and figures."""

import math
from functools import partial

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from sensitivity_cases import BLOCK, STUDY, of_law
from study_texts import study_of

import toppling as tp
from toppling.fragility.fitting.bootstrap import draw_motions
from toppling.models.friction import friction_at_impact
from toppling.studies import SensitivityStudy, show
from toppling.studies.plots.sensitivity import (
    QUANTITIES,
    figures,
    input_panel,
    sensitivity,
)
from toppling.studies.sensitivity.findings import Curves, excess, flipped, swing, trend

DELTA = """
[sensitivity]
parameter = "delta"
values = [0.002, 0.01, 0.05, 0.1]
replicates = 100
sobol = 8
[sensitivity.inputs]
delta = { distribution = "uniform", lower = 0.01, upper = 0.1 }
restitution_factor = { distribution = "uniform", lower = 0.8, upper = 1.0 }
"""
E = """
[sensitivity]
parameter = "e"
values = [0.5, 0.8, 0.9, 1.0]
replicates = 100
"""


@pytest.fixture(scope="module")
def over_delta(tmp_path_factory):
    return study_of(tmp_path_factory.mktemp("delta"), STUDY, DELTA).run()


@pytest.fixture(scope="module")
def over_e(tmp_path_factory):
    return study_of(tmp_path_factory.mktemp("e"), STUDY, E).run()


@pytest.fixture(scope="module")
def runs():
    shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(15, seed=3)
    laws = [tp.HousnerImpact(), tp.Vassiliou(), tp.MakrisKonstantinidis(e=0.7, delta=1e-3)]
    return tp.ida(BLOCK, laws, shakes, np.geomspace(0.5, 8.0, 8), "pga", "overturned")


class TestPaired:
    def test_ratio_is_of_the_same_motions(self, runs):
        """As the replicates of one fit, whose quantiles are taken here by hand."""
        curves = Curves.of(runs, 200, 5, 0.9)
        middle, low, high = curves.ratio(np.array([1, 0]), np.array([0, 0]), 0.9)
        fit = tp.fit_fragility(runs, replicates=200, seed=5, keep_replicates=True).isel(block=0)
        own, base = fit["median_sample"].transpose("model", "replicate").values[[1, 0]]
        assert middle[0, 0] == pytest.approx(float(fit["median"][1] / fit["median"][0]))
        assert (low[0, 0], high[0, 0]) == pytest.approx(
            (np.quantile(own / base, 0.05, method="lower"), np.quantile(own / base, 0.95, method="higher"))
        )
        # a law and itself under the same motions
        assert (middle[0, 1], low[0, 1], high[0, 1]) == (1.0, 1.0, 1.0)
        alone = np.quantile(own, 0.95) / np.quantile(base, 0.05) / (np.quantile(own, 0.05) / np.quantile(base, 0.95))
        assert high[0, 0] / low[0, 0] < alone

    def test_nothing_fell(self, runs):
        """Then the median is beyond the levels: infinitely many times, and no number is made up."""
        curves = Curves.of(runs, 100, 0, 0.95)
        assert str(curves.fit["status"][0, 2].values) == "no overturning"
        middle, low, high = curves.ratio(np.array([2, -1]), np.array([0, 0]), 0.95)
        assert middle[0, 0] == low[0, 0] == high[0, 0] == np.inf
        assert np.isnan([middle[0, 1], low[0, 1], high[0, 1]]).all()

    def test_swing(self, runs):
        """The basic interval of ln(largest/smallest), from replicates of an own fit; beyond the levels, no end."""
        curves = Curves.of(runs, 200, 5, 0.9)
        middle, low, high = swing(curves, 0, np.array([0, 1]), 0.9)
        fit = tp.fit_fragility(runs, replicates=200, seed=5, keep_replicates=True).isel(block=0, model=[0, 1])
        logs = np.log(fit["median"].values)
        drawn = np.abs(np.diff(np.log(fit["median_sample"].transpose("model", "replicate").values), axis=0))[0]
        assert math.log(middle) == pytest.approx(abs(logs[1] - logs[0]))
        percentiles = (np.quantile(drawn, 0.95, method="higher"), np.quantile(drawn, 0.05, method="lower"))
        expected = [max(0.0, 2.0 * abs(logs[1] - logs[0]) - one) for one in percentiles]
        assert (math.log(low), math.log(high)) == pytest.approx(tuple(expected))
        assert 1.0 <= low <= middle <= high
        assert np.all(swing(curves, 0, np.array([0, 2]), 0.9) == np.inf)

    def test_trend(self, runs):
        """Least squares by numpy."""
        curves = Curves.of(runs, 100, 5, 0.9)
        x = np.array([0.0, 1.5])
        found = trend(curves, 0, np.array([0, 1]), x)
        assert found[0] == pytest.approx(np.polyfit(x, curves.log_median[0, :2], 1)[0])
        assert found[7] == pytest.approx(np.polyfit(x, curves.log_samples[0, :2, 6], 1)[0])

    def test_flips(self, runs):
        flags = runs["overturned"].transpose("block", "model", "level", "motion").values
        share, low, high = flipped(flags, np.array([0, 1, 2]), np.array([0, 0, -1]), 0.95)
        assert not share[0, 0].any()
        by_hand = [np.mean([a != b for a, b in zip(*pair, strict=True)]) for pair in zip(*flags[0, :2], strict=True)]
        np.testing.assert_allclose(share[0, 1], by_hand)
        assert np.all((low[0, 1] <= share[0, 1]) & (share[0, 1] <= high[0, 1]))
        assert np.isnan(share[0, 2]).all()

    def test_excess_is_a_paired_bootstrap(self, runs):
        flags = runs["overturned"].transpose("block", "model", "level", "motion").values
        middle, low, high = excess(flags, np.array([1]), np.array([0]), np.arange(15), 200, 7, 0.9)
        weights = draw_motions((np.arange(15),), 200, 7).astype(int)
        for level in range(flags.shape[2]):
            one, other = flags[0, 1, level].astype(float), flags[0, 0, level].astype(float)
            drawn = sorted(np.repeat(one, w).mean() - np.repeat(other, w).mean() for w in weights)
            assert middle[0, 0, level] == pytest.approx(one.mean() - other.mean())
            assert low[0, 0, level] == pytest.approx(drawn[math.floor(0.05 * 199)])
            assert high[0, 0, level] == pytest.approx(drawn[math.ceil(0.95 * 199)])


class TestDelta:
    def test_agrees_with_a_plain_analysis(self, over_delta, tmp_path):
        """Each value is a law of its own under the same motions."""
        study = study_of(tmp_path, STUDY, DELTA)
        law = tp.GianniniMasiani(delta=0.05)
        runs = tp.ida(study.blocks, law, study.design.motions, study.design.levels)
        here = of_law(over_delta, "giannini-masiani").sel(value=0.05)
        np.testing.assert_array_equal(here["overturned"], runs["overturned"].isel(model=0))
        np.testing.assert_array_equal(here["peak_rotation"], runs["peak_rotation"].isel(model=0))
        fit = tp.fit_fragility(runs, replicates=100).isel(model=0)
        for name in ("median", "median_lower", "dispersion", "dispersion_upper"):
            np.testing.assert_allclose(here[name], fit[name], rtol=1e-9)

    def test_the_rigid_block_against_itself(self, over_delta):
        here = of_law(over_delta, "housner").sel(comparison="rigid")
        for name in ("median_ratio", "median_ratio_lower", "median_ratio_upper"):
            assert np.all(here[name] == 1.0)
        assert not here["flipped"].any()
        assert not here["excess"].any()

    def test_the_value_before(self, over_delta):
        here = of_law(over_delta, "discrete", "elastic").isel(block=0)
        found = here["flipped"].sel(comparison="previous")
        flags = here["overturned"]
        assert np.isnan(found.isel(value=0)).all()
        expected = (flags.isel(value=2) != flags.isel(value=1)).mean("motion")
        np.testing.assert_allclose(found.isel(value=2), expected)
        ratio = (here["median"][2] / here["median"][1]).item()
        assert here["median_ratio"].sel(comparison="previous")[2].item() == pytest.approx(ratio)

    def test_elastic_frequency(self, over_delta):
        """3 Hz for R = 0.38 m at delta = 0.05; none where the block rests rigidly."""
        assert of_law(over_delta, "discrete", "elastic")["elastic_frequency"].sel(value=0.05)[0].item() == (
            pytest.approx(3.0, abs=0.1)
        )
        assert np.isnan(of_law(over_delta, "energy-consistent")["elastic_frequency"]).all()

    def test_inputs_that_a_law_does_not_take(self, over_delta):
        """Vassiliou et al. has no restitution: no share of the variance, no swing."""
        here = of_law(over_delta, "vassiliou").sel(input="restitution_factor")
        assert not here["tornado_swing"].any()
        assert np.all(here["tornado_low"] == here["tornado_base"])
        assert not here["sobol_total"].any()
        assert of_law(over_delta, "makris-konstantinidis").sel(input="delta")["tornado_swing"].max() > 0.3

    @pytest.mark.slow
    def test_runs_are_counted_and_bits_are_the_same(self, tmp_path):
        laws = STUDY[STUDY.index("[[models]]") : STUDY.index("[motions]")]
        few = STUDY.replace(laws, '[[models]]\nlaw = "discrete"\n[[models]]\nlaw = "vassiliou"\n')
        few = few.replace('[[blocks]]\ncatalogue = "server-rack-42u"\n', "").replace("number = 12", "number = 5")
        study = study_of(tmp_path, few, DELTA)
        seen = []
        first = study.run(tmp_path / "out", progress=lambda done, total: seen.append((done, total)))
        assert seen[-1] == (study.work, study.work)
        assert seen == sorted(seen)
        assert isinstance(study, SensitivityStudy)
        study.run(tmp_path / "again")
        assert (tmp_path / "out" / "results.nc").read_bytes() == (tmp_path / "again" / "results.nc").read_bytes()
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            assert stored["median"].equals(first["median"])


class TestE:
    def test_laws_that_do_not_know_e_run_once(self, tmp_path):
        study = study_of(tmp_path, STUDY, E)
        grid = study.grid
        assert np.all(grid.at[3] == grid.at[3, 0])
        # five laws of e at four values and their own e_R, Vassiliou's once; Housner's are the rigid blocks
        assert len(grid.laws) == 6 * 5 + 1
        assert len(set(grid.laws)) == len(grid.laws)

    def test_own_restitution_is_the_reference(self, over_e, tmp_path):
        assert over_e["comparison"].values.tolist() == ["own", "rigid", "previous"]
        study = study_of(tmp_path, STUDY, E)
        runs = tp.ida(study.blocks, tp.DiscreteDamping(), study.design.motions, study.design.levels)
        own = runs["overturned"].isel(model=0)
        here = of_law(over_e, "discrete", "elastic")
        expected = (here["overturned"] != own.drop_vars([c for c in own.coords if c not in own.dims])).mean("motion")
        np.testing.assert_allclose(here["flipped"].sel(comparison="own"), expected.transpose("block", "value", "level"))

    def test_a_law_without_e(self, over_e):
        assert np.all(of_law(over_e, "vassiliou")["median_ratio"].sel(comparison="own") == 1.0)

    def test_values_that_need_too_much_friction(self, over_e):
        ratio = 1.0 / np.tan(over_e["alpha"].values)
        need = friction_at_impact(ratio[:, None], over_e["value"].values[None])
        np.testing.assert_array_equal(over_e["in_use"], need <= 1.0)
        assert not over_e["in_use"].all()
        assert over_e["in_use"].any()

    def test_friction_can_be_said(self, tmp_path):
        laws = STUDY[STUDY.index("[[models]]") : STUDY.index("[motions]")]
        text = STUDY.replace(laws, '[[models]]\nlaw = "discrete"\n').replace("number = 12", "number = 4")
        results = study_of(tmp_path, text, E, "[friction]\nstatic = 0.3\n").run()
        assert results["in_use"].sum() < 8
        # the shade ends where the need is what there is
        ax = sensitivity(results, block="server-rack-42u")
        shade = next(patch for patch in ax.patches if "friction above 0.3" in str(patch.get_label()))
        end = float(shade.get_x() + shade.get_width())
        ratio = 1.0 / np.tan(results["alpha"].sel(block="server-rack-42u").item())
        assert friction_at_impact(ratio, end) == pytest.approx(0.3)


BASE = STUDY + '[sensitivity]\nparameter = "delta"\n'


class TestSchema:
    def test_a_value_as_reference(self, tmp_path):
        few = BASE.replace("number = 12", "number = 4").replace("number = 8", "number = 4")
        results = study_of(tmp_path, few, "values = [0.02, 0.05]\nreference = 0.05\nreplicates = 100").run()
        assert results["comparison"].values.tolist() == ["given", "rigid", "previous"]
        assert results.attrs["reference"] == "0.05"
        assert not results["flipped"].sel(comparison="given", value=0.05).any()


PANELS = [partial(input_panel, needed=needed) for needed in ("tornado_low", "sobol_total")]


class TestFigures:
    @pytest.mark.slow
    def test_all(self, over_delta, over_e, tmp_path):
        names = {"delta": (over_delta, 7), "e": (over_e, 5)}
        for key, (results, n) in names.items():
            found = dict(figures(results.isel(block=[0])))
            assert len(found) == n, key
            for figure in found.values():
                assert isinstance(figure, Figure)
                assert figure.get_figwidth() == 3.5  # one column, for 380 pixels
        assert len(show.draw(over_e.isel(block=[0]), tmp_path)) == 5

    def test_lines_are_the_results(self, over_delta):
        ax = sensitivity(
            over_delta, quantity="probability", block="server-rack-42u", level=float(over_delta["level"][5])
        )
        drawn = next(line for line in ax.lines if "Discrete" in str(line.get_label()))
        here = of_law(over_delta, "discrete", "elastic").sel(block="server-rack-42u")
        np.testing.assert_array_equal(drawn.get_ydata(), here["probability"].isel(level=5))
        np.testing.assert_array_equal(drawn.get_xdata(), over_delta["value"])
        assert ax.get_ylabel().replace("\n", " ").startswith("Probability of overturning")

    def test_the_rigid_block_is_there(self, over_delta):
        ax = sensitivity(over_delta.isel(block=[0]))
        drawn = next(line for line in ax.lines if line.get_label() == "rigid block")
        np.testing.assert_allclose(drawn.get_ydata() * 9.80665, of_law(over_delta, "housner")["median"][0])

    def test_axes_in_axes_out(self, over_delta):
        ax = Figure().add_subplot()
        one = over_delta.isel(block=[0])
        assert sensitivity(one, ax, quantity="dispersion") is ax
        assert ax.get_legend() is None
        for name in QUANTITIES:
            assert sensitivity(one, quantity=name).get_legend() is not None

    @pytest.mark.slow
    def test_the_block_is_said(self, over_delta):
        """Nobody's first block is drawn for want of a word."""
        for draw in (sensitivity, *PANELS):
            with pytest.raises(ValueError, match="several blocks, say which"):
                draw(over_delta)

    def test_one_law_keeps_its_look(self, over_delta):
        one = over_delta.isel(block=[0])
        label = str(one["model"].values[1])
        among = [line.get_color() for line in sensitivity(one).lines]
        lines = sensitivity(one, model=label).lines
        assert lines[0].get_color() == among[1]
        assert len(lines) == 2  # and the rigid block's
        assert sensitivity(one, model=label, color="red").lines[0].get_color() == "red"

    def test_refusals(self, over_delta, over_e):
        with pytest.raises(ValueError, match=r"quantity must be one of 'median', .*, got 'mean'"):
            sensitivity(over_delta, quantity="mean")
        with pytest.raises(ValueError, match=r"level must be one of .*, got 0.123"):
            sensitivity(over_delta.isel(block=0), quantity="flipped", level=0.123)
        with pytest.raises(ValueError, match=r"block must be one of .*, got 'shelf'"):
            sensitivity(over_delta, block="shelf")
        with pytest.raises(ValueError, match="results must be of a sensitivity study"):
            sensitivity(over_delta.drop_attrs())
        for panel in PANELS:
            with pytest.raises(ValueError, match="the study asked for none"):
                panel(over_e)
