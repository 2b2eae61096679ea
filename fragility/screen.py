"""Validity screen: for every run, whether rocking is the right model of it, and what speaks against it.

Rigid rocking knows no sliding, no bouncing and no vertical shaking.  Nothing here changes a result: the screen stands
beside it, as variables that say what is needed and as reasons, one bit each.  Sentences are made of it in `notes`.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..models.friction import FixedFriction, Friction
from ..motions.arrays import Record
from ..motions.spectra import BAND_SHARES, energy_band
from ..units import HERTZ, STANDARD_GRAVITY
from .execution import Progress
from .intervals import wilson_half_width, wilson_interval
from .perturbed import PERTURBATION, Repeated, repeated
from .provenance import DESCRIBED, Motions, floor_of_each_motion, provenance_from, records_of, scale_factor
from .reasons import (
    ELASTIC_MODE,
    SCALED_FAR,
    SQUAT,
    UNDECIDED,
    Reason,
    Shares,
    labelled,
    reason_names,
    verdict_of,
)
from .runners import Runner, runner_of
from .slabs import Array, put, slabs
from .sliding import NEEDS, chances_of, compact, friction_by_block, needs_of, rising_peaks, slides_of

if TYPE_CHECKING:
    from distributed import Client

SQUAT_RATIO = 2.0
"""h/b below which bouncing decides (Lipscombe and Pellegrino 1993)."""
FACTORS = (0.2, 5.0)
"""Scale factors that pass: a convention; the bias grows with the factor without a step (Davalos and Miranda 2019)."""
HALF_WIDTH = 0.15
"""Half width of the 95 % Wilson interval of a probability of 1/2 that passes: 39 motions; FEMA P-695 takes 44."""

ORDER = (
    "squat",
    "friction_uplift",
    "friction_rocking_demand",
    "friction_impact",
    "friction_uplift_demand",
    "elastic_frequency",
    "scale_factor",
    "interval_half_width",
    "few_motions",
    "slides",
    "band_low",
    "band_high",
    "perturbed",
    "undecided",
    "undecided_lower",
    "undecided_upper",
    "verdict",
    "outside",
)
"""The variables of a screen, as they stand in results."""


def screen(
    runs: xr.Dataset,
    motions: Motions | None = None,
    friction: float | Friction | Mapping[str, float | Friction] | None = None,
    *,
    factors: tuple[float, float] = FACTORS,
    half_width: float = HALF_WIDTH,
    undecided: bool | float = False,
    client: Client | Runner | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Where rocking is the right model of a run, and where it is not.

    Parameters
    ----------
    runs : xarray.Dataset
        As `toppling.ida` (or `stripes`, or `cloud`) returns it.
    motions : xarray.DataArray or a sequence of them, optional
        The motions of the runs (of stripes, one set a stripe).  Without them neither uplift nor the motions' bands can
        be judged.
    friction : float, Friction or mapping, optional
        Coefficient of friction between block and floor: a number, a distribution (`toppling.models.friction`), or
        either for each block by its label.  Where not given, only a need above 1 counts as sliding.
    factors : (float, float)
        Least and greatest scale factor that pass, for motions that have an amplitude of their own (records, scenarios).
    half_width : float
        Greatest half width of the 95 % interval of a probability of 1/2 that passes.
    undecided : bool or float
        Whether, or for which share of the motions, flags are tested under perturbations (`flips`): up to four more
        runs for each.
    client, progress
        For those runs, as for `toppling.ida`.

    Returns
    -------
    xarray.Dataset
        On the dimensions that each depends on:

        - ``friction_uplift`` (block): b/h, needed at uplift; ``friction_uplift_demand`` (block, level, motion): needed
          up to the peak of the half-cycle in which the block uplifts, or by the peak of the motion where it does not;
          ``friction_rocking_demand`` (block, level, motion): needed by the peak of the motion while the block is
          nearly upright; ``friction_impact`` (block, model);
        - ``slides`` (block, model, level, motion), where friction is given: the probability that it is below the
          greatest of these, or whether it is;
        - ``squat`` (block); ``elastic_frequency`` (block, model), Hz, of laws with an elastic zone at rest;
          ``band_low`` and ``band_high`` (motion), Hz; ``scale_factor`` (level, motion), with block where it depends on
          it;
        - ``few_motions`` and ``interval_half_width``, of the floor or stripe with the fewest motions;
        - ``verdict`` (block, model, level, motion): 0 where nothing speaks against a run, else the sum of its reasons
          (`REASONS`; attributes flag_masks and flag_meanings); ``outside`` (block, model, reason): share of the runs
          for which each holds, of `any` one at least, of `undecided` among those tested;
        - where tested: ``perturbed`` (motion), which; ``undecided`` (block, model), the share of flags that flip, with
          ``undecided_lower`` and ``undecided_upper``, its 95 % Wilson interval.

    Raises
    ------
    TypeError, ValueError
        Runs of another kind, motions that are not those of the runs, a friction that is neither number nor
        distribution or is missing for a block, bounds out of order.

    Notes
    -----
    Vertical shaking is not modelled and cannot be screened for.

    The peak of the half-cycle that lifts the block comes when it has hardly turned: in that half-cycle its exact motion
    needs 0.98 to 1 of `friction_uplift_demand`.  The peak of the motion may come at any time: over whole histories of
    blocks with h/b >= 3, up to four times g b/h, the need is 0.68 to 1.02 of `friction_rocking_demand` (60 simulated
    motions).  Squat blocks may lose all pressure on the floor, which no friction makes good: they are `squat`.  Sliding
    counts where it is more likely than not; while rocking and at impact only for motions that exceed g b/h.

    The band of a motion holds the middle 90 % of its energy by frequency (`motions.spectra.energy_band`).  In an
    elastic mode inside it a block resonates and uplifts that should not.

    At n motions the Wilson interval of 1/2 has a half width of z/(2 sqrt(n + z²)).

    References
    ----------
    `friction_at_uplift`, `friction_at_impact`.  Lipscombe, P. R. and Pellegrino, S. (1993). Free rocking of prismatic
    blocks. Journal of Engineering Mechanics 119(7), 1387-1410.  Davalos, H. and Miranda, E. (2019). Evaluation of the
    scaling factor bias influence on the probability of collapse using Sa(T1) as the intensity measure. Earthquake
    Spectra 35(2).

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.catalogue["file-vertical-2-drawer"], tp.HousnerImpact(), shakes, [2.0, 9.8])
    >>> found = screen(runs, shakes, friction=0.5)
    >>> round(float(found["friction_uplift"][0]), 3), bool(found["squat"][0])
    (0.625, True)
    >>> found["verdict"].values[0, 0, :, 0].tolist()  # squat; at 1 g it slides, too
    [1, 7]
    """
    dims = _dims(runs)
    lowest, highest = (checks.number("factors", one, above=0.0) for one in factors)
    if lowest >= highest:
        raise ValueError(f"factors must be a least and a greatest one, got {lowest:g} and {highest:g}")
    bounds = Bounds((lowest, highest), checks.number("half_width", half_width, above=0.0, below=0.5))
    if isinstance(undecided, bool):
        share = float(undecided)
    else:
        share = checks.number("undecided", undecided, at_least=0.0, at_most=1.0)
    if motions is None and share > 0.0:
        raise ValueError("motions must be given where undecided runs are looked for: they are run again")
    if motions is not None and not isinstance(motions, xr.DataArray):
        motions = list(motions)
    plain = None if motions is None else records_of(runs, motions)
    runner = runner_of(client)
    again = repeated(runs, motions, share, runner, progress) if motions is not None and share > 0.0 else None
    shaken = None if plain is None else Shaken.by(plain)
    variables, settings = _screened(runs, dims, shaken, friction, bounds, again, runner.array)
    settings["tested"] = share
    return xr.Dataset(
        variables,
        coords={dim: runs[dim].variable for dim in dims if dim in runs.coords} | {"reason": reason_names()},
        attrs={
            "title": "Validity screen",
            **provenance_from("validity screen", settings, runs=runs),
            "screen": json.dumps(settings, ensure_ascii=False),
        },
    )


def with_screen(runs: xr.Dataset, shaken: Shaken | None, array: Array) -> xr.Dataset:
    """The runs with what the screen says without knowing the friction, and without running any of them again.

    The runs as they are where `shaken` is None: no screen was asked for.
    """
    if shaken is None:
        return runs
    variables, settings = _screened(runs, _dims(runs), shaken, None, Bounds(), None, array)
    told = json.dumps(settings, ensure_ascii=False)
    return runs.assign(variables).assign_coords(reason=reason_names()).assign_attrs(screen=told)


class Bounds(NamedTuple):
    """What passes: scale factors, and the half width of an interval."""

    factors: tuple[float, float] = FACTORS
    half_width: float = HALF_WIDTH


class Shaken(NamedTuple):
    """What the screen asks of the motions themselves: both ends of their bands, and their rising peaks."""

    low: xr.Variable
    high: xr.Variable
    rising: list[NDArray[np.float64]]

    @classmethod
    def by(cls, plain: list[Record]) -> Shaken:
        """That of all of them."""
        low, high = _bands(plain)
        return cls(low, high, rising_peaks(plain))

    def of(self, motions: slice) -> Shaken:
        """That of some of them."""
        return Shaken(self.low[motions], self.high[motions], self.rising[motions])


def _screened(
    runs: xr.Dataset,
    dims: tuple[str, ...],
    shaking: Shaken | None,
    friction: float | Friction | Mapping[str, float | Friction] | None,
    bounds: Bounds,
    again: Repeated | None,
    array: Array,
) -> tuple[dict[str, xr.Variable], dict[str, Any]]:
    """All that `screen` finds, and what it was asked; `again`: where runs were tested; `array`: a place for a variable.

    On plain variables: labelled arrays would look at their labels at every step, which costs more than the numbers.
    """
    available = friction_by_block(friction, [str(label) for label in runs["block"].values])
    known = all(isinstance(one, FixedFriction) for one in available)
    sizes = {dim: runs.sizes[dim] for dim in dims}
    found: dict[str, xr.Variable] = {} if again is None else _undecided(again, dims)
    shares = Shares(sizes)
    for where in slabs(sizes, ("block", "motion")):
        motions = where.get("motion", slice(None))
        variables, chances, holds = _of_slab(
            runs.isel(where),
            None if shaking is None else shaking.of(motions),
            available[where.get("block", slice(None))],
            bounds,
        )
        if friction is not None:
            variables["slides"] = slides_of(chances, known)
        if again is not None:
            holds[UNDECIDED] = again.flipped(where, dims)
        own = {dim: len(range(size)[where.get(dim, slice(None))]) for dim, size in sizes.items()}
        variables["verdict"] = verdict_of(own, holds)
        shares.add(holds, variables["verdict"], where)
        ordered = {name: one.transpose(*[dim for dim in dims if dim in one.dims]) for name, one in variables.items()}
        put(found, ordered, where, sizes, array)
    found["outside"] = shares.outside(found.get("undecided"))
    half = wilson_half_width(_fewest(runs))
    text = "half width of the 95 % interval of a probability of 1/2"
    found["interval_half_width"] = labelled(xr.Variable((), half), text)
    found["few_motions"] = labelled(
        xr.Variable((), half > bounds.half_width), f"whether that is above {bounds.half_width:g}"
    )

    described: Any = None
    if friction is not None and len(available) <= DESCRIBED:
        described = {str(label): one.description for label, one in zip(runs["block"].values, available, strict=True)}
    elif friction is not None:
        described = [json.loads(one) for one in sorted({json.dumps(one.description) for one in available})]
    return {name: found[name] for name in ORDER if name in found}, {
        "friction": described,
        "factors": list(bounds.factors),
        "half_width": bounds.half_width,
        "fewest_motions": _fewest(runs),
        "motions": shaking is not None,
        "tested": 0.0,
        "perturbation": PERTURBATION,
    }


def _of_slab(
    runs: xr.Dataset, shaking: Shaken | None, available: list[Friction], bounds: Bounds
) -> tuple[dict[str, xr.Variable], dict[Reason, xr.Variable], dict[Reason, xr.Variable]]:
    """What is found of some blocks and motions, their chances to slide, and for which runs each reason holds."""
    block = {name: runs[name].variable for name in ("width", "cm_height", "alpha", "p", "inertia_factor")}
    slenderness = block["cm_height"] / (0.5 * block["width"])
    factor = scale_factor(runs).variable
    peak = factor * runs["pga"].variable
    needs = needs_of(runs, slenderness, block["inertia_factor"], peak, None if shaking is None else shaking.rising)
    chances = chances_of(needs, available, peak * slenderness > STANDARD_GRAVITY)
    frequency = _elastic_frequency(runs, block)
    variables = {
        "squat": labelled(slenderness < SQUAT_RATIO, SQUAT.text),
        "friction_uplift": labelled(1.0 / slenderness, "coefficient of friction needed at uplift: b/h"),
        **{NEEDS[reason][0]: labelled(compact(need), NEEDS[reason][1]) for reason, need in needs.items()},
        "elastic_frequency": labelled(frequency, "frequency of the law's elastic mode", HERTZ),
        "scale_factor": labelled(factor, "scale factor of the motion"),
    }
    far = (factor < bounds.factors[0]) | (factor > bounds.factors[1])
    holds = {
        SQUAT: variables["squat"],
        **{reason: chance > 0.5 for reason, chance in chances.items()},
        SCALED_FAR: far & _own_amplitude(runs),
    }
    if shaking is not None:
        variables |= {"band_low": shaking.low, "band_high": shaking.high}
        holds[ELASTIC_MODE] = (frequency >= shaking.low) & (frequency <= shaking.high)
    return variables, chances, holds


def _outputs(runs: xr.Dataset) -> Iterator[str]:
    """The variables that hold something of every run."""
    return (str(name) for name, one in runs.data_vars.items() if {"block", "model", "motion"} <= {*one.dims})


def _dims(runs: xr.Dataset) -> tuple[str, ...]:
    """Dimensions of the runs in their usual order; TypeError where these are no runs."""
    found = next(_outputs(runs), None) if isinstance(runs, xr.Dataset) else None
    missing = {"width", "cm_height", "alpha", "p", "inertia_factor", "e", "delta", "rest", "pga"}
    if found is None or not missing <= {*runs.coords}:
        raise TypeError("runs must be a dataset of runs with its coordinates, as toppling.ida returns it")
    dims = {str(dim) for dim in runs[found].dims}
    if not dims <= {"block", "model", "level", "motion"}:
        raise ValueError(f"runs must be on block, model, motion and possibly level, got dims {runs[found].dims}")
    return tuple(dim for dim in ("block", "model", "level", "motion") if dim in dims)


def _bands(plain: list[Record]) -> list[xr.Variable]:
    """Both ends of the band of each motion, Hz."""
    bands = np.array([energy_band(record.acceleration, record.dt) for record in plain])
    return [
        labelled(
            xr.Variable(("motion",), values),
            f"frequency below which {100.0 * share:g} % of the energy of the motion lie",
            HERTZ,
        )
        for values, share in zip(bands.T, BAND_SHARES, strict=True)
    ]


def _elastic_frequency(runs: xr.Dataset, block: Mapping[str, xr.Variable]) -> xr.Variable:
    """Of laws that rest in an elastic zone: p sqrt((1/delta - 1) sin(alpha)/alpha)/(2 pi), Hz; NaN of others."""
    alpha = block["alpha"]
    elastic = runs["rest"].variable != "rigid"
    stiffness = (1.0 / runs["delta"].variable - 1.0) * (alpha.copy(data=np.sin(alpha.values)) / alpha)
    frequency = block["p"] * stiffness.copy(data=np.sqrt(stiffness.values)) / (2.0 * np.pi)
    found: xr.Variable = xr.apply_ufunc(np.where, elastic, frequency, np.nan)
    return found.transpose("block", "model")


def _own_amplitude(runs: xr.Dataset) -> xr.Variable:
    """Which motions have an amplitude that means something: (motion,), all where nothing is said."""
    if "own_amplitude" in runs.coords:
        found: xr.Variable = runs["own_amplitude"].variable.astype(bool)
        return found
    return xr.Variable(("motion",), np.ones(runs.sizes["motion"], np.bool_))


def _fewest(runs: xr.Dataset) -> int:
    """Motions of the floor and stripe that has the fewest."""
    stripes = runs["stripe"].values.tolist() if "stripe" in runs.coords else [0] * runs.sizes["motion"]
    return min(Counter(zip(floor_of_each_motion(runs), stripes, strict=True)).values(), default=0)


def _undecided(again: Repeated, dims: tuple[str, ...]) -> dict[str, xr.Variable]:
    """The share of flags that flip among those tested, and its interval as if runs were independent."""
    each = tuple(dim for dim in dims if dim in ("block", "model"))
    flipped = np.stack([np.count_nonzero(one > 0, axis=tuple(range(1, one.ndim))) for one in again.counts])
    n = np.full(flipped.shape, math.prod(again.counts.shape[2:]))
    lower, upper = wilson_interval(flipped, n)
    return {
        "perturbed": labelled(
            xr.Variable("motion", again.chosen), "whether the runs of the motion were run again, perturbed"
        ),
        "undecided": labelled(xr.Variable(each, flipped / n), "share of the flags tested that a millionth flips"),
        "undecided_lower": labelled(xr.Variable(each, lower), "lower end of its 95 % Wilson interval"),
        "undecided_upper": labelled(xr.Variable(each, upper), "upper end of its 95 % Wilson interval"),
    }
