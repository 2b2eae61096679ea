"""Annual rates: closed forms to fifty digits, published numbers, quadrature, tails."""

import itertools
import warnings

import mpmath as mp
import numpy as np
import pytest
import xarray as xr
from risk_cases import LAW, ORACLE, SITE, X, curves
from scipy.stats import norm

from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import (
    Branch,
    HazardCurve,
    annual_rate,
    epistemic_rates,
    probability_in,
    rate_from_probability,
)
from toppling.fragility.curves.curve import LognormalCurves, TabulatedCurves
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.hazard.pieces import pieces_of
from toppling.fragility.risk.convolution import rates_and_slopes, rates_of
from toppling.fragility.risk.quadrature import GAUSS, KRONROD, NODES, event_integral, integrate


def plain(log_median, dispersion, step=-np.inf, smooth=None):
    """One curve as plain arrays; `smooth` is the dispersion of uplift at `step`."""
    arrays = [log_median, dispersion, step, 0.0 if smooth is None else smooth]
    return LognormalCurves(*(np.array([float(one)]) for one in arrays))


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

    @pytest.mark.parametrize("curvature", [0.0, 0.02])
    @pytest.mark.parametrize("below", ["extend", "none"])
    @pytest.mark.parametrize("above", ["extend", "none", "hold"])
    def test_slopes_are_those_of_rates(self, curvature, below, above):
        rates = np.log([6e-2, 2e-2, 7e-3, 2e-3, 4.5e-4, 7e-5, 7e-6])
        pieces = pieces_of(np.log([0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0]), rates, curvature, below, above)
        median, beta = np.meshgrid(np.linspace(-2.0, 3.0, 9), [0.1, 0.3, 0.7, 1.1])

        def at(by_median, by_dispersion):
            arrays = (median.ravel() + by_median, beta.ravel() * np.exp(by_dispersion))
            return LognormalCurves(*arrays, np.full(median.size, -np.inf), np.zeros(median.size))

        step = 1e-5
        found, slopes = rates_and_slopes(at(0.0, 0.0), pieces)
        assert np.array_equal(found.rate, rates_of(at(0.0, 0.0), pieces).rate)
        for slope, of in zip(slopes, ((step, 0.0), (0.0, step)), strict=True):
            up, down = (np.log(rates_of(at(*np.multiply(of, sign)), pieces).rate) for sign in (1.0, -1.0))
            assert slope == pytest.approx((up - down) / (2.0 * step), rel=1e-6, abs=1e-7)

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

    @pytest.mark.slow
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
        assert event_integral(plain(m, beta, step), pieces)[0] == pytest.approx(exact, rel=1e-10, abs=0.0)

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

    @pytest.mark.slow
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
            table = TabulatedCurves(np.log(x), fine["probability"].values[None], np.zeros(1))
            assert found == pytest.approx(event_integral(table, hazard.pieces()[0])[0], rel=1e-12, abs=0.0)
        levels, values = np.log([1.0, 2.0, 8.0]), np.array([[0.1, 0.5, 0.9]])
        table = TabulatedCurves(levels, values, np.zeros(1))
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
                assert found == pytest.approx(event_integral(table, pieces)[0] + held, rel=1e-11, abs=0.0), (
                    bend,
                    above,
                )

    def test_as_the_weights_of_levels_have_it(self):
        """What a performance assessment sums over its levels is the same integral, in other hands."""
        levels, values = np.array([0.5, 10.0]), np.array([0.02, 0.9])  # (of two levels a straight line)
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


@pytest.mark.parametrize(
    ("hazard", "said"),
    [
        (HazardCurve([0.5, 1.0, 2.0], [4e-2, 1e-2, 2e-3], "pga", fractile=0.84), "a fractile of 84 %, not the mean"),
        (HazardCurve([0.5, 1.0, 2.0, 4.0], [4.0, 1.8, 0.6, 0.1], "pga"), "more often than at any site"),
        (HazardCurve([0.5, 1.0, 2.0, 4.0], [4e-2, 1.8e-2, 6e-3, 1e-3], "pga"), ""),
    ],
)
@pytest.mark.parametrize("epistemic", [False, True])
def test_scripts_are_warned_of_their_hazard(hazard, said, epistemic):
    with warnings.catch_warnings(record=True, action="always") as told:
        if epistemic:
            epistemic_rates([Branch("law", "records", "hazard", curves(), hazard, 1.0)])
        else:
            annual_rate(curves(), hazard)
    assert [said in str(one.message) for one in told if "hazard: " in str(one.message)] == [True] * bool(said)
