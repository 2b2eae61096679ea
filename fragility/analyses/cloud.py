"""Cloud analysis: every motion is run once, unscaled."""

from collections.abc import Iterable, Sequence

import xarray as xr

from ...core.aliases import Progress
from ...core.parameters import USUAL_MEASURE
from ...models import Block, Model
from ...motions.arrays import other_coordinates, records
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.polarity import AS_RECORDED, arrays_under, records_under
from ..runs.factors import unscaled
from ..runs.provenance import CLOUD
from ..runs.request import check_request
from ..runs.runners import Workers
from ..runs.scaling import SCALE, ground_of, intensities, intensity_measure, name_at, scaling
from .analysis import Design, analyse, specimens_of

Motions = xr.DataArray | Iterable[xr.DataArray]


def cloud(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: Motions,
    im: str | Measure = USUAL_MEASURE,
    outputs: Sequence[str] | None = None,
    client: Workers = None,
    *,
    screen: bool = True,
    ground: Motions | None = None,
    polarity: str = AS_RECORDED,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Cloud analysis: every motion is run once, unscaled.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2); nothing is scaled.
    im : str or Measure
        The intensity measure of the runs: any but ``scale``.
    outputs, client, screen, polarity, progress
        As for `toppling.ida`.
    ground : xarray.DataArray or a sequence of them, optional
        Ground motions from which the floor motions `motions` were computed: the measure is then the ground motions'
        own.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, motion), with the measure as coordinate `intensity`: on motion, or on (block,
        motion) if it depends on the block.

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
    request = check_request(blocks, models, outputs, True, client, progress, screen)
    arrays = arrays_under(motions, polarity)
    plain = records(arrays)
    at = plain if ground is None else ground_of(plain, records_under(ground, polarity))
    measure = intensity_measure(im)
    if measure is None:
        raise ValueError(f"im must be a measure of the motions in a cloud analysis, got {im!r}")
    values = intensities(measure, at, request.blocks)
    scaled = scaling([1.0], plain, SCALE)
    long_name = name_at(measure.long_name, plain, None if ground is None else at)
    attributes = {"units": measure.units, "long_name": long_name, "im": measure.label}
    dims = ("motion",) if values.ndim == 1 else ("block", "motion")
    design = Design(
        CLOUD,
        "Cloud analysis of freestanding blocks",
        plain,
        scaled.factors,
        unscaled(len(plain)),
        {"motion": len(plain)},
        {"intensity": xr.Variable(dims, values, attributes)},
        {"design": CLOUD, "im": measure.label, **({} if ground is None else {"im_at": GROUND})},
        other_coordinates(arrays),
    )
    return analyse(request, specimens_of(request), design)
