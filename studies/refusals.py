"""What a study file does not hold, as one sentence in a user's words: the key, the value and what is allowed."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from .include import tables_of
from .tables import Table, nearest, shown

NO_TABLE = ("model_type", "model_attributes_type", "dict_type")
NO_LIST = ("list_type", "tuple_type")
HINTS = {
    "title": '; every study has one, as title = "Office contents"',
    "models": "; a study has one [[models]] table for each damping law",
    "motions": "; the table [motions] says what shakes the blocks",
}
"""What to write for keys that must be given, where it is not plain."""


def said(errors: ValidationError, content: Any, table: type[Table]) -> tuple[str, tuple[str, ...]]:
    """What `content`, which should be a `table`, does not hold: the sentence, and where it is."""
    found = errors.errors(include_url=False, include_context=False)
    # an unknown key is likely the cause of one that is missing: say it first
    error = min(found, key=lambda one: one["type"] != "extra_forbidden")
    kind = error["type"]
    location = _stated(error["loc"], content, kind)
    names = tuple(part for part in location if isinstance(part, str))
    key = _written(location)
    value = error["input"]
    if kind == "extra_forbidden":
        known = _known_keys(table, location[:-1])
        near = nearest(str(location[-1]), known)
        hint = f"; did you mean {near!r}?" if near else f", allowed are {', '.join(known)}"
        return f"unknown key {shown(key, 120)}{hint}", names
    if kind == "missing":
        return f"key {shown(key, 120)} is missing{HINTS.get(key, '')}", names
    if kind in NO_LIST and isinstance(value, dict):
        return f"{key}: there may be several: write [[{key}]] for each, not [{key}]", names
    if kind in NO_TABLE:
        return f"{key}: {_no_table(location, key, value)}", names
    message = error["msg"].removeprefix("Value error, ")
    if kind == "value_error":
        return (f"{key}: {message}" if key else message), names
    return f"{key}: {message[0].lower()}{message[1:]}, got {shown(value)}", names


def _no_table(location: tuple[int | str, ...], key: str, value: Any) -> str:
    """What to write where something else stands in a table's place."""
    if location and location[-1] == "levels":
        values = shown(value) if isinstance(value, list) else "[0.1, 0.2]"
        return f'levels need their unit: write levels = {{ values = {values}, unit = "g" }}, or another unit'
    if isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        return f"there is one only: write [{key}], not [[{key}]]"
    return f"must be a table: write [{key}] and its keys below it, got {shown(value)}"


def _stated(location: tuple[int | str, ...], content: Any, kind: str) -> tuple[int | str, ...]:
    """The parts of a location that stand in the file: those that name one of several types do not."""
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
    """A location as people write it: blocks[2].width_m, counted from 1."""
    return "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")


def _known_keys(table: type[Table], location: tuple[int | str, ...]) -> list[str]:
    """The keys allowed at `location` in a table."""
    for part in location:
        fields = {field.alias or name: field for name, field in table.model_fields.items()}
        if isinstance(part, str) and part in fields:
            table = next(tables_of(fields[part].annotation), table)
    return [field.alias or name for name, field in table.model_fields.items()]
