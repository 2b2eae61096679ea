"""Pooled analysis: curves of all blocks of a region at once, from single runs of a few blocks of the analysis' own."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import xarray as xr

from ...core import checks
from ...core.aliases import Progress
from ...core.doubts import warn
from ...core.parameters import USUAL_MEASURE, Parameter
from ...core.units import provenance
from ...core.wording import counted
from ...models import Block, Law
from ...models.block_array import BlockArray
from ...models.laws import describe_law
from ...models.plausibility import block_doubts
from ...models.sliding.law import SlidingLaw
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND
from ...motions.polarity import AS_RECORDED
from ...motions.simulated.generator import Generator
from ..adaptive.rate import check_hazard
from ..adaptive.stopping import ALL_FELL, NONE_FELL
from ..adaptive.until import MEDIAN, Until, until_of
from ..hazard.curve import HazardCurve
from ..runs.request import check_request
from ..runs.runners import Workers
from ..runs.scaling import BlockMeasure
from ..surfaces.domain import domain_of, some_points
from ..surfaces.evaluation import LawSurfaces, curves_at
from ..surfaces.sequential import PooledCurves
from .region_runs import PooledPlan, PooledRuns, blocks_at, own_options, with_own
from .surface_results import POOLED, surface_curves, surface_dataset, variables_of
from .waves import MotionSource, scaled_to

BLOCKS_A_MOTION = 16
A_MOTION = Parameter(at_least=1, at_most=256)
MOST = 20_000
"""Maximum number of motions unless `until` gives one."""
BAND_POINTS = 400
"""Blocks at which the band of all medians is determined, evenly among those given; and the corners of the region."""


def pooled(
    blocks: Block | Sequence[Block] | BlockArray,
    models: Law | Sequence[Law],
    motions: Generator | xr.DataArray | Iterable[xr.DataArray],
    im: str | Measure = USUAL_MEASURE,
    until: Mapping[str, Any] | Until | None = None,
    client: Workers = None,
    *,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    hazard: HazardCurve | None = None,
    blocks_per_motion: int = BLOCKS_A_MOTION,
    seed: int = 0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Fragility curves of many free-standing blocks from one surface for each law.

    Parameters
    ----------
    blocks : Block, sequence of them, or BlockArray
        Free-standing blocks on a rigid floor. A `BlockArray` may have a million, and e and delta of each block instead
        of the laws' e and delta.
    models : one or a sequence
        Damping laws, with unique labels.
    motions : Generator, or xarray.DataArray or a sequence of them
        One horizontal component, with a vertical one or without; taken in waves until the medians are known.
    im : str or Measure
        Measure to which motions are scaled, or ``scale``; not one that depends on the block.
    until : mapping, optional
        ``median``: half width, as a share (0.1), at which `half_level` of *all* blocks is known at once with 95 %
        confidence. ``motions``: a mapping of `least` (64) and ``most`` (20,000).
    client : distributed.Client, optional
        As of `toppling.ida`.
    ground, polarity : optional
        As of `toppling.ida`.
    hazard : HazardCurve, optional
        Of the measure; then annual rates are found, too.
    blocks_per_motion : int
        Runs of each motion, each of another block of the region, 1 to 256: more if motions take long to make.
    seed : int
        Of the generator's motions (or their order), of the blocks and the levels.
    progress : callable, optional
        Called with (runs done, runs expected) after every wave.

    Returns
    -------
    xarray.Dataset
        On (block, model): `half_level`, `half_level_lower` and `half_level_upper`, which are valid for all blocks at
        once. Further `median` and `dispersion` of the lognormal curve through all runs; with a hazard `rate`. On model:
        `stopped_because`, `account`, `half_width`, `motions_run`, `lack_of_fit` and `check_p_value`. On (model, check):
        differences from the surface of medians of blocks without runs in the fit. The surfaces, from which
        `surface_curves` returns the curves of further blocks in the same region. On pooled_run: the runs. A function of
        the arguments alone: neither of chunks nor of workers.

    Raises
    ------
    TypeError, ValueError
        Blocks with a wall, a restraint, a bed, an offset or a lean. Blocks with their own e or delta under laws that
        have none or give e. Sliding. Pairs of components. Motions of several floors. A target other than the median.
        Nothing or everything overturns at all levels tried. Too few motions for a surface.

    Notes
    -----
    ln(median) over the measure's unit g tan(alpha) and ln(dispersion) are polynomials in ln p, ln tan(alpha) and the
    inertia factor, as far as these vary. If blocks have their own e and delta, also in e and ln delta. Their total
    degrees are 4 and 2 at first (3 and 2 with more than three variables) and 6 and 4 at most. A degree is raised if
    Wald's test with the motions as clusters requires it, and if the check does. Blocks are near D-optimal in the convex
    hull of the given blocks. Medians are fitted to runs near them alone, with the dispersions of the curve through all
    runs times one factor. The check runs 24 blocks under fresh motions (of a set: under the same).

    The region is cut across one of the variables, at the place of maximum likelihood, if Wald's test finds a jump of
    the medians there. A cut is tried if higher degrees do not remove a difference beyond chance, or if the runs are
    likelier with a jump. It stays if 24 other blocks under further motions differ less from the surface with it than
    from one without; half of them lie next to it. If the runs do not decide the side of a block, its interval includes
    both sides. The remaining difference is added to every interval and is named in `account`.

    Blocks that are close to each other fall together more often than their curves predict. The number that fall in one
    event cannot be found from this result, but from runs of a sample of them under common motions (`joint_falls`).

    References
    ----------
    Liang, K.-Y. and Zeger, S. L. (1986). Longitudinal data analysis using generalized linear models. Biometrika 73,
    13-22.  Montiel Olea, J. L. and Plagborg-Møller, M. (2019). Simultaneous confidence bands. Journal of Applied
    Econometrics 34, 1-17.  Hansen, B. E. (2000). Sample splitting and threshold estimation. Econometrica 68, 575-603.

    Examples
    --------
    >>> import toppling as tp
    >>> shelves = [tp.Block(0.3, height) for height in (1.2, 1.5, 1.8, 2.1)]
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01)
    >>> curves = pooled(shelves, tp.HousnerImpact(), shakes, until={"median": 0.25})
    >>> dict(curves["half_level"].sizes), curves["stopped_because"].values.tolist()
    ({'block': 4, 'model': 1}, ['precision reached'])
    """
    checks.callback("progress", progress)
    columns = BlockArray.of(blocks)
    source = MotionSource(motions, seed, ground, polarity)
    plan = checked_plan(columns, models, source, im, until, blocks_per_motion, hazard, client)
    variables = variables_of(columns)
    points = plan.domain.points(variables)
    given = some_points(plan.domain, points, BAND_POINTS)
    warn(block_doubts(columns))
    laws = [PooledCurves(plan.until, given, plan.seed) for _ in plan.laws]
    runs = PooledRuns(plan, laws, points, progress)
    checked = runs.until_known()
    for law, curves_of_law in zip(plan.laws, laws, strict=True):
        if curves_of_law.stopped in (NONE_FELL, ALL_FELL):
            raise ValueError(
                f"{curves_of_law.stopped} of {law.label} at all levels tried: give motions that shake, or another im"
            )
        if curves_of_law.near is None:
            raise ValueError(
                f"{counted(curves_of_law.motions, 'motion')} of {counted(blocks_per_motion, 'block')} each are too few "
                f"for a surface of {law.label}: allow more motions, or run more blocks under each"
            )
    known = [
        LawSurfaces(law.near, law.curve, law.band().factor, check.worst)
        for law, check in zip(laws, checked, strict=True)
        if law.near is not None and law.curve is not None
    ]
    if hazard is not None:
        unit = runs.unit(runs.check_points)
        curves = [curves_at(fitted, runs.check_points, unit, hazard.pieces()[0]) for fitted in known]
        known = [fitted._replace(rates=plane) for fitted, plane in zip(known, runs.rates(curves), strict=True)]
    surface = surface_dataset(plan, runs, known, checked)
    described = {
        "design": POOLED,
        "models": [describe_law(law) for law in plan.laws],
        **({"own": list(plan.varied)} if plan.varied else {}),
        "blocks": len(columns),
        **plan.source.describe(),
        "im": plan.scaled.name,
        "until": plan.until.describe(),
        "blocks_per_motion": blocks_per_motion,
        "seed": seed,
        **({"hazard": hazard.describe()} if hazard is not None else {}),
        **({"im_at": GROUND} if ground is not None else {}),
    }
    surface = surface.assign_attrs(
        title="Pooled analysis of free-standing blocks", design=POOLED, im=plan.scaled.name, **provenance(described)
    )
    return surface.merge(surface_curves(surface, columns, hazard), combine_attrs="override")


def checked_plan(
    columns: BlockArray,
    models: Law | Sequence[Law],
    source: MotionSource,
    im: str | Measure,
    until: Mapping[str, Any] | Until | None,
    blocks_per_motion: int = BLOCKS_A_MOTION,
    hazard: HazardCurve | None = None,
    client: Workers = None,
) -> PooledPlan:
    """Check the arguments of `pooled`, and lay out the region of the blocks; errors as there."""
    domain = domain_of(variables_of(columns))
    given = models if checks.is_several(models) else [models]
    if any(isinstance(model, SlidingLaw) for model in given):
        raise ValueError("pooled curves are of blocks that rock: sliding ones differ in other numbers")
    request = check_request(blocks_at(domain, domain.vertices[:1]), models, ["overturned"], True, client, None)
    laws = [model for model in request.models if isinstance(model, Law)]
    varied = tuple(columns.own)
    for law, name in product(laws, varied):
        if name not in law.options:
            raise ValueError(f"blocks have {name} of their own, and {law.label!r} has none: leave it out, or the law")
        if name == "e" and law.options["e"] is not None:
            raise ValueError(f"e must be left out of laws where blocks have their own, got {law.label!r}")
    options = own_options(domain, domain.vertices, varied)
    for block, option in zip(blocks_at(domain, domain.vertices), options, strict=True):
        for law in laws:
            # blocks outside the range of every law, such as an e_R below 0, must be an error before the runs
            with_own(law, option).oscillator(block)
    scaled = scaled_to(im)
    if isinstance(scaled.intensity, BlockMeasure):
        raise ValueError(f"im must not depend on the block, got {scaled.name}: give {scaled.intensity.measure.label}")
    asked = until
    if not isinstance(until, Until):
        aims = dict(until or {}) if isinstance(until, Mapping) or until is None else until
        if isinstance(aims, dict) and isinstance(aims.get("motions", {}), Mapping):
            aims["motions"] = {"most": MOST, **aims.get("motions", {})}
        asked = aims
    goal = until_of(asked)
    if goal.target != MEDIAN:
        raise ValueError(f"until must name the median for pooled curves, got {goal.target}")
    A_MOTION.check("blocks_per_motion", blocks_per_motion, int)
    most = source.most(goal)
    plan = PooledPlan(request, laws, scaled, source, most, domain, goal, blocks_per_motion, source.seed, hazard, varied)
    if hazard is not None:
        check_hazard(hazard, scaled.name)
    return plan
