"""Other measures of the first motions of an analysis in waves, and the savings of levels in them.

Levels in a measure in which the capacities of a block scatter less take fewer motions.
"""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.elementary import log
from ...core.units import ENDS, described, of_end
from ...motions.intensity.directions import PairMeasure
from ...motions.intensity.evaluation import measure
from ...motions.intensity.measure import MEASURES, Measure
from ..adaptive.probit import Observations
from ..surfaces.gain import CONFIDENCE, Gain, measure_gain
from .waves import MotionWave, Scaled

MOTIONS = 128
"""Motions that other measures are taken of."""
OF_PAIRS = ("pga", "pgv")
"""Measures that are taken of pairs, in every direction of each."""
OTHER = "other_measure"


class OtherMeasures:
    """Ln ratios of other measures to the measure of the levels (`scaled`), of the first motions."""

    def __init__(self, scaled: Scaled) -> None:
        self._scaled = scaled
        self.measures = _candidates(scaled)
        self._ratios = np.full((len(self.measures), MOTIONS), np.nan)

    @property
    def labels(self) -> list[str]:
        """Names of the other measures."""
        return [measure.label for measure in self.measures]

    def add(self, wave: MotionWave) -> None:
        """Take the measures of those motions of a wave that are among the first; a motion counts one way alone."""
        numbers, places = np.unique(wave.numbers, return_index=True)
        chosen = places[numbers < MOTIONS].tolist()
        if not chosen:
            return
        motions = wave.records if wave.ground is None else wave.ground
        some = [motions[i] for i in chosen]
        base = self._scaled.base
        power, log_base = (1.0, np.zeros(len(some))) if base is None else (base.power, log(measure(base, some)))
        for row, candidate in zip(self._ratios, self.measures, strict=True):
            row[numbers[numbers < MOTIONS]] = power / candidate.power * log(measure(candidate, some)) - log_base

    def gains(self, runs: Observations) -> list[Gain]:
        """Return the gains of the other measures, from the runs under the motions that they are known of."""
        some = runs.motion < MOTIONS
        known = Observations(runs.x[some], runs.fell[some], runs.motion[some])
        return [measure_gain(known, row) for row in self._ratios]

    def variables(self, gains: Sequence[Sequence[Gain]], dims: tuple[str, ...], shape: tuple[int, ...]) -> xr.Dataset:
        """Return gains (curve, other measure) as variables on `dims` of a shape, and the other measure."""
        table = np.array([[tuple(gain) for gain in row] for row in gains]).reshape(*shape, len(self.measures), 3)
        text = "number of times fewer motions that levels in another measure would take for the median, or more"
        named = described("another intensity measure of the motions")
        return xr.Dataset(
            {
                f"measure_gain{end}": ((*dims, OTHER), table[..., k], described(of_end(end, text, CONFIDENCE)))
                for k, end in enumerate(ENDS)
            },
            coords={OTHER: (OTHER, np.array(self.labels, dtype=object), named)},
        )


def _candidates(scaled: Scaled) -> list[Measure]:
    """Return the measures without parameters that grow with a motion; of pairs, two of them in the same way."""
    base = scaled.base
    if isinstance(base, PairMeasure):
        candidates = [type(base)(MEASURES[name]) for name in OF_PAIRS]
        return [candidate for candidate in candidates if candidate.label != base.label]
    return [
        measure
        for measure in MEASURES.values()
        if measure.power != 0.0 and (base is None or measure.label != base.label)
    ]
