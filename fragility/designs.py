"""Analyses beside the incremental one: multiple stripes and cloud.

In both a motion is run once, at one intensity: dims (block, model, motion), `intensity` on motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from .. import checks
from ..models import Block, Law
from ..motions.arrays import Record, records
from ..motions.intensity import Measure
from ..units import DIMENSIONLESS
from .beside import Beside
from .block_factors import dense
from .execution import Progress, execute, request
from .labels import label_runs, measured
from .scaling import SCALE, Scaling, ground_of, increasing, intensities, intensity_measure, of_the_ground, scaling
from .screen import with_screen

if TYPE_CHECKING:
    from distributed import Client

    from .runners import Runner

Motions = xr.DataArray | Iterable[xr.DataArray]


def stripes(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    motions: Sequence[Motions],
    levels: Any,
    im: str | Measure = "pga",
    outputs: Sequence[str] = ("overturned", "peak_rotation"),
    client: Client | Runner | None = None,
    skip: bool = True,
    *,
    screen: bool = True,
    scale: bool = True,
    ground: Sequence[Motions] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Multiple-stripe analysis: motions that differ from level to level, as a hazard-consistent selection gives them.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : sequence of motions or of sequences of them
        The motions of each level (m s-2); a motion may be in several stripes.
    levels : array_like, shape (level,)
        Level of each stripe, SI, > 0, strictly increasing.
    im : str or Measure
        The measure that the levels are of, as for `toppling.ida`.
    outputs, client, skip, screen, progress
        As for `toppling.ida`.
    scale : bool
        Scale every motion of a stripe to its level (default), or take the motions as they are: they were chosen, or
        simulated, for that level, and scatter about it.
    ground : sequence of motions or of sequences of them, optional
        For each stripe the ground motions of which `motions` are floor motions: the levels are then of their measure.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, motion); on motion the coordinates `intensity` (the level of the motion's stripe),
        `stripe` (1, 2, …) and `record` (its label as given: a motion that is in several stripes has the stripe added
        to its label).  `overturning_probability` counts them by level.

    Raises
    ------
    TypeError, ValueError
        Another number of stripes than of levels; otherwise as `toppling.ida`.

    Notes
    -----
    Motions differ between stripes, so stripes are independent of each other, which the levels of an incremental
    analysis are not.

    References
    ----------
    Jalayer, F. (2003). Direct probabilistic seismic analysis: implementing non-linear dynamic assessments. PhD thesis,
    Stanford University.  Baker, J. W. (2015). Efficient analytical fragility function fitting using dynamic structural
    analysis. Earthquake Spectra 31(1), 579-599.

    Examples
    --------
    >>> import toppling as tp
    >>> weak, strong = (tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4, seed) for seed in (1, 2))
    >>> runs = stripes(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), [weak, strong], [2.0, 4.0])
    >>> runs["intensity"].values.tolist()
    [2.0, 2.0, 2.0, 2.0, 4.0, 4.0, 4.0, 4.0]
    """
    asked = request(blocks, models, outputs, skip, client, progress, screen)
    if not isinstance(scale, bool):
        raise TypeError(f"scale must be True or False, got {scale!r:.40}")
    values = increasing(levels)
    sets = _sets("motions", motions, values.size)
    below = [None] * values.size if ground is None else _sets("ground", ground, values.size)
    plain: list[Record] = []
    scaled: list[Scaling] = []
    for level, own, earth in zip(values, sets, below, strict=True):
        one = scaling([level], own, im, asked.blocks, None if earth is None else ground_of(own, earth))
        plain.extend(own)
        scaled.append(one if scale else one._replace(factors=np.ones((1, 1, len(own)))))
    stripe = np.repeat(np.arange(1, values.size + 1), [len(own) for own in sets])
    names = [record.label for record in plain]
    if len(set(names)) < len(names):
        plain = [one._replace(label=f"{one.label}, stripe {k}") for one, k in zip(plain, stripe, strict=True)]
    together = scaled[0]._replace(
        factors=np.concatenate([dense(one.factors) for one in scaled], axis=2),
        measured=None
        if scaled[0].measured is None
        else np.concatenate([one.measured for one in scaled if one.measured is not None], axis=-1),
    )
    of_motions = Beside(plain, asked.screen)
    runs = execute(asked.oscillators, plain, together.factors, asked)
    attributes = {"units": together.units, "long_name": together.long_name, "im": together.name}
    measures, shaken = of_motions.result()
    labelled = label_runs(
        runs,
        asked,
        plain,
        measures,
        ("motion",),
        {
            "intensity": xr.Variable("motion", values[stripe - 1], attributes),
            "stripe": xr.Variable("motion", stripe, {"units": DIMENSIONLESS, "long_name": "stripe"}),
            "record": xr.Variable(
                "motion", np.array(names, dtype=object), {"units": DIMENSIONLESS, "long_name": "motion as given"}
            ),
            **measured(together),
        },
        {
            "design": "stripes",
            "im": together.name,
            "levels": values.tolist(),
            "scale": scale,
            **({"im_at": "ground"} if together.ground else {}),
        },
        "Multiple-stripe analysis of freestanding blocks",
    )
    return with_screen(labelled, shaken, asked.runner.array)


def cloud(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    motions: Motions,
    im: str | Measure = "pga",
    outputs: Sequence[str] = ("overturned", "peak_rotation"),
    client: Client | Runner | None = None,
    skip: bool = True,
    *,
    screen: bool = True,
    ground: Motions | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Cloud analysis: every motion once, as it is.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2); nothing is scaled.
    im : str or Measure
        The measure against which the runs are looked at: any but ``scale``.
    outputs, client, skip, screen, progress
        As for `toppling.ida`.
    ground : xarray.DataArray or a sequence of them, optional
        The ground motions of which `motions` are floor motions: the measure is then taken of them.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, motion), with the measure as coordinate `intensity`: on motion, or on (block,
        motion) where it depends on the block.

    Raises
    ------
    TypeError, ValueError
        As `toppling.ida`.

    References
    ----------
    Jalayer, F., Ebrahimian, H., Miano, A., Manfredi, G., Sezen, H. (2017). Analytical fragility assessment using
    unscaled ground motion records. Earthquake Engineering & Structural Dynamics 46(15), 2639-2663.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(4)
    >>> runs = cloud(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, "pgv")
    >>> runs["intensity"].dims
    ('motion',)
    """
    asked = request(blocks, models, outputs, skip, client, progress, screen)
    plain = records(motions)
    at = plain if ground is None else ground_of(plain, records(ground))
    one = intensity_measure(im)
    if one is None:
        raise ValueError(f"im must be a measure of the motions in a cloud analysis, got {im!r}")
    intensity = intensities(one, at, asked.blocks)
    scaled = scaling([1.0], plain, SCALE)
    of_motions = Beside(plain, asked.screen)
    runs = execute(asked.oscillators, plain, scaled.factors, asked)
    text = one.long_name if ground is None else of_the_ground(one.long_name)
    attributes = {"units": one.units, "long_name": text, "im": one.label}
    dims = ("motion",) if intensity.ndim == 1 else ("block", "motion")
    measures, shaken = of_motions.result()
    labelled = label_runs(
        runs,
        asked,
        plain,
        measures,
        ("motion",),
        {"intensity": xr.Variable(dims, intensity, attributes)},
        {"design": "cloud", "im": one.label, **({} if ground is None else {"im_at": "ground"})},
        "Cloud analysis of freestanding blocks",
    )
    return with_screen(labelled, shaken, asked.runner.array)


def _sets(name: str, motions: Sequence[Motions], n: int) -> list[list[Record]]:
    """The plain records of each stripe."""
    if not isinstance(motions, list | tuple):
        raise TypeError(f"{name} must be a list of motions, one set a level, got {checks.kind(motions)}")
    sets = list(motions)
    if len(sets) != n:
        raise ValueError(f"{name} must hold one set of motions for each of the {n} levels, got {len(sets)}")
    found = []
    for i, one in enumerate(sets, start=1):
        try:
            found.append(records(one))
        except (TypeError, ValueError) as error:
            raise type(error)(f"{name}[{i}]: {error}") from None
    return found
