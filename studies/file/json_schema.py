"""The schema of study files as JSON Schema (draft 2020-12), for editors, other programs and the documentation.

The schema holds the rules of single keys; rules that join several keys are checked when a study is read.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic.fields import FieldInfo

from .include import INCLUDE, tables_of
from .schema import ANALYSES, StudyFile
from .table import UNIT_SUFFIXES, KeyInfo, PartialTable, Table, sentences_of, suffix_of

BOUNDS = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")
DIALECT = "https://json-schema.org/draft/2020-12/schema"


@cache
def study_schema() -> dict[str, Any]:
    """Return the JSON schema of a study file: draft 2020-12, every key with its description, unit and default."""
    schema = StudyFile.model_json_schema(by_alias=True)
    definitions = schema.pop("$defs")
    partial: list[tuple[dict[str, Any], Any]] = []
    for table in all_tables():
        properties = schema if table is StudyFile else definitions[table.__name__]
        sentences = sentences_of(table)
        for name, field in table.model_fields.items():
            key = field.alias or name
            described = {"description": sentences.get(key, ""), **properties["properties"][key]}
            properties["properties"][key] = made = _property(described, key, field)
            partial += [(made, mark.table) for mark in field.metadata if isinstance(mark, PartialTable)]
        properties["description"] = (table.__doc__ or "").partition("\n\n")[0]
    for made, tables in partial:
        made["properties"] = merged([definitions[table.__name__] for table in tables_of(tables)])
        made["additionalProperties"] = False
    needed = schema.pop("required")
    return {
        "$schema": DIALECT,
        **schema,
        "title": "toppling study file",
        # keys that a file lacks may be given in the files that it includes
        "if": {"not": {"required": [INCLUDE]}},
        "then": {"required": needed, "oneOf": [{"required": [name]} for name in ANALYSES]},
        "$defs": definitions,
    }


def merged(tables: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the keys of several tables: each with all that it may be in one of them."""
    kinds_of: dict[str, list[dict[str, Any]]] = {}
    for table in tables:
        for key, about in table["properties"].items():
            plain = {name: value for name, value in about.items() if name not in ("description", "default")}
            if plain not in kinds_of.setdefault(key, []):
                kinds_of[key].append(plain)
    return {key: kinds[0] if len(kinds) == 1 else {"anyOf": kinds} for key, kinds in kinds_of.items()}


def all_tables(table: type[Table] = StudyFile) -> list[type[Table]]:
    """Return a class of tables and all classes of tables in it, each once, in their order."""
    tables = [table]
    for field in table.model_fields.values():
        for inner in tables_of(field.annotation):
            tables += [inner_table for inner_table in all_tables(inner) if inner_table not in tables]
    return tables


def unit_of(key: str, field: FieldInfo) -> str:
    """Return the unit of a key by its ending, else by its annotation; '' if neither has one."""
    return UNIT_SUFFIXES.get(suffix_of(key), "") or _key_info(field).unit


def _key_info(field: FieldInfo) -> KeyInfo:
    return next((annotation for annotation in field.metadata if isinstance(annotation, KeyInfo)), KeyInfo())


def _property(made: dict[str, Any], key: str, field: FieldInfo) -> dict[str, Any]:
    """Return the schema of a key by pydantic, without null, which TOML lacks, and with the key's annotation."""
    about = _key_info(field)
    plain = {name: value for name, value in made.items() if name not in {"title", "anyOf", "default"}}
    types = [kind for kind in made.get("anyOf", []) if kind != {"type": "null"}]
    plain |= types[0] if len(types) == 1 else {"anyOf": types} if types else {}
    numbers = list(_numbers(plain))
    for number in numbers:  # (equal bounds of two keys are one object: 0 or 0.0, whichever was loaded first)
        kind = {"number": float, "integer": int}[number["type"]]
        number |= {name: kind(number[name]) for name in BOUNDS if name in number}
    unit = unit_of(key, field)
    if unit or any(number["type"] == "number" for number in numbers):
        plain["unit"] = unit or "1"
    default = made.get("default") if about.default is None else about.default
    if default is None:
        return plain
    words = plain.get("enum")
    if isinstance(default, str) and not (words and default in words) and about.default is not None:
        return {**plain, "description": f"{plain['description']} Where not given: {default}."}
    return {**plain, "default": default}


def _numbers(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the parts of a property that are numbers."""
    if schema.get("type") in {"number", "integer"}:
        yield schema
    parts = [*schema.get("anyOf", []), *schema.get("prefixItems", []), schema.get("items")]
    for part in parts:
        if isinstance(part, dict):
            yield from _numbers(part)
