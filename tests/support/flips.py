"""Flags that perturbations change, run by run."""

import numpy as np

from toppling.fragility.runs.request import runner_of
from toppling.fragility.validity import undecided


def undecided_outcomes(runs, motions, share=1.0):
    """Perturbations that change the flag of each run, on the dimensions of the flags; -1 where it was not tested."""
    found = undecided.count_flips(runs, motions, share, runner_of(None))
    shaped = undecided._flags(runs)
    counts = np.full(shaped.shape, -1, np.int8)
    counts[..., found.chosen] = found.counts
    labelled = shaped.copy(data=counts)
    dims = runs["overturned"].dims
    return (labelled if "level" in dims else labelled.isel(level=0)).transpose(*dims)
