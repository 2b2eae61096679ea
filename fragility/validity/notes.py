"""Notes of a validity screen: a fact for each reason, and its sentences."""

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Flags
from ...core.doubts import NAMED
from ...core.facts import Fact, doubted
from ...core.sentences import register_of, sentence
from ...core.wording import listed_name
from ...models import Block
from ...models.block_array import BlockArray
from ...models.plausibility import block_doubts
from ...motions.arrays import POLARITY
from ..numerics.proportions import runs_for_half_width, wilson_interval
from ..runs.provenance import BED, RUN, about_both_axes, runs_near_curves
from .reasons import (
    AIRBORNE,
    ELASTIC_MODE,
    SCALED_FAR,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SLIDES_WHILE_ROCKING,
    Reason,
)
from .scenes import scene_facts
from .slab_screen import SQUAT_RATIO

TEMPLATES = Path(__file__).parents[1] / "templates"
_BLOCK, _LAW, _PAIR = ("block",), ("model",), ("block", "model")
OF_THE_WIDTH = Fact("axis.screen_of_width")
"""Fact of blocks that run about both axes."""


def sentences_of(facts: Iterable[Fact]) -> list[str]:
    """Return the sentences of facts on blocks and screens."""
    return [sentence(fact.what, fact, [register_of(TEMPLATES, "screen")]) for fact in facts]


def block_notes(blocks: Iterable[Block]) -> list[str]:
    """Return notes on the blocks alone, before anything is run: one or two sentences each."""
    return sentences_of(block_facts(checks.several("blocks", blocks, Block)))


def block_facts(blocks: Iterable[Block]) -> list[Fact]:
    """Return the notes on blocks before any run: squat blocks, their surroundings, and input warnings."""
    every = list(blocks)
    return [*squat_facts(every), *scene_facts(every), *doubted(doubt.sentence for doubt in block_doubts(every))]


def squat_facts(blocks: Iterable[Block] | BlockArray) -> list[Fact]:
    """Return the fact on squat blocks, which slide or bounce rather than rock; none without any."""
    if isinstance(blocks, BlockArray):
        return _squat(blocks.names.tolist(), 1.0 / np.tan(blocks.alpha))
    every = list(blocks)
    return _squat([block.label for block in every], np.array([block.h / block.b for block in every]))


def notes(screened: xr.Dataset, slides: bool = False) -> list[str]:
    """Return notes on the validity of a result: one or two sentences for each reason.

    Parameters
    ----------
    screened : xarray.Dataset
        As `screen` or `summary_screen` returns it, or a study's results, which have the same variables.
    slides : bool
        True if sliding was evaluated in addition to rocking, so that the last sentence does not state the opposite.

    Returns
    -------
    list of str
        Notes on squat blocks; friction; the elastic mode; scale factors; the number of motions; undecided flags;
        and the effects that are not modelled.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.fragility import screen
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.Block(0.4, 1.2, name="cabinet"), tp.HousnerImpact(e=0.9), shakes, [2.0, 9.8])
    >>> for note in notes(screen(runs, shakes, friction=0.45))[1:]:
    ...     print(note)
    4 motions give a probability of 1/2 within ±0.35 (95...%); 39 motions give ±0.15.
    Not modelled: vertical shaking, bouncing, and sliding.
    """
    try:
        return sentences_of(screen_facts(screened, slides))
    except KeyError:
        raise TypeError("notes need all variables and reasons that toppling.fragility.screen returns") from None


def screen_facts(screened: xr.Dataset, slides: bool = False) -> list[Fact]:
    """Return the `notes` of a screen as facts."""
    if not isinstance(screened, xr.Dataset) or "screen" not in screened.attrs or "outside" not in screened:
        raise TypeError("notes need a dataset as toppling.fragility.screen returns it")
    checks.not_empty("screened runs", screened)
    settings = json.loads(screened.attrs["screen"])
    labels = [str(label) for label in np.atleast_1d(screened["block"].values)]
    facts = _squat(labels, 1.0 / np.atleast_1d(screened["friction_uplift"]), screened["squat"].values)
    facts += _friction(screened, settings)
    facts += _shaking(screened, settings)
    if "undecided" in screened:
        facts.append(_undecided(screened, settings))
    if "round" in screened.coords and bool(screened["round"].any()):
        facts.append(Fact("block.round", names=tuple(np.array(labels)[np.atleast_1d(screened["round"])].tolist())))
    if about_both_axes(screened):
        facts.append(OF_THE_WIDTH)
    more = {"vertical": bool(settings.get("vertical", False)), "slides": slides}
    return [*facts, Fact("validity.not_modelled", more=more)]


def _squat(labels: list[str], ratios: Array, squat_flags: Flags | None = None) -> list[Fact]:
    """Return squat blocks: by the height of the centre of mass over half the width, or as given by the screen."""
    squat = np.flatnonzero(ratios < SQUAT_RATIO if squat_flags is None else squat_flags)
    if not squat.size:
        return []
    low, high = float(ratios[squat].min()), float(ratios[squat].max())
    return [Fact("block.squat", SQUAT_RATIO, low, high, names=tuple(labels[i] for i in squat))]


def _friction(screened: xr.Dataset, settings: dict[str, Any]) -> list[Fact]:
    """Return shares of runs that slide; if no coefficient is given, the friction that blocks need."""
    given = settings["friction"] is not None
    facts = []
    for reason, when, name in (
        (SLIDES_AT_UPLIFT, "uplift", "friction_uplift_demand"),
        (SLIDES_WHILE_ROCKING, "rocking", "friction_rocking_demand"),
        (SLIDES_AT_IMPACT, "impact", "friction_impact"),
    ):
        shares = _shares(screened, reason)
        if float(shares.mean()) > 0.0:
            more = {"when": when, "given": given, **_worst(shares, _PAIR if reason is SLIDES_AT_IMPACT else _BLOCK)}
            need = greatest_need(screened, name)
            facts.append(Fact("sliding.share", float(shares.mean()), upper=need, more=more))
    if not given:
        impact = screened["friction_impact"]
        more = {
            "rocking": greatest_need(screened, "friction_rocking_demand"),
            "impact": float(impact.max()) if bool(impact.notnull().any()) else None,
        }
        facts.append(Fact("friction.not_given", math.nan, *_ends(screened["friction_uplift"].values), more=more))
    return facts


def _shaking(screened: xr.Dataset, settings: dict[str, Any]) -> list[Fact]:
    """Return facts on the elastic mode, the scale factors and the number of motions."""
    facts = []
    resonant, frequency = _shares(screened, ELASTIC_MODE), screened["elastic_frequency"]
    if (share := float(resonant.mean())) > 0.0:
        ends = _ends(frequency.where(resonant > 0.0).values)
        facts.append(Fact("law.elastic_mode", share, *ends, more=_worst(resonant, _LAW)))
    if "rest" in screened.coords and bool((screened["rest"] == "soft").any()):
        ends = _ends(frequency.where(screened["rest"] == "soft").values)
        facts.append(Fact("support.soft", math.nan, *ends, more={"bed": False}))
    if BED in screened.coords:
        ends = _ends(frequency.where(screened[BED].notnull()).values)
        facts.append(Fact("support.soft", math.nan, *ends, more={"bed": True}))
    if (share := float(_shares(screened, SCALED_FAR).mean())) > 0.0:
        whole = "scale_factor" in screened  # else the minimum and the maximum of each block
        names = ["scale_factor"] if whole else ["scale_factor_lowest", "scale_factor_highest"]
        factors = np.stack([near_curves(screened, name) for name in names])
        known = factors[np.isfinite(factors)]
        least, most = (float(known.min()), float(known.max())) if known.size else (None, None)
        more = {"least": least, "most": most}
        lowest, highest = settings["factors"]
        facts.append(Fact("motion.scaled_far", share, lowest, highest, more=more))
    if settings.get("vertical", False):
        facts.append(Fact("motion.vertical"))
        leaving = _shares(screened, AIRBORNE)
        if (share := float(leaving.mean())) > 0.0:
            facts.append(Fact("motion.airborne", share, more=_worst(leaving, _BLOCK)))
    if bool(screened["few_motions"]):
        n, widest = int(settings["fewest_motions"]), float(settings["half_width"])
        more = {"motions": n, "need": runs_for_half_width(widest), "width": widest}
        facts.append(Fact("validity.few_motions", float(screened["interval_half_width"]), more=more))
    return facts


def near_curves(screened: xr.Dataset, name: str) -> Array:
    """Return the values of a variable; at adaptive levels without the runs that search for the curves."""
    values: Array = screened[name].values
    return values[runs_near_curves(screened)] if RUN in screened[name].dims else values


def greatest_need(screened: xr.Dataset, name: str) -> float:
    """Return the maximum coefficient of friction that blocks need, of a variable of the screen; NaN without one."""
    return float(np.fmax.reduce(near_curves(screened, name).ravel(), initial=np.nan))


def _undecided(screened: xr.Dataset, settings: dict[str, Any]) -> Fact:
    share = screened["undecided"]
    # (at adaptive levels curves have different numbers of runs)
    tests = screened["undecided_tested"].values if "undecided_tested" in screened else int(settings["tested_runs"])
    tested = int(np.sum(tests * share.notnull().values))
    flipped = int(np.rint(share.fillna(0.0).values * tests).sum())
    low, high = (float(end) for end in wilson_interval(np.array(flipped), np.array(tested)))
    several = flipped and int(share.notnull().sum()) > 1
    more = {
        "flipped": flipped,
        "tested": tested,
        "perturbed": int(screened["perturbed"].sum()),
        "motions": screened["perturbed"].size,
        "reversed": POLARITY in screened.coords,
        **(_worst(share, _PAIR) if several else {"worst": [], "others": 0}),
    }
    return Fact("stability.undecided", flipped / tested if tested else 0.0, low, high, more=more)


def _shares(screened: xr.Dataset, reason: Reason) -> xr.DataArray:
    return _on(screened["outside"], "reason").sel(reason=reason.name, drop=True)


def _on(values: xr.DataArray, *dims: str) -> xr.DataArray:
    """Return values on dimensions of which one label can be selected."""
    return values.expand_dims([dim for dim in dims if dim not in values.dims])


def _worst(shares: xr.DataArray, by: tuple[str, ...]) -> dict[str, Any]:
    """Return the blocks, laws or pairs with the largest shares, each after its share, and the number of the others."""
    means = _on(shares.mean([dim for dim in shares.dims if dim not in by]), *by).transpose(*by)
    flat = means.values.ravel()
    order = [int(i) for i in np.argsort(-flat, kind="stable") if flat[i] > 0.0]
    places = [np.unravel_index(i, means.shape) for i in order[:NAMED]]
    labels = [[listed_name(str(means[dim].values[k])) for dim, k in zip(by, at, strict=True)] for at in places]
    named = [[float(flat[i]), *label] for i, label in zip(order, labels, strict=False)]
    return {"worst": named, "others": len(order) - len(named)}


def _ends(values: Array) -> tuple[float, float]:
    return float(np.nanmin(values)), float(np.nanmax(values))
