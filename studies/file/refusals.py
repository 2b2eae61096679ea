"""Validation errors of a study file as one sentence in a user's words: the key, the value and the allowed values."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from ...core.parameters import Parameter
from .include import fields_of, tables_of
from .table import UNIT_SUFFIXES, PartialTable, checked, meant, shown, suffix_of

NO_TABLE = ("model_type", "model_attributes_type", "dict_type", "union_tag_invalid", "union_tag_not_found")
NO_LIST = ("list_type", "tuple_type")
NO_CHOICE = ("union_tag_invalid", "union_tag_not_found")
NO_INTEGER = ("int_type", "int_from_float", "int_parsing", "int_parsing_size")
NO_NUMBER = ("float_type", "float_parsing", "finite_number")
OUTSIDE = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
MOST_WRITTEN = 1e9
MOST_HOMES, MOST_WORDS = 6, 3
"""Maximum number of tables, and of words that choose tables, in the advice for a key in the wrong table."""
DEPTHS = ("depth_m", "depth", "length_m", "length", "thickness_m")
"""Keys that are tried for the third size of a block."""
"""Bounds from here on are written with a power of ten."""
HINTS = {
    "title": '; every study has one, as title = "Office contents"',
    "models": "; a study has one [[models]] table for each damping law",
    "motions": "; the table [motions] gives the ground motions",
}
"""The advice for keys that must be given, if it is not obvious."""


def refusal(
    errors: ValidationError, content: Any, table: Any, above: tuple[int | str, ...] = ()
) -> tuple[str, tuple[int | str, ...]]:
    """Return the sentence for the first error of `content`, as `refusals` has it."""
    return refusals(errors, content, table, above)[0]


def refusals(
    errors: ValidationError, content: Any, table: Any, above: tuple[int | str, ...] = ()
) -> list[tuple[str, tuple[int | str, ...]]]:
    """Return a sentence and the location for each error of `content`, unknown keys first; `above` locates the table."""
    all_of_them = errors.errors(include_url=False)
    unknown = [error for error in all_of_them if error["type"] == "extra_forbidden"]
    others = [error for error in all_of_them if error not in unknown and not (unknown and error["type"] == "missing")]
    of_keys: dict[str, tuple[str, tuple[int | str, ...]]] = {}
    for error in (*unknown, *others):
        location = _stated(error["loc"], content, error["type"])
        key = _written((*above, *location))
        # (rules that join tables come in one error, a line each)
        for i, sentence in enumerate(_sentence(error, location, key, table, content).split("\n")):
            of_keys.setdefault(f"{key}{i or ''}", (sentence, (*above, *location)))
    return list(of_keys.values())


def _sentence(error: Any, location: tuple[int | str, ...], key: str, table: Any, content: Any) -> str:
    """Return the sentence for one error."""
    kind, value = error["type"], error["input"]
    if kind == "extra_forbidden":
        return _unknown(key, location, table, content)
    if kind in NO_CHOICE and isinstance(value, dict):
        return _no_choice(key, value, _at(table, location, content)[0])
    if kind == "missing":
        return f"key {shown(key, 120)} is missing{HINTS.get(key, '')}"
    if kind in NO_LIST and isinstance(value, dict):
        field = _field(table, location, content)[0]
        if field is None or next(tables_of(field.annotation), None) is not None:
            return f"{key}: there may be several: write [[{key}]] for each, not [{key}]"
        return f"{key}: must be a list, not a table: write {location[-1]} = [...]; a unit is a key beside it"
    if kind in NO_TABLE:
        return f"{key}: {_no_table(location, key, value)}"
    if kind == "value_error":
        message = str(error["msg"]).removeprefix("Value error, ")
        return f"{key}: {message}" if key else message
    return f"{key}: {_allowed(kind, location, _field(table, location, content), error)}, got {_as_written(value)}"


def _no_choice(key: str, content: dict[str, Any], annotation: Any) -> str:
    """The sentence for a table whose word is none of those that choose its other keys."""
    chosen = next(tables_of(annotation)).alternative
    assert chosen is not None
    name, words = chosen[0].word_of(content)
    where = f"{key}.{name}".lstrip(".")
    if name not in content:
        return f"key {shown(where, 120)} is missing"
    if not isinstance(content[name], str):
        return f"{where}: must be text in quotes, got {_as_written(content[name])}"
    try:
        checked(content[name], words)
    except ValueError as error:
        return f"{where}: {error}"
    raise AssertionError(where)


def _unknown(key: str, location: tuple[int | str, ...], table: Any, content: Any) -> str:
    """The sentence for an unknown key: its place, the key that may be meant, or the keys that are allowed."""
    name = str(location[-1])
    fields = fields_of(table, content)
    if len(location) > 1 and name in fields:
        if next(tables_of(fields[name].annotation), None) is not None:
            return f"unknown key {shown(key, 120)}: {name} is a table of the file itself, write {_header(name, fields)}"
        inside = _written(tuple(part for part in location[:-1] if isinstance(part, str)))
        return (
            f"unknown key {shown(key, 120)}: {name} is a key of the whole file, and every line below [{inside}] "
            "belongs to that table; move it above the first [table]"
        )
    inside, value = _at(table, location[:-1], content)
    known = list(fields_of(inside, value))
    if name in DEPTHS and "width_m" in known:
        return (
            f"unknown key {shown(key, 120)}: width_m is the size in the direction in which the block tips, which of a "
            "bookcase is its depth from front to back; its length along the wall is not needed"
        )
    others = {table.alternative[1]: table for table in tables_of(inside) if table.alternative is not None}
    words = [tag for tag, table in others.items() if name in table.model_fields]
    if words:
        return f"unknown key {shown(key, 120)}: {name} belongs to {_choices(words, others, location)}"
    near = meant(name, known)
    homes = [
        _header(top, fields)
        for top, field in fields.items()
        if top not in location and any(name in table.model_fields for table in tables_of(field.annotation))
    ]
    hint = f", allowed are {', '.join(known)}"
    if near:
        hint = f"; {near}"
    elif 0 < len(homes) <= MOST_HOMES and len(location) > 1:
        hint = f"; {name} is a key of {', '.join(homes)}"
    return f"unknown key {shown(key, 120)}{hint}"


def _choices(tags: list[str], every: Iterable[str], location: tuple[int | str, ...]) -> str:
    """The words that choose tables, by their keys; a key alone with all of its words."""
    by_key: dict[str, list[str]] = {}
    for key, _, word in (tag.partition("=") for tag in tags):
        by_key.setdefault(key, []).append(f'"{word}"')
    all_words = Counter(tag.partition("=")[0] for tag in every)
    table = "".join(f"{part}." for part in location[:-1] if isinstance(part, str))
    texts = {
        key: ""
        if len(words) == all_words[key]
        else f" = {', '.join(words[:MOST_WORDS])}"
        + (f" and {len(words) - MOST_WORDS} more" if MOST_WORDS < len(words) < all_words[key] else "")
        for key, words in by_key.items()
    }
    return " or ".join(f"{table}{key}{text}" for key, text in texts.items())


def _header(name: str, fields: dict[str, FieldInfo]) -> str:
    return f"[[{name}]]" if "list" in str(fields[name].annotation) else f"[{name}]"


def _allowed(kind: str, location: tuple[int | str, ...], of_key: tuple[FieldInfo | None, str], error: Any) -> str:
    """The requirement on a value by the table: its kind, bounds and unit."""
    field, name = of_key
    bounds = "" if field is None else _bounds(field)
    unit = "" if field is None else UNIT_SUFFIXES.get(suffix_of(name), "")
    of = f"{f' {bounds}' if bounds else ''}{f' (in {unit})' if unit else ''}"
    value, context = error["input"], error.get("ctx", {})
    plain = ", without quotes" if isinstance(value, str) else ""
    if kind in NO_INTEGER:
        return f"must be a whole number{of}{plain}"
    if kind in NO_NUMBER:
        return f"must be a {'finite ' if kind == 'finite_number' else ''}number{of}{plain}"
    if kind in OUTSIDE:
        return f"must be{of}"
    if kind == "bool_type":
        return "must be true or false, without quotes"
    if kind == "string_type":
        return "must be text in quotes"
    if kind in NO_LIST and field is not None and next(tables_of(field.annotation), None) is not None:
        return f"must be tables: write [[{_written(location)}]] and its keys below it for each"
    if kind in NO_LIST:
        return f"must be a list: put it in brackets, as [{_as_written(value)}]"
    if kind in ("too_short", "too_long"):
        end, number = ("least", "min_length") if kind == "too_short" else ("most", "max_length")
        entries = "entry" if context[number] == 1 else "entries"
        return f"must hold at {end} {context[number]:,} {entries}"
    if kind in ("string_too_short", "string_too_long"):
        end, number = ("least", "min_length") if kind == "string_too_short" else ("most", "max_length")
        letters = "character" if context[number] == 1 else "characters"
        return f"must hold at {end} {context[number]:,} {letters}"
    if kind == "literal_error":
        return f"must be {context['expected']}"
    message: str = error["msg"]
    return f"{message[0].lower()}{message[1:]}"


def _bounds(field: FieldInfo) -> str:
    """The bounds of a number in the table: '> 0 and <= 1'."""
    signs = ((">", "gt", "above"), (">=", "ge", "at_least"), ("<", "lt", "below"), ("<=", "le", "at_most"))
    bounds = []
    for limit in (*field.metadata, *_limits(field.annotation)):
        for sign, *names in signs:
            for bound in (getattr(limit, name, None) for name in names):
                if bound is not None:
                    bounds.append(f"{sign} {bound:,.0f}" if 10.0 <= bound < MOST_WRITTEN else f"{sign} {bound:g}")
    return " and ".join(dict.fromkeys(bounds))


def _limits(annotation: Any) -> Iterator[Any]:
    """Yield the annotations of the numbers of a type: optional numbers, numbers in lists, or one of several types."""
    for part in get_args(annotation):
        if isinstance(part, FieldInfo):
            yield from part.metadata
        elif isinstance(part, Parameter):
            yield part
        elif next(tables_of(part), None) is None:
            yield from _limits(part)


def _field(table: Any, location: tuple[int | str, ...], content: Any) -> tuple[FieldInfo | None, str]:
    """Return the field of the key at `location` (None if the table has none), and the name of the key."""
    names = [i for i, part in enumerate(location) if isinstance(part, str)]
    if not names:
        return None, ""
    annotation, value = _at(table, location[: names[-1]], content)
    name = str(location[names[-1]])
    return fields_of(annotation, value).get(name), name


def _at(table: Any, location: tuple[int | str, ...], content: Any) -> tuple[Any, Any]:
    """Return the annotation and the content at a location of a table."""
    annotation = table
    for part in location:
        named = next(
            (get_args(kind)[1] for kind in (annotation, *get_args(annotation)) if get_origin(kind) is dict), None
        )
        field = fields_of(annotation, content).get(part) if isinstance(part, str) and named is None else None
        if named is not None:  # (of a table whose keys are names, such as inputs, which fields may have, too)
            annotation = named
        elif field is not None:
            partial = next((mark.table for mark in field.metadata if isinstance(mark, PartialTable)), None)
            annotation = field.annotation if partial is None else partial
        inside = isinstance(content, dict) and part in content
        whole = isinstance(content, list) and isinstance(part, int) and part < len(content)
        content = content[part] if inside or whole else None
    return annotation, content


def _as_written(value: Any) -> str:
    """Return a value as text in the notation of TOML, if Python's differs."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if hasattr(value, "isoformat") else shown(value)


def _no_table(location: tuple[int | str, ...], key: str, value: Any) -> str:
    """The advice if a value is given instead of a table."""
    if location and location[-1] == "levels":
        values = shown(value) if isinstance(value, list) else "[0.1, 0.2]"
        return f'levels need their unit: write levels = {{ values = {values}, unit = "g" }}, or another unit'
    if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
        return f"there is one only: write [{key}], not [[{key}]]"
    if location and isinstance(location[-1], int):
        several = _written(location[:-1])
        return f"must be a table: write [[{several}]] and its keys below it, got {_as_written(value)}"
    return f"must be a table: write [{key}] and its keys below it, got {_as_written(value)}"


def _stated(location: tuple[int | str, ...], content: Any, kind: str) -> tuple[int | str, ...]:
    """Return the parts of a location that are in the file, without those that name one of several types."""
    at = content
    kept: list[int | str] = []
    for i, part in enumerate(location):
        whole = isinstance(at, list) and isinstance(part, int) and part < len(at)
        if part in at if isinstance(at, dict) else whole:
            at = at[part]
        elif not (kind == "missing" and i == len(location) - 1):
            continue
        kept.append(part)
    return tuple(kept)


def _written(location: tuple[int | str, ...]) -> str:
    """Return a location as text, counted from 1: blocks[2].width_m."""
    return "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
