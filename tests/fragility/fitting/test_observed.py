"""Levels at which shares of the runs overturn: by hand on straight curves, their ends, and how often they hold."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from known_truths import FRECHET, LOGNORMAL, MIXTURE, WEIBULL, cloud, ida, stripes
from scipy.special import stdtrit
from scipy.stats import norm

import toppling as tp
from toppling.fragility import fit_fragility
from toppling.fragility.fitting.bootstrap import draw_motions
from toppling.fragility.fitting.fit import CurveOptions, half_level_samples

LEVELS = np.geomspace(1.0, 4.0, 9)


def runs_of(shares, motions, levels=LEVELS):
    """An analysis in which so many of the motions overturn at each level."""
    fell = np.arange(motions) < np.rint(np.array(shares) * motions)[:, None]
    return xr.Dataset({"overturned": (("level", "motion"), fell)}, {"level": levels})


def ends(fit, name="half_level"):
    return [float(fit[f"{name}{end}"]) for end in ("", "_lower", "_upper")]


def test_of_a_lognormal_curve_by_hand():
    """Shares on a lognormal curve: the level is its median, the ends its fractiles at q -/+ t sqrt(q (1 - q)/n)."""
    motions, beta = 10_000, 0.4
    fit = fit_fragility(runs_of(norm.cdf(np.log(LEVELS / 2.0) / beta), motions), fractiles=[0.25], intervals="profile")
    # (what lies between levels is not known to be straight: the ends are those of the widest of three curves)
    assert ends(fit) == pytest.approx(
        [2.0 * math.exp(beta * norm.ppf(p)) for p in (0.5, *around(0.5, motions))], rel=5e-3
    )
    quarter = [
        float(one[0]) for one in (fit["fraction_level"], fit["fraction_level_lower"], fit["fraction_level_upper"])
    ]
    assert quarter == pytest.approx(
        [2.0 * math.exp(beta * norm.ppf(p)) for p in (0.25, *around(0.25, motions))], rel=5e-3
    )
    assert float(fit["misfit"]) == float(fit["misfit_low"]) == 0.0


def around(share, motions):
    half = stdtrit(motions - 1, 0.975) * math.sqrt(share * (1.0 - share) / motions)
    return share - half, share + half


def refitted(draw, replicates):
    """Levels of half of replicates, and of fits to their motions, each as often as it was drawn."""
    data = draw(LOGNORMAL, 1, 60, 7).isel(study=0)
    strata = (np.arange(60),)
    if "stripe" in data.coords:
        strata = tuple(np.flatnonzero(data["stripe"].values == stripe) for stripe in np.unique(data["stripe"]))
    again = half_level_samples(data, CurveOptions(replicates=replicates, seed=3))["half_level_sample"].values
    fits = []
    for weights in draw_motions(strata, replicates, 3):
        drawn = data.isel(motion=np.repeat(np.arange(data.sizes["motion"]), weights.astype(int)))
        labels = np.arange(drawn.sizes["motion"])
        drawn = drawn.assign_coords({name: ("motion", labels) for name in ("motion", "record") if name in drawn.coords})
        fits.append(float(fit_fragility(drawn, intervals="profile")["half_level"]))
    return again, np.array(fits)


@pytest.mark.parametrize("draw", [ida, stripes])
def test_replicates_are_fits_to_drawn_motions(draw):
    again, fits = refitted(draw, 20)
    assert again == pytest.approx(fits, rel=1e-12)


def test_replicates_of_a_cloud():
    """They keep window and dispersion of the line through all runs: they scatter as fits to drawn motions do."""
    again, fits = map(np.log, refitted(cloud, 100))
    assert np.nanmean(again) == pytest.approx(np.nanmean(fits), abs=0.02)
    assert np.nanstd(again) == pytest.approx(np.nanstd(fits), rel=0.25)
    assert np.corrcoef(again, fits)[0, 1] > 0.8


def test_half_is_half_where_the_fit_misses_it():
    """Two populations: half overturn between them, wherever the fitted median lies, and the misfit says how far off."""
    shares = [0.0, 0.3, 0.5, 0.5, 0.5, 0.6, 0.7, 0.8, 0.9]
    fit = fit_fragility(runs_of(shares, 400), intervals="profile")
    half, lower, upper = ends(fit)
    assert half == pytest.approx(LEVELS[3], rel=1e-9)  # (the middle of the levels at which exactly half fall)
    assert LEVELS[1] < lower < LEVELS[2] < LEVELS[4] < upper < LEVELS[5]
    median = float(fit["median"])
    assert float(fit["misfit"]) == (0.0 if lower <= median <= upper else pytest.approx(median / half - 1.0))
    sure = fit_fragility(runs_of([0.0, 0.0, 0.49, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6], 4000), intervals="profile")
    assert float(sure["misfit"]) == pytest.approx(float(sure["median"]) / float(sure["half_level"]) - 1.0, rel=1e-12)
    assert float(sure["misfit"]) > 0.02


def test_ends_beyond_the_levels():
    never = fit_fragility(runs_of(np.linspace(0.0, 0.3, 9), 100), intervals="profile")
    assert ends(never)[0] == math.inf
    assert ends(never)[1:] == [LEVELS[-1], math.inf]  # (three tenths of 100 are surely fewer than half)
    always = fit_fragility(runs_of(np.linspace(0.8, 1.0, 9), 100), intervals="profile")
    assert ends(always)[0] == 0.0
    assert ends(always)[1:] == [0.0, LEVELS[0]]
    few = fit_fragility(runs_of(np.linspace(0.1, 0.9, 9), 4), intervals="profile")
    assert ends(few)[1:] == [0.0, math.inf]  # (four motions tell nothing of half)
    none = fit_fragility(runs_of(np.zeros(9), 40), intervals="profile")
    assert math.isnan(ends(none)[0])
    assert ends(none)[1:] == [LEVELS[-1], math.inf]


def test_motions_count_once():
    """Both ways a motion is one: the interval is that of as many motions, not of twice as many runs."""
    shares = norm.cdf(np.log(LEVELS / 2.0) / 0.4)
    one = fit_fragility(runs_of(shares, 60), intervals="profile")
    runs = runs_of(shares, 60)
    both = xr.concat([runs, runs], "motion").assign_coords(
        record=("motion", [f"{i}" for i in range(60)] * 2), polarity=("motion", np.repeat([1, -1], 60))
    )
    assert ends(fit_fragility(both, intervals="profile")) == pytest.approx(ends(one), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [LOGNORMAL, WEIBULL, FRECHET, MIXTURE], ids=lambda shape: shape.name)
@pytest.mark.parametrize("motions", [20, 100])
@pytest.mark.parametrize("draw", [ida, stripes, cloud])
def test_how_often_they_hold(draw, motions, shape):
    """300 studies: 95 % is known to 1.3 % (one standard error); coverage is never below nominal by three of these."""
    truth = replace(shape, correlation=0.5 if draw is ida else 0.0)
    fit = fit_fragility(draw(truth, 300, motions, 1), intervals="profile", fractiles=[0.25])
    for share, name in ((0.5, "half_level"), (0.25, "fraction_level")):
        level = math.exp(truth.log_level(share))
        low, high = (fit[f"{name}_{end}"].values.ravel() for end in ("lower", "upper"))
        assert np.mean((low <= level) & (level <= high)) > 0.91


@pytest.mark.slow
def test_more_motions_do_not_make_it_worse():
    """The fitted median of two populations leaves half with more motions; the level from the runs does not."""
    held = {}
    for motions in (40, 400):
        fit = fit_fragility(ida(replace(MIXTURE, correlation=1.0), 200, motions, 2), intervals="profile")
        level = math.exp(MIXTURE.log_level(0.5))
        for name in ("median", "half_level"):
            low, high = (fit[f"{name}_{end}"].values for end in ("lower", "upper"))
            held[name, motions] = np.mean((low <= level) & (level <= high))
    assert held["median", 400] < 0.5 < held["median", 40]
    assert min(held["half_level", 40], held["half_level", 400]) > 0.91


@pytest.mark.slow
def test_of_real_runs():
    """The cabinet of exact geometry whose fitted median is 3 % above the level at which half of 4,000 motions fall."""
    shakes = tp.motions.CloughPenzien(duration=20.0, dt=0.01)
    cabinet, law, levels = tp.Block(0.4, 1.8), tp.HousnerImpact(geometry="exact"), np.geomspace(1.0, 12.0, 20)
    found = fit_fragility(tp.ida(cabinet, law, shakes.sample(200, 0), levels, screen=False), intervals="profile")
    near = np.geomspace(3.2, 4.3, 7)
    share = tp.ida(cabinet, law, shakes.sample(1500, 9), near, screen=False)["overturned"].mean("motion").values.ravel()
    half = float(np.exp(np.interp(0.5, share, np.log(near))))
    value, lower, upper = ends(found.squeeze())
    assert lower < half < upper
    assert abs(value / half - 1.0) < 0.05
