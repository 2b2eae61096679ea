"""Figures of single responses: the drawn values are the computed ones, and other inputs are refused."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import toppling as tp
from toppling.studies import plot
from toppling.studies.plots.axes import COLOURS
from toppling.studies.plots.response import HIGHEST

BLOCK = tp.Block.from_slenderness(0.2, 0.38)
M0 = BLOCK.p**2 * math.sin(BLOCK.alpha)
E = 0.925


def decay(model, duration=3.0, dt=0.001):
    return tp.free_rocking(BLOCK, model, 0.5 * BLOCK.alpha, duration, dt)


def legend_of(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


@pytest.fixture(scope="module")
def discrete():
    return decay(tp.DiscreteDamping(e=E))


@pytest.fixture(scope="module")
def falling():
    shake = tp.motions.OneCycleSine(amplitude=8.0, omega=6.0, dt=0.01, tail=2.0).sample(1)
    run = tp.simulate(BLOCK, tp.DiscreteDamping(e=E), shake)
    assert bool(run.overturned)
    return run


class TestHistory:
    def test_draws_rotation_over_slenderness(self, discrete):
        ax = plot.history(discrete)
        (line,) = ax.get_lines()
        np.testing.assert_array_equal(line.get_xdata(), discrete.time)
        np.testing.assert_allclose(line.get_ydata(), discrete.rotation / BLOCK.alpha, rtol=1e-15)
        assert ax.get_xlabel() == "Time (s)"
        assert ax.get_ylabel() == "Rotation over slenderness, θ/α (–)"
        assert ax.get_legend() is None

    def test_several_have_a_legend_with_names_that_differ_and_the_reference_is_black(self, discrete):
        ax = plot.history([discrete, decay(tp.HousnerImpact(e=E))])
        assert legend_of(ax) == ["discrete e=0.925 δ=0.05", "housner e=0.925"]
        assert [line.get_color() for line in ax.get_lines()] == [COLOURS[0], "#222222"]
        other = tp.free_rocking(tp.Block(0.4, 1.8, name="shelf"), tp.DiscreteDamping(e=E), 0.05, 1.0)
        assert legend_of(plot.history([discrete, other])) == ["0.151 m × 0.7449 m", "shelf"]

    def test_the_cross_stands_at_the_last_balance(self, falling):
        """The cross is where |θ| = α for the last time, before the curve leaves the frame and the block lies flat."""
        ax = plot.history(falling)
        line, cross, _ = ax.get_lines()
        assert np.abs(line.get_ydata()).max() < 0.5 * math.pi / BLOCK.alpha
        assert cross.get_marker() == "X"
        (x,), (y,) = cross.get_data()
        assert abs(y) == 1.0
        time, ratio = falling.time.values, falling.rotation.values / BLOCK.alpha
        assert np.interp(x, time, ratio) == pytest.approx(y, rel=1e-12)
        assert np.all(np.abs(ratio[time > x]) > 1.0)
        assert x < float(falling.overturning_time)
        low, high = ax.get_ylim()
        assert -HIGHEST - 0.1 <= low <= y <= high <= HIGHEST + 0.1
        assert "past its balance for good" in legend_of(ax)

    def test_overturning_after_the_record(self):
        """The history ends before the block passes its balance: the cross stands at its end."""
        shake = tp.motions.OneCycleSine(amplitude=8.0, omega=6.0, dt=0.01, tail=0.01).sample(1).isel(time=slice(0, 26))
        run = tp.simulate(BLOCK, tp.DiscreteDamping(e=E), shake)
        end = float(run.time[-1])
        assert bool(run.overturned)
        assert float(run.overturning_time) > end
        assert plot.history(run).get_lines()[1].get_xdata()[0] == pytest.approx(end)

    def test_own_axes_labels_and_colors(self, discrete):
        ax = Figure().subplots()
        assert plot.history([discrete, discrete], ax, labels=["one", "two"], colors=["red", "blue"]) is ax
        assert [line.get_color() for line in ax.get_lines()] == ["red", "blue"]
        assert ax.get_legend() is None
        ax.legend()
        assert legend_of(ax) == ["one", "two"]

    @pytest.mark.filterwarnings("error")
    def test_blank_labels_leave_no_legend(self, discrete, falling):
        assert plot.history([discrete, falling], labels=["", ""]).get_legend() is None


class TestPhase:
    def test_draws_both_over_their_units(self, discrete):
        (line,) = plot.phase(discrete, label="here", color="red").get_lines()
        np.testing.assert_allclose(line.get_xdata(), discrete.rotation / BLOCK.alpha, rtol=1e-15)
        np.testing.assert_allclose(line.get_ydata(), discrete.angular_velocity / (BLOCK.p * BLOCK.alpha), rtol=1e-15)
        assert (line.get_label(), line.get_color()) == ("here", "red")
        with pytest.raises(TypeError, match="got list"):
            plot.phase([discrete])

    def test_nothing_after_overturning(self, falling):
        (line,) = plot.phase(falling).get_lines()
        assert 1.0 < np.abs(line.get_xdata()).max() < 0.5 * math.pi / BLOCK.alpha


class TestHysteresis:
    @pytest.mark.parametrize("law", [tp.DiscreteDamping(e=E), tp.GianniniMasiani(e=E)], ids=lambda law: law.law)
    def test_encloses_the_energy_lost(self, law):
        """From release to the first peak the damping moment does the work that the potential lost."""
        run = decay(law, 1.5, 2e-5)
        until = int(np.searchsorted(run.time.values, run.peak_times.values[1]))
        x, y = plot.hysteresis(run, moment="damping").get_lines()[0].get_data()
        x0, x1 = (run.peak_rotations.values / BLOCK.alpha)[:2]
        # work over M0 alpha: x - x²/2 outside the zone; the work inside the zone is the same at both ends
        # (the moment jumps at the zone's edges, within one sample of 2e-5 s)
        lost = (x0 - 0.5 * x0**2) - (x1 - 0.5 * x1**2)
        assert np.trapezoid(y[:until], x[:until]) == pytest.approx(lost, rel=2e-3)

    @pytest.mark.parametrize(("geometry", "end"), [("exact", 1.0), ("linear", BLOCK.alpha / math.sin(BLOCK.alpha))])
    def test_a_rigid_block_jumps_upright(self, geometry, end):
        """At the upright position the line is vertical, from one end of the jump to the other."""
        run = decay(tp.HousnerImpact(e=E, geometry=geometry), dt=0.02)
        x, y = plot.hysteresis(run).get_lines()[0].get_data()
        assert not np.any(x[1:] * x[:-1] < 0.0)
        rotates = run.rotation.values != 0.0
        impacts = np.count_nonzero(np.diff(np.sign(run.rotation.values[rotates])))
        assert impacts > 3
        jumps = np.abs(np.diff(y))[(x[1:] == 0.0) & (x[:-1] == 0.0)]
        assert np.count_nonzero(np.isclose(jumps, 2.0 * end, rtol=1e-9)) == impacts
        samples = np.isin(x, run.rotation.values / BLOCK.alpha) & (x != 0.0)
        np.testing.assert_array_equal(y[samples], (run.restoring_moment.values / M0)[rotates])

    @pytest.mark.parametrize("law", [tp.HousnerImpact(e=E), tp.EnergyConsistent(e=E)], ids=lambda law: law.law)
    def test_from_rest_it_goes_straight_up(self, law):
        shake = tp.motions.OneCycleSine(amplitude=3.0, omega=8.0, dt=0.01).sample(1)
        x, y = plot.hysteresis(tp.simulate(BLOCK, law, shake)).get_lines()[0].get_data()
        first = int(np.flatnonzero(x)[0])
        assert (x[first - 1], y[first - 1]) == (0.0, pytest.approx(math.copysign(1.0, x[first]), rel=1e-9))

    def test_nothing_jumps_in_an_elastic_zone(self, discrete):
        for run in (discrete, decay(tp.Vassiliou())):
            (line,) = plot.hysteresis(run).get_lines()
            np.testing.assert_array_equal(line.get_xdata(), run.rotation / BLOCK.alpha)

    def test_total_is_the_sum(self, discrete):
        parts = [plot.hysteresis(discrete, moment=name).get_lines()[0] for name in ("restoring", "damping", "total")]
        restoring, damping, total = (line.get_ydata() for line in parts)
        np.testing.assert_allclose(restoring + damping, total, atol=1e-14)
        np.testing.assert_allclose(restoring, discrete.restoring_moment / M0, rtol=1e-14)
        impacts = plot.hysteresis(decay(tp.HousnerImpact(e=E)), moment="damping").get_lines()[0]
        assert not np.any(impacts.get_ydata())  # (an impact encloses nothing)


class TestMoment:
    def test_bilinear(self):
        delta = 0.1
        line = plot.moment(BLOCK, tp.DiscreteDamping(e=E, delta=delta)).get_lines()[0]
        x, y = line.get_data()
        assert np.all(np.diff(x) >= 0.0)
        inside = np.abs(x) <= delta
        np.testing.assert_allclose(y[inside], (1.0 / delta - 1.0) * x[inside], atol=1e-14)
        np.testing.assert_allclose(y[~inside], np.sign(x[~inside]) * (1.0 - np.abs(x[~inside])), atol=1e-14)

    def test_exact_is_a_sine_and_upright_at_rest(self):
        x, y = plot.moment(BLOCK, tp.HousnerImpact(e=E)).get_lines()[0].get_data()
        sine = np.sin(BLOCK.alpha * (1.0 - x[x > 0.0])) / math.sin(BLOCK.alpha)
        np.testing.assert_allclose(y[x > 0.0], sine, atol=1e-14)
        np.testing.assert_allclose(sorted(y[x == 0.0]), [-1.0, 1.0], atol=1e-14)

    def test_rigid_rest_has_its_zone_dotted(self):
        ax = plot.moment(BLOCK, tp.EnergyConsistent(e=E, delta=0.1))
        zone, line, _ = ax.get_lines()
        np.testing.assert_allclose(np.abs(zone.get_xdata()).max(), 0.1)
        x, y = line.get_data()
        np.testing.assert_allclose(y[x > 0.0], 1.0 - x[x > 0.0], atol=1e-14)


def test_no_figure_is_left_open(discrete):
    before = plt.get_fignums()  # (of examples that ran in this process)
    for draw in (plot.history, plot.phase, plot.hysteresis):
        assert isinstance(draw(discrete).figure, Figure)
    plot.moment(BLOCK, tp.DiscreteDamping(e=E))
    assert plt.get_fignums() == before


def test_refused(refusal):
    refusal()
