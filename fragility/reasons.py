"""Reasons why a run is outside what the model can say, one bit each, and their shares among the runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..units import DIMENSIONLESS


class Reason(NamedTuple):
    """Why a run is outside what the model can say: short name, bit of `verdict`, and what it means."""

    name: str
    bit: int
    text: str


SQUAT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT, ELASTIC_MODE, SCALED_FAR, UNDECIDED = REASONS = (
    Reason("squat", 1, "centre of mass less than two half widths high: bouncing decides"),
    Reason("slides_at_uplift", 2, "slides before or at uplift"),
    Reason("slides_while_rocking", 4, "slides at the peak of the motion"),
    Reason("slides_at_impact", 8, "slides when it comes down"),
    Reason("elastic_mode", 16, "the law's elastic mode lies inside the motion's band"),
    Reason("scaled_far", 32, "the motion is scaled beyond the bounds"),
    Reason("undecided", 64, "a millionth more or less of motion or restitution changes the flag"),
)
ANY = "any"


def labelled(values: xr.DataArray, long_name: str, units: str = DIMENSIONLESS) -> xr.DataArray:
    """The values with no other attributes than these two."""
    return values.drop_attrs().assign_attrs(units=units, long_name=long_name)


def verdict_of(
    runs_like: xr.DataArray, holds: Mapping[Reason, xr.DataArray], undecided: xr.DataArray | None
) -> tuple[xr.DataArray, xr.DataArray]:
    """The bits of every run, and the share of runs for each reason; `runs_like` is zero on their dimensions."""
    verdict = runs_like
    shares = []
    for reason in REASONS:
        if reason in holds:
            here = runs_like + holds[reason].astype(np.uint8)
            verdict = verdict | here * np.uint8(reason.bit)
            shares.append(_share(here))
        else:
            shares.append(_share(runs_like))
    if undecided is not None:
        shares[REASONS.index(UNDECIDED)] = undecided
    shares.append(_share(verdict > 0))
    outside = xr.concat([one.drop_attrs() for one in shares], "reason")
    masks = {
        "flag_masks": np.array([one.bit for one in REASONS], np.uint8),
        "flag_meanings": " ".join(one.name for one in REASONS),
    }
    return (
        labelled(verdict, "what speaks against the run, 0 where nothing does").assign_attrs(masks),
        labelled(outside, "share of the runs for which the reason holds"),
    )


def _share(here: xr.DataArray) -> xr.DataArray:
    share: xr.DataArray = here.mean([dim for dim in here.dims if dim not in ("block", "model")])
    return share


def reason_names() -> xr.Variable:
    """The coordinate of the shares."""
    names = np.array([*(one.name for one in REASONS), ANY], dtype=object)
    return xr.Variable("reason", names, {"units": DIMENSIONLESS, "long_name": "what speaks against the runs"})
