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
from toppling.fragility import rates_by_measure
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
SPECTRUM = [f"Sa({period:g})" for period in (0.3, 0.5, 0.75, 1.0, 1.5, 2.0)]
WEIGHTS = {"pgv": 3.0, "d5_95": 3.0}
POOL = [
    tp.motions.SiteBasedScenario(magnitude=magnitude, distance=distance, vs30=VS30, dt=0.01)
    for magnitude in (5.7, 6.1, 6.5, 7.0, 7.5)
    for distance in (8e3, 15e3, 30e3)
] + [tp.motions.NearFault(magnitude=magnitude, distance=10e3, vs30=VS30, dt=0.01) for magnitude in (6.5, 7.0)]
EACH = 80
A_CANDIDATE = 3
"""Motions of each simulated earthquake where all candidates are scaled."""
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


FURTHER = SITES[1]
"""The site at which floors and supports are compared."""


class Hazard(NamedTuple):
    """What a site's earthquakes give: the hazard curve of GIVEN, its levels, and the target of each level."""

    curve: tp.HazardCurve
    levels: NDArray[np.float64]
    wide: list[tp.motions.Mixture]
    spectral: list[tp.motions.Mixture]


def hazard_of(site: Site, given: str | tp.motions.Measure = GIVEN) -> Hazard:
    """Return the hazard of a site by a measure: lognormal motions of every earthquake."""
    on = [tp.motions.expected_target(one, given, [*SPECTRUM, "pgv"]) for one in site.scenarios]
    # (epsilon is linear in the logarithm of the level)
    at_one, at_e = (np.array([one.at(level).epsilon for one in on]) for level in (1.0, math.e))
    sigmas = 1.0 / (at_e - at_one)
    medians = np.exp(-at_one * sigmas)

    def exceeded(levels: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(ndtr(np.log(medians / levels[:, None]) / sigmas) @ site.rates)

    grid = np.geomspace(1e-3, 100.0, 240)
    levels = np.exp(np.interp(np.log(PERIODS), -np.log(exceeded(grid)), np.log(grid)))
    wide, spectral = [], []
    for level in levels:
        density = np.exp(-0.5 * (np.log(level / medians) / sigmas) ** 2) / sigmas * site.rates
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
    candidates: tp.motions.Candidates, hazard: Hazard, spectra_alone: bool = False
) -> list[tp.motions.Selection]:
    """Return the selection of every level."""
    targets = hazard.spectral if spectra_alone else hazard.wide
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [
            tp.motions.select(
                candidates, target, NUMBER, level=level, weights=None if spectra_alone else WEIGHTS, seed=SEED
            )
            for target, level in zip(targets, hazard.levels.tolist(), strict=True)
        ]


class Rates(NamedTuple):
    """Annual rates (piece,) with replicates (replicate, piece)."""

    values: NDArray[np.float64]
    samples: NDArray[np.float64]


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
    return Rates(rate["rate"].values.ravel(), samples.values)


def ratio(one: Rates, other: Rates, piece: int) -> str:
    """Return the ratio of two rates of a piece with its 95 % interval, by replicates."""
    value = one.values[piece] / other.values[piece]
    if not np.isfinite(value):
        return "no fall in the runs"
    low, high = np.nanquantile(one.samples[:, piece] / other.samples[:, piece], (0.025, 0.975))
    return f"{value:.2f} ({low:.2f}–{high:.2f})"


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


def by_measure(site: Site, candidates: tp.motions.Candidates) -> xr.Dataset:
    """Return the rates of a site from stripes at levels of each measure; `stripes`: how many agree and are used."""
    runs, curves, kept = [], [], []
    for given in (GIVEN, *OTHERS.values()):
        hazard = hazard_of(site, given)
        agree = [(one, level) for one, level in _pairs(chosen(candidates, hazard), hazard) if one.consistent]
        sets = [scaled(one, level, given) for one, level in agree]
        levels = [level for _, level in agree]
        runs.append(tp.stripes(list(PIECES), LAW, sets, levels, given, ("overturned",), scale=False, screen=False))
        curves.append(hazard.curve)
        kept.append(len(agree))
    found = rates_by_measure(runs, curves, replicates=REPLICATES).squeeze("model", drop=True)
    return found.assign(stripes=("measure", np.array(kept)))


def measures_table(found: xr.Dataset) -> str:
    """Return the table of a site: the rate by levels of GIVEN, and the ratios of those by other measures to it."""
    lines = [f"| piece | {GIVEN}: 1/1000 years | {' | '.join(OTHERS)} |", "|---|" + "---|" * (len(OTHERS) + 1)]
    for i, piece in enumerate(PIECES):
        own = found.isel(block=i)
        rate, low, high = (1e3 * float(own[f"rate{end}"][0]) for end in ("", "_lower", "_upper"))
        cells = [f"{rate:.3g} ({low:.2g}–{high:.2g})"]
        for k in range(1, len(OTHERS) + 1):
            value, low, high = (float(own[f"ratio{end}"][k]) for end in ("", "_lower", "_upper"))
            cells.append(f"{value:.2f} ({low:.2f}–{high:.2f})" if np.isfinite(value) else "no fall in the runs")
        lines.append(f"| {piece.label} | {' | '.join(cells)} |")
    kept = ", ".join(f"{name} {n}" for name, n in zip((GIVEN, *OTHERS), found["stripes"].values, strict=True))
    above = ", ".join(
        f"{name} {100.0 * float(share):.0f} %"
        for name, share in zip((GIVEN, *OTHERS), found["share_above"].max("block").values, strict=True)
    )
    return "\n".join([*lines, "", f"Stripes used: {kept}. Greatest share of a rate from above them: {above}."])


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


def on_supports(sets: Sequence[Sequence[xr.DataArray]], hazard: Hazard) -> dict[str, Rates]:
    """Return the rates on the ground and on supports of it."""
    found = {"ground": rates_of(sets, hazard)}
    for name, support in TOPS.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found[name] = rates_of([[support.motions(one) for one in level] for level in sets], hazard, sets)
    return found


def table(found: dict[str, Rates], base: str) -> str:
    """Return the table of a base's rates and the ratios of the others to them, piece by piece."""
    others = [name for name in found if name != base]
    lines = [f"| piece | {base}: 1/1000 years | {' | '.join(others)} |", "|---|" + "---|" * (len(others) + 1)]
    for i, piece in enumerate(PIECES):
        low, high = np.nanquantile(found[base].samples[:, i], (0.025, 0.975))
        rate = f"{1e3 * found[base].values[i]:.3g} ({1e3 * low:.2g}–{1e3 * high:.2g})"
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
                drawn = rates[name].samples[:, i] / rates["selected"].samples[:, i]
                if not np.isfinite(drawn).any():
                    continue
                low, high = np.nanquantile(drawn, (0.025, 0.975))
                y = -i + 0.22 * (1 - k)
                ax.plot([low, high], [y, y], color=colour, lw=1.2)
                value = rates[name].values[i] / rates["selected"].values[i]
                ax.plot(value, y, marker, color=colour, ms=5, mew=0, label=name if i == 0 else None)
        ax.axvline(1.0, color="0.3", lw=1.0)
        ax.set_xscale("log")
        ax.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
        ax.minorticks_off()
        ax.set_title(site, fontsize=10)
        ax.set_yticks([-i for i in range(len(PIECES))], [piece.label for piece in PIECES], fontsize=9)
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
            tops = on_supports(sets, hazard)
    draw(by_site, folder)
    every = {
        name: np.concatenate([rates[name].values / rates["selected"].values for rates in by_site.values()])
        for name in ("spectra alone", "one earthquake", "all candidates")
    }
    pairs = [one.isel(measure=slice(1, None)) for one in measures.values()]
    known = sum(int(np.isfinite(one["ratio"]).sum()) for one in pairs)
    agree = sum(int(((one["ratio_lower"] <= 1.0) & (one["ratio_upper"] >= 1.0)).sum()) for one in pairs)
    spans = {name.replace(" ", "_"): f"{np.nanmin(one):.2f} to {np.nanmax(one):.2f}" for name, one in every.items()}
    weak = [roof[name].values / roof["elastic"].values for name in roof if name != "elastic"]
    isolated = {name: tops[name].values / tops["ground"].values for name in TOPS}
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
        known=known,
        agree=agree,
        strong=f"{np.nanmin(weak[0]):.2f} to {np.nanmax(weak[0]):.2f}",
        weak=f"{np.nanmin(weak[1]):.2f} to {np.nanmax(weak[1]):.2f}",
        roof_table=table(roof, "elastic"),
        ductilities="\n".join(f"| {name} | {one} |" for name, one in ductility.items()),
        top_table=table(tops, "ground"),
        bench=f"{np.nanmin(isolated['bench, 8 Hz']):.2f} to {np.nanmax(isolated['bench, 8 Hz']):.2f}",
        isolators=f"{min(np.nanmin(one) for name, one in isolated.items() if 'bench' not in name):.2f} to "
        f"{max(np.nanmax(one) for name, one in isolated.items() if 'bench' not in name):.2f}",
        number=NUMBER,
        candidates=len(POOL) * EACH,
        levels=len(PERIODS),
        further=FURTHER.name,
    )
    (HERE / "consistency.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
