"""Answers of every public function of toppling.fragility."""

import numpy as np
import xarray as xr

import toppling as tp
from toppling import fragility
from toppling.fragility.curves import published
from toppling.models.block_array import BlockArray

SHELF, CABINET = tp.Block(0.2, 1.0, name="shelf"), tp.Block(0.3, 1.2, name="cabinet")
LAWS = [tp.HousnerImpact(0.9), tp.EnergyConsistent()]
NOISE = tp.motions.CloughPenzien(duration=6.0, dt=0.02)
GROUND = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(12, seed=4)
LEVELS = [1.0, 2.0, 3.0, 4.0, 6.0]
AT_LEVEL = {"level": 4.0, "within": 0.2}
MOTIONS = {"motions": {"least": 32, "most": 32}}
HAZARD = fragility.HazardCurve.power_law(1e-2, 2.5, "pga")


def _runs(**options):
    return fragility.ida([SHELF, CABINET], LAWS, GROUND, LEVELS, **options)


def _curves():
    return fragility.fit_fragility(_runs(), replicates=50)


def _inputs():
    return fragility.RandomInputs(
        {"e": fragility.Uniform(0.85, 1.0), "alpha_factor": fragility.Normal(1.0, 0.05, 0.8, 1.2)},
        {("e", "alpha_factor"): 0.3},
    )


def _response():
    return fragility.overturning_response(_inputs(), SHELF, LAWS[0], GROUND, [4.0, 5.0])


def _table():
    """Every motion at two levels under one law and at one under the other."""
    return {"model": [0, 0, 1] * 3, "motion": [0, 0, 0, 1, 1, 1, 2, 2, 2], "level": [2.0, 4.0, 3.0] * 3}


def analyses():
    return {
        "ida": _runs(),
        "ida_turned": _runs(polarity="both", skip=False, outputs=["overturned", "peak_rotation"]),
        "cloud": fragility.cloud(SHELF, LAWS, GROUND),
        "stripes": fragility.stripes(SHELF, LAWS, [GROUND[:6], GROUND[6:]], [3.0, 4.0]),
        "adaptive": tp.adaptive_ida(SHELF, LAWS[0], NOISE, until={"median": 0.3} | MOTIONS),
        "adaptive_at_level": fragility.adaptive_ida(SHELF, LAWS[0], NOISE, until={"probability": AT_LEVEL} | MOTIONS),
        "run_table": fragility.run_table(SHELF, LAWS, GROUND[:3], _table()),
        "joint_falls": fragility.joint_falls(BlockArray([0.2, 0.22, 0.3], [1.0, 1.1, 1.2]), LAWS, GROUND, [2.0, 4.0]),
        "slide_runs": fragility.slide_runs(_runs(), GROUND, 0.3, draws=10),
    }


def surfaces():
    blocks = [tp.Block(0.25, 0.25 * ratio) for ratio in (3.5, 4.0, 4.5, 5.0, 5.5, 6.0)]
    shakes = tp.motions.CloughPenzien(duration=6.0, dt=0.02)
    found = fragility.pooled(blocks, LAWS[1], shakes, until={"median": 0.25}, hazard=HAZARD)
    return {"pooled": found, "surface_curves": fragility.surface_curves(found, blocks, HAZARD)}


def estimates():
    runs = _runs()
    curves = _curves()
    slip = fragility.Slip(0.05)
    slid = fragility.slide_runs(runs, GROUND, 0.2, draws=10)
    published_medians = published.p58_estimate([SHELF, CABINET])
    return {
        "overturning_probability": fragility.overturning_probability(runs),
        "forms": sorted(fragility.FORMS),
        "fit_fragility": curves,
        "kept_replicates": fragility.fit_fragility(runs, keep_replicates=True, replicates=50),
        "fit_weibull": fragility.fit_fragility(runs, form="weibull", penalty="firth", replicates=50),
        "fit_capacity": fragility.fit_fragility(runs, method="first-overturning", fractiles=[0.1], replicates=50),
        "goodness_of_fit": fragility.goodness_of_fit(runs, replicates=20),
        "compare_forms": fragility.compare_forms(runs),
        "curve_probability": fragility.curve_probability(curves, [1.5, 2.5], outside="least"),
        "with_modelling": fragility.with_modelling(curves, 0.3),
        "median_ratio": fragility.median_ratio(_pgv_curves(), published_medians),
        "resurrections": fragility.resurrections(runs),
        "reached": fragility.reached(runs),
        "reached_slip": fragility.reached(slid, slip),
        "binomial_interval": fragility.binomial_interval([0, 3, 12], 12, method="jeffreys"),
        "wilson_interval": fragility.wilson_interval([0, 3, 12], 12),
    }


def _pgv_curves():
    return fragility.fit_fragility(fragility.ida([SHELF, CABINET], LAWS[0], GROUND, [0.1, 0.3, 0.6, 1.0], "pgv"))


def criteria():
    return {
        "fema_p58": published.fema_p58(),
        "p58_estimate": published.p58_estimate([SHELF, CABINET]),
        "japanese": published.japanese([SHELF, CABINET]),
        "japanese_velocity": published.japanese([SHELF, CABINET], "velocity"),
    }


def efficiency():
    many = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(40, seed=4)
    runs = fragility.stripes(SHELF, LAWS[0], [many, many], [4.0, 5.0])
    return {
        "overturning_capacity": fragility.overturning_capacity(_runs()),
        "rank_measures": fragility.rank_measures(_runs(), GROUND, "Sa(0.5)", replicates=20),
        "stripe_sufficiency": fragility.stripe_sufficiency(runs, ["pgv"]),
    }


def hazards():
    points = fragility.HazardCurve.from_points([0.1, 0.4, 1.0], [1e-2, 1e-3, 1e-4], "pga", "g", source="points")
    quadratic = fragility.HazardCurve.log_quadratic(1e-4, 2.5, 0.2, "pga", units="g")
    rows = [points.rates, HAZARD.resampled(points.levels).rates]
    mean = fragility.HazardCurve(points.levels, (), "pga", realisations=rows, weights=[0.4, 0.6])
    try:
        fragility.read_hazard("target.csv")
    except fragility.HazardError as error:
        refused = str(error)
    return {
        "describe": points.describe(),
        "rate_at": [curve.rate_at([0.8, 3.0, 12.0]) for curve in (points, quadratic, mean, HAZARD)],
        "pieces": points.pieces(above="none"),
        "resampled": HAZARD.resampled([0.5, 2.0]),
        "measure": [mean.measure.label, mean.units],
        "read_hazard": fragility.read_hazard("hazard.csv"),
        "probability_in": fragility.probability_in(0.002),
        "rate_from_probability": fragility.rate_from_probability(0.1, 50.0),
        "refused": refused,
    }


def risk():
    curves = _curves()
    other = fragility.HazardCurve.log_quadratic(1e-2, 2.2, 0.1, "pga")
    branches = [
        fragility.Branch("housner", "motions", "first", curves.isel(model=0), HAZARD, 0.6),
        fragility.Branch("housner", "motions", "second", curves.isel(model=0), other, 0.4),
    ]
    rates = fragility.annual_rate(curves, HAZARD, outside="least")
    sizes = rates.isel(model=0)
    return {
        "annual_rate": rates,
        "rate_share_above": fragility.rate_share_above(curves, HAZARD, 2.0, outside="least"),
        "epistemic_rates": fragility.epistemic_rates(branches, 0.2, outside="least"),
        "size_for_rate": fragility.size_for_rate(sizes, rate=float(sizes["rate"].mean())),
    }


def exchange():
    curves = _curves().isel(model=0)
    written = {
        "csv": fragility.write_curve_csv(curves, "curves.csv"),
        "nrml": fragility.write_nrml(curves, "fragility.xml"),
        "pelicun": fragility.write_pelicun(curves, "fragility_pelicun.csv"),
    }
    assert all(isinstance(files, fragility.Written) for files in written.values())
    try:
        fragility.read_pelicun("target.csv")
    except fragility.ExchangeError as error:
        refused = str(error)
    return {
        "ids": {name: files.ids for name, files in written.items()},
        "read_pelicun": fragility.read_pelicun("fragility_pelicun.csv"),
        "refused": refused,
    }


def distributions():
    probabilities, values = np.array([0.05, 0.5, 0.95]), np.array([0.3, 0.6, 0.9])
    continuous = {
        "beta": fragility.Beta(2.0, 3.0),
        "beta_from_moments": fragility.Beta.from_moments(0.9, 0.05),
        "lognormal": fragility.Lognormal(0.6, 0.4),
        "normal": fragility.Normal(0.6, 0.2, 0.0, 1.0),
        "uniform": fragility.Uniform(0.2, 0.8),
        "least": fragility.Least([fragility.Lognormal(0.6, 0.4), fragility.Uniform(0.2, 0.8)]),
    }
    assert all(isinstance(kind, fragility.Distribution) for kind in continuous.values())
    choice = fragility.Categorical(["a", "b"], [0.3, 0.7])
    return {
        name: {"quantile": kind.quantile(probabilities), "below": kind.below(values), "support": kind.support}
        for name, kind in continuous.items()
    } | {"categorical": [choice.quantile(probabilities), choice.labels, choice.shares]}


def uncertainty():
    inputs, response = _inputs(), _response()
    free = fragility.RandomInputs({"e": fragility.Uniform(0.85, 1.0), "alpha_factor": fragility.Uniform(0.9, 1.1)})
    shakes = fragility.uncertain_ida(inputs, SHELF, LAWS, GROUND[:4], LEVELS, samples=6)
    samples = inputs.sample(4, seed=2)
    return {
        "sample": inputs.sample(4, seed=1, method="sobol"),
        "at": inputs.at(np.array([[0.2, 0.8], [0.5, 0.5]])),
        "realise": [block.alpha for block, _ in inputs.realise(SHELF, LAWS[0], samples)],
        "description": [inputs.description, inputs.independent, inputs.names],
        "response": response(samples),
        "uncertain_ida": shakes,
        "sobol_indices": fragility.sobol_indices(free, response, 8, replicates=20),
        "tornado": fragility.tornado(free, response),
        "capacity_variance_shares": fragility.capacity_variance_shares(shakes),
        "variance_shares": fragility.variance_shares(
            xr.DataArray([[0.0, 1.0], [3.0, 4.5]], dims=("motion", "model")), ("motion", "model")
        ),
    }


def screening():
    screened = fragility.screen(_runs(), GROUND, 0.3)
    squat = tp.Block(1.0, 0.8, name="plinth")
    return {
        "screen": screened,
        "notes": fragility.notes(screened),
        "block_notes": fragility.block_notes([SHELF, squat]),
    }


def chunks():
    motions = tuple(tp.motions.records(GROUND[:2]))
    oscillators = [law.oscillator(SHELF) for law in LAWS]
    factors = np.array([[[1.0, 2.0], [2.0, 4.0], [4.0, 8.0]]])
    work = fragility.Work(oscillators, motions, factors)
    planned = fragility.plan_chunks(work)
    assert all(isinstance(chunk, fragility.Chunk) for chunk in planned)
    return {
        "plan_chunks": planned,
        "run_chunk": [fragility.run_chunk(work, chunk).results for chunk in planned],
        "factors_of": [work.factors_of(chunk) for chunk in planned],
        "runs_of": [work.runs_of(chunk) for chunk in planned],
        "work": [work.levels, work.runs],
    }
