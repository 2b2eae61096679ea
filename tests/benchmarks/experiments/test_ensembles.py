"""JMA's instrumental intensity, held to a sine of which it is known by hand."""

import math

import numpy as np
import pytest

from toppling.benchmarks.experiments.ensembles import CLASSES, jma_intensity


class TestIntensity:
    def test_a_sine_of_one_hertz(self):
        """The filter's value at 1 Hz is 0.9986, times 0.5^3 of the low cut: worked out by hand."""
        dt = 0.01
        time = np.arange(0.0, 60.0, dt)
        record = np.sin(2.0 * np.pi * time)
        y2 = 0.01
        high = 1 + 0.694 * y2 + 0.241 * y2**2 + 0.0557 * y2**3 + 0.009664 * y2**4 + 0.00134 * y2**5 + 0.000155 * y2**6
        weight = math.sqrt(1.0 - math.exp(-8.0)) / math.sqrt(high)
        # exceeded for 0.3 s in all: the last half per cent below the peak of 60 cycles
        a0 = 100.0 * weight * math.sin(0.5 * math.pi * (1.0 - 0.3 / 60.0))
        assert jma_intensity(record, dt) == pytest.approx(2.0 * math.log10(a0) + 0.94, abs=0.01)

    def test_ten_times_the_motion_is_two_more(self):
        record = np.random.default_rng(1).normal(size=2000)
        assert jma_intensity(10.0 * record, 0.01) - jma_intensity(record, 0.01) == pytest.approx(2.0)

    def test_classes_follow_on_one_another(self):
        ends = list(CLASSES.values())
        assert all(high == low for (_, high), (low, _) in zip(ends[:-1], ends[1:], strict=True))
