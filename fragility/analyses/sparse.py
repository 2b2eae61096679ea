"""Runs at levels of their own as one dataset: a line for every run, and adaptive results for every curve."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array, Index
from ...core.parameters import USUAL_CONFIDENCE
from ...core.units import DIMENSIONLESS, ENDS, PER_YEAR, described, of_end, provenance
from ...models.outputs import OUTPUTS
from ...motions.arrays import BOTH_AXES, motion_coordinates
from ...motions.intensity.evaluation import measure_variables
from ...motions.intensity.naming import GROUND, measure_named
from ..adaptive.rate import weighted_samples
from ..adaptive.sequential import SequentialCurve, account, half_width
from ..adaptive.stopping import reason_text
from ..adaptive.until import MEDIAN, PROBABILITY, RATE
from ..fitting.bootstrap import draw_motions
from ..fitting.states import OVERTURNED, State, flags_of, needed_output
from ..runs.labels import OF_ACCOUNT, OF_DISPERSION, OF_MEDIAN, OF_STOP, depth_coordinate
from ..runs.provenance import AXES, RUN, clusters_of, configuration_of, curves_of
from ..runs.request import Request, part_of
from ..runs.scaling import BlockMeasure, name_at
from ..surfaces.gain import gain_words
from ..validity.screen import with_screen
from ..validity.slab_screen import ScreenRequest
from ..validity.sparse_screen import Shaken, sparse_screen
from .analysis import OF_WIDTH, specimens_of, with_words
from .friction_draws import FRICTION
from .other_measures import OtherMeasures
from .waves import MotionWave, Rows, Scaled


class WaveRuns(NamedTuple):
    """The runs of one wave.

    `runs`: arrays (run,) by name. `motions`: their coordinates. `long_name`: of the levels' measure. `axes`: axes of
    the motions.
    """

    runs: dict[str, NDArray[Any]]
    motions: xr.Dataset
    long_name: str
    axes: str


def runs_of(
    number: int,
    first: int,
    wave: MotionWave,
    rows: Rows,
    outputs: Mapping[str, NDArray[Any]],
    scaled: Scaled,
    measured: Array,
    axes: str,
) -> WaveRuns:
    """Return the runs of a wave with their outputs (run,).

    `number` counts the waves from 0, and `first` the records before this one.  `measured` (block or 1, motion) is the
    measure of the unscaled motions.
    """
    runs = {
        "run_block": rows.block,
        "run_model": rows.model,
        "run_motion": first + rows.motion,
        "wave": np.full(rows.level.size, number),
        "level": rows.level,
        **outputs,
    }
    peaks = measure_variables(wave.records, [measure_named("pga")])
    if axes == BOTH_AXES:
        peaks = {name: with_words(peak, OF_WIDTH) for name, peak in peaks.items()}
    coordinates: dict[str, xr.Variable] = {**motion_coordinates(list(wave.records)), **peaks}
    long_name = name_at(scaled.long_name, wave.records, wave.ground)
    if scaled.intensity is not None:
        values = measured if isinstance(scaled.intensity, BlockMeasure) else measured[0]
        name = scaled.name if wave.ground is None else f"{GROUND}_{scaled.name}"
        attributes = described(long_name, scaled.units)
        coordinates[name] = xr.Variable(("motion",) if values.ndim == 1 else ("block", "motion"), values, attributes)
    return WaveRuns(runs, xr.Dataset(coords=coordinates), long_name, axes)


_RUNS = {
    "run_block": "block of the run, as block_number",
    "run_model": "law of the run, as model_number",
    "run_motion": "motion of the run, as motion_number",
    "wave": "wave in which the run was made, from 0",
    FRICTION: "static coefficient of friction of the run",
}


def labelled(
    request: Request,
    waves: Sequence[WaveRuns],
    scaled: Scaled,
    configuration: Mapping[str, Any],
    title: str,
    state: str | None = None,
) -> xr.Dataset:
    """Return runs as a dataset; `state`: the name of a damage state, other than overturning, that levels are for."""
    variables: dict[str, xr.Variable] = {}
    for name in waves[0].runs:
        if name == "level":
            attributes = {"units": scaled.units, "long_name": waves[0].long_name, "im": scaled.name}
        elif name == "weight":
            came = "overturned" if state is None else f"reached {state}"
            text = f"annual rate that the run stands for if its block {came}, over the number of motions"
            attributes = described(text, PER_YEAR)
        elif name in _RUNS:
            attributes = described(_RUNS[name])
        else:
            attributes = OUTPUTS[name].attributes
        variables[name] = xr.Variable(RUN, np.concatenate([wave.runs[name] for wave in waves]), attributes)
    specimens = specimens_of(request)
    motions = xr.concat([wave.motions for wave in waves], "motion", coords="minimal", compat="override")
    coordinates = {
        **specimens.coordinates,
        **numbers("block", len(request.blocks)),
        **numbers("model", len(request.models)),
        **numbers("motion", motions.sizes["motion"]),
        **(depth_coordinate(request.blocks) if waves[0].axes else {}),
        **{str(name): coordinate.variable for name, coordinate in motions.coords.items()},
    }
    described_configuration = provenance({**specimens.configuration, **configuration})
    attributes = {"title": title, "design": configuration["design"], "im": scaled.name, **described_configuration}
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def with_estimates(
    runs: xr.Dataset, curves: Sequence[SequentialCurve], other_measures: OtherMeasures, state: str | None
) -> xr.Dataset:
    """Add to runs the estimates of each curve, and the better measures; the attribute `state` if not overturning."""
    until, shape = curves[0].until, (runs.sizes["block"], runs.sizes["model"])
    gains = [other_measures.gains(curve.seen) for curve in curves]
    # (of other answers the scatter of capacities does not say how many motions they take)
    offers = [gain_words(other_measures.labels, gain) if until.target == MEDIAN else "" for gain in gains]
    ratios = other_measures.variables(gains, ("block", "model"), shape)
    estimated = runs.assign(curve_variables(curves, runs, offers, state))
    return (
        estimated.assign({str(name): variable.variable for name, variable in ratios.data_vars.items()})
        .assign_coords({str(name): coordinate.variable for name, coordinate in ratios.coords.items()})
        .assign_attrs(
            until=json.dumps(until.describe()),
            **({} if state is None else {"state": state}),
            stopped_because="; ".join(dict.fromkeys(reason_text(curve.stopped, state) for curve in curves)),
        )
    )


def with_sparse_screen(runs: xr.Dataset, request: Request, shaken: Shaken, asked: ScreenRequest) -> xr.Dataset:
    """Add to runs the variables of their screen, if requested."""
    if not request.screen:
        return runs
    about = 2 if configuration_of(runs).get(AXES) == BOTH_AXES else 1
    progress = part_of(request.progress, about * runs.sizes[RUN])
    return with_screen(runs, sparse_screen(runs, shaken, asked, request.runner, progress))


def numbers(dim: str, n: int) -> dict[str, xr.Variable]:
    """Return the coordinate of numbers from 0 by which runs name their block, law and motion, also of a selection."""
    text = f"number from 0 by which runs name their {'law' if dim == 'model' else dim} (run_{dim})"
    return {f"{dim}_number": xr.Variable(dim, np.arange(n), described(text))}


def curve_variables(
    curves: Sequence[SequentialCurve], runs: xr.Dataset, offers: Sequence[str], state: str | None = None
) -> dict[str, xr.Variable]:
    """Return the estimates of every curve, on (block, model), and the half width at every look.

    offers (curve,): clauses on better measures, empty if there is none. state: the name of a damage state other than
    overturning.
    """
    unit, measure = (runs["level"].attrs[name] for name in ("units", "long_name"))
    shape = runs.sizes["block"], runs.sizes["model"]
    of, half = ("overturning", "half overturn") if state is None else (state, f"half reach {state}")

    def interval(name: str, ends: Iterable[Sequence[float]], units: str, text: str) -> dict[str, Any]:
        named = zip(ENDS, zip(*ends, strict=True), strict=True)
        return {f"{name}{end}": (values, units, of_end(end, text, USUAL_CONFIDENCE)) for end, values in named}

    looks = [curve.looks[-1] for curve in curves]
    near = f"level at which {half}, from levels near it: {measure}"
    columns = {
        **interval("half_level", [_ends(look.local) for look in looks], unit, near),
        **interval("median", [_ends(look.curve) for look in looks], unit, f"{OF_MEDIAN}: {measure}"),
        **interval("dispersion", [_ends(look.log_dispersion) for look in looks], DIMENSIONLESS, OF_DISPERSION),
    }
    target = curves[0].until.target
    asked = [(look.value, look.lower, look.upper) for look in looks]
    if target == RATE:
        columns |= interval("rate", asked, PER_YEAR, f"annual rate of {of}, from weighted runs without a form of curve")
        fitted = [curve.fitted_rate() for curve in curves]
        rates = [math.nan if rate is None else rate.value for rate in fitted]
        differ = [curve.rate_misfit() for curve in curves]
        text = "rate of the curve over that without one, less 1; 0 within error"
        columns |= {
            "rate_of_curve": (rates, PER_YEAR, f"annual rate of {of}, of the lognormal curve through all runs"),
            "rate_misfit": (differ, DIMENSIONLESS, text),
        }
    if target == PROBABILITY:
        columns |= interval("probability", asked, DIMENSIONLESS, f"probability of {of} at the level asked for")
    misfits = [math.expm1(-look.misfit) for look in looks]
    widths = [half_width(curve, look.ratio) for curve, look in zip(curves, looks, strict=True)]
    accounts = [
        "; ".join(part for part in (account(curve, state), offer) if part)
        for curve, offer in zip(curves, offers, strict=True)
    ]
    width = "half width of the 95 % interval asked for, in the terms of until"
    columns |= {
        "misfit": (misfits, DIMENSIONLESS, "median over half_level, less 1; 0 within twice its error"),
        "motions_run": ([look.motions for look in looks], DIMENSIONLESS, "motions that the block was run under"),
        "half_width": (widths, DIMENSIONLESS, width),
        "stopped_because": ([reason_text(curve.stopped, state) for curve in curves], DIMENSIONLESS, OF_STOP),
        "account": (accounts, DIMENSIONLESS, OF_ACCOUNT),
    }
    variables = {}
    for name, (values, units, text) in columns.items():
        array = np.array(values, dtype=object if isinstance(values[0], str) else None).reshape(shape)
        variables[name] = xr.Variable(("block", "model"), array, described(text, units))
    return variables | look_variables(curves, shape)


def look_variables(curves: Sequence[SequentialCurve], shape: tuple[int, int]) -> dict[str, xr.Variable]:
    """Return the half width of every curve at every look, NaN after it stopped, and the motions until then."""
    longest = max((curve.looks for curve in curves), key=len)
    widths = np.full((len(curves), len(longest)), math.nan)
    for row, curve in zip(widths, curves, strict=True):
        row[: len(curve.looks)] = [half_width(curve, look.ratio) for look in curve.looks]
    text = "half width of the 95 % interval after each wave, in the terms of until"
    motions: Index = np.array([look.motions for look in longest], dtype=np.int64)
    return {
        "look_half_width": xr.Variable(("block", "model", "look"), widths.reshape(*shape, -1), described(text)),
        "look_motions": xr.Variable("look", motions, described("motions until the look")),
    }


def _ends(estimate: Any) -> tuple[float, float, float]:
    """Return an estimate of a logarithm and its interval, without the logarithm; NaN if there is none."""
    if estimate is None or not math.isfinite(estimate.reach):
        return (math.nan,) * 3
    value, reach = estimate.value, estimate.reach
    return math.exp(value), math.exp(value - reach), math.exp(min(value + reach, 700.0))


def weighted_rate_samples(runs: xr.Dataset, replicates: int, seed: int = 0, state: State = OVERTURNED) -> xr.DataArray:
    """Return the annual rates (block, model, replicate), 1/year, of replicates of runs whose levels a hazard drew.

    The rate of a replicate is the mean over its motions of the weights of their runs that reached the state
    (`fragility.adaptive.rate`), without a form of curve. A possible rate below the lowest falls is not in the
    replicates, but in the interval of the rate itself. A replicate of the same seed draws the same motions as in
    `fit_fragility`.
    """
    if "weight" not in runs or RUN not in runs["weight"].dims:
        raise ValueError("rates without a form of curve need the weights of runs at adaptive levels, until a rate")
    clusters = clusters_of(runs)
    drawn = draw_motions((np.arange(clusters.max() + 1),), replicates, seed)
    verdicts = runs[needed_output(state)].values
    alpha = runs["alpha"].values if "alpha" in runs.coords else np.full(runs.sizes["block"], math.nan)
    rates = np.empty((runs.sizes["block"], runs.sizes["model"], replicates))
    for i, j, rows, motions in curves_of(runs):
        fell = np.asarray(flags_of(verdicts[rows], state, float(alpha[i])), dtype=np.bool_)
        rates[i, j] = weighted_samples(runs["weight"].values[rows], fell, clusters[motions], drawn)
    text = "annual rate of each replicate, from weighted runs without a form of curve"
    return xr.DataArray(
        rates,
        {"block": runs["block"].variable, "model": runs["model"].variable},
        ("block", "model", "replicate"),
        attrs=described(text, PER_YEAR),
    )
