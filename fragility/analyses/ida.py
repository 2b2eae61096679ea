"""Incremental dynamic analysis: every block is run under every law and every motion at every level."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import xarray as xr

from ...core.aliases import Progress
from ...models import Block, Model
from ...motions.arrays import other_coordinates, records
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.polarity import AS_RECORDED, arrays_under, records_under
from ...motions.simulated.generator import Generator
from ..runs.labels import measured
from ..runs.provenance import IDA
from ..runs.request import check_request
from ..runs.scaling import ground_of, scaling
from .analysis import Design, analyse, specimens_of

if TYPE_CHECKING:
    from distributed import Client

    from ..runs.runners import Runner


def ida(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = "pga",
    outputs: Sequence[str] | None = None,
    client: Client | Runner | None = None,
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
        Labelled motions (m s-2), each with its own time step and length; nothing is resampled or padded.  Pairs of
        `toppling.motions.both_axes` shake blocks along their width and their depth: a planar run about each axis under
        one factor, of which the earlier fall decides (docs/theory/axes.md).
    levels : array_like, shape (level,)
        Levels of the intensity measure, SI, > 0, strictly increasing.
    im : str or Measure
        The measure to which every motion is scaled: a measure that grows with the motion (`motions.MEASURES`), one with
        parameters such as ``motions.Sa(1.0)`` or ``"Sa(1.0)"``, ``pga_normalised`` = PGA/(g tan alpha) or
        ``pgv_normalised`` = p PGV/(g tan alpha), whose factors depend on the block too, or ``scale``: plain factors.
    outputs : sequence of str, optional
        By default overturned and peak_rotation, and axis (1 or 2 where the block fell along its width or depth, 0 where
        it stands) of runs about both axes.  Any of overturned, peak_rotation, uplifted, impacts, overturning_time,
        impact_velocity (the greatest angular speed at which the block comes down, before an impact or at the edge of
        the elastic zone), direction (1 or -1: the sign of the rotation in which it fell; 0 if it stands),
        top_displacement (the way of the upper corner it leans to, height x sin(peak_rotation): to be compared with the
        gap to a wall), restraint_force (N, the greatest force of each part of a restraint: its strength where it broke;
        NaN without one, and of a rigid one on one side only that broke), airborne (of motions that shake vertically,
        too: the floor falls faster than g; such a run is not computed, counts as overturned, and has NaN for a
        rotation).  Of `Sliding` blocks, which are not screened, by default slide_peak; any of slide_peak,
        slide_forward, slide_backward, slide_residual, slide_path (m), slide_velocity (m/s), slips, first_slip_time (s),
        slide_after (m, the way after the end of the motion), mode (0 rests, 1 slides, 2 rocks, -1 loses contact with
        the floor) and fallen_off (whether the slips to the front and back take the block over its `Edge`; False of
        blocks near none, True where the block loses contact with the floor).
    client : distributed.Client, optional
        The cluster that computes the runs; where not given, what dask is configured to use (a scheduler, or a default
        client), else threads of this process.
    skip : bool
        Skip samples that cannot change the outcome: those before the first uplift, and, where ``outputs`` is overturned
        alone, those after which the rest of the record cannot overturn a block.  Flags do not change, peaks only by
        rounding.  The attribute ``skipped`` (JSON) states how many samples all runs have, which share was skipped and
        why (also after overturning, which `skip` does not change), and how many events were solved per run.
    screen : bool
        Add the validity screen to the outputs: friction needed, squat blocks, an elastic mode in the motion's band,
        far scaling, few motions, and a ``verdict`` for every run, as `toppling.fragility.screen` returns them without
        a coefficient of friction and without repeating runs.  False leaves them out.
    ground : xarray.DataArray or a sequence of them, optional
        The ground motions of which `motions` are floor motions, with the same labels: the levels then refer to the
        measure of the ground motions, and each floor motion is scaled like its ground motion (the building is elastic).
    polarity : {"as recorded", "both"}
        ``both`` runs every motion both ways, as given and reversed (ü and -ü), for blocks that answer the two
        differently: those with a wall, a restraint, an offset or a lean.  The two are trials of one motion: counts
        hold both, and every interval takes the motion as one draw with all its runs.
    progress : callable, optional
        Called with (runs done, runs in all) after every chunk.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, level, motion), with the properties of blocks, laws and motions as coordinates,
        and the variables of the validity screen.  Where motions are run both ways, each is followed by its reverse
        along motion, with the coordinates `record` (its label as given) and `polarity` (1, -1).  Coordinates of the
        motions on motion, such as `magnitude` and `station`, are kept.
        Bit-identical for any chunking, any scheduler and any number of workers.

    Notes
    -----
    The levels at which one motion overturns a block have no smallest interval, so that closer levels go on to find
    earlier falls; probabilities and rates, which are means over motions, settle.

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
