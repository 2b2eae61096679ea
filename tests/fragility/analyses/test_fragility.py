"""Incremental dynamic analysis, probabilities and fits: labels, bit-identity, published and independent oracles."""

import json
import os

import dask
import distributed
import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from fit_cases import BAKER, BAKER_MEDIAN, counts

import toppling as tp
from toppling.fragility import Work, plan_chunks, run_chunk, screen
from toppling.fragility.runs.plan import SECONDS_PER_EXACT_SAMPLE, SECONDS_PER_SAMPLE
from toppling.fragility.runs.scaling import scaling
from toppling.models.outputs import OF_ROCKING, OUTPUTS as EVERY_OUTPUT
from toppling.motions import records

OUTPUTS = [name for name in OF_ROCKING if name != "axis"]

BLOCKS = [tp.catalogue["bookcase-5-shelf"], tp.Block(0.5, 1.2, name="crate")]
MODELS = [tp.DiscreteDamping(), tp.EnergyConsistent(), tp.HousnerImpact(), tp.Vassiliou()]
LEVELS = np.array([1.0, 2.5, 4.0, 7.0])


def motions():
    """Three sets with steps and lengths of their own."""
    make = tp.motions.CloughPenzien
    envelope = tp.motions.RiseStrongDecay(1.0, 4.0, 0.5)
    return [
        make(duration=6.0, dt=0.01, envelope=envelope).sample(5, seed=1),
        make(duration=8.0, dt=0.005, envelope=envelope).sample(3, seed=2),
        make(duration=5.0, dt=0.02, envelope=envelope).sample(4, seed=3),
    ]


@pytest.fixture(scope="module")
def result():
    return tp.ida(BLOCKS, MODELS, motions(), LEVELS, outputs=list(OUTPUTS))


def in_chunks(work, seconds):
    """The work done chunk by chunk, the last one first, each in every cell once."""
    shape = (len(work.oscillators), work.levels, len(work.motions))
    found = {name: np.zeros(shape, EVERY_OUTPUT[name].kind) for name in work.outputs}
    times = np.zeros(shape, int)
    for chunk in reversed(plan_chunks(work, seconds)):
        cells = np.s_[chunk.row : chunk.row_stop, :, chunk.first : chunk.stop]
        times[cells] += 1
        done = run_chunk(work, chunk)
        assert done.runs == work.runs_of(chunk) == times[cells].size
        for array, part in zip(found.values(), done.results, strict=True):
            array[cells] = part
    assert (times == 1).all()
    return found


class TestIda:
    def test_labels_and_numbers(self, result):
        assert dict(result.sizes) == {"block": 2, "model": 4, "level": 4, "motion": 12, "reason": 9}
        assert result.block.values.tolist() == ["bookcase-5-shelf", "crate"]
        assert result.model.values.tolist() == [m.label for m in MODELS]
        assert result.e.sel(block="crate").values[0] == BLOCKS[1].restitution
        assert np.isnan(result.e.values[:, 3]).all()
        assert result.dt.values.tolist() == [0.01] * 5 + [0.005] * 3 + [0.02] * 4
        assert result.duration.values[5] == pytest.approx(8.0 + 21.22, abs=0.01)
        assert set(result.data_vars) == set(OUTPUTS) | set(screen(result, motions()).data_vars)
        assert result.verdict.dims == result.overturned.dims
        np.testing.assert_allclose(result.pga.values, tp.motions.measures(motions()).pga.values)
        configuration = json.loads(result.attrs["configuration"])
        assert configuration["blocks"][1]["width"] == 0.5
        assert configuration["models"][0] == MODELS[0].options | {"law": "discrete"}

    def test_each_run_is_the_simulated_one(self, result):
        sets = motions()
        for b, m, k, motion in ((0, 0, 1, 0), (1, 2, 3, 6), (0, 1, 2, 9), (1, 3, 2, 11)):
            one = result.isel(block=b, model=m, level=k, motion=motion)
            label = str(one.motion.item())
            array = next(a.sel(motion=[label]) for a in sets if label in a.motion.values)
            scaled = tp.motions.scale_to(array, float(LEVELS[k]))
            run = tp.simulate(BLOCKS[b], MODELS[m], scaled)
            assert bool(one.overturned) == bool(run.overturned)
            assert float(one.peak_rotation) == pytest.approx(float(run.peak_rotation), rel=1e-9)

    def test_bit_identical_for_any_chunking_and_workers(self, result):
        plain = records(motions())
        oscillators = [m.oscillator(b) for b in BLOCKS for m in MODELS]
        factors = scaling(LEVELS, plain, "pga").factors
        for seconds in (1e-9, 1e-3, 1e9):
            work = Work(tuple(oscillators), tuple(plain), factors)
            for name, found in in_chunks(work, seconds).items():
                assert found.dtype == result[name].dtype
                np.testing.assert_array_equal(found, result[name].values.reshape(found.shape))
        with dask.config.set(num_workers=1):
            xr.testing.assert_identical(tp.ida(BLOCKS, MODELS, motions(), LEVELS, outputs=list(OUTPUTS)), result)

    def test_a_given_client_gives_the_same_bytes(self, result):
        done = []
        options = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": None}
        with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
            far = tp.ida(
                BLOCKS,
                MODELS,
                motions(),
                LEVELS,
                outputs=list(OUTPUTS),
                client=client,
                progress=lambda n, total: done.append((n, total)),
            )
        xr.testing.assert_identical(far, result)
        assert done[-1] == (384, 384)

    def test_a_client_that_is_not_the_default(self, result):
        """Only the given client is used, whatever the process-wide default is."""
        options = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
        with (
            distributed.LocalCluster(**options) as cluster,
            distributed.Client(cluster, set_as_default=False) as client,
        ):
            far = tp.ida(BLOCKS, MODELS, motions(), LEVELS, outputs=list(OUTPUTS), client=client)
        xr.testing.assert_identical(far, result)

    def test_progress_counts_every_run_once(self):
        seen = []
        tp.ida(BLOCKS, MODELS, motions(), LEVELS, progress=lambda n, total: seen.append((n, total)))
        assert seen[-1] == (384, 384)
        assert all(a[0] < b[0] for a, b in zip(seen[:-1], seen[1:], strict=True))

    def test_skipping_is_an_option_that_changes_no_flag(self, result):
        plain = tp.ida(BLOCKS, MODELS, motions(), LEVELS, skip=False)
        np.testing.assert_array_equal(plain.overturned.values, result.overturned.values)
        np.testing.assert_allclose(plain.peak_rotation.values, result.peak_rotation.values, rtol=1e-9)

    def test_says_what_was_skipped(self, result):
        """Shares of samples by reason, on the dataset; flags alone end runs that cannot fall any more."""
        plain = tp.ida(BLOCKS, MODELS, motions(), LEVELS, skip=False)
        flags = tp.ida(BLOCKS, MODELS, motions(), LEVELS, outputs="overturned")
        np.testing.assert_array_equal(flags.overturned.values, plain.overturned.values)
        none, some, most = (json.loads(data.attrs["skipped"]) for data in (plain, result, flags))
        per_motion = sum(record.acceleration.size - 1 for record in tp.motions.records(motions()))
        assert none["samples"] == len(BLOCKS) * len(MODELS) * len(LEVELS) * per_motion
        assert none["share_before_uplift"] == none["share_cannot_overturn"] == 0.0
        assert some["share_before_uplift"] > 0.05
        assert most["share_cannot_overturn"] > 0.0
        assert none["share_after_overturning"] == some["share_after_overturning"]
        assert none["events_per_run"] >= some["events_per_run"] > most["events_per_run"] > 1.0

    def test_plain_factors_and_velocity_levels(self):
        array = motions()[0]
        by_factor = tp.ida(BLOCKS, MODELS, array, [2.0], im="scale")
        pgv = tp.motions.measures(array).pgv.values
        for i in range(array.sizes["motion"]):
            one = array.isel(motion=[i])
            by_velocity = tp.ida(BLOCKS, MODELS, one, [2.0 * pgv[i]], im="pgv")
            expected = by_factor.isel(motion=[i]).peak_rotation
            np.testing.assert_allclose(by_velocity.peak_rotation.values, expected.values, rtol=1e-9)
        assert by_velocity.level.attrs["units"] == "m s-1"
        assert by_factor.level.attrs["units"] == "1"

    def test_one_block_one_model_one_array(self):
        small = tp.ida(BLOCKS[0], MODELS[0], motions()[0], 3.0, screen=False)
        assert dict(small.sizes) == {"block": 1, "model": 1, "level": 1, "motion": 5}
        assert set(small.data_vars) == {"overturned", "peak_rotation"}


class TestIntensityMeasures:
    """Any measure that grows with the motion; those that depend on the block."""

    def test_factors_of_a_measure_are_those_of_all_blocks(self):
        plain = records(motions())
        for im in ("pga", "arias", tp.motions.Sa(0.5), "scale"):
            assert scaling(LEVELS, plain, im, BLOCKS).factors.shape == (1, 4, 12)
        assert scaling(LEVELS, plain, "pga_normalised", BLOCKS).factors.shape == (2, 4, 12)

    @pytest.mark.parametrize("im", ["arias", "cav", "housner_intensity", "Sa(0.5)", tp.motions.AvgSa([0.3, 1.0])])
    def test_levels_are_reached(self, im):
        """Each motion times its factor has the level as its measure."""
        array = motions()[0]
        scaled = scaling(LEVELS, records(array), im)
        for level, row in zip(LEVELS, scaled.factors[0], strict=True):
            found = tp.motions.measures(array.copy(data=array.values * row[:, None]), im)[scaled.name]
            np.testing.assert_allclose(found.values, level, rtol=1e-12)

    def test_spectral_acceleration(self):
        array = motions()[0]
        by_object = tp.ida(BLOCKS, MODELS, array, LEVELS, im=tp.motions.Sa(0.5))
        xr.testing.assert_identical(tp.ida(BLOCKS, MODELS, array, LEVELS, im="Sa(0.5)"), by_object)
        assert by_object.level.attrs["units"] == "m s-2"
        assert by_object.level.attrs["im"] == "Sa(0.5)"
        assert numbers_in(by_object.level.attrs["long_name"]) == [0.5, 5]
        assert by_object.level.attrs["long_name"].endswith("ground motion")
        measured = tp.motions.measures(array, "Sa(0.5)")["Sa(0.5)"]
        np.testing.assert_array_equal(by_object["Sa(0.5)"].values, measured.values)
        assert tp.fit_fragility(by_object).attrs["im"] == "Sa(0.5)"

    @pytest.mark.parametrize(("im", "of"), [("pga_normalised", "pga"), ("pgv_normalised", "pgv")])
    def test_block_normalised(self, im, of):
        """Each block runs as alone at its own levels of the plain measure."""
        array = motions()[:2]
        levels = np.array([1.0, 2.0, 5.0])
        together = tp.ida(BLOCKS, MODELS, array, levels, im=im, outputs=list(OUTPUTS))
        assert together.level.attrs["units"] == "1"
        assert "g tan alpha" in together.level.attrs["long_name"]
        plain = tp.motions.measures(array)[of].values
        for i, block in enumerate(BLOCKS):
            unit = 9.80665 * block.b / block.h / (block.p if of == "pgv" else 1.0)
            np.testing.assert_allclose(together[im].values[i], plain / unit, rtol=1e-13)
            alone = tp.ida(block, MODELS, array, levels * unit, im=of, outputs=list(OUTPUTS))
            np.testing.assert_array_equal(together.overturned.values[i], alone.overturned.values[0])
            np.testing.assert_allclose(together.peak_rotation.values[i], alone.peak_rotation.values[0], rtol=1e-6)
            xr.testing.assert_identical(
                tp.ida(block, MODELS, array, levels, im=im).overturned, together.overturned.isel(block=[i])
            )

    def test_uplift_starts_at_one(self):
        """A rigid block stands still below PGA = g tan alpha, and every one of them uplifts above."""
        law = tp.HousnerImpact(geometry="exact")
        result = tp.ida(BLOCKS, law, motions()[0], [1.0 - 1e-9, 1.0 + 1e-3], "pga_normalised", outputs=["uplifted"])
        assert not result.uplifted.values[:, :, 0].any()
        assert result.uplifted.values[:, :, 1].all()

    def test_block_factors_are_bit_identical_for_any_chunking(self):
        plain = records(motions())
        oscillators = [m.oscillator(b) for b in BLOCKS for m in MODELS]
        factors = scaling(LEVELS, plain, "pgv_normalised", BLOCKS).factors
        whole = tp.ida(BLOCKS, MODELS, motions(), LEVELS, "pgv_normalised", outputs=list(OUTPUTS))
        for seconds in (1e-9, 1e9):
            for name, found in in_chunks(Work(tuple(oscillators), tuple(plain), factors), seconds).items():
                np.testing.assert_array_equal(found, whole[name].values.reshape(found.shape))


class TestProbability:
    def test_counts(self, result):
        p = tp.overturning_probability(result)
        assert p.probability.dims == ("block", "model", "level")
        assert int(p.runs.min()) == int(p.runs.max()) == 12
        np.testing.assert_array_equal(p.overturnings.values, result.overturned.sum("motion").values)
        assert bool(((p.lower <= p.probability) & (p.probability <= p.upper)).all())
        assert set(p.data_vars) == {"probability", "lower", "upper", "overturnings", "runs"}
        assert 0.0 < float(p.probability.mean()) < 1.0


class TestFit:
    @pytest.mark.parametrize(
        ("overturnings", "status"),
        [
            ([0, 0, 0, 0], "no overturning"),
            ([40, 40, 40, 40], "all overturned"),
            ([40, 40, 3, 0], "not increasing"),
            ([20, 19, 18, 17], "not increasing"),
        ],
    )
    def test_what_cannot_be_fitted_is_said(self, overturnings, status):
        fit = tp.fit_fragility(counts([1.0, 2.0, 3.0, 4.0], overturnings))
        assert fit.status.item() == status
        assert not bool(fit.converged)
        for name in ("median", "dispersion", "median_se", "dispersion_lower"):
            assert np.isnan(float(fit[name]))

    @pytest.mark.parametrize("overturnings", [[0, 0, 40, 40], [0, 0, 17, 40]])
    def test_separated_stripes_are_penalised(self, overturnings):
        """No finite maximum: none without a penalty, and with it an estimate, flagged, between the levels."""
        data = counts([1.0, 2.0, 3.0, 4.0], overturnings)
        plain, penalised = tp.fit_fragility(data, penalty="none"), tp.fit_fragility(data)
        assert plain.status.item() == penalised.status.item() == "separated"
        assert np.isnan(float(plain["median"]))
        assert not bool(plain.converged)
        assert bool(penalised.converged)
        assert bool(penalised.penalised)
        assert 2.0 < float(penalised["median"]) < 4.0

    def test_runs_at_one_level_are_one_stripe(self):
        """However the counts are split over equal levels, the likelihood is the same."""
        whole = tp.fit_fragility(BAKER)
        x, k = BAKER.level.values, BAKER.overturnings.values
        split = counts(np.repeat(x, 2), np.stack([k // 2, k - k // 2], axis=1).ravel(), 20)
        assert float(tp.fit_fragility(split)["median"]) == pytest.approx(float(whole["median"]), rel=1e-12)
        assert tp.fit_fragility(counts([1.0, 1.0, 2.0], [1, 0, 1], 1)).status.item() == "separated"
        assert tp.fit_fragility(counts([1.0, 1.0], [1, 0], 1)).status.item() == "one level"
        assert tp.fit_fragility(counts([1.0, 2.0], [0, 0], 0)).status.item() == "no runs"

    def test_extreme_but_proper_data(self):
        """Steep, flat, one pair of overlapping outcomes, levels over many decades."""
        steep = tp.fit_fragility(counts([1.0, 1.01, 1.02], [1, 500, 999], 1000))
        assert steep.status.item() == "ok"
        assert float(steep["median"]) == pytest.approx(1.01, rel=1e-3)
        flat = tp.fit_fragility(counts([1.0, 2.0, 4.0], [19, 20, 21], 40))
        assert flat.status.item() == "ok"
        assert float(flat.dispersion) > 5.0
        least = tp.fit_fragility(counts([1.0, 2.0, 3.0, 4.0], [0, 1, 39, 40]))
        assert least.status.item() == "ok"
        wide = tp.fit_fragility(counts([1e-6, 1e-3, 1.0, 1e3], [1, 10, 30, 39]))
        assert wide.status.item() == "ok"

    def test_ida_and_its_counts_give_one_curve(self, result):
        from_flags, from_counts = tp.fit_fragility(result), tp.fit_fragility(tp.overturning_probability(result))
        for name in ("median", "dispersion", "log_likelihood", "status"):  # intervals know of motions, or do not
            xr.testing.assert_equal(from_flags[name], from_counts[name])
        assert from_flags["median"].dims == ("block", "model")
        assert from_flags["median"].attrs["units"] == "m s-2"
        assert {"law", "alpha", "e"} <= set(from_flags.coords)

    def test_unsorted_levels_and_empty_stripes(self):
        order = [3, 0, 7, 1, 5, 2, 6, 4]
        shuffled = BAKER.isel(level=order)
        assert float(tp.fit_fragility(shuffled)["median"]) == pytest.approx(BAKER_MEDIAN, rel=1e-12)
        gap = counts(
            [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0], [0, 0, 0, 0, 4, 6, 13, 12, 16], [40, 40, 40, 0] + [40] * 5
        )
        assert float(tp.fit_fragility(gap)["median"]) == pytest.approx(BAKER_MEDIAN, rel=1e-12)


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="minutes without the compiler")
def test_planned_time_is_of_the_right_order():
    """What a chunk is planned to take is the time it takes on a core, to a factor of 12: a limit for any machine."""
    from time import thread_time

    plain = records(tp.motions.CloughPenzien(duration=20.0).sample(20))
    oscillators = [m.oscillator(BLOCKS[0]) for m in MODELS]
    factors = np.broadcast_to(np.geomspace(1.0, 8.0, 40)[None, :, None], (1, 40, 20))
    work = Work(tuple(oscillators), tuple(plain), np.ascontiguousarray(factors))
    chunk = plan_chunks(work)[0]
    per_sample = sum(SECONDS_PER_EXACT_SAMPLE if one.exact else SECONDS_PER_SAMPLE for one in oscillators)
    samples = sum(motion.acceleration.size for motion in plain[chunk.first : chunk.stop])
    planned = per_sample * samples * work.levels * (chunk.row_stop - chunk.row) / len(oscillators)
    run_chunk(work, chunk._replace(stop=1))
    started = thread_time()
    run_chunk(work, chunk)
    assert planned / 12.0 < thread_time() - started < planned * 12.0


def test_refused(refusal):
    refusal()
