"""Figures of single responses: histories, phase portraits, hysteresis, and the moment that rights a block.

Axes in, axes out.  They take what `toppling.simulate` and `toppling.free_rocking` return, and know nothing of studies.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law
from ..models.simulate import oscillator_of
from .plots import COLOURS, model_name, styles

HIGHEST = 1.6
"""|θ|/α at which the curve of a falling block leaves a figure of histories."""
WIDEST = 1.15
"""|θ|/α up to which a moment is drawn: a little past the balance."""
MOMENTS = {
    "total": ("restoring_moment", "damping_moment"),
    "damping": ("damping_moment",),
    "restoring": ("restoring_moment",),
}


def history(
    responses: xr.Dataset | Sequence[xr.Dataset],
    ax: Axes | None = None,
    *,
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
) -> Axes:
    """Rotation over slenderness against time, a line for each response; a cross where one overturns.

    Parameters
    ----------
    responses : xarray.Dataset or sequence of them
        As `toppling.simulate` or `toppling.free_rocking` returns them, of any blocks and laws.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    labels : sequence of str, optional
        One for each response, "" for none; the law, the block or the motion, whichever tells them apart, where not
        given.
    colours : sequence of str, optional
        One for each response; the palette's, with the first Housner black and dashed, where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError
        What is no dataset.
    ValueError
        No responses, datasets that hold no history, labels or colours of another number.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_response
    >>> block = tp.Block.from_slenderness(0.2, 0.38)
    >>> laws = tp.HousnerImpact(e=0.925), tp.DiscreteDamping(e=0.925)
    >>> ax = plots_response.history([tp.free_rocking(block, law, 0.1, 4.0) for law in laws])
    >>> [text.get_text() for text in ax.get_legend().get_texts()]
    ['housner e=0.925', 'discrete e=0.925 δ=0.05']
    """
    many = [responses] if isinstance(responses, xr.Dataset) else list(responses)
    if not many:
        raise ValueError("responses must be at least one history, got none")
    for one in many:
        _checked(one)
    names = _as_many("labels", labels, many) or _names(many)
    chosen = _as_many("colours", colours, many)
    if ax is None:
        ax = Figure(figsize=(6.4, 3.4), layout="constrained").add_subplot()
    fallen = False
    for i, (one, (colour, _, line)) in enumerate(zip(many, _styles(many), strict=True)):
        standing = _standing(one)
        time, x = one["time"].values[standing], (one["rotation"].values / one.attrs["alpha"])[standing]
        own = colour if chosen is None else chosen[i]
        ax.plot(time, x, color=own, ls=line, lw=1.4, label=names[i])
        if bool(one["overturned"]):
            shown = np.flatnonzero(np.abs(x) <= HIGHEST)
            last = int(shown[-1]) if shown.size else 0
            ax.plot(time[last], x[last], marker="X", ms=8.0, mew=0.6, mec="white", color=own, ls="none", zorder=3)
            fallen = True
    if fallen and any(names):
        ax.plot([], [], marker="X", ms=8.0, mew=0.6, mec="white", color="0.4", ls="none", label="overturns")
    if fallen:
        low, high = ax.get_ylim()
        ax.set_ylim(max(low, -HIGHEST - 0.1), min(high, HIGHEST + 0.1))
    ax.set_xlabel("time (s)")
    ax.set_ylabel("rotation over slenderness, θ/α (–)")
    if len(ax.get_legend_handles_labels()[0]) > 1:
        ax.legend(frameon=False, fontsize=9)
    return _plain(ax)


def phase(response: xr.Dataset, ax: Axes | None = None, *, label: str | None = None, colour: str | None = None) -> Axes:
    """Rotation over slenderness against angular velocity over p α: a spiral into rest, or out to where it falls.

    Parameters
    ----------
    response : xarray.Dataset
        As `toppling.simulate` or `toppling.free_rocking` returns it; after overturning nothing is drawn.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    label, colour : str, optional
        Of the line.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError
        What is no dataset.
    ValueError
        A dataset that holds no history.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_response
    >>> block = tp.Block.from_slenderness(0.2, 0.38)
    >>> ax = plots_response.phase(tp.free_rocking(block, tp.HousnerImpact(e=0.925), 0.1, 4.0))
    >>> ax.get_ylabel()
    "angular velocity over p α, θ'/(pα) (–)"
    """
    _checked(response)
    if ax is None:
        ax = Figure(figsize=(4.6, 4.2), layout="constrained").add_subplot()
    standing = _standing(response)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    x, v = response["rotation"].values / alpha, response["angular_velocity"].values / (p * alpha)
    ax.plot(x[standing], v[standing], color=colour or COLOURS[0], lw=1.2, label=label)
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel("angular velocity over p α, θ'/(pα) (–)")
    return _plain(ax)


def hysteresis(
    response: xr.Dataset,
    ax: Axes | None = None,
    *,
    moment: str = "total",
    label: str | None = None,
    colour: str | None = None,
) -> Axes:
    """What resists the block against its rotation: the restoring and the damping moment, over M0 = m g R sin α.

    Parameters
    ----------
    response : xarray.Dataset
        As `toppling.simulate` or `toppling.free_rocking` returns it; after overturning nothing is drawn.  An impact
        takes its energy at one rotation: the curve of a Housner block encloses nothing.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    moment : {"total", "damping", "restoring"}
        The sum, or one of its parts.
    label, colour : str, optional
        Of the line.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError
        What is no dataset.
    ValueError
        A dataset that holds no history; another moment.

    Notes
    -----
    The histories hold moments per unit moment of inertia, and M0/I_O = p² sin α.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_response
    >>> block = tp.Block.from_slenderness(0.2, 0.38)
    >>> run = tp.free_rocking(block, tp.DiscreteDamping(e=0.925), 0.1, 4.0)
    >>> ax = plots_response.hysteresis(run, moment="damping")
    >>> ax.get_ylabel()
    'damping moment over M0 (–)'
    """
    parts = MOMENTS[checks.choice("moment", moment, tuple(MOMENTS))]
    _checked(response)
    if ax is None:
        ax = Figure(figsize=(5.0, 3.8), layout="constrained").add_subplot()
    standing = _standing(response)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    resisting = sum(response[part].values for part in parts) / (p**2 * math.sin(alpha))
    x = response["rotation"].values / alpha
    ax.plot(x[standing], resisting[standing], color=colour or COLOURS[0], lw=1.2, label=label)
    name = {"total": "restoring and damping", "damping": "damping", "restoring": "restoring"}[moment]
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel(f"{name} moment over M0 (–)")
    return _plain(ax)


def moment(
    block: Block,
    model: Law,
    ax: Axes | None = None,
    *,
    label: str | None = None,
    colour: str | None = None,
    line: Any = "solid",
) -> Axes:
    """The restoring moment of a block under a law against its rotation, with the law's elastic zone shaded.

    Parameters
    ----------
    block : Block
    model : law
        Its geometry decides the curve: sine or straight, with an elastic zone or upright where the block is rigid.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    label, colour : str, optional
        Of the line; the law's own label where not given.
    line : matplotlib line style, optional

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
    Over M0 = m g R sin α, which the floor's reaction can balance before the block lifts.  With ``rest="rigid"`` a
    block that starts from rest, or that would come to rest, follows the rigid branch; the zone is drawn dotted.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_response
    >>> ax = plots_response.moment(tp.Block.from_slenderness(0.2, 0.38), tp.DiscreteDamping(e=0.925, delta=0.1))
    >>> round(float(ax.get_lines()[0].get_ydata().max()), 3)
    0.9
    """
    oscillator = oscillator_of(block, model)
    if ax is None:
        ax = Figure(figsize=(5.4, 3.8), layout="constrained").add_subplot()
    alpha = block.alpha
    unit = block.p**2 * math.sin(alpha)
    own = colour or COLOURS[0]
    end = WIDEST * alpha
    solid: list[NDArray[np.float64]] = []
    for part in sorted(oscillator.regions, key=lambda part: (part.lower, part.upper)):
        theta = np.linspace(max(part.lower, -end), min(part.upper, end), 201)
        if oscillator.exact:
            resisting = -part.stiffness * np.sin(part.offset / part.stiffness - theta)
        else:
            resisting = part.stiffness * theta - part.offset
        curve = np.stack([theta / alpha, resisting / unit])
        if part.captures:
            ax.plot(*curve, color=own, lw=1.4, ls=(0, (1, 1.5)))
        else:
            solid.append(curve)
    # one line in one style: where the block rests it goes straight up, as the floor's reaction does
    x, y = np.concatenate(solid, axis=1)
    ax.plot(x, y, color=own, lw=1.8, ls=line, label=model_name(model.label) if label is None else label)
    delta = getattr(model, "delta", None)
    if delta is not None:
        ax.axvspan(-delta, delta, color="0.9", lw=0.0, zorder=0)
    ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel("restoring moment over M0 (–)")
    return _plain(ax)


def _checked(response: Any) -> None:
    """TypeError where a response is no dataset, ValueError where it holds no history."""
    if not isinstance(response, xr.Dataset):
        raise TypeError(f"a response must be a dataset as toppling.simulate returns it, got {checks.kind(response)}")
    needed = {"rotation", "angular_velocity", "restoring_moment", "damping_moment", "overturned", "overturning_time"}
    lacks = sorted(needed - {str(name) for name in response.data_vars})
    lacks += sorted({"alpha", "p", "configuration"} - {str(name) for name in response.attrs})
    if lacks or response["rotation"].dims != ("time",):
        why = f"without {', '.join(lacks)}" if lacks else f"with rotation on {response['rotation'].dims}"
        raise ValueError(f"a response must hold one history as toppling.simulate returns it, got a dataset {why}")


def _standing(response: xr.Dataset) -> NDArray[np.bool_]:
    """The samples before the block lies on its side."""
    if not bool(response["overturned"]):
        return np.ones(response.sizes["time"], dtype=bool)
    return np.asarray(np.abs(response["rotation"].values) < 0.5 * math.pi)


def _as_many(name: str, values: Sequence[str] | None, many: Sequence[Any]) -> list[str] | None:
    """The values as a list; ValueError where they are not one for each response."""
    if values is None:
        return None
    if isinstance(values, str) or len(values) != len(many):
        raise ValueError(f"{name} must be {len(many)}, one for each response, got {values!r:.60}")
    return list(values)


def _names(many: Sequence[xr.Dataset]) -> list[str]:
    """What tells the responses apart: law, block or motion; all that differ."""
    found = [[str(one.attrs.get(name, "")) for name in ("model", "block", "motion")] for one in many]
    differ = [len(set(column)) > 1 for column in zip(*found, strict=True)]
    if not any(differ):
        differ[0] = True
    texts = [", ".join(part for part, other in zip(row, differ, strict=True) if other and part) for row in found]
    return [model_name(text) for text in texts]


def _styles(many: Sequence[xr.Dataset]) -> list[tuple[str, str, Any]]:
    """Colour, marker and line of each response, as of the laws of a study."""
    laws = [json.loads(one.attrs["configuration"])["model"]["law"] for one in many]
    return styles(xr.Dataset({"law": ("model", laws)}))


def _plain(ax: Axes) -> Axes:
    """The looks that all figures share."""
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    return ax
