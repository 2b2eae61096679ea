"""Plausibility of levels and their measures, and of slides: outside of the known range, with the likely slip."""

from collections.abc import Iterable, Sequence

import numpy as np

from ...core.aliases import Array, Flags
from ...core.doubts import Doubt, first_names
from ...core.units import ACCELERATION, METRE, SPELLED, STANDARD_GRAVITY, VELOCITY
from ...core.wording import short_digits, two_digits
from ...motions.intensity.spectra import measure_doubts
from ..runs.scaling import intensity_measure

SLIDES_ON = 0.05
"""Share of a slip after the end of the motion."""
NEAR_LEVEL, OTHER_LEVEL = 1.1, 1.5
"""Factor between a stripe and the mean of its unscaled motions: the bound of selections, and beyond chance."""
FAR_FROM_LEVEL = 2.0
"""Factor between a stripe and one of its unscaled motions."""
LEAST_SLIP = 1e-4  # m
HIGHEST: dict[str, tuple[float, float, str]] = {
    ACCELERATION: (5.0 * STANDARD_GRAVITY, 50.0 * STANDARD_GRAVITY, "acceleration"),
    VELOCITY: (10.0, 100.0, "velocity"),
    METRE: (10.0, 1e3, "displacement"),
}
"""By the unit of levels: the highest that exists, the highest that can be meant, and its cure in `doubts.toml`."""
LEAST_TOP = {ACCELERATION: 0.05 * STANDARD_GRAVITY, VELOCITY: 0.02, METRE: 0.001}
"""By the unit of levels: the highest level, at least, of any that overturn something."""


def cut_slides(peaks: Array, after: Array) -> Flags:
    """Return True for motions at whose end blocks slide: slips (…, motion) in all and after the end, m."""
    on = (after > np.maximum(SLIDES_ON * peaks, LEAST_SLIP)).any(axis=tuple(range(after.ndim - 1)))
    return np.atleast_1d(np.asarray(on))


def end_doubts(on: Iterable[bool], motions: Sequence[str]) -> list[Doubt]:
    """Return the input warning on motions that end while blocks slide (`cut_slides`)."""
    named = [name for name, cut in zip(motions, on, strict=True) if cut]
    values = {"cut": len(named), "total": len(motions), "per_cent": 100.0 * SLIDES_ON, "named": first_names(named)}
    return [Doubt.of("slides_on", **values)] if named else []


def period_doubts(im: str) -> list[Doubt]:
    """Return the input warning on a measure of a period above 10 s or a damping ratio above 0.35, by its label."""
    try:
        return measure_doubts(im, intensity_measure(im))
    except ValueError:  # (a measure of the caller's own)
        return []


def level_doubts(levels: Array, units: str) -> list[Doubt]:
    """Return the input warning on the highest level of a measure: beyond any shaking, or below all that overturn."""
    if units not in HIGHEST or not levels.size:
        return []
    highest, beyond, cure = HIGHEST[units]
    top = float(np.max(levels, where=~np.isnan(levels), initial=0.0))
    shown = f"{top / STANDARD_GRAVITY:g} g" if units == ACCELERATION else f"{top:g} {SPELLED.get(units, units)}"
    if 0.0 < top < LEAST_TOP[units]:
        return [Doubt.of("level_weak", level=shown)]
    return [Doubt.of("level_beyond", top > beyond, cure, level=shown)] if top > highest else []


def stripe_doubts(im: str, stripes: Iterable[tuple[float, float | Array]]) -> list[Doubt]:
    """Return the input warning on unscaled motions: the level of each stripe, and the measure of its motions."""
    doubtful = []
    for number, (level, measured) in enumerate(stripes, start=1):
        ratios = np.asarray(measured) / level
        mean, least, most = float(np.exp(np.log(ratios).mean())), float(ratios.min()), float(ratios.max())
        off = max(mean, 1.0 / mean)
        if off > NEAR_LEVEL or max(most, 1.0 / least) > FAR_FROM_LEVEL:
            span = f"{two_digits(mean)} times as much in the mean, {two_digits(least)} to {two_digits(most)} times each"
            doubtful.append((off, f"stripe {number} of {short_digits(level)} in SI: they have {span}"))
    if not doubtful:
        return []
    off, worst = max(doubtful)
    return [Doubt.of("stripes", off > OTHER_LEVEL, number=len(doubtful), im=im, worst=worst)]
