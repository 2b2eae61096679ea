"""Rates by stripes of several measures: one measure under two names, sets that do not agree, refusals."""

import math

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.benchmarks.selection.rates import rates_by_measure
from toppling.fragility import HazardCurve

UNITS = {"Sa(1)": "m s-2", "pgv": "m s-1", "pga": "m s-2"}


def runs_of(fell, levels, stripe, record, im, **coords):
    return xr.Dataset(
        {"overturned": ("motion", np.asarray(fell, bool), {"units": "1"})},
        {
            "intensity": ("motion", np.asarray(levels, float)[stripe], {"units": UNITS[im], "im": im}),
            "stripe": ("motion", np.asarray(stripe) + 1),
            "record": ("motion", np.array([str(one) for one in record], dtype=object)),
            **{name: ("motion", values) for name, values in coords.items()},
        },
    )


def invented(seed, number=30, stripes=4, factor=1.0, im="pga", pool=60):
    """Stripes of motions of a pool, some in several; a motion falls at a level of its own."""
    rng = np.random.default_rng(seed)
    capacity = np.exp(0.4 * rng.normal(size=pool)) * 3.0
    levels = np.array([1.5, 2.5, 4.0, 6.0, 9.0])[:stripes]
    chosen = np.concatenate([rng.choice(pool, number, replace=False) for _ in levels])
    stripe = np.repeat(np.arange(stripes), number)
    noise = np.exp(0.2 * rng.normal(size=chosen.size))
    fell = capacity[chosen] * noise < levels[stripe]
    return runs_of(fell, factor * levels, stripe, [f"motion {i}" for i in chosen], im)


HAZARD = HazardCurve.power_law(1e-2, 2.5, "pga")


def other_units(factor, im="pgv"):
    """The same hazard of a measure that is `factor` times the first."""
    return HazardCurve.power_law(float(HAZARD.rate_at(1.0 / factor)), 2.5, im)


class TestPairs:
    def test_one_measure_under_two_names(self):
        """PGV that is a tenth of the PGA in every motion: each replicate has the same rate, the ratio no width."""
        found = rates_by_measure(
            [invented(1), invented(1, factor=0.1, im="pgv")], [HAZARD, other_units(0.1)], replicates=200
        )
        for name in ("ratio", "ratio_lower", "ratio_upper"):
            np.testing.assert_allclose(found[name], 1.0, rtol=1e-9)
        np.testing.assert_allclose(found["rate_within"][1], found["rate_within"][0], rtol=1e-12)
        assert float(found["rate_upper"][0] / found["rate_lower"][0]) > 1.2
        assert found["shared"].values.tolist() == found["motions"].values.tolist()

    def test_motions_of_other_names_are_not_paired(self):
        """The same runs with labels of their own: the ratio is 1 with an interval as wide as of independent rates."""
        other = invented(1, factor=0.1, im="pgv")
        other["record"] = ("motion", np.array([f"another {one}" for one in other["record"].values], dtype=object))
        found = rates_by_measure([invented(1), other], [HAZARD, other_units(0.1)], replicates=2000)
        assert float(found["ratio"][1]) == pytest.approx(1.0, rel=1e-9)
        assert found["shared"].values.tolist() == [found["motions"].values[0], 0]
        widths = {
            name: np.log(found[f"{name}_upper"][1] / found[f"{name}_lower"][1]).item() for name in ("rate", "ratio")
        }
        assert widths["ratio"] == pytest.approx(math.sqrt(2.0) * widths["rate"], rel=0.1)

    def test_rates_are_those_of_the_fitted_curves(self):
        runs = invented(2)
        curves = tp.fit_fragility(runs, intervals="profile")
        expected = tp.annual_rate(curves, HAZARD)["rate"].item()
        found = rates_by_measure([runs, invented(3, im="pgv")], [HAZARD, other_units(1.0)], replicates=20)
        assert float(found["rate"][0]) == pytest.approx(expected, rel=1e-12)
        share = tp.fragility.rate_share_above(curves, HAZARD, 6.0).item()
        assert float(found["share_above"][0]) == pytest.approx(share, rel=1e-12)
        assert float(found["share_below"][0]) == pytest.approx(
            1.0 - tp.fragility.rate_share_above(curves, HAZARD, 1.5).item(), rel=1e-9
        )

    def test_the_sum_over_the_stripes_by_hand(self):
        runs = invented(2)
        shares = [runs["overturned"].values[runs["stripe"].values == k].mean() for k in (1, 2, 3, 4)]
        bounds = [
            1.5 * math.sqrt(1.5 / 2.5), math.sqrt(1.5 * 2.5), math.sqrt(2.5 * 4.0), math.sqrt(24.0),
            6.0 * math.sqrt(1.5),
        ]  # fmt: skip
        rates = [1e-2 * bound**-2.5 for bound in bounds]
        expected = sum(p * (rates[k] - rates[k + 1]) for k, p in enumerate(shares))
        found = rates_by_measure([runs, invented(3, im="pgv")], [HAZARD, other_units(1.0)], replicates=20)
        assert float(found["rate_within"][0]) == pytest.approx(expected, rel=1e-12)

    def test_two_motions_of_an_earthquake_count_as_one(self):
        """Every motion twice, in one event: replicate by replicate the shares of the motions alone."""
        runs = invented(4)
        twins = runs.copy()
        twins["record"] = ("motion", np.array([f"{one}, twin" for one in runs["record"].values], dtype=object))
        twice = xr.concat([runs, twins], dim="motion")
        events = {str(one): str(one).removesuffix(", twin") for one in twice["record"].values}
        other = invented(5, im="pgv")
        single = rates_by_measure([runs, other], [HAZARD, other_units(1.0)], replicates=200, events={})
        double = rates_by_measure([twice, other], [HAZARD, other_units(1.0)], replicates=200, events=events)
        for name in ("rate_within", "rate_within_lower", "rate_within_upper"):
            np.testing.assert_allclose(double[name], single[name], rtol=1e-12)
        alone = rates_by_measure([twice, other], [HAZARD, other_units(1.0)], replicates=200)
        width = {
            name: float(np.log(found["rate_within_upper"][0] / found["rate_within_lower"][0]))
            for name, found in (("events", double), ("motions", alone))
        }
        assert width["motions"] < 0.85 * width["events"]

    def test_stripes_that_do_not_agree_are_counted(self):
        runs = invented(2).assign_coords(hazard_consistent=("motion", np.repeat([True, False, True, False], 30)))
        found = rates_by_measure([invented(3, im="pgv"), runs], [other_units(1.0), HAZARD], replicates=20)
        np.testing.assert_array_equal(found["inconsistent"], [np.nan, 2.0])

    def test_realisations_of_a_hazard_do_not_count(self):
        rows = [[2e-2, 2e-4], [1e-2, 1e-4]]
        several = HazardCurve([1.0, 6.0], (), "pga", realisations=rows)
        mean = HazardCurve([1.0, 6.0], several.rates, "pga")
        one, other = (
            rates_by_measure([invented(2), invented(3, im="pgv")], [hazard, other_units(1.0)], replicates=50)
            for hazard in (several, mean)
        )
        xr.testing.assert_equal(one, other)

    def test_the_seed_decides(self):
        one, other, again = (
            rates_by_measure([invented(2), invented(3, im="pgv")], [HAZARD, other_units(1.0)], replicates=50, seed=seed)
            for seed in (1, 2, 1)
        )
        xr.testing.assert_identical(one, again)
        assert float(one["rate_lower"][0]) != float(other["rate_lower"][0])


class TestRuns:
    def test_of_blocks_and_laws(self):
        """Real runs: a row for each measure, block and law; a block's rates are those of it alone."""
        pool = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(30, seed=4)
        blocks, laws = [tp.Block(0.2, 1.0), tp.Block(0.25, 1.1)], [tp.HousnerImpact(), tp.EnergyConsistent()]
        both = [
            tp.stripes(blocks, laws, [pool, pool], levels, im, ["overturned"], screen=False)
            for im, levels in (("pga", [3.0, 5.0]), ("pgv", [0.3, 0.5]))
        ]
        hazards = [HAZARD, HazardCurve.power_law(3e-5, 2.5, "pgv")]
        found = rates_by_measure(both, hazards, replicates=50)
        assert dict(found["ratio"].sizes) == {"measure": 2, "block": 2, "model": 2}
        assert found["block"].values.tolist() == [one.label for one in blocks]
        alone = rates_by_measure([one.isel(block=[1]) for one in both], hazards, replicates=50)
        np.testing.assert_allclose(found["rate_upper"].isel(block=[1]), alone["rate_upper"], rtol=1e-12)
        with pytest.raises(ValueError, match="runs must have the same block labels in one order"):
            rates_by_measure([both[0], both[1].isel(block=[1, 0])], hazards)
        with pytest.raises(ValueError, match="runs must be of the same blocks, laws and floors"):
            rates_by_measure([both[0], both[1].isel(block=[1])], hazards)

    def test_pools_whose_labels_meet_are_refused(self):
        pools = [tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(12, seed=seed) for seed in (1, 2)]
        pools = [one.assign_coords(motion=[f"record {i}" for i in range(12)]) for one in pools]
        both = [
            tp.stripes(tp.Block(0.2, 1.0), tp.HousnerImpact(), [pool, pool], levels, im, ["overturned"], screen=False)
            for pool, im, levels in zip(pools, ("pga", "pgv"), ([3.0, 5.0], [0.3, 0.5]), strict=True)
        ]
        assert both[0]["record"].values.tolist() == both[1]["record"].values.tolist()
        with pytest.raises(ValueError, match="is another motion in other runs: take motions of one pool"):
            rates_by_measure(both, [HAZARD, other_units(1.0)])


ONE, OTHER = invented(2), invented(3, im="pgv")


@pytest.mark.parametrize(
    ("runs", "hazards", "options", "said"),
    [
        ([ONE], [HAZARD], {}, "must be of at least two measures, one of each a measure, got 1 and 1"),
        ([ONE, OTHER], [HAZARD], {}, "got 2 and 1"),
        (ONE, [HAZARD], {}, "runs must be a list of Dataset"),
        ([ONE, OTHER], [HAZARD, 1.0], {}, "hazards must be a list of HazardCurve"),
        ([ONE, ONE], [HAZARD, HAZARD], {}, "measures must differ, got pga, pga"),
        ([ONE, OTHER], [HAZARD, HAZARD], {}, r"runs\[1\] are at levels of pgv, hazards\[1\] is of pga"),
        ([ONE, OTHER.drop_vars("stripe")], [HAZARD, HAZARD], {}, r"runs\[1\] must be those of stripes"),
        ([invented(2, stripes=1), OTHER], [HAZARD, HAZARD], {}, r"runs\[0\] must have at least two stripes, got one"),
        ([ONE, OTHER], [HAZARD, other_units(1.0)], {"confidence": 1.0}, "confidence must be"),
        ([ONE, OTHER], [HAZARD, other_units(1.0)], {"replicates": 0}, "replicates must be"),
    ],
)
def test_what_is_refused(runs, hazards, options, said):
    with pytest.raises((TypeError, ValueError), match=said):
        rates_by_measure(runs, hazards, **options)
