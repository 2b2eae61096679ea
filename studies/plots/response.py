"""Figures of single responses: histories and phase portraits."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from ..text.histories import before_lying, checked, last_balance
from . import axes, selection

VARIABLES = ("angular_velocity", "restoring_moment", "damping_moment", "overturned", "overturning_time")
ATTRIBUTES = ("alpha", "p", "configuration")
"""Variables and attributes of a history that the figures need beside the rotation."""
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
        One label ("" for none) and one of matplotlib's colours for each response; by default the law, block or motion
        that distinguishes the responses, and the palette, with the first Housner black and dashed.
    """
    several = isinstance(responses, Iterable) and not isinstance(responses, xr.Dataset)
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
    """Return the values as a list; ValueError where there is not one value for each response."""
    if values is None:
        return None
    if isinstance(values, str) or len(values) != len(many):
        raise ValueError(f"{name} must be {len(many)}, one for each response, got {values!r:.60}")
    return list(values)


def _names(many: Sequence[xr.Dataset]) -> list[str]:
    """Return the names that distinguish the responses: law, block and motion, as far as they differ."""
    found = [[str(one.attrs.get(name, "")) for name in ("model", "block", "motion")] for one in many]
    differ = [len(set(column)) > 1 for column in zip(*found, strict=True)]
    if not any(differ):
        differ[0] = True
    texts = [", ".join(part for part, other in zip(row, differ, strict=True) if other and part) for row in found]
    return [axes.model_name(text) for text in texts]
