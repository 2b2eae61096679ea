"""Falls with each kit and their savings: the runs of an inventory with every kit, under the same motions."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, Index, log
from ...core.units import ACCELERATION, DIMENSIONLESS, ENDS, NEWTON, PER_YEAR
from ...fragility import HazardCurve
from ...fragility.curves.means import resampled_means
from ...fragility.numerics.slabs import in_memory
from ...fragility.runs.provenance import number_of_motions
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Workers
from ...fragility.runs.scaling import SCALE
from ...models import half_weight, required_force, static_capacity
from ...motions.arrays import POLARITY
from ...motions.polarity import AS_RECORDED, BOTH
from ..buildings.anchoring import interval_options, weights_of
from ..buildings.assessment import Assessment, assess, distinct_runs
from ..buildings.savings import ItemChances
from ..buildings.shaking import Shaking, support_of
from ..buildings.variables import (
    RUPTURE,
    Precision,
    Year,
    consistent,
    level_index,
    per_year,
    variable,
    with_interval,
)
from ..inventory.contents import Inventory
from ..inventory.kits import Kit
from ..plan.design_shaking import at_level, design_level

AT_LEVELS = {
    "kit_probability": (ENDS[:1], "probability", "probability that a piece with the kit overturns"),
    "kit_front_probability": (ENDS[:1], "front_probability", "probability that a piece with the kit overturns forward"),
    "kit_broken_probability": (ENDS, f"{RUPTURE}_probability", "probability that the kit breaks"),
}
"""Variables at every level: their ends, the variable of the results with a kit that they are, and their words."""
FLAGS = {"falls": "", "front_falls": "front"}
"""Variables with the flags of any falls (as `fall_flags` names them), and of forward falls."""


def with_kit(inventory: Inventory, kit: Kit) -> Inventory | None:
    """Return the lines of an inventory that a kit fits, with it and without consequences; None if it fits none."""
    rows = [kit.on(row) for row in inventory.rows if kit.fits(row)]
    bare: dict[str, Any] = {"value": 0.0, "cost": None, "downtime": None, "injury": None, "consequences": ()}
    bare["stands_on"] = ""
    return replace(inventory, rows=tuple(replace(row, **bare) for row in rows)) if rows else None


def kit_savings(
    inventory: Inventory,
    kits: Sequence[Kit],
    assessment: xr.Dataset,
    asked: Assessment,
    level: float | None = None,
    client: Workers = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run an inventory with each of several kits, and return the falls and the savings.

    Lines that are not permanently anchored get each kit that fits them. `assessment` is of the inventory as it is, with
    ``sides=True`` and the arguments in `asked`. `level` is one of its levels, for probabilities given this level
    instead of annual rates. Variables are on (model, kit, item), NaN if the kit does not fit; intervals are paired over
    motions. ``kit_peak_acceleration`` is the median over motions of the peak acceleration of the item's floor at the
    level. With a hazard it is at the level that is exceeded with 10 % in 50 years.
    """
    if level is not None and asked.modelling_dispersion > 0.0:
        raise ValueError("savings of kits at a given level hold no modelling_dispersion: give a hazard curve")
    hazard = asked.hazard
    if hazard is not None and not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve for the savings of kits, got {checks.kind(hazard)}")
    asked = replace(asked, polarity=BOTH if POLARITY in assessment.coords else AS_RECORDED)
    year = Year.of(assessment, weights_of(assessment, level))
    precision = interval_options(assessment, year, asked.replicates, asked.seed)
    named, sizes = _named(level is None), assessment.sizes
    shape, dims = (sizes["model"], len(kits), sizes["block"]), ("model", "kit", "block")
    fits = np.zeros(shape[1:], bool)
    ranges = {name: np.full((3, *shape), np.nan) for name in named}
    at_levels = {name: np.full((len(ends), *shape, sizes["level"]), np.nan) for name, (ends, _, _) in AT_LEVELS.items()}
    done = 0
    for k, kit in enumerate(kits):
        held = with_kit(inventory, kit)
        if held is None:
            continue
        with_it = assess(held, asked, sides=True, client=client, progress=part_of(progress, done))
        with_it = with_it.transpose("model", "block", ...)
        of_each = distinct_runs(held, asked.variability, str(asked.polarity)) * number_of_motions(with_it)
        done += of_each * with_it.sizes["model"] * with_it.sizes["level"]
        rows = np.array([i for i, row in enumerate(inventory.rows) if kit.fits(row)])
        fits[k, rows] = True
        for name, (ends, of, _) in AT_LEVELS.items():
            at_levels[name][:, :, k, rows] = [with_it[f"{of}{end}"].values for end in ends]
        for name, values in _falls(assessment, with_it, rows, year, precision).items():
            ranges[name][:, :, k, rows] = values
        for name, values in _ruptures(with_it, level, hazard).items():
            ranges[name][:, :, k, rows] = values
    variables = {"kit_fits": variable(("kit", "block"), fits, DIMENSIONLESS, "whether the kit fits the pieces")}
    for name, (units, text) in named.items():
        variables |= with_interval(name, dims, ranges[name], units, text, precision)
    for name, (ends, _, text) in AT_LEVELS.items():
        if len(ends) == 1:
            variables[name] = variable((*dims, "level"), at_levels[name][0], DIMENSIONLESS, text)
        else:
            variables |= with_interval(name, (*dims, "level"), at_levels[name], DIMENSIONLESS, text, precision)
    variables = consistent(variables)
    value = assessment["value"].values * assessment["count"].values
    if value.any():
        money = assessment["value"].attrs["units"]
        when, units = ("in a year", per_year(money)) if level is None else ("at the level", money)
        text = f"mean loss that all pieces of the item save {when} by the kit"
        variables["kit_saving"] = variable(dims, ranges["kit_falls_saved"][0] * value, units, text)
    variables |= _static(inventory, kits, assessment, asked, level)
    names = np.array([kit.name for kit in kits], dtype=object)
    return xr.Dataset(variables, {"kit": variable(("kit",), names, DIMENSIONLESS, "kit that holds the pieces")})


def _named(yearly: bool) -> dict[str, tuple[str, str]]:
    """Return the units and words of the variables on (model, kit, item) that have intervals."""
    units, of = (PER_YEAR, "annual rate at which") if yearly else (DIMENSIONLESS, "probability at the level that")
    named = {
        "kit_falls": (units, f"{of} a piece with the kit overturns"),
        "kit_falls_saved": (units, f"{of} a piece overturns as it is, less that with the kit"),
        "kit_front_falls": (units, f"{of} a piece with the kit overturns forward"),
        "kit_front_falls_saved": (units, f"{of} a piece overturns forward as it is, less that with the kit"),
        "kit_share_saved": (DIMENSIONLESS, "share of the falls of a piece that the kit saves"),
        "kit_breaks": (units, f"{of} the kit breaks"),
    }
    if yearly:
        text = "probability that the kit breaks under the shaking that is exceeded with 10 % in 50 years"
        named["kit_breaks_at_design"] = DIMENSIONLESS, text
    return named


def _falls(
    assessment: xr.Dataset, with_it: xr.Dataset, rows: Index, year: Year, precision: Precision
) -> dict[str, Array]:
    """Return the falls of lines with a kit, and its saving compared with the present (value and ends, model, line)."""
    shape = (3, with_it.sizes["model"], rows.size)
    falls = {"kit_share_saved": np.empty(shape)}
    for name, flags in FLAGS.items():
        before, after = ItemChances(assessment, rows, flags), ItemChances(with_it, np.arange(rows.size), flags)
        falls |= {f"kit_{name}": np.empty(shape), f"kit_{name}_saved": np.empty(shape)}
        for of, part in after.of_items():
            with_kit_falls = year.total(after.piece(of, part))
            saved = year.total(before.piece(of, part)) - with_kit_falls
            falls[f"kit_{name}"][:, of, part] = precision.of_means(with_kit_falls, year.rate)
            # (a kit may fell a piece, too)
            falls[f"kit_{name}_saved"][:, of, part] = precision.of_means(saved, year.rate, signed=True)
            if name == "falls":
                falls["kit_share_saved"][:, of, part] = _share(saved, with_kit_falls + saved, precision)
    return falls


def _ruptures(with_it: xr.Dataset, level: float | None, hazard: HazardCurve | None) -> dict[str, Array]:
    """Return the frequency of a kit's ruptures (value and ends, model, line): per year and at a level.

    All values are in the results with the kit.
    """
    chances = np.stack([with_it[f"{RUPTURE}_probability{end}"].values for end in ENDS])
    if level is not None:
        return {"kit_breaks": chances[..., level_index(with_it, level)]}
    assert hazard is not None  # (annual rates come from it)
    levels = with_it["level"].values
    return {
        "kit_breaks": np.stack([with_it[f"{RUPTURE}_rate{end}"].values for end in ENDS]),
        "kit_breaks_at_design": np.stack(
            [at_level(design_level(levels, hazard), levels, chance) for chance in chances]
        ),
    }


def _share(saved: Array, before: Array, precision: Precision) -> Array:
    """Return the saved share of an amount (value and ends, …), of values (…, motion) resampled together."""
    confidence = precision.confidence
    draws = precision.replicates, precision.seed, in_memory, precision.strata
    with np.errstate(divide="ignore", invalid="ignore"):
        share = saved.mean(axis=-1) / before.mean(axis=-1)
        resampled = resampled_means(saved, *draws) / resampled_means(before, *draws)
        agree = resampled.min(axis=-1) == resampled.max(axis=-1)
    # (shares that all motions agree on have no interval, apart from none and all)
    known = np.isfinite(resampled).all(axis=-1) & (~agree | np.isin(share, (0.0, 1.0)))
    ends = np.full((2, *share.shape), np.nan)
    ends[:, known] = np.quantile(resampled[known], (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence), axis=-1)
    return np.concatenate([share[None], ends])


def _static(
    inventory: Inventory, kits: Sequence[Kit], assessment: xr.Dataset, asked: Assessment, level: float | None
) -> dict[str, xr.Variable]:
    """Return the static checks of the kits: forces needed, static capacities, half weights, and the motion."""
    shaking = Shaking.of(asked.building, asked.motions, None, asked.im == SCALE)
    placed, scaled = shaking.placed(inventory), shaking.scaled(asked.levels, asked.im)
    peaks = np.empty(len(inventory))
    for at in shaking.supports(placed):
        shaken = shaking.shaken(at, scaled, asked.im)
        peaks_of_motions = np.array([np.abs(motion.acceleration).max() for motion in shaken.motions])
        medians = np.median((shaken.factors[0] * peaks_of_motions).reshape(-1, shaking.runs), axis=-1)
        if level is None:
            assert isinstance(asked.hazard, HazardCurve)  # (annual rates come from it)
            peak = math.exp(at_level(design_level(scaled.levels, asked.hazard), scaled.levels, log(medians)))
        else:
            peak = float(medians[level_index(assessment, level)])
        peaks[[support_of(row) == at for row in placed.rows]] = peak

    shape = (len(kits), len(inventory))
    force, capacity, half = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape[1], np.nan)
    for i, row in enumerate(inventory.rows):
        if row.block.mass is not None:
            half[i] = half_weight(row.block)
        for k, kit in enumerate(kits):
            if not kit.fits(row):
                continue
            block = kit.on(row).block
            assert block.restraint is not None  # (it has the kit)
            capacity[k, i] = static_capacity(block)
            if block.restraint.front is not None and math.isfinite(peaks[i]):
                force[k, i] = required_force(block, peaks[i], block.restraint.front)
    text = "peak acceleration of its floor for the static check, median over motions"
    strength = np.array([kit.restraint.count * kit.restraint.strength for kit in kits])
    return {
        "kit_strength": variable(("kit",), strength, NEWTON, "force at which the kits of a piece break, all together"),
        "kit_peak_acceleration": variable(("block",), peaks, ACCELERATION, text),
        "kit_required_force": variable(("kit", "block"), force, NEWTON, "static force on the kits of a piece"),
        "kit_static_capacity": variable(
            ("kit", "block"), capacity, ACCELERATION, "static acceleration at which a piece with the kit tips"
        ),
        "kit_half_weight": variable(("block",), half, NEWTON, "half of the weight of a piece"),
    }
