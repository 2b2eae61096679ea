"""The page docs/paper.md and its figures: each figure and table that the source paper's text describes, drawn again.

TOPPLING_RECORDS names a folder of AT2 records for the forced runs; without it, simulated motions stand in.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...studies.plot import history, hysteresis, moment
from ...studies.plots.axes import COLOURS, plain_log
from . import paper_numbers as numbers
from .figures import bare, looks, new
from .page import save, some, template, write
from .paper_numbers import CONCRETE, DELTA, DELTAS, FIGURE_6, PEAKS, RIVALS, X0, E
from .tables import minus, percent, table

# Overturnings under 400 other motions of the same kind, counted before this engine was written, by two programs.
PROTOTYPES = {
    "discrete": (0.63, 0.53, 0.34, 0.11),
    "discrete, rigid at rest": (0.025, 0.022, 0.015, 0.020),
    "energy-consistent (ours)": (0.007, 0.018, 0.015, 0.015),
}
RIGID_PROTOTYPE = 0.010
# Of its three runs that stood and its three that fell: what the paper's section 3.2 says in words.
PAPER_VERDICTS = {
    "discrete": (3, 3),
    "Vassiliou": (1, 2),
    "Makris–Konstantinidis": (3, 0),
    "Giannini–Masiani": (3, 3),
}


def main() -> None:
    """Write the page and its figures."""
    shaking = numbers.shaking(os.environ.get("TOPPLING_RECORDS") or None, some(40))
    fell = numbers.verdicts(shaking.waveform)
    standing, fallen = numbers.forced(shaking.waveform, fell)
    with looks():
        drawn = {
            "moment": moment_figure(),
            "dissipation": dissipation_figure(),
            "ratio": ratio_figure(),
            "hysteresis": hysteresis_figure(),
            "free": free_figure(),
            "delta": delta_figure(),
            "motion": motion_figure(shaking.waveform),
            "standing": forced_figure(standing),
            "fallen": forced_figure(fallen),
            "verdicts": verdict_figure(fell),
        }
        save("paper", drawn, 170)
    shares, mode = numbers.many_runs(shaking.many), numbers.elastic_mode(some(400))
    write("paper", page(shaking, fell, standing, fallen, shares, mode))


def page(
    shaking: numbers.Shaking,
    fell: xr.DataArray,
    standing: Sequence[numbers.Forced],
    fallen: Sequence[numbers.Forced],
    shares: Sequence[numbers.Shares],
    mode: numbers.Mode,
) -> str:
    """Return the page: its template with every number."""
    errors = {rival.name: numbers.free_errors(rival.make(E, DELTA)) for rival in RIVALS}
    ranges = delta_ranges()
    false = {one.name: percent(one.falsely_fallen / one.standing) for one in shares}
    missed = next(one for one in shares if one.name == KEYS["mk"])
    ratios = [tp.MakrisKonstantinidis.damping_ratio, tp.GianniniMasiani.damping_ratio]
    near, half = ([ratio(e) for ratio in ratios] for e in (E, 0.5))
    values: dict[str, Any] = {
        "e": E,
        "e_rigid": CONCRETE.restitution,
        "delta": DELTA,
        "ratio_n": 1.0 / DELTA - 1.0,
        "moment_difference": 100.0 * numbers.moment_difference(FIGURE_6),
        "zone_moment": 1.0 - DELTA,
        "ratio_near": near[0] / near[1],
        "ratio_half": half[0] / half[1],
        "zeta_gm": percent(near[1], 1),
        "zeta_mk": percent(near[0], 1),
        "free_table": free_table(),
        **{f"mre_{key}": signed(errors[name].peak) for key, name in KEYS.items()},
        "period_consistent": signed(errors[KEYS["consistent"]].period, 1),
        "period_discrete": signed(errors["discrete"].period),
        "tenth_discrete": errors["discrete"].peaks[10],
        "tenth_housner": numbers.housner_peaks()[1, 10],
        "tenth_edge": numbers.edge_peaks()[10],
        "equivalent": numbers.equivalent_restitution(),
        "delta_table": delta_table(),
        **{f"range_{key}": percent(ranges[name]) for key, name in KEYS.items()},
        "frequency": numbers.elastic_frequency(FIGURE_6),
        "waveform": shaking.waveform_words,
        "pga": float(tp.motions.measures(shaking.waveform)["pga"].item()) / STANDARD_GRAVITY,
        "stands_in": "" if shaking.titles else STAND_IN,
        "blocks": "; ".join(block.label for block in numbers.SHAKEN),
        "standing_table": standing_table(standing),
        "fallen_table": fallen_table(fallen),
        "verdict_table": verdict_table(standing, fallen),
        "passing": passing_sentence(standing),
        "undecided": undecided_sentence([*standing, *fallen]),
        "scale_errors": scale_errors(fell),
        "many": shaking.many_words,
        "runs": shares[0].standing + shares[0].fallen,
        "levels": ", ".join(f"{level:g}" for level in numbers.LEVELS),
        "shares_table": shares_table(shares),
        "false_discrete": false["discrete"],
        "false_consistent": false[KEYS["consistent"]],
        "false_lever": false["Housner, bilinear, lever R"],
        "false_line": false["Housner, bilinear, lever h"],
        "missed_mk": percent(1.0 - missed.detected / missed.fallen),
        "number": mode.number,
        "mode_table": mode_table(mode),
        "at_rest": mode.at_rest[1] / mode.number,
        "elastic": mode.elastic[1] / mode.number,
        "rigid": mode.rigid / mode.number,
        "lever_slender": percent(1.0 - math.cos(math.atan(1.0 / 6.0)), 1),
        "lever_squat": percent(1.0 - math.cos(math.atan(1.0 / 1.6)), 1),
        "record_list": record_list(shaking),
    }
    return template("paper").format(**values)


KEYS = {
    "discrete": "discrete",
    "vassiliou": "Vassiliou",
    "mk": "Makris–Konstantinidis",
    "gm": "Giannini–Masiani",
    "consistent": "energy-consistent (ours)",
}
STAND_IN = " **It stands in for a record: no folder of records was named when this page was made.**"
LAWS = [rival.name for rival in RIVALS]


def free_table() -> str:
    """Return the paper's Table 2: peaks over alpha with their errors, and mean relative errors."""
    reference, edge = numbers.housner_peaks()[1], numbers.edge_peaks()
    found = [numbers.free_errors(rival.make(E, DELTA)) for rival in RIVALS]
    rows = []
    for n in range(1, PEAKS + 1):
        cells = [f"{law.peaks[n]:.4f} ({signed(law.peak_errors[n - 1])})" for law in found]
        rows.append((str(n), f"{reference[n]:.4f}", *cells, f"{edge[n]:.4f}"))
    rows.append(("**mean error, θ_peak**", "", *(f"**{signed(law.peak, 1)}**" for law in found), ""))
    rows.append(("**mean error, T**", "", *(f"**{signed(law.period, 1)}**" for law in found), ""))
    return table(("n", "Housner", *LAWS, "Eqs. 16–17 alone"), rows)


def delta_ranges() -> dict[str, float]:
    """Return how far the fifth peak ranges over the deltas, over its value at the recommended one."""
    peaks = numbers.fifth_peaks()[:, :, 1]
    return {name: float(np.ptp(row) / row[DELTAS.index(DELTA)]) for name, row in zip(LAWS, peaks, strict=True)}


def delta_table() -> str:
    """Return the fifth peak and its time at every delta."""
    rows = []
    for name, law in zip(LAWS, numbers.fifth_peaks(), strict=True):
        time, peak = np.ptp(law, axis=0) / law[DELTAS.index(DELTA)]
        rows.append((name, *(f"{one:.4f}" for one in law[:, 1]), percent(peak, 1), percent(time, 1)))
    return table(("fifth peak over α", *(f"δ = {delta:g}" for delta in DELTAS), "range", "range of its time"), rows)


def standing_table(runs: Sequence[numbers.Forced]) -> str:
    """Return the paper's Table 4: errors of the largest rotation where the reference stands."""
    rows = []
    for run in runs:
        truth = float(run.reference["peak_rotation"])
        errors = (
            "overturns" if bool(one["overturned"]) else signed(float(one["peak_rotation"]) / truth - 1.0)
            for one in run.runs
        )
        rows.append((run.name, *marked((f"{truth / run.block.alpha:.3f}", *errors), run)))
    return table(("run", "Housner, max \\|θ\\|/α", *LAWS), rows)


def fallen_table(runs: Sequence[numbers.Forced]) -> str:
    """Return the paper's Table 5: whether a law finds the overturning that the reference has."""
    rows = []
    for run in runs:
        marks = ("√" if bool(one["overturned"]) else "×" for one in (run.reference, *run.runs))
        rows.append((run.name, *marked(marks, run)))
    return table(("run", "Housner", *LAWS), rows)


def marked(cells: Iterator[str] | Sequence[str], run: numbers.Forced) -> list[str]:
    """Return cells of the reference and every law, with a question mark where a verdict is undecided."""
    return [cell + ("?" if flips else "") for cell, flips in zip(cells, run.undecided, strict=True)]


def verdict_table(standing: Sequence[numbers.Forced], fallen: Sequence[numbers.Forced]) -> str:
    """Return how many verdicts each law shares with the reference, beside the paper's with the measurement."""
    rows = []

    def add(name: str, falls: list[bool], finds: list[bool]) -> None:
        paper = (f"{one} of 3" for one in PAPER_VERDICTS[name]) if name in PAPER_VERDICTS else ("–", "–")
        first, second = paper
        stands = f"{len(falls) - sum(falls)} of {len(falls)}"
        rows.append((name, first, stands, second, f"{sum(finds)} of {len(finds)}"))

    for i, name in enumerate(LAWS):
        add(name, *([bool(run.runs[i]["overturned"]) for run in runs] for runs in (standing, fallen)))
    for i, name in enumerate(numbers.CAUSES):
        add(name, *([run.causes[i] for run in runs] for runs in (standing, fallen)))
    heads = ("stands: the paper's runs", "stands: these", "falls: the paper's runs", "falls: these")
    return table(("law, right where the block", *heads), rows)


def passing_sentence(standing: Sequence[numbers.Forced]) -> str:
    """Return that rotation beyond alpha need not be the end, where the reference shows it."""
    most = max(float(run.reference["peak_rotation"]) / run.block.alpha for run in standing)
    if most <= 1.0:
        return ""
    return f" The reference itself passes α, as far as {most:.2f} α, and is brought back by the shaking."


def undecided_sentence(runs: Sequence[numbers.Forced]) -> str:
    """Return what a millionth more or less of the motion changes."""
    flips = sum(sum(run.undecided) for run in runs)
    total = sum(len(run.undecided) for run in runs)
    if flips == 0:
        return f"None of these {total} verdicts flips where the motion is a millionth stronger or weaker."
    return f"{flips} of these {total} verdicts flip where the motion is a millionth stronger or weaker (marked ?)."


def scale_errors(fell: xr.DataArray) -> str:
    """Return how often a law's verdict is the reference's over all scales and blocks, and on which side it errs."""
    reference, *laws = fell.transpose("model", ...).values.astype(bool)
    rows = []
    for name, law in zip(LAWS, laws, strict=True):
        false, missed = int((law & ~reference).sum()), int((~law & reference).sum())
        rows.append((name, f"{law.size - false - missed} of {law.size}", str(false), str(missed)))
    return table(("law", "same verdict", "falls, the reference stands", "stands, the reference falls"), rows)


def shares_table(shares: Sequence[numbers.Shares]) -> str:
    """Return Tables 4 and 5 as shares."""
    rows = []
    for one in shares:
        middle, low, high = map(signed, one.error)
        false = f"{one.falsely_fallen} of {one.standing} ({percent(one.falsely_fallen / one.standing)})"
        found = f"{one.detected} of {one.fallen} ({percent(one.detected / one.fallen)})"
        rows.append((one.name, false, found, f"{middle} ({low} to {high}), {one.compared} runs"))
    heads = ("law", "overturns where Housner's block rocks and stands", "overturns where it overturns")
    return table((*heads, "error of max \\|θ\\| where both stand: median (16 to 84 %)"), rows)


def mode_table(mode: numbers.Mode) -> str:
    """Return shares of overturnings at every delta, with those of the prototypes and the difference."""

    def cell(count: int, stated: float) -> str:
        share = count / mode.number
        return minus(f"{share:.3f} / {stated:.3f} ({share - stated:+.3f})")

    rows = [("rigid block (Housner, bilinear)", *[cell(mode.rigid, RIGID_PROTOTYPE)] * 4)]
    for name, counts in zip(PROTOTYPES, (mode.elastic, mode.at_rest, mode.consistent), strict=True):
        rows.append((name, *map(cell, counts, PROTOTYPES[name])))
    return table(("P(overturn), here / before (difference)", *(f"δ = {delta:g}" for delta in mode.deltas)), rows)


def record_list(shaking: numbers.Shaking) -> str:
    """Return the files of the many runs, or what stands in for them."""
    if not shaking.titles:
        return f"No folder of records was named: {shaking.waveform_words}, and {shaking.many_words} stand in."
    head = "Those that reach 0.1 g, each with event, station, component and source as its own head says them:"
    return "\n".join((head, "", *(f"- {title}" for title in shaking.titles)))


def signed(value: float, digits: int = 0) -> str:
    """Return a relative error in per cent, with its sign."""
    text = f"{100.0 * value:+.{digits}f} %"
    return minus(text) if float(text[:-2]) else f"{0.0:.{digits}f} %"


# Figures -------------------------------------------------------------------------------------------------------------

ROCKING = "rotation over slenderness, θ/α (–)"
HOUSNER: dict[str, Any] = {"lw": 0.8, "ls": (0, (3, 1.5))}
"""The line of Housner's block."""


def moment_figure() -> Figure:
    """Draw the paper's figure 2."""
    figure, ax = new(3.9)
    moment(FIGURE_6, tp.HousnerImpact(e=E), ax, label="rigid block: sin(α − θ)/sin α", color="0.55")
    moment(FIGURE_6, tp.DiscreteDamping(e=E, delta=DELTA), ax, label=f"bilinear, δ = {DELTA:g}", linestyle="dashed")
    ax.annotate("elastic zone\n±δα", (-DELTA, 0.5), xytext=(-0.66, 0.46), arrowprops={"arrowstyle": "-", "lw": 0.8})
    ax.annotate("balance", (1.0, 0.0), xytext=(0.72, -0.42), arrowprops={"arrowstyle": "-", "lw": 0.8})
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return figure


def energy(run: xr.Dataset, delta: float) -> np.ndarray:
    """Return the energy over that at the start of free rocking, of a bilinear block (delta = 0: rigid)."""
    alpha, q2 = run.attrs["alpha"], run.attrs["p"] ** 2 * math.sin(run.attrs["alpha"]) / run.attrs["alpha"]
    theta, edge = np.abs(run["rotation"].values), delta * run.attrs["alpha"]
    potential = q2 * (alpha * theta - 0.5 * theta**2 - 0.5 * alpha * edge)
    if delta > 0.0:
        potential = np.where(theta < edge, 0.5 * (1.0 / delta - 1.0) * q2 * theta**2, potential)
    total = 0.5 * run["angular_velocity"].values ** 2 + potential
    return np.asarray(total / total[0])


def dissipation_figure() -> Figure:
    """Draw the paper's figure 4: when energy is lost, by impact, all the time, and in the zone."""
    cases = (
        ("impact", tp.HousnerImpact(e=E, geometry="bilinear"), 0.0, "black"),
        ("continuous", tp.GianniniMasiani(e=E, delta=DELTA), DELTA, COLOURS[1]),
        ("discrete", tp.DiscreteDamping(e=E, delta=DELTA), DELTA, COLOURS[0]),
    )
    figure, axes = new(4.2, 2, 3, sharex=True, sharey="row")
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
            bare(ax)
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
    """Draw the paper's figure 5."""
    e = np.linspace(0.002, 1.0, 800)
    figure, ax = new(3.8)
    names = (
        ("Giannini–Masiani: (2/π)(1 − e)/(1 + e)", tp.GianniniMasiani.damping_ratio, COLOURS[1], "solid"),
        ("Makris–Konstantinidis: −0.68 ln e", tp.MakrisKonstantinidis.damping_ratio, COLOURS[2], "solid"),
        ("FEMA 356 (added): 0.4 (1 − e)", lambda e: 0.4 * (1.0 - e), "0.5", "dashed"),
    )
    for name, ratio, colour, line in names:
        ax.plot(e, [ratio(float(one)) for one in e], color=colour, lw=1.8, ls=line, label=name)
    ax.plot(0.0, 2.0 / math.pi, "o", color=COLOURS[1], ms=5.0, clip_on=False)
    ax.annotate("2/π", (0.0, 2.0 / math.pi), xytext=(6, 3), textcoords="offset points")
    ax.axvspan(0.85, 1.0, color="0.92", lw=0.0, zorder=0)
    ax.annotate("$e_R$ of blocks with h/b ≥ 3", (0.84, 0.62), ha="right")
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 1.2)
    ax.set_xlabel("coefficient of restitution e (–)")
    ax.set_ylabel("damping ratio ζ (–)")
    bare(ax)
    ax.legend(frameon=False, loc="upper right")
    return figure


def hysteresis_figure() -> Figure:
    """Draw the paper's figure 6: total moments above, damping moments below; discrete left, continuous right."""
    figure, axes = new(5.0, 2, 2, sharex=True, sharey="row")
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
    """Draw the paper's figure 7: rows are laws, columns are rotation, velocity and acceleration."""
    figure, axes = new(8.6, len(RIVALS), 3, sharex=True, sharey="col")
    names = ("rotation", "angular_velocity", "angular_acceleration")
    reference = tp.free_rocking(CONCRETE, tp.HousnerImpact(e=E, geometry="linear"), X0 * CONCRETE.alpha, 4.0)
    for row, rival in zip(axes, RIVALS, strict=True):
        run = tp.free_rocking(CONCRETE, rival.make(E, DELTA), X0 * CONCRETE.alpha, 4.0)
        for power, (ax, name) in enumerate(zip(row, names, strict=True)):
            unit = CONCRETE.p**power * CONCRETE.alpha
            ax.plot(reference["time"], reference[name] / unit, color="0.35", **HOUSNER)
            ax.plot(run["time"], run[name] / unit, color=rival.colour, lw=1.3)
            bare(ax)
        row[0].set_title(f"({rival.panel}) {rival.name}", loc="left")
        row[0].set_xlim(0.0, 4.0)
        for ax, label in zip(row, ("θ/α (–)", "θ'/(pα) (–)", "θ''/(p²α) (–)"), strict=True):
            ax.set_ylabel(label)
    axes[0, 2].set_ylim(-1.6, 1.6)
    figure.supxlabel("time (s); dashed: Housner's block")
    return figure


def delta_figure() -> Figure:
    """Draw the paper's figure 10: rotation histories at several deltas, a panel for each law."""
    figure, axes = new(7.2, len(RIVALS), 1, sharex=True, sharey=True)
    deltas = (0.01, 0.05, 0.1)
    labels = [f"δ = {delta:g}" for delta in deltas]
    for ax, rival in zip(axes, RIVALS, strict=True):
        runs = [tp.free_rocking(CONCRETE, rival.make(E, delta), X0 * CONCRETE.alpha, 6.0) for delta in deltas]
        history(runs, ax, colors=("#9ecae1", "#4a98c9", "#08306b"), labels=labels)
        ax.set(xlabel="", ylabel="")
        ax.set_title(f"({rival.panel}) {rival.name}", loc="left")
        ax.set_xlim(0.0, 6.0)
    figure.supylabel(ROCKING)
    figure.supxlabel("time (s)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def motion_figure(waveform: xr.DataArray) -> Figure:
    """Draw the paper's figure 11, of another motion: its history and its spectrum of pseudo-acceleration."""
    figure, (top, bottom) = new(4.6, 2, 1)
    motion = waveform.isel(motion=0)
    time = np.arange(motion.size) * float(motion["dt"])
    top.plot(time, motion.values / STANDARD_GRAVITY, color="black", lw=0.6)
    top.set_xlim(0.0, time[-1])
    top.set_xlabel("time (s)")
    top.set_ylabel("acceleration (g)")
    top.set_title(str(motion["motion"].item()))
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
        bare(ax)
    return figure


def forced_figure(runs: Sequence[numbers.Forced], longest: float = 20.0) -> Figure:
    """Draw the paper's figures 12 and 13: rows are laws, columns are runs; the rigid block in exact geometry dashed."""
    figure, axes = new(8.0, len(RIVALS), len(runs), sharex=True, sharey=True)
    for column, run in enumerate(runs):
        axes[0, column].text(0.5, 1.3, run.name, transform=axes[0, column].transAxes, ha="center", weight="bold")
        for row, rival in enumerate(RIVALS):
            both = [run.runs[row], run.reference]
            ax = history(both, axes[row, column], colors=(rival.colour, "black"), labels=("", ""))
            ax.get_lines()[1 + int(bool(run.runs[row]["overturned"]))].set(**HOUSNER)
            ax.set(xlabel="", ylabel="")
            if column == 0:
                ax.set_title(f"({rival.panel}) {rival.name}", loc="left")
    axes[0, 0].set_xlim(0.0, longest)
    axes[0, 0].set_xticks(np.arange(0.0, longest, 5.0))
    axes[0, 0].set_ylim(-1.75, 1.75)
    figure.supylabel(ROCKING)
    figure.supxlabel("time (s)")
    named = {
        "Housner's block, exact geometry": Line2D([], [], color="black", **(HOUSNER | {"lw": 0.9})),
        "falls from here on": Line2D([], [], marker="X", ms=8.0, ls="none", color="0.4"),
    }
    figure.legend([*named.values()], [*named], loc="outside upper center", ncols=2, frameon=False)
    return figure


def verdict_figure(fell: xr.DataArray) -> Figure:
    """Draw which law falls at which scale of the waveform: a row for each law, a panel for each block."""
    blocks = fell.sizes["block"]
    figure, axes = new(1.6 * blocks + 0.8, blocks, 1, sharex=True)
    scales = fell["level"].values
    half = 0.5 * float(scales[1] - scales[0])
    names = ["Housner, exact", *(name.replace(" (ours)", "") for name in LAWS)]
    edges = np.append(scales - half, scales[-1] + half)
    for i, ax in enumerate(axes):
        ax.pcolormesh(
            edges, np.arange(len(names) + 1) - 0.5, fell.isel(block=i).values.astype(int),
            cmap=ListedColormap(["#f0f0f0", "#34495e"]), vmin=0, vmax=1, edgecolors="white", lw=0.6,
        )  # fmt: skip
        ax.set_yticks(range(len(names)), names)
        ax.invert_yaxis()
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
        ax.set_title(str(fell["block"].values[i]), loc="left")
    axes[-1].set_xticks(np.arange(1.0, scales[-1] + half))
    axes[-1].xaxis.set_major_formatter(PercentFormatter(1.0))
    axes[-1].set_xlabel("scale of the waveform; dark: overturns")
    return figure
