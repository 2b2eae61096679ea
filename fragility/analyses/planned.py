"""Runs that a table lists: the design of a researcher's own."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Index, Progress
from ...core.doubts import warn
from ...core.parameters import USUAL_MEASURE
from ...models import Block, Model
from ...models.plausibility import block_doubts, law_doubts
from ...motions.arrays import records
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.plausibility import record_doubts
from ..runs.plan import refuse_endless_runs
from ..runs.provenance import AXES, PLANNED
from ..runs.request import check_request
from ..runs.runners import Workers
from ..runs.scaling import ground_of
from ..validity.plausibility import level_doubts
from ..validity.slab_screen import ScreenRequest
from ..validity.sparse_screen import Shaken
from .friction_draws import is_random
from .sparse import labelled, runs_of, with_sparse_screen
from .waves import MotionWave, Rows, check_own_levels, check_row_factors, checked_axes, run_rows, scaled_to

COLUMNS = ("block", "model", "motion", "level")


def run_table(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: xr.DataArray | Iterable[xr.DataArray],
    table: Mapping[str, Any],
    im: str | Measure = USUAL_MEASURE,
    outputs: Sequence[str] | None = None,
    client: Workers = None,
    *,
    screen: bool = True,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Run the rows of a table: each one block under one law and one motion, scaled to a level of its own.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2).
    table : mapping of columns, or pandas.DataFrame
        Columns of equal length: ``block``, ``model`` and ``motion`` (labels, or numbers from 0; block and model may be
        left out if there is one) and ``level`` (SI, > 0).
    im : str or Measure
        The measure of the levels, as for `toppling.ida`.
    outputs, client, screen, ground, progress
        As for `toppling.ida`; a screen needs runs of every block under every law.

    Returns
    -------
    xarray.Dataset
        The outputs on run, in the order of the table, with `run_block`, `run_model`, `run_motion` and `level`, and the
        variables of the validity screen. `adaptive_ida` returns runs in the same form, for `fit_fragility` and later
        steps.

    Raises
    ------
    TypeError, ValueError
        As `toppling.ida`; columns that are missing, of several lengths, or name unknown labels.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(3)
    >>> table = {"motion": [0, 0, 1, 2], "level": [2.0, 4.0, 3.0, 5.0]}
    >>> run_table(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, table)["run_motion"].values.tolist()
    [0, 0, 1, 2]
    """
    request = check_request(blocks, models, outputs, True, client, progress, screen)
    check_own_levels(request)
    if is_random(request.models):
        raise ValueError("models must have a known friction in a table of runs: take Sliding")
    plain = records(motions)
    scaled = scaled_to(im)
    wave = MotionWave(np.arange(len(plain)), plain, None if ground is None else ground_of(plain, records(ground)))
    rows = _rows(
        table,
        {
            "block": [block.label for block in request.blocks],
            "model": [law.label for law in request.models],
            "motion": [record.label for record in plain],
        },
    )
    axes = checked_axes(request, plain)
    refuse_endless_runs((("models", *pair) for pair in product(request.blocks, request.models)), plain)
    measured = scaled.measured(wave, request.blocks)
    factors = scaled.factors(rows.level, measured[rows.block % len(measured), rows.motion])
    check_row_factors(rows, factors, plain)
    doubts = [*block_doubts(request.blocks), *law_doubts(request.blocks, request.models, request.outputs)]
    warn([*doubts, *record_doubts(plain), *level_doubts(np.unique(rows.level), scaled.units)])
    results = run_rows(request, plain, rows, factors, request.progress)
    kept = {name: results[name] for name in request.outputs}
    configuration = {
        "motions": [record.label for record in plain],
        **({AXES: axes} if axes else {}),
        "design": PLANNED,
        "im": scaled.name,
        **({} if ground is None else {"im_at": GROUND}),
    }
    runs = runs_of(0, 0, wave, rows, kept, scaled, measured, axes)
    labelled_runs = labelled(request, [runs], scaled, configuration, "Runs of freestanding blocks by a table")
    shaken = Shaken(0.0)
    if request.screen:
        shaken.add(plain)
    return with_sparse_screen(labelled_runs, request, shaken, ScreenRequest())


def _rows(table: Any, labels: Mapping[str, list[str]]) -> Rows:
    """Return the rows of a table with the numbers of the labels in its columns."""
    if not isinstance(table, Mapping) and not hasattr(table, "columns"):
        raise TypeError(f"table must be a mapping of columns or a DataFrame, got {checks.kind(table)}")
    for name in table:
        checks.choice("a column of the table", name, COLUMNS)
    if "level" not in table:
        raise ValueError("table must have the column level, got none")
    levels = checks.finite_array("the column level", np.asarray(table["level"]), ndim=(1,))
    if not (levels > 0.0).all():
        raise ValueError(f"the column level must be > 0, got {levels.min():g}")
    block, model, motion = (_numbers(name, table, known, levels.size) for name, known in labels.items())
    return Rows(block, model, motion, levels)


def _numbers(name: str, table: Any, known: list[str], size: int) -> Index:
    """Return a column of numbers from 0, into which its labels are turned."""
    if name not in table:
        if len(known) > 1:
            raise ValueError(f"table must have the column {name}, of which there are {len(known)}, got none")
        return np.zeros(size, np.int64)
    column = np.asarray(table[name])
    if column.shape != (size,):
        raise ValueError(f"the column {name} must have a value for each of the {size} levels, got {column.shape}")
    if column.dtype.kind in "iu":
        numbers = column.astype(np.int64)
    else:
        places = {label: i for i, label in enumerate(known)}
        numbers = np.array([places.get(str(value), -1) for value in column.tolist()], np.int64)
    wrong = np.flatnonzero((numbers < 0) | (numbers >= len(known)))
    if wrong.size:
        raise ValueError(
            f"the column {name} must hold labels, or numbers from 0 to {len(known) - 1}, got {column[wrong[0]]!s:.40}"
        )
    return numbers
