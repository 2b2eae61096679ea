"""Figures of uncertainty: shares of variance, Sobol' and Morris indices, a tornado.  Axes in, axes out."""

from __future__ import annotations

import math
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from .estimates import middle_level
from .plots import COLOURS, MARKERS, model_name, plain_log, styles
from .words import display_unit

NAMES = {
    "alpha": "α",
    "alpha_factor": "α / nominal",
    "R": "R",
    "R_factor": "R / nominal",
    "inertia_factor": "λ",
    "e": "e",
    "restitution_factor": "$e/e_R$",
    "delta": "δ",
    "zeta": "ζ",
    "law": "damping law",
    "model": "damping law",
    "sample": "parameters",
    "cm_height": "mass centre",
}
MOST_BARS = 8
HATCHES = ("", "////", "....")


def input_name(name: str) -> str:
    """An input, or a dimension of runs, as people write it."""
    return NAMES.get(name, name)


def variance_bars(shares: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Shares of the total variance as stacked bars, one for each entry of the dimension left.

    Main effects are plain, interactions hatched.

    Parameters
    ----------
    shares : xarray.Dataset
        As `fragility.variance_shares` returns it, on component and at most one dimension more (such as level).
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        More than one dimension beside component.
    """
    share = shares["share"]
    rest = [str(dim) for dim in share.dims if dim != "component"]
    if len(rest) > 1:
        raise ValueError(f"shares are drawn along one dimension, got {', '.join(rest)}: select")
    if ax is None:
        ax = plt.figure(figsize=(8.4, 4.0) if rest else (4.6, 4.0), layout="constrained").add_subplot()
    values = np.atleast_2d(share.transpose(*rest, "component").values)
    x = np.arange(values.shape[0])
    bottom = np.zeros(x.size)
    styles = _component_styles([str(one) for one in share["component"].values])
    for k, (label, style) in enumerate(styles.items()):
        height = np.nan_to_num(values[:, k])
        ax.bar(x, height, 0.82, bottom, label=label, edgecolor="white", lw=0.8, **style)
        bottom += height
    for at in x[np.isnan(values).any(axis=1)]:
        ax.annotate("no variance", (at, 0.02), ha="center", rotation=90, fontsize=8, color="0.4")
    if rest:
        axis = shares[rest[0]]
        if axis.dtype.kind == "f":
            scale, unit = display_unit(axis)
            ax.set_xticks(x, [f"{one / scale:.2g}" for one in axis.values])
            ax.set_xlabel(f"{axis.attrs.get('long_name', rest[0])}{f' ({unit})' if unit else ''}")
        else:
            ax.set_xticks(x, [str(one) for one in axis.values])
    else:
        ax.set_xticks([])
        ax.set_xlim(-0.7, 0.7)
    ax.set_ylim(0.0, 1.0)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel("share of the variance")
    ax.spines[["top", "right"]].set_visible(False)
    handles, labels = ax.get_legend_handles_labels()
    # top to bottom as the bars are
    ax.legend(handles[::-1], labels[::-1], frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    return ax


def _component_styles(components: list[str]) -> dict[str, dict[str, Any]]:
    """A colour for each main effect; interactions grey, hatched by the number of factors."""
    styles: dict[str, dict[str, Any]] = {}
    greys = iter(np.linspace(0.45, 0.85, max(1, sum("×" in one for one in components))))
    mains = 0
    for one in components:
        parts = one.split(" × ")
        label = " × ".join(input_name(part) for part in parts)
        if len(parts) == 1:
            styles[label] = {"color": COLOURS[mains % len(COLOURS)]}
            mains += 1
        else:
            styles[label] = {"color": str(round(float(next(greys)), 3)), "hatch": HATCHES[min(len(parts) - 1, 2)]}
    return styles


def sobol_bars(indices: xr.Dataset, ax: Axes | None = None) -> Axes:
    """First- and total-order Sobol' indices with their intervals, the largest total on top.

    Parameters
    ----------
    indices : xarray.Dataset
        As `fragility.sobol_indices` returns it, of one output (``isel(output=0)``).
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Several outputs.
    """
    here = _one_output(indices, "total")
    order = np.argsort(-np.nan_to_num(here["total"].values), kind="stable")
    here = here.isel(input=order)
    y = np.arange(order.size)
    if ax is None:
        ax = plt.figure(figsize=(6.0, 0.55 * y.size + 1.2), layout="constrained").add_subplot()
    for name, shift, colour, label in (
        ("total", 0.19, COLOURS[5], "total: with all others"),
        ("first", -0.19, COLOURS[0], "first order: alone"),
    ):
        half = here[f"{name}_upper"].values - here[name].values
        error = {"ecolor": "0.25", "elinewidth": 1.1, "capsize": 2.5}
        ax.barh(y + shift, here[name].values, 0.36, color=colour, label=label, xerr=half, error_kw=error)
    ax.axvline(0.0, color="0.25", lw=0.8)
    ax.set_yticks(y, [input_name(str(one)) for one in here["input"].values])
    ax.set_ylim(y[-1] + 0.6, -0.6)
    ax.set_xlabel("share of the variance (Sobol' index)")
    _bare(ax)
    handles, labels = ax.get_legend_handles_labels()
    ax.legend(handles[::-1], labels[::-1], frameon=False, loc="lower right", fontsize=9)
    _title(ax, here)
    return ax


def morris_scatter(indices: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Morris' mean absolute effect of every input against the scatter of its effects.

    Parameters
    ----------
    indices : xarray.Dataset
        As `fragility.morris_indices` returns it, of one output.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Several outputs.
    """
    here = _one_output(indices, "mu_star")
    if ax is None:
        ax = plt.figure(figsize=(5.6, 4.6), layout="constrained").add_subplot()
    x, y = here["mu_star"].values, here["sigma"].values
    half = here["mu_star_upper"].values - x
    for i, name in enumerate(here["input"].values):
        colour, marker = COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)]
        ax.errorbar(x[i], y[i], xerr=half[i], fmt=marker, ms=7.0, color=colour, lw=1.1, label=input_name(str(name)))
    largest = 1.08 * max(float((x + half).max()), float(y.max()), 1e-12)
    ax.plot([0.0, largest], [0.0, largest], color="0.7", lw=0.8, ls=(0, (4, 2)), zorder=0)
    ax.annotate("σ = µ*", (0.93 * largest, 0.95 * largest), ha="right", fontsize=8, color="0.45")
    ax.set_xlim(0.0, largest)
    ax.set_ylim(-0.02 * largest, largest)
    ax.set_xlabel("µ*: mean absolute effect over the input's range")
    ax.set_ylabel("σ: scatter of the effect (interaction, curvature)")
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    _title(ax, here)
    return ax


def tornado_bars(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """The output with one input at a time at its low and high quantile, the widest on top.

    Parameters
    ----------
    found : xarray.Dataset
        As `fragility.tornado` returns it, of one output.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Several outputs.
    """
    here = _one_output(found, "swing")
    here = here.isel(input=np.argsort(-here["swing"].values, kind="stable"))
    y = np.arange(here.sizes["input"])
    if ax is None:
        ax = plt.figure(figsize=(6.0, 0.42 * y.size + 1.3), layout="constrained").add_subplot()
    base = here["base"].item()
    first, last = (f"{100.0 * float(one):g} %" for one in found.attrs["quantiles"])
    ax.axvline(base, color="0.25", lw=0.9, zorder=0)
    # ends and not bars from the base: both may lie on one side of it, where one bar would hide the other
    ax.hlines(y, here["low"].values, here["high"].values, color="0.75", lw=5.0, zorder=1)
    for name, colour, marker, label in (
        ("low", COLOURS[0], "o", f"input at its {first} quantile, or its least choice"),
        ("high", COLOURS[1], "s", f"input at its {last} quantile, or its greatest choice"),
    ):
        ax.plot(here[name].values, y, marker, ms=8.0, color=colour, label=label, zorder=2)
    ax.set_yticks(y, [input_name(str(one)) for one in here["input"].values])
    ax.set_ylim(y[-1] + 0.6, -0.6)
    ax.set_xlabel(str(here["output"].item()) if "output" in here.coords else "value")
    _bare(ax)
    ax.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=9)
    return ax


def _one_output(indices: xr.Dataset, name: str) -> xr.Dataset:
    if indices[name].dims != ("input",):
        raise ValueError(f"one output is drawn, got {dict(indices[name].sizes)}: select it")
    return indices


def _title(ax: Axes, here: xr.Dataset) -> None:
    if "output" in here.coords:
        ax.set_title(str(here["output"].item()), fontsize=10)


def _bare(ax: Axes) -> None:
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(axis="y", length=0.0)
    ax.spines[["top", "right", "left"]].set_visible(False)


def uncertainty_figure(results: xr.Dataset) -> Figure:
    """An uncertainty study: the curves with their spread over samples, and where the variance comes from.

    A row for each block: on the left the probability of each law, all inputs uncertain, with a band that holds 90 % of
    the samples' own probabilities; on the right the shares of the variance of the verdict at levels where it is open.
    """
    blocks = [str(one) for one in results["block"].values]
    figure = plt.figure(figsize=(11.0, 4.4 * len(blocks) + 0.5), layout="constrained")
    axes = figure.subplots(len(blocks), 2, squeeze=False, width_ratios=(1.0, 0.9))
    scale, unit = display_unit(results["level"])
    for (left, right), block in zip(axes, blocks, strict=True):
        here = results.sel(block=block)
        x = here["level"].values / scale
        for i, (colour, _, line) in enumerate(styles(here)):
            one = here.isel(model=i)
            band = one["probability_quantile"]
            left.fill_between(x, band.isel(quantile=0), band.isel(quantile=-1), color=colour, alpha=0.15, lw=0.0)
            left.plot(x, one["probability"], color=colour, ls=line, lw=1.8, label=model_name(str(one["model"].item())))
        left.set_xscale("log")
        plain_log(left)
        left.yaxis.set_major_formatter(PercentFormatter(1.0))
        left.set_xlabel(f"{here['level'].attrs.get('long_name', 'level')}{f' ({unit})' if unit else ''}")
        left.set_ylabel("probability of overturning")
        left.set_title(block, fontsize=10)
        left.grid(alpha=0.25, lw=0.6)
        left.spines[["top", "right"]].set_visible(False)
        left.legend(frameon=False, fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.16))
        overall = here["probability"].mean("model").values
        open_ = np.flatnonzero((overall > 0.005) & (overall < 0.995))
        chosen = open_[:: max(1, math.ceil(open_.size / MOST_BARS))] if open_.size else np.arange(1)
        variance_bars(here[["flag_share"]].rename(flag_share="share").isel(level=chosen), right)
        right.set_title("Where the variance of the verdict comes from", fontsize=10)
    samples, motions = results.sizes["sample"], results.sizes["motion"]
    figure.suptitle(
        f"{results.attrs.get('title', 'Uncertainty')}\n{samples} samples under {motions} motions; "
        "bands hold 90 % of the samples' own probabilities",
        fontsize=11,
    )
    return figure


def index_figure(results: xr.Dataset, name: str) -> Figure:
    """Sobol' or Morris' indices of an uncertainty study at the level where the probability is nearest to one half."""
    blocks, models = ([str(one) for one in results[dim].values] for dim in ("block", "model"))
    draw = {"sobol": sobol_bars, "morris": morris_scatter}[name]
    own = [str(one) for one in results.data_vars if str(one).startswith(f"{name}_")]
    indices = results[own].rename({one: one.removeprefix(f"{name}_") for one in own})
    figure = plt.figure(figsize=(5.4 * len(models), 3.4 * len(blocks) + 0.4), layout="constrained")
    axes = figure.subplots(len(blocks), len(models), squeeze=False)
    for row, block in zip(axes, blocks, strict=True):
        for ax, model in zip(row, models, strict=True):
            probability = results["probability"].sel(block=block, model=model)
            at = middle_level(probability)
            draw(indices.sel(block=block, model=model).isel(output=at), ax)
            scale, unit = display_unit(results["level"])
            level = f"{float(results['level'][at]) / scale:.3g}{f' {unit}' if unit else ''}"
            ax.set_title(f"{block}, {model_name(model)}\nprobability of overturning at {level}", fontsize=9)
    return figure
