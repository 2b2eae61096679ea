"""Figures of what resists a block: the moments of a response against its rotation, and the law's own.

Axes in, axes out, as in `plots_response`.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .. import checks
from ..models import LAWS, Block, Law
from ..models.oscillator import Oscillator, Region
from ..models.simulate import oscillator_of
from .histories import before_lying, checked
from .plots import COLOURS, grid, model_name, new_axes
from .plots_response import ATTRIBUTES, VARIABLES

Values = NDArray[np.float64]

WIDEST = 1.15
"""|θ|/α up to which a moment is drawn: a little past the balance."""
MOMENTS = {
    "total": ("restoring_moment", "damping_moment"),
    "damping": ("damping_moment",),
    "restoring": ("restoring_moment",),
}


def hysteresis(
    response: xr.Dataset,
    ax: Axes | None = None,
    *,
    moment: str = "total",
    label: str | None = None,
    color: str | None = None,
) -> Axes:
    """What resists the block against its rotation: the restoring and the damping moment, over m g R sin α.

    Parameters
    ----------
    response : xarray.Dataset
        As `phase` takes it.  An impact takes its energy at one rotation: the curve of a Housner block encloses nothing.
    ax, label, color : optional
        As of `phase`.
    moment : {"total", "damping", "restoring"}
        The sum, or one of its parts.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError, ValueError
        As `phase`; another moment.

    Notes
    -----
    The histories hold moments per unit moment of inertia, and m g R sin α/I_O = p² sin α.  Upright the moment of a
    rigid block jumps between ±m g R sin α (of its small-angle geometry α for sin α), and is drawn upright between the
    samples on both sides; a law that is none of the package's is drawn from sample to sample.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_moments
    >>> block = tp.Block.from_slenderness(0.2, 0.38)
    >>> run = tp.free_rocking(block, tp.DiscreteDamping(e=0.925), 0.1, 4.0)
    >>> ax = plots_moments.hysteresis(run, moment="damping")
    >>> ax.get_ylabel()
    'damping moment over m g R sin α (–)'
    """
    parts = MOMENTS[checks.choice("moment", moment, tuple(MOMENTS))]
    checked(response, VARIABLES, ATTRIBUTES)
    if ax is None:
        ax = new_axes(5.0, 3.8)
    standing = before_lying(response)
    theta, *moments = (response[name].values[standing] for name in ("rotation", *parts))
    if "restoring_moment" in parts:
        theta, *moments = _upright(response, theta, *moments)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    resisting = np.sum(moments, axis=0) / (p**2 * math.sin(alpha))
    ax.plot(theta / alpha, resisting, color=color or COLOURS[0], lw=1.2, label=label)
    name = {"total": "restoring and damping", "damping": "damping", "restoring": "restoring"}[moment]
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel(f"{name} moment over m g R sin α (–)")
    grid(ax)
    return ax


def moment(
    block: Block,
    model: Law,
    ax: Axes | None = None,
    *,
    label: str | None = None,
    color: str | None = None,
    linestyle: Any = "solid",
) -> Axes:
    """The restoring moment of a block under a law against its rotation, with the law's elastic zone shaded.

    Parameters
    ----------
    block : Block
    model : law
        Its geometry decides the curve: sine or straight, with an elastic zone or upright where the block is rigid.
    ax, label, color, linestyle : optional
        Matplotlib's: where to draw (new axes where not given), and of the line; the law's own label where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError
        No block or no law.
    ValueError
        A law that needs an explicit e for this block.

    Notes
    -----
    Over m g R sin α, which the floor's reaction can balance before the block lifts.  With ``rest="rigid"`` a
    block that starts from rest, or that would come to rest, follows the rigid branch; the zone is drawn dotted.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_moments
    >>> ax = plots_moments.moment(tp.Block.from_slenderness(0.2, 0.38), tp.DiscreteDamping(e=0.925, delta=0.1))
    >>> round(float(ax.get_lines()[0].get_ydata().max()), 3)
    0.9
    """
    oscillator = oscillator_of(block, model)
    if ax is None:
        ax = new_axes(5.4, 3.8)
    alpha = block.alpha
    unit = block.p**2 * math.sin(alpha)
    own = color or COLOURS[0]
    end = WIDEST * alpha
    solid: list[Values] = []
    for part in sorted(oscillator.regions, key=lambda part: (part.lower, part.upper)):
        theta = np.linspace(max(part.lower, -end), min(part.upper, end), 201)
        curve = np.stack([theta / alpha, _restoring(oscillator, part, theta) / unit])
        if part.captures:
            ax.plot(*curve, color=own, lw=1.4, ls=(0, (1, 1.5)))
        else:
            solid.append(curve)
    # one line in one style: where the block rests it goes straight up, as the floor's reaction does
    x, y = np.concatenate(solid, axis=1)
    ax.plot(x, y, color=own, lw=1.8, ls=linestyle, label=model_name(model.label) if label is None else label)
    delta = getattr(model, "delta", None)
    if delta is not None:
        ax.axvspan(-delta, delta, color="0.9", lw=0.0, zorder=0)
    ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel("restoring moment over m g R sin α (–)")
    grid(ax)
    return ax


def _restoring(oscillator: Oscillator, part: Region, theta: Values) -> Values:
    """The restoring moment that a region of an oscillator has at rotations, per unit moment of inertia, rad/s²."""
    if oscillator.exact:
        return np.asarray(-part.stiffness * np.sin(part.offset / part.stiffness - theta))
    return np.asarray(part.stiffness * theta - part.offset)


def _upright(response: xr.Dataset, theta: Values, restoring: Values, *more: Values) -> tuple[Values, ...]:
    """The samples, with both ends of the jump wherever a rigid block goes through upright between two of them.

    In an elastic zone nothing jumps: only samples at rest, and those on the branches that end upright, count.
    """
    options = json.loads(response.attrs["configuration"])
    law, block = LAWS.get(options["model"].pop("law")), Block(**options["block"])
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

    def ends(first: Values, last: Values) -> Values:
        return np.stack([first, last], axis=1).ravel()

    # (at rest the floor's reaction is where the shaking puts it)
    first, last = (np.where(side[at] == 0.0, restoring[at], side[at] * jump) for at in (before, after))
    level = [one[before] + share * (one[after] - one[before]) for one in more]
    return (
        np.insert(theta, places, 0.0),
        np.insert(restoring, places, ends(first, last)),
        *(np.insert(one, places, ends(at, at)) for one, at in zip(more, level, strict=True)),
    )
