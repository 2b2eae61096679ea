"""Scale factors at which a verdict changes, found by refining a grid: what the published criteria are compared with."""

import numpy as np

from toppling.models.runs import run_many


def overturns(oscillator, pulse, factors):
    """Flags (m,) of an oscillator under factors (m,) times a one-motion pulse."""
    values = np.ascontiguousarray(pulse.values[0])
    results = run_many([oscillator], np.atleast_2d(np.asarray(factors, float)), values, float(pulse["dt"][0]))
    return results[0, :, 0] == 1.0


def boundary(oscillator, pulse, low, high):
    """The factor in (low, high) where the verdict changes, exactly once, to rounding."""
    first, last = overturns(oscillator, pulse, [low, high])
    assert first != last, f"no change of verdict between {low} and {high}"
    for _ in range(14):
        grid = np.linspace(low, high, 17)
        flags = overturns(oscillator, pulse, grid)
        at = int(np.argmax(flags != first))
        low, high = grid[at - 1], grid[at]
    return 0.5 * (low + high)
