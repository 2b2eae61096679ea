"""The page docs/sensitivity.md and its figures: how much delta and e matter, and verdicts on the paper's claims.

It takes the results of studies/examples/sensitivity_delta.toml and sensitivity_e.toml.
"""

from __future__ import annotations

from typing import cast

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ...studies.kinds.sensitivity import SensitivityStudy
from ...studies.plots.sensitivity import figures
from ..claims.claims import FAILS, HOLDS, OPEN, PAPER, Claim, claims
from ..claims.evidence import evidence
from ..claims.figures import figures as figures_of_claims
from .page import results, save, study, template, write
from .tables import Interval, body

SHOWN = {"delta": ("decay_error", "median_ratio", "tornado", "sobol"), "e": ("median", "tornado", "sobol")}
"""Figures of each study that the page shows."""
ABOVE = "its median over the rigid block's; above 1: falls too late"
LARGER = "share of runs with a larger peak than the rigid block's; 0.5: neither"
WHAT = {
    "discrete damping outperforms in free decay": "relative distance of its peaks from the rigid block's; 0: none",
    "discrete damping is least sensitive to δ: free rocking": (
        "largest over smallest peak, δ from 0.01 to 0.1; 1: not sensitive"
    ),
    "discrete damping is least sensitive to δ: overturning": "factor on its median for ten times δ; 1: not sensitive",
    "the coefficient of Vassiliou et al. does not depend on δ": "relative range of the coefficient over δ; 0: none",
    "Giannini–Masiani performs like discrete damping under shaking": (
        "its median over that of discrete damping; 1: the same"
    ),
    "Makris–Konstantinidis underestimates overturning": ABOVE,
    "Makris–Konstantinidis underestimates peaks under shaking": LARGER.replace("larger", "smaller"),
    "Vassiliou et al. overestimates overturning": ABOVE.replace("above 1: falls too late", "below 1: falls too soon"),
    "Vassiliou et al. overestimates peaks under shaking": LARGER,
    "discrete damping dissipates less than an impact does": (
        "its last peak of free rocking over the rigid block's; above 1: too little"
    ),
    "discrete damping has an elastic mode that a rigid block has not": (
        "its median over that of the same law at rest until uplift; below 1: the mode topples"
    ),
    "energy-consistent damping is the rigid block": "its median over the rigid block's; 1: the same",
}
"""The number of each claim, and its value if it says nothing for or against the claim."""


def main() -> None:
    """Write the page and its figures."""
    names = {parameter: f"sensitivity_{parameter}" for parameter in SHOWN}
    found = {
        parameter: evidence(cast(SensitivityStudy, study(name)), results(name)) for parameter, name in names.items()
    }
    for parameter, shown in SHOWN.items():
        every = (*figures(found[parameter]), *figures_of_claims(found[parameter]))
        drawn = {f"{parameter}_{name}": figure for name, figure in every if name in shown}
        for figure in drawn.values():
            legend_above(figure)
        save("sensitivity", drawn, 140)
    write("sensitivity", page(found["delta"], found["e"]))


def legend_above(figure: Figure) -> None:
    """Put a figure's legend between its title and its panels: three panels high, its foot is off the screen."""
    (below,) = figure.legends
    handles, labels = below.legend_handles, [text.get_text() for text in below.get_texts()]
    size = below.get_texts()[0].get_fontsize()
    below.remove()
    figure.legend(
        [handle for handle in handles if handle is not None],
        labels,
        title=figure.get_suptitle(),
        loc="outside upper center",
        ncols=2,
        fontsize=size,
        frameon=False,
    )
    figure.suptitle("")


def page(over_delta: xr.Dataset, over_e: xr.Dataset) -> str:
    """Return the page: its template with every number from the datasets."""
    of_delta, of_e = claims(over_delta), claims(over_e)
    verdicts = [claim.verdict for claim in of_delta if claim.of == PAPER]
    return template("sensitivity").format(
        motions=over_delta.sizes["motion"],
        levels=over_delta.sizes["level"],
        blocks=", ".join(str(block) for block in over_delta["block"].values),
        deltas=", ".join(f"{value:g}" for value in over_delta["value"].values),
        es=", ".join(f"{value:g}" for value in over_e["value"].values),
        judged=len(verdicts),
        holds=verdicts.count(HOLDS),
        fails=verdicts.count(FAILS),
        open=verdicts.count(OPEN),
        claim_table=claim_table(of_delta, of_e),
        swing_table=swing_table(over_delta),
        friction=float(over_e.attrs["friction"]),
        unphysical=unphysical(over_e),
        replicates=int(over_delta.attrs["replicates"]),
    )


def claim_table(over_delta: list[Claim], over_e: list[Claim]) -> str:
    """Return every claim: what its number is, and verdict and number in both studies."""
    others = {claim.claim: claim for claim in over_e}
    rows = []
    for claim in over_delta:
        both = (claim, others.get(claim.claim))
        cells = (f"**{of_study.verdict}**: {written(of_study)}" if of_study else "–" for of_study in both)
        rows.append((claim.claim, WHAT[claim.claim], *cells))
    return body(rows)


def written(claim: Claim) -> str:
    """Return a number with its interval."""
    if claim.lower == claim.number == claim.upper:
        return f"{claim.number:g}"
    return f"{Interval(claim.number, claim.lower, claim.upper):.2f}"


def swing_table(results: xr.Dataset) -> str:
    """Return how far medians move over all values of delta, and over the usual ones."""
    rows = []
    for model in results["model"].values:
        for block in results["block"].values:
            own = results.sel(block=block, model=model)
            swings = (swing(own.sel(span=span)) for span in own["span"].values)
            rows.append((str(model).replace("_", "\\_"), block, *swings))
    return body(rows)


def swing(one: xr.Dataset) -> str:
    """Return how far the median of a law and block moves, with its interval."""
    middle, low, high = (one[f"median_swing{end}"].item() for end in ("", "_lower", "_upper"))
    if np.isnan(middle):
        return "no curve at some δ"
    if np.isinf(middle):
        return "more than the levels show"
    return f"{middle:.2f} ({low:.2f}–{'∞' if np.isinf(high) else f'{high:.2f}'})"


def unphysical(results: xr.Dataset) -> str:
    """Return from which e on an impact needs no more friction than there is, block by block."""
    limit = float(results.attrs["friction"])
    ratio = 1.0 / np.tan(results["alpha"].values)
    ends = (ratio - limit) / (ratio + limit)
    return ", ".join(f"{end:.2f} ({block})" for end, block in zip(ends, results["block"].values, strict=True))
