"""The page docs/runs.md: outcomes of one motion by its factor, numbers of runs, and the coverage of intervals.

docs/runs also has the output of the commands that the page names, and of `make coverage`.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

import toppling as tp

from ...models.oscillator import stack
from ...models.outputs import OF_ENGINE
from ...models.runs import run_mixed
from ...motions import records
from ...motions.arrays import Record
from ...studies.facts.coverage import COVERAGE
from ...studies.plots.axes import COLOURS
from ..sequential import sizes
from .page import ROOT, save, some, template, write, write_csv
from .tables import Interval, body

BLOCK = tp.Block(0.4, 1.8)
LAW = tp.EnergyConsistent()
GENERATOR = tp.motions.SiteBasedScenario(magnitude=6.8, distance=15_000.0, vs30=620.0, dt=0.01)
SEED = 17
MOTIONS = some(60)
POINTS = some(400)
NEAR = 0.5
"""Half width, in ln, of the levels about the median at which verdicts are compared."""
CHANGES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6)
SPACINGS = (0.2, 0.05, 0.0125, 0.003125, 0.00078125, 0.0001953125)
SPAN = (-1.0, 0.8)
ZOOMS = 5
ACROSS = 1500
"""Levels across a strip of the figure."""
LEVELS_A_MOTION = (1, 2, 3, 5, 10, 20)
REPLICATES = some(2000)
INTERVALS = {
    "half level, far apart": "half level, levels two dispersions apart",
    "fraction": "levels at which 10, 25 or 75 % overturn",
    "fraction, cloud": "the same, clouds",
    "dispersion": "dispersion of a fitted curve",
    "rate": "annual rate, common levels",
    "rate, stripes": "annual rate, stripes",
    "rate, cloud": "annual rate, clouds",
    "rate, isotonic": "annual rate, isotonic curves",
    "total": "total of an inventory",
    "saving": "saving by anchoring",
    "size": "size that meets a rate",
    "ratio of medians": "ratio of fitted medians",
    "ratio of totals": "ratio of totals",
}
"""Names of kinds of intervals in the table of coverage."""
COVERED = ((20,), (80, 100), (400,))
"""Numbers of motions in the columns of the table of coverage."""


class Shaken(NamedTuple):
    """Motions, and the factor on each that brings its peak velocity to the median of the block."""

    motions: list[Record]
    middle: NDArray[np.float64]


def falls(
    motions: list[Record], factors: NDArray[np.float64], block: tp.Block = BLOCK, law: tp.EnergyConsistent = LAW
) -> NDArray[np.bool_]:
    """Return whether a block falls under each motion at factors (motion, level)."""
    which = np.repeat(np.arange(len(motions)), factors.shape[1])
    results = run_mixed(
        stack([law.oscillator(block)]), np.zeros(which.size, np.int64), which, factors.ravel(), motions, True, True
    )
    return np.asarray(results[:, OF_ENGINE["overturned"]] > 0.0).reshape(factors.shape)


def shaken(number: int = MOTIONS) -> Shaken:
    """Return the motions, with factors to the level at which half of all runs fall."""
    array = GENERATOR.sample(number, seed=SEED)
    motions = records(array)
    velocities = tp.motions.measures(array, "pgv")["pgv"].values
    x = np.linspace(np.log(0.15), np.log(2.0), 200)
    share = falls(motions, np.exp(x) / velocities[:, None]).mean(axis=0)
    median = np.exp(np.interp(0.5, np.maximum.accumulate(share), x))
    return Shaken(motions, median / velocities)


def about_the_median(ensemble: Shaken, points: int = POINTS) -> NDArray[np.float64]:
    """Return factors (motion, level) spread evenly, in ln, about each motion's factor to the median."""
    random = np.random.default_rng(SEED)
    shift = (np.arange(points) + random.random((len(ensemble.motions), points))) / points
    return ensemble.middle[:, None] * np.exp(NEAR * (2.0 * shift - 1.0))


def interval(values: NDArray[np.float64]) -> Interval:
    """Return the mean of values (motion,) with its 95 % interval over motions."""
    random = np.random.default_rng(SEED)
    means = values[random.integers(0, values.size, (4000, values.size))].mean(axis=1)
    return Interval(float(values.mean()), float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975)))


def flips(ensemble: Shaken) -> dict[float, NDArray[np.float64]]:
    """Return the share of verdicts (motion,) that change where the factor does by a relative change."""
    factors = about_the_median(ensemble)
    before = falls(ensemble.motions, factors)
    return {change: (falls(ensemble.motions, factors * (1.0 + change)) != before).mean(axis=1) for change in CHANGES}


def exponent(shares: dict[float, NDArray[np.float64]]) -> Interval:
    """Return the uncertainty exponent: the slope of ln(share) over ln(change) up to 1 %, with its interval."""
    small = [change for change in shares if change <= 1e-2]
    x = np.log(small)
    every = np.array([shares[change] for change in small])
    random = np.random.default_rng(SEED)
    slopes = []
    for _ in range(2000):
        drawn = every[:, random.integers(0, every.shape[1], every.shape[1])].mean(axis=1)
        slopes.append(np.polyfit(x, np.log(np.maximum(drawn, 1e-12)), 1)[0])
    slope = float(np.polyfit(x, np.log(every.mean(axis=1)), 1)[0])
    return Interval(slope, float(np.quantile(slopes, 0.025)), float(np.quantile(slopes, 0.975)))


def _smoother(record: Record) -> Record:
    """Return a record of which every second sample was kept, and straight lines between them."""
    n = record.acceleration.size
    return record._replace(acceleration=np.interp(np.arange(n), np.arange(0, n, 2), record.acceleration[::2]))


def _rounded(record: Record) -> Record:
    step = 1e-3 * 9.80665
    return record._replace(acceleration=np.round(record.acceleration / step) * step)


def other_models(ensemble: Shaken) -> dict[str, NDArray[np.float64]]:
    """Return the share of verdicts (motion,) that change where block, law or record do."""
    factors = about_the_median(ensemble)
    before = falls(ensemble.motions, factors)
    e = float(LAW.restitution(BLOCK) or 0.0)
    wider = replace(BLOCK, width=BLOCK.width * 1.01)
    cases: dict[str, Callable[[], NDArray[np.bool_]]] = {
        "e larger by 1 %": lambda: falls(ensemble.motions, factors, law=tp.EnergyConsistent(e=min(1.0, 1.01 * e))),
        "width larger by 1 %": lambda: falls(ensemble.motions, factors, wider),
        "record rounded to 0.001 g": lambda: falls([_rounded(record) for record in ensemble.motions], factors),
        "every second sample left out": lambda: falls([_smoother(record) for record in ensemble.motions], factors),
    }
    return {name: (case() != before).mean(axis=1) for name, case in cases.items()}


def first_falls(ensemble: Shaken) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return, by spacing: the mean number of intervals of levels that fell, and the median first fall, in ln."""
    finest = SPACINGS[-1]
    x = np.arange(SPAN[0], SPAN[1], finest)
    intervals, first = np.empty((2, len(SPACINGS), len(ensemble.motions)))
    for i, (record, middle) in enumerate(zip(ensemble.motions, ensemble.middle, strict=True)):
        fell = falls([record], middle * np.exp(x)[None])[0]
        for k, spacing in enumerate(SPACINGS):
            step = round(spacing / finest)
            spaced = fell[::step]
            intervals[k, i] = np.sum(spaced[1:] & ~spaced[:-1]) + spaced[0]
            first[k, i] = x[::step][int(np.argmax(spaced))] if spaced.any() else SPAN[1]
    return intervals.mean(axis=1), np.median(first, axis=1)


def levels_a_motion(ensemble: Shaken) -> dict[int, float]:
    """Return the standard error of ln(median) from 100 motions, by the number of levels of each within the curve."""
    x = np.log(about_the_median(ensemble, 200) / ensemble.middle[:, None])
    fell = falls(ensemble.motions, about_the_median(ensemble, 200))
    random = np.random.default_rng(SEED)
    errors = {}
    for levels in LEVELS_A_MOTION:
        medians = []
        for _ in range(REPLICATES):
            motions = random.integers(0, len(ensemble.motions), 100)
            at = random.integers(0, 200, (100, levels))
            s, y = x[motions[:, None], at].ravel(), fell[motions[:, None], at].ravel().astype(float)
            # (a straight line through verdicts near the median: what a local curve comes to)
            near = np.abs(s) < 0.5
            slope, middle = np.polyfit(s[near], y[near], 1)
            if slope > 0.0:
                medians.append((0.5 - middle) / slope)
        errors[levels] = float(np.std(medians))
    return errors


def boundary_figure(ensemble: Shaken) -> Figure:
    """Draw verdicts of the motion whose verdicts change most often: each strip is a tenth of the one above."""
    often = falls(ensemble.motions, np.sort(about_the_median(ensemble, 200), axis=1))
    wild = int((often[:, 1:] != often[:, :-1]).sum(axis=1).argmax())
    figure = Figure(figsize=(6.4, 5.4))
    panels = figure.subplots(ZOOMS, 1)
    centre, width = 0.0, 1.0
    for k, ax in enumerate(panels):
        x = centre + width * np.linspace(-0.5, 0.5, ACROSS)
        fell = falls([ensemble.motions[wild]], ensemble.middle[wild] * np.exp(x)[None])[0]
        ax.imshow(fell[None], aspect="auto", cmap=ListedColormap(["white", COLOURS[0]]), extent=(x[0], x[-1], 0, 1))
        ax.set_yticks([])
        ax.set_xticks([x[0], x[-1]], [f"{np.exp(x[0]):.7g}", f"{np.exp(x[-1]):.7g}"], fontsize=8)
        ax.tick_params(length=2)
        if k + 1 < ZOOMS:
            width /= 10.0
            changes = np.flatnonzero(fell[1:] != fell[:-1])
            inside = changes[(changes > ACROSS // 10) & (changes < ACROSS - ACROSS // 10)]
            centre = float(x[inside[inside.size // 2]])
            ax.axvspan(centre - width / 2, centre + width / 2, color=COLOURS[1], alpha=0.6, lw=0)
    panels[-1].set_xlabel("factor on the motion over the factor to the median (log)")
    figure.tight_layout()
    return figure


class Way(NamedTuple):
    """A line of what `benchmarks.sequential.sizes` prints: error, motions, runs, those of a check, and time, s."""

    rms: float
    motions: int
    runs: int
    check: int
    seconds: float


def ways_to_sizes(text: str) -> dict[str, list[Way]]:
    """Return the lines of `benchmarks.sequential.sizes` by their label, those of more runs after those of fewer."""
    ways: dict[str, list[Way]] = {}
    for line in text.splitlines()[1:-1]:
        *label, rms, _, motions, runs, check, seconds = line.split()
        of_motions, of_runs, of_check = (int(number.replace(",", "")) for number in (motions, runs, check))
        way = Way(float(rms), of_motions, of_runs, of_check, float(seconds))
        ways.setdefault(" ".join(label), []).append(way)
    return ways


def printed(name: str) -> str:
    """Return the output of a command."""
    return (ROOT / f"docs/runs/{name}.txt").read_text(encoding="utf-8").rstrip()


def covered() -> Iterator[tuple[str, ...]]:
    """Yield each kind of interval with its lowest and highest coverage by number of motions."""
    for kind, name in INTERVALS.items():
        ends = (next((COVERAGE[kind][n] for n in numbers if n in COVERAGE[kind]), None) for numbers in COVERED)
        yield name, *("–" if known is None else f"{known[0]:.1f}–{known[1]:.1f}" for known in ends)


def half_levels() -> float:
    """Return the lowest coverage of half levels from 20 motions on, unless levels are far apart, per cent."""
    with (ROOT / "docs/runs/coverage.csv").open(encoding="utf-8", newline="") as stream:
        return min(
            float(row["lowest"])
            for row in csv.DictReader(stream)
            if row["interval"].startswith("Level at which half overturn")
            and "far apart" not in row["interval"]
            and int(row["motions"]) >= 20
        )


def main() -> None:
    """Write the page, its figure and its tables."""
    ensemble = shaken()
    shares, by_model = flips(ensemble), other_models(ensemble)
    save("runs", {"boundary": boundary_figure(ensemble)}, 120)
    slope = exponent(shares)
    intervals, first = first_falls(ensemble)
    errors = levels_a_motion(ensemble)
    changes = [(f"factor larger by {100 * change:g} %", interval(share)) for change, share in shares.items()]
    changes += [(name, interval(share)) for name, share in by_model.items()]
    lines = ((name, *(f"{100 * end:.1f}" for end in share)) for name, share in changes)
    write_csv("runs", "changes", ("change", "outcomes that change, %", "lower", "upper"), lines)
    write_csv(
        "runs",
        "spacings",
        ("spacing of levels, %", "intervals per motion", "median first fall, % above the coarsest spacing"),
        (
            (f"{100 * spacing:.3g}", f"{number:.1f}", f"{100 * (np.exp(at - first[0]) - 1.0):.0f}")
            for spacing, number, at in zip(SPACINGS, intervals, first, strict=True)
        ),
    )
    ways = ways_to_sizes(printed("sizes"))
    surface, grid = ways["one surface"][1], ways["20 common levels, local fit"][-1]
    page = template("runs").format(
        motions=MOTIONS,
        exponent=slope,
        halving="{:,.0f} ({:,.0f} to {:,.0f})".format(*(2 ** (1 / slope[i]) for i in (0, 2, 1))),
        fewest=intervals[0],
        most=intervals[-1],
        coarsest=100 * SPACINGS[0],
        finest=100 * SPACINGS[-1],
        drift=100 * (1.0 - np.exp(first[-1] - first[0])),
        flipped=100 * shares[1e-2].mean(),
        changed=interval(shares[1e-2]).times(100),
        restitution=100 * by_model["e larger by 1 %"].mean(),
        width=100 * by_model["width larger by 1 %"].mean(),
        width_table=body((n, 100 * n, f"±{196 * error:.1f}") for n, error in errors.items()),
        three=196 * errors[3],
        twenty=196 * errors[20],
        other_motions=100 * 20 / 3,
        better=196 * errors[3] * (3 / 20) ** 0.5,
        blocks=sizes.NUMBER,
        surface=surface,
        grid=grid,
        surface_rms=100.0 * surface.rms,
        grid_rms=100.0 * grid.rms,
        fewer=grid.runs / (surface.runs + surface.check),
        less=grid.seconds / surface.seconds,
        half=half_levels(),
        coverage=body(covered()),
    )
    write("runs", page)
