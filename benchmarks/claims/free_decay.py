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
from ...models import Block, HousnerImpact, Law, free_rocking

HALF_CYCLES = 10
RELEASE = 0.5
"""Rotation over alpha from which blocks rock freely."""
SPAN, STEP = 20.0, 0.05
"""Least length of a history and its step, as p t."""
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
    elastic zone).  On law: `decay_error`, the mean over the half cycles 1 to 10 of the peak over the rigid block's,
    less 1.  Peaks count that the rigid block has outside the law's elastic zone, because inside it the law does not
    rock.  A peak that the law does not reach outside its zone counts as the edge of the zone, its upper bound.
    """
    peak = np.full((len(laws), HALF_CYCLES + 1), np.nan)
    rigid = np.array([impact_decay(release, e) for e in restitution])
    errors = np.full(len(laws), np.nan)
    last = max(SPAN, SLOWER * float(impact_times(block, release, 1.0)[-1]))
    length = STEP * math.ceil(last / STEP)
    for i, law in enumerate(laws):
        run = free_rocking(block, law, release * block.alpha, length / block.p, STEP / block.p)
        n = min(run.sizes["peak"], HALF_CYCLES + 1)
        peak[i, :n] = run["peak_rotations"].values[:n] / block.alpha
        edge = 0.0 if isinstance(law, HousnerImpact) else float(getattr(law, "delta", 0.0))
        counted = np.flatnonzero(rigid[i] >= edge)[1:]
        if counted.size:  # (else it comes to rest at once)
            reached = np.where(np.isnan(peak[i]), edge, peak[i])
            errors[i] = np.mean(reached[counted] / rigid[i, counted] - 1.0)
    on = ("law", "half_cycle")
    return xr.Dataset({"decay_peak": (on, peak), "decay_rigid": (on, rigid), "decay_error": ("law", errors)})
