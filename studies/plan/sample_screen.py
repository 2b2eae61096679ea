"""The validity screen of uncertain blocks: sliding, scaling and undecided outcomes of every sample, block by block."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...aliases import Progress
from ...fragility.runs.factors import BlockFactors
from ...fragility.runs.runners import Runner
from ...fragility.runs.scaling import ground_of, scaling
from ...fragility.validity.characteristics import Characteristics
from ...fragility.validity.summary import input_of_pairs, over_samples, summary_screen
from ...fragility.validity.undecided import FlipCounts, choose_motions, count_flips_of
from ...models import Block, Law
from ...models.friction import Friction
from ...motions import records
from .designs import Incremental


def screen_samples(
    block: Block,
    pairs: Sequence[Sequence[tuple[Block, Law]]],
    design: Incremental,
    overturned: xr.DataArray,
    friction: Friction | None,
    undecided: float,
    runner: Runner,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Screen all samples of one block together.

    Parameters
    ----------
    block : Block
        The nominal block.
    pairs : sequences, (sample, model)
        The block and the law of every sample.
    design : Incremental
        Motions and levels.
    overturned : xarray.DataArray
        The flags on (model, sample, level, motion).
    friction : Friction or None
        The friction there is.
    undecided : float
        Share of the motions whose flags are tested.
    runner, progress
        For the runs under perturbations.

    Returns
    -------
    xarray.Dataset
        As `summary_screen`, with the nominal block on block: squat and friction_uplift are its own, shares are of the
        runs of all samples, and demands the greatest among them.
    """
    plain = records(design.motions)
    ground = ground_of(plain, records(design.ground)) if design.ground else None
    blocks = [row[0][0] for row in pairs]
    scaled = scaling(design.at, plain, design.im, blocks, ground)
    given = input_of_pairs(
        [str(i) for i in range(len(pairs))],
        pairs,
        plain,
        scaled.factors_at(xr.Variable("level", scaled.levels), len(plain)),
    )
    flips = None
    if undecided > 0.0:
        chosen = choose_motions(len(plain), undecided)
        flags = overturned.transpose("sample", "model", "level", "motion").values[..., chosen]
        factors = (
            scaled.factors.part(motions=chosen)
            if isinstance(scaled.factors, BlockFactors)
            else scaled.factors[:, :, chosen]
        )
        each = np.repeat(factors, len(pairs[0]), axis=0) if factors.shape[0] > 1 else factors
        flat = flags.reshape(-1, *flags.shape[2:])
        near = [one for one, is_in in zip(plain, chosen, strict=True) if is_in]
        counts = count_flips_of([pair for row in pairs for pair in row], flat, near, each, runner, progress)
        flips = FlipCounts(chosen, counts.reshape(flags.shape))
    return over_samples(summary_screen(given, Characteristics.of(plain), friction, flips), block)


def joined_screens(parts: Sequence[xr.Dataset], models: xr.DataArray) -> xr.Dataset:
    """Return the screens of several blocks as one, on block and model."""
    found = xr.concat(parts, "block", data_vars="minimal", coords="minimal", compat="equals", combine_attrs="override")
    settings = [json.loads(part.attrs["screen"]) for part in parts]
    told = dict(settings[0])
    if told["friction"] is not None:
        told["friction"] = {label: one for own in settings for label, one in own["friction"].items()}
    return found.assign_coords(model=models.variable).assign_attrs(screen=json.dumps(told, ensure_ascii=False))
