"""The page docs/walls.md and its figures: falls into the room in front of walls, and with anti-tip kits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...motions import Generator, KanaiTajimi, NearFault, SiteBasedScenario
from ...motions.polarity import both_polarities
from ...studies.plots.axes import COLOURS
from . import kits
from .figures import DPI, looks, new
from .kits import gap_name, sides
from .page import Table, save, some, template, write, write_csv
from .shares import change, clustered, crossing, decidable, decided, share, share_of_free
from .tables import Interval, per_cent, span

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
LEVELS = (0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.3, 1.6, 2.0, 2.6, 3.2)
"""Of the peak velocity, normalised: p PGV/(g tan alpha)."""
NUMBER, SEED = some(100), 1
MEASURE = "pgv_normalised"
KINDS: dict[str, Generator] = {
    "broadband": KanaiTajimi(),
    "site-based": SiteBasedScenario(6.8, 15e3, 760.0),
    "near-fault": NearFault(6.8, 5e3),
}
VARIED = ("broadband", "near-fault")
"""Kinds of motions under which the rebound is varied."""
OFTEN = ("half", "nine in ten")
"""Runs in which the free piece falls at the levels compared."""
NEAR = list(KINDS).index("near-fault")
EXACT = tp.HousnerImpact(geometry="exact")


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
    block = tp.catalogue[piece]
    if gap is None:
        return tp.Block(block.width, block.height, name=f"{piece}, free")
    restitution = None if total is None else min(1.0, total / block.restitution**2)
    name = f"{piece}, {gap:g}" + ("" if total is None else f", {total:g}")
    return tp.Block(block.width, block.height, name=name, wall=tp.Wall(gap, restitution=restitution))


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
    fell_in = np.full((len(VARIED), 2, len(PIECES), len(GAPS), len(REBOUNDS), NUMBER), np.nan)
    for k, i in product(range(len(VARIED)), range(len(PIECES))):
        piece = PIECES[i]
        possible = [j for j, total in enumerate(REBOUNDS) if total <= tp.catalogue[piece].restitution ** 2]
        blocks = [placed(piece, gap, REBOUNDS[j]) for gap in GAPS for j in possible]
        levels = [LEVELS[gaps.level(VARIED[k], piece, often)] for often in (False, True)]
        fell = clustered(sides(blocks, shakes[VARIED[k]], levels, MEASURE, EXACT) == 1)
        fell = fell.reshape(len(GAPS), len(possible), 2, NUMBER)
        fell_in[k, :, i][:, :, possible] = np.moveaxis(fell, 2, 0)
    return fell_in


def main() -> None:
    """Write the page, its figures and its tables."""
    shakes = {kind: both_polarities(generator.sample(NUMBER, seed=SEED)) for kind, generator in KINDS.items()}
    gaps = over_gaps(shakes)
    rebounds = over_rebounds(shakes, gaps)
    strapped, fallen = kits.kits(kits.design_motions()), kits.overturning()
    with looks("xtick.labelsize", "ytick.labelsize"):
        save("walls", {"map": map_figure(gaps), "strength": kits.strength_figure(strapped)}, DPI)
    for name, (headings, rows) in (tables(gaps, rebounds) | kits.tables(strapped, fallen)).items():
        write_csv("walls", name, headings, rows)
    write("walls", page(gaps, rebounds, kits.values(strapped, fallen)))


def tables(gaps: Gaps, rebounds: np.ndarray) -> dict[str, Table]:
    """Return the tables of files: headings and rows."""
    names = [gap_name(gap) for gap in GAPS]
    heads = ("motions", "piece", "free falls in", "PGV (m/s)", "free: falls either way (%)", "free (%)")
    sizes = ("piece", "size (m)", "h/b", "e", "r_w", "e² r_w", "g tan α/p (m/s)")
    return {
        "pieces": (sizes, piece_rows()),
        "intensities": (("motions", "piece", "free falls in half at (m/s)", *names), crossing_rows(gaps)),
        "falls": (
            (*heads, *(f"{name} (%)" for name in names)),
            (row for often in (False, True) for row in gap_rows(gaps, often)),
        ),
        "rebounds": (("motions", "free falls in", "piece", *names), even_rows(gaps, rebounds)),
    }


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
    bar.set_label("Change in the probability of falling into the room")
    axes[-1, 1].set_xlabel("peak velocity, p PGV/(g tan α) (–)")
    return figure


def page(gaps: Gaps, rebounds: np.ndarray, of_kits: dict[str, object]) -> str:
    """Return the page: its template with every number from the results, and the values of its part on kits."""
    varied = sum(total <= tp.catalogue[piece].restitution ** 2 for piece in PIECES for total in REBOUNDS)
    runs = len(KINDS) * len(PIECES) * (1 + len(GAPS)) * len(LEVELS) * 2 * NUMBER
    runs += len(VARIED) * varied * len(GAPS) * 2 * 2 * NUMBER
    signs = decided(gaps.excess)
    total = gaps.front[:, :, 1:] - gaps.either[:, :, None]
    wide = signs[NEAR, :, -1]
    strongest = gaps.front[:, :, 1, -1].mean(-1)
    return template("walls").format(
        motions=NUMBER,
        runs=runs + of_kits.pop("kit_runs"),  # type: ignore[operator]
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
        none_even=none_even(gaps, rebounds),
        pieces=len(PIECES),
        **answers(gaps),
        **of_kits,
    )


def crossings(gaps: Gaps, k: int, j: int) -> list[Interval]:
    """Return the level above which a wall at a gap increases falls into the room, of every piece."""
    return [crossing(gaps.excess[k, i, j], np.array(LEVELS)) for i in range(len(PIECES))]


def answers(gaps: Gaps) -> dict[str, str]:
    """Return ranges over the pieces that the text states: where the wall begins to increase falls, by kind and gap."""
    values = {}
    for (k, kind), (j, gap) in product(enumerate(KINDS), enumerate(GAPS)):
        name = f"{kind.replace('-', '')}_{round(1000 * gap)}"
        ends = [level.value for level in crossings(gaps, k, j)]
        values[f"{name}_level"] = span(ends, ".1f")
        values[f"{name}_fallen"] = per_cent(
            [np.interp(end, LEVELS, gaps.either[k, i].mean(-1)) for i, end in enumerate(ends)]
        )
    return values


def piece_rows() -> Iterator[tuple[str, ...]]:
    """Yield the pieces: sizes, slenderness, restitutions, and the velocity that the levels are relative to."""
    for piece in PIECES:
        block = tp.catalogue[piece]
        kept = rebound(block)
        numbers = (block.restitution, kept, block.restitution**2 * kept, velocity(piece))
        size, slender = f"{block.width:.2f} × {block.height:.2f}", f"{block.height / block.width:.1f}"
        yield piece, size, slender, *(f"{number:.2f}" for number in numbers)


def crossing_rows(gaps: Gaps) -> Iterator[tuple[str, ...]]:
    """Yield for every kind, piece and gap the peak velocity up to which the wall reduces falls into the room."""
    for k, kind in enumerate(KINDS):
        ends = [crossings(gaps, k, j) for j in range(len(GAPS))]
        for i, piece in enumerate(PIECES):
            unit = velocity(piece)
            median = unit * float(np.interp(0.5, gaps.either[k, i].mean(-1), LEVELS))
            yield kind, piece, f"{median:.2f}", *(f"{of_gap[i].times(unit):.2f}" for of_gap in ends)


def gap_row(gaps: Gaps, k: int, i: int, n: int) -> tuple[object, ...]:
    """Return falls of the free piece either way, and into the room free and at every gap, in per cent."""
    walls = [share(gaps.front[k, i, 1 + j, n]) for j in range(len(GAPS))]
    return share(gaps.either[k, i, n]), share_of_free(gaps.front[k, i, 0, n]), *walls


def gap_rows(gaps: Gaps, often: bool) -> Iterator[tuple[object, ...]]:
    """Yield all kinds and pieces at the level where the free piece falls in half the runs, or in nine of ten."""
    for (k, kind), (i, piece) in product(enumerate(KINDS), enumerate(PIECES)):
        n = gaps.level(kind, piece, often)
        yield kind, piece, OFTEN[often], f"{LEVELS[n] * velocity(piece):.2f}", *gap_row(gaps, k, i, n)


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


def even_rows(gaps: Gaps, rebounds: np.ndarray) -> Iterator[tuple[str, ...]]:
    """Yield total rebounds above which a wall increases falls into the room."""
    for (k, kind), often, (i, piece) in product(enumerate(VARIED), (0, 1), enumerate(PIECES)):
        free = gaps.free(kind, piece, bool(often))
        yield kind, OFTEN[often], piece, *(even(rebounds[k, often, i, j], free) for j in range(len(GAPS)))


def none_even(gaps: Gaps, rebounds: np.ndarray) -> int:
    """Return for how many pieces a touching wall increases falls without any rebound, decided at 1 %.

    Under near-fault motions, where the free piece falls in nine of ten.
    """
    still = rebounds[VARIED.index("near-fault"), 1, :, 0, 0]
    free = np.array([gaps.free("near-fault", piece, often=True) for piece in PIECES])
    return int((decided(still - free) > 0).sum())
