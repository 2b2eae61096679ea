"""Curves as flat rows, one row a curve, which all exchange formats read and write.

`datasets` converts datasets to rows and back, `ids` makes ids, `files` reads files; no format is known here.
"""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import numpy as np

from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, ENDS, METRE, PER_YEAR, of_end
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, long_name_at, measure_named
from ..curves.curve import ISOTONIC, LINKED, UPLIFT
from ..fitting.links import LOGNORMAL
from ..fitting.states import INCOMPLETE, OK
from ..fitting.uplift import LOWEST
from ..runs.scaling import SCALE, BlockMeasure, intensity_measure
from .files import ExchangeError

Entries = TypeVar("Entries")
PLACES = (FLOOR, GROUND)
"""Places of a measure; the index is True for the ground."""

FORMS = (LOGNORMAL, UPLIFT, *LINKED, ISOTONIC)
LIMIT_STATE = "limit_state"
OVERTURNING = "overturning"

MAX_CURVES = 100_000
MAX_DISPERSION = 20.0
SMALLEST, LARGEST = 1e-100, 1e100

LEVEL = "level"  # in a table of units: the unit of the measure's levels
_OF_RANGE = "end of its range if all capacities are wrong by the same factor"
CURVE_NUMBERS: dict[str, tuple[str, str]] = {
    **{f"median{end}": (LEVEL, of_end(end, "median")) for end in ENDS[1:]},
    **{f"dispersion{end}": (DIMENSIONLESS, of_end(end, "dispersion")) for end in ENDS[1:]},
    "modelling_dispersion": (
        DIMENSIONLESS,
        "modelling uncertainty that the dispersion holds beside that of the motions",
    ),
    "width": (METRE, "full width"),
    "height": (METRE, "full height"),
    **{f"rate{end}": (PER_YEAR, of_end(end, "annual rate of overturning")) for end in ENDS},
    **{f"rate_modelling_{side}": (PER_YEAR, f"{side} {_OF_RANGE}") for side in ("lower", "upper")},
    "rate_modelling_dispersion": (
        DIMENSIONLESS,
        "modelling uncertainty in rates and risk probabilities, given if the dispersion has another",
    ),
    **{f"fitted_rate{end}": (PER_YEAR, of_end(end, "annual rate of the curve itself")) for end in ENDS},
    **{f"risk_probability{end}": (DIMENSIONLESS, of_end(end, "chance of overturning in the years")) for end in ENDS},
    **{f"risk_probability_modelling_{side}": (DIMENSIONLESS, f"{side} {_OF_RANGE}") for side in ("lower", "upper")},
    "directional": (DIMENSIONLESS, "whether the demand is taken in the component's own direction"),
    "offset": (DIMENSIONLESS, "floors between the component and its demand"),
}
"""Numbers that may accompany a curve: unit and long name."""

CURVE_WORDS = {"weights": "shares of the damage states that the limit state stands for"}
"""Texts that may accompany a curve, with their long names."""


class CurveParameters(NamedTuple):
    """Parameters of a curve (SI), NaN if it has none: P(x) = F(ln(x/median)/dispersion), F by its `link`.

    If both parameters of uplift are given, P has the further factor Phi(ln(x/uplift_median)/uplift_dispersion), a step
    at uplift_median if uplift_dispersion is 0.
    """

    median: float = math.nan
    dispersion: float = math.nan
    uplift_median: float = math.nan
    uplift_dispersion: float = math.nan
    link: str = LOGNORMAL

    @property
    def uplifting(self) -> bool:
        """True if the probability of uplift is a factor, which is 1 at every level if all runs uplift."""
        certain = self.uplift_median == LOWEST and self.uplift_dispersion == 0.0
        return not certain and not (math.isnan(self.uplift_median) and math.isnan(self.uplift_dispersion))

    @property
    def problem(self) -> str | None:
        """Reason why these numbers are no fragility curve; None for a valid curve."""
        if not SMALLEST <= self.median <= LARGEST:
            return f"median must be finite and > 0, got {self.median:g}"
        if not 0.0 < self.dispersion <= MAX_DISPERSION:
            return f"dispersion must be > 0 and <= {MAX_DISPERSION:g}, got {self.dispersion:g}"
        if not self.uplifting:
            return None
        if not SMALLEST <= self.uplift_median <= LARGEST:
            return f"uplift_median must be finite and > 0, got {self.uplift_median:g}"
        if not 0.0 <= self.uplift_dispersion <= MAX_DISPERSION:
            return f"uplift_dispersion must be >= 0 and <= {MAX_DISPERSION:g}, got {self.uplift_dispersion:g}"
        return None


PARAMETERS = CurveParameters._fields[:-1]
"""Numbers among the parameters of a curve; curves without uplift have the first two."""


class CurveRow(NamedTuple):
    """One curve: labels along the set's dimensions, parameters or probabilities, status, and accompanying values.

    A curve without parameters has its `probability` (level,) at the set's levels; `numbers` and `words` contain its
    known values of `CURVE_NUMBERS` and `CURVE_WORDS`.
    """

    labels: tuple[str, ...]
    parameters: CurveParameters = CurveParameters()
    status: str = OK
    probability: Array | None = None
    numbers: Mapping[str, float] = MappingProxyType({})
    words: Mapping[str, str] = MappingProxyType({})

    @property
    def estimated(self) -> bool:
        """True if there is a curve."""
        return self.probability is not None or not math.isnan(self.parameters.median)

    @property
    def lognormal(self) -> bool:
        """True unless the curve is none with two lognormal parameters."""
        return self.probability is None and self.parameters.link == LOGNORMAL and not self.parameters.uplifting

    @property
    def problem(self) -> str | None:
        """Reason why these numbers are no fragility curve; None for a valid curve."""
        p = self.probability
        if p is None:
            return self.parameters.problem if self.estimated else None
        if not np.isfinite(p).all() or p.min() < 0.0 or p.max() > 1.0:
            return "probabilities must lie between 0 and 1"
        return "probabilities must not decrease with the level" if np.any(np.diff(p) < 0.0) else None

    def with_reason(self) -> "CurveRow":
        """Return the row; without an estimate its status gives a reason, and incomplete parameters are dropped."""
        if self.estimated:
            return self
        return self._replace(parameters=CurveParameters(), status=INCOMPLETE if self.status == OK else self.status)


class CurveSet(NamedTuple):
    """Curves of one measure: the measure's label and SI unit, a flag for the ground's motion, dimensions, ids, form.

    Curves that differ only in the limit state are one component and have one id. `floors` are the floors above the
    ground whose motions levels measure (`upper_floors`). `state` is the limit state if there is only one. `place` is
    the place of the motions that levels measure.
    """

    im: str
    units: str
    ground: bool
    dims: tuple[str, ...]
    ids: tuple[str, ...]
    curves: tuple[CurveRow, ...]
    form: str = LOGNORMAL
    levels: Array | None = None
    title: str = "Fragility curves"
    floors: tuple[str, ...] = ()
    state: str = OVERTURNING
    place: str = FLOOR

    def components(self) -> dict[str, list[CurveRow]]:
        """Return the curves of each component by id, in the order of the limit states."""
        components: dict[str, list[CurveRow]] = {}
        for name, curve in zip(self.ids, self.curves, strict=True):
            components.setdefault(name, []).append(curve)
        return components

    def missing(self) -> dict[str, str]:
        """Return the reasons for missing curves, by the ids of components that lack at least one limit state."""
        return {
            name: next(state.status for state in states if not state.estimated)
            for name, states in self.components().items()
            if not all(state.estimated for state in states)
        }

    @property
    def limit_states(self) -> tuple[str, ...]:
        """Limit states in their order; the only one if the set has no such dimension."""
        if LIMIT_STATE not in self.dims:
            return (self.state,)
        at = self.dims.index(LIMIT_STATE)
        return tuple(dict.fromkeys(curve.labels[at] for curve in self.curves))

    @property
    def long_name(self) -> str:
        """Long name of the measure."""
        measure = known_measure(self.im)
        text = measure.long_name if measure is not None else "scale factor" if self.im == SCALE else "level"
        return long_name_at(text, self.place) if measure is not None else text


class Written(NamedTuple):
    """Result of a writer: its files, the ids of their components, and the reasons for missing estimates, by id."""

    paths: tuple[Path, ...]
    ids: tuple[str, ...]
    missing: dict[str, str]


def levels_problem(levels: Array) -> str | None:
    """Return the error in the levels of curves without parameters; None for valid levels."""
    if levels.size == 0 or not np.isfinite(levels).all() or levels[0] <= 0.0:
        return "levels must be finite and > 0, one at least"
    return "levels must be strictly increasing" if np.any(np.diff(levels) <= 0.0) else None


def known_measure(im: str) -> Measure | BlockMeasure | None:
    """Return the measure of a label; None for plain factors, an empty label, and user-defined measures."""
    try:
        return intensity_measure(im)
    except ValueError:
        return None


def spectral_period(im: str) -> tuple[str, float] | None:
    """Return Sa, Sv or Sd and its period (s) for a label of one of these with damping ratio 0.05; else None."""
    match = re.fullmatch(r"(Sa|Sv|Sd)\(.*\)", im)
    if match is None:
        return None
    measure = measure_named(im)
    return (match[1], float(measure.period)) if measure.damping == 0.05 else None  # type: ignore[attr-defined]


def select_measure(
    file: Path, entries: Mapping[tuple[str, bool], Entries], im: str | None
) -> tuple[tuple[str, bool], Entries]:
    """Return the measure (label, of the ground) that `im` selects, or the only one of a file, with its entries.

    `im` is a label, or if a file has the measure of both, with its place: ``pga of the ground``.
    """
    named, _, place = ("", "", "") if im is None else im.partition(" of the ")
    if place not in PLACES:
        named, place = im or "", ""
    measure = intensity_measure(named) if named else None
    wanted = None if im is None else SCALE if measure is None else measure.label
    keys = [key for key in entries if wanted in (None, key[0]) and place in ("", PLACES[key[1]])]
    # name the place for the ground, and if a measure exists in both places
    held = ", ".join(
        f"{label} of the {PLACES[ground]}" if ground or (label, True) in entries else label for label, ground in entries
    )
    if not keys:
        raise ExchangeError(f"{file}: holds no curves of {im}" + (f", but of {held}" if held else ""))
    if len(keys) > 1:
        raise ExchangeError(f"{file}: holds curves of {held}: choose one with im, or rows by their ids")
    return keys[0], entries[keys[0]]
