"""What a reader must be told of fitted curves and of their rates before signing for them, in sentences.

How curves are fitted and rates are made is not known here: only what they rest on, and how far they are guessed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility.states import state_name
from ..fragility.statuses import SEPARATED
from .words import floor_name, level_text

FEWEST = 5
"""Fewer runs that reached the state, or that did not, leave a curve to chance."""
WIDEST = 2.0
"""Ratio of the ends of a median's interval above which it is worth a sentence."""
NOTABLE = 0.05
"""Share of a rate beyond what is known above which it is worth a sentence."""
SETTLED = 0.95
"""Probability from which a curve has little left to rise."""
LARGE = 100.0
"""Ratio that is not said more closely."""
REACHED = {state_name("overturned"): "overturned", state_name("uplifted"): "uplifted"}
VERBS = {state_name("overturned"): "overturns", state_name("uplifted"): "uplifts"}


def verb_of(state: str) -> str:
    """What a block does that reaches a state, by the state's name: overturns, uplifts."""
    return VERBS.get(state, f"reaches {state}")


def reached_of(state: str) -> str:
    """What a run did that reached a state, by the state's name: overturned, uplifted."""
    return REACHED.get(state, f"reached {state}")


def curve_notes(curves: xr.Dataset, reached: xr.DataArray, runs: xr.DataArray, state: str) -> list[str]:
    """What stands on few runs, and what is known to a factor only: one sentence each.

    Parameters
    ----------
    curves : xarray.Dataset
        As `fit_fragility` returns them; without ``median_lower`` nothing is said of intervals.
    reached, runs : xarray.DataArray
        How many runs of each curve reached the state, and how many there are, on the dimensions of the curves.
    state : str
        Name of the state.

    Returns
    -------
    list of str

    Examples
    --------
    >>> curves = xr.Dataset({"status": ("block", ["separated"])}, {"block": ["shelf"]})
    >>> curve_notes(curves, xr.DataArray([2], dims="block"), xr.DataArray([40], dims="block"), "overturning")
    ['fewer than 5 runs overturned for the curve (shelf: 2 of 40): it rests on them; take more motions or higher \
levels', 'data are separated for the curve (shelf): no two levels have both runs that overturned and runs that did \
not, so the dispersion is a guess (penalised likelihood); take more motions or closer levels']
    """
    status = curves["status"]
    reached, runs = (one.transpose(*status.dims) for one in (reached, runs))
    found = []
    did, stayed = reached_of(state), f"did not {_infinitive(state)}"
    for few, number, what, cure in (
        (reached, reached, did, "higher levels"),
        (runs - reached, runs - reached, stayed, "lower levels"),
    ):
        here = (few.values < FEWEST) & (runs.values > 0)
        if here.any():
            of = [f"{int(a)} of {int(b)}" for a, b in zip(number.values[here], runs.values[here], strict=True)]
            rest = "it rests" if here.sum() == 1 else "they rest"
            found.append(
                f"fewer than {FEWEST} runs {what} for {_how_many(here)} ({_listed(status, here, of)}): {rest} on them; "
                f"take more motions or {cure}"
            )
    apart = status.values == SEPARATED
    if apart.any():
        found.append(
            f"data are separated for {_how_many(apart)} ({_listed(status, apart)}): no two levels have both runs that "
            f"{did} and runs that did not, so the dispersion is a guess (penalised likelihood); take more motions or "
            "closer levels"
        )
    if "median_lower" in curves:
        lower, upper = (curves[f"median_{end}"].transpose(*status.dims).values for end in ("lower", "upper"))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = upper / lower
        wide = np.isfinite(curves["median"].transpose(*status.dims).values) & (ratio > WIDEST)
        if wide.any():
            of = [f"{one:.1f}" if one < LARGE else f"more than {LARGE:g}" for one in ratio[wide]]
            found.append(
                f"the interval of the median is wider than a factor of {WIDEST:g} for {_how_many(wide)} "
                f"({_listed(status, wide, of)}): take more motions"
            )
    return found


def rate_notes(rates: xr.Dataset, settled: xr.DataArray, hazard_end: float, levels_end: str, cure: str) -> list[str]:
    """Which rates come from shaking beyond the hazard curve or beyond the levels: one sentence each.

    Parameters
    ----------
    rates : xarray.Dataset
        As `Risk.of` returns them: ``rate``, ``rate_share_above``, ``rate_share_above_levels``.
    settled : xarray.DataArray
        What each curve has reached at the highest shaking that was run: where that is nearly 1 nothing is left to know.
    hazard_end : float
        The hazard curve's last level, SI, in the unit of the bins.
    levels_end, cure : str
        What the highest shaking that was run is called (the last level), and what to do (raise ida.levels.to).

    Returns
    -------
    list of str

    Examples
    --------
    >>> shares = {"rate": [1e-4], "rate_share_above": [0.71], "rate_share_above_levels": [0.08]}
    >>> rates = xr.Dataset(
    ...     {name: ("block", values) for name, values in shares.items()},
    ...     {"block": ["pedestal"], "bin": ("bin", [1.0], {"units": "m s-1"})},
    ... )
    >>> for note in rate_notes(rates, xr.DataArray([0.6], dims="block"), 1.6, "the last level", "raise ida.levels.to"):
    ...     print(note[:88])
    71 % of the annual rate of pedestal comes from shaking above the hazard curve's last lev
    8 % of the annual rate of pedestal comes from shaking above the last level, where the cu
    """
    end = level_text(hazard_end, rates["bin"])
    outside, beyond = rates["rate_share_above"], rates["rate_share_above_levels"]
    found = []
    for share, here, where in (
        (
            outside,
            outside.values > NOTABLE,
            f"above the hazard curve's last level ({end}), where only its last slope is known: give the curve at "
            "higher levels",
        ),
        (
            beyond,
            (beyond.values > NOTABLE) & (settled.transpose(*beyond.dims).values < SETTLED),
            f"above {levels_end}, where the curve is not known: {cure}",
        ),
    ):
        if here.any():
            shown = np.where(here, share.values, 0.0)
            worst = tuple(int(i) for i in np.unravel_index(int(shown.argmax()), shown.shape))
            more = int(here.sum()) - 1
            others = f" (and more than {100 * NOTABLE:g} % of {more} other{'s' if more > 1 else ''})" if more else ""
            found.append(
                f"{100.0 * shown[worst]:.0f} % of the annual rate of {_name(share, worst)}{others} comes from shaking "
                f"{where}"
            )
    if "rate_lower" in rates:
        lower, upper = rates["rate_lower"].values, rates["rate_upper"].values
        alike = np.isfinite(upper) & (lower == upper)
        if alike.any():
            found.append(
                f"the interval of the annual rate has no width for {_how_many(alike)} "
                f"({_listed(rates['rate'], alike)}): however motions are drawn from these the curve is the same, and "
                "where it rises between two levels is not known; take closer levels and more motions"
            )
    return found


MOST_NAMED = 3


def _infinitive(state: str) -> str:
    return {"overturns": "overturn", "uplifts": "uplift"}.get(
        verb_of(state), verb_of(state).replace("reaches", "reach")
    )


def _how_many(here: NDArray[np.bool_]) -> str:
    return f"{int(here.sum())} of {here.size} curves" if here.size > 1 else "the curve"


def _listed(like: xr.DataArray, here: NDArray[np.bool_], said: list[str] | None = None) -> str:
    """The first of those that are meant, with what is said of each."""
    names = [_name(like, tuple(int(i) for i in at)) for at in np.argwhere(here)]
    words = names if said is None else [f"{name}: {one}" for name, one in zip(names, said, strict=True)]
    more = len(words) - MOST_NAMED
    return "; ".join(words[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")


def _name(like: xr.DataArray, at: tuple[Any, ...]) -> str:
    """A curve for people: block, law and floor as far as they are told apart."""
    labels = {str(dim): str(like[dim].values[i]) for dim, i in zip(like.dims, at, strict=True) if dim in like.coords}
    alone = [dim for dim in labels if dim != "block" and like.sizes[dim] == 1]
    text = labels.get("block", "the block")
    if "model" in labels and "model" not in alone:
        text += f" under {labels['model']}"
    if "floor" in labels:
        text += f", {floor_name(labels['floor'])}"
    return text
