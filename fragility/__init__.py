"""From runs to probabilities: scaling, incremental dynamic analysis, estimators."""

from .designs import cloud, stripes
from .fit import fit_fragility, fit_lognormal
from .ida import ida
from .plan import Chunk, plan_chunks, run_chunk
from .probability import overturning_probability, wilson_interval
from .states import reached

__all__ = [
    "Chunk",
    "cloud",
    "fit_fragility",
    "fit_lognormal",
    "ida",
    "overturning_probability",
    "plan_chunks",
    "reached",
    "run_chunk",
    "stripes",
    "wilson_interval",
]
