"""Figures of single responses and of laws: histories, phase portraits, and moments that resist rotation."""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from ...core import checks
from ...core.aliases import Array
from ...models import LAWS, Block, Law
from ...models.block import block_from
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator, Region
from ..text.histories import before_lying, checked, last_balance
from . import axes, selection

VARIABLES = ("angular_velocity", "restoring_moment", "damping_moment", "overturned", "overturning_time")
ATTRIBUTES = ("alpha", "p", "configuration")
"""Variables and attributes of a history that the figures need in addition to the rotation."""
ROTATION = "rotation over slenderness, θ/α (–)"
HIGHEST = 1.6
"""|θ|/α at which the curve of a falling block leaves a figure of histories."""
CROSS: dict[str, Any] = {"marker": "X", "ms": 8.0, "mew": 0.6, "mec": "white", "ls": "none"}


@axes.drawing
def history(
    responses: xr.Dataset | Sequence[xr.Dataset],
    ax: Axes | None = None,
    *,
    labels: Sequence[str] | None = None,
    colors: Sequence[str] | None = None,
) -> Axes:
    """Draw rotation over slenderness against time, a line for each response, with a cross at the last balance.

    The cross marks the last time at which |θ| exceeds α, or the end of a history that ends before.

    Parameters
    ----------
    responses : xarray.Dataset or sequence of them
        Datasets that `toppling.simulate` or `toppling.free_rocking` returned, of any blocks and laws.
    labels, colors : sequence of str, optional
        One label ("" for none) and one of matplotlib's colours for each response. By default the label is the law,
        block or motion that distinguishes the responses, and colours are the palette, with the first Housner black and
        dashed.
    """
    several = checks.is_several(responses) and not isinstance(responses, xr.Dataset)
    many: list[Any] = list(responses) if several else [responses]
    if not many:
        raise ValueError("responses must be at least one history, got none")
    for response in many:
        checked(response, VARIABLES, ATTRIBUTES)
    names = _one_each("labels", labels, many) or _names(many)
    chosen = _one_each("colors", colors, many)
    alone = ax is None
    ax = ax or axes.new(3.4)
    fallen = False
    laws = [json.loads(response.attrs["configuration"])["model"]["law"] for response in many]
    looks = selection.looks(xr.Dataset({"law": ("model", laws)}))
    for i, (response, (colour, _, line)) in enumerate(zip(many, looks, strict=True)):
        standing = before_lying(response)
        x = (response["rotation"].values / response.attrs["alpha"])[standing]
        colour = colour if chosen is None else chosen[i]  # noqa: PLW2901
        ax.plot(response["time"].values[standing], x, color=colour, ls=line, lw=1.4, label=names[i])
        if bool(response["overturned"]):
            ax.plot(*last_balance(response)[:2], color=colour, zorder=3, **CROSS)
            fallen = True
    if fallen and any(names):
        ax.plot([], [], color="0.4", label="past its balance for good", **CROSS)
    if fallen:
        low, high = ax.get_ylim()
        ax.set_ylim(max(low, -HIGHEST - 0.1), min(high, HIGHEST + 0.1))
    if alone:
        axes.own_legend(ax)
    return axes.label(ax, "time (s)", ROTATION)


@axes.drawing
def phase(response: xr.Dataset, ax: Axes | None = None, *, label: str | None = None, color: str | None = None) -> Axes:
    """Draw the phase portrait until overturning: angular velocity over p α against rotation over slenderness.

    Parameters
    ----------
    response : xarray.Dataset
        Dataset that `toppling.simulate` or `toppling.free_rocking` returned.
    """
    checked(response, VARIABLES, ATTRIBUTES)
    ax = ax or axes.new()
    standing = before_lying(response)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    x, v = response["rotation"].values / alpha, response["angular_velocity"].values / (p * alpha)
    ax.plot(x[standing], v[standing], color=color or axes.COLOURS[0], lw=1.2, label=label)
    return axes.label(ax, ROTATION, "angular velocity over p α, θ'/(pα) (–)")


def _one_each(name: str, values: Sequence[str] | None, many: Sequence[Any]) -> list[str] | None:
    """Return the values as a list; ValueError if there is not one value for each response."""
    if values is None:
        return None
    if isinstance(values, str) or len(values) != len(many):
        raise ValueError(f"{name} must be {len(many)}, one for each response, got {values!r:.60}")
    return list(values)


def _names(many: Sequence[xr.Dataset]) -> list[str]:
    """Return the names that distinguish the responses: law, block and motion, as far as they differ."""
    names = [[str(dataset.attrs.get(name, "")) for name in ("model", "block", "motion")] for dataset in many]
    differ = [len(set(column)) > 1 for column in zip(*names, strict=True)]
    if not any(differ):
        differ[0] = True
    texts = [", ".join(part for part, other in zip(row, differ, strict=True) if other and part) for row in names]
    return [axes.model_name(text) for text in texts]


WIDEST = 1.15
"""|θ|/α up to which a moment is drawn, a little past the balance at 1."""
MOMENTS = {
    "total": ("restoring_moment", "damping_moment"),
    "damping": ("damping_moment",),
    "restoring": ("restoring_moment",),
}


@axes.drawing
def hysteresis(
    response: xr.Dataset,
    ax: Axes | None = None,
    *,
    moment: str = "total",
    label: str | None = None,
    color: str | None = None,
) -> Axes:
    """Draw the restoring and the damping moment of a response, over m g R sin α, against its rotation.

    The histories contain moments per unit moment of inertia, and m g R sin α/I_O = p² sin α.  In the upright position
    the moment of a rigid block jumps between ±m g R sin α (in small-angle geometry ±m g R α).

    Parameters
    ----------
    response : xarray.Dataset
        The response, as for `phase`.  The curve of a Housner block encloses no area, as impacts dissipate its energy.
    moment : {"total", "damping", "restoring"}
        The sum of both moments, or one of them.
    """
    parts = MOMENTS[checks.choice("moment", moment, tuple(MOMENTS))]
    checked(response, VARIABLES, ATTRIBUTES)
    ax = ax or axes.new()
    standing = before_lying(response)
    theta, *moments = (response[name].values[standing] for name in ("rotation", *parts))
    if "restoring_moment" in parts:
        theta, *moments = _with_upright_ends(response, theta, *moments)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    resisting = np.sum(moments, axis=0) / (p**2 * math.sin(alpha))
    ax.plot(theta / alpha, resisting, color=color or axes.COLOURS[0], lw=1.2, label=label)
    name = {"total": "restoring and damping", "damping": "damping", "restoring": "restoring"}[moment]
    return axes.label(ax, ROTATION, f"{name} moment over m g R sin α (–)")


@axes.drawing
def moment(
    block: Block,
    model: Law,
    ax: Axes | None = None,
    *,
    label: str | None = None,
    color: str | None = None,
    linestyle: Any = "solid",
) -> Axes:
    """Draw the restoring moment of a block under a law against its rotation, with the law's elastic zone shaded.

    The moment is divided by m g R sin α, which the floor's reaction can balance before the block lifts.  With
    ``rest="rigid"`` a block at rest follows the rigid branch; the zone is dotted.

    Parameters
    ----------
    block : Block
    model : law
        Its geometry decides the shape of the curve: a sine or straight lines, with an elastic zone or a vertical jump.
    """
    oscillator = oscillator_of(block, model)
    ax = ax or axes.new()
    alpha = block.alpha
    unit = block.p**2 * math.sin(alpha)
    colour = color or axes.COLOURS[0]
    end = WIDEST * alpha
    solid: list[Array] = []
    for part in sorted(oscillator.regions, key=lambda part: (part.lower, part.upper)):
        theta = np.linspace(max(part.lower, -end), min(part.upper, end), 201)
        curve = np.stack([theta / alpha, _restoring(oscillator, part, theta) / unit])
        if part.captures:
            ax.plot(*curve, color=colour, lw=1.4, ls=(0, (1, 1.5)))
        else:
            solid.append(curve)
    # one line in one style: at rest it is vertical, since the floor's reaction takes any value there
    x, y = np.concatenate(solid, axis=1)
    label = axes.model_name(model.label) if label is None else label
    ax.plot(x, y, color=colour, lw=1.8, ls=linestyle, label=label)
    edge = model.zone_edge(block) / alpha
    if edge > 0.0:
        ax.axvspan(-edge, edge, color="0.9", lw=0.0, zorder=0)
    ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    return axes.label(ax, ROTATION, "restoring moment over m g R sin α (–)")


def _restoring(oscillator: Oscillator, part: Region, theta: Array) -> Array:
    """Return the restoring moment of a region of an oscillator at rotations, per unit moment of inertia, rad/s²."""
    if oscillator.exact:
        return np.asarray(-part.stiffness * np.sin(part.offset / part.stiffness - theta))
    return np.asarray(part.stiffness * theta - part.offset)


def _with_upright_ends(response: xr.Dataset, theta: Array, restoring: Array, *more: Array) -> tuple[Array, ...]:
    """Return samples with both ends of the moment's jump wherever a rigid block passes upright."""
    options = json.loads(response.attrs["configuration"])
    law, block = LAWS.get(options["model"].pop("law")), block_from(options["block"])
    oscillator = None if law is None else oscillator_of(block, law(**options["model"]))
    branches = (
        () if oscillator is None else [region for region in oscillator.regions if 0.0 in (region.lower, region.upper)]
    )
    rigid = theta == 0.0
    jump = 0.0
    for part in branches:
        assert oscillator is not None  # it has branches
        inside = (theta >= part.lower) & (theta <= part.upper)
        moment = _restoring(oscillator, part, theta)
        jump = max(jump, float(_restoring(oscillator, part, np.zeros(1))[0]))
        rigid |= inside & (np.abs(restoring - moment) <= 1e-9 * jump)
    side = np.sign(theta)
    before = np.flatnonzero(rigid[1:] & rigid[:-1] & (side[1:] != side[:-1])) if jump else np.zeros(0, dtype=int)
    after = before + 1
    share = theta[before] / (theta[before] - theta[after])
    places = np.repeat(after, 2)

    def ends(first: Array, last: Array) -> Array:
        return np.stack([first, last], axis=1).ravel()

    # (at rest the floor's reaction follows the shaking)
    first, last = (np.where(side[at] == 0.0, restoring[at], side[at] * jump) for at in (before, after))
    level = [values[before] + share * (values[after] - values[before]) for values in more]
    return (
        np.insert(theta, places, 0.0),
        np.insert(restoring, places, ends(first, last)),
        *(np.insert(values, places, ends(at, at)) for values, at in zip(more, level, strict=True)),
    )
