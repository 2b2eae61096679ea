"""Hostile input to every public function: one sentence that names the value and what is allowed."""

import math

import numpy as np
import pytest
import xarray as xr
from shared_cases import lifts_at

import toppling as tp
from toppling import motions as mo
from toppling.fragility import wilson_interval
from toppling.models.engine.regions import energy_consistent_zeta
from toppling.models.runs import run_many, trace
from toppling.motions.scaling import parabolic_baseline

BLOCK = tp.Block(0.4, 1.8)
LAW = tp.HousnerImpact()
SHAKE = mo.OneCycleSine(3.0, 6.0).sample(1)
NAN, INF = math.nan, math.inf

BAD_LAWS = [
    (lambda: tp.DiscreteDamping(e=0.0), ValueError, "e must be finite and > 0 and <= 1, got 0.0"),
    (lambda: tp.DiscreteDamping(e=1.1), ValueError, "got 1.1"),
    (lambda: tp.GianniniMasiani(e=NAN), ValueError, "e must be .* got nan"),
    (lambda: tp.MakrisKonstantinidis(e=-0.5), ValueError, "got -0.5"),
    (lambda: tp.EnergyConsistent(e="0.9"), TypeError, "e must be a number, got '0.9'"),
    (lambda: tp.DiscreteDamping(delta=0.0), ValueError, "delta must be finite and >= 1e-09 and < 1, got 0.0"),
    (lambda: tp.DiscreteDamping(delta=1.0), ValueError, "delta must be"),
    (lambda: tp.Vassiliou(delta=INF), ValueError, "delta must be"),
    (lambda: tp.Vassiliou(coefficient=-0.1), ValueError, "coefficient must be"),
    (lambda: tp.ViscousDamping(-0.1), ValueError, "zeta must be"),
    (lambda: tp.ViscousDamping.fema356(2.0), ValueError, "e must be"),
    (lambda: tp.DiscreteDamping(lever="x"), ValueError, "lever must be one of 'h', 'R', got 'x'"),
    (lambda: tp.EnergyConsistent(rest="hard"), ValueError, "rest must be one of"),
    (lambda: tp.HousnerImpact(geometry="flat"), ValueError, "geometry must be one of"),
    (lambda: tp.HousnerImpact(lever="R"), ValueError, "lever='R' needs geometry='bilinear'"),
    (lambda: tp.DiscreteDamping(restitution_factor=0.0), ValueError, "restitution_factor must be"),
    (lambda: tp.HousnerImpact(restitution_factor=1.2).oscillator(BLOCK), ValueError, "above 1"),
    (lambda: tp.DiscreteDamping(e=0.9, restitution_factor=0.9), ValueError, "give it or e, got e=0.9"),
    (lambda: tp.DiscreteDamping(delta=1e-13), ValueError, "delta must be finite and >= 1e-09 and < 1, got 1e-13"),
    (lambda: tp.Block(1e200, 1e200), ValueError, "width must be finite and > 0 and <= 1e.06"),
    (lambda: tp.Block(1e-200, 1e-200), ValueError, "R of at least 1e-06 m"),
    (lambda: tp.Block(10**400, 1.0), ValueError, "width must be finite"),
    (lambda: tp.ViscousDamping(1e3), ValueError, "zeta must be finite and >= 0 and <= 100"),
]

BAD_SIMULATIONS = [
    (lambda: tp.simulate("block", LAW, SHAKE), TypeError, "block must be a toppling Block, got str"),
    (lambda: tp.simulate(BLOCK, "discrete", SHAKE), TypeError, "model must be a damping law"),
    (lambda: tp.simulate(BLOCK, tp.HousnerImpact, SHAKE), TypeError, "the class HousnerImpact .call it."),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE.values), TypeError, "motion must be a labelled array"),
    (lambda: tp.simulate(BLOCK, LAW, mo.KanaiTajimi(duration=2.0).sample(2)), ValueError, "exactly one motion"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE.assign_attrs(units="g")), ValueError, "must be in m s-2, got units 'g'"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE * NAN), ValueError, "motion must be finite .* got nan at index 0"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE, theta0=NAN), ValueError, "theta0 must be"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE, theta0=1.6), ValueError, "theta0 must be"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE, omega0=INF), ValueError, "omega0 must be"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE, omega0=1e100), ValueError, "omega0 must be finite and >= -1e.06 and <="),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE, theta0=np.zeros(2)), TypeError, "theta0 must be a number"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 1e308), ValueError, "at most 1e.07 samples, got inf"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 5.0, dt=5e-324), ValueError, "at most 1e.07 samples, got inf"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE.isel(time=slice(0, 1))), ValueError, "at least 2 samples"),
    (lambda: tp.simulate(BLOCK, LAW, every_second()), ValueError, "states dt = .* but its time steps"),
    (lambda: tp.simulate(BLOCK, LAW, uneven()), ValueError, "time step of motion must be uniform"),
    (lambda: tp.simulate(BLOCK, LAW, SHAKE.drop_vars(["time", "dt"])), ValueError, "a dt or a time coordinate"),
    (lambda: tp.free_rocking(BLOCK, LAW, BLOCK.alpha, 5.0), ValueError, "theta0 must satisfy 0 < .theta0. < alpha"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.0, 5.0), ValueError, "theta0 must satisfy"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 0.0), ValueError, "duration must be"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 5.0, dt=0.0), ValueError, "dt must be"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 5.0, dt=6.0), ValueError, "dt must be"),
    (lambda: tp.free_rocking(BLOCK, LAW, 0.1, 1e9), ValueError, "at most 1e.07 samples"),
]

BAD_MOTIONS = [
    (lambda: mo.highpass(SHAKE, 5e-324), ValueError, "corner frequency must be finite and > 1e-09"),
    (lambda: mo.resample(SHAKE, 5e-324), ValueError, "dt must stand to the motions' step"),
    (lambda: mo.measures([SHAKE.assign_coords(motion=["x" * 10**5])] * 2), ValueError, "got 'x{59} more than once"),
    (lambda: mo.response_spectrum(SHAKE, 10**5000), TypeError, "got a value of type ndarray"),
    (lambda: wilson_interval([1, 2], [3, 4, 5]), TypeError, "arrays of shapes that fit, got .1, 2. and .3, 4, 5."),
    (lambda: wilson_interval(10**400, 5), TypeError, "must be numbers or arrays of shapes that fit"),
    (lambda: mo.from_array([], 0.01), ValueError, "must not be empty"),
    (lambda: mo.from_array([1.0], 0.01), ValueError, "at least 2 samples"),
    (lambda: mo.from_array([0.0, NAN], 0.01), ValueError, "acceleration must be finite .* got nan at index .?1"),
    (lambda: mo.from_array([0.0, -INF], 0.01), ValueError, "got -inf"),
    (lambda: mo.from_array(np.zeros((2, 2, 2)), 0.01), ValueError, "1 or 2 dimension"),
    (lambda: mo.from_array(1.0, 0.01), ValueError, "dimension"),
    (lambda: mo.from_array(["a", "b"], 0.01), TypeError, "real numbers"),
    (lambda: mo.from_array([1j, 2j], 0.01), TypeError, "real numbers"),
    (lambda: mo.from_array([[1.0, 2.0], [3.0]], 0.01), TypeError, "real numbers"),
    (lambda: mo.from_array([0.0, 1.0], 0.0), ValueError, "dt must be finite and > 0 and <= 1000 .in s., got 0.0"),
    (lambda: mo.from_array([0.0, 1.0], -0.01), ValueError, "dt must be"),
    (lambda: mo.from_array([0.0, 1.0], NAN), ValueError, "dt must be"),
    (lambda: mo.from_array([0.0, 1.0], 1e4), ValueError, "dt must be .*<= 1000"),
    (lambda: mo.from_array([0.0, 1e10], 0.01), ValueError, "acceleration must be at most 1e.09 m/s², got 1e.10"),
    (lambda: mo.KanaiTajimi(omega_g=1e200), ValueError, "omega_g must be .*<= 1e.06"),
    (lambda: mo.KanaiTajimi().sample(10**12), ValueError, "at most 5e.08 samples in all"),
    (lambda: mo.from_array([0.0, 1.0], 0.01, ["a", "b"]), ValueError, "labels must be 1"),
    (lambda: mo.from_array(np.zeros((2, 3)), 0.01, ["a", "a"]), ValueError, "unique, got 'a'"),
    (lambda: mo.measures([]), ValueError, "at least one motion, got none"),
    (lambda: mo.measures([np.zeros(5)]), TypeError, "labelled arrays"),
    (lambda: mo.measures([SHAKE, SHAKE]), ValueError, "unique labels, got 'OneCycleSine"),
    (lambda: mo.measures(SHAKE.rename(time="t")), ValueError, "dims"),
    (lambda: mo.measures(SHAKE.assign_attrs(units="g")), ValueError, "must be in m s-2, got units 'g'"),
    (lambda: mo.measures(None), TypeError, "labelled arrays .* got NoneType"),
    (lambda: mo.measures(every_second()), ValueError, "states dt = .* but its time steps"),
    (lambda: mo.measures(uneven()), ValueError, "must be uniform"),
    (lambda: mo.from_array([0.0, 1.0], 0.01, 5), ValueError, "labels must be 1 non-empty strings"),
    (lambda: mo.from_array([0.0, 1.0], 0.01, source=5), ValueError, "source must be one string"),
    (lambda: mo.from_array(np.ma.masked_equal([0.0, 1.0], 1.0), 0.01), ValueError, "no masked values"),
    (lambda: mo.read(5), TypeError, "path must be a path, got int"),
    (lambda: mo.read(mo.example_path(), dt=0.5), ValueError, "states its own DT"),
    (lambda: mo.write_at2(SHAKE, "no/such/folder.AT2"), ValueError, "cannot be written"),
    (lambda: mo.write_at2(SHAKE, "x.AT2", title="a\nb"), ValueError, "title must be one line"),
    (lambda: mo.scale_to("x", 1.0), TypeError, "labelled arrays"),
    (lambda: mo.scale_to(SHAKE.isel(motion=0), 1.0), ValueError, "must have dims .motion, time."),
    (lambda: parabolic_baseline([0.0, 1.0], 0.01), ValueError, "at least 5 samples"),
    (lambda: parabolic_baseline(np.full(9, NAN), 0.01), ValueError, "finite"),
    (lambda: parabolic_baseline(np.ones(9), -0.01), ValueError, "dt must be"),
    (lambda: mo.scale_to(SHAKE, -1.0), ValueError, "target must be"),
    (lambda: mo.scale_to(SHAKE, 1.0, "pgx"), ValueError, "intensity measure must be one of"),
    (lambda: mo.KanaiTajimi(dt=0.0), ValueError, "dt must be"),
    (lambda: mo.KanaiTajimi(duration=NAN), ValueError, "duration must be"),
    (lambda: mo.KanaiTajimi(duration=0.005, dt=0.005), ValueError, "duration must be at least 20 dt"),
    (lambda: mo.KanaiTajimi(xi_g=0.0), ValueError, "xi_g must be"),
    (lambda: mo.CloughPenzien(omega_f=-1.0), ValueError, "omega_f must be"),
    (lambda: mo.KanaiTajimi(envelope="gamma"), TypeError, "envelope must be"),
    (lambda: mo.KanaiTajimi(baseline="linear"), ValueError, "baseline must be one of"),
    (lambda: mo.KanaiTajimi().sample(0), ValueError, "n must be at least 1, got 0"),
    (lambda: mo.KanaiTajimi().sample(2.5), TypeError, "n must be a whole number"),
    (lambda: mo.KanaiTajimi().sample(1, seed=-1), ValueError, "seed must be at least 0"),
    (lambda: mo.RiseStrongDecay(rise=0.0), ValueError, "rise must be"),
    (lambda: mo.RiseStrongDecay(rise=5.0, strong_end=4.0), ValueError, "strong_end must be"),
    (lambda: mo.HalfSine(0.0, 6.0), ValueError, "amplitude must be"),
    (lambda: mo.Ricker(1.0, INF), ValueError, "omega must be"),
]


def study(blocks=BLOCK, models=LAW, motions=SHAKE, levels=(1.0, 2.0), **options):
    return tp.ida(blocks, models, motions, levels, **options)


def bare(record, factor, vertical=None):
    vertical = None if vertical is None else np.array(vertical)
    return run_many([LAW.oscillator(BLOCK)], np.array([[factor]]), np.array(record), 0.01, vertical=vertical)


BAD_STUDIES = [
    (lambda: study(blocks=[]), ValueError, "blocks must hold at least one, got none"),
    (lambda: study(models=[]), ValueError, "models must hold at least one"),
    (lambda: study(motions=[]), ValueError, "at least one motion"),
    (lambda: study(blocks=[1.0]), TypeError, "blocks must be one Block or a sequence of them, got float"),
    (lambda: study(blocks=0.4), TypeError, "blocks must be one Block"),
    (lambda: study(models=tp.HousnerImpact), TypeError, "the class HousnerImpact .call it."),
    (lambda: study(blocks=[BLOCK, BLOCK]), ValueError, "unique labels"),
    (lambda: study(models=[LAW, LAW]), ValueError, "unique labels, got 'housner e=e_R'"),
    (lambda: study(levels=[]), ValueError, "levels must not be empty"),
    (lambda: study(levels=[2.0, 1.0]), ValueError, "strictly increasing, got 1 after 2"),
    (lambda: study(levels=[1.0, 1.0]), ValueError, "strictly increasing"),
    (lambda: study(levels=[-1.0, 1.0]), ValueError, "levels must be > 0, got -1"),
    (lambda: study(levels=[0.0, 1.0]), ValueError, "levels must be > 0"),
    (lambda: study(levels=[1.0, NAN]), ValueError, "levels must be finite"),
    (lambda: study(levels=[[1.0, 2.0]]), ValueError, "1 dimension"),
    (lambda: study(levels="high"), TypeError, "levels must be real numbers"),
    (lambda: study(levels=[1.0, 1e300]), ValueError, "to 1e.09 m/s² at most, got a factor of"),
    (lambda: study(levels=[1.0, 1e308], im="scale"), ValueError, "to 1e.09 m/s² at most"),
    (lambda: study(motions=mo.from_array([0.0, 1e-310, 0.0], 0.01)), ValueError, "has a peak of 1e-310 m/s²"),
    (lambda: study(motions=0.9e-100 * SHAKE), ValueError, "has a peak of 2.7e-100 m/s² and cannot be scaled"),
    (lambda: study(motions=1e-165 * SHAKE, levels=[1.0], im="arias"), ValueError, "has a peak of"),
    (lambda: tp.stripes(BLOCK, LAW, [1e-200 * SHAKE], [1.0]), ValueError, "has a peak of"),
    (lambda: mo.scale_to(1e-170 * SHAKE, 1.0, "arias"), ValueError, "has a peak of"),
    (lambda: mo.scale_to_mean(1e-170 * SHAKE, 1.0), ValueError, "has a peak of"),
    (lambda: study(levels=[1e-200], im="scale"), ValueError, "scaled by 1e-100 at least"),
    (lambda: study(motions=1e-290 * SHAKE, levels=[1e290], im="scale"), ValueError, "1e.100 at most"),
    (lambda: bare([0.0, 1.0, 0.0], 1.1e9), ValueError, "at most 1e.09 m/s², got 1.1e.09"),
    (lambda: bare([0.0, 1.5e308, 0.0], 1.0), ValueError, "at most 1e.09 m/s²"),
    (lambda: bare([0.0, 1.0, 0.0], 1.0, [0.0, -2e9, 0.0]), ValueError, "at most 1e.09 m/s²"),
    (lambda: bare([0.0, NAN, 0.0], 1.0), ValueError, "must be finite"),
    (
        lambda: study(im="pgx"),
        ValueError,
        "im must be one of 'pga', 'pgv', 'pgd', 'arias', 'cav', 'housner_intensity', 'pga_normalised', .*, got 'pgx'",
    ),
    (lambda: study(outputs=[]), ValueError, "at least one of overturned"),
    (lambda: study(outputs=["peak"]), ValueError, "outputs must be one of"),
    (lambda: study(motions=mo.from_array(np.zeros(9), 0.01)), ValueError, "has pga = 0"),
    (lambda: study(skip="yes"), TypeError, "skip must be True or False"),
    (lambda: study(client="x"), TypeError, "client must be a dask.distributed Client, got str"),
    (lambda: study(motions=None), TypeError, "labelled arrays"),
    (lambda: tp.Study.from_toml(5), TypeError, "path must be a path, got int"),
    (lambda: tp.overturning_probability(flags([0.5])), ValueError, "must be flags"),
    (lambda: tp.overturning_probability(flags([])), ValueError, "at least one motion"),
    (lambda: wilson_interval(np.array([5]), np.array([4])), ValueError, "between 0 and trials"),
    (lambda: wilson_interval(np.array([1]), np.array([4]), 2.0), ValueError, "confidence must be"),
    (lambda: tp.fit_fragility(more_runs()), ValueError, "dimensions of overturnings"),
    (lambda: tp.overturning_probability(SHAKE), TypeError, "needs runs with `overturned`"),
    (lambda: tp.overturning_probability(study(), confidence=1.0), ValueError, "confidence must be"),
    (lambda: tp.fit_fragility(3.0), TypeError, "needs an IDA dataset or a dataset of counts, got float"),
    (lambda: tp.fit_fragility(xr.Dataset()), ValueError, "counts must hold overturnings and runs"),
    (lambda: tp.fit_fragility(fractions([0.5], [1])), TypeError, "whole numbers"),
    (lambda: tp.fit_fragility(fractions([5], [4])), ValueError, "between 0 and runs"),
    (lambda: tp.fit_fragility(fractions([-1], [4])), ValueError, "between 0 and runs"),
    (lambda: tp.fit_fragility(fractions([1], [4], -1.0)), ValueError, "level must be > 0"),
    (lambda: tp.fit_fragility(fractions([1], [4]), confidence=NAN), ValueError, "confidence must be"),
]


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


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    BAD_LAWS + BAD_SIMULATIONS + BAD_MOTIONS + BAD_STUDIES,
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_one_sentence(call, kind, message):
    with pytest.raises(kind, match=message) as error:
        call()
    assert type(error.value) in (kind, mo.RecordError)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300


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
