"""The page docs/consistency.md: annual rates by the choice of motions, on floors that yield, and on isolators."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import ndtr

import toppling as tp

from ...motions import Scenario
from ...motions.selection.target import Target
from .figures import DPI, log_ticks, looks, new, whiskers
from .page import Table, save, some, template, write, write_csv
from .tables import Interval, body, span

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
NUMBER = some(40, 20)
REPLICATES = some(1000)
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
"""Falls in the runs below which their number is given instead of a ratio."""
OTHER_SEEDS = (5, 6, 7)
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


def _curve_of(site: Site) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the medians of GIVEN in a site's earthquakes, and its standard deviations of the logarithm."""
    on = [tp.motions.expected_target(scenario, GIVEN, [*SPECTRUM, "pgv"]) for scenario in site.scenarios]
    # (epsilon is linear in the logarithm of the level)
    at_one, at_e = (np.array([target.at(level).epsilon for target in on]) for level in (1.0, math.e))
    sigmas = 1.0 / (at_e - at_one)
    return np.exp(-at_one * sigmas), sigmas


class Hazard(NamedTuple):
    """The hazard curve of a site, its levels, and the target of each level."""

    curve: tp.HazardCurve
    levels: NDArray[np.float64]
    wide: list[Target | tp.motions.Mixture]
    spectral: list[Target | tp.motions.Mixture]


def hazard_of(site: Site) -> Hazard:
    """Return the hazard of a site: lognormal motions of every earthquake."""
    medians, sigmas = _curve_of(site)

    def exceeded(levels: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(ndtr(np.log(medians / levels[:, None]) / sigmas) @ site.rates)

    grid = np.geomspace(1e-3, 100.0, 240)
    levels = np.exp(np.interp(np.log(PERIODS), -np.log(exceeded(grid)), np.log(grid)))
    # the weight of each earthquake at each level
    densities = np.exp(-0.5 * (np.log(levels[:, None] / medians) / sigmas) ** 2) / sigmas * site.rates
    wide, spectral = (
        [tp.motions.expected_target(site.scenarios, GIVEN, measures, weights=density) for density in densities]
        for measures in ([*SPECTRUM, "pgv", "d5_95"], SPECTRUM)
    )
    return Hazard(tp.HazardCurve(grid.tolist(), exceeded(grid).tolist(), GIVEN), levels, wide, spectral)


def chosen(
    candidates: tp.motions.Candidates, hazard: Hazard, spectra_alone: bool = False, seed: int = SEED
) -> list[tp.motions.Selection]:
    """Return the selection of every level."""
    targets = hazard.spectral if spectra_alone else hazard.wide
    weights = None if spectra_alone else WEIGHTS
    return [
        tp.motions.select(candidates, target, NUMBER, level=level, weights=weights, seed=seed)
        for target, level in zip(targets, hazard.levels.tolist(), strict=True)
    ]


class Rates(NamedTuple):
    """Annual rates (piece,) with replicates (replicate, piece), and the falls in the runs (piece,)."""

    values: NDArray[np.float64]
    samples: NDArray[np.float64]
    falls: NDArray[np.int64]

    def over(self, base: Rates) -> NDArray[np.float64]:
        """Return the ratios to other rates (piece,), NaN where too few runs fell for one."""
        enough = np.minimum(self.falls, base.falls) >= LEAST_FALLS
        return np.where(enough, self.values / np.where(enough, base.values, 1.0), np.nan)

    def interval(self, base: Rates, piece: int) -> Interval:
        """Return the ratio to another rate of a piece with its 95 % interval, by replicates."""
        low, high = np.nanquantile(self.samples[:, piece] / base.samples[:, piece], (0.025, 0.975))
        return Interval(float(self.over(base)[piece]), float(low), float(high))


def rates_of(
    sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard, below: Sequence[Sequence[xr.DataArray]] | None = None
) -> Rates:
    """Return the rates of all pieces from one set of motions a level, as they are."""
    runs = tp.stripes(
        list(PIECES), LAW, [list(level) for level in sets], hazard.levels, GIVEN, ("overturned",), scale=False,
        ground=[list(level) for level in below or sets], screen=False,
    )  # fmt: skip
    curves = tp.fit_fragility(runs, intervals="bootstrap", replicates=REPLICATES, keep_replicates=True)
    rate = tp.annual_rate(curves, hazard.curve)
    samples = rate["rate_sample"].isel(model=0, drop=True).squeeze(drop=True).transpose("replicate", "block")
    fell = runs["overturned"].isel(model=0).transpose("block", ...).values.reshape(len(PIECES), -1)
    return Rates(rate["rate"].values.ravel(), samples.values, fell.sum(axis=1))


def holding_one(pairs: Sequence[tuple[Rates, Rates]]) -> str:
    """Return in how many of the known ratios the interval holds 1, in words."""
    known = [
        rates.interval(base, int(i)) for rates, base in pairs for i in np.flatnonzero(np.isfinite(rates.over(base)))
    ]
    return f"{sum(interval.lower <= 1.0 <= interval.upper for interval in known)} of {len(known)}"


def at_levels(selections: Sequence[tp.motions.Selection], hazard: Hazard) -> list[list[xr.DataArray]]:
    """Return the motions of selections at their levels."""
    sets = [
        selection.motions if isinstance(selection.motions, list) else [selection.motions] for selection in selections
    ]
    return [
        [tp.motions.scale_to(motions, level, GIVEN) for motions in arrays]
        for arrays, level in zip(sets, hazard.levels.tolist(), strict=True)
    ]


def choices(candidates: tp.motions.Candidates, hazard: Hazard) -> dict[str, Rates]:
    """Return the rates of a hazard by the way in which motions are chosen."""
    single = ONE.sample(NUMBER, seed=99)
    random = np.random.default_rng(SEED)
    three = [
        generator.sample(EACH, seed=SEED + i).isel(motion=np.sort(random.choice(EACH, A_CANDIDATE, replace=False)))
        for i, generator in enumerate(POOL)
    ]
    levels = hazard.levels.tolist()
    stripes = {
        "selected": at_levels(chosen(candidates, hazard), hazard),
        "spectra alone": at_levels(chosen(candidates, hazard, True), hazard),
        "one earthquake": [[tp.motions.scale_to(single, level, GIVEN)] for level in levels],
        "all candidates": [[tp.motions.scale_to(motions, level, GIVEN) for motions in three] for level in levels],
    }
    return {name: rates_of(sets, hazard) for name, sets in stripes.items()}


def to(values: NDArray[np.float64]) -> str:
    """Return the least and the greatest of some ratios, in words."""
    return span(values, ".2f", " to ")


STOREYS, PERIOD = 5, 0.8
STRENGTHS = (0.3, 0.15)
TOPS: dict[str, tp.motions.Support | tp.motions.Isolator] = {
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
    frame = tp.motions.Building.from_storeys
    frames: dict[str, tp.motions.Building | tp.motions.YieldingBuilding] = {"elastic": frame(masses, stiffnesses, 0.05)}
    for strength in STRENGTHS:
        frames[f"C_y = {strength:g}"] = frame(masses, stiffnesses, 0.05, yielding=tp.motions.Yielding(strength))
    return frames


def moved_by(
    sets: Sequence[Sequence[xr.DataArray]], motions_on: Callable[[xr.DataArray], xr.DataArray]
) -> list[list[xr.DataArray]]:
    """Return the motions on a floor or a support."""
    return [[motions_on(motions) for motions in level] for level in sets]


def on_roof(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard) -> dict[str, Rates]:
    """Return the rates on the roof of each building."""
    by_building = {}
    for name, building in buildings().items():
        moved = moved_by(sets, lambda motions, on=building: on.floor_motions(motions, floors=[STOREYS]))  # type: ignore[misc]
        by_building[name] = rates_of(moved, hazard, sets)
    return by_building


def on_supports(
    sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard
) -> tuple[dict[str, Rates], dict[str, tuple[float, float]]]:
    """Return the rates on the ground and on its supports; median and maximum displacement at the rarest level, m."""
    by_support, ways = {"ground": rates_of(sets, hazard)}, {}
    for name, support in TOPS.items():
        moved = moved_by(sets, support.motions)
        by_support[name] = rates_of(moved, hazard, sets)
        far = np.concatenate([np.atleast_1d(array["support_displacement"].values) for array in moved[-1]])
        ways[name] = (float(np.median(far)), float(far.max()))
    return by_support, ways


def ratio(rates: Rates, base: Rates, piece: int) -> str:
    """Return the ratio to another rate of a piece with its interval, or the falls if they are too few."""
    few = min(rates.falls[piece], base.falls[piece])
    if few < LEAST_FALLS:
        return f"{few} fall{'' if few == 1 else 's'}"
    return f"{rates.interval(base, piece):.2f}"


def rates_rows(by_case: dict[str, Rates]) -> Iterator[tuple[str, ...]]:
    """Yield rates per 1,000 years of the first case and ratios of the others to it, piece by piece."""
    base, *compared = by_case.values()
    for i, piece in enumerate(PIECES):
        low, high = np.nanquantile(base.samples[:, i], (0.025, 0.975))
        rate = f"{1e3 * base.values[i]:.3g} ({1e3 * low:.2g}–{1e3 * high:.2g})"
        yield piece.label, rate, *(ratio(rates, base, i) for rates in compared)


def choices_figure(by_site: dict[str, dict[str, Rates]]) -> Figure:
    """Draw the ratios of the rates by choice to those of selected motions, a panel for each site."""
    figure, panels = new(8.4, len(by_site), 1, sharex=True)
    names = [f"{piece.label} ({piece.h / piece.b:.1f})" for piece in PIECES]
    for ax, (site, rates) in zip(panels, by_site.items(), strict=True):
        ratios = {name: [rates[name].interval(rates["selected"], i) for i in range(len(PIECES))] for name in CHOICES}
        ax.axvline(1.0, color="0.3", lw=1.0)
        whiskers(ax, names, ratios)
        log_ticks(ax, (0.25, 0.5, 1.0, 2.0, 4.0, 8.0))
        ax.set_title(site)
    panels[-1].set_xlabel("annual rate relative to selected motions")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def agreement(selections: list[tp.motions.Selection]) -> str:
    """Return the stripes that agree with the hazard, in words."""
    off = [f"{period:,.0f}" for selection, period in zip(selections, PERIODS, strict=True) if not selection.consistent]
    return f"Stripes of {', '.join(off)} years do not agree." if off else f"All {len(PERIODS)} stripes agree."


def main() -> None:
    """Write the page, its figure and its tables."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values, by_site, tables = computed()
    with looks("xtick.labelsize", "ytick.labelsize"):
        save("consistency", {"choices": choices_figure(by_site)}, DPI)
    for name, (headings, rows) in tables.items():
        write_csv("consistency", name, headings, rows)
    write("consistency", template("consistency").format(**values))


def computed() -> tuple[dict[str, object], dict[str, dict[str, Rates]], dict[str, Table]]:
    """Return every value of the page, the rates of each site by the choice of motions, and the tables."""
    candidates = tp.motions.Candidates([generator.sample(EACH, seed=SEED + i) for i, generator in enumerate(POOL)])
    by_site, agrees = {}, []
    for site in SITES:
        hazard = hazard_of(site)
        selections = chosen(candidates, hazard)
        ruptures = "; ".join(f"M {m:g} at {1e-3 * d:g} km, {rate:g} per year" for m, d, rate in site.ruptures)
        agrees.append(f"- *{site.name}*: {ruptures}. {agreement(selections)}")
        by_site[site.name] = choices(candidates, hazard)
        if site is FURTHER:
            further, sets, base = hazard, at_levels(selections, hazard), by_site[site.name]["selected"]
    # (the rates under other seeds of the selection)
    reseeded = (at_levels(chosen(candidates, further, seed=seed), further) for seed in OTHER_SEEDS)
    roof = on_roof(sets, further)
    tops, ways = on_supports(sets, further)
    choice = {name: [(rates[name], rates["selected"]) for rates in by_site.values()] for name in CHOICES}
    strong, weak = ((roof[f"C_y = {strength:g}"], roof["elastic"]) for strength in STRENGTHS)
    bench, *isolated = ((tops[name], tops["ground"]) for name in TOPS)
    over_ground = np.array([rates.over(base) for rates, base in isolated])
    far = np.array([ways[name] for name in TOPS][1:])
    tables: dict[str, Table] = {
        "choices": (
            ("site", "piece", "selected: per 1,000 years", *CHOICES),
            [(name, *row) for name, rates in by_site.items() for row in rates_rows(rates)],
        ),
        "roof": (("piece", "elastic: per 1,000 years", *[*roof][1:]), rates_rows(roof)),
        "supports": (("piece", "ground: per 1,000 years", *TOPS), rates_rows(tops)),
        "displacements": (
            ("support", "median (m)", "maximum (m)"),
            [(name, *(f"{way:.2f}" for way in row)) for name, row in ways.items()],
        ),
    }
    values = {
        **{
            name.replace(" ", "_"): to(np.concatenate([rates.over(selected) for rates, selected in pair]))
            for name, pair in choice.items()
        },
        "sites": "\n".join(agrees),
        "alone_one": holding_one(choice["spectra alone"]),
        "seeds": to(np.array([rates_of(motions, further).over(base) for motions in reseeded])),
        "further_table": body(
            (piece.label, f"{piece.width:.3g} × {piece.height:.3g}", f"{piece.h / piece.b:.1f}",
             *(ratio(*pair, i) for pair in (strong, weak, bench)))
            for i, piece in enumerate(PIECES)
        ),
        "strong": to(strong[0].over(strong[1])),
        "strong_one": holding_one([strong]),
        "weak": to(weak[0].over(weak[1])),
        "bench": to(bench[0].over(bench[1])),
        "bench_one": holding_one([bench]),
        "isolators": to(over_ground),
        "unknown": np.isnan(over_ground).sum(),
        "few": max(int(rates.falls[np.isnan(rates.over(ground))].max(initial=0)) for rates, ground in isolated),
        "isolated": over_ground.size,
        "far_median": to(far[:, 0]),
        "far_most": f"{far[:, 1].max():.2f}",
        "runs": NUMBER * len(PERIODS),
        "least": LEAST_FALLS,
        "number": NUMBER,
        "candidates": f"{len(POOL) * EACH:,}",
        "levels": len(PERIODS),
        "further": FURTHER.name,
    }  # fmt: skip
    return values, by_site, tables
