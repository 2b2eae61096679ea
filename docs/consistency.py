"""docs/consistency.md: what the choice of motions, floors that yield and isolators change in an annual rate.

`make consistency` runs it (some minutes).  Every number on the page is put there by this file.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtr

import toppling as tp
from toppling.benchmarks.selection.rates import rates_by_measure
from toppling.fragility.curves.published import fema_p58
from toppling.motions import Scenario
from toppling.studies.plots import axes

HERE = Path(__file__).parent
GIVEN = "Sa(1.0)"
VS30 = 620.0
LAW = tp.HousnerImpact()
PIECES = (
    tp.catalogue["bookcase-6-shelf"],
    tp.catalogue["bookcase-5-shelf"],
    tp.catalogue["bookcase-4-shelf"],
    tp.catalogue["file-vertical-4-drawer"],
    tp.Block(0.45, 2.0, name="server rack"),
    tp.Block(0.3, 1.4, name="pedestal"),
)
PERIODS = (25.0, 43.0, 72.0, 144.0, 288.0, 575.0, 1150.0, 2475.0, 5000.0, 10_000.0)
"""Return periods of the stripes, years."""
NUMBER = 40
REPLICATES = 1000
SEED = 4
SPECTRUM = [f"Sa({period:g})" for period in (0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0)]
"""From the bench's period to beyond that of the isolators."""
WEIGHTS = {"pgv": 3.0, "d5_95": 3.0}
POOL = [
    tp.motions.SiteBasedScenario(magnitude=magnitude, distance=distance, vs30=VS30, dt=0.01)
    for magnitude in (5.7, 6.1, 6.5, 7.0, 7.5)
    for distance in (8e3, 15e3, 30e3)
] + [tp.motions.NearFault(magnitude=magnitude, distance=10e3, vs30=VS30, dt=0.01) for magnitude in (6.5, 7.0)]
EACH = 80
A_CANDIDATE = 3
"""Motions of each simulated earthquake where all candidates are scaled."""
LEAST_FALLS = 10
"""Falls in the runs below which their number is given in place of a ratio."""
MOST_ABOVE = 0.5
"""Share of a rate from above the stripes beyond which its ratio is in brackets."""
LEAST_STRIPES = 4
"""Stripes that agree below which a measure is left out at a site."""
STRONG = tp.motions.SiteBasedScenario(magnitude=7.2, distance=8e3, vs30=VS30, dt=0.01)
"""The earthquake of the page on FEMA P-58's contents."""
VELOCITIES = (0.25, 0.4, 0.55, 0.7, 0.9, 1.1, 1.4, 1.8)
"""Levels of peak velocity at which that is done, m/s."""
MILLIONTH = 1e-6
MANY = 400
"""Motions of one earthquake that are selected from by themselves."""
OTHER_SEEDS = (5, 6, 7)
COMPARED = ("pga", "pgv", "Sa(0.2)", "Sa(2.0)", "d5_95")
"""Measures of scaled motions that are held against the hazard's."""
RARE = 7
"""The stripe at which that is done: 2475 years."""
OTHERS = {"PGV": "pgv", "average Sa": tp.motions.AvgSa([0.3, 0.5, 0.75, 1.0, 1.5, 2.0])}
"""Further measures that the motions are selected at levels of."""
ONE = POOL[7]
"""The single earthquake whose motions are scaled to all levels in the usual way."""


class Site(NamedTuple):
    """A site: its earthquakes, magnitude, distance (m) and annual rate of each."""

    name: str
    ruptures: tuple[tuple[float, float, float], ...]

    @property
    def scenarios(self) -> list[Scenario]:
        """Return the earthquakes."""
        return [Scenario(magnitude, distance, VS30) for magnitude, distance, _ in self.ruptures]

    @property
    def rates(self) -> NDArray[np.float64]:
        """Return their annual rates."""
        return np.array([rate for *_, rate in self.ruptures])


SITES = (
    Site("moderate, near", ((6.0, 8e3, 0.05), (6.6, 10e3, 0.02))),
    Site("large, far", ((6.5, 25e3, 0.06), (7.5, 35e3, 0.03))),
    Site("mixed", ((5.7, 8e3, 0.08), (6.8, 15e3, 0.03), (7.5, 50e3, 0.02))),
)


CHOICES = ("spectra alone", "one earthquake", "all candidates")
FURTHER = SITES[1]
"""The site at which floors and supports are compared."""


def _curve_of(site: Site, given: str | tp.motions.Measure) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the medians of a measure in a site's earthquakes, and its standard deviations of the logarithm."""
    on = [tp.motions.expected_target(one, given, [*SPECTRUM, "pgv"]) for one in site.scenarios]
    # (epsilon is linear in the logarithm of the level)
    at_one, at_e = (np.array([one.at(level).epsilon for one in on]) for level in (1.0, math.e))
    sigmas = 1.0 / (at_e - at_one)
    return np.exp(-at_one * sigmas), sigmas


def _density(site: Site, level: float, given: str | tp.motions.Measure = GIVEN) -> NDArray[np.float64]:
    """Return the weight of each earthquake of a site where a measure has a level."""
    medians, sigmas = _curve_of(site, given)
    return np.asarray(np.exp(-0.5 * (np.log(level / medians) / sigmas) ** 2) / sigmas * site.rates)


class Hazard(NamedTuple):
    """What a site's earthquakes give: the hazard curve of GIVEN, its levels, and the target of each level."""

    curve: tp.HazardCurve
    levels: NDArray[np.float64]
    wide: list[tp.motions.Mixture]
    spectral: list[tp.motions.Mixture]


def hazard_of(site: Site, given: str | tp.motions.Measure = GIVEN) -> Hazard:
    """Return the hazard of a site by a measure: lognormal motions of every earthquake."""
    medians, sigmas = _curve_of(site, given)

    def exceeded(levels: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(ndtr(np.log(medians / levels[:, None]) / sigmas) @ site.rates)

    grid = np.geomspace(1e-3, 100.0, 240)
    levels = np.exp(np.interp(np.log(PERIODS), -np.log(exceeded(grid)), np.log(grid)))
    wide, spectral = [], []
    for level in levels:
        density = _density(site, float(level), given)
        for measures, found in (([*SPECTRUM, "pgv", "d5_95"], wide), (SPECTRUM, spectral)):
            found.append(tp.motions.expected_target(site.scenarios, given, measures, weights=density))
    return Hazard(tp.HazardCurve(grid.tolist(), exceeded(grid).tolist(), given), levels, wide, spectral)


def pool() -> tp.motions.Candidates:
    """Return all candidates."""
    return tp.motions.Candidates([one.sample(EACH, seed=SEED + i) for i, one in enumerate(POOL)])


def scaled(
    selection: tp.motions.Selection, level: float, given: str | tp.motions.Measure = GIVEN
) -> list[xr.DataArray]:
    """Return the motions of a selection at its level."""
    arrays = selection.motions if isinstance(selection.motions, list) else [selection.motions]
    return [tp.motions.scale_to(one, level, given) for one in arrays]


def chosen(
    candidates: tp.motions.Candidates, hazard: Hazard, spectra_alone: bool = False, seed: int = SEED
) -> list[tp.motions.Selection]:
    """Return the selection of every level."""
    targets = hazard.spectral if spectra_alone else hazard.wide
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [
            tp.motions.select(
                candidates, target, NUMBER, level=level, weights=None if spectra_alone else WEIGHTS, seed=seed
            )
            for target, level in zip(targets, hazard.levels.tolist(), strict=True)
        ]


class Rates(NamedTuple):
    """Annual rates (piece,) with replicates (replicate, piece), and the falls in the runs (piece,)."""

    values: NDArray[np.float64]
    samples: NDArray[np.float64]
    falls: NDArray[np.int64]


def rates_of(
    sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard, below: Sequence[Sequence[xr.DataArray]] | None = None
) -> Rates:
    """Return the rates of all pieces from one set of motions a level, as they are."""
    grounds = [list(one) for one in (below or sets)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        runs = tp.stripes(
            list(PIECES),
            LAW,
            [list(one) for one in sets],
            hazard.levels,
            GIVEN,
            ("overturned",),
            scale=False,
            ground=grounds,
            screen=False,
        )
        curves = tp.fit_fragility(runs, intervals="bootstrap", replicates=REPLICATES, keep_replicates=True)
        rate = tp.annual_rate(curves, hazard.curve)
    samples = rate["rate_sample"].isel(model=0, drop=True).squeeze(drop=True).transpose("replicate", "block")
    fell = runs["overturned"].isel(model=0).transpose("block", ...).values.reshape(len(PIECES), -1)
    return Rates(rate["rate"].values.ravel(), samples.values, fell.sum(axis=1))


def ratios(one: Rates, other: Rates) -> NDArray[np.float64]:
    """Return the ratios of two sets of rates (piece,), NaN where too few runs fell for one."""
    enough = np.minimum(one.falls, other.falls) >= LEAST_FALLS
    return np.where(enough, one.values / np.where(enough, other.values, 1.0), np.nan)


def interval(one: Rates, other: Rates, piece: int) -> NDArray[np.float64]:
    """Return the 95 % interval of the ratio of two rates of a piece, by replicates."""
    found: NDArray[np.float64] = np.nanquantile(one.samples[:, piece] / other.samples[:, piece], (0.025, 0.975))
    return found


def ratio(one: Rates, other: Rates, piece: int) -> str:
    """Return the ratio of two rates of a piece with its 95 % interval, or how many runs fell where they are too few."""
    value = ratios(one, other)[piece]
    if not np.isfinite(value):
        few = min(one.falls[piece], other.falls[piece])
        return f"*{few} fall{'' if few == 1 else 's'}*"
    low, high = interval(one, other, piece)
    return f"{value:.2f}\u00a0({low:.2f}\u2060–\u2060{high:.2f})"


def span(values: NDArray[np.float64]) -> str:
    """Return the least and the greatest of some ratios, in words."""
    return f"{np.nanmin(values):.2f} to {np.nanmax(values):.2f}"


def holding_one(found: Sequence[tuple[Rates, Rates]]) -> tuple[int, int]:
    """Return in how many of the known ratios the interval holds 1, and how many are known."""
    known = [
        interval(one, other, i)
        for one, other in found
        for i, value in enumerate(ratios(one, other))
        if np.isfinite(value)
    ]
    return sum(bool(low <= 1.0 <= high) for low, high in known), len(known)


def choices(candidates: tp.motions.Candidates, hazard: Hazard) -> dict[str, Rates]:
    """Return the rates of a hazard by the way in which motions are chosen."""
    own = ONE.sample(NUMBER, seed=99)
    random = np.random.default_rng(SEED)
    some = [
        generator.sample(EACH, seed=SEED + i).isel(motion=np.sort(random.choice(EACH, A_CANDIDATE, replace=False)))
        for i, generator in enumerate(POOL)
    ]
    found = {
        "selected": [scaled(one, level) for one, level in _pairs(chosen(candidates, hazard), hazard)],
        "spectra alone": [scaled(one, level) for one, level in _pairs(chosen(candidates, hazard, True), hazard)],
        "one earthquake": [[tp.motions.scale_to(own, level, GIVEN)] for level in hazard.levels.tolist()],
        "all candidates": [
            [tp.motions.scale_to(one, level, GIVEN) for one in some] for level in hazard.levels.tolist()
        ],
    }
    return {name: rates_of(sets, hazard) for name, sets in found.items()}


def _pairs(selections: list[tp.motions.Selection], hazard: Hazard) -> list[tuple[tp.motions.Selection, float]]:
    return list(zip(selections, hazard.levels.tolist(), strict=True))


def seeds(candidates: tp.motions.Candidates, hazard: Hazard, base: Rates) -> str:
    """Return the ratios of the rates under other seeds of the selection to those of the page's, in words."""
    found = []
    for seed in OTHER_SEEDS:
        sets = [scaled(one, level) for one, level in _pairs(chosen(candidates, hazard, seed=seed), hazard)]
        found.append(ratios(rates_of(sets, hazard), base))
    return span(np.array(found))


def rounding(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard, base: Rates) -> str:
    """Return the ratios of the rates under motions that are stronger by a millionth to a base's, in words."""
    moved = [[one.copy(data=one.values * (1.0 + MILLIONTH)) for one in level] for level in sets]
    return span(ratios(rates_of(moved, hazard), base))


def one_earthquake(hazard: Hazard) -> str:
    """Return at which levels motions of one earthquake alone can be selected to agree with a hazard, in words."""
    alone = tp.motions.Candidates([ONE.sample(MANY, seed=SEED)])
    medians, sigmas = _curve_of(Site("one", ((6.5, 15e3, 1.0),)), GIVEN)
    agreeing = []
    for target, level in zip(hazard.wide, hazard.levels.tolist(), strict=True):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = tp.motions.select(alone, target, NUMBER, level=level, weights=WEIGHTS, seed=SEED)
        except ValueError:  # (too few of them reach the level)
            continue
        if found.consistent:
            agreeing.append((np.log(level) - np.log(medians[0])) / sigmas[0])
    if not agreeing:
        return f"none of {len(PERIODS)} stripes"
    return (
        f"{len(agreeing)} of {len(PERIODS)} stripes, the highest {max(agreeing):.1f} standard deviations above the "
        "median of that earthquake"
    )


def contents(candidates: tp.motions.Candidates) -> tuple[str, str]:
    """Return medians (PGV) of FEMA P-58's contents from selected motions and from those of one earthquake, scaled."""
    measures = [*SPECTRUM, "pgv", "d5_95"]
    target = tp.motions.expected_target(Scenario(STRONG.magnitude, STRONG.distance, VS30), "pgv", measures)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [
            tp.motions.select(candidates, target, NUMBER, level=level, weights=WEIGHTS, seed=SEED)
            for level in VELOCITIES
        ]
    agree = [(one, level) for one, level in zip(found, VELOCITIES, strict=True) if one.consistent]
    levels = [level for _, level in agree]
    own = STRONG.sample(NUMBER, seed=99)
    sets = [
        [scaled(one, level, "pgv") for one, level in agree],
        [[tp.motions.scale_to(own, level, "pgv")] for level in levels],
    ]
    known = fema_p58()
    items = [tp.catalogue[name] for name in known["block"].values.tolist()]
    medians, samples = [], []
    for one in sets:
        runs = tp.stripes(items, LAW, one, levels, "pgv", ("overturned",), scale=False, screen=False)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            curves = tp.fit_fragility(runs, intervals="bootstrap", replicates=REPLICATES, keep_replicates=True)
        medians.append(curves["median"].values.ravel())
        samples.append(curves["median_sample"].isel(model=0).transpose("replicate", "block").values)
    lines = ["| item | P-58 (m/s) | selected (m/s) | over P-58 | one earthquake over selected |", "|---|" + "---|" * 4]
    reached = medians[0] <= levels[-1]
    over = np.where(reached, medians[0] / known["median"].values, np.nan)
    scaled_over = np.where(reached, medians[1] / medians[0], np.nan)
    for i, item in enumerate(items):
        own = f"{known['median'].values[i]:.2f}"
        if not reached[i]:  # (NaN, too)
            lines.append(f"| {item.label} | {own} | above {levels[-1]:g} | – | – |")
            continue
        low, high = np.nanquantile(samples[0][:, i], (0.025, 0.975)) / medians[0][i]
        first = f"{over[i]:.2f}\u00a0({over[i] * low:.2f}\u2060–\u2060{over[i] * high:.2f})"
        low, high = np.nanquantile(samples[1][:, i] / samples[0][:, i], (0.025, 0.975))
        second = f"{scaled_over[i]:.2f}\u00a0({low:.2f}\u2060–\u2060{high:.2f})"
        lines.append(f"| {item.label} | {own} | {medians[0][i]:.2f} | {first} | {second} |")
    said = f"{span(over)} times the published ones, and {span(1.0 / scaled_over)} times those of the scaled motions"
    return "\n".join(lines), f"{said} ({len(levels)} of {len(VELOCITIES)} stripes agree and are used)"


def excess(hazard: Hazard) -> str:
    """Return the table of what motions of one earthquake, scaled to a rare level, have over the hazard there."""
    level = float(hazard.levels[RARE])
    target = tp.motions.expected_target(FURTHER.scenarios, GIVEN, list(COMPARED), weights=_density(FURTHER, level))
    given = target.at(level)
    own = tp.motions.scale_to(ONE.sample(NUMBER, seed=99), level, GIVEN)
    every = [tp.motions.scale_to(one.sample(A_CANDIDATE, seed=SEED + i), level, GIVEN) for i, one in enumerate(POOL)]
    lines = ["| over the hazard's median | " + " | ".join(NAMES) + " |", "|---|" + "---|" * len(NAMES)]
    for name, arrays in (("one earthquake", [own]), ("all candidates", every)):
        cells = []
        for measure in COMPARED:
            values = np.concatenate([tp.motions.measures(one, measure)[measure].values for one in arrays])
            wanted = given.medians[[one.label for one in given.measures].index(measure)]
            cells.append(f"{math.exp(np.log(values).mean()) / wanted:.2f}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


NAMES = ("PGA", "PGV", "Sa(0.2 s)", "Sa(2 s)", "D5–95")


def by_measure(site: Site, candidates: tp.motions.Candidates) -> xr.Dataset:
    """Return the rates of a site from stripes at levels of each measure; `stripes`: how many agree and are used.

    Measures of which fewer than LEAST_STRIPES agree are named in the attribute `left_out`.
    """
    runs, curves, names, kept, left = [], [], [], [], []
    for name, given in {GIVEN: GIVEN, **OTHERS}.items():
        hazard = hazard_of(site, given)
        agree = [(one, level) for one, level in _pairs(chosen(candidates, hazard), hazard) if one.consistent]
        if len(agree) < LEAST_STRIPES:
            left.append(f"{name} {len(agree)}")
            continue
        sets = [scaled(one, level, given) for one, level in agree]
        levels = [level for _, level in agree]
        runs.append(tp.stripes(list(PIECES), LAW, sets, levels, given, ("overturned",), scale=False, screen=False))
        curves.append(hazard.curve)
        names.append(name)
        kept.append(len(agree))
    found = rates_by_measure(runs, curves, replicates=REPLICATES).squeeze("model", drop=True)
    return found.assign(stripes=("measure", np.array(kept)), name=("measure", names)).assign_attrs(
        left_out=", ".join(left)
    )


def measures_table(found: xr.Dataset) -> str:
    """Return the table of a site: the rate by levels of GIVEN, and the ratios of those by other measures to it."""
    names = found["name"].values.tolist()
    lines = [f"| piece | {GIVEN}: per 1,000 years | {' | '.join(names[1:])} |", "|---|" + "---|" * len(names)]
    for i, piece in enumerate(PIECES):
        own = found.isel(block=i)
        rate, low, high = (1e3 * float(own[f"rate{end}"][0]) for end in ("", "_lower", "_upper"))
        cells = [f"{rate:.3g}\u00a0({low:.2g}\u2060–\u2060{high:.2g})"]
        for k in range(1, len(names)):
            value, low, high = (float(own[f"ratio{end}"][k]) for end in ("", "_lower", "_upper"))
            if not np.isfinite(value):
                cells.append("*no fall*")
                continue
            text = f"{value:.2f}\u00a0({low:.2f}\u2060–\u2060{high:.2f})"
            cells.append(f"[{text}]" if float(own["share_above"][k]) > MOST_ABOVE else text)
        lines.append(f"| {piece.label} | {' | '.join(cells)} |")
    kept = ", ".join(f"{name} {n}" for name, n in zip(names, found["stripes"].values, strict=True))
    left = f" Too few agree: {found.attrs['left_out']}." if found.attrs["left_out"] else ""
    return "\n".join([*lines, "", f"Stripes that agree with the hazard and are used: {kept}.{left}"])


STOREYS, PERIOD = 5, 0.8
STRENGTHS = (0.3, 0.15)
TOPS = {
    "bench, 8 Hz": tp.motions.Support(8.0, 0.03),
    "linear isolator, 2.5 s, 15 %": tp.motions.Isolator.linear(2.5, 0.15),
    "lead rubber, 2.5 s, Q 6 %": tp.motions.Isolator.bilinear(2.5, 0.06),
    "pendulum, R 1.5 m, μ 5 %": tp.motions.Isolator.pendulum(1.5, 0.05),
}


def buildings() -> dict[str, tp.motions.Building | tp.motions.YieldingBuilding]:
    """Return a frame of five storeys, elastic and with two strengths."""
    masses = np.full(STOREYS, 3e5)
    first = 2.0 * np.sin(np.pi / (2.0 * (2 * STOREYS + 1)))
    stiffnesses = masses * (2.0 * np.pi / PERIOD / first) ** 2
    found: dict[str, tp.motions.Building | tp.motions.YieldingBuilding] = {
        "elastic": tp.motions.Building.from_storeys(masses, stiffnesses, 0.05)
    }
    for strength in STRENGTHS:
        found[f"C_y = {strength:g}"] = tp.motions.Building.from_storeys(
            masses, stiffnesses, 0.05, yield_coefficient=strength
        )
    return found


def on_roof(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard) -> tuple[dict[str, Rates], dict[str, str]]:
    """Return the rates on the roof of each building, and the ductilities of the strongest and the middle level."""
    found, ductility = {}, {}
    for name, building in buildings().items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            moved = [[building.floor_motions(one, floors=[STOREYS]) for one in level] for level in sets]
        found[name] = rates_of(moved, hazard, sets)
        if name != "elastic":
            medians = [np.median(np.concatenate([one["ductility"].values for one in level])) for level in moved]
            fallen = np.concatenate([one["collapsed"].values for one in moved[-1]]).astype(bool).mean()
            ductility[name] = f"{medians[len(medians) // 2]:.1f}, {medians[-1]:.1f}; {100 * fallen:.0f}"
    return found, ductility


def on_supports(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard) -> tuple[dict[str, Rates], dict[str, str]]:
    """Return the rates on the ground and on supports of it, and how far the supports move at the rarest level, m."""
    found, ways = {"ground": rates_of(sets, hazard)}, {}
    for name, support in TOPS.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            moved = [[support.motions(one) for one in level] for level in sets]
        found[name] = rates_of(moved, hazard, sets)
        far = np.concatenate([np.atleast_1d(one["support_displacement"].values) for one in moved[-1]])
        ways[name] = f"{np.median(far):.2f}, {far.max():.2f}"
    return found, ways


def table(found: dict[str, Rates], base: str) -> str:
    """Return the table of a base's rates and the ratios of the others to them, piece by piece."""
    others = [name for name in found if name != base]
    lines = [f"| piece | {base}: per 1,000 years | {' | '.join(others)} |", "|---|" + "---|" * (len(others) + 1)]
    for i, piece in enumerate(PIECES):
        low, high = np.nanquantile(found[base].samples[:, i], (0.025, 0.975))
        rate = f"{1e3 * found[base].values[i]:.3g}\u00a0({1e3 * low:.2g}\u2060–\u2060{1e3 * high:.2g})"
        lines.append(
            f"| {piece.label} | {rate} | {' | '.join(ratio(found[name], found[base], i) for name in others)} |"
        )
    return "\n".join(lines)


def draw(found: dict[str, dict[str, Rates]], folder: Path) -> None:
    """Draw the ratios of the rates by choice to those of selected motions, a panel for each site."""
    figure, panels = plt.subplots(len(found), 1, figsize=(4.8, 8.4), sharex=True)
    styles = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"))
    for ax, (site, rates) in zip(panels, found.items(), strict=True):
        others = [name for name in rates if name != "selected"]
        for k, (name, (colour, marker)) in enumerate(zip(others, styles, strict=True)):
            for i in range(len(PIECES)):
                value = ratios(rates[name], rates["selected"])[i]
                if not np.isfinite(value):
                    continue
                low, high = interval(rates[name], rates["selected"], i)
                y = -i + 0.22 * (1 - k)
                ax.plot([low, high], [y, y], color=colour, lw=1.2)
                ax.plot(value, y, marker, color=colour, ms=5, mew=0, label=name if i == 0 else None)
        ax.axvline(1.0, color="0.3", lw=1.0)
        ax.set_xscale("log")
        ax.set_xticks([0.25, 0.5, 1, 2, 4, 8], ["¼", "½", "1", "2", "4", "8"])
        ax.minorticks_off()
        ax.set_title(site, fontsize=10)
        ax.set_yticks(
            [-i for i in range(len(PIECES))],
            [f"{piece.label} ({piece.h / piece.b:.1f})" for piece in PIECES],
            fontsize=9,
        )
        axes.grid(ax)
    panels[-1].set_xlabel("annual rate over that of selected motions")
    panels[-1].legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.4, -0.22), ncols=3)
    figure.tight_layout()
    figure.savefig(folder / "choices.png", dpi=120, bbox_inches="tight")
    plt.close(figure)


def agreement(selections: list[tp.motions.Selection]) -> str:
    """Return which stripes agree with the hazard, in words."""
    off = [f"{period:,.0f}" for one, period in zip(selections, PERIODS, strict=True) if not one.consistent]
    return f"all {len(PERIODS)} stripes" if not off else f"all stripes but those of {', '.join(off)} years"


def main() -> None:
    """Write the page and its figure."""
    folder = HERE / "consistency"
    folder.mkdir(exist_ok=True)
    candidates = pool()
    by_site, agrees, measures = {}, [], {}
    for site in SITES:
        hazard = hazard_of(site)
        selections = chosen(candidates, hazard)
        agrees.append(f"- *{site.name}*: {agreement(selections)} agree.")
        by_site[site.name] = choices(candidates, hazard)
        measures[site.name] = by_measure(site, candidates)
        if site is FURTHER:
            sets = [scaled(one, level) for one, level in _pairs(selections, hazard)]
            roof, ductility = on_roof(sets, hazard)
            tops, ways = on_supports(sets, hazard)
            other_seeds = seeds(candidates, hazard, by_site[site.name]["selected"])
            moved = rounding(sets, hazard, by_site[site.name]["selected"])
            over = excess(hazard)
            alone_agrees = one_earthquake(hazard)
            contents_table, contents_said = contents(candidates)
    draw(by_site, folder)
    choice = {name: [(rates[name], rates["selected"]) for rates in by_site.values()] for name in CHOICES}
    spans = {
        name.replace(" ", "_"): span(np.concatenate([ratios(*pair) for pair in pairs]))
        for name, pairs in choice.items()
    }
    alone, known_alone = holding_one(choice["spectra alone"])
    pairs = [one.isel(measure=slice(1, None)) for one in measures.values()]
    said = [(np.isfinite(one["ratio"]) & (one["share_above"] <= MOST_ABOVE)).values for one in pairs]
    lower, upper = (
        np.concatenate([one[f"ratio_{end}"].values[which] for one, which in zip(pairs, said, strict=True)])
        for end in ("lower", "upper")
    )
    known, agree = lower.size, int(((lower <= 1.0) & (upper >= 1.0)).sum())
    strong, weak = ([(roof[f"C_y = {one:g}"], roof["elastic"])] for one in STRENGTHS)
    benched = [(tops["bench, 8 Hz"], tops["ground"])]
    isolated = [(tops[name], tops["ground"]) for name in TOPS if "bench" not in name]
    text = (HERE / "consistency.md.in").read_text(encoding="utf-8")
    page = text.format(
        **spans,
        sites="\n".join(
            f"- *{site.name}*: "
            + "; ".join(f"M {m:g} at {1e-3 * d:g} km, {rate:g} a year" for m, d, rate in site.ruptures)
            for site in SITES
        ),
        agrees="\n".join(agrees),
        tables="\n\n".join(f"**{name}**\n\n{table(found, 'selected')}" for name, found in by_site.items()),
        measures="\n\n".join(f"**{name}**\n\n{measures_table(one)}" for name, one in measures.items()),
        alone_one=f"{alone} of {known_alone}",
        known=known,
        agree=agree,
        over=over,
        seeds=other_seeds,
        moved=moved,
        low=f"{np.median(lower):.2f}",
        high=f"{np.median(upper):.2f}",
        pieces="\n".join(
            f"| {piece.label} | {piece.width:.3g} × {piece.height:.3g} | {piece.h / piece.b:.1f} | {piece.R:.2f} |"
            for piece in PIECES
        ),
        strong=span(ratios(*strong[0])),
        strong_one="{} of {}".format(*holding_one(strong)),
        weak=span(ratios(*weak[0])),
        roof_table=table(roof, "elastic"),
        ductilities="\n".join(f"| {name} | {one} |" for name, one in ductility.items()),
        top_table=table(tops, "ground"),
        ways="\n".join(f"| {name} | {one} |" for name, one in ways.items()),
        bench=span(ratios(*benched[0])),
        bench_one="{} of {}".format(*holding_one(benched)),
        isolators=span(np.concatenate([ratios(*pair) for pair in isolated])),
        unknown=sum(int(np.isnan(ratios(*pair)).sum()) for pair in isolated),
        few=max(int(one.falls[np.isnan(ratios(one, other))].max(initial=0)) for one, other in isolated),
        many=MANY,
        alone_agrees=alone_agrees,
        contents=contents_table,
        contents_said=contents_said,
        isolated=3 * len(PIECES),
        runs=NUMBER * len(PERIODS),
        least=LEAST_FALLS,
        number=NUMBER,
        candidates=len(POOL) * EACH,
        levels=len(PERIODS),
        further=FURTHER.name,
    )
    (HERE / "consistency.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
