"""The comparisons and tables of docs/directions.md."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from directions_runs import (
    BENCH,
    EDGE,
    FLOORS,
    HAZARD,
    ITEMS,
    LEVELS,
    NUDGES,
    ROCKING,
    SLIPS,
    VINYL,
    Item,
    Runs,
    coefficients,
)
from paired import draws, flips, holm, interval, medians, sign_test
from polarity import share

from toppling.models.friction import CONTACTS


class Case(NamedTuple):
    """Outcomes of a piece at one level, with and without what is added: flags (motion,) of the motions compared."""

    before: np.ndarray
    after: np.ndarray

    def __str__(self) -> str:
        """The paired difference in percentage points with its 95 % interval."""
        return points(self.difference)

    @property
    def difference(self) -> np.ndarray:
        """Change of the outcome of every motion: 1, 0 or -1."""
        return self.after.astype(float) - self.before

    @property
    def flipped(self) -> str:
        """Shares of the motions that fall only after, and only before, in per cent."""
        gained, lost = flips(self.before, self.after)
        return f"{100 * gained / self.before.size:.1f} / {100 * lost / self.before.size:.1f}"

    @property
    def p(self) -> float:
        """The p-value of the exact test of the outcomes that changed."""
        return sign_test(self.before, self.after)


def level_of(share: float, falls: dict[str, np.ndarray]) -> int:
    """The level at which one component overturns a piece in a share of the motions, as nearly as the levels allow."""
    return int(np.argmin(np.abs(falls["one"].mean(-1) - share)))


CHANGES = {
    "square": "both directions, square plan",
    "own": "both directions, own plan",
    "two thirds": "vertical component, V/H 2/3",
    "full": "vertical component, V/H 1",
    "nudged": f"the component times {NUDGES[1]:g}",
    "nudged down": f"the component times {NUDGES[0]:g}",
    "other": "the other component in place of the first",
}
"""What is compared with one component, in words; the last three are controls."""


def case(falls: dict[str, np.ndarray], change: str, level: int) -> Case:
    """A piece at a level with one component and with a change, under the motions in which the floor holds it."""
    one = falls["one"][level]
    if change in ("square", "own"):
        return Case(one, one | falls["other" if change == "square" else "deep"][level])
    stays = ~airborne(falls, change, level)
    return Case(one[stays], falls[change][level][stays])


def airborne(falls: dict[str, np.ndarray], change: str, level: int) -> np.ndarray:
    """Motions (motion,) that take the floor from under the piece: none without the vertical component."""
    name = f"airborne {change}"
    return falls[name][level] if name in falls else np.zeros_like(falls["one"][level])


def airborne_share(falls: dict[str, np.ndarray], change: str) -> float:
    """The share of such motions at the level of half."""
    return float(airborne(falls, change, level_of(0.5, falls)).mean())


MOST_AIRBORNE, MOST_POOLED, MOST_LEFT_OUT = 0.02, 0.2, 0.5
"""Share of the motions that leave the piece in the air up to which ratios of medians are given, up to which a piece is
in means over pieces, and up to which a change is given at all."""


def medians_over(falls: dict[str, np.ndarray], change: str) -> np.ndarray:
    """Replicates (replicate,) of the median under one component over the median with a change."""
    if change in ("square", "own"):
        changed = falls["one"] | falls["other" if change == "square" else "deep"]
    else:
        changed = falls[change]
    one, two = (medians(draws(flags), np.array(LEVELS)) for flags in (falls["one"], changed))
    return np.asarray(one / two)


def ratio_of_medians(falls: dict[str, np.ndarray], change: str) -> str:
    """That ratio with its interval; a dash where the vertical component leaves too many pieces in the air."""
    if airborne_share(falls, change) > MOST_AIRBORNE:
        return "–"
    return f"{span(interval(medians_over(falls, change)), 3)}"


def span(found: tuple[float, float, float], digits: int) -> str:
    """A value with its interval."""
    value, low, high = (f"{one:.{digits}f}" for one in found)
    return f"{value} ({low}–{high})"


def points(difference: np.ndarray) -> str:
    """A mean of differences (motion,) in percentage points, with its bootstrap interval."""
    value, low, high = (100.0 * one for one in interval(draws(difference)))
    return f"{value:+.1f} ({low:+.1f} to {high:+.1f})".replace("-", "−")


class Pooled(NamedTuple):
    """A change in several pieces at one intensity."""

    mean: np.ndarray
    """Mean difference (motion,) of the pieces that at most a fifth of the motions leaves in the air.

    A motion that leaves a piece in the air is one without a change of it.
    """
    number: int
    """Pieces in that mean."""
    cases: list[Case]
    """All pieces that at most half of the motions leave in the air."""


def pooled(runs: Runs, change: str, intensity: float) -> Pooled:
    """A change at the level at which one component overturns each piece in a share of the motions."""
    means, cases = [], []
    for falls in runs.falls.values():
        level = level_of(intensity, falls)
        gone = airborne(falls, change, level)
        if gone.mean() > MOST_LEFT_OUT:
            continue
        cases.append(case(falls, change, level))
        if gone.mean() <= MOST_POOLED:
            difference = np.zeros(gone.size)
            difference[~gone] = cases[-1].difference
            means.append(difference)
    return Pooled(np.mean(means, axis=0), len(means), cases)


def summary_table(runs: Runs) -> str:
    """Every change in the mean of the pieces, at two intensities, and in how many pieces it is decided."""
    rows = []
    for change, words in CHANGES.items():
        cells = []
        for intensity in (0.5, 0.1):
            found = pooled(runs, change, intensity)
            signs = decided_signs(found.cases)
            cells += [
                f"{points(found.mean)}, {found.number} pieces",
                f"{signs.count(1)} / {signs.count(-1)} of {len(signs)}",
            ]
        rows.append((words, *cells))
    headings = ("one component, and …", "half: mean (points)", "half: more / fewer", "a tenth: mean (points)")
    return table((*headings, "a tenth: more / fewer"), rows)


def decided_signs(cases: list[Case]) -> list[int]:
    """The sign of every change that is decided (Holm, 5 % for all of the pieces together), 0 for the others."""
    held = holm([one.p for one in cases])
    return [int(np.sign(one.difference.sum())) if yes else 0 for one, yes in zip(cases, held, strict=True)]


def direction_table(runs: Runs) -> str:
    """What the second direction changes, piece by piece."""
    rows = []
    for item in ROCKING:
        falls = runs.falls[item.name]
        level = level_of(0.5, falls)
        square, own = (case(falls, change, level) for change in ("square", "own"))
        assert item.block.depth is not None
        rows.append(
            (
                item.name,
                f"{LEVELS[level]:g}",
                f"{100 * square.before.mean():.0f}",
                str(square),
                ratio_of_medians(falls, "square"),
                f"{item.block.depth / item.block.width:.2f}",
                str(own),
                ratio_of_medians(falls, "own"),
            )
        )
    headings = ["piece", "PGV (m/s)", "one component (%)", "square plan: change (points)"]
    headings += ["square plan: ratio of medians", "own plan: depth/width", "own plan: change (points)"]
    return table((*headings, "own plan: ratio of medians"), rows)


def vertical_table(runs: Runs) -> str:
    """What the vertical component changes, piece by piece, beside a factor of 1.001."""
    rows = []
    for item in ROCKING:
        falls = runs.falls[item.name]
        level = level_of(0.5, falls)
        cells = []
        for change in ("two thirds", "full"):
            gone = airborne_share(falls, change)
            own = case(falls, change, level)
            few = gone > MOST_LEFT_OUT
            cells += [f"{100 * gone:.0f}", *(("–", "–") if few else (str(own), own.flipped))]
        nudged = case(falls, "nudged", level)
        rows.append((item.name, f"{LEVELS[level]:g}", *cells, str(nudged), nudged.flipped))
    headings = ["piece", "PGV (m/s)"]
    for ratio in ("2/3", "1"):
        headings += [f"V/H {ratio}: airborne (%)", f"V/H {ratio}: change (points)", f"V/H {ratio}: flips + / − (%)"]
    return table((*headings, f"times {NUDGES[1]:g}: change (points)", f"times {NUDGES[1]:g}: flips + / − (%)"), rows)


def median_table(runs: Runs) -> str:
    """The median with the vertical component over the median without, where few motions leave a piece in the air."""
    rows = []
    for item in ROCKING:
        falls = runs.falls[item.name]
        cells = [ratio_of_medians(falls, change) for change in ("two thirds", "full")]
        if set(cells) != {"–"}:
            rows.append((item.name, *cells))
    return table(("piece", "V/H 2/3", "V/H 1"), rows)


def slides(item: Item, contact: str) -> float:
    """The probability that a piece slides in place of rocking: that its friction is below b/h."""
    return float(CONTACTS[contact].friction.below(item.limit))


def undecided(item: Item, contact: str) -> float:
    """The probability of a friction between b/h and 1.3 b/h, where neither pure sliding nor pure rocking is certain."""
    return float(CONTACTS[contact].friction.below(1.3 * item.limit)) - slides(item, contact)


def gated(item: Item, contact: str) -> np.ndarray:
    """Coefficients (draw,) with which a piece slides in place of rocking."""
    return np.asarray(coefficients(contact) < item.limit)


def slipped(item: Item | None, contact: str, slips: np.ndarray, beyond: float) -> np.ndarray:
    """The probability over friction (level, motion) that a piece slides farther than a distance, m.

    Without a piece: of one that slides at every friction.
    """
    far = slips > beyond
    if item is not None:
        far = far & gated(item, contact)[:, None, None]
    return np.asarray(far.mean(0))


def over_edge(item: Item, contact: str, slips: dict[str, np.ndarray]) -> np.ndarray:
    """The probability over friction and both ways round (level, motion) that a piece slides over an edge 0.1 m off."""
    front, _ = EDGE.slips(item.block.b)
    ways = [slipped(item, contact, slips[name], front) for name in ("slide_forward", "slide_backward")]
    return np.asarray(0.5 * (ways[0] + ways[1]))


def friction_table(runs: Runs) -> str:
    """The gate: how likely a piece slides in place of rocking, and falls all the same, at the level of half."""
    rows = []
    for item in ROCKING:
        falls = runs.falls[item.name]
        level = level_of(0.5, falls)
        one = falls["one"][level].astype(float)
        own = [slides(item, contact) for contact in FLOORS]
        rows.append(
            (
                item.name,
                f"{item.limit:.2f}",
                *(f"{one:.3f}" for one in own),
                f"{undecided(item, VINYL):.2f}",
                f"{LEVELS[level]:g}",
                str(share(one)),
                *(str(share((1.0 - chance) * one)) for chance in own),
            )
        )
    headings = ["piece", "b/h", *(f"slides: {one}" for one in FLOORS), "undecided: vinyl", "PGV (m/s)"]
    return table((*headings, "falls, cannot slide (%)", *(f"falls: {one} (%)" for one in FLOORS)), rows)


def slip_table(runs: Runs) -> str:
    """How far pieces slide at the level at which one component overturns them in half of the motions."""
    rows = []
    for item in ROCKING:
        level = level_of(0.5, runs.falls[item.name])
        cells = []
        for contact in FLOORS:
            for beyond in SLIPS if contact == VINYL else SLIPS[1:2]:
                cells.append(
                    str(share(slipped(item, contact, runs.slips[contact]["slide_peak"][:, [level]], beyond)[0]))
                )
        rows.append((item.name, f"{LEVELS[level]:g}", *cells))
    headings = [f"{VINYL}: > {100 * one:g} cm (%)" for one in SLIPS]
    headings += [f"{one}: > {100 * SLIPS[1]:g} cm (%)" for one in FLOORS[1:]]
    return table(("piece", "PGV (m/s)", *headings), rows)


SLIDE_LEVELS = (0.5, 0.8, 1.0, 1.6)


def slide_change_table(runs: Runs) -> str:
    """What the second direction and the vertical component change of slips on vinyl."""
    slips = runs.slips[VINYL]
    rows = []
    for level in map(LEVELS.index, SLIDE_LEVELS):
        one, lifted_one = slips["slide_peak"][:, level], slips["lifted"][:, level]
        both = slips["both"][:, level]
        stays = np.isfinite(lifted_one[0])
        for beyond in SLIPS:
            before, two, up = ((part > beyond).mean(0) for part in (one, both, lifted_one))
            rows.append(
                (
                    f"{LEVELS[level]:g}",
                    f"{100 * beyond:g}",
                    str(share(before)),
                    points(two - before),
                    points((up - before)[stays]),
                    f"{100 * (1.0 - stays.mean()):.0f}",
                )
            )
    headings = ("PGV (m/s)", "slip > (cm)", "one component (%)", "both directions: change (points)")
    return table((*headings, "V/H 2/3: change (points)", "airborne (%)"), rows)


BENCH_LEVELS = (0.5, 1.0, 2.0)
BENCH_CONTACTS = FLOORS[:2]


def bench_table(runs: Runs) -> str:
    """Bench-top pieces: overturning and falling off an edge."""
    rows = []
    for item in BENCH:
        for level in map(LEVELS.index, BENCH_LEVELS):
            fallen = runs.falls[item.name]["one"][level].astype(float) if item.rocks else None
            cells = [item.name, f"{LEVELS[level]:g}", "–" if fallen is None else str(share(fallen))]
            for contact in BENCH_CONTACTS:
                slips = {name: values[:, [level]] for name, values in runs.slips[contact].items()}
                chance = slides(item, contact)
                cells += [
                    f"{chance:.2f}",
                    "–" if fallen is None else str(share((1.0 - chance) * fallen)),
                    str(share(over_edge(item, contact, slips)[0])),
                ]
            rows.append(tuple(cells))
    headings = ["piece", "PGV (m/s)", "overturns, cannot slide (%)"]
    for contact in BENCH_CONTACTS:
        headings += [f"{contact}: slides", f"{contact}: overturns (%)", f"{contact}: over the edge (%)"]
    return table(tuple(headings), rows)


def rates(chances: np.ndarray) -> np.ndarray:
    """Annual rates (...) from probabilities (..., level): the mean of two levels counts for what lies between them."""
    exceeded = np.asarray(HAZARD.rate_at(np.array(LEVELS)))
    ends = np.concatenate([0.5 * (chances[..., :-1] + chances[..., 1:]), chances[..., -1:]], axis=-1)
    # (weights of a bootstrap draw sum up to 1 but for rounding)
    return np.asarray(np.minimum(ends, 1.0) @ (exceeded - np.append(exceeded[1:], 0.0)))


RATES = ("one", "square", "own", "vertical", "all", "at most", "friction", "slip")
"""One component; both directions of a square and of the own plan; with vertical shaking; own plan and vertical shaking,
also where all that are in the air fall; all of it on vinyl; slips beyond 10 cm on vinyl."""


def rates_of(item: Item, runs: Runs) -> dict[str, np.ndarray]:
    """Replicates (replicate,) of the annual rates of a piece; in the air it does as without vertical shaking."""
    falls, slips = runs.falls[item.name], runs.slips[VINYL]
    one, gone = falls["one"], falls["airborne two thirds"]
    own = one | falls["deep"]
    every = np.where(gone, own, falls["two thirds"] | falls["deep two thirds"])
    upward, still = slips["both, lifted"], slips["both"]
    far = slipped(item, VINYL, np.where(np.isfinite(upward), upward, still), SLIPS[1])
    flags = {
        "one": one,
        "square": one | falls["other"],
        "own": own,
        "vertical": np.where(gone, one, falls["two thirds"]),
        "all": every,
        "at most": every | gone,
        "friction": (1.0 - slides(item, VINYL)) * every,
        "slip": far,
    }
    return {name: rates(draws(values)) for name, values in flags.items()}


def rate_table(found: dict[str, dict[str, np.ndarray]]) -> str:
    """Annual rates of all pieces, as ratios to that of one component."""
    rows = []
    for name, own in found.items():
        one = own["one"]
        cells = [span(interval(own[change] / one), 2) for change in RATES[1:5]]
        most = own["at most"][0] / one[0]
        cells.append(f"{most:.2f}" if most < 10.0 else f"{most:.0f}")
        cells += [span(interval(own["friction"] / one), 3), span(interval(1e3 * own["slip"]), 2)]
        rows.append((name, span(interval(1e3 * one), 2), *cells))
    headings = ("piece", "one component (1/1000 years)", "square plan", "own plan", "V/H 2/3", "own plan and V/H 2/3")
    return table(
        (*headings, "the same, airborne fall", "the same on vinyl", "slips > 10 cm on vinyl (1/1000 years)"), rows
    )


def item_table() -> str:
    """The pieces."""
    rows = []
    for item in ITEMS:
        one = item.block
        plan = f"⌀ {one.width:g}" if one.round else f"{one.width:.3g} × {one.depth:.3g}"
        rows.append((item.name, plan, f"{one.h:.3g}", f"{item.limit:.2f}", f"{one.inertia:.2f}", item.source))
    return table(("piece", "plan (m)", "mass at (m)", "b/h", "λ", "source"), rows)


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])
