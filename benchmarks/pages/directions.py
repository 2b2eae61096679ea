"""The page docs/directions.md and its figure: the second direction, the vertical component and friction.

Finished runs are kept in results/directions, so that it can be interrupted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ...fragility import binomial_interval
from ...fragility.curves.published import fema_p58
from ...models.friction import CONTACTS
from .directions_runs import (
    BENCH,
    EDGE,
    FLOORS,
    ITEMS,
    LEVELS,
    NUDGE,
    NUMBER,
    P58,
    ROCKING,
    SLIPS,
    TWO_DRAWER,
    VINYL,
    Item,
    Runs,
    coefficients,
    compute,
)
from .figures import DPI, looks, new, whiskers
from .page import save, template, write, write_csv
from .shares import REPLICATES, change, draws, flips, holm, interval, medians, share, sign_test
from .tables import Interval, body, span

Falls = dict[str, np.ndarray]
"""Flags (level, motion) of a piece by case."""
Rows = Iterator[tuple[object, ...]]
FIRST = 60
"""Motions of which the file of falls has the count, too: a test runs them again."""


def main() -> None:
    """Write the page, its figure and the numbers of falls."""
    runs = compute()
    with looks("xtick.labelsize", "ytick.labelsize"):
        save("directions", {"changes": changes_figure(runs)}, DPI)
    for table, (headings, rows) in TABLES.items():
        write_csv("directions", table, headings, rows(runs))
    write("directions", page(runs))


# Comparisons ---------------------------------------------------------------------------------------------------------


class Case(NamedTuple):
    """Outcomes of a piece at one level, with and without what is added: flags (motion,) of the motions compared."""

    before: np.ndarray
    after: np.ndarray

    def __str__(self) -> str:
        """The paired difference in percentage points with its 95 % interval."""
        return change(self.difference)

    @property
    def difference(self) -> np.ndarray:
        """Change of the outcome of every motion: 1, 0 or -1."""
        return np.asarray(self.after.astype(float) - self.before)

    @property
    def flipped(self) -> str:
        """Shares of the motions that fall only after, and only before, in per cent."""
        return " / ".join(f"{100 * number / self.before.size:.1f}" for number in flips(self.before, self.after))

    @property
    def p(self) -> float:
        """The p-value of the exact test of the outcomes that changed."""
        return sign_test(self.before, self.after)


CHANGES = {
    "square": "both directions, square plan",
    "own": "both directions, own plan",
    "two thirds": "vertical component, V/H 2/3",
    "full": "vertical component, V/H 1",
    "nudged": f"the component times {NUDGE:g}",
    "other": "the other component alone",
}
"""Changes compared with one component, in words; the last two are controls."""
ACROSS = {"square": "other", "own": "deep"}
"""The case of the other axis that a change with both directions adds."""
VERTICAL = ("two thirds", "full")
MOST_POOLED, MOST_LEFT_OUT = 0.2, 0.5
"""Share of the motions that leave the piece in the air up to which a piece is in means over pieces, and up to which a
change is given at all."""


def level_of(part: float, falls: Falls) -> int:
    """Return the level at which one component overturns a piece in a share of the motions, as the levels allow."""
    return int(np.argmin(np.abs(falls["one"].mean(-1) - part)))


def changed(falls: Falls, name: str) -> np.ndarray:
    """Return the falls (level, motion) with a change."""
    return falls["one"] | falls[ACROSS[name]] if name in ACROSS else falls[name]


def airborne(falls: Falls, name: str, level: int) -> np.ndarray:
    """Return the motions (motion,) that take the floor from under the piece: none without the vertical component."""
    return np.asarray(falls.get(f"airborne {name}", np.zeros_like(falls["one"]))[level])


def airborne_share(falls: Falls, name: str) -> float:
    """Return the share of such motions at the level of half."""
    return float(airborne(falls, name, level_of(0.5, falls)).mean())


def case(falls: Falls, name: str, level: int) -> Case:
    """Return a piece at a level with one component and with a change, under the motions in which the floor holds it."""
    stays = ~airborne(falls, name, level)
    return Case(falls["one"][level][stays], changed(falls, name)[level][stays])


def medians_over(falls: Falls, name: str) -> np.ndarray:
    """Return replicates (replicate,) of the median under one component over the median with a change."""
    single, both = (medians(draws(flags), np.array(LEVELS)) for flags in (falls["one"], changed(falls, name)))
    return np.asarray(single / both)


class Pooled(NamedTuple):
    """A change in several pieces at one intensity."""

    mean: np.ndarray
    """Mean difference (motion,) of the pieces that at most a fifth of the motions leaves in the air.

    A motion that leaves a piece in the air is one without a change of it.
    """
    number: int
    """Pieces in that mean."""
    cases: dict[str, Case]
    """All pieces that at most half of the motions leave in the air."""

    @property
    def signs(self) -> list[int]:
        """The sign of every change that is decided (Holm, 5 % for all of the pieces together), 0 for the others."""
        held = holm([test.p for test in self.cases.values()])
        return [int(np.sign(test.difference.sum())) * yes for test, yes in zip(self.cases.values(), held, strict=True)]


def pooled(runs: Runs, name: str, part: float) -> Pooled:
    """Return a change at the level at which one component overturns each piece in a share of the motions."""
    means, cases = [], {}
    for piece, falls in runs.falls.items():
        level = level_of(part, falls)
        gone = airborne(falls, name, level)
        if gone.mean() > MOST_LEFT_OUT:
            continue
        cases[piece] = case(falls, name, level)
        if gone.mean() <= MOST_POOLED:
            difference = np.zeros(gone.size)
            difference[~gone] = cases[piece].difference
            means.append(difference)
    return Pooled(np.mean(means, axis=0), len(means), cases)


def slides(item: Item, contact: str) -> float:
    """Return the probability that a piece slides in place of rocking: that its friction is below b/h."""
    return float(CONTACTS[contact].friction.below(item.limit))


def undecided(item: Item, contact: str) -> float:
    """Return the probability of a friction from b/h to 1.3 b/h, where neither sliding nor rocking alone is certain."""
    return float(CONTACTS[contact].friction.below(1.3 * item.limit)) - slides(item, contact)


def slipped(item: Item, contact: str, slips: np.ndarray, beyond: float) -> np.ndarray:
    """Return the probability over friction (motion,) that a piece slides farther than a distance, m."""
    gated = coefficients(contact) < item.limit
    return np.asarray(((slips > beyond) & gated[:, None]).mean(0))


def over_edge(item: Item, contact: str, slips: Mapping[str, np.ndarray], level: int) -> np.ndarray:
    """Return the probability over friction and both ways round (motion,) that a piece slides over an edge 0.1 m off."""
    front, _ = EDGE.slips(item.block.b)
    forward, backward = (
        slipped(item, contact, slips[name][:, level], front) for name in ("slide_forward", "slide_backward")
    )
    return np.asarray(0.5 * (forward + backward))


# Tables --------------------------------------------------------------------------------------------------------------


def falls_rows(runs: Runs) -> Rows:
    """Yield numbers of falls of every piece, case and level, of all motions and of the first of them."""
    for name, falls in runs.falls.items():
        for label, flags in falls.items():
            for level, row in zip(LEVELS, flags, strict=True):
                yield name, label, f"{level:g}", row.size, row.sum(), row[:FIRST].sum()


def summary_rows(runs: Runs) -> Rows:
    """Yield every change in the mean of the pieces, at two intensities, and in how many pieces it is decided."""
    for name, words in CHANGES.items():
        cells = []
        for part in (0.5, 0.1):
            pool = pooled(runs, name, part)
            signs = pool.signs
            cells += [
                f"{change(pool.mean)}, {pool.number} pieces",
                f"{signs.count(1)} / {signs.count(-1)} of {len(signs)}",
            ]
        yield words, *cells


def at_half(runs: Runs) -> Iterator[tuple[Item, Falls, int, str]]:
    """Yield every piece with its falls and the level at which one component overturns it in half, also in words."""
    for item in ROCKING:
        level = level_of(0.5, runs.falls[item.name])
        yield item, runs.falls[item.name], level, f"{LEVELS[level]:g}"


def direction_rows(runs: Runs) -> Rows:
    """Yield what the second direction changes, piece by piece."""
    for item, falls, level, pgv in at_half(runs):
        square, own_plan = (case(falls, name, level) for name in ACROSS)
        plan = f"{(item.block.depth or 0.0) / item.block.width:.2f}"
        percent = f"{100 * square.before.mean():.0f}"
        ratios = [f"{interval(medians_over(falls, name)):.3f}" for name in ACROSS]
        yield item.name, pgv, percent, square, ratios[0], plan, own_plan, ratios[1]


def vertical_rows(runs: Runs) -> Rows:
    """Yield what the vertical component changes, piece by piece, and what a factor of 1.001 changes."""
    for item, falls, level, pgv in at_half(runs):
        cells: list[object] = []
        for name in VERTICAL:
            gone, outcome = airborne_share(falls, name), case(falls, name, level)
            cells += [f"{100 * gone:.0f}", *(("–", "–") if gone > MOST_LEFT_OUT else (outcome, outcome.flipped))]
        nudged = case(falls, "nudged", level)
        yield item.name, pgv, *cells, nudged, nudged.flipped


def friction_rows(runs: Runs) -> Rows:
    """Yield how likely a piece slides in place of rocking, and falls all the same, at the level of half."""
    for item, falls, level, pgv in at_half(runs):
        fell = falls["one"][level].astype(float)
        sliding = [slides(item, contact) for contact in FLOORS]
        chances = [f"{chance:.3f}" for chance in sliding]
        left = [share((1.0 - chance) * fell) for chance in sliding]
        yield item.name, f"{item.limit:.2f}", *chances, f"{undecided(item, VINYL):.2f}", pgv, share(fell), *left


def slide_change_rows(runs: Runs) -> Rows:
    """Yield what the second direction and the vertical component change of slips on vinyl."""
    slips = runs.slips[VINYL]
    for level in map(LEVELS.index, (0.5, 0.8, 1.0, 1.6)):
        parts = [slips[name][:, level] for name in ("slide_peak", "both", "lifted")]
        stays = np.isfinite(parts[2][0])
        for beyond in SLIPS:
            before, two, up = ((part > beyond).mean(0) for part in parts)
            cells = (share(before), change(two - before), change((up - before)[stays]))
            yield f"{LEVELS[level]:g}", f"{100 * beyond:g}", *cells, f"{100 * (1.0 - stays.mean()):.0f}"


def bench_rows(runs: Runs) -> Rows:
    """Yield bench-top pieces: overturning and falling off an edge."""
    for item in BENCH:
        for level in map(LEVELS.index, (0.5, 1.0, 2.0)):
            fallen = runs.falls[item.name]["one"][level].astype(float) if item.rocks else None
            cells: list[object] = ["–" if fallen is None else share(fallen)]
            for contact in FLOORS[:2]:
                chance = slides(item, contact)
                left = "–" if fallen is None else share((1.0 - chance) * fallen)
                cells += [f"{chance:.2f}", left, share(over_edge(item, contact, runs.slips[contact], level))]
            yield item.name, f"{LEVELS[level]:g}", *cells


def item_rows(_: Runs | None = None) -> Rows:
    """Yield the pieces."""
    for item in ITEMS:
        block = item.block
        plan = f"⌀ {block.width:g}" if block.round else f"{block.width:.3g} × {block.depth:.3g}"
        yield item.name, plan, f"{block.h:.3g}", f"{item.limit:.2f}", f"{block.inertia:.2f}", item.source


ADDED = "V/H {}: airborne (%)", "V/H {}: change (points)", "V/H {}: flips + / − (%)"
ON_BENCH = "{}: slides", "{}: overturns (%)", "{}: over the edge (%)"
SLIDING = tuple(f"slides: {contact}" for contact in FLOORS)
FALLING = tuple(f"falls: {contact} (%)" for contact in FLOORS)
TABLES: dict[str, tuple[tuple[str, ...], Callable[[Runs], Rows]]] = {
    "falls": (("piece", "case", "rotd50_pgv_m_s", "motions", "falls", f"falls_of_first_{FIRST}"), falls_rows),
    "pieces": (("piece", "plan (m)", "mass at (m)", "b/h", "λ", "source"), item_rows),
    "second_direction": (
        ("piece", "PGV (m/s)", "one component (%)", "square plan: change (points)", "square plan: ratio of medians",
         "own plan: depth/width", "own plan: change (points)", "own plan: ratio of medians"),
        direction_rows,
    ),
    "vertical": (
        ("piece", "PGV (m/s)", *(head.format(ratio) for ratio in ("2/3", "1") for head in ADDED),
         f"times {NUDGE:g}: change (points)", f"times {NUDGE:g}: flips + / − (%)"),
        vertical_rows,
    ),
    "friction": (
        ("piece", "b/h", *SLIDING, f"undecided: {VINYL}", "PGV (m/s)", "falls, cannot slide (%)", *FALLING),
        friction_rows,
    ),
    "slips": (
        ("PGV (m/s)", "slip > (cm)", "one component (%)", "both directions: change (points)",
         "V/H 2/3: change (points)", "airborne (%)"),
        slide_change_rows,
    ),
    "bench": (
        ("piece", "PGV (m/s)", "overturns, cannot slide (%)",
         *(head.format(contact) for contact in FLOORS[:2] for head in ON_BENCH)),
        bench_rows,
    ),
}  # fmt: skip
"""Files of the page, with their headings."""


# Figures -------------------------------------------------------------------------------------------------------------


def change_of(falls: Falls, name: str) -> Interval | None:
    """Return the change at the level of half in points; None where most motions leave the piece in the air."""
    if airborne_share(falls, name) > MOST_LEFT_OUT:
        return None
    return interval(draws(case(falls, name, level_of(0.5, falls)).difference)).times(100.0)


def changes_figure(runs: Runs) -> Figure:
    """Draw changes of the chance of falling of every piece: by the second direction, and vertically."""
    figure, panels = new(8.6, 1, 2, sharey=True, sharex=True)
    shown = (
        {"square": "square plan", "own": "own plan"},
        {"two thirds": "V/H 2/3", "full": "V/H 1", "nudged": f"times {NUDGE:g}"},
    )
    for ax, words, first in zip(panels, shown, (0, 2), strict=True):
        ax.axvline(0.0, color="0.3", lw=1.0)
        series = {text: [change_of(falls, name) for falls in runs.falls.values()] for name, text in words.items()}
        whiskers(ax, [*runs.falls], series, first)
        ax.legend(loc="lower left", bbox_to_anchor=(-0.05, 1.0), frameon=False, handlelength=1.2, borderaxespad=0.2)
    figure.supxlabel("change of the chance of falling, percentage points", fontsize=10.5)
    return figure


# The page ------------------------------------------------------------------------------------------------------------


def page(runs: Runs) -> str:
    """Return the page: its template with every number from the results."""
    chances = {item.name: slides(item, VINYL) for item in ROCKING}
    return template("directions").format(
        summary_table=body(summary_rows(runs)),
        motions=NUMBER,
        rocking=len(ROCKING),
        nudge=NUDGE,
        levels=len(LEVELS),
        least_level=LEVELS[0],
        top_level=LEVELS[-1],
        replicates=REPLICATES,
        means=2 * len(CHANGES),
        slides_slender=chances["bookcase-6-shelf"],
        slides_short=chances["bookcase-2-shelf"],
        slides_file=chances[TWO_DRAWER],
        **direction_answers(runs),
        **vertical_answers(runs),
        **slide_answers(runs),
        **file_answers(runs),
    )


def direction_answers(runs: Runs) -> dict[str, str]:
    """Return what the text states of the second direction."""
    square, long, bench = [], [], []
    for item, falls, level, _ in at_half(runs):
        square.append(medians_over(falls, "square")[0])
        if item in P58:
            gained, _ = flips(*case(falls, "own", level))
            long.append(100.0 * float(binomial_interval(gained, NUMBER, method="clopper-pearson")[1]))
        elif not item.block.round:
            bench.append(medians_over(falls, "own")[0])
    return {"square_ratios": span(square), "long_change": f"{max(long):.1f}", "bench_ratios": span(bench)}


def vertical_answers(runs: Runs) -> dict[str, str]:
    """Return what the text states of the vertical component: means over pieces, and shares of outcomes that change."""
    values: dict[str, str] = {}
    for name in VERTICAL:
        half, tenth = (pooled(runs, name, part) for part in (0.5, 0.1))
        means = {"half": change(half.mean), "tenth": change(tenth.mean), "pieces": str(half.number)}
        values |= {f"{name.replace(' ', '_')}_{key}": text for key, text in means.items()}
    two_thirds = pooled(runs, "two thirds", 0.5)
    flipped = {name: np.abs(pooled_case.difference).mean() for name, pooled_case in two_thirds.cases.items()}
    nudged = {
        name: np.abs(case(falls, "nudged", level_of(0.5, falls)).difference).mean()
        for name, falls in runs.falls.items()
        if name in flipped
    }
    more = [name for name, sign in zip(two_thirds.cases, two_thirds.signs, strict=True) if sign > 0]
    gone = {name: f"{100 * airborne_share(falls, 'two thirds'):.0f} %" for name, falls in runs.falls.items()}
    return values | {
        "two_thirds_more": str(two_thirds.signs.count(1)),
        "two_thirds_cases": str(len(two_thirds.cases)),
        "two_thirds_flips": span([100.0 * part for part in flipped.values()], ".0f") + " %",
        "two_thirds_gone": gone[TWO_DRAWER],
        "nudge_share": span([nudged[name] / flipped[name] for name in flipped]),
        "two_thirds_who": ", ".join(more),
        "two_thirds_left_out": ", ".join(gone[name] for name in more),
    }


def slide_answers(runs: Runs) -> dict[str, str]:
    """Return what the text states of slips beyond 10 cm on vinyl at 1 m/s, in one direction and both."""
    level = LEVELS.index(1.0)
    single, both = ((runs.slips[VINYL][name][:, level] > SLIPS[1]).mean(0) for name in ("slide_peak", "both"))
    return {"slide_one": str(share(single)), "slide_both": change(both - single)}


def file_answers(runs: Runs) -> dict[str, str]:
    """Return what the text states of the two-drawer file."""
    file = next(item for item in ITEMS if item.name == TWO_DRAWER)
    published = float(fema_p58()["median"].sel(block=TWO_DRAWER))
    levels = {
        "published": int(np.argmin(np.abs(np.log(np.array(LEVELS) / published)))),
        "half": level_of(0.5, runs.falls[TWO_DRAWER]),
    }
    values = {
        "file_limit": f"{file.limit:.3f}",
        "file_slender": f"{1.0 / file.limit:.1f}",
        "file_published": f"{published:.2f}",
        "file_level": f"{LEVELS[levels['published']]:g}",
        "file_half": f"{LEVELS[levels['half']]:g}",
    }
    for contact in FLOORS:
        values[f"file_{contact.replace(' ', '_')}"] = f"{slides(file, contact):.3f}"
    for name, level in levels.items():
        fallen = runs.falls[TWO_DRAWER]["one"][level].astype(float)
        values[f"file_falls_{name}"] = str(share(fallen))
        values[f"file_left_{name}"] = str(share((1.0 - slides(file, VINYL)) * fallen))
        for beyond in SLIPS:
            slips = slipped(file, VINYL, runs.slips[VINYL]["slide_peak"][:, level], beyond)
            values[f"file_slips_{100 * beyond:g}_{name}"] = str(share(slips))
    return values
