"""Tables of a region: precision of its surfaces, joint falls, and the spread of its blocks."""

import json

import numpy as np
import xarray as xr

from ...core.parameters import USUAL_CONFIDENCE, USUAL_YEARS
from ...core.wording import given_percent, two_digits, years_text
from ...fragility.adaptive.until import MEDIAN
from ..text.block_order import HALF
from ..text.words import axis_of, display_unit, level_name
from .table import Cells, Column, Table, footnote, range_of

SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Shares of the blocks below the values of the table."""


def surfaces(results: xr.Dataset) -> Table:
    """Return the requested and the reached precision of each surface."""
    requested = float(json.loads(str(results.attrs["until"]))[MEDIAN])
    rows: list[Cells] = []
    for j, model in enumerate(results["model"].values):
        law = results.isel(model=j)
        chance, apart = float(law["check_p_value"]), float(law["lack_of_fit"])
        within = f"within chance (p = {chance:.2g})"
        beyond = f"by {100.0 * apart:.1f} % beyond chance" if apart > 0.0 else within
        rows.append({
            Column("law", "law"): str(model),
            Column("reached", "reached", "precision"): float(law["half_width"]),
            Column("motions", "motions", "count"): int(law["motions_run"]),
            Column("runs", "runs", "count"): int((results["run_model"].values == j).sum()),
            Column("apart", "difference of blocks run alone"): beyond,
            Column("stopped", "stopped because"): str(law["stopped_because"].item()),
        })  # fmt: skip
    note = footnote("half_width_of_all", 100.0 * requested)
    return Table.of("Precision of the surfaces", rows, note)


def spread(results: xr.Dataset) -> Table:
    """Return the distribution of levels, dispersions and probabilities of the blocks, by law."""
    scale, unit = display_unit(axis_of(results))
    years = years_text(float(results.attrs.get("years", USUAL_YEARS)))
    columns = (
        *(
            Column(HALF, f"half overturn at {level_name(results)}", "two", unit),
            Column("dispersion", "dispersion β", "two"),
        ),
        Column("risk_probability", f"chance in {years}", "chance"),
    )
    rows: list[Cells | str] = []
    for j, model in enumerate(results["model"].values):
        law = results.isel(model=j)
        quantiles = {
            column: np.quantile(law[column.key].values, SHARES) / (scale if column.key == HALF else 1.0)
            for column in columns
            if column.key in results
        }
        rows += [str(model)] if results.sizes["model"] > 1 else []
        for k, share in enumerate(SHARES):
            values: Cells = {column: float(of_shares[k]) for column, of_shares in quantiles.items()}
            rows.append({Column("share"): f"{given_percent(share)} of the blocks below", **values})
    number = int(results.attrs.get("shown_of", results.sizes["block"]))
    note = footnote("region", number)
    return Table.of("Blocks of the region", rows, note)


def events(results: xr.Dataset) -> Table:
    """Return the share of the region that falls in one event at each level, the levels under each law together."""
    scale, unit = display_unit(axis_of(results))
    rows: list[Cells | str] = []
    for j, model in enumerate(results["model"].values):
        rows += [str(model)] if results.sizes["model"] > 1 else []
        for k, level in enumerate(results["event_level"].values.tolist()):
            event = results.isel(model=j, event_level=k)
            few, middle, many = event["fallen_quantile"].values.tolist()
            apart = float(event["fallen_sd_independent"])
            rows.append({
                Column("level", "level", "plain", unit): level / scale,
                Column("mean", "mean", "observed"): range_of(event, "fallen_mean"),
                Column("few", "in 5 % of events, below", "observed"): few,
                Column("middle", "in half of events, below", "observed"): middle,
                Column("many", "in 95 %, below", "observed"): many,
                Column("spread", "standard deviation", "observed", priority=2): float(event["fallen_sd"]),
                Column("apart", "standard deviation if independent", "observed", priority=2): apart,
                Column("correlation", "correlation of two blocks", "hundredths", priority=2): float(
                    event["fallen_correlation"]
                ),
            })  # fmt: skip
    sample, number = int(results.attrs["event_sample"]), results.sizes["event_motion"]
    noise = float(results["fallen_sampling_error"].max())
    sampled = footnote("sampled", two_digits(100.0 * noise)) if noise else ""
    note = footnote("events", number, sample)
    return Table.of(
        "Shares of the region that fall in one event",
        rows,
        note,
        footnote("intervals", given_percent(USUAL_CONFIDENCE)),
        sampled,
    )
