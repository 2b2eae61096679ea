"""Results of every law at every value of delta or e: curves, differences from a reference."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
import xarray as xr

from ...core.elementary import Array, Flags, Index, exp, log, times
from ...core.units import ENDS, HERTZ, described, of_end
from ...core.wording import given_percent
from ...fragility import binomial_interval, fit_fragility, overturning_probability
from ...fragility.fitting.bootstrap import draw_clusters, percentile_interval
from ...fragility.numerics.slabs import Allocator, gathered, in_memory
from ...fragility.runs.labels import OF_LAWS
from ...fragility.runs.provenance import number_of_motions, polarity_pairs
from ...models import Block, Law
from ...models.friction import friction_at_impact
from ..file.uncertainty import RIGID, Sweep
from ..plan.risk import without_replicates

NOTHING_FELL, ALL_FELL = "no overturning", "all overturned"


class Curves(NamedTuple):
    """Curves of runs (block, law) and ln medians of replicates: inf if nothing fell, -inf if everything."""

    fit: xr.Dataset
    log_median: Array
    log_samples: Array

    @classmethod
    def of(cls, runs: xr.Dataset, replicates: int, seed: int, confidence: float) -> "Curves":
        """Fit lognormal curves of runs (block, model, level, motion) with bootstrap over motions."""
        fit = gathered(
            lambda part: fit_fragility(part, confidence, replicates=replicates, seed=seed, keep_replicates=True), runs
        )
        status = fit["status"].values
        beyond = np.select([status == NOTHING_FELL, status == ALL_FELL], [np.inf, -np.inf], np.nan)
        middle = log(fit["median"].values)
        samples = log(fit["median_sample"].transpose("block", "model", "replicate").values)
        middle = np.where(np.isnan(middle), beyond, middle)
        lost = np.broadcast_to(beyond[..., None], samples.shape)
        samples = np.where(np.isnan(samples), lost, samples)
        return cls(without_replicates(fit), middle, samples)

    def ratio(self, first: Index, other: Index, confidence: float) -> tuple[Array, Array, Array]:
        """Return medians of laws `first` over medians of `other` (any shape, -1: none), (block, …), with intervals."""
        missing = (first < 0) | (other < 0)
        with np.errstate(invalid="ignore"):
            middle = self.log_median[:, first] - self.log_median[:, other]
            samples = self.log_samples[:, first] - self.log_samples[:, other]
        middle[:, missing] = np.nan
        samples[:, missing] = np.nan
        return exponentials(middle, samples, confidence)


def exponentials(middle: Array, samples: Array, confidence: float) -> tuple[Array, Array, Array]:
    """Return exp of estimates (…) and of percentile intervals of replicates (…, replicate); NaN without an estimate."""
    lower, upper, _ = percentile_interval(samples, confidence)
    known = ~np.isnan(middle)
    return exp(middle), exp(np.where(known, lower, np.nan)), exp(np.where(known, upper, np.nan))


def flipped(flags: Flags, first: Index, other: Index, confidence: float, ways: int = 1) -> tuple[Array, Array, Array]:
    """Return shares (block, …, level) of motions whose flags (block, law, level, motion) differ, with Wilson's ends."""
    missing = (first < 0) | (other < 0)
    counts = np.empty((flags.shape[0], *first.shape, flags.shape[2]), np.int64)
    for block, *where in np.ndindex(*counts.shape[:-1]):
        place = tuple(where)
        counts[(block, *place)] = (flags[block, first[place]] != flags[block, other[place]]).sum(axis=-1)
    share = counts / flags.shape[-1]
    lower, upper = binomial_interval(counts / ways, flags.shape[-1] / ways, confidence)
    for array in (share, lower, upper):
        array[:, missing] = np.nan
    return share, lower, upper


def excess(
    flags: Flags, first: Index, other: Index, pairs: Index, replicates: int, seed: int, confidence: float
) -> tuple[Array, Array, Array]:
    """Return probabilities of laws `first` less `other`, with paired bootstrap intervals, (block, …, level)."""
    weights = draw_clusters(pairs, replicates, seed) / flags.shape[-1]
    missing = (first < 0) | (other < 0)
    shape = (flags.shape[0], *first.shape, flags.shape[2])
    ends = np.full((3, *shape), np.nan)
    tail = 0.5 * (1.0 - confidence)
    for block in range(flags.shape[0]):
        for where in np.ndindex(*first.shape):
            if missing[where]:
                continue
            differs = flags[block, first[where]].astype(np.int8) - flags[block, other[where]]
            ends[(0, block, *where)] = differs.mean(axis=-1)
            samples = times(differs, weights.T)
            # as in percentile_interval, the ends are values of replicates
            ends[(1, block, *where)] = np.quantile(samples, tail, axis=-1, method="lower")
            ends[(2, block, *where)] = np.quantile(samples, 1.0 - tail, axis=-1, method="higher")
    return ends[0], ends[1], ends[2]


def swing(curves: Curves, block: int, laws: Index, confidence: float) -> Array:
    """Return largest over smallest median with its basic interval (of ln), which corrects its bias; ends at least 1."""
    with np.errstate(invalid="ignore"):
        middle = float(np.ptp(curves.log_median[block, laws]))
        samples = np.ptp(curves.log_samples[block, laws], axis=0)
    if not np.isfinite(middle):
        return np.full(3, exp(middle))
    ends = percentile_interval(samples, confidence)
    turned = 2.0 * middle - np.array([ends.upper, ends.lower])
    return exp([middle, *np.maximum(turned, 0.0).tolist()])


def trend(curves: Curves, block: int, laws: Index, x: Array) -> Array:
    """Return the slope of ln median of some laws of a block over x (law,), by least squares: (1 + replicate,)."""
    weights = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    logs = np.concatenate([curves.log_median[block, laws][:, None], curves.log_samples[block, laws]], axis=1)
    with np.errstate(invalid="ignore"):
        return times(weights, logs)


ALL, USUAL = "all", "usual"
DELTA_USUAL = (0.01, 0.1)
"""Values of delta that are in use; the paper recommends 0.05."""
STEPS = {"delta": math.log(10.0), "e": 0.1}
"""Steps that the trend of medians is given for: a tenfold delta, 0.1 more of e."""


class Grid(NamedTuple):
    """Distinct laws with indices `at` (model, value) and, of each comparison, `against`, -1 for none."""

    laws: tuple[Law, ...]
    at: Index
    against: dict[str, Index]

    @classmethod
    def of(cls, at: Sequence[Sequence[Law]], against: Mapping[str, Sequence[Sequence[Law | None]]]) -> Self:
        """Make the grid from the laws and the laws that they are compared with, each (model, value)."""
        known: dict[Law, int] = {}
        for rows in (at, *against.values()):
            for law in (law for row in rows for law in row):
                if law is not None:
                    known.setdefault(law, len(known))

        def places(rows: Sequence[Sequence[Law | None]]) -> Index:
            return np.array([[-1 if law is None else known[law] for law in row] for row in rows], dtype=np.int64)

        return cls(tuple(known), places(at), {name: places(rows) for name, rows in against.items()})


def findings(
    runs: xr.Dataset,
    blocks: Sequence[Block],
    models: Sequence[Law],
    grid: Grid,
    sweep: Sweep,
    array: Allocator = in_memory,
) -> xr.Dataset:
    """Compute all results but the indices, on (block, model, value) and more, from runs of `grid.laws`."""
    confidence = sweep.confidence
    curves = Curves.of(runs[["overturned"]], sweep.replicates, sweep.seed, confidence)
    flags = runs["overturned"].transpose("block", "model", "level", "motion").values
    pairs, ways = polarity_pairs(runs), flags.shape[-1] // number_of_motions(runs)
    names = list(grid.against)
    variables: dict[str, Any] = {
        name: _of_every_run(runs[name], grid.at, array) for name in ("overturned", "peak_rotation", "uplifted")
    }
    observed = overturning_probability(runs, confidence)
    variables |= {str(name): _placed(variable, grid.at) for name, variable in observed.data_vars.items()}
    variables |= {str(name): _placed(variable, grid.at) for name, variable in curves.fit.data_vars.items()}

    def compared(what: str, on: tuple[str, ...], parts: list[tuple[Array, Array, Array]], text: str) -> None:
        dims = ("block", "model", "value", *on, "comparison")
        for i, suffix in enumerate(ENDS):
            long_name = (
                text if not suffix else f"{suffix[1:]} end of the {given_percent(confidence)} interval of the {text}"
            )
            variables[f"{what}{suffix}"] = (dims, np.stack([part[i] for part in parts], axis=-1), described(long_name))

    others = [grid.against[name] for name in names]
    compared(
        "median_ratio",
        (),
        [curves.ratio(grid.at, other, confidence) for other in others],
        "median over that of what it is held against",
    )
    compared(
        "flipped",
        ("level",),
        [flipped(flags, grid.at, other, confidence, ways) for other in others],
        "share of motions whose flag differs from what it is held against",
    )
    compared(
        "excess",
        ("level",),
        [excess(flags, grid.at, other, pairs, sweep.replicates, sweep.seed, confidence) for other in others],
        "probability of overturning less that of what it is held against",
    )
    variables |= _sensitivity(curves, blocks, grid, sweep)
    return xr.Dataset(variables, coords=_coordinates(runs, blocks, models, grid, sweep), attrs=_attributes(runs, sweep))


def placed_screen(screened: xr.Dataset, grid: Grid) -> xr.Dataset:
    """Return the screen of the runs of `grid.laws` on (block, model, value), without its coordinates."""
    of_laws = screened.drop_vars(["friction_impact", "elastic_frequency", "model"])
    return of_laws.map(
        lambda array: xr.DataArray(_placed(array, grid.at)) if "model" in array.dims else array, keep_attrs=True
    )


def usual(blocks: Sequence[Block], sweep: Sweep) -> Flags:
    """True for usual values (block, value): delta of 0.01 to 0.1; e that needs no more friction than there is."""
    if sweep.parameter == "delta":
        low, high = DELTA_USUAL
        return np.tile((sweep.values >= low * (1.0 - 1e-9)) & (sweep.values <= high * (1.0 + 1e-9)), (len(blocks), 1))
    ratio = np.array([block.h / block.b for block in blocks])
    return np.asarray(friction_at_impact(ratio[:, None], sweep.values[None]) <= sweep.friction)


def _sensitivity(curves: Curves, blocks: Sequence[Block], grid: Grid, sweep: Sweep) -> dict[str, Any]:
    """Compute swing and trend of the medians, over all values and over the usual values."""
    swings, slopes = swings_and_slopes(curves, blocks, grid, sweep)
    trends = exponentials(slopes[..., 0], slopes[..., 1:], sweep.confidence)
    step = "a tenfold delta" if sweep.parameter == "delta" else "0.1 more of e"
    variables: dict[str, Any] = {}
    for name, parts, text in (
        ("median_swing", swings, "largest over smallest median"),
        ("median_trend", trends, f"factor on the median of {step}"),
    ):
        for end, part in zip(ENDS, parts, strict=True):
            long_name = of_end(end, text, sweep.confidence)
            variables[f"{name}{end}"] = (("block", "model", "span"), part, described(long_name))
    return variables


def swings_and_slopes(curves: Curves, blocks: Sequence[Block], grid: Grid, sweep: Sweep) -> tuple[Array, Array]:
    """Return swings of medians with intervals (3, block, model, span), and slopes of ln medians with replicates."""
    spans = [np.ones((len(blocks), sweep.values.size), dtype=bool), usual(blocks, sweep)]
    shape = (len(blocks), len(grid.at), len(spans))
    swings = np.full((3, *shape), np.nan)
    slopes = np.full((*shape, 1 + sweep.replicates), np.nan)
    x = log(sweep.values) if sweep.parameter == "delta" else sweep.values
    for i, j, s in np.ndindex(*shape):
        inside = np.flatnonzero(spans[s][i])
        if inside.size > 1:
            laws = grid.at[j, inside]
            swings[:, i, j, s] = swing(curves, i, laws, sweep.confidence)
            slopes[i, j, s] = trend(curves, i, laws, x[inside]) * STEPS[sweep.parameter]
    return swings, slopes


def _placed(array: xr.DataArray, at: Index) -> xr.DataArray:
    """Expand an array on (block, model) of the distinct laws to (block, model, value)."""
    bare = array.drop_vars([name for name, coordinate in array.coords.items() if "model" in coordinate.dims])
    placed = bare.isel(model=xr.DataArray(at, dims=("row", "value"))).rename(row="model")
    return placed.transpose("block", "model", "value", ...)


def _of_every_run(runs: xr.DataArray, at: Index, array: Allocator) -> xr.Variable:
    """Expand results of the distinct laws to (block, model, value, level, motion)."""
    dims = ("block", "model", "level", "motion")
    values = runs.transpose(*dims).values
    values_of = array((values.shape[0], *at.shape, *values.shape[2:]), values.dtype)
    for block, j, k in np.ndindex(*values_of.shape[:3]):
        values_of[block, j, k] = values[block, at[j, k]]
    return xr.Variable(("block", "model", "value", "level", "motion"), values_of, runs.attrs)


def _coordinates(
    runs: xr.Dataset, blocks: Sequence[Block], models: Sequence[Law], grid: Grid, sweep: Sweep
) -> dict[str, Any]:
    """Return the labels with their numbers, the friction that an impact needs, and the elastic modes."""
    kept = {
        str(name): coordinate.variable for name, coordinate in runs.coords.items() if "model" not in coordinate.dims
    }
    token = {"delta": "δ=", "e": "e="}[sweep.parameter]
    labels = [" ".join(part for part in law.label.split() if not part.startswith(token)) for law in models]
    e = np.array([[[grid.laws[i].restitution(block) or np.nan for i in row] for row in grid.at] for block in blocks])
    rigid = np.array([[[grid.laws[i].restitution(b) for i in row] for row in grid.against[RIGID]] for b in blocks])
    delta = np.array([[getattr(grid.laws[i], "delta", np.nan) for i in row] for row in grid.at])
    rest = np.array([law.options.get("rest", "elastic" if "delta" in law.options else "rigid") for law in models])
    ratio = np.array([block.h / block.b for block in blocks])
    p = np.array([block.p for block in blocks])
    flat = np.array([np.sin(block.alpha) / block.alpha for block in blocks])
    mode = p[:, None, None] * np.sqrt((1.0 / delta - 1.0) * flat[:, None, None]) / (2.0 * np.pi)
    mode = np.where((rest == "elastic")[:, None], mode, np.nan)
    names = {"delta": f"{OF_LAWS['delta']}, δ", "e": "coefficient of restitution, e"}
    on = ("block", "model", "value")
    return {
        **kept,
        "model": ("model", np.array(labels, dtype=object), described("damping law")),
        "law": ("model", np.array([law.law for law in models], dtype=object), described("short name of the law")),
        "rest": ("model", rest.astype(object), described("elastic zone at rest, or rigid")),
        "value": ("value", sweep.values, described(names[sweep.parameter])),
        "comparison": (
            "comparison",
            np.array(list(grid.against), dtype=object),
            described("what a value is held against"),
        ),
        "span": ("span", np.array([ALL, USUAL], dtype=object), described("which values")),
        "in_use": (("block", "value"), usual(blocks, sweep), described("whether the value is a usual one")),
        "e": (on, e, described("coefficient of restitution used; NaN of laws without")),
        "rigid_e": (on, rigid, described("coefficient of restitution of the rigid block beside it")),
        "delta": (("model", "value"), delta, described(f"{OF_LAWS['delta']}; NaN without")),
        "friction_impact": (
            ("block", "model", "value"),
            friction_at_impact(ratio[:, None, None], rigid),
            described("coefficient of friction that an impact needs"),
        ),
        "elastic_frequency": (on, mode, described("frequency of the elastic mode at rest", HERTZ)),
    }


def _attributes(runs: xr.Dataset, sweep: Sweep) -> dict[str, Any]:
    """Return the attributes: the varied parameter and the options of its evaluation."""
    low, high = DELTA_USUAL
    friction = f"values of e that need a friction coefficient of at most {sweep.friction:g}"
    return {
        **runs.attrs,
        "parameter": sweep.parameter,
        "reference": sweep.reference if isinstance(sweep.reference, str) else f"{sweep.reference:g}",
        "usual": f"δ from {low:g} to {high:g}" if sweep.parameter == "delta" else friction,
        "friction": sweep.friction,
        "confidence": sweep.confidence,
        "replicates": sweep.replicates,
        "state": "overturning",
    }
