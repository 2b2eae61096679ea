"""Motions that shake the contents: simulated motions, pulses, records, floor motions, and their intensity measures."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .arrays import from_array, records
    from .corrections import bandpass, baseline, highpass, lowpass, pad, resample, taper, trim, trim_husid
    from .floors.building import Building
    from .floors.files import read_floors
    from .floors.strength import default_yield_coefficient
    from .floors.yielding import CollapsingBuilding, YieldingBuilding
    from .generators import GENERATORS
    from .intensity.dataset import measure_named, measures
    from .intensity.directions import GeometricMean, RotD50, RotD100
    from .intensity.measure import MEASURES, Measure
    from .intensity.parametric_measures import FIV3, AvgSa, Sa, Sd, Sv
    from .intensity.spectra import response_spectrum
    from .matching.ac156 import AC156, ac156_acceptance
    from .matching.adjustment import TargetMissed
    from .matching.match import match
    from .matching.misfit import matching_report
    from .matching.spectrum_compatible import SpectrumCompatible
    from .matching.targets import TargetSpectrum
    from .pairs import as_recorded, both_axes, join, rotate, weak_axis
    from .readers.at2 import read_at2, write_at2
    from .readers.csv import read_csv
    from .readers.lines import RecordError
    from .readers.read import example_path, read, read_all
    from .scaling import parabolic_baseline, scale_to, scale_to_mean
    from .selection.candidates import Candidates
    from .selection.correlations import DoubtfulCorrelations
    from .selection.expected import expected_target
    from .selection.files import TargetError, read_target
    from .selection.ruptures import Disaggregation, read_disaggregation
    from .selection.select import InconsistentSelection, Selection, select
    from .selection.stated import Stated
    from .selection.target import Conditional, Mixture, Target
    from .simulated.envelopes import ENVELOPES, Envelope, RiseStrongDecay, Stationary
    from .simulated.evolutionary import EvolutionaryCloughPenzien, EvolutionaryKanaiTajimi
    from .simulated.generator import Generator, ensemble, steps_of
    from .simulated.ground_motion_models import Scenario, expected_motions, over_model, scale_to_model
    from .simulated.kanai_tajimi import CloughPenzien, KanaiTajimi
    from .simulated.near_fault import NearFault
    from .simulated.pulses import (
        PULSES,
        HalfSine,
        MavroeidisPapageorgiou,
        OneCycleCosine,
        OneCycleSine,
        Pulse,
        RectangularPulse,
        Ricker,
    )
    from .simulated.seismological import Seismological
    from .simulated.site_based import SiteBased, SiteBasedScenario
    from .supports.isolator import Isolator, IsolatorStrikes
    from .supports.support import Support

__all__ = [
    "AC156",
    "ENVELOPES",
    "FIV3",
    "GENERATORS",
    "MEASURES",
    "PULSES",
    "AvgSa",
    "Building",
    "Candidates",
    "CloughPenzien",
    "CollapsingBuilding",
    "Conditional",
    "Disaggregation",
    "DoubtfulCorrelations",
    "Envelope",
    "EvolutionaryCloughPenzien",
    "EvolutionaryKanaiTajimi",
    "Generator",
    "GeometricMean",
    "HalfSine",
    "InconsistentSelection",
    "Isolator",
    "IsolatorStrikes",
    "KanaiTajimi",
    "MavroeidisPapageorgiou",
    "Measure",
    "Mixture",
    "NearFault",
    "OneCycleCosine",
    "OneCycleSine",
    "Pulse",
    "RecordError",
    "RectangularPulse",
    "Ricker",
    "RiseStrongDecay",
    "RotD50",
    "RotD100",
    "Sa",
    "Scenario",
    "Sd",
    "Seismological",
    "Selection",
    "SiteBased",
    "SiteBasedScenario",
    "SpectrumCompatible",
    "Stated",
    "Stationary",
    "Support",
    "Sv",
    "Target",
    "TargetError",
    "TargetMissed",
    "TargetSpectrum",
    "YieldingBuilding",
    "ac156_acceptance",
    "as_recorded",
    "bandpass",
    "baseline",
    "both_axes",
    "default_yield_coefficient",
    "ensemble",
    "example_path",
    "expected_motions",
    "expected_target",
    "from_array",
    "highpass",
    "join",
    "lowpass",
    "match",
    "matching_report",
    "measure_named",
    "measures",
    "over_model",
    "pad",
    "parabolic_baseline",
    "read",
    "read_all",
    "read_at2",
    "read_csv",
    "read_disaggregation",
    "read_floors",
    "read_target",
    "records",
    "resample",
    "response_spectrum",
    "rotate",
    "scale_to",
    "scale_to_mean",
    "scale_to_model",
    "select",
    "steps_of",
    "taper",
    "trim",
    "trim_husid",
    "weak_axis",
    "write_at2",
]

__getattr__, __dir__ = face(
    __name__,
    {
        "arrays": ("from_array", "records"),
        "corrections": (
            "bandpass",
            "baseline",
            "highpass",
            "lowpass",
            "pad",
            "resample",
            "taper",
            "trim",
            "trim_husid",
        ),
        "floors.building": ("Building",),
        "floors.files": ("read_floors",),
        "floors.strength": ("default_yield_coefficient",),
        "floors.yielding": ("CollapsingBuilding", "YieldingBuilding"),
        "supports.isolator": ("Isolator", "IsolatorStrikes"),
        "supports.support": ("Support",),
        "generators": ("GENERATORS",),
        "intensity.dataset": ("measure_named", "measures"),
        "intensity.directions": ("GeometricMean", "RotD50", "RotD100"),
        "intensity.measure": ("MEASURES", "Measure"),
        "intensity.parametric_measures": ("FIV3", "AvgSa", "Sa", "Sd", "Sv"),
        "intensity.spectra": ("response_spectrum",),
        "matching.ac156": ("AC156", "ac156_acceptance"),
        "matching.adjustment": ("TargetMissed",),
        "matching.match": ("match",),
        "matching.misfit": ("matching_report",),
        "matching.spectrum_compatible": ("SpectrumCompatible",),
        "matching.targets": ("TargetSpectrum",),
        "pairs": ("as_recorded", "both_axes", "join", "rotate", "weak_axis"),
        "readers.at2": ("read_at2", "write_at2"),
        "readers.csv": ("read_csv",),
        "readers.lines": ("RecordError",),
        "readers.read": ("example_path", "read", "read_all"),
        "scaling": ("parabolic_baseline", "scale_to", "scale_to_mean"),
        "selection.candidates": ("Candidates",),
        "selection.correlations": ("DoubtfulCorrelations",),
        "selection.expected": ("expected_target",),
        "selection.files": ("TargetError", "read_target"),
        "selection.ruptures": ("Disaggregation", "read_disaggregation"),
        "selection.stated": ("Stated",),
        "selection.select": ("InconsistentSelection", "Selection", "select"),
        "selection.target": ("Conditional", "Mixture", "Target"),
        "simulated.envelopes": ("ENVELOPES", "Envelope", "RiseStrongDecay", "Stationary"),
        "simulated.evolutionary": ("EvolutionaryCloughPenzien", "EvolutionaryKanaiTajimi"),
        "simulated.generator": ("Generator", "ensemble", "steps_of"),
        "simulated.ground_motion_models": ("Scenario", "expected_motions", "over_model", "scale_to_model"),
        "simulated.kanai_tajimi": ("CloughPenzien", "KanaiTajimi"),
        "simulated.near_fault": ("NearFault",),
        "simulated.pulses": (
            "PULSES",
            "HalfSine",
            "MavroeidisPapageorgiou",
            "OneCycleCosine",
            "OneCycleSine",
            "Pulse",
            "RectangularPulse",
            "Ricker",
        ),
        "simulated.seismological": ("Seismological",),
        "simulated.site_based": ("SiteBased", "SiteBasedScenario"),
    },
)
