"""What shakes the contents: simulated motions, pulses, records, and their intensity measures."""

from .arrays import from_array, records
from .at2 import read_at2, write_at2
from .envelopes import ENVELOPES, DoubleExponential, Envelope, Gamma, RiseStrongDecay, Stationary
from .files import RecordError
from .filters import GENERATORS, CloughPenzien, Generator, KanaiTajimi
from .measures import MEASURES, measures
from .processing import parabolic_baseline, scale_to, scale_to_mean
from .pulses import PULSES, HalfSine, OneCycleCosine, OneCycleSine, Pulse, RectangularPulse, Ricker
from .reading import example_path, read
from .text import read_csv

__all__ = [
    "ENVELOPES",
    "GENERATORS",
    "MEASURES",
    "PULSES",
    "CloughPenzien",
    "DoubleExponential",
    "Envelope",
    "Gamma",
    "Generator",
    "HalfSine",
    "KanaiTajimi",
    "OneCycleCosine",
    "OneCycleSine",
    "Pulse",
    "RecordError",
    "RectangularPulse",
    "Ricker",
    "RiseStrongDecay",
    "Stationary",
    "example_path",
    "from_array",
    "measures",
    "parabolic_baseline",
    "read",
    "read_at2",
    "read_csv",
    "records",
    "scale_to",
    "scale_to_mean",
    "write_at2",
]
