"""Curves as flat rows, one row a curve, which all exchange formats write: no format is known here."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, METRE, PER_YEAR, UNITS
from ...motions.intensity.dataset import measure_named
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, long_name_at, place_in
from ..curves.curve import ISOTONIC, LINKED, UPLIFT
from ..fitting.links import LOGNORMAL
from ..fitting.states import INCOMPLETE, OK, SEPARATED
from ..fitting.uplift import LOWEST
from ..runs.provenance import levels_of_the_ground
from ..runs.scaling import SCALE, BlockMeasure, intensity_measure
from .ids import OPENQUAKE_MARKS, TABLE_MARKS, check_ids, is_id, make_ids

PLACES = (FLOOR, GROUND)
"""Places of a measure, by whether it is of the ground."""

FORMS = (LOGNORMAL, UPLIFT, *LINKED, ISOTONIC)
LIMIT_STATE = "limit_state"
OVERTURNING = "overturning"

MAX_CURVES, MAX_NUMBERS = 100_000, 5_000_000
MAX_DISPERSION = 20.0
SMALLEST, LARGEST = 1e-100, 1e100

LEVEL = "level"  # in a table of units: the unit of the measure's levels
CURVE_NUMBERS = {
    "median_lower": LEVEL,
    "median_upper": LEVEL,
    "dispersion_lower": DIMENSIONLESS,
    "dispersion_upper": DIMENSIONLESS,
    "modelling_dispersion": DIMENSIONLESS,
    "width": METRE,
    "height": METRE,
    "rate": PER_YEAR,
    "rate_lower": PER_YEAR,
    "rate_upper": PER_YEAR,
    "rate_modelling_lower": PER_YEAR,
    "rate_modelling_upper": PER_YEAR,
    "rate_modelling_dispersion": DIMENSIONLESS,
    "fitted_rate": PER_YEAR,
    "fitted_rate_lower": PER_YEAR,
    "fitted_rate_upper": PER_YEAR,
    "risk_probability": DIMENSIONLESS,
    "risk_probability_lower": DIMENSIONLESS,
    "risk_probability_upper": DIMENSIONLESS,
    "risk_probability_modelling_lower": DIMENSIONLESS,
    "risk_probability_modelling_upper": DIMENSIONLESS,
    "directional": DIMENSIONLESS,
    "offset": DIMENSIONLESS,
}
"""Numbers that may accompany a curve, and their units."""

CURVE_WORDS = ("weights",)
"""Texts that may accompany a curve: shares of the damage states that the limit state stands for."""

SIZES = ("width", "height")
GUESSED = "The data are separated: the dispersion is a guess (penalised likelihood)."
"""Note on a curve whose dispersion few runs determine."""


class CurveParameters(NamedTuple):
    """Parameters of a curve (SI), NaN where it has none: P(x) = F(ln(x/median)/dispersion), F by its `link`.

    Where both parameters of uplift are given, P has the further factor Phi(ln(x/uplift_median)/uplift_dispersion), a
    step at uplift_median if uplift_dispersion is 0.
    """

    median: float = math.nan
    dispersion: float = math.nan
    uplift_median: float = math.nan
    uplift_dispersion: float = math.nan
    link: str = LOGNORMAL

    @property
    def uplifting(self) -> bool:
        """True where the probability of uplift is a factor, which is 1 at every level if all runs uplift."""
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
"""Numbers among the parameters of a curve; those of curves without uplift are the first two."""


class CurveRow(NamedTuple):
    """One curve: labels along the set's dimensions, parameters or probabilities, status, and accompanying values.

    A curve without parameters has its `probability` (level,) at the set's levels; `numbers` and `words` hold the
    known ones of `CURVE_NUMBERS` and `CURVE_WORDS`.
    """

    labels: tuple[str, ...]
    parameters: CurveParameters = CurveParameters()
    status: str = OK
    probability: Array | None = None
    numbers: Mapping[str, float] = MappingProxyType({})
    words: Mapping[str, str] = MappingProxyType({})

    @property
    def estimated(self) -> bool:
        """True where there is a curve."""
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

    def with_reason(self) -> CurveRow:
        """Return the row; without an estimate its status gives a reason, and incomplete parameters are dropped."""
        if self.estimated:
            return self
        return self._replace(parameters=CurveParameters(), status=INCOMPLETE if self.status == OK else self.status)


class CurveSet(NamedTuple):
    """Curves of one measure: the measure's label and SI unit, a flag for the ground's motion, dimensions, ids, form.

    Curves that differ in nothing but the limit state are one component and have one id; `floors` are those on which the
    blocks stand, as far as they are known, `state` is the limit state where there is but one, and `place` is the place
    of the motions that levels measure.
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
        found: dict[str, list[CurveRow]] = {}
        for name, curve in zip(self.ids, self.curves, strict=True):
            found.setdefault(name, []).append(curve)
        return found

    def missing(self) -> dict[str, str]:
        """Return the reasons for missing curves, by the ids of components that lack at least one limit state."""
        return {
            name: next(one.status for one in states if not one.estimated)
            for name, states in self.components().items()
            if not all(one.estimated for one in states)
        }

    @property
    def limit_states(self) -> tuple[str, ...]:
        """Limit states in their order; the only one where the set has no such dimension."""
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


def component_record(found: CurveSet, rows: Sequence[CurveRow]) -> dict[str, Any]:
    """Return our record of a component in the types that JSON holds."""
    labels = dict(zip(found.dims, rows[0].labels, strict=True))
    labels.pop(LIMIT_STATE, None)
    reason = next((row.status for row in rows if not row.estimated), None)
    return {
        "labels": labels,
        **({} if found.limit_states == (OVERTURNING,) else {"limit_states": list(found.limit_states)}),
        **{name: rows[0].numbers[name] for name in SIZES if name in rows[0].numbers},
        **({} if reason is None else {"status": reason}),
        **({"note": GUESSED} if reason is None and any(row.status == SEPARATED for row in rows) else {}),
    }


def curve_set(curves: xr.Dataset, marks: str, chosen: Sequence[str] | None = None) -> CurveSet:
    """Return the curves of a dataset as rows, with ids of letters, digits and `marks`: the `chosen` ones, if any."""
    if not isinstance(curves, xr.Dataset):
        raise TypeError(f"curves must be a dataset of fragility curves, got {type(curves).__name__}")
    form = _form(curves)
    base = curves["probability" if form == ISOTONIC else "median"]
    if base.size > MAX_NUMBERS:
        raise ValueError(f"curves must hold at most {MAX_NUMBERS:,} numbers, got {base.size:,}")
    levels = _levels(curves) if form == ISOTONIC else None
    dims = tuple(str(dim) for dim in base.dims if dim != "level")
    of_levels = curves["level"] if "level" in curves.coords else base
    im = str(curves.attrs.get("im") or of_levels.attrs.get("im", ""))
    units = _si_unit(im, str((of_levels if form == ISOTONIC else base).attrs.get("units", DIMENSIONLESS)))
    axes = [[_text(value) for value in _axis(curves, dim)] for dim in dims]
    labels = list(itertools.product(*axes))
    parameters = [CurveParameters()] * len(labels)
    probabilities: list[Array | None] = [None] * len(labels)
    if form == ISOTONIC:
        table = np.asarray(base.transpose(*dims, "level").values, dtype=float).reshape(len(labels), -1)
        probabilities = [None if np.isnan(one).all() else one for one in table]
    else:
        names = PARAMETERS if form == UPLIFT else PARAMETERS[:2]
        columns = {name: column for name in names if (column := _column(curves, name, dims)) is not None}
        if len(columns) < len(names):
            raise ValueError(f"{' and '.join(names)} of curves must be numbers on {dims}")
        parameters = [
            CurveParameters(**dict(zip(names, numbers, strict=True)), link=form if form in LINKED else LOGNORMAL)
            for numbers in zip(*(columns[name].tolist() for name in names), strict=True)
        ]
    accompanying = {name: column for name in CURVE_NUMBERS if (column := _column(curves, name, dims)) is not None}
    words = {name: texts for name in CURVE_WORDS if (texts := _texts(curves, name, dims)) is not None}
    statuses = _texts(curves, "status", dims) or [OK] * len(labels)
    rows = []
    for i, label in enumerate(labels):
        row = CurveRow(
            label,
            parameters[i],
            statuses[i],
            probabilities[i],
            {name: float(column[i]) for name, column in accompanying.items() if math.isfinite(column[i])},
            {name: texts[i] for name, texts in words.items() if texts[i]},
        )
        if row.problem:
            raise ValueError(f"curve {' / '.join(label)!r:.100}: {row.problem}")
        rows.append(row.with_reason())
    title = str(curves.attrs.get("title", "Fragility curves"))
    ids = _ids(curves, dims, labels, marks, chosen)
    at_ground = levels_of_the_ground(curves)
    return CurveSet(
        im,
        units,
        at_ground,
        dims,
        ids,
        tuple(rows),
        form,
        levels,
        title,
        tuple(_text(one) for one in curves["floor"].values.reshape(-1)) if "floor" in curves.coords else (),
        _text(curves.attrs.get("state", OVERTURNING)),
        GROUND if at_ground else place_in(str(of_levels.attrs.get("long_name", ""))) or FLOOR,
    )


def _form(curves: xr.Dataset) -> str:
    stated = curves.attrs.get("form")
    if stated is None:
        stated = UPLIFT if "uplift_median" in curves else LOGNORMAL
    if stated not in FORMS:
        raise ValueError(f"form of curves must be one of {', '.join(FORMS)}, got {stated!r:.60}")
    needed = {UPLIFT: PARAMETERS, ISOTONIC: ("probability",)}.get(str(stated), PARAMETERS[:2])
    if not all(name in curves for name in needed):
        held = ", ".join(map(str, curves.data_vars)) or "nothing"
        raise ValueError(f"{stated} curves must hold {' and '.join(needed)}, got {held:.200}")
    return str(stated)


def _levels(curves: xr.Dataset) -> Array:
    if "level" not in curves["probability"].dims or "level" not in curves.coords:
        raise ValueError(f"probability of curves must lie on level, got {curves['probability'].dims}")
    levels = np.asarray(curves["level"].values, dtype=float)
    if levels.size == 0 or not np.isfinite(levels).all() or levels[0] <= 0.0:
        raise ValueError(f"levels must be finite and > 0, one at least, got {levels[:5].tolist()}")
    if np.any(np.diff(levels) <= 0.0):
        raise ValueError(f"levels must be strictly increasing, got {levels[:5].tolist()}")
    return levels


def _si_unit(im: str, stated: str) -> str:
    """Return the unit of the curves, which must be that of the measure; a user-defined measure may have any unit."""
    measure = known_measure(im)
    if measure is not None and UNITS.get(stated) != (1.0, measure.units):
        raise ValueError(f"curves of {im} must be in {measure.units}, got {stated!r:.40}")
    return stated if measure is None else measure.units


def _column(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> Array | None:
    """Return a variable at every row; None if the dataset has no such numbers on (some of) these dimensions."""
    array = _at_every_row(curves, name, dims)
    return None if array is None or array.dtype.kind not in "iufb" else np.asarray(array, dtype=float)


def _texts(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> list[str] | None:
    array = _at_every_row(curves, name, dims)
    return None if array is None else [_text(value) for value in array]


def _at_every_row(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> NDArray[Any] | None:
    if name not in curves.variables or not {str(dim) for dim in curves[name].dims} <= set(dims):
        return None
    like = xr.DataArray(np.empty([curves.sizes[dim] for dim in dims], dtype=bool), dims=dims)
    spread = curves[name].variable.to_base_variable()
    return np.asarray(xr.DataArray(spread).broadcast_like(like).transpose(*dims).values).reshape(-1)


def _axis(curves: xr.Dataset, dim: str) -> NDArray[Any]:
    return np.asarray(curves[dim].values if dim in curves.coords else np.arange(curves.sizes[dim]))


def _text(value: Any) -> str:
    text = str(value)
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise ValueError(f"label {text!r:.60} holds characters that no text file can hold") from None
    return text


def _ids(
    curves: xr.Dataset,
    dims: tuple[str, ...],
    labels: Sequence[tuple[str, ...]],
    marks: str,
    chosen: Sequence[str] | None,
) -> tuple[str, ...]:
    """Return the chosen ids, else the dataset's own if there is one a component, else ids made of the labels.

    The dataset's own ids are kept where they are legal with `marks`; those of another program are made legal.
    """
    at = [k for k, dim in enumerate(dims) if dim != LIMIT_STATE]
    keys = [tuple(label[k] for k in at) for label in labels]
    components = list(dict.fromkeys(keys))
    if chosen is not None:
        by_key = dict(zip(components, check_ids(chosen, len(components), marks), strict=True))
        return tuple(by_key[key] for key in keys)
    of_components = [dims[k] for k in at]
    brought = _texts(curves, "id", dims)
    if brought is not None:
        own = dict(zip(keys, brought, strict=True)).values()
        if len(set(own)) == len(components) and all(is_id(one, OPENQUAKE_MARKS + TABLE_MARKS) for one in own):
            if all(is_id(one, marks) for one in own):
                return tuple(brought)
            keys, of_components = [(one,) for one in brought], []
    made = make_ids(list(dict.fromkeys(keys)), of_components)
    return tuple(made[key] for key in keys)
