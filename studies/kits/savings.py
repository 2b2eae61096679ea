"""Falls with each kit and their savings: the runs of an inventory with every kit, under the same motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.elementary import Array, log
from ...core.units import ACCELERATION, DIMENSIONLESS, NEWTON
from ...core.wording import given_percent
from ...fragility import HazardCurve
from ...fragility.curves.means import resampled_means
from ...fragility.numerics.slabs import in_memory
from ...fragility.runs.progress import part_of
from ...fragility.runs.provenance import number_of_motions
from ...fragility.runs.scaling import SCALE
from ...fragility.uncertainty.joint import Variability
from ...models import Law, half_weight, required_force, static_capacity
from ...motions import Building
from ...motions.arrays import POLARITY
from ...motions.polarity import AS_RECORDED, BOTH
from ..buildings.anchoring import Resampling, weights_of
from ..buildings.assessment import assess, distinct_runs
from ..buildings.savings import ItemChances
from ..buildings.shaking import Shaking, support_of
from ..buildings.slide_runs import Slipping
from ..buildings.variables import PER_YEAR, RUPTURE, Year, level_index, per_year, variable
from ..inventory.contents import Inventory
from ..inventory.kits import Kit
from ..plan.design_shaking import at_level, design_level

if TYPE_CHECKING:
    from distributed import Client

    from ...fragility.runs.runners import Runner

ENDS = ("", "_lower", "_upper")
RUPTURES = ("kit_breaks", "kit_breaks_at_design")
"""Variables with how often a kit breaks."""
FLAGS = {"falls": "", "front_falls": "front"}
"""Variables with the flags of any falls (as `fall_flags` names them), and of forward falls."""


class Shake(NamedTuple):
    """How an inventory is shaken: the arguments of `assess` that its runs with kits have in common with it."""

    models: Sequence[Law]
    motions: Any
    levels: Array
    im: str
    building: Building | None = None
    hazard: HazardCurve | None = None
    variability: Variability | None = None
    modelling_dispersion: float = 0.0
    replicates: int = 1000
    seed: int = 0
    polarity: str | None = None
    slipping: Slipping | None = None

    def assess(self, inventory: Inventory, **options: Any) -> xr.Dataset:
        """Return the assessment of an inventory that is shaken so; options: the other arguments of `assess`."""
        return assess(
            inventory,
            self.models,
            self.motions,
            self.levels,
            self.im,
            self.building,
            self.hazard,
            variability=self.variability,
            modelling_dispersion=self.modelling_dispersion,
            replicates=self.replicates,
            seed=self.seed,
            polarity=self.polarity,
            slipping=self.slipping,
            **options,
        )


def with_kit(inventory: Inventory, kit: Kit) -> Inventory | None:
    """Return the lines of an inventory that a kit fits, with it and without consequences; None where it fits none."""
    rows = [kit.on(row) for row in inventory.rows if kit.fits(row)]
    bare: dict[str, Any] = {"value": 0.0, "cost": None, "downtime": None, "injury": None, "consequences": ()}
    bare["stands_on"] = ""
    return replace(inventory, rows=tuple(replace(row, **bare) for row in rows)) if rows else None


def kit_savings(
    inventory: Inventory,
    kits: Sequence[Kit],
    assessment: xr.Dataset,
    shake: Shake,
    level: float | None = None,
    client: Client | Runner | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run an inventory with each of several kits, and return what falls then and what that saves.

    Lines that are not anchored for good get each kit that fits them.  `assessment` is that of the inventory as it
    is, with ``sides=True`` and the arguments in `shake`; `level` is one of its levels, for probabilities given this
    level instead of annual rates.  Variables are on (model, kit, item), NaN where the kit does not fit; intervals
    are paired over motions.  ``kit_peak_acceleration`` is the median over motions of the peak acceleration of the
    item's floor at the level, or with a hazard at the level that is exceeded with 10 % in 50 years.
    """
    if level is not None and shake.modelling_dispersion > 0.0:
        raise ValueError("savings of kits at a given level hold no modelling_dispersion: give a hazard curve")
    shake = shake._replace(polarity=BOTH if POLARITY in assessment.coords else AS_RECORDED)
    year = Year.of(assessment, weights_of(assessment, level))
    precision = Resampling(shake.replicates, shake.seed, year.strata(assessment.sizes["motion"]))
    found = _Savings(assessment, [kit.name for kit in kits])
    done = 0
    for k, kit in enumerate(kits):
        held = with_kit(inventory, kit)
        if held is None:
            continue
        with_it = shake.assess(held, sides=True, client=client, progress=part_of(progress, done))
        of_each = distinct_runs(held, shake.variability, str(shake.polarity)) * number_of_motions(with_it)
        done += of_each * with_it.sizes["model"] * with_it.sizes["level"]
        rows = [i for i, row in enumerate(inventory.rows) if kit.fits(row)]
        found.add(k, rows, with_it, year, precision)
        found.add_ruptures(k, rows, with_it, level, shake.hazard)
    data = found.variables(assessment, level is None) | _static(inventory, kits, assessment, shake, level)
    names = np.array([kit.name for kit in kits], dtype=object)
    return xr.Dataset(data, {"kit": variable(("kit",), names, DIMENSIONLESS, "kit that holds the pieces")})


class _Savings:
    """Rates with kits and what they save, gathered kit by kit; NaN for items that a kit does not fit."""

    def __init__(self, assessment: xr.Dataset, kits: Sequence[str]) -> None:
        self.assessment = assessment
        sizes = assessment.sizes
        shape = (sizes["model"], len(kits), sizes["item"])
        self.falls = {name: np.full((2, 3, *shape), np.nan) for name in FLAGS}
        self.probabilities = {name: np.full((*shape, sizes["level"]), np.nan) for name in FLAGS}
        self.fits = np.zeros(shape[1:], bool)
        self.shares = np.full((3, *shape), np.nan)
        self.ruptures = {name: np.full((3, *shape), np.nan) for name in RUPTURES}
        self.broken = np.full((3, *shape, sizes["level"]), np.nan)

    def add(self, k: int, rows: Sequence[int], with_it: xr.Dataset, year: Year, precision: Resampling) -> None:
        """Take the results with one kit, of the items at some positions."""
        at, confidence = np.array(rows), float(self.assessment.attrs["confidence"])
        self.fits[k, at] = True
        for name, flags in FLAGS.items():
            before = ItemChances(self.assessment, at, flags)
            after = ItemChances(with_it, np.arange(at.size), flags)
            stored = "probability" if name == "falls" else "front_probability"
            self.probabilities[name][:, k, at] = with_it[stored].values
            for of, part in after.of_items():
                own = year.total(after.piece(of, part))
                saved = year.total(before.piece(of, part)) - own
                for i, values in enumerate((own, saved)):
                    # (a kit may fell a piece, too)
                    ends = precision.interval(values, confidence, signed=i == 1)
                    one = np.stack([values.mean(axis=-1), ends.lower, ends.upper])
                    self.falls[name][i][:, of, k, at[part]] = one
                if name == "falls":
                    self.shares[:, of, k, at[part]] = _share(saved, own + saved, precision, confidence)

    def add_ruptures(
        self, k: int, rows: Sequence[int], with_it: xr.Dataset, level: float | None, hazard: HazardCurve | None
    ) -> None:
        """Take how often one kit broke, as the results with it say: in a year or at the level, and at every level."""
        at, levels = np.array(rows), with_it["level"].values
        for i, end in enumerate(ENDS):
            chances = with_it[f"{RUPTURE}_probability{end}"].values
            self.broken[i][:, k, at] = chances
            if level is not None:
                self.ruptures["kit_breaks"][i][:, k, at] = chances[..., level_index(with_it, level)]
                continue
            assert hazard is not None  # (annual rates come from it)
            self.ruptures["kit_breaks"][i][:, k, at] = with_it[f"item_{RUPTURE}_rate{end}"].values
            there = at_level(design_level(levels, hazard), levels, chances)
            self.ruptures["kit_breaks_at_design"][i][:, k, at] = there

    def variables(self, assessment: xr.Dataset, yearly: bool) -> dict[str, xr.Variable]:
        """Return the variables on (model, kit, item)."""
        dims = ("model", "kit", "item")
        percent = given_percent(float(assessment.attrs["confidence"]))
        units, of = (PER_YEAR, "annual rate at which") if yearly else (DIMENSIONLESS, "probability at the level that")
        found = {"kit_fits": variable(("kit", "item"), self.fits, DIMENSIONLESS, "whether the kit fits the pieces")}
        for name in FLAGS:
            where = "" if name == "falls" else " forward"
            texts = {
                f"kit_{name}": f"{of} a piece with the kit overturns{where}",
                f"kit_{name}_saved": f"{of} a piece overturns{where} as it is, less that with the kit",
            }
            for (label, text), values in zip(texts.items(), self.falls[name], strict=True):
                found[label] = variable(dims, values[0], units, text)
                for end, one in (("lower", values[1]), ("upper", values[2])):
                    long_name = f"{end} end of the {percent} interval: {text}"
                    found[f"{label}_{end}"] = variable(dims, one, units, long_name)
            label = "kit_probability" if name == "falls" else "kit_front_probability"
            text = f"probability that a piece with the kit overturns{where}"
            found[label] = variable((*dims, "level"), self.probabilities[name], DIMENSIONLESS, text)
        rate = "annual rate at which the kit breaks" if yearly else "probability at the level that the kit breaks"
        design = "probability that the kit breaks under the shaking that is exceeded with 10 % in 50 years"
        broken = [("kit_broken_probability", self.broken, "probability that the kit breaks", DIMENSIONLESS)]
        broken += [("kit_breaks", self.ruptures["kit_breaks"], rate, units)]
        broken += [("kit_breaks_at_design", self.ruptures["kit_breaks_at_design"], design, DIMENSIONLESS)][
            : int(yearly)
        ]
        for label, ruptures, text, unit in broken:
            for end, one in zip(ENDS, ruptures, strict=True):
                long_name = f"{end[1:]} end of the {percent} interval: {text}" if end else text
                found[f"{label}{end}"] = variable((*dims, "level")[: one.ndim], one, unit, long_name)
        text = "share of the falls of a piece that the kit saves"
        for end, values in zip(("", "_lower", "_upper"), self.shares, strict=True):
            long_name = f"{end[1:]} end of the {percent} interval: {text}" if end else text
            found[f"kit_share_saved{end}"] = variable(dims, values, DIMENSIONLESS, long_name)
        value = assessment["value"].values * assessment["count"].values
        if value.any():
            money = assessment["value"].attrs["units"]
            unit = per_year(money) if yearly else money
            text = f"mean loss that all pieces of the item save {'in a year' if yearly else 'at the level'} by the kit"
            found["kit_saving"] = variable(dims, self.falls["falls"][1, 0] * value, unit, text)
        return found


def _share(saved: Array, before: Array, precision: Resampling, confidence: float) -> Array:
    """Return what is saved over what there was (value and ends, …), of values (…, motion) resampled together."""
    draws = precision.replicates, precision.seed, in_memory, precision.strata
    with np.errstate(divide="ignore", invalid="ignore"):
        share = saved.mean(axis=-1) / before.mean(axis=-1)
        resampled = resampled_means(saved, *draws) / resampled_means(before, *draws)
    known = np.isfinite(resampled).all(axis=-1)
    ends = np.full((2, *share.shape), np.nan)
    ends[:, known] = np.quantile(resampled[known], (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence), axis=-1)
    return np.concatenate([share[None], ends])


def _static(
    inventory: Inventory, kits: Sequence[Kit], assessment: xr.Dataset, shake: Shake, level: float | None
) -> dict[str, xr.Variable]:
    """Return the static checks of the kits: forces needed, static capacities, half weights, and what shaking."""
    shaking = Shaking.of(shake.building, shake.motions, None, shake.im == SCALE)
    placed, scaled = shaking.placed(inventory), shaking.scaled(shake.levels, shake.im)
    peaks = np.empty(len(inventory))
    for at in shaking.supports(placed):
        shaken = shaking.shaken(at, scaled, shake.im)
        own = np.array([np.abs(one.acceleration).max() for one in shaken.motions])
        medians = np.median((shaken.factors[0] * own).reshape(-1, shaking.runs), axis=-1)
        if level is None:
            assert shake.hazard is not None  # (annual rates come from it)
            here = math.exp(at_level(design_level(scaled.levels, shake.hazard), scaled.levels, log(medians)))
        else:
            here = float(medians[level_index(assessment, level)])
        peaks[[support_of(row) == at for row in placed.rows]] = here

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
        "kit_peak_acceleration": variable(("item",), peaks, ACCELERATION, text),
        "kit_required_force": variable(("kit", "item"), force, NEWTON, "static force on the kits of a piece"),
        "kit_static_capacity": variable(
            ("kit", "item"), capacity, ACCELERATION, "static acceleration at which a piece with the kit tips"
        ),
        "kit_half_weight": variable(("item",), half, NEWTON, "half of the weight of a piece"),
    }
