"""The history of one run: its check, the samples before the block lies, and the time at which it passes its balance."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from ... import checks
from ...aliases import Flags

FLAT = 0.5 * math.pi
"""|θ| at which a block lies on its side, rad: there the model ends."""


def checked(response: Any, variables: Iterable[str], attributes: Iterable[str]) -> None:
    """Check a response: TypeError if it is no dataset, ValueError if it holds no history of one run or lacks a part."""
    if not isinstance(response, xr.Dataset):
        raise TypeError(f"a response must be a dataset as toppling.simulate returns it, got {checks.kind(response)}")
    lacks = sorted({"rotation", *variables} - {str(name) for name in response.data_vars})
    lacks += sorted({*attributes} - {str(name) for name in response.attrs})
    if lacks or response["rotation"].dims != ("time",):
        why = f"without {', '.join(lacks)}" if lacks else f"with rotation on {response['rotation'].dims}"
        raise ValueError(f"a response must hold one history as toppling.simulate returns it, got a dataset {why}")


def before_lying(response: xr.Dataset) -> Flags:
    """True for the samples before the block lies on its side."""
    if not bool(response["overturned"]):
        return np.ones(response.sizes["time"], dtype=bool)
    return np.asarray(np.abs(response["rotation"].values) < FLAT)


def last_balance(response: xr.Dataset) -> tuple[float, float]:
    """The time (s) and side (θ/α) at which a block that overturns exceeds its balance for the last time.

    Samples are joined by straight lines.  For a history that ends before, it is the last sample.
    """
    standing = before_lying(response)
    time, x = response["time"].values[standing], (response["rotation"].values / response.attrs["alpha"])[standing]
    inside = np.flatnonzero(np.abs(x) <= 1.0)
    last = int(inside[-1]) if inside.size else 0
    if not inside.size or last + 1 == x.size:
        return float(time[last]), float(x[last])
    side = float(np.sign(x[last + 1]))
    share = (side - x[last]) / (x[last + 1] - x[last])
    return float(time[last] + share * (time[last + 1] - time[last])), side
