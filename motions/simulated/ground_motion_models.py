"""Ground-motion models: expected PGA, PGV and spectrum of an earthquake at a site, for comparison with motions."""

import importlib
import logging
import math
import threading
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.elementary import Array, exp, log
from ...core.streams import stream
from ...core.units import ACCELERATION, SECOND, STANDARD_GRAVITY, VELOCITY, described, provenance
from ..arrays import records
from ..intensity.evaluation import measure
from ..intensity.naming import measure_named
from ..intensity.parametric_measures import Sa
from ..scaling import scale_to
from .scenario import REVERSE, STRIKE_SLIP

MODEL = "BSSA14"
MODELS: dict[str, str] = {MODEL: "BooreStewartSeyhanAtkinson2014", "CY14": "ChiouYoungs2014"}
"""Models by name, with the class of pyGMM that computes each."""
PERIODS = (0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 4.0)
"""Periods of Sa, s."""
NEAREST = 400.0
"""Rupture distance, m, below which the number is likely of km."""
MECHANISMS = {STRIKE_SLIP: "SS", REVERSE: "RS"}
_one_at_a_time = threading.Lock()


class Scenario(NamedTuple):
    """An earthquake and a site: moment magnitude, rupture distance (m), V_S30 (m/s), and style of faulting.

    `depth` is the depth of the top of the rupture, m; the fault is vertical.
    """

    magnitude: float
    distance: float
    vs30: float
    faulting: str = STRIKE_SLIP
    depth: float = 0.0

    @property
    def text(self) -> str:
        """The scenario in words."""
        return f"M {self.magnitude:g}, {1e-3 * self.distance:g} km, V_S30 {self.vs30:g} m/s, {self.faulting}"


def expected_motions(scenario: Scenario, model: str = MODEL, periods: Sequence[float] = PERIODS) -> xr.Dataset:
    """Return the medians and dispersions that a ground-motion model gives for a scenario.

    Parameters
    ----------
    scenario : Scenario
        Magnitude, distance (m), V_S30 (m/s), faulting ("strike-slip" or "reverse"), depth of the rupture's top (m).
    model : {"BSSA14", "CY14"}
        Boore, Stewart, Seyhan and Atkinson (2014) [1]_ or Chiou and Youngs (2014) [2]_, as pyGMM computes them.
    periods : sequence of float
        Periods of Sa, s, 0.01 to 10.

    Returns
    -------
    xarray.Dataset
        ``pga`` (m s-2), ``pgv`` (m s-1) and ``sa`` (period, m s-2), the medians (RotD50, 5 % damping), and
        ``pga_dispersion``, ``pgv_dispersion``, ``sa_dispersion``, the total standard deviations of their logarithms.

    Notes
    -----
    The fault is vertical and the site next to it: R_jb² = R_rup² - depth². Basin depths are the models' defaults for
    V_S30, the region is California.

    References
    ----------
    .. [1] Boore, D. M., Stewart, J. P., Seyhan, E. and Atkinson, G. M. (2014). NGA-West2 equations for predicting PGA,
       PGV, and 5% damped PSA for shallow crustal earthquakes. Earthquake Spectra 30(3), 1057-1085.
    .. [2] Chiou, B. S.-J. and Youngs, R. R. (2014). Update of the Chiou and Youngs NGA model for the average horizontal
       component of peak ground motion and response spectra. Earthquake Spectra 30(3), 1117-1153.

    Examples
    --------
    >>> expected = expected_motions(Scenario(6.5, 20e3, 760.0))
    >>> round(float(expected.pgv), 4)
    0.0915
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"scenario must be a Scenario, got {checks.kind(scenario)}")
    name = MODELS[checks.choice("model", model, list(MODELS))]
    mechanism = MECHANISMS[checks.choice("faulting", scenario.faulting, list(MECHANISMS))]
    depth = checks.number("depth", scenario.depth, at_least=0.0, at_most=3e4, unit="m")
    distance = checks.number("distance", scenario.distance, at_least=max(depth, 0.0), at_most=4e5, unit="m")
    if distance < NEAREST:
        warn([Doubt.of("rupture_distance", distance=distance)])
    at = [
        checks.number("period", period, at_least=0.01, at_most=10.0, unit="s")
        for period in checks.sequence("periods", periods)
    ]
    aside = 1e-3 * math.sqrt(distance * distance - depth * depth)
    pygmm = importlib.import_module("pygmm")
    given = pygmm.Scenario(
        mag=checks.number("magnitude", scenario.magnitude, at_least=3.0, at_most=8.5),
        dist_rup=1e-3 * distance,
        dist_jb=aside,
        dist_x=aside,
        v_s30=checks.number("vs30", scenario.vs30, at_least=150.0, at_most=1500.0, unit="m/s"),
        mechanism=mechanism,
        region="california",
        dip=90.0,
        depth_tor=1e-3 * depth,
    )
    with quiet():
        computed = getattr(pygmm, name)(given)
    period = xr.Variable("period", np.array(at), described("period", SECOND))
    sa = STANDARD_GRAVITY * np.asarray(computed.interp_spec_accels(at))
    spread = np.asarray(computed.interp_ln_stds(at))
    return xr.Dataset(
        {
            "pga": ((), STANDARD_GRAVITY * float(computed.pga), described("median PGA", ACCELERATION)),
            "pgv": ((), 0.01 * float(computed.pgv), described("median PGV", VELOCITY)),
            "sa": ("period", sa, described("median Sa, 5 % damping", ACCELERATION)),
            "pga_dispersion": ((), float(computed.ln_std_pga), described("dispersion of PGA")),
            "pgv_dispersion": ((), float(computed.ln_std_pgv), described("dispersion of PGV")),
            "sa_dispersion": ("period", spread, described("dispersion of Sa")),
        },
        coords={"period": period},
        attrs={"title": f"{model}: {scenario.text}", **provenance({"model": model, "scenario": scenario._asdict()})},
    )


@contextmanager
def quiet() -> Iterator[list[warnings.WarningMessage]]:
    """Keep pyGMM's own warnings silent, and yield the list of them: ranges are checked and documented here."""
    with _one_at_a_time:  # (both settings are of the whole process)
        before = logging.root.manager.disable
        logging.disable(max(before, logging.WARNING))
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                yield caught
        finally:
            logging.disable(before)


def over_model(
    motions: xr.DataArray | Iterable[xr.DataArray],
    scenario: Scenario,
    model: str = MODEL,
    periods: Sequence[float] = PERIODS,
) -> xr.Dataset:
    """Return the medians and dispersions of an ensemble divided by a ground-motion model's.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Ground motions of the scenario; two at least.
    scenario, model, periods
        As `expected_motions`.

    Returns
    -------
    xarray.Dataset
        On ``measure`` (pga, pgv, Sa(0.1) …): ``ratio`` of the medians, ``dispersion`` of the ensemble (standard
        deviation of the logarithm) and ``model_dispersion``.
    """
    return over_models(motions, scenario, [model], periods)[model]


def over_models(
    motions: xr.DataArray | Iterable[xr.DataArray],
    scenario: Scenario,
    models: Iterable[str] = tuple(MODELS),
    periods: Sequence[float] = PERIODS,
) -> dict[str, xr.Dataset]:
    """Return `over_model` of several models by name; the motions are measured once."""
    plain = records(motions)
    if len(plain) < 2:
        raise ValueError(f"motions must be at least 2, to have a median and a dispersion, got {len(plain)}")
    expected = {model: expected_motions(scenario, model, periods) for model in models}
    labels = ["pga", "pgv", *(f"Sa({float(period)!r})" for period in periods)]
    values = np.array([measure(label, plain) for label in labels])
    if not (values > 0.0).all():
        raise ValueError("motions must shake, got one that is zero throughout")
    return {model: _ratios(values, labels, expectation, model) for model, expectation in expected.items()}


def scale_to_model(
    motions: xr.DataArray, scenario: Scenario, model: str = MODEL, im: str = "pgv", seed: int = 0, first: int = 0
) -> xr.DataArray:
    """Scale every motion so that an intensity measure has the distribution of a ground-motion model.

    Parameters
    ----------
    motions : xarray.DataArray
        Ground motions of the scenario (motion, time), m s-2.
    scenario, model
        As `expected_motions`.
    im : {"pgv", "pga"} or str
        The measure, or an Sa such as "Sa(1.0)" with 5 % damping.  Only one can be matched by a factor; the others keep
        their ratio to it in each motion.
    seed, first : int
        Seed of the random terms and index of the first motion, >= 0. A term depends on (seed, index) alone, and is
        independent of motion `index` of a generator under the same seed.

    Returns
    -------
    xarray.DataArray
        The scaled motions.

    Notes
    -----
    ln im = ln median + tau b + phi w with standard normal b and w.  Each motion is of an earthquake of its own, so that
    event term and record term are drawn together, N(0, tau² + phi²).

    Examples
    --------
    >>> from toppling.motions import Scenario, SiteBasedScenario, measures
    >>> at = Scenario(7.0, 20e3, 760.0)
    >>> shaking = scale_to_model(SiteBasedScenario(7.0, 20e3, 760.0, dt=0.02).sample(3), at)
    >>> [round(float(pgv), 3) for pgv in measures(shaking, ["pgv"])["pgv"]]
    [0.044, 0.208, 0.159]
    """
    wanted = measure_named(im)
    period = wanted.period if isinstance(wanted, Sa) else 1.0
    expected = expected_motions(scenario, model, [period])
    if wanted.label in ("pga", "pgv"):
        median, spread = float(expected[wanted.label]), float(expected[f"{wanted.label}_dispersion"])
    elif wanted == Sa(period):
        median, spread = float(expected["sa"][0]), float(expected["sa_dispersion"][0])
    else:
        raise ValueError(f"im must be 'pga', 'pgv' or an Sa with 5 % damping, which {model} gives, got {im!r}")
    seed, first = checks.count("seed", seed), checks.count("first", first)
    unit = scale_to(motions, 1.0, wanted)
    terms = np.array([stream(seed, first + i, 1).standard_normal() for i in range(unit.sizes["motion"])])
    scaled = unit * xr.DataArray(median * exp(spread * terms), dims="motion")
    return scaled.transpose(*motions.dims).assign_attrs(motions.attrs).rename(motions.name)


def _ratios(values: Array, labels: Sequence[str], expected: xr.Dataset, model: str) -> xr.Dataset:
    """Return the result of `over_model` for measures (measure, motion) and the model's expected values."""
    medians = np.concatenate([[expected["pga"], expected["pgv"]], expected["sa"].values])
    spreads = np.concatenate(
        [[expected["pga_dispersion"], expected["pgv_dispersion"]], expected["sa_dispersion"].values]
    )

    def on_measure(numbers: Any, long_name: str) -> xr.Variable:
        return xr.Variable("measure", np.asarray(numbers, dtype=float), described(long_name))

    names = np.array(labels, dtype=object)
    return xr.Dataset(
        {
            "ratio": on_measure(np.median(values, axis=1) / medians, f"median over that of {model}"),
            "dispersion": on_measure(log(values).std(axis=1, ddof=1), "dispersion of the motions"),
            "model_dispersion": on_measure(spreads, f"dispersion of {model}"),
        },
        coords={"measure": ("measure", names, described("intensity measure"))},
        attrs=expected.attrs,
    )
