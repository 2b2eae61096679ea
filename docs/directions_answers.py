"""The numbers in the sentences of docs/directions.md."""

from __future__ import annotations

import numpy as np
from directions_runs import FLOORS, ITEMS, LEVELS, NUMBER, P58, ROCKING, SLIPS, TWO_DRAWER, VINYL, Runs
from directions_tables import (
    MOST_LEFT_OUT,
    airborne_share,
    case,
    decided_signs,
    level_of,
    medians_over,
    points,
    pooled,
    slides,
    slipped,
)
from paired import flips, interval
from polarity import share

from toppling.fragility import binomial_interval
from toppling.fragility.curves.published import fema_p58


def direction_answers(runs: Runs) -> dict[str, str]:
    """What the text states of the second direction."""
    square, long, bench = [], [], []
    for item in ROCKING:
        falls = runs.falls[item.name]
        square.append(float(medians_over(falls, "square")[0]))
        if item in P58:
            gained, _ = flips(*case(falls, "own", level_of(0.5, falls)))
            _, high = binomial_interval(gained, NUMBER, method="clopper-pearson")
            long.append(100.0 * float(high))
        elif not item.block.round:
            bench.append(float(medians_over(falls, "own")[0]))
    return {
        "square_ratios": f"{min(square):.2f}–{max(square):.2f}",
        "long_change": f"{max(long):.1f}",
        "bench_ratios": f"{min(bench):.2f}–{max(bench):.2f}",
    }


def vertical_answers(runs: Runs) -> dict[str, str]:
    """What the text states of the vertical component: means over pieces, and shares of the outcomes that change."""
    found: dict[str, str] = {}
    for change in ("two thirds", "full"):
        name = change.replace(" ", "_")
        half, tenth = (pooled(runs, change, intensity) for intensity in (0.5, 0.1))
        changed = [100.0 * float((one.difference != 0.0).mean()) for one in half.cases]
        found |= {
            f"{name}_half": points(half.mean),
            f"{name}_tenth": points(tenth.mean),
            f"{name}_pieces": str(half.number),
            f"{name}_more": str(decided_signs(half.cases).count(1)),
            f"{name}_cases": str(len(half.cases)),
            f"{name}_flips": f"{min(changed):.0f}–{max(changed):.0f} %",
        }
    ratios = []
    for falls in runs.falls.values():
        if airborne_share(falls, "two thirds") <= MOST_LEFT_OUT:
            level = level_of(0.5, falls)
            two = [np.abs(case(falls, change, level).difference).mean() for change in ("nudged", "two thirds")]
            ratios.append(float(two[0] / two[1]))
    found["nudge_share"] = f"{min(ratios):.2f}–{max(ratios):.2f}"
    held = [name for name, falls in runs.falls.items() if airborne_share(falls, "two thirds") <= MOST_LEFT_OUT]
    signs = decided_signs(pooled(runs, "two thirds", 0.5).cases)
    found["two_thirds_who"] = ", ".join(name for name, sign in zip(held, signs, strict=True) if sign > 0)
    found["two_thirds_left_out"] = ", ".join(
        f"{100 * airborne_share(runs.falls[name], 'two thirds'):.0f} %"
        for name, sign in zip(held, signs, strict=True)
        if sign > 0
    )
    falls = runs.falls[TWO_DRAWER]
    for change in ("two thirds", "full"):
        gone = airborne_share(falls, change)
        found[f"{change.replace(' ', '_')}_gone"] = f"{100 * gone:.0f} %"
    return found


def friction_answers(runs: Runs) -> dict[str, str]:
    """What the text states of the pieces on vinyl."""
    chances = {item.name: slides(item, VINYL) for item in ROCKING}
    return {
        "slides_slender": f"{chances['bookcase-6-shelf']:.3f}",
        "slides_short": f"{chances['bookcase-2-shelf']:.2f}",
        "slides_file": f"{chances[TWO_DRAWER]:.3f}",
    }


def slide_answers(runs: Runs) -> dict[str, str]:
    """What the text states of slips beyond 10 cm on vinyl at 1 m/s, in one direction and both."""
    slips, level = runs.slips[VINYL], LEVELS.index(1.0)
    one = slips["slide_peak"][:, level]
    before, both = ((part > SLIPS[1]).mean(0) for part in (one, slips["both"][:, level]))
    return {"slide_one": str(share(before)), "slide_both": points(both - before)}


def rate_answers(yearly: dict[str, dict[str, np.ndarray]]) -> dict[str, str]:
    """What the text states of annual rates: ranges of ratios, and the ends of their intervals."""
    square = [float(own["square"][0] / own["one"][0]) for own in yearly.values()]
    vertical = [interval(own["vertical"] / own["one"]) for own in yearly.values()]
    return {
        "rate_square": f"{min(square):.2f}–{max(square):.2f}",
        "rate_vertical": f"{min(one[1] for one in vertical):.2f} and {max(one[2] for one in vertical):.2f}",
    }


def file_answers(runs: Runs) -> dict[str, str]:
    """What the text states of the two-drawer file."""
    file = next(item for item in ITEMS if item.name == TWO_DRAWER)
    published = float(fema_p58()["median"].sel(block=TWO_DRAWER))
    level = int(np.argmin(np.abs(np.log(np.array(LEVELS) / published))))
    half = level_of(0.5, runs.falls[TWO_DRAWER])
    found = {
        "file_limit": f"{file.limit:.3f}",
        "file_slender": f"{1.0 / file.limit:.1f}",
        "file_published": f"{published:.2f}",
        "file_level": f"{LEVELS[level]:g}",
        "file_half": f"{LEVELS[half]:g}",
    }
    for contact in FLOORS:
        found[f"file_{contact.replace(' ', '_')}"] = f"{slides(file, contact):.3f}"
    for name, at in (("published", level), ("half", half)):
        fallen = runs.falls[TWO_DRAWER]["one"][at].astype(float)
        found[f"file_falls_{name}"] = str(share(fallen))
        found[f"file_left_{name}"] = str(share((1.0 - slides(file, VINYL)) * fallen))
        for beyond in SLIPS:
            slips = slipped(file, VINYL, runs.slips[VINYL]["slide_peak"][:, [at]], beyond)[0]
            found[f"file_slips_{100 * beyond:g}_{name}"] = str(share(slips))
    return found
