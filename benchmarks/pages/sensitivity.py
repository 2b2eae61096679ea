"""The part of the page docs/paper.md on δ and e: how much they matter, and verdicts on the paper's claims.

It takes the results of studies/examples/sensitivity_delta.toml and sensitivity_e.toml.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ...studies.kinds.sensitivity import SensitivityStudy
from ...studies.plots.sensitivity import figures
from ..claims.claims import FAILS, HOLDS, OPEN, PAPER, Claim, claims
from ..claims.evidence import evidence
from .page import Table, results, study
from .tables import Interval, body, span

ABOVE = "its median over the rigid block's; above 1: falls too late"
LARGER = "share of runs with a larger peak than the rigid block's; 0.5: neither"
WHAT = {
    "discrete damping outperforms in free decay": "relative distance of its peaks from the rigid block's; 0: none",
    "discrete damping has the lowest sensitivity to δ: free rocking": (
        "maximum over minimum peak, δ from 0.01 to 0.1; 1: not sensitive"
    ),
    "discrete damping has the lowest sensitivity to δ: overturning": (
        "factor on its median for ten times δ; 1: not sensitive"
    ),
    "the coefficient of Vassiliou et al. does not depend on δ": "relative range of the coefficient over δ; 0: none",
    "Giannini–Masiani performs like discrete damping under shaking": (
        "its median over the discrete law's; 1: the same"
    ),
    "Makris–Konstantinidis underestimates overturning": ABOVE,
    "Makris–Konstantinidis underestimates peaks under shaking": LARGER.replace("larger", "smaller"),
    "Vassiliou et al. overestimates overturning": ABOVE.replace("above 1: falls too late", "below 1: falls too soon"),
    "Vassiliou et al. overestimates peaks under shaking": LARGER,
    "discrete damping dissipates less than an impact does": (
        "its last peak of free rocking over the rigid block's; above 1: too little"
    ),
    "discrete damping has an elastic mode that a rigid block has not": (
        "its median over the same law's with a rigid rest; below 1: the mode overturns blocks"
    ),
    "energy-consistent damping is the rigid block": "its median over the rigid block's; 1: the same",
}
"""The number of each claim, and its value if it says nothing for or against the claim."""


def studies() -> dict[str, xr.Dataset]:
    """Return what claims are judged by, over δ and over e."""
    names = {parameter: f"sensitivity_{parameter}" for parameter in ("delta", "e")}
    return {
        parameter: evidence(cast(SensitivityStudy, study(name)), results(name)) for parameter, name in names.items()
    }


def figure(over_delta: xr.Dataset) -> Figure:
    """Return medians over the rigid block's, with the legend above: the foot of three panels is off the screen."""
    drawn = dict(figures(over_delta))["median_ratio"]
    (below,) = drawn.legends
    handles, labels = below.legend_handles, [text.get_text() for text in below.get_texts()]
    size = below.get_texts()[0].get_fontsize()
    below.remove()
    drawn.legend(
        [handle for handle in handles if handle is not None],
        labels,
        title=drawn.get_suptitle(),
        loc="outside upper center",
        ncols=2,
        fontsize=size,
        frameon=False,
    )
    drawn.suptitle("")
    return drawn


LAWS = {
    "discrete": ("discrete", "elastic"),
    "vassiliou": ("vassiliou", "elastic"),
    "mk": ("makris-konstantinidis", "elastic"),
    "gm": ("giannini-masiani", "elastic"),
    "rest": ("discrete", "rigid"),
    "consistent": ("energy-consistent", "rigid"),
}
"""Law and rest of every law by its key in the template."""


def of_law(dataset: xr.Dataset, key: str) -> xr.Dataset:
    """Return the part of a law."""
    law, rest = LAWS[key]
    return dataset.isel(model=int(np.flatnonzero((dataset["law"] == law) & (dataset["rest"] == rest))[0]))


def values(over: dict[str, xr.Dataset]) -> dict[str, object]:
    """Return the values of the template."""
    over_delta, over_e = over["delta"], over["e"]
    of_delta, of_e = claims(over_delta), claims(over_e)
    verdicts = [claim.verdict for claim in of_delta if claim.of == PAPER]
    index = {key: of_law(over_delta, key)["sobol_total"] for key in LAWS}
    slender = [index[key].sel(input="alpha_factor") for key in ("rest", "consistent")]
    on_e = [of_law(over_e, key)["sobol_total"].sel(input="e") for key in LAWS if key != "vassiliou"]
    return {
        "sensitivity_motions": over_delta.sizes["motion"],
        "sensitivity_levels": over_delta.sizes["level"],
        "sensitivity_blocks": "; ".join(str(block) for block in over_delta["block"].values),
        "judged": len(verdicts),
        "holds": verdicts.count(HOLDS),
        "fails": verdicts.count(FAILS),
        "open": verdicts.count(OPEN),
        "claim_table": claim_table(of_delta, of_e),
        **{f"swing_{key}": span(of_law(over_delta, key)["median_swing"].isel(span=-1)) for key in LAWS},
        **{f"sobol_{key}": span(indices.sel(input="delta")) for key, indices in index.items()},
        "sobol_slender": span(slender),
        "sobol_e": span(on_e),
        "friction": float(over_e.attrs["friction"]),
        "unphysical": unphysical(over_e),
        "replicates": int(over_delta.attrs["replicates"]),
    }


def tables(over: dict[str, xr.Dataset]) -> dict[str, Table]:
    """Return the tables of files: headings and rows."""
    return {
        "swings": (("law", "block", "all δ", "δ 0.01–0.1"), swing_rows(over["delta"])),
        "sobol": (("study over", "law", "block", "input", "total Sobol' index"), sobol_rows(over)),
    }


def sobol_rows(over: dict[str, xr.Dataset]) -> Iterator[tuple[str, ...]]:
    """Yield total Sobol' indices with their intervals."""
    for parameter, indices in over.items():
        for model, block, name in product(indices["model"].values, indices["block"].values, indices["input"].values):
            of_input = indices.sel(model=model, block=block, input=name)
            ends = (of_input[f"sobol_total{end}"].item() for end in ("", "_lower", "_upper"))
            yield parameter, str(model), str(block), str(name), f"{Interval(*ends):.2f}"


def claim_table(over_delta: list[Claim], over_e: list[Claim]) -> str:
    """Return every claim: what its number is, and verdict and number in both studies."""
    by_claim = {claim.claim: claim for claim in over_e}
    rows = []
    for claim in over_delta:
        both = (claim, by_claim.get(claim.claim))
        cells = (f"**{of_study.verdict}**: {written(of_study)}" if of_study else "–" for of_study in both)
        rows.append((claim.claim, WHAT[claim.claim], *cells))
    return body(rows)


def written(claim: Claim) -> str:
    """Return a number with its interval."""
    if claim.lower == claim.number == claim.upper:
        return f"{claim.number:g}"
    return f"{Interval(claim.number, claim.lower, claim.upper):.2f}"


def swing_rows(dataset: xr.Dataset) -> Iterator[tuple[str, ...]]:
    """Yield how far medians move over all values of delta, and over the usual ones."""
    for model, block in product(dataset["model"].values, dataset["block"].values):
        of_block = dataset.sel(block=block, model=model)
        yield str(model), str(block), *(swing(of_block.sel(span=name)) for name in of_block["span"].values)


def swing(of_block: xr.Dataset) -> str:
    """Return how far the median of a law and block moves, with its interval."""
    middle, low, high = (of_block[f"median_swing{end}"].item() for end in ("", "_lower", "_upper"))
    if np.isnan(middle):
        return "no curve at some δ"
    if np.isinf(middle):
        return "more than the levels show"
    return f"{middle:.2f} ({low:.2f}–{'∞' if np.isinf(high) else f'{high:.2f}'})"


def unphysical(dataset: xr.Dataset) -> str:
    """Return from which e on an impact needs no more friction than there is, block by block."""
    limit = float(dataset.attrs["friction"])
    ratio = 1.0 / np.tan(dataset["alpha"].values)
    ends = (ratio - limit) / (ratio + limit)
    return ", ".join(f"{end:.2f} ({block})" for end, block in zip(ends, dataset["block"].values, strict=True))
