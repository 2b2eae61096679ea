"""Motions of the contents: simulated motions, pulses, records, floor motions, and their intensity measures."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .arrays import from_array as from_array, records as records
    from .corrections import (
        bandpass as bandpass,
        baseline as baseline,
        highpass as highpass,
        lowpass as lowpass,
        pad as pad,
        resample as resample,
        taper as taper,
        trim_husid as trim_husid,
    )
    from .floors.building import Building as Building
    from .floors.files import read_floors as read_floors
    from .floors.yielding import (
        CollapsingBuilding as CollapsingBuilding,
        Yielding as Yielding,
        YieldingBuilding as YieldingBuilding,
    )
    from .generators import GENERATORS as GENERATORS
    from .intensity.directions import GeometricMean as GeometricMean, RotD50 as RotD50, RotD100 as RotD100
    from .intensity.evaluation import measures as measures
    from .intensity.measure import MEASURES as MEASURES, Measure as Measure
    from .intensity.naming import measure_named as measure_named
    from .intensity.parametric_measures import FIV3 as FIV3, AvgSa as AvgSa, Sa as Sa, Sd as Sd, Sv as Sv
    from .intensity.spectra import response_spectrum as response_spectrum
    from .matching.ac156 import AC156 as AC156, ac156_acceptance as ac156_acceptance
    from .matching.adjustment import TargetMissed as TargetMissed
    from .matching.match import match as match
    from .matching.misfit import matching_report as matching_report
    from .matching.spectrum_compatible import SpectrumCompatible as SpectrumCompatible
    from .matching.target_spectra import TargetSpectrum as TargetSpectrum
    from .pairs import (
        as_recorded as as_recorded,
        both_axes as both_axes,
        join as join,
        rotate as rotate,
        weak_axis as weak_axis,
    )
    from .readers.at2 import read_at2 as read_at2, write_at2 as write_at2
    from .readers.csv import read_csv as read_csv
    from .readers.lines import RecordError as RecordError
    from .readers.read import example_path as example_path, read as read, read_all as read_all
    from .scaling import scale_to as scale_to, scale_to_mean as scale_to_mean
    from .selection.candidates import Candidates as Candidates
    from .selection.correlations import DoubtfulCorrelations as DoubtfulCorrelations
    from .selection.expected import expected_target as expected_target
    from .selection.files import TargetError as TargetError, read_target as read_target
    from .selection.ruptures import Disaggregation as Disaggregation, read_disaggregation as read_disaggregation
    from .selection.select import (
        InconsistentSelection as InconsistentSelection,
        Selection as Selection,
        select as select,
    )
    from .selection.stated import Stated as Stated
    from .selection.target import Conditional as Conditional, Mixture as Mixture, Target as Target
    from .simulated.envelopes import (
        ENVELOPES as ENVELOPES,
        Envelope as Envelope,
        RiseStrongDecay as RiseStrongDecay,
        Stationary as Stationary,
    )
    from .simulated.evolutionary import (
        EvolutionaryCloughPenzien as EvolutionaryCloughPenzien,
        EvolutionaryKanaiTajimi as EvolutionaryKanaiTajimi,
    )
    from .simulated.generator import Generator as Generator, ensemble as ensemble, steps_of as steps_of
    from .simulated.ground_motion_models import (
        Scenario as Scenario,
        expected_motions as expected_motions,
        over_model as over_model,
        scale_to_model as scale_to_model,
    )
    from .simulated.kanai_tajimi import CloughPenzien as CloughPenzien, KanaiTajimi as KanaiTajimi
    from .simulated.near_fault import NearFault as NearFault
    from .simulated.pulses import (
        PULSES as PULSES,
        HalfSine as HalfSine,
        MavroeidisPapageorgiou as MavroeidisPapageorgiou,
        OneCycleCosine as OneCycleCosine,
        OneCycleSine as OneCycleSine,
        Pulse as Pulse,
        RectangularPulse as RectangularPulse,
        Ricker as Ricker,
    )
    from .simulated.seismological import Seismological as Seismological
    from .simulated.site_based import SiteBased as SiteBased, SiteBasedScenario as SiteBasedScenario
    from .supports.isolator import Isolator as Isolator, IsolatorStrikes as IsolatorStrikes
    from .supports.support import Support as Support

__getattr__, __dir__, __all__ = face(__name__)
