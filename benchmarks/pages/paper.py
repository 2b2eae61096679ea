"""The page docs/paper.md and its figures: what the source paper's text says of its laws, computed again; δ and e.

The paper is Liu, Huang and Qu (2024), A discretely damped SDOF model for the rocking response of freestanding blocks.
TOPPLING_RECORDS names a folder of AT2 records for the forced runs; without it, simulated motions stand in.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...models import Law
from ...models.runs import trace
from ...studies.plots.axes import COLOURS
from . import sensitivity
from .figures import bare, looks, new
from .page import Table, save, some, template, write, write_csv
from .tables import minus, percent, table

E, DELTA, X0 = 0.925, 0.05, 0.5
"""Restitution of the concrete block, half width of the zone, and the rotation over α from which it is let go."""
CONCRETE = tp.Block.from_slenderness(math.atan(0.2), 0.38, name="concrete block")
"""e = 0.925 and e_R = 0.942 are Aslam's block's; its size is in the lost Table 1, and only stretches time."""
FIGURE_6 = tp.Block.from_slenderness(0.2, 0.38, name="block of figure 6")
PEAKS = 10
DELTAS = (0.01, 0.02, 0.05, 0.1)
SHAKEN = tuple(
    tp.Block.from_slenderness(math.atan(1.0 / ratio), R, name=f"h/b = {ratio}, R = {R} m")
    for ratio, R in ((5, 0.8), (4, 0.5), (3, 0.6))
)
LEVELS = (1.5, 2.0, 3.0, 4.0, 6.0)
"""PGA/(g tan α) of the many runs."""
LEAST_PGA = 0.1 * STANDARD_GRAVITY
"""Records weaker than this are left out: scaled to six times g tan α they would be no records."""


class Rival(NamedTuple):
    """A law of the comparison: its key in the template, its name, its colour, and its maker."""

    key: str
    name: str
    colour: str
    make: Callable[[float | None, float], Law]


def _lever(law: type[Law]) -> Callable[[float | None, float], Law]:
    return lambda e, delta: law(e=e, delta=delta, lever="R")  # type: ignore[call-arg]


RIVALS = (
    Rival("discrete", "discrete", COLOURS[0], _lever(tp.DiscreteDamping)),
    Rival("vassiliou", "Vassiliou", COLOURS[3], lambda e, delta: tp.Vassiliou(delta=delta, lever="R")),
    Rival("mk", "Makris–Konstantinidis", COLOURS[2], _lever(tp.MakrisKonstantinidis)),
    Rival("gm", "Giannini–Masiani", COLOURS[1], _lever(tp.GianniniMasiani)),
    Rival("consistent", "energy-consistent (ours)", COLOURS[0], _lever(tp.EnergyConsistent)),
)
"""In the order of the paper's panels; the fifth is not the paper's."""
LAWS = [rival.name for rival in RIVALS]
REFERENCE = tp.HousnerImpact()
"""Exact geometry and e_R: what stands where the paper has measurements."""
CAUSES = {
    f"Housner, bilinear, lever {lever}": tp.HousnerImpact(geometry="bilinear", lever=lever) for lever in ("R", "h")
}
"""The reference with the paper's straight line, and with its lever: what is not the damping's doing."""
# Overturnings under 400 other motions of the same kind, counted before this engine was written, by two programs.
PROTOTYPES = {
    "rigid block (Housner, bilinear)": (0.010,) * 4,
    "discrete": (0.63, 0.53, 0.34, 0.11),
    "discrete, rigid at rest": (0.025, 0.022, 0.015, 0.020),
    "energy-consistent (ours)": (0.007, 0.018, 0.015, 0.015),
}


def main() -> None:
    """Write the page, its figures and its tables."""
    over = sensitivity.studies()
    with looks():
        free = free_figure()
    save("paper", {"free": free, "median_ratio": sensitivity.figure(over["delta"])}, 140)
    shaken = shaking(os.environ.get("TOPPLING_RECORDS") or None, some(40))
    mode = elastic_mode(some(400))
    for name, (headings, rows) in (tables(shaken, mode) | sensitivity.tables(over)).items():
        write_csv("paper", name, headings, rows)
    write("paper", page(shaken, many_runs(shaken.many), mode, sensitivity.values(over)))


def tables(shaken: Shaking, mode: Mode) -> dict[str, Table]:
    """Return the tables of files: headings and rows."""
    made: dict[str, Table] = {
        "free": (("n", "Housner", *LAWS, "Eqs. 16–17 alone"), free_rows()),
        "delta": (
            ("fifth peak over α", *(f"δ = {delta:g}" for delta in DELTAS), "range", "range of its time"),
            delta_rows(),
        ),
        "elastic_zone": (
            ("P(overturn), here / earlier", *(f"δ = {delta:g}" for delta in MODE_DELTAS)),
            mode_rows(mode),
        ),
    }
    return made | ({"records": (("file", "record"), shaken.titles)} if shaken.titles else {})


def page(shaken: Shaking, shares: Sequence[Shares], mode: Mode, of_studies: Mapping[str, object]) -> str:
    """Return the page: its template with every number, and the values of the studies over δ and e."""
    errors = {rival.key: free_errors(rival.make(E, DELTA)) for rival in RIVALS}
    false = {law.name: percent(law.falsely_fallen / law.standing) for law in shares}
    return template("paper").format(
        e=E,
        e_rigid=CONCRETE.restitution,
        delta=DELTA,
        **{f"mre_{key}": signed(law.peak) for key, law in errors.items()},
        period_consistent=percent(errors["consistent"].period, 1),
        period_discrete=percent(errors["discrete"].period),
        tenth_discrete=errors["discrete"].peaks[10],
        tenth_housner=housner_peaks()[1, 10],
        tenth_edge=edge_peaks()[10],
        equivalent=equivalent_restitution(),
        **{f"range_{key}": percent(ratio) for key, ratio in delta_ranges().items()},
        frequency=elastic_frequency(FIGURE_6),
        blocks="; ".join(block.label for block in SHAKEN),
        many=shaken.words,
        runs=shares[0].standing + shares[0].fallen,
        levels=", ".join(f"{level:g}" for level in LEVELS),
        shares_table=shares_table(shares),
        false_discrete=false["discrete"],
        false_lever=false["Housner, bilinear, lever R"],
        false_line=false["Housner, bilinear, lever h"],
        number=mode.number,
        at_rest=mode.at_rest[1] / mode.number,
        elastic=mode.elastic[1] / mode.number,
        rigid=mode.rigid / mode.number,
        lever_slender=percent(1.0 - math.cos(math.atan(1.0 / 6.0)), 1),
        lever_squat=percent(1.0 - math.cos(math.atan(1.0 / 1.6)), 1),
        records="[records.csv](paper/records.csv) lists them." if shaken.titles else "this page is without them.",
        **of_studies,
    )


def signed(value: float, digits: int = 0) -> str:
    """Return a relative error in per cent, with its sign."""
    text = f"{100.0 * value:+.{digits}f} %"
    return minus(text) if float(text[:-2]) else f"{0.0:.{digits}f} %"


# Free rocking --------------------------------------------------------------------------------------------------------


def turning_points(block: tp.Block, model: Law, number: int = PEAKS) -> NDArray[np.float64]:
    """Times over 1/p and |rotations| over alpha (2, number + 1) of free rocking from X0, inside the zone too."""
    quiet = np.zeros(6001)
    run = trace(model.oscillator(block), quiet, 0.01 / block.p, X0 * block.alpha, max_turning_points=8 * number)
    times, rotations = run.turning_points[:, :number]
    return np.stack([np.append(0.0, times) * block.p, np.append(X0 * block.alpha, np.abs(rotations)) / block.alpha])


def housner_peaks(e: float = E) -> NDArray[np.float64]:
    """Housner's closed form from X0: times over 1/p and peaks over alpha (2, PEAKS + 1), linear geometry.

    x_n = 1 - sqrt(1 - e^2n [1 - (1 - x0)²]), and a quarter of a swing to x takes acosh(1/(1 - x))/p (Housner 1963).
    """
    n = np.arange(PEAKS + 1)
    x = 1.0 - np.sqrt(1.0 - e ** (2 * n) * (1.0 - (1.0 - X0) ** 2))
    quarter = np.arccosh(1.0 / (1.0 - x))
    return np.stack([np.append(0.0, np.cumsum(quarter[:-1] + quarter[1:])), x])


def edge_peaks(delta: float = DELTA) -> NDArray[np.float64]:
    """Peaks over alpha where each crossing shrinks the speed at the zone's edge by e: the paper's Eqs. 16 and 17.

    (1 - x_n)² = (1 - delta)² - e^2n [(1 - delta)² - (1 - x0)²] (derived): the energy below the edge is never lost.
    """
    top = (1.0 - delta) ** 2
    n = np.arange(PEAKS + 1)
    return np.asarray(1.0 - np.sqrt(top - E ** (2 * n) * (top - (1.0 - X0) ** 2)))


class FreeErrors(NamedTuple):
    """A law's peaks (n + 1,) over alpha, and mean relative errors of peaks and half periods, of n swings."""

    peaks: NDArray[np.float64]
    peak_errors: NDArray[np.float64]
    peak: float
    period: float


def free_errors(model: Law) -> FreeErrors:
    """The paper's Table 2, with Housner's closed form in the place of the measurement."""
    reference = housner_peaks()
    turns = turning_points(CONCRETE, model)
    relative = turns[1, 1:] / reference[1, 1:] - 1.0
    periods = np.diff(turns[0]) / np.diff(reference[0]) - 1.0
    return FreeErrors(turns[1], relative, float(relative.mean()), float(periods.mean()))


def free_rows() -> Iterator[tuple[str, ...]]:
    """Yield the paper's Table 2: peaks over alpha with their errors, and mean relative errors."""
    reference, edge = housner_peaks()[1], edge_peaks()
    errors = [free_errors(rival.make(E, DELTA)) for rival in RIVALS]
    for n in range(1, PEAKS + 1):
        cells = [f"{law.peaks[n]:.4f} ({signed(law.peak_errors[n - 1])})" for law in errors]
        yield str(n), f"{reference[n]:.4f}", *cells, f"{edge[n]:.4f}"
    yield "mean error, θ_peak", "", *(signed(law.peak, 1) for law in errors), ""
    yield "mean error, T", "", *(signed(law.period, 1) for law in errors), ""


def equivalent_restitution() -> float:
    """The e at which Housner's block has the discrete law's last peak: (E_n/E_0)^(1/2n), E = 1 - (1 - x)² (derived)."""
    last = turning_points(CONCRETE, RIVALS[0].make(E, DELTA))[1, PEAKS]
    return float(((1.0 - (1.0 - last) ** 2) / (1.0 - (1.0 - X0) ** 2)) ** (0.5 / PEAKS))


def fifth_peaks() -> NDArray[np.float64]:
    """The fifth peak of the concrete block (law, delta, 2), its time over 1/p and its rotation over alpha."""
    return np.array([[turning_points(CONCRETE, rival.make(E, delta), 5)[:, 5] for delta in DELTAS] for rival in RIVALS])


def delta_ranges() -> dict[str, float]:
    """Return how far the fifth peak ranges over the deltas, over its value at the recommended one, by the law's key."""
    peaks = zip(RIVALS, fifth_peaks()[:, :, 1], strict=True)
    return {rival.key: float(np.ptp(row) / row[DELTAS.index(DELTA)]) for rival, row in peaks}


def delta_rows() -> Iterator[tuple[str, ...]]:
    """Yield the fifth peak and its time at every delta."""
    for name, law in zip(LAWS, fifth_peaks(), strict=True):
        time, peak = np.ptp(law, axis=0) / law[DELTAS.index(DELTA)]
        yield name, *(f"{height:.4f}" for height in law[:, 1]), percent(peak, 1), percent(time, 1)


def free_figure() -> Figure:
    """Draw rotations of the paper's figure 7, a panel for each law."""
    figure, axes = new(7.2, len(RIVALS), 1, sharex=True, sharey=True)
    start = X0 * CONCRETE.alpha
    reference = tp.free_rocking(CONCRETE, tp.HousnerImpact(e=E, geometry="linear"), start, 4.0)
    for ax, rival in zip(axes, RIVALS, strict=True):
        run = tp.free_rocking(CONCRETE, rival.make(E, DELTA), start, 4.0)
        ax.plot(reference["time"], reference["rotation"] / CONCRETE.alpha, color="0.35", lw=0.8, ls=(0, (3, 1.5)))
        ax.plot(run["time"], run["rotation"] / CONCRETE.alpha, color=rival.colour, lw=1.3)
        bare(ax)
        ax.set_title(rival.name, loc="left")
        ax.set_xlim(0.0, 4.0)
    figure.supylabel("rotation over slenderness, θ/α (–)")
    figure.supxlabel("time (s); dashed: Housner's block")
    return figure


# The elastic mode -----------------------------------------------------------------------------------------------------


def elastic_frequency(block: tp.Block) -> float:
    """Hz: sqrt(k0/I_O)/2π, the block's own frequency inside the zone, which a rigid block does not have."""
    ratio = 1.0 / DELTA - 1.0
    return block.p * math.sqrt(ratio * math.sin(block.alpha) / block.alpha) / (2.0 * math.pi)


MODE_DELTAS = (0.1, 0.05, 0.01, 0.001)


class Mode(NamedTuple):
    """Overturnings of the rigid block, and of the discrete law at several deltas, elastic and rigid at rest."""

    number: int
    rigid: int
    elastic: tuple[int, ...]
    at_rest: tuple[int, ...]
    consistent: tuple[int, ...]


def elastic_mode(number: int = 400) -> Mode:
    """Overturnings under filtered noise of mean PGA 0.3 g: h/b = 4, R = 0.5 m, e_R, lever R."""
    generator = tp.motions.KanaiTajimi(omega_g=5.0 * math.pi, xi_g=0.6, duration=30.0, dt=0.005, baseline="parabolic")
    motions = tp.motions.scale_to_mean(generator.sample(number, seed=1980), 0.3 * STANDARD_GRAVITY)
    models: list[Law] = [tp.HousnerImpact(geometry="bilinear", lever="R")]
    models += [tp.DiscreteDamping(delta=delta, lever="R") for delta in MODE_DELTAS]
    models += [tp.DiscreteDamping(delta=delta, lever="R", rest="rigid") for delta in MODE_DELTAS]
    models += [tp.EnergyConsistent(delta=delta, lever="R") for delta in MODE_DELTAS]
    block = tp.Block.from_slenderness(math.atan(0.25), 0.5)
    runs = tp.ida(block, models, motions, [1.0], im="scale", outputs=("overturned",))
    counts = [int(count) for count in runs["overturned"].sum("motion").values.ravel()]
    n = len(MODE_DELTAS)
    return Mode(number, counts[0], *(tuple(counts[1 + i * n : 1 + (i + 1) * n]) for i in range(3)))


def mode_rows(mode: Mode) -> Iterator[tuple[str, ...]]:
    """Yield shares of overturnings at every delta, with the shares of the prototypes."""
    counted = ((mode.rigid,) * 4, mode.elastic, mode.at_rest, mode.consistent)
    for (name, stated), counts in zip(PROTOTYPES.items(), counted, strict=True):
        yield name, *(f"{count / mode.number:.3f} / {share:.3f}" for count, share in zip(counts, stated, strict=True))


# Forced rocking ------------------------------------------------------------------------------------------------------


class Shaking(NamedTuple):
    """The motions of the shares, the same in words, and the titles of records."""

    many: list[xr.DataArray]
    words: str
    titles: tuple[tuple[str, str], ...]


def shaking(folder: str | Path | None = None, number: int = 40) -> Shaking:
    """The AT2 records of a folder (and its sub-folders), or where none is given simulated motions in their place."""
    if folder is None:
        many = [tp.motions.CloughPenzien(duration=20.0, dt=0.01).sample(number, seed=1940)]
        return Shaking(many, f"{number} simulated motions (Clough–Penzien, seed 1940)", ())
    files = sorted(Path(folder).rglob("*.AT2"), key=lambda path: path.name)
    if not files:
        raise ValueError(f"the folder of records must hold AT2 files, got {folder}")
    arrays = [tp.motions.read(path) for path in files]
    strong = np.flatnonzero(tp.motions.measures(arrays)["pga"].values >= LEAST_PGA)
    if strong.size == 0:
        raise ValueError(f"a record must reach a PGA of at least {LEAST_PGA:.3g} m/s², got none in {folder}")
    return Shaking(
        [arrays[i] for i in strong],
        f"the {strong.size} of {len(files)} records that reach 0.1 g",
        tuple((files[i].name, _title(files[i])) for i in strong),
    )


def _title(path: Path) -> str:
    """Event, station and component as the file's head says them: its first line where that names no database."""
    head = path.read_text(encoding="latin-1").splitlines()[:2]
    if "PEER" not in head[0].upper():
        return " ".join(head[0].split())
    return f"{' '.join(head[1].split())}; PEER strong motion database"


class Shares(NamedTuple):
    """One law against the reference over many runs: counts of verdicts, and errors where both blocks rock and stand."""

    name: str
    standing: int
    falsely_fallen: int
    fallen: int
    detected: int
    compared: int
    error: tuple[float, float, float]


def many_runs(motions: Sequence[xr.DataArray]) -> list[Shares]:
    """Tables 4 and 5 over all blocks, motions and levels: shares in the place of six verdicts."""
    models = [REFERENCE, *(rival.make(None, DELTA) for rival in RIVALS), *CAUSES.values()]
    outputs = ("overturned", "peak_rotation", "uplifted")
    runs = tp.ida(SHAKEN, models, list(motions), LEVELS, im="pga_normalised", outputs=outputs)
    fell, peak, rocked = (runs[name].transpose("model", ...).values for name in outputs)
    rows = []
    for i, name in enumerate([*LAWS, *CAUSES], 1):
        stood = rocked[0].astype(bool) & ~fell[0]
        both = stood & ~fell[i]
        error = peak[i][both] / peak[0][both] - 1.0
        middle, low, high = np.quantile(error, (0.5, 0.16, 0.84)).tolist()
        rows.append(
            Shares(
                name,
                int(stood.sum()),
                int((stood & fell[i]).sum()),
                int(fell[0].sum()),
                int((fell[0] & fell[i]).sum()),
                int(both.sum()),
                (middle, low, high),
            )
        )
    return rows


def shares_table(shares: Sequence[Shares]) -> str:
    """Return Tables 4 and 5 as shares."""
    rows = []
    for law in shares:
        middle, low, high = map(signed, law.error)
        false = f"{law.falsely_fallen} of {law.standing} ({percent(law.falsely_fallen / law.standing)})"
        detected = f"{law.detected} of {law.fallen} ({percent(law.detected / law.fallen)})"
        rows.append((law.name, false, detected, f"{middle} ({low} to {high}), {law.compared} runs"))
    heads = ("law", "overturns if Housner's stays upright", "overturns if Housner's overturns")
    return table((*heads, "error of max \\|θ\\|, median (16 to 84 %)"), rows)
