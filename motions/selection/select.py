"""Selection of motions for a level of a hazard, and the report on their agreement with it."""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.elementary import Array, Index, exp, expm1
from ...core.parameters import COUNT, POSITIVE
from ...core.streams import stream
from ...core.units import described, provenance
from ..intensity.measure import MEASURES, Measure
from ..intensity.naming import measure_named
from .candidates import Candidates
from .choosing import Problem, choose
from .stated import Stated
from .target import Conditional, Mixture, Target

ALWAYS = ("pgv", "d5_95")
"""Measures that a selection always reports, targeted or not: the cause of overturning, and the duration."""
BIAS, LOW_RATIO, HIGH_RATIO = 0.10, 0.8, 1.25
"""Gate of a hazard-consistent set: bias of medians, ratio of standard deviations (assumed)."""
AT_BOUND = 0.01
"""A factor within a hundredth of its bound counts as one at the bound."""
CONFIDENCE = 0.95
SELECTION = 0
"""Key of the random stream of a choice."""
FACTORS = (0.25, 4.0)
"""Smallest and largest factor of a motion."""


class InconsistentSelection(UserWarning):
    """Warning that a selection does not agree with the hazard within the gate."""


@dataclass(frozen=True)
class Selection:
    """Motions chosen for one level, and their agreement with the target.

    Attributes
    ----------
    motions : xarray.DataArray, or a list of them
        The chosen motions as they are, not scaled, in the order of the candidates. Coordinates on motion are `factor`
        (which scales each to the level), `candidate` (its number among the candidates) and `event`. If the candidates
        are several arrays, a list with an array for each that has a chosen motion.
    report : xarray.Dataset
        On measure: target and achieved median and sigma, `bias` of the median, `sigma_ratio`, `ks` and its critical
        value `ks_critical` (5 %), and `gated` (True if the gate includes it). Attributes: `level`, `given`, `epsilon`,
        `consistent` (1 or 0), factors, candidates allowed, events, and the repair of the correlations.
    """

    motions: Any
    report: xr.Dataset

    @property
    def consistent(self) -> bool:
        """True if the set passes the gate: targeted medians within 10 %, sigmas within 0.8 to 1.25 (assumed)."""
        return bool(self.report.attrs["consistent"])

    @property
    def why(self) -> str:
        """Deviations from the gate in words; empty if the set is consistent."""
        failed = self.report.where(self.report["gated"] & ~self.report["passes"], drop=True)
        return "; ".join(
            f"{name}: median {100.0 * bias:+.0f} %, sigma {ratio:.2f} times the target's"
            for name, bias, ratio in zip(
                failed["measure"].values, failed["bias"].values, failed["sigma_ratio"].values, strict=True
            )
        )


def select(
    candidates: xr.DataArray | Iterable[xr.DataArray] | Candidates,
    target: Target | Mixture | Stated,
    number: int,
    *,
    level: float,
    factor: tuple[float, float] = FACTORS,
    weights: Mapping[str, float] | None = None,
    per_event: int = 3,
    seed: int = 0,
) -> Selection:
    """Choose motions whose measures, scaled to a level of the target's measure, are distributed as the target asks.

    Parameters
    ----------
    candidates : xarray.DataArray, a sequence of them, or Candidates
        Ground motions, m s-2; a coordinate `event` on motion names the earthquake of each, and each is one of its own
        without it.  Measures of `Candidates` are taken once for all levels.
    target : Target, Mixture or Stated
    number : int
        Size of the set, >= 1.
    level : float
        Level of the target's `given`, SI, > 0.
    factor : tuple of float
        Smallest and largest factor of a motion.
    weights : mapping, optional
        Weight of a measure by its label, >= 0; 1 if not named. They are divided by their mean.
    per_event : int
        Maximum number of motions of one event, >= 1.
    seed : int
        The choice depends on it and on the candidates, the target and the level, and on nothing else.

    Warns
    -----
    InconsistentSelection
        The set does not pass the gate (`Selection.consistent`).

    Raises
    ------
    TypeError, ValueError
        Wrong arguments; a target given a measure that scaling does not change; fewer than 2 `number` candidates within
        the factors.

    Notes
    -----
    A factor f multiplies a measure by f to its `power` (1 for Sa and PGV, 2 for the Arias intensity, 0 for durations).
    The search minimises J = sum of weight [(mean - mu')² + 2 (sd - sigma')²] over the logarithms, from five
    Latin-hypercube draws of the target. It takes the nearest candidate to each point, then exchanges until none lowers
    J.

    References
    ----------
    Baker, J. W. and Lee, C. (2018). An improved algorithm for selecting ground motions to match a conditional spectrum.
    Journal of Earthquake Engineering 22(4), 708-723.

    Examples
    --------
    >>> from toppling import motions
    >>> pool = motions.CloughPenzien(duration=10.0, dt=0.01).sample(40, seed=1)
    >>> target = motions.Target(["pga", "pgv"], [4.0, 0.4], [0.6, 0.6], given="pga")
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore")
    ...     chosen = select(pool, target, 10, level=4.0)
    >>> chosen.motions.sizes["motion"], chosen.consistent
    (10, False)
    """
    if not isinstance(target, Target | Mixture | Stated):
        raise TypeError(f"target must be a Target, a Mixture or a Stated target, got {checks.kind(target)}")
    n = COUNT.count("number", number)
    most = COUNT.count("per_event", per_event)
    low, high = _bounds(factor)
    chance = checks.count("seed", seed)
    pool = candidates if isinstance(candidates, Candidates) else Candidates(candidates)
    wanted = target.at(level)
    labels = [measure.label for measure in wanted.measures]
    weighted = _weights(weights, labels)
    factors = pool.factors(wanted.given, wanted.level)
    allowed = np.flatnonzero((factors >= low) & (factors <= high))
    if allowed.size < 2 * n:
        raise ValueError(
            f"{allowed.size} of {len(pool)} candidates reach {wanted.given.label} = {wanted.level:g} with factors of "
            f"{low:g} to {high:g}; a choice of {n} needs at least {2 * n}"
        )
    scaled = {im.label: pool.scaled(im, factors) for im in _reported(wanted)}
    values = np.column_stack([scaled[label] for label in labels]) - wanted.mean
    numbered = np.unique(pool.groups[allowed], return_inverse=True)[1]
    if np.minimum(np.bincount(numbered), min(most, n)).sum() < n:
        raise ValueError(
            f"{n} motions of at most {most} per event cannot be chosen: {numbered.max() + 1} events are left"
        )
    problem = Problem(values[allowed], wanted.sigmas, weighted, numbered, min(most, n))
    chosen = allowed[choose(problem, wanted.covariance, n, stream(chance, SELECTION))]
    report, taken = _report(wanted, scaled, chosen), factors[chosen]
    report.attrs |= {
        "level": wanted.level,
        "given": wanted.given.label,
        "epsilon": wanted.epsilon,
        "correlation_change": target.correlation_change,
        "allowed": int(allowed.size),
        "candidates": len(pool),
        "factor_median": float(np.median(taken)),
        "factor_least": float(taken.min()),
        "factor_greatest": float(taken.max()),
        "factors_at_a_bound": int(((taken <= low * (1.0 + AT_BOUND)) | (taken >= high * (1.0 - AT_BOUND))).sum()),
        "events": int(np.unique(pool.groups[chosen]).size),
        "greatest_share_of_an_event": float(np.bincount(pool.groups[chosen]).max() / n),
        **provenance({"number": n, "factor": [low, high], "per_event": most, "seed": chance}),
    }
    kept = pool.chosen(chosen, factors)
    selection = Selection(kept[0] if pool.single else kept, report)
    if not selection.consistent:
        warnings.warn(
            f"the selection for {wanted.given.label} = {wanted.level:g} is not hazard-consistent ({selection.why})",
            InconsistentSelection,
            stacklevel=2,
        )
    return selection


def _bounds(factor: Any) -> tuple[float, float]:
    pair = POSITIVE.array("factor", factor)
    if pair.shape != (2,) or pair[0] > pair[1]:
        raise ValueError(f"factor must be a least and a greatest factor, got {pair.tolist()}")
    return float(pair[0]), float(pair[1])


def _weights(given: Mapping[str, float] | None, labels: list[str]) -> Array:
    if given is not None and not isinstance(given, Mapping):
        raise TypeError(f"weights must be a table of weights by the names of measures, got {checks.kind(given)}")
    by_label = {measure_named(name).label: value for name, value in (given or {}).items()}
    unknown = sorted(set(by_label) - set(labels))
    if unknown:
        raise ValueError(f"weights name {unknown[0]}, which the target does not hold")
    values = np.array([checks.number(f"weight of {label}", by_label.get(label, 1.0), at_least=0.0) for label in labels])
    if values.sum() == 0.0:
        raise ValueError("weights must not all be 0")
    return np.asarray(values / values.mean())


def _reported(wanted: Conditional) -> list[Measure]:
    further = [MEASURES[name] for name in ALWAYS]
    return [*wanted.measures, *(im for im in further if im not in wanted.measures)]


def _report(wanted: Conditional, scaled: Mapping[str, Array], chosen: Index) -> xr.Dataset:
    names, n, m = list(scaled), len(chosen), len(wanted.measures)
    values = np.column_stack([scaled[name][chosen] for name in names])
    mean = values.mean(axis=0)
    sigma = values.std(axis=0, ddof=1) if n > 1 else np.full(len(names), np.nan)
    target_mean, target_sigma = np.full((2, len(names)), np.nan)
    target_mean[:m], target_sigma[:m] = wanted.mean, wanted.sigmas
    free = target_sigma > 1e-9  # (the measure that is given does not scatter)
    bias = expm1(np.minimum(mean - target_mean, 700.0))  # (of a median near zero: as good as infinite)
    ratio = np.divide(sigma, target_sigma, out=np.full(len(names), np.nan), where=free)
    spread = n == 1 or (ratio >= LOW_RATIO) & (ratio <= HIGH_RATIO)
    passes = (np.abs(bias) <= BIAS) & spread
    distance = np.full(len(names), np.nan)
    for j in np.flatnonzero(free):
        placed = np.sort(scipy.special.ndtr((values[:, j] - target_mean[j]) / target_sigma[j]))
        steps = np.arange(n + 1) / n
        distance[j] = max(np.max(steps[1:] - placed), np.max(placed - steps[:-1]))
    units = [next(im.units for im in _reported(wanted) if im.label == name) for name in names]
    variables: dict[str, tuple[Any, str]] = {
        "target_median": (exp(target_mean), "median of the target, in the unit of each measure; NaN without one"),
        "median": (exp(mean), "geometric mean of the set, in the unit of each measure"),
        "target_sigma": (target_sigma, "standard deviation of the logarithm, target"),
        "sigma": (sigma, "standard deviation of the logarithm, set"),
        "bias": (bias, "median over the target's, minus 1"),
        "sigma_ratio": (ratio, "standard deviation over the target's"),
        "ks": (distance, "Kolmogorov-Smirnov distance from the target"),
        "gated": (free, "whether the gate asks for it"),
        "passes": (
            passes & free,
            f"whether it passes: median within {BIAS:.0%}, scatter within {LOW_RATIO:g} to {HIGH_RATIO:g}",
        ),
    }
    data = {name: ("measure", value, described(text)) for name, (value, text) in variables.items()}
    return xr.Dataset(
        data,
        coords={"measure": names, "unit": ("measure", units)},
        attrs={
            "title": "Selected motions beside the target",
            "ks_critical": round(float(scipy.stats.kstwo.ppf(CONFIDENCE, n)), 12),
            "number": n,
            "consistent": int(np.all(passes[free])),
        },
    )
