"""Hostile input to every public function: one sentence that names the value and what is allowed."""

import math

import numpy as np
import pytest
import xarray as xr
from shared_cases import lifts_at

import toppling as tp
from toppling import motions as mo
from toppling.models.engine.regions import energy_consistent_zeta
from toppling.models.runs import run_many, trace

BLOCK = tp.Block(0.4, 1.8)
LAW = tp.HousnerImpact()
SHAKE = mo.OneCycleSine(3.0, 6.0).sample(1)
NAN, INF = math.nan, math.inf
HAZARD = tp.HazardCurve.power_law(1e-4, 2.5, "pga")
_OF_BLOCK = {name: ("block", [value], {"units": "m s-2"}) for name, value in (("median", 2.0), ("dispersion", 0.4))}
CURVES = xr.Dataset(_OF_BLOCK, {"block": ["a"]}, {"im": "pga"})


def study(blocks=BLOCK, models=LAW, motions=SHAKE, levels=(1.0, 2.0), **options):
    return tp.ida(blocks, models, motions, levels, **options)


def bare(record, factor, vertical=None):
    vertical = None if vertical is None else np.array(vertical)
    return run_many([LAW.oscillator(BLOCK)], np.array([[factor]]), np.array(record), 0.01, vertical=vertical)


def flags(values):
    return xr.Dataset({"overturned": (("level", "motion"), [values])}, coords={"level": [1.0]})


def more_runs():
    return fractions([1], [4]).assign(runs=(("block", "level"), [[4], [5]]))


def every_second():
    """A stale dt beside a time axis that was thinned."""
    return SHAKE.isel(time=slice(None, None, 2))


def uneven():
    return SHAKE.drop_vars("dt").assign_coords(time=SHAKE.time**2)


def fractions(overturnings, runs, level=1.0):
    return xr.Dataset({"overturnings": ("level", overturnings), "runs": ("level", runs)}, coords={"level": [level]})


EXTREMES = [
    tp.DiscreteDamping(e=0.01, delta=1e-6),
    tp.DiscreteDamping(e=1.0, delta=0.5),
    tp.DiscreteDamping(e=0.5, delta=1e-6, rest="rigid"),
    tp.EnergyConsistent(e=0.01, delta=0.5, rest="elastic"),
    tp.EnergyConsistent(e=0.01, delta=1e-6),
    tp.EnergyConsistent(e=0.999999, delta=0.3),
    tp.GianniniMasiani(e=0.01, delta=1e-4),
    tp.MakrisKonstantinidis(e=0.01, delta=1e-4),
    tp.Vassiliou(delta=1e-5, coefficient=1.0),
    tp.HousnerImpact(e=1.0),
    tp.HousnerImpact(e=1.0, geometry="linear"),
    tp.HousnerImpact(e=0.01),
    tp.HousnerImpact(e=0.999999, geometry="bilinear"),
]


@pytest.mark.parametrize("model", EXTREMES, ids=lambda m: m.label)
@pytest.mark.parametrize(("alpha", "R"), [(0.01, 0.01), (0.2, 100.0), (1.2, 0.5)])
def test_extreme_parameters_end_and_stay_finite(model, alpha, R):
    block = tp.Block.from_slenderness(alpha, R)
    base = mo.KanaiTajimi(duration=4.0, dt=0.02, envelope=mo.Stationary()).sample(2, seed=1)
    threshold = 9.80665 * math.tan(alpha)
    at_threshold = mo.from_array(np.tile([threshold, -threshold], 10), 0.01, ["at the threshold"])
    denormal = mo.from_array(np.full(20, 5e-324), 0.01, ["denormal"])
    levels = np.array([1e-12, 0.5, 1.0, 1.0 + 1e-12, 2.0, 1e6]) * threshold
    scaled = tp.ida(block, model, mo.scale_to(base, 1.0), levels, im="scale", outputs=["peak_rotation", "overturned"])
    plain = tp.ida(block, model, [at_threshold, denormal], [1.0, 1.0 + 1e-9], im="scale")
    for result in (scaled, plain):
        peaks = result.peak_rotation.values
        assert np.isfinite(peaks).all()
        assert np.all((peaks >= 0.0) & (peaks <= 0.5 * math.pi))
        np.testing.assert_array_equal(peaks == 0.5 * math.pi, result.overturned.values)
    assert scaled.overturned.values[0, 0, -1].all()
    assert not scaled.overturned.values[0, 0, 0].any()


@pytest.mark.slow
def test_uplift_within_rounding_of_the_threshold_ends():
    """Forcing a few units in the last place about the threshold, then falling, steady or rising: no endless uplift."""
    rng = np.random.default_rng(5)
    laws = [tp.HousnerImpact(e=0.9, geometry=g) for g in ("exact", "linear", "bilinear")] + [tp.EnergyConsistent(e=0.9)]
    for i in range(4000):
        oscillator = laws[i % 4].oscillator(tp.Block.from_slenderness(rng.uniform(0.01, 1.3), rng.uniform(0.1, 3.0)))
        start = -lifts_at(oscillator) / oscillator.gain * (1.0 + int(rng.integers(-40, 40)) * 2.2e-16)
        after = start * rng.choice([0.0, 0.5, 1.0, 1.0 + 2.2e-16, 1.01, -1.0])
        peak = trace(oscillator, np.array([start, after, 0.0]), 0.01).results[1]
        assert 0.0 <= peak < 0.5


def test_restitution_within_rounding_of_one():
    shakes = mo.CloughPenzien(duration=8.0, dt=0.01).sample(10, seed=1)
    for e in (np.nextafter(1.0, 0.0), 1.0 - 1e-15, 1.0 - 1e-12):
        laws = [tp.EnergyConsistent(e=float(e)), tp.EnergyConsistent(e=float(e), rest="elastic")]
        result = tp.ida(BLOCK, laws, shakes, [1.0, 3.0])
        assert np.isfinite(result.peak_rotation.values).all()
    assert 0.0 < energy_consistent_zeta(818.8023088772889, 818.8023088772887) < 1e-12


@pytest.mark.parametrize("model", [*EXTREMES, tp.DiscreteDamping(), tp.ViscousDamping(0.05), tp.Vassiliou()], ids=str)
def test_denormal_and_huge_shaking_ends(model):
    """Products of denormals have no sign; a shove of 1e8 g overturns, and does not spin."""
    for values in ([-5e-324, 1.0, 0.0], [0.0, -1e-322, 1.0, 0.0], [5e-324, 5e-324, -1.0, 0.0], [5e-324, -5e-324]):
        run = tp.simulate(BLOCK, model, mo.from_array(values, 0.01))
        assert 0.0 <= float(run.peak_rotation) < 0.1
    shove = tp.simulate(BLOCK, model, mo.from_array([0.0, 1e9, 1e9, 0.0], 0.01))
    assert bool(shove.overturned)
    back = tp.simulate(BLOCK, model, mo.from_array([1e9, -1e9, 1e9], 0.01))
    assert float(back.peak_rotation) <= 0.5 * math.pi


@pytest.mark.parametrize(
    ("levels", "overturnings", "runs", "status"),
    [
        (np.linspace(0.1, 1.4, 14), [0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1], 200, "flat"),
        ([1.0, 2.0, 3.0, 4.0], [10, 10, 10, 11], 200, "flat"),
        ([1.0, 2.0, 3.0], [0, 1, 0], 200, "flat"),
        ([1.0459478394829482, 166.3752963998099, 166.3752964025665, 166.375296402623], [0, 0, 1, 1], 25, None),
    ],
)
def test_counts_without_a_slope_give_no_curve(levels, overturnings, runs, status):
    data = xr.Dataset(
        {"overturnings": ("level", np.array(overturnings)), "runs": ("level", np.full(len(levels), runs))},
        coords={"level": np.asarray(levels)},
    )
    fit = tp.fit_fragility(data)
    if status is not None:
        assert fit.status.item() == status
    finite = [np.isfinite(float(fit[name])) for name in ("median", "median_se", "median_upper", "dispersion_upper")]
    assert all(finite) if fit.status.item() == "ok" else not any(finite)


def test_refused(refusal):
    refusal()


def test_levels_of_another_order_are_of_their_curves():
    """Shares above a level on (model, block) are those of the curves on (block, model), by name."""
    on = ("block", "model")
    medians = np.array([[1.0, 2.0], [3.0, 4.0]])
    curves = xr.Dataset({"median": (on, medians, {"units": "m s-2"}), "dispersion": (on, np.full((2, 2), 0.4))})
    curves.attrs["im"] = "pga"
    levels = xr.DataArray(np.array([[1.0, 2.0], [0.5, 3.0]]), dims=on)
    found = tp.fragility.rate_share_above(curves, HAZARD, levels)
    assert found.equals(tp.fragility.rate_share_above(curves, HAZARD, levels.T))
    alone = tp.fragility.rate_share_above(curves, HAZARD, 0.5)
    assert found[1, 0] == alone[1, 0]


@pytest.mark.parametrize("height", [3.0, [3.0, 3.0], np.float32(3.0), xr.DataArray([3.0, 3.0], attrs={"units": "m"})])
def test_heights_as_they_come(height):
    made = mo.Building.flexural_shear(0.5, storeys=2, storey_height=height)
    np.testing.assert_array_equal(made.heights, [0.0, 3.0, 6.0])


@pytest.mark.parametrize("color", [None, "k", "C3", "#0072B2", (0.1, 0.2, 0.3), "0.5"])
def test_colours_as_they_come(color):
    tp.plot.phase(tp.free_rocking(BLOCK, LAW, 0.1, 0.5), color=color, label=None)
