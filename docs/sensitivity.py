"""docs/sensitivity.md and its figures: how much delta and e matter, and what that says of the paper's claims.

`make sensitivity` runs it: the studies studies/examples/sensitivity_delta.toml and sensitivity_e.toml (finished results
are kept).  Every number on the page is put there by this file.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import toppling as tp
from toppling.benchmarks.claims.claims import FAILS, HOLDS, OPEN, OURS, PAPER, Claim, claims
from toppling.benchmarks.claims.evidence import evidence
from toppling.benchmarks.claims.figures import figures as figures_of_claims
from toppling.studies.plots.sensitivity import figures

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "studies/examples"
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
"""What is shown of each study."""
DPI = 140
"""Of the figures: 5.2 in wide, they fill the page's column (728 pixels)."""
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
"""What the number of each claim is, and where it would say nothing against or for it."""


def main(out: Path = HERE, results: Path = HERE.parent / "results") -> None:
    """Write the page and its figures into `out`."""
    found = {}
    (out / "sensitivity").mkdir(exist_ok=True)
    for parameter, names in SHOWN.items():
        name = f"sensitivity_{parameter}"
        study = tp.Study.from_toml(EXAMPLES / f"{name}.toml")
        one = evidence(study, study.run(results / name))
        for which, figure in (*figures(one), *figures_of_claims(one)):
            if which in names:
                legend_above(figure)
                figure.savefig(out / "sensitivity" / f"{parameter}_{which}.png", dpi=DPI)
        found[parameter] = one
    (out / "sensitivity.md").write_text(page(found["delta"], found["e"]), encoding="utf-8")


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
    """The page: the text of sensitivity.md.in with every number from the datasets."""
    of_delta, of_e = claims(over_delta), claims(over_e)
    verdicts = [one.verdict for one in of_delta if one.of == PAPER]
    numbers = {
        "motions": over_delta.sizes["motion"],
        "levels": over_delta.sizes["level"],
        "blocks": ", ".join(str(one) for one in over_delta["block"].values),
        "deltas": ", ".join(f"{one:g}" for one in over_delta["value"].values),
        "es": ", ".join(f"{one:g}" for one in over_e["value"].values),
        "judged": len(verdicts),
        "holds": verdicts.count(HOLDS),
        "fails": verdicts.count(FAILS),
        "open": verdicts.count(OPEN),
        "delta_claims": claim_list(of_delta, PAPER),
        "delta_ours": claim_list(of_delta, OURS),
        "e_claims": claim_list(of_e, PAPER),
        "e_ours": claim_list(of_e, OURS),
        "claim_table": claim_table(of_delta, of_e),
        "swing_table": swing_table(over_delta),
        "flip_table": flip_table(over_delta),
        "friction": f"{float(over_e.attrs['friction']):g}",
        "unphysical": unphysical(over_e),
        "replicates": f"{int(over_delta.attrs['replicates']):,}",
        "order": order_table(over_delta),
    }
    return (HERE / "sensitivity.md.in").read_text(encoding="utf-8").format(**numbers)


def claim_list(found: list[Claim], of: str) -> str:
    """Claims with verdict, number and interval, one each."""
    return "\n".join(
        f"- **{capital(one.claim)}: {one.verdict}.** {capital(one.text)}. *{written(one)}: {kind(one)}.*"
        for one in found
        if one.of == of
    )


def kind(one: Claim) -> str:
    """What a claim's number is, and what its interval."""
    return WHAT[one.claim].partition(";")[0] + ("" if one.interval == "exact" else f" ({one.interval})")


def capital(text: str) -> str:
    """The beginning of a sentence, symbols left as they are."""
    return text if text.startswith("Vassiliou et al.") else text[0].upper() + text[1:]


def claim_table(over_delta: list[Claim], over_e: list[Claim]) -> str:
    """Every claim: what its number is, and verdict and number in both studies."""
    beside = {one.claim: one for one in over_e}
    rows = []
    for one in over_delta:
        other = beside.get(one.claim)
        cells = [f"**{it.verdict}**: {written(it)}" if it else "–" for it in (one, other)]
        rows.append((one.claim, WHAT[one.claim], *cells))
    return table(("claim", "the number is", "at δ = 0.05 or over δ", "over e"), rows)


def written(one: Claim) -> str:
    """A number with its interval."""
    if one.lower == one.number == one.upper:
        return f"{one.number:g}"
    return f"{one.number:.2f} ({one.lower:.2f}–{one.upper:.2f})"


def swing_table(results: xr.Dataset) -> str:
    """How far medians move over all values of delta, and over the usual ones."""
    rows = []
    for model in results["model"].values:
        for block in results["block"].values:
            one = results.sel(block=block, model=model)
            cells = [swing(one.sel(span=span)) for span in one["span"].values]
            rows.append((str(model).replace("_", "\\_"), str(block), *cells))
    return table(("law", "block", "all δ", "δ 0.01–0.1"), rows)


def swing(one: xr.Dataset) -> str:
    """How far the median of a law and block moves, with its interval."""
    middle, low, high = (one[f"median_swing{end}"].item() for end in ("", "_lower", "_upper"))
    if np.isnan(middle):
        return "no curve at some δ"
    if np.isinf(middle):
        return "more than the levels show"
    return f"{middle:.2f} ({low:.2f}–{'∞' if np.isinf(high) else f'{high:.2f}'})"


def flip_table(results: xr.Dataset) -> str:
    """Largest share of flags that differ from the rigid block's, over the levels, at each delta; mean of the blocks."""
    share = results["flipped"].sel(comparison="rigid").max("level").mean("block")
    rows = [
        (str(model).replace("_", "\\_"), *(f"{100 * float(one):.0f} %" for one in share.sel(model=model).values))
        for model in results["model"].values
    ]
    return table(("law", *(f"δ = {one:g}" for one in results["value"].values)), rows)


def order_table(results: xr.Dataset) -> str:
    """Order of convergence of each law and block."""
    rows = [
        (
            str(model).replace("_", "\\_"),
            *(f"{float(one):.2f}".replace("-", "−") for one in results["convergence_order"].sel(model=model).values),
        )
        for model in results["model"].values
    ]
    return table(("law", *(str(block) for block in results["block"].values)), rows)


def unphysical(results: xr.Dataset) -> str:
    """From which e on an impact needs no more friction than there is, block by block."""
    limit = float(results.attrs["friction"])
    ratio = 1.0 / np.tan(results["alpha"].values)
    ends = (ratio - limit) / (ratio + limit)
    return ", ".join(f"{end:.2f} ({block})" for end, block in zip(ends, results["block"].values, strict=True))


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
