"""What a pooled surface says of a region, in rows and sentences: its precision, its checks, and how blocks differ."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...core.wording import two_digits
from ...fragility.adaptive.stopping import REACHED
from ...fragility.adaptive.until import MEDIAN
from ...fragility.analyses.surface_results import POOLED
from ..plan.form_free import OF_THE_MEAN
from ..text.block_order import HALF
from ..text.precision import measure_notes
from ..text.rows import Rows
from ..text.words import axis_of, display_unit, reference_law

SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Shares of the blocks below the values of the table."""
MOST_SAID = 3
"""Most levels of events that a sentence names."""
TELLING = (0.1, 0.5, 0.9)
"""Mean shares of a region that fall, next to which levels are named where there are more."""


def is_pooled(results: xr.Dataset) -> bool:
    """Return whether results are of a pooled surface."""
    return str(results.attrs.get("design")) == POOLED


def pooled_notes(results: xr.Dataset) -> list[Fact]:
    """Return the notes on a region: what was not reached, surfaces cut or unlike their checks, and joint falls."""
    said = []
    for j in range(results.sizes["model"]):
        one = results.isel(model=j)
        cut = "cut_places" in one and bool(one["cut_places"].notnull().all())
        if cut or str(one["stopped_because"].item()) != REACHED or float(one["lack_of_fit"]) > 0.0:
            said.append(Fact("adaptive.account", names=(str(one["model"].item()), str(one["account"].item()))))
    said += measure_notes(results)
    if "fallen_mean" not in results:
        said.append(Fact("region.joint_falls"))
    if "rate" in results and str(json.loads(str(results.attrs["hazard"])).get("weights", "")):
        said.append(OF_THE_MEAN)
    return said


def examples(results: xr.Dataset) -> xr.Dataset:
    """Return the blocks with the lowest, the middle and the highest half level, for curves of a region."""
    order = np.argsort(results[HALF].isel(model=reference_law(results)[0]).values, kind="stable")
    chosen = list(dict.fromkeys(order[[0, order.size // 2, order.size - 1]].tolist()))
    which = {"shown_of": results.sizes["block"], "shown_by": "with the lowest, the middle and the highest half level"}
    return results.isel(block=chosen).assign_attrs(which if order.size > len(chosen) else {})


def surface_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of what was asked of each surface and what was reached; None for other designs."""
    if not is_pooled(results):
        return None
    asked = float(json.loads(str(results.attrs["until"]))[MEDIAN])
    lines = []
    for j in range(results.sizes["model"]):
        one = results.isel(model=j)
        chance, apart = float(one["check_p_value"]), float(one["lack_of_fit"])
        lines.append(
            (
                str(one["model"].item()),
                f"±{100.0 * float(one['half_width']):.1f} %",
                f"{int(one['motions_run']):,}",
                f"{int((results['run_model'].values == j).sum()):,}",
                f"by {100.0 * apart:.1f} % beyond chance" if apart > 0.0 else f"within chance (p = {chance:.2g})",
                str(one["stopped_because"].item()),
            )
        )
    title = f"One surface a law: asked are ±{100.0 * asked:g} % of the half levels of all blocks at once (95 %)"
    headings = ("law", "reached", "motions", "runs", "blocks run by themselves differ", "stopped because")
    return Rows(title, headings, lines)


def event_levels(results: xr.Dataset) -> list[tuple[float, float, float, float, int]]:
    """Return how much of a region falls in one event: level, mean share, its ends and the number of pieces.

    If there are many levels: three, with shares of about 10, 50 and 90 % under the reference law.
    """
    if "fallen_mean" not in results:
        return []
    here = results.isel(model=reference_law(results)[0])
    means, levels = here["fallen_mean"].values, here["event_level"].values
    every = list(range(levels.size))
    if levels.size > MOST_SAID:
        every = sorted({int(np.abs(means - share).argmin()) for share in TELLING})
    ends = here["fallen_quantile"].isel(event_quantile=[0, -1]).values
    number = int(results.attrs.get("shown_of", results.sizes["block"]))
    return [(float(levels[k]), float(means[k]), float(ends[k][0]), float(ends[k][1]), number) for k in every]


def event_rows(results: xr.Dataset) -> Iterator[Rows]:
    """Yield, for each law, how much of the region falls in one event at each level; none without events."""
    if "fallen_mean" not in results:
        return
    scale, unit = display_unit(axis_of(results))
    sample, events = int(results.attrs["event_sample"]), results.sizes["event_motion"]
    for j, model in enumerate(results["model"].values.tolist()):
        lines = []
        for k, level in enumerate(results["event_level"].values.tolist()):
            one = results.isel(model=j, event_level=k)
            mean, low, high = (100.0 * float(one[f"fallen_mean{end}"]) for end in ("", "_lower", "_upper"))
            few, middle, many = (f"{100.0 * value:.3g} %" for value in one["fallen_quantile"].values)
            spread, apart = (100.0 * float(one[f"fallen_sd{end}"]) for end in ("", "_independent"))
            correlation = float(one["fallen_correlation"])
            lines.append(
                (
                    f"{level / scale:.3g}{f' {unit}' if unit else ''}",
                    f"{mean:.3g} % ({low:.3g}–{high:.3g})",
                    few,
                    middle,
                    many,
                    f"{spread:.2g} %",
                    f"{apart:.2g} %",
                    f"{correlation:.2f}" if np.isfinite(correlation) else "–",
                )
            )
        noise = 100.0 * float(results["fallen_sampling_error"].isel(model=j).max())
        title = (
            f"Share of the region that falls in one event, under {model}: {events:,} events at each level, {sample:,} "
            f"blocks of it run under each"
            + (f" (a share is uncertain by ±{two_digits(noise)} % from the sample)" if noise else "")
        )
        headings = ("level", "mean (95 %)", "5 % of events: below", "half: below", "95 %: below")
        spreads = ("standard deviation", "if blocks fell independently", "correlation of two blocks")
        yield Rows(title, (*headings, *spreads), lines)


def region_rows(results: xr.Dataset) -> Iterator[Rows]:
    """Yield, for each law, how medians, dispersions and rates of the blocks are distributed; none for other designs."""
    if not is_pooled(results):
        return
    scale, unit = display_unit(axis_of(results))
    number = int(results.attrs.get("shown_of", results.sizes["block"]))
    for j, model in enumerate(results["model"].values.tolist()):
        one = results.isel(model=j)
        heading = f"half level, {unit}" if unit else "half level"
        columns = [(heading, one[HALF].values / scale), ("β", one["dispersion"].values)]
        if "rate" in one:
            columns.append(("annual rate", one["rate"].values))
        found = [(name, np.quantile(values, SHARES)) for name, values in columns]
        lines = [
            (f"{100.0 * share:g} % of the blocks below", *(f"{values[i]:.3g}" for _, values in found))
            for i, share in enumerate(SHARES)
        ]
        title = f"The {number:,} blocks under {model}, each number by itself"
        yield Rows(title, ("", *(name for name, _ in found)), lines)
