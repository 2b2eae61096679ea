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

from ...fragility.curves.published import fema_p58
from ...motions import Scenario
from ...motions.selection.target import Target
from ...studies.plots import axes
from ..selection.rates import rates_by_measure
from .page import save, some, template, write
from .tables import Interval, body, span, table

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
MANY = some(400)
"""Motions of one earthquake that are selected from by themselves."""
OTHER_SEEDS = (5, 6, 7)
COMPARED = ("pga", "pgv", "Sa(0.2)", "Sa(2.0)", "d5_95")
"""Measures of scaled motions that are held against the hazard's."""
RARE = 7
"""The stripe at which that is done: 2475 years."""
OTHERS: dict[str, str | tp.motions.Measure] = {
    "PGV": "pgv",
    "average Sa": tp.motions.AvgSa([0.3, 0.5, 0.75, 1.0, 1.5, 2.0]),
}
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
    """The hazard curve of a site, its levels, and the target of each level."""

    curve: tp.HazardCurve
    levels: NDArray[np.float64]
    wide: list[Target | tp.motions.Mixture]
    spectral: list[Target | tp.motions.Mixture]


def hazard_of(site: Site, given: str | tp.motions.Measure = GIVEN) -> Hazard:
    """Return the hazard of a site by a measure: lognormal motions of every earthquake."""
    medians, sigmas = _curve_of(site, given)

    def exceeded(levels: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(ndtr(np.log(medians / levels[:, None]) / sigmas) @ site.rates)

    grid = np.geomspace(1e-3, 100.0, 240)
    levels = np.exp(np.interp(np.log(PERIODS), -np.log(exceeded(grid)), np.log(grid)))
    densities = [_density(site, level, given) for level in levels.tolist()]
    wide, spectral = (
        [tp.motions.expected_target(site.scenarios, given, measures, weights=density) for density in densities]
        for measures in ([*SPECTRUM, "pgv", "d5_95"], SPECTRUM)
    )
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


def whole(found: Interval, first: str = ".2f", ends: str = ".2f") -> str:
    """Return a value with its interval, which no line breaks."""
    return f"{found.value:{first}}\u00a0({found.lower:{ends}}\u2060–\u2060{found.upper:{ends}})"


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


def holding_one(found: Sequence[tuple[Rates, Rates]]) -> str:
    """Return in how many of the known ratios the interval holds 1, in words."""
    known = [
        rates.interval(base, int(i)) for rates, base in found for i in np.flatnonzero(np.isfinite(rates.over(base)))
    ]
    return f"{sum(one.lower <= 1.0 <= one.upper for one in known)} of {len(known)}"


def at_levels(
    selections: Sequence[tp.motions.Selection], levels: Sequence[float], given: str | tp.motions.Measure = GIVEN
) -> list[list[xr.DataArray]]:
    """Return the motions of selections at their levels."""
    return [scaled(selection, level, given) for selection, level in zip(selections, levels, strict=True)]


def choices(candidates: tp.motions.Candidates, hazard: Hazard) -> dict[str, Rates]:
    """Return the rates of a hazard by the way in which motions are chosen."""
    own = ONE.sample(NUMBER, seed=99)
    random = np.random.default_rng(SEED)
    three = [
        generator.sample(EACH, seed=SEED + i).isel(motion=np.sort(random.choice(EACH, A_CANDIDATE, replace=False)))
        for i, generator in enumerate(POOL)
    ]
    levels = hazard.levels.tolist()
    found = {
        "selected": at_levels(chosen(candidates, hazard), levels),
        "spectra alone": at_levels(chosen(candidates, hazard, True), levels),
        "one earthquake": [[tp.motions.scale_to(own, level, GIVEN)] for level in levels],
        "all candidates": [[tp.motions.scale_to(motions, level, GIVEN) for motions in three] for level in levels],
    }
    return {name: rates_of(sets, hazard) for name, sets in found.items()}


def seeds(candidates: tp.motions.Candidates, hazard: Hazard, base: Rates) -> str:
    """Return the ratios of the rates under other seeds of the selection to those of the page's, in words."""
    sets = (at_levels(chosen(candidates, hazard, seed=seed), hazard.levels.tolist()) for seed in OTHER_SEEDS)
    return to(np.array([rates_of(motions, hazard).over(base) for motions in sets]))


def rounding(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard, base: Rates) -> str:
    """Return the ratios of the rates under motions that are stronger by a millionth to a base's, in words."""
    moved = [[motions.copy(data=motions.values * (1.0 + MILLIONTH)) for motions in level] for level in sets]
    return to(rates_of(moved, hazard).over(base))


def to(values: NDArray[np.float64]) -> str:
    """Return the least and the greatest of some ratios, in words."""
    return span(values, ".2f", " to ")


def one_earthquake(hazard: Hazard) -> str:
    """Return at which levels motions of one earthquake alone can be selected to agree with a hazard, in words."""
    alone = tp.motions.Candidates([ONE.sample(MANY, seed=SEED)])
    medians, sigmas = _curve_of(Site("one", ((6.5, 15e3, 1.0),)), GIVEN)
    agreeing = []
    for target, level in zip(hazard.wide, hazard.levels.tolist(), strict=True):
        try:
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
    found = {
        level: tp.motions.select(candidates, target, NUMBER, level=level, weights=WEIGHTS, seed=SEED)
        for level in VELOCITIES
    }
    agree = {level: selection for level, selection in found.items() if selection.consistent}
    levels = [*agree]
    own = STRONG.sample(NUMBER, seed=99)
    known = fema_p58()
    items = [tp.catalogue[name] for name in known["block"].values.tolist()]
    medians, samples = [], []
    for sets in (
        at_levels([*agree.values()], levels, "pgv"),
        [[tp.motions.scale_to(own, level, "pgv")] for level in levels],
    ):
        runs = tp.stripes(items, LAW, sets, levels, "pgv", ("overturned",), scale=False, screen=False)
        curves = tp.fit_fragility(runs, intervals="bootstrap", replicates=REPLICATES, keep_replicates=True)
        medians.append(curves["median"].values.ravel())
        samples.append(curves["median_sample"].isel(model=0).transpose("replicate", "block").values)
    published = known["median"].values
    reached = medians[0] <= levels[-1]
    over = np.where(reached, medians[0] / published, np.nan)
    scaled_over = np.where(reached, medians[1] / medians[0], np.nan)
    rows: list[tuple[str, ...]] = []
    for i, item in enumerate(items):
        if not reached[i]:  # (NaN, too)
            rows.append((item.label, f"{published[i]:.2f}", f"above {levels[-1]:g}", "–", "–"))
            continue
        ends = over[i] * np.nanquantile(samples[0][:, i], (0.025, 0.975)) / medians[0][i]
        others = np.nanquantile(samples[1][:, i] / samples[0][:, i], (0.025, 0.975))
        cells = (whole(Interval(over[i], *ends)), whole(Interval(scaled_over[i], *others)))
        rows.append((item.label, f"{published[i]:.2f}", f"{medians[0][i]:.2f}", *cells))
    said = f"{to(over)} times the published medians, and {to(1.0 / scaled_over)} times the medians of scaled motions"
    return body(rows), f"{said} ({len(levels)} of {len(VELOCITIES)} stripes agree and are used)"


def excess(hazard: Hazard) -> Iterator[tuple[str, ...]]:
    """Yield measures of one earthquake's and all candidates' motions at a rare level, over the hazard's medians."""
    level = float(hazard.levels[RARE])
    target = tp.motions.expected_target(FURTHER.scenarios, GIVEN, list(COMPARED), weights=_density(FURTHER, level))
    given = target.at(level)
    wanted = dict(zip((measure.label for measure in given.measures), given.medians, strict=True))
    own = tp.motions.scale_to(ONE.sample(NUMBER, seed=99), level, GIVEN)
    every = [tp.motions.scale_to(one.sample(A_CANDIDATE, seed=SEED + i), level, GIVEN) for i, one in enumerate(POOL)]
    for name, arrays in (("one earthquake", [own]), ("all candidates", every)):
        values = (
            np.concatenate([tp.motions.measures(motions, measure)[measure].values for motions in arrays])
            for measure in COMPARED
        )
        middles = (math.exp(np.log(of_measure).mean()) for of_measure in values)
        yield name, *(f"{middle / wanted[measure]:.2f}" for middle, measure in zip(middles, COMPARED, strict=True))


def by_measure(site: Site, candidates: tp.motions.Candidates) -> xr.Dataset:
    """Return the rates of a site from stripes at levels of each measure; `stripes`: how many agree and are used.

    Measures of which fewer than LEAST_STRIPES agree are named in the attribute `left_out`.
    """
    runs, curves, kept, left = [], [], {}, []
    for name, given in [(GIVEN, GIVEN), *OTHERS.items()]:
        hazard = hazard_of(site, given)
        selections = dict(zip(hazard.levels.tolist(), chosen(candidates, hazard), strict=True))
        agree = {level: selection for level, selection in selections.items() if selection.consistent}
        if len(agree) < LEAST_STRIPES:
            left.append(f"{name} {len(agree)}")
            continue
        levels = [*agree]
        sets = at_levels([*agree.values()], levels, given)
        runs.append(tp.stripes(list(PIECES), LAW, sets, levels, given, ("overturned",), scale=False, screen=False))
        curves.append(hazard.curve)
        kept[name] = len(agree)
    found = rates_by_measure(runs, curves, replicates=REPLICATES).squeeze("model", drop=True)
    return found.assign(stripes=("measure", [*kept.values()]), name=("measure", [*kept])).assign_attrs(
        left_out=", ".join(left)
    )


def measures_table(found: xr.Dataset) -> str:
    """Return the table of a site: the rate by levels of GIVEN, and the ratios of those by other measures to it."""
    names = found["name"].values.tolist()
    rows = []
    for i, piece in enumerate(PIECES):
        own = found.isel(block=i)

        def of(what: str, k: int, own: xr.Dataset = own) -> Interval:
            return Interval(*(float(own[f"{what}{end}"][k]) for end in ("", "_lower", "_upper")))

        cells = [whole(of("rate", 0).times(1e3), ".3g", ".2g")]
        for k in range(1, len(names)):
            ratio = of("ratio", k)
            text = whole(ratio) if np.isfinite(ratio.value) else "*no fall*"
            beyond = np.isfinite(ratio.value) and float(own["share_above"][k]) > MOST_ABOVE
            cells.append(f"[{text}]" if beyond else text)
        rows.append((piece.label, *cells))
    kept = ", ".join(f"{name} {n}" for name, n in zip(names, found["stripes"].values, strict=True))
    left = f" Too few agree: {found.attrs['left_out']}." if found.attrs["left_out"] else ""
    head = ("piece", f"{GIVEN}: per 1,000 years", *names[1:])
    return f"{table(head, rows)}\n\nStripes that agree with the hazard and are used: {kept}.{left}"


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
    found: dict[str, tp.motions.Building | tp.motions.YieldingBuilding] = {"elastic": frame(masses, stiffnesses, 0.05)}
    for strength in STRENGTHS:
        found[f"C_y = {strength:g}"] = frame(masses, stiffnesses, 0.05, yield_coefficient=strength)
    return found


def moved_by(
    sets: Sequence[Sequence[xr.DataArray]], motions_on: Callable[[xr.DataArray], xr.DataArray]
) -> list[list[xr.DataArray]]:
    """Return the motions on a floor or a support."""
    return [[motions_on(motions) for motions in level] for level in sets]


def on_roof(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard) -> tuple[dict[str, Rates], list[tuple[str, str]]]:
    """Return the rates on the roof of each building, and the ductilities of the strongest and the middle level."""
    found, ductility = {}, []
    for name, building in buildings().items():
        moved = moved_by(sets, lambda motions, on=building: on.floor_motions(motions, floors=[STOREYS]))  # type: ignore[misc]
        found[name] = rates_of(moved, hazard, sets)
        if name != "elastic":
            medians = [np.median(np.concatenate([one["ductility"].values for one in level])) for level in moved]
            fallen = np.concatenate([one["collapsed"].values for one in moved[-1]]).astype(bool).mean()
            ductility.append((name, f"{medians[len(medians) // 2]:.1f}, {medians[-1]:.1f}; {100 * fallen:.0f}"))
    return found, ductility


def on_supports(
    sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard
) -> tuple[dict[str, Rates], list[tuple[str, str]]]:
    """Return the rates on the ground and on supports of it, and how far the supports move at the rarest level, m."""
    found, ways = {"ground": rates_of(sets, hazard)}, []
    for name, support in TOPS.items():
        moved = moved_by(sets, support.motions)
        found[name] = rates_of(moved, hazard, sets)
        far = np.concatenate([np.atleast_1d(one["support_displacement"].values) for one in moved[-1]])
        ways.append((name, f"{np.median(far):.2f}, {far.max():.2f}"))
    return found, ways


def rates_table(found: dict[str, Rates], base: str) -> str:
    """Return the table of a base's rates and the ratios of the others to them, piece by piece."""
    others = [rates for name, rates in found.items() if name != base]
    own = found[base]
    rows = []
    for i, piece in enumerate(PIECES):
        rate = Interval(own.values[i], *np.nanquantile(own.samples[:, i], (0.025, 0.975)))
        cells = [whole(rate.times(1e3), ".3g", ".2g")]
        for rates in others:
            few = min(rates.falls[i], own.falls[i])
            enough = few >= LEAST_FALLS
            cells.append(whole(rates.interval(own, i)) if enough else f"*{few} fall{'' if few == 1 else 's'}*")
        rows.append((piece.label, *cells))
    return table(("piece", f"{base}: per 1,000 years", *(name for name in found if name != base)), rows)


def choices_figure(found: dict[str, dict[str, Rates]]) -> Figure:
    """Draw the ratios of the rates by choice to those of selected motions, a panel for each site."""
    figure = Figure(figsize=(4.8, 8.4))
    panels = figure.subplots(len(found), 1, sharex=True)
    styles = dict(zip(CHOICES, (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^")), strict=True))
    for ax, (site, rates) in zip(panels, found.items(), strict=True):
        for k, (name, (colour, marker)) in enumerate(styles.items()):
            for i in range(len(PIECES)):
                ratio = rates[name].interval(rates["selected"], i)
                if not np.isfinite(ratio.value):
                    continue
                y = -i + 0.22 * (1 - k)
                ax.plot([ratio.lower, ratio.upper], [y, y], color=colour, lw=1.2)
                ax.plot(ratio.value, y, marker, color=colour, ms=5, mew=0, label=name if i == 0 else None)
        ax.axvline(1.0, color="0.3", lw=1.0)
        ax.set_xscale("log")
        ax.set_xticks([0.25, 0.5, 1, 2, 4, 8], ["¼", "½", "1", "2", "4", "8"])
        ax.minorticks_off()
        ax.set_title(site, fontsize=10)
        names = [f"{piece.label} ({piece.h / piece.b:.1f})" for piece in PIECES]
        ax.set_yticks([-i for i in range(len(PIECES))], names, fontsize=9)
        axes.grid(ax)
    panels[-1].set_xlabel("annual rate over that of selected motions")
    panels[-1].legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.4, -0.22), ncols=3)
    figure.tight_layout()
    return figure


def agreement(selections: list[tp.motions.Selection]) -> str:
    """Return which stripes agree with the hazard, in words."""
    off = [f"{period:,.0f}" for one, period in zip(selections, PERIODS, strict=True) if not one.consistent]
    return f"all {len(PERIODS)} stripes" if not off else f"all stripes but those of {', '.join(off)} years"


def main() -> None:
    """Write the page and its figure."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values, by_site = computed()
        save("consistency", {"choices": choices_figure(by_site)}, 120, bbox_inches="tight")
    write("consistency", template("consistency").format(**values))


def computed() -> tuple[dict[str, object], dict[str, dict[str, Rates]]]:
    """Return every value of the page, and the rates of each site by the choice of motions."""
    candidates = pool()
    by_site, agrees, measures = {}, [], {}
    for site in SITES:
        hazard = hazard_of(site)
        selections = chosen(candidates, hazard)
        agrees.append(f"- *{site.name}*: {agreement(selections)} agree.")
        by_site[site.name] = choices(candidates, hazard)
        measures[site.name] = by_measure(site, candidates)
        if site is FURTHER:
            further, sets, base = hazard, at_levels(selections, hazard.levels.tolist()), by_site[site.name]["selected"]
    roof, ductility = on_roof(sets, further)
    tops, ways = on_supports(sets, further)
    contents_table, contents_said = contents(candidates)
    choice = {name: [(rates[name], rates["selected"]) for rates in by_site.values()] for name in CHOICES}
    pairs = [rates.isel(measure=slice(1, None)) for rates in measures.values()]
    said = [(np.isfinite(one["ratio"].values) & (one["share_above"].values <= MOST_ABOVE)) for one in pairs]
    lower, upper = (
        np.concatenate([one[f"ratio_{end}"].values[which] for one, which in zip(pairs, said, strict=True)])
        for end in ("lower", "upper")
    )
    strong, weak = ((roof[f"C_y = {strength:g}"], roof["elastic"]) for strength in STRENGTHS)
    bench, *isolated = ((tops[name], tops["ground"]) for name in TOPS)
    over_ground = np.array([rates.over(base) for rates, base in isolated])
    return {
        **{
            name.replace(" ", "_"): to(np.concatenate([rates.over(selected) for rates, selected in pair]))
            for name, pair in choice.items()
        },
        "sites": "\n".join(
            f"- *{site.name}*: "
            + "; ".join(f"M {m:g} at {1e-3 * d:g} km, {rate:g} a year" for m, d, rate in site.ruptures)
            for site in SITES
        ),
        "agrees": "\n".join(agrees),
        "tables": "\n\n".join(f"**{name}**\n\n{rates_table(rates, 'selected')}" for name, rates in by_site.items()),
        "measures": "\n\n".join(f"**{name}**\n\n{measures_table(rates)}" for name, rates in measures.items()),
        "alone_one": holding_one(choice["spectra alone"]),
        "known": lower.size,
        "agree": ((lower <= 1.0) & (upper >= 1.0)).sum(),
        "over": body(excess(further)),
        "seeds": seeds(candidates, further, base),
        "moved": rounding(sets, further, base),
        "low": np.median(lower),
        "high": np.median(upper),
        "pieces": body(
            (one.label, f"{one.width:.3g} × {one.height:.3g}", f"{one.h / one.b:.1f}", f"{one.R:.2f}") for one in PIECES
        ),
        "strong": to(strong[0].over(strong[1])),
        "strong_one": holding_one([strong]),
        "weak": to(weak[0].over(weak[1])),
        "roof_table": rates_table(roof, "elastic"),
        "ductilities": body(ductility),
        "top_table": rates_table(tops, "ground"),
        "ways": body(ways),
        "bench": to(bench[0].over(bench[1])),
        "bench_one": holding_one([bench]),
        "isolators": to(over_ground),
        "unknown": np.isnan(over_ground).sum(),
        "few": max(int(rates.falls[np.isnan(rates.over(ground))].max(initial=0)) for rates, ground in isolated),
        "many": MANY,
        "alone_agrees": one_earthquake(further),
        "contents": contents_table,
        "contents_said": contents_said,
        "isolated": over_ground.size,
        "runs": NUMBER * len(PERIODS),
        "least": LEAST_FALLS,
        "number": NUMBER,
        "candidates": len(POOL) * EACH,
        "levels": len(PERIODS),
        "further": FURTHER.name,
    }, by_site
