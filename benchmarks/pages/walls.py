"""The page docs/walls.md and its figures: when does a wall keep a piece from falling into the room?"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter
from numpy.typing import ArrayLike

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...motions import Generator, KanaiTajimi, NearFault, SiteBasedScenario
from ...motions.arrays import Record, records
from ...motions.polarity import both_polarities
from ...studies.plots.axes import COLOURS, MARKERS
from ..kernels import drifting_wall
from .figures import DASHED, DPI, bare, curve, log_ticks, looks, new, shares_axis
from .page import save, some, template, write
from .shares import change, clustered, crossing, decidable, decided, draws, share, share_of_free
from .tables import Interval, body, span

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
NUMBER, DRIFTING, SEED = some(100), some(30, 4), 1
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
NEAR = list(KINDS).index("near-fault")
NORMALISED = "peak velocity, p PGV/(g tan α) (–)"
EXACT = tp.HousnerImpact(geometry="exact")


def gap_name(gap: float | None) -> str:
    """Return a gap in words."""
    return "free" if gap is None else "touching" if gap == 0.0 else f"{1000.0 * gap:g} mm"


def rebound(block: tp.Block) -> float:
    """Return the velocity kept at the wall, r_w of the geometry."""
    return float(2.0 / block.inertia * np.cos(block.alpha) ** 2 - 1.0)


class Gaps(NamedTuple):
    """Falls of every piece and kind: into the room (kind, piece, free and gaps, level, motion), and free either way."""

    front: np.ndarray
    either: np.ndarray

    @property
    def excess(self) -> np.ndarray:
        """Falls into the room before a wall less those of the free piece (kind, piece, gap, level, motion)."""
        return np.asarray(self.front[:, :, 1:] - self.front[:, :, :1])

    def free(self, kind: str, piece: str, often: bool) -> np.ndarray:
        """Falls of the free piece into the room (motion,) at the level below."""
        kinds, pieces = list(KINDS).index(kind), PIECES.index(piece)
        return np.asarray(self.front[kinds, pieces, 0, self.level(kind, piece, often)])

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


def sides(
    blocks: list[tp.Block], shakes: xr.DataArray, levels: list[float], im: str, law: tp.HousnerImpact
) -> np.ndarray:
    """Return the side to which every block falls: 1 into the room, -1 back, 0 none (block, level, motion)."""
    found = tp.ida(blocks, law, shakes, levels, im=im, outputs=("direction",), screen=False)
    return np.asarray(found["direction"].values[:, 0])


def over_gaps(
    shakes: dict[str, xr.DataArray], levels: tuple[float, ...] = LEVELS, pieces: tuple[str, ...] = PIECES
) -> Gaps:
    """Every piece, free and at every gap, at every level."""
    blocks = [placed(piece, gap) for piece in pieces for gap in (None, *GAPS)]
    fell = np.array([sides(blocks, shakes[kind], list(levels), MEASURE, EXACT) for kind in shakes])
    fell = fell.reshape(len(shakes), len(pieces), 1 + len(GAPS), len(levels), -1)
    return Gaps(clustered(fell == 1), clustered(fell[:, :, 0] != 0))


def over_rebounds(shakes: dict[str, xr.DataArray], gaps: Gaps) -> np.ndarray:
    """Falls into the room (kind, half or nine in ten, piece, gap, rebound, motion); NaN where a rebound is above e²."""
    found = np.full((len(VARIED), 2, len(PIECES), len(GAPS), len(REBOUNDS), NUMBER), np.nan)
    for k, i in product(range(len(VARIED)), range(len(PIECES))):
        piece = PIECES[i]
        possible = [j for j, total in enumerate(REBOUNDS) if total <= tp.catalogue[piece].restitution ** 2]
        blocks = [placed(piece, gap, REBOUNDS[j]) for gap in GAPS for j in possible]
        levels = [LEVELS[gaps.level(VARIED[k], piece, often)] for often in (False, True)]
        fell = clustered(sides(blocks, shakes[VARIED[k]], levels, MEASURE, EXACT) == 1)
        fell = fell.reshape(len(GAPS), len(possible), 2, NUMBER)
        found[k, :, i][:, :, possible] = np.moveaxis(fell, 2, 0)
    return found


def over_drifts(shakes: dict[str, xr.DataArray], gaps: Gaps) -> np.ndarray:
    """Return falls into the room (kind, half or nine in ten, piece, gap, drift, motion) before a wall that drifts."""
    found = np.zeros((len(VARIED), 2, len(PIECES), len(DRIFTING_GAPS), len(DRIFTS), DRIFTING))
    for (k, kind), often, (i, piece) in product(enumerate(VARIED), (0, 1), enumerate(PIECES)):
        level = LEVELS[gaps.level(kind, piece, bool(often))] * velocity(piece)
        found[k, often, i] = clustered(
            drifting(tp.catalogue[piece], shakes[kind].isel(motion=slice(2 * DRIFTING)), level)
        )
    return found


def drifting(block: tp.Block, shakes: xr.DataArray, level: float) -> np.ndarray:
    """Return whether a block falls into the room under motions of a PGV, m/s, by the slow integration.

    (gap, drift, motion)
    """
    fallen = np.zeros((len(DRIFTING_GAPS), len(DRIFTS), shakes.sizes["motion"]), dtype=bool)
    factors = level / tp.motions.measures(shakes, ["pgv"])["pgv"].values

    def one(j: int, motion: Record) -> None:
        record = np.concatenate([motion.acceleration, np.zeros(round(QUIET / motion.dt))])
        u, du = drifting_wall.drift(record, motion.dt, PERIOD)
        for (i, gap), (d, ratio) in product(enumerate(DRIFTING_GAPS), enumerate(DRIFTS)):
            scale = ratio * block.height / np.abs(u).max()
            side, _ = drifting_wall.fall(
                record, motion.dt, float(factors[j]), PARTS, block.alpha, block.p**2, STANDARD_GRAVITY,
                block.restitution, max(0.0, rebound(block)), gap, block.height, u, du, scale,
            )  # fmt: skip
            fallen[i, d, j] = side == 1

    with ThreadPoolExecutor() as pool:
        list(pool.map(one, range(shakes.sizes["motion"]), records(shakes)))
    return fallen


def main() -> None:
    """Write the page and its figures."""
    began = time.perf_counter()
    shakes = {kind: both_polarities(generator.sample(NUMBER, seed=SEED)) for kind, generator in KINDS.items()}
    gaps = over_gaps(shakes)
    rebounds = over_rebounds(shakes, gaps)
    drifts = over_drifts(shakes, gaps)
    minutes = (time.perf_counter() - began) / 60.0
    with looks("xtick.labelsize", "ytick.labelsize"):
        drawn = {
            "map": map_figure(gaps),
            "curves": curve_figure(gaps.front[:, PIECES.index("bookcase-5-shelf")]),
            "rebound": varied_figure(
                rebounds.mean(-1)[:, :, :, [0, 2]], gaps, (GAPS[0], GAPS[2]), REBOUNDS, "total rebound e² r_w (–)"
            ),
            "drift": varied_figure(
                drifts.mean(-1), gaps, DRIFTING_GAPS, DRIFTS, "peak drift of the wall over its height (%)"
            ),
        }
        save("walls", drawn, DPI)
    write("walls", page(gaps, rebounds, drifts, minutes))


def map_figure(gaps: Gaps) -> Figure:
    """Draw falls into the room before a wall less those of the free piece; a dot in cells that are not decided."""
    figure, axes = new(9.0, len(PIECES), len(KINDS))
    excess, open_cells = gaps.excess.mean(-1), decided(gaps.excess) == 0
    colours = LinearSegmentedColormap.from_list("fewer_more", [COLOURS[0], "#ffffff", COLOURS[1]])
    edges = np.arange(len(LEVELS) + 1) - 0.5
    shown = [j for j, level in enumerate(LEVELS) if level in (0.5, 1.0, 2.0)]
    for (i, k), ax in np.ndenumerate(axes):
        mesh = ax.pcolormesh(
            edges, np.arange(len(GAPS) + 1) - 0.5, excess[k, i], cmap=colours, vmin=-0.5, vmax=0.5, edgecolors="white",
            lw=0.4,
        )  # fmt: skip
        y, x = np.nonzero(open_cells[k, i])
        ax.plot(x, y, ".", color="0.55", ms=2.5)
        ax.set_yticks(range(len(GAPS)), [gap_name(gap) for gap in GAPS] if k == 0 else [])
        ax.set_xticks(shown, [f"{LEVELS[j]:g}" for j in shown] if i == len(PIECES) - 1 else [])
        ax.tick_params(length=2.0)
        heading = PIECES[i] if k == 0 else ""
        ax.set_title(f"{[*KINDS][k]}\n{heading}" if i == 0 else heading, loc="left", fontsize=9.5)
    bar = figure.colorbar(mesh, ax=axes, location="bottom", shrink=0.8, aspect=30, pad=0.06)
    bar.set_label("P(falls into the room): before the wall minus free")
    axes[-1, 1].set_xlabel(NORMALISED)
    return figure


def curve_figure(front: np.ndarray) -> Figure:
    """Draw falls into the room over the level (kind, free and gaps, level, motion): a panel for each kind."""
    figure, axes = new(8.0, len(KINDS), 1, sharex=True, sharey=True)
    for ax, kind, falls in zip(axes, KINDS, front, strict=True):
        curve(
            ax,
            LEVELS,
            [share_of_free(one) for one in falls[0]],
            0,
            0.13,
            color="black",
            ls=DASHED,
            lw=1.6,
            label="free",
        )
        for j, gap in enumerate(GAPS):
            shares = [share(one) for one in falls[1 + j]]
            curve(ax, LEVELS, shares, j, 0.13, 1 + j, lw=1.6, label=gap_name(gap))
        bare(ax)
        ax.set_title(kind, loc="left")
        log_ticks(ax, (0.3, 0.5, 1.0, 2.0, 3.0))
        shares_axis(ax)
    figure.supylabel("P(falls into the room)")
    figure.supxlabel(NORMALISED)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, frameon=False,
                  handlelength=1.6, columnspacing=1.0, handletextpad=0.4)  # fmt: skip
    return figure


def varied_figure(
    front: np.ndarray, gaps: Gaps, shown: tuple[float, ...], values: tuple[float, ...], label: str
) -> Figure:
    """Draw falls into the room over a rebound or a drift (kind, half or nine in ten, piece, gap, value).

    A panel for every kind, intensity and gap; grey: the range over the free pieces.
    """
    figure, axes = new(8.2, 2 * len(VARIED), len(shown), sharex=True, sharey=True)
    for (k, kind), often, (j, gap) in product(enumerate(VARIED), (False, True), enumerate(shown)):
        ax = axes[2 * k + often, j]
        free = [gaps.free(kind, piece, often).mean() for piece in PIECES]
        ax.axhspan(min(free) - 0.004, max(free) + 0.004, color="0.8", lw=0.0)
        for i in range(len(PIECES)):
            ax.plot(values, front[k, int(often), i, j], color=COLOURS[i], marker=MARKERS[i], ms=4.0, lw=1.3)
        bare(ax)
        shares_axis(ax, 1.02, -0.02)
        intensity = "free falls in 9 of 10" if often else "free falls in half"
        if values is DRIFTS:
            ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1, symbol=""))
        if len(shown) < 3:
            ax.set_title(f"{kind}, {gap_name(gap)}\n{intensity}", loc="left")
        else:
            ax.set_title(gap_name(gap), loc="left")
            if j == 0:
                ax.set_ylabel(f"{kind},\n{intensity}")
    figure.supylabel("P(falls into the room)")
    figure.supxlabel(label)
    handles = [Line2D([], [], color=COLOURS[i], marker=MARKERS[i], ms=4.0, lw=1.3) for i in range(len(PIECES))]
    figure.legend([*handles, Line2D([], [], color="0.8", lw=6.0)], [*PIECES, "free, into the room"],
                  loc="outside upper center", ncols=2, frameon=False, handlelength=1.6)  # fmt: skip
    return figure


def page(gaps: Gaps, rebounds: np.ndarray, drifts: np.ndarray, minutes: float) -> str:
    """Return the page: its template with every number from the results."""
    signs = decided(gaps.excess)
    total = gaps.front[:, :, 1:] - gaps.either[:, :, None]
    wide = signs[NEAR, :, -1]
    strongest = gaps.front[:, :, 1, -1].mean(-1)
    return template("walls").format(
        motions=NUMBER,
        slow_motions=DRIFTING,
        runs=run_number(),
        minutes=minutes,
        cells=signs.size,
        decidable=decidable(gaps.excess).sum(),
        fewer=(signs < 0).sum(),
        more=(signs > 0).sum(),
        beyond_either=(decided(total) > 0).sum(),
        total_decidable=decidable(total).sum(),
        wide_cells=wide.size,
        wide_fewer=(wide < 0).sum(),
        wide_more=(wide > 0).sum(),
        wide_fewer_up_to=max((LEVELS[n] for n in np.nonzero((wide < 0).any(0))[0]), default=math.nan),
        strongest=per_cent(strongest),
        top_level=LEVELS[-1],
        piece_table=piece_table(),
        crossing_table=body(crossing_rows(gaps)),
        half_table=body(gap_rows(gaps, often=False)),
        often_table=body(gap_rows(gaps, often=True)),
        even_table=body(even_rows(gaps, rebounds)),
        drift_table=body(drift_rows(drifts)),
        agree=100 * agreement(gaps, drifts),
        slow_runs=2 * DRIFTING,
        none_even=none_even(gaps, rebounds),
        pieces=len(PIECES),
        parts=PARTS,
        kinds=len(KINDS),
        **drift_answers(gaps, drifts),
        **answers(gaps),
    )


def run_number() -> int:
    """Return the number of runs of the whole page."""
    engine = len(KINDS) * len(PIECES) * (1 + len(GAPS)) * len(LEVELS) * 2 * NUMBER
    varied = sum(total <= tp.catalogue[one].restitution ** 2 for one in PIECES for total in REBOUNDS)
    engine += len(VARIED) * varied * len(GAPS) * 2 * 2 * NUMBER
    slow = len(VARIED) * 2 * len(PIECES) * len(DRIFTING_GAPS) * len(DRIFTS) * 2 * DRIFTING
    return engine + slow


def crossings(gaps: Gaps, k: int, j: int) -> list[Interval]:
    """Return the level above which a wall at a gap increases falls into the room, of every piece."""
    return [crossing(gaps.excess[k, i, j], np.array(LEVELS)) for i in range(len(PIECES))]


def answers(gaps: Gaps) -> dict[str, str]:
    """Return ranges over the pieces that the text states: where the wall begins to increase falls, by kind and gap."""
    found = {}
    for (k, kind), (j, gap) in product(enumerate(KINDS), enumerate(GAPS)):
        name = f"{kind.replace('-', '')}_{round(1000 * gap)}"
        ends = [one.value for one in crossings(gaps, k, j)]
        found[f"{name}_level"] = span(ends, ".1f")
        found[f"{name}_fallen"] = per_cent(
            [np.interp(end, LEVELS, gaps.either[k, i].mean(-1)) for i, end in enumerate(ends)]
        )
    return found


def per_cent(shares: ArrayLike) -> str:
    """Return a range in per cent, or its one value."""
    ends = span(100 * np.asarray(shares), ".0f").split("–")
    return "–".join(dict.fromkeys(ends)) + " %"


def piece_table() -> str:
    """Return the pieces: sizes, slenderness, restitutions, and the velocity that the levels are relative to."""
    rows = []
    for piece in PIECES:
        one = tp.catalogue[piece]
        numbers = (
            one.height / one.width,
            one.restitution,
            rebound(one),
            one.restitution**2 * rebound(one),
            velocity(piece),
        )
        forms = (".1f", ".2f", ".2f", ".2f", ".2f")
        rows.append((piece, f"{one.width:.2f} × {one.height:.2f}", *map(format, numbers, forms)))
    return body(rows)


def crossing_rows(gaps: Gaps) -> Iterator[tuple[str, ...]]:
    """Yield for every kind, piece and gap the peak velocity up to which the wall reduces falls into the room."""
    for k, kind in enumerate(KINDS):
        ends = [crossings(gaps, k, j) for j in range(len(GAPS))]
        for i, piece in enumerate(PIECES):
            unit = velocity(piece)
            median = unit * float(np.interp(0.5, gaps.either[k, i].mean(-1), LEVELS))
            yield kind, piece, f"{median:.2f}", *(f"{of_gap[i].times(unit):.2f}" for of_gap in ends)


def gap_row(gaps: Gaps, k: int, i: int, n: int, piece: str, kind: str, level: float) -> tuple[object, ...]:
    """Return the velocity, falls of the free piece either way, and into the room free and at every gap, in per cent."""
    walls = [share(gaps.front[k, i, 1 + j, n]) for j in range(len(GAPS))]
    free = share_of_free(gaps.front[k, i, 0, n])
    return kind, piece, f"{level * velocity(piece):.2f}", share(gaps.either[k, i, n]), free, *walls


def gap_rows(gaps: Gaps, often: bool) -> Iterator[tuple[object, ...]]:
    """Yield all kinds and pieces at the level where the free piece falls in half the runs, or in nine of ten."""
    for (k, kind), (i, piece) in product(enumerate(KINDS), enumerate(PIECES)):
        n = gaps.level(kind, piece, often)
        yield gap_row(gaps, k, i, n, piece, kind, LEVELS[n])


def even(front: np.ndarray, free: np.ndarray) -> str:
    """Return the total rebound at which a wall leaves falls into the room as they are (rebound, motion).

    Where the sign of the mean is the same at all rebounds: the change at the end of the rebounds that is nearest to
    another sign, in percentage points.
    """
    known = ~np.isnan(front[:, 0])
    excess = front[known] - free
    if (excess.mean(-1) < 0.0).all():
        return f"above {REBOUNDS[known.sum() - 1]:g}: {change(excess[-1], 0)}"
    if (excess.mean(-1) > 0.0).all():
        return f"none: {change(excess[0], 0)}"
    return f"{Interval(*(end - 1.0 for end in crossing(excess, 1.0 + np.array(REBOUNDS)[known]))):.2f}"


OFTEN = ("half", "nine in ten")


def even_rows(gaps: Gaps, rebounds: np.ndarray) -> Iterator[tuple[str, ...]]:
    """Yield total rebounds above which a wall increases falls into the room."""
    for (k, kind), often, (i, piece) in product(enumerate(VARIED), (0, 1), enumerate(PIECES)):
        free = gaps.free(kind, piece, bool(often))
        yield kind, OFTEN[often], piece, *(even(rebounds[k, often, i, j], free) for j in range(len(GAPS)))


def drift_rows(drifts: np.ndarray) -> Iterator[tuple[object, ...]]:
    """Yield falls into the room with drift less those without, mean of the pieces, with the interval over motions."""
    for (k, kind), often, (j, gap) in product(enumerate(VARIED), (0, 1), enumerate(DRIFTING_GAPS)):
        still, *moved = drifts[k, often, :, j].mean(0)
        yield kind, OFTEN[often], gap_name(gap), share(still), *(change(one - still, 0) for one in moved)


def none_even(gaps: Gaps, rebounds: np.ndarray) -> int:
    """Return for how many pieces a touching wall increases falls without any rebound, decided at 1 %.

    Under near-fault motions, where the free piece falls in nine of ten.
    """
    still = rebounds[VARIED.index("near-fault"), 1, :, 0, 0]
    free = np.array([gaps.free("near-fault", piece, often=True) for piece in PIECES])
    return int((decided(still - free) > 0).sum())


def drift_answers(gaps: Gaps, drifts: np.ndarray) -> dict[str, str]:
    """Return what the text states of drifts: upper ends of intervals, and the piece whose falls grow most."""
    mean = drifts.mean(2)  # kind, half or nine in ten, gap, drift, motion
    high = np.quantile(draws(mean[..., 1:, :] - mean[..., :1, :])[1:], 0.975, axis=0)
    grown = drifts[..., -1, :] - drifts[..., 0, :]
    k, often, i, j = np.unravel_index(int(np.argmax(grown.mean(-1))), grown.shape[:-1])
    near, broad = (mean[VARIED.index(kind), 1] for kind in ("near-fault", "broadband"))
    free = np.mean([gaps.free("near-fault", piece, often=True) for piece in PIECES])
    return {
        "half_drift": f"{100 * high[:, 0].max():.0f}",
        "small_drift": f"{100 * high[..., :-1].max():.0f}",
        "near_drift": change(near[0, -1] - near[0, 0], 0),
        "near_still": f"{100 * near[0, 0].mean():.0f}",
        "near_free": f"{100 * free:.0f}",
        "broad_drift": "; ".join(
            f"{change(falls[-1] - falls[0], 0)} {'touching' if gap == 0.0 else 'at ' + gap_name(gap)}"
            for gap, falls in zip(DRIFTING_GAPS, broad, strict=True)
        ),
        "worst_piece": PIECES[i],
        "worst_case": f"{VARIED[k]}, {gap_name(DRIFTING_GAPS[j])}, free falls in {OFTEN[often]}",
        "worst_change": change(grown[k, often, i, j], 0),
    }


def agreement(gaps: Gaps, drifts: np.ndarray) -> float:
    """Return the largest difference of a share from the engine's where the wall does not drift."""
    worst = 0.0
    for (k, kind), often, (i, piece) in product(enumerate(VARIED), (0, 1), enumerate(PIECES)):
        n = gaps.level(kind, piece, bool(often))
        for j, gap in enumerate(DRIFTING_GAPS):
            engine = gaps.front[list(KINDS).index(kind), i, 1 + GAPS.index(gap), n, :DRIFTING].mean()
            worst = max(worst, abs(float(engine - drifts[k, often, i, j, 0].mean())))
    return worst
