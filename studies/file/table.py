"""The base class of all tables of a study file, annotations of their keys, and quantities with units."""

import difflib
import inspect
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core.core_schema import CoreSchema, no_info_after_validator_function

from ...core.doubts import Doubt
from ...core.parameters import BETA_M, CONFIDENCE, Parameter, Seed
from ...core.units import ACCELERATION, KILOGRAM, METRE, NEWTON, RADIAN, SECOND, STIFFNESS, UNITS
from ...models.friction import SPREAD
from ...models.sliding.trip import TRIP
from ...motions.plausibility import unusual, usual
from ..text.error import StudyError

MOST_ERRORS = 5
"""Maximum number of errors of a study file that are reported at once."""
_MORE = {
    **{"s": (1.0, SECOND), "ms": (1e-3, SECOND), "rad": (1.0, RADIAN), "deg": (math.pi / 180.0, RADIAN)},
    **{"kg": (1.0, KILOGRAM), "N": (1.0, NEWTON), "kN": (1e3, NEWTON)},
    **{"N/mm": (1e3, STIFFNESS), "kN/m": (1e3, STIFFNESS), "N/m": (1.0, STIFFNESS)},
}
_SPELLINGS = {f"{unit}/s{two}": f"{unit}/s2" for unit in ("m", "cm", "mm") for two in ("²", "^2", "**2")}
_SPELLINGS |= {"Gal": "gal", "°": "deg"}
SIMILAR = 0.75
"""Similarity (`difflib`) from which a word may be meant."""
_SAME = {
    **{"weight": "mass", "restitution": "e"},
    **dict.fromkeys(("quantity", "qty", "pieces", "number"), "count"),
    **dict.fromkeys(("coefficient", "friction", "mu", "static_friction"), "static"),
}
UNIT_FACTORS = {
    unit.lower(): (factor, si.lower())
    for unit, (factor, si) in {
        **{"in": (0.0254, METRE), "ft": (0.3048, METRE), "t": (1e3, KILOGRAM)},
        **{**UNITS, **_MORE},
    }.items()
    if si in (METRE, SECOND, KILOGRAM, NEWTON)
}
"""SI value and SI unit, as names of keys end, of each unit that a user may write there."""
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_EXAMPLES = {
    **{ACCELERATION: "0.4g or 3.9m/s2", METRE: "0.4m or 40cm", SECOND: "0.5s", RADIAN: "0.2rad or 12deg"},
    **{KILOGRAM: "100kg", NEWTON: "267N", STIFFNESS: "20N/mm"},
}


def quantity(option: str, text: str, units: str, *, bare: float = 0.0, at_least: float | None = None) -> float:
    """Convert a number with its unit to its SI value, > 0 or at least a given value.

    `option` is the option as the user wrote it; `units` is the SI unit, ``m s-2``, ``m``, ``s``, ``rad``, ``kg``, ``N``
    or ``N m-1``. A number without a unit is taken in that unit up to `bare`; 0 if the unit must always be given.

    >>> quantity("--width", "40cm", "m"), quantity("--width", "0.4", "m", bare=10.0)
    (0.4, 0.4)
    """
    factors = {name: factor for name, (factor, si) in {**UNITS, **_MORE}.items() if si == units and " " not in name}
    example = _EXAMPLES[units]
    match = _WRITTEN.fullmatch(text)
    if match is None or "," in text:
        hint = " (a decimal point, no comma)" if "," in text else ""
        raise StudyError(f"{option} {text[:40]}: must be a number with its unit, such as {example}{hint}")
    name = _SPELLINGS.get(match[2], match[2])
    if not name and not bare:
        raise StudyError(f"{option} {text[:40]}: say the unit, such as {example}")
    if name and name not in factors:
        # (of another unit of the same quantity the number would be another)
        near = [] if name in _SPELLINGS.values() else difflib.get_close_matches(name.lower(), factors, n=1, cutoff=0.5)
        hint = f"; did you mean {match[1]}{near[0]}?" if near else ""
        raise StudyError(f"{option} {text[:40]}: unit must be one of {', '.join(factors)}, got {match[2][:20]!r}{hint}")
    value = float(match[1]) * (factors[name] if name else 1.0)
    enough = value > 0.0 if at_least is None else value >= at_least
    if not enough or not abs(value) < math.inf:
        least = "> 0" if at_least is None else f">= {at_least:g}"
        raise StudyError(f"{option} {text[:40]}: must be finite{'' if at_least == -math.inf else f' and {least}'}")
    if not name and abs(value) > bare:
        fits = [unit for unit in ("cm", "mm") if float(match[1]) * factors.get(unit, math.inf) <= bare]
        hint = f"; did you mean {float(match[1]) * factors[fits[0]]:g} ({match[1]}{fits[0]})?" if fits else ""
        alone = f"a number alone is in {units}, up to {bare:g} (beyond that {match[1]}{units})"
        raise StudyError(f"{option} {text[:40]}: {alone}{hint}")
    return value


def nearest(value: str, words: Iterable[str]) -> str | None:
    """Return the word that is most similar to `value`, ignoring capitals; None if none is similar."""
    known = {word.casefold(): word for word in words}
    near = difflib.get_close_matches(value[:100].casefold(), known, n=1, cutoff=SIMILAR)
    return known[near[0]] if near else None


def nearest_key(name: str, keys: Iterable[str]) -> str | None:
    """Return the key that may be meant: one of a similar name, whose unit is of the same kind; None without one."""
    name = name.casefold()
    stem, suffix = bare(name), suffix_of(name)
    alike = [key for key in keys if not suffix or _KINDS.get(suffix_of(key), "") in ("", _KINDS[suffix])]
    words = [bare(key) for key in alike]
    near = _SAME[stem] if _SAME.get(stem) in words else nearest(stem, words)
    return next((key for key in alike if key.casefold() == name), None) or next(
        (key for key in alike if bare(key) == near), None
    )


def meant(name: str, keys: Sequence[str]) -> str:
    """Return the question for another key that may be meant, with its unit's effect on the numbers; '' without one.

    >>> meant("width_mm", ["width_m"]), meant("Width (m)", ["width_m"]), meant("colour", ["width_m"])
    ("did you mean 'width_m'? Then divide by 1000", "did you mean 'width_m'?", '')
    """
    plain = re.sub(r"[\W_]+", "_", name.casefold()).strip("_")
    stem, _, unit = plain.rpartition("_")
    factor, si = UNIT_FACTORS.get(unit, (0.0, ""))
    for key in keys:
        factor_of_key, of = UNIT_FACTORS.get(suffix_of(key)[1:], (0.0, ""))
        if of == si != "" and factor_of_key != factor and bare(key) in (bare(stem), _SAME.get(bare(stem))):
            less = (
                f"divide by {factor_of_key / factor:g}" if factor_of_key > factor and unit not in {"in", "ft"} else ""
            )
            return f"did you mean {key!r}? Then {less or f'multiply by {factor / factor_of_key:g}'}"
    # (a unit of no key in brackets, as EUR)
    tried = (name, plain) if si else (name, plain, re.split(r"[\[(]", name)[0].strip())
    near = next((key for key in (nearest_key(word, keys) for word in tried) if key), None)
    then = " Then write thousands in full" if _THOUSANDS.search(name) else " Then divide by 100" if "%" in name else ""
    return f"did you mean {near!r}?{then}" if near else ""


_THOUSANDS = re.compile(r"(?i)(?<![a-z])(?:[ktm](?=€|\$|£|eur|usd|chf|gbp)|tsd|thousand|1[ .,']?000|mio|mln|mill)")


def checked(value: str, allowed: Iterable[str], further: str = "") -> str:
    """Return a word that must be one of those allowed; the ValueError suggests the nearest one."""
    words = list(allowed)
    if value in words:
        return value
    near = nearest(_SPELLINGS.get(value, value), words)
    hint = f"; did you mean {near!r}?" if near else ""
    raise ValueError(f"must be one of {', '.join(words)}{further}, got {shown(value)}{hint}")


def shown(value: Any, most: int = 60) -> str:
    """Return a value as text for a message, at most `most` characters."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists in lists
        return f"a {type(value).__name__}"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def unended(name: str) -> Doubt:
    """Return the input warning on a file whose last line has no end and ends in a number."""
    return Doubt.of("unended", name=name)


@dataclass(frozen=True)
class WordChoice:
    """Annotation of a text (or None) that must be one of some words, which the schema lists."""

    allowed: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any) -> Any:
            spelled = _SPELLINGS.get(value)
            return None if value is None else checked(spelled if spelled in self.allowed else value, self.allowed)

        return no_info_after_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "enum": list(self.allowed)}


def all_errors(sentences: Sequence[str]) -> str:
    """Return all errors of a study file in one line, the first `MOST_ERRORS` of them with their sentences.

    >>> all_errors(["blocks[1].width_m: must be > 0", "key 'models' is missing"])
    "2 errors: (1) blocks[1].width_m: must be > 0; (2) key 'models' is missing"
    """
    if len(sentences) == 1:
        return sentences[0]
    listed = "; ".join(f"({i}) {sentence}" for i, sentence in enumerate(sentences[:MOST_ERRORS], start=1))
    more = len(sentences) - MOST_ERRORS
    return f"{len(sentences)} errors: {listed}{f'; and {more} more' if more > 0 else ''}"


def one_of(names: Iterable[str]) -> WordChoice:
    """Annotation of a word (or None) that must be one of `names`."""
    return WordChoice(tuple(names))


@dataclass(frozen=True)
class KeyInfo:
    """Annotation of a key for the schema, in addition to its description.

    `default`: the value if the key is not given, in words if it is no single value. `unit`: the unit of a key whose
    name does not end with it.
    """

    default: Any = None
    unit: str = ""


@dataclass(frozen=True)
class RelativePath:
    """Annotation of a path (or several) relative to the file that names it; `pattern`: * and ** are wildcards."""

    pattern: bool = False


class Table(BaseModel):
    """A table of a study file: unknown keys are an error; its docstring has a line for each key."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)
    alternative: ClassVar[tuple[Any, str] | None] = None
    """Choice of a table that is one of several: its key, and its tag."""

    def given(self, key: str) -> Any:
        """Return the value of a key; None if it is not given, or belongs to another of several tables."""
        return getattr(self, key, None)


_KEY = re.compile(r"^(\w+): (.+(?:\n    .+)*)", re.MULTILINE)


def sentences_of(table: type[Table]) -> dict[str, str]:
    """Return the docstrings' sentences on the keys of a table and its bases, a line ``key: sentence`` each."""
    docs = [inspect.cleandoc(kind.__doc__ or "") for kind in reversed(table.__mro__) if issubclass(kind, Table)]
    return {key: " ".join(text.split()) for doc in docs for key, text in _KEY.findall(doc)}


RADIANS = 6.3
EIGHTHS = tuple(round(i * math.pi / 4.0, 2) for i in range(1, 9) if i != 7)
"""A full turn and its eighths, rad: an azimuth in degrees as small is none of them, and has no third decimal."""


def key_doubts(table: Table, name: str = "") -> list[Doubt]:
    """Return the input warnings on numbers of a table, and of tables in it, that are not usual for their keys."""
    doubts = []
    for key in type(table).model_fields:
        value = table.given(key)
        parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else [value]
        for part in parts:
            if isinstance(part, Table):
                doubts += key_doubts(part, key)
            elif f"{name}.{key}" in usual() and isinstance(part, int | float):
                doubts += unusual({f"{name}.{key}": part}, "units")
            elif key == "azimuth" and isinstance(part, float) and 0.0 < abs(part) < RADIANS:
                doubts += [Doubt.of("radians", angle=part)] * (round(part, 2) != part or abs(part) in EIGHTHS)
    return doubts


@dataclass(frozen=True)
class PartialTable:
    """Annotation of a table with the keys of another, all optional, checked when the two are merged."""

    table: Any


# The unit of each ending of a key, longest first.
UNIT_SUFFIXES = {
    "_m2_s3": "m²/s³",
    "_rad_s2": "rad/s²",
    "_kg_m3": "kg/m³",
    "_n_per_mm": "N/mm",
    "_rad_s": "rad/s",
    "_per_s": "1/s",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_n_m": "N/m",
    "_deg": "°",
    "_rad": "rad",
    "_hz": "Hz",
    "_pa": "Pa",
    "_kg": "kg",
    "_mm": "mm",
    "_n": "N",
    "_m": "m",
    "_s": "s",
}


_KINDS = {suffix: {"_mm": "_m", "_rad": "_deg"}.get(suffix, suffix) for suffix in UNIT_SUFFIXES}


def suffix_of(key: str) -> str:
    """Return the ending of a key that is a unit, '' if there is none."""
    return next((suffix for suffix in UNIT_SUFFIXES if key.endswith(suffix)), "")


def bare(key: str) -> str:
    """Return a key without its unit."""
    return key.removesuffix(suffix_of(key))


WRITTEN = {"mm": UNITS["mm"][0], "°": _MORE["deg"][0], "N/mm": _MORE["N/mm"][0]}
"""SI value of each unit of study files that is not SI."""


def as_written(parameter: Parameter) -> Parameter:
    """Return a parameter with its bounds in the unit of study files."""
    factor = WRITTEN.get(parameter.written, 1.0)
    bounds: dict[str, Any] = {name: plain(bound / factor) for name, bound in parameter.bounds.items()}
    return replace(parameter, **bounds)


def plain(value: float) -> float:
    """Return a number of a file's unit without the digits added by the conversion from SI."""
    return float(f"{value:.12g}")


MAX_TEXT = 200
"""Most characters of a cell, a name or a title."""
MAX_VALUE = 1e15
AMOUNT = Parameter(at_least=0.0, at_most=MAX_VALUE)
"""An amount of money."""
# Keys that several tables have.
SEVERAL = Field(min_length=1, max_length=100)
"""Number of tables of a list, or of characters of a name that tables refer to."""
Label = Annotated[str, Field(min_length=1, max_length=MAX_TEXT)]
Static = Annotated[float, Field(ge=0.05, le=2.0, description="Static coefficient of friction, or its median.")]
Spread = Annotated[
    float, replace(SPREAD, at_most=1.0), Field(description="Dispersion of a lognormal coefficient of friction.")
]
Trip = Annotated[
    float,
    as_written(TRIP),
    Field(
        description="Clear distance from the foot to an obstacle on either side (a joint, a cable, the edge of a "
        "carpet). Not with both components.",
    ),
]
Replicates = Annotated[int, Field(ge=100, le=100_000, description="Resamples of the motions.")]
ResamplingSeed = Annotated[Seed, Field(description="Seed of the resamples.")]
Confidence = Annotated[float, CONFIDENCE, Field(description="Confidence of all intervals.")]
Modelling = Annotated[float, BETA_M, Field(description="Modelling dispersion β_m of capacities; 0: not included.")]
ModelledIn = Annotated[
    Literal["mean", "fractiles"],
    Field(description="Use of β_m: in the mean rates, or in their ranges over branches."),
]
