"""Inventories run both ways: the mean of both polarities, and intervals that draw a motion with its two outcomes."""

import math
from dataclasses import replace
from itertools import pairwise

import dask
import numpy as np
import pytest
import scipy
from assessed import anchoring, assess, assessed
from numpy.testing import assert_allclose, assert_array_equal

import toppling as tp
from toppling.fragility import HazardCurve, wilson_interval
from toppling.fragility.fitting.bootstrap import draw_motions
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.runs.provenance import number_of_motions
from toppling.fragility.uncertainty.joint import Variability
from toppling.models import laws
from toppling.motions import Building
from toppling.motions.floors.histories import FloorHistories, History
from toppling.studies.buildings.assessment import Assessment, distinct_runs, polarity_of
from toppling.studies.buildings.branches import InventoryBranch, Sampling, rates_over_branches
from toppling.studies.buildings.variables import Year
from toppling.studies.inventory.consequences import Consequence, Injury
from toppling.studies.inventory.contents import Contents, Inventory

LAW = tp.HousnerImpact(geometry="linear")
STRAP = tp.Restraint.strap(1.4, 267.0, 20e3, 0.005)
WALLED = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02))
FREE = tp.Block(0.3, 1.4)
MIXED = Inventory(
    (
        Contents("case", WALLED, 0, 3, value=100.0, consequences=("injury",), anchoring_cost=5.0),
        Contents(
            "shelf", tp.Block(0.35, 1.5, cm_offset=0.03), 2, 2, value=50.0, consequences=("injury", "blocks-exit")
        ),
        Contents("strapped", replace(WALLED, restraint=STRAP), 1, 1, value=10.0, kit="strap"),
        Contents("fixed", WALLED, 1, 5, value=500.0, anchored=True),
        Contents("free", FREE, 2, 4, value=20.0, consequences=("blocks-exit",), e=0.9),
    ),
    "EUR",
)
DRAWN = replace(
    MIXED,
    rows=tuple(
        replace(row, value=0.0, cost=Consequence(80.0, 0.4), downtime=Consequence(3.0, 0.5), injury=Injury(0.2, 0.5))
        for row in MIXED.rows
    ),
)
GROUNDED = replace(MIXED, rows=tuple(replace(row, floor=0) for row in MIXED.rows))
SYMMETRIC = replace(
    DRAWN,
    rows=tuple(replace(row, block=FREE if i % 2 else tp.Block(0.4, 1.8), kit="") for i, row in enumerate(DRAWN.rows)),
)
MOTIONS = tp.motions.pad(tp.motions.CloughPenzien(duration=8.0, dt=0.01, s0=0.05).sample(15, seed=2), 0.0, 6.0)
MINUS = MOTIONS.copy(data=-MOTIONS.values)
N = MOTIONS.sizes["motion"]
FRAME = Building.flexural_shear(0.4, storeys=3)
LEVELS = np.geomspace(0.8, 12.0, 7)
CURVE = HazardCurve(np.geomspace(0.2, 20.0, 12).tolist(), (0.02 * np.geomspace(0.2, 20.0, 12) ** -1.8).tolist(), "pga")
VARIED = Variability(0.02, 0.05, variants=4, realisations=5)
EVERY_LAW = [law(zeta=0.05) if law is tp.ViscousDamping else law() for law in laws.LAWS.values()]
MEANS = ("probability", "mean", "exceedance", "rate", "annual")


def found(inventory, polarity=None, motions=MOTIONS, building=FRAME, **options):
    options = {"hazard": CURVE, "replicates": 200, **options}
    return assessed(inventory, LAW, motions, LEVELS, "pga", building, polarity=polarity, **options)


def averaged(results):
    """Names of the means, probabilities and rates, without the ends of their intervals and the errors of draws."""
    return [
        str(name)
        for name, one in results.data_vars.items()
        if "motion" not in one.dims
        and any(word in str(name) for word in MEANS)
        and not str(name).endswith(("_lower", "_upper", "_sampling_error"))
        and not str(name).startswith("level_weight")
    ]


def of_each(values):
    """Means (…, motion) over the two runs of each motion."""
    return 0.5 * (values[..., ::2] + values[..., 1::2])


@pytest.fixture(scope="module")
def both():
    return found(MIXED)


class TestMeanOfBothPolarities:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("inventory", "options"),
        [
            (MIXED, {}),
            (MIXED, {"variability": VARIED, "sides": True}),
            (DRAWN, {}),
            (MIXED, {"modelling_dispersion": 0.3}),
            (DRAWN, {"modelling_dispersion": 0.3, "hazard": None}),
            (GROUNDED, {"building": None}),
        ],
        ids=["plain", "varied", "drawn", "modelled", "modelled at levels", "on the ground"],
    )
    def test_of_two_assessments(self, inventory, options):
        one = found(inventory, "both", **options)
        plus, minus = (found(inventory, "as recorded", motions, **options) for motions in (MOTIONS, MINUS))
        for name in ("overturned", "front", "number", "loss"):
            values = one[name].transpose(..., "motion").values
            assert_array_equal(values[..., ::2], plus[name].transpose(..., "motion").values)
            assert_array_equal(values[..., 1::2], minus[name].transpose(..., "motion").values)
        assert (plus["overturned"].values != minus["overturned"].values).any()
        names = averaged(one)
        assert {"probability", "front_probability", "number_mean", "any_probability"} <= {*names}
        assert ("annual_loss" in names) == (options.get("hazard", CURVE) is not None)
        for name in names:
            expected = 0.5 * (plus[name].values + minus[name].values)
            assert_allclose(one[name].values, expected, rtol=1e-12, atol=1e-15, err_msg=name)

    def test_as_recorded_and_by_default(self, both):
        assert polarity_of(MIXED) == "both"
        assert polarity_of(SYMMETRIC) == "as recorded"
        anchored = replace(MIXED, rows=tuple(replace(row, anchored=not row.e) for row in MIXED.rows if not row.kit))
        assert polarity_of(anchored) == "as recorded"
        assert both["polarity"].values.tolist() == [1, -1] * N
        assert both["record"].values.tolist() == np.repeat(MOTIONS["motion"].values, 2).tolist()
        assert number_of_motions(both) == N
        plain = found(MIXED, "as recorded")
        assert "polarity" not in plain.coords
        assert "polarity" not in plain.attrs["configuration"]
        assert '"polarity": "both"' in both.attrs["configuration"]
        assert_array_equal(plain["overturned"].values, both["overturned"].values[..., ::2])

    def test_pieces_of_a_motion_see_the_same_polarity(self, both):
        """What falls together is counted run by run, not from the two chances of each motion."""
        of_pieces = both["overturned"].values[0]  # item, level, run
        number = np.einsum("ilr,i->lr", of_pieces, [row.count for row in MIXED.rows])
        assert_array_equal(both["number"].values[0, 0], number)
        happens = of_pieces.any(axis=0)
        assert_allclose(both["any_probability"].values[0, 0], happens.mean(axis=-1), rtol=1e-14)
        chances = of_each(of_pieces.astype(float))
        assert np.abs(1.0 - (1.0 - chances).prod(axis=0).mean(axis=-1) - happens.mean(axis=-1)).max() > 0.01
        for k, threshold in enumerate(both["number_threshold"].values):
            share = (number >= threshold).mean(axis=-1)
            assert_allclose(both["number_exceedance"].values[0, 0, :, k], share, atol=1e-15)

    def test_bits_do_not_depend_on_workers(self, both):
        with dask.config.set(num_workers=1):
            again = found(MIXED)
        assert again.identical(both)


class TestIntervals:
    """Draws are of N motions, each with both its outcomes."""

    def test_annual_values_by_a_plain_bootstrap_of_motions(self, both):
        weights = level_weights(LEVELS, CURVE).weights
        flags = both["overturned"].values[0]
        counts = np.array([row.count for row in MIXED.rows])
        each = of_each(np.einsum("ilr,i,l->r", flags, counts, weights))
        assert both["annual_number"].values[0, 0] == pytest.approx(each.mean(), rel=1e-12)
        drawn = draw_motions((np.arange(N),), 200, 0)
        assert (drawn.sum(axis=1) == N).all()
        mean, error = each.mean(), each.std()
        steps, logarithms = [], []
        for often in drawn:
            own = np.repeat(each, often.astype(int))
            ratio = error / math.sqrt(0.95 * own.var() + 0.05 * error**2)
            steps.append((own.mean() / mean - 1.0) * ratio)
            logarithms.append(own.mean() / mean * math.log(own.mean() / mean) * ratio)
        ends = {
            "lower": mean * math.exp(-np.quantile(logarithms, 0.975)),
            "upper": mean * (1.0 - 0.5 * np.quantile(steps, 0.025)) ** 2,
        }
        for end, own in ends.items():
            assert both[f"annual_number_{end}"].values[0, 0] == pytest.approx(own, rel=1e-9)
        # another program's BCa interval, with draws of its own, is shorter above
        rng = np.random.default_rng(1)
        other = scipy.stats.bootstrap((each,), np.mean, n_resamples=20_000, method="BCa", rng=rng).confidence_interval
        assert other.high < both["annual_number_upper"].values[0, 0] < other.high + (other.high - other.low)
        assert abs(both["annual_number_lower"].values[0, 0] - other.low) < 0.15 * (other.high - other.low)

    def test_probabilities_count_motions(self, both):
        for i in (0, 1, 4):
            successes = both["overturned"].values[0, i].sum(axis=-1) / 2.0
            lower, upper = wilson_interval(successes, np.full(LEVELS.size, N), 0.95)
            assert_allclose(both["probability_lower"].values[0, i], lower, atol=1e-14)
            assert_allclose(both["probability_upper"].values[0, i], upper, atol=1e-14)

    def test_quantiles_are_of_ranks_of_motions(self, both):
        number = both["number"].values[0, 0]  # level, run
        for q, probability in enumerate(both["quantile"].values):
            cumulative = scipy.stats.binom.cdf(np.arange(N + 1), N, probability)
            low, high = np.searchsorted(cumulative, 0.025), np.searchsorted(cumulative, 0.975) + 1
            pooled = np.sort(number, axis=-1)
            lower = pooled[:, 2 * (low - 1)] if low > 0 else 0.0
            upper = pooled[:, 2 * high - 1] if high <= N else sum(row.count for row in MIXED.rows if not row.anchored)
            assert_array_equal(both["number_quantile_lower"].values[0, 0, :, q], lower)
            assert_array_equal(both["number_quantile_upper"].values[0, 0, :, q], upper)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "options",
        [
            {},
            {"variability": VARIED},
            {"modelling_dispersion": 0.3},
            {"modelling_dispersion": 0.3, "hazard": None},
            {"modelling_dispersion": 0.2, "variability": VARIED},
        ],
        ids=["plain", "varied", "modelled", "modelled at levels", "all"],
    )
    def test_equal_outcomes_are_one(self, options):
        """Symmetric pieces fall under a motion and its reverse: every value and interval is that of N motions."""
        twice, once = (found(SYMMETRIC, way, **options) for way in ("both", "as recorded"))
        assert twice.sizes["motion"] == 2 * once.sizes["motion"]
        assert {*twice.data_vars} == {*once.data_vars}
        for name, one in once.data_vars.items():
            values = twice[name].values
            if "motion" in one.dims:
                values = twice[name].isel(motion=slice(0, None, 2)).values
                assert_array_equal(twice[name].isel(motion=slice(1, None, 2)).values, values)
            assert_array_equal(values, one.values, err_msg=str(name))

    def test_half_of_the_falls_of_symmetric_pieces_are_to_the_front(self):
        one = found(SYMMETRIC, "both", sides=True)
        assert (one["rate"].values[0] > 0.0).sum() == 4
        for end in ("", "_lower", "_upper"):
            assert_allclose(one[f"front_rate{end}"], 0.5 * one[f"rate{end}"], rtol=1e-12)
        assert_allclose(one["front_probability"], 0.5 * one["probability"], rtol=1e-12)


class TestSymmetricPieces:
    """They are run as recorded, and mirrored."""

    @pytest.mark.parametrize("law", EVERY_LAW, ids=lambda law: law.law)
    def test_the_engine_mirrors_them_bit_for_bit(self, law):
        blocks = [FREE, tp.Block(0.4, 1.8, name="other")]
        if law.law in ("housner", "bilinear-damping", "discrete-damping"):
            blocks.append(tp.Block(0.3, 1.8, name="niche", wall=tp.Wall(0.05, front_gap=0.05)))
        kinds = []
        for block in blocks:
            try:
                law.oscillator(block)
                kinds.append(block)
            except ValueError:
                continue
        assert not any(block.sided for block in kinds)
        runs = tp.ida(kinds, law, MOTIONS, LEVELS, outputs=["direction", "peak_rotation"], polarity="both")
        sides = runs["direction"].values
        assert (sides != 0).sum() > 40
        assert_array_equal(sides[..., ::2], -sides[..., 1::2])
        peaks = runs["peak_rotation"].values
        assert_array_equal(np.abs(peaks[..., ::2]), np.abs(peaks[..., 1::2]))

    def test_they_cost_no_further_runs(self):
        counted = []
        found(MIXED, "both", progress=lambda done, total: counted.append((done, total)))
        assert distinct_runs(MIXED) == 4
        assert distinct_runs(MIXED, polarity="both") == 7  # (the free line once)
        assert counted[-1] == (7 * N * LEVELS.size,) * 2
        assert all(a[0] <= b[0] for a, b in pairwise(counted))
        assert distinct_runs(SYMMETRIC, VARIED, "both") == distinct_runs(SYMMETRIC, VARIED)

    def test_they_are_what_running_them_gives(self):
        """In another inventory the same pieces are run both ways, here as reversed motions of their own."""
        one = found(SYMMETRIC, "both", sides=True)
        reverse = found(SYMMETRIC, "as recorded", MINUS, sides=True)
        assert one["front"].any()
        for name in ("overturned", "front"):
            assert_array_equal(one[name].values[..., 1::2], reverse[name].values)


def fixed(row, label):
    if row.label != label:
        return row
    return replace(row, anchored=True, kit="", block=replace(row.block, restraint=None))


class TestAnchoring:
    @pytest.mark.slow
    @pytest.mark.parametrize("objective", ["number", "loss", "any", "injury"])
    def test_savings_are_differences_of_assessments(self, both, objective):
        ranked = anchoring(both, objective, replicates=200)
        name = {"any": "any_rate", "injury": "consequence_rate"}.get(objective, f"annual_{objective}")

        def value(results):
            here = results[name].isel(model=0).sel(place="building")
            return float(here.sel(consequence=objective) if objective == "injury" else here)

        for i, label in enumerate(ranked["block"].values):
            without = found(replace(MIXED, rows=tuple(fixed(row, label) for row in MIXED.rows)), "both")
            saving = ranked["saving"].values[0, i]
            assert saving == pytest.approx(value(both) - value(without), rel=1e-9, abs=1e-15)
            assert not ranked["saving_lower"].values[0, i] > saving

    @pytest.mark.slow
    def test_equal_outcomes_are_one(self):
        for objective in ("number", "any", "blocks-exit"):
            twice, once = (
                anchoring(found(SYMMETRIC, way), objective, replicates=200) for way in ("both", "as recorded")
            )
            for name in once.data_vars:
                assert_array_equal(twice[name].values, once[name].values, err_msg=str(name))

    def test_parts_of_the_motions_hold_both_polarities(self, both, monkeypatch):
        whole = anchoring(both, "any", replicates=200)
        monkeypatch.setattr("toppling.fragility.numerics.slabs.RUNS", 40)
        assert anchoring(both, "any", replicates=200).identical(whole)


def branch(weight, curve=CURVE, name="hazard"):
    return InventoryBranch(LAW.label, "motions", name, curve, weight)


class TestBranches:
    CURVES = (CURVE, replace(CURVE, rates=tuple(1.7 * np.array(CURVE.rates))))

    def rates(self, assessment, inventory, **options):
        each = [branch(weight, curve, str(weight)) for weight, curve in zip((0.4, 0.6), self.CURVES, strict=True)]
        return rates_over_branches(each, {"motions": assessment}, inventory, Sampling(200, 0, **options))

    @pytest.fixture(scope="class")
    def assessed(self):
        ways = ("both", MOTIONS), ("as recorded", MOTIONS), ("as recorded", MINUS)
        return [found(DRAWN, way, motions) for way, motions in ways]

    @pytest.mark.slow
    @pytest.mark.parametrize("options", [{}, {"beta": 0.3}, {"beta": 0.3, "spread": True}], ids=str)
    def test_means_are_those_of_both_polarities(self, assessed, options):
        one, plus, minus = (self.rates(each, DRAWN, **options) for each in assessed)
        for name in one.data_vars:
            if str(name).startswith("branch_share") or "fractile" in str(name) or "spread" in str(name):
                continue
            expected = 0.5 * (plus[name].values + minus[name].values)
            assert_allclose(one[name].values, expected, rtol=1e-11, atol=1e-16, err_msg=str(name))

    def test_fractiles_are_of_drawn_motions(self):
        """Of one item and one hazard: percentiles of the plain cluster bootstrap."""
        one = found(MIXED, "both")
        rates = rates_over_branches([branch(1.0)], {"motions": one}, MIXED, Sampling(200, 0))
        each = of_each(np.einsum("lr,l->r", one["overturned"].values[0, 0], level_weights(LEVELS, CURVE).weights))
        means = draw_motions((np.arange(N),), 200, 0) @ each / N
        fractiles = rates["epistemic_rate_fractile"].values[0]
        for q, value in zip(rates["epistemic_fractile"].values, fractiles, strict=True):
            near = np.sort(means)[[max(0, int(200 * q) - 2), min(199, int(200 * q) + 1)]]
            assert near[0] * (1 - 1e-9) <= value <= near[1] * (1 + 1e-9)


def histories(own, scale=1.0, elastic=False):
    """Floor motions of FRAME, of 3 motions at 3 levels: the same, or of each level its own."""
    at = LEVELS[[1, 3, 5]]
    found = []
    for i, level in enumerate(at[:1] if elastic else at):
        part = MOTIONS.isel(motion=np.arange(4) + (4 * i if own else 0) % 12)
        peaks = np.abs(part).max("time").values[:, None]
        moved = FRAME.floor_motions(part.copy(data=scale * level * part.values / peaks))
        for j, label in enumerate(part["motion"].values):
            found += [
                History(float(level), str(label), str(floor), "", moved.values[j, k], 0.01, "made")
                for k, floor in enumerate(moved["floor"].values)
            ]
    return replace(FloorHistories.of(found, "m/s²"), elastic=elastic)


class TestHistories:
    @pytest.mark.slow
    @pytest.mark.parametrize("own", [True, False])
    def test_mean_of_both_polarities(self, own):
        at = LEVELS[[1, 3, 5]]

        def run(inventory, polarity, scale=1.0):
            given = histories(own, scale)
            return assess(
                inventory, Assessment(LAW, given, at, hazard=CURVE, polarity=polarity, replicates=200), sides=True
            )

        one, plus, minus = run(MIXED, None), run(MIXED, "as recorded"), run(MIXED, "as recorded", -1.0)
        assert number_of_motions(one) == 4
        assert ("level" in one["record"].dims) == own
        assert one["motion"].values[1] == f"{plus['motion'].values[0]}, reversed"
        if own:
            assert_array_equal(one["record"].values[:, 1::2], plus["record"].values)
        for name in averaged(one):
            expected = 0.5 * (plus[name].values + minus[name].values)
            assert_allclose(one[name].values, expected, rtol=1e-12, atol=1e-15, err_msg=name)
        twice, once = (run(SYMMETRIC, way) for way in ("both", "as recorded"))
        for name, values in once.data_vars.items():
            if "motion" not in values.dims and "front" not in str(name):
                assert_array_equal(twice[name].values, values.values, err_msg=str(name))
        ranked = [anchoring(each, "any", replicates=200) for each in (twice, once)]
        for name in ranked[1].data_vars:
            assert_array_equal(ranked[0][name].values, ranked[1][name].values, err_msg=str(name))
        year = Year.of(one, one["level_weight"].values)
        assert year.size(8) == (12 if own else 4)

    def test_of_an_elastic_building(self):
        given = histories(False, elastic=True)
        one, plus, minus = (
            assess(MIXED, Assessment(LAW, motions, LEVELS, hazard=CURVE, polarity=way, replicates=200))
            for motions, way in ((given, "both"), (given, "as recorded"), (histories(False, -1.0, True), "as recorded"))
        )
        assert_allclose(one["rate"], 0.5 * (plus["rate"].values + minus["rate"].values), rtol=1e-12)


class TestFloorMotions:
    @pytest.mark.slow
    def test_floor_motions_with_their_ground_motions(self):
        moved = FRAME.floor_motions(MOTIONS)
        through = found(MIXED, "both")
        for ground in (None, MOTIONS):
            given = moved if ground is None else moved.isel(floor=[0, 1, 2])
            one = found(MIXED, "both", given, None, ground=ground)
            assert_array_equal(one["overturned"].values, through["overturned"].values)


def test_refused(refusal):
    refusal()
