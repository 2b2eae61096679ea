"""The page docs/p58.md and its figure: FEMA P-58's overturning contents and their published medians.

It takes the results of studies/examples/fema_p58.toml, and uncertain inputs of the blocks for shares of the dispersion.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import toppling as tp

from ...fragility import (
    Beta,
    Lognormal,
    Normal,
    RandomInputs,
    Uniform,
    capacity_variance_shares,
    median_ratio,
    uncertain_ida,
)
from ...fragility.curves import published
from ...studies.plots.axes import COLOURS, MARKERS
from .figures import bare, log_ticks
from .page import results, save, some, study, template, write, write_csv
from .tables import body, per_cent, span

REFERENCE = "housner"

# Uncertain properties of a piece: its contents, the floor and the spread of its mass.
INPUTS = RandomInputs(
    {
        "restitution_factor": Beta(8.0, 2.0, 0.7, 1.0),
        "alpha_factor": Normal(1.0, 0.08, 0.75, 1.25),
        "R_factor": Lognormal(1.0, 0.08, 0.75, 1.3),
        "inertia_factor": Uniform(1.25, 1.4),
    }
)
SAMPLES = some(24, 4)
ITEMS = ("bookcase-2-shelf", "bookcase-5-shelf", "file-vertical-4-drawer", "file-lateral-4-drawer")
LAWS = (tp.HousnerImpact(geometry="bilinear"), tp.EnergyConsistent(), tp.DiscreteDamping())


def main() -> None:
    """Write the page and its figure."""
    stored = results("fema_p58")
    runs = stored.rename(motion_floor="floor_of").drop_vars("floor").rename(floor_of="floor")
    runs = runs[["overturned"]].assign_attrs(im="pgv", design="ida", configuration=stored.attrs["configuration"])
    curves = tp.fit_fragility(runs, keep_replicates=True)
    known = published.fema_p58()
    japanese = published.japanese([tp.catalogue[str(block)] for block in stored["block"].values], "velocity")
    save("p58", {"medians": medians_figure(of_law(curves, REFERENCE), known, japanese)}, 130)
    shares = uncertain()
    ratios = of_law(median_ratio(curves, known), REFERENCE)
    floors = [str(floor) for floor in ratios["floor"].values]
    write_csv("p58", "medians", ("item", "P-58 (m/s)", "V50 (m/s)", *floors), ratio_rows(ratios, known, japanese))
    write_csv("p58", "dispersion", ("case", "dispersion", *PARTS, "capacities known"), share_rows(shares))
    heads = ("friction that uplift needs", "runs that need more than 1 while rocking", "undecided runs", "model")
    write_csv("p58", "friction", ("item", *heads), validity_rows(stored))
    write("p58", page(stored, curves, known, shares))


def size_regression(curves: xr.Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit ln(median) = a + b ln(width) + c ln(height) by least squares: b, c and the residuals' root mean square.

    Each (floor,), of the curves of one law.
    """
    terms = np.stack([np.ones(curves.sizes["block"]), np.log(curves["width"]), np.log(curves["height"])], axis=1)
    logs = np.log(curves["median"].transpose("block", "floor").values)
    coefficients = np.linalg.pinv(terms) @ logs
    scatter = np.sqrt(((logs - terms @ coefficients) ** 2).mean(axis=0))
    return coefficients[1], coefficients[2], scatter


def of_law(dataset: xr.Dataset, law: str) -> xr.Dataset:
    """Return the part of one law."""
    return dataset.isel(model=int(np.flatnonzero(dataset["law"].values == law)[0]))


def uncertain() -> dict[str, xr.Dataset]:
    """Return the dispersion of ln capacity and its shares, for items on the ground and on the roof of a building."""
    design: Any = study("fema_p58").design  # type: ignore[attr-defined]
    shares = {}
    for label, place in {"ground": "ground", "1 s floor 8": "roof"}.items():
        array = next(moved for moved in design.motions if label in [str(floor) for floor in moved["floor"].values])
        motions = array.sel(floor=label).isel(motion=slice(some(60)))
        for item in ITEMS:
            runs = uncertain_ida(
                INPUTS,
                tp.catalogue[item],
                LAWS,
                motions,
                design.levels,
                "pgv",
                "overturned",
                samples=INPUTS.sample(SAMPLES, 1),
            )
            shares[f"{item}, {place}"] = capacity_variance_shares(runs)
    return shares


def medians_figure(curves: xr.Dataset, known: xr.Dataset, japanese: xr.Dataset) -> Figure:
    """Draw our medians on every floor, the published one with its dispersion, and the Japanese one."""
    blocks, floors = ([str(label) for label in curves[name].values] for name in ("block", "floor"))
    places = [
        (floor, "black" if k == 0 else COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)])
        for k, floor in enumerate(floors)
    ]
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    ax = figure.subplots()
    dotted = (0, (2, 2))
    for i, block in enumerate(blocks):
        median, beta = (float(known[name].sel(block=block)) for name in ("median", "dispersion"))
        v50 = float(japanese["median"].sel(block=block))
        height = [i - 0.4, i + 0.4]
        ax.fill_betweenx(height, median * np.exp(-beta), median * np.exp(beta), color="0.9", lw=0.0)
        ax.plot([median, median], height, color="black", lw=2.0)
        ax.plot([v50, v50], height, color="black", lw=1.2, ls=dotted)
        for k, (floor, colour, marker) in enumerate(places):
            curve = curves.sel(block=block, floor=floor)
            y = i + 0.32 * (2.0 * k / max(1, len(floors) - 1) - 1.0)
            value, low, high = (curve[f"median{end}"].item() for end in ("", "_lower", "_upper"))
            ax.errorbar(value, y, xerr=[[value - low], [high - value]], fmt=marker, ms=4.5, lw=1.1, color=colour)
    ax.plot([], [], color="black", lw=2.0, label="FEMA P-58, median (band: ± its dispersion)")
    ax.plot([], [], color="black", lw=1.2, ls=dotted, label="Japanese velocity criterion")
    for floor, colour, marker in places:
        ax.plot([], [], marker, ms=5.0, color=colour, label=floor)
    ax.set_yticks(range(len(blocks)), blocks)
    ax.set_ylim(len(blocks) - 0.5, -0.5)
    log_ticks(ax, (0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0))
    ax.set_xlabel("median peak floor velocity (m/s)")
    ax.set_title("Overturning medians, Housner's block in exact geometry, with 95 % intervals", fontsize=11)
    bare(ax, "x")
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    return figure


PARTS = ("motion", "law", "parameters", "interactions")
"""Parts of the variance of ln capacity."""


def total(shares: xr.Dataset) -> float:
    """Return the dispersion of ln capacity."""
    return float(np.sqrt(shares["total_variance"].item()))


def parts_of(shares: xr.Dataset) -> list[float]:
    """Return the shares of the variance of ln capacity, in the order of PARTS."""
    parts = [float(shares["share"].sel(component=name)) for name in ("motion", "model", "sample")]
    return [*parts, 1.0 - sum(parts)]


def page(stored: xr.Dataset, curves: xr.Dataset, known: xr.Dataset, shares: dict[str, xr.Dataset]) -> str:
    """Return the page: its template with every number from the datasets."""
    ratios = median_ratio(curves, known)
    main_law = of_law(ratios, REFERENCE)
    values, outcomes = main_law["ratio"].values, main_law["verdict"].values
    by_law = (
        (law, span(of_law(ratios, law)["ratio"].values), span(of_law(curves, law)["dispersion"].values))
        for law in dict.fromkeys(str(law) for law in curves["law"].values)
    )
    width, height, scatter = size_regression(of_law(curves, REFERENCE))
    return template("p58").format(
        motions=stored.sizes["motion"] // main_law.sizes["floor"],
        least=main_law["ratio"].mean("block").idxmin("floor").item(),
        ratios=span(values),
        pairs=values.size,
        **{word: int((outcomes == word).sum()) for word in ("agrees", "higher", "lower", "open")},
        dispersions=span(of_law(curves, REFERENCE)["dispersion"].values),
        totals=span([total(share) for share in shares.values()]),
        law_table=body(by_law),
        width_exponent=span(width),
        height_exponent=span(height, ".2f", " to "),
        scatter=span(100 * scatter, ".0f"),
        samples=SAMPLES,
        part_table=body(part_rows(shares)),
        uplift=span(stored["friction_uplift"].values),
    )


def part_rows(shares: dict[str, xr.Dataset]) -> Iterator[tuple[str, ...]]:
    """Yield ranges of the shares over the items, on the ground and on the roof."""
    for i, name in enumerate(PARTS):
        places = (
            [parts_of(share)[i] for case, share in shares.items() if case.endswith(at)] for at in ("ground", "roof")
        )
        yield name, *map(per_cent, places)


def ratio_rows(main_law: xr.Dataset, known: xr.Dataset, japanese: xr.Dataset) -> Iterator[tuple[str, ...]]:
    """Yield our medians over the published ones, item by item."""
    for block in main_law["block"].values:
        places = (main_law.sel(block=block, floor=floor) for floor in main_law["floor"].values)
        of_block = [
            f"{at['ratio'].item():.2f} ({at['lower'].item():.2f}–{at['upper'].item():.2f}) {at['verdict'].item()}"
            for at in places
        ]
        yield str(block), *(f"{float(data['median'].sel(block=block)):.2f}" for data in (known, japanese)), *of_block


def validity_rows(stored: xr.Dataset) -> Iterator[tuple[str, ...]]:
    """Yield the friction that each item needs, and how many of its runs the law does not decide."""
    outside = of_law(stored, REFERENCE)["outside"]
    for block in outside["block"].values:
        of_block = outside.sel(block=block)
        cells = [f"{100 * float(of_block.sel(reason=name)):.0f} %" for name in ("slides_while_rocking", "undecided")]
        need = f"{float(stored['friction_uplift'].sel(block=block)):.2f}"
        squat = float(of_block.sel(reason="squat")) > 0.0
        yield str(block), need, *cells, "too squat" if squat else "rocks with that friction"


def share_rows(shares: dict[str, xr.Dataset]) -> Iterator[tuple[str, ...]]:
    """Yield the dispersion of each case and its shares."""
    for case, share in shares.items():
        known = f"{100 * share['share_known'].item():.0f} %"
        yield case, f"{total(share):.2f}", *(f"{100 * part:.0f} %" for part in parts_of(share)), known
