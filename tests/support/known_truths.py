"""Curves that are known in closed form, and studies drawn from them, many at once."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ndtr

from toppling.core.streams import stream

MEDIAN, DISPERSION = 2.0, 0.4
LEVELS = MEDIAN * np.exp(np.linspace(-1.8, 1.8, 20))
ATTRIBUTES = {"units": "m s-2", "im": "pga", "long_name": "peak ground acceleration"}


@dataclass(frozen=True)
class Truth:
    """Probability of overturning at ln levels; correlation of the normal scores of two runs of one motion."""

    name: str
    probability: Callable
    correlation: float = 0.5

    def verdicts(self, levels, random):
        """Whether blocks overturn at levels (run, motion), each motion a new one."""
        own, noise = random.standard_normal(levels.shape[1]), random.standard_normal(levels.shape)
        score = math.sqrt(self.correlation) * own + math.sqrt(1.0 - self.correlation) * noise
        return ndtr(score) < self.probability(np.log(levels))

    def log_level(self, share):
        return brentq(lambda x: float(self.probability(np.array(x))) - share, -4.0, 5.0)

    def rate(self, slope):
        """The annual rate under the hazard x^-slope."""
        x = np.linspace(math.log(MEDIAN) - 8.0, math.log(MEDIAN) + 6.0, 200_001)
        return np.trapezoid(slope * np.exp(-slope * x) * self.probability(x), x) + math.exp(-slope * x[-1])


def score(x, median=MEDIAN, dispersion=DISPERSION):
    return ndtr((x - math.log(median)) / dispersion)


LOGNORMAL = Truth("lognormal", score, 1.0)
CORRELATED = Truth("lognormal, correlation 0.5", score)
MIXTURE = Truth("mixture of two", lambda x: 0.6 * score(x, 1.5, 0.3) + 0.4 * score(x, 3.5, 0.35))
UPLIFT = Truth(
    "a quarter falls at uplift", lambda x: np.where(x < math.log(MEDIAN) - 0.6745 * DISPERSION, 0.0, score(x))
)
WEIBULL = Truth("Weibull", lambda x: -np.expm1(-math.log(2.0) * np.exp(4.0 * (x - math.log(MEDIAN)))))
FRECHET = Truth("Frechet", lambda x: np.exp(-math.log(2.0) * np.exp(-3.0 * (x - math.log(MEDIAN)))))


def ida(truth, studies, motions, seed, levels=LEVELS):
    """Incremental analyses: `overturned` on (study, level, motion)."""
    at = np.repeat(levels[:, None], studies * motions, axis=1)
    fell = truth.verdicts(at, stream(seed)).reshape(levels.size, studies, motions).transpose(1, 0, 2)
    return xr.Dataset({"overturned": (("study", "level", "motion"), fell)}, {"level": ("level", levels, ATTRIBUTES)})


def once(truth, intensity, seed):
    """Runs of as many motions, each at its own intensity (study, motion)."""
    fell = truth.verdicts(intensity.reshape(1, -1), stream(seed)).reshape(intensity.shape)
    return xr.Dataset({"overturned": (("study", "motion"), fell)})


def stripes(truth, studies, motions, seed, levels=LEVELS[::4]):
    """Stripes of other motions at each level."""
    intensity, stripe = np.repeat(levels, motions), np.repeat(np.arange(1, levels.size + 1), motions)
    record = [f"motion {i}" for i in range(intensity.size)]
    found = once(truth, np.repeat(intensity[None], studies, axis=0), seed).assign_coords(motion=record)
    of = {"intensity": ("motion", intensity, ATTRIBUTES), "stripe": ("motion", stripe), "record": ("motion", record)}
    return found.assign_coords(of).assign_attrs(design="stripes")


def cloud(truth, studies, motions, seed):
    """Clouds about the median."""
    intensity = MEDIAN * np.exp(0.6 * stream(seed, 1).standard_normal((studies, motions)))
    found = once(truth, intensity, seed).assign_coords(motion=[f"motion {i}" for i in range(motions)])
    return found.assign_coords(intensity=(("study", "motion"), intensity, ATTRIBUTES)).assign_attrs(design="cloud")
