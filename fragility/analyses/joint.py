"""Blocks that fall in the same event: a sample of a region, run under common motions."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Flags, Progress
from ...core.parameters import USUAL_CONFIDENCE, USUAL_MEASURE
from ...core.streams import stream
from ...core.units import ENDS, described, of_end, provenance
from ...models import Block, Law
from ...models.block_array import BlockArray
from ...models.sliding.law import SlidingLaw
from ...motions.intensity.measure import Measure
from ..adaptive.probit import student
from ..numerics.proportions import binomial_interval
from ..runs.runners import Workers
from ..runs.scaling import BlockMeasure, intensity_measure
from .ida import ida

SAMPLE = 2000
"""Blocks of which runs are made: a share has an error of one hundredth at most."""
FEWEST_BLOCKS, FEWEST_MOTIONS = 2, 8
SAMPLE_KEY = (4, 0)
"""Key, under a seed, of the random numbers that the sample is drawn with."""
QUANTILES = (0.05, 0.5, 0.95)


def joint_falls(
    blocks: Block | Sequence[Block] | BlockArray,
    models: Law | Sequence[Law],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = USUAL_MEASURE,
    client: Workers = None,
    *,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    sample: int = SAMPLE,
    seed: int = 0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Distribution, over events, of the share of many blocks that falls in one event.

    Parameters
    ----------
    blocks : Block, sequence of them, or BlockArray
        Blocks of the region, at least two; blocks in a sequence may have walls or restraints.
    models : one or a sequence
        Damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Events, at least 8: each acts on all blocks, scaled to the level.
    levels, im, client, ground, progress
        As of `toppling.ida`.
    sample : int
        Blocks that are run, drawn without replacement from all; all if there are no more.
    seed : int
        Of the sample.

    Returns
    -------
    xarray.Dataset
        On (model, level, motion): `fallen_share`, the share of the sample that falls in each event.

        On (model, level): `fallen_mean` with the 95 % interval `fallen_mean_lower`, `fallen_mean_upper`. `fallen_sd`,
        the standard deviation between events of the share of *all* blocks, without the contribution of the sample.
        `fallen_sd_independent`, its value if blocks fell independently of each other, with the same probabilities.
        `fallen_correlation`, the mean correlation of the falls of two blocks.

        On (model, level, quantile): `fallen_quantile`, of the shares of the events, and `fallen_sampling_error`, the
        standard error of a share from the sample. Bit-identical for any chunking and any number of workers.

    Raises
    ------
    TypeError, ValueError
        As `toppling.ida`; levels without numbers; sliding laws; fewer than two blocks, 8 motions or 2 blocks of the
        sample; a measure that depends on the block.

    Notes
    -----
    Let c_ij be the covariance of the falls of blocks i and j over the events. The share of N blocks has the variance
    (sum of all c_ij)/N² = ((N - 1) c + v)/N. Here v is the mean of c_ii = P_i (1 - P_i), and c the mean of the other
    c_ij. Means over a sample of n blocks are unbiased for the means over all. With s² the variance of the shares of the
    sample, c = (n s² - v)/(n - 1). Independent falls have v/N, and the correlation is c/v (*derived*).

    Examples
    --------
    >>> import toppling as tp
    >>> shelves = BlockArray([0.4, 0.41, 0.42, 0.43], [1.8, 1.8, 1.9, 1.9])
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(40, seed=1)
    >>> shares = joint_falls(shelves, tp.HousnerImpact(), shakes, [4.5])
    >>> bool((shares["fallen_sd"] > 1.5 * shares["fallen_sd_independent"]).item())
    True
    """
    if isinstance(intensity_measure(im), BlockMeasure):
        raise ValueError(f"im must not depend on the block, whose motions would differ in one event, got {im!r:.40}")
    if isinstance(blocks, BlockArray) and blocks.own:
        keys = " and ".join(blocks.own)
        raise ValueError(f"blocks must take {keys} from the laws, and not have their own: give laws for each {keys}")
    if isinstance(levels, str):
        raise TypeError(f"levels must be numbers, common to all blocks and events, got {levels!r:.40}")
    if any(isinstance(law, SlidingLaw) for law in (models if isinstance(models, Sequence) else [models])):
        raise ValueError("models must be laws of rocking blocks, which overturn: sliding ones do not")
    number, chosen = _sample(blocks, checks.count("sample", sample, at_least=FEWEST_BLOCKS), checks.count("seed", seed))
    runs = ida(
        chosen, models, motions, levels, im, ["overturned"], client, screen=False, ground=ground, progress=progress
    )
    if runs.sizes["motion"] < FEWEST_MOTIONS:
        raise ValueError(f"motions must be at least {FEWEST_MOTIONS} for a distribution, got {runs.sizes['motion']}")
    fell = runs["overturned"].transpose("model", "level", "block", "motion").values
    table = [[_falls(fell[i, j], number) for j in range(fell.shape[1])] for i in range(fell.shape[0])]
    dims = ("model", "level")
    variables: dict[str, Any] = {}
    for name, text in _LABELS.items():
        values = np.array([[shares[name] for shares in row] for row in table])
        more = {"share": ("motion",), "quantile": ("quantile",), "sampling_error": ("quantile",)}.get(name, ())
        variables[f"fallen_{name}"] = ((*dims, *more), values, described(text))
    shares = described("share of the events in which less falls")
    kept = [name for name, coordinate in runs.coords.items() if not {"block", "reason"} & {*coordinate.dims}]
    return xr.Dataset(
        variables,
        coords={**{name: runs[name].variable for name in kept}, "quantile": ("quantile", list(QUANTILES), shares)},
        attrs={
            "title": "Share of the blocks that fall in one event",
            "blocks": number,
            "sample": len(chosen),
            **provenance({"design": "joint falls", "blocks": number, "sample": len(chosen), "seed": seed}),
        },
    )


_LABELS = {
    "share": "share of the sampled blocks that falls in the event",
    **{f"mean{end}": of_end(end, "mean share of the blocks that falls in an event", USUAL_CONFIDENCE) for end in ENDS},
    "sd": "standard deviation between events of the share of all blocks that falls",
    "sd_independent": "what this standard deviation would be if blocks fell independently of each other",
    "correlation": "mean correlation between events of the falls of two blocks",
    "quantile": "quantile over events of the share of the blocks that falls",
    "sampling_error": "standard error of that share from the sample of blocks",
}


def _sample(blocks: Block | Sequence[Block] | BlockArray, sample: int, seed: int) -> tuple[int, list[Block]]:
    """Return the number of blocks, and those that are run, in the order in which they were given."""
    if not isinstance(blocks, Block | Iterable | BlockArray):
        raise TypeError(f"blocks must be Blocks or a BlockArray, got {checks.kind(blocks)}")
    given = blocks if isinstance(blocks, BlockArray) else [blocks] if isinstance(blocks, Block) else list(blocks)
    number = len(given)
    if number < 2:
        raise ValueError(f"blocks must be at least two to fall together, got {number}")
    which = np.arange(number)
    if sample < number:
        which = np.sort(stream(seed, *SAMPLE_KEY).choice(number, sample, replace=False))
    return number, given.some(which) if isinstance(given, BlockArray) else [given[i] for i in which.tolist()]


def _falls(fell: Flags, number: int) -> dict[str, Any]:
    """Return statistics of the shares of `number` blocks from falls (block, motion), by name (`_LABELS`)."""
    n, motions = fell.shape
    share = fell.mean(axis=0)
    chances = fell.mean(axis=1)
    alone = float((chances * (1.0 - chances)).mean()) * motions / (motions - 1.0)
    together = (n * float(share.var(ddof=1)) - alone) / (n - 1.0)
    left = 1.0 - n / number
    # (errors of the mean: few events, and blocks of the sample that fall more or less often than the others)
    spread = max(float(chances.var(ddof=1)) - alone / motions, 0.0)
    reach = student(motions - 1) * math.sqrt(float(share.var(ddof=1)) / motions + left * spread / n)
    mean = float(share.mean())
    ends = mean - reach, mean + reach
    if mean in {0.0, 1.0}:
        # as if all blocks fell together, the minimum information of these events
        lower, upper = binomial_interval(round(mean) * motions, motions, USUAL_CONFIDENCE, "clopper-pearson")
        ends = float(lower), float(upper)
    quantile = np.quantile(share, QUANTILES)
    return {
        "share": share,
        "mean": mean,
        "mean_lower": max(ends[0], 0.0),
        "mean_upper": min(ends[1], 1.0),
        "sd": math.sqrt(max((number - 1.0) * together + alone, 0.0) / number),
        "sd_independent": math.sqrt(alone / number),
        "correlation": together / alone if alone > 0.0 else math.nan,
        "quantile": quantile,
        "sampling_error": np.sqrt(left * quantile * (1.0 - quantile) / (n - 1.0)),
    }
