"""`toppling.plot`: axes in and axes out, the numbers that are drawn, refused inputs, and legible texts."""

import subprocess
import sys
from contextlib import nullcontext
from importlib import import_module

import numpy as np
import plot_cases as cases
import pytest
import xarray as xr
from matplotlib.figure import Figure
from scipy.special import ndtr

import toppling as tp
from toppling.fragility import curve_probability
from toppling.fragility.curves.published import fema_p58
from toppling.fragility.numerics.proportions import wilson_interval
from toppling.models.friction import CONTACTS
from toppling.studies import plot
from toppling.studies.plots import axes, selection
from toppling.studies.plots.assessment import anchoring_figure, exceedance_figure, levels_figure
from toppling.studies.plots.axes import COLOURS
from toppling.studies.plots.efficiency import ranking_figure
from toppling.studies.plots.fragility import fragility_figure, laws_figure
from toppling.studies.plots.risk import risk_figure
from toppling.studies.plots.uncertainty import index_figure, uncertainty_figure
from toppling.studies.text.words import renamed, with_law_names

G = 9.80665
WHOLE = cases.with_ranking(cases.assessment(), cases.ranking(items=("shelf", "rack")))
SHELF = cases.curves(("shelf",))


def lines(ax):
    return {line.get_label(): line for line in ax.lines if not line.get_label().startswith("_")}


def curves_in(ax):
    return [line for line in ax.lines if len(line.get_xdata()) > 100]


def check_curve(line, results):
    own = curve_probability(results[["median", "dispersion"]], line.get_xdata() * G)
    np.testing.assert_allclose(line.get_ydata(), own, atol=1e-12)


def title_of(ax):
    return ax.get_title("left").replace("\n", " ")


def close_rates(rate=1.226e-4):
    """The rate of one block under one law, whose interval is far shorter than a decade."""
    found = cases.rates(0.0).isel(block=[0], model=[0])
    ends = {"rate": 1.0, "rate_lower": 0.94, "rate_upper": 1.06}
    return found.assign({name: (found["rate"].dims, [[one * rate]]) for name, one in ends.items()})


DRAWN = {
    "fragility": (SHELF, {}),
    "inventory levels": (cases.assessment(), {}),
    "inventory exceedance": (cases.assessment(), {"view": "exceedance"}),
    "inventory anchoring": (WHOLE, {"view": "anchoring"}),
    "inventory left": (WHOLE, {"view": "left"}),
    "uncertainty": (cases.uncertain(), {}),
    "uncertainty variance": (cases.uncertain(), {"view": "variance"}),
    "indices": (cases.uncertain(), {"method": "sobol", "model": cases.LAWS[0]}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWN)
def test_a_legend_comes_with_a_figure_of_its_own(name):
    """Axes of the caller get none, which has the labels."""
    results, options = DRAWN[name]
    function = getattr(plot, name.split()[0])
    assert len(function(results, **options).get_legend().get_texts()) > 1
    ax = Figure().add_subplot()
    assert function(results, ax, **options) is ax
    assert ax.get_legend() is None
    assert len(ax.get_legend_handles_labels()[1]) > 1


class TestFragility:
    def test_the_curve_is_the_fits_own(self):
        ax = Figure().add_subplot()
        assert plot.fragility(SHELF, ax) is ax
        for i, line in enumerate(curves_in(ax)):
            check_curve(line, SHELF.isel(block=0, model=i))
        assert ax.get_xlabel() == "Peak ground acceleration (g)"
        assert len(ax.get_legend_handles_labels()[1]) == 3
        assert plot.fragility(SHELF.isel(model=[0])).get_legend() is None
        assert plot.fragility(SHELF.isel(model=[0]), label="site A").get_legend() is not None

    @pytest.mark.parametrize("spacing", [np.geomspace, np.linspace])
    def test_points_stay_at_their_levels(self, spacing):
        """Points of all laws lie at their levels, for any spacing: a shifted point reads as a biased fit."""
        many = xr.concat([SHELF.isel(model=[0])] * 9, "model").assign_coords(model=[f"law {i}" for i in range(9)])
        levels = spacing(0.5, 8.0, 9)
        many = many.assign_coords(level=("level", levels, cases.PGA))
        ax = plot.fragility(many)
        assert ax.get_xscale() == ("log" if spacing is np.geomspace else "linear")
        assert len(ax.containers) == 9
        for bars in ax.containers:
            np.testing.assert_allclose(bars[0].get_xdata(), levels / G, rtol=1e-12)

    def test_a_cloud_shows_the_state_of_its_curves(self):
        found = cases.cloud().isel(model=[0]).assign_attrs(state="|theta|/alpha > 0.3").assign_coords(alpha=0.2)
        turned = 0.2 * np.abs(np.sin(np.arange(300.0)))
        found = found.assign(peak_rotation=(found["overturned"].dims, turned[None, None]))
        ax = plot.fragility(found)
        (ticks,) = [line for line in ax.lines if line.get_marker() == "|"]
        reached = turned > 0.3 * 0.2
        assert 0 < reached.sum() != int(found["overturned"].sum())
        assert ((np.asarray(ticks.get_ydata()) > 0.5) == reached).all()

    def test_a_cloud_has_binned_fractions(self):
        found = cases.cloud().isel(model=[0])
        ax = plot.fragility(found)
        (bars,) = ax.containers
        x, p = bars[0].get_xdata(), bars[0].get_ydata()
        at, fell = found["intensity"].values / G, found["overturned"].values[0, 0]
        parts = np.array_split(np.arange(300), x.size)
        np.testing.assert_allclose(p, [fell[part].mean() for part in parts], atol=1e-12)
        # (where the curve has the mean over the bin)
        curve = curve_probability(found.isel(block=0, model=0), x * G).values
        means = [curve_probability(found.isel(block=0, model=0), at[part] * G).values.mean() for part in parts]
        np.testing.assert_allclose(curve, means, atol=1e-4)
        ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments()])
        falls = np.array([fell[part].sum() for part in parts])
        lower, upper = wilson_interval(falls, np.array([len(part) for part in parts]))
        np.testing.assert_allclose(ends, np.stack([lower, upper], -1), atol=1e-12)
        # and every motion is a tick
        assert max(len(line.get_xdata()) for line in ax.lines if line.get_marker() == "|") == 300

    @pytest.mark.parametrize("wrong", [1.0, 0.8, 1.25])
    def test_points_of_adaptive_levels_lie_as_far_from_a_curve_as_the_runs(self, wrong):
        """At the mean level of a wide bin, points would be up to 0.12 off the very curve that the runs follow."""
        found = cases.adaptive()
        found["median"] = found["median"] * wrong
        (bars,) = plot.fragility(found).containers
        x, p = bars[0].get_xdata() * G, bars[0].get_ydata()
        curve = curve_probability(found.isel(block=0, model=0), x).values
        at, fell = found["intensity"].values, found["overturned"].values
        parts = np.array_split(np.argsort(at, kind="stable"), x.size)
        assert all(at[part].min() <= one <= at[part].max() for one, part in zip(x, parts, strict=True))
        of_runs = ndtr(np.log(at / found["median"].item()) / found["dispersion"].item())
        means = np.array([[fell[part].mean(), of_runs[part].mean()] for part in parts])
        np.testing.assert_allclose(p - curve, means[:, 0] - means[:, 1], atol=1e-3)
        off = np.abs(p - curve).max()
        assert off < 0.03 if wrong == 1.0 else off > 0.15

    def test_points_without_a_curve_lie_at_the_mean_level(self):
        found = cases.adaptive().drop_vars(["median", "dispersion"])
        (bars,) = plot.fragility(found).containers
        at = np.sort(found["intensity"].values)
        middle = [np.exp(np.log(part).mean()) for part in np.array_split(at, bars[0].get_xdata().size)]
        np.testing.assert_allclose(bars[0].get_xdata() * G, middle, rtol=1e-9)

    def test_curves_alone_and_fractions_alone(self):
        alone = SHELF[["median", "dispersion"]].drop_dims("level", errors="ignore").assign_attrs(im="pga")
        assert plot.fragility(alone, model="discrete e=0.9 δ=0.05").get_xlabel() == "PGA (g)"
        ax = plot.fragility(SHELF[["probability", "lower", "upper"]])
        assert (len(ax.containers), curves_in(ax)) == (3, [])

    def test_one_law_keeps_its_look(self):
        ax = plot.fragility(SHELF, model="discrete e=0.9 δ=0.05", label="mine")
        assert list(lines(ax)) == ["mine"]
        assert lines(ax)["mine"].get_color() == COLOURS[1]
        assert lines(plot.fragility(SHELF, model="housner e=e_R", color="red"))["Housner"].get_color() == "red"

    def test_few_blocks_share_a_panel(self):
        """The curves and points of the reference law, each with its own look, and the medians of all laws below."""
        results = cases.curves(("bookcase-5-shelf", "rack"))
        (ax,) = fragility_figure(results).axes
        assert [line.get_color() for line in curves_in(ax)] == list(COLOURS[:2])
        rows = [line for line in ax.lines if line.get_marker() == "|"]
        for i, (line, bars, row) in enumerate(zip(curves_in(ax), ax.containers, rows, strict=True)):
            check_curve(line, results.isel(block=i, model=0))
            np.testing.assert_array_equal(bars[0].get_ydata(), results["probability"][i, 0])
            np.testing.assert_allclose(np.sort(row.get_xdata()), np.sort(results["median"][i]) / G)
            assert max(row.get_ydata()) < 0.0
        assert {text.get_text() for text in ax.texts} == {"Bookcase, 5 shelves", "rack", "Medians\nby law"}

    def test_many_blocks_have_panels_of_their_own(self):
        """The reference law in colour, the other laws in grey; every column of panels ends with numbers."""
        results = cases.curves(tuple("abcde"))
        figure = fragility_figure(results)
        assert [ax.get_title("left") for ax in figure.axes] == list("abcde")
        for i, ax in enumerate(figure.axes):
            assert [line.get_color() for line in curves_in(ax)] == ["0.75", "0.75", COLOURS[0]]
            for line, law in zip(curves_in(ax), (1, 2, 0), strict=True):
                check_curve(line, results.isel(block=i, model=law))
            shown = ax.xaxis.get_tick_params()["labelbottom"]
            assert shown == bool(ax.get_xlabel()) == (i >= 2)

    def test_floors_share_the_panel_of_their_block(self):
        both = xr.concat([cases.curves(tuple("abc"))] * 2, "floor").assign_coords(floor=[0, 3])
        figure = fragility_figure(both.transpose("block", "floor", ...))
        assert [ax.get_title("left") for ax in figure.axes] == list("abc")
        assert [text.get_text() for text in figure.axes[1].texts] == ["ground", "floor 3"]

    def test_medians_by_law_are_relative_to_the_reference(self):
        results = cases.curves().isel(model=[1, 0, 2])
        for end, factor in (("lower", 0.9), ("upper", 1.2)):
            results[f"half_level_{end}"] = factor * results["half_level"]
        figure = laws_figure(results)
        for i, ax in enumerate(figure.axes):
            reference, *others = [line for line in ax.lines if line.get_marker() == "o"]
            assert (reference.get_xdata()[0], reference.get_color()) == (1.0, "#222222")
            np.testing.assert_allclose([line.get_xdata()[0] for line in others], [1.1, 0.8])
            bars = [line.get_xdata() for line in ax.lines if line.get_linewidth() == 2.2]
            np.testing.assert_allclose(bars, np.outer([1.0, 1.1, 0.8], [0.9, 1.2]))
            numbers = [float(text.get_text()) for text in ax.texts]
            np.testing.assert_allclose(numbers, results["median"].values[i, [1, 0, 2]] / G, atol=0.005)
        names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
        assert names == ["Housner", "Energy-consistent", "Discrete"]


class TestRisk:
    @pytest.mark.slow
    def test_the_share_from_above_is_drawn_and_said(self):
        found = cases.rates()
        ax = plot.risk(found, quantity="share", block="shelf")
        tails = [patch.get_data() for patch in ax.patches if patch.get_hatch()]
        width = np.log(float(found["bin_upper"][0]) / float(found["bin_lower"][0]))
        parts = [float(data.values[0]) * np.log(data.edges[-1] / data.edges[0]) / width for data in tails]
        np.testing.assert_allclose(parts, found["share_above"].sel(block="shelf"), rtol=1e-12)
        assert [data.edges[0] for data in tails] == pytest.approx([6.0 / G] * len(tails))
        assert "hatched: 7–35 % from above 0.612 g" in title_of(ax)
        assert "7–35 % from above 0.612 g" in risk_figure(found).get_label()

    def test_a_share_from_below_is_drawn_where_it_is_notable(self):
        found = cases.rates(0.0)
        found["share_below"][0, 0] = 0.2
        ax = plot.risk(found, quantity="share", block="shelf")
        (tail,) = (patch.get_data() for patch in ax.patches if patch.get_hatch())
        assert tail.edges[-1] == pytest.approx(float(found["bin_lower"][0]) / G)

    def test_nothing_beyond_is_nothing_said(self):
        found = cases.rates(0.0)
        ax = plot.risk(found, quantity="share", block="rack", model="housner e=e_R")
        assert title_of(ax) == ""
        assert not [patch for patch in ax.patches if patch.get_hatch()]
        found["rate_share_above_levels"] = found["rate"].dims, np.full((2, 3), 0.12)
        assert title_of(plot.risk(found, quantity="share", block="rack")) == "12 % from above all runs"

    def test_levels_not_run_are_shaded(self):
        found = cases.rates(0.0).assign_coords(level=("level", [1.0, 2.0, 3.0], cases.PGA))
        ax = plot.risk(found, quantity="share", block="rack")
        assert len([patch for patch in ax.patches if patch.get_alpha() == 0.12]) == 2
        assert "Shaded" in risk_figure(found).get_label()

    def test_rates_are_those_of_annual_rate(self):
        curves = fema_p58().isel(block=slice(0, 1))
        rates = tp.annual_rate(curves, tp.HazardCurve.power_law(1e-3, 2.0, "pgv"))
        (bars,) = plot.risk(rates).containers
        assert bars[0].get_xdata()[0] == pytest.approx(rates["rate"].item())

    @pytest.mark.parametrize("rate", [1.226e-4, 3.3e-7, 9.7e-5, 4.9e-4, 0.0431, 2.9])
    def test_an_axis_within_a_decade_has_numbers(self, rate):
        figure = risk_figure(close_rates(rate))
        ax = figure.axes[0]
        figure.canvas.draw()
        low, high = ax.get_xlim()
        assert high < 10.0 * low
        named = [tick for tick, one in zip(ax.get_xticks(), ax.get_xticklabels(), strict=True) if one.get_text()]
        assert 2 <= len(named) <= 5
        assert all(low <= one <= high for one in named)

    def test_a_law_without_a_curve(self):
        found = cases.rates()
        found["rate"][0, 1] = np.nan
        assert "no curve" in [text.get_text() for text in plot.risk(found, block="shelf").texts]


class TestInventory:
    def test_all_laws_are_drawn(self):
        ax = plot.inventory(WHOLE)
        assert len(ax.containers) == 3
        for i, bars in enumerate(ax.containers):
            np.testing.assert_allclose(bars[0].get_ydata(), WHOLE["number_mean"].isel(model=i, place=0))
        drawn = lines(exceedance_figure(WHOLE).axes[0])
        assert list(drawn) == ["Housner", "Energy-consistent", "Discrete"]
        for i, line in enumerate(drawn.values()):
            assert line.get_ydata()[0] == WHOLE["loss_rate"].values[i, 0, 0]
        assert len(plot.inventory(WHOLE, view="anchoring").patches) == 6
        places = lines(plot.inventory(WHOLE, view="exceedance", model="housner e=e_R"))
        assert len(places) > 1
        assert places["building"].get_ydata()[0] == WHOLE["loss_rate"].values[0, 0, 0]

    def test_exceedance_ends_where_nothing_more_falls(self):
        """The curve extends from the rate of any loss, left of the axis, to the greatest loss under any motion."""
        whole = WHOLE.isel(model=[0], loss_threshold=slice(0, 4), number_threshold=slice(0, 3))
        anything = float(whole["number_rate"][0, 0, 0])
        rates = np.array([anything, 0.8 * anything, 0.5 * anything, 0.0])
        found = whole.assign_coords(loss_threshold=[0.0, 10.0, 20.0, 40.0], number_threshold=[1.0, 2.0, 3.0])
        for end, factor in (("", 1.0), ("_lower", 0.9), ("_upper", 1.1)):
            found[f"loss_rate{end}"][:] = factor * rates
            found[f"number_rate{end}"][:] = rates[[0, 2, 3]]
        ax = plot.inventory(found, view="exceedance", quantity="loss", place="building")
        x, y = ax.get_lines()[0].get_data()
        assert x[1:].tolist() == [10.0, 10.0, 20.0, 20.0, 40.0, 40.0]
        assert y[:-1].tolist() == rates[[0, 0, 1, 1, 2, 2]].tolist()
        assert x[0] < ax.get_xlim()[0] < 10.0
        assert y[-1] < ax.get_ylim()[0] < rates[2]
        (line,) = plot.inventory(found, view="exceedance", quantity="number", place="building").get_lines()
        x, y = line.get_data()
        assert x.tolist() == [0.0, 1.0, 1.0, 2.0, 2.0]
        assert y[:-1].tolist() == rates[[0, 0, 2, 2]].tolist()
        assert y[-1] < 0.01 * anything

    def test_losses_of_return_periods_are_marked(self):
        """At a dot the loss is exceeded at the rate of its return period, and a larger loss is not."""
        ax = exceedance_figure(WHOLE).axes[0]
        dots = {round(1.0 / line.get_ydata()[0]): line.get_xdata()[0] for line in ax.lines if line.get_marker() == "o"}
        at, rate = WHOLE["loss_threshold"].values, WHOLE["loss_rate"].values[0, 0]
        # (in 100 years no loss has so high a rate)
        assert dots == {years: at[np.flatnonzero(rate < 1.0 / years)[0]] for years in (500, 1000)}

    def test_anchoring_says_what_is_saved(self):
        ax = plot.inventory(cases.ranking(1), view="anchoring")
        assert ax.get_xlabel().replace("\n", " ") == "Reduction of the expected annual value overturned (EUR per year)"
        left = plot.inventory(cases.ranking(), view="left")
        assert len(lines(left)) == 3
        assert left.get_ylabel().replace("\n", " ") == "Remaining expected value overturned (EUR per year)"


class TestSliding:
    def test_the_chance_is_that_of_a_lognormal_coefficient(self):
        """Along each line the median is b/h times exp(-dispersion times the quantile of its share)."""
        ax = plot.sliding(dispersion=0.4)
        drawn = next(one for one in ax.collections if getattr(one, "labelTexts", None))
        assert len(drawn.get_paths()) == len(drawn.levels) == 7
        for share, path in zip(drawn.levels, drawn.get_paths(), strict=True):
            ratio, median = path.vertices.T
            np.testing.assert_allclose(ndtr(np.log(ratio / median) / 0.4), share, rtol=0.02)

    def test_blocks_stand_at_their_ratio(self):
        ax = plot.sliding([tp.catalogue["file-vertical-2-drawer"], tp.Block(0.4, 1.6, name="crate")])
        at = {name: line.get_xdata()[0] for name, line in lines(ax).items()}
        assert (at["crate"], at["file-vertical-2-drawer"]) == (0.25, 0.625)
        assert [text.get_text() for text in ax.get_legend().get_texts()] == ["file-vertical-2-drawer", "crate"]
        # (no share is written over a line of a block or of a contact)
        shares = np.log([text.get_position() for text in ax.texts if text.get_text().endswith("%")])
        assert len(shares) == 7
        assert abs(shares[:, :1] - np.log([*at.values()])).min() > 0.1
        assert abs(shares[:, 1:] - np.log([contact.friction.median for contact in CONTACTS.values()])).min() > 0.1
        own = Figure().add_subplot()
        assert plot.sliding(tp.Block(0.4, 1.6), own) is own
        assert own.get_legend() is None


def test_measures_have_the_tables_words():
    ax = plot.measures(cases.measured(), model="housner e=e_R")
    names = [tick.get_text() for tick in ax.get_yticklabels()]
    assert names[-2:] == ["√(Arias intensity) of the ground", "PGA of the ground"]


class TestUncertainty:
    def test_bands_have_the_edges_of_their_law(self):
        ax = plot.uncertainty(cases.uncertain())
        edges = [line for line in ax.lines if line.get_linewidth() == 0.8]
        assert [line.get_color() for line in edges[::2]] == ["#222222", *COLOURS[:2]]
        np.testing.assert_allclose(edges[0].get_ydata(), cases.uncertain()["probability_quantile"][0, 0, :, 0])
        assert len(uncertainty_figure(cases.uncertain(("shelf", "rack"))).axes) == 4

    def test_indices(self):
        found, law = cases.uncertain(), "housner e=e_R"
        assert title_of(plot.indices(found, method="sobol", model=law)) == "Probability of overturning at 0.204 g"
        assert "at 0.816 g" in title_of(plot.indices(found, method="sobol", model=law, level=8.0))
        # ends of an interval instead of its half width
        ends = found.isel(model=0, block=0, output=0)[["sobol_first", "sobol_total"]]
        ends = ends.rename(sobol_first="first", sobol_total="total")
        ends = ends.assign(total_lower=ends["total"] - 0.1, total_upper=ends["total"] + 0.2)
        (bars, _) = (bars for bars in plot.indices(ends).containers if hasattr(bars, "patches"))
        segments = bars.errorbar[2][0].get_segments()
        np.testing.assert_allclose(np.diff([segment[:, 0] for segment in segments], axis=1), 0.3)


@pytest.mark.parametrize("phone", [False, True])
def test_figures_have_two_widths_and_short_titles_at_the_left(phone):
    """A page or a column wide, a title of at most six words, and notes as sentences of the caption."""
    with axes.on_a_phone() if phone else nullcontext():
        for name, make in FIGURES.items():
            figure = make()
            assert figure.get_figwidth() == (3.5 if phone else 7.2), name
            if name == "sliding":  # (axes, not the figure of a study)
                continue
            assert len(figure.get_suptitle().split()) <= 6
            assert figure._suptitle.get_ha() == "left"
            assert figure.get_label().endswith(".")


def test_laws_have_the_names_of_their_authors():
    """Parameters are given only where laws of one name differ in them."""
    assert selection.law_names(["housner e=e_R", "energy-consistent e=e_R δ=0.05"]) == ["Housner", "Energy-consistent"]
    two = ["discrete e=0.9 δ=0.05", "discrete e=0.9 δ=0.1", "mine e=1"]
    assert selection.law_names(two) == ["Discrete δ=0.05", "Discrete δ=0.1", "mine e=1"]


def test_a_page_has_names_in_place_of_labels():
    results = xr.Dataset(coords={
        "model": ["housner e=e_R", "discrete e=e_R δ=0.05"],
        "branch_model": ("branch", ["discrete e=e_R δ=0.05"]),
        "block": ["bookcase-5-shelf", "shelf"],
    })  # fmt: skip
    named = with_law_names(results)
    assert named["model"].values.tolist() == ["Housner", "Discrete"]
    assert named["branch_model"].values.tolist() == ["Discrete"]
    text = "bookcase-5-shelf under discrete e=e_R δ=0.05 and “bookcase-5-shelf”, shelf under housner e=e_R"
    title = "“Bookcase, 5 shelves”"
    assert renamed(text, results) == f"{title} under Discrete and {title}, shelf under Housner"


def test_lines_are_even_and_words_whole():
    assert axes.wrapped("energy-consistent e=e_R", 1.5) == "energy-consistent\ne=e_R"
    assert axes.wrapped("one two three four five six", 1.6) == "one two three\nfour five six"
    assert [axes.wrapped(text, 9.0) for text in ("short", "")] == ["short", ""]


def test_more_laws_than_colours_differ():
    many = xr.concat([SHELF.isel(model=[2])] * 9, "model").assign_coords(model=[f"law {i}" for i in range(9)])
    assert len({(law.colour, law.line) for law in selection.laws(many)}) == 9


FIGURES = {
    "fragility": lambda: fragility_figure(cases.curves()),
    "laws": lambda: laws_figure(cases.curves()),
    "one block": lambda: fragility_figure(SHELF),
    "five blocks": lambda: fragility_figure(cases.curves((*"abcd", "a block with a long name, in a corner"))),
    "cloud": lambda: fragility_figure(cases.cloud()),
    "risk": lambda: risk_figure(cases.rates()),
    "close rates": lambda: risk_figure(close_rates()),
    "adaptive": lambda: fragility_figure(cases.adaptive()),
    "measures": lambda: ranking_figure(cases.measured()),
    "number": lambda: levels_figure(WHOLE),
    "loss of one law": lambda: levels_figure(cases.assessment(1), "loss"),
    "loss of many floors": lambda: levels_figure(cases.dear(), "loss"),
    "exceedance": lambda: exceedance_figure(WHOLE),
    "exceedance of one law": lambda: exceedance_figure(cases.assessment(1), "number"),
    "anchoring": lambda: anchoring_figure(cases.ranking()),
    "anchoring of one law": lambda: anchoring_figure(cases.ranking(1)),
    "uncertainty": lambda: uncertainty_figure(cases.uncertain(("shelf", "rack"))),
    "sobol": lambda: index_figure(cases.uncertain()),
    "sliding": lambda: plot.sliding([tp.Block(0.3, 1.8, name="shelf"), tp.Block(0.8, 1.6, name="chest")]).figure,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_texts_can_be_read(name):
    assert cases.faults(FIGURES[name]()) == []


def test_faults_are_found():
    figure = Figure(figsize=(2.0, 2.0))
    ax = figure.add_subplot()
    ax.set_xticks([0.0, 0.01, 1.0], ["first", "second", "third"])
    ax.set_title("a title that is far too long for its figure")
    ax.annotate("tiny", (0.5, 0.5), fontsize=5)
    said = " ".join(cases.faults(figure))
    assert "over each other: 'first' and 'second'" in said
    assert "cut: 'a title" in said
    assert "small: 'tiny'" in said


@pytest.mark.slow
def test_tables_and_messages_load_no_plotting():
    code = (
        "import sys\nfrom toppling.studies.command import cli\ncli.main(['run', 'nothing.toml'])\n"
        "from toppling.studies import show\nfrom toppling.studies.tables import assessment, fragility, slides\n"
        "print('matplotlib' in sys.modules)\nimport toppling\ntoppling.plot.fragility\n"
        "from toppling.studies.plots import uncertainty\nfrom toppling.studies.single import motions\n"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.split() == ["False", "False"]


@pytest.mark.parametrize("name", plot.__all__)
def test_the_public_functions(name):
    function = getattr(tp.plot, name)
    module = import_module(function.__module__)
    assert "pyplot" not in dir(module)
    for heading in ("Parameters", "Returns", "Raises"):
        assert f"    {heading}\n    ---" in function.__doc__


@pytest.mark.slow
def test_figures_of_many_blocks_under_several_laws_are_not_endless():
    two = cases.curves(tuple(f"block {i}" for i in range(50))).isel(model=slice(2))
    several = {2: two, 4: xr.concat([two, two.assign_coords(model=["third", "fourth"])], "model", join="outer")}
    for number, results in several.items():
        figure = fragility_figure(results)
        assert figure.get_figheight() <= 11.0  # in, 1,650 pixels
        assert len(figure.axes) == 12, number


def test_refused(refusal):
    refusal()
