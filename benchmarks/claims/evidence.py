"""What claims are judged by beside a study's results: free rocking, pulses, peaks, and replicates of the bootstrap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ...fragility import ida
from ...fragility.fitting.bootstrap import draw_clusters, percentile_interval
from ...fragility.runs.provenance import polarity_pairs
from ...models import Block
from ...motions import OneCycleSine
from ...studies.file.uncertainty import RIGID, Sweep
from ...studies.kinds.sensitivity import OUTPUTS, SensitivityStudy
from ...studies.sensitivity.comparisons import Curves
from ...studies.sensitivity.findings import Grid, swings_and_slopes
from .free_decay import free_decay

SMALL = 0.01
"""Values of delta up to which the order of convergence is fitted."""
CALM = (0.2, 0.5)
"""Peaks of the rigid block, over alpha, under the pulses of convergence: outside the zones, far from overturning."""
PULSE_FREQUENCY = 5.0
PULSE_LEVELS = np.linspace(1.1, 2.8, 18)
"""Pulses that measure the distance of a law from the rigid block: omega/p of one sine cycle, peaks over g tan alpha.

The rigid block with e = 0.9 survives these pulses up to 3.02 (Zhang and Makris 2001).
"""
PULSE_STEPS = 500


def evidence(study: SensitivityStudy, results: xr.Dataset) -> xr.Dataset:
    """Return the results of a study with what its claims are judged by; its runs are run once more.

    On (block, model, value, replicate): `log_median_sample` and `log_rigid_sample`, ln of the median (SI) of the law
    and of the rigid block, the same motions for all; on (block, model, span, replicate) `log_trend_sample`.
    """
    grid, sweep, blocks = study.grid, study.sweep, study.blocks
    runs = study.design.run(blocks, grid.laws, OUTPUTS, None, None)
    curves = Curves.of(runs[["overturned"]], sweep.replicates, sweep.seed, sweep.confidence)
    _, slopes = swings_and_slopes(curves, blocks, grid, sweep)
    rate = [[[grid.laws[i].oscillator(one).regions[0].damping for i in row] for row in grid.at] for one in blocks]
    on = ("block", "model", "value")
    found: dict[str, Any] = {
        "log_median_sample": ((*on, "replicate"), curves.log_samples[:, grid.at]),
        "log_rigid_sample": ((*on, "replicate"), curves.log_samples[:, grid.against[RIGID]]),
        "log_trend_sample": (("block", "model", "span", "replicate"), slopes[..., 1:]),
        "viscous_rate": (on, np.array(rate)),
        **peaks(runs, grid, sweep),
        **decay(blocks, grid),
    }
    if sweep.parameter == "delta":
        found |= convergence([pulses(block, grid) for block in blocks], blocks, grid, sweep)
    return results.assign(found)


def pulses(block: Block, grid: Grid) -> xr.DataArray:
    """Return the peak rotations (model, level) of a block under its pulses, for all distinct laws."""
    omega = PULSE_FREQUENCY * block.p
    pulse = OneCycleSine(1.0, omega, dt=2.0 * np.pi / omega / PULSE_STEPS).sample(1)
    levels = PULSE_LEVELS * STANDARD_GRAVITY * block.b / block.h
    runs = ida(block, grid.laws, pulse, levels, outputs="peak_rotation", screen=False)
    return runs["peak_rotation"].isel(block=0, motion=0)


def convergence(peaks: Sequence[xr.DataArray], blocks: Sequence[Block], grid: Grid, sweep: Sweep) -> dict[str, Any]:
    """Compute distances from the rigid block under pulses, from each block's peaks (model, level) of all `grid.laws`.

    `pulse_error` (block, model, value) is the root mean square of the difference of peaks over alpha, over those pulses
    under which the rigid block turns by 0.2 to 0.5 of alpha (outside the zones, and so far from overturning that
    nothing jumps);
    `convergence_order` (block, model) the slope of its logarithm over that of delta, for delta up to 0.01.
    """
    each_block = np.stack([one.transpose("model", "level").values for one in peaks])
    scaled = each_block / np.array([block.alpha for block in blocks])[:, None, None]
    own, rigid = scaled[:, grid.at], scaled[:, grid.against[RIGID]]
    calm = (rigid >= CALM[0]) & (rigid <= CALM[1])
    with np.errstate(invalid="ignore"):
        error = np.sqrt(np.where(calm, (own - rigid) ** 2, 0.0).sum(axis=-1) / calm.sum(axis=-1))
    order = order_of(error, sweep.values)
    return {"pulse_error": (("block", "model", "value"), error), "convergence_order": (("block", "model"), order)}


def order_of(error: Array, values: Array) -> Array:
    """Return the slope of ln error (block, model, value) over ln delta, for delta up to 0.01; NaN without one."""
    small = np.flatnonzero(values <= SMALL)
    if small.size < 2:
        return np.full(error.shape[:2], np.nan)
    x = np.log(values[small])
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.log(error[..., small]) @ (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    return np.where(np.isfinite(slope), slope, np.nan)


def peaks(runs: xr.Dataset, grid: Grid, sweep: Sweep) -> dict[str, Any]:
    """Compare with the rigid block: shares of smaller peaks, and of motions that uplift only the law's block.

    `peak_smaller`, of the rigid block's rocking runs, of those where the peaks differ.
    """
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
    found = {name: (("block", "model", "value"), part) for name, part in zip(names, share, strict=True)}
    alone = np.empty((*share.shape[1:], lifted.shape[2]))
    for block, j, k in np.ndindex(*share.shape[1:]):
        alone[block, j, k] = np.mean(lifted[block, grid.at[j, k]] & ~lifted[block, rigid[j, k]], axis=-1)
    return {**found, "uplift_alone": (("block", "model", "value", "level"), alone)}


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
