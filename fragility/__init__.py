"""From runs to probabilities: scaling, incremental dynamic analysis, estimators."""

from .fit import fit_fragility, fit_lognormal
from .ida import ida
from .plan import Chunk, plan_chunks, run_chunk
from .probability import overturning_probability, wilson_interval

__all__ = [
    "Chunk",
    "fit_fragility",
    "fit_lognormal",
    "ida",
    "overturning_probability",
    "plan_chunks",
    "run_chunk",
    "wilson_interval",
]
