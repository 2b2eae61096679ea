"""What claims are judged by beside a study's results: free rocking, peaks, and replicates of the bootstrap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...fragility.fitting.bootstrap import draw_clusters, percentile_interval
from ...fragility.runs.provenance import polarity_pairs
from ...models import Block
from ...studies.file.uncertainty import RIGID, Sweep
from ...studies.kinds.sensitivity import OUTPUTS, SensitivityStudy
from ...studies.sensitivity.comparisons import Curves
from ...studies.sensitivity.findings import Grid, swings_and_slopes
from .free_decay import free_decay


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
    found: dict[str, Any] = {
        "log_median_sample": ((*on, "replicate"), curves.log_samples[:, grid.at]),
        "log_rigid_sample": ((*on, "replicate"), curves.log_samples[:, grid.against[RIGID]]),
        "log_trend_sample": (("block", "model", "span", "replicate"), slopes[..., 1:]),
        "viscous_rate": (on, np.array(rate)),
    }
    return results.assign(found | peaks(runs, grid, sweep) | decay(blocks, grid))


def peaks(runs: xr.Dataset, grid: Grid, sweep: Sweep) -> dict[str, Any]:
    """Return the shares of smaller peaks, with intervals, of the rigid block's rocking runs where the peaks differ."""
    peak, lifted = (
        runs[name].transpose("block", "model", "level", "motion").values for name in ("peak_rotation", "uplifted")
    )
    rigid = grid.against[RIGID]
    weights = draw_clusters(polarity_pairs(runs), sweep.replicates, sweep.seed)
    share = np.full((3, peak.shape[0], *grid.at.shape), np.nan)
    for block, j, k in np.ndindex(*share.shape[1:]):
        own, base = peak[block, grid.at[j, k]], peak[block, rigid[j, k]]
        told = lifted[block, rigid[j, k]] & (own != base)
        smaller, apart = (told & (own < base)).sum(axis=0), told.sum(axis=0)
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
        found = free_decay(block, [law for law, _ in once], [float(e or 0.0) for _, e in once])
        where = xr.DataArray(
            np.array([once.index(key) for key in keys]).reshape(grid.at.shape), dims=("model", "value")
        )
        parts.append(found.isel(law=where))
    together = xr.concat(parts, "block", combine_attrs="override")
    return {str(name): one.transpose("block", "model", "value", ...) for name, one in together.data_vars.items()}
