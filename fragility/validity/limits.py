"""Limits beyond which results are not valid: of the checks of studies, and of the warnings of functions in Python."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.wording import counted, short_digits
from ..numerics.proportions import runs_for_half_width, wilson_half_width
from ..runs.provenance import BED, scaled_to_levels
from .reasons import ELASTIC_MODE, SLIDES_AT_IMPACT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SQUAT

NEEDED = {reason.name for reason in (SQUAT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT, ELASTIC_MODE)}
"""Names of the reasons of runs that are outside of a model of which these limits are."""
MOST = 0.5
"""Share of runs, or of a rate, above which, for every block and law, results are not valid."""
HOPELESS = 4.0
"""Ratio of the ends of every median's interval above which medians are not valid."""
PLAIN = "pga", "pgv", "pgd", "cav"
"""Measures that grow with the scale factor and are coordinates of runs."""
SAME = 1e-6
NO_BETTER_THAN = 0.3
"""Half width of the interval of a probability of 1/2 above which the number of motions is not valid."""


def mostly(shares: xr.DataArray | Array) -> bool:
    """Return True if every share is above `MOST`."""
    return float(shares.min()) > MOST


def sliding_shares(data: xr.Dataset) -> xr.DataArray:
    """Return the shares of the runs (block, model) in which a block slides at any time."""
    reasons = (SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT)
    return data["outside"].sel(reason=[reason.name for reason in reasons]).max("reason")


def interval_ratios(curves: xr.Dataset) -> xr.DataArray:
    """Return the ratios of the ends of the intervals of half_level, NaN if it lies beyond the levels."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = curves["half_level_upper"] / curves["half_level_lower"]
    return ratio.where(np.isfinite(curves["half_level"]) & (curves["half_level"] > 0.0))


def of_runs(data: xr.Dataset, motions: int) -> Iterator[str]:
    """Yield the sentences on runs that are not valid; motions: their number at the level that has the fewest."""
    if motions and wilson_half_width(motions) > NO_BETTER_THAN:
        yield (
            f"{counted(motions, 'motion')} {'leaves' if motions == 1 else 'leave'} a probability of 1/2 known to "
            f"±{wilson_half_width(motions):.2f}: "
            f"take {runs_for_half_width(NO_BETTER_THAN)} or more"
        )
    if copies := _copies(data):
        yield (
            f"{counted(copies, 'motion')} of {data.sizes['motion']:,} repeat another by label and outcomes: copies "
            "make intervals too narrow"
        )
    yield from _levels_changed(data)
    reasons = data["outside"].indexes.get("reason") if "outside" in data else None
    if reasons is None or 0 in data["outside"].shape or not reasons.is_unique or not {*reasons} >= NEEDED:
        return
    if mostly(data["outside"].sel(reason=SQUAT.name)):
        yield "every block is so squat that it bounces rather than rocks"
    if mostly(sliding_shares(data)):
        yield "every block would slide in more than half of its runs unless its friction is above 1"
    soft = BED in data.coords or ("rest" in data.coords and bool((data["rest"] == "soft").any()))
    resonant = data["outside"].sel(reason=ELASTIC_MODE.name)
    if not soft and mostly(resonant.mean([dim for dim in resonant.dims if dim != "model"])):
        yield "the elastic mode of every law resonates in more than half of the runs: take a smaller delta"


def _copies(data: xr.Dataset) -> int:
    """Return the number of motions that have the label and the outcomes of an earlier motion."""
    if not {"motion"} <= {*data.coords} or "overturned" not in data or "motion" not in data["overturned"].dims:
        return 0
    labels = [str(label) for label in data["motion"].values.tolist()]
    if len({*labels}) == len(labels):
        return 0
    flags = np.moveaxis(data["overturned"].values, data["overturned"].dims.index("motion"), 0).astype(bool)
    seen = [(label, row.tobytes()) for label, row in zip(labels, flags, strict=True)]
    return len(seen) - len({*seen})


def _levels_changed(data: xr.Dataset) -> Iterator[str]:
    """Yield the sentences on levels that were changed or joined after the runs: measures of scaled motions show it."""
    axis = "level" if "level" in data.dims else "intensity"
    if axis not in data.coords or "motion" not in data.dims or data.sizes["motion"] < 2:
        return
    levels, factors = data[axis], data.get("scale_factor", xr.DataArray(1.0))
    if levels.dims == ("level",) and len({*levels.values.tolist()}) < levels.size:
        yield "a level stands there twice, so that its runs count twice: join runs of different levels alone"
        return
    if "scale_factor" not in data and scaled_to_levels(data):
        return  # (the screen keeps the factors)
    im = str(levels.attrs.get("im", data.attrs.get("im", "")))
    if im not in PLAIN or im not in data.coords or data[im].dims != ("motion",):
        return
    of_runs = factors * data[im] / levels
    if {*of_runs.dims} - {"level", "motion"} or 0 in of_runs.shape:
        return
    ratios = of_runs.transpose("motion", ...).values.reshape(data.sizes["motion"], -1)
    # (measures of floors or components under levels of the ground differ from motion to motion, but not with the level)
    if not bool((abs(ratios / ratios[:, :1] - 1.0) < SAME).all()):
        yield "scale factors do not grow with the levels: runs of other levels or measures were joined or relabelled"
    elif bool((abs(ratios / ratios[0] - 1.0) < SAME).all()) and abs(ratios[0, 0] - 1.0) > SAME:
        unit, times = str(data[im].attrs.get("units", "")), short_digits(1.0 / float(ratios[0, 0]))
        yield f"levels are {times} times the {im} of the scaled motions: keep them in {unit}"


def of_curves(curves: xr.Dataset) -> Iterator[str]:
    """Yield the sentence on fitted curves none of which can be relied on."""
    if not curves["converged"].size:
        return
    if not curves["converged"].any():
        reasons = ", ".join(dict.fromkeys(curves["status"].values.ravel().astype(str)))
        yield f"no curve can be fitted ({reasons}): take other levels or more motions"
    elif "half_level_lower" in curves and not bool((curves["half_level"] == np.inf).all()):
        ratios = interval_ratios(curves)
        if not bool(ratios.notnull().any()):
            yield "no level at which half fall has an interval: take more motions"
        elif float(ratios.min()) > HOPELESS:
            yield f"every interval of a level at which half fall spans a factor above {HOPELESS:g}: take more motions"


def of_rates(rates: xr.Dataset) -> Iterator[str]:
    """Yield the sentences on annual rates from beyond the hazard curve."""
    if not rates["rate"].size:
        return
    known = np.isfinite(rates["rate"])
    if not bool(known.any()):
        yield "no curve has an annual rate: give curves with a median"
        return
    for side, end, more in (("below", "first", "lower"), ("above", "last", "higher")):
        if mostly(rates[f"share_{side}"].where(known)):
            yield (
                f"more than half of every rate comes from shaking {side} the hazard curve's {end} level: "
                f"give the curve at {more} levels"
            )
