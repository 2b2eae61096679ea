"""Plausibility of records: offsets, drifts and slips of units in files."""

import math
from bisect import bisect_left, insort
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, pairwise
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr

from ..core.aliases import Array, Index
from ..core.doubts import (
    HIGHEST_PGA,
    HIGHEST_RECORD,
    IMPOSSIBLE_PGA,
    Doubt,
    doubt_data,
    first_names,
    first_of,
)
from ..core.units import ACCELERATION, STANDARD_GRAVITY
from ..core.wording import short_digits, two_digit_percent, two_digits
from .arrays import Record, records
from .floors.histories import DIRECTIONS, FloorHistories
from .intensity.directions import PairMeasure
from .intensity.naming import measure_named
from .intensity.parametric_measures import Sa
from .intensity.peaks import peak_acceleration, peak_displacement, peak_velocity, velocity
from .readers.directions import LEFT_OUT, ON_PURPOSE

OFFSET = 0.01
"""Mean over PGA above which a record keeps an offset."""
STANDING = 0.9, 1.1
"""Mean in g of an upright sensor, which measures gravity."""
LONE, HELD = 3.0, 5
"""Ratio of a peak to all other samples that makes it a spike; number of equal neighbours that make a clipped peak."""
DOUBLED = 20
"""Changes of a record between pairs of equal samples from which no rounding explains them (assumed)."""
DRIFT = 0.1
"""Velocity at the end over PGV above which a record drifts."""
WANDERING = 0.25
"""PGD over PGV, as a share of the duration, above which a record wanders off."""
WEAK_MEDIAN, STRONG_MEDIAN, FEW = 0.02 * STANDARD_GRAVITY, 1.0 * STANDARD_GRAVITY, 3
"""m/s²: median PGA below which nothing overturns, and above which no set of `FEW` records or more is (assumed)."""
SHORTEST_PGV_PGA, LONGEST_PGV_PGA = 0.01, 0.8
"""PGV over PGA, s, of any ground motion."""
LONGEST = 900.0
"""Duration, s."""
UNLIKE = 5.0
"""Ratio of the PGAs of two horizontal components: recordings differ by 3 at most (assumed)."""
SIMULTANEOUS = 1.5
"""Time steps between the first samples of components up to which clocks of files may differ."""
ALIKE, WHOLE = 3e-5, 1e-3
"""Relative differences within rounding: of ratios of norms, and of factors from 1 or -1."""
SAME = 1.0 - 1e-6
"""Square of the correlation from which two motions are one: files print four digits or more."""
LEVEL = "the level"
LEVEL_APART, MOTION_APART = 1.5, 2.0
"""Factors between a level and its ground motions, in the mean and each, beyond which they are of another level."""
AS_LEVEL = 0.01
"""Relative difference of a motion from its level within which it is the ground motion that was scaled to it."""
GROUND_FLOOR = "0"
SLOW, LEAST_SLOW = Sa(10.0), 0.5
"""Measure of slow motion, which all buildings follow, and its ratio to the ground's below which they do not.

Relative accelerations have about (T/10 s)² of a building's or isolator's period T, absolute ones 1 and more.
"""
RINGING = 0.2
"""Share of its peak above which the last swing of a building is cut.

Generated motions that fade leave 0.09 to 0.24 in the median, for periods of 0.3 to 2 s.
"""
STIFFER = 1.1
"""Ratio of the stiffnesses of the highest and the lowest storey of no usual building (assumed)."""
STOREY_PERIODS = 0.02, 0.4
"""Period of a building over its storeys, s: stiff walls to soft frames."""


def usual() -> dict[str, tuple[float, float, str, str]]:
    """Return minimum, maximum, unit and likely slip of numbers by their names, from `doubts.toml`.

    They are numbers of buildings, supports, generators, inventories and study keys, and all are assumed. The largest
    Arias intensities of records are about 20 to 30 m/s, corners of their filters 0.05 to 1 Hz. Ground filters have
    damping ratios of 0.2 to 0.9 and 3 to 50 rad/s, paths have q0 of 50 to 1000 (recalled). Tall buildings are damped by
    0.003 and more (Satake et al. 2003, recalled), with dampers by up to 0.35. Isolators have 1 to 7 s and a strength or
    a friction of 0.01 to 0.2 of the weight (Constantinou et al. 2011, MCEER-11-0004, recalled).
    """
    return doubt_data()["usual"]


def _components(record: Record) -> list[Record]:
    """Return a record, its companion if it has one, and its vertical component if it acts."""
    further = {"other component": record.companion, "vertical component": record.vertical}
    return [
        record,
        *(
            record._replace(label=f"{record.label}, {name}", acceleration=values)
            for name, values in further.items()
            if values is not None
        ),
    ]


def vertical_doubts(arrays: Sequence[xr.DataArray], cure: str = ON_PURPOSE) -> list[Doubt]:
    """Return the note on omitted vertical components; `cure`: instruction for the caller to take them on purpose."""
    out = [str(name) for array in arrays for name in array.attrs.get(LEFT_OUT, ())]
    left_out = {"number": len(out), "named": first_names(out), "remedy": cure}
    return [Doubt.of("vertical_left_out", **left_out)] if out else []


def multiple(samples: Array, reference: Array) -> float:
    """Return the factor between samples and another motion, peak upon peak, NaN if they are not the same motion."""
    first, second = (int(np.abs(values).argmax()) for values in (samples, reference))
    before, after = min(first, second), min(samples.size - first, reference.size - second)
    samples, reference = samples[first - before : first + after], reference[second - before : second + after]
    product, square = float(samples @ reference), float(reference @ reference)
    return product / square if product**2 > SAME * square * float(samples @ samples) else math.nan


def pair_doubts(h1: Sequence[Record], h2: Sequence[Record], vertical: Sequence[Record] = ()) -> list[Doubt]:
    """Return the input warning on recorded components of different recordings: multiples, and another order of PGA."""
    odd = []
    for i, (along, across) in enumerate(zip(h1, h2, strict=True)):
        if not (along.recorded and across.recorded):
            continue
        peaks = [float(np.abs(record.acceleration).max()) / STANDARD_GRAVITY for record in (along, across)]
        if max(peaks) > UNLIKE * min(peaks):
            odd.append(f"{along.label} and {across.label}: a PGA of {' and '.join(map(two_digits, peaks))} g")
            continue
        for first, second in combinations((along, across, *vertical[i : i + 1]), 2):
            factor = multiple(first.acceleration, second.acceleration)
            if math.isfinite(factor):
                odd.append(f"{first.label} is {short_digits(factor)} times {second.label}")
    return [Doubt.of("pairs", number=len(odd), named=first_of(odd))] if odd else []


def history_doubts(histories: FloorHistories, im: str) -> list[Doubt]:
    """Return the input warnings on floor histories with levels in SI of a measure, '' without one.

    The ground is held against the levels, each floor against the next one, and each direction against the other.
    Without the ground, the lowest floor is held against levels of an acceleration.
    """
    doubts, floors = [], histories.floors
    both = [floor for floor in floors if len(histories.directions(floor)) > 1]
    across = [[record for floor in both for record in histories.on(floor, along)] for along in DIRECTIONS]
    doubts += pair_doubts(*across) if both else []
    late = []
    for (i, motion, floor, direction), history in histories.histories.items():
        other = histories.histories.get((i, motion, floor, DIRECTIONS[1]))
        if direction == DIRECTIONS[0] and other and abs(history.begins - other.begins) > SIMULTANEOUS * history.dt:
            late.append(f"{motion} on floor {floor}: {abs(history.begins - other.begins):g} s apart")
    doubts += [Doubt.of("pair_begins", named=first_of(late))] if late else []
    peaks: dict[str, list[float]] = {floor: [] for floor in floors}
    for (_, _, floor, _), history in histories.histories.items():
        peaks[floor].append(math.log(np.abs(history.acceleration).max()))
    measure = measure_named(im) if im else None
    plain = measure.base if isinstance(measure, PairMeasure) else measure
    means = {f"that of floor {floor}": np.mean(peaks[floor]) for floor in floors if floor.isdecimal()}
    if plain is not None and plain.units == ACCELERATION and GROUND_FLOOR not in floors:
        means = {LEVEL: np.mean(np.log(histories.levels)), **means}
    for (lower, below), (upper, above) in pairwise(means.items()):
        ratio = float(np.exp(above - below))
        # (at long periods, a spectral acceleration may be far below the PGA)
        most = UNLIKE if lower != LEVEL or (plain is not None and plain.label == "pga") else math.inf
        if not 1.0 / UNLIKE < ratio < most:
            floor = upper.removeprefix("that of ")
            doubts.append(Doubt.of("floors_unlike", upper=floor, ratio=two_digits(ratio), lower=lower))
    if GROUND_FLOOR in floors and not doubts:
        doubts += _relative_doubts(histories)
    if plain is None:
        return doubts

    def over_levels(floor: str) -> Array:
        along = [histories.on(floor, direction) for direction in histories.directions(floor)]
        values = np.array([[plain.of_record(record) for record in row] for row in along])
        # (direction, level, motion): the measure may be of either direction, or of both
        ratios: Array = values.reshape(len(along), histories.levels.size, -1) / histories.levels[:, None]
        return ratios

    held = {floor: over_levels(floor) for floor in floors if floor.isdecimal()}
    grounds = [floor for floor, ratios in held.items() if (np.abs(ratios - 1.0) < AS_LEVEL).all(axis=(1, 2)).any()]
    if grounds and GROUND_FLOOR not in grounds:
        return [*doubts, Doubt.of("floors_from_one", measure=plain.label, floor=grounds[0])]
    if GROUND_FLOOR not in held:
        return doubts
    ratios = held[GROUND_FLOOR]
    means = np.exp(np.log(ratios).mean(axis=2))
    off = (means.max(axis=0) * LEVEL_APART < 1.0) | (means.min(axis=0) > LEVEL_APART)
    off |= (ratios.max(axis=0) * MOTION_APART < 1.0).any(axis=1) | (ratios.min(axis=0) > MOTION_APART).any(axis=1)
    if off.any():
        i = int(np.argmax(off))
        ends = {"least": two_digits(float(ratios[:, i].min())), "most": two_digits(float(ratios[:, i].max()))}
        levels = {"number": int(off.sum()), "level": histories.texts[i], **ends}
        doubts.append(Doubt.of("floors_of_other_levels", measure=plain.label, **levels))
    return doubts


def _relative_doubts(histories: FloorHistories) -> list[Doubt]:
    """Return the input warning on floors that do not follow slow motion of floor 0, as relative accelerations."""
    slow: dict[tuple[str, str], Array] = {}
    for floor, direction in histories.supports:
        of_level = histories.on(floor, direction)[: histories.motions]
        slow[floor, direction] = np.array([SLOW.of_record(record) for record in of_level])
    for (floor, direction), values in slow.items():
        ground = slow.get((GROUND_FLOOR, direction), np.zeros(1))
        if ground.all() and (share := float(np.median(values / ground))) < LEAST_SLOW:
            return [Doubt.of("floors_relative", measure=SLOW.label, floor=floor, share=two_digits(share))]
    return []


def _copies(plain: Iterable[Record]) -> list[str]:
    """Return the records that are multiples of others; of floor histories, which levels scale, times 1 or -1."""
    known: dict[float, list[tuple[float, Record, Array]]] = {}
    copies = []
    for record in plain:
        if not record.recorded or record.reverse_of:
            continue
        for part in _components(record):
            samples = part.acceleration
            if not samples.any():
                continue
            group = known.setdefault(record.dt, [])
            # (multiples share the ratio of two norms: few of equal ratio are multiplied with each other)
            shape = float(np.abs(samples).sum() / math.sqrt(samples @ samples))
            low, high = (bisect_left(group, shape * (1.0 + end * ALIKE), key=itemgetter(0)) for end in (-1.0, 1.0))
            for _, original, reference in group[low:high]:
                factor = 0.0 if original is record else multiple(samples, reference)
                if abs(factor) > 0.0 and (not record.floor or abs(abs(factor) - 1.0) < WHOLE):
                    times = "" if abs(factor - 1.0) < WHOLE else f" times {short_digits(factor)}"
                    copies.append(f"{part.label}: those of {original.label}{times}")
                    break
            else:
                insort(group, (shape, record, samples), key=itemgetter(0))
                continue
            break
    return copies


def _strength_doubts(plain: Sequence[Record]) -> list[Doubt]:
    """Return the input warning on the median PGA of ground motions whose amplitude is their own."""
    ground = [record for record in plain if record.own_amplitude and not record.floor and not record.reverse_of]
    peaks = [peak for record in ground if (peak := peak_acceleration(record.acceleration, record.dt)) > 0.0]
    median = float(np.median(peaks)) if peaks else math.nan
    recorded = any(record.recorded for record in ground)
    strong = recorded and len(peaks) >= FEW and median > STRONG_MEDIAN
    if not strong and not median < WEAK_MEDIAN:
        return []
    what = "records_strong" if strong else "records_weak" if recorded else "motions_weak"
    return [Doubt.of(what, median=two_digits(median / STANDARD_GRAVITY), number=len(peaks))]


def record_doubts(plain: Iterable[Record], own_level: bool = True) -> list[Doubt]:
    """Return the input warnings on records: offsets, drifts, and amplitudes and durations beyond any recording.

    The median PGA of all is checked unless the motions have the strength of a given level (not `own_level`).
    Only PGA and duration of generated motions are checked, and nothing of floor motions. A zero motion, and one that is
    all offset, has no drift of its own. Baseline and filters are no cure for motions that all have them already.
    Maximum accelerations: Anderson, J. G. (2010). Bulletin of the Seismological Society of America 100(1), 1-36.
    """
    plain = list(plain)
    looked_at = [record for record in plain if record.recorded or not (record.floor or record.own_level)]
    read = [component for record in looked_at for component in _components(record)]
    uncorrected: set[str] = set()
    odd: dict[str, list[str]] = defaultdict(list)
    copies = {floor: _copies([record for record in plain if bool(record.floor) == floor]) for floor in (False, True)}
    greatest = 0.0
    strong = "record_strong" if any(record.recorded for record in read) else "motion_strong"

    def keep(name: str, record: Record, what: str) -> None:
        odd[name].append(f"{record.label}: {what}")
        if not record.corrected:
            uncorrected.add(name)

    for record in read:
        pga = peak_acceleration(record.acceleration, record.dt)
        if pga == 0.0:
            continue
        greatest = max(greatest, pga)
        odd["record_named_upright"] += [record.label] * record.upright
        reached = f"{record.label}: {short_digits(pga / STANDARD_GRAVITY)} g"
        if pga > (HIGHEST_RECORD if record.recorded and not record.floor else HIGHEST_PGA):
            odd[strong].append(reached)
        if record.duration > LONGEST:
            odd["record_long"].append(f"{record.label}: {short_digits(record.duration)} s")
        if not record.recorded:
            continue
        pgv = peak_velocity(record.acceleration, record.dt)
        size = np.abs(record.acceleration)
        if size.size > 1 and pga > LONE * np.partition(size, -2)[-2]:
            odd["record_lone"].append(reached)
        flat = np.diff(record.acceleration) == 0.0
        if np.count_nonzero(flat[1:] & flat[:-1] & (size[1:-1] == pga)) >= HELD:
            odd["record_held"].append(reached)
        first, second = record.acceleration[:-1:2], record.acceleration[1::2]
        if (first == second).all() and np.count_nonzero(np.diff(first)) > DOUBLED:
            odd["record_doubled"].append(record.label)
        mean = abs(float(record.acceleration.mean())) / pga
        upright = STANDING[0] < mean * pga / STANDARD_GRAVITY < STANDING[1]
        if not upright and np.ptp(np.sign(record.acceleration)) < 2.0:
            odd["record_one_sign"].append(reached)
        elif upright:
            odd["record_upright"].append(f"{record.label}: {short_digits(mean * pga / STANDARD_GRAVITY)} g")
        elif mean > OFFSET:
            keep("record_offset", record, f"its mean is {two_digit_percent(mean)} of its PGA")
        left = abs(float(velocity(record.acceleration, record.dt)[-1])) / pgv
        if left > DRIFT:
            keep("record_drift", record, f"{two_digit_percent(left)} of its PGV is left at its end")
        pgd = peak_displacement(record.acceleration, record.dt)
        if pgd > WANDERING * record.duration * pgv:
            keep("record_wandering", record, f"PGD {short_digits(pgd)} m with PGV {short_digits(pgv)} m/s")
        if max(mean / OFFSET, left / DRIFT) <= 1.0 and not SHORTEST_PGV_PGA <= pgv / pga <= LONGEST_PGV_PGA:
            odd["record_ratio"].append(f"{record.label}: {short_digits(pgv / pga)} s")
    doubts: list[Doubt] = []
    for what, alike in (("copies_of_records", copies[False]), ("copies_of_floors", copies[True])):
        if alike:
            doubts.append(Doubt.of(what, number=len(alike), named=first_of(alike)))
    floors = any(record.floor for record in read)  # (a study corrects records alone)
    highest = HIGHEST_RECORD if any(record.recorded and not record.floor for record in read) else HIGHEST_PGA
    bounds = {"highest": highest / STANDARD_GRAVITY, "shortest": SHORTEST_PGV_PGA, "longest": LONGEST_PGV_PGA}
    cures = {"record_offset": "offset", "record_drift": "drift", "record_wandering": "drift"}
    for name in (
        *("record_named_upright", "record_upright", "record_one_sign", "record_lone", "record_held", "record_doubled"),
        *(*cures, strong, "record_ratio", "record_long"),
    ):
        if names := odd[name]:
            of = "the record" if len(read) == 1 else f"{len(names):,} of {len(read):,} records"
            cure = cures.get(name, "")
            if cure and (floors or name not in uncorrected):
                cure = "floors" if name in uncorrected else "corrected"
            grave = name == strong and greatest > IMPOSSIBLE_PGA
            values = {"number": len(names), "of": of, "named": first_of(names), "duration": LONGEST, **bounds}
            doubts.append(Doubt.of(name, grave, cure, **values))
    if own_level and not odd[strong]:
        doubts += _strength_doubts(plain)
    return doubts


def collapse_doubts(labels: Sequence[str], collapsed: Index, factor: float = 1.0) -> list[Doubt]:
    """Return the input warning on a building that collapses under scaled motions: its storey (motion,), 0 for none."""
    fallen = [label for label, storey in zip(labels, collapsed, strict=True) if storey]
    if not fallen:
        return []
    times = f"times {factor:g}: " if factor != 1.0 else ""
    counts = {"fallen": len(fallen), "total": len(labels)}
    return [Doubt.of("collapse", times=times, named=first_names(fallen), **counts)]


def scaling_doubts(
    given: Iterable[xr.DataArray], scaled: Iterable[xr.DataArray], bounds: tuple[float, float]
) -> list[Doubt]:
    """Return the input warning on motions with their own amplitude that are scaled by less or more than the bounds."""
    before = [record for array in given for record in records(array)]
    after = [record for array in scaled for record in records(array)]
    factors = {
        original.label: float(np.abs(result.acceleration).max() / np.abs(original.acceleration).max())
        for original, result in zip(before, after, strict=True)
        if original.own_amplitude
    }
    far = [label for label, factor in factors.items() if not bounds[0] <= factor <= bounds[1]]
    if not far:
        return []
    low, high = (two_digits(end(factors.values())) for end in (min, max))
    counts = {"far": len(far), "total": len(before)}
    return [Doubt.of("scaling", bounds=bounds, named=first_names(far), low=low, high=high, **counts)]


def generator_doubts(generator: object) -> list[Doubt]:
    """Return the input warnings on the parameters of a generator of motions, by their names in `usual`."""
    given = {name: getattr(generator, name, None) for name in usual()}
    numbers = {name: value for name, value in given.items() if value is not None and not callable(value)}
    return unusual(numbers, "units")


def unusual(values: Mapping[str, Any], kind: str = "building") -> list[Doubt]:
    """Return the input warnings on numbers outside of their `usual` range; 0 and infinity mean absence."""
    doubts = []
    for what, given in values.items():
        least, most, unit, slip = usual()[what]
        for value in np.unique(np.asarray(given)).tolist():
            if 0.0 < abs(value) < np.inf and not least <= abs(value) <= most:
                row = {"what": what, "value": value, "unit": f" {unit}" if unit else "", "slip": slip}
                doubts.append(Doubt.of("unusual", least=least, most=most, **row)._replace(kind=kind))
    return doubts


def building_doubts(period: float, damping: Any, heights: Array) -> list[Doubt]:
    """Return the input warnings on a building: its period (s) for its storeys, its damping, its floor heights (m).

    A period up to 1 s may be of any low building.
    """
    storeys, (least, most) = heights.size - 1, STOREY_PERIODS
    rises, doubts = np.diff(heights), unusual({"damping of a building": damping})
    typical = unusual({"storey height": np.median(rises)}) if storeys > 1 else []
    doubts += typical or unusual({"height of one storey": rises})
    if not storeys * least <= period <= max(storeys * most, 1.0):
        row = {"storeys": storeys, "period": period, "each": period / storeys, "least": least, "most": most}
        doubts.append(Doubt.of("building_period", **row))
    return doubts


def storey_doubts(masses: Array, stiffnesses: Array) -> list[Doubt]:
    """Return the input warning on storeys that are lighter and softer at the ground than at the roof."""
    if masses[0] >= masses[-1] or stiffnesses[-1] <= STIFFER * stiffnesses[0] or (np.diff(stiffnesses) < 0.0).any():
        return []
    return [Doubt.of("storeys")]


def strength_doubts(coefficients: Array) -> list[Doubt]:
    """Return the input warning on storeys, more than two, of which each is stronger than the storey below."""
    if coefficients.size < 3 or (np.diff(coefficients) <= 0.0).any():
        return []
    return [Doubt.of("storey_strengths", given=", ".join(map(short_digits, coefficients.tolist())))]


def ringing_doubts(floor_motions: Iterable[xr.DataArray]) -> list[Doubt]:
    """Return the input warning on floor motions (their coordinate ``ringing``) that end while the building moves."""
    every, cut = 0, []
    for array in floor_motions:
        top = array["floor"].values[int(np.argmax(array["height"].values))]
        every += array.sizes["motion"]
        for label, share in zip(array["motion"].values, array["ringing"].values, strict=True):
            if share > RINGING:
                cut.append(f"{label}: {two_digit_percent(float(share))} of its peak on floor {top}")
    of = f"{len(cut):,} of {every:,} motions" if every > 1 else "the motion"
    return [Doubt.of("ringing", number=len(cut), of=of, named=first_names(cut))] if cut else []
