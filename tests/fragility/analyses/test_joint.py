"""Falls of many blocks in one event: against runs of all of them, samples against the whole, and what is refused."""

import numpy as np
import pytest

import toppling as tp
from toppling.fragility import joint_falls
from toppling.fragility.analyses.joint import _falls
from toppling.models import BlockArray

SHAKES = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(60, seed=5)
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
LEVELS = [3.5, 5.0]


def region(n, seed=1):
    random = np.random.default_rng(seed)
    height, slenderness = random.uniform(1.2, 2.0, n), random.uniform(3.0, 5.0, n)
    return BlockArray(height / slenderness, height)


@pytest.fixture(scope="module")
def fell():
    """Outcomes (law, level, block, motion) of 300 blocks."""
    blocks = region(300).some(np.arange(300))
    runs = tp.ida(blocks, LAWS, SHAKES, LEVELS, outputs=["overturned"], screen=False)
    return runs["overturned"].transpose("model", "level", "block", "motion").values


@pytest.mark.slow
def test_all_blocks_are_those_of_a_direct_analysis(fell):
    found = joint_falls(region(300), LAWS, SHAKES, LEVELS)
    shares = fell.mean(axis=2)
    np.testing.assert_array_equal(found["fallen_share"], shares)
    np.testing.assert_allclose(found["fallen_mean"], shares.mean(axis=-1), rtol=1e-12)
    np.testing.assert_allclose(found["fallen_sd"], shares.std(axis=-1, ddof=1), rtol=1e-12)
    np.testing.assert_allclose(found["fallen_quantile"][..., 1], np.median(shares, axis=-1), rtol=1e-12)
    assert not found["fallen_sampling_error"].values.any()
    # (with each block's outcomes put in an order of its own, blocks fall independently)
    random = np.random.default_rng(2)
    apart = [random.permuted(fell[0, 0], axis=1).mean(axis=0).var(ddof=1) for _ in range(300)]
    assert float(found["fallen_sd_independent"][0, 0]) ** 2 == pytest.approx(np.mean(apart), rel=0.05)
    assert float(found["fallen_sd"][0, 0]) > 5.0 * float(found["fallen_sd_independent"][0, 0])
    covariances = np.cov(fell[0, 0])
    off = (covariances.sum() - np.trace(covariances)) / (300 * 299)
    assert float(found["fallen_correlation"][0, 0]) == pytest.approx(off / np.diag(covariances).mean(), rel=1e-9)


def test_samples_say_the_same_on_the_average(fell):
    """500 samples of 12 blocks: variances of the 300 are found without the noise of a sample."""
    whole = _falls(fell[1, 0], 300)
    random = np.random.default_rng(4)
    some = [_falls(fell[1, 0][random.choice(300, 12, replace=False)], 300) for _ in range(500)]
    for name in ("sd", "sd_independent"):
        squares = np.array([one[name] for one in some]) ** 2
        assert abs(squares.mean() - whole[name] ** 2) < 4.0 * squares.std() / np.sqrt(500)
    noisy = np.mean([one["share"].var(ddof=1) for one in some])
    assert noisy > 1.15 * whole["sd"] ** 2
    more = [_falls(fell[1, 0][random.choice(300, 40, replace=False)], 300) for _ in range(300)]
    assert np.mean([one["mean_lower"] <= whole["mean"] <= one["mean_upper"] for one in more]) > 0.95


@pytest.mark.slow
def test_a_share_from_a_sample_has_the_error_that_is_said(fell):
    random = np.random.default_rng(4)
    shares = [fell[1, 0][random.choice(300, 40, replace=False)].mean(axis=0) for _ in range(400)]
    for motion in (3, 20, 41):
        p = fell[1, 0, :, motion].mean()
        said = np.sqrt((1.0 - 40 / 300) * p * (1.0 - p) / 39)
        assert np.std([one[motion] for one in shares]) == pytest.approx(said, rel=0.15, abs=1e-12)
    found = joint_falls(region(300), LAWS, SHAKES, LEVELS, sample=40)
    q = found["fallen_quantile"]
    np.testing.assert_allclose(found["fallen_sampling_error"], np.sqrt((1.0 - 40 / 300) * q * (1.0 - q) / 39))


@pytest.mark.slow
def test_the_sample_is_of_the_seed_alone():
    one = joint_falls(region(300), LAWS[0], SHAKES, LEVELS, sample=40, seed=1)
    assert one.identical(joint_falls(region(300), LAWS[0], SHAKES, LEVELS, sample=40, seed=1))
    other = joint_falls(region(300), LAWS[0], SHAKES, LEVELS, sample=40, seed=2)
    assert not np.array_equal(one["fallen_share"], other["fallen_share"])
    assert (one.attrs["blocks"], one.attrs["sample"]) == (300, 40)


def test_blocks_with_walls_and_those_that_never_fall():
    leaning = [tp.Block(0.4, 1.8, name=f"shelf {i}", wall=tp.Wall(0.05 + 0.01 * i)) for i in range(4)]
    found = joint_falls(leaning, LAWS[1], SHAKES, [1e-3])
    assert float(found["fallen_mean"].item()) == 0.0
    assert np.isnan(found["fallen_correlation"].item())
    assert float(found["fallen_sd"].item()) == float(found["fallen_sd_independent"].item()) == 0.0


def test_what_no_event_showed_has_an_upper_end():
    """Clopper and Pearson's, as if blocks fell all or none."""
    fell = np.zeros((50, 30), bool)
    none, every = _falls(fell, 300), _falls(~fell, 300)
    upper = 1.0 - 0.025 ** (1.0 / 30.0)
    assert (none["mean"], none["mean_lower"]) == (0.0, 0.0)
    assert none["mean_upper"] == pytest.approx(upper, rel=1e-9)
    assert (every["mean"], every["mean_upper"]) == (1.0, 1.0)
    assert every["mean_lower"] == pytest.approx(1.0 - upper, rel=1e-9)


def test_refused(refusal):
    refusal()
