"""From runs to probabilities: scaling, incremental dynamic analysis, estimators."""

from .designs import cloud, stripes
from .fit import fit_fragility, fit_lognormal
from .ida import ida
from .notes import block_notes, notes
from .perturbed import flips
from .plan import Chunk, plan_chunks, run_chunk
from .probability import overturning_probability, wilson_interval
from .screen import screen
from .states import reached

__all__ = [
    "Chunk",
    "block_notes",
    "cloud",
    "fit_fragility",
    "fit_lognormal",
    "flips",
    "ida",
    "notes",
    "overturning_probability",
    "plan_chunks",
    "reached",
    "run_chunk",
    "screen",
    "stripes",
    "wilson_interval",
]
