"""Figures of single responses: histories and phase portraits.

Axes in, axes out.  They take what `toppling.simulate` and `toppling.free_rocking` return, and know nothing of studies.
Lines that are given a label have it in their handles; axes that are handed in get no legend (``ax.legend()``).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from .histories import before_lying, checked, last_balance
from .plots import COLOURS, grid, model_name, new_axes, own_legend, styles

VARIABLES = ("angular_velocity", "restoring_moment", "damping_moment", "overturned", "overturning_time")
ATTRIBUTES = ("alpha", "p", "configuration")
"""What a history holds beside its rotation."""
HIGHEST = 1.6
"""|θ|/α at which the curve of a falling block leaves a figure of histories."""
CROSS: dict[str, Any] = {"marker": "X", "ms": 8.0, "mew": 0.6, "mec": "white", "ls": "none"}


def history(
    responses: xr.Dataset | Sequence[xr.Dataset],
    ax: Axes | None = None,
    *,
    labels: Sequence[str] | None = None,
    colors: Sequence[str] | None = None,
) -> Axes:
    """Rotation over slenderness against time, a line for each response; a cross where one is past its balance for good.

    Parameters
    ----------
    responses : xarray.Dataset or sequence of them
        As `toppling.simulate` or `toppling.free_rocking` returns them, of any blocks and laws.
    ax : matplotlib Axes, optional
        Where to draw; axes of a new figure, with a legend, where not given.
    labels : sequence of str, optional
        One for each response, "" for none; the law, the block or the motion, whichever tells them apart, where not
        given.
    colors : sequence of str, optional
        One for each response, matplotlib's; the palette's, with the first Housner black and dashed, where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError
        What is no dataset.
    ValueError
        No responses, datasets that hold no history, labels or colors of another number.

    Notes
    -----
    The cross stands where |θ| exceeds α for the last time, at the end of a history that ends before; the block lies on
    its side later, at the response's `overturning_time`.

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
        checked(one, VARIABLES, ATTRIBUTES)
    names = _as_many("labels", labels, many) or _names(many)
    chosen = _as_many("colors", colors, many)
    alone = ax is None
    if ax is None:
        ax = new_axes(6.4, 3.4)
    fallen = False
    for i, (one, (colour, _, line)) in enumerate(zip(many, _styles(many), strict=True)):
        standing = before_lying(one)
        time, x = one["time"].values[standing], (one["rotation"].values / one.attrs["alpha"])[standing]
        own = colour if chosen is None else chosen[i]
        ax.plot(time, x, color=own, ls=line, lw=1.4, label=names[i])
        if bool(one["overturned"]):
            ax.plot(*last_balance(one), color=own, zorder=3, **CROSS)
            fallen = True
    if fallen and any(names):
        ax.plot([], [], color="0.4", label="past its balance for good", **CROSS)
    if fallen:
        low, high = ax.get_ylim()
        ax.set_ylim(max(low, -HIGHEST - 0.1), min(high, HIGHEST + 0.1))
    ax.set_xlabel("time (s)")
    ax.set_ylabel("rotation over slenderness, θ/α (–)")
    if alone:
        own_legend(ax)
    grid(ax)
    return ax


def phase(response: xr.Dataset, ax: Axes | None = None, *, label: str | None = None, color: str | None = None) -> Axes:
    """Rotation over slenderness against angular velocity over p α: a spiral into rest, or out to where it falls.

    Parameters
    ----------
    response : xarray.Dataset
        As `toppling.simulate` or `toppling.free_rocking` returns it; after overturning nothing is drawn.
    ax, label, color : optional
        Matplotlib's: where to draw (new axes where not given), and of the line.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError, ValueError
        What is no dataset; one that holds no history.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies import plots_response
    >>> block = tp.Block.from_slenderness(0.2, 0.38)
    >>> ax = plots_response.phase(tp.free_rocking(block, tp.HousnerImpact(e=0.925), 0.1, 4.0))
    >>> ax.get_ylabel()
    "angular velocity over p α, θ'/(pα) (–)"
    """
    checked(response, VARIABLES, ATTRIBUTES)
    if ax is None:
        ax = new_axes(4.6, 4.2)
    standing = before_lying(response)
    alpha, p = response.attrs["alpha"], response.attrs["p"]
    x, v = response["rotation"].values / alpha, response["angular_velocity"].values / (p * alpha)
    ax.plot(x[standing], v[standing], color=color or COLOURS[0], lw=1.2, label=label)
    ax.set_xlabel("rotation over slenderness, θ/α (–)")
    ax.set_ylabel("angular velocity over p α, θ'/(pα) (–)")
    grid(ax)
    return ax


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
