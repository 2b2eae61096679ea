"""The inputs of `toppling simulate`: block, law and motion from words of the command line; errors as one sentence."""

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import xarray as xr
from pydantic import ValidationError

from ... import motions as shaking
from ...core.parameters import declared
from ...core.units import ACCELERATION, METRE, SECOND, STIFFNESS
from ...core.wording import counted
from ...models import Block, Law
from ...models.scenes.restraint import KINDS
from ...motions.arrays import TAKEN, from_array, records, taken as taken_from
from ...motions.intensity.evaluation import positive_measure
from ...motions.matching.adjustment import REACHED
from ..file.blocks import FACTORS, MAKERS, PARTS as BLOCK_PARTS, SIZES, BlockTable
from ..file.derived import key_of
from ..file.models import Models, model_table
from ..file.motions import PROCESSING, Motions, motions_table
from ..file.refusals import refusal
from ..file.table import WRITTEN, bare, checked, nearest, quantity, suffix_of
from ..plan.reading import Taken
from ..text.error import StudyError

RECORD_KEYS = {"dt_s", "unit", *PROCESSING}
"""Keys of ``[motions]`` for record files: data that a file may lack, and corrections."""
NAMES = (*shaking.GENERATORS, *shaking.PULSES)
LARGEST = 10.0
"""Size, m, above which a number must have a unit: no furniture is so large, so cm or mm is meant."""
Built = TypeVar("Built")


class _Word(NamedTuple):
    """Key of a study file for a word of the command line: its SI unit, one of the key's units in it, a minimum."""

    key: str
    units: str
    factor: float = 1.0
    at_least: float | None = None


def _word(key: str, parameter: Any) -> _Word:
    """Return the word of a parameter: one above 0 has no minimum."""
    least = None if parameter.above == 0.0 else -math.inf if parameter.at_least is None else parameter.at_least
    units = STIFFNESS if parameter.unit == "N/m" else parameter.unit
    return _Word(key, units, WRITTEN.get(parameter.written, 1.0), least)


OPTIONS = {
    bare(key): _word(key, about[parameter].parameter)
    for part, (make, _) in BLOCK_PARTS.items()
    for about in (declared(make),)
    for key, (parameter, _) in FACTORS[part].items()
    if key not in SIZES and suffix_of(key)
}
"""Options of lengths, angles and masses, with their keys of ``[[blocks]]``."""
PARTS = {
    name: _word(key_of(name, about.parameter), about.parameter)
    for make in MAKERS.values()
    for name, about in declared(make).items()
    if about.parameter is not None and about.parameter.unit
}
"""Parts of ``--restraint``, with their keys of ``[restraints.NAME]``; ``count`` is a number without a unit."""


def block_of(name: str | None, options: Mapping[str, Any]) -> Block:
    """Return the block of a catalogue name, or of sizes with units, with its scene, from the options that are given."""
    sizes = {size: options[size] for size in map(bare, SIZES) if options[size] is not None}
    metres = {
        size: quantity(_option(size), text, METRE, bare=LARGEST)
        for size, text in sizes.items()
        if isinstance(text, str)
    }
    around = scene_of(options)
    if name is not None:
        if sizes:
            raise StudyError(f"a block is a catalogue name or sizes, got {name!r} and {_option(next(iter(sizes)))}")
        listed = {"catalogue": name, **({"placed": True} if options["placed"] else {}), **around}
        return built("BLOCK", lambda: BlockTable.model_validate(listed).build(), listed, BlockTable)
    if options["placed"]:
        raise StudyError("--placed belongs to items of the catalogue: give --wall-gap for other blocks")
    if "width" not in metres or "height" not in metres:
        raise StudyError("which block? A name of `toppling catalogue`, or --width and --height")
    plain = built("block", lambda: Block(**{**sizes, **metres}))
    keys = {key: getattr(plain, bare(key)) for key in SIZES} | around
    return built("block", lambda: BlockTable.model_validate(keys).build(), around, BlockTable)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def law_of(law: str, **options: Any) -> Law:
    """Return a damping law by its short name; StudyError if an option is not the law's own or out of range."""
    content = {"law": law, **{name: value for name, value in options.items() if value is not None}}
    return built(f"--law {law}", lambda: model_table(content).build(), content, Models)


def motion_of(
    name: str, seed: int | None = None, index: int = 0, settings: Sequence[str] = (), period: str | None = None
) -> xr.DataArray:
    """Return motion number `index` of a generator or pulse (with ``key=value`` settings), a record or a study."""
    given = [_setting(setting) for setting in settings]
    keys = dict(given)
    if len(keys) < len(given):
        twice = next(key for i, (key, _) in enumerate(given) if key in dict(given[:i]))
        raise StudyError(f"--set {twice}: must be given once, got it twice")
    made = name in NAMES
    if not made:
        _check_name(name)
    if name not in shaking.PULSES and period is not None:
        raise StudyError(f"--period belongs to pulses ({', '.join(shaking.PULSES)}), got {name!r}")
    if name not in shaking.GENERATORS and seed is not None:
        raise StudyError(f"--seed belongs to generators ({', '.join(shaking.GENERATORS)}), got {name!r}")
    if index < 0:
        raise StudyError(f"--index must be 0 or more, got {index}")
    at = index
    taken: tuple[Taken, ...] = ()
    if not made:
        arrays, taken = _read(name, keys)
    else:
        if name in shaking.PULSES:
            keys |= {"pulse": name}
            if period is not None:
                if "omega_rad_s" in keys:
                    raise StudyError("give --period or --set omega_rad_s, not both")
                keys["omega_rad_s"] = 2.0 * math.pi / quantity("--period", period, SECOND)
            elif "omega_rad_s" not in keys:
                raise StudyError(f"pulse {name!r} needs its --period, such as 0.5s")
        else:
            keys |= {"generator": name, "number": 1, "seed": seed or 0}
        first = index if name in shaking.GENERATORS else 0
        at -= first
        arrays = built(name, lambda: motions_table(keys).build(Path(), first), keys)
    plain = records(arrays)
    if at >= len(plain):
        last = f"0 to {len(plain) - 1}" if len(plain) > 1 else "0 only"
        raise StudyError(f"--index {index}: {name} holds {counted(len(plain), 'motion')} ({last})")
    record = plain[at]
    alone = from_array(
        record.acceleration, record.dt, [record.label], record.source, record.own_amplitude, record.recorded
    )
    of_each = [
        array.isel({"motion": [i], "floor": floor}, missing_dims="ignore")
        for array in arrays
        for i, floor in np.ndindex(array.sizes["motion"], array.sizes.get("floor", 1))
    ]
    coordinates = {key: of_each[at].coords[key] for key in (REACHED if made else TAKEN) if key in of_each[at].coords}
    alone = alone.assign_coords({key: values for key, values in coordinates.items() if values.dims == ("motion",)})
    label = str(of_each[at]["motion"].values[0])
    below = None if "unit_from" in alone.coords else next((row for row in taken if row[0] == label), None)
    if below is None:
        return alone
    _, dt, unit, step, azimuth = below  # of the ground motion below a floor
    alone = taken_from(alone, [unit], [step if dt == record.dt else "building"])
    return alone.assign_coords(azimuth_from=("motion", [azimuth])) if azimuth else alone


def _check_name(name: str) -> None:
    """Raise StudyError for a name that is neither a file nor a known motion; the error lists these."""
    if not Path(name).exists() and not any(letter in name for letter in "./*\\"):
        near = nearest(name, NAMES)
        hint = f"; did you mean {near!r}?" if near else ""
        raise StudyError(f"MOTION must be a file, or one of {', '.join(NAMES)}, got {name!r}{hint}")


def _read(name: str, keys: Mapping[str, Any]) -> tuple[list[xr.DataArray], tuple[Taken, ...]]:
    """Return the motions of record files or of a study file, and what is `taken_of` files."""
    from .motions import read_motions  # noqa: PLC0415 - matplotlib

    foreign = sorted(set(keys) - RECORD_KEYS) or (sorted(keys) if name.lower().endswith(".toml") else [])
    if foreign:
        raise StudyError(f"--set {foreign[0]}: belongs to generators and pulses, got {name!r}")
    if not keys:
        shown = read_motions([name])
        return shown.motions, shown.taken
    content = {"records": name, **keys}
    return built(name, lambda: motions_table(content).build(), content), ()


def factor_of(motion: xr.DataArray, scale: float | None, pga: str | None) -> float:
    """Return the factor on the motion: the one given, or the factor that scales its peak to a PGA with its unit."""
    if scale is not None and pga is not None:
        raise StudyError("give --scale or --pga, not both")
    if pga is not None:
        wanted = quantity("--pga", pga, ACCELERATION)
        return wanted / float(built("--pga", lambda: positive_measure("pga", records(motion)))[0])
    if scale is None:
        return 1.0
    if not 0.0 < scale < math.inf:
        raise StudyError(f"--scale must be finite and > 0, got {scale:g}")
    return scale


def built(what: str, make: Callable[[], Built], content: Any = None, table: Any = Motions) -> Built:
    """Return the result of `make`; its error becomes one sentence about `what`, or about keys of `content`."""
    try:
        return make()
    except ValidationError as error:
        raise StudyError(f"{what}: {refusal(error, content, table)[0]}") from None
    except (StudyError, shaking.RecordError) as error:
        raise StudyError(str(error)) from None
    except (TypeError, ValueError, ArithmeticError) as error:
        raise StudyError(f"{what}: {error}") from None


def _setting(text: str) -> tuple[str, Any]:
    """Return key and value of ``key=value``; the value is as TOML reads it, or else plain text."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip() or not value.strip():
        raise StudyError(f"--set {text[:60]}: must be key=value, such as duration_s=20")
    if key.strip() in ("generator", "pulse", "records", "floors_file", "number", "seed"):
        raise StudyError(f"--set {key.strip()}: is said by MOTION, --seed and --index")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return key.strip(), value.strip()


def scene_of(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of ``[[blocks]]`` that the options of the command line give."""
    keys_of: dict[str, Any] = {
        word.key: _value(_option(name), options[name], word) for name, word in OPTIONS.items() if options.get(name)
    }
    if options.get("wall_restitution") is not None:
        keys_of["wall_restitution"] = options["wall_restitution"]
    if options.get("restraint") is not None:
        keys_of["restraint"] = _restraint(options["restraint"])
    return keys_of


def _restraint(text: str) -> dict[str, Any]:
    """Return the table of a restraint from ``kind,part=value,…``."""
    kind, *parts = (word.strip() for word in text.split(","))
    try:
        checked(kind, KINDS)
    except ValueError as error:
        raise StudyError(f"--restraint {kind[:40]}: {error}") from None
    table: dict[str, Any] = {"kind": kind}
    for part in parts:
        name, equals, value = (word.strip() for word in part.partition("="))
        if not equals:
            raise StudyError(f"--restraint {part[:40]}: must be part=value, such as strap,height=1.75m,strength=267N")
        try:
            checked(name, (*PARTS, "count"))
        except ValueError as error:
            raise StudyError(f"--restraint {name[:40]}: {error}") from None
        key = name if name == "count" else PARTS[name].key
        if key in table:
            raise StudyError(f"--restraint {name}: is given twice")
        if name != "count":
            table[key] = _value(f"--restraint {name}", value, PARTS[name])
        elif value.isascii() and value.isdigit():
            table[key] = int(value[:9])
        else:
            raise StudyError(f"--restraint count: must be a whole number, got {value[:40]!r}")
    return table


def _value(option: str, text: str, word: _Word) -> float:
    """Return the value in the unit of the study file's key."""
    # (divided by the unit, since 0.02 m is 20 mm, and 0.02 times 1000 is not quite so)
    return quantity(option, text, word.units, at_least=word.at_least) / word.factor
