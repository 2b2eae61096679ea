"""The page docs/kits.md and its figure: which anti-tip kit is enough?"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...motions import SpectrumCompatible, TargetSpectrum
from ...motions.polarity import both_polarities
from ...studies.plots.axes import COLOURS, MARKERS
from .figures import DASHED, DOTTED, DPI, bare, curve, log_ticks, looks, new, shares_axis
from .page import save, some, template, write
from .shares import clustered, decidable, decided, share, share_of_free
from .tables import body, span
from .walls import gap_name, sides

FALLS = "P(falls into the room)"
LAW = tp.HousnerImpact(geometry="linear")
"""Restraints need linearised geometry."""


class Piece(NamedTuple):
    """A piece of furniture: sizes in m, mass in kg, and where they come from."""

    name: str
    width: float
    height: float
    mass: float
    source: str


PIECES = (
    Piece("chest", 0.42, 1.365, 81.32, "Tokyo's shake-table specimen"),
    Piece("cupboard", 0.40, 1.80, 100.35, "Tokyo's shake-table specimen"),
    Piece("bookcase-5-shelf", 0.320675, 1.8034, 100.0, "catalogue; mass: judgement, full of books"),
    Piece("bookcase-billy", 0.28, 2.02, 120.0, "catalogue; mass: judgement, full of books"),
)
SITES = {"zone 1": 0.16, "zone 2": 0.24, "zone 3": 0.36}
"""Design ground acceleration on rock, g."""
SOIL, CORNERS = 1.35, (0.2, 0.8, 2.0)
"""EN 1998-1, type 1, ground type D: soil factor, and corner periods in s."""
STRENGTHS = (50.0, 100.0, 150.0, 200.0, 267.0, 400.0, 600.0, 1000.0, 1500.0, 2500.0)  # N
SLACKS = (0.0, 0.005, 0.01, 0.02)  # m
STIFFNESSES = (20e3, 100e3, 500e3)  # N/m
GAPS, BELOW_TOP = (0.0, 0.02), 0.05  # m: touching, or behind a skirting board; the strap below the top
ENOUGH = 0.05
"""Probability of a fall into the room below which a kit is enough, with the upper end of its 95 % interval."""
NUMBER, SEED = some(75, 8), 1


def design_spectrum() -> TargetSpectrum:
    """The elastic spectrum of EN 1998-1 (type 1, ground type D, 5 %) for a design acceleration of 1 g on rock."""
    short, corner, long = CORNERS
    periods = np.unique([*np.geomspace(0.05, 4.0, 60), short, corner, long])
    shape = np.where(
        periods < short,
        1.0 + 1.5 * periods / short,
        2.5 * np.minimum(1.0, corner / periods) * np.minimum(1.0, long / periods),
    )
    return TargetSpectrum(tuple(periods), tuple(STANDARD_GRAVITY * SOIL * shape), name="EN 1998-1")


def design_motions(number: int = NUMBER) -> xr.DataArray:
    """Motions of the design spectrum at 1 g, in both polarities; the sites' differ in scale alone."""
    found: xr.DataArray = both_polarities(SpectrumCompatible(design_spectrum()).sample(number, seed=SEED))
    return found


def block(piece: Piece, restraint: tp.Restraint | None = None, gap: float | None = None) -> tp.Block:
    """A piece before its wall (or free), with or without a restraint."""
    wall = None if gap is None else tp.Wall(gap)
    held = "" if restraint is None else f"{restraint.strength}, {restraint.slack}, {restraint.stiffness}"
    return tp.Block(
        piece.width, piece.height, name=f"{piece.name}, {gap}, {held}", mass=piece.mass, wall=wall, restraint=restraint
    )


def strap(piece: Piece, strength: float, slack: float, stiffness: float) -> tp.Restraint:
    """A strap near the top of a piece."""
    return tp.Restraint.strap(piece.height - BELOW_TOP, strength, stiffness, slack)


class Kits(NamedTuple):
    """Falls into the room at every site (…, site, motion): with every kit, before the wall without one, and free."""

    kit: np.ndarray  # piece, gap, stiffness, slack, strength, site, motion
    wall: np.ndarray  # piece, gap, site, motion
    free: np.ndarray  # piece, site, motion


def kits(
    shakes: xr.DataArray, pieces: tuple[Piece, ...] = PIECES, stiffnesses: tuple[float, ...] = STIFFNESSES
) -> Kits:
    """Every piece with every kit, before its wall without one, and free, at the design shaking of every site."""
    grid = list(product(stiffnesses, SLACKS, STRENGTHS))
    blocks = []
    for piece in pieces:
        blocks.append(block(piece))
        for gap in GAPS:
            blocks.append(block(piece, None, gap))
            blocks += [block(piece, strap(piece, strength, slack, one), gap) for one, slack, strength in grid]
    found = clustered(sides(blocks, shakes, list(SITES.values()), "scale", LAW) == 1)
    found = found.reshape(len(pieces), -1, len(SITES), found.shape[-1])
    walled = found[:, 1:].reshape(len(pieces), len(GAPS), 1 + len(grid), len(SITES), -1)
    shape = (len(pieces), len(GAPS), len(stiffnesses), len(SLACKS), len(STRENGTHS), len(SITES), -1)
    return Kits(walled[:, :, 1:].reshape(shape), walled[:, :, 0], found[:, 0])


def static_force(piece: Piece, acceleration: float) -> float:
    """The force that a strap carries if the piece is held still at an acceleration (m/s²), N; at least 0."""
    moment = piece.mass * 0.5 * (acceleration * piece.height - STANDARD_GRAVITY * piece.width)
    return max(0.0, moment / (piece.height - BELOW_TOP))


# Makris and Zhang: a block anchored at its lower corners, under one cycle of a sine.
SLENDERNESS, FREQUENCY = 0.349, 2.14  # rad, rad/s
FORCES = (0.2, 0.4, 1.0)
"""Strength of a restrainer over the block's weight."""
RATIOS = tuple(np.arange(1.0, 8.01, 0.125))
AMPLITUDES = tuple(np.geomspace(1.0, 60.0, some(1200)))
YIELD = 0.002  # m, elongation of a restrainer at its strength


def anchored(strength: float | None) -> tp.Block:
    """A block of 20°, p = 2.14 rad/s, free or with elastic-brittle restrainers at its corners."""
    plain = tp.Block.from_slenderness(SLENDERNESS, 0.75 * STANDARD_GRAVITY / FREQUENCY**2)
    if strength is None:
        return plain
    force = strength * STANDARD_GRAVITY  # of 1 kg
    hold = tp.Restraint("bracket", force, force / YIELD, plain.width, plain.width)
    return tp.Block(plain.width, plain.height, name=f"anchored, {strength:g}", mass=1.0, restraint=hold)


def overturning(ratios: tuple[float, ...] = RATIOS) -> np.ndarray:
    """Return whether the block falls under one cycle of a sine (free and anchored, omega/p, amplitude)."""
    blocks = [anchored(one) for one in (None, *FORCES)]
    pulse = STANDARD_GRAVITY * math.tan(SLENDERNESS) * np.sin(2.0 * math.pi * np.arange(401) / 400)
    found = []
    for ratio in ratios:
        motion = tp.motions.from_array(pulse[None], 2.0 * math.pi / (ratio * blocks[0].p) / 400)
        found.append(sides(blocks, motion, list(AMPLITUDES), "scale", LAW)[:, :, 0] != 0)
    return np.stack(found, axis=1)


def main() -> None:
    """Write the page and its figure."""
    found, fallen = kits(design_motions()), overturning()
    with looks("xtick.labelsize", "ytick.labelsize"):
        save("kits", {"strength": strength_figure(found)}, DPI)
    write("kits", page(found, fallen))


def strength_figure(found: Kits) -> Figure:
    """Draw falls over the strength of a strap at the strongest site: a panel for every piece and gap."""
    figure, axes = new(8.4, len(PIECES), len(GAPS), sharex=True, sharey=True)
    ends = ((0, "solid"), (len(SLACKS) - 1, DOTTED))
    for (i, j), ax in np.ndenumerate(axes):
        ax.axhline(found.wall[i, j, -1].mean(), color="black", lw=1.2, ls=DASHED)
        ax.axhline(found.free[i, -1].mean(), color="0.65", lw=1.2)
        for k, (slack, line) in product(range(len(STIFFNESSES)), ends):
            shares = [share(falls) for falls in found.kit[i, j, k, slack, :, -1]]
            curve(ax, STRENGTHS, shares, k, 0.0 if slack else 0.13, ls=line, ms=3.5, lw=1.3)
        bare(ax)
        log_ticks(ax, (100.0, 400.0, 1500.0), "{x:.0f}")
        shares_axis(ax, 1.02, -0.02)
        ax.set_title(f"{PIECES[i].name}, {gap_name(GAPS[j])}", loc="left", fontsize=9.5)
    figure.supylabel(FALLS)
    figure.supxlabel("strength of the strap (N)")
    named = {
        f"{stiffness / 1e3:g} N/mm": Line2D([], [], color=COLOURS[k], marker=MARKERS[k], ms=3.5, lw=1.3)
        for k, stiffness in enumerate(STIFFNESSES)
    }
    named |= {f"slack {1000 * SLACKS[c]:g} mm": Line2D([], [], color="0.4", ls=line) for c, line in ends}
    named["wall, no kit"] = Line2D([], [], color="black", lw=1.2, ls=DASHED)
    named["free"] = Line2D([], [], color="0.65", lw=1.2)
    figure.legend(
        [*named.values()], [*named], loc="outside upper center", ncols=3, frameon=False, handlelength=1.8
    )  # fmt: skip
    return figure


def least(fallen: np.ndarray) -> np.ndarray:
    """Return the smallest amplitude, over g tan alpha, that overturns the block (free and anchored, omega/p)."""
    return np.where(fallen.any(-1), np.array(AMPLITUDES)[np.argmax(fallen, axis=-1)], np.nan)


def page(found: Kits, fallen: np.ndarray) -> str:
    """Return the page: its template with every number from the results."""
    gains = found.kit - found.wall[:, :, None, None, None]
    signs = decided(gains)
    more = int((signs > 0).sum())
    within_step, compared = slack_steps(found)
    shares = found.kit[:, -1].mean(-1)  # piece, stiffness, slack, strength, site
    widths = np.quantile(transitions(found), [0.25, 0.75, 0.9])
    return template("kits").format(
        motions=NUMBER,
        runs=2 * (found.kit.size + found.wall.size + found.free.size) + fallen.size,
        enough=100 * ENOUGH,
        soil=SOIL,
        corners=", ".join(f"{corner:g}" for corner in CORNERS),
        sites=", ".join(f"{name} {ground:g} g" for name, ground in SITES.items()),
        piece_table=piece_table(),
        wall_table=body(wall_rows(found)),
        least_table=least_table(found),
        kit_cells=signs.size,
        kit_decidable=decidable(gains).sum(),
        kit_fewer=(signs < 0).sum(),
        kit_more=f"{more} increase{'s' if more == 1 else ''}",
        abrupt=f"{widths[0]:.0f} to {widths[1]:.0f}",
        abrupt_ninth=widths[2],
        both_runs=2 * NUMBER,
        one_fall=share(np.r_[0.5, np.zeros(NUMBER - 1)]),
        steps=span([after / before for before, after in pairwise(STRENGTHS)], ".1f", " to "),
        within_step=within_step,
        compared=compared,
        slack_points=100 * np.abs(shares - shares[:, :, :1]).max(),
        ratio_step=RATIOS[1] - RATIOS[0],
        amplitude_step=100 * (AMPLITUDES[1] / AMPLITUDES[0] - 1),
        worse=WORSE,
        band_table=body(band_rows(least(fallen))),
    )


def piece_table() -> str:
    """Return the pieces and where their sizes and masses come from."""
    return body(
        (one.name, f"{one.width:.2f} × {one.height:.2f}", f"{one.mass:.0f}", f"{0.5 * one.mass * STANDARD_GRAVITY:.0f}",
         one.source)
        for one in PIECES
    )  # fmt: skip


def wall_rows(found: Kits) -> Iterator[tuple[object, ...]]:
    """Yield falls into the room without a kit, and the force of static equilibrium at the site's peak acceleration."""
    for (i, piece), (s, (site, ground)) in product(enumerate(PIECES), enumerate(SITES.items())):
        force = static_force(piece, ground * SOIL * STANDARD_GRAVITY)
        walls = [share(found.wall[i, j, s]) for j in range(len(GAPS))]
        yield piece.name, site, share_of_free(found.free[i, s]), *walls, f"{force:.0f}"


def is_enough(clusters: np.ndarray) -> bool:
    """Return whether the upper end of the 95 % interval of a share lies below what is enough."""
    return share(clusters).upper < ENOUGH


def without(clusters: np.ndarray) -> str:
    """Return what is known of a piece without a kit: its share is below or above what is enough, or undecided."""
    found, limit = share(clusters), f"{100 * ENOUGH:g} %"
    return f"below {limit}" if found.upper < ENOUGH else f"above {limit}" if found.lower > ENOUGH else "undecided"


def least_index(clusters: np.ndarray) -> int:
    """Return the place among the strengths from which on every kit is enough (strength, motion), or their number."""
    good = np.array([is_enough(falls) for falls in clusters])
    return 0 if good.all() else good.size - int(np.argmin(good[::-1]))


def least_strength(clusters: np.ndarray) -> str:
    """Return the least strength from which on every kit is enough (strength, motion)."""
    first = least_index(clusters)
    if first == len(STRENGTHS):
        return f"> {STRENGTHS[-1]:.0f}"
    return f"{'≤ ' if first == 0 else ''}{STRENGTHS[first]:.0f}"


def transitions(found: Kits) -> np.ndarray:
    """Return the factor of strength from nine tenths to a tenth of the falls without a kit, of every strap.

    By interpolation in the logarithm of the strength, for straps that do both among the strengths tried, and where a
    tenth of the runs or more end in a fall without a kit.
    """
    relative = found.kit.mean(-1) / np.maximum(found.wall.mean(-1), 1e-9)[:, :, None, None, None]
    curves = np.moveaxis(np.minimum.accumulate(relative, axis=4), 4, -1)  # piece, gap, stiffness, slack, site, strength
    falls = np.broadcast_to(found.wall.mean(-1)[:, :, None, None], curves.shape[:-1])
    used = curves[(falls >= 0.1) & (curves[..., 0] >= 0.9) & (curves[..., -1] <= 0.1)]
    log = np.log(STRENGTHS)[::-1]
    return np.array([np.exp(np.interp(0.1, one[::-1], log) - np.interp(0.9, one[::-1], log)) for one in used])


def slack_steps(found: Kits) -> tuple[int, int]:
    """Return how many slack straps behind a gap have a least strength within one step of the taut strap's; of how many.

    Where the piece needs a kit, and where the taut strap's least strength is among those tried.
    """
    near, number = 0, 0
    for i, s, k in product(range(len(PIECES)), range(len(SITES)), range(len(STIFFNESSES))):
        if without(found.wall[i, -1, s]) != f"above {100 * ENOUGH:g} %":
            continue
        taut, *slack = (least_index(found.kit[i, -1, k, c, :, s]) for c in range(len(SLACKS)))
        if taut < len(STRENGTHS):
            near += sum(abs(place - taut) <= 1 for place in slack)
            number += len(slack)
    return near, number


def least_table(found: Kits) -> str:
    """Return the least strength that is enough for every piece, site, gap, stiffness and slack."""
    rows = []
    for (i, piece), (s, site), (j, gap) in product(enumerate(PIECES), enumerate(SITES), enumerate(GAPS)):
        cells = ["–"] * len(STIFFNESSES)
        if not is_enough(found.wall[i, j, s]):
            kept = found.kit[i, j, :, :, :, s]
            cells = [" / ".join(least_strength(strap) for strap in stiffness) for stiffness in kept]
        rows.append((piece.name, site, gap_name(gap), without(found.wall[i, j, s]), *cells))
    return body(rows)


WORSE = 0.99
"""Ratio of amplitudes below which an anchored block counts as worse than the free one."""


def band_rows(amplitudes: np.ndarray) -> Iterator[tuple[object, ...]]:
    """Yield the range of omega/p in which an anchored block falls at smaller amplitudes than the free one."""
    omegas = np.array(RATIOS)
    for i, force in enumerate(FORCES, 1):
        relative = amplitudes[i] / amplitudes[0]
        band = omegas[relative < WORSE]
        if not band.size:
            yield f"{force:g}", "–", "–", f"{relative.max():.2f}"
            continue
        low, high = (f"{relative[j]:.2f} at {omegas[j]:.2f}" for j in (np.argmin(relative), np.argmax(relative)))
        yield f"{force:g}", f"{band.min():.2f} to {band.max():.2f}", low, high
