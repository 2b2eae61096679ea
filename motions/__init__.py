"""What shakes the contents: simulated motions, pulses, records, and their intensity measures."""

from .ac156 import AC156, ac156_acceptance
from .arrays import from_array, records
from .at2 import read_at2, write_at2
from .corrections import bandpass, baseline, highpass, lowpass, pad, resample, taper, trim, trim_husid
from .ensembles import Generator
from .envelopes import ENVELOPES, DoubleExponential, Envelope, Gamma, RiseStrongDecay, Stationary
from .evolutionary import EvolutionaryCloughPenzien, EvolutionaryKanaiTajimi
from .files import RecordError
from .filters import CloughPenzien, KanaiTajimi
from .floor_files import read_floors
from .floors import Building
from .generators import GENERATORS
from .intensity import MEASURES, Measure
from .matching import match
from .measures import measure_named, measures
from .misfit import matching_report
from .nearfault import NearFault
from .p58 import p58_floor_demands
from .parametrised import FIV3, AvgSa, Sa, Sd, Sv
from .processing import parabolic_baseline, scale_to, scale_to_mean
from .pulses import (
    PULSES,
    HalfSine,
    MavroeidisPapageorgiou,
    OneCycleCosine,
    OneCycleSine,
    Pulse,
    RectangularPulse,
    Ricker,
)
from .reading import example_path, read, read_all
from .seismological import Seismological
from .sitebased import SiteBased, SiteBasedScenario
from .spectra import response_spectrum
from .spectrum_compatible import SpectrumCompatible
from .targets import TargetSpectrum
from .text import read_csv

__all__ = [
    "AC156",
    "ENVELOPES",
    "FIV3",
    "GENERATORS",
    "MEASURES",
    "PULSES",
    "AvgSa",
    "Building",
    "CloughPenzien",
    "DoubleExponential",
    "Envelope",
    "EvolutionaryCloughPenzien",
    "EvolutionaryKanaiTajimi",
    "Gamma",
    "Generator",
    "HalfSine",
    "KanaiTajimi",
    "MavroeidisPapageorgiou",
    "Measure",
    "NearFault",
    "OneCycleCosine",
    "OneCycleSine",
    "Pulse",
    "RecordError",
    "RectangularPulse",
    "Ricker",
    "RiseStrongDecay",
    "Sa",
    "Sd",
    "Seismological",
    "SiteBased",
    "SiteBasedScenario",
    "SpectrumCompatible",
    "Stationary",
    "Sv",
    "TargetSpectrum",
    "ac156_acceptance",
    "bandpass",
    "baseline",
    "example_path",
    "from_array",
    "highpass",
    "lowpass",
    "match",
    "matching_report",
    "measure_named",
    "measures",
    "p58_floor_demands",
    "pad",
    "parabolic_baseline",
    "read",
    "read_all",
    "read_at2",
    "read_csv",
    "read_floors",
    "records",
    "resample",
    "response_spectrum",
    "scale_to",
    "scale_to_mean",
    "taper",
    "trim",
    "trim_husid",
    "write_at2",
]
