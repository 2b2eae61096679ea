"""Incremental dynamic analysis: every block is run under every law and every motion at every level."""

from collections.abc import Iterable, Sequence
from typing import Any

import xarray as xr

from ...core.aliases import Progress
from ...core.parameters import USUAL_MEASURE
from ...models import Block, Model
from ...motions.arrays import other_coordinates, records
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.polarity import AS_RECORDED, arrays_under, records_under
from ...motions.simulated.generator import Generator
from ..runs.labels import measured
from ..runs.provenance import IDA
from ..runs.request import check_request
from ..runs.runners import Workers
from ..runs.scaling import ground_of, scaling
from .analysis import Design, analyse, specimens_of


def ida(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = USUAL_MEASURE,
    outputs: Sequence[str] | None = None,
    client: Workers = None,
    skip: bool = True,
    *,
    screen: bool = True,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Incremental dynamic analysis at levels that all motions share; `adaptive_ida` chooses the levels itself.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2), each with its own time step and length; nothing is resampled or padded. Pairs of
        `toppling.motions.both_axes` act on blocks along their width and their depth: a planar run about each axis under
        one factor, of which the earlier fall decides (docs/theory/axes.md).
    levels : array_like, shape (level,)
        Levels of the intensity measure, SI, > 0, strictly increasing.
    im : str or Measure
        The measure to which every motion is scaled, which must grow with the motion: one of `motions.MEASURES`, or one
        with parameters such as ``motions.Sa(1.0)`` or ``"Sa(1.0)"``. With ``pga_normalised`` = PGA/(g tan alpha) and
        ``pgv_normalised`` = p PGV/(g tan alpha), factors depend on the block too. With ``scale``, levels are plain
        factors.
    outputs : sequence of str, optional
        By default overturned and peak_rotation. Runs about both axes add axis: 1 or 2 if the block fell along its width
        or depth, else 0.

        Any of:

        - overturned, peak_rotation, uplifted, impacts and overturning_time;
        - impact_velocity, the maximum angular speed just before an impact or at the edge of the elastic zone;
        - direction, the sign of the rotation in which the block fell: 1 or -1, and 0 without a fall;
        - top_displacement, the displacement height x sin(peak_rotation) of the upper corner, to be compared with the
          gap to a wall;
        - restraint_force (N), the maximum force of each part of a restraint: its strength if it broke. NaN without a
          restraint, and for a rigid part on one side only that broke;
        - airborne (of motions with a vertical component), True if the floor falls faster than g. Such a run is not
          computed, counts as overturned, and has a NaN rotation.

        `Sliding` blocks are not screened; by default their output is slide_peak. Any of:

        - slide_peak, slide_forward, slide_backward, slide_residual and slide_path (m);
        - slide_velocity (m/s), slips and first_slip_time (s);
        - slide_after (m), the slip after the end of the motion;
        - mode: 0 rests, 1 slides, 2 rocks, -1 loses contact with the floor;
        - fallen_off, True if the slips to the front and back move the block over its `Edge`, or if it loses contact
          with the floor. False for blocks without an edge.
    client : distributed.Client, optional
        The cluster that computes the runs; by default dask's configuration (a scheduler, or a default client), else
        threads of this process.
    skip : bool
        Skip samples that cannot change the outcome, such as samples before the first uplift. If ``outputs`` is
        overturned alone, also skip samples after which the rest of the record cannot overturn a block. Flags do not
        change, peaks only by rounding. The attribute ``skipped`` (JSON) states the number of samples of all runs, the
        skipped share with its reasons, and the number of events per run. It includes samples after overturning, which
        `skip` does not change.
    screen : bool
        Add the validity screen to the outputs: required friction, squat blocks, an elastic mode in the motion's band,
        far scaling, few motions, and a ``verdict`` for every run. `toppling.fragility.screen` returns the same without
        a coefficient of friction and without repeated runs. False omits them.
    ground : xarray.DataArray or a sequence of them, optional
        Ground motions from which the floor motions `motions` were computed, with the same labels. The levels then refer
        to the measure of the ground motions. Each floor motion is scaled like its ground motion (the building is
        elastic).
    polarity : {"as recorded", "both"}
        ``both`` runs every motion as recorded and reversed (ü and -ü), for blocks that are not symmetric: with a wall,
        a restraint, an offset or a lean. The two are trials of one motion: counts include both, and every interval
        treats the motion as one draw with all its runs.
    progress : callable, optional
        Called with (runs done, runs in all) after every chunk.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, level, motion), with the properties of blocks, laws and motions as coordinates,
        and the variables of the validity screen. If motions are run both ways, each is followed by its reverse along
        motion, with the coordinates `record` (its label as given) and `polarity` (1, -1). Coordinates of the motions on
        motion, such as `magnitude` and `station`, are kept. Bit-identical for any chunking, any scheduler and any
        number of workers.

    Notes
    -----
    The levels at which one motion overturns a block have no smallest interval, so that closer levels always find
    earlier falls. Probabilities and rates are means over motions, and converge.

    References
    ----------
    Vamvatsikos, D. and Cornell, C. A. (2002). Incremental dynamic analysis. Earthquake Engineering & Structural
    Dynamics 31(3), 491-514.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> result = ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, [1.0, 4.0])
    >>> dict(result.sizes)
    {'block': 1, 'model': 1, 'level': 2, 'motion': 4, 'reason': 9}
    """
    if isinstance(levels, str):
        raise TypeError(f"levels must be real numbers, got {levels!r:.40}: adaptive_ida chooses levels")
    if isinstance(motions, Generator):
        raise TypeError("motions must be labelled arrays: take some of the generator's (sample), or adaptive_ida")
    request = check_request(blocks, models, outputs, skip, client, progress, screen)
    design = incremental(levels, motions, im, request.blocks, ground, polarity)
    return analyse(request, specimens_of(request), design)


def incremental(
    levels: Any,
    motions: xr.DataArray | Iterable[xr.DataArray],
    im: str | Measure,
    blocks: Sequence[Block],
    ground: xr.DataArray | Iterable[xr.DataArray] | None,
    polarity: str = AS_RECORDED,
) -> Design:
    """Return the design in which every motion is run at every level; arguments as for `ida`."""
    arrays = arrays_under(motions, polarity)
    plain = records(arrays)
    below = None if ground is None else ground_of(plain, records_under(ground, polarity))
    scaled = scaling(levels, plain, im, blocks, below)
    attributes = {"units": scaled.units, "long_name": scaled.long_name, "im": scaled.name}
    level = xr.Variable("level", scaled.levels, attributes)
    return Design(
        IDA,
        "Incremental dynamic analysis of freestanding blocks",
        plain,
        scaled.factors,
        scaled.factors_at(level, len(plain)),
        {"level": level.size, "motion": len(plain)},
        {"level": level, **measured(scaled)},
        {
            "design": IDA,
            "im": scaled.name,
            "levels": scaled.levels.tolist(),
            **({"im_at": GROUND} if scaled.ground else {}),
        },
        other_coordinates(arrays),
    )
