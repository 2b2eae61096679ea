"""Notes of a validity screen: a sentence for each reason that holds, for tables and reports."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Flags
from ...core.doubts import NAMED, first_names
from ...core.wording import counted, listed_name, two_digit_percent, two_digits
from ...models import Block
from ...models.columns import BlockArray
from ...motions.arrays import POLARITY
from ..numerics.proportions import runs_for_half_width, wilson_interval
from ..runs.provenance import BED, RUN, about_both_axes, runs_near_curves
from .plausibility import block_doubts
from .reasons import (
    AIRBORNE,
    ELASTIC_MODE,
    SCALED_FAR,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SLIDES_WHILE_ROCKING,
    Reason,
)
from .scenes import round_note, scene_notes
from .slab_screen import SQUAT_RATIO, TESTED

MOST_ALONE = 8  # blocks with a sentence of their own
_BLOCK, _LAW, _PAIR = ("block",), ("model",), ("block", "model")
OF_THE_WIDTH = (
    "blocks are run about both axes; squatness, sliding and the elastic mode are checked in the direction of the width"
)


def not_modelled(vertical: bool = False, slides: bool = False) -> str:
    """Return the sentence on the effects that are not modelled.

    vertical: whether motions shake vertically, too; slides: whether sliding is evaluated beside rocking.
    """
    effects = "bouncing and sliding while a block rocks" if slides else "sliding and bouncing"
    return f"{'' if vertical else 'vertical shaking, '}{effects} are not modelled"


def block_notes(blocks: Iterable[Block]) -> list[str]:
    """Return notes on the blocks alone, before anything is run: one sentence each."""
    every = list(blocks)
    return [*squat_notes(every), *scene_notes(every), *(one.sentence for one in block_doubts(every))]


def squat_notes(blocks: Iterable[Block] | BlockArray) -> list[str]:
    """Return a sentence on each squat block, which slides or bounces rather than rocks."""
    if isinstance(blocks, BlockArray):
        return _squat(blocks.names.tolist(), 1.0 / np.tan(blocks.alpha))
    every = list(blocks)
    return _squat([block.label for block in every], np.array([block.h / block.b for block in every]))


def notes(screened: xr.Dataset, slides: bool = False) -> list[str]:
    """Return notes that a user should read before trusting a result: a sentence for each reason that holds.

    Parameters
    ----------
    screened : xarray.Dataset
        As `screen` or `summary_screen` returns it, or a study's results, which hold the same variables.
    slides : bool
        Whether sliding was evaluated beside rocking, so that the last sentence does not say that it was not.

    Returns
    -------
    list of str
        Notes on each squat block; friction; the elastic mode; scale factors; the number of motions; undecided flags;
        and the effects that are not modelled.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.fragility import screen
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.Block(0.4, 1.2, name="cabinet"), tp.HousnerImpact(e=0.9), shakes, [2.0, 9.8])
    >>> for sentence in notes(screen(runs, shakes, friction=0.45)):
    ...     print(sentence)
    50 % of the runs slide while they rock: they need a coefficient of friction of up to 0.48 (cabinet 50 %)
    with 4 motions a probability of 1/2 is known only to ±0.35 (95 %); 39 motions give ±0.15
    vertical shaking, sliding and bouncing are not modelled
    """
    if not isinstance(screened, xr.Dataset) or "screen" not in screened.attrs or "outside" not in screened:
        raise TypeError("notes need a dataset as toppling.fragility.screen returns it")
    if "item" in screened.dims:
        screened = screened.rename(item="block")
    checks.not_empty("screened runs", screened.sizes)
    settings = json.loads(screened.attrs["screen"])
    labels = [str(label) for label in screened["block"].values]
    found = _squat(labels, 1.0 / screened["friction_uplift"].values, screened["squat"].values)
    found += _friction(screened, settings)
    found += _shaking(screened, settings)
    if "undecided" in screened:
        found.append(_undecided(screened, settings))
    if "round" in screened.coords and bool(screened["round"].any()):
        found.append(round_note([label for label, one in zip(labels, screened["round"].values, strict=True) if one]))
    if about_both_axes(screened):
        found.append(OF_THE_WIDTH)
    return [*found, not_modelled(settings.get("vertical", False), slides)]


def _squat(labels: list[str], ratios: Array, here: Flags | None = None) -> list[str]:
    """Sentences on squat blocks: by the height of the centre of mass over half the width, or as given by the screen."""
    squat = np.flatnonzero(ratios < SQUAT_RATIO if here is None else here)
    if squat.size > MOST_ALONE:
        low, high = float(ratios[squat].min()), float(ratios[squat].max())
        named = first_names([labels[i] for i in squat])
        return [
            f"{squat.size:,} blocks ({named}) have their centre of mass {low:.1f} to {high:.1f} half widths high; "
            f"below {SQUAT_RATIO:g} they slide or bounce rather than rock, which is not modelled"
        ]
    return [
        f"{labels[i]}: its centre of mass is {ratios[i]:.1f} half widths high; below {SQUAT_RATIO:g} it slides or "
        "bounces rather than rocks, which is not modelled"
        for i in squat
    ]


def _friction(screened: xr.Dataset, settings: dict[str, Any]) -> list[str]:
    """Sentences on sliding; where no coefficient is given, on the friction that blocks need."""
    given = settings["friction"] is not None
    against = "" if given else ", which very few floors provide"
    found = []
    for reason, text, name in (
        (SLIDES_AT_UPLIFT, "slide before or at uplift", "friction_uplift_demand"),
        (SLIDES_WHILE_ROCKING, "slide while they rock", "friction_rocking_demand"),
        (SLIDES_AT_IMPACT, "slide when they come down", "friction_impact"),
    ):
        share = float(_shares(screened, reason).mean())
        if share > 0.0:
            by = _PAIR if reason is SLIDES_AT_IMPACT else _BLOCK
            need = greatest_need(screened, name)
            found.append(
                f"{two_digit_percent(share)} of the runs {text}: they need a coefficient of friction of up to "
                f"{need:.2f}{against} ({_worst(_shares(screened, reason), by)})"
            )
    if not given:
        at_uplift = screened["friction_uplift"].values
        impact = screened["friction_impact"]
        found.append(
            f"no coefficient of friction is given: blocks slide where it is below {_range(at_uplift)} at uplift, "
            f"{greatest_need(screened, 'friction_rocking_demand'):.2f} at the greatest peak"
            + (f", {float(impact.max()):.2f} at impact" if bool(impact.notnull().any()) else "")
        )
    return found


def _shaking(screened: xr.Dataset, settings: dict[str, Any]) -> list[str]:
    """Sentences on the elastic mode, the scale factors and the number of motions."""
    found = []
    share = float(_shares(screened, ELASTIC_MODE).mean())
    if share > 0.0:
        frequency = screened["elastic_frequency"].where(_shares(screened, ELASTIC_MODE) > 0.0).values
        found.append(
            f"in {two_digit_percent(share)} of the runs the law's elastic mode ({_range(frequency)} Hz) lies inside "
            "the motion's band: at rest the block resonates, and uplifts where a rigid block would not "
            f"({_worst(_shares(screened, ELASTIC_MODE), _LAW)})"
        )
    if "rest" in screened.coords and bool((screened["rest"] == "soft").any()):
        frequency = screened["elastic_frequency"].where(screened["rest"] == "soft").values
        found.append(
            f"the elastic mode of rest='soft' ({_range(frequency)} Hz) is that of the soft support whose settlement or "
            "frequency gives δ: it is physical, and a block that resonates with it uplifts as a real one would"
        )
    if BED in screened.coords:
        frequency = screened["elastic_frequency"].where(screened[BED].notnull()).values
        found.append(
            f"the elastic mode of blocks on a soft bed ({_range(frequency)} Hz) is that of the bed, and not of δ: "
            "it is physical, and a block that resonates with it uplifts as a real one would"
        )
    share = float(_shares(screened, SCALED_FAR).mean())
    if share > 0.0:
        lowest, highest = settings["factors"]
        whole = "scale_factor" in screened  # (else the least and the greatest of each block)
        names = ["scale_factor"] if whole else ["scale_factor_lowest", "scale_factor_highest"]
        factors = np.stack([near_curves(screened, name) for name in names])
        known = factors[np.isfinite(factors)]
        ends = [two_digits(float(end)) for end in (known.min(), known.max())] if known.size else []
        found.append(
            f"{two_digit_percent(share)} of the runs have motions scaled by less than {lowest:g} or more than "
            f"{highest:g}{f' (from {ends[0]} to {ends[1]} in all)' if ends else ''}"
        )
    if settings.get("vertical", False):
        share = float(_shares(screened, AIRBORNE).mean())
        found.append("the vertical components of the motions shake, too, scaled as the horizontal ones")
        if share > 0.0:
            found.append(
                f"in {two_digit_percent(share)} of the runs the floor falls faster than g, and the block leaves it: "
                f"these runs are not computed and count as overturned ({_worst(_shares(screened, AIRBORNE), _BLOCK)})"
            )
    if bool(screened["few_motions"]):
        n, widest = int(settings["fewest_motions"]), float(settings["half_width"])
        half = float(screened["interval_half_width"])
        found.append(few_motions_note(n, half, widest))
    return found


def near_curves(screened: xr.Dataset, name: str) -> Array:
    """Return the values of a variable; at adaptive levels without those of the runs that look for the curves."""
    values: Array = screened[name].values
    return values[runs_near_curves(screened)] if RUN in screened[name].dims else values


def greatest_need(screened: xr.Dataset, name: str) -> float:
    """Return the greatest coefficient of friction that blocks need, of a variable of the screen; NaN for none."""
    return float(np.fmax.reduce(near_curves(screened, name).ravel(), initial=np.nan))


def few_motions_note(n: int, half: float, widest: float) -> str:
    """Return the sentence on `n` motions whose interval of a probability of 1/2 is wider than it may be."""
    return (
        f"with {counted(n, 'motion')} a probability of 1/2 is known only to ±{half:.2f} (95 %); "
        f"{runs_for_half_width(widest)} motions give ±{widest:g}"
    )


def _undecided(screened: xr.Dataset, settings: dict[str, Any]) -> str:
    share = screened["undecided"]
    # (at adaptive levels curves have different numbers of runs)
    each = screened[TESTED].values if TESTED in screened else int(settings["tested_runs"])
    tested = int(np.sum(each * share.notnull().values))
    flipped = int(np.rint(share.fillna(0.0).values * each).sum())
    low, high = (float(end) for end in wilson_interval(np.array(flipped), np.array(tested)))
    change = "a change of one millionth in the motion or the restitution"
    of = f"the {counted(tested, 'outcome')} tested, under {int(screened['perturbed'].sum())} of "
    motions = screened["perturbed"].size
    of += counted(motions, "motion")
    if POLARITY in screened.coords:
        of += f" ({motions // 2:,} and their reverses)"
    if not flipped:
        return f"{change} reverses none of {of}: at most {two_digit_percent(high)} of all outcomes are undecided (95 %)"
    worst = f" ({_worst(share, _PAIR)})" if int(share.notnull().sum()) > 1 else ""
    return (
        f"{two_digit_percent(flipped / tested)} of the outcomes are undecided ({two_digit_percent(low)} to "
        f"{two_digit_percent(high)}, 95 %): {change} reverses {flipped:,} of {of}{worst}"
    )


def _shares(screened: xr.Dataset, reason: Reason) -> xr.DataArray:
    return screened["outside"].sel(reason=reason.name, drop=True)


def _worst(shares: xr.DataArray, by: tuple[str, ...]) -> str:
    """The blocks, laws or pairs of them with the greatest shares, in their order where shares are equal."""
    means = shares.mean([dim for dim in shares.dims if dim not in by]).transpose(*by)
    flat = means.values.ravel()
    order = [int(i) for i in np.argsort(-flat, kind="stable") if flat[i] > 0.0]
    names = []
    for i in order[:NAMED]:
        at = np.unravel_index(i, means.shape)
        label = " under ".join(listed_name(str(means[dim].values[k])) for dim, k in zip(by, at, strict=True))
        names.append(f"{label} {two_digit_percent(float(flat[i]))}")
    more = len(order) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _range(values: np.ndarray) -> str:
    low, high = f"{np.nanmin(values):.2f}", f"{np.nanmax(values):.2f}"
    return low if low == high else f"{low} to {high}"
