"""Kits of performance studies: kits to try for each line, notes on them, and the sets in results."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from ...core.doubts import Doubt, first_of
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...models import Block
from ...models.plausibility import unit_doubts
from ..buildings.variables import per_year, variable
from ..file.analyses import PerformanceTable
from ..file.csv_table import NO, YES
from ..file.schema import StudyFile
from ..inventory.contents import DEAREST, Inventory
from ..inventory.kits import Kit
from ..kits.sets import INJURIES, LOSS, TARGETS, KitSet, budget_kits, target_kits
from .study import restraints_of

AMOUNT_WORDS = {
    "falls": "expected falls",
    "front_falls": "expected forward falls",
    "injuries": "expected injured persons",
    "loss": "expected loss",
}
"""Amounts that a target can limit, in words."""


def kits_of(content: StudyFile) -> dict[str, Kit]:
    """Return all restraints of a study as kits; ValueError if one is wrong, or has a name that means yes or no."""
    restraints_of(content)
    kits = {name: Kit.of(name, table) for name, table in (content.restraints or {}).items()}
    for name in kits:
        if name.lower() in (*YES, *NO):
            raise ValueError(f"restraints.{name}: {name!r} says whether a piece is anchored, and cannot name a kit")
    return kits


def candidates(asked: PerformanceTable, known: dict[str, Kit], inventory: Inventory) -> tuple[Kit, ...]:
    """Return the kits to try; ValueError if they cannot be tried, or if restraints are not used."""
    names = asked.kits or []
    for name in names:
        if name not in known:
            listed = ", ".join(map(repr, known)) or "none"
            raise ValueError(f"performance.kits must name restraints of the study ({listed}), got {name!r}")
    if len(set(names)) < len(names):
        raise ValueError(f"performance.kits must be different, got {', '.join(names)}")
    used = {*names, *(row.kit for row in inventory.rows)}
    unused = [name for name in known if name not in used]
    if unused:
        raise ValueError(
            f"restraints.{unused[0]} holds nothing: name it in performance.kits, or in the inventory under 'anchored'"
        )
    kits = tuple(known[name] for name in names)
    for kit in kits:
        fitting = [row for row in inventory.rows if kit.fits(row)]
        if not fitting:
            free = next((row for row in inventory.rows if not row.anchored and row.kit != kit.name), None)
            why = "all have it or are anchored"
            if free is not None:
                why = f"of {free.label!r} it {kit.misfit(free.block, free.anchor_height)}"
            raise ValueError(f"performance.kits: {kit.name!r} fits no piece of the inventory ({why})")
        for row in fitting:
            if row.block.mass is None:
                raise ValueError(f"performance.kits need mass_kg of every piece that they fit, {row.label!r} has none")
    if asked.target is not None:
        if not kits:
            raise ValueError("performance.target needs performance.kits, of which the cheapest set is chosen")
        if LOSS in asked.target.limits and inventory.value == 0.0:
            raise ValueError("performance.target.loss needs values in the inventory, which gives none")
        if INJURIES in asked.target.limits and all(row.injury is None for row in inventory.rows):
            raise ValueError("performance.target.injuries needs persons_exposed in the inventory, which gives none")
    if kits and (asked.target is not None or asked.budget is not None) and all(kit.cost is None for kit in kits):
        key = "target" if asked.target is not None else "budget"
        raise ValueError(f"performance.{key} needs the cost of the kits (`cost` in their tables), and none has one")
    return kits


def kit_doubts(inventory: Inventory, kits: Sequence[Kit], limits: Mapping[str, float]) -> list[Doubt]:
    """Return the input warnings on costs of kits compared with the losses, and on targets that are already met."""
    doubts = unit_doubts((kit.name, kit.restraint) for kit in kits)
    dear = []
    for kit in kits:
        loss = max((row.loss for row in inventory.rows if kit.fits(row)), default=0.0)
        if loss > 0.0 and kit.cost is not None and kit.cost > DEAREST * loss:
            dear.append(f"{kit.name}: {kit.cost:,.12g} for {loss:,.12g}")
    if dear:
        doubts.append(Doubt.of("kits_dear", most=DEAREST, named=first_of(dear)))
    free = [row for row in inventory.rows if not row.anchored]
    injured = sum(row.count * row.injury.mean for row in free if row.injury is not None)
    pieces = float(sum(row.count for row in free))
    most = {"falls": pieces, "front_falls": pieces, INJURIES: injured, LOSS: inventory.value}
    loose = [
        f"{name} = {limit:g}, all pieces give {most[name]:.4g}" for name, limit in limits.items() if limit > most[name]
    ]
    if loose:
        doubts.append(Doubt.of("target_met", named=first_of(loose)))
    return doubts


def scenes_of(inventory: Inventory, kits: Sequence[Kit]) -> list[Block]:
    """Return the blocks of all lines by their names, those that get kits with the stiffest that fits."""
    blocks = []
    for row in inventory.rows:
        if row.anchored:
            continue
        fitting = [kit for kit in kits if kit.fits(row)]
        stiffest = max(fitting, key=lambda kit: kit.restraint.stiffness, default=None)
        block = row.block if stiffest is None else stiffest.on(row).block
        blocks.append(replace(block, name=row.label))
    return blocks


def kit_notes(inventory: Inventory, kits: Sequence[Kit]) -> list[Fact]:
    """Return facts on kits that do not fit some lines, and on kits without a cost."""
    priced = any(kit.cost is not None for kit in kits)
    facts = [Fact("kit.no_cost", names=(kit.name,)) for kit in kits if kit.cost is None and priced]
    for kit in kits:
        left = [row for row in inventory.rows if not row.anchored and row.kit != kit.name and not kit.fits(row)]
        if left:
            more = {"kit": kit.name, "why": kit.misfit(left[0].block, left[0].anchor_height)}
            facts.append(Fact("kit.not_tried", names=tuple(row.label for row in left), more=more))
    return facts


def with_kit_sets(results: xr.Dataset, budget: float | None, target: dict[str, float] | None) -> xr.Dataset:
    """Return the results with the best kits for the budget and the cheapest for the target, under each law."""
    variables: dict[str, Any] = {}
    attributes: dict[str, Any] = {}
    laws = range(results.sizes["model"])
    if budget is not None:
        variables |= _set_variables("budget", [budget_kits(results, budget, k) for k in laws], results)
        attributes["budget"] = budget
    if target is not None:
        sets = [target_kits(results, target, k) for k in laws]
        met = np.array([of_law.met for of_law in sets])
        variables |= _set_variables("target", sets, results)
        variables["target_met"] = variable(("model",), met, DIMENSIONLESS, "whether any set of kits meets the target")
        attributes["target"] = json.dumps(target)
    return results.assign(variables).assign_attrs(attributes)


def _set_variables(what: str, sets: Sequence[KitSet], results: xr.Dataset) -> dict[str, xr.Variable]:
    """Return the sets of kits of all laws as variables."""
    of = f"in the set for the {what}"
    money = results["kit_cost"].attrs["units"]
    yearly = "rate" in results
    loss = results["value"].attrs["units"]
    units = dict.fromkeys(TARGETS, PER_YEAR if yearly else DIMENSIONLESS) | {LOSS: per_year(loss) if yearly else loss}
    text = "by how much another set can be better, relative to this one"
    variables = {
        f"{what}_kit": variable(
            ("model", "block"), np.stack([of_law.kits for of_law in sets]), DIMENSIONLESS, f"kit {of}"
        ),
        f"{what}_cost": variable(
            ("model",), np.array([of_law.cost for of_law in sets]), money, f"cost of all kits {of}"
        ),
        f"{what}_gap": variable(("model",), np.array([of_law.gap for of_law in sets]), DIMENSIONLESS, text),
    }
    for name in TARGETS:
        values = np.array([of_law.amounts[name] for of_law in sets])
        variables[f"{what}_{name}"] = variable(
            ("model",), values, units[name], f"{AMOUNT_WORDS[name]} with the kits {of}"
        )
    return variables
