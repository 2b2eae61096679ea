"""The figures of docs/paper.md: each takes what it draws and returns a figure.  Narrow, so that a phone shows them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import paper_numbers as numbers
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter
from paper_numbers import CONCRETE, DELTA, FIGURE_6, RIVALS, X0, E

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.studies.plot import history, hysteresis, moment
from toppling.studies.plots.axes import COLOURS, plain_log

_SIZED = ("font.size", "axes.labelsize", "axes.titlesize", "legend.fontsize", "figure.labelsize")
LOOKS: dict[str, Any] = dict.fromkeys(_SIZED, 10.5)
"""8 pt where a phone shows a figure 380 pixels wide."""
WIDTH = 5.2
ROCKING = "rotation over slenderness, θ/α (–)"


def moment_figure() -> Figure:
    """The paper's figure 2."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    ax = figure.add_subplot()
    exact = tp.HousnerImpact(e=E)
    moment(FIGURE_6, exact, ax, label="rigid block: sin(α − θ)/sin α", color="0.55")
    moment(FIGURE_6, tp.DiscreteDamping(e=E, delta=DELTA), ax, label=f"bilinear, δ = {DELTA:g}", linestyle="dashed")
    ax.annotate("elastic zone\n±δα", (-DELTA, 0.5), xytext=(-0.66, 0.46), arrowprops={"arrowstyle": "-", "lw": 0.8})
    ax.annotate("balance", (1.0, 0.0), xytext=(0.72, -0.42), arrowprops={"arrowstyle": "-", "lw": 0.8})
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return figure


def energy(run: xr.Dataset, delta: float) -> np.ndarray:
    """Energy over that at the start of free rocking, of a bilinear block (delta = 0: rigid)."""
    alpha, q2 = run.attrs["alpha"], run.attrs["p"] ** 2 * math.sin(run.attrs["alpha"]) / run.attrs["alpha"]
    theta = np.abs(run["rotation"].values)
    edge = delta * alpha
    outside = q2 * (alpha * theta - 0.5 * theta**2 - 0.5 * alpha * edge)
    potential = outside
    if delta > 0.0:
        potential = np.where(theta < edge, 0.5 * (1.0 / delta - 1.0) * q2 * theta**2, outside)
    total = 0.5 * run["angular_velocity"].values ** 2 + potential
    return np.asarray(total / total[0])


def dissipation_figure() -> Figure:
    """The paper's figure 4: when energy is lost, by impact, all the time, and in the zone."""
    cases = (
        ("impact", tp.HousnerImpact(e=E, geometry="bilinear"), 0.0, "black"),
        ("continuous", tp.GianniniMasiani(e=E, delta=DELTA), DELTA, COLOURS[1]),
        ("discrete", tp.DiscreteDamping(e=E, delta=DELTA), DELTA, COLOURS[0]),
    )
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey="row")
    for (name, law, delta, colour), (top, bottom) in zip(cases, axes.T, strict=True):
        run = tp.free_rocking(CONCRETE, law, X0 * CONCRETE.alpha, 2.4, 5e-4)
        time, x = run["time"].values, run["rotation"].values / CONCRETE.alpha
        for ax in (top, bottom):
            if name == "continuous":
                ax.axvspan(time[0], time[-1], color=colour, alpha=0.13, lw=0.0)
            elif name == "discrete":
                # (its first crossing included: the coefficient is set at each inward crossing)
                ax.fill_between(
                    time, 0.0, 1.0, where=np.abs(x) < delta, transform=ax.get_xaxis_transform(), color=colour, alpha=0.2
                )
            else:
                for i in np.flatnonzero(np.diff(np.sign(x))):
                    ax.axvline(time[i], color="0.6", lw=1.0)
            ax.grid(alpha=0.25, lw=0.6)
            ax.spines[["top", "right"]].set_visible(False)
        top.plot(time, x, color=colour, lw=1.5)
        bottom.plot(time, energy(run, delta), color=colour, lw=1.5)
        top.set_title(name)
    axes[0, 0].set_ylabel("θ/α (–)")
    axes[1, 0].set_ylabel("energy left")
    axes[1, 0].set_ylim(0.0, 1.05)
    axes[1, 0].yaxis.set_major_formatter(PercentFormatter(1.0))
    figure.supxlabel("time (s); shaded: while energy is lost")
    return figure


def ratio_figure() -> Figure:
    """The paper's figure 5."""
    e = np.linspace(0.002, 1.0, 800)
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    ax = figure.add_subplot()
    names = (
        ("Giannini–Masiani: (2/π)(1 − e)/(1 + e)", tp.GianniniMasiani.damping_ratio, COLOURS[1], "solid"),
        ("Makris–Konstantinidis: −0.68 ln e", tp.MakrisKonstantinidis.damping_ratio, COLOURS[2], "solid"),
        ("FEMA 356 (added): 0.4 (1 − e)", lambda one: 0.4 * (1.0 - one), "0.5", "dashed"),
    )
    for name, ratio, colour, line in names:
        ax.plot(e, [ratio(float(one)) for one in e], color=colour, lw=1.8, ls=line, label=name)
    ax.plot(0.0, 2.0 / math.pi, "o", color=COLOURS[1], ms=5.0, clip_on=False)
    ax.annotate("2/π", (0.0, 2.0 / math.pi), xytext=(6, 3), textcoords="offset points")
    ax.axvspan(0.85, 1.0, color="0.92", lw=0.0, zorder=0)
    ax.annotate("e_R of blocks with h/b ≥ 3".replace("e_R", "$e_R$"), (0.84, 0.62), ha="right")
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 1.2)
    ax.set_xlabel("coefficient of restitution e (–)")
    ax.set_ylabel("damping ratio ζ (–)")
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, loc="upper right")
    return figure


def hysteresis_figure() -> Figure:
    """The paper's figure 6: total moments above, damping moments below; discrete left, continuous right."""
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    laws = (
        ("discrete", tp.DiscreteDamping(e=E, delta=DELTA), COLOURS[0]),
        ("continuous", tp.GianniniMasiani(e=E, delta=DELTA), COLOURS[1]),
    )
    for column, (name, law, colour) in enumerate(laws):
        run = tp.free_rocking(FIGURE_6, law, X0 * FIGURE_6.alpha, 4.0, 2e-4)
        for row, part in enumerate(("total", "damping")):
            ax = hysteresis(run, axes[row, column], moment=part, color=colour)
            ax.axvspan(-DELTA, DELTA, color="0.9", lw=0.0, zorder=0)
            ax.set_title(f"({'abcd'[2 * row + column]}) {part}, {name}")
            ax.set_xlabel("")
            ax.set_ylabel("moment over M0 (–)" if column == 0 else "")
    figure.supxlabel(ROCKING)
    return figure


def free_figure() -> Figure:
    """The paper's figure 7: rows are laws, columns are rotation, velocity and acceleration."""
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    axes = figure.subplots(len(RIVALS), 3, sharex=True, sharey="col")
    reference = tp.free_rocking(CONCRETE, tp.HousnerImpact(e=E, geometry="linear"), X0 * CONCRETE.alpha, 4.0)
    for row, rival in enumerate(RIVALS):
        run = tp.free_rocking(CONCRETE, rival.make(E, DELTA), X0 * CONCRETE.alpha, 4.0)
        for ax, (name, power) in zip(
            axes[row], (("rotation", 0), ("angular_velocity", 1), ("angular_acceleration", 2)), strict=True
        ):
            unit = CONCRETE.p**power * CONCRETE.alpha
            ax.plot(reference["time"], reference[name] / unit, color="0.35", lw=0.8, ls=(0, (3, 1.5)))
            ax.plot(run["time"], run[name] / unit, color=rival.colour, lw=1.3)
            ax.grid(alpha=0.25, lw=0.6)
            ax.spines[["top", "right"]].set_visible(False)
        axes[row, 0].set_title(f"({rival.panel}) {rival.name}", loc="left")
        axes[row, 0].set_xlim(0.0, 4.0)
        axes[row, 0].set_ylabel("θ/α (–)")
        axes[row, 1].set_ylabel("θ'/(pα) (–)")
        axes[row, 2].set_ylabel("θ''/(p²α) (–)")
    axes[0, 2].set_ylim(-1.6, 1.6)
    figure.supxlabel("time (s); dashed: Housner's block")
    return figure


def delta_figure() -> Figure:
    """The paper's figure 10: rotation histories at several deltas, a panel for each law."""
    figure = Figure(figsize=(WIDTH, 7.2), layout="constrained")
    axes = figure.subplots(len(RIVALS), 1, sharex=True, sharey=True)
    shades = ("#9ecae1", "#4a98c9", "#08306b")
    deltas = (0.01, 0.05, 0.1)
    for ax, rival in zip(axes, RIVALS, strict=True):
        runs = [tp.free_rocking(CONCRETE, rival.make(E, delta), X0 * CONCRETE.alpha, 6.0) for delta in deltas]
        history(runs, ax, colors=shades, labels=[f"δ = {delta:g}" for delta in deltas])
        _bare(ax)
        ax.set_title(f"({rival.panel}) {rival.name}", loc="left")
        ax.set_xlim(0.0, 6.0)
    figure.supylabel(ROCKING)
    figure.supxlabel("time (s)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    return figure


def motion_figure(waveform: xr.DataArray, title: str) -> Figure:
    """The paper's figure 11, of another motion: its history and its spectrum of pseudo-acceleration."""
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    top, bottom = figure.subplots(2, 1)
    one = waveform.isel(motion=0)
    time = np.arange(one.size) * float(one["dt"])
    top.plot(time, one.values / STANDARD_GRAVITY, color="black", lw=0.6)
    top.set_xlim(0.0, time[-1])
    top.set_xlabel("time (s)")
    top.set_ylabel("acceleration (g)")
    top.set_title(title)
    periods = np.geomspace(0.05, 5.0, 200)
    spectrum = tp.motions.response_spectrum(waveform, periods, 0.05)
    bottom.plot(periods, spectrum["sa"].isel(motion=0).values / STANDARD_GRAVITY, color="black", lw=1.3)
    bottom.set_xscale("log")
    bottom.set_xlim(0.05, 5.0)
    plain_log(bottom)
    bottom.set_ylim(bottom=0.0)
    bottom.set_xlabel("period (s)")
    bottom.set_ylabel("Sa, 5 % damping (g)")
    for ax in (top, bottom):
        ax.grid(alpha=0.25, lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def forced_figure(runs: Sequence[numbers.Forced], longest: float = 20.0) -> Figure:
    """The paper's figures 12 and 13: rows are laws, columns are runs; the rigid block in exact geometry dashed."""
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(len(RIVALS), len(runs), sharex=True, sharey=True)
    for column, run in enumerate(runs):
        axes[0, column].text(0.5, 1.3, run.name, transform=axes[0, column].transAxes, ha="center", weight="bold")
        for row, rival in enumerate(RIVALS):
            ax = history(
                [run.runs[row], run.reference], axes[row, column], colors=(rival.colour, "black"), labels=("", "")
            )
            ax.get_lines()[1 + int(bool(run.runs[row]["overturned"]))].set(lw=0.8, ls=(0, (3, 1.5)))
            _bare(ax)
            if column == 0:
                ax.set_title(f"({rival.panel}) {rival.name}", loc="left")
    axes[0, 0].set_xlim(0.0, longest)
    axes[0, 0].set_xticks(np.arange(0.0, longest, 5.0))
    axes[0, 0].set_ylim(-1.75, 1.75)
    figure.supylabel(ROCKING)
    figure.supxlabel("time (s)")
    cross: dict[str, Any] = {"marker": "X", "ms": 8.0, "ls": "none", "color": "0.4"}
    figure.legend(
        [Line2D([], [], color="black", lw=0.9, ls=(0, (3, 1.5))), Line2D([], [], **cross)],
        ["Housner's block, exact geometry", "falls from here on"],
        loc="outside upper center",
        ncols=2,
        frameon=False,
    )
    return figure


def verdict_figure(fell: xr.DataArray) -> Figure:
    """Which law falls at which scale of the waveform: a row for each law, a panel for each block."""
    blocks = fell.sizes["block"]
    figure = Figure(figsize=(WIDTH, 1.6 * blocks + 0.8), layout="constrained")
    axes = figure.subplots(blocks, 1, sharex=True, squeeze=False)[:, 0]
    scales = fell["level"].values
    half = 0.5 * float(scales[1] - scales[0])
    names = ["Housner, exact", *(rival.name.replace(" (ours)", "") for rival in RIVALS)]
    for i, ax in enumerate(axes):
        values = fell.isel(block=i).values.astype(int)
        edges = np.append(scales - half, scales[-1] + half)
        ax.pcolormesh(
            edges,
            np.arange(len(names) + 1) - 0.5,
            values,
            cmap=ListedColormap(["#f0f0f0", "#34495e"]),
            vmin=0,
            vmax=1,
            edgecolors="white",
            lw=0.6,
        )
        ax.set_yticks(range(len(names)), names)
        ax.invert_yaxis()
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
        ax.set_title(str(fell["block"].values[i]), loc="left")
    axes[-1].set_xticks(np.arange(1.0, scales[-1] + half))
    axes[-1].xaxis.set_major_formatter(PercentFormatter(1.0))
    axes[-1].set_xlabel("scale of the waveform; dark: overturns")
    return figure


def _bare(ax: Axes) -> None:
    """No labels of its own: the figure has them."""
    ax.set_xlabel("")
    ax.set_ylabel("")
