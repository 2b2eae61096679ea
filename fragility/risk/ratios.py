"""The ratio of two numbers of the same motions, with its interval over motions."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, exp, log
from ..fitting.bootstrap import percentile_interval


class Ratio(NamedTuple):
    """A ratio with its interval, NaN if it is not known."""

    value: float
    lower: float
    upper: float


def ratio_of(
    a: float,
    b: float,
    of_a: Array | None,
    of_b: Array | None,
    confidence: float,
    of_runs: Sequence[float] | Array = (math.nan, math.nan),
) -> Ratio:
    """Return b/a with the percentile interval of the ratio of replicates (replicate,), replicate by replicate.

    Both numbers are >= 0, NaN if there is none; replicates that are None give no interval. `of_runs` (2,) are both
    numbers by the runs, if a and b are of fitted curves: the interval also contains itself moved there.
    """
    if not (a > 0.0 and math.isfinite(a) and math.isfinite(b)):
        return Ratio(math.nan, math.nan, math.nan)
    # (nothing that was never seen to fall has a range of chances in its replicates)
    if of_a is None or of_b is None or b == 0.0:
        return Ratio(b / a, math.nan, math.nan)
    # (a few motions decide: in many resamples nothing falls, and the rest would look more alike than they are)
    empty = float(np.mean(~((np.asarray(of_a) > 0.0) & (np.asarray(of_b) > 0.0))))
    if empty > 0.5 * (1.0 - confidence):
        return Ratio(b / a, math.nan, math.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        samples = log(of_b) - log(of_a)
    lower, upper = (float(end[0]) for end in percentile_interval(samples[None], confidence)[:2])
    apart = math.log(of_runs[1] / of_runs[0] * a / b) if min(of_runs) > 0.0 else 0.0
    return Ratio(b / a, float(exp(min(lower, lower + apart))), float(exp(max(upper, upper + apart))))
