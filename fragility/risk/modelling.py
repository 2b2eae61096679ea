"""Modelling uncertainty beta_m of fragility curves: quality of the model, in addition to the variability of motions."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, exp, log
from ...core.parameters import BETA_M
from ...core.units import ENDS, described
from ..curves.curve import LognormalCurves, form_name
from ..fitting.links import LOGNORMAL
from ..hazard.curve import HazardCurve
from ..hazard.pieces import EXTEND
from .convolution import rates_of

MODELLING = "modelling_dispersion"
"""Attribute of curves whose dispersion includes modelling uncertainty, with its value."""
POINTS = 1000
"""Points of a blurred hazard curve."""
USUAL_DISPERSION = 0.3
"""Default beta_m of the range of a probability or a rate. It lies between the average (0.25) and the limited (0.40)
quality of a model by FEMA P-58-1 (2018), section 5.2 (recalled).
"""
TENTH = 1.28
"""Standard normal score that one in ten exceeds."""


def capacity_factors(dispersion: float) -> tuple[float, float]:
    """Return the factors exp(-1.28 beta_m) and exp(1.28 beta_m) between which true over computed capacities lie.

    They are the 10 and 90 % fractiles of a lognormal error of all capacities with beta_m = `dispersion`, or the usual
    one if that is 0.
    """
    error = TENTH * (dispersion or USUAL_DISPERSION)
    return float(exp(-error)), float(exp(error))


def seen_by(hazard: HazardCurve, factor: float) -> HazardCurve:
    """Return the hazard curve H(factor x): of capacities c it gives the rates of capacities factor c."""
    return replace(hazard, levels=tuple(level / factor for level in hazard.levels))


RANGE = "modelling_range"
"""Attribute of results with the beta_m of the ranges that follow."""
LOWER, UPPER = "_modelling_lower", "_modelling_upper"
"""Endings of the names of the ends of a value's range if all capacities are wrong by the same factor."""


def with_ends(
    name: str, dims: tuple[str, ...], ends: Sequence[Array], units: str, dispersion: float, measure: str = ""
) -> dict[str, xr.Variable]:
    """Return the ends of the range of a value, from the values at the two `capacity_factors`; NaN if one is NaN.

    `measure`: measure of a value with a unit of the levels.
    """
    low, high = capacity_factors(dispersion)
    text = f"if all capacities are wrong by the same factor, {low:.2f} to {high:.2f}{f': {measure}' if measure else ''}"
    pairs = ((LOWER, "lower", np.minimum(*ends)), (UPPER, "upper", np.maximum(*ends)))
    return {
        f"{name}{end}": xr.Variable(dims, values, described(f"{side} end of the range of {name} {text}", units))
        for end, side, values in pairs
    }


def range_of_half_levels(curves: xr.Dataset, dispersion: float) -> dict[str, xr.Variable]:
    """Return the ends of the range of half_level: its values times the `capacity_factors`, NaN beyond the levels."""
    level = curves["half_level"]
    known = level.where((level > 0.0) & np.isfinite(level)).values
    ends = [known * factor for factor in capacity_factors(dispersion)]
    units, measure = str(level.attrs.get("units", "1")), str(level.attrs.get("long_name", "")).rpartition(": ")[2]
    return with_ends("half_level", tuple(map(str, level.dims)), ends, units, dispersion, measure)


def with_modelling(curves: xr.Dataset, dispersion: float) -> xr.Dataset:
    """Return lognormal curves whose dispersion includes modelling uncertainty: the mean over possible models.

    Parameters
    ----------
    curves : xarray.Dataset
        Lognormal curves, as `fit_fragility` returns them, whose dispersion is of the motions alone.
    dispersion : float
        beta_m, the standard deviation of ln(true median / median of the model), >= 0. It must not include other
        uncertainty, such as laws or motions that are branches. FEMA P-58 combines two parts of 0.10 (superior), 0.25
        (average) or 0.40 (limited), the construction's and the model's, as the root of their squares.

    Returns
    -------
    xarray.Dataset
        The curves with sqrt(beta² + beta_m²) instead of beta, in ends of intervals and replicates too, and beta_m in
        the attribute ``modelling_dispersion``. Standard errors and fractiles, which are valid only for the plain
        curves, are left out.

    Notes
    -----
    With ln(median) normal around the model's value, E[Phi(ln(x/median)/beta)] = Phi(ln(x/median)/sqrt(beta² +
    beta_m²)). Rates of these curves are mean rates; fractiles of the rate (`epistemic_rates`) start from curves without
    it, so that it is never counted twice. With a hazard H = k0 x^-k the mean rate is exp(k² beta_m²/2) times the plain
    curve's (Cornell et al. 2002).

    References
    ----------
    FEMA (2018). Seismic performance assessment of buildings, volume 1, methodology. FEMA P-58-1, 2nd ed., section
    5.2.6 (recalled).

    Cornell, C. A., Jalayer, F., Hamburger, R. O. and Foutch, D. A. (2002). Probabilistic basis for 2000 SAC Federal
    Emergency Management Agency steel moment frame guidelines. Journal of Structural Engineering 128(4), 526-533.

    Examples
    --------
    >>> curves = xr.Dataset({"median": ((), 0.6, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    >>> with_modelling(curves, 0.3)["dispersion"].item()
    0.5
    """
    beta = BETA_M.number("dispersion", dispersion)
    form = form_name(curves)
    if form != LOGNORMAL:
        raise ValueError(f"modelling uncertainty is for lognormal curves, got curves of the form {form!r}")
    if curves.attrs.get(MODELLING, 0.0):
        raise ValueError(f"curves hold modelling uncertainty already (beta_m = {curves.attrs[MODELLING]:g})")
    if beta == 0.0:
        return curves
    plain = [f"{name}_se" for name in ("median", "dispersion")]
    plain += [f"fractile{end}" for end in ENDS]
    widened = curves.drop_vars([name for name in plain if name in curves])
    text = f"dispersion of motions and model (beta_m = {beta:g})"
    for name in ("dispersion", "dispersion_lower", "dispersion_upper", "dispersion_sample"):
        if name in widened:
            whole = widened[name].copy(data=np.hypot(widened[name].values, beta))
            long_name = text if name == "dispersion" else f"{text}: {name.rpartition('_')[2]}"
            widened[name] = whole.assign_attrs(described(long_name))
    return widened.assign_attrs({MODELLING: beta})


def blurred(hazard: HazardCurve, dispersion: float, levels: Array) -> HazardCurve:
    """Return the hazard curve under which capacities known exactly have the mean rates of capacities known to beta_m.

    It is E[H(x exp(beta_m Z))] at points that reach four beta_m beyond levels (SI) and hazard, which is extended with
    its slopes at both ends. At x it is the rate of a lognormal curve with the median x and the `dispersion` beta_m > 0.
    A capacity c exp(beta_m Z) is exceeded at the rate H(c exp(beta_m Z)), whose mean over Z is the rate of c under this
    curve. It is valid for any number of capacities with the same Z, for their sums, and for events of several of them.
    """
    beta = checks.number("dispersion", dispersion, above=0.0, at_most=BETA_M.at_most)
    ends = log([min(hazard.levels[0], levels[0]), max(hazard.levels[-1], levels[-1])])
    points = exp(np.linspace(ends[0] - 4.0 * beta, ends[1] + 4.0 * beta, POINTS))
    zeros = np.zeros(points.size)
    curves = LognormalCurves(log(points), zeros + beta, zeros - np.inf, zeros)
    rates = rates_of(curves, hazard.pieces(EXTEND, EXTEND)[0]).rate
    return HazardCurve(points.tolist(), rates.tolist(), hazard.im, hazard.source, at=hazard.at)
