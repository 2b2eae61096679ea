"""How often the test of goodness of fit rejects curves that are right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import scipy
import xarray as xr

from ...core.aliases import Array
from ...core.streams import stream
from ...fragility import goodness_of_fit
from ..sequential.truths import MEDIAN, Truth
from .drawn_studies import ATTRIBUTES, LEVELS, LOGNORMAL, Row, cloud, ida, stripes

NOMINAL = 0.05
FEW = MEDIAN * np.exp(np.linspace(-0.8, 0.8, 6))
CORRELATIONS = (0.0, 0.3, 0.5, 0.8, 1.0)


def rejected(runs: xr.Dataset, method: str = "binomial") -> float:
    """Return the share of the studies whose curve is rejected; those without a curve are not.

    Seeds differ from study to study: simulated with the same one, all would share the error of 199 replicates.
    """
    studies = (runs.isel(study=[i]) for i in range(runs.sizes["study"]))
    p = [goodness_of_fit(of, method=method, replicates=199, seed=i)["p_value"].item() for i, of in enumerate(studies)]
    return float((np.array(p) <= NOMINAL).mean())


def fading(truth: Truth, studies: int, motions: int, seed: int, levels: Array) -> xr.Dataset:
    """Draw incremental analyses whose normal scores are correlated by `truth.correlation` from level to level."""
    noise = stream(seed).standard_normal((levels.size, studies, motions))
    innovations = np.sqrt(1.0 - truth.correlation**2) * noise
    innovations[0] = noise[0]
    score = scipy.signal.lfilter([1.0], [1.0, -truth.correlation], innovations, axis=0)
    fell = scipy.special.ndtr(score) < truth.probability(np.log(levels))[:, None, None]
    return xr.Dataset(
        {"overturned": (("level", "study", "motion"), fell)}, coords={"level": ("level", levels, ATTRIBUTES)}
    )


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of the test; low: the share of right curves that it rejects at a nominal 5 %."""
    studies, numbers = (1000, (20, 40, 100, 400)) if full else (200, (20, 100))

    def row(text: str, truth: str, motions: int, runs: xr.Dataset, method: str = "binomial") -> Row:
        return Row(f"goodness of fit, {text}", truth, motions, studies, rejected(runs, method), 0.0)

    common = replace(LOGNORMAL, correlation=1.0)
    for motions, levels in product(numbers, (FEW, LEVELS)):
        text = f"{levels.size} levels"
        for correlation in CORRELATIONS:
            truth = replace(LOGNORMAL, correlation=correlation)
            runs = ida(truth, studies, motions, motions, levels)
            yield row(text, f"correlation {correlation:g}", motions, runs)
        for correlation in (0.6, 0.95) if full else (0.95,):
            truth = replace(LOGNORMAL, correlation=correlation)
            runs = fading(truth, studies, motions, motions, levels)
            yield row(text, f"correlation {correlation:g} from level to level", motions, runs)
        yield row(
            f"first overturnings, {text}",
            "one capacity",
            motions,
            ida(common, studies, motions, 1, levels),
            "first-overturning",
        )
    for motions in numbers:
        yield row("stripes", "independent", motions, stripes(LOGNORMAL, studies, motions, motions))
    for motions in (40, *numbers[1:]):
        yield row("clouds", "independent", motions, cloud(LOGNORMAL, studies, motions, motions))
