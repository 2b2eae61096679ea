"""What stands around a block or holds it, from words of the command line: the keys of ``[[blocks]]``.

Numbers come with their units, ``--wall-gap 20mm --restraint strap,height=1.75m,strength=267N``, and become the values
of the study file's keys, whose table checks them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from ...core.units import KILOGRAM, METRE, NEWTON, RADIAN, STIFFNESS
from ...models.scenes.restraint import KINDS
from ..file.table import checked, quantity
from ..text.error import StudyError


class _Word(NamedTuple):
    """Key of a study file that a word of the command line gives: its SI unit, one of the key's units in it, a least."""

    key: str
    units: str
    factor: float = 1.0
    at_least: float | None = None


OPTIONS = {
    "--mass": _Word("mass_kg", KILOGRAM),
    "--cm-offset": _Word("cm_offset_mm", METRE, 1e-3, -math.inf),
    "--lean": _Word("lean_deg", RADIAN, math.pi / 180.0, -math.inf),
    "--wall-gap": _Word("wall_gap_mm", METRE, 1e-3, 0.0),
    "--wall-height": _Word("wall_height_m", METRE),
    "--front-gap": _Word("front_gap_mm", METRE, 1e-3),
    "--bed-settlement": _Word("bed_settlement_mm", METRE, 1e-3),
}
"""Options of lengths, angles and masses, with their keys of ``[[blocks]]``."""
PARTS = {
    "height": _Word("height_m", METRE),
    "strength": _Word("strength_n", NEWTON),
    "stiffness": _Word("stiffness_n_per_mm", STIFFNESS, 1e3),
    "slack": _Word("slack_mm", METRE, 1e-3, 0.0),
    "preload": _Word("preload_n", NEWTON, 1.0, 0.0),
    "front": _Word("front_m", METRE),
    "back": _Word("back_m", METRE),
    "angle": _Word("angle_deg", RADIAN, math.pi / 180.0, -math.inf),
    "width": _Word("width_m", METRE),
}
"""Parts of ``--restraint``, with their keys of ``[restraints.NAME]``; ``count`` is a number without a unit."""


def scene_of(options: Mapping[str, str | None], restitution: float | None, restraint: str | None) -> dict[str, Any]:
    """Return the keys of ``[[blocks]]`` that the options of the command line give.

    `options` are the words of `OPTIONS`, None where not given; `restraint` is a kind, and its parts with commas.
    """
    found: dict[str, Any] = {
        OPTIONS[option].key: _value(option, text, OPTIONS[option]) for option, text in options.items() if text
    }
    if restitution is not None:
        found["wall_restitution"] = restitution
    if restraint is not None:
        found["restraint"] = _restraint(restraint)
    return found


def _restraint(text: str) -> dict[str, Any]:
    """Return the table of a restraint from ``kind,part=value,…``."""
    kind, *parts = (word.strip() for word in text.split(","))
    try:
        checked(kind, KINDS)
    except ValueError as error:
        raise StudyError(f"--restraint {kind[:40]}: {error}") from None
    found: dict[str, Any] = {"kind": kind}
    for part in parts:
        name, equals, value = (word.strip() for word in part.partition("="))
        if not equals:
            raise StudyError(f"--restraint {part[:40]}: must be part=value, such as strap,height=1.75m,strength=267N")
        try:
            checked(name, (*PARTS, "count"))
        except ValueError as error:
            raise StudyError(f"--restraint {name[:40]}: {error}") from None
        key = name if name == "count" else PARTS[name].key
        if key in found:
            raise StudyError(f"--restraint {name}: is given twice")
        if name != "count":
            found[key] = _value(f"--restraint {name}", value, PARTS[name])
        elif value.isascii() and value.isdigit():
            found[key] = int(value[:9])
        else:
            raise StudyError(f"--restraint count: must be a whole number, got {value[:40]!r}")
    return found


def _value(option: str, text: str, word: _Word) -> float:
    """Return the value in the unit of the study file's key."""
    # (divided by the unit, since 0.02 m is 20 mm, and 0.02 times 1000 is not quite so)
    return quantity(option, text, word.units, at_least=word.at_least) / word.factor
