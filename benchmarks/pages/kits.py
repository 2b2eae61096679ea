"""The part of the page docs/walls.md on anti-tip kits: the strength that is enough."""

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
from .figures import DASHED, DOTTED, bare, curve, log_ticks, new, shares_axis
from .page import Table, some
from .shares import clustered, decidable, decided, share, share_of_free
from .tables import body, span

FALLS = "Probability of falling into the room"
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
    Piece("bookcase-5-shelf", 0.320675, 1.8034, 100.0, "catalogue; mass assumed, full of books"),
    Piece("bookcase-billy", 0.28, 2.02, 120.0, "catalogue; mass assumed, full of books"),
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


def gap_name(gap: float | None) -> str:
    """Return a gap in words."""
    return "free" if gap is None else "touching" if gap == 0.0 else f"{1000.0 * gap:g} mm"


def sides(
    blocks: list[tp.Block], shakes: xr.DataArray, levels: list[float], im: str, law: tp.HousnerImpact
) -> np.ndarray:
    """Return the side to which every block falls: 1 into the room, -1 back, 0 none (block, level, motion)."""
    runs = tp.ida(blocks, law, shakes, levels, im=im, outputs=("direction",), screen=False)
    return np.asarray(runs["direction"].values[:, 0])


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
    motions: xr.DataArray = both_polarities(SpectrumCompatible(design_spectrum()).sample(number, seed=SEED))
    return motions


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
            blocks += [block(piece, strap(piece, strength, slack, spring), gap) for spring, slack, strength in grid]
    fell = clustered(sides(blocks, shakes, list(SITES.values()), "scale", LAW) == 1)
    fell = fell.reshape(len(pieces), -1, len(SITES), fell.shape[-1])
    walled = fell[:, 1:].reshape(len(pieces), len(GAPS), 1 + len(grid), len(SITES), -1)
    shape = (len(pieces), len(GAPS), len(stiffnesses), len(SLACKS), len(STRENGTHS), len(SITES), -1)
    return Kits(walled[:, :, 1:].reshape(shape), walled[:, :, 0], fell[:, 0])


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
    blocks = [anchored(force) for force in (None, *FORCES)]
    pulse = STANDARD_GRAVITY * math.tan(SLENDERNESS) * np.sin(2.0 * math.pi * np.arange(401) / 400)
    falls = []
    for ratio in ratios:
        motion = tp.motions.from_array(pulse[None], 2.0 * math.pi / (ratio * blocks[0].p) / 400)
        falls.append(sides(blocks, motion, list(AMPLITUDES), "scale", LAW)[:, :, 0] != 0)
    return np.stack(falls, axis=1)


def strength_figure(outcomes: Kits) -> Figure:
    """Draw falls over the strength of a strap at the strongest site: a panel for every piece and gap."""
    figure, axes = new(8.4, len(PIECES), len(GAPS), sharex=True, sharey=True)
    slacks = ((0, "solid"), (len(SLACKS) - 1, DOTTED))
    for (i, j), ax in np.ndenumerate(axes):
        ax.axhline(outcomes.wall[i, j, -1].mean(), color="black", lw=1.2, ls=DASHED)
        ax.axhline(outcomes.free[i, -1].mean(), color="0.65", lw=1.2)
        for k, (slack, line) in product(range(len(STIFFNESSES)), slacks):
            shares = [share(falls) for falls in outcomes.kit[i, j, k, slack, :, -1]]
            curve(ax, STRENGTHS, shares, k, 0.0 if slack else 0.13, ls=line, ms=3.5, lw=1.3)
        bare(ax)
        log_ticks(ax, (100.0, 400.0, 1500.0), "{x:.0f}")
        shares_axis(ax)
        ax.set_title(f"{PIECES[i].name}, {gap_name(GAPS[j])}", loc="left", fontsize=9.5)
    figure.supylabel(FALLS)
    figure.supxlabel("strength of the strap (N)")
    named = {
        f"{stiffness / 1e3:g} N/mm": Line2D([], [], color=COLOURS[k], marker=MARKERS[k], ms=3.5, lw=1.3)
        for k, stiffness in enumerate(STIFFNESSES)
    }
    named |= {f"slack {1000 * SLACKS[c]:g} mm": Line2D([], [], color="0.4", ls=line) for c, line in slacks}
    named["wall, no kit"] = Line2D([], [], color="black", lw=1.2, ls=DASHED)
    named["free"] = Line2D([], [], color="0.65", lw=1.2)
    figure.legend(
        [*named.values()], [*named], loc="outside upper center", ncols=3, frameon=False, handlelength=1.8
    )  # fmt: skip
    return figure


def least(fallen: np.ndarray) -> np.ndarray:
    """Return the smallest amplitude, over g tan alpha, that overturns the block (free and anchored, omega/p)."""
    return np.where(fallen.any(-1), np.array(AMPLITUDES)[np.argmax(fallen, axis=-1)], np.nan)


def values(outcomes: Kits, fallen: np.ndarray) -> dict[str, object]:
    """Return the values of the template."""
    gains = outcomes.kit - outcomes.wall[:, :, None, None, None]
    signs = decided(gains)
    within_step, compared = slack_steps(outcomes)
    shares = outcomes.kit[:, -1].mean(-1)  # piece, stiffness, slack, strength, site
    widths = np.quantile(transitions(outcomes), [0.25, 0.75, 0.9])
    soft, stiff = (
        [least_index(falls) for _, kept in needed(outcomes) for falls in kept[end]] for end in (0, len(STIFFNESSES) - 1)
    )
    relative = ratios_of(least(fallen))
    omegas = np.array(RATIOS)[(relative < WORSE).any(0)]
    return {
        "kit_motions": NUMBER,
        "kit_runs": 2 * (outcomes.kit.size + outcomes.wall.size + outcomes.free.size) + fallen.size,
        "enough": 100 * ENOUGH,
        "soil": SOIL,
        "corners": ", ".join(f"{corner:g}" for corner in CORNERS),
        "sites": ", ".join(f"{name} {ground:g} g" for name, ground in SITES.items()),
        "least_table": body((*names, *map(ends, kept)) for names, kept in needed(outcomes)),
        "soft_most": in_newtons(max(soft)),
        "stiff_short": stiff.count(len(STRENGTHS)),
        "stiff_cases": len(stiff),
        "top_strength": f"{STRENGTHS[-1]:.0f}",
        "kit_cells": signs.size,
        "kit_decidable": decidable(gains).sum(),
        "kit_fewer": (signs < 0).sum(),
        "kit_more": (signs > 0).sum(),
        "abrupt": f"{widths[0]:.0f} to {widths[1]:.0f}",
        "abrupt_ninth": widths[2],
        "both_runs": 2 * NUMBER,
        "one_fall": share(np.r_[0.5, np.zeros(NUMBER - 1)]),
        "steps": span([after / before for before, after in pairwise(STRENGTHS)], ".1f", " to "),
        "within_step": within_step,
        "compared": compared,
        "slack_points": 100 * np.abs(shares - shares[:, :, :1]).max(),
        "band_low": f"{omegas.min():.2f}" if omegas.size else "–",
        "band_high": f"{omegas.max():.2f}" if omegas.size else "–",
        "band_least": span(relative.min(1)),
        "band_most": span(relative.max(1)),
    }


def tables(outcomes: Kits, fallen: np.ndarray) -> dict[str, Table]:
    """Return the tables of files: headings and rows."""
    gaps = [f"{gap_name(gap)} (%)" for gap in GAPS]
    straps = [f"{spring / 1e3:g} N/mm, slack {1e3 * slack:g} mm (N)" for spring, slack in product(STIFFNESSES, SLACKS)]
    band = f"ratio below {WORSE:g} for ω/p"
    return {
        "kit_pieces": (("piece", "depth × height (m)", "mass (kg)", "half the weight (N)", "source"), piece_rows()),
        "without_kit": (("piece", "site", "free (%)", *gaps, "static force (N)"), wall_rows(outcomes)),
        "minimum": (("piece", "site", "gap", "without a kit", *straps), least_rows(outcomes)),
        "anchored": (("strength/weight", band, "minimum ratio", "maximum ratio"), band_rows(least(fallen))),
    }


def piece_rows() -> Iterator[tuple[str, ...]]:
    """Yield the pieces and where their sizes and masses come from."""
    for piece in PIECES:
        size, half = f"{piece.width:.2f} × {piece.height:.2f}", 0.5 * piece.mass * STANDARD_GRAVITY
        yield piece.name, size, f"{piece.mass:.0f}", f"{half:.0f}", piece.source


def wall_rows(outcomes: Kits) -> Iterator[tuple[object, ...]]:
    """Yield falls into the room without a kit, and the force of static equilibrium at the site's peak acceleration."""
    for (i, piece), (s, (site, ground)) in product(enumerate(PIECES), enumerate(SITES.items())):
        force = static_force(piece, ground * SOIL * STANDARD_GRAVITY)
        walls = [share(outcomes.wall[i, j, s]) for j in range(len(GAPS))]
        yield piece.name, site, share_of_free(outcomes.free[i, s]), *walls, f"{force:.0f}"


def is_enough(clusters: np.ndarray) -> bool:
    """Return whether the upper end of the 95 % interval of a share lies below what is enough."""
    return share(clusters).upper < ENOUGH


def without(clusters: np.ndarray) -> str:
    """Return what is known of a piece without a kit: its share is below or above what is enough, or undecided."""
    chance, limit = share(clusters), f"{100 * ENOUGH:g} %"
    return f"below {limit}" if chance.upper < ENOUGH else f"above {limit}" if chance.lower > ENOUGH else "undecided"


def least_index(clusters: np.ndarray) -> int:
    """Return the place among the strengths from which on every kit is enough (strength, motion), or their number."""
    good = np.array([is_enough(falls) for falls in clusters])
    return 0 if good.all() else good.size - int(np.argmin(good[::-1]))


def least_strength(clusters: np.ndarray) -> str:
    """Return the least strength from which on every kit is enough (strength, motion)."""
    return in_newtons(least_index(clusters))


def in_newtons(place: int) -> str:
    """Return a place among the strengths as a strength."""
    if place == len(STRENGTHS):
        return f"> {STRENGTHS[-1]:.0f}"
    return f"{'≤ ' if place == 0 else ''}{STRENGTHS[place]:.0f}"


def transitions(outcomes: Kits) -> np.ndarray:
    """Return the factor of strength from nine tenths to a tenth of the falls without a kit, of every strap.

    By interpolation in the logarithm of the strength, for straps that do both among the strengths tried, and where a
    tenth of the runs or more end in a fall without a kit.
    """
    relative = outcomes.kit.mean(-1) / np.maximum(outcomes.wall.mean(-1), 1e-9)[:, :, None, None, None]
    curves = np.moveaxis(np.minimum.accumulate(relative, axis=4), 4, -1)  # piece, gap, stiffness, slack, site, strength
    falls = np.broadcast_to(outcomes.wall.mean(-1)[:, :, None, None], curves.shape[:-1])
    used = curves[(falls >= 0.1) & (curves[..., 0] >= 0.9) & (curves[..., -1] <= 0.1)]
    log = np.log(STRENGTHS)[::-1]
    return np.array([np.exp(np.interp(0.1, shares[::-1], log) - np.interp(0.9, shares[::-1], log)) for shares in used])


def slack_steps(outcomes: Kits) -> tuple[int, int]:
    """Return how many slack straps behind a gap have a least strength within one step of the taut strap's; of how many.

    Where the piece needs a kit, and where the taut strap's least strength is among those tried.
    """
    near, number = 0, 0
    for i, s, k in product(range(len(PIECES)), range(len(SITES)), range(len(STIFFNESSES))):
        if without(outcomes.wall[i, -1, s]) != f"above {100 * ENOUGH:g} %":
            continue
        taut, *slack = (least_index(outcomes.kit[i, -1, k, c, :, s]) for c in range(len(SLACKS)))
        if taut < len(STRENGTHS):
            near += sum(abs(place - taut) <= 1 for place in slack)
            number += len(slack)
    return near, number


def cases(outcomes: Kits) -> Iterator[tuple[tuple[str, str, str, str], np.ndarray, bool]]:
    """Yield every piece, site and gap in words, the falls with its kits, and whether it needs one.

    Falls are of (stiffness, slack, strength, motion).
    """
    for (i, piece), (s, site), (j, gap) in product(enumerate(PIECES), enumerate(SITES), enumerate(GAPS)):
        names = (piece.name, site, gap_name(gap), without(outcomes.wall[i, j, s]))
        yield names, outcomes.kit[i, j, :, :, :, s], not is_enough(outcomes.wall[i, j, s])


def needed(outcomes: Kits) -> Iterator[tuple[tuple[str, str, str, str], np.ndarray]]:
    """Yield the cases that need a kit."""
    yield from ((names, kept) for names, kept, needs in cases(outcomes) if needs)


def least_rows(outcomes: Kits) -> Iterator[tuple[str, ...]]:
    """Yield the least strength that is enough for every piece, site, gap, stiffness and slack."""
    for names, kept, needs in cases(outcomes):
        yield *names, *(least_strength(falls) if needs else "–" for stiffness in kept for falls in stiffness)


def ends(straps: np.ndarray) -> str:
    """Return the least strength without slack and, in brackets, with the most slack (slack, strength, motion)."""
    return f"{least_strength(straps[0])} ({least_strength(straps[-1])})"


WORSE = 0.99
"""Ratio of amplitudes below which an anchored block counts as worse than the free one."""


def ratios_of(amplitudes: np.ndarray) -> np.ndarray:
    """Return amplitudes of the anchored blocks over amplitudes of the free block (strength, omega/p)."""
    return np.asarray(amplitudes[1:] / amplitudes[0])


def band_rows(amplitudes: np.ndarray) -> Iterator[tuple[str, ...]]:
    """Yield the range of omega/p in which an anchored block falls at smaller amplitudes than the free one."""
    omegas = np.array(RATIOS)
    for force, relative in zip(FORCES, ratios_of(amplitudes), strict=True):
        band = omegas[relative < WORSE]
        low, high = (f"{relative[j]:.2f} at {omegas[j]:.2f}" for j in (np.argmin(relative), np.argmax(relative)))
        yield f"{force:g}", f"{band.min():.2f} to {band.max():.2f}" if band.size else "–", low, high
