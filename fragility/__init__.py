"""From runs to probabilities: scaling, analyses, estimators, comparisons of measures, uncertain inputs."""

from .capacity import overturning_capacity
from .designs import cloud, stripes
from .distributions import Beta, Categorical, Distribution, Lognormal, Normal, Uniform
from .efficiency import rank_measures
from .fit import fit_fragility, fit_lognormal
from .ida import ida
from .inputs import RandomInputs
from .notes import block_notes, notes
from .perturbed import flips
from .plan import Chunk, plan_chunks, run_chunk
from .probability import overturning_probability, wilson_interval
from .response import overturning_response
from .screen import screen
from .sensitivity import morris_indices, sobol_indices, tornado
from .states import reached
from .uncertain import uncertain_ida
from .variance import capacity_variance_shares, variance_shares

__all__ = [
    "Beta",
    "Categorical",
    "Chunk",
    "Distribution",
    "Lognormal",
    "Normal",
    "RandomInputs",
    "Uniform",
    "block_notes",
    "capacity_variance_shares",
    "cloud",
    "fit_fragility",
    "fit_lognormal",
    "flips",
    "ida",
    "morris_indices",
    "notes",
    "overturning_capacity",
    "overturning_probability",
    "overturning_response",
    "plan_chunks",
    "rank_measures",
    "reached",
    "run_chunk",
    "screen",
    "sobol_indices",
    "stripes",
    "tornado",
    "uncertain_ida",
    "variance_shares",
    "wilson_interval",
]
