"""Annual rates: closed forms to fifty digits, published numbers, quadrature, tails, uncertainty, inversion."""

import itertools
import json
import time

import mpmath as mp
import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

import toppling as tp
from toppling.fragility import (
    HazardCurve,
    annual_rate,
    curve_probability,
    design_for_rate,
    discrete_rate,
    probability_in,
    rate_from_probability,
    size_for_rate,
    slenderness_for_rate,
)
from toppling.fragility.convolution import rates_of
from toppling.fragility.curves import Lognormals, Tabulated
from toppling.fragility.expected import level_weights
from toppling.fragility.hazard_quadrature import events
from toppling.fragility.pieces import pieces_of
from toppling.fragility.quadrature import GAUSS, KRONROD, NODES, integrate
from toppling.units import STANDARD_GRAVITY as G

# k0 = 1e-4, k = 2.5, median 0.6, dispersion 0.4
ORACLE = 5.912472244407e-4
LAW = HazardCurve.power_law(1e-4, 2.5, "pga")
# grows steeper, as hazard curves do
X = np.geomspace(0.05, 30.0, 30)
SITE = HazardCurve(X, 0.02 * np.exp(-1.2 * np.log(X / 0.05) - 0.1 * np.log(X / 0.05) ** 2), "pga")


def curves(median=0.6, dispersion=0.4, im="pga", units="m s-2", **other):
    """Curves on block where the median is a sequence."""
    dims = ("block",) if np.ndim(median) else ()
    found = {
        "median": (dims, np.asarray(median, float), {"units": units, "long_name": "median"}),
        "dispersion": (dims, np.broadcast_to(dispersion, np.shape(median)), {"units": "1", "long_name": "dispersion"}),
    }
    return xr.Dataset(found, attrs={"im": im}).assign(other)


def plain(log_median, dispersion, step=-np.inf, smooth=None):
    """One curve as plain arrays; `smooth` is the dispersion of uplift at `step`."""
    arrays = [log_median, dispersion, step, 0.0 if smooth is None else smooth]
    return Lognormals(*(np.array([float(one)]) for one in arrays))


class TestOracles:
    def test_power_law(self):
        assert annual_rate(curves(), LAW)["rate"].item() == pytest.approx(ORACLE, rel=1e-12, abs=0.0)

    def test_power_law_through_many_points(self):
        x = np.geomspace(1e-3, 1e3, 400)
        points = HazardCurve(x, 1e-4 * x**-2.5, "pga")
        assert annual_rate(curves(), points)["rate"].item() == pytest.approx(ORACLE, rel=1e-12, abs=0.0)

    def test_power_law_in_g(self):
        law = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
        assert annual_rate(curves(0.6 * G), law)["rate"].item() == pytest.approx(ORACLE, rel=1e-12, abs=0.0)

    @pytest.mark.parametrize(
        ("k1", "k2", "median", "beta"), [(2.5, 0.1, 0.6, 0.4), (2.0, 0.3, 3.0, 0.4), (3.0, 1e-9, 0.2, 0.3)]
    )
    def test_second_order_law(self, k1, k2, median, beta):
        """sqrt(p) k0 exp(-p (k2 m² + k1 m - k1² beta²/2)), p = 1/(1 + 2 k2 beta²), m = ln median."""
        law = HazardCurve.log_quadratic(1e-4, k1, k2, "pga")
        p, m = 1.0 / (1.0 + 2.0 * k2 * beta**2), np.log(median)
        expected = np.sqrt(p) * 1e-4 * np.exp(-p * (k2 * m**2 + k1 * m - 0.5 * (k1 * beta) ** 2))
        # the formula's integral goes on below the summit, where its hazard falls: in these cases far below rounding
        assert annual_rate(curves(median, beta), law)["rate"].item() == pytest.approx(expected, rel=1e-11, abs=0.0)

    def test_second_order_law_about_its_summit(self):
        """The rate never falls towards small levels: only events above the summit count."""
        law = HazardCurve.log_quadratic(1e-2, 0.5, 0.5, "pga")
        found = annual_rate(curves(0.6, 0.5), law)["rate"].item()
        m, summit = mp.log(mp.mpf("0.6")), mp.mpf("-0.5")

        def density(u):
            h = mp.mpf("0.01") * mp.exp(-u * u / 2 - u / 2)
            return mp.ncdf((u - m) / mp.mpf("0.5")) * h * (u + mp.mpf("0.5"))

        assert found == pytest.approx(float(mp.quad(density, [summit, 0, 1, 3, 8])), rel=1e-12, abs=0.0)

    def test_baker_bradley_stafford(self):
        """Three rates .06 .016 .003 with P .1 .4 .6 make .0114 a year."""
        assert discrete_rate([0.1, 0.4, 0.6], [0.06, 0.016, 0.003]) == pytest.approx(0.0114, rel=1e-14, abs=0.0)
        labelled = xr.DataArray([[0.1, 0.4, 0.6], [0.0, 0.0, 1.0]], dims=("block", "level"))
        found = discrete_rate(labelled, [0.06, 0.016, 0.003])
        np.testing.assert_allclose(found.values, [0.0114, 0.003], rtol=1e-14)
        assert found.attrs["units"] == "year-1"
        with pytest.raises(ValueError, match="one a level, got 2 for 3 levels"):
            discrete_rate(labelled, [0.06, 0.016])

    def test_discrete_sum_nears_the_integral_from_below(self):
        exact = annual_rate(curves(), LAW)["rate"].item()
        errors = []
        for count in (100, 200, 400):
            x = np.geomspace(1e-3, 1e4, count)
            errors.append(exact - discrete_rate(curve_probability(curves(), x), 1e-4 * x**-2.5).item())
        assert errors[0] > errors[1] > errors[2] > 0.0
        ratios = errors[0] / errors[1], errors[1] / errors[2]
        assert 1.8 < ratios[0] < ratios[1] < 2.0

    def test_poisson(self):
        assert rate_from_probability(0.1, 50) == pytest.approx(1 / 474.561, rel=1e-6, abs=0.0)
        rates = np.array([1e-18, 1e-6, 1e-2])
        np.testing.assert_allclose(rate_from_probability(probability_in(rates, 7.0), 7.0), rates, rtol=1e-14)
        assert rate_from_probability(1e-18, 1.0) == 1e-18
        with pytest.raises(ValueError, match="at least 0 and below 1, got 1"):
            rate_from_probability(1.0)
        with pytest.raises(ValueError, match="years must be finite and > 0"):
            probability_in(0.1, 0.0)


def fifty_digits(u, log_rates, bend, below, above, m, beta, step):
    """Integral of H dP, each piece by completing the square in mpmath: another way than the package's."""
    u, log_rates = [mp.mpf(float(x)) for x in u], [mp.mpf(float(x)) for x in log_rates]
    bend, m, beta, w = mp.mpf(bend), mp.mpf(m), mp.mpf(beta), mp.mpf(step)
    normal = lambda z: mp.erfc(-z / mp.sqrt(2)) / 2  # noqa: E731
    pieces = []
    for (a, la), (b, lb) in itertools.pairwise(zip(u, log_rates, strict=True)):
        pieces.append((a, b, a, la, (la - lb) / (b - a) - bend * (b - a), bend))
    first, slope = u[0], pieces[0][4]
    if below == "extend" and bend > 0:
        top = first - slope / (2 * bend)
        pieces.append((top, first, first, log_rates[0], slope, bend))
        pieces.append((-mp.inf, top, top, log_rates[0] + slope**2 / (4 * bend), mp.mpf(0), mp.mpf(0)))
    else:
        pieces.append((-mp.inf, first, first, log_rates[0], slope if below == "extend" else mp.mpf(0), mp.mpf(0)))
    if above == "extend":
        a, b = u[-2:]
        last = (log_rates[-2] - log_rates[-1]) / (b - a) + bend * (b - a)
        pieces.append((b, mp.inf, b, log_rates[-1], last, bend))
    total = mp.mpf(0)
    for a, b, reference, log_rate, slope, k2 in pieces:
        if a < w <= b:
            total += mp.exp(log_rate - slope * (w - reference) - k2 * (w - reference) ** 2) * normal((w - m) / beta)
        start, stop = max(a, w), max(b, w)
        if start == stop:
            continue
        square = 1 / (2 * beta**2) + k2
        linear = slope + (reference - m) / beta**2
        middle, width = reference - linear / (2 * square), 1 / mp.sqrt(2 * square)
        scale = mp.exp(linear**2 / (4 * square) - (reference - m) ** 2 / (2 * beta**2) + log_rate) * width / beta
        low, high = (start - middle) / width, (stop - middle) / width
        total += scale * (normal(-low) - normal(-high) if low > 0 else normal(high) - normal(low))
    if above == "none" and u[-1] >= w:
        total -= normal((u[-1] - m) / beta) * mp.exp(log_rates[-1])
    return total


def random_case(rng):
    """A hazard curve with stretches steep and level, near or far from a curve broad or nearly a step."""
    n = rng.integers(2, 9)
    u = np.cumsum(10 ** rng.uniform(-2.5, 0.5, n)) + 2.0 * rng.standard_normal()
    bend = 0.0 if rng.random() < 0.6 else 10 ** rng.uniform(-6, 0)
    slopes = 10 ** rng.uniform(-2, 1, n - 1)
    if bend == 0.0:
        slopes[:-1][rng.random(n - 2) < 0.15] = 0.0
    width = np.diff(u)
    log_rates = np.log(0.1) - np.concatenate([[0.0], np.cumsum(slopes * width + bend * width**2)])
    m, beta = rng.uniform(u[0] - 3.0, u[-1] + 3.0), 10 ** rng.uniform(-3, 0.5)
    step = -np.inf if rng.random() < 0.6 else m + 2.0 * rng.standard_normal() * beta
    return u, log_rates, bend, m, beta, step


class TestExactness:
    def test_units_and_scales(self):
        """All levels times a factor, or all rates: the rate stays, or goes along; a firmer block is safer."""
        rng = np.random.default_rng(8)
        medians = np.sort(rng.uniform(0.3, 20.0, 20))
        rate = annual_rate(curves(medians), SITE)["rate"].values
        assert np.all(np.diff(rate) < 0.0)
        grown = HazardCurve(X * 3.7, SITE.rates, "pga")
        np.testing.assert_allclose(annual_rate(curves(3.7 * medians), grown)["rate"], rate, rtol=1e-13)
        more = HazardCurve(X, 3.7 * np.array(SITE.rates), "pga")
        np.testing.assert_allclose(annual_rate(curves(medians), more)["rate"], 3.7 * rate, rtol=1e-13)
        # between the two bounds that anybody can check: rate of exceeding the median, and of all events counted
        broad = annual_rate(curves(medians, 1.5), SITE, below="none")["rate"].values
        assert np.all(broad < SITE.rates[0])

    def test_random_cases_to_fifty_digits(self):
        """Relative error below 1e-12, from rates of 1e-290 to 1e30: no cancellation, no overflow."""
        rng = np.random.default_rng(5)
        checked, smallest = 0, 1.0
        with mp.workdps(60):
            for _ in range(300):
                u, log_rates, bend, m, beta, step = random_case(rng)
                for below, above in itertools.product(("extend", "none"), ("extend", "hold")):
                    exact = fifty_digits(u, log_rates, bend, below, above, m, beta, step)
                    if not 1e-290 < exact < 1e30:
                        continue
                    pieces = pieces_of(u, log_rates, bend, below, above)
                    found = rates_of(plain(m, beta, step), pieces).rate[0]
                    assert found == pytest.approx(float(exact), rel=1e-12, abs=0.0), (u, log_rates, bend, m, beta, step)
                    checked, smallest = checked + 1, min(smallest, float(exact))
        assert checked > 800
        assert smallest < 1e-100

    def test_without_what_lies_above(self):
        """above="none" takes a term away: as accurate wherever 1e-9 of the rate is left, by quadrature if need be."""
        rng = np.random.default_rng(6)
        checked, least = 0, 1.0
        with mp.workdps(60):
            for _ in range(150):
                u, log_rates, _, m, beta, step = random_case(rng)
                if np.any(np.diff(log_rates) == 0.0):
                    continue
                exact = fifty_digits(u, log_rates, 0.0, "extend", "none", m, beta, step)
                whole = fifty_digits(u, log_rates, 0.0, "extend", "hold", m, beta, step)
                if not 1e-250 < exact < 1e30 or exact < 1e-9 * whole:
                    continue
                found = rates_of(plain(m, beta, step), pieces_of(u, log_rates, 0.0, "extend", "none")).rate[0]
                assert found == pytest.approx(float(exact), rel=2e-12, abs=0.0), (u, log_rates, m, beta, step)
                checked, least = checked + 1, min(least, float(exact / whole))
        assert checked > 80
        assert least < 1e-3
        # levels so close that next to nothing happens between them
        for m in np.linspace(0.1, 1.0, 7):
            u, log_rates = np.array([0.0, 1e-4]), np.array([-3.0, -3.0 - 1e-6])
            with mp.workdps(60):
                exact = float(fifty_digits(u, log_rates, 0.0, "none", "none", m, 0.4, -np.inf))
            found = rates_of(plain(m, 0.4), pieces_of(u, log_rates, 0.0, "none", "none")).rate[0]
            assert found == pytest.approx(exact, rel=1e-12, abs=0.0)
            assert found < 1e-7

    def test_by_quadrature_in_mpmath(self):
        """Independent of any closed form: P times the density of events."""
        u, rates = np.log([0.1, 0.5, 2.0, 8.0]), [1e-1, 1e-2, 1e-2, 1e-5]
        m, beta, step = np.log(1.1), 0.45, np.log(0.7)
        pieces = pieces_of(u, np.log(rates), 0.0, "extend", "extend")
        slopes = -np.diff(np.log(rates)) / np.diff(u)

        def density(x):
            at = min(max(int(np.searchsorted(u, float(x))) - 1, 0), 2)
            return mp.ncdf((x - m) / beta) * slopes[at] * rates[at] * mp.exp(-slopes[at] * (x - u[at]))

        exact = float(mp.quad(density, [step, u[2], 1.0, u[3], 4.0, 8.0, 16.0]))
        assert rates_of(plain(m, beta, step), pieces).rate[0] == pytest.approx(exact, rel=1e-10, abs=0.0)
        assert events(plain(m, beta, step), pieces)[0] == pytest.approx(exact, rel=1e-10, abs=0.0)

    def test_steps(self):
        """A dispersion that goes to 0 is the rate of exceeding the median; so is 0 itself."""
        rate = SITE.rate_at(3.0).item()
        found = [annual_rate(curves(3.0, beta), SITE)["rate"].item() for beta in (1e-3, 1e-6, 1e-9, 1e-300, 0.0)]
        np.testing.assert_array_less(np.abs(np.array(found) / rate - 1.0), [1e-5, 1e-11, 1e-14, 1e-14, 1e-14])

    @pytest.mark.parametrize("beta", [1e-2, 1e-4, 1e-6])
    def test_steep_curves_anywhere_on_a_piece(self, beta):
        """H(m) exp(k² beta²/2) to rounding, though the ends of the piece are up to a million dispersions away."""
        at = HazardCurve([1.0, 2.0, 4.0], [1e-1, 1e-2, 1e-4], "pga")
        k = np.log2(100.0)
        medians = np.array([2.2, 2.5, 3.0, 3.5, 3.7])
        found = annual_rate(curves(medians, beta), at)["rate"]
        np.testing.assert_allclose(found, at.rate_at(medians) * np.exp(0.5 * (k * beta) ** 2), rtol=1e-13, atol=1e-20)

    def test_a_level_stretch_adds_nothing(self):
        """With slopes that go to 0 the rate goes to that of a level stretch, without a jump."""
        found = []
        for slope in (1e-3, 1e-9, 1e-15, 0.0):
            log_rates = np.array([-3.0, -3.0 - slope, -6.0])
            found.append(rates_of(plain(0.5, 0.4), pieces_of(np.array([0.0, 1.0, 2.0]), log_rates)).rate[0])
        np.testing.assert_array_less(np.abs(np.array(found) / found[-1] - 1.0), [1e-2, 1e-8, 1e-14, 1e-300])

    def test_an_extension_beyond_all_bounds_is_infinite_and_says_so(self):
        steep = HazardCurve([1.0, 2.0], [1e-2, 1e-14], "pga")
        with np.errstate(all="raise"):
            risk = annual_rate(curves(1e-3, 2.0), steep)
        assert np.isposinf(risk["rate"].item())
        assert (risk["share_below"].item(), risk["probability"].item()) == (1.0, 1.0)
        assert annual_rate(curves(1e-3, 2.0), steep, below="none")["rate"].item() < 1e-2

    @pytest.mark.parametrize("smooth", [0.05, 0.3, 1.0])
    def test_product_of_two_lognormals(self, smooth):
        m, beta, w = np.log(2.0), 0.4, np.log(1.2)
        uplift = curves(2.0, beta, uplift_median=1.2, uplift_dispersion=smooth)
        found = annual_rate(uplift, LAW)["rate"].item()

        def density(u):
            return mp.ncdf((u - m) / beta) * mp.ncdf((u - w) / smooth) * mp.exp(-mp.mpf("2.5") * u)

        exact = mp.mpf("2.5e-4") * mp.quad(density, [w - 9 * smooth, w - smooth, w, w + 1, m + 4, m + 8, m + 20])
        assert found == pytest.approx(float(exact), rel=1e-10, abs=0.0)

    def test_tabulated_on_any_hazard(self):
        """A tabulated curve as fine as a lognormal one has its rate; coarse ones are exact for what they are."""
        x = np.geomspace(0.05, 60.0, 4000)
        fine = xr.Dataset(
            {"probability": ("level", norm.cdf(np.log(x / 3.0) / 0.4))},
            {"level": ("level", x, {"units": "m s-2"})},
            {"form": "isotonic", "im": "pga"},
        )
        law = HazardCurve.log_quadratic(1e-3, 1.5, 0.2, "pga")
        for hazard in (SITE, law):
            found = annual_rate(fine, hazard, outside="least")["rate"].item()
            assert found == pytest.approx(annual_rate(curves(3.0), hazard)["rate"].item(), rel=1e-5, abs=0.0)
            table = Tabulated(np.log(x), fine["probability"].values[None], np.zeros(1))
            assert found == pytest.approx(events(table, hazard.pieces()[0])[0], rel=1e-12, abs=0.0)
        levels, values = np.log([1.0, 2.0, 8.0]), np.array([[0.1, 0.5, 0.9]])
        table = Tabulated(levels, values, np.zeros(1))
        for bend in (0.0, 1e-7, 0.05, 0.5):
            slopes = np.array([0.7, 0.9 + 2.0 * bend])
            u = np.array([0.3, 1.3, 2.3])
            log_rates = -3.0 - np.concatenate([[0.0], np.cumsum(slopes * np.diff(u) + bend)])
            for above in ("extend", "none", "hold"):
                pieces = pieces_of(u, log_rates, bend, "extend", above)
                found = rates_of(table, pieces, "least").rate[0]
                held = 0.9 * np.exp(log_rates[-1]) if above == "hold" else 0.0
                if above == "hold":
                    held = table.probability(u[-1:], "least")[0, 0] * np.exp(log_rates[-1])
                assert found == pytest.approx(events(table, pieces)[0] + held, rel=1e-11, abs=0.0), (bend, above)

    def test_as_the_weights_of_levels_have_it(self):
        """What a performance assessment sums over its levels is the same integral, in other hands."""
        levels = np.geomspace(0.5, 10.0, 8)
        values = norm.cdf(np.log(levels / 3.0) / 0.4)
        weights = level_weights(levels, SITE)
        table = xr.Dataset(
            {"probability": ("level", values)},
            {"level": ("level", levels, {"units": "m s-2"})},
            {"form": "tabulated", "im": "pga"},
        )
        expected = weights.weights @ values - weights.below * values[0]
        found = annual_rate(table, SITE, outside="least")["rate"].item()
        assert found == pytest.approx(expected, rel=1e-12, abs=0.0)
        bent = HazardCurve.log_quadratic(1e-3, 1.5, 0.2, "pga")
        fine = annual_rate(table, bent.resampled(np.geomspace(0.05, 40.0, 2000)), outside="least")["rate"].item()
        assert fine == pytest.approx(annual_rate(table, bent, outside="least")["rate"].item(), rel=1e-5)


class TestTails:
    def test_shares_and_rules(self):
        """Parts below, inside and above make the whole, and each rule leaves out what it says."""
        short = HazardCurve([0.3, 0.6, 1.2], LAW.rate_at([0.3, 0.6, 1.2]), "pga")
        whole = annual_rate(curves(), short)
        rate, below, above = (whole[name].item() for name in ("rate", "share_below", "share_above"))
        assert rate == pytest.approx(ORACLE, rel=1e-12, abs=0.0)
        inside = annual_rate(curves(), short, below="none", above="none")
        assert inside["rate"].item() == pytest.approx(rate * (1.0 - below - above), rel=1e-12, abs=0.0)
        assert inside["share_below"].item() == inside["share_above"].item() == 0.0
        assert annual_rate(curves(), short, below="none")["rate"].item() == pytest.approx(
            rate * (1.0 - below), rel=1e-12, abs=0.0
        )
        held = annual_rate(curves(), short, above="hold")
        at_top = short.rates[-1] * norm.cdf(np.log(2.0) / 0.4)
        assert held["rate"].item() == pytest.approx(rate * (1.0 - above) + at_top, rel=1e-12, abs=0.0)
        assert held["share_above"].item() == pytest.approx(at_top / held["rate"].item(), rel=1e-12, abs=0.0)
        m = np.log(0.6) - 2.5 * 0.16
        density = norm.cdf((np.log(1.2) - m) / 0.4)
        expected = ORACLE * (1.0 - density) + norm.cdf(np.log(2.0) / 0.4) * short.rates[-1]
        assert above == pytest.approx(expected / ORACLE, rel=1e-10, abs=0.0)
        assert 0.02 < below < 0.2
        assert 0.02 < above < 0.2

    @pytest.mark.parametrize("bins", [40, 7, np.geomspace(0.01, 100.0, 33)])
    def test_bins_make_the_whole(self, bins):
        two = curves([0.6, 2.0], 0.4, uplift_median=("block", [0.3, 2.5]), uplift_dispersion=("block", [0.0, 0.2]))
        for hazard, above in ((SITE, "extend"), (SITE, "hold"), (LAW, "extend")):
            risk = annual_rate(two, hazard, bins=bins, above=above)
            assert risk["share"].dims == ("block", "bin")
            assert (risk["share"] >= 0.0).all()
            spanned = risk["share"].sum("bin")
            if np.ndim(bins) == 0:
                spanned = spanned + risk["share_below"]
                if above == "extend":
                    spanned = spanned + risk["share_above"]
            np.testing.assert_allclose(spanned, 1.0, rtol=1e-12 if np.ndim(bins) == 0 else 1e-3)

    def test_bins_by_quadrature(self):
        edges = np.array([0.2, 0.5, 0.7, 3.0])
        risk = annual_rate(curves(), LAW, bins=edges)

        def density(u):
            return mp.ncdf((u - mp.log(mp.mpf("0.6"))) / mp.mpf("0.4")) * mp.mpf("2.5e-4") * mp.exp(-mp.mpf("2.5") * u)

        expected = [float(mp.quad(density, [mp.log(a), mp.log(b)])) / ORACLE for a, b in itertools.pairwise(edges)]
        np.testing.assert_allclose(risk["share"], expected, rtol=1e-12)
        np.testing.assert_allclose(risk["bin"], np.sqrt(edges[:-1] * edges[1:]))
        assert risk["bin"].attrs["units"] == "m s-2"

    def test_mean_and_mode(self):
        """The power law's own: d ln(rate)/dk is 1/k less the mean of ln x; the mode where phi/Phi = k beta."""
        risk = annual_rate(curves(), LAW, bins=np.geomspace(0.1, 3.0, 2001))
        # ln rate = ln k0 - k ln median + k² beta²/2, and the density is k H P: mean = 1/k + ln median - k beta²
        mean = 1.0 / 2.5 + np.log(0.6) - 2.5 * 0.16
        assert np.log(risk["intensity_mean"].item()) == pytest.approx(mean, abs=1e-10)
        z = np.log(risk["intensity_mode"].item() / 0.6) / 0.4
        assert norm.pdf(z) / norm.cdf(z) == pytest.approx(2.5 * 0.4, rel=2e-3, abs=0.0)
        step = annual_rate(curves(0.6, 0.0), LAW)
        assert np.log(step["intensity_mean"].item()) == pytest.approx(np.log(0.6) + 1.0 / 2.5, abs=1e-10)
        held = annual_rate(curves(0.6, 0.0), HazardCurve([0.5, 1.0], [1e-2, 5e-3], "pga"), above="hold")
        # slope 1: events between 0.6 and 1, and the rest at 1
        inside = 5e-3 / 0.6 * (1.0 + np.log(0.6)) - 5e-3 * 1.0
        assert np.log(held["intensity_mean"].item()) == pytest.approx(inside / (5e-3 / 0.6), abs=1e-10)


class TestUncertainty:
    @staticmethod
    def replicated(count=400, blocks=3, seed=2):
        rng = np.random.default_rng(seed)
        median = np.linspace(2.0, 4.0, blocks)
        found = curves(median)
        spread = np.exp(0.15 * rng.standard_normal((blocks, count)))
        attributes = found["median"].attrs
        found["median_sample"] = (("block", "replicate"), median[:, None] * spread, attributes)
        found["dispersion_sample"] = (("block", "replicate"), 0.4 * np.exp(0.1 * rng.standard_normal((blocks, count))))
        return found

    def test_replicates(self):
        data = self.replicated()
        data["median_sample"][1, 5] = np.nan
        risk = annual_rate(data, SITE, confidence=0.9)
        assert risk["rate_sample"].dims == ("block", "replicate")
        one = data.isel(block=2, replicate=7)
        alone = annual_rate(curves(one["median_sample"].item(), one["dispersion_sample"].item()), SITE)
        assert risk["rate_sample"].values[2, 7] == pytest.approx(alone["rate"].item(), rel=1e-14, abs=0.0)
        assert risk["samples_used"].values.tolist() == [400, 399, 400]
        ends = np.nanquantile(risk["rate_sample"], [0.05, 0.95], axis=1)
        np.testing.assert_allclose([risk["rate_lower"], risk["rate_upper"]], ends, rtol=1e-15)
        np.testing.assert_allclose(risk["probability_upper"], probability_in(ends[1], 50.0), rtol=1e-15)
        assert ((risk["rate_lower"] < risk["rate"]) & (risk["rate"] < risk["rate_upper"])).all()

    def test_realisations(self):
        low, high = (HazardCurve(X, factor * np.array(SITE.rates), "pga") for factor in (0.5, 3.0))
        tree = HazardCurve.from_realisations([low, high], [0.8, 0.2])
        risk = annual_rate(curves([2.0, 4.0]), tree)
        assert risk["rate_sample"].dims == ("block", "realisation")
        base = annual_rate(curves([2.0, 4.0]), SITE)["rate"].values
        np.testing.assert_allclose(risk["rate_sample"], base[:, None] * [0.5, 3.0], rtol=1e-13)
        np.testing.assert_allclose(risk["rate"], base, rtol=1e-13)
        np.testing.assert_allclose(risk["rate_upper"], 3.0 * base, rtol=1e-13)
        assert risk["weight"].values.tolist() == [0.8, 0.2]
        mostly = annual_rate(curves([2.0, 4.0]), tree, confidence=0.5)
        np.testing.assert_allclose(mostly["rate_upper"], 0.5 * base, rtol=1e-13)

    def test_both_are_crossed(self):
        data = self.replicated(50)
        tree = HazardCurve.from_realisations(
            [HazardCurve(X, factor * np.array(SITE.rates), "pga") for factor in (0.5, 1.0, 3.0)], [0.3, 0.5, 0.2]
        )
        risk = annual_rate(data, tree)
        assert risk["rate_sample"].dims == ("block", "replicate", "realisation")
        alone = annual_rate(data, SITE)["rate_sample"].values
        np.testing.assert_allclose(risk["rate_sample"], alone[..., None] * [0.5, 1.0, 3.0], rtol=1e-13)
        # weights as counts of equal samples
        every = np.repeat(risk["rate_sample"].values, [3, 5, 2], axis=2).reshape(3, -1)
        ends = np.quantile(every, [0.025, 0.975], axis=1, method="inverted_cdf")
        np.testing.assert_array_equal([risk["rate_lower"], risk["rate_upper"]], ends)

    def test_replicates_of_tabulated_curves(self):
        level = xr.Variable("level", [1.0, 2.0, 8.0], {"units": "m s-2"})
        values = np.array([[0.0, 0.4, 1.0], [0.0, 0.5, 1.0]])
        data = xr.Dataset(
            {
                "probability": ("level", values.mean(axis=0)),
                "probability_sample": (("replicate", "level"), values),
            },
            {"level": level},
            {"form": "isotonic", "im": "pga"},
        )
        risk = annual_rate(data, SITE)
        # the integral is linear in P
        assert risk["rate_sample"].values.mean() == pytest.approx(risk["rate"].item(), rel=1e-13, abs=0.0)
        assert risk["rate_sample"].values[0] < risk["rate_sample"].values[1]

    def test_fifty_curves_of_a_thousand_replicates_in_a_second(self):
        """Exactly as one by one; the bound is generous to a machine that is shared."""
        data = self.replicated(1000, 50)
        start = time.perf_counter()
        risk = annual_rate(data, SITE)
        assert time.perf_counter() - start < 3.0
        assert risk.sizes == {"block": 50, "replicate": 1000, "bin": 40}
        again = annual_rate(data.isel(block=[17]), SITE)
        np.testing.assert_array_equal(again["rate_sample"].values[0], risk["rate_sample"].values[17])


class TestDatasets:
    def test_labels(self):
        data = curves([2.0, 4.0, np.nan]).assign_coords(
            block=("block", ["slim", "squat", "wide"], {"units": "1", "long_name": "block"}),
            alpha=("block", [0.1, 0.2, 0.3], {"units": "rad", "long_name": "slenderness angle"}),
        )
        data.attrs["configuration"] = json.dumps({"im": "pga"})
        risk = annual_rate(data, SITE, years=75.0, below="none")
        for name in risk.variables:
            assert risk[name].attrs["units"], name
            assert risk[name].attrs["long_name"], name
        assert risk["rate"].attrs["units"] == "year-1"
        assert risk["alpha"].values.tolist() == [0.1, 0.2, 0.3]
        assert np.isnan(risk["rate"].values[2])
        assert np.isnan(risk["intensity_mean"].values[2])
        np.testing.assert_allclose(risk["probability"], -np.expm1(-75.0 * risk["rate"]))
        configuration = json.loads(risk.attrs["configuration"])
        assert configuration["hazard"]["im"] == "pga"
        assert configuration["hazard"]["rates"] == list(SITE.rates)
        assert [configuration[key] for key in ("below", "above", "years")] == ["none", "extend", 75.0]
        assert configuration["curves"] == {"im": "pga"}
        assert risk.attrs["title"] == "Annual rates of overturning"

    def test_survives_a_netcdf_file(self, tmp_path):
        risk = annual_rate(TestUncertainty.replicated(5), SITE)
        risk.to_netcdf(tmp_path / "risk.nc")
        xr.testing.assert_identical(xr.load_dataset(tmp_path / "risk.nc"), risk)

    def test_of_an_analysis(self):
        """From runs to a rate; of the observed probabilities as they are, it lies between the two plain sums."""
        blocks = [tp.Block(0.4, 1.8, name="slim"), tp.Block(0.6, 1.5, name="squat")]
        shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(30, seed=3)
        runs = tp.ida(blocks, tp.HousnerImpact(), shakes, np.geomspace(0.5, 12.0, 12), outputs="overturned")
        risk = annual_rate(tp.fit_fragility(runs), SITE)
        assert risk["rate"].dims == ("block", "model")
        assert (risk["rate"] > 0.0).all()
        observed = tp.overturning_probability(runs)["probability"]
        rising = observed.copy(data=np.maximum.accumulate(observed.values, axis=-1))
        table = xr.Dataset({"probability": rising}, attrs={"form": "tabulated", "im": "pga"})
        hazard = HazardCurve(runs["level"].values, SITE.rate_at(runs["level"].values), "pga")
        found = annual_rate(table, hazard, below="none", above="hold")["rate"]
        later = rising.copy(data=rising.values[..., [*range(1, 12), 11]])
        below, above = (discrete_rate(one, hazard.rates) for one in (rising, later))
        assert ((below < found) & (found < above)).all()

    def test_normalised_measures(self):
        """Curves of one normalised measure meet the hazard of pga (pgv) with each block's own levels."""
        blocks = {
            "alpha": ("block", [0.1, 0.2], {"units": "rad", "long_name": "slenderness"}),
            "p": ("block", [2.0, 3.0], {"units": "rad s-1", "long_name": "frequency parameter"}),
        }
        normalised = curves([2.0, 2.0], im="pga_normalised", units="1").assign_coords(blocks)
        found = annual_rate(normalised, SITE)["rate"]
        own = annual_rate(curves(2.0 * G * np.tan([0.1, 0.2])), SITE)["rate"]
        np.testing.assert_allclose(found, own, rtol=1e-13)
        velocity = HazardCurve.power_law(1e-3, 2.0, "pgv")
        found = annual_rate(curves([2.0, 2.0], im="pgv_normalised", units="1").assign_coords(blocks), velocity)["rate"]
        own = annual_rate(curves(2.0 * G * np.tan([0.1, 0.2]) / [2.0, 3.0], im="pgv", units="m s-1"), velocity)["rate"]
        np.testing.assert_allclose(found, own, rtol=1e-13)
        table = xr.Dataset(
            {"probability": (("block", "level"), [[0.0, 0.4, 1.0]] * 2)},
            {"level": ("level", [1.0, 2.0, 4.0], {"units": "1"}), **blocks},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        found = annual_rate(table, SITE)["rate"].values
        for at, alpha in enumerate((0.1, 0.2)):
            one = table.isel(block=at).assign_coords(
                level=("level", table["level"].values * G * np.tan(alpha), {"units": "m s-2"})
            )
            assert found[at] == pytest.approx(
                annual_rate(one.assign_attrs(im="pga"), SITE)["rate"].item(), rel=1e-12, abs=0.0
            )

    @pytest.mark.parametrize(
        ("data", "hazard", "message"),
        [
            (curves(im="pgv", units="m s-1"), SITE, "curves are of 'pgv' and the hazard curve is of 'pga'"),
            (curves(units="g"), SITE, "levels of the curves are in 'g' and of the hazard curve in 'm s-2'"),
            (curves(im=""), SITE, "must say which measure their levels are of"),
            (curves(im="scale", units="1"), SITE, "im of the curves must be one of"),
            (
                curves(im="pga_normalised", units="1"),
                HazardCurve([1.0, 2.0], [2e-3, 1e-3], "pgv"),
                "needs a hazard curve of 'pga'",
            ),
            (curves(im="pga_normalised", units="1"), SITE, "must have the coordinates alpha and p"),
            (curves().assign_coords(floor=3), SITE, "of the motions of floor 3, the hazard curve is of the ground's"),
            (curves().drop_vars("dispersion"), SITE, "dispersion is missing in median"),
            (curves(), HazardCurve([1.0, 2.0, 3.0], [2e-3, 1e-3, 1e-3], "pga"), "last two rates are equal"),
        ],
    )
    def test_refused(self, data, hazard, message):
        with pytest.raises(ValueError, match=message):
            annual_rate(data, hazard)

    def test_floors(self):
        upper = curves([2.0, 4.0]).rename(block="floor").assign_coords(floor=[0, 3])
        with pytest.raises(ValueError, match="motions of floor 3"):
            annual_rate(upper, SITE)
        there = HazardCurve(SITE.levels, SITE.rates, "pga", at="floor")
        with pytest.raises(ValueError, match="one floor's curves, got floors 0, 3"):
            annual_rate(upper, there)
        assert annual_rate(upper.isel(floor=1), there)["rate"].item() > 0.0
        assert annual_rate(upper.isel(floor=0), SITE)["rate"].item() > 0.0
        upper.attrs["configuration"] = json.dumps({"im_at": "ground"})
        assert annual_rate(upper, SITE)["rate"].dims == ("floor",)
        with pytest.raises(ValueError, match="of the ground's motion, the hazard curve is of a floor's"):
            annual_rate(upper.isel(floor=1), there)

    def test_a_tabulated_curve_too_short(self):
        level = xr.Variable("level", [1.0, 2.0, 8.0], {"units": "m s-2"})
        data = xr.Dataset(
            {"probability": ("level", [0.1, 0.4, 0.9])}, {"level": level}, {"form": "isotonic", "im": "pga"}
        )
        with pytest.raises(
            ValueError, match=r"known from 1 to 8 only, with P from 0.1 to 0.9, bounds its rate by .* and inf"
        ):
            annual_rate(data, SITE)
        inside = HazardCurve([1.5, 3.0, 6.0], [1e-2, 2e-3, 1e-4], "pga")
        with pytest.raises(ValueError, match=r"bounds its rate by 0.00\d+ and 0.00\d+ per year"):
            annual_rate(data, inside, below="none")
        exact = annual_rate(data, inside, below="none", above="hold")["rate"].item()
        assert exact == annual_rate(data, inside, below="none", above="hold", outside="most")["rate"].item()
        least, most = (
            annual_rate(data, inside, below="none", outside=rule)["rate"].item() for rule in ("least", "most")
        )
        assert exact < least < most
        np.testing.assert_allclose(
            annual_rate(data, SITE, below="none", outside="most", bins=300)["share"].sum("bin"), 1.0, rtol=1e-2
        )

    def test_options(self):
        with pytest.raises(TypeError, match="hazard must be a HazardCurve, got dict"):
            annual_rate(curves(), {})
        with pytest.raises(ValueError, match="above must be one of 'extend', 'none', 'hold'"):
            annual_rate(curves(), SITE, above="clip")
        with pytest.raises(ValueError, match="bins must be a number of bins, or at least two edges"):
            annual_rate(curves(), SITE, bins=[2.0, 1.0])
        with pytest.raises(ValueError, match="confidence"):
            annual_rate(curves(), SITE, confidence=1.0)


class TestInversion:
    def test_design_for_rate(self):
        found = design_for_rate(lambda alpha: 1e-4 * alpha**-2.5, 2e-4, 0.1, 1.0)
        assert found.value == pytest.approx(2.0**-0.4, rel=1e-8, abs=0.0)
        assert found.rate == pytest.approx(2e-4, rel=1e-7, abs=0.0)
        assert found.evaluations < 20
        rising = design_for_rate(lambda x: 1e-3 * x, 1e-3, 0.0, 4.0)
        assert rising.value == pytest.approx(1.0, rel=1e-8, abs=0.0)
        assert design_for_rate(lambda x: 1e-3 * x, 4e-3, 0.0, 4.0).value == 4.0

    @pytest.mark.parametrize(
        ("rate_of", "message"),
        [
            (lambda x: 1e-2 / x, r"target of 0.0001 per year is not met between 1 and 2: .* both lie above it"),
            (lambda x: 1e-6 / x, "both lie below it"),
            (lambda x: 1e-3 if x < 1.3 else 2e-3 if x < 1.7 else 1e-5, "rate_of must fall steadily between 1 and 2"),
            (lambda x: np.nan, "rate_of must give a rate >= 0 per year, got nan at 1"),
            (lambda x: -1.0, "got -1.0 at 1"),
        ],
    )
    def test_design_refused(self, rate_of, message):
        with pytest.raises(ValueError, match=message):
            design_for_rate(rate_of, 1e-4, 1.0, 2.0)

    @staticmethod
    def family(count=5, replicates=0):
        """Blocks of one R whose rates follow a known law: rate = 1e-4 (alpha/0.2)^-3 under LAW-like hazard."""
        alpha = np.linspace(0.1, 0.3, count)
        hazard = HazardCurve.power_law(1e-4, 3.0, "pga")
        coords = {"alpha": ("block", alpha, {"units": "rad", "long_name": "slenderness angle"})}
        data = curves(alpha / 0.2, 0.0).assign_coords(coords)
        if replicates:
            factor = np.exp(0.1 * np.random.default_rng(4).standard_normal(replicates))
            data["median_sample"] = data["median"] * xr.DataArray(factor, dims="replicate")
            data["dispersion_sample"] = xr.zeros_like(data["median_sample"])
        return data, hazard, alpha

    def test_size_for_rate(self):
        data, hazard, alpha = self.family()
        risk = annual_rate(data, hazard)
        found = size_for_rate(risk, "alpha", rate=3e-4)
        logs = np.log(risk["rate"].values)
        assert found["alpha"].item() == pytest.approx(np.interp(-np.log(3e-4), -logs, alpha), rel=1e-14, abs=0.0)
        assert found["status"].item() == "ok"
        assert found["alpha"].attrs["units"] == "rad"
        # with many blocks the law's own
        many, hazard, _ = self.family(400)
        fine = size_for_rate(annual_rate(many, hazard), probability=0.01, years=50.0)
        assert fine["alpha"].item() == pytest.approx(0.2 * (-np.log(0.99) / 50.0 / 1e-4) ** (-1 / 3), rel=1e-5, abs=0.0)
        shuffled = size_for_rate(risk.isel(block=[3, 0, 4, 1, 2]), rate=3e-4)
        assert shuffled["alpha"].item() == found["alpha"].item()

    def test_the_interval_of_a_size(self):
        data, hazard, _ = self.family(400, 999)
        found = size_for_rate(annual_rate(data, hazard), rate=2e-4, confidence=0.9)
        factors = np.sort(data["median_sample"].values[0] / data["median"].values[0])
        sizes = 0.2 * 2.0 ** (-1 / 3) / factors[::-1]
        expected = np.quantile(sizes, [0.05, 0.95])
        np.testing.assert_allclose([found["alpha_lower"], found["alpha_upper"]], expected, rtol=2e-4)
        wide = size_for_rate(annual_rate(data, hazard), rate=0.35e-4, confidence=0.9)
        assert np.isposinf(wide["alpha_upper"].item())
        assert wide["alpha_lower"].item() < 0.3

    def test_samples_that_cross_more_than_once_count_on_the_safe_side(self):
        """Falling rates: above the last crossing; rising ones: below the first."""
        rates = xr.Dataset(
            {
                "rate": ("block", [9.0, 9.0, 0.1, 0.1]),
                "rate_sample": (("replicate", "block"), [[9.0, 0.1, 9.0, 0.1]] * 3),
            },
            {"width": ("block", [1.0, 2.0, 3.0, 4.0], {"units": "m"})},
        )
        middle = np.log(9.0) / np.log(90.0)
        falling = size_for_rate(rates, "width", rate=1.0)
        assert falling["width"].item() == pytest.approx(2.0 + middle, rel=1e-14, abs=0.0)
        assert falling["width_lower"].item() == pytest.approx(3.0 + middle, rel=1e-14, abs=0.0)
        rising = rates.assign_coords(width=("block", [4.0, 3.0, 2.0, 1.0], {"units": "m"}))
        rising = size_for_rate(rising, "width", rate=1.0)
        assert rising["width"].item() == pytest.approx(3.0 - middle, rel=1e-14, abs=0.0)
        assert rising["width_upper"].item() == pytest.approx(2.0 - middle, rel=1e-14, abs=0.0)
        assert rising["samples_used"].item() == 3

    def test_says_why_there_is_no_size(self):
        rates = xr.Dataset(
            {
                "rate": (
                    ("model", "block"),
                    [[9.0, 8.0, 7.0], [0.3, 0.2, 0.1], [9.0, 0.1, 8.0], [9.0, np.nan, 0.1], [9.0, 2.0, 0.0]],
                )
            },
            {"width": ("block", [0.2, 0.4, 0.6], {"units": "m"}), "alpha": ("block", [0.1, 0.2, 0.3])},
        )
        found = size_for_rate(rates, "width", rate=1.0)
        status = ["all above the target", "all below the target", "crosses the target more than once", "no rate", "ok"]
        assert found["status"].values.tolist() == status
        # a rate of 0 is met from its own block on
        np.testing.assert_allclose(found["width"], [np.nan] * 4 + [0.6])
        with pytest.raises(ValueError, match="got neither"):
            size_for_rate(rates, "width")
        with pytest.raises(ValueError, match="got both"):
            size_for_rate(rates, "width", rate=1.0, probability=0.1)
        with pytest.raises(ValueError, match="coordinate 'height' on block"):
            size_for_rate(rates, "height", rate=1.0)
        with pytest.raises(ValueError, match=r"differ in width, got 0.2, 0.2"):
            size_for_rate(rates.isel(block=[0, 0]), "width", rate=1.0)
        with pytest.raises(TypeError, match="with `rate` on block"):
            size_for_rate(rates["rate"], "width", rate=1.0)

    def test_slenderness_for_rate(self):
        """One normalised curve, any slenderness: closed form for the power law, and the rate of the block found."""
        data = curves([2.0, 3.0], 0.4, im="pga_normalised", units="1")
        law = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
        found = slenderness_for_rate(data, law, probability=0.01, years=50.0)
        goal = -np.log(0.99) / 50.0
        expected = (1e-4 * np.exp(0.5) / goal) ** 0.4 / np.array([2.0, 3.0])
        np.testing.assert_allclose(found["tan_alpha"], expected, rtol=1e-12)
        np.testing.assert_allclose(np.tan(found["alpha"]), expected, rtol=1e-12)
        back = annual_rate(data.assign_coords(alpha=("block", found["alpha"].values), p=3.0), SITE)
        labelled = data.assign_coords(block=["slim", "wide"], alpha=("block", [0.1, 0.2]), p=("block", [2.0, 2.0]))
        again = slenderness_for_rate(labelled, SITE, rate=back["rate"].values[0])
        assert set(again.coords) == {"block"}
        assert again["alpha"].values[0] == pytest.approx(found["alpha"].values[0], rel=1e-12, abs=0.0)

    def test_slenderness_by_velocity_with_interval(self):
        data = curves([2.0], 0.4, im="pgv_normalised", units="1")
        factor = np.exp(0.1 * np.random.default_rng(4).standard_normal((1, 99)))
        data["median_sample"] = (("block", "replicate"), 2.0 * factor)
        data["dispersion_sample"] = (("block", "replicate"), np.full((1, 99), 0.4))
        law = HazardCurve.power_law(1e-3, 2.0, "pgv")
        found = slenderness_for_rate(data, law, rate=1e-3, p=3.0, confidence=0.9)
        tangent = 3.0 / G * np.exp(0.16) / 2.0
        assert found["tan_alpha"].item() == pytest.approx(tangent, rel=1e-12, abs=0.0)
        np.testing.assert_allclose(
            np.tan([found["alpha_lower"].item(), found["alpha_upper"].item()]),
            tangent * np.quantile(1.0 / factor, [0.05, 0.95]),
            rtol=1e-4,
        )
        by_block = data.assign_coords(p=("block", [3.0], {"units": "rad s-1"}))
        assert slenderness_for_rate(by_block, law, rate=1e-3)["alpha"].item() == found["alpha"].item()
        with pytest.raises(ValueError, match="coordinates alpha and p"):
            slenderness_for_rate(data, law, rate=1e-3)

    def test_no_slenderness(self):
        data = curves([2.0, np.nan], 0.4, im="pga_normalised", units="1")
        high = slenderness_for_rate(data, SITE, rate=10.0, below="none")
        assert high["status"].values.tolist() == ["all below the target", "no rate"]
        assert np.isnan(high["alpha"]).all()
        with pytest.raises(ValueError, match="curves must be of pga_normalised or pgv_normalised, got 'pga'"):
            slenderness_for_rate(curves(), SITE, rate=1e-3)

    def test_samples_that_no_slenderness_saves(self):
        """Where a branch of the hazard never comes so often (or so rarely), its sample is 0 (or pi/2)."""
        data = curves([2.0], 0.4, im="pga_normalised", units="1")
        often = HazardCurve([1.0, 2.0], [1e-1, 1e-2], "pga")
        seldom = HazardCurve([1.0, 2.0], [1e-4, 1e-5], "pga")
        tree = HazardCurve.from_realisations([often, seldom], [0.5, 0.5])
        found = slenderness_for_rate(data, tree, rate=1e-3, below="none")
        assert found["alpha_lower"].item() == 0.0
        assert found["alpha_upper"].item() == pytest.approx(
            slenderness_for_rate(data, often, rate=1e-3, below="none")["alpha"].item(), rel=1e-12, abs=0.0
        )
        # a curve that lets one block in two fall at any level
        table = xr.Dataset(
            {"probability": ("level", [0.5, 0.5])},
            {"level": ("level", [1.0, 2.0], {"units": "1"})},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        tree = HazardCurve.from_realisations([often, seldom], [0.3, 0.7])
        found = slenderness_for_rate(table, tree, rate=1e-3, below="none", above="hold", outside="most")
        assert found["status"].item() == "all above the target"
        assert found["alpha_upper"].item() == pytest.approx(np.pi / 2.0, rel=1e-15)
        assert found["alpha_lower"].item() == 0.0

    def test_slenderness_of_tabulated_curves(self):
        table = xr.Dataset(
            {"probability": ("level", [0.0, 0.4, 1.0])},
            {"level": ("level", [1.0, 2.0, 4.0], {"units": "1"})},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        found = slenderness_for_rate(table, SITE, rate=1e-3)
        back = annual_rate(table.assign_coords(alpha=found["alpha"].item(), p=1.0), SITE)
        assert back["rate"].item() == pytest.approx(1e-3, rel=1e-11, abs=0.0)


class TestQuadrature:
    def test_nodes_are_exact_for_polynomials(self):
        for power in range(0, 23, 2):
            assert KRONROD @ NODES**power == pytest.approx(2.0 / (power + 1), rel=1e-15, abs=0.0)
            if power <= 12:
                assert GAUSS @ NODES**power == pytest.approx(2.0 / (power + 1), rel=1e-15, abs=0.0)

    def test_peaks_and_jumps(self):
        """A peak of width 1e-6, a jump inside a panel, and NaN that stays with its own integral."""

        def function(u, owner):
            kinds = [np.exp(-0.5 * ((u - 0.3) / 1e-6) ** 2), (u > 0.6).astype(float), np.full_like(u, np.nan)]
            return np.choose(owner[:, None], kinds)

        start, stop = np.array([0.0, 0.299, 0.301, 0.0, 0.0]), np.array([0.299, 0.301, 1.0, 1.0, 1.0])
        found = integrate(function, start, stop, np.array([0, 0, 0, 1, 2]), np.arange(3))
        assert found[0] == pytest.approx(1e-6 * np.sqrt(2.0 * np.pi), rel=1e-10, abs=0.0)
        assert found[1] == pytest.approx(0.4, rel=1e-10, abs=0.0)
        assert np.isnan(found[2])
