"""The one way from a request to labelled, screened runs, shared by all analyses.

An analysis is a design (which motions are run at which scale) for specimens (which blocks under which laws).
"""

import json
import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from itertools import product
from typing import Any, NamedTuple, Self

import xarray as xr

from ...core.doubts import Doubt, warn
from ...core.units import provenance
from ...models import Block, Model, describe_block, describe_law
from ...models.outputs import AXIS, BOTH, OUTPUTS
from ...models.plausibility import block_doubts, law_doubts, still_doubts
from ...models.runs import Specimen
from ...motions.arrays import BOTH_AXES, DOWNWARD, DRAW, POLARITY, RECORD, Record, motion_coordinates
from ...motions.intensity.evaluation import measure_variables
from ...motions.intensity.measure import MEASURES, RESULT_MEASURES
from ...motions.plausibility import record_doubts
from ...motions.polarity import BOTH as BOTH_WAYS
from ..runs.axes import along_width, axes_of, check_axes, check_outputs
from ..runs.factors import Factors, ScaleFactors
from ..runs.labels import block_coordinates, depth_coordinate, law_coordinates, output_variables, restitution_variable
from ..runs.plan import LeftError, refuse_endless_runs
from ..runs.provenance import AXES, CLOUD, DESCRIBED, STRIPES
from ..runs.request import ENDS, USUAL_OF_ROCKING, Request, check_vertical, collect_about, work_of
from ..runs.runners import thread_count
from ..validity.characteristics import Characteristics
from ..validity.plausibility import cut_slides, end_doubts, level_doubts, period_doubts
from ..validity.screen import with_screen
from ..validity.slab_screen import ScreenInput, ScreenRequest, screened_runs

OF_WIDTH = ", of the component along the width"
"""End of the long name of measures of motions along both axes; their screen is of the width, too."""

MEANT = ("intensity", "stripe", "level", RECORD, POLARITY, DRAW, DOWNWARD)
"""Coordinates that describe the runs.  Motions may have coordinates of the same names, which mean something else."""


class Specimens(NamedTuple):
    """The oscillators of an analysis and their labels.

    `oscillators`: block by block, equally many for each of `blocks`. `sizes`: of the dimensions of the oscillators, in
    order; `coordinates`: on these dimensions. `configuration`: their description as plain values. `across`: the
    oscillators in the direction of the blocks' depths, needed only for runs about both axes. `pairs`: the blocks with
    their laws, unless these are all of `blocks` under all laws of the request.
    """

    oscillators: Sequence[Specimen]
    blocks: Sequence[Block]
    sizes: Mapping[str, int]
    coordinates: Mapping[str, Any]
    configuration: Mapping[str, Any]
    across: Sequence[Specimen] | None = None
    pairs: Sequence[tuple[Block, Model]] | None = None


class Design(NamedTuple):
    """The motions of an analysis and the intensities at which they are run.

    `name`: ida, stripes or cloud. `factors` (block, level, motion): of the runs. `scale`: the same by dimension, for
    the screen. `sizes`: of the dimensions that the specimens do not have, in order. `coordinates`: the intensities and
    the measure behind them. `configuration`: the design as plain values. `described`: other coordinates of the motions;
    a result keeps them unless it uses their names itself. `measures`: of the motions, if they are known already.
    """

    name: str
    title: str
    motions: Sequence[Record]
    factors: Factors
    scale: ScaleFactors
    sizes: Mapping[str, int]
    coordinates: Mapping[str, xr.Variable]
    configuration: Mapping[str, Any]
    described: Mapping[str, xr.Variable]
    measures: dict[str, xr.Variable] | None = None


def specimens_of(request: Request) -> Specimens:
    """Return every block of a request under every law."""
    blocks, models = request.blocks, request.models
    described = (
        [describe_block(block) for block in blocks]
        if len(blocks) <= DESCRIBED
        else f"{len(blocks)}, as their coordinates say"
    )
    sizes = {"block": len(blocks), "model": len(models)}
    e = restitution_variable(product(blocks, models), tuple(sizes), tuple(sizes.values()))
    return Specimens(
        request.specimens(),
        blocks,
        sizes,
        {**block_coordinates(blocks), **law_coordinates(models), "e": e},
        {"blocks": described, "models": [describe_law(model) for model in models]},
        request.specimens(across=True),
    )


def doubts_of(request: Request, design: Design) -> list[Doubt]:
    """Return the input warnings on blocks, on records, and on the levels to which they are scaled."""
    at = design.coordinates.get("intensity" if design.name == STRIPES else "level")
    levels = [] if at is None else level_doubts(at.values, str(at.attrs["units"]))
    blocks = [*block_doubts(request.blocks), *law_doubts(request.blocks, request.models, request.outputs)]
    motions = [motion for motion in design.motions if not motion.reverse_of]
    if design.name == CLOUD:
        blocks += still_doubts(request.blocks, (float(abs(motion.acceleration).max()) for motion in motions))
    periods = period_doubts(str(design.configuration["im"]))
    return [*blocks, *record_doubts(motions, design.name != STRIPES), *levels, *periods]


def analyse(request: Request, specimens: Specimens, design: Design) -> xr.Dataset:
    """Run every specimen under the motions of a design, label the runs, and screen them if requested.

    If specimens and design give the same coordinate or the same entry of the configuration, it has the place that the
    specimens give it. The order in a result can thus be chosen.
    """
    check_vertical(request.models, design.motions)
    pairs = specimens.pairs or product(specimens.blocks, request.models)
    refuse_endless_runs((("models", *pair) for pair in pairs), design.motions)
    warn(doubts_of(request, design))
    axes = axes_of(design.motions)
    request = _about(axes, request)
    sizes = {**specimens.sizes, **design.sizes}
    per_block = math.prod(list(specimens.sizes.values())[1:])
    motions = [along_width(motion) for motion in design.motions]
    work = work_of(specimens.oscillators, motions, design.factors, request, per_block)
    across = None
    if axes == BOTH_AXES and request.sliding:
        work = work._replace(oscillators=request.specimens(plane=True))
    elif axes == BOTH_AXES:
        assert specimens.across is not None  # the caller that takes such motions makes them
        across = specimens.across
    thread = MeasuringThread(design.motions, request.screen, design.measures)
    with thread:
        runs = collect_about(work, across, request.runner, request.progress)
    if all(name in runs.results for name in ENDS):
        labels = [record.label for record in design.motions]
        peaks, after = (runs.results[name] for name in ENDS)
        warn(end_doubts(cut_slides(peaks, after), labels))
    outputs = output_variables(request, runs, specimens.blocks, work, sizes)
    measures, characteristics = thread.result()
    if axes == BOTH_AXES:
        outputs = {name: with_words(output, BOTH[OUTPUTS[name].both]) for name, output in outputs.items()}
        measures = {name: with_words(measure, OF_WIDTH) for name, measure in measures.items()}
    coordinates = {
        **specimens.coordinates,
        **(depth_coordinate(specimens.blocks) if axes and "block" in specimens.sizes else {}),
        **motion_coordinates(list(design.motions)),
        **measures,
        **design.coordinates,
    }
    configuration = {
        **specimens.configuration,
        "motions": [record.label for record in design.motions],
        **({"polarity": BOTH_WAYS} if any(record.reverse_of for record in design.motions) else {}),
        **({AXES: axes} if axes else {}),
        **design.configuration,
    }
    labelled = xr.Dataset(
        outputs,
        coords=coordinates,
        attrs={
            "title": design.title,
            "design": design.name,
            **provenance(configuration),
            "skipped": json.dumps(runs.skipped),
        },
    )
    if characteristics is not None:
        # about both axes the screen is of the width, the axis about which the block overturns more easily
        given = ScreenInput(sizes, coordinates, design.scale)
        screened = screened_runs(given, characteristics, ScreenRequest(), None, request.runner.array)
        labelled = with_screen(labelled, screened)
    taken = {*labelled.variables, *labelled.dims, *MEANT, *MEASURES}
    return labelled.assign_coords({name: values for name, values in design.described.items() if name not in taken})


def _about(axes: str, request: Request) -> Request:
    """Return a request, with the axis of each fall among the usual outputs if blocks are run about both axes.

    ValueError if its blocks or outputs do not go with the axes.
    """
    check_axes(axes, request.blocks, request.models)
    check_outputs(axes, request.outputs, request.models)
    named = [name for name in request.outputs if name != "ruptured"]  # (which studies add for what holds blocks)
    usual = axes == BOTH_AXES and named == list(USUAL_OF_ROCKING)
    return request._replace(outputs=[*request.outputs, AXIS]) if usual else request


def with_words(variable: xr.Variable, more: str) -> xr.Variable:
    """Return a variable with more words at the end of its long name."""
    attributes = {**variable.attrs, "long_name": f"{variable.attrs['long_name']}{more}"}
    return xr.Variable(variable.dims, variable.data, attributes)


MotionProperties = tuple[dict[str, xr.Variable], Characteristics | None]
"""The measures that every result carries, and the characteristics for the screen (None without a screen)."""


class _Motions(list[Record]):
    """Motions that are gone through until they are left."""

    left = False

    def __iter__(self) -> Iterator[Record]:
        for motion in super().__iter__():
            if self.left:
                raise LeftError
            yield motion


class MeasuringThread:
    """Thread that measures motions, and stops after the current motion if the runs, its context, end early.

    (Interrupted, or their cluster lost.  No daemon, which Python ends within C++ code, and the process with it.)

    It starts at once; with `screen` it computes the characteristics of the motions, too. If dask is limited to one
    thread, they are computed at their first use.
    """

    def __init__(self, motions: Sequence[Record], screen: bool, known: dict[str, xr.Variable] | None = None) -> None:
        self._motions = _Motions(motions)
        self._screen = screen
        self._known = known
        self._measured: Future[MotionProperties] = Future()
        self._started = thread_count() > 1 and (screen or known is None)
        if self._started:
            threading.Thread(target=self._work, name="toppling-motions").start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._motions.left = kind is not None

    def _work(self) -> None:
        try:
            measures = self._known or measure_variables(self._motions, RESULT_MEASURES)
            self._measured.set_result((measures, Characteristics.of(self._motions) if self._screen else None))
        except Exception as error:
            self._measured.set_exception(error)

    def result(self) -> MotionProperties:
        """Wait for the thread and return its result, or raise its error."""
        if not self._started:
            self._work()
        with self:
            return self._measured.result()  # Python treats a thread with an interrupted join as ended, and exits
