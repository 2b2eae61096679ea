"""Random inputs, runs of uncertain blocks, shares of variance, Sobol' indices."""

import json
from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from scipy import stats

import toppling as tp
from toppling.fragility import (
    Beta,
    Categorical,
    Lognormal,
    Normal,
    RandomInputs,
    Uniform,
    capacity_variance_shares,
    overturning_capacity,
    overturning_response,
    sobol_indices,
    tornado,
    uncertain_ida,
    variance_shares,
)

mpl.use("Agg")

SHELF = tp.catalogue["bookcase-5-shelf"]
LAWS = [tp.EnergyConsistent(), tp.DiscreteDamping(), tp.HousnerImpact()]
INPUTS = RandomInputs(
    {
        "e": Beta(4.0, 2.0, 0.8, 1.0),
        "delta": Uniform(0.01, 0.1),
        "alpha_factor": Normal(1.0, 0.05, 0.8, 1.2),
        "R_factor": Lognormal(1.0, 0.1),
        "inertia_factor": Uniform(1.2, 1.4),
        "law": Categorical([*LAWS, "vassiliou"], [0.4, 0.3, 0.2, 0.1]),
    }
)
SHAKES = tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(12, seed=4)


class TestDistributions:
    def test_choices(self):
        law = Categorical(["a", "b", "c"], [0.5, 0.2, 0.3])
        assert law.quantile(np.array([0.0, 0.49, 0.51, 0.69, 0.71, 1.0])).tolist() == ["a", "a", "b", "b", "c", "c"]
        assert Categorical(LAWS).labels == tuple(one.label for one in LAWS)


class TestRandomInputs:
    @pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "random"])
    def test_samples_follow_their_distributions(self, method):
        found = INPUTS.sample(1024, seed=7, method=method)
        assert set(found.data_vars) == set(INPUTS.names)
        assert found["alpha_factor"].attrs["units"] == "1"
        assert (found.attrs["method"], found.attrs["seed"]) == (method, 7)
        uniform = stats.kstest(found["delta"].values, stats.uniform(0.01, 0.09).cdf)
        assert uniform.statistic < (0.05 if method == "random" else 0.002)
        assert stats.kstest(found["e"].values, stats.beta(4.0, 2.0, 0.8, 0.2).cdf).pvalue > 0.01
        shares = [(found["law"] == label).mean().item() for label in INPUTS.distributions["law"].labels]
        assert shares == pytest.approx([0.4, 0.3, 0.2, 0.1], abs=0.06 if method == "random" else 0.002)
        rho = stats.spearmanr(found["e"].values, found["R_factor"].values).statistic
        assert abs(rho) < 3.0 / np.sqrt(1024.0)

    def test_the_same_seed_gives_the_same_samples(self):
        for method in ("sobol", "latin-hypercube", "random"):
            one = INPUTS.sample(64, 3, method)
            xr.testing.assert_identical(one, INPUTS.sample(64, 3, method))
            assert not (one["e"] == INPUTS.sample(64, 4, method)["e"]).any()
        # a Sobol' sequence goes on where it stopped
        longer = INPUTS.sample(128, 3, "sobol").isel(sample=slice(0, 64))
        assert (longer["e"] == INPUTS.sample(64, 3, "sobol")["e"]).all()

    def test_rank_correlations(self):
        pairs = {("e", "delta"): 0.6, ("delta", "R"): -0.4}
        inputs = RandomInputs(
            {"e": Beta(2.0, 5.0, 0.5, 1.0), "delta": Lognormal(0.05, 0.3, upper=0.5), "R": Lognormal(1.0, 0.8)}, pairs
        )
        assert not inputs.independent
        found = inputs.sample(4096, 1, "sobol")
        for (a, b), rho in pairs.items():
            assert stats.spearmanr(found[a].values, found[b].values).statistic == pytest.approx(rho, abs=0.02)
        assert stats.spearmanr(found["e"].values, found["R"].values).statistic == pytest.approx(0.0, abs=0.02)
        # margins stay what they are
        assert stats.kstest(found["e"].values, stats.beta(2.0, 5.0, 0.5, 0.5).cdf).statistic < 0.02


class TestRealise:
    def test_a_block_and_a_law_of_its_own(self):
        samples = INPUTS.sample(40, 2)
        pairs = INPUTS.realise(SHELF, LAWS[0], samples)
        assert len(pairs) == 40
        for k, (block, law) in enumerate(pairs):
            one = samples.isel(sample=k)
            assert block.alpha == pytest.approx(SHELF.alpha * one["alpha_factor"].item(), rel=1e-14)
            grown = block.R / SHELF.R
            assert grown == pytest.approx(one["R_factor"].item(), rel=1e-14)
            assert block.inertia == one["inertia_factor"].item()
            assert block.h / block.height == pytest.approx(SHELF.h / SHELF.height, rel=1e-14)
            chosen = one["law"].item()
            kind = tp.Vassiliou if chosen == "vassiliou" else {law.label: type(law) for law in LAWS}[chosen]
            assert type(law) is kind
            assert law.options.get("e", one["e"].item()) == one["e"].item()
            assert law.options.get("delta", one["delta"].item()) == one["delta"].item()

    def test_outer_sizes(self):
        inputs = RandomInputs({"width": Uniform(0.3, 0.5), "cm_height": Uniform(0.7, 0.9)})
        law = tp.HousnerImpact()
        samples = inputs.sample(5)
        for k, (block, same) in enumerate(inputs.realise(SHELF, law, samples)):
            assert (block.width, block.height) == (samples["width"].values[k], SHELF.height)
            assert block.h == samples["cm_height"].values[k]
            assert same == law
        tall = RandomInputs({"height": Uniform(1.5, 2.5)})
        for block, _ in tall.realise(SHELF, law, tall.sample(5)):
            assert block.h == pytest.approx(0.5 * block.height, rel=1e-14)

    def test_what_is_not_uncertain_is_the_nominal_itself(self):
        inputs = RandomInputs({"restitution_factor": Uniform(0.8, 1.0)})
        for block, law in inputs.realise(SHELF, tp.HousnerImpact(), inputs.sample(4)):
            assert block is SHELF
            assert law.restitution(block) < SHELF.restitution

    def test_with_an_e_of_its_own_squat_blocks_are_no_matter(self):
        inputs = RandomInputs({"alpha": Uniform(0.1, 1.0)})
        assert len(inputs.realise(SHELF, tp.HousnerImpact(e=0.7), inputs.sample(3))) == 3

    def test_samples_of_other_inputs(self):
        wrong = INPUTS.sample(3)
        wrong["law"] = ("sample", np.array(["housner"] * 3, dtype=object))
        with pytest.raises(ValueError, match="sample 0 has law 'housner'"):
            INPUTS.realise(SHELF, LAWS[0], wrong)


class TestUncertainIda:
    LEVELS = np.array([2.0, 4.0, 8.0])

    @pytest.mark.parametrize("im", ["pga", "pgv_normalised"])
    def test_every_sample_runs_as_alone(self, im):
        levels = self.LEVELS if im == "pga" else np.array([0.4, 0.8, 2.0])
        outputs = ["overturned", "peak_rotation", "top_displacement"]
        runs = uncertain_ida(INPUTS, SHELF, LAWS[0], SHAKES, levels, im, outputs, samples=INPUTS.sample(10, 5))
        assert runs["overturned"].dims == ("sample", "level", "motion")
        assert dict(runs.sizes) == {"sample": 10, "level": 3, "motion": 12}
        pairs = INPUTS.realise(SHELF, LAWS[0], INPUTS.sample(10, 5))
        for k, (block, law) in enumerate(pairs):
            alone = tp.ida(block, law, SHAKES, levels, im, outputs)
            for name in outputs:
                np.testing.assert_array_equal(runs[name].values[k], alone[name].values[0, 0])
            for name in ("alpha", "R", "p", "width", "inertia_factor"):
                assert runs[name].values[k] == alone[name].values[0]
            np.testing.assert_array_equal(runs["e"].values[k], alone["e"].values[0, 0])
            np.testing.assert_array_equal(runs["delta"].values[k], alone["delta"].values[0])
        assert runs["law"].values.tolist() == INPUTS.sample(10, 5)["law"].values.tolist()

    def test_without_a_product(self):
        runs = uncertain_ida(INPUTS, SHELF, LAWS[0], SHAKES, self.LEVELS, samples=10)
        per_motion = sum(record.acceleration.size - 1 for record in tp.motions.records(SHAKES))
        assert json.loads(runs.attrs["skipped"])["samples"] == 10 * 3 * per_motion

    def test_several_laws_under_the_same_samples(self):
        inputs = RandomInputs({"e": Uniform(0.8, 1.0), "alpha_factor": Uniform(0.9, 1.1)})
        samples = inputs.sample(6, 1)
        runs = uncertain_ida(inputs, SHELF, LAWS, SHAKES, [0.5, 1.0], "pgv_normalised", samples=samples)
        assert runs["overturned"].dims == ("model", "sample", "level", "motion")
        assert runs["model"].values.tolist() == [law.label for law in LAWS]
        assert runs["pgv_normalised"].dims == ("sample", "motion")
        for i, law in enumerate(LAWS):
            one = uncertain_ida(inputs, SHELF, law, SHAKES, [0.5, 1.0], "pgv_normalised", samples=samples)
            np.testing.assert_array_equal(runs["peak_rotation"].values[i], one["peak_rotation"].values)
            np.testing.assert_array_equal(runs["pgv_normalised"].values, one["pgv_normalised"].values)

    def test_goes_on_into_probabilities_and_curves(self):
        runs = uncertain_ida(INPUTS, SHELF, LAWS[0], SHAKES, np.geomspace(1.0, 30.0, 8), samples=6)
        counts = tp.overturning_probability(runs)
        assert counts["probability"].dims == ("sample", "level")
        assert tp.fit_fragility(runs)["median"].dims == ("sample",)
        assert overturning_capacity(runs)["upper"].dims == ("sample", "motion")
        again = uncertain_ida(INPUTS, SHELF, LAWS[0], SHAKES, np.geomspace(1.0, 30.0, 8), samples=6)
        xr.testing.assert_identical(runs, again)

    @pytest.mark.parametrize("method", ["binomial", "first-overturning"])
    def test_curve_of_all_samples_together(self, method):
        """As if every sample of a motion were a motion that is drawn with the others of its record."""
        inputs = RandomInputs({"R_factor": Uniform(0.8, 1.2), "alpha_factor": Uniform(0.9, 1.1)})
        runs = uncertain_ida(inputs, SHELF, LAWS, SHAKES, np.geomspace(1.0, 30.0, 8), samples=6)
        found = tp.fit_fragility(runs, method=method, replicates=100, together=["sample"])
        flags = runs["overturned"].transpose("model", "level", "sample", "motion").values
        records = np.tile(runs["motion"].values, 6)
        every = xr.Dataset(
            {"overturned": (("model", "level", "motion"), flags.reshape(len(LAWS), 8, -1))},
            coords={
                "model": runs["model"],
                "level": runs["level"],
                "motion": np.arange(records.size),
                "record": ("motion", records),
            },
        )
        stacked = tp.fit_fragility(every, method=method, replicates=100)
        assert found["median"].dims == ("model",)
        assert (found["status"] == "ok").all()
        for name in ("median", "dispersion", "median_lower", "median_upper", "dispersion_lower", "dispersion_upper"):
            np.testing.assert_allclose(found[name], stacked[name], rtol=1e-9)
        assert found.attrs["method"] == stacked.attrs["method"]

    def test_of_floors_scaled_as_the_ground(self):
        building = tp.motions.Building.flexural_shear(0.5, storeys=3)
        ground = SHAKES.isel(motion=slice(0, 3))
        floors = building.floor_motions(ground, floors=[3])
        inputs = RandomInputs({"e": Uniform(0.8, 1.0)})
        runs = uncertain_ida(inputs, SHELF, LAWS[0], floors, [1.0, 2.0], samples=2, ground=ground)
        block, law = inputs.realise(SHELF, LAWS[0], inputs.sample(2))[1]
        alone = tp.ida(block, law, floors, [1.0, 2.0], ground=ground)
        np.testing.assert_array_equal(runs["peak_rotation"].values[1], alone["peak_rotation"].values[0, 0])
        np.testing.assert_array_equal(runs["ground_pga"].values, alone["ground_pga"].values)


class TestVarianceShares:
    DIMS = ("motion", "model", "sample")

    def additive(self):
        rng = np.random.default_rng(0)
        parts = [rng.normal(0.0, sd, n) for sd, n in ((1.0, 7), (0.5, 4), (0.3, 5))]
        values = parts[0][:, None, None] + parts[1][None, :, None] + parts[2][None, None, :] + 50.0
        return xr.DataArray(values, dims=self.DIMS), [part.var() for part in parts]

    def test_of_an_additive_model(self):
        values, variances = self.additive()
        found = variance_shares(values, self.DIMS)
        expected = np.array(variances) / sum(variances)
        assert found["component"].values.tolist()[:4] == ["motion", "model", "sample", "motion × model"]
        np.testing.assert_allclose(found["share"].values, [*expected, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(found["total_share"].values, expected, atol=1e-12)
        np.testing.assert_allclose(found["nested_share"].values, expected, atol=1e-12)
        assert found["total_variance"].item() == pytest.approx(values.values.var(), rel=1e-12)

    def test_of_any_values_against_means_written_out(self):
        rng = np.random.default_rng(1)
        values = xr.DataArray(rng.normal(0.0, 1.0, (6, 3, 4)), dims=self.DIMS)
        found = variance_shares(values, self.DIMS)
        assert found["share"].sum().item() == pytest.approx(1.0, abs=1e-13)
        assert found["nested_share"].sum().item() == pytest.approx(1.0, abs=1e-13)
        v = values.values
        effects = {}
        for size in (1, 2, 3):
            for kept in combinations(range(3), size):
                mean = v.mean(axis=tuple(i for i in range(3) if i not in kept), keepdims=True)
                lower = sum(
                    (one for part, one in effects.items() if set(part) < set(kept)), start=np.full((1, 1, 1), v.mean())
                )
                effects[kept] = mean - lower
        for (kept, effect), share in zip(effects.items(), found["variance"].values, strict=True):
            assert share == pytest.approx((effect**2).mean(), rel=1e-10), kept
        # the law of total variance, the outer first: Var E[v|motion], E Var(E[v|motion, model]|motion), the rest
        by_two = v.mean(axis=2)
        outer = by_two.mean(axis=1).var()
        inner = by_two.var(axis=1).mean()
        rest = v.var(axis=2).mean()
        np.testing.assert_allclose(found["nested_share"].values, np.array([outer, inner, rest]) / v.var(), rtol=1e-10)

    def test_of_pure_interaction(self):
        found = variance_shares(xr.DataArray([[0.0, 1.0], [1.0, 0.0]], dims=("a", "b")), ("a", "b"))
        np.testing.assert_allclose(found["share"].values, [0.0, 0.0, 1.0], atol=1e-15)
        np.testing.assert_allclose(found["total_share"].values, [1.0, 1.0], atol=1e-15)
        np.testing.assert_allclose(found["nested_share"].values, [0.0, 1.0], atol=1e-15)

    def test_of_flags_level_by_level(self):
        flags = np.random.default_rng(2).random((20, 3, 5)) < np.array([0.0, 0.1, 0.4, 0.8, 1.0])
        found = variance_shares(xr.DataArray(flags, dims=("motion", "model", "level")), ("motion", "model"))
        p = flags.mean(axis=(0, 1))
        np.testing.assert_allclose(found["total_variance"].values, p * (1.0 - p), atol=1e-14)
        assert np.isnan(found["share"].isel(level=[0, 4])).all()
        np.testing.assert_allclose(found["share"].isel(level=[1, 2, 3]).sum("component").values, 1.0, atol=1e-13)

    def test_weights_are_entries_repeated(self):
        rng = np.random.default_rng(3)
        values = xr.DataArray(rng.normal(0.0, 1.0, (5, 3)), dims=("motion", "model"))
        weighed = variance_shares(values, ("motion", "model"), {"model": [2.0, 1.0, 1.0]})
        repeated = variance_shares(values.isel(model=[0, 0, 1, 2]), ("motion", "model"))
        xr.testing.assert_allclose(weighed, repeated)
        one = variance_shares(values, ("motion", "model"), {"model": [0.0, 1.0, 0.0]})
        np.testing.assert_allclose(one["share"].values, [1.0, 0.0, 0.0], atol=1e-14)

    def test_a_large_mean_does_not_drown_them(self):
        values, variances = self.additive()
        found = variance_shares(values * 1e-6 + 1e6, self.DIMS)
        np.testing.assert_allclose(found["share"].values[:3], np.array(variances) / sum(variances), rtol=1e-3)

    @pytest.mark.parametrize("size", [3, 7, 49])
    def test_of_values_that_are_all_the_same(self, size):
        """Sevenths do not add up to 1: what rounding leaves is no variance."""
        same = xr.DataArray(np.ones((size, 7), bool), dims=("motion", "sample"))
        found = variance_shares(same, ("motion", "sample"))
        assert found["share"].isnull().all()
        assert found["total_share"].isnull().all()


class TestCapacityShares:
    LEVELS = np.geomspace(0.5, 200.0, 600)

    def runs(self, log_capacity):
        """Runs with made-up capacities (model, motion)."""
        array = tp.motions.CloughPenzien(duration=2.0, dt=0.02).sample(log_capacity.shape[1], 1)
        one = tp.ida(SHELF, LAWS, array, [1.0])
        one = one.isel(level=np.zeros(600, int)).assign_coords(level=("level", self.LEVELS, one["level"].attrs))
        flags = np.log(self.LEVELS)[:, None] > log_capacity[None, :, None, :]
        return one.assign(overturned=(one["overturned"].dims, flags))

    def test_of_known_capacities(self):
        rng = np.random.default_rng(4)
        motion, law = rng.normal(1.5, 0.4, 10), np.array([-0.3, 0.0, 0.4])
        found = capacity_variance_shares(self.runs(law[:, None] + motion))
        variances = np.array([motion.var(), law.var()])
        assert found["component"].values.tolist() == ["motion", "model", "motion × model"]
        # the levels are 1 % apart
        np.testing.assert_allclose(found["share"].values[:2, 0], variances / variances.sum(), atol=0.01)
        assert found["share"].values[2, 0] == pytest.approx(0.0, abs=1e-3)
        assert found["share_known"].values == pytest.approx(1.0)
        width = np.log(self.LEVELS[1] / self.LEVELS[0])
        assert found["rounding_share"].values == pytest.approx(width**2 / 12.0 / variances.sum(), rel=0.02)

    def test_motions_whose_capacities_are_not_known_fall_out_and_are_counted(self):
        rng = np.random.default_rng(5)
        log_capacity = rng.normal(1.5, 0.4, (3, 10))
        log_capacity[1, 4] = 10.0
        log_capacity[:, 7] = -5.0
        found = capacity_variance_shares(self.runs(log_capacity))
        assert (found["motions"].item(), found["motions_used"].item()) == (10, 8)
        assert found["share_known"].values == pytest.approx(1.0 - 4.0 / 30.0)
        kept = self.runs(np.delete(log_capacity, [4, 7], axis=1))
        alone = capacity_variance_shares(kept)
        np.testing.assert_allclose(found["share"].values, alone["share"].values, atol=1e-12)


def ishigami(samples):
    x1, x2, x3 = (samples[name].values for name in ("x1", "x2", "x3"))
    return np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


CIRCLE = RandomInputs({name: Uniform(-np.pi, np.pi) for name in ("x1", "x2", "x3")})


class TestSobol:
    def test_ishigami(self):
        """Closed form: Ishigami and Homma (1990), a = 7, b = 0.1."""
        a, b = 7.0, 0.1
        v1 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
        v2 = a**2 / 8.0
        v13 = b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
        total = v1 + v2 + v13
        found = sobol_indices(CIRCLE, ishigami, n=4096, seed=1)
        assert found["variance"].item() == pytest.approx(total, rel=5e-3)
        assert found["mean"].item() == pytest.approx(a / 2.0, rel=5e-3)
        np.testing.assert_allclose(found["first"].values, np.array([v1, v2, 0.0]) / total, atol=0.01)
        np.testing.assert_allclose(found["total"].values, np.array([v1 + v13, v2, v13]) / total, atol=0.01)
        # a third of the intervals' half widths is a standard error and a half; they hold the truth
        off = np.abs(found["total"].values - np.array([v1 + v13, v2, v13]) / total)
        assert np.all(off < 2.0 * (found["total_upper"] - found["total"]).values)
        assert found.attrs["samples"] == 4096 * 5

    def test_the_variance_of_a_flag(self):
        """Of a share m of its values: m (1 - m), however few there are."""
        found = sobol_indices(CIRCLE, lambda one: (one["x1"] > 1.0).astype(float), n=4)
        share = found["mean"].item()
        assert 0.0 < share < 1.0
        assert found["variance"].item() == pytest.approx(share * (1.0 - share), rel=1e-12)

    def test_linear_model_of_unlike_inputs(self):
        """Shares a² Var x over their sum, whatever the distributions; a choice is one input."""
        inputs = RandomInputs(
            {
                "a": Normal(0.0, 1.0),
                "b": Lognormal(1.0, 0.5),
                "c": Categorical(["low", "middle", "high"], [0.25, 0.5, 0.25]),
            }
        )

        def function(samples):
            step = samples["c"].copy(
                data=[{"low": -1.0, "middle": 0.0, "high": 1.0}[one] for one in samples["c"].values]
            )
            both = samples["a"] + samples["b"] + 2.0 * step.astype(float)
            return xr.concat(
                [both, samples["a"] * 1.0, 0.0 * both + 3.0], xr.DataArray([1, 2, 3], dims="case", name="case")
            )

        found = sobol_indices(inputs, function, n=2048, seed=2)
        assert found["first"].dims == ("input", "case")
        variances = np.array([1.0, np.exp(0.25) * (np.exp(0.25) - 1.0), 4.0 * 0.5])
        np.testing.assert_allclose(found["first"].sel(case=1).values, variances / variances.sum(), atol=0.03)
        np.testing.assert_allclose(found["total"].sel(case=1).values, variances / variances.sum(), atol=0.03)
        np.testing.assert_allclose(found["total"].sel(case=2).values, [1.0, 0.0, 0.0], atol=0.02)
        # what does not vary has no shares
        assert np.isnan(found["total"].sel(case=3)).all()

    def test_the_same_seed_gives_the_same_indices(self):
        one = sobol_indices(CIRCLE, ishigami, n=64, seed=0)
        xr.testing.assert_identical(one, sobol_indices(CIRCLE, ishigami, n=64, seed=0))
        assert not (one["total"] == sobol_indices(CIRCLE, ishigami, n=64, seed=1)["total"]).any()


def test_tornado():
    inputs = RandomInputs(
        {"a": Normal(1.0, 0.5), "b": Uniform(0.0, 2.0), "c": Categorical(["x", "y", "z"], [0.2, 0.5, 0.3])}
    )
    extra = {"x": 4.0, "y": 1.0, "z": -2.0}

    def function(samples):
        return samples["a"] - samples["b"] + [extra[one] for one in samples["c"].values]

    found = tornado(inputs, function, 0.1, 0.9)
    z = stats.norm.ppf(0.9)
    assert found["base"].item() == pytest.approx(1.0)
    np.testing.assert_allclose(found["low"].values, [1.0 - 0.5 * z, 1.8, -2.0], rtol=1e-9)
    np.testing.assert_allclose(found["high"].values, [1.0 + 0.5 * z, 0.2, 4.0], rtol=1e-9)
    np.testing.assert_allclose(found["swing"].values, [z, 1.6, 6.0], rtol=1e-9)


class TestOverturningResponse:
    def test_probabilities_of_every_sample(self):
        levels = np.geomspace(1.0, 40.0, 8)
        inputs = RandomInputs({"e": Uniform(0.8, 1.0), "alpha_factor": Uniform(0.9, 1.1)})
        response = overturning_response(inputs, SHELF, tp.HousnerImpact(), SHAKES, levels)
        samples = inputs.sample(4)
        found = response(samples)
        assert found["output"].values.tolist()[0].endswith("1 m s-2")
        runs = uncertain_ida(inputs, SHELF, tp.HousnerImpact(), SHAKES, levels, samples=samples)
        counts = tp.overturning_probability(runs)
        np.testing.assert_array_equal(found.values, counts["probability"].values)


class TestFigures:
    def test_axes_in_axes_out(self):
        import matplotlib.pyplot as plt

        from toppling.studies.plots import uncertainty as plots

        flags = np.random.default_rng(2).random((20, 3, 4)) < np.array([0.0, 0.1, 0.4, 0.8])
        level = ("level", [1.0, 2.0, 3.0, 4.0], {"units": "m s-2", "long_name": "peak floor acceleration"})
        values = xr.DataArray(flags, dims=("motion", "model", "level"), coords={"level": level})
        shares = variance_shares(values, ("motion", "model"))
        ax = plt.figure().add_subplot()
        assert plots.variance_bars(shares, ax) is ax
        assert ax.get_xlabel().endswith("floor acceleration (g)")
        assert [text.get_text() for text in ax.texts] == ["no variance"]
        # the bars of a level reach 100 %
        tops = [patch.get_y() + patch.get_height() for patch in ax.patches]
        assert max(tops) == pytest.approx(1.0)
        whole = plots.variance_bars(variance_shares(values.isel(level=2), ("motion", "model")))
        assert whole.get_ylabel().endswith("the variance")
        inputs = RandomInputs({"alpha": Uniform(0.1, 0.2), "e": Uniform(0.8, 1.0)})
        indices = sobol_indices(inputs, lambda one: one["alpha"] + one["e"], n=16)
        names = ["restitution e", "slenderness α"]
        assert [tick.get_text() for tick in plots.sobol_bars(indices).get_yticklabels()] == names
        swings = tornado(inputs, lambda one: one["alpha"] + one["e"])
        assert [tick.get_text() for tick in plots.tornado_bars(swings).get_yticklabels()] == names
        two = sobol_indices(inputs, lambda one: xr.concat([one["e"], one["alpha"]], "k"), n=16)
        with pytest.raises(ValueError, match="one output is drawn"):
            plots.sobol_bars(two)
        with pytest.raises(ValueError, match="along one dimension"):
            plots.variance_bars(variance_shares(values, ("motion",)))
        plt.close("all")


def test_refused(refusal):
    refusal()


def test_doubted(doubts):
    doubts()
