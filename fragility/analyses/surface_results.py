"""Results of a pooled analysis: the surfaces as a dataset, and from it the curves of blocks."""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, arctan, exp, log, tan
from ...core.facts import Fact
from ...core.parameters import USUAL_CONFIDENCE
from ...core.sentences import register_of, sentence
from ...core.units import (
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    ENDS,
    PER_YEAR,
    RADIAN,
    STANDARD_GRAVITY,
    described,
    of_end,
    variables as variables_on,
)
from ...models import Block
from ...models.block_array import BlockArray
from ..adaptive.stopping import REACHED, motions_needed
from ..hazard.curve import HazardCurve
from ..runs.labels import OF_ACCOUNT, OF_BLOCKS, OF_DISPERSION, OF_LAWS, OF_MEDIAN, OF_STOP, law_coordinates
from ..runs.provenance import coordinates_on
from ..surfaces.checks import Check, RatePlane
from ..surfaces.domain import NARROW, Domain
from ..surfaces.evaluation import Curves, LawSurfaces, curves_at
from ..surfaces.gain import gain_words
from ..surfaces.sequential import FIRM, PooledCurves
from ..surfaces.surface import Cut, Surface
from ..validity.notes import TEMPLATES
from .region_runs import PooledPlan, PooledRuns, own_options

POOLED = "pooled"
"""Name of the design."""


def surface_curves(
    surface: xr.Dataset, blocks: Block | Sequence[Block] | BlockArray, hazard: HazardCurve | None = None
) -> xr.Dataset:
    """Return the curves of blocks from the surfaces of a pooled analysis.

    Parameters
    ----------
    surface : xarray.Dataset
        Result of `pooled`.
    blocks : Block, sequence of them, or BlockArray
        Free-standing blocks in the region of the analysis.
    hazard : HazardCurve, optional
        Hazard curve of the analysis, for annual rates.

    Returns
    -------
    xarray.Dataset
        The variables of `pooled` on (block, model).
    """
    if not isinstance(surface, xr.Dataset) or surface.attrs.get("design") != POOLED:
        raise ValueError("surface must be a result of toppling.fragility.pooled")
    checks.plain("surface", surface)
    columns = BlockArray.of(blocks)
    if hazard is not None and not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve, got {checks.kind(hazard)}")
    if "model" not in surface.dims:
        raise ValueError("surface must keep its dimension model: select laws with a list, isel(model=[0])")
    if hazard is not None and json.dumps(hazard.describe()) != surface.attrs.get("hazard"):
        raise ValueError("hazard must be that of the analysis, on which its check of rates depends")
    options = json.loads(surface.attrs["own"])
    if list(columns.own) != options:
        having = " and ".join(options) or "neither e nor delta"
        raise ValueError(f"blocks must have {having} of their own, as those of the analysis")
    domain = Domain(*(surface[f"region_{name}"].values for name in Domain._fields))
    points = domain.points(variables_of(columns))
    inside = domain.holds(points)
    if not inside.all():
        first = int(np.argmin(inside))
        rest = int((~inside).sum()) - 1
        which = f"{str(columns.names[first])!r:.80} " + (f"and {rest:,} more are" if rest else "is")
        raise ValueError(f"{which} outside the region of the blocks of the analysis, where its surfaces say nothing")
    log_unit = float(surface.attrs["power"]) * log(STANDARD_GRAVITY * tan(columns.alpha))
    pieces = None if hazard is None else hazard.pieces()[0]
    curves = [
        curves_at(_law_surfaces(surface, i, domain.size), points, log_unit, pieces)
        for i in range(surface.sizes["model"])
    ]
    return _curve_dataset(columns, curves, surface, hazard is not None)


def variables_of(columns: BlockArray) -> Array:
    """Return ln p, ln tan(alpha), the inertia factor, and own e and ln delta of blocks, (block, variable)."""
    options = [log(values) if name == "delta" else values for name, values in columns.own.items()]
    return np.stack([log(columns.p), log(tan(columns.alpha)), columns.inertia, *options], axis=1)


def surface_dataset(
    plan: PooledPlan, runs: PooledRuns, known: Sequence[LawSurfaces], checked: Sequence[Check]
) -> xr.Dataset:
    """Return the surfaces, their checks and the runs as a dataset."""
    variables: dict[str, xr.Variable] = {}
    dims = {
        "middle": ("variable",),
        "axes": ("variable", "region_axis"),
        "back": ("region_axis", "variable"),
        "vertices": ("vertex", "region_axis"),
        "inside": ("face", "face_term"),
    }
    for name, dim in dims.items():
        text = f"region of the blocks in ln p, ln tan(alpha), inertia factor, and own e and ln delta: {name}"
        variables[f"region_{name}"] = xr.Variable(dim, getattr(plan.domain, name), described(text))
    for kind in ("near", "curve"):
        surfaces: list[Surface] = [getattr(surfaces, kind) for surfaces in known]
        most = max(len(surface.coefficients) for surface in surfaces)
        coefficients, covariance = np.full((len(known), most), np.nan), np.full((len(known), most, most), np.nan)
        for i, surface in enumerate(surfaces):
            n = len(surface.coefficients)
            coefficients[i, :n], covariance[i, :n, :n] = surface.coefficients, surface.covariance
        term = f"{kind}_term"
        near = kind == "near"
        which, spread = ("runs near the medians", " (of all runs, times a factor)") if near else ("all runs", "")
        for name, array, on, text in (
            ("coefficients", coefficients, ("model", term), f"of ln median, then of ln dispersion{spread}"),
            ("covariance", covariance, ("model", term, f"{term}_too"), "of the coefficients"),
            ("degrees", [each.degrees for each in surfaces], ("model", "degree_of"), "of ln median, of ln dispersion"),
            ("motions", [each.motions for each in surfaces], ("model",), "number of motions"),
        ):
            long_name = f"surface of {which}: {name} {text}" if name != "motions" else f"{text} of the surface"
            variables[f"{kind}_{name}"] = xr.Variable(on, array, described(long_name))
    variables |= _cut_variables([surfaces.near.cut for surfaces in known], plan.domain.size)
    reaches = [math.expm1(law.band().reach + surfaces.apart) for law, surfaces in zip(runs.laws, known, strict=True)]
    gains = [runs.others.gains(law.centred) for law in runs.laws]
    offers = [gain_words(runs.others.labels, gain) for gain in gains]
    accounts = [_account(plan, *parts) for parts in zip(runs.laws, known, checked, reaches, offers, strict=True)]
    of_laws: dict[str, tuple[list[Any], str]] = {
        "band_factor": ([law.factor for law in known], "standard errors within which all medians lie at once"),
        "lack_of_fit": ([math.expm1(law.apart) for law in known], "share by which checks differ beyond chance"),
        "check_p_value": ([check.p_value for check in checked], "chance of differences as large as the check's"),
        "motions_run": ([law.motions for law in runs.laws], "motions of the surface"),
        "half_width": (reaches, "half width of the widest interval of a median, as a share"),
        "stopped_because": ([law.stopped for law in runs.laws], OF_STOP),
        "account": (accounts, OF_ACCOUNT),
    }
    for name, (values, text) in of_laws.items():
        dtype = object if isinstance(values[0], str) else None
        variables[name] = xr.Variable("model", np.array(values, dtype), described(text))
    if plan.hazard is not None:
        variables |= _rate_variables(known, plan.domain.size + 1)
    variables |= _check_variables(plan, checked) | _run_variables(plan, runs)
    # (curves of further blocks need them)
    attributes = {
        "until": json.dumps(plan.until.describe()),
        "own": json.dumps(plan.varied),
        "power": plan.power,
        "level_units": plan.scaled.units,
        "level_name": runs.level_name,
        **({} if plan.hazard is None else {"hazard": json.dumps(plan.hazard.describe())}),
    }
    surfaces_found = xr.Dataset(variables, coords=_law_coordinates(plan), attrs=attributes)
    return surfaces_found.merge(runs.others.variables(gains, ("model",), (len(gains),)))


def _account(plan: PooledPlan, law: PooledCurves, known: LawSurfaces, check: Check, reach: float, offer: str) -> str:
    """Return the reason why a law has stopped, the reached precision, the result of the check, and a better measure."""
    motions, ratio = law.ratios[-1]
    # (what the check adds to the intervals does not fall with the number of motions)
    missed = law.stopped != REACHED and not known.apart
    needed = motions_needed(motions, ratio, FIRM) if missed else 0
    more = {
        "motions": law.motions,
        "tolerance": plan.until.tolerance,
        "stopped": "" if law.stopped == REACHED else law.stopped,
        "needed": needed if needed > motions else 0,
        "precise": ratio <= 1.0,
        "blocks": check.difference.size,
        "apart": math.expm1(known.apart),
        "error": float(np.sqrt(np.mean(check.error**2))) if check.error.size else math.nan,
        "cut": None if known.near.cut is None else _place_of(plan, known.near.cut),
        "offer": offer,
    }
    fact = Fact("pooled.account", reach, more=more)
    return sentence(fact.what, fact, [register_of(TEMPLATES, "pooled")])


def _place_of(plan: PooledPlan, cut: Cut) -> dict[str, Any]:
    """Return name, unit, place and ends of the cut of the region, in the terms of its blocks."""
    domain = plan.domain
    k = next(i for i in range(domain.back.shape[1]) if np.array_equal(domain.back[:, i], cut.normal))
    low, place, high = (float(domain.middle[k]) + shift for shift in (cut.low, cut.place, cut.high))
    option = plan.varied[k - 3] if k >= 3 else ""
    if k == 0 and float(np.sqrt((domain.back[:, 2] ** 2).sum())) < NARROW:
        # with one inertia factor the frequency gives the size
        inertia = float(domain.middle[2])
        high, place, low = (STANDARD_GRAVITY / (inertia * math.exp(2.0 * log_p)) for log_p in (low, place, high))
        name, unit = "a size R", " m"
    elif k in {0, 1} or option == "delta":
        low, place, high = (math.exp(log_value) for log_value in (low, place, high))
        name, unit = {0: ("a frequency p", " 1/s"), 1: ("tan α", "")}.get(k, ("δ", ""))
    else:
        name, unit = ("an inertia factor" if k == 2 else option), ""
    return {"name": name, "unit": unit, "low": low, "place": place, "high": high}


def _cut_variables(cuts: Sequence[Cut | None], axes: int) -> dict[str, xr.Variable]:
    """Return the places of the surfaces' jumps, NaN for laws without a jump; nothing without any."""
    if all(cut is None for cut in cuts):
        return {}
    none = np.full(axes, np.nan)
    normal = np.array([none if cut is None else cut.normal for cut in cuts])
    places = np.array([[math.nan] * 3 if cut is None else [cut.place, cut.low, cut.high] for cut in cuts])
    beyond = "where the surfaces jump: blocks beyond have point @ normal >= place"
    return {
        "cut_normal": xr.Variable(("model", "region_axis"), normal, described(f"{beyond}: normal")),
        "cut_places": xr.Variable(("model", "place"), places, described(f"{beyond}: place, lowest, highest")),
    }


def _rate_variables(known: Sequence[LawSurfaces], terms: int) -> dict[str, xr.Variable]:
    """Return the planes that correct rates of curves to rates without a form, NaN without a plane."""
    none = RatePlane(np.full(terms, np.nan), np.full((terms, terms), np.nan), math.nan)
    planes = [none if surfaces.rates is None else surfaces.rates for surfaces in known]
    labels = {
        "coefficients": (("model", "rate_term"), "plane of ln ratios of rates without a form to those of curves"),
        "covariance": (("model", "rate_term", "rate_term_too"), "covariance of the coefficients of that plane"),
        "apart": (("model",), "ln ratio by which single blocks differ from that plane beyond chance"),
    }
    return {
        f"rate_{name}": xr.Variable(dims, np.array([getattr(plane, name) for plane in planes]), described(text))
        for name, (dims, text) in labels.items()
    }


def _check_variables(plan: PooledPlan, checked: Sequence[Check]) -> dict[str, xr.Variable]:
    most = max(check.difference.size for check in checked)
    shape = len(checked), most
    columns = {name: np.full(shape, np.nan) for name in ("difference", "error", "p", "alpha", *plan.varied)}
    for i, check in enumerate(checked):
        log_p, log_tan = plan.domain.variables(check.points)[:, :2].T
        options = own_options(plan.domain, check.points, plan.varied)
        values = {name: np.array([option[name] for option in options]) for name in plan.varied}
        values |= {"difference": check.difference, "error": check.error, "p": exp(log_p), "alpha": arctan(exp(log_tan))}
        for name, array in values.items():
            columns[name][i, : check.difference.size] = array
    labels = {
        "difference": (DIMENSIONLESS, "ln median of a block from runs of its own, less that of the surface"),
        "error": (DIMENSIONLESS, "standard error of the difference"),
        "p": (ANGULAR_VELOCITY, f"{OF_BLOCKS['p'][1]} of the block"),
        "alpha": (RADIAN, f"{OF_BLOCKS['alpha'][1]} of the block"),
        **{name: (DIMENSIONLESS, f"{_OWN[name]} of the block") for name in plan.varied},
    }
    return {
        f"check_{name}": xr.Variable(("model", "check"), columns[name], described(text, units))
        for name, (units, text) in labels.items()
    }


def _run_variables(plan: PooledPlan, runs: PooledRuns) -> dict[str, xr.Variable]:
    pools = [law.runs for law in runs.laws]
    points = np.concatenate([pool.points for pool in pools])
    log_p, log_tan, inertia = plan.domain.variables(points)[:, :3].T
    options = own_options(plan.domain, points, plan.varied)
    unit = plan.power * (math.log(STANDARD_GRAVITY) + log_tan)
    model = np.repeat(np.arange(len(pools)), [pool.x.size for pool in pools])
    labels: dict[str, tuple[Any, str, str]] = {
        "run_model": (model, DIMENSIONLESS, "law of the run, from 0"),
        "run_motion": (np.concatenate([pool.motion for pool in pools]), DIMENSIONLESS, "number of its motion, from 0"),
        "run_p": (exp(log_p), ANGULAR_VELOCITY, f"{OF_BLOCKS['p'][1]} of its block"),
        "run_alpha": (arctan(exp(log_tan)), RADIAN, f"{OF_BLOCKS['alpha'][1]} of its block"),
        "run_inertia_factor": (inertia, DIMENSIONLESS, "inertia factor of its block"),
        **{
            f"run_{name}": (np.array([option[name] for option in options]), DIMENSIONLESS, f"{_OWN[name]} of its block")
            for name in plan.varied
        },
        "run_level": (
            exp(np.concatenate([pool.x for pool in pools]) + unit),
            plan.scaled.units,
            f"level of the run: {runs.level_name}",
        ),
        "run_overturned": (
            np.concatenate([pool.fell for pool in pools]),
            DIMENSIONLESS,
            "whether the block overturned",
        ),
    }
    return {name: xr.Variable(*variable) for name, variable in variables_on("pooled_run", labels).items()}


_OWN = {"e": "coefficient of restitution", "delta": OF_LAWS["delta"]}


def _law_coordinates(plan: PooledPlan) -> dict[str, xr.Variable]:
    """Return the labels and options of laws, without the options that blocks have of their own."""
    coordinates = law_coordinates(plan.laws)
    signs = {"e": "e=", "delta": "δ="}
    labels = []
    for law in plan.laws:
        parts = law.label.split(" ")
        for name in plan.varied:
            parts = [f"{signs[name]}own" if part.startswith(signs[name]) else part for part in parts]
        labels.append(" ".join(parts))
    coordinates["model"] = xr.Variable("model", np.array(labels, dtype=object), coordinates["model"].attrs)
    if "delta" in plan.varied:
        coordinates["delta"] = xr.Variable("model", np.full(len(labels), np.nan), coordinates["delta"].attrs)
    return coordinates


def _law_surfaces(surface: xr.Dataset, i: int, variables: int) -> LawSurfaces:
    """Return the surfaces of a law from a dataset."""
    pair = []
    cut = None
    if "cut_normal" in surface and np.isfinite(surface["cut_places"].values[i]).all():
        cut = Cut(surface["cut_normal"].values[i], *surface["cut_places"].values[i].tolist())
    for kind in ("near", "curve"):
        coefficients = surface[f"{kind}_coefficients"].values[i]
        n = int(np.isfinite(coefficients).sum())
        first, second = surface[f"{kind}_degrees"].values[i].tolist()
        covariance = surface[f"{kind}_covariance"].values[i, :n, :n]
        motions = int(surface[f"{kind}_motions"].values[i])
        pair.append(Surface(variables, (first, second), coefficients[:n], covariance, motions, np.zeros((0, n)), cut))
    factor, apart = (float(surface[name].values[i]) for name in ("band_factor", "lack_of_fit"))
    near, curve = pair
    rates = None
    if "rate_coefficients" in surface and np.isfinite(surface["rate_coefficients"].values[i]).all():
        rates = RatePlane(*(surface[f"rate_{name}"].values[i] for name in RatePlane._fields))
    return LawSurfaces(near, curve, factor, math.log1p(apart), rates)


def _curve_dataset(columns: BlockArray, laws: Sequence[Curves], surface: xr.Dataset, rated: bool) -> xr.Dataset:
    """Return curves as variables on (block, model)."""
    unit = surface.attrs["level_units"]
    name = surface.attrs["level_name"]
    of_all = f"level at which half overturn, from levels near it; its interval holds for all blocks at once: {name}"
    rate = "annual rate of overturning: of the lognormal curve through all runs, times what runs without a form say"
    labels = {
        **{f"half_level{end}": (unit, of_end(end, of_all, USUAL_CONFIDENCE)) for end in ENDS},
        "median": (unit, f"{OF_MEDIAN}: {name}"),
        **{f"dispersion{end}": (DIMENSIONLESS, of_end(end, OF_DISPERSION, USUAL_CONFIDENCE)) for end in ENDS},
        **{f"rate{end}": (PER_YEAR, of_end(end, rate, USUAL_CONFIDENCE)) for end in ENDS},
        **{
            f"rate_share_{side}": (DIMENSIONLESS, f"share of the rate from {side} the levels of the hazard curve")
            for side in ("below", "above")
        },
    }
    variables = {}
    for k, (name, (units, text)) in enumerate(labels.items()):
        if name.startswith("rate") and not rated:
            continue
        values = np.empty((len(columns), len(laws)))
        for i, curves in enumerate(laws):
            values[:, i] = exp(curves[k]) if units == unit else curves[k]
        variables[name] = xr.Variable(("block", "model"), values, described(text, units))
    of_laws = {name: values for name, values in coordinates_on(surface, ("model",)).items() if values.dims}
    return xr.Dataset(variables, coords={**_block_columns(columns), **of_laws}, attrs=surface.attrs)


def _block_columns(columns: BlockArray) -> dict[str, xr.Variable]:
    """Return the labels and properties of blocks."""
    labels = {
        "block": (columns.names.astype(object), DIMENSIONLESS, "block"),
        **{name: (getattr(columns, name.removesuffix("_factor")), *words) for name, words in OF_BLOCKS.items()},
        **{f"own_{name}": (values, DIMENSIONLESS, f"{_OWN[name]} of its own") for name, values in columns.own.items()},
    }
    return {name: xr.Variable(*variable) for name, variable in variables_on("block", labels).items()}
