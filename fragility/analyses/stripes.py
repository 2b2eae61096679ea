"""Multiple-stripe analysis: every motion is run once, at the level of its stripe."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Progress
from ...core.doubts import warn
from ...core.parameters import USUAL_MEASURE
from ...core.units import described
from ...models import Block, Model
from ...motions.arrays import AS_GIVEN, RECORD, Record, other_coordinates, records
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.polarity import AS_RECORDED, arrays_under
from ...motions.selection.select import Selection
from ..runs.factors import dense, unscaled
from ..runs.labels import measured
from ..runs.provenance import STRIPES
from ..runs.request import check_request
from ..runs.runners import Workers
from ..runs.scaling import Scaling, ground_of, increasing, intensity_measure, scaling
from ..validity.plausibility import stripe_doubts
from .analysis import Design, analyse, specimens_of

Motions = xr.DataArray | Iterable[xr.DataArray] | Selection
AT_LEVEL = 1e-9
"""Relative difference between the level of a selection and the level of its stripe that counts as rounding."""


def stripes(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: Sequence[Motions],
    levels: Any,
    im: str | Measure = USUAL_MEASURE,
    outputs: Sequence[str] | None = None,
    client: Workers = None,
    *,
    screen: bool = True,
    scale: bool = True,
    ground: Sequence[Motions] | None = None,
    polarity: str = AS_RECORDED,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Multiple-stripe analysis: motions that differ from level to level, as selected consistently with the hazard.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : sequence of motions or of sequences of them
        The motions of each level (m s-2), or a `toppling.motions.Selection` for it, which must agree with the hazard.
        The `motions` of a selection are accepted even if they do not agree. A motion may be in several stripes.
    levels : array_like, shape (level,)
        Level of each stripe, SI, > 0, strictly increasing.
    im : str or Measure
        The intensity measure of the levels, as for `toppling.ida`.
    outputs, client, screen, polarity, progress
        As for `toppling.ida`.
    scale : bool
        True (default) scales every motion of a stripe to its level. False runs the motions as they are, because they
        were selected or simulated for that level and scatter about it. Motions with another measure cause a warning
        (`toppling.core.doubts.ImplausibleInput`); in studies they are an error.
    ground : sequence of motions or of sequences of them, optional
        For each stripe the ground motions of which `motions` are floor motions: the levels then refer to the measure of
        the ground motions.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, motion). Coordinates on motion are `intensity` (the level of the motion's stripe),
        `stripe` (1, 2, …) and `record` (its label as given). If a motion is in several stripes, the stripe is added to
        the labels of the dimension. `overturning_probability` counts the runs by level.

    Notes
    -----
    Because motions differ between stripes, stripes are independent of each other, whereas the levels of an incremental
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
    request = check_request(blocks, models, outputs, True, client, progress, screen)
    checks.flag("scale", scale)
    values = increasing(levels, intensity_measure(im))
    _check_selections(motions, values, im)
    arrays, sets = _sets("motions", motions, values.size, polarity)
    below = [None] * values.size if ground is None else _sets("ground", ground, values.size, polarity)[1]
    plain = [record for members in sets for record in members]
    scalings = stripe_scalings(values, sets, im, request.blocks, below, scale)
    scaled = _joined(scalings)
    stripe = np.repeat(np.arange(1, values.size + 1), [len(members) for members in sets])
    names, given = [record.label for record in plain], [record.given for record in plain]
    if len(set(names)) < len(names):
        plain = [record._replace(label=f"{record.label}, stripe {k}") for record, k in zip(plain, stripe, strict=True)]
    attributes = {"units": scaled.units, "long_name": scaled.long_name, "im": scaled.name}
    intensity = xr.Variable("motion", values[stripe - 1], attributes)
    design = Design(
        STRIPES,
        "Multiple-stripe analysis of freestanding blocks",
        plain,
        scaled.factors,
        scaled.factors_at(intensity, len(plain)) if scale else unscaled(len(plain)),
        {"motion": len(plain)},
        {
            "intensity": intensity,
            "stripe": xr.Variable("motion", stripe, described("stripe")),
            RECORD: xr.Variable("motion", np.array(given, dtype=object), AS_GIVEN),
            **measured(scaled),
        },
        {
            "design": STRIPES,
            "im": scaled.name,
            "levels": values.tolist(),
            "scale": scale,
            **({"im_at": GROUND} if scaled.ground else {}),
        },
        other_coordinates(arrays),
    )
    return analyse(request, specimens_of(request), design)


def stripe_scalings(
    levels: Array,
    sets: Sequence[Sequence[Record]],
    im: str | Measure,
    blocks: Sequence[Block],
    below: Sequence[Sequence[Record] | None],
    scale: bool,
) -> list[Scaling]:
    """Return the scaling of each stripe to its level; motions that are run as they are are doubted if far from it."""
    scalings = []
    for level, motions, earth in zip(levels, sets, below, strict=True):
        # (motions of floors that yield belong to their level, and are taken as they are)
        shaking = motions if scale else [motion._replace(own_level=False) for motion in motions]
        scalings.append(scaling([level], shaking, im, blocks, None if earth is None else ground_of(shaking, earth)))
    if scale:
        return scalings
    measured = [1.0 if scaled.measured is None else scaled.measured for scaled in scalings]
    warn(stripe_doubts(scalings[0].name, zip(levels, measured, strict=True)))
    return [
        scaled._replace(factors=np.ones((1, 1, len(sequence)))) for scaled, sequence in zip(scalings, sets, strict=True)
    ]


def _check_selections(motions: Any, levels: Array, im: str | Measure) -> None:
    """Raise ValueError for a selection of another level or measure, or one that does not agree with the hazard."""
    chosen = list(motions) if isinstance(motions, list | tuple) else []
    if not any(isinstance(stripe, Selection) for stripe in chosen):
        return
    measure = intensity_measure(im)
    if not all(isinstance(stripe, Selection) for stripe in chosen):
        raise TypeError("motions must all be selections, or none of them")
    for i, (selection, level) in enumerate(zip(chosen, levels, strict=False), start=1):
        given, at = selection.report.attrs["given"], selection.report.attrs["level"]
        if measure is None or measure.label != given:
            raise ValueError(f"motions[{i}] is selected for levels of {given}, im must be that, got {im!r}")
        if abs(at / level - 1.0) > AT_LEVEL:
            raise ValueError(f"motions[{i}] is selected for {given} = {at:g}, its level is {level:g}")
        if not selection.consistent:
            raise ValueError(
                f"motions[{i}] is not hazard-consistent ({selection.why}): select from other candidates, leave the "
                "level out, or give its motions as they are"
            )


def _joined(scalings: Sequence[Scaling]) -> Scaling:
    """The scaling of all stripes: factors and measured values of one stripe after the other, along motions."""
    first = scalings[0]
    values = [scaling.measured for scaling in scalings if scaling.measured is not None]
    return first._replace(
        factors=np.concatenate([dense(scaling.factors) for scaling in scalings], axis=2),
        measured=np.concatenate(values, axis=-1) if values else None,
    )


def _sets(
    name: str, motions: Sequence[Motions], n: int, polarity: str
) -> tuple[list[xr.DataArray], list[list[Record]]]:
    """The arrays of all stripes, and the plain records of each."""
    if not isinstance(motions, list | tuple):
        raise TypeError(f"{name} must be a list of motions, one set a level, got {checks.kind(motions)}")
    sets = list(motions)
    if len(sets) != n:
        raise ValueError(f"{name} must hold one set of motions for each of the {n} levels, got {len(sets)}")
    every, records_by_stripe = [], []
    for i, members in enumerate(sets, start=1):
        try:
            arrays = arrays_under(members.motions if isinstance(members, Selection) else members, polarity)
            records_by_stripe.append(records(arrays))
        except (TypeError, ValueError) as error:
            raise type(error)(f"{name}[{i}]: {error}") from None
        every += arrays
    return every, records_by_stripe
