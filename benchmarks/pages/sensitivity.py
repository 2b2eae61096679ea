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
from ..claims.claims import FAILS, HOLDS, OPEN, OURS, PAPER, Claim, claims
from ..claims.evidence import evidence
from ..claims.figures import figures as figures_of_claims
from .page import results, save, study, template, write
from .tables import Interval, body, minus, table

SHOWN = {
    "delta": (
        "decay_error",
        "free_rocking",
        "median_ratio",
        "dispersion",
        "probability",
        "flipped",
        "convergence",
        "tornado",
        "sobol",
    ),
    "e": ("median", "dispersion", "probability", "flipped", "decay_error", "free_rocking", "tornado", "sobol"),
}
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
        [one for one in handles if one is not None],
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
    verdicts = [one.verdict for one in of_delta if one.of == PAPER]
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
        delta_claims=claim_list(of_delta, PAPER),
        delta_ours=claim_list(of_delta, OURS),
        e_claims=claim_list(of_e, PAPER),
        e_ours=claim_list(of_e, OURS),
        claim_table=claim_table(of_delta, of_e),
        swing_table=swing_table(over_delta),
        flip_table=flip_table(over_delta),
        friction=float(over_e.attrs["friction"]),
        unphysical=unphysical(over_e),
        replicates=int(over_delta.attrs["replicates"]),
        order=order_table(over_delta),
    )


def claim_list(found: list[Claim], of: str) -> str:
    """Claims with verdict, number and interval, one each."""
    return "\n".join(
        f"- **{capital(one.claim)}: {one.verdict}.** {capital(one.text)}. *{written(one)}: {kind(one)}.*"
        for one in found
        if one.of == of
    )


def kind(one: Claim) -> str:
    """Return what a claim's number is, and its interval."""
    return WHAT[one.claim].partition(";")[0] + ("" if one.interval == "exact" else f" ({one.interval})")


def capital(text: str) -> str:
    """The beginning of a sentence, symbols left as they are."""
    return text if text.startswith("Vassiliou et al.") else text[0].upper() + text[1:]


def claim_table(over_delta: list[Claim], over_e: list[Claim]) -> str:
    """Return every claim: what its number is, and verdict and number in both studies."""
    others = {one.claim: one for one in over_e}
    rows = []
    for one in over_delta:
        both = (one, others.get(one.claim))
        cells = [f"**{claim.verdict}**: {written(claim)}" if claim else "–" for claim in both]
        rows.append((one.claim, WHAT[one.claim], *cells))
    return body(rows)


def written(one: Claim) -> str:
    """Return a number with its interval."""
    if one.lower == one.number == one.upper:
        return f"{one.number:g}"
    return f"{Interval(one.number, one.lower, one.upper):.2f}"


def swing_table(results: xr.Dataset) -> str:
    """Return how far medians move over all values of delta, and over the usual ones."""
    rows = []
    for model in results["model"].values:
        for block in results["block"].values:
            one = results.sel(block=block, model=model)
            rows.append((law(model), block, *(swing(one.sel(span=span)) for span in one["span"].values)))
    return body(rows)


def law(model: object) -> str:
    """Return the name of a law as Markdown."""
    return str(model).replace("_", "\\_")


def swing(one: xr.Dataset) -> str:
    """Return how far the median of a law and block moves, with its interval."""
    middle, low, high = (one[f"median_swing{end}"].item() for end in ("", "_lower", "_upper"))
    if np.isnan(middle):
        return "no curve at some δ"
    if np.isinf(middle):
        return "more than the levels show"
    return f"{middle:.2f} ({low:.2f}–{'∞' if np.isinf(high) else f'{high:.2f}'})"


def flip_table(results: xr.Dataset) -> str:
    """Return the largest share of flags over the levels that differ from the rigid block's, mean of the blocks."""
    share = results["flipped"].sel(comparison="rigid").max("level").mean("block")
    rows = (
        (law(model), *(f"{100 * one:.0f} %" for one in share.sel(model=model).values))
        for model in share["model"].values
    )
    return table(("law", *(f"δ = {delta:g}" for delta in results["value"].values)), rows)


def order_table(results: xr.Dataset) -> str:
    """Return the order of convergence of each law and block."""
    order = results["convergence_order"]
    rows = (
        (law(model), *(minus(f"{one:.2f}") for one in order.sel(model=model).values)) for model in order["model"].values
    )
    return table(("law", *map(str, results["block"].values)), rows)


def unphysical(results: xr.Dataset) -> str:
    """Return from which e on an impact needs no more friction than there is, block by block."""
    limit = float(results.attrs["friction"])
    ratio = 1.0 / np.tan(results["alpha"].values)
    ends = (ratio - limit) / (ratio + limit)
    return ", ".join(f"{end:.2f} ({block})" for end, block in zip(ends, results["block"].values, strict=True))
