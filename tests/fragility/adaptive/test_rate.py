"""Rates from weighted runs: cells against the hazard curve, and unbiasedness against the closed form."""

import math

import numpy as np
import pytest
import scipy

from toppling.core.streams import stream
from toppling.fragility import HazardCurve
from toppling.fragility.adaptive.probit import Observations
from toppling.fragility.adaptive.rate import check_hazard, draw_levels, hazard_cells, unseen_tail, weighted_rate

MEDIAN, DISPERSION = 2.0, 0.4


def closed_form(k0, k):
    """Rate of a lognormal curve under a power law (Cornell et al. 2002)."""
    return k0 * MEDIAN**-k * math.exp(0.5 * k * k * DISPERSION**2)


@pytest.mark.parametrize("k", [2.0, 3.0])
def test_cells_hold_the_rates_of_the_hazard(k):
    hazard = HazardCurve.power_law(1e-2, k, "pga")
    cells = hazard_cells(hazard, math.log(MEDIAN), DISPERSION)
    assert cells.masses.sum() == pytest.approx(float(hazard.rate_at(math.exp(cells.edges[0]))), rel=1e-12)
    number = np.arange(cells.edges.size - 1)
    for share in (0.0, 0.3, 1.0):
        x = cells.at(number, np.full(number.size, share))
        left = hazard.rate_at(np.exp(x))
        assert left == pytest.approx(cells.rates[:-1] - share * cells.masses[:-1], rel=1e-9)
    assert cells.at(np.array([cells.edges.size - 1]), np.array([0.7])) == cells.edges[-1]


def test_cells_have_edges_where_the_hazard_has_corners():
    hazard = HazardCurve([0.5, 1.0, 3.0, 8.0], [1e-2, 8e-3, 2e-4, 1e-6], "pga")
    cells = hazard_cells(hazard, math.log(MEDIAN), DISPERSION)
    assert set(np.log([0.5, 1.0, 3.0, 8.0])) <= set(cells.edges.tolist())
    assert np.exp(np.log(cells.rates)) == pytest.approx(hazard.rate_at(np.exp(cells.edges)), rel=1e-12)


@pytest.mark.parametrize("k", [2.0, 3.0])
def test_the_rate_of_a_curve_is_the_closed_form(k):
    cells = hazard_cells(HazardCurve.power_law(1e-2, k, "pga"), math.log(MEDIAN), DISPERSION)
    x, rates = cells.points
    found = float((rates * scipy.special.ndtr((x - math.log(MEDIAN)) / DISPERSION)).sum())
    # (four dispersions to both sides of what matters: Phi(-4) is left out)
    assert found == pytest.approx(closed_form(1e-2, k), rel=5e-5)


@pytest.mark.parametrize("strata", [3, 10, 20])
@pytest.mark.parametrize("k", [2.0, 3.0])
def test_weighted_runs_are_unbiased_for_any_number_of_levels(k, strata):
    """10,000 motions of one capacity each, drawn with a curve that is wrong in both parameters."""
    hazard = HazardCurve.power_law(1e-2, k, "pga")
    random = np.random.default_rng(strata)
    wrong = math.log(1.2 * MEDIAN), 0.5
    cells = hazard_cells(hazard, *wrong)
    n = 10_000
    x, weights = draw_levels(cells, *wrong, random.random((2, strata, n)))
    fell = x > math.log(MEDIAN) + DISPERSION * random.standard_normal(n)
    found = weighted_rate(weights.ravel(), fell.ravel(), np.tile(np.arange(n), strata))
    assert found.motions == n
    assert abs(found.value - closed_form(1e-2, k)) < 3.0 * found.error
    assert found.error < 0.05 * found.value


def test_where_everything_overturns_the_rate_is_that_of_the_lowest_level():
    hazard = HazardCurve.power_law(1e-2, 2.0, "pga")
    cells = hazard_cells(hazard, math.log(MEDIAN), DISPERSION)
    x, weights = draw_levels(cells, math.log(MEDIAN), DISPERSION, np.random.default_rng(0).random((2, 5, 20_000)))
    found = weighted_rate(weights.ravel(), np.ones(x.size, bool), np.tile(np.arange(20_000), 5))
    assert abs(found.value - cells.masses.sum()) < 3.0 * found.error
    assert x.min() >= cells.edges[0]
    assert x.max() <= cells.edges[-1]


def test_runs_without_a_weight_are_left_out():
    weights = np.array([math.nan] * 4 + [1.0, 3.0] * 8)
    motion = np.array([0, 1, 2, 3, *np.repeat(np.arange(4, 12), 2)])
    fell = np.array([True] * 4 + [True, False] * 8)
    found = weighted_rate(weights, fell, motion)
    assert (found.value, found.error, found.motions) == (1.0, 0.0, 8)
    assert weighted_rate(weights[:8], fell[:8], motion[:8]).reach == math.inf


def drawn(chance, n, k=2.5, seed=0):
    """Weighted runs, 3 a motion, of a probability at ln levels, and their cells."""
    random = np.random.default_rng(seed)
    cells = hazard_cells(HazardCurve.power_law(1.0, k, "pga"), math.log(MEDIAN), 0.35)
    x, weights = draw_levels(cells, math.log(MEDIAN), 0.35, random.random((2, 3, n)))
    fell = random.random(x.shape) < chance(x)
    return cells, weights.ravel(), Observations(x.ravel(), fell.ravel(), np.tile(np.arange(n), 3))


def power(x):
    """A tail that is a power of the level, of which half overturn at the median."""
    return -np.expm1(-math.log(2.0) * np.exp(4.0 * (x - math.log(MEDIAN))))


def test_a_tail_below_the_falls_is_what_the_weighted_runs_lack():
    """Against the integral: what lies below the fortieth fall, less what the weighted runs say of it."""
    gaps = []
    for seed in range(20):
        cells, weights, seen = drawn(power, 1500, seed=seed)
        at = np.sort(seen.x[seen.fell])[39]
        x, rates = cells.points
        below = x < at
        found = weights[seen.fell & (seen.x <= at)].sum() / 1500
        truth = float(rates[below] @ power(x[below]))
        tail = unseen_tail(cells, weights, seen)
        assert tail >= 0.0
        gaps.append((tail - max(0.0, truth - found)) / truth)
    assert abs(np.mean(gaps)) < 0.15


def test_a_tail_that_the_runs_have_seen_adds_next_to_nothing():
    cells, weights, seen = drawn(lambda x: scipy.special.ndtr((x - math.log(MEDIAN)) / DISPERSION), 40_000)
    assert unseen_tail(cells, weights, seen) < 0.01 * weighted_rate(weights, seen.fell, seen.motion).value


def test_a_tail_is_not_known_from_few_falls():
    cells, weights, seen = drawn(power, 40)
    assert seen.fell.sum() < 200
    assert unseen_tail(cells, weights, seen) == math.inf


def test_hazards_that_plunge_above_their_levels_have_cells_with_rates():
    """As those that end at the strongest motion there can be: above it nothing happens."""
    hazard = HazardCurve([1.0, 5.0, 5.0005], [1e-1, 1e-2, 1e-3], "pga")
    check_hazard(hazard, hazard.im)
    cells = hazard_cells(hazard, math.log(8.0), 0.3)
    assert (np.diff(cells.rates) <= 0.0).all()
    assert (cells.rates > 0.0).all()
    assert (cells.masses >= 0.0).all()
    levels, weights = draw_levels(cells, math.log(8.0), 0.3, stream(1).random((2, 4, 200)))
    assert np.isfinite(levels).all()
    assert np.isfinite(weights).all()


def test_refused(refusal):
    refusal()
