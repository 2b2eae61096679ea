"""The reference of all keys of a study file in Markdown: meaning, unit, default and type, a table for each TOML table.

The reference is made from the JSON schema, so that page, schema and reader cannot differ.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from .json_schema import study_schema

HEAD = "| key | meaning | unit | default | type |\n|---|---|---|---|---|\n"
NAMED = " Where not given: "


class PlacedTable(NamedTuple):
    """A table of a study file: its heading there, and its part of the schema."""

    heading: str
    table: dict[str, Any]


def key_reference() -> str:
    """Return the reference of all keys in Markdown; tables in the order in which a study names them."""
    schema = study_schema()
    parts = []
    for place in _places(schema, schema, ""):
        needed = set(place.table.get("required", ())) | set(place.table.get("then", {}).get("required", ()))
        rows = [_row(key, one, key in needed) for key, one in place.table["properties"].items()]
        about = place.table["description"] if place.heading else "The study itself: keys before the first table."
        parts.append(f"### {place.heading or 'Top of the file'}\n\n{about}\n\n{HEAD}{''.join(rows)}")
    return "\n".join(parts)


def _places(schema: dict[str, Any], table: dict[str, Any], path: str) -> Iterator[PlacedTable]:
    """Yield a table and the tables in it, each with its heading."""
    brackets = f"`[[{path.removesuffix('[]')}]]`" if path.endswith("[]") else f"`[{path}]`"
    yield PlacedTable(brackets if path else "", table)
    for key, one in table["properties"].items():
        inner, several = _table_in(one)
        if inner is None or ("description" in one and one["description"].startswith("Keys of [")):
            continue
        here = f"{path.removesuffix('[]')}.{key}".lstrip(".")
        yield from _places(schema, schema["$defs"][inner], here + several)


def _table_in(one: dict[str, Any]) -> tuple[str | None, str]:
    """Return the table that a key holds, and '[]' for a list of tables or '.NAME' for tables with names."""
    either = [(part, "") for part in one.get("oneOf", [])]
    for part, mark in (*either, (one, ""), (one.get("items"), "[]"), (one.get("additionalProperties"), ".NAME")):
        if isinstance(part, dict) and "$ref" in part:
            return part["$ref"].rpartition("/")[2], mark
    return None, ""


def _row(key: str, one: dict[str, Any], needed: bool) -> str:
    meaning, _, default = one["description"].partition(NAMED)
    if needed:
        default = "must be given"
    elif "default" in one:
        default = f"`{str(one['default']).lower() if isinstance(one['default'], bool) else _number(one['default'])}`"
    cells = (f"`{key}`", meaning, one.get("unit", ""), default.removesuffix("."), _type(one))
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


def _type(one: dict[str, Any]) -> str:
    """The type of a value in words."""
    if "oneOf" in one:
        return " or ".join(_type(part) for part in one["oneOf"])
    if "const" in one:
        return f"`{one['const']}`"
    inner, mark = _table_in(one)
    if inner is not None:
        return {"": "table", "[]": "tables", ".NAME": "a table each"}[mark]
    if "enum" in one:
        return ", ".join(f"`{word}`" for word in one["enum"])
    if "anyOf" in one and "type" not in one:
        return " or ".join(_type(part) for part in one["anyOf"])
    if one.get("type") == "array":
        if "prefixItems" in one:
            return f"list of {len(one['prefixItems'])}"
        return f"list of {_type(one['items'])}"
    words = {"string": "text", "boolean": "true or false", "integer": "whole number", "object": "table"}
    kind = words.get(one.get("type", ""), "number")
    return kind + ",".join(
        f" {sign} {_number(one[word])}"
        for word, sign in (
            ("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤"),
        )
        if word in one
    )  # fmt: skip


def _number(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
