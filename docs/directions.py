"""docs/directions.md and its figures: what do the second direction, the vertical component and friction change?

`make directions` runs it; runs that are finished are kept in results/directions, so that it can be interrupted.  Every
number on the page is put there by this file.
"""

from __future__ import annotations

import sys
from pathlib import Path

import directions_figures as figures
import numpy as np
from directions_answers import (
    direction_answers,
    file_answers,
    friction_answers,
    rate_answers,
    slide_answers,
    vertical_answers,
)
from directions_runs import (
    FLOORS,
    HAZARD,
    ITEMS,
    LEVELS,
    NUDGES,
    NUMBER,
    ROCKING,
    SLIPS,
    TWO_DRAWER,
    VINYL,
    Runs,
    compute,
)
from directions_tables import (
    CHANGES,
    MOST_LEFT_OUT,
    airborne_share,
    bench_table,
    case,
    direction_table,
    friction_table,
    item_table,
    level_of,
    median_table,
    rate_table,
    rates_of,
    slide_change_table,
    slides,
    slip_table,
    slipped,
    summary_table,
    vertical_table,
)
from matplotlib import rc_context
from matplotlib.figure import Figure
from paired import draws, interval
from polarity import REPLICATES, share

HERE = Path(__file__).resolve().parent


def main(out: Path = HERE, results: Path = HERE.parent / "results/directions") -> None:
    """Write the page and its figures into `out`."""
    runs = compute(results)
    yearly = {item.name: rates_of(item, runs) for item in ROCKING}
    (out / "directions").mkdir(exist_ok=True)
    with rc_context(figures.LOOKS):
        for name, figure in drawn(runs, yearly).items():
            figure.savefig(out / "directions" / f"{name}.png", dpi=figures.DPI)
    (out / "directions" / "falls.csv").write_text(falls_csv(runs), encoding="utf-8")
    (out / "directions.md").write_text(page(runs, yearly), encoding="utf-8")


FIRST = 60
"""Motions of which the file of falls has the count, too: a test runs them again."""


def falls_csv(runs: Runs) -> str:
    """Numbers of falls of every piece, case and level, of all motions and of the first of them."""
    lines = ["piece,case,rotd50_pgv_m_s,motions,falls,falls_of_first_60"]
    for name, falls in runs.falls.items():
        for label, flags in falls.items():
            for level, row in zip(LEVELS, flags, strict=True):
                lines.append(f"{name},{label},{level:g},{row.size},{row.sum()},{row[:FIRST].sum()}")
    return "\n".join(lines) + "\n"


def drawn(runs: Runs, yearly: dict[str, dict[str, np.ndarray]]) -> dict[str, Figure]:
    """The figures of the page."""
    names = [item.name for item in ROCKING]

    def changes(words: dict[str, str]) -> dict[str, list[figures.Interval | None]]:
        return {text: [change_of(runs.falls[name], change) for name in names] for change, text in words.items()}

    file = next(item for item in ITEMS if item.name == TWO_DRAWER)
    one = runs.falls[TWO_DRAWER]["one"].astype(float)
    gates = {"cannot slide": 0.0, **{contact: slides(file, contact) for contact in FLOORS}}
    slips = runs.slips[VINYL]["slide_peak"]
    return {
        "changes": figures.change_figure(
            names,
            changes({"square": "square plan", "own": "own plan"}),
            changes({"two thirds": "V/H 2/3", "full": "V/H 1", "nudged": f"times {NUDGES[1]:g}"}),
        ),
        "file": figures.file_figure(
            LEVELS,
            {f"falls: {name}": [share(row) for row in (1.0 - chance) * one] for name, chance in gates.items()},
            {
                f"slips more than {100 * beyond:g} cm": [share(row) for row in slipped(file, VINYL, slips, beyond)]
                for beyond in SLIPS
            },
        ),
        "rates": figures.rate_figure(
            names,
            {
                text: [interval(yearly[name][change] / yearly[name]["one"]) for name in names]
                for change, text in (
                    ("square", "both directions, square plan"),
                    ("own", "both directions, own plan"),
                    ("vertical", "vertical component, V/H 2/3"),
                    ("friction", "both directions, own plan, V/H 2/3, and friction on vinyl"),
                )
            },
        ),
    }


def change_of(falls: dict[str, np.ndarray], change: str) -> figures.Interval | None:
    """The change at the level of half in percentage points; None where most motions leave the piece in the air."""
    if airborne_share(falls, change) > MOST_LEFT_OUT:
        return None
    value, low, high = interval(draws(case(falls, change, level_of(0.5, falls)).difference))
    return 100.0 * value, 100.0 * low, 100.0 * high


def page(runs: Runs, yearly: dict[str, dict[str, np.ndarray]]) -> str:
    """The page: the text of directions.md.in with every number from the results."""
    tables = {
        "summary_table": summary_table(runs),
        "direction_table": direction_table(runs),
        "vertical_table": vertical_table(runs),
        "median_table": median_table(runs),
        "friction_table": friction_table(runs),
        "slip_table": slip_table(runs),
        "slide_change_table": slide_change_table(runs),
        "bench_table": bench_table(runs),
        "rate_table": rate_table(yearly),
        "item_table": item_table(),
    }
    numbers = {
        "motions": NUMBER,
        "rocking": len(ROCKING),
        "nudge": f"{NUDGES[1]:g}",
        "levels": len(LEVELS),
        "least_level": f"{LEVELS[0]:g}",
        "top_level": f"{LEVELS[-1]:g}",
        "replicates": REPLICATES,
        "hazard_level": f"{HAZARD.levels[1]:g}",
        "means": 2 * len(CHANGES),
        **direction_answers(runs),
        **vertical_answers(runs),
        **friction_answers(runs),
        **slide_answers(runs),
        **rate_answers(yearly),
        **file_answers(runs),
    }
    return (HERE / "directions.md.in").read_text(encoding="utf-8").format(**tables, **numbers)


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
