"""What claims are judged by beside a study's results: free rocking, peaks, and replicates of the bootstrap.

Free rocking is compared with its closed form, peak by peak, against Housner's impacts.  Rotations are divided by alpha
and times multiplied by p: the results then depend on slenderness alone, and on that only little.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...fragility.fitting.bootstrap import draw_clusters, percentile_interval
from ...fragility.runs.provenance import polarity_pairs
from ...models import Block, HousnerImpact, Law, free_rocking
from ...studies.file.uncertainty import RIGID, Sweep
from ...studies.kinds.sensitivity import OUTPUTS, SensitivityStudy
from ...studies.sensitivity.findings import Curves, Grid, swings_and_slopes

HALF_CYCLES = 10
RELEASE = 0.5
"""Rotation over alpha from which blocks rock freely."""
SPAN, STEP = 20.0, 0.05
"""Least length of a history and its step, as p t."""
SLOWER = 2.0
"""Duration in which peaks are sought, in multiples of ten half cycles of the rigid block without loss."""


def evidence(study: SensitivityStudy, results: xr.Dataset) -> xr.Dataset:
    """Return the results of a study with what its claims are judged by; its runs are run once more.

    On (block, model, value, replicate): `log_median_sample` and `log_rigid_sample`, ln of the median (SI) of the law
    and of the rigid block, the same motions for all; on (block, model, span, replicate) `log_trend_sample`.
    """
    grid, sweep, blocks = study.grid, study.sweep, study.blocks
    runs = study.design.run(blocks, grid.laws, OUTPUTS, None, None)
    curves = Curves.of(runs[["overturned"]], sweep.replicates, sweep.seed, sweep.confidence)
    _, slopes = swings_and_slopes(curves, blocks, grid, sweep)
    rate = [[[grid.laws[i].oscillator(block).regions[0].damping for i in row] for row in grid.at] for block in blocks]
    on = ("block", "model", "value")
    variables: dict[str, Any] = {
        "log_median_sample": ((*on, "replicate"), curves.log_samples[:, grid.at]),
        "log_rigid_sample": ((*on, "replicate"), curves.log_samples[:, grid.against[RIGID]]),
        "log_trend_sample": (("block", "model", "span", "replicate"), slopes[..., 1:]),
        "viscous_rate": (on, np.array(rate)),
    }
    return results.assign(variables | peaks(runs, grid, sweep) | decay(blocks, grid))


def peaks(runs: xr.Dataset, grid: Grid, sweep: Sweep) -> dict[str, Any]:
    """Return the shares of smaller peaks, with intervals, of the rigid block's rocking runs where the peaks differ."""
    peak, lifted = (
        runs[name].transpose("block", "model", "level", "motion").values for name in ("peak_rotation", "uplifted")
    )
    rigid = grid.against[RIGID]
    weights = draw_clusters(polarity_pairs(runs), sweep.replicates, sweep.seed)
    share = np.full((3, peak.shape[0], *grid.at.shape), np.nan)
    for block, j, k in np.ndindex(*share.shape[1:]):
        rotation, base = peak[block, grid.at[j, k]], peak[block, rigid[j, k]]
        differs = lifted[block, rigid[j, k]] & (rotation != base)
        smaller, apart = (differs & (rotation < base)).sum(axis=0), differs.sum(axis=0)
        if apart.any():
            with np.errstate(invalid="ignore"):
                samples = (weights @ smaller) / (weights @ apart)
            share[:, block, j, k] = smaller.sum() / apart.sum(), *percentile_interval(samples, sweep.confidence)[:2]
    names = ("peak_smaller", "peak_smaller_lower", "peak_smaller_upper")
    return {name: (("block", "model", "value"), part) for name, part in zip(names, share, strict=True)}


def decay(blocks: Sequence[Block], grid: Grid) -> dict[str, xr.DataArray]:
    """Compute the free rocking of every law at every value, each oscillator once."""
    parts = []
    for block in blocks:
        laws = [law for row in grid.at for law in (grid.laws[i] for i in row)]
        rigid = [grid.laws[i].restitution(block) for row in grid.against[RIGID] for i in row]
        keys = list(zip(laws, rigid, strict=True))
        once = list(dict.fromkeys(keys))
        decays = free_decay(block, [law for law, _ in once], [float(e or 0.0) for _, e in once])
        where = xr.DataArray(
            np.array([once.index(key) for key in keys]).reshape(grid.at.shape), dims=("model", "value")
        )
        parts.append(decays.isel(law=where))
    together = xr.concat(parts, "block", combine_attrs="override")
    return {str(name): part.transpose("block", "model", "value", ...) for name, part in together.data_vars.items()}


def impact_decay(release: float, e: float, half_cycles: int = HALF_CYCLES) -> Array:
    """Return the peak rotations over alpha of a rigid block that rocks freely, (half_cycles + 1,), from the release on.

    x_n = 1 - sqrt(1 - e^(2n) [1 - (1 - x0)²]): each impact leaves e² of the energy (Housner 1963).  The formula holds
    for any falling branch that is linear in theta, for the linear and the bilinear branch alike.
    """
    # (1 - sqrt(1 - E) loses all digits of a small E)
    energy = e ** (2.0 * np.arange(half_cycles + 1)) * (1.0 - (1.0 - release) ** 2)
    return np.asarray(energy / (1.0 + np.sqrt(1.0 - energy)))


def impact_times(block: Block, release: float, e: float) -> Array:
    """Return the times of these peaks, as p t, (HALF_CYCLES + 1,).

    A quarter period from the peak x to upright takes acosh(1/(1 - x))/q, q² = p² sin(alpha)/alpha: the bilinear form of
    Housner's 4/p acosh(1/(1 - x)).
    """
    quarters = np.arccosh(1.0 / (1.0 - impact_decay(release, e)))
    q_over_p = np.sqrt(np.sin(block.alpha) / block.alpha)
    return np.asarray(np.concatenate([[0.0], np.cumsum(quarters[:-1] + quarters[1:])]) / q_over_p)


def free_decay(block: Block, laws: Sequence[Law], restitution: Sequence[float]) -> xr.Dataset:
    """Compute the free rocking of a block from `RELEASE` under each law, and the peaks of the rigid block.

    On (law, half_cycle): `decay_peak` and `decay_rigid` (over alpha; NaN where the law has no such peak outside its
    elastic zone).  On law: `decay_error`, the mean over the half cycles 1 to 10 of the peak over the rigid block's,
    less 1.  Peaks count that the rigid block has outside the law's elastic zone, because inside it the law does not
    rock.  A peak that the law does not reach outside its zone counts as the edge of the zone, its upper bound.
    """
    peak = np.full((len(laws), HALF_CYCLES + 1), np.nan)
    rigid = np.array([impact_decay(RELEASE, e) for e in restitution])
    errors = np.full(len(laws), np.nan)
    last = max(SPAN, SLOWER * float(impact_times(block, RELEASE, 1.0)[-1]))
    length = STEP * math.ceil(last / STEP)
    for i, law in enumerate(laws):
        run = free_rocking(block, law, RELEASE * block.alpha, length / block.p, STEP / block.p)
        n = min(run.sizes["peak"], HALF_CYCLES + 1)
        peak[i, :n] = run["peak_rotations"].values[:n] / block.alpha
        edge = 0.0 if isinstance(law, HousnerImpact) else float(getattr(law, "delta", 0.0))
        counted = np.flatnonzero(rigid[i] >= edge)[1:]
        if counted.size:  # (else it comes to rest at once)
            reached = np.where(np.isnan(peak[i]), edge, peak[i])
            errors[i] = np.mean(reached[counted] / rigid[i, counted] - 1.0)
    on = ("law", "half_cycle")
    return xr.Dataset({"decay_peak": (on, peak), "decay_rigid": (on, rigid), "decay_error": ("law", errors)})
