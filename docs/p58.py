"""docs/p58.md and its figures: FEMA P-58's contents that fall over, held against their published medians.

`make p58` runs it: the study studies/examples/fema_p58.toml (finished results are kept), and what is uncertain of the
blocks for the shares of the dispersion.  Every number on the page is put there by this file.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

import toppling as tp
from toppling.fragility import (
    Beta,
    Lognormal,
    Normal,
    RandomInputs,
    Uniform,
    capacity_variance_shares,
    median_ratio,
    uncertain_ida,
)
from toppling.fragility.curves import published
from toppling.fragility.fitting.bootstrap import percentile_interval
from toppling.studies.plots.axes import COLOURS, MARKERS

HERE = Path(__file__).parent
STUDY = HERE.parent / "studies/examples/fema_p58.toml"
REFERENCE, OURS = "housner", "energy-consistent"

# What nobody knows of a piece of furniture to a per cent: how full it is, what it stands on, how its mass is spread.
INPUTS = RandomInputs(
    {
        "restitution_factor": Beta(8.0, 2.0, 0.7, 1.0),
        "alpha_factor": Normal(1.0, 0.08, 0.75, 1.25),
        "R_factor": Lognormal(1.0, 0.08, 0.75, 1.3),
        "inertia_factor": Uniform(1.25, 1.4),
    }
)
SAMPLES = 24
ITEMS = ("bookcase-2-shelf", "bookcase-5-shelf", "file-vertical-4-drawer", "file-lateral-4-drawer")
LAWS = (tp.HousnerImpact(geometry="bilinear"), tp.EnergyConsistent(), tp.DiscreteDamping())


def main(out: Path = HERE, results: Path = HERE.parent / "results/fema_p58") -> None:
    """Write the page and its figures into `out`."""
    mpl.use("Agg")
    study = tp.Study.from_toml(STUDY)
    found = study.run(results)
    runs = found.rename(motion_floor="floor_of").drop_vars("floor").rename(floor_of="floor")
    runs = runs[["overturned"]].assign_attrs(im="pgv", design="ida", configuration=found.attrs["configuration"])
    curves = tp.fit_fragility(runs, keep_replicates=True)
    known = published.fema_p58()
    japanese = published.japanese([tp.catalogue[str(block)] for block in found["block"].values], "velocity")
    ratios = median_ratio(curves, known)
    laws = size_regression(curves)
    shares = uncertain(study)
    folder = out / "p58"
    folder.mkdir(exist_ok=True)
    for name, figure in (
        ("medians", medians_figure(curves, known, japanese)),
        ("exponents", exponents_figure(laws)),
        ("shares", shares_figure(shares)),
    ):
        figure.savefig(folder / f"{name}.png", dpi=130)
        plt.close(figure)
    (out / "p58.md").write_text(page(found, curves, known, japanese, ratios, laws, shares), encoding="utf-8")


def size_regression(curves: xr.Dataset) -> xr.Dataset:
    """Fit ln(median) = a + b ln(width) + c ln(height) by least squares, with 95 % intervals from replicates."""
    terms = np.stack([np.ones(curves.sizes["block"]), np.log(curves["width"]), np.log(curves["height"])], axis=1)
    solve = xr.DataArray(np.linalg.pinv(terms), {"term": ["constant", "width", "height"]}, ("term", "block"))
    of_blocks = [name for name, one in curves.coords.items() if "block" in one.dims]
    logs, samples = (np.log(curves[name].drop_vars(of_blocks)) for name in ("median", "median_sample"))
    coefficient = xr.dot(solve, logs, dim="block")
    fitted = xr.dot(xr.DataArray(terms, dims=("block", "term")), coefficient.drop_vars("term"), dim="term")
    drawn = xr.dot(solve, samples, dim="block").transpose(*coefficient.dims, "replicate")
    ends = percentile_interval(drawn.values, 0.95)
    return xr.Dataset(
        {
            "coefficient": coefficient,
            "coefficient_lower": coefficient.copy(data=ends.lower),
            "coefficient_upper": coefficient.copy(data=ends.upper),
            "scatter": np.sqrt(((logs - fitted) ** 2).mean("block")),
        }
    )


def of_law(dataset: xr.Dataset, law: str) -> xr.Dataset:
    """The part of one law."""
    return dataset.isel(model=int(np.flatnonzero(dataset["law"].values == law)[0]))


def uncertain(study: Any) -> xr.Dataset:
    """Dispersion of ln capacity and its shares, for some items on the ground and on the roof of the 1 s building."""
    levels = study.design.levels
    where = {"ground": "ground", "1 s floor 8": "roof"}
    parts = []
    for label, place in where.items():
        array = next(one for one in study.design.motions if label in [str(floor) for floor in one["floor"].values])
        motions = array.sel(floor=label).isel(motion=slice(60))
        for item in ITEMS:
            runs = uncertain_ida(
                INPUTS, tp.catalogue[item], LAWS, motions, levels, "pgv", "overturned", samples=SAMPLES, seed=1
            )
            share = capacity_variance_shares(runs)
            parts.append(
                share[["share", "total_variance", "share_known", "motions_used"]].assign_coords(case=f"{item}, {place}")
            )
    return xr.concat(parts, "case")


def medians_figure(curves: xr.Dataset, known: xr.Dataset, japanese: xr.Dataset) -> Figure:
    """Our medians on the ground and on every floor, the published one with its dispersion, and the Japanese one."""
    blocks = [str(block) for block in curves["block"].values]
    floors = [str(floor) for floor in curves["floor"].values]
    figure = plt.figure(figsize=(9.0, 6.4), layout="constrained")
    ax = figure.subplots()
    here = of_law(curves, REFERENCE)
    for i, block in enumerate(blocks):
        median, beta = (float(known[name].sel(block=block)) for name in ("median", "dispersion"))
        ax.fill_betweenx([i - 0.4, i + 0.4], median * np.exp(-beta), median * np.exp(beta), color="0.9", lw=0.0)
        ax.plot([median, median], [i - 0.4, i + 0.4], color="black", lw=2.0)
        v50 = float(japanese["median"].sel(block=block))
        ax.plot([v50, v50], [i - 0.4, i + 0.4], color="black", lw=1.2, ls=(0, (2, 2)))
        for k, floor in enumerate(floors):
            one = here.sel(block=block, floor=floor)
            y = i + 0.32 * (2.0 * k / max(1, len(floors) - 1) - 1.0)
            value, low, high = (one[f"median{end}"].item() for end in ("", "_lower", "_upper"))
            colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
            if k == 0:
                colour = "black"
            ax.errorbar(value, y, xerr=[[value - low], [high - value]], fmt=marker, ms=4.5, lw=1.1, color=colour)
    ax.plot([], [], color="black", lw=2.0, label="FEMA P-58, median (band: ± its dispersion)")
    ax.plot([], [], color="black", lw=1.2, ls=(0, (2, 2)), label="Japanese velocity criterion")
    for k, floor in enumerate(floors):
        colour = "black" if k == 0 else COLOURS[k % len(COLOURS)]
        ax.plot([], [], MARKERS[k % len(MARKERS)], ms=5.0, color=colour, label=floor)
    ax.set_yticks(range(len(blocks)), blocks)
    ax.set_ylim(len(blocks) - 0.5, -0.5)
    ax.set_xscale("log")
    ticks = [0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0]
    ax.set_xticks(ticks, [f"{one:g}" for one in ticks])
    ax.minorticks_off()
    ax.set_xlabel("median peak floor velocity (m/s)")
    ax.set_title("Overturning medians, Housner's block in exact geometry, with 95 % intervals", fontsize=11)
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    return figure


def exponents_figure(laws: xr.Dataset) -> Figure:
    """Exponents of width and height under two laws, on every floor, beside the published ones."""
    figure = plt.figure(figsize=(9.0, 3.8), layout="constrained")
    floors = [str(floor) for floor in laws["floor"].values]
    for ax, (term, value) in zip(
        figure.subplots(1, 2), zip(("width", "height"), (1.48, -1.07), strict=True), strict=True
    ):
        ax.axhline(value, color="0.3", lw=1.2, ls=(0, (4, 2)), label="FEMA P-58")
        for j, law in enumerate((REFERENCE, OURS)):
            one = of_law(laws, law).sel(term=term)
            middle, low, high = (one[f"coefficient{end}"].values for end in ("", "_lower", "_upper"))
            x = np.arange(len(floors)) + 0.16 * (2 * j - 1)
            ax.errorbar(x, middle, [middle - low, high - middle], fmt=MARKERS[j], ms=5.0, color=COLOURS[j], label=law)
        ax.set_xticks(range(len(floors)), [floor.replace(" floor ", "\nfloor ") for floor in floors], fontsize=8)
        ax.set_ylabel(f"exponent of the {term}")
        ax.grid(axis="y", alpha=0.25, lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    figure.axes[0].legend(frameon=False, fontsize=9)
    figure.suptitle("median ∝ widthᵇ heightᶜ over the nine items, with 95 % intervals", fontsize=11)
    return figure


def shares_figure(shares: xr.Dataset) -> Figure:
    """Dispersion of ln capacity, all uncertainties together, in parts that add up in variance."""
    figure = plt.figure(figsize=(9.0, 4.2), layout="constrained")
    ax = figure.subplots()
    cases = [str(case) for case in shares["case"].values]
    total = np.sqrt(shares["total_variance"].values)
    y = np.arange(len(cases))
    left = np.zeros(len(cases))
    for name, colour, hatch in PARTS:
        width = total * part(shares, name)
        ax.barh(y, width, 0.7, left, color=colour, hatch=hatch, edgecolor="white", label=name)
        left += width
    ax.axvline(0.5, color="black", lw=1.6, ls=(0, (4, 2)))
    ax.annotate("FEMA P-58: 0.5", (0.5, -0.62), xytext=(-4, 0), textcoords="offset points", ha="right", fontsize=9)
    ax.set_yticks(y, cases)
    ax.set_ylim(len(cases) - 0.4, -0.9)
    ax.set_xlabel("dispersion of ln capacity in peak floor velocity (length), and what its variance is of (parts)")
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure


PARTS = (
    ("motion", COLOURS[0], ""),
    ("law", COLOURS[1], ""),
    ("parameters", COLOURS[2], ""),
    ("interactions", "0.75", "//"),
)


def part(shares: xr.Dataset, name: str) -> np.ndarray:
    """Shares of the variance of one part; interactions are what is left."""
    named = {"motion": "motion", "law": "model", "parameters": "sample"}
    if name in named:
        return np.asarray(shares["share"].sel(component=named[name]).values)
    return 1.0 - sum(np.asarray(shares["share"].sel(component=one).values) for one in named.values())


def page(
    found: xr.Dataset,
    curves: xr.Dataset,
    known: xr.Dataset,
    japanese: xr.Dataset,
    ratios: xr.Dataset,
    laws: xr.Dataset,
    shares: xr.Dataset,
) -> str:
    """The page: the text of p58.md.in with every number from the datasets."""
    main_law = of_law(ratios, REFERENCE)
    values, verdicts = main_law["ratio"].values, main_law["verdict"].values
    words = {word: int((verdicts == word).sum()) for word in ("agrees", "higher", "lower", "open")}
    floors = [str(floor) for floor in main_law["floor"].values]
    rows = []
    for block in main_law["block"].values:
        one = main_law.sel(block=block)
        cells = [f"{float(known['median'].sel(block=block)):.2f}", f"{float(japanese['median'].sel(block=block)):.2f}"]
        for floor in floors:
            at = one.sel(floor=floor)
            ends = "–".join(f"{at[end].item():.2f}" for end in ("lower", "upper"))
            cells.append(f"{at['ratio'].item():.2f} ({ends}) {at['verdict'].item()}")
        rows.append((str(block), *cells))
    by_law = []
    for law in dict.fromkeys(str(one) for one in curves["law"].values):
        dispersion = of_law(curves, law)["dispersion"].values
        by_law.append((law, span(of_law(ratios, law)["ratio"].values), span(dispersion)))
    outside = of_law(found, REFERENCE)["outside"]
    validity = []
    for block in outside["block"].values:
        here = outside.sel(block=block)
        squat = float(here.sel(reason="squat")) > 0.0
        said = [f"{100 * float(here.sel(reason=name)):.0f} %" for name in ("slides_while_rocking", "undecided")]
        need = f"{float(found['friction_uplift'].sel(block=block)):.2f}"
        validity.append(
            (str(block), need, *said, "too squat to rock" if squat else "rocks where there is that friction")
        )
    total = np.sqrt(shares["total_variance"].values)
    exponents = of_law(laws, REFERENCE)
    coefficient = exponents["coefficient"]
    numbers = {
        "answer": answer(words["higher"], values.size),
        "motions": found.sizes["motion"] // len(floors),
        "least": str(main_law["ratio"].mean("block").idxmin("floor").item()),
        "ratios": span(values),
        "pairs": values.size,
        **words,
        "dispersions": span(of_law(curves, REFERENCE)["dispersion"].values),
        "totals": span(total),
        "ratio_table": table(("item", "P-58 (m/s)", "V50 (m/s)", *floors), rows),
        "law_table": table(("law", "median over the published one", "dispersion"), by_law),
        "width_exponent": span(coefficient.sel(term="width").values),
        "height_exponent": span(coefficient.sel(term="height").values, signed=True),
        "scatter": span(100 * exponents["scatter"].values, digits=0),
        "samples": SAMPLES,
        "share_table": table(
            ("case", "dispersion", *(name for name, _, _ in PARTS), "capacities known"), share_rows(shares)
        ),
        "validity_table": table(
            (
                "item",
                "friction that uplift needs",
                "runs that need more than 1 while rocking",
                "undecided flags",
                "verdict",
            ),
            validity,
        ),
    }
    return (HERE / "p58.md.in").read_text(encoding="utf-8").format(**numbers)


def answer(higher: int, pairs: int) -> str:
    """Where our medians are higher than the published ones, by the number of pairs of item and place."""
    if higher == pairs:
        return "higher than the published ones in every place"
    if higher > 0.75 * pairs:
        return "higher than the published ones nearly everywhere"
    return "higher than the published ones " + ("in most places" if higher > 0.5 * pairs else "in some places only")


def share_rows(shares: xr.Dataset) -> list[tuple[str, ...]]:
    """Rows of the table of shares."""
    rows = []
    for i, case in enumerate(shares["case"].values):
        here = shares.isel(case=[i])
        parts = [f"{100 * float(part(here, name)[0]):.0f} %" for name, _, _ in PARTS]
        known = f"{100 * here['share_known'].item():.0f} %"
        rows.append((str(case), f"{np.sqrt(here['total_variance'].item()):.2f}", *parts, known))
    return rows


def span(values: np.ndarray, digits: int = 2, signed: bool = False) -> str:
    """The range of values."""
    low, high = (f"{value:.{digits}f}".replace("-", "−") for value in (np.nanmin(values), np.nanmax(values)))
    return f"{low} to {high}" if signed else f"{low}–{high}"


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
