"""The labelled array of motions, and its plain records.

An array has the name ``acceleration`` and the dims (motion, time), with ``floor`` in floor histories; its values are in
m/s² and linear between samples.  Several arrays with their own steps and lengths form one set of motions: nothing is
resampled or padded.
"""

import hashlib
import math
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ..core import checks
from ..core.aliases import Array, Flags
from ..core.doubts import Doubt, warn
from ..core.labelled import spare_dask
from ..core.parameters import STEP
from ..core.units import ACCELERATION, METRE, RADIAN, SECOND, described
from .readers.directions import are_vertical
from .readers.units import in_name, quantities

spare_dask()

RECORDED = described("whether the motion was read from a file, and not generated")
OWN_AMPLITUDE = described("whether the amplitude is the motion's own and no parameter")
AS_GIVEN = described("motion as given")
RECORD, POLARITY = "record", "polarity"
"""Coordinates of runs: the label of the motion as given, and the sign with which it is run."""
DRAW = "draw"
"""Coordinate of runs of which several are of one motion: the number of each among them."""
REVERSE_OF = "reverse_of"
"""Coordinate of motions that are run both ways: the label of the motion that each reverses (`motions.polarity`)."""

TAKEN = {
    "unit_from": "unit of the values in the file, with its source",
    "dt_from": "source of the time step",
    "azimuth_from": "source of the azimuth",
}
"""Coordinates of motions from files: values that a reader takes, with their sources."""

BEGINS = "begins"
"""Coordinate of motions from files: the time of the first sample, s, by the clock of the file."""
TRANSPOSED = 10
"""Motions over samples, above which an array is likely transposed."""
SHORT_STEP, LONG_STEP = 1e-4, 1.0
"""Time steps, s, below which it is no step of a record, and from which it is none of a motion."""
FEW = 10
"""Samples up to which rows that rise by equal steps need not be times."""


class Record(NamedTuple):
    """One motion as plain numbers: label, acceleration (n,) in m/s², step in s, source, and floor ('' for none).

    `own_amplitude` is True if the amplitude is a property of the motion, as of a record or a scenario, so that scaling
    changes its meaning. It is False if the amplitude is a parameter, as in filtered noise, pulses and motions of a
    target spectrum. `recorded` is True for motions read from a file, which may have offsets, drifts and slips of units
    (`toppling.motions.plausibility`). `companion` (n,) is the other horizontal component, if it is known. `vertical`
    (n,) is the vertical component (upward), if the motion has one: one factor scales both. `corrected` is True if a
    baseline was subtracted or a high-pass filter applied. `reverse_of` is the label of the motion that this one
    reverses, '' for a motion as given.

    `axes` is `BOTH_AXES` if the companion also acts, along the depth of the blocks. It is `WEAK_AXIS` if blocks must be
    long enough that it need not act, and '' for one component. `azimuth` is the direction of the blocks' width, rad, in
    the first two cases. `own_level` is True for motions from yielding floors or isolators: their ground motion has one
    amplitude, and no factor scales them to another. `upright` is True for a vertical component, by its file.
    """

    label: str
    acceleration: Array
    dt: float
    source: str
    floor: str = ""
    own_amplitude: bool = True
    recorded: bool = False
    companion: Array | None = None
    corrected: bool = False
    reverse_of: str = ""
    vertical: Array | None = None
    axes: str = ""
    azimuth: float = math.nan
    own_level: bool = False
    upright: bool = False

    @property
    def given(self) -> str:
        """Label of the motion as given, which its reverse shares."""
        return self.reverse_of or self.label

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return (self.acceleration.size - 1) * self.dt


def digest(record: Record) -> str:
    """Return a hash of step and samples: two records with equal hashes are the same to the last bit."""
    sha = hashlib.sha256(record.dt.hex().encode())
    for name, values in ((b"", record.acceleration), (b"", record.companion), (b"vertical", record.vertical)):
        if values is not None:
            sha.update(name)
            sha.update(np.ascontiguousarray(values).data)
    return sha.hexdigest()


def from_array(
    acceleration: Any,
    dt: float,
    labels: Sequence[str] | None = None,
    source: str | Sequence[str] = "array",
    own_amplitude: bool = True,
    recorded: bool = False,
) -> xr.DataArray:
    """Return plain numbers as labelled motions.

    Parameters
    ----------
    acceleration : array_like, shape (time,) or (motion, time)
        Floor acceleration, m/s², assumed to be linear between samples; at least two samples, all finite.
    dt : float
        Time step, s, > 0.
    labels : sequence of str, optional
        One unique label for each motion; ``motion 1``, ``motion 2`` … if not given.
    source : str or sequence of str
        Source of the motions: one for all, or one for each.
    own_amplitude : bool
        True if the amplitude is a property of the motions, as of records and scenarios. False if it is a parameter that
        scaling replaces (noise, pulses, target spectra).
    recorded : bool
        True for records, whose offsets, drifts and slips of units are checked at their use.

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion, time), m s-2, with coordinates ``dt``, ``source``, ``own_amplitude`` and
        ``recorded`` on motion.

    Examples
    --------
    >>> from_array([0.0, 1.0, 0.0], dt=0.01).sizes["time"]
    3
    """
    step = STEP.number("dt", dt)
    if isinstance(acceleration, xr.DataArray):
        checks.stated_unit("acceleration", acceleration, "m s-2")
        if "time" in acceleration.dims:
            acceleration = acceleration.transpose(..., "time")
        if "time" in acceleration.indexes and acceleration.sizes["time"] > 1:
            checks.time_step("acceleration", acceleration["time"].values, step)
    axis = getattr(acceleration, "columns" if getattr(acceleration, "ndim", 1) == 2 else "index", None)  # (of pandas)
    axis = getattr(axis, "values", None)
    if isinstance(axis, np.ndarray) and axis.dtype.kind in "fmM" and axis.size > 1:
        seconds = axis if axis.dtype.kind == "f" else (axis - axis[0]) / np.timedelta64(1, "s")
        checks.time_step("acceleration", seconds, step)
    attributes = getattr(acceleration, "attrs", None) or {}
    for text in map(str, (getattr(acceleration, "name", None), attributes.get("standard_name"))):
        named, units = quantities(text), [] if attributes.get("units") else in_name(text, 0)
        scaled = any(unit.quantity == "acceleration" and unit.factor != 1.0 for unit in units)
        if scaled or (named and "acceleration" not in named):
            raise ValueError(f"acceleration must be acceleration in m s-2, got values of the name {text!r:.40}")
    values = np.atleast_2d(checks.acceleration("acceleration", acceleration, ndim=(1, 2)))
    if values.shape[1] < 2:
        raise ValueError(f"acceleration must have at least 2 samples, got {values.shape[1]}")
    n = values.shape[0]
    if n > TRANSPOSED * values.shape[1]:
        warn([Doubt.of("motions_transposed", motions=n, samples=values.shape[1])])
    for i, row in enumerate(values if n > 1 and values.shape[1] > FEW else ()):
        if row[0] < row[1] < row[-1] and np.ptp(rises := np.diff(row)) <= checks.UNIFORMITY * rises[0]:
            warn([Doubt.of("motion_of_times", row=i, rise=rises[0])])
    checks.flag("recorded", recorded)
    if step >= LONG_STEP or (recorded and step < SHORT_STEP):
        warn([Doubt.of("time_step", step=step)])
    if labels is None:
        labels = [f"motion {i + 1}" for i in range(n)]
    names: list[Any] = list(labels) if checks.is_several(labels) and not isinstance(labels, str) else [labels]
    if len(names) != n or not all(isinstance(name, str) and name for name in names):
        raise ValueError(f"labels must be {n} non-empty strings, one a motion, got {checks.shown(names)}")
    if len(set(names)) != n:
        raise ValueError(f"labels must be unique, got {_first_repeated(names)!r:.60} more than once")
    sources = list(source) if checks.is_several(source) and not isinstance(source, str) else [source] * n
    if len(sources) != n or not all(isinstance(name, str) for name in sources):
        raise ValueError(f"source must be one string or {n}, one a motion, got {checks.shown(source)}")
    for name, flag in (("own_amplitude", own_amplitude), ("recorded", recorded)):
        checks.flag(name, flag)
    return xr.DataArray(
        values,
        dims=("motion", "time"),
        coords={
            "motion": ("motion", np.array(names, dtype=object), described("motion")),
            "time": ("time", np.arange(values.shape[1]) * step, described("time", SECOND)),
            "dt": ("motion", np.full(n, step), described("time step", SECOND)),
            "source": ("motion", np.array(sources, dtype=object), described("source of the motion")),
            "own_amplitude": ("motion", np.full(n, own_amplitude), OWN_AMPLITUDE),
            "recorded": ("motion", np.full(n, recorded), RECORDED),
        },
        name="acceleration",
        attrs={"units": ACCELERATION, "long_name": "floor acceleration", "standard_name": "acceleration"},
    )


def listed(motions: Any) -> list[Any]:
    """Return one motion, or an object that cannot be iterated, as a list of one, and several as a list."""
    several = checks.is_several(motions) and not isinstance(motions, xr.DataArray)
    return list(motions) if several and getattr(motions, "ndim", 1) > 0 else [motions]


def records(motions: xr.DataArray | Iterable[xr.DataArray]) -> list[Record]:
    """Return the plain records of one labelled array or a sequence of them, in order; a ``floor`` dimension is stacked.

    Raises
    ------
    TypeError
        An argument that is no labelled acceleration array.
    ValueError
        No motion, a label used twice, units other than m s-2, a time axis that is not uniform or does not agree with
        dt, NaN or infinity.
    """
    plain: list[Record] = []
    for array in listed(motions):
        if not isinstance(array, xr.DataArray):
            raise TypeError(
                f"motions must be labelled arrays as toppling.motions makes them (numbers: motions.from_array), "
                f"got {checks.kind(array)}"
            )
        checks.plain("motions", array)
        plain.extend(_records_of(array))
    if not plain:
        raise ValueError("motions must hold at least one motion, got none")
    names = [record.label for record in plain]
    if len(set(names)) != len(names):
        raise ValueError(
            f"motions must have unique labels, got {_first_repeated(names)!r:.60} more than once: give one set other "
            "labels"
        )
    return plain


HORIZONTAL = ("h1", "h2")
VERTICAL = "v"
BOTH_AXES, WEAK_AXIS = "both axes", "weak axis"
"""Values of the coordinate `shakes` of pairs whose h1 is along the width of the blocks and h2 along their depth."""
LIFTS = "lifts"
"""Coordinate of joined components: True if the vertical one acts, too."""
DOWNWARD = "downward_acceleration"
"""Coordinate of runs with a vertical component: the maximum downward acceleration of each motion."""
BASELINES = ("baseline(", "highpass(", "bandpass(")
"""Corrections, as the attribute `processing` lists them, that remove offsets and drifts."""
LONGEST_TAPER = 0.15
"""Share of a record, at either end, that a usual taper does not exceed (assumed)."""
HIGHEST_HIGHPASS, LOWEST_LOWPASS = 1.0, 5.0
"""Corners of filters, Hz: slower motions overturn blocks, and beyond records keep most of their PGA."""
OWN_LEVEL = "own_level"
"""Coordinate of motions that belong to the level at which they were made, such as motions of yielding floors and
isolators.
"""
OF_OWN_LEVEL = described("belongs to the strength of its ground motion, and must not be scaled")
_RECORD_COORDINATES = ("motion", "source", "dt", "own_amplitude", "recorded", "time", REVERSE_OF, OWN_LEVEL)


def filter_doubts(arrays: Iterable[xr.DataArray]) -> list[Doubt]:
    """Return the input warning on filters of motions, by their ``processing``, that leave little of an earthquake."""
    arrays = list(arrays)
    notes = " ".join(str(array.attrs.get("processing", "")) for array in arrays)
    below = [low for low in map(float, re.findall(r"pass\(low=(\S+) Hz", notes)) if low > HIGHEST_HIGHPASS]
    above = [high for high in map(float, re.findall(r"pass\(.{0,40}?high=(\S+) Hz", notes)) if high < LOWEST_LOWPASS]
    nyquist = [0.5 / step for step in map(float, re.findall(r"resample\(dt=(\S+) s", notes))]
    above += [frequency for frequency in nyquist if frequency < LOWEST_LOWPASS]
    doubts = []
    for array in arrays:
        tapered = [
            float(text) for text in re.findall(r"taper\(duration=(\S+) s", str(array.attrs.get("processing", "")))
        ]
        length = (
            array.sizes.get("time", 0) * float(np.min(array["dt"].values)) if tapered and "dt" in array.coords else 0.0
        )
        if length and max(tapered) > LONGEST_TAPER * length:
            doubts.append(Doubt.of("taper", taper=max(tapered), duration=length))
    if below:
        doubts.append(Doubt.of("highpass", corner=max(below), usual=HIGHEST_HIGHPASS))
    if above:
        doubts.append(Doubt.of("lowpass", corner=min(above), usual=LOWEST_LOWPASS))
    return doubts


def _records_of(array: xr.DataArray) -> list[Record]:
    if array.ndim == 1 and array.dims == ("time",):
        array = array.expand_dims("motion")
    if "component" in array.dims:
        return _records_of_pairs(array)
    if "time" not in array.dims or "motion" not in array.dims or not set(array.dims) <= {"motion", "floor", "time"}:
        raise ValueError(f"motions must have dims (motion, time) or (motion, floor, time), got {array.dims}")
    checks.stated_unit("motions", array, "m s-2")
    if "floor" in array.dims:
        array = array.transpose("motion", "floor", "time")
        floors = [str(f) for f in array["floor"].values] if "floor" in array.coords else None
        pieces = [(array.isel(floor=i), floors[i] if floors else str(i)) for i in range(array.sizes["floor"])]
    else:
        pieces = [(array.transpose("motion", "time"), "")]
    n = array.sizes["motion"]
    corrected = any(name in str(array.attrs.get("processing", "")) for name in BASELINES)
    columns = [{name: _values_by_motion(piece, name, n) for name in _RECORD_COORDINATES} for piece, _ in pieces]
    waves = [piece.values for piece, _ in pieces]
    upright = are_vertical(array)
    unpacked = []
    # (motions share their time axis, which is checked once)
    steps: dict[tuple[int, float | None], float] = {}
    for i in range(n):
        for (_, floor), column, wave in zip(pieces, columns, waves, strict=True):
            coordinates = {name: values[i] for name, values in column.items() if values is not None}
            label = str(coordinates.get("motion", f"motion {i + 1}"))
            values = checks.acceleration(f"motion {label!r}", wave[i])
            if values.size < 2:
                raise ValueError(f"motion {label!r} must have at least 2 samples, got {values.size}")
            time, step = coordinates.get("time"), float(coordinates["dt"]) if "dt" in coordinates else None
            if (id(time), step) not in steps:
                steps[id(time), step] = checks.time_step(f"motion {label!r}", time, step)
            dt = steps[id(time), step]
            own_amplitude = bool(coordinates.get("own_amplitude", True))
            source = str(coordinates.get("source", "array"))
            read = bool(coordinates.get("recorded", False))
            reverse_of = str(coordinates.get(REVERSE_OF, ""))
            if floor:
                label, reverse_of = (name and f"{name} floor {floor}" for name in (label, reverse_of))
            plain = Record(label, values, dt, source, floor, own_amplitude, read, None, corrected, reverse_of)
            own_level = bool(coordinates.get(OWN_LEVEL, False))
            unpacked.append(plain._replace(own_level=own_level, upright=upright[i] and read and not floor))
    return unpacked


def _records_of_pairs(array: xr.DataArray) -> list[Record]:
    """Return the records of joined components: the acting one, with the other horizontal one as companion.

    With the vertical component, too, if the coordinate `LIFTS` is True.
    """
    shakes = shakes_of(array)
    if shakes not in (*HORIZONTAL, BOTH_AXES, WEAK_AXIS):
        raise ValueError(
            "motions with a component dimension must say which component shakes: motions.as_recorded(pair, 'h1'), "
            "motions.both_axes(pair), or pair.sel(component='h1') for that one alone"
        )
    ordered = sorted(HORIZONTAL, key=lambda name: name != shakes)  # (the one that shakes first)
    first, second = (_records_of(array.sel(component=name, drop=True)) for name in ordered)
    pairs = [record._replace(companion=across.acceleration) for record, across in zip(first, second, strict=True)]
    if shakes not in HORIZONTAL:
        azimuths = array["azimuth"].sel(component=HORIZONTAL[0]).values
        directions = np.repeat(azimuths, len(pairs) // azimuths.size).tolist()  # (of each floor of a motion)
        pairs = [record._replace(axes=shakes, azimuth=angle) for record, angle in zip(pairs, directions, strict=True)]
    if not (LIFTS in array.coords and bool(array.coords[LIFTS])):
        return pairs
    upward = _records_of(array.sel(component=VERTICAL, drop=True))
    return [record._replace(vertical=lifting.acceleration) for record, lifting in zip(pairs, upward, strict=True)]


def shakes_of(array: xr.DataArray) -> str:
    """Return the axis or axes along which joined components act; '' if not stated."""
    return str(array.coords["shakes"].values) if "shakes" in array.coords else ""


def _values_by_motion(piece: xr.DataArray, name: str, n: int) -> Sequence[Any] | None:
    """Return a coordinate motion by motion, its value or, for time, its array; None if there is no such coordinate."""
    if name not in piece.coords:
        return None
    coordinate = piece.coords[name]
    if name != "time" and not {*coordinate.dims} <= {"motion"}:
        raise ValueError(f"{name} of motions must be on motion alone, got dims {coordinate.dims}")
    if name in ("time", "dt"):
        checks.stated_unit(f"{name} of motions", coordinate, "s")
    if "motion" not in coordinate.dims:
        return [coordinate.values[()]] * n
    return list(coordinate.transpose("motion", ...).values)


def motion_coordinates(plain: list[Record]) -> dict[str, xr.Variable]:
    """Return label, step, duration, source, own_amplitude (and floor, if there is one) of records, on ``motion``.

    If motions are run both ways, also ``record``, the label of the motion as given, and ``polarity``, 1 or -1. With
    vertical components, also ``downward_acceleration``, the maximum of each (m/s², of the motion as given).
    """

    def column(name: str, attributes: dict[str, str], kind: Any = None) -> xr.Variable:
        return xr.Variable("motion", np.array([getattr(record, name) for record in plain], dtype=kind), attributes)

    coordinates = {
        "motion": column("label", described("motion"), object),
        "dt": column("dt", described("time step", SECOND)),
        "duration": column("duration", described("duration", SECOND)),
        "source": column("source", described("source of the motion"), object),
        "own_amplitude": column("own_amplitude", OWN_AMPLITUDE),
    }
    if any(record.floor for record in plain):
        coordinates["floor"] = column("floor", described("floor"), object)
    if any(record.axes for record in plain):
        text = "azimuth of the blocks' width, clockwise from north"
        coordinates["azimuth"] = column("azimuth", described(text, RADIAN))
    if any(record.reverse_of for record in plain):
        coordinates[RECORD] = column("given", AS_GIVEN, object)
        coordinates[POLARITY] = polarity_coordinate(np.array([bool(record.reverse_of) for record in plain]))
    if any(record.vertical is not None for record in plain):
        down = [0.0 if record.vertical is None else -float(record.vertical.min()) for record in plain]
        text = "greatest downward acceleration of the vertical component"
        coordinates[DOWNWARD] = xr.Variable("motion", down, described(text, ACCELERATION))
    return coordinates


def other_coordinates(arrays: Sequence[xr.DataArray]) -> dict[str, xr.Variable]:
    """Return further coordinates of each motion, such as its magnitude and its station, on ``motion``.

    The motions are in the order of `records`. Of arrays without a coordinate it is NaN, or '' if it is a text.
    ValueError if its unit differs between arrays.
    """
    excluded = (*_RECORD_COORDINATES, *TAKEN, BEGINS, "floor", LIFTS, "shakes")
    coordinates = [
        {str(key): known for key, known in array.coords.items() if key not in excluded and {*known.dims} <= {"motion"}}
        for array in arrays
    ]
    further = {}
    for name in dict.fromkeys(key for known in coordinates for key in known):
        having = [known[name] for known in coordinates if name in known]
        units = sorted({str(values.attrs.get("units", "")) for values in having})
        if len(units) > 1:
            raise ValueError(f"motions: {name} must have one unit in all arrays, got {units[0]!r} and {units[1]!r}")
        text = any(values.dtype.kind in "OSU" for values in having)
        missing = np.array("NaT", having[0].dtype) if having[0].dtype.kind in "mM" else math.nan
        columns = []
        for array, known in zip(arrays, coordinates, strict=True):
            n, floors = array.sizes.get("motion", 1), array.sizes.get("floor", 1)
            values = np.broadcast_to(known[name].values if name in known else missing, n)
            if text:
                whole = xr.DataArray(values.astype(object)).fillna("")
                values = np.array([str(value) for value in whole.values], dtype=object)
            columns.append(np.repeat(values, floors))
        further[name] = xr.Variable("motion", np.concatenate(columns), having[0].attrs)
    return further


def polarity_coordinate(reversed_ones: Flags) -> xr.Variable:
    """Return the polarity of motions (motion,): 1 as given, -1 for those that are reverses."""
    signs = np.where(reversed_ones, -1, 1).astype(np.int8)
    return xr.Variable("motion", signs, described("1 for a motion as given, -1 for its reverse"))


def floor_coordinates(floors: Sequence[Any], heights: Array | None = None) -> dict[str, xr.Variable]:
    """Return labels of floors, and their heights (m) if known, as variables on ``floor``."""
    whole = all(isinstance(floor, int) for floor in floors)
    labels = np.array(list(floors), dtype=np.int64 if whole else object)
    text = "floor, 0 is the ground" if whole else "floor"
    coordinates = {"floor": xr.Variable("floor", labels, described(text))}
    if heights is not None:
        coordinates["height"] = xr.Variable("floor", heights, described("height above the ground", METRE))
    return coordinates


def floor_array(
    values: Array,
    dt: float,
    labels: Sequence[str],
    sources: Sequence[str],
    floors: Sequence[Any],
    heights: Array | None = None,
    own_amplitude: Sequence[bool] | None = None,
) -> xr.DataArray:
    """Return floor histories (motion, floor, time), m/s², as the labelled array that `records` takes."""
    time = np.arange(values.shape[2]) * dt
    amplitudes = [True] * len(labels) if own_amplitude is None else list(own_amplitude)
    return xr.DataArray(
        values,
        dims=("motion", "floor", "time"),
        coords={
            "motion": ("motion", np.array(labels, dtype=object), described("motion")),
            **floor_coordinates(floors, heights),
            "time": ("time", time, described("time", SECOND)),
            "dt": ("motion", np.full(len(labels), dt), described("time step", SECOND)),
            "source": ("motion", np.array(sources, dtype=object), described("source of the motion")),
            "own_amplitude": ("motion", np.array(amplitudes), OWN_AMPLITUDE),
        },
        name="acceleration",
        attrs={"units": ACCELERATION, "long_name": "absolute floor acceleration", "standard_name": "acceleration"},
    )


def taken(array: xr.DataArray, units: Any, steps: Any) -> xr.DataArray:
    """Return motions with the sources of their units and time steps, for each motion or each of its floors."""
    dims = ("motion", "floor")[: np.ndim(units)]
    texts = np.array(units, dtype=object)
    sources = np.broadcast_to(np.array(steps, dtype=object), texts.shape)
    return array.assign_coords(
        unit_from=(dims, texts, described(TAKEN["unit_from"])), dt_from=(dims, sources, described(TAKEN["dt_from"]))
    )


def _first_repeated(names: Sequence[str]) -> str:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return ""
