"""The validity screen of an inventory: sliding, scaling and undecided outcomes of its lines, each on its own floor."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags, Index, Progress
from ...fragility.runs.provenance import BED, DESCRIBED
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Runner
from ...fragility.uncertainty.joint import Variability, pieces_of, with_restitution
from ...fragility.validity.characteristics import Characteristics
from ...fragility.validity.friction_demand import ANY_FLOOR
from ...fragility.validity.slab_screen import distinct
from ...fragility.validity.summary import OF_BLOCKS, input_of_pairs, summary_screen
from ...fragility.validity.undecided import FlipCounts, choose_motions, count_flips_of, perturbed_runs
from ...models import Block, Law
from ...models.friction import Friction
from ...motions.arrays import Record
from ..inventory.contents import Contents, Inventory
from .assessment import Assessment, distinct_runs, kind_of, shaking_of
from .axes import placed_on_axes
from .shaking import Shaking, support_of


def runs_of_tests(
    inventory: Inventory,
    models: Sequence[Law],
    levels: int,
    motions: int,
    undecided: float,
    variability: Variability | None,
) -> int:
    """Return the number of further runs that test which outcomes are undecided, in a share of the motions."""
    if undecided == 0.0:
        return 0
    return perturbed_runs(distinct_runs(inventory, variability), models, levels, motions, undecided)


def screen_inventory(
    inventory: Inventory,
    asked: Assessment,
    overturned: xr.DataArray,
    undecided: float,
    runner: Runner,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Screen every line as `summary_screen`; for an anchored line, values that depend on the motion are NaN.

    undecided: the share of the motions whose flags are tested.
    """
    models, variability = asked.laws, asked.variability
    shaking = shaking_of(asked, inventory)
    inventory, scaled = placed_on_axes(inventory, shaking, models), shaking.scaled(asked.levels, asked.im)
    flags = overturned if "variant" in overturned.dims else overturned.expand_dims("variant")
    values = flags.transpose("block", "model", "variant", "level", "motion").values
    values = values.reshape(*values.shape[:3], *shaking.run_shape(values.shape[3]))
    total = runs_of_tests(inventory, models, values.shape[3], values.shape[4], undecided, variability)
    chosen = choose_motions(values.shape[4], undecided) if undecided > 0.0 else None
    tests = _Tests(models, variability, undecided, runner, progress, total)
    parts = []
    for support in shaking.supports(inventory):
        at = [i for i, row in enumerate(inventory.rows) if support_of(row) == support]
        rows, shaken = [inventory.rows[i] for i in at], shaking.shaken(support, scaled, asked.im)
        flips = None
        if chosen is not None:
            flips = tests.of(rows, values, at, chosen, shaken.motions, shaken.factors)
        given = input_of_pairs(
            [row.label for row in rows],
            [[(row.block, with_restitution(law, row.e)) for law in models] for row in rows],
            shaken.motions,
            shaken.of_runs,
        )
        stripe = np.arange(len(shaken.motions)) // shaking.runs  # (few motions are few at a level)
        given = given._replace(coordinates={**given.coordinates, "stripe": xr.Variable("motion", stripe)})
        of_floor = summary_screen(given, Characteristics.of(shaken.motions), _friction_of(inventory, rows), flips)
        parts.append(_by_level(of_floor, shaking))
    return _joined(parts, overturned, np.array([not row.anchored for row in inventory.rows]))


def _friction_of(inventory: Inventory, rows: Sequence[Contents]) -> dict[str, Friction] | None:
    """Return the friction of lines by their labels, None if no line of the inventory has any."""
    if all(row.friction is None for row in inventory.rows):
        return None
    return {row.label: ANY_FLOOR if row.friction is None else row.friction for row in rows}


def _by_level(screened: xr.Dataset, shaking: Shaking) -> xr.Dataset:
    """Return a screen with `perturbed` on (level, motion) if the motions of all levels follow one another."""
    if "perturbed" not in screened or screened.sizes["motion"] == shaking.runs:
        return screened
    perturbed = screened["perturbed"]
    shaped = xr.Variable(("level", "motion"), perturbed.values.reshape(-1, shaking.runs), perturbed.attrs)
    return screened.drop_dims("motion").assign(perturbed=shaped)


@dataclass
class _Tests:
    """Runs under perturbations, floor after floor; lines that are alike are run once, and anchored lines never."""

    models: Sequence[Law]
    variability: Variability | None
    share: float
    runner: Runner
    progress: Progress | None
    total: int
    done: int = 0

    def of(
        self,
        rows: Sequence[Contents],
        flags: Flags,
        at: Sequence[int],
        chosen: Flags,
        motions: Sequence[Record],
        factors: Array,
    ) -> FlipCounts:
        """Return the counts of a floor's lines, at positions `at`, from flags (line, model, variant, level, motion)."""
        _, models, variants, levels, _ = flags.shape
        counts = self.runner.array((len(rows), models, levels, variants, int(chosen.sum())), np.int8)
        counts[...] = 0
        near = [motion for motion, is_in in zip(motions, chosen, strict=True) if is_in]
        for both in (False, True):
            first: dict[tuple[Any, ...], int] = {}
            for i, row in enumerate(rows):
                if not row.anchored and row.both_axes == both:
                    first.setdefault(kind_of(row), i)
            if not first:
                continue
            lines, places = [rows[i] for i in first.values()], np.array(at)[list(first.values())]
            flips = count_flips_of(
                lines,
                self._pairs_of,
                near,
                partial(_flags_of, flags, places, chosen),
                factors[:, :, chosen],
                self.runner,
                part_of(self.progress, self.done, self.total),
                both,
            )
            run = len(first) * variants
            self.done += perturbed_runs(run, self.models, levels, len(motions), self.share, 1 + both)
            numbers = {kind: k for k, kind in enumerate(first)}
            for i, row in enumerate(rows):
                if not row.anchored and row.both_axes == both:
                    of_line = flips[numbers[kind_of(row)]].reshape(models, variants, levels, -1)
                    counts[i] = np.moveaxis(of_line, 1, 2)
        return FlipCounts(chosen, counts)

    def _pairs_of(self, row: Contents, across: bool) -> list[tuple[Block, Law]]:
        """Return the pieces of a line with their laws, about the width or with `across` about the depth."""
        every = (pieces_of(row.block, law, row.e, self.variability, across) for law in self.models)
        return [pair for pieces in every for pair in pieces]


def _flags_of(flags: Flags, places: Index, chosen: Flags, part: slice) -> Flags:
    """Return the flags (line, model and variant, level, chosen motion) of a part of the lines at some places."""
    chosen_flags: Flags = flags[places[part]][..., chosen]
    return chosen_flags.reshape(len(chosen_flags), -1, *chosen_flags.shape[3:])


def _joined_friction(parts: Sequence[Any]) -> Any:
    """Join the friction of the floors, which is described line by line for few lines, else by its range."""
    if parts[0] is None:
        return None
    if all(isinstance(part, dict) for part in parts) and sum(map(len, parts)) <= DESCRIBED:
        return {label: friction for part in parts for label, friction in part.items()}
    return distinct(friction for part in parts for friction in (part.values() if isinstance(part, dict) else part))


def _joined(parts: Sequence[xr.Dataset], overturned: xr.DataArray, standing: Flags) -> xr.Dataset:
    """Join the screens of the floors in the order of the inventory; NaN for anchored lines if the motion decides."""
    settings = [json.loads(part.attrs["screen"]) for part in parts]
    friction = _joined_friction([setting["friction"] for setting in settings])
    for name, none in (("round", False), (BED, np.nan)):  # (of floors with a round piece, or a piece on a soft bed)
        if any(name in part.coords for part in parts):
            known = [part.get(name, xr.DataArray(np.full(part.sizes["block"], none), dims="block")) for part in parts]
            parts = [part.assign_coords({name: of}) for part, of in zip(parts, known, strict=True)]
    screened = xr.concat(
        parts, "block", data_vars="minimal", coords="minimal", compat="equals", combine_attrs="override"
    )
    screened = screened.sel(block=overturned["block"].values)
    free = xr.DataArray(standing, dims="block")
    masked = [
        name for name, variable in screened.data_vars.items() if "block" in variable.dims and name not in OF_BLOCKS
    ]
    screened = screened.assign({name: screened[name].where(free).assign_attrs(screened[name].attrs) for name in masked})
    screened = screened.assign_coords(model=overturned["model"].variable)
    return screened.assign_attrs(screen=json.dumps({**settings[0], "friction": friction}, ensure_ascii=False))
