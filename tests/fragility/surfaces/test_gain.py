"""Gain of another measure: against known scatter, where there is none, and in analyses of simulated motions."""

import math
import re

import numpy as np
import pytest
from check_facts import numbers_in

import toppling as tp
from toppling.fragility import pooled
from toppling.fragility.adaptive.probit import Observations
from toppling.fragility.surfaces.gain import UNKNOWN, WORTH, Gain, gain_words, measure_gain
from toppling.models import BlockArray

SCATTER, RATIOS = 0.2, 0.4


def drawn(share, seed, motions=128):
    """Three runs a motion; ln capacities fall by `share` of the ln ratio of the measures."""
    random = np.random.default_rng(seed)
    ratios = random.normal(0.3, RATIOS, motions)
    capacity = -share * (ratios - 0.3) + random.normal(0.0, SCATTER, motions)
    motion = np.repeat(np.arange(motions), 3)
    x = random.normal(0.0, 0.4, motion.size)
    return Observations(x, x > capacity[motion], motion), ratios


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0, 1.4])
def test_it_is_the_ratio_of_variances(share):
    """200 analyses: right on the average, and within the interval as often as it says, to the error of counting."""
    truth = (SCATTER**2 + (share * RATIOS) ** 2) / (SCATTER**2 + ((1.0 - share) * RATIOS) ** 2)
    found = [measure_gain(*drawn(share, seed)) for seed in range(200)]
    logs = np.log([one.value for one in found]) - math.log(truth)
    assert abs(logs.mean()) < 4.0 * logs.std() / math.sqrt(len(logs))
    assert np.mean([one.lower < truth < one.upper for one in found]) > 0.95


def test_a_measure_that_goes_with_the_first_gains_nothing():
    runs, ratios = drawn(0.5, 0)
    assert measure_gain(runs, np.full(ratios.size, 0.7)) == (1.0, 1.0, 1.0)


def test_what_tells_nothing_has_no_gain():
    runs, ratios = drawn(0.5, 0)
    few = Observations(*(one[:30] for one in runs))
    for unknown in (
        measure_gain(few, ratios),
        measure_gain(runs._replace(fell=np.zeros(runs.x.size, np.bool_)), ratios),
        measure_gain(runs, np.where(np.arange(ratios.size) == 3, -np.inf, ratios)),
    ):
        assert np.isnan(unknown).all()
        assert not unknown.lower > WORTH


def test_the_best_two_are_offered():
    gains = [Gain(2.5, 1.6, 4.0), UNKNOWN, Gain(5.0, 3.0, 8.0), Gain(3.0, 2.0, 4.5), Gain(9.0, 1.2, 40.0)]
    said = gain_words(["a", "b", "c", "d", "e"], gains)
    assert re.search(r"in c\b.*in d\b", said)
    assert numbers_in(said)[:6] == [20, 5, 99, 3, 8, 33]
    assert " a " not in said
    assert gain_words(["a"], [UNKNOWN]) == ""


SITE = tp.motions.SiteBasedScenario(magnitude=6.8, distance=15_000.0, vs30=620.0, dt=0.01)
NOISE = tp.motions.CloughPenzien(duration=10.0, dt=0.01)
CABINET = tp.Block(0.4, 1.8)


def gains(found):
    return dict(
        zip(found["other_measure"].values.tolist(), found["measure_gain"].values[..., :].reshape(-1), strict=True)
    )


@pytest.mark.slow
def test_velocity_saves_most_site_based_motions_as_is_said():
    """Both analyses are run: peak velocity takes the share of the motions that is said, or fewer."""
    until = {"median": 0.05, "motions": {"most": 6000}}
    one, other = (tp.adaptive_ida(CABINET, tp.EnergyConsistent(), SITE, im, until=until) for im in ("pga", "pgv"))
    at = one["other_measure"].values.tolist().index("pgv")
    low, value = (float(one[f"measure_gain{end}"].values[0, 0, at]) for end in ("_lower", ""))
    assert 1.5 < low < value < 5.0
    worth = [math.log1p(float(a["half_width"].item())) ** 2 * int(a["motions_run"].item()) for a in (one, other)]
    assert worth[0] / worth[1] > low
    assert re.search("housner_intensity would.*pgv would", one["account"].item())
    assert gains(other)["pga"] < 0.5
    assert "would take" not in other["account"].item()


@pytest.mark.slow
def test_velocity_saves_no_motions_of_filtered_noise():
    found = tp.adaptive_ida(CABINET, tp.EnergyConsistent(), NOISE, "pga", until={"median": 0.1})
    assert 0.5 < gains(found)["pgv"] < 1.5
    assert "would take" not in found["account"].item()
    assert found["measure_gain"].dims == ("block", "model", "other_measure")
    rate = tp.adaptive_ida(CABINET, tp.EnergyConsistent(), NOISE, "pgv", until={"dispersion": 0.4})
    assert "would take" not in rate["account"].item()


def test_a_plain_factor_is_worse_than_any_measure():
    """Motions that differ by factors alone: levels of the factor scatter with them, those of a measure do not."""
    random = np.random.default_rng(3)
    motions = NOISE.sample(96)
    motions = motions * np.exp(random.normal(0.0, 1.0, 96))[:, None]
    motions.attrs["units"] = "m s-2"
    found = tp.adaptive_ida(CABINET, tp.EnergyConsistent(), motions, "scale", until={"median": 0.3})
    assert set(gains(found)) == {"pga", "pgv", "pgd", "arias", "cav", "housner_intensity"}
    assert gains(found)["pga"] > 5.0
    assert "levels in " in found["account"].item()


@pytest.mark.slow
def test_surfaces_say_so_for_their_region():
    random = np.random.default_rng(1)
    height, slenderness = random.uniform(1.2, 2.0, 50), random.uniform(3.0, 5.0, 50)
    found = pooled(BlockArray(height / slenderness, height), tp.HousnerImpact(), NOISE, until={"median": 0.25})
    assert found["measure_gain"].dims == ("model", "other_measure")
    assert 0.5 < gains(found)["pgv"] < 1.5
    assert gains(found)["pgd"] < 1.0


def test_pairs_have_gains_of_both_components():
    pairs = tp.motions.both_axes(NOISE.sample_pairs(40))[0]
    until = {"median": 0.5, "motions": {"least": 32}}
    block = tp.Block(0.4, 1.8, depth=0.5)
    found = tp.adaptive_ida(block, tp.EnergyConsistent(), pairs, "RotD50(pga)", until=until)
    assert list(gains(found)) == ["RotD50(pgv)"]
    assert np.isfinite(gains(found)["RotD50(pgv)"])
