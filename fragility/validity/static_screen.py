"""The part of the validity screen that depends only on blocks, laws and the number of motions.

It is for results that are not runs on (block, model, level, motion), as `screen` needs them: inventories and uncertain
blocks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ... import checks
from ...models import Block, Law, describe_block, describe_law
from ...models.friction import friction_at_impact
from ...units import provenance
from ..numerics.proportions import wilson_half_width
from .notes import NOT_MODELLED, block_notes, few_motions_note
from .reasons import labelled
from .screen import HALF_WIDTH, SQUAT_RATIO


def preliminary_screen(
    blocks: Sequence[Block], models: Sequence[Law], motions: int, dim: str = "block", half_width: float = HALF_WIDTH
) -> xr.Dataset:
    """Screen blocks and laws for conditions under which rocking is not the right model, without any motion.

    Parameters
    ----------
    blocks, models : sequences
        As for `toppling.ida`.
    motions : int
        Number of motions.
    dim : str
        Name of the dimension of the blocks.
    half_width : float
        Greatest half width of the 95 % interval of a probability of 1/2 that passes.

    Returns
    -------
    xarray.Dataset
        As in `screen`: squat and friction_uplift on the blocks, friction_impact on (model, blocks), and
        interval_half_width and few_motions; the attribute notes states the findings in sentences, one a line.

    Raises
    ------
    TypeError, ValueError
        No motions, a half width out of range.

    Examples
    --------
    >>> import toppling as tp
    >>> found = preliminary_screen([tp.Block(0.4, 0.6, name="crate")], [tp.HousnerImpact()], 20)
    >>> bool(found["squat"][0]), bool(found["few_motions"])
    (True, True)
    """
    widest = checks.number("half_width", half_width, above=0.0, below=0.5)
    half = wilson_half_width(checks.count("motions", motions, at_least=1))
    ratio = np.array([block.h / block.b for block in blocks])
    e = np.array([[model.restitution(block) for block in blocks] for model in models], dtype=float)
    impact = friction_at_impact(ratio[None], e)
    said = block_notes(blocks)
    ends = dict.fromkeys(f"{one:.2f}" for one in ((1.0 / ratio).min(), (1.0 / ratio).max()))
    needs = [f"{' to '.join(ends)} at uplift"]
    if np.isfinite(impact).any():
        needs.append(f"{np.nanmax(impact):.2f} at impact")
    said.append(f"blocks slide where the coefficient of friction is below {' and '.join(needs)}")
    if half > widest:
        said.append(few_motions_note(motions, half, widest))
    variables = {
        "squat": labelled(xr.DataArray(ratio < SQUAT_RATIO, dims=dim), "less than two half widths high: bounces"),
        "friction_uplift": labelled(xr.DataArray(1.0 / ratio, dims=dim), "coefficient of friction needed at uplift"),
        "friction_impact": labelled(
            xr.DataArray(impact, dims=("model", dim)), "coefficient of friction needed at impact"
        ),
        "interval_half_width": labelled(xr.DataArray(half), "half width of the 95 % interval of a probability of 1/2"),
        "few_motions": labelled(xr.DataArray(half > widest), f"whether that is above {widest:g}"),
    }
    configuration = {
        "analysis": "validity screen",
        "blocks": [describe_block(block) for block in blocks],
        "models": [describe_law(model) for model in models],
        "motions": motions,
        "half_width": widest,
    }
    return xr.Dataset(
        variables,
        attrs={
            "title": "Validity screen",
            **provenance(configuration),
            "notes": "\n".join([*said, NOT_MODELLED]),
        },
    )
