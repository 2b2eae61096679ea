"""Reasons why a run is outside the range of the model, one bit each, and their shares among the runs."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Flags, Index
from ...core.units import DIMENSIONLESS, described
from ..numerics.slabs import Where, spread


class Reason(NamedTuple):
    """A reason why a run is outside the range of the model: short name, bit of `verdict`, and meaning."""

    name: str
    bit: int
    text: str


REASONS = (
    Reason("squat", 1, "centre of mass less than two half widths high: bouncing decides"),
    Reason("slides_at_uplift", 2, "slides before or at uplift"),
    Reason("slides_while_rocking", 4, "slides at the peak of the motion"),
    Reason("slides_at_impact", 8, "slides when it comes down"),
    Reason("elastic_mode", 16, "the law's elastic mode lies inside the motion's band"),
    Reason("scaled_far", 32, "the motion is scaled beyond the bounds"),
    Reason("undecided", 64, "a millionth more or less of motion or restitution changes the flag"),
    Reason("airborne", 128, "the floor falls faster than g: not computed, counted as overturned"),
)
SQUAT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT, ELASTIC_MODE, SCALED_FAR, UNDECIDED, AIRBORNE = REASONS
ANY = "any"


def labelled(values: xr.DataArray | xr.Variable, long_name: str, units: str = DIMENSIONLESS) -> xr.Variable:
    """Return the values with only these two attributes."""
    return xr.Variable(values.dims, values.data, described(long_name, units))


def verdict_of(sizes: Mapping[str, int], holds: Mapping[Reason, xr.Variable]) -> xr.Variable:
    """Return the sum of the reasons of every run; `sizes`: of the dimensions of the runs, in order."""
    verdict = np.zeros(tuple(sizes.values()), np.uint8)
    # (reasons on the same dimensions are combined first, because there are many runs)
    for dims in {hold.dims: None for hold in holds.values()}:
        alike = [(reason, hold) for reason, hold in holds.items() if hold.dims == dims]
        bits = np.bitwise_or.reduce([np.where(on.values, np.uint8(reason.bit), np.uint8(0)) for reason, on in alike])
        np.bitwise_or(verdict, spread(xr.Variable(dims, bits), sizes), out=verdict)
    variable = labelled(xr.Variable(tuple(sizes), verdict), "what speaks against the run, 0 where nothing does")
    # (only vertical shaking can use the eighth bit, which files without unsigned integers cannot hold)
    reasons = [reason for reason in REASONS if reason is not AIRBORNE or reason in holds]
    variable.attrs |= {
        "flag_masks": np.array([reason.bit for reason in reasons], np.uint8),
        "flag_meanings": " ".join(reason.name for reason in reasons),
    }
    return variable


class Shares:
    """Counts, slab by slab, of the runs with each reason; `sizes`: of all runs by dimension, in order."""

    def __init__(self, sizes: Mapping[str, int]) -> None:
        self._sizes = {dim: size for dim, size in sizes.items() if dim in ("block", "model")}
        self.runs: Any = math.prod(size for dim, size in sizes.items() if dim not in self._sizes)
        self._counts = np.zeros((*self._sizes.values(), len(REASONS) + 1), np.int64)

    def add(self, holds: Mapping[Reason, xr.Variable], verdict: xr.Variable, where: Where) -> None:
        """Add the counts of a slab."""
        counts = self._counts[tuple(where.get(dim, slice(None)) for dim in self._sizes)]
        kept = {dim: counts.shape[i] for i, dim in enumerate(self._sizes)}
        runs = math.prod(size for dim, size in verdict.sizes.items() if dim not in kept)
        for i, on in [*((REASONS.index(reason), hold) for reason, hold in holds.items()), (len(REASONS), verdict > 0)]:
            over = [dim for dim in on.dims if dim not in kept]
            times = runs // math.prod(on.sizes[dim] for dim in over)
            counts[..., i] += times * spread(on.sum(over), kept).astype(np.int64)

    def outside(self, undecided: xr.Variable | None) -> xr.Variable:
        """Return the share of all runs for each reason; for `undecided` the share among the runs tested."""
        shares = self._counts / self.runs
        if undecided is not None:
            shares[..., REASONS.index(UNDECIDED)] = spread(undecided, self._sizes)
        return labelled(xr.Variable((*self._sizes, "reason"), shares), "share of the runs for which the reason holds")


class CurveShares(Shares):
    """Shares of the runs in a table, curve by curve: `curve` (run,) is their number, `near` True if they count."""

    def __init__(self, sizes: Mapping[str, int], curve: Index, near: Flags) -> None:
        super().__init__(sizes)
        self._curve, self._near = curve, near

    def add(self, holds: Mapping[Reason, xr.Variable], verdict: xr.Variable, where: Where) -> None:
        """Add the counts of a slab."""
        near, (part,) = self._near, where.values()
        curve, counts = self._curve[part][near[part]], self._counts.reshape(-1, len(REASONS) + 1)
        for i, flags in [*((REASONS.index(reason), flags) for reason, flags in holds.items()), (-1, verdict > 0)]:
            counts[:, i] += np.bincount(curve[flags.values[near[part]]], minlength=len(counts))

    def outside(self, undecided: xr.Variable | None) -> xr.Variable:
        """Return the share of the runs of each curve for each reason, as of all runs."""
        runs = np.bincount(self._curve[self._near], minlength=math.prod(self._sizes.values()))
        self.runs = runs.reshape(*self._sizes.values(), 1)
        return super().outside(undecided)


def reason_names() -> xr.Variable:
    """Return the coordinate `reason` of the shares."""
    names = np.array([*(reason.name for reason in REASONS), ANY], dtype=object)
    return xr.Variable("reason", names, described("what speaks against the runs"))
