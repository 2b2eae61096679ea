"""Note on curves of first overturnings: closer levels find earlier ones, and by how much the levels at hand decide."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from ...core.wording import whole_percent


def spacing_notes(curves: xr.Dataset) -> list[str]:
    """Return one sentence on curves that were fitted to first overturnings, none on other curves."""
    if "level_shift" not in curves:
        return []
    shifts = curves["level_shift"].values.ravel()
    known = np.expm1(shifts[np.isfinite(shifts)])
    text = "the curves are of first overturnings, which closer levels find earlier, without an end"
    spacing = float(curves.attrs.get("level_spacing", math.nan))
    if math.isfinite(spacing):
        text += f": levels are up to {whole_percent(spacing)} apart"
    if known.size:
        low, high = (whole_percent(float(end)) for end in (known.min(), known.max()))
        much = low if low == high else f"{low} to {high}"
        text += f", and with every other level first overturnings come {much} later"
    return [text]
