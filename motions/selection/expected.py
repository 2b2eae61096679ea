"""Targets of earthquakes at a site, from a ground-motion model: numbers that a hazard analysis would also give."""

import importlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import checks
from ...core.doubts import Doubt, warn
from ..intensity.measure import Measure
from ..intensity.naming import measure_named
from ..intensity.parametric_measures import Sa
from ..simulated.ground_motion_models import MECHANISMS, MODEL, Scenario, expected_motions, quiet
from .target import FORMULAS, Mixture, Target

MEASURES = (
    *(f"Sa({period})" for period in (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)),
    "pgv",
    "d5_95",
)
"""Default measures of a target: the spectrum that acts on blocks, the PGV that overturns them, and the duration."""


def expected_target(
    scenarios: Scenario | Sequence[Scenario],
    given: str | Measure,
    measures: Sequence[str | Measure] | None = None,
    *,
    weights: Any = None,
    model: str = MODEL,
    correlations: Any = FORMULAS,
) -> Target | Mixture:
    """Return the target of one or several earthquakes, as a ground-motion model expects their motions.

    Parameters
    ----------
    scenarios : Scenario or a sequence of them
        The ruptures of the hazard, for instance the means of a disaggregation.
    given : measure or its name
        The measure whose levels condition the others; it is added to the measures if it is not among them.
    measures : sequence of measures or their names, optional
        Sa(T) of 5 % damping, 0.01 to 10 s, ``pga``, ``pgv``, ``d5_95``; twelve spectral ordinates from 0.1 to 4 s, the
        peak velocity and the duration if not given.
    weights : array_like, shape (scenario,), optional
        Shares of the scenarios; needed if there are several.
    model : {"BSSA14", "CY14"}
        As for `toppling.motions.expected_motions`; durations are from Afshari and Stewart (2016).
    correlations
        As for `Target`.

    Returns
    -------
    Target, or Mixture of several

    Notes
    -----
    The models give the median over directions (RotD50).  One component of a motion scatters about it more, which is
    not in the standard deviations here.

    References
    ----------
    Afshari, K. and Stewart, J. P. (2016). Physically parameterized prediction equations for significant duration in
    active crustal regions. Earthquake Spectra 32(4), 2057-2081.

    Examples
    --------
    >>> from toppling.motions import Scenario
    >>> target = expected_target(Scenario(6.5, 20e3, 400.0), "Sa(1.0)", ["Sa(0.5)", "Sa(1.0)", "pgv", "d5_95"])
    >>> target.at(4.0).medians.round(2).tolist()
    [5.56, 4.0, 0.32, 11.57]
    """
    several = checks.several("scenarios", scenarios, Scenario)
    if not several:
        raise TypeError("scenarios must be one Scenario or a sequence of them, got none")
    if len(several) > 1 and weights is None:
        raise ValueError(f"weights must be given for {len(several)} scenarios")
    on = measure_named(given, "given")
    chosen = [measure_named(name) for name in (MEASURES if measures is None else _listed(measures))]
    if on not in chosen and not hasattr(on, "periods"):
        chosen.append(on)
    targets = [_of_one(scenario, chosen, on, model, correlations) for scenario in several]
    return targets[0] if len(targets) == 1 else Mixture(targets, weights)


def _listed(measures: Any) -> list[str | Measure]:
    if isinstance(measures, str | Measure) or not checks.is_several(measures):
        raise TypeError(f"measures must be a sequence of measures, got {checks.kind(measures)}")
    return list(measures)


def _of_one(scenario: Scenario, chosen: list[Measure], given: Measure, model: str, correlations: Any) -> Target:
    periods = [measure.period for measure in chosen if isinstance(measure, Sa)]
    expected = expected_motions(scenario, model, periods or (1.0,))
    medians, sigmas = np.empty((2, len(chosen)))
    for i, measure in enumerate(chosen):
        if isinstance(measure, Sa) and measure.damping == 0.05:
            at = periods.index(measure.period)
            medians[i], sigmas[i] = expected["sa"].values[at], expected["sa_dispersion"].values[at]
        elif measure.label in ("pga", "pgv"):
            medians[i], sigmas[i] = float(expected[measure.label]), float(expected[f"{measure.label}_dispersion"])
        elif measure.label == "d5_95":
            medians[i], sigmas[i] = _duration(scenario)
        else:
            raise ValueError(f"the models give Sa of 5 % damping, pga, pgv and d5_95, not {measure.label}")
    return Target(chosen, medians, sigmas, correlations=correlations, given=given)


def _duration(scenario: Scenario) -> tuple[float, float]:
    """Return the median of D5-95, s, and the standard deviation of its logarithm."""
    pygmm = importlib.import_module("pygmm")
    given = pygmm.Scenario(
        mag=scenario.magnitude,
        dist_rup=1e-3 * scenario.distance,
        v_s30=scenario.vs30,
        mechanism=MECHANISMS[scenario.faulting],
    )
    with quiet() as caught:
        model = pygmm.AfshariStewart2016(given)
    if any(warning.category is UserWarning for warning in caught):
        warn([Doubt.of("durations")])
    median, sigma = float(model.duration["D_5t95"]), float(model.std_err["D_5t95"])
    if not (math.isfinite(median) and median > 0.0):
        raise ValueError(f"the model of durations gives no duration for {scenario.text}")
    return median, sigma
