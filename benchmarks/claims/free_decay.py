"""Free rocking compared with its closed form: the energy that laws dissipate, peak by peak, against Housner's impacts.

Rotations are divided by alpha and times multiplied by p: the results then depend on slenderness alone, and on that only
little.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import DIMENSIONLESS
from ...models import Block, HousnerImpact, Law, free_rocking

HALF_CYCLES = 10
RELEASE = 0.5
"""Rotation over alpha from which blocks rock freely."""
SPAN, SAMPLES = 20.0, 401
"""Length of a history, as p t, and number of its samples."""
SLOWER = 2.0
"""Duration in which peaks are sought, in multiples of ten half cycles of the rigid block without loss."""


def impact_decay(release: float, e: float, half_cycles: int = HALF_CYCLES) -> Array:
    """Return the peak rotations over alpha of a rigid block that rocks freely, (half_cycles + 1,), from the release on.

    x_n = 1 - sqrt(1 - e^(2n) [1 - (1 - x0)²]): each impact leaves e² of the energy (Housner 1963).  The formula holds
    for any falling branch that is linear in theta, for the linear and the bilinear branch alike.
    """
    # (1 - sqrt(1 - E) loses all digits of a small E)
    energy = e ** (2.0 * np.arange(half_cycles + 1)) * (1.0 - (1.0 - release) ** 2)
    return np.asarray(energy / (1.0 + np.sqrt(1.0 - energy)))


def impact_times(block: Block, release: float, e: float, half_cycles: int = HALF_CYCLES) -> Array:
    """Return the times of these peaks, as p t, (half_cycles + 1,).

    A quarter period from the peak x to upright takes acosh(1/(1 - x))/q, q² = p² sin(alpha)/alpha: the bilinear form of
    Housner's 4/p acosh(1/(1 - x)).
    """
    quarters = np.arccosh(1.0 / (1.0 - impact_decay(release, e, half_cycles)))
    q_over_p = np.sqrt(np.sin(block.alpha) / block.alpha)
    return np.asarray(np.concatenate([[0.0], np.cumsum(quarters[:-1] + quarters[1:])]) / q_over_p)


def free_decay(block: Block, laws: Sequence[Law], restitution: Sequence[float], release: float = RELEASE) -> xr.Dataset:
    """Compute the free rocking of a block under each law, with the peaks of the rigid block of that restitution.

    On (law, half_cycle): `decay_peak` and `decay_rigid` (over alpha; NaN where the law has no such peak outside its
    elastic zone), `decay_time` (p t).  On (law, scaled_time): `free_rotation`, over alpha.  On law: `decay_error`, the
    mean over the half cycles 1 to 10 of the peak over the rigid block's, less 1, and `period_error`, the same of the
    times.  Peaks count that the rigid block has outside the law's elastic zone, because inside it the law does not
    rock.  A peak that the law does not reach outside its zone counts as the edge of the zone, its upper bound.
    """
    grid = np.linspace(0.0, SPAN, SAMPLES)
    peak = np.full((len(laws), HALF_CYCLES + 1), np.nan)
    time = np.full_like(peak, np.nan)
    rigid = np.empty_like(peak)
    history = np.empty((len(laws), SAMPLES))
    errors = np.empty((2, len(laws)))
    start = release * block.alpha
    step = SPAN / (SAMPLES - 1)
    last = max(SPAN, SLOWER * float(impact_times(block, release, 1.0)[-1]))
    length = step * math.ceil(last / step)
    for i, (law, e) in enumerate(zip(laws, restitution, strict=True)):
        run = free_rocking(block, law, start, length / block.p, step / block.p)
        history[i] = run["rotation"].values[:SAMPLES] / block.alpha
        n = min(run.sizes["peak"], HALF_CYCLES + 1)
        peak[i, :n] = run["peak_rotations"].values[:n] / block.alpha
        time[i, :n] = run["peak_times"].values[:n] * block.p
        rigid[i] = impact_decay(release, e)
        edge = 0.0 if isinstance(law, HousnerImpact) else float(getattr(law, "delta", 0.0))
        counted = np.flatnonzero(rigid[i] >= edge)[1:]
        reached = np.where(np.isnan(peak[i]), edge, peak[i])
        if not counted.size:  # (it comes to rest at once)
            errors[:, i] = np.nan
            continue
        errors[0, i] = np.mean(reached[counted] / rigid[i, counted] - 1.0)
        errors[1, i] = np.mean(time[i, counted] / impact_times(block, release, e)[counted] - 1.0)
    of = ("law", "half_cycle")

    def attributes(long_name: str) -> dict[str, str]:
        return {"units": DIMENSIONLESS, "long_name": long_name}

    return xr.Dataset(
        {
            "decay_peak": (of, peak, attributes("peak rotation over alpha, free rocking")),
            "decay_rigid": (of, rigid, attributes("the same of the rigid block (Housner's closed form)")),
            "decay_time": (of, time, attributes("time of the peak, p t")),
            "free_rotation": (("law", "scaled_time"), history, attributes("rotation over alpha, free rocking")),
            "decay_error": (
                "law",
                errors[0],
                attributes("mean relative error of the peaks of free rocking against the rigid block"),
            ),
            "period_error": (
                "law",
                errors[1],
                attributes("mean relative error of the times of these peaks; NaN where one is missing"),
            ),
        },
        coords={
            "half_cycle": ("half_cycle", np.arange(HALF_CYCLES + 1), attributes("number of the peak")),
            "scaled_time": ("scaled_time", grid, attributes("time, p t")),
        },
    )
