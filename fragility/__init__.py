"""From runs to probabilities and rates: analyses, estimators, comparisons of measures, uncertain inputs, risk."""

from .capacity import overturning_capacity
from .comparison import median_ratio, size_regression
from .curve_csv import read_curve_csv, write_curve_csv
from .curves import curve_probability
from .designs import cloud, stripes
from .distributions import Beta, Categorical, Distribution, Lognormal, Normal, Uniform
from .efficiency import rank_measures
from .exchange import Written
from .exchange_files import ExchangeError
from .fit import FORMS, fit_fragility, fit_lognormal
from .goodness import compare_forms, goodness_of_fit
from .hazard import HazardCurve
from .hazard_files import read_hazard
from .hazard_reading import HazardError
from .ida import ida
from .inputs import RandomInputs
from .intervals import binomial_interval, wilson_interval
from .inversion import Design, design_for_rate, size_for_rate
from .notes import block_notes, notes
from .nrml import write_nrml
from .nrml_reading import read_nrml
from .pelicun import read_pelicun, write_pelicun
from .perturbed import flips
from .plan import Chunk, Work, plan_chunks, run_chunk
from .probability import overturning_probability
from .rates import discrete_rate, probability_in, rate_from_probability
from .response import overturning_response
from .resurrection import returned
from .risk import annual_rate, rate_share_above
from .screen import screen
from .screen_without_runs import standing
from .sensitivity import morris_indices, sobol_indices, tornado
from .slenderness import slenderness_for_rate
from .states import reached
from .uncertain import uncertain_ida
from .variance import capacity_variance_shares, variance_shares

__all__ = [
    "FORMS",
    "Beta",
    "Categorical",
    "Chunk",
    "Design",
    "Distribution",
    "ExchangeError",
    "HazardCurve",
    "HazardError",
    "Lognormal",
    "Normal",
    "RandomInputs",
    "Uniform",
    "Work",
    "Written",
    "annual_rate",
    "binomial_interval",
    "block_notes",
    "capacity_variance_shares",
    "cloud",
    "compare_forms",
    "curve_probability",
    "design_for_rate",
    "discrete_rate",
    "fit_fragility",
    "fit_lognormal",
    "flips",
    "goodness_of_fit",
    "ida",
    "median_ratio",
    "morris_indices",
    "notes",
    "overturning_capacity",
    "overturning_probability",
    "overturning_response",
    "plan_chunks",
    "probability_in",
    "rank_measures",
    "rate_from_probability",
    "rate_share_above",
    "reached",
    "read_curve_csv",
    "read_hazard",
    "read_nrml",
    "read_pelicun",
    "returned",
    "run_chunk",
    "screen",
    "size_for_rate",
    "size_regression",
    "slenderness_for_rate",
    "sobol_indices",
    "standing",
    "stripes",
    "tornado",
    "uncertain_ida",
    "variance_shares",
    "wilson_interval",
    "write_curve_csv",
    "write_nrml",
    "write_pelicun",
]
