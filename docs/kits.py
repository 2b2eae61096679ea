"""docs/kits.md and its figures: which anti-tip kit is enough?

`make kits` runs it.  Every number on the page is put there by this file.
"""

from __future__ import annotations

import math
import sys
import time
from itertools import pairwise, product
from pathlib import Path
from typing import NamedTuple

import kits_figures as figures
import numpy as np
import xarray as xr
from matplotlib import rc_context
from polarity import REPLICATES, Share, clustered, decidable, decided, share, share_of_free

import toppling as tp
from toppling.benchmarks.experiments.jma import jma_intensity
from toppling.core.streams import stream
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions import KanaiTajimi, NearFault, SpectrumCompatible, TargetSpectrum
from toppling.motions.arrays import records
from toppling.motions.polarity import both_polarities

HERE = Path(__file__).resolve().parent
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
GAPS, GAP, BELOW_TOP = (0.0, 0.02), 0.02, 0.05  # m: touching, or behind a skirting board; the strap below the top
ENOUGH = 0.05
"""Probability of a fall into the room below which a kit is enough, with the upper end of its 95 % interval."""
NUMBER, SEED = 75, 1


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
    return both_polarities(SpectrumCompatible(design_spectrum()).sample(number, seed=SEED))


def block(piece: Piece, restraint: tp.Restraint | None = None, gap: float | None = GAP, lean: float = 0.0) -> tp.Block:
    """A piece before its wall (or free), with or without a restraint."""
    wall = None if gap is None else tp.Wall(gap)
    held = (
        "" if restraint is None else f"{restraint.kind}, {restraint.strength}, {restraint.slack}, {restraint.stiffness}"
    )
    name = f"{piece.name}, {gap}, {lean}, {held}"
    return tp.Block(
        piece.width, piece.height, name=name, mass=piece.mass, lean=lean, wall=wall, restraint=restraint
    )  # fmt: skip


def strap(piece: Piece, strength: float, slack: float, stiffness: float) -> tp.Restraint:
    """A strap near the top of a piece."""
    return tp.Restraint.strap(piece.height - BELOW_TOP, strength, stiffness, slack)


def sides(blocks: list[tp.Block], shakes: xr.DataArray, scales: list[float], im: str = "scale") -> np.ndarray:
    """The side to which every block falls: 1 into the room, -1 back, 0 none (block, level, motion)."""
    found = tp.ida(blocks, LAW, shakes, scales, im=im, outputs=("direction",), screen=False)
    return np.asarray(found["direction"].values[:, 0])


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
        blocks.append(block(piece, None, None))
        for gap in GAPS:
            blocks.append(block(piece, None, gap))
            blocks += [block(piece, strap(piece, strength, slack, one), gap) for one, slack, strength in grid]
    found = clustered(sides(blocks, shakes, list(SITES.values())) == 1)
    found = found.reshape(len(pieces), -1, len(SITES), found.shape[-1])
    walled = found[:, 1:].reshape(len(pieces), len(GAPS), 1 + len(grid), len(SITES), -1)
    shape = (len(pieces), len(GAPS), len(stiffnesses), len(SLACKS), len(STRENGTHS), len(SITES), -1)
    return Kits(walled[:, :, 1:].reshape(shape), walled[:, :, 0], found[:, 0])


def static_force(piece: Piece, acceleration: float) -> float:
    """The force that a strap carries if the piece is held still at an acceleration (m/s²), N; at least 0."""
    moment = piece.mass * 0.5 * (acceleration * piece.height - STANDARD_GRAVITY * piece.width)
    return max(0.0, moment / (piece.height - BELOW_TOP))


# Kumamoto: a survey at second hand.  Shares and the numbers of pieces where they are stated.
SURVEY_FREE = 0.335
SURVEY_BRACKETS, SURVEY_MATS = (0.089, 79), 0.397
"""Of mats the source states 39.7 % of 56, which no count of 56 gives: without a number there is no interval."""
BRACKET_STIFFNESSES = (50e3, 500e3)  # N/m, on plasterboard, and steel on a stud
KUMAMOTO = NearFault(7.0, 5e3, 400.0, with_pulse="probability")
SURVEY_SCALES = tuple(np.geomspace(0.1, 2.0, 14))  # m/s
DEVICES = (25.0, 50.0, 100.0, 200.0, 400.0, 800.0, 1600.0)  # N


def wilson(value: float, number: int) -> Share:
    """A stated share of a number of pieces, with Wilson's 95 % interval."""
    lower, upper = tp.fragility.binomial_interval(value * number, number)
    return Share(value, float(lower), float(upper))


class Survey(NamedTuple):
    """The model beside the survey: the calibrated level, and falls over strength."""

    level: float  # m/s
    brackets: np.ndarray  # stiffness, strength, motion
    mats: np.ndarray  # strength, motion


def survey() -> Survey:
    """Scale near-fault motions until the pieces before their walls fall as often as those of the survey.

    Two brackets near the top, soft or stiff and without slack, and mats at both long edges as an adhesive, then stand
    in the same shaking.
    """
    shakes = both_polarities(KUMAMOTO.sample(NUMBER, seed=SEED))
    plain = clustered(sides([block(one) for one in PIECES], shakes, list(SURVEY_SCALES), "pgv") == 1).mean((0, 2))
    level = float(np.exp(np.interp(SURVEY_FREE, plain, np.log(SURVEY_SCALES))))
    blocks = []
    for piece in PIECES:
        top = piece.height - BELOW_TOP
        blocks += [
            block(piece, tp.Restraint.bracket(top, force, stiffness, count=2))
            for stiffness, force in product(BRACKET_STIFFNESSES, DEVICES)
        ]
        blocks += [block(piece, tp.Restraint.adhesive(force, piece.width)) for force in DEVICES]
    found = clustered(sides(blocks, shakes, [level], "pgv") == 1)[:, 0]
    mean = found.reshape(len(PIECES), len(BRACKET_STIFFNESSES) + 1, len(DEVICES), -1).mean(0)
    return Survey(level, mean[:-1], mean[-1])


# Tokyo: JMA's instrumental intensity in the middle of 6-lower and 6-upper.
INTENSITIES = {"6-lower": 5.75, "6-upper": 6.25}
WEDGE = -math.radians(1.0)
POLE_FORCE, POLE_STIFFNESS = 200.0, 50e3  # N, N/m


def tokyo_cases(piece: Piece) -> dict[str, tp.Block]:
    """The set-ups of the shake-table tests that the model can describe."""
    pole = tp.Restraint.pole(POLE_FORCE, 10.0 * POLE_FORCE, POLE_STIFFNESS, piece.width - 0.05, 0.05, count=2)
    brackets = tp.Restraint.bracket(piece.height - BELOW_TOP, 1000.0, BRACKET_STIFFNESSES[-1], count=2)
    return {
        "nothing": block(piece),
        "wedge (leans 1° to the wall)": block(piece, None, GAP, WEDGE),
        "poles (two, 200 N each)": block(piece, pole),
        "wedge and poles": block(piece, pole, GAP, WEDGE),
        "L-brackets (two, 1 kN each)": block(piece, brackets),
    }


def tokyo() -> dict[tuple[str, str, str], np.ndarray]:
    """Falls into the room (intensity, motion) of Tokyo's two specimens, by piece, case and kind of motions."""
    found = {}
    for kind, generator in {"broadband": KanaiTajimi(), "near-fault": NearFault(7.0, 5e3, 400.0)}.items():
        plain = generator.sample(NUMBER, seed=SEED)
        unit = np.array([10.0 ** (-0.5 * jma_intensity(one.acceleration, one.dt)) for one in records(plain)])
        shakes = both_polarities((plain * xr.DataArray(unit, dims="motion")).assign_attrs(plain.attrs))
        levels = [10.0 ** (0.5 * one) for one in INTENSITIES.values()]
        for piece in PIECES[:2]:
            cases = tokyo_cases(piece)
            fallen = clustered(sides(list(cases.values()), shakes, levels) == 1)
            found.update({(piece.name, case, kind): fallen[i] for i, case in enumerate(cases)})
    return found


# Makris and Zhang: a block anchored at its lower corners, under one cycle of a sine.
SLENDERNESS, FREQUENCY = 0.349, 2.14  # rad, rad/s
FORCES = (0.2, 0.4, 1.0)
"""Strength of a restrainer over the block's weight."""
RATIOS = tuple(np.arange(1.0, 8.01, 0.125))
AMPLITUDES = tuple(np.geomspace(1.0, 60.0, 1200))
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
    """Whether the block falls under one cycle of a sine (free and anchored, omega/p, amplitude)."""
    blocks = [anchored(one) for one in (None, *FORCES)]
    found = []
    for ratio in ratios:
        omega = ratio * blocks[0].p
        steps = 400
        dt = 2.0 * math.pi / omega / steps
        time_axis = np.arange(steps + 1) * dt
        pulse = STANDARD_GRAVITY * math.tan(SLENDERNESS) * np.sin(omega * time_axis)
        found.append(sides(blocks, tp.motions.from_array(pulse[None], dt), list(AMPLITUDES))[:, :, 0] != 0)
    return np.stack(found, axis=1)


def main(out: Path = HERE) -> None:
    """Write the page and its figures into `out`."""
    began = time.perf_counter()
    found, surveyed, tested, fallen = kits(design_motions()), survey(), tokyo(), overturning()
    seconds = time.perf_counter() - began
    (out / "kits").mkdir(exist_ok=True)
    names = [piece.name for piece in PIECES]
    with rc_context(figures.LOOKS):
        drawn = {
            "strength": figures.strength_figure(
                found.kit[..., -1, :], found.wall[..., -1, :], found.free[..., -1, :], names, GAPS, STIFFNESSES, SLACKS,
                STRENGTHS,
            ),
            "survey": figures.survey_figure(
                surveyed.brackets, BRACKET_STIFFNESSES, surveyed.mats, DEVICES, wilson(*SURVEY_BRACKETS), SURVEY_MATS,
                SURVEY_FREE,
            ),
            "anchored": figures.anchored_figure(RATIOS, least(fallen), FORCES),
        }  # fmt: skip
        for name, figure in drawn.items():
            figure.savefig(out / "kits" / f"{name}.png", dpi=figures.DPI)
    (out / "kits.md").write_text(page(found, surveyed, tested, fallen, seconds), encoding="utf-8")


def least(fallen: np.ndarray) -> np.ndarray:
    """The smallest amplitude, over g tan alpha, that overturns the block (free and anchored, omega/p)."""
    return np.where(fallen.any(-1), np.array(AMPLITUDES)[np.argmax(fallen, axis=-1)], np.nan)


def page(
    found: Kits, surveyed: Survey, tested: dict[tuple[str, str, str], np.ndarray], fallen: np.ndarray, seconds: float
) -> str:
    """The page: the text of kits.md.in with every number from the results."""
    gains = found.kit - found.wall[:, :, None, None, None]
    signs = decided(gains)
    within_step, compared = slack_steps(found)
    widths = np.quantile(transitions(found), [0.25, 0.75, 0.9])
    runs = 2 * NUMBER * (
        (found.kit[..., 0, 0].size + found.wall[..., 0, 0].size + len(PIECES)) * len(SITES)
        + len(PIECES) * (len(SURVEY_SCALES) + (len(BRACKET_STIFFNESSES) + 1) * len(DEVICES))
        + 2 * 2 * 2 * len(tokyo_cases(PIECES[0]))
    )  # fmt: skip
    numbers = {
        "motions": NUMBER,
        "runs": f"{runs + fallen.size:,}",
        "seconds": f"{seconds:.0f}",
        "enough": f"{100 * ENOUGH:g}",
        "soil": f"{SOIL:g}",
        "corners": ", ".join(f"{one:g}" for one in CORNERS),
        "sites": ", ".join(f"{name} {one:g} g" for name, one in SITES.items()),
        "piece_table": piece_table(),
        "wall_table": wall_table(found),
        "least_table": least_table(found),
        "kit_cells": signs.size,
        "kit_decidable": int(decidable(gains).sum()),
        "kit_fewer": int((signs < 0).sum()),
        "kit_more": f"{(more := int((signs > 0).sum()))} increase{'s' if more == 1 else ''}",
        "abrupt": f"{widths[0]:.0f} to {widths[1]:.0f}",
        "abrupt_ninth": f"{widths[2]:.0f}",
        "both_runs": 2 * NUMBER,
        "one_fall": str(share(np.r_[0.5, np.zeros(NUMBER - 1)])),
        "steps": f"{min(ratios(STRENGTHS)):.1f} to {max(ratios(STRENGTHS)):.1f}",
        "within_step": within_step,
        "compared": compared,
        "slack_points": f"{100 * slack_points(found):.0f}",
        "device_table": device_table(surveyed),
        "survey_level": f"{surveyed.level:.2f}",
        "survey_free": f"{100 * SURVEY_FREE:.1f}",
        "brackets": written(wilson(*SURVEY_BRACKETS)),
        "mats": f"{100 * SURVEY_MATS:.1f}",
        "soft_brackets": reproducing(surveyed.brackets[0], *SURVEY_BRACKETS),
        "stiff_brackets": reproducing(surveyed.brackets[1], *SURVEY_BRACKETS),
        "mat_forces": like_none(surveyed.mats),
        "ratio_step": f"{RATIOS[1] - RATIOS[0]:g}",
        "amplitude_step": f"{100 * (AMPLITUDES[1] / AMPLITUDES[0] - 1):.2f}",
        "worse": f"{WORSE:g}",
        "test_table": test_table(tested),
        "band_table": band_table(least(fallen)),
    }
    return (HERE / "kits.md.in").read_text(encoding="utf-8").format(**numbers)


def written(one: Share) -> str:
    """A share with one digit after the point, in per cent."""
    return f"{100 * one.value:.1f} % ({100 * one.lower:.0f}–{100 * one.upper:.0f} %)"


def piece_table() -> str:
    """The pieces and where their sizes and masses come from."""
    rows = [
        (one.name, f"{one.width:.2f} × {one.height:.2f}", f"{one.mass:.0f}", f"{0.5 * one.mass * STANDARD_GRAVITY:.0f}",
         one.source)
        for one in PIECES
    ]  # fmt: skip
    return table(("piece", "depth × height (m)", "mass (kg)", "half the weight (N)", "source"), rows)


def wall_table(found: Kits) -> str:
    """Falls into the room without a kit, and the force of static equilibrium at the site's peak acceleration."""
    rows = []
    for (i, piece), (s, (site, ground)) in product(enumerate(PIECES), enumerate(SITES.items())):
        force = static_force(piece, ground * SOIL * STANDARD_GRAVITY)
        shares = [share_of_free(found.free[i, s]), *(share(found.wall[i, j, s]) for j in range(len(GAPS)))]
        rows.append((piece.name, site, *(str(one) for one in shares), f"{force:.0f}"))
    return table(("piece", "site", "free", "touching", "20 mm", "static force (N)"), rows)


def is_enough(clusters: np.ndarray) -> bool:
    """Whether the upper end of the 95 % interval of a share lies below what is enough."""
    return share(clusters).upper < ENOUGH


def without(clusters: np.ndarray) -> str:
    """What is known of a piece without a kit: its share is below or above what is enough, or undecided."""
    one, limit = share(clusters), f"{100 * ENOUGH:g} %"
    return f"below {limit}" if one.upper < ENOUGH else f"above {limit}" if one.lower > ENOUGH else "undecided"


def least_index(clusters: np.ndarray) -> int:
    """The place among the strengths from which on every kit is enough (strength, motion), or their number."""
    good = np.array([is_enough(one) for one in clusters])
    return 0 if good.all() else good.size - int(np.argmin(good[::-1]))


def least_strength(clusters: np.ndarray) -> str:
    """The least strength from which on every kit is enough (strength, motion)."""
    first = least_index(clusters)
    if first == len(STRENGTHS):
        return f"> {STRENGTHS[-1]:.0f}"
    return f"{'≤ ' if first == 0 else ''}{STRENGTHS[first]:.0f}"


def ratios(values: tuple[float, ...]) -> list[float]:
    """Every value over the one before."""
    return [after / before for before, after in pairwise(values)]


def transitions(found: Kits) -> np.ndarray:
    """The factor of strength over which falls drop from nine tenths to a tenth of those without a kit, of every strap.

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
    """Slack straps behind a gap whose least strength lies within one step of the taut strap's; and all of them.

    Where the piece needs a kit, and where the taut strap's least strength is among those tried.
    """
    near, number = 0, 0
    for i, s, k in product(range(len(PIECES)), range(len(SITES)), range(len(STIFFNESSES))):
        if without(found.wall[i, -1, s]) != f"above {100 * ENOUGH:g} %":
            continue
        places = [least_index(found.kit[i, -1, k, c, :, s]) for c in range(len(SLACKS))]
        if places[0] < len(STRENGTHS):
            near += sum(abs(one - places[0]) <= 1 for one in places[1:])
            number += len(SLACKS) - 1
    return near, number


def slack_points(found: Kits) -> float:
    """The largest difference that slack makes behind a gap to the share of falls, at one strength."""
    shares = found.kit[:, -1].mean(-1)  # piece, stiffness, slack, strength, site
    return float(np.abs(shares - shares[:, :, :1]).max())


def least_table(found: Kits) -> str:
    """The least strength that is enough for every piece, site, gap, stiffness and slack."""
    rows = []
    for (i, piece), (s, site), (j, gap) in product(enumerate(PIECES), enumerate(SITES), enumerate(GAPS)):
        start = (piece.name, site, figures.gap_name(gap), without(found.wall[i, j, s]))
        if is_enough(found.wall[i, j, s]):
            rows.append((*start, *["–"] * len(STIFFNESSES)))
            continue
        cells = []
        for k in range(len(STIFFNESSES)):
            cells.append(" / ".join(least_strength(found.kit[i, j, k, c, :, s]) for c in range(len(SLACKS))))
        rows.append((*start, *cells))
    return table(("piece", "site", "gap", "without a kit", *(f"{one / 1e3:g} N/mm" for one in STIFFNESSES)), rows)


def device_table(surveyed: Survey) -> str:
    """Falls over the strength of a device."""
    rows = [
        (f"{force:.0f}", *(str(share(one[i])) for one in (*surveyed.brackets, surveyed.mats)))
        for i, force in enumerate(DEVICES)
    ]
    brackets = [f"two brackets of {one / 1e3:g} N/mm (%)" for one in BRACKET_STIFFNESSES]
    return table(("strength of one (N)", *brackets, "mats as an adhesive (%)"), rows)


def reproducing(falls: np.ndarray, value: float, number: int) -> str:
    """The strengths at which the model's falls (strength, motion) equal a stated share of a number of pieces, in kN.

    The 95 % interval to one digit, of draws of both: motions by the bootstrap, and the stated share from Jeffreys'
    posterior.  A draw outside the strengths tried counts as the nearest of them.
    """
    draws, motions = stream(1, 0), falls.shape[-1]
    weights = draws.multinomial(motions, np.full(motions, 1.0 / motions), REPLICATES) / motions
    stated = draws.beta(value * number + 0.5, (1.0 - value) * number + 0.5, REPLICATES)
    curves = np.minimum.accumulate((falls @ weights.T).T, axis=1)[:, ::-1]
    log = np.log(DEVICES)[::-1]
    forces = [float(np.exp(np.interp(one, curve, log))) / 1e3 for one, curve in zip(stated, curves, strict=True)]
    low, high = np.quantile(forces, [0.025, 0.975])
    return f"{low:.1g} to {high:.1g}"


def like_none(falls: np.ndarray) -> str:
    """The greatest strength tried whose interval of falls (strength, motion) contains the share without a device, N."""
    shares = [share(one) for one in falls]
    return f"{max(force for force, one in zip(DEVICES, shares, strict=True) if one.upper >= SURVEY_FREE):.0f}"


def test_table(tested: dict[tuple[str, str, str], np.ndarray]) -> str:
    """Falls in the set-ups of the shake-table tests."""
    rows = []
    for piece, case in product(PIECES[:2], tokyo_cases(PIECES[0])):
        cells = [
            str(share(tested[piece.name, case, kind][n]))
            for kind, n in product(("broadband", "near-fault"), range(len(INTENSITIES)))
        ]
        rows.append((piece.name, case, *cells))
    headings = [f"{name}, {kind}" for kind, name in product(("broadband", "near-fault"), INTENSITIES)]
    return table(("piece", "held by", *headings), rows)


WORSE = 0.99
"""Ratio of amplitudes below which an anchored block counts as worse than the free one."""


def band_table(amplitudes: np.ndarray) -> str:
    """For every strength the range of omega/p in which the anchored block falls at smaller amplitudes than the free."""
    omegas = np.array(RATIOS)
    rows = []
    for i, force in enumerate(FORCES, 1):
        relative = amplitudes[i] / amplitudes[0]
        worse = relative < WORSE
        if not worse.any():
            rows.append((f"{force:g}", "–", "–", f"{relative.max():.2f}"))
            continue
        j = int(np.argmin(relative))
        band = f"{omegas[worse].min():.2f} to {omegas[worse].max():.2f}"
        rows.append(
            (
                f"{force:g}",
                band,
                f"{relative[j]:.2f} at {omegas[j]:.2f}",
                f"{relative.max():.2f} at {omegas[np.argmax(relative)]:.2f}",
            )
        )
    return table(("strength/weight", f"ratio below {WORSE:g} for ω/p", "least ratio", "largest ratio"), rows)


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
