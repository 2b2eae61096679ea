"""Fitted fragility curves as functions: the probability of overturning at any level, for every form a fit may have.

Curves of one form are a NamedTuple of plain arrays with a method `probability`; `curve_arrays` makes it from a labelled
dataset. The fit of the curves and their hazard curve are not used here.
"""

from typing import Any, NamedTuple, Self

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, exp, log
from ...core.units import DIMENSIONLESS, described
from ..fitting.links import LINKS, LOGNORMAL
from ..runs.provenance import coordinates_on, load_coordinates
from ..validity.plausibility import level_doubts

UPLIFT = "uplift-lognormal"
ISOTONIC = "isotonic"
TABULATED = (ISOTONIC, "tabulated")
LINKED = tuple(name for name in LINKS if name != LOGNORMAL)
FORMS = (LOGNORMAL, UPLIFT, *LINKED, *TABULATED)
REFUSE, LEAST, MOST = "refuse", "least", "most"
OUTSIDE = (REFUSE, LEAST, MOST)
"""Rules for a tabulated curve beyond its levels: an error, or the minimum or the maximum that a rising curve allows."""


def step_or_normal(log_x: Array, log_median: Array, dispersion: Array) -> Array:
    """Return Phi(ln(x/median)/dispersion); for a dispersion of 0 a step: 0 below the median, 1 from the median on."""
    with np.errstate(divide="ignore", invalid="ignore"):
        smooth = scipy.special.ndtr((log_x - log_median) / dispersion)
    # the comparison is False for NaN, which must stay NaN
    step = np.where(np.isnan(log_median), np.nan, (log_x >= log_median).astype(float))
    return np.where(dispersion == 0.0, step, smooth)


class LognormalCurves(NamedTuple):
    """Lognormal curves, each times a lognormal curve of uplift: ln of medians, and dispersions, all of one shape.

    Curves without uplift have log_uplift = -inf and uplift_dispersion = 0: a step below every level.
    """

    log_median: Array
    dispersion: Array
    log_uplift: Array
    uplift_dispersion: Array

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the arrays, with one curve per element."""
        return self.log_median.shape

    def probability(self, log_x: Array, outside: str = REFUSE) -> Array:
        """Return P (..., level) at ln x, of a shape that broadcasts with (..., 1)."""
        over = step_or_normal(log_x, self.log_median[..., None], self.dispersion[..., None])
        return over * step_or_normal(log_x, self.log_uplift[..., None], self.uplift_dispersion[..., None])

    def shifted(self, log_factor: Array) -> Self:
        """Return the curves with every level multiplied by a factor, given by its logarithm."""
        return self._replace(log_median=self.log_median + log_factor, log_uplift=self.log_uplift + log_factor)

    def rows(self, where: Any) -> Self:
        """Return some of the curves."""
        return type(self)(*(array[where] for array in self))

    def flat(self) -> Self:
        """Return the curves in one dimension."""
        return type(self)(*(array.reshape(-1) for array in self))


class TabulatedCurves(NamedTuple):
    """Curves known at levels, linear in ln x between them: log_levels (level,), values (..., level).

    shift (...,) is added to ln of the levels of each curve.
    """

    log_levels: Array
    values: Array
    shift: Array

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the curves without their levels."""
        return self.values.shape[:-1]

    def probability(self, log_x: Array, outside: str = REFUSE) -> Array:
        """Return P (..., level) at ln x, of a shape that broadcasts with (..., 1).

        ValueError for levels beyond the curve's own under the rule "refuse".
        """
        shape = (*self.shape, np.shape(log_x)[-1])
        points = np.broadcast_to(log_x, shape).reshape(-1, shape[-1])
        values, shifts = self.values.reshape(-1, self.log_levels.size), self.shift.reshape(-1)
        if outside == REFUSE:
            low, high = self.log_levels[0] + shifts[:, None], self.log_levels[-1] + shifts[:, None]
            # a level may miss the end by the rounding of its logarithm
            beyond = (points < low - 1e-12) | (points > high + 1e-12)
            if beyond.any():
                row, at = (int(i) for i in np.argwhere(beyond)[0])
                raise ValueError(
                    f"the curve is known from {exp(low[row, 0]):g} to {exp(high[row, 0]):g} only, got a level of "
                    f"{exp(points[row, at]):g}: give outside='least' or 'most'"
                )
        most = outside == MOST
        chances = np.empty(points.shape)
        for row, (line, value, shift) in enumerate(zip(points, values, shifts, strict=True)):
            ends = {"left": value[0] if most else 0.0, "right": 1.0 if most else value[-1]} if outside != REFUSE else {}
            chances[row] = np.interp(line, self.log_levels + shift, value, **ends)
        broken = np.isnan(values).any(axis=1)
        chances[broken] = np.nan
        return chances.reshape(shape)

    def shifted(self, log_factor: Array) -> Self:
        """Return the curves with every level multiplied by a factor, given by its logarithm."""
        return self._replace(shift=self.shift + log_factor)

    def rows(self, where: Any) -> Self:
        """Return some of the curves."""
        return self._replace(values=self.values[where], shift=self.shift[where])

    def flat(self) -> Self:
        """Return the curves in one dimension."""
        return self._replace(values=self.values.reshape(-1, self.log_levels.size), shift=self.shift.reshape(-1))


class LinkedCurves(NamedTuple):
    """Two-parameter curves with another link function than the normal: ln of medians, dispersions, name of the link."""

    log_median: Array
    dispersion: Array
    link: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the arrays, with one curve per element."""
        return self.log_median.shape

    def probability(self, log_x: Array, outside: str = REFUSE) -> Array:
        """Return P (..., level) at ln x, of a shape that broadcasts with (..., 1)."""
        link = LINKS[self.link]
        with np.errstate(over="ignore"):
            z = link.scale * (log_x - self.log_median[..., None]) / self.dispersion[..., None]
            return np.asarray(link.cumulative(link.quantile(0.5) + z))


CurveArrays = LognormalCurves | TabulatedCurves


def form_name(curves: xr.Dataset) -> str:
    """Return the form of a dataset of curves, from its attribute ``form`` or from its variables."""
    if not isinstance(curves, xr.Dataset):
        raise TypeError(f"curves must be a dataset as fit_fragility returns it, got {checks.kind(curves)}")
    checks.plain("curves", curves)
    load_coordinates(curves)
    if "run_block" in curves and "form" not in curves.attrs:  # a study has fitted curves in addition to its runs
        raise ValueError("curves must be a dataset as fit_fragility returns it, got runs at adaptive levels")
    stated = curves.attrs.get("form")
    if stated is None:
        stated = UPLIFT if "uplift_median" in curves else LOGNORMAL
    name = checks.choice("form of the curves", stated, FORMS)
    wanted = {
        LOGNORMAL: ("median", "dispersion"),
        UPLIFT: ("median", "dispersion", "uplift_median", "uplift_dispersion"),
        **dict.fromkeys(LINKED, ("median", "dispersion")),
    }.get(name, ("probability", "level"))
    missing = [key for key in wanted if key not in curves]
    if missing:
        held = ", ".join(map(str, curves.data_vars)) or "nothing"
        raise ValueError(
            f"curves of the form {name!r} must hold {', '.join(wanted)}; {missing[0]} is missing in {held}"
        )
    return name


def curve_arrays(curves: xr.Dataset, replicates: bool = False) -> tuple[CurveArrays | LinkedCurves, tuple[str, ...]]:
    """Return the curves of a labelled dataset as plain arrays, with the dimensions of the arrays.

    With `replicates` the curves are the bootstrap replicates, whose last dimension is ``replicate``. A curve without an
    estimate is NaN; medians not > 0, dispersions below 0 and probabilities outside [0, 1] or falling are errors.
    """
    name = form_name(curves)
    suffix = "_sample" if replicates else ""
    if replicates and not has_replicates(curves):
        raise ValueError("curves hold no bootstrap replicates (median_sample or probability_sample on replicate)")
    if name in TABULATED:
        return _tabulated(curves, suffix)
    wanted = ["median", "dispersion"] + (["uplift_median", "uplift_dispersion"] if name == UPLIFT else [])
    # a fit may keep the uplift fixed and resample only the rest
    parameters = [curves.variables[key + suffix if key + suffix in curves else key] for key in wanted]
    arrays = xr.broadcast(*map(xr.DataArray, parameters))
    dims = _ordered(arrays[0].dims)
    values = [np.asarray(array.transpose(*dims).values, dtype=np.float64) for array in arrays]
    for parameter, value in zip(wanted, values, strict=True):
        wrong = value < 0.0 if parameter.endswith("dispersion") else value <= 0.0
        wrong |= np.isinf(value)
        if wrong.any():
            allowed = "finite and >= 0" if parameter.endswith("dispersion") else "finite and > 0"
            raise ValueError(f"{parameter} of the curves must be {allowed}, got {value[wrong][0]:g}")
    if name in LINKED:
        if (values[1] == 0.0).any():
            raise ValueError(f"dispersion of {name} curves must be > 0, got 0")
        return LinkedCurves(log(np.where(np.isnan(values[1]), np.nan, values[0])), values[1], name), dims
    if name != UPLIFT:
        values += [np.zeros_like(values[0]), np.zeros_like(values[0])]
    # a curve with a missing number has no estimate
    values[0] = np.where(np.isnan(np.sum(values, axis=0)), np.nan, values[0])
    return LognormalCurves(log(values[0]), values[1], log(values[2]), values[3]), dims


def has_replicates(curves: xr.Dataset) -> bool:
    """Return True if a dataset of curves contains bootstrap replicates."""
    name = "probability_sample" if form_name(curves) in TABULATED else "median_sample"
    return name in curves and "replicate" in curves[name].dims


def _tabulated(curves: xr.Dataset, suffix: str) -> tuple[TabulatedCurves, tuple[str, ...]]:
    array = curves["probability" + suffix]
    if "level" not in array.dims:
        raise ValueError(f"probability of the curves must lie on level, got dims {array.dims}")
    dims = _ordered(dim for dim in array.dims if dim != "level")
    array = array.transpose(*dims, "level")
    levels = checks.finite_array("level of the curves", curves["level"].values)
    checks.increasing("level of the curves", levels)
    values = np.asarray(array.values, dtype=np.float64)
    if np.any((values < 0.0) | (values > 1.0)) or np.any(np.diff(values, axis=-1) < 0.0):
        raise ValueError("probability of the curves must lie between 0 and 1 and never fall with the level")
    return TabulatedCurves(log(levels), values, np.zeros(values.shape[:-1])), dims


def _ordered(dims: Any) -> tuple[str, ...]:
    names = [str(dim) for dim in dims]
    return (*(dim for dim in names if dim != "replicate"), *(dim for dim in names if dim == "replicate"))


def curve_probability(curves: xr.Dataset, x: Any, outside: str = REFUSE) -> xr.DataArray:
    """Probability of overturning at levels of the intensity measure.

    Parameters
    ----------
    curves : xarray.Dataset
        Fitted curves: ``median`` and ``dispersion``; with ``uplift_median`` and ``uplift_dispersion`` also for uplift;
        or, with the attribute ``form`` = "isotonic", ``probability`` on ``level``.
    x : array_like, shape (level,)
        Levels in the unit of the curves (SI), > 0; a warning where they are beyond any shaking (PGV in cm/s).
    outside : {"refuse", "least", "most"}
        Rule beyond the levels of a tabulated curve. The default is an error. `"least"` is the minimum that a rising
        curve allows: 0 below and the last value above. `"most"` is the maximum: the first value below and 1 above.

    Returns
    -------
    xarray.DataArray
        On the dimensions of the curves and ``level``; NaN if there is no estimate.

    Notes
    -----
    P(x) = Phi(ln(x/uplift_median)/uplift_dispersion) Phi(ln(x/median)/dispersion); a dispersion of 0 is a step, 0 below
    the median and 1 from it on.  Between the levels of a tabulated curve P is linear in ln x.

    Examples
    --------
    >>> import xarray as xr
    >>> curves = xr.Dataset({"median": ((), 2.0, {"units": "m s-2"}), "dispersion": 0.5}, attrs={"im": "pga"})
    >>> [round(float(p), 4) for p in curve_probability(curves, [1.0, 2.0, 4.0])]
    [0.0828, 0.5, 0.9172]
    """
    checks.choice("outside", outside, OUTSIDE)
    levels = np.atleast_1d(checks.finite_array("x", x, ndim=(0, 1)))
    if np.any(levels <= 0.0):
        raise ValueError(f"x must be > 0, got {levels.min():g}")
    arrays, dims = curve_arrays(curves)
    values = arrays.probability(log(levels), outside)
    reference = curves["level"] if form_name(curves) in TABULATED else curves["median"]
    checks.stated_unit("x", x, str(reference.attrs.get("units", "")))
    warn(level_doubts(levels, str(reference.attrs.get("units", ""))))
    attributes = {
        "units": reference.attrs.get("units", DIMENSIONLESS),
        "long_name": str(curves["level"].attrs.get("long_name", "level")) if "level" in curves.coords else "level",
        "im": im_of(curves),
    }
    return xr.DataArray(
        values,
        {**coordinates_on(curves, dims), "level": xr.Variable("level", levels, attributes)},
        (*dims, "level"),
        "probability",
        described("probability of overturning"),
    )


def im_of(curves: xr.Dataset) -> str:
    """Return the name of the curves' intensity measure, empty if it is not stated."""
    stated = curves.attrs.get("im") or (curves["level"].attrs.get("im") if "level" in curves.coords else None)
    return str(stated or "")
