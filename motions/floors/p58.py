"""Floor demands by the simplified procedure of FEMA P-58, without response histories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.units import ACCELERATION, DIMENSIONLESS, STANDARD_GRAVITY, VELOCITY, provenance
from ..arrays import floor_coordinates
from .building import MAX_PERIOD, MIN_PERIOD, storey_heights

LOW_RISE, MID_RISE = (2, 9), (10, 15)
LARGEST_DISPERSION = 2.0

# a0 … a5 of ln H = a0 + a1 T1 + a2 S + a3 x + a4 x² + a5 x³, for 2-9 and for 10-15 storeys.
VELOCITY_COEFFICIENTS = {
    "braced": ((0.15, -0.10, 0.0, -0.408, 0.47, 0.0), (0.086, -0.10, 0.041, 0.45, -2.89, 2.57)),
    "moment": ((0.025, -0.068, 0.032, -0.53, 0.54, 0.0), (-0.02, -0.068, 0.034, 0.32, -1.75, 1.53)),
    "wall": ((-0.033, -0.085, 0.055, -0.52, 0.47, 0.0), (-0.11, -0.085, 0.11, 0.87, -4.07, 3.27)),
}
ACCELERATION_COEFFICIENTS = {
    "braced": ((0.66, -0.27, -0.089, 0.075, 0.0, 0.0), (0.44, -0.27, -0.052, 3.24, -9.71, 6.83)),
    "moment": ((0.66, -0.25, -0.080, -0.039, 0.0, 0.0), (0.34, -0.25, -0.062, 2.86, -7.43, 5.10)),
    "wall": ((0.66, -0.15, -0.084, -0.26, 0.57, 0.0), (-0.13, -0.15, -0.10, 7.79, -17.52, 11.04)),
}


def p58_floor_demands(
    system: str,
    storeys: int,
    period: float,
    pga: float,
    sa: float,
    *,
    pgv: float | None = None,
    sa_1s: float | None = None,
    yield_coefficient: float | None = None,
    participation: float = 1.3,
    modal_weight: float = 0.8,
    shape: Sequence[float] | None = None,
    storey_height: float | Sequence[float] = 3.0,
    dispersions: tuple[float, float, float] | None = None,
) -> xr.Dataset:
    """Return median peak floor acceleration and velocity by the simplified procedure of FEMA P-58, with dispersions.

    Parameters
    ----------
    system : {"braced", "moment", "wall"}
        Braced frame, moment frame or shear wall.
    storeys : int
        Number of storeys, 2 to 15.
    period : float
        Fundamental period T1, s.
    pga, sa : float
        Median peak ground acceleration and spectral acceleration at T1, m/s².
    pgv, sa_1s : float, optional
        Peak ground velocity, m/s, or the spectral acceleration at 1 s, m/s², from which it is estimated: exactly one.
    yield_coefficient : float, optional
        Yield strength over weight V_y/W; an elastic building (S = 1, V_y = Sa W) if not given.
    participation : float
        First-mode participation factor Gamma_1 of a shape that is 1 at the roof.
    modal_weight : float
        First-mode effective weight over the weight W_1/W, above 0 to 1.
    shape : sequence of float, optional
        First-mode shape at floors 1 … storeys, over its value at the roof; proportional to the height if not given.
    storey_height : float or sequence of float
        Height of every storey, or of each, m.
    dispersions : (float, float, float), optional
        Dispersions of floor acceleration and floor velocity from record to record, beta_aa and beta_av, and that of the
        model, beta_m, each 0 to 2: table 5-6 of FEMA P-58-1 has them by T1 and S.  The table itself is not held here.

    Returns
    -------
    xarray.Dataset
        ``pfa`` (m s-2) and ``pfv`` (m s-1), medians on ``floor`` (0 is the ground, where they are PGA and PGV), with
        ``height`` (m).  Where `dispersions` are given, ``pfa_dispersion`` and ``pfv_dispersion`` (1), of the floors
        above the ground.

    Raises
    ------
    TypeError, ValueError
        A value out of range; both or neither of pgv and sa_1s.

    Notes
    -----
    PFA = H_a PGA and PFV = H_v v_s with ln H = a0 + a1 T1 + a2 S + a3 x + a4 x² + a5 x³, x the relative height, S = Sa
    W/V_y >= 1, v_s = PGV + 0.3 (T1/2 pi) (V_y Gamma_1/(W_1/g)) (delta_i/delta_roof), and PGV = Sa(1 s) 1 s/(2 pi)/1.65
    if PGV is not given.  Dispersions sqrt(beta_a² + beta_m²), with those of the table.

    References
    ----------
    FEMA (2018). Seismic performance assessment of buildings, volume 1: methodology. FEMA P-58-1, 2nd ed., section 5.3.

    Examples
    --------
    >>> demands = p58_floor_demands("moment", 4, 0.8, pga=4.0, sa=6.0, sa_1s=5.0)
    >>> demands.pfa.values.round(2).tolist()
    [4.0, 5.79, 5.74, 5.68, 5.63]
    """
    kind = checks.choice("system", system, tuple(ACCELERATION_COEFFICIENTS))
    number = checks.count("storeys", storeys, at_least=LOW_RISE[0])
    if number > MID_RISE[1]:
        raise ValueError(f"storeys must be {LOW_RISE[0]} to {MID_RISE[1]}, got {number}")
    first = checks.number("period", period, at_least=MIN_PERIOD, at_most=MAX_PERIOD, unit="s")
    ground = checks.number("pga", pga, above=0.0, at_most=checks.MAX_ACCELERATION, unit="m/s²")
    spectral = checks.number("sa", sa, above=0.0, at_most=checks.MAX_ACCELERATION, unit="m/s²")
    gamma = checks.number("participation", participation, above=0.0)
    weight = checks.number("modal_weight", modal_weight, above=0.0, at_most=1.0)
    if (pgv is None) == (sa_1s is None):
        raise ValueError(f"give pgv (m/s) or sa_1s (m/s²), one of the two, got {'neither' if pgv is None else 'both'}")
    if pgv is not None:
        velocity = checks.number("pgv", pgv, above=0.0, unit="m/s")
    else:
        velocity = checks.number("sa_1s", sa_1s, above=0.0, unit="m/s²") / (2.0 * math.pi) / 1.65
    demand = spectral / STANDARD_GRAVITY
    strength = demand
    if yield_coefficient is not None:
        strength = checks.number("yield_coefficient", yield_coefficient, above=0.0)
    ratio = max(demand / strength, 1.0)
    heights = storey_heights(storey_height, number)
    x = heights[1:] / heights[-1]
    deflection = x if shape is None else _shape(shape, number)
    band = 0 if number <= LOW_RISE[1] else 1
    terms = np.stack([np.ones(number), np.full(number, first), np.full(number, ratio), x, x**2, x**3])
    amplify = {
        name: np.exp(np.array(table[kind][band]) @ terms)
        for name, table in (("pfa", ACCELERATION_COEFFICIENTS), ("pfv", VELOCITY_COEFFICIENTS))
    }
    sway = 0.3 * first / (2.0 * math.pi) * strength * gamma / (weight / STANDARD_GRAVITY) * deflection
    pfa = np.concatenate([[ground], amplify["pfa"] * ground])
    pfv = np.concatenate([[velocity], amplify["pfv"] * (velocity + sway)])
    configuration: dict[str, Any] = {
        "system": kind,
        "storeys": number,
        "period": first,
        "pga": ground,
        "sa": spectral,
        "pgv": velocity,
        "strength_ratio": ratio,
    }
    found: dict[str, Any] = {
        "pfa": ("floor", pfa, {"units": ACCELERATION, "long_name": "median peak floor acceleration"}),
        "pfv": ("floor", pfv, {"units": VELOCITY, "long_name": "median peak floor velocity"}),
    }
    if dispersions is not None:
        beta = checks.finite_array("dispersions", dispersions)
        if beta.size != 3 or beta.min() < 0.0 or beta.max() > LARGEST_DISPERSION:
            raise ValueError(f"dispersions must be beta_aa, beta_av and beta_m, each 0 to 2, got {dispersions!r:.80}")
        configuration["dispersions"] = beta.tolist()
        for name, own, what in (("pfa", beta[0], "acceleration"), ("pfv", beta[1], "velocity")):
            text = f"dispersion of peak floor {what} above the ground"
            found[f"{name}_dispersion"] = ((), math.hypot(own, beta[2]), {"units": DIMENSIONLESS, "long_name": text})
    return xr.Dataset(
        found,
        coords=floor_coordinates(range(number + 1), heights),
        attrs={"title": "FEMA P-58 floor demands", **provenance(configuration)},
    )


def _shape(shape: Sequence[float], storeys: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    values = checks.finite_array("shape", shape)
    if values.size != storeys:
        raise ValueError(f"shape must be {storeys} numbers, one a floor above the ground, got {values.size}")
    if values.min() < 0.0 or abs(values[-1] - 1.0) > 1e-9:
        raise ValueError(f"shape must be >= 0 and 1 at the roof, got {values.tolist()!r:.80}")
    return values
