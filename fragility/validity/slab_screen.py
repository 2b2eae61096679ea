"""The screen of runs, slab by slab: of runs on block, model, level and motion, or of runs in a table."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Index
from ...core.units import HERTZ, STANDARD_GRAVITY
from ...models.friction import Contact, FixedFriction, Friction, friction_at_impact
from ...models.runs import leaves_floor
from ...motions.arrays import DOWNWARD, POLARITY, RECORD
from ..numerics.proportions import wilson_half_width
from ..numerics.slabs import RUNS, Allocator, Where, put, slabs
from ..runs.factors import ScaleFactors
from ..runs.provenance import BED, DESCRIBED, FLOORS, RUN, floor_labels, scale_factors
from .characteristics import Characteristics
from .friction_demand import NEEDS, chance_below, compact, friction_by_block, friction_demands, slides_of
from .reasons import (
    AIRBORNE,
    ELASTIC_MODE,
    SCALED_FAR,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SQUAT,
    UNDECIDED,
    Reason,
    Shares,
    labelled,
    verdict_of,
)
from .undecided import PERTURBATION, FlipCounts, RunFlips

SQUAT_RATIO = 2.0
"""h/b below which bouncing decides (Lipscombe and Pellegrino 1993)."""
FACTORS = (0.2, 5.0)
"""Scale factors that pass: a convention; the bias grows with the factor without a step (Davalos and Miranda 2019)."""
HALF_WIDTH = 0.15
"""Half width of the 95 % Wilson interval of a probability of 1/2 that passes: 39 motions; FEMA P-695 takes 44."""

DIMS = ("block", "model", "level", "motion")
"""Dimensions of runs at common levels, or of one level a motion, in order."""
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
    "undecided_tested",
    "verdict",
    "outside",
)
"""The variables of a screen, in their order in results."""


class ScreenInput(NamedTuple):
    """Properties of runs that the screen needs, as plain variables: of all runs, or of some blocks and motions.

    `sizes`: of the dimensions of the runs, in order. `coordinates`: of blocks, laws and motions, by name (all of
    `NEEDED`, some of `OPTIONAL`). `factors`: scale factors of the motions. `places` (run,): of the block, the law and
    the motion of each run in a table, for runs that do not lie on these dimensions.
    """

    sizes: dict[str, int]
    coordinates: Mapping[str, xr.Variable]
    factors: ScaleFactors
    places: Mapping[str, Index] | None = None

    @property
    def lifted(self) -> bool:
        """True if the motions have a vertical component, too."""
        return DOWNWARD in self.coordinates

    def slabs(self) -> Iterator[Where]:
        """Yield the bounds of slabs of runs."""
        if self.places is None:
            yield from slabs(self.sizes, ("block", "motion"))
            return
        for first in range(0, self.sizes[RUN], RUNS):
            yield {RUN: slice(first, min(first + RUNS, self.sizes[RUN]))}

    def part(self, where: Where) -> "ScreenInput":
        """Return the input for the runs of a slab."""
        return ScreenInput(
            {dim: len(range(size)[where.get(dim, slice(None))]) for dim, size in self.sizes.items()},
            {name: variable.isel(where, missing_dims="ignore") for name, variable in self.coordinates.items()},
            self.factors.part(where),
            None if self.places is None else {dim: at[where[RUN]] for dim, at in self.places.items()},
        )

    def on_runs(self, values: xr.Variable) -> xr.Variable:
        """Return values of blocks, laws and motions for the runs of a table; unchanged for others."""
        if self.places is None:
            return values
        return values.isel({dim: xr.Variable(RUN, at) for dim, at in self.places.items()}, missing_dims="ignore")

    @property
    def fewest_motions(self) -> int:
        """Number of motions, those run both ways once, of the floor and stripe, or the curve, that has the fewest."""
        known, n = self.coordinates, self.coordinates["pga"].sizes["motion"]
        names = known[RECORD].values.tolist() if POLARITY in known else range(n)
        if self.places is not None:
            numbers = {name: k for k, name in enumerate(dict.fromkeys(names))}
            motion = np.array([numbers[name] for name in names])[self.places["motion"]]
            curves = np.unique(np.stack([self.places["block"], self.places["model"], motion]), axis=1)[:2]
            return int(np.unique(curves, axis=1, return_counts=True)[1].min())
        stripes = known["stripe"].values.tolist() if "stripe" in known else [0] * n
        motions = set(zip(floor_labels(known, n), stripes, names, strict=True))
        return min(Counter(of_motion[:2] for of_motion in motions).values(), default=0)


NEEDED = ("width", "cm_height", "alpha", "p", "inertia_factor", "e", "delta", "rest", "pga")
"""Coordinates without which runs cannot be screened."""
OPTIONAL = (BED, POLARITY, RECORD, "own_amplitude", "stripe", DOWNWARD, *FLOORS)
"""Coordinates that the screen takes into account if runs have them."""


def screen_input(runs: xr.Dataset) -> ScreenInput:
    """Read the properties of labelled runs from their coordinates and attributes."""
    dims = _dims(runs)
    return ScreenInput({dim: runs.sizes[dim] for dim in dims}, known_coordinates(runs), scale_factors(runs))


def known_coordinates(runs: xr.Dataset) -> dict[str, xr.Variable]:
    """Return the coordinates of runs that the screen needs, and those that it takes into account if there are."""
    names = ["block", *NEEDED, *(name for name in OPTIONAL if name in runs.coords)]
    # (they are small: those that were read in chunks are loaded)
    return {name: runs[name].variable.compute() for name in names}


class ScreenRequest(NamedTuple):
    """Request for a screen of runs: friction and limits as of `screen`, and the share of the motions tested."""

    friction: float | Friction | Contact | Mapping[str, float | Friction | Contact] | None = None
    factors: tuple[float, float] = FACTORS
    half_width: float = HALF_WIDTH
    undecided: float = 0.0


Screened = tuple[dict[str, xr.Variable], dict[str, Any]]
"""The variables of a screen and its settings, plain values."""
Keep = Callable[[dict[str, xr.Variable], dict[str, xr.Variable], Where], None]
"""Puts the kept variables of a slab into the variables of all runs."""


def screened_runs(
    given: ScreenInput,
    shaking: Characteristics | None,
    asked: ScreenRequest,
    flips: FlipCounts | RunFlips | None,
    array: Allocator,
    shares: Shares | None = None,
) -> Screened:
    """Return the screen with every variable: `array` allocates those with a value for every run."""
    sizes, dims = given.sizes, tuple(given.sizes)

    def keep(kept: dict[str, xr.Variable], variables: dict[str, xr.Variable], where: Where) -> None:
        put(kept, ordered(variables, dims), where, sizes, array)

    screened, settings = screened_slabs(given, shaking, asked, flips, keep, shares)
    return {name: screened[name] for name in ORDER if name in screened}, settings


def screened_slabs(
    given: ScreenInput,
    shaking: Characteristics | None,
    asked: ScreenRequest,
    flips: FlipCounts | RunFlips | None,
    keep: Keep,
    shares: Shares | None = None,
) -> Screened:
    """Screen runs slab by slab, and return the kept variables.

    flips: of the runs that were repeated under perturbations; shares: of which runs the shares are, all by default.
    The screen works on plain variables, because labelled arrays compare their labels at every step, which takes longer
    than the arithmetic.
    """
    labels = [str(label) for label in given.coordinates["block"].values]
    available = friction_by_block(asked.friction, labels)
    known = all(isinstance(coefficient, FixedFriction) for coefficient in available)
    sizes, dims = given.sizes, tuple(given.sizes)
    kept: dict[str, xr.Variable] = {}
    counts = Shares(sizes) if shares is None else shares
    for where in given.slabs():
        part = given.part(where)
        shaken = None if shaking is None else shaking.part(where.get("motion", slice(None)))
        friction = available[where.get("block", slice(None))]
        variables, chances, holds = _screen_slab(part, shaken, friction, asked.factors)
        if flips is not None:
            holds[UNDECIDED] = flips.flipped(where, dims)
        variables["verdict"] = verdict_of(part.sizes, holds)
        if asked.friction is not None:
            variables["slides"] = slides_of(chances, known)
        counts.add(holds, variables["verdict"], where)
        keep(kept, variables, where)
    if flips is not None:
        kept |= flips.variables(dims)
    kept["outside"] = counts.outside(kept.get("undecided"))
    fewest = given.fewest_motions
    settings = {
        "friction": described_friction(asked.friction, available, labels),
        "factors": list(asked.factors),
        "half_width": asked.half_width,
        "fewest_motions": fewest,
        "motions": shaking is not None,
        "tested": asked.undecided,
        "tested_runs": 0 if flips is None else flips.tested,
        "perturbation": PERTURBATION,
        **({"vertical": True} if given.lifted else {}),
    }
    return kept | few_motions(fewest, asked.half_width), settings


def described_friction(friction: Any, available: Sequence[Friction], labels: Sequence[str]) -> Any:
    """Return the friction of the blocks as plain values; None if it is not known."""
    if friction is None:
        return None
    if len(available) <= DESCRIBED:
        return {label: friction.description for label, friction in zip(labels, available, strict=True)}
    return distinct(friction.description for friction in available)


def distinct(descriptions: Iterable[Any]) -> list[Any]:
    """Return each of many plain values once, in the order of their JSON."""
    return [json.loads(text) for text in sorted(set(map(json.dumps, descriptions)))]


def ordered(variables: Mapping[str, xr.Variable], dims: tuple[str, ...]) -> dict[str, xr.Variable]:
    """Return variables with their dimensions in the order of `dims`, then others."""
    return {name: variable.transpose(*dims, ..., missing_dims="ignore") for name, variable in variables.items()}


def few_motions(fewest: int, widest: float) -> dict[str, xr.Variable]:
    """Return the variables on the number of motions; `fewest`: of the floor with the fewest."""
    half = wilson_half_width(fewest)
    text = "half width of the 95 % interval of a probability of 1/2"
    few = f"whether interval_half_width is above {widest:g}"
    return {
        "interval_half_width": labelled(xr.Variable((), half), text),
        "few_motions": labelled(xr.Variable((), half > widest), few),
    }


def _screen_slab(
    given: ScreenInput, shaking: Characteristics | None, available: list[Friction], bounds: tuple[float, float]
) -> tuple[dict[str, xr.Variable], dict[Reason, xr.Variable], dict[Reason, xr.Variable]]:
    """Return the variables of some blocks and motions, their probabilities of sliding, and flags of each reason."""
    known, on_runs = given.coordinates, given.on_runs
    slenderness = known["cm_height"] / (0.5 * known["width"])
    slim = on_runs(slenderness)
    factor = given.factors.values
    peak = factor * on_runs(known["pga"])
    places = given.places or {}
    rising = None if shaking is None else shaking.rising
    needs = friction_demands(slim, on_runs(known["inertia_factor"]), peak, factor, rising, places.get("motion"))
    needs[SLIDES_AT_IMPACT] = xr.apply_ufunc(friction_at_impact, slenderness, known["e"])
    lifts = peak * slim > STANDARD_GRAVITY
    chances = {}
    for reason, need in needs.items():
        chance = on_runs(chance_below(need, available, places.get("block")))
        # a block that never uplifts neither rocks nor has an impact
        chances[reason] = chance if reason is SLIDES_AT_UPLIFT else xr.apply_ufunc(np.where, lifts, chance, 0.0)
    frequency = _elastic_frequency(known)
    variables = {
        "squat": labelled(slenderness < SQUAT_RATIO, SQUAT.text),
        "friction_uplift": labelled(1.0 / slenderness, "coefficient of friction needed at uplift: b/h"),
        **{NEEDS[reason][0]: labelled(compact(need), NEEDS[reason][1]) for reason, need in needs.items()},
        "elastic_frequency": labelled(frequency, "frequency of the law's elastic mode", HERTZ),
        "scale_factor": labelled(factor, "scale factor of the motion"),
    }
    far = (factor < bounds[0]) | (factor > bounds[1])
    holds = {
        SQUAT: on_runs(variables["squat"]),
        **{reason: chance > 0.5 for reason, chance in chances.items()},
        # (the amplitude of other motions is a parameter)
        SCALED_FAR: far & on_runs(known["own_amplitude"].astype(bool)) if "own_amplitude" in known else far,
    }
    if given.lifted:
        holds[AIRBORNE] = leaves_floor(factor, on_runs(known[DOWNWARD]))
    if shaking is not None:
        variables |= {"band_low": shaking.low, "band_high": shaking.high}
        # (the mode of a soft support is real, and speaks against no run)
        spurious = known["rest"] != "soft"
        if BED in known:
            spurious = spurious & known[BED].isnull()
        mode = on_runs(frequency)
        inside = (mode >= on_runs(shaking.low)) & (mode <= on_runs(shaking.high))
        holds[ELASTIC_MODE] = inside & on_runs(spurious)
    return variables, chances, holds


def _dims(runs: xr.Dataset) -> tuple[str, ...]:
    """Dimensions of the runs in their usual order; TypeError if the dataset has no runs."""
    variables = runs.data_vars.values() if isinstance(runs, xr.Dataset) else ()
    output = next((each for each in variables if {"block", "model", "motion"} <= {*each.dims}), None)
    if output is None or not {*NEEDED} <= {*runs.coords}:
        raise TypeError("runs must be a dataset of runs with its coordinates, as toppling.ida returns it")
    if not {*output.dims} <= {*DIMS}:
        raise ValueError(f"runs must be on block, model, motion and possibly level, got dims {output.dims}")
    return tuple(dim for dim in DIMS if dim in output.dims)


def _elastic_frequency(known: Mapping[str, xr.Variable]) -> xr.Variable:
    """Frequency p sqrt((1/delta - 1) sin(alpha)/alpha)/(2 pi), Hz, of laws with an elastic zone at rest; else NaN.

    A bed that settles by d0 has the stiffness of delta = 3 d0/(b alpha).
    """
    alpha = known["alpha"]
    elastic = known["rest"] != "rigid"
    delta = known["delta"]
    if BED in known:
        of_bed = known[BED] / (0.5 * known["width"] * alpha) * 3.0
        delta = xr.apply_ufunc(np.where, of_bed.isnull(), delta, of_bed)
    stiffness = (1.0 / delta - 1.0) * (alpha.copy(data=np.sin(alpha.values)) / alpha)
    frequency = known["p"] * stiffness.copy(data=np.sqrt(stiffness.values)) / (2.0 * np.pi)
    frequencies: xr.Variable = xr.apply_ufunc(np.where, elastic, frequency, np.nan)
    return frequencies.transpose("block", "model")
