"""From runs to probabilities and rates: analyses, estimators, comparisons of measures, uncertain inputs, risk."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .analyses.cloud import cloud
    from .analyses.ida import ida
    from .analyses.joint import joint_falls
    from .analyses.pooled import pooled
    from .analyses.sliding import slide_runs
    from .analyses.stripes import stripes
    from .analyses.surface_results import surface_curves
    from .curves.comparison import median_ratio
    from .curves.curve import curve_probability
    from .curves.probability import overturning_probability
    from .curves.resurrection import resurrections
    from .efficiency.capacity import overturning_capacity
    from .efficiency.ranking import rank_measures
    from .efficiency.sufficiency import stripe_sufficiency
    from .exchange.curve_csv import write_curve_csv
    from .exchange.files import ExchangeError
    from .exchange.nrml.writing import write_nrml
    from .exchange.pelicun.reading import read_pelicun
    from .exchange.pelicun.writing import write_pelicun
    from .exchange.rows import Written
    from .fitting.fit import FORMS, fit_fragility
    from .fitting.goodness import compare_forms, goodness_of_fit
    from .fitting.states import Slip, reached
    from .hazard.curve import HazardCurve
    from .hazard.files import read_hazard
    from .hazard.rates import probability_in, rate_from_probability
    from .hazard.reading import HazardError
    from .numerics.proportions import binomial_interval, wilson_interval
    from .risk.annual_rate import annual_rate, rate_share_above
    from .risk.epistemic import Branch, epistemic_rates
    from .risk.inversion import size_for_rate
    from .risk.modelling import with_modelling
    from .runs.plan import Chunk, Work, plan_chunks, run_chunk
    from .uncertainty.distributions import Beta, Categorical, Distribution, Least, Lognormal, Normal, Uniform
    from .uncertainty.ida import uncertain_ida
    from .uncertainty.indices import sobol_indices, tornado
    from .uncertainty.inputs import RandomInputs
    from .uncertainty.response import overturning_response
    from .uncertainty.variance import capacity_variance_shares, variance_shares
    from .validity.notes import block_notes, notes
    from .validity.screen import screen
    from .validity.undecided import undecided_outcomes

__all__ = [
    "FORMS",
    "Beta",
    "Branch",
    "Categorical",
    "Chunk",
    "Distribution",
    "ExchangeError",
    "HazardCurve",
    "HazardError",
    "Least",
    "Lognormal",
    "Normal",
    "RandomInputs",
    "Slip",
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
    "epistemic_rates",
    "fit_fragility",
    "goodness_of_fit",
    "ida",
    "joint_falls",
    "median_ratio",
    "notes",
    "overturning_capacity",
    "overturning_probability",
    "overturning_response",
    "plan_chunks",
    "pooled",
    "probability_in",
    "rank_measures",
    "rate_from_probability",
    "rate_share_above",
    "reached",
    "read_hazard",
    "read_pelicun",
    "resurrections",
    "run_chunk",
    "screen",
    "size_for_rate",
    "slide_runs",
    "sobol_indices",
    "stripe_sufficiency",
    "stripes",
    "surface_curves",
    "tornado",
    "uncertain_ida",
    "undecided_outcomes",
    "variance_shares",
    "wilson_interval",
    "with_modelling",
    "write_curve_csv",
    "write_nrml",
    "write_pelicun",
]

__getattr__, __dir__ = face(
    __name__,
    {
        "analyses.cloud": ("cloud",),
        "analyses.ida": ("ida",),
        "analyses.joint": ("joint_falls",),
        "analyses.pooled": ("pooled",),
        "analyses.surface_results": ("surface_curves",),
        "analyses.sliding": ("slide_runs",),
        "analyses.stripes": ("stripes",),
        "curves.comparison": ("median_ratio",),
        "curves.curve": ("curve_probability",),
        "curves.probability": ("overturning_probability",),
        "curves.resurrection": ("resurrections",),
        "efficiency.capacity": ("overturning_capacity",),
        "efficiency.ranking": ("rank_measures",),
        "efficiency.sufficiency": ("stripe_sufficiency",),
        "exchange.curve_csv": ("write_curve_csv",),
        "exchange.files": ("ExchangeError",),
        "exchange.nrml.writing": ("write_nrml",),
        "exchange.pelicun.reading": ("read_pelicun",),
        "exchange.pelicun.writing": ("write_pelicun",),
        "exchange.rows": ("Written",),
        "fitting.fit": ("FORMS", "fit_fragility"),
        "fitting.goodness": ("compare_forms", "goodness_of_fit"),
        "fitting.states": ("Slip", "reached"),
        "hazard.curve": ("HazardCurve",),
        "hazard.files": ("read_hazard",),
        "hazard.rates": ("probability_in", "rate_from_probability"),
        "hazard.reading": ("HazardError",),
        "numerics.proportions": ("binomial_interval", "wilson_interval"),
        "risk.annual_rate": ("annual_rate", "rate_share_above"),
        "risk.epistemic": ("Branch", "epistemic_rates"),
        "risk.inversion": ("size_for_rate",),
        "risk.modelling": ("with_modelling",),
        "runs.plan": ("Chunk", "Work", "plan_chunks", "run_chunk"),
        "uncertainty.distributions": ("Beta", "Categorical", "Distribution", "Least", "Lognormal", "Normal", "Uniform"),
        "uncertainty.ida": ("uncertain_ida",),
        "uncertainty.indices": ("sobol_indices", "tornado"),
        "uncertainty.inputs": ("RandomInputs",),
        "uncertainty.response": ("overturning_response",),
        "uncertainty.variance": ("capacity_variance_shares", "variance_shares"),
        "validity.notes": ("block_notes", "notes"),
        "validity.screen": ("screen",),
        "validity.undecided": ("undecided_outcomes",),
    },
)
