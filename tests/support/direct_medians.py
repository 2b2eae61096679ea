"""Medians of blocks run by themselves, for pooled surfaces; and a law that no surface follows."""

import numpy as np

from toppling.fragility.adaptive.probit import Observations, fit_probit
from toppling.fragility.analyses.waves import MotionSource, run_wave, scaled_to
from toppling.fragility.runs.request import check_request
from toppling.models import DiscreteDamping
from toppling.models.laws import oscillator_of

TOGETHER = 500


class Kinked(DiscreteDamping):
    """Its elastic zone is three times as wide for blocks of R above 0.8 m."""

    def oscillator(self, block):
        return DiscreteDamping(delta=self.delta * (3.0 if block.R > 0.8 else 1.0)).oscillator(block)


def direct_medians(blocks, law, curves, motions, generator):
    """Ln medians (PGA) of three runs of each block under each motion, near those of `curves`, and standard errors."""
    request = check_request(blocks[:1], law, ["overturned"], True, None, None)
    specimens = [oscillator_of(block, law) for block in blocks]
    source, scaled = MotionSource(generator, 90_000), scaled_to("pga")
    x = np.log(curves["half_level"].values) + 0.3 * curves["dispersion"].values * np.array([-1.0, 0.0, 1.0])
    flags, numbers = [], []
    for first in range(0, motions, TOGETHER):
        wave = source.wave(first, min(TOGETHER, motions - first))
        factors = np.asarray(scaled.factors(np.exp(x)[:, :, None], scaled.measured(wave, blocks[:1])[0]))
        flags.append(run_wave(request, specimens, None, wave.records, factors)["overturned"])
        numbers.append(wave.numbers)
    fell, motion = np.concatenate(flags, axis=-1), np.concatenate(numbers)
    found = []
    for own, level in zip(fell, x, strict=True):
        z, number = (np.broadcast_to(one, own.shape).ravel() for one in (level[:, None], motion))
        fitted, _ = fit_probit(Observations(z, own.ravel(), number))
        estimate = fitted.median()
        found.append((estimate.value, estimate.error))
    return np.array(found).T
