"""Damage states of a block, and the statuses of estimates.

A damage state defines which runs count as failures.  A status is the reason why a curve, a size or a slenderness is
missing or must not be trusted.
"""

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
import xarray as xr

from ...core import checks
from ...core.parameters import Parameter, check
from ...core.units import DIMENSIONLESS
from ...models.outputs import OUTPUTS
from ...models.scenes.edge import FALLEN_OFF
from ...models.sliding.trip import TRIPS
from ..runs.provenance import RUN, about_both_axes, load_coordinates

OVERTURNED = "overturned"
UPLIFTED = "uplifted"
FRONT = "front"
BACK = "back"
NAMES = {
    OVERTURNED: "overturning",
    UPLIFTED: "uplift",
    FRONT: "a forward fall",
    BACK: "a backward fall",
    FALLEN_OFF: "a fall over an edge",
    TRIPS: "a trip over an obstacle",
}
TURNED = Parameter(above=0.0, at_most=3.0)
"""Value of |θ|/α in a damage state: no block returns from 3, so 50 is per cent."""
DIRECTIONS = {FRONT: 1, BACK: -1}
SIDES = {"either": "slide_peak", FRONT: "slide_forward", BACK: "slide_backward"}


DISTANCE = Parameter("m", above=0.0, at_most=10.0)
"""Slip that makes a damage state."""


@dataclass(frozen=True)
class Slip:
    """Damage state of sliding blocks: a slip above a distance (m, > 0, at most 10), to `side` either, front or back.

    Examples
    --------
    >>> state_name(Slip(0.1))
    'a slip above 0.1 m'
    """

    distance: Annotated[float, DISTANCE]
    side: str = "either"

    def __post_init__(self) -> None:
        check(self)
        checks.choice("side", self.side, tuple(SIDES))


State = str | float | Slip
"""A damage state: overturning (to either side or one), uplift, a rotation above x alpha, a slip, a fall, a trip."""

# Statuses of any estimate
OK: Final = "ok"

# Statuses of a fitted curve
NO_RUNS: Final = "no runs"
ONE_LEVEL: Final = "one level"
NONE: Final = "no overturning"
ALL: Final = "all overturned"
SEPARATED: Final = "separated"
DECREASING: Final = "not increasing"
FAILED: Final = "not converged"
FLAT: Final = "flat"

# Statuses of a size or slenderness that meets a rate
TOO_HIGH: Final = "all above the target"
TOO_LOW: Final = "all below the target"
CROSSED: Final = "crosses the target more than once"
NO_RATE: Final = "no rate"

# Statuses of a curve in a file of another program
ABSENT: Final = "not in the file"
INCOMPLETE: Final = "incomplete"


def state_name(state: State) -> str:
    """Return a damage state in words."""
    if isinstance(state, Slip):
        return f"a slip above {state.distance:g} m" + ("" if state.side == "either" else f" to the {state.side}")
    if isinstance(state, str):
        return NAMES[checks.choice("state", state, tuple(NAMES))]
    return f"|theta|/alpha > {TURNED.number('state', state):g}"


def state_named(name: str) -> State | None:
    """Return the damage state that `state_name` calls so; None if there is none.

    >>> [state_named(state_name(state)) for state in ("uplifted", 0.5, Slip(0.1, "front"))]
    ['uplifted', 0.5, Slip(distance=0.1, side='front')]
    """
    state_of_name = next((state for state, words in NAMES.items() if words == name), None)
    turned = re.fullmatch(r"\|theta\|/alpha > (\S+)", name)
    slid = re.fullmatch(r"a slip above (\S+) m(?: to the (front|back))?", name)
    if slid is not None:
        return Slip(float(slid[1]), slid[2] or "either")
    return state_of_name if turned is None else float(turned[1])


def needed_output(state: State) -> str:
    """Return the output of a run from which a damage state is read."""
    if isinstance(state, Slip):
        return SIDES[state.side]
    if not isinstance(state, str):
        return "peak_rotation"
    return "direction" if state in DIRECTIONS else state


def of_both_axes(state: State) -> bool:
    """Return True for a damage state that runs about both axes can reach: others are of one axis."""
    return state.side == "either" if isinstance(state, Slip) else state in (OVERTURNED, UPLIFTED, FALLEN_OFF)


def check_axes_of(state: State) -> None:
    """Raise a ValueError for a damage state that runs about both axes do not have (`of_both_axes`)."""
    if not of_both_axes(state):
        raise ValueError(
            f"{state_name(state)} is of one axis: runs about both axes have the states {OVERTURNED}, {UPLIFTED} and "
            f"{FALLEN_OFF}, and slips to either side"
        )


def flags_of(values: Any, state: State, alpha: Any) -> Any:
    """Return flags of the runs that reached a damage state, from the output that it needs (`needed_output`).

    `values` and the slenderness of the blocks `alpha`, rad, are numpy or labelled arrays that go with each other.
    """
    if values.dtype.kind not in "biuf":
        raise TypeError(f"{needed_output(state)} of runs must be numbers, got {values.dtype}")
    if isinstance(state, Slip):
        if bool(np.isnan(values).any()):
            name = state_name(state)
            raise ValueError(f"{name} is not known of runs in which the block loses contact with the floor")
        return values > state.distance
    if not isinstance(state, str):
        # a block that overturned has passed every rotation, those beyond pi/2 among them; one that left the floor
        # under vertical shaking has none, and counts as overturned
        return (values > state * alpha) | (values >= 0.5 * math.pi) | np.isnan(values)
    if state in DIRECTIONS:
        return (values == DIRECTIONS[state]) | (values == OUTPUTS["direction"].airborne)
    if values.dtype == np.bool_:
        return values
    if not bool(((values == 0) | (values == 1)).all()):
        raise ValueError(f"{needed_output(state)} must be flags, got values other than 0 and 1 ({values.dtype})")
    return values.astype(bool)


def reached(runs: xr.Dataset, state: State = OVERTURNED) -> xr.DataArray:
    """Return flags of the runs that reached a damage state; runs that are airborne count as having reached each.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs as `toppling.ida`, `toppling.stripes` or `toppling.cloud` return them.
    state : str, float or Slip
        ``overturned``, ``uplifted``, or ``front`` or ``back`` (overturned to that side: to the front means away from a
        wall, into the room). A number x > 0: the peak rotation exceeded x alpha; an overturned block always did. For
        sliding blocks a `Slip`, ``fallen_off`` (it slid over an edge) or ``trips`` (it slid into an obstacle, fast
        enough to turn over it).

    Returns
    -------
    xarray.DataArray
        Flags on the dimensions of the runs, with `state` as an attribute.

    References
    ----------
    Rotation thresholds |theta|/alpha as damage states of contents: D'Angela, D., Magliulo, G., Cosenza, E. (2021).
    Seismic damage assessment of unanchored nonstructural components taking into account the building response.
    Structural Safety 93, 102126 (thresholds as quoted by others; not re-read).

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, [1.0, 4.0])
    >>> bool(reached(runs, 0.1).sum() >= reached(runs).sum())
    True
    """
    name = state_name(state)
    needs = needed_output(state)
    if not isinstance(runs, xr.Dataset) or needs not in runs:
        raise TypeError(f"{name} needs runs with `{needs}` (see outputs), as toppling.ida returns them")
    load_coordinates(runs)
    if about_both_axes(runs):
        check_axes_of(state)
    values = runs[needs]
    if RUN in values.dims:
        raise ValueError(
            f"{name} is needed of every motion at common levels: adaptive levels have a level for each run, which "
            "fit_fragility takes"
        )
    if "motion" not in values.dims:
        raise ValueError(f"{needs} must have a motion dimension, got dims {values.dims}")
    checks.not_empty("runs", runs, "motion")
    if "alpha" not in runs.coords and isinstance(state, float | int):
        raise ValueError(f"{name} needs the blocks' alpha as a coordinate of the runs, as toppling.ida returns them")
    flags: xr.DataArray = flags_of(values, state, runs["alpha"] if "alpha" in runs.coords else math.nan)
    return flags.rename(state if isinstance(state, str) else "reached").assign_attrs(
        units=DIMENSIONLESS, long_name=f"whether the block reached {name}", state=name
    )
