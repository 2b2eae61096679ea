"""Figures of the moments that resist a block against its rotation: those of a response, and those of a law."""

from __future__ import annotations

import json
import math
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
from ..text.histories import before_lying, checked
from . import axes
from .response import ATTRIBUTES, ROTATION, VARIABLES

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
    branches = () if oscillator is None else [one for one in oscillator.regions if 0.0 in (one.lower, one.upper)]
    rigid = theta == 0.0
    jump = 0.0
    for part in branches:
        assert oscillator is not None  # it has branches
        here = (theta >= part.lower) & (theta <= part.upper)
        own = _restoring(oscillator, part, theta)
        jump = max(jump, float(_restoring(oscillator, part, np.zeros(1))[0]))
        rigid |= here & (np.abs(restoring - own) <= 1e-9 * jump)
    side = np.sign(theta)
    before = np.flatnonzero(rigid[1:] & rigid[:-1] & (side[1:] != side[:-1])) if jump else np.zeros(0, dtype=int)
    after = before + 1
    share = theta[before] / (theta[before] - theta[after])
    places = np.repeat(after, 2)

    def ends(first: Array, last: Array) -> Array:
        return np.stack([first, last], axis=1).ravel()

    # (at rest the floor's reaction follows the shaking)
    first, last = (np.where(side[at] == 0.0, restoring[at], side[at] * jump) for at in (before, after))
    level = [one[before] + share * (one[after] - one[before]) for one in more]
    return (
        np.insert(theta, places, 0.0),
        np.insert(restoring, places, ends(first, last)),
        *(np.insert(one, places, ends(at, at)) for one, at in zip(more, level, strict=True)),
    )
