"""Tables of study files that follow from the classes and functions that they describe, and choices among them.

A parameter's declaration (`core.parameters`) gives its key: the name with its unit, the type, the bounds, the sentence
and the default. A choice, such as the choice of a generator, has one table for each of its words. A key of another word
is then an error when the file is read.
"""

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin

from pydantic import Discriminator, Field, Tag, create_model
from pydantic.fields import FieldInfo

from ...core.parameters import Declared, Parameter, declared
from .table import UNIT_SUFFIXES, WRITTEN, KeyInfo, Table, as_written, one_of, plain

_SUFFIXES = {unit: suffix for suffix, unit in UNIT_SUFFIXES.items()}


def key_of(name: str, parameter: Parameter | None) -> str:
    """Return the key of a parameter: its name with the unit of study files."""
    unit = "" if parameter is None else parameter.written or parameter.unit
    return f"{name}{_SUFFIXES.get(unit, '')}"


class Derived(Table):
    """A table whose keys are the parameters of the object that it makes."""

    makes: ClassVar[Callable[..., Any]]
    si_factors: ClassVar[dict[str, tuple[str, float]]]
    """Parameter and SI value of one unit of each key."""

    def options(self) -> dict[str, Any]:
        """Return the parameters that are given, in SI; ValueError as of tables in the table."""
        return in_si(self, self.si_factors)

    def build(self) -> Any:
        """Make the object that the table describes; ValueError if values do not go together."""
        return type(self).makes(**self.options())


def _times(value: Any, factor: float) -> Any:
    if factor == 1.0 or isinstance(value, bool | str):
        return value
    return [factor * number for number in value] if isinstance(value, list) else factor * value


def derived(
    make: Any,
    base: type[Table] = Derived,
    *,
    word: tuple[str, str] | None = None,
    types: Mapping[str, Any] | None = None,
    defaults: Mapping[str, Any] | None = None,
) -> Any:
    """Return the table of a class or function, as a subclass of `base`.

    `word`: the key and the word that choose it. `types`: annotations of parameters that no `Parameter` declares, or
    None for parameters that are no keys. `defaults`: instead of the parameters' own, in words or SI.
    """
    fields, factors = keys_of(make, types, defaults=defaults)
    fields = {key: field for key, field in fields.items() if key not in base.model_fields}
    if word is not None:
        fields = {**_word_field(base, *word), **fields}
    label = f"{make.__name__[0].upper()}{make.__name__[1:]}{base.__name__}"
    made = create_model(label, __base__=base, __module__=__name__, **fields)
    made.makes, made.si_factors = staticmethod(make), factors  # type: ignore[attr-defined]
    made.__doc__ = inspect.cleandoc(make.__doc__).split("\n\n")[0] if base is Derived else base.__doc__
    return made


def keys_of(
    make: Any,
    types: Mapping[str, Any] | None = None,
    *,
    defaults: Mapping[str, Any] | None = None,
    names: Mapping[str, str] | None = None,
) -> tuple[dict[str, Any], dict[str, tuple[str, float]]]:
    """Return the keys of a class or function as fields of a table, and each key's parameter and SI value of one unit.

    types and defaults: as of `derived`; names: of parameters in the table, if they are others.
    """
    fields: dict[str, Any] = {}
    factors: dict[str, tuple[str, float]] = {}
    for parameter, declaration in declared(make).items():
        given = (types or {}).get(parameter, declaration.parameter)
        if given is None:
            continue
        about = declaration._replace(default=(defaults or {}).get(parameter, declaration.default))
        key = key_of((names or {}).get(parameter, parameter), about.parameter)
        fields[key] = _field(about, (types or {}).get(parameter))
        unit = "" if about.parameter is None else about.parameter.written
        factors[key] = parameter, WRITTEN.get(unit, 1.0)
    return fields, factors


def in_si(table: Table, factors: Mapping[str, tuple[str, float]]) -> dict[str, Any]:
    """Return the values of a table that are given, by parameter and in SI; ValueError as of tables in the table."""
    given = {name: (getattr(table, key), factor) for key, (name, factor) in factors.items()}
    return {name: _made(value, factor) for name, (value, factor) in given.items() if value is not None}


def _made(value: Any, factor: float) -> Any:
    """Return the value of a key in SI, or the object that its table, or each of its tables by name, describes."""
    if isinstance(value, Derived):
        return value.build()
    if isinstance(value, dict):
        return {name: _made(part, factor) for name, part in value.items()}
    return _times(value, factor)


def _worded(table: type[Table], key: str, word: str) -> type[Table]:
    """Return a table that has the one word of the key that chooses it."""
    field = table.model_fields[key]
    if get_origin(field.annotation) is Literal:
        return table
    made = create_model(table.__name__, __base__=table, __module__=__name__, **_word_field(table, key, word))
    made.__doc__ = table.__doc__
    return made


def _word_field(table: type[Table], key: str, word: str) -> dict[str, Any]:
    return {key: (Annotated[Literal[word], Field(description=table.model_fields[key].description)], ...)}


def default_of(field: FieldInfo) -> Any:
    """Return the value of a key, in its unit, if it is not given."""
    return next(info.default for info in field.metadata if isinstance(info, KeyInfo))


def _field(about: Declared, given: Any) -> tuple[Any, Any]:
    """Return the annotation and the default of a key."""
    parameter = about.parameter or Parameter()
    factor = WRITTEN.get(parameter.written, 1.0)
    described = any(isinstance(part, FieldInfo) and part.description for part in get_args(given)[1:])
    unit = rf", {re.escape(parameter.unit)}(?=[.:;,)])" if parameter.unit else "$^"
    more = [] if described else [Field(description=re.sub(unit, "", about.sentence, count=1))]
    if given is None:
        bounds = as_written(parameter)
        given = {
            "float": Annotated[float, bounds],
            "int": Annotated[int, bounds],
            "bool": bool,
            "str": Annotated[str, one_of(filter(None, parameter.words)) if parameter.words else bounds],
        }.get(getattr(about.type, "__name__", ""))
        if given is None:  # a number or several
            given = reduce(or_, [Annotated[float, bounds], list[Annotated[float, bounds]]])
    if about.needed:
        return Annotated[given, *more, KeyInfo(unit=parameter.unit)], ...
    default = about.default
    if isinstance(default, float) and factor != 1.0:
        default = plain(default / factor)
    if isinstance(default, tuple):
        default = list(default)
    known = isinstance(default, float | int | str | list) and default != math.inf
    return Annotated[given | None, *more, KeyInfo(default if known else None, unit=parameter.unit)], None


class By:
    """Choice of one of several tables by the word of a key."""

    def __init__(self, key: str, words: Sequence[str] = ()) -> None:
        self.key, self.words, self.__name__ = key, words, key  # (pydantic wants the name of a function)

    def __call__(self, value: Any) -> str:
        """Return the tag of the table for a table's content, or for the table itself."""
        word = value.get(self.key) if isinstance(value, dict) else getattr(value, self.key, None)
        return f"{self.key}={word}"

    def word_of(self, content: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
        """Return the key whose word chooses among tables such as this one, and all such words."""
        return self.key, self.words


def choice(key: str, tables: Mapping[str, type[Table]]) -> Any:
    """Return the annotation of one of several tables, by the word of their key."""
    worded = {f"{key}={word}": _worded(table, key, word) for word, table in tables.items()}
    return chosen_by(By(key, tuple(tables)), worded)


def chosen_by(by: By, tables: Mapping[str, type[Table]]) -> Any:
    """Return the annotation of one of several tables, by their tags."""
    for tag, table in tables.items():
        table.alternative = by, tag
    return Annotated[reduce(or_, [Annotated[table, Tag(tag)] for tag, table in tables.items()]), Discriminator(by)]
