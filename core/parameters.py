"""Parameters: unit, bounds and words of a value, declared once with its type, and their derived values.

A field of a dataclass or an argument of a function is declared by its annotation, ``Annotated[float, Parameter("m",
above=0.0)]``. Its default is the usual one, and its sentence is in the section Parameters of the docstring.
"""

import inspect
import math
import re
import typing
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from . import checks
from .aliases import Array, Flags


@dataclass(frozen=True)
class Parameter:
    """Annotation of a value: SI unit, bounds (of a text: of its length), or words; `written`: unit in study files."""

    unit: str = ""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    words: tuple[str, ...] = ()
    written: str = ""

    @cached_property
    def bounds(self) -> dict[str, float]:
        """The given bounds, by their names."""
        return {name: getattr(self, name) for name in checks.BOUNDS if getattr(self, name) is not None}

    @property
    def text(self) -> str:
        """The bounds in words, as ``> 0 and <= 1 (in m)``."""
        bounds = " and ".join(f"{checks.BOUNDS[name][1]} {value:g}" for name, value in self.bounds.items())
        return f"{bounds} (in {self.unit})" if self.unit else bounds

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        """Let a table check a value against its bounds (a protocol of pydantic)."""
        made = handler(source)
        if self.bounds and made["type"] not in ("float", "int", "str"):
            raise TypeError(f"bounds must be of a number or a text, not of {source} ({self.text})")
        of_text = {"at_least": "min_length", "at_most": "max_length"}
        names = of_text if made["type"] == "str" else {"above": "gt", "at_least": "ge", "below": "lt", "at_most": "le"}
        return {**made, **{names[name]: bound for name, bound in self.bounds.items()}}

    def holds(self, values: Array) -> Flags:
        """Return True for each of many values that is finite and within the bounds."""
        flags: Flags = np.isfinite(values)
        for name, bound in self.bounds.items():
            flags &= checks.BOUNDS[name][0](values, bound)
        return flags

    def number(self, name: str, value: Any) -> float:
        """Return a value as a float; ValueError or TypeError unless it is a finite number within the bounds."""
        return checks.number(name, value, **self.bounds, unit=self.unit)

    def count(self, name: str, value: Any) -> int:
        """Return a value as a whole number; ValueError or TypeError unless it is one within the bounds."""
        self.check(name, value, int)
        return int(value)

    def array(self, name: str, values: Any, ndim: tuple[int, ...] = (0, 1)) -> Array:
        """Return values as an array of floats; ValueError or TypeError unless all are finite and within the bounds."""
        numbers = checks.finite_array(name, values, ndim=ndim, unit=self.unit)
        wrong = numbers[~self.holds(numbers)]
        if wrong.size:
            raise ValueError(f"{name} must be {self.text}, got {wrong[0]:g}")
        return numbers

    def check(self, name: str, value: Any, kind: Any = float) -> None:
        """Raise a ValueError or TypeError unless a value, or each of a sequence, is one of the words or in bounds."""
        if self.words:
            checks.choice(name, value, self.words)
            return
        if kind in (str, bool):
            if not isinstance(value, kind):
                raise TypeError(f"{name} must be {'text' if kind is str else 'true or false'}, got {value!r:.60}")
            if kind is str and not all(
                checks.BOUNDS[bound][0](len(value), self.bounds[bound]) for bound in self.bounds
            ):
                raise ValueError(f"{name} must be of {self.text} characters, got {value!r:.60}")
            return
        if kind is int:
            number = checks.count(name, value, at_least=int(self.bounds.get("at_least", 0)))
            if number > self.bounds.get("at_most", math.inf):
                raise ValueError(f"{name} must be at most {self.at_most:,.0f}, got {number:,}")
            return
        several = kind is not float and isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
        for number in value if several else (value,):
            self.number(name, number)


POSITIVE = Parameter(above=0.0)
COUNT = Parameter(at_least=1)
STEP = Parameter("s", above=0.0, at_most=checks.MAX_STEP)
"""Time step of a motion."""
CHANCE = Parameter(above=0.0, below=1.0)
CONFIDENCE = Parameter(at_least=0.5, below=1.0)
"""Of intervals: a lower value is a level of significance."""
USUAL_CONFIDENCE = 0.95
BETA_M = Parameter(at_least=0.0, at_most=1.5)
"""Modelling uncertainty: FEMA P-58 has up to 0.57, and per cent are above the bound."""
SHARE = Parameter(at_least=0.0, at_most=1.0)
PART = Parameter(above=0.0, at_most=1.0)
RATIO = Parameter(at_least=0.0, below=1.0)
CORRELATION = Parameter(at_least=-1.0, at_most=1.0)
YEARS = Parameter("years", above=0.0)
USUAL_YEARS = 50.0
USUAL_MEASURE = "pga"
HALF_INTERVAL = Parameter(above=0.0, below=0.5)
"""Half width of the interval of a probability."""
Seed = typing.Annotated[int, Parameter(at_least=0)]
"""Seed of random draws."""


class Declared(NamedTuple):
    """A parameter of a class or function: its type without annotations, its declaration, its default and sentence."""

    type: Any
    parameter: Parameter | None
    default: Any
    sentence: str
    optional: bool = False
    """True if it may be None."""

    @property
    def needed(self) -> bool:
        """True if it must be given."""
        return self.default is MISSING


@cache
def declared(make: Any) -> dict[str, Declared]:
    """Return the parameters of a dataclass or a function by their names."""
    if isinstance(make, type) and is_dataclass(make):
        hints = typing.get_type_hints(make, include_extras=True)
        defaults = {
            field.name: field.default if field.default_factory is MISSING else field.default_factory()
            for field in fields(make)
            if field.init
        }
    else:
        plain = getattr(make, "__func__", make)
        hints = typing.get_type_hints(plain, include_extras=True)
        arguments = inspect.signature(make).parameters.values()
        defaults = {
            argument.name: MISSING if argument.default is argument.empty else argument.default for argument in arguments
        }
    sentences = sentences_of(make)
    return {
        name: Declared(
            *_parts(hints[name]), default, sentences.get(name, ""), type(None) in typing.get_args(hints[name])
        )
        for name, default in defaults.items()
    }


def _parts(hint: Any) -> tuple[Any, Parameter | None]:
    """Return the type of an annotation, without None, and its declaration; None if it has none."""
    if typing.get_origin(hint) is typing.Annotated:
        kind, *marks = typing.get_args(hint)
        return kind, next((mark for mark in marks if isinstance(mark, Parameter)), None)
    parts = [part for part in typing.get_args(hint) if part is not type(None)]
    return _parts(parts[0]) if len(parts) == 1 and type(None) in typing.get_args(hint) else (hint, None)


def check(values: Any, but: Sequence[str] = ()) -> None:
    """Check the declared fields of a dataclass, except those in `but`; ValueError or TypeError for a wrong value.

    >>> @dataclass
    ... class Wave:
    ...     length: typing.Annotated[float, Parameter("m", above=0.0)]
    >>> check(Wave(-1.0))
    Traceback (most recent call last):
    ...
    ValueError: length must be finite and > 0 (in m), got -1.0
    """
    for name, kind, parameter, optional in _checked(values.__class__):
        value = getattr(values, name)
        if (value is not None or not optional) and name not in but:
            parameter.check(name, value, kind)


@cache
def _checked(kind: Any) -> tuple[tuple[str, Any, Parameter, bool], ...]:
    """Return the declared fields of a dataclass with their types, and True if they may be None."""
    rows = ((name, about.type, about.parameter, about.optional) for name, about in declared(kind).items())
    return tuple((name, of, parameter, optional) for name, of, parameter, optional in rows if parameter is not None)


_SECTION = re.compile(r"Parameters\n-+\n(.*?)(?:\n\n\S|\Z)", re.S)
_ENTRY = re.compile(r"^(\w[\w, ]*?) : [^\n]*\n((?:    .*\n?|\n(?=    ))+)", re.M)


def sentences_of(make: Any) -> dict[str, str]:
    """Return the docstrings' sentences on the parameters of a class and its bases, or of a function or class method."""
    sentences: dict[str, str] = {}
    of = getattr(make, "__self__", None)
    kinds = make.__mro__ if isinstance(make, type) else (make, *of.__mro__) if isinstance(of, type) else (make,)
    for kind in reversed(kinds):
        section = _SECTION.search(inspect.cleandoc(kind.__doc__ or ""))
        for names, text in _ENTRY.findall(f"{section[1]}\n" if section else ""):
            sentences |= dict.fromkeys(re.split(r",\s*", names), " ".join(text.split()))
    return sentences
