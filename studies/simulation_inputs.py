"""What `toppling simulate` is told: a block, a law and a motion in words, one sentence where they are none."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr
from pydantic import ValidationError

from .. import motions as shaking
from ..models import Block, Law
from ..motions.arrays import from_array, records
from ..motions.measures import positive_measure
from ..units import ACCELERATION, METRE, SECOND
from .block_tables import BlockTable, ModelTable
from .motion_tables import MotionsTable
from .quantities import quantity
from .refusals import said
from .tables import StudyError, Table, expand, nearest

OF_TABLES = {"dt_s": "dt", "unit": "unit"}
"""What a record file may not state: keys of ``[motions]``, and what `toppling.motions.read_all` calls them."""
NAMES = (*shaking.GENERATORS, *shaking.PULSES)
LARGEST = 10.0
"""Size, m, above which a number alone is rather meant in cm or mm: no furniture is so large."""
Built = TypeVar("Built")


def block_of(name: str | None, sizes: Mapping[str, str | None], inertia_factor: float | None = None) -> Block:
    """The block of a catalogue name, or of sizes with units (``--width``, ``--height``, ``--cm-height``).

    Raises
    ------
    StudyError
        Neither or both, a name that is not in the catalogue, sizes out of range.
    """
    given = [option for option, text in sizes.items() if text is not None]
    metres = {option: quantity(option, str(sizes[option]), METRE, bare=LARGEST) for option in given}
    if name is not None:
        if given or inertia_factor is not None:
            other = given[0] if given else "--inertia-factor"
            raise StudyError(f"a block is a catalogue name or sizes, got {name!r} and {other}")
        return built("BLOCK", lambda: BlockTable(catalogue=name).build())
    if "--width" not in metres or "--height" not in metres:
        raise StudyError("which block? A name of `toppling catalogue`, or --width and --height")
    width, height, cm_height = (metres.get(option) for option in ("--width", "--height", "--cm-height"))
    return built("block", lambda: Block(width or 0.0, height or 0.0, cm_height, inertia_factor))


def law_of(law: str, options: Mapping[str, Any]) -> Law:
    """A damping law by its short name; StudyError where an option is not its own or out of range."""
    given = {name: value for name, value in options.items() if value is not None}
    content = {"law": law, **given}
    return built(f"--law {law}", lambda: ModelTable.model_validate(content).build(), content, ModelTable)


def motion_of(
    name: str, seed: int | None = None, index: int = 0, settings: Sequence[str] = (), period: str | None = None
) -> xr.DataArray:
    """One motion: of a generator or a pulse by its name, of a record file, or of a study file.

    Parameters
    ----------
    name : str
        A name of `NAMES`, a path or pattern of record files, or a study file (.toml).
    seed : int, optional
        Of a generator; 0 where not given.
    index : int
        Which motion: of the seed, or of those that the file holds (floors one after the other).
    settings : sequence of str
        ``key=value``, keys of ``[motions]`` in a study file.
    period : str, optional
        Of a pulse, with its unit.

    Raises
    ------
    StudyError
        No such name or file, keys that do not belong to it, an index beyond its motions.
    """
    keys = dict(_setting(one) for one in settings)
    made = name in NAMES
    if name not in shaking.PULSES and period is not None:
        raise StudyError(f"--period belongs to pulses ({', '.join(shaking.PULSES)}), got {name!r}")
    if name not in shaking.GENERATORS and seed is not None:
        raise StudyError(f"--seed belongs to generators ({', '.join(shaking.GENERATORS)}), got {name!r}")
    if index < 0:
        raise StudyError(f"--index must be 0 or more, got {index}")
    at = index
    if not made:
        found = _read(name, keys)
    else:
        if name in shaking.PULSES:
            keys |= {"pulse": name}
            if period is not None:
                keys["omega_rad_s"] = 2.0 * math.pi / quantity("--period", period, SECOND)
            elif "omega_rad_s" not in keys:
                raise StudyError(f"pulse {name!r} needs its --period, such as 0.5s")
        else:
            keys |= {"generator": name, "number": 1, "seed": seed or 0}
        first = index if name in shaking.GENERATORS else 0
        at -= first
        found = built(name, lambda: MotionsTable.model_validate(keys).build(Path(), first), keys)
    plain = records(found)
    if at >= len(plain):
        last = f"0 to {len(plain) - 1}" if len(plain) > 1 else "0 only"
        raise StudyError(f"--index {index}: {name} holds {_count(len(plain), 'motion')} ({last})")
    one = plain[at]
    return from_array(one.acceleration, one.dt, [one.label], one.source, one.own_amplitude)


def _read(name: str, keys: Mapping[str, Any]) -> list[xr.DataArray]:
    """The motions of record files or of a study file; a name that is neither is answered with those there are."""
    from .look import read_motions  # noqa: PLC0415 - matplotlib

    if not Path(name).exists() and not any(letter in name for letter in "./*\\"):
        near = nearest(name, NAMES)
        hint = f"; did you mean {near!r}?" if near else ""
        raise StudyError(f"MOTION must be a file, or one of {', '.join(NAMES)}, got {name!r}{hint}")
    foreign = sorted(set(keys) - set(OF_TABLES)) or (sorted(keys) if name.lower().endswith(".toml") else [])
    if foreign:
        raise StudyError(f"--set {foreign[0]}: belongs to generators and pulses, got {name!r}")
    if not keys:
        return read_motions([name])
    stated = {OF_TABLES[key]: value for key, value in keys.items()}
    return built(name, lambda: [one for path in expand(name, Path()) for one in shaking.read_all(path, **stated)])


def factor_of(motion: xr.DataArray, scale: float | None, pga: str | None) -> float:
    """What the motion is multiplied by: a plain factor, or what brings its peak to a PGA with its unit."""
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


def built(what: str, make: Callable[[], Built], content: Any = None, table: type[Table] = MotionsTable) -> Built:
    """What `make` returns; its error as one sentence about `what`, where `content` is no `table` about its keys."""
    try:
        return make()
    except ValidationError as error:
        raise StudyError(f"{what}: {said(error, content, table)[0]}") from None
    except (StudyError, shaking.RecordError) as error:
        raise StudyError(str(error)) from None
    except (TypeError, ValueError, ArithmeticError) as error:
        raise StudyError(f"{what}: {error}") from None


def _setting(text: str) -> tuple[str, Any]:
    """Key and value of ``key=value``: as TOML reads it, or a word."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip() or not value.strip():
        raise StudyError(f"--set {text[:60]}: must be key=value, such as duration_s=20")
    if key.strip() in ("generator", "pulse", "records", "floors_file", "number", "seed"):
        raise StudyError(f"--set {key.strip()}: is said by MOTION, --seed and --index")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return key.strip(), value.strip()


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"
