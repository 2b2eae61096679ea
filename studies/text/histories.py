"""The history of one run: its check, the samples before the block lies, and the time at which it passes its balance."""

import json
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Flags
from ...models import Block
from ...models.block import block_from

FLAT = 0.5 * math.pi
"""|θ| at which a block lies on its side, rad: there the model ends."""


def checked(response: Any, variables: Iterable[str], attributes: Iterable[str]) -> None:
    """Check a response: TypeError if it is no dataset, ValueError if it is no history of one run or lacks a part."""
    if not isinstance(response, xr.Dataset):
        raise TypeError(f"a response must be a dataset as toppling.simulate returns it, got {checks.kind(response)}")
    checks.plain("the response", response)
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


def block_of(response: xr.Dataset) -> Block:
    """Return the block of a run from the attributes of its response."""
    return block_from(json.loads(response.attrs["configuration"])["block"])


class LastBalance(NamedTuple):
    """The last time (s) at which a block was at its balance, with θ/α there; `passed`: it then went beyond for good."""

    time: float
    rotation: float
    passed: bool


def last_balance(response: xr.Dataset) -> LastBalance:
    """The time and rotation at which a block last exceeds its balance, linear between samples; else the last sample."""
    standing = before_lying(response)
    alpha = response.attrs["alpha"]
    time, x = response["time"].values[standing], (response["rotation"].values / alpha)[standing]
    front, back = block_of(response).balances
    inside = np.flatnonzero((x <= front / alpha) & (x >= -back / alpha))
    last = int(inside[-1]) if inside.size else 0
    if not inside.size or last + 1 == x.size:
        return LastBalance(float(time[last]), float(x[last]), False)
    side = front / alpha if x[last + 1] > 0.0 else -back / alpha
    share = (side - x[last]) / (x[last + 1] - x[last])
    return LastBalance(float(time[last] + share * (time[last + 1] - time[last])), side, True)
