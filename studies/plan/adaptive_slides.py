"""Effect of sliding on the blocks of a study at adaptive levels: separate runs for every slip."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact, doubted
from ...core.units import DIMENSIONLESS, ENDS, METRE, PER_YEAR, described
from ...fragility import Slip
from ...fragility.adaptive.until import MEDIAN, PROBABILITY, RATE
from ...fragility.runs.labels import OF_ACCOUNT, OF_STOP
from ...fragility.runs.runners import Runner
from ...models import Block, RandomSliding
from ..text.precision import (
    SLIP_ACCOUNT,
    SLIP_HALF_WIDTH,
    SLIP_MOTIONS,
    SLIP_RUNS,
    SLIP_STOPPED,
    SLIP_TARGET,
    precision_notes,
    runs_of_curve,
)
from .designs import Sequential
from .estimates import Fit
from .risk import Risk
from .slides import INSTEAD, SLIP, SLIP_RATE, Slides, free_of, gated

SLIP_HALF, SLIP_DISPERSION = "slip_half_level", "slip_dispersion"
"""Variables: of the curve of a slip of a block that slides, on (block, slip)."""
NEGLIGIBLE = 1e-6
"""Probability of sliding up to which nothing is run: its share of a rate is below the precision of any number here."""
OUTPUTS = ("slide_peak",)
MOST_SAID = 3
"""Most slips that have a note of their own."""


class _Curve(NamedTuple):
    """Numbers of the curve of one slip of one block, NaN if they are not known: estimates with their intervals."""

    half: Array
    dispersion: Array
    rate: Array
    probability: Array
    target: Array
    half_width: float
    motions: int
    runs: int
    stopped: str
    account: str


UNKNOWN = np.full(3, np.nan)
UNRUN = _Curve(UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, np.nan, 0, 0, "", "")


def groups(slides: Slides, blocks: Sequence[Block]) -> dict[RandomSliding, list[int]]:
    """Return the places of the blocks that are run, by their friction."""
    by_law: dict[RandomSliding, list[int]] = {}
    for i in free_of(blocks):
        law = RandomSliding(slides.friction_of(blocks[i]), slides.ratio_of(blocks[i]))
        if law.chance(blocks[i]) > NEGLIGIBLE:
            by_law.setdefault(law, []).append(i)
    return by_law


def adaptive_slides(
    slides: Slides,
    design: Sequential,
    blocks: Sequence[Block],
    fit: Fit,
    risk: Risk | None,
    falls: Mapping[str, xr.DataArray],
    units: str,
    client: Runner,
) -> tuple[xr.Dataset, list[Fact]]:
    """Return chances to slide instead of rocking, curves of slips, and notes; NaN for held and uneven blocks."""
    results = slides.chances(blocks, design.axes != "")
    chance = results[INSTEAD].values
    curves = {(i, k): UNRUN for i in range(len(blocks)) for k in range(len(slides.distances))}
    longest, ends = 0, ""
    notable: list[Fact] = []
    of_laws = groups(slides, blocks)
    number = 0
    for law, mine in of_laws.items():
        for k, distance in enumerate(slides.distances):
            state = Slip(distance)
            # (what moves one way under a motion moves the other way under its reverse)
            sought = replace(design.one_way, until=replace(design.until, state=state))
            runs = sought.run([blocks[i] for i in mine], [law], OUTPUTS, client, None)
            if runs.sizes["motion"] > longest:
                longest, ends = runs.sizes["motion"], str(runs.attrs.get("notes", ""))
            notable += precision_notes(runs, distance)
            for place, curve in zip(mine, _curves(runs, replace(fit, state=state), risk, design), strict=True):
                curves[place, k] = curve
            number += 1
            client.tell("slips", number, len(of_laws) * len(slides.distances))
    facts = [*doubted(ends.splitlines()), *notable[:MOST_SAID]]
    if len(notable) > MOST_SAID:
        facts.append(Fact("adaptive.further_slips", len(notable) - MOST_SAID))
    still = [chance[i] <= NEGLIGIBLE for i in range(len(blocks))]
    shape = len(blocks), len(slides.distances)

    def column(name: str, units: str, text: str, values: Sequence[Array]) -> None:
        """Add a number with its interval."""
        of = np.stack(values).reshape(*shape, 3)
        for j, end in enumerate(ENDS):
            words = f"{end[1:]} end of the interval of the {text}" if end else text
            results[f"{name}{end}"] = (("block", "slip"), of[..., j], described(words, units))

    every = [curves[i, k] for i in range(shape[0]) for k in range(shape[1])]
    column(
        SLIP_HALF, units, "level at which half of the blocks that slide slip further", [curve.half for curve in every]
    )
    column(SLIP_DISPERSION, DIMENSIONLESS, "dispersion of the fitted curve", [curve.dispersion for curve in every])
    weights = [0.0 if still[i] else chance[i] for i in range(shape[0]) for _ in range(shape[1])]
    if risk is not None:
        rates = [w * curve.rate if w else np.zeros(3) for w, curve in zip(weights, every, strict=True)]
        column(SLIP_RATE, PER_YEAR, "annual rate of a greater slip", rates)
    if design.until.target == PROBABILITY:
        chances = [w * curve.probability if w else np.zeros(3) for w, curve in zip(weights, every, strict=True)]
        column(SLIP, DIMENSIONLESS, "probability of a greater slip at the level asked for", chances)
    target = design.until.target
    of_target = {MEDIAN: units, RATE: PER_YEAR}.get(target, DIMENSIONLESS)
    text = f"{target} of the slip of blocks that slide, of the analysis itself"
    column(SLIP_TARGET, of_target, text, [curve.target for curve in every])
    for name, text, values in (
        (SLIP_HALF_WIDTH, f"half width of the interval of this {target}", [curve.half_width for curve in every]),
        (SLIP_MOTIONS, "motions that the block slid under", [curve.motions for curve in every]),
        (SLIP_RUNS, "runs of the block that slides", [curve.runs for curve in every]),
        (SLIP_STOPPED, OF_STOP, [curve.stopped for curve in every]),
        (SLIP_ACCOUNT, OF_ACCOUNT, [curve.account for curve in every]),
    ):
        table = np.array(values, dtype=object if isinstance(values[0], str) else None).reshape(shape)
        results[name] = (("block", "slip"), table, described(text))
    slip = xr.Variable("slip", list(slides.distances), described("slip that is exceeded", METRE))
    return results.assign(gated(results[INSTEAD], falls)).assign_coords(slip=slip), facts


def _curves(runs: xr.Dataset, fit: Fit, risk: Risk | None, design: Sequential) -> Iterator[_Curve]:
    """Yield the slips from the runs of blocks under one law, block by block."""
    fitted = fit.curves(runs, risk is not None)
    rates = None
    if risk is not None:
        rates = runs if design.until.target == RATE else risk.rates(fitted, fit.confidence)

    def ends(of: xr.Dataset | None, name: str, block: int) -> Array:
        if of is None:
            return UNKNOWN
        values = [float(of[f"{name}{end}"][block, 0]) if f"{name}{end}" in of else np.nan for end in ENDS]
        # (a rate without a form of curve may have no upper end: then there is no interval)
        return np.array(values if np.isfinite(values).all() else [values[0], np.nan, np.nan])

    for i in range(runs.sizes["block"]):
        curve = runs.isel(block=i, model=0)
        yield _Curve(
            ends(runs, "half_level", i),
            ends(fitted, "dispersion", i),
            ends(rates, "rate", i),
            ends(runs if design.until.target == PROBABILITY else None, "probability", i),
            ends(runs, "half_level" if design.until.target == MEDIAN else design.until.target, i),
            float(curve["half_width"]),
            int(curve["motions_run"]),
            runs_of_curve(curve).size,
            str(curve["stopped_because"].item()),
            str(curve["account"].item()),
        )
