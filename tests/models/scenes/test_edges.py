"""Edges of shelves and benches: the slips that take a block over them, and what is refused."""

import math

import numpy as np
import pytest
from check_facts import numbers_in

import toppling as tp
from toppling import motions as mo
from toppling.fragility import fit_fragility, overturning_probability, reached
from toppling.fragility.runs.provenance import blocks_of

G = 9.80665
LEVELS = [2.0, 4.0, 8.0]
SLIDING = tp.Sliding(0.2)


def noise(n=8, seed=0):
    return mo.pad(mo.CloughPenzien(duration=12.0, dt=0.01).sample(n, seed=seed), 0.0, 5.0)


def near(front=None, back=None, when="centre", name="piece"):
    return tp.Block(0.3, 0.5, name=name, edge=tp.Edge(front, back, when))


class TestEdge:
    @pytest.mark.parametrize(
        ("edge", "slips"),
        [
            (tp.Edge(0.1), (0.25, math.inf)),
            (tp.Edge(0.1, 0.2), (0.25, 0.35)),
            (tp.Edge(0.1, falls_when="foot"), (0.1, math.inf)),
            (tp.Edge(None, 0.0, "foot"), (math.inf, 0.0)),
        ],
    )
    def test_slips_that_take_a_block_over(self, edge, slips):
        assert edge.slips(0.15) == pytest.approx(slips)

    def test_a_block_falls_beyond_its_slip_and_not_at_it(self):
        edge = tp.Edge(0.1, 0.2, "foot")
        forward, backward = np.array([0.1, 0.1001, 0.0, 0.0, np.nan]), np.array([0.0, 0.0, 0.2, 0.2001, np.nan])
        assert edge.fallen_off(forward, backward, 9.0).tolist() == [False, True, False, True, True]

    def test_label_tells_the_sides(self):
        assert numbers_in(near(0.1, 0.02, name=None).label) == [0.3, 0.5, 100, 20]


@pytest.fixture(scope="module")
def blocks():
    return near(0.02, when="foot", name="front"), near(None, 0.05, name="back"), tp.Block(0.3, 0.5, name="none")


@pytest.fixture(scope="module")
def runs(blocks):
    outputs = ("slide_forward", "slide_backward", "fallen_off")
    return tp.ida(blocks, [SLIDING, tp.Sliding(0.1)], noise(), LEVELS, outputs=outputs)


class TestRuns:
    def test_closed_form_of_a_pulse(self):
        """s = mu g t1² A (A - 1)/2 to the front: 0.27581203125 m of A = 1.5, mu = 0.3 and t1 = 0.5 s."""
        push = mo.from_array(np.full(51, -1.5 * 0.3 * G), dt=0.01)
        for distance, falls in ((0.2758, True), (0.2759, False)):
            run = tp.simulate(near(distance, when="foot"), tp.Sliding(0.3), push)
            assert bool(run.fallen_off) is falls
            assert bool(tp.simulate(near(distance - 0.15), tp.Sliding(0.3), push).fallen_off) is falls
            assert not bool(tp.simulate(near(None, distance, "foot"), tp.Sliding(0.3), push).fallen_off)
            assert bool(tp.simulate(near(None, distance, "foot"), tp.Sliding(0.3), -push).fallen_off) is falls
        assert "fallen_off" not in tp.simulate(tp.Block(0.3, 0.5), tp.Sliding(0.3), push)

    def test_flags_are_those_of_the_signed_slips(self, runs):
        forward, backward, fell = (runs[name].values for name in ("slide_forward", "slide_backward", "fallen_off"))
        np.testing.assert_array_equal(fell[0], forward[0] > 0.02)
        np.testing.assert_array_equal(fell[1], backward[1] > 0.05 + 0.15)
        assert not fell[2].any()
        assert fell[0].any()
        assert not fell[0].all()
        assert fell.dtype == np.bool_

    def test_blocks_of_runs_keep_their_edges(self, blocks, runs):
        assert [one.edge for one in blocks_of(runs)] == [one.edge for one in blocks]

    def test_both_ways_front_and_back_change_places(self, blocks):
        both = tp.ida(blocks[0], SLIDING, noise(), LEVELS, outputs=("fallen_off",), polarity="both")
        other = tp.Block(0.3, 0.5, edge=tp.Edge(None, 0.02, "foot"))
        swapped = tp.ida(other, SLIDING, noise(), LEVELS, outputs=("fallen_off",))
        np.testing.assert_array_equal(both["fallen_off"][0, 0, :, 1::2], swapped["fallen_off"][0, 0])

    def test_a_block_whose_weight_is_taken_has_fallen(self, blocks):
        pair = mo.join(noise(2, 1), noise(2, 3), noise(2, 2))
        shaken = mo.as_recorded(pair, vertical=True)
        runs = tp.ida(blocks, SLIDING, shaken, [1.0, 30.0], outputs=("slide_peak", "fallen_off"))
        lost = np.isnan(runs["slide_peak"].values)
        assert lost[:, :, 1].all()
        assert runs["fallen_off"].values[:2, :, 1].all()
        assert not runs["fallen_off"].values[2].any()


class TestCurves:
    def test_probabilities_curves_and_rates(self):
        runs = tp.ida(near(0.02, when="foot"), SLIDING, noise(20), LEVELS, outputs=("fallen_off",))
        share = runs["fallen_off"].values[0, 0].mean(axis=-1)
        assert 0.0 < share[1] < share[2]
        flags = reached(runs, "fallen_off")
        assert flags.attrs["state"].endswith("an edge")
        found = overturning_probability(runs, state="fallen_off")
        np.testing.assert_array_equal(found["probability"][0, 0], share)
        curves = fit_fragility(runs, state="fallen_off", replicates=100)
        assert curves.attrs["form"] == "isotonic"
        np.testing.assert_allclose(curves["probability"][0, 0], np.maximum.accumulate(share))
        site = tp.fragility.HazardCurve.power_law(1e-3, 2.0, "pga")
        rate = tp.annual_rate(curves, site, outside="most")
        # (isotonic curves are linear in ln x between levels, and beyond them as high as they can be)
        x = np.geomspace(LEVELS[0], LEVELS[-1], 200_001)
        p = np.interp(np.log(x), np.log(LEVELS), share)
        rates = np.diff(-1e-3 * x**-2.0)
        expected = np.sum(0.5 * (p[1:] + p[:-1]) * rates) + 1e-3 * LEVELS[-1] ** -2.0
        expected += share[0] * (site.rate_at(1e-6) if share[0] else 0.0)
        assert float(rate["rate"][0, 0]) == pytest.approx(expected, rel=1e-6)


def test_refused(refusal):
    refusal()
