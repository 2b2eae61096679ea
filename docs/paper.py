"""docs/paper.md and its figures: each figure and table that the source paper's text describes, drawn again.

`make paper` runs it; `--records DIR` (or TOPPLING_RECORDS) names a folder of AT2 records for the forced runs, else
simulated motions stand in.  Every number on the page is put there by this file; docs/paper.md.in is the text.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import paper_figures as figures
import paper_numbers as numbers
import xarray as xr
from p58 import table
from paper_numbers import CONCRETE, DELTA, DELTAS, PEAKS, RIVALS

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY

HERE = Path(__file__).parent
SHOWN = (1, 2, 5, 10)
# Free decay at e = 0.925, alpha = atan 0.2, delta = 0.05 from alpha/2, peaks 1, 2, 5 and 10: integrated at 1e-12 by an
# adaptive 8th-order method that shares nothing with the engine (tests/models/test_published.py compares them with the
# engine's, too).
INTEGRATED = {
    "discrete": (0.41131983, 0.34490885, 0.21770197, 0.11808315),
    "Vassiliou": (0.43717884, 0.38875676, 0.29051030, 0.19996001),
    "Makris–Konstantinidis": (0.24525335, 0.15681699, 0.06660880, 0.02792737),
    "Giannini–Masiani": (0.34195436, 0.25803813, 0.14066521, 0.07245964),
}
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


def main(out: Path = HERE, records: str | None = None, motions: int = 400) -> None:
    """Write the page and its figures into `out`."""
    shaking = numbers.shaking(records)
    fell = numbers.verdicts(shaking.waveform)
    standing, fallen = numbers.forced(shaking.waveform, fell)
    folder = out / "paper"
    folder.mkdir(parents=True, exist_ok=True)
    name = str(shaking.waveform["motion"].values[0])
    with mpl.rc_context(figures.LOOKS):
        for file, figure in (
            ("moment", figures.moment_figure()),
            ("dissipation", figures.dissipation_figure()),
            ("ratio", figures.ratio_figure()),
            ("hysteresis", figures.hysteresis_figure()),
            ("free", figures.free_figure()),
            ("delta", figures.delta_figure()),
            ("motion", figures.motion_figure(shaking.waveform, name)),
            ("standing", figures.forced_figure(standing)),
            ("fallen", figures.forced_figure(fallen)),
            ("verdicts", figures.verdict_figure(fell)),
        ):
            figure.savefig(folder / f"{file}.png", dpi=170)
    shares = numbers.many_runs(shaking.many)
    mode = numbers.elastic_mode(motions)
    text = page(shaking, fell, standing, fallen, shares, mode)
    (out / "paper.md").write_text(text, encoding="utf-8")


def page(
    shaking: numbers.Shaking,
    fell: xr.DataArray,
    standing: Sequence[numbers.Forced],
    fallen: Sequence[numbers.Forced],
    shares: Sequence[numbers.Shares],
    mode: numbers.Mode,
) -> str:
    """The page: the text of paper.md.in with every number."""
    errors = {rival.name: numbers.free_errors(rival.make(numbers.E, DELTA)) for rival in RIVALS}
    ranges = delta_ranges()
    by_name = {one.name: one for one in shares}
    pga = float(tp.motions.measures(shaking.waveform)["pga"].item())
    near, half = (
        tp.MakrisKonstantinidis.damping_ratio(e) / tp.GianniniMasiani.damping_ratio(e) for e in (numbers.E, 0.5)
    )
    false = {one.name: percent(one.falsely_fallen / one.standing) for one in shares}
    filled = {
        "e": f"{numbers.E:g}",
        "e_rigid": f"{CONCRETE.restitution:.3f}",
        "delta": f"{DELTA:g}",
        "ratio_n": f"{1.0 / DELTA - 1.0:.0f}",
        "moment_difference": f"{100.0 * numbers.moment_difference(numbers.FIGURE_6):.2f}",
        "zone_moment": f"{1.0 - DELTA:.2f}",
        "ratio_near": f"{near:.2f}",
        "ratio_half": f"{half:.2f}",
        "zeta_gm": percent(tp.GianniniMasiani.damping_ratio(numbers.E), 1),
        "zeta_mk": percent(tp.MakrisKonstantinidis.damping_ratio(numbers.E), 1),
        "free_table": free_table(),
        **{f"mre_{key}": signed(errors[name].peak) for key, name in KEYS.items()},
        "period_consistent": signed(errors[KEYS["consistent"]].period, 1),
        "period_discrete": signed(errors["discrete"].period),
        "tenth_discrete": f"{errors['discrete'].peaks[10]:.4f}",
        "tenth_housner": f"{numbers.housner_peaks()[1, 10]:.4f}",
        "tenth_edge": f"{numbers.edge_peaks()[10]:.4f}",
        "equivalent": f"{numbers.equivalent_restitution():.3f}",
        "delta_table": delta_table(),
        **{f"range_{key}": percent(ranges[name]) for key, name in KEYS.items()},
        "frequency": f"{numbers.elastic_frequency(numbers.FIGURE_6):.2f}",
        "waveform": shaking.waveform_words,
        "pga": f"{pga / STANDARD_GRAVITY:.3f}",
        "stands_in": "" if shaking.titles else STAND_IN,
        "blocks": "; ".join(block.label for block in numbers.SHAKEN),
        "standing_table": standing_table(standing),
        "fallen_table": fallen_table(fallen),
        "verdict_table": verdict_table(standing, fallen),
        "passing": passing_sentence(standing),
        "undecided": undecided_sentence([*standing, *fallen]),
        "scale_errors": scale_errors(fell),
        "many": shaking.many_words,
        "runs": sum((shares[0].standing, shares[0].fallen)),
        "levels": ", ".join(f"{one:g}" for one in numbers.LEVELS),
        "shares_table": shares_table(shares),
        "false_discrete": false["discrete"],
        "false_consistent": false[KEYS["consistent"]],
        "false_lever": false["Housner, bilinear, lever R"],
        "false_line": false["Housner, bilinear, lever h"],
        "missed_mk": percent(1.0 - by_name[KEYS["mk"]].detected / by_name[KEYS["mk"]].fallen),
        "number": mode.number,
        "mode_table": mode_table(mode),
        "at_rest": f"{mode.at_rest[1] / mode.number:.3f}",
        "elastic": f"{mode.elastic[1] / mode.number:.3f}",
        "rigid": f"{mode.rigid / mode.number:.3f}",
        "lever_slender": percent(1.0 - math.cos(math.atan(1.0 / 6.0)), 1),
        "lever_squat": percent(1.0 - math.cos(math.atan(1.0 / 1.6)), 1),
        "held_table": held_table(),
        "record_list": record_list(shaking),
    }
    return (HERE / "paper.md.in").read_text(encoding="utf-8").format(**filled)


KEYS = {
    "discrete": "discrete",
    "vassiliou": "Vassiliou",
    "mk": "Makris–Konstantinidis",
    "gm": "Giannini–Masiani",
    "consistent": "energy-consistent (ours)",
}
STAND_IN = " **It stands in for a record: no folder of records was named when this page was made.**"


def free_table() -> str:
    """The paper's Table 2: peaks over alpha with their errors, and mean relative errors."""
    reference = numbers.housner_peaks()[1]
    edge = numbers.edge_peaks()
    found = [numbers.free_errors(rival.make(numbers.E, DELTA)) for rival in RIVALS]
    rows = []
    for n in range(1, PEAKS + 1):
        cells = [f"{one.peaks[n]:.4f} ({signed(one.peak_errors[n - 1])})" for one in found]
        rows.append((str(n), f"{reference[n]:.4f}", *cells, f"{edge[n]:.4f}"))
    rows.append(("**mean error, θ_peak**", "", *(f"**{signed(one.peak, 1)}**" for one in found), ""))
    rows.append(("**mean error, T**", "", *(f"**{signed(one.period, 1)}**" for one in found), ""))
    return table(("n", "Housner", *(rival.name for rival in RIVALS), "Eqs. 16–17 alone"), rows)


def delta_ranges() -> dict[str, float]:
    """How far the fifth peak ranges over the deltas, over its value at the recommended one."""
    peaks = numbers.fifth_peaks()[:, :, 1]
    at = DELTAS.index(DELTA)
    return {rival.name: float(np.ptp(row) / row[at]) for rival, row in zip(RIVALS, peaks, strict=True)}


def delta_table() -> str:
    """Fifth peak and its time at every delta."""
    found = numbers.fifth_peaks()
    at = DELTAS.index(DELTA)
    rows = []
    for rival, law in zip(RIVALS, found, strict=True):
        spread = np.ptp(law, axis=0) / law[at]
        rows.append((rival.name, *(f"{one:.4f}" for one in law[:, 1]), percent(spread[1], 1), percent(spread[0], 1)))
    return table(("fifth peak over α", *(f"δ = {one:g}" for one in DELTAS), "range", "range of its time"), rows)


def standing_table(runs: Sequence[numbers.Forced]) -> str:
    """The paper's Table 4: errors of the largest rotation where the reference stands."""
    rows = []
    for run in runs:
        truth = float(run.reference["peak_rotation"])
        cells = []
        for one, flips in zip(run.runs, run.undecided[1:], strict=True):
            error = signed(float(one["peak_rotation"]) / truth - 1.0)
            cells.append(("overturns" if bool(one["overturned"]) else error) + ("?" if flips else ""))
        rows.append((run.name, f"{truth / run.block.alpha:.3f}" + ("?" if run.undecided[0] else ""), *cells))
    return table(("run", "Housner, max \\|θ\\|/α", *(rival.name for rival in RIVALS)), rows)


def fallen_table(runs: Sequence[numbers.Forced]) -> str:
    """The paper's Table 5: whether a law finds the overturning that the reference has."""
    rows = []
    for run in runs:
        marks = [
            ("√" if bool(one["overturned"]) else "×") + ("?" if flips else "")
            for one, flips in zip((run.reference, *run.runs), run.undecided, strict=True)
        ]
        rows.append((run.name, *marks))
    return table(("run", "Housner", *(rival.name for rival in RIVALS)), rows)


def verdict_table(standing: Sequence[numbers.Forced], fallen: Sequence[numbers.Forced]) -> str:
    """How many of the verdicts each law shares with the reference, beside the paper's with the measurement."""
    rows = []
    for i, rival in enumerate(RIVALS):
        stands = sum(not bool(run.runs[i]["overturned"]) for run in standing)
        falls = sum(bool(run.runs[i]["overturned"]) for run in fallen)
        paper = (f"{one} of 3" for one in PAPER_VERDICTS[rival.name]) if rival.name in PAPER_VERDICTS else ("–", "–")
        first, second = paper
        rows.append((rival.name, first, f"{stands} of {len(standing)}", second, f"{falls} of {len(fallen)}"))
    for i, name in enumerate(numbers.CAUSES):
        stands, falls = sum(not run.causes[i] for run in standing), sum(run.causes[i] for run in fallen)
        rows.append((name, "–", f"{stands} of {len(standing)}", "–", f"{falls} of {len(fallen)}"))
    heads = ("stands: the paper's runs", "stands: these", "falls: the paper's runs", "falls: these")
    return table(("law, right where the block", *heads), rows)


def passing_sentence(standing: Sequence[numbers.Forced]) -> str:
    """That rotation beyond alpha need not be the end, where the reference shows it."""
    most = max(float(run.reference["peak_rotation"]) / run.block.alpha for run in standing)
    if most <= 1.0:
        return ""
    return f" The reference itself passes α, as far as {most:.2f} α, and is brought back by the shaking."


def undecided_sentence(runs: Sequence[numbers.Forced]) -> str:
    """What a millionth more or less of the motion changes."""
    flips = sum(sum(run.undecided) for run in runs)
    total = sum(len(run.undecided) for run in runs)
    if flips == 0:
        return f"None of these {total} verdicts flips where the motion is a millionth stronger or weaker."
    return f"{flips} of these {total} verdicts flip where the motion is a millionth stronger or weaker (marked ?)."


def scale_errors(fell: xr.DataArray) -> str:
    """Of all scales and blocks: how often a law's verdict is the reference's, and on which side it errs."""
    values = fell.transpose("model", ...).values.astype(bool)
    total = values[0].size
    parts = []
    for i, rival in enumerate(RIVALS, 1):
        false, missed = int((values[i] & ~values[0]).sum()), int((~values[i] & values[0]).sum())
        parts.append((rival.name, f"{total - false - missed} of {total}", str(false), str(missed)))
    return table(("law", "same verdict", "falls, the reference stands", "stands, the reference falls"), parts)


def shares_table(shares: Sequence[numbers.Shares]) -> str:
    """Tables 4 and 5 as shares."""
    rows = []
    for one in shares:
        middle, low, high = one.error
        rows.append(
            (
                one.name,
                f"{one.falsely_fallen} of {one.standing} ({percent(one.falsely_fallen / one.standing)})",
                f"{one.detected} of {one.fallen} ({percent(one.detected / one.fallen)})",
                f"{signed(middle)} ({signed(low)} to {signed(high)}), {one.compared} runs",
            )
        )
    heads = ("law", "overturns where Housner's block rocks and stands", "overturns where it overturns")
    return table((*heads, "error of max \\|θ\\| where both stand: median (16 to 84 %)"), rows)


def mode_table(mode: numbers.Mode) -> str:
    """Shares of overturnings at every delta, with those of the prototypes and the difference."""
    rows = [("rigid block (Housner, bilinear)", *(with_stated(mode.rigid / mode.number, RIGID_PROTOTYPE),) * 4)]
    for name, counts in zip(PROTOTYPES, (mode.elastic, mode.at_rest, mode.consistent), strict=True):
        cells = [
            with_stated(count / mode.number, stated) for count, stated in zip(counts, PROTOTYPES[name], strict=True)
        ]
        rows.append((name, *cells))
    return table(("P(overturn), here / before (difference)", *(f"δ = {one:g}" for one in mode.deltas)), rows)


def with_stated(value: float, stated: float) -> str:
    """A share, the one stated before, and their difference."""
    return f"{value:.3f} / {stated:.3f} ({value - stated:+.3f})".replace("-", "−")


def held_table() -> str:
    """Every number that the paper or another source states, ours, and the difference."""
    linear = numbers.turning_points(CONCRETE, tp.HousnerImpact(e=numbers.E, geometry="linear"))
    undamped = numbers.turning_points(CONCRETE, tp.HousnerImpact(e=1.0, geometry="linear"), 1)
    rows: list[tuple[str, ...]] = []

    def row(what: str, stated: float, source: str, here: float, digits: int) -> None:
        rows.append((what, f"{stated:.{digits}f}", source, f"{here:.{digits}f}", difference(here, stated)))

    row("ζ of Giannini–Masiani at e = 0: 2/π", 2.0 / math.pi, "the paper", tp.GianniniMasiani.damping_ratio(0.0), 6)
    for degrees, ratio in ((10, 0.0315), (15, 0.0720), (20, 0.1312)):
        e = tp.Block.from_slenderness(math.radians(degrees), 1.0).restitution
        here = tp.MakrisKonstantinidis.damping_ratio(e)
        row(f"ζ of Makris–Konstantinidis, α = {degrees}°, e_R", ratio, "Makris and Konstantinidis (2003)", here, 4)
    row("e_R of the concrete block", 0.942, "1 − 1.5 sin² α", CONCRETE.restitution, 3)
    row("stiffness ratio n at δ = 0.05", 19.0, "the paper: δ = 1/(n + 1)", zone_ratio(), 1)
    row("quarter period p T/4 from α/2", math.acosh(2.0), "Housner (1963), acosh 2", 0.5 * undamped[0, 1], 6)
    closed = numbers.housner_peaks()[1]
    for n in SHOWN:
        row(f"Housner's peak {n} over α", closed[n], "Housner (1963), closed form", linear[1, n], 6)
    for rival in RIVALS:
        peaks = numbers.turning_points(CONCRETE, rival.make(numbers.E, DELTA))[1]
        for i, n in enumerate(SHOWN):
            if rival.name in INTEGRATED:
                row(f"{rival.name}, peak {n} over α", INTEGRATED[rival.name][i], "integration", peaks[n], 8)
            else:
                row(f"{rival.name}, peak {n} over α", closed[n], "Housner's closed form", peaks[n], 8)
    return table(("quantity", "stated", "by", "here", "difference"), rows)


def zone_ratio() -> float:
    """The stiffness of the zone over that of the falling branch, from the oscillator that the engine solves."""
    regions = sorted(
        tp.DiscreteDamping(e=numbers.E, delta=DELTA).oscillator(CONCRETE).regions, key=lambda one: one.lower
    )
    return regions[1].stiffness / -regions[0].stiffness


def record_list(shaking: numbers.Shaking) -> str:
    """The files of the many runs, or what stands in for them."""
    if not shaking.titles:
        return f"No folder of records was named: {shaking.waveform_words}, and {shaking.many_words} stand in."
    head = "Those that reach 0.1 g, each with event, station, component and source as its own head says them:"
    return "\n".join((head, "", *(f"- {one}" for one in shaking.titles)))


def percent(value: float, digits: int = 0) -> str:
    """A share in per cent."""
    return f"{100.0 * value:.{digits}f} %".replace("-", "−")


def signed(value: float, digits: int = 0) -> str:
    """A relative error in per cent, with its sign."""
    text = f"{100.0 * value:+.{digits}f} %"
    return (f"{0.0:.{digits}f} %" if float(text[:-2]) == 0.0 else text).replace("-", "−")


def difference(here: float, stated: float) -> str:
    """A difference in powers of ten; below rounding of what was stated it is just small."""
    off = here - stated
    return "0" if off == 0.0 else f"{off:+.0e}".replace("-", "−")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="make docs/paper.md and its figures")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--records", default=os.environ.get("TOPPLING_RECORDS") or None, help="folder of AT2 records")
    chosen = parser.parse_args()
    main(chosen.out, chosen.records)
