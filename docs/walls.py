"""docs/walls.md and its figures: when does a wall keep a piece from falling into the room?

`make walls` runs it.  Every number on the page is put there by this file.
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from typing import NamedTuple

import drifting_wall
import numpy as np
import walls_figures as figures
import xarray as xr
from matplotlib import rc_context
from polarity import Share, clustered, crossing, decidable, decided, difference, share, share_of_free

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions import Generator, KanaiTajimi, NearFault, SiteBasedScenario
from toppling.motions.arrays import records
from toppling.motions.polarity import both_polarities

HERE = Path(__file__).resolve().parent
PIECES = (
    "bookcase-billy",
    "bookcase-5-shelf",
    "museum-pedestal-slender",
    "file-vertical-4-drawer",
    "electrical-cabinet-600",
    "chest-tall-5-drawer",
)
"""Of the catalogue, the most slender first."""
GAPS = (0.0, 0.005, 0.02, 0.05)
REBOUNDS = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9)
DRIFTS = (0.0, 0.0025, 0.005, 0.01)
DRIFTING_GAPS = (0.0, 0.005, 0.02)
LEVELS = (0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.3, 1.6, 2.0, 2.6, 3.2)
"""Of the peak velocity, normalised: p PGV/(g tan alpha)."""
NUMBER, DRIFTING, SEED = 100, 30, 1
PERIOD, PARTS, QUIET = 0.5, 2, 3.0
"""Of the drift: period of the storey, s; steps per sample; seconds after the record."""
MEASURE = "pgv_normalised"
KINDS: dict[str, Generator] = {
    "broadband": KanaiTajimi(),
    "site-based": SiteBasedScenario(6.8, 15e3, 760.0),
    "near-fault": NearFault(6.8, 5e3),
}
VARIED = ("broadband", "near-fault")
"""Kinds of motions under which rebound and drift are varied."""
EXACT = tp.HousnerImpact(geometry="exact")


class Gaps(NamedTuple):
    """Falls of every piece and kind: into the room (kind, piece, free and gaps, level, motion), and free either way."""

    front: np.ndarray
    either: np.ndarray

    @property
    def excess(self) -> np.ndarray:
        """Falls into the room before a wall less those of the free piece (kind, piece, gap, level, motion)."""
        return np.asarray(self.front[:, :, 1:] - self.front[:, :, :1])

    def level(self, kind: str, piece: str, often: bool) -> int:
        """The level at which the free piece falls in about half the runs, or the least with nine in ten of them."""
        fallen = self.either[list(KINDS).index(kind), PIECES.index(piece)].mean(-1)
        return int(np.argmax(fallen >= 0.9)) if often else int(np.argmin(np.abs(fallen - 0.5)))


def velocity(piece: str) -> float:
    """The peak velocity, m/s, at which the normalised one is 1."""
    block = tp.catalogue[piece]
    return float(STANDARD_GRAVITY * np.tan(block.alpha) / block.p)


def placed(piece: str, gap: float | None, total: float | None = None) -> tp.Block:
    """A piece of the catalogue, free or at a gap from its wall, with a total rebound e² r_w if not its own."""
    one = tp.catalogue[piece]
    if gap is None:
        return tp.Block(one.width, one.height, name=f"{piece}, free")
    own = None if total is None else min(1.0, total / one.restitution**2)
    name = f"{piece}, {gap:g}" + ("" if total is None else f", {total:g}")
    return tp.Block(one.width, one.height, name=name, wall=tp.Wall(gap, restitution=own))


def runs(
    blocks: list[tp.Block], shakes: xr.DataArray, levels: list[float], im: str, law: tp.HousnerImpact
) -> np.ndarray:
    """The side to which every block falls: 1 into the room, -1 back, 0 none (block, level, motion)."""
    found = tp.ida(blocks, law, shakes, levels, im=im, outputs=("direction",), screen=False)
    return np.asarray(found["direction"].values[:, 0])


def over_gaps(
    shakes: dict[str, xr.DataArray], levels: tuple[float, ...] = LEVELS, pieces: tuple[str, ...] = PIECES
) -> Gaps:
    """Every piece, free and at every gap, at every level."""
    blocks = [placed(piece, gap) for piece in pieces for gap in (None, *GAPS)]
    sides = np.array([runs(blocks, shakes[kind], list(levels), MEASURE, EXACT) for kind in shakes])
    sides = sides.reshape(len(shakes), len(pieces), 1 + len(GAPS), len(levels), -1)
    return Gaps(clustered(sides == 1), clustered(sides[:, :, 0] != 0))


def over_rebounds(shakes: dict[str, xr.DataArray], gaps: Gaps) -> np.ndarray:
    """Falls into the room (kind, half or nine in ten, piece, gap, rebound, motion); NaN where a rebound is above e²."""
    found = np.full((len(VARIED), 2, len(PIECES), len(GAPS), len(REBOUNDS), NUMBER), np.nan)
    for k, i in product(range(len(VARIED)), range(len(PIECES))):
        piece = PIECES[i]
        possible = [j for j, total in enumerate(REBOUNDS) if total <= tp.catalogue[piece].restitution ** 2]
        blocks = [placed(piece, gap, REBOUNDS[j]) for gap in GAPS for j in possible]
        levels = [LEVELS[gaps.level(VARIED[k], piece, often)] for often in (False, True)]
        sides = clustered(runs(blocks, shakes[VARIED[k]], levels, MEASURE, EXACT) == 1)
        sides = sides.reshape(len(GAPS), len(possible), 2, NUMBER)
        found[k, :, i][:, :, possible] = np.moveaxis(sides, 2, 0)
    return found


def drifting(
    block: tp.Block, shakes: xr.DataArray, factors: np.ndarray, cases: list[tuple[float, float]]
) -> np.ndarray:
    """The side to which a block falls by the slow integration (case, motion); cases: gap in m and drift ratio."""
    own = 2.0 / block.inertia_factor * np.cos(block.alpha) ** 2 - 1.0
    plain = records(shakes)
    sides = np.zeros((len(cases), len(plain)), dtype=int)

    def one(j: int) -> None:
        still = np.zeros(round(QUIET / plain[j].dt))
        record = np.concatenate([plain[j].acceleration, still])
        u, du = drifting_wall.drift(record, plain[j].dt, PERIOD)
        for i, (gap, ratio) in enumerate(cases):
            scale = ratio * block.height / np.abs(u).max()
            sides[i, j], _ = drifting_wall.fall(
                record, plain[j].dt, float(factors[j]), PARTS, block.alpha, block.p**2, block.restitution,
                max(0.0, own), gap, block.height, u, du, scale,
            )  # fmt: skip

    with ThreadPoolExecutor() as pool:
        list(pool.map(one, range(len(plain))))
    return sides


def factors_to(shakes: xr.DataArray, name: str, level: float) -> np.ndarray:
    """Factors that scale every motion to a peak acceleration (m/s²) or velocity (m/s)."""
    return np.asarray(level / tp.motions.measures(shakes, [name])[name].values)


def over_drifts(shakes: dict[str, xr.DataArray], gaps: Gaps) -> np.ndarray:
    """Falls into the room (kind, half or nine in ten, piece, gap, drift, motion) before a wall that drifts."""
    cases = list(product(DRIFTING_GAPS, DRIFTS))
    found = np.zeros((len(VARIED), 2, len(PIECES), len(cases), DRIFTING))
    for k, often, i in product(range(len(VARIED)), (0, 1), range(len(PIECES))):
        some = first(shakes[VARIED[k]], DRIFTING)
        level = LEVELS[gaps.level(VARIED[k], PIECES[i], bool(often))] * velocity(PIECES[i])
        sides = drifting(tp.catalogue[PIECES[i]], some, factors_to(some, "pgv", level), cases)
        found[k, often, i] = clustered(sides == 1)
    return found.reshape(len(VARIED), 2, len(PIECES), len(DRIFTING_GAPS), len(DRIFTS), DRIFTING)


def first(shakes: xr.DataArray, number: int) -> xr.DataArray:
    """The first motions of an ensemble of both polarities, with their reversals."""
    return shakes.isel(motion=slice(2 * number))


class Check(NamedTuple):
    """A first figure that was stated for one block before this study, and what the study finds."""

    what: str
    stated: str
    recorded: Share
    reversed_too: Share


CHECKED = tp.Block(0.30, 1.80, name="0.30 × 1.80 m")
ACCELERATIONS = (0.3, 0.5)  # g
VELOCITIES = (0.8, 1.2)  # m/s
CHECKED_NUMBER = 300


def at_wall(gap: float | None, total: float | None = None) -> tp.Block:
    """The block of the first figures, free or at a gap, with a total rebound if not its own."""
    if gap is None:
        return CHECKED
    own = None if total is None else total / CHECKED.restitution**2
    return tp.Block(0.30, 1.80, name=f"{gap:g}, {total}", wall=tp.Wall(gap, restitution=own))


def checks() -> list[Check]:
    """The first figures again: linearised geometry, 300 broadband motions at a PGA, 150 near-fault ones at a PGV."""
    linear = tp.HousnerImpact(geometry="linear")
    found = []

    def add(what: str, stated: str, sides: np.ndarray) -> None:
        both = share_of_free if what.endswith("free") else share
        found.append(Check(what, stated, share(np.asarray(sides[::2], dtype=float)), both(clustered(sides))))

    noise = both_polarities(KINDS["broadband"].sample(CHECKED_NUMBER, seed=SEED))
    blocks = [at_wall(None), *(at_wall(gap) for gap in reversed(GAPS))]
    sides = runs(blocks, noise, [STANDARD_GRAVITY * one for one in ACCELERATIONS], "pga", linear)
    stated = (("0.44", "0.19", "0.01", "0", "0"), ("0.50", "0.91", "0.63", "0.23", "0.047"))
    for n, j in product(range(2), range(5)):
        where = figures.gap_name((None, *reversed(GAPS))[j])
        add(f"broadband, {ACCELERATIONS[n]:g} g, {where}", stated[n][j], sides[j, n] == 1)
    totals = (0.42, 0.6, 0.7, 0.8, 0.9)
    sides = runs([at_wall(0.0, one) for one in totals], noise, [0.5 * STANDARD_GRAVITY], "pga", linear)
    for j, (total, one) in enumerate(zip(totals, ("0.06", "0.14", "0.32", "0.68", "0.93"), strict=True)):
        add(f"broadband, 0.5 g, touching, total rebound {total:g}", one, sides[j, 0] == 1)
    near = both_polarities(KINDS["near-fault"].sample(CHECKED_NUMBER // 2, seed=SEED))
    sides = runs([at_wall(None), at_wall(0.0), at_wall(0.02)], near, list(VELOCITIES), "pgv", linear)
    stated = (("0.43", "0.35", "0.65"), ("0.52", "0.86", "0.95"))
    for n, j in product(range(2), range(3)):
        where = ("free", "touching", "20 mm")[j]
        add(f"near-fault, {VELOCITIES[n]:g} m/s, {where}", stated[n][j], sides[j, n] == 1)
    some = first(noise, NUMBER)
    cases = [(0.0, ratio) for ratio in DRIFTS[1:]] + [(0.005, ratio) for ratio in DRIFTS[1:]]
    sides = drifting(CHECKED, some, factors_to(some, "pga", 0.5 * STANDARD_GRAVITY), cases)
    for (gap, ratio), one, side in zip(cases, ("0.12", "0.17", "0.37", "0.28", "0.35", "0.52"), sides, strict=True):
        add(f"broadband, 0.5 g, {figures.gap_name(gap)}, drift {100 * ratio:g} %", one, side == 1)
    return found


def main(out: Path = HERE) -> None:
    """Write the page and its figures into `out`."""
    began = time.perf_counter()
    shakes = {kind: both_polarities(generator.sample(NUMBER, seed=SEED)) for kind, generator in KINDS.items()}
    gaps = over_gaps(shakes)
    rebounds = over_rebounds(shakes, gaps)
    drifts = over_drifts(shakes, gaps)
    checked = checks()
    minutes = (time.perf_counter() - began) / 60.0
    (out / "walls").mkdir(exist_ok=True)
    with rc_context(figures.LOOKS):
        bookcase = PIECES.index("bookcase-5-shelf")
        free = np.array([free_range(gaps, kind) for kind in VARIED])
        drawn = {
            "map": figures.map_figure(
                gaps.excess.mean(-1), decided(gaps.excess) != 0, list(KINDS), PIECES, GAPS, LEVELS
            ),
            "curves": figures.curve_figure(gaps.front[:, bookcase], list(KINDS), (None, *GAPS), LEVELS),
            "rebound": figures.varied_figure(
                rebounds.mean(-1)[:, :, :, [0, 2]], free, VARIED, (GAPS[0], GAPS[2]), PIECES, REBOUNDS,
                "total rebound e² r_w (–)",
            ),
            "drift": figures.varied_figure(
                drifts.mean(-1), free, VARIED, DRIFTING_GAPS, PIECES, DRIFTS,
                "peak drift of the wall over its height (%)", percent=True,
            ),
        }  # fmt: skip
        for name, figure in drawn.items():
            figure.savefig(out / "walls" / f"{name}.png", dpi=figures.DPI)
    (out / "walls.md").write_text(page(gaps, rebounds, drifts, checked, minutes), encoding="utf-8")


def free_range(gaps: Gaps, kind: str) -> list[tuple[float, float]]:
    """Least and largest share of free pieces that fall into the room, at either intensity."""
    found = []
    for often in (False, True):
        shares = [
            gaps.front[list(KINDS).index(kind), i, 0, gaps.level(kind, one, often)].mean()
            for i, one in enumerate(PIECES)
        ]
        found.append((float(min(shares)), float(max(shares))))
    return found


def page(gaps: Gaps, rebounds: np.ndarray, drifts: np.ndarray, checked: list[Check], minutes: float) -> str:
    """The page: the text of walls.md.in with every number from the results."""
    signs = decided(gaps.excess)
    total = gaps.front[:, :, 1:] - gaps.either[:, :, None]
    wide = signs[list(KINDS).index("near-fault"), :, -1]
    strongest = gaps.front[:, :, 1, -1].mean(-1)
    numbers = {
        "motions": NUMBER,
        "slow_motions": DRIFTING,
        "runs": f"{run_number():,}",
        "minutes": f"{minutes:.0f}",
        "cells": signs.size,
        "decidable": int(decidable(gaps.excess).sum()),
        "fewer": int((signs < 0).sum()),
        "more": int((signs > 0).sum()),
        "beyond_either": int((decided(total) > 0).sum()),
        "total_decidable": int(decidable(total).sum()),
        "wide_cells": wide.size,
        "wide_fewer": int((wide < 0).sum()),
        "wide_more": int((wide > 0).sum()),
        "wide_fewer_up_to": f"{max(LEVELS[n] for n in np.nonzero((wide < 0).any(0))[0]):g}",
        "strongest": per_cent(float(strongest.min()), float(strongest.max())),
        "top_level": f"{LEVELS[-1]:g}",
        "piece_table": piece_table(),
        "crossing_table": crossing_table(gaps),
        "half_table": gap_table(gaps, often=False),
        "often_table": gap_table(gaps, often=True),
        "even_table": even_table(gaps, rebounds),
        "drift_table": drift_table(drifts),
        "check_table": check_table(checked),
        "agree": agreement(gaps, drifts),
        "slow_runs": 2 * DRIFTING,
        "none_even": none_even(gaps, rebounds),
        "pieces": len(PIECES),
        "parts": PARTS,
        **drift_answers(gaps, drifts),
        "kinds": len(KINDS),
        **answers(gaps),
    }
    return (HERE / "walls.md.in").read_text(encoding="utf-8").format(**numbers)


def run_number() -> int:
    """Runs of the whole page."""
    engine = len(KINDS) * len(PIECES) * (1 + len(GAPS)) * len(LEVELS) * 2 * NUMBER
    varied = sum(total <= tp.catalogue[one].restitution ** 2 for one in PIECES for total in REBOUNDS)
    engine += len(VARIED) * varied * len(GAPS) * 2 * 2 * NUMBER + 2 * CHECKED_NUMBER * (10 + 5) + CHECKED_NUMBER * 6
    slow = len(VARIED) * 2 * len(PIECES) * len(DRIFTING_GAPS) * len(DRIFTS) * 2 * DRIFTING + 6 * 2 * NUMBER
    return engine + slow


def crossings(gaps: Gaps, k: int, j: int) -> list[tuple[float, float, float]]:
    """The level above which a wall at a gap increases falls into the room, of every piece."""
    return [crossing(gaps.excess[k, i, j], np.array(LEVELS)) for i in range(len(PIECES))]


def fallen_at(gaps: Gaps, k: int, found: list[tuple[float, float, float]]) -> list[float]:
    """Share of the free pieces' runs that end in a fall, either way, at levels."""
    return [float(np.interp(one[0], LEVELS, gaps.either[k, i].mean(-1))) for i, one in enumerate(found)]


def answers(gaps: Gaps) -> dict[str, str]:
    """Ranges over the pieces that the text states: where the wall begins to increase falls, by kind and gap."""
    found = {}
    for (k, kind), (j, gap) in product(enumerate(KINDS), enumerate(GAPS)):
        name = f"{kind.replace('-', '')}_{round(1000 * gap)}"
        ends = crossings(gaps, k, j)
        fallen = fallen_at(gaps, k, ends)
        found[f"{name}_level"] = f"{min(one[0] for one in ends):.1f}–{max(one[0] for one in ends):.1f}"
        found[f"{name}_fallen"] = per_cent(min(fallen), max(fallen))
    return found


def per_cent(low: float, high: float) -> str:
    """A range in per cent, or its one value."""
    ends = [f"{100 * one:.0f}" for one in (low, high)]
    return f"{ends[0]} %" if ends[0] == ends[1] else f"{ends[0]}–{ends[1]} %"


def piece_table() -> str:
    """The pieces: sizes, slenderness, restitutions, and the velocity that the levels are relative to."""
    rows = []
    for piece in PIECES:
        one = tp.catalogue[piece]
        own = 2.0 / one.inertia_factor * np.cos(one.alpha) ** 2 - 1.0
        rows.append(
            (piece, f"{one.width:.2f} × {one.height:.2f}", f"{one.height / one.width:.1f}", f"{one.restitution:.2f}",
             f"{own:.2f}", f"{one.restitution**2 * own:.2f}", f"{velocity(piece):.2f}")
        )  # fmt: skip
    return table(("piece", "size (m)", "h/b", "e", "r_w", "e² r_w", "g tan α/p (m/s)"), rows)


def crossing_table(gaps: Gaps) -> str:
    """For every kind, piece and gap the peak velocity up to which the wall reduces falls into the room."""
    rows = []
    for k, kind in enumerate(KINDS):
        for i, piece in enumerate(PIECES):
            unit = velocity(piece)
            cells = []
            for j in range(len(GAPS)):
                value, low, high = (unit * one for one in crossings(gaps, k, j)[i])
                cells.append(f"{value:.2f} ({low:.2f}–{high:.2f})")
            median = unit * float(np.interp(0.5, gaps.either[k, i].mean(-1), LEVELS))
            rows.append((kind, piece, f"{median:.2f}", *cells))
    return table(("motions", "piece", "free falls in half at", *(figures.gap_name(gap) for gap in GAPS)), rows)


def gap_row(gaps: Gaps, k: int, i: int, n: int, piece: str, kind: str, level: float) -> tuple[str, ...]:
    """A row: the velocity, falls of the free piece either way, and into the room free and at every gap, in per cent."""
    shares = [str(share_of_free(gaps.front[k, i, 0, n]))]
    shares += [str(share(gaps.front[k, i, 1 + j, n])) for j in range(len(GAPS))]
    return (kind, piece, f"{level * velocity(piece):.2f}", str(share(gaps.either[k, i, n])), *shares)


def gap_table(gaps: Gaps, often: bool) -> str:
    """All kinds and pieces at the level where the free piece falls in half the runs, or in nine of ten."""
    rows = []
    for (k, kind), (i, piece) in product(enumerate(KINDS), enumerate(PIECES)):
        n = gaps.level(kind, piece, often)
        rows.append(gap_row(gaps, k, i, n, piece, kind, LEVELS[n]))
    names = [figures.gap_name(gap) for gap in GAPS]
    return table(("motions", "piece", "PGV (m/s)", "free: falls either way", "free", *names), rows)


def even(front: np.ndarray, free: np.ndarray) -> str:
    """The total rebound at which a wall leaves falls into the room as they are (rebound, motion), with its interval.

    Where the sign of the mean is the same at all rebounds: the change at the end of the rebounds that is nearest to
    another sign, in percentage points.
    """
    known = ~np.isnan(front[:, 0])
    excess = front[known] - free
    if (excess.mean(-1) < 0.0).all():
        return f"above {REBOUNDS[known.sum() - 1]:g}: {points(excess[-1])}"
    if (excess.mean(-1) > 0.0).all():
        return f"none: {points(excess[0])}"
    value, low, high = crossing(excess, 1.0 + np.array(REBOUNDS)[known])
    return f"{value - 1.0:.2f} ({low - 1.0:.2f}–{high - 1.0:.2f})"


def points(change: np.ndarray) -> str:
    """A mean change over motions in percentage points, with its 95 % interval."""
    value, low, high = (100.0 * float(one[0]) for one in difference(change[None], 0.95))
    return f"{value:+.0f} ({low:+.0f} to {high:+.0f})".replace("-", "−")


def even_table(gaps: Gaps, rebounds: np.ndarray) -> str:
    """Total rebounds above which a wall increases falls into the room."""
    rows = []
    for k, often in product(range(len(VARIED)), (0, 1)):
        for i, piece in enumerate(PIECES):
            kind = list(KINDS).index(VARIED[k])
            free = gaps.front[kind, i, 0, gaps.level(VARIED[k], piece, bool(often))]
            cells = [even(rebounds[k, often, i, j], free) for j in range(len(GAPS))]
            rows.append((VARIED[k], "nine in ten" if often else "half", piece, *cells))
    return table(("motions", "free falls in", "piece", *(figures.gap_name(gap) for gap in GAPS)), rows)


def drift_table(drifts: np.ndarray) -> str:
    """Falls into the room with drift less those without, mean of the pieces, with the interval over motions."""
    rows = []
    for k, often, j in product(range(len(VARIED)), (0, 1), range(len(DRIFTING_GAPS))):
        mean = drifts[k, often, :, j].mean(0)
        cells = [str(share(mean[0]))]
        for d in range(1, len(DRIFTS)):
            cells.append(points(mean[d] - mean[0]))
        rows.append((VARIED[k], "nine in ten" if often else "half", figures.gap_name(DRIFTING_GAPS[j]), *cells))
    headings = [f"at {100 * one:g} %" for one in DRIFTS[1:]]
    return table(("motions", "free falls in", "gap", "without drift (%)", *headings), rows)


def none_even(gaps: Gaps, rebounds: np.ndarray) -> int:
    """Pieces whose touching wall increases falls without any rebound, decided at 1 %: near-fault, free nine in ten."""
    k, kind = VARIED.index("near-fault"), list(KINDS).index("near-fault")
    levels = [gaps.level("near-fault", piece, often=True) for piece in PIECES]
    return sum(
        int(decided(rebounds[k, 1, i, 0, 0] - gaps.front[kind, i, 0, n])) > 0 for i, n in enumerate(levels)
    )  # fmt: skip


def drift_answers(gaps: Gaps, drifts: np.ndarray) -> dict[str, str]:
    """What the text states of drifts: upper ends of intervals, and the piece whose falls grow most."""
    mean = drifts.mean(2)  # kind, half or nine in ten, gap, drift, motion
    _, _, high = difference(mean[..., 1:, :] - mean[..., :1, :], 0.95)
    change = (drifts[..., -1, :] - drifts[..., 0, :]).mean(-1)
    k, often, i, j = np.unravel_index(int(np.argmax(change)), change.shape)
    near = mean[VARIED.index("near-fault"), 1, 0]
    kind, levels = list(KINDS).index("near-fault"), [gaps.level("near-fault", piece, often=True) for piece in PIECES]
    free = np.array([gaps.front[kind, place, 0, n] for place, n in enumerate(levels)])
    broad = mean[VARIED.index("broadband"), 1]
    return {
        "half_drift": f"{100 * high[:, 0].max():.0f}",
        "small_drift": f"{100 * high[..., :-1].max():.0f}",
        "near_drift": points(near[-1] - near[0]),
        "near_still": f"{100 * near[0].mean():.0f}",
        "near_free": f"{100 * free.mean():.0f}",
        "broad_drift": "; ".join(
            f"{points(one[-1] - one[0])} {'touching' if gap == 0.0 else 'at ' + figures.gap_name(gap)}"
            for gap, one in zip(DRIFTING_GAPS, broad, strict=True)
        ),
        "worst_piece": PIECES[i],
        "worst_case": f"{VARIED[k]}, {figures.gap_name(DRIFTING_GAPS[j])}, "
        f"free falls in {'nine in ten' if often else 'half'}",
        "worst_change": points(drifts[k, often, i, j, -1] - drifts[k, often, i, j, 0]),
    }


def agreement(gaps: Gaps, drifts: np.ndarray) -> str:
    """Largest difference of a share from the engine's where the wall does not drift, in percentage points."""
    worst = 0.0
    for (k, kind), often, (i, piece) in product(enumerate(VARIED), (0, 1), enumerate(PIECES)):
        n = gaps.level(kind, piece, bool(often))
        for j, gap in enumerate(DRIFTING_GAPS):
            engine = gaps.front[list(KINDS).index(kind), i, 1 + GAPS.index(gap), n, :DRIFTING].mean()
            worst = max(worst, abs(float(engine - drifts[k, often, i, j, 0].mean())))
    return f"{100 * worst:.1f}"


def check_table(checked: list[Check]) -> str:
    """The first figures beside ours."""
    rows = [(one.what, f"{100 * float(one.stated):g}", str(one.recorded), str(one.reversed_too)) for one in checked]
    return table(("0.30 × 1.80 m", "first figure (%)", "as generated (%)", "both polarities (%)"), rows)


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
