"""From runs to probabilities and rates: analyses, estimators, comparisons of measures, uncertain inputs, risk."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .analyses.adaptive import adaptive_ida as adaptive_ida
    from .analyses.cloud import cloud as cloud
    from .analyses.ida import ida as ida
    from .analyses.joint import joint_falls as joint_falls
    from .analyses.planned import run_table as run_table
    from .analyses.pooled import pooled as pooled
    from .analyses.sliding import slide_runs as slide_runs
    from .analyses.stripes import stripes as stripes
    from .analyses.surface_results import surface_curves as surface_curves
    from .curves.comparison import median_ratio as median_ratio
    from .curves.curve import curve_probability as curve_probability
    from .curves.probability import overturning_probability as overturning_probability
    from .curves.resurrection import resurrections as resurrections
    from .efficiency.capacity import overturning_capacity as overturning_capacity
    from .efficiency.ranking import rank_measures as rank_measures
    from .efficiency.sufficiency import stripe_sufficiency as stripe_sufficiency
    from .exchange.curve_csv import write_curve_csv as write_curve_csv
    from .exchange.files import ExchangeError as ExchangeError
    from .exchange.nrml.writing import write_nrml as write_nrml
    from .exchange.pelicun.reading import read_pelicun as read_pelicun
    from .exchange.pelicun.writing import write_pelicun as write_pelicun
    from .exchange.rows import Written as Written
    from .fitting.fit import FORMS as FORMS, fit_fragility as fit_fragility
    from .fitting.goodness import compare_forms as compare_forms, goodness_of_fit as goodness_of_fit
    from .fitting.states import Slip as Slip, reached as reached
    from .hazard.curve import HazardCurve as HazardCurve
    from .hazard.files import read_hazard as read_hazard
    from .hazard.poisson import probability_in as probability_in, rate_from_probability as rate_from_probability
    from .hazard.reading import HazardError as HazardError
    from .numerics.proportions import binomial_interval as binomial_interval, wilson_interval as wilson_interval
    from .risk.annual_rate import annual_rate as annual_rate, rate_share_above as rate_share_above
    from .risk.epistemic import Branch as Branch, epistemic_rates as epistemic_rates
    from .risk.inversion import size_for_rate as size_for_rate
    from .risk.modelling import with_modelling as with_modelling
    from .runs.plan import Chunk as Chunk, Work as Work, plan_chunks as plan_chunks, run_chunk as run_chunk
    from .uncertainty.distributions import (
        Beta as Beta,
        Categorical as Categorical,
        Distribution as Distribution,
        Least as Least,
        Lognormal as Lognormal,
        Normal as Normal,
        Uniform as Uniform,
    )
    from .uncertainty.ida import overturning_response as overturning_response, uncertain_ida as uncertain_ida
    from .uncertainty.indices import sobol_indices as sobol_indices, tornado as tornado
    from .uncertainty.inputs import RandomInputs as RandomInputs
    from .uncertainty.variance import (
        capacity_variance_shares as capacity_variance_shares,
        variance_shares as variance_shares,
    )
    from .validity.notes import block_notes as block_notes, notes as notes
    from .validity.screen import screen as screen

__getattr__, __dir__, __all__ = face(__name__)
