"""The one way from a request to labelled, screened runs, shared by all analyses.

An analysis is a design (which motions are run at which scale) for specimens (which blocks under which laws).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import xarray as xr

from ...doubts import Doubt, warn
from ...models import Block, describe_block, describe_law
from ...models.oscillator import Oscillator
from ...motions.arrays import Record, motion_coordinates
from ...motions.plausibility import record_doubts
from ...motions.polarity import BOTH
from ...units import provenance
from ..runs.factors import Factors, ScaleFactors
from ..runs.graph import output_arrays
from ..runs.labels import block_coordinates, lazy_outputs, model_coordinates, output_variables
from ..runs.plan import plan_even
from ..runs.provenance import DESCRIBED, STRIPES
from ..runs.request import Request, collect, work_of
from ..validity.lazy_screen import with_lazy_screen
from ..validity.plausibility import block_doubts, level_doubts
from ..validity.screen import ScreenInput, with_screen
from .measuring import MeasuringThread


class Specimens(NamedTuple):
    """The oscillators of an analysis and what labels them.

    oscillators: block by block, equally many for each of `blocks`; sizes: of the dimensions that the oscillators are
    laid out on, in order; coordinates: on these dimensions; configuration: their description as plain values.
    """

    oscillators: Sequence[Oscillator]
    blocks: Sequence[Block]
    sizes: Mapping[str, int]
    coordinates: Mapping[str, Any]
    configuration: Mapping[str, Any]


class Design(NamedTuple):
    """The motions of an analysis and the intensities at which they are run.

    name: ida, stripes or cloud; factors (block, level, motion): those of the runs; scale: the same by dimension, for
    the screen; sizes: of the dimensions beside those of the specimens, in order; coordinates: the intensities and the
    measure behind them; configuration: the design as plain values.
    """

    name: str
    title: str
    motions: Sequence[Record]
    factors: Factors
    scale: ScaleFactors
    sizes: Mapping[str, int]
    coordinates: Mapping[str, xr.Variable]
    configuration: Mapping[str, Any]


def specimens_of(request: Request) -> Specimens:
    """Return every block of a request under every law."""
    blocks, models = request.blocks, request.models
    described = (
        [describe_block(block) for block in blocks]
        if len(blocks) <= DESCRIBED
        else f"{len(blocks)}, as their coordinates say"
    )
    return Specimens(
        request.oscillators,
        blocks,
        {"block": len(blocks), "model": len(models)},
        {**block_coordinates(blocks), **model_coordinates(blocks, models)},
        {"blocks": described, "models": [describe_law(model) for model in models]},
    )


def doubts_of(blocks: Sequence[Block], design: Design) -> list[Doubt]:
    """Return the doubts in the sizes of blocks, the records, and the levels that they are scaled to."""
    at = design.coordinates.get("intensity" if design.name == STRIPES else "level")
    levels = [] if at is None else level_doubts(at.values, str(at.attrs["units"]))
    return [*block_doubts(blocks), *record_doubts([one for one in design.motions if not one.reverse_of]), *levels]


def analyse(request: Request, specimens: Specimens, design: Design) -> xr.Dataset:
    """Run every specimen under the motions of a design, label the runs, and screen them where the request says so.

    Where specimens and design give the same coordinate or the same entry of the configuration, it stands where the
    specimens have it, so that the order in a result can be chosen.  Where the request is not to compute, the
    variables with a value for every run are dask arrays.
    """
    warn(doubts_of(request.blocks, design))
    sizes = {**specimens.sizes, **design.sizes}
    each = math.prod(list(specimens.sizes.values())[1:])
    work = work_of(specimens.oscillators, design.motions, design.factors, request, each)
    thread = MeasuringThread(design.motions, request.screen)
    if request.compute:
        runs = collect(work, request.runner, request.progress)
        outputs = output_variables(request, runs, specimens.blocks, work, sizes)
        known = {"skipped": json.dumps(runs.skipped)}
    else:
        outputs = lazy_outputs(
            request, output_arrays(work, plan_even(work), list(sizes.values())), specimens.blocks, work, sizes
        )
        known = {}
    measures, characteristics = thread.result()
    coordinates = {
        **specimens.coordinates,
        **motion_coordinates(list(design.motions)),
        **measures,
        **design.coordinates,
    }
    configuration = {
        **specimens.configuration,
        "motions": [record.label for record in design.motions],
        **({"polarity": BOTH} if any(record.reverse_of for record in design.motions) else {}),
        **design.configuration,
    }
    labelled = xr.Dataset(
        outputs,
        coords=coordinates,
        attrs={
            "title": design.title,
            "design": design.name,
            **provenance(configuration),
            **known,
        },
    )
    if characteristics is None:
        return labelled
    given = ScreenInput(sizes, coordinates, design.scale)
    if request.compute:
        return with_screen(labelled, given, characteristics, request.runner.array)
    return with_lazy_screen(labelled, given, characteristics)
