"""The instrumental seismic intensity of the Japan Meteorological Agency (JMA)."""

from __future__ import annotations

import math

import numpy as np

from ...core.aliases import Array

CLASSES = {
    "5-lower": (4.5, 5.0),
    "5-upper": (5.0, 5.5),
    "6-lower": (5.5, 6.0),
    "6-upper": (6.0, 6.5),
    "7": (6.5, 7.0),
}
"""Classes of JMA's scale with the instrumental intensities between which they lie; that of 7 has no upper end on the
scale, and ends here at 7.0, which few records reach (judgement)."""


def jma_intensity(acceleration: Array, dt: float) -> float:
    """Return JMA's instrumental intensity of one component (time,), m/s²: I = 2 log10(a0) + 0.94.

    a0 is the acceleration in gal that the filtered motion exceeds for a total of 0.3 s. The filter combines the
    period's effect, a high cut and a low cut. The agency takes the vector sum of three components; the intensity of one
    component is lower. Japan Meteorological Agency (1996). Notice on the instrumental seismic intensity (read in
    translation).
    """
    size = 2 * acceleration.size
    frequency = np.fft.rfftfreq(size, dt)
    f = np.maximum(frequency, 1e-9)
    y2 = (f / 10.0) ** 2
    high = 1.0 + y2 * (0.694 + y2 * (0.241 + y2 * (0.0557 + y2 * (0.009664 + y2 * (0.00134 + y2 * 0.000155)))))
    weight = np.sqrt(1.0 / f) / np.sqrt(high) * np.sqrt(-np.expm1(-((f / 0.5) ** 3)))
    weight[0] = 0.0
    filtered = np.sort(np.abs(np.fft.irfft(np.fft.rfft(100.0 * acceleration, size) * weight, size)))[::-1]
    return float(2.0 * np.log10(filtered[math.ceil(0.3 / dt) - 1]) + 0.94)
