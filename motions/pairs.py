"""Components of one recording: joined, found by the names of files and channels, rotated, and used as recorded."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..core import checks
from ..core.aliases import Array
from ..core.doubts import Doubt, first_of, warn
from ..core.streams import stream
from ..core.units import RADIAN, described
from .arrays import (
    BEGINS,
    BOTH_AXES,
    HORIZONTAL,
    LIFTS,
    TAKEN,
    VERTICAL,
    WEAK_AXIS,
    Record,
    from_array,
    listed,
    records,
)
from .plausibility import SIMULTANEOUS, pair_doubts
from .readers.directions import direction_of, header_of, of_file, said_of
from .readers.lines import RecordError

AZIMUTH = described("azimuth of the component, clockwise from north", RADIAN)
RANDOM = "random"
"""Azimuth that is drawn for each motion."""
ZERO = 1e-15
"""Cosines below this belong to right angles."""
PERPENDICULAR = math.radians(2.0)
"""Maximum deviation from a right angle of two horizontal components."""


class _Channel(NamedTuple):
    """One component that was read: its motion, name, recording and direction (`azimuth`: NaN if not known)."""

    motion: xr.DataArray
    name: str
    recording: str
    vertical: bool
    azimuth: float
    azimuth_from: str


def join(h1: xr.DataArray, h2: xr.DataArray, vertical: xr.DataArray | None = None) -> xr.DataArray:
    """Join the components of recordings, which begin at the same time.

    Parameters
    ----------
    h1, h2 : xarray.DataArray
        Two perpendicular horizontal components, (motion, time), m s-2; equally many motions, of the same recordings in
        the same order, with one step and length.
    vertical : xarray.DataArray, optional
        The vertical component, likewise.

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion, component, time), labelled as `h1`; ``component`` is h1, h2 (and v). ``azimuth`` (rad,
        on motion and component) is from the coordinates ``azimuth`` of `h1` and `h2`. Without them it is 0 and pi/2, so
        that directions count from h1 towards h2; NaN for v.

    Examples
    --------
    >>> from toppling import motions
    >>> east, north = (motions.CloughPenzien(duration=5.0).sample(1, seed=i) for i in (1, 2))
    >>> dict(motions.join(east, north).sizes)
    {'motion': 1, 'component': 2, 'time': 5246}
    """
    given = {"h1": h1, "h2": h2, **({} if vertical is None else {"v": vertical})}
    plains: list[list[Record]] = []
    for name, array in given.items():
        if not isinstance(array, xr.DataArray):
            raise TypeError(f"{name} must be labelled motions (numbers: motions.from_array), got {checks.kind(array)}")
        if set(array.dims) != {"motion", "time"}:
            raise ValueError(f"{name} must be motions with dims (motion, time), got {array.dims}")
        plains.append(records(array))
        first, plain = plains[0], plains[-1]
        if len(plain) != len(first):
            raise ValueError(f"{name} must hold as many motions as h1, {len(first)}, got {len(plain)}")
        alike = math.isclose(plain[0].dt, first[0].dt, rel_tol=1e-9)  # (a column of times rounds it)
        if not alike or plain[0].acceleration.size != first[0].acceleration.size:
            raise ValueError(
                f"{name} must have the step and length of h1, {first[0].acceleration.size} samples at "
                f"{first[0].dt:g} s, got {plain[0].acceleration.size} at {plain[0].dt:g} s: resample, trim or pad it "
                "first"
            )
    labels = [[record.label for record in plain] for plain in plains[:2]]
    if labels[0] != labels[1] and set(labels[0]) == set(labels[1]):
        raise ValueError("h2 must hold the motions of h1 in the same order, got theirs in another one")
    warn([*pair_doubts(*plains), *_header_doubts(h1, h2), *_late_doubts(list(given.values()))])
    azimuths = np.full((len(first), len(given)), np.nan)
    known = [component.coords["azimuth"].values if "azimuth" in component.coords else None for component in (h1, h2)]
    azimuths[:, 0] = 0.0 if known[0] is None or known[1] is None else known[0]
    azimuths[:, 1] = 0.5 * math.pi if known[0] is None or known[1] is None else known[1]
    off = np.abs(np.abs(np.sin(azimuths[:, 1] - azimuths[:, 0])) - 1.0)
    if not (off <= 1.0 - math.cos(PERPENDICULAR)).all():
        at = int(np.argmax(off))
        first_azimuth, second_azimuth = np.degrees(azimuths[at, :2])
        raise ValueError(f"h1 and h2 must be perpendicular, got azimuths of {first_azimuth:g}° and {second_azimuth:g}°")
    apart = {"component", "azimuth", BEGINS, *TAKEN}
    columns = [
        (name, [part.coords[name].values if name in part.coords else [""] * len(first) for part in given.values()])
        for name in TAKEN
        if name in h1.coords or name in h2.coords
    ]
    array = xr.DataArray(
        np.stack([component.transpose("motion", "time").values for component in given.values()], axis=1),
        dims=("motion", "component", "time"),
        coords={name: coordinate.variable for name, coordinate in h1.coords.items() if name not in apart},
        name=h1.name,
        attrs=h1.attrs,
    )
    names = np.array(list(given), dtype=object)
    array = array.assign_coords(
        component=("component", names, described("component of the recording")),
        azimuth=(("motion", "component"), azimuths, AZIMUTH),
    )
    return array.assign_coords(
        {name: (array["azimuth"].dims, np.array(texts, object).T, described(TAKEN[name])) for name, texts in columns}
    )


def _header_doubts(h1: xr.DataArray, h2: xr.DataArray) -> list[Doubt]:
    """Return the input warning on components whose files name different stations or events."""
    if "recorded" not in h1.coords or not h1["recorded"].any():
        return []
    odd = []
    for i, label in enumerate(h1["motion"].values):
        headers = [header_of(array.isel(motion=[i])) for array in (h1, h2)]
        if all(headers) and headers[0].casefold() != headers[1].casefold():
            odd.append(f"{label}: {headers[0]!r:.60} and {headers[1]!r:.60}")
    return [Doubt.of("pair_headers", named=first_of(odd))] if odd else []


def _late_doubts(components: Sequence[xr.DataArray]) -> list[Doubt]:
    """Return the input warning on components that begin at different times, by the clock of their files."""
    if not all(BEGINS in component.coords for component in components):
        return []
    spans = np.ptp([component[BEGINS].values + component["time"].values[0] for component in components], axis=0)
    late = np.flatnonzero(spans > SIMULTANEOUS * components[0]["dt"].values)
    named = (f"{components[0]['motion'].values[i]}: {spans[i]:g} s apart" for i in late)
    return [Doubt.of("pair_begins", named=first_of(list(named)))] if late.size else []


def rotate(pair: xr.DataArray, azimuth: float) -> xr.DataArray:
    """Return joined components turned in the horizontal plane: h1 in the direction `azimuth`, h2 a right angle further.

    Parameters
    ----------
    pair : xarray.DataArray
        As `join` returns it.
    azimuth : float
        Direction of the new h1, rad, clockwise from north (from h1 towards h2 if azimuths are not known).

    Notes
    -----
    With azimuths a1 and a2 of the components, the acceleration in a direction φ is h1 cos(φ - a1) + h2 cos(φ - a2).
    """
    _check_pair(pair)
    angle = _angle(azimuth)
    return _turned(pair, np.full(pair.sizes["motion"], angle))


def _angle(azimuth: float | str) -> float:
    angle = checks.number("azimuth", azimuth, unit="rad")
    if abs(angle) > 2.0 * math.pi:
        warn([Doubt.of("azimuth", angle=angle)])
    return angle


def _turned(pair: xr.DataArray, azimuths: Array) -> xr.DataArray:
    """Return joined components turned, each motion to its own azimuth (motion,) of h1, rad."""
    a1, a2 = (pair["azimuth"].sel(component=name).values[:, None] for name in HORIZONTAL)
    h1, h2 = (pair.sel(component=name).transpose("motion", "time").values for name in HORIZONTAL)
    values = pair.transpose("motion", "component", "time").values.copy()
    directions = pair["azimuth"].transpose("motion", "component").values.copy()
    places = [list(pair["component"].values).index(name) for name in HORIZONTAL]
    for place, direction in zip(places, (azimuths, azimuths + 0.5 * math.pi), strict=True):
        values[:, place] = h1 * _cosine(direction[:, None] - a1) + h2 * _cosine(direction[:, None] - a2)
        directions[:, place] = direction % (2.0 * math.pi)
    turned = pair.transpose("motion", "component", "time").copy(data=values)
    return turned.assign_coords(azimuth=(("motion", "component"), directions, AZIMUTH))


def _cosine(angles: Array) -> Array:
    """Return cosines, at right angles exactly 0: turned by one, components change places to the last bit."""
    cosines = np.cos(angles)
    return np.asarray(np.where(np.abs(cosines) < ZERO, 0.0, cosines))


def both_axes(
    pairs: xr.DataArray | Iterable[xr.DataArray],
    azimuth: float | str = 0.0,
    seed: int = 0,
    *,
    first: int = 0,
    vertical: bool = False,
) -> list[xr.DataArray]:
    """Return joined components that act on blocks along their width and their depth at the same time.

    An analysis runs each block about both axes under the same factor; it overturns if it does so about one of them.

    Parameters
    ----------
    pairs : xarray.DataArray or an iterable of them
        As `join` or `Generator.sample_pairs` return them.
    azimuth : float or "random"
        Direction of the blocks' width, rad, clockwise from north (from h1 towards h2 if azimuths are not known), or for
        each motion another one, uniform over all directions.
    seed, first : int
        Seed of random azimuths, and number of the first motion. The azimuth of motion number `index` is drawn from
        ``SeedSequence(seed, spawn_key=(index, 1))``; numbers continue from one array to the next.
    vertical : bool
        True if the vertical component acts, too, as for `as_recorded`.

    Returns
    -------
    list of xarray.DataArray
        The pairs turned as by `rotate`, h1 along the width and h2 along the depth, with the coordinate ``shakes``, for
        `toppling.ida`, `toppling.stripes` and `toppling.cloud`. Their levels are of measures of both components, such
        as ``RotD50(pga)``.

    Examples
    --------
    >>> from toppling import motions
    >>> pairs = motions.CloughPenzien(duration=5.0).sample_pairs(3)
    >>> (turned,) = motions.both_axes(pairs, "random")
    >>> str(turned["shakes"].values), dict(turned.sizes)
    ('both axes', {'motion': 3, 'component': 2, 'time': 5246})
    """
    return _along_blocks(pairs, azimuth, seed, first, vertical, BOTH_AXES)


def weak_axis(
    pairs: xr.DataArray | Iterable[xr.DataArray],
    azimuth: float | str = 0.0,
    seed: int = 0,
    *,
    first: int = 0,
    vertical: bool = False,
) -> list[xr.DataArray]:
    """Return joined components of which the one along the width of the blocks acts; arguments as `both_axes`.

    The analysis checks that this axis alone is enough: that the depth of every block is at least 1.6 times its width
    (`toppling.fragility.runs.axes`).
    """
    return _along_blocks(pairs, azimuth, seed, first, vertical, WEAK_AXIS)


def _along_blocks(
    pairs: xr.DataArray | Iterable[xr.DataArray],
    azimuth: float | str,
    seed: int,
    first: int,
    vertical: bool,
    shakes: str,
) -> list[xr.DataArray]:
    at_random = isinstance(azimuth, str) and azimuth == RANDOM
    angle = None if at_random else _angle(azimuth)
    number = checks.count("seed", seed)
    turned, index = [], checks.count("first", first)
    for pair in listed(pairs):
        shaken = as_recorded(pair, vertical=vertical)
        n = shaken.sizes["motion"]
        if angle is None:
            turns = [stream(number, index + i, 1).uniform(0.0, 2.0 * math.pi) for i in range(n)]
        else:
            turns = [angle] * n
        attributes = described("how the components shake")
        turned.append(_turned(shaken, np.array(turns)).assign_coords(shakes=((), shakes, attributes)))
        index += n
    return turned


def as_recorded(pair: xr.DataArray, component: str = "h1", vertical: bool = False) -> xr.DataArray:
    """Return joined components of which one acts on the blocks; measures such as ``RotD50(pga)`` are of both.

    Parameters
    ----------
    pair : xarray.DataArray
        As `join` returns it.
    component : str
        The acting component, h1 or h2.
    vertical : bool
        True if the vertical component acts, too, scaled as the horizontal one.

    Returns
    -------
    xarray.DataArray
        The pair with the coordinate ``shakes`` (and ``lifts``, if the vertical component shakes, too), for every
        analysis and for `toppling.motions.measures`.
    """
    _check_pair(pair)
    name = checks.choice("component", component, HORIZONTAL)
    checks.flag("vertical", vertical)
    if vertical and VERTICAL not in pair["component"].values:
        raise ValueError("vertical needs the vertical component of the recording: motions.join(h1, h2, vertical)")
    acting = {"shakes": ((), name, described("component that shakes"))}
    lifts = ((), True, described("whether the vertical component shakes, too"))
    return pair.drop_vars(LIFTS, errors="ignore").assign_coords({**acting, **({LIFTS: lifts} if vertical else {})})


def correct_together(pair: xr.DataArray, correction: Callable[[xr.DataArray], xr.DataArray]) -> xr.DataArray:
    """Return components as `join` gives them after a correction of their motions that keeps them simultaneous."""
    _check_pair(pair)
    if pair.sizes["motion"] != 1:
        raise ValueError(f"pair must be of one recording, got {pair.sizes['motion']}")
    pair = pair.transpose("motion", "component", "time")
    rows = from_array(pair.values[0], float(pair["dt"].values[0]), [str(value) for value in pair["component"].values])
    done = correction(rows.assign_attrs(pair.attrs))
    coordinates = {
        name: coordinate.variable for name, coordinate in pair.coords.items() if "time" not in coordinate.dims
    }
    return xr.DataArray(
        done.values[None],
        dims=("motion", "component", "time"),
        coords={**coordinates, "time": done["time"].variable},
        name=pair.name,
        attrs=done.attrs,
    )


def pair_up(read: Mapping[Path, Sequence[xr.DataArray]]) -> list[xr.DataArray]:
    """Return motions read from files, the components of each recording joined, in the order of their first files.

    Components of one recording are, first, the channels of one file. Second, files whose names differ in the direction
    alone. In K-NET and KiK-net it is ``.NS``, ``.EW``, ``.UD``, and a digit for the sensor. In the NGA databases it is
    an ending of the name (``…009`` and ``…279``, ``-N`` and ``-E``, ``-UP``). Third, files of the NGA databases with
    one record sequence number (``RSN953_…``), and files whose headers name one station and event. A direction in a
    header has priority over the direction in the name, except in the second line of AT2 files: a warning shows a
    difference. RecordError for one component alone, and for horizontal components that are more than two or not
    perpendicular.
    """
    recordings: dict[str, list[_Channel]] = {}
    for path, arrays in read.items():
        for channel in _channels(path, arrays):
            recordings.setdefault(channel.recording, []).append(channel)
    return [_joined(channels) for channels in recordings.values()]


def _check_pair(pair: xr.DataArray) -> None:
    if not isinstance(pair, xr.DataArray):
        raise TypeError(f"pair must be components as motions.join returns them, got {checks.kind(pair)}")
    if set(pair.dims) != {"motion", "component", "time"} or "azimuth" not in pair.coords:
        raise ValueError(f"pair must be components as motions.join returns them, got dims {pair.dims}")
    if pair.dtype.kind not in "iuf":
        raise TypeError(f"pair must hold numbers (in m/s²), got {pair.dtype}")
    missing = [name for name in HORIZONTAL if name not in pair["component"].values]
    if missing:
        raise ValueError(f"pair must have the components {' and '.join(HORIZONTAL)}, got none named {missing[0]}")


def _channels(path: Path, read: Sequence[xr.DataArray]) -> list[_Channel]:
    """Return the channels of a file, each with the recording that it belongs to."""
    arrays = [array.isel(motion=[i]) for array in read for i in range(array.sizes["motion"])]
    channels = []
    for array in arrays:
        if len(arrays) > 1:
            direction = said_of(array)
            vertical, azimuth = direction_of(direction) or (False, math.nan)
            channels.append(_Channel(array, f"{path.name} {direction}".strip(), str(path), vertical, azimuth, "header"))
            continue
        vertical, azimuth, source, recording = of_file(path, array)
        channels.append(_Channel(array, path.name, recording, vertical, azimuth, source))
    return channels


def _joined(channels: Sequence[_Channel]) -> xr.DataArray:
    """Return the joined components of one recording; RecordError if they are not two, or two and a vertical."""
    level = [channel for channel in channels if not channel.vertical]
    upright = [channel for channel in channels if channel.vertical]
    for some, most, what in ((level, 2, "horizontal"), (upright, 1, "vertical")):
        if len(some) > most:
            raise RecordError(
                f"{', '.join(channel.name for channel in some[: most + 1])}: are {len(some)} {what} components of one "
                "recording, by their names: join them with motions.join"
            )
    if len(level) < 2:
        raise RecordError(f"{channels[0].name}: has no second horizontal component among the files given")
    known = all(math.isfinite(channel.azimuth) for channel in level)
    motions = [
        channel.motion.assign_coords(azimuth_from=("motion", [channel.azimuth_from])) if known else channel.motion
        for channel in (*level, *upright)
    ]
    if known:
        azimuths = (("motion", [channel.azimuth], AZIMUTH) for channel in level)
        motions[:2] = [motion.assign_coords(azimuth=at) for motion, at in zip(motions[:2], azimuths, strict=True)]
    try:
        return join(*motions)
    except ValueError as error:
        raise RecordError(f"{level[0].name}, {level[1].name}: {error}") from None
