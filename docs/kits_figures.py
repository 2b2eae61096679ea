"""The figures of docs/kits.md: each takes what it draws and returns a figure.  Narrow, so that a phone shows them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator, PercentFormatter
from polarity import Share, share
from walls_figures import DPI, LOOKS, WIDTH, gap_name

from toppling.studies.plots.axes import COLOURS, MARKERS

__all__ = ["DPI", "LOOKS", "anchored_figure", "gap_name", "strength_figure", "survey_figure"]
FALLS = "P(falls into the room)"


def _bare(ax: Axes) -> None:
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def _forces(ax: Axes, ticks: Sequence[float]) -> None:
    """A logarithmic axis of forces."""
    ax.set_xscale("log")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_locator(FixedLocator(list(ticks)))
    ax.xaxis.set_major_formatter("{x:.0f}")
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))


def strength_figure(
    kit: np.ndarray, wall: np.ndarray, free: np.ndarray, names: Sequence[str], gaps: Sequence[float],
    stiffnesses: Sequence[float], slacks: Sequence[float], strengths: Sequence[float],
) -> Figure:  # fmt: skip
    """Falls over the strength of a strap (piece, gap, stiffness, slack, strength, motion): a panel a piece and gap."""
    figure = Figure(figsize=(WIDTH, 8.4), layout="constrained")
    axes = figure.subplots(len(names), len(gaps), sharex=True, sharey=True)
    ends = (0, len(slacks) - 1)
    for (i, j), ax in np.ndenumerate(axes):
        ax.axhline(wall[i, j].mean(), color="black", lw=1.2, ls=(0, (4, 2)))
        ax.axhline(free[i].mean(), color="0.65", lw=1.2)
        for k in range(len(stiffnesses)):
            for c, line in zip(ends, ("solid", (0, (1, 1))), strict=True):
                shares = [share(one) for one in kit[i, j, k, c]]
                ax.plot(strengths, [one.value for one in shares], color=COLOURS[k], ls=line, marker=MARKERS[k], ms=3.5,
                        lw=1.3)  # fmt: skip
                if c == 0:
                    ax.fill_between(strengths, [one.lower for one in shares], [one.upper for one in shares],
                                    color=COLOURS[k], alpha=0.13, lw=0.0)  # fmt: skip
        _bare(ax)
        _forces(ax, (100.0, 400.0, 1500.0))
        ax.set_ylim(-0.02, 1.02)
        ax.set_title(f"{names[i]}, {gap_name(gaps[j])}", loc="left", fontsize=9.5)
    figure.supylabel(FALLS)
    figure.supxlabel("strength of the strap (N)")
    handles = [Line2D([], [], color=COLOURS[k], marker=MARKERS[k], ms=3.5, lw=1.3) for k in range(len(stiffnesses))]
    handles += [Line2D([], [], color="0.4", ls=line) for line in ("solid", (0, (1, 1)))]
    handles += [Line2D([], [], color="black", lw=1.2, ls=(0, (4, 2))), Line2D([], [], color="0.65", lw=1.2)]
    labels = [f"{one / 1e3:g} N/mm" for one in stiffnesses]
    labels += [f"slack {1000 * slacks[c]:g} mm" for c in ends] + ["wall, no kit", "free"]
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, handlelength=1.8)
    return figure


def survey_figure(
    brackets: np.ndarray, stiffnesses: Sequence[float], mats: np.ndarray, forces: Sequence[float], held: Share,
    matted: float, free: float,
) -> Figure:  # fmt: skip
    """Falls over the strength of brackets (stiffness, strength, motion) and mats, beside the survey's shares."""
    figure = Figure(figsize=(WIDTH, 5.8), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    axes[0].axhspan(held.lower, held.upper, color="0.88", lw=0.0)
    names = [f"{one / 1e3:g} N/mm" for one in stiffnesses]
    panels = ((brackets, held.value, "two L-brackets", names), (mats[None], matted, "mats, as an adhesive", ["mats"]))
    for ax, (curves, stated, title, labels) in zip(axes, panels, strict=True):
        ax.axhline(stated, color="0.5", lw=1.2)
        ax.axhline(free, color="black", lw=1.2, ls=(0, (4, 2)))
        for k, falls in enumerate(curves):
            shares, colour = [share(one) for one in falls], COLOURS[k]
            ax.plot(forces, [one.value for one in shares], color=colour, marker=MARKERS[k], ms=4.0, lw=1.5,
                    label=labels[k])  # fmt: skip
            ax.fill_between(
                forces, [one.lower for one in shares], [one.upper for one in shares], color=colour, alpha=0.15, lw=0.0
            )
        _bare(ax)
        _forces(ax, forces)
        ax.set_ylim(0.0, 0.6)
        ax.set_title(title, loc="left")
    axes[0].legend(frameon=False, loc="upper right")
    figure.supylabel(FALLS)
    figure.supxlabel("strength of one bracket, or of the mats at one edge (N)")
    handles = [
        Line2D([], [], color="black", lw=1.2, ls=(0, (4, 2))),
        Line2D([], [], color="0.5", lw=1.2),
        Line2D([], [], color="0.88", lw=8.0),
    ]
    figure.legend(
        handles,
        ["survey, nothing (calibrated)", "survey, this device", "its 95 % interval"],
        loc="outside upper center",
        ncols=2,
        frameon=False,
    )
    return figure


def anchored_figure(ratios: Sequence[float], amplitudes: np.ndarray, forces: Sequence[float]) -> Figure:
    """Smallest amplitudes that overturn a block under a one-cycle sine (free and anchored, omega/p)."""
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(ratios, amplitudes[0], color="black", lw=1.8, ls=(0, (4, 2)), label="free")
    for k, force in enumerate(forces):
        ax.plot(ratios, amplitudes[k + 1], color=COLOURS[k], lw=1.5, label=f"strength {force:g} of the weight")
    _bare(ax)
    ax.set_yscale("log")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_locator(FixedLocator([1.0, 2.0, 3.0, 5.0, 10.0, 15.0]))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("frequency of the pulse over that of the block, ω/p (–)")
    ax.set_ylabel("least amplitude that overturns, over g tan α (–)")
    ax.legend(frameon=False, loc="upper left")
    return figure
