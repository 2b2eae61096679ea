"""Published and closed-form numbers, to the digits in which they are given; the source stands with each."""

import math

import numpy as np
import pytest
from reference import integrate
from scipy.optimize import brentq
from scipy.stats import binom
from shared_cases import lifts_at
from thresholds import boundary, overturns

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.laws import Law
from toppling.motions import HalfSine, KanaiTajimi, OneCycleCosine, OneCycleSine, RectangularPulse, scale_to_mean

pytestmark = [pytest.mark.lowest, pytest.mark.newest]

FINE = 20_000  # samples per pulse: the chords of a sine then err by 1e-8


def fine(pulse, amplitude, omega):
    """A pulse sampled finely, long enough a tail that the record's end does not matter."""
    duration = pulse(amplitude, omega).duration
    return pulse(amplitude, omega, dt=duration / FINE, tail=duration / FINE).sample(1)


class TestFreeRocking:
    """Housner (1963): peaks x_n = 1 - sqrt(1 - e^2n [1 - (1 - x0)²]), pT/4 = acosh(1/(1 - x0))."""

    HOUSNER_PEAKS = {1: 0.401434, 2: 0.328487, 5: 0.190023, 10: 0.082244}

    @pytest.mark.parametrize("geometry", ["linear", "bilinear"])
    def test_housner_peaks(self, geometry):
        block = tp.Block.from_slenderness(0.2, 0.38)
        run = tp.free_rocking(block, tp.HousnerImpact(e=0.925, geometry=geometry), 0.5 * block.alpha, 20.0)
        x = run.peak_rotations.values / block.alpha
        for n, published in self.HOUSNER_PEAKS.items():
            assert x[n] == pytest.approx(published, abs=5e-7)
        n = np.arange(30)
        exact = 1.0 - np.sqrt(1.0 - 0.925 ** (2 * n) * 0.75)
        np.testing.assert_allclose(x[:30], exact, rtol=1e-12)

    @pytest.mark.parametrize("rest", ["elastic", "rigid"])
    @pytest.mark.parametrize("delta", [0.2, 0.05, 0.001, 1e-6])
    def test_energy_consistent_has_housners_peaks(self, rest, delta):
        block = tp.Block.from_slenderness(math.atan(0.2), 0.5)
        law = tp.EnergyConsistent(e=0.925, delta=delta, rest=rest)
        x = tp.free_rocking(block, law, 0.5 * block.alpha, 20.0).peak_rotations.values / block.alpha
        n = np.arange(11)
        exact = 1.0 - np.sqrt(1.0 - 0.925 ** (2 * n) * 0.75)
        outside = exact[exact > delta]
        np.testing.assert_allclose(x[: outside.size], outside, rtol=1e-12)

    # Free decay at e = 0.925, alpha = atan 0.2, delta = 0.05, x0 = 0.5: 1e-12 integration of each law.
    DECAY = {
        tp.DiscreteDamping: (0.41131983, 0.34490885, 0.21770197, 0.11808315),
        tp.Vassiliou: (0.43717884, 0.38875676, 0.29051030, 0.19996001),
        tp.MakrisKonstantinidis: (0.24525335, 0.15681699, 0.06660880, 0.02792737),
        tp.GianniniMasiani: (0.34195436, 0.25803813, 0.14066521, 0.07245964),
    }

    @pytest.mark.parametrize("lever", ["h", "R"])
    @pytest.mark.parametrize("law", DECAY)
    def test_decay_of_the_four_laws(self, law, lever):
        block = tp.Block.from_slenderness(math.atan(0.2), 0.5)
        model = law(lever=lever) if law is tp.Vassiliou else law(e=0.925, lever=lever)
        # Makris-Konstantinidis' tenth peak lies inside the zone, where the public list of peaks ends.
        run = simulate_peaks(block, model, 0.5 * block.alpha)
        for n, published in zip((1, 2, 5, 10), self.DECAY[law], strict=True):
            assert run[n] / block.alpha == pytest.approx(published, abs=6e-9)

    @pytest.mark.parametrize(("geometry", "quarter"), [("linear", 1.316958), ("exact", 1.3185044)])
    def test_quarter_period(self, geometry, quarter):
        block = tp.Block.from_slenderness(0.2, 0.38)
        run = tp.free_rocking(block, tp.HousnerImpact(e=1.0, geometry=geometry), 0.5 * block.alpha, 5.0)
        half = float(run.peak_times[1]) * block.p
        assert half / 2.0 == pytest.approx(quarter, abs=5e-7)


def simulate_peaks(block, model, theta0):
    """All |peaks| of free rocking, inside the zone too, from the engine's list of turning points."""
    from toppling.models.runs import trace

    run = trace(model.oscillator(block), np.zeros(4001), 0.005, theta0, max_turning_points=50)
    return np.append(abs(theta0), np.abs(run.turning_points[1]))


# Models whose first swing is the rigid block's, so that criteria without impact hold for them: in units of the
# oscillator's own rate q and threshold.
FIRST_SWING = [
    tp.HousnerImpact(e=0.9, geometry="linear"),
    tp.HousnerImpact(e=0.9, geometry="bilinear"),
    tp.HousnerImpact(e=0.9, geometry="bilinear", lever="R"),
    tp.DiscreteDamping(e=0.9, rest="rigid"),
    tp.EnergyConsistent(e=0.9),
]


def scales(block: tp.Block, model: Law):
    """Rate q of the falling branch (rad/s) and the acceleration at the static threshold (m/s²)."""
    oscillator = model.oscillator(block)
    right = max(oscillator.regions, key=lambda region: region.upper)
    return math.sqrt(-right.stiffness), lifts_at(oscillator) / oscillator.gain


@pytest.mark.parametrize("model", FIRST_SWING, ids=lambda m: m.label)
class TestFirstSwing:
    block = tp.Block.from_slenderness(0.25, 1.6)

    def threshold(self, model, pulse, w, low, high):
        q, at_rest = scales(self.block, model)
        return boundary(model.oscillator(self.block), fine(pulse, at_rest, w * q), low, high)

    def test_rectangular(self, model):
        """A = 1/(1 - exp(-p t1)) for a pulse of length t1 = pi/omega."""
        assert self.threshold(model, RectangularPulse, math.pi, 1.2, 2.0) == pytest.approx(1.581977, abs=6e-7)

    @pytest.mark.parametrize(("w", "published"), [(1.0, 1.322397), (3.0, 2.293872)])
    def test_half_sine(self, model, w, published):
        """Makris and Roussos (2000): w sin psi - cos psi = exp[-(pi - psi)/w], A = 1/sin psi."""
        psi = brentq(lambda s: w * math.sin(s) - math.cos(s) - math.exp(-(math.pi - s) / w), 0.05, 1.5)
        assert 1.0 / math.sin(psi) == pytest.approx(published, abs=6e-7)
        assert self.threshold(model, HalfSine, w, 1.05, 4.0) == pytest.approx(1.0 / math.sin(psi), rel=3e-8)

    @pytest.mark.parametrize(("w", "published"), [(1.0, 1.418315), (3.0, 3.631150)])
    def test_one_cycle_sine_without_impact(self, model, w, published):
        """Zhang and Makris (2001): w sin psi - cos psi = -exp[-(2 pi - psi)/w]; higher amplitudes fall at once."""
        psi = brentq(lambda s: w * math.sin(s) - math.cos(s) + math.exp(-(2.0 * math.pi - s) / w), 0.05, 1.5)
        assert 1.0 / math.sin(psi) == pytest.approx(published, abs=6e-7)
        # the mode with impact needs less at w = 3, so start from where the block falls without one
        q, at_rest = scales(self.block, model)
        pulse = fine(OneCycleSine, at_rest, w * q)
        critical = 1.0 / math.sin(psi)
        assert overturns(model.oscillator(self.block), pulse, critical * (1.0 + 1e-7))
        below = critical * (1.0 - 1e-7)
        oscillator = model.oscillator(self.block)
        if w == 1.0:
            assert not overturns(oscillator, pulse, below)
        # just below it turns back: the first swing's peak stays under alpha, or it falls to the other side
        run = first_fall(oscillator, pulse, below)
        above = first_fall(oscillator, pulse, critical * (1.0 + 1e-7))
        assert run != above


def first_fall(oscillator, pulse, factor):
    """Side to which the block has fallen at the end (0: it stands)."""
    from toppling.models.runs import trace

    values = np.concatenate([pulse.values[0] * factor, np.zeros(40 * FINE)])
    run = trace(oscillator, values, float(pulse["dt"][0]))
    return int(np.sign(run.history[0, -1])) if run.results[0] else 0


class TestOneCycleWithImpact:
    """Zhang and Makris (2001), p = 2.14 rad/s, alpha = 0.25, e = 0.9: overturning is not monotonic in amplitude."""

    block = tp.Block.from_slenderness(0.25, 3.0 * G / (4.0 * 2.14**2))

    # survives below the first, falls to the second, survives to the third, falls above
    WINDOWS = {
        "linear": (3.01860, 6.31807, 7.16813),
        "bilinear": (3.01860, 6.31807, 7.16813),
        "exact": (3.0323, 6.7430, 7.4930),
    }

    @pytest.mark.parametrize("geometry", WINDOWS)
    def test_windows(self, geometry):
        model = tp.HousnerImpact(e=0.9, geometry=geometry)
        oscillator = model.oscillator(self.block)
        q, at_rest = (self.block.p, G * 0.25) if geometry == "exact" else scales(self.block, model)
        pulse = fine(OneCycleSine, at_rest, 5.0 * q)
        digits = 6e-5 if geometry == "exact" else 6e-6
        for published in self.WINDOWS[geometry]:
            found = boundary(oscillator, pulse, published - 0.05, published + 0.05)
            assert found == pytest.approx(published, abs=digits)
        flags = overturns(oscillator, pulse, [2.5, 4.5, 7.0, 8.0])
        assert flags.tolist() == [False, True, False, True]

    @pytest.mark.parametrize(("geometry", "critical"), [("linear", 3.2301), ("exact", 2.2232)])
    def test_high_frequency(self, geometry, critical):
        """The same block under 15.7 rad/s: 3.24 g linearised, 2.22 g exact in print."""
        pulse = fine(OneCycleSine, G, 15.7)
        oscillator = tp.HousnerImpact(e=0.9, geometry=geometry).oscillator(self.block)
        assert boundary(oscillator, pulse, critical - 0.1, critical + 0.1) == pytest.approx(critical, abs=6e-5)


def test_half_sine_of_makris_and_roussos():
    """b = 0.2, h = 0.6 m, 2 pi rad/s: 5.4391 m/s² (they print 5.430 survives, 5.440 overturns)."""
    block = tp.Block(0.4, 1.2)
    oscillator = tp.HousnerImpact(e=0.9, geometry="linear").oscillator(block)
    assert boundary(oscillator, fine(HalfSine, 1.0, 2.0 * math.pi), 5.3, 5.6) == pytest.approx(5.4391, abs=6e-5)


def test_one_cycle_cosine():
    """b = 0.5, h = 1.5 m, 1 s, e = e_R = 0.85: 0.62598 g (Makris and Roussos 2000 print 0.6245 … 0.6255)."""
    block = tp.Block(1.0, 3.0)
    assert block.restitution == pytest.approx(0.85)
    oscillator = tp.HousnerImpact().oscillator(block)
    pulse = fine(OneCycleCosine, G, 2.0 * math.pi)
    assert boundary(oscillator, pulse, 0.60, 0.65) == pytest.approx(0.62598, abs=6e-6)


@pytest.mark.parametrize(("degrees", "percent"), [(10, 3.15), (15, 7.20), (20, 13.12)])
def test_makris_konstantinidis_ratio(degrees, percent):
    """Makris and Konstantinidis (2003), Eq. 11, with e_R."""
    block = tp.Block.from_slenderness(math.radians(degrees), 1.0)
    assert 100.0 * tp.MakrisKonstantinidis.damping_ratio(block.restitution) == pytest.approx(percent, abs=6e-3)


class TestYimChopraPenzien:
    """Yim, Chopra and Penzien (1980): R = 10 ft, e = e_R, counts of 20 motions at mean PGA 0.30 … 0.60 g."""

    LEVELS = np.array([0.30, 0.35, 0.40, 0.45, 0.50, 0.55, 0.60]) * G
    PUBLISHED = {5: (0.0, 0.10, 0.15, 0.40, 0.55, 0.75, 0.80), 6: (0.10, 0.40, 0.50, 0.65, 0.75, 0.80, 1.0)}

    @pytest.mark.slow
    def test_every_count_lies_in_the_binomial_interval(self):
        generator = KanaiTajimi(omega_g=5.0 * math.pi, xi_g=0.6, duration=30.0, dt=0.02, baseline="parabolic")
        motions = scale_to_mean(generator.sample(500, seed=1980), 1.0)
        blocks = [tp.Block.from_slenderness(math.atan(1.0 / ratio), 3.048, name=f"h/b={ratio}") for ratio in (5, 6)]
        runs = tp.ida(blocks, tp.HousnerImpact(), motions, self.LEVELS, im="scale")
        ours = tp.overturning_probability(runs).probability.values[:, 0]
        for probabilities, published in zip(ours, self.PUBLISHED.values(), strict=True):
            counts = np.round(20.0 * np.array(published))
            assert np.all(binom.ppf(0.005, 20, probabilities) <= counts)
            assert np.all(counts <= binom.ppf(0.995, 20, probabilities))
            # the curves must rise from nearly nothing to nearly everything, or the intervals would hold anything
            assert probabilities[0] < 0.3
            assert probabilities[-1] > 0.65

    def test_runs_are_those_of_an_independent_integration(self):
        """Twenty motions have little power, so the exact-geometry runs themselves are held to support/reference.py."""
        generator = KanaiTajimi(omega_g=5.0 * math.pi, xi_g=0.6, duration=30.0, dt=0.02, baseline="parabolic")
        motions = scale_to_mean(generator.sample(500, seed=1980), 0.45 * G).isel(motion=slice(0, 40))
        block = tp.Block.from_slenderness(0.2, 3.048)
        ours = tp.ida(block, tp.HousnerImpact(), motions, [1.0], im="scale")
        for i, record in enumerate(motions.values):
            arguments = {"alpha": block.alpha, "R": block.R, "e": block.restitution, "geometry": "exact", "dt": 0.02}
            truth, *twins = (
                integrate("housner", acceleration=record * (1.0 + s), **arguments) for s in (0.0, 1e-13, -1e-13)
            )
            change = max(abs(twin.peak - truth.peak) for twin in twins)
            found = ours.isel(motion=i, level=0, block=0, model=0)
            assert abs(float(found.peak_rotation) - truth.peak) <= max(1e-9 * truth.peak, 100.0 * change)
            assert bool(found.overturned) == truth.overturned
        assert 0.1 < float(ours.overturned.mean()) < 0.9
