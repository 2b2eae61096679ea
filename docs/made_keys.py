"""The page of study files, from their JSON schema: every key, the keys of one generator, law …, and kinds of doubts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING
from typing import Any

from made_schema import study_schema

from toppling.core.doubts import KINDS
from toppling.models import LAWS
from toppling.motions import ENVELOPES, GENERATORS, PULSES
from toppling.studies.file import blocks, code, motions, supports, uncertainty
from toppling.studies.file.table import bare

HEAD = "| key | meaning | unit | default | type |\n|---|---|---|---|---|\n"
NAMED = " Where not given: "
DOUBTS = {
    "block size": "sides above 20 m or below 0.01 m, widths above 1.5 m, and centres of mass lower than half the width "
    "(sides above 100 m or below 0.001 m refused)",
    "units": "dampings, restitutions, masses, strengths, distances, periods, filters … that suggest another unit",
    "building": "periods, dampings and heights of buildings, benches and isolators that suggest another unit",
    "level": "levels above 5 g or 10 m/s (above 50 g or 100 m/s refused), and levels of stripes or histories that "
    "their unscaled motions miss (stripes: by more than 10 %; by more than a factor of 1.5 refused)",
    "scenario": "earthquakes and sites outside of a generator's data, or motions unlike a ground-motion model's",
    "spectra": "records that are copies or multiples, and ensembles of nearly one spectrum: a dispersion of PGV/PGA "
    "below 0.3, or of Sa(1 s)/Sa(0.2 s) below 0.45, each with 95 % confidence (earthquakes: 0.52 and 0.73)",
    "vertical": "vertical components of records, left out, or shaking blocks as horizontal ones where they are named",
    "offset": "records whose mean is above 1 % of their PGA: raw samples (`baseline_order`)",
    "drift": "records whose velocity at the end is above 10 % of their PGV: an offset or a cut record (`highpass_hz`)",
    "displacement": "records whose PGD is above a quarter of their duration times their PGV (`highpass_hz`)",
    "PGA": "motions with a PGA above 3 g (above 20 g refused): gal or per cent headed g; spikes and clipped peaks",
    "PGV/PGA": "records whose PGV/PGA lies outside 0.01 to 0.8 s: another time step, or velocity headed acceleration",
    "duration": "motions longer than 900 s, steps of a second, and arrays that look transposed (`window`)",
    "hazard": "hazards that are more frequent or stronger than at any site (0.1 g or 0.1 m/s more than 0.2 times per "
    "year, peaks of 2 g or 4 m/s in 475 years), end below 0.01 g, contradict others, are one branch, or lack a measure",
    "selection": "stripes whose motions do not agree with the hazard, disaggregations of another level",
    "ringing": "floor motions that end while the building sways with more than a fifth of its peak acceleration",
    "collapse": "ground motions under which a building that yields collapses",
    "strike": "motions under which an isolated platform moves further than its clearance (`stop_frequency_hz`)",
    "rocks first": "blocks that slide, under so much friction that they would rock",
    "slides on": "motions at whose end blocks still slide: add zeros after records, or friction is next to nothing",
    "scaling": "recordings scaled by less than 0.2 or more than 5 before they go through a building or an isolator "
    "that yields",
    "misfit": "matched motions whose mean misfit is above 5 %, or whose PGV or PGD leave their bounds (`pgv_bound`)",
    "table": "lines that lack cells or are cut, factors not applied, what is left out, hidden cells, unlikely pairs",
}
"""Kinds of doubts: what each questions."""


def key_reference() -> str:
    """Return the reference of all keys in Markdown; tables in the order in which a study names them."""
    schema = study_schema()
    parts = []
    for heading, table in _places(schema, schema, ""):
        needed = set(table.get("required", ())) | set(table.get("then", {}).get("required", ()))
        rows = [_row(key, one, key in needed) for key, one in table["properties"].items()]
        about = table["description"] if heading else "The study itself: keys before the first table."
        parts.append(f"### {heading or 'Top of the file'}\n\n{about}\n\n{HEAD}{''.join(rows)}")
    return "\n".join(parts)


def _places(schema: dict[str, Any], table: dict[str, Any], path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a table and the tables in it, each after its heading."""
    brackets = f"`[[{path.removesuffix('[]')}]]`" if path.endswith("[]") else f"`[{path}]`"
    yield brackets if path else "", table
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


def of_classes(table: str, classes: Mapping[str, Any]) -> dict[str, tuple[set[str], set[str]]]:
    """Return, by name, the keys of a table that an instance of each class takes, and those that it must be given."""
    keys = study_schema()["$defs"][table]["properties"]
    found = {}
    for name, one in classes.items():
        fields = {key: one.__dataclass_fields__[bare(key)] for key in keys if bare(key) in one.__dataclass_fields__}
        plain = {key for key, field in fields.items() if field.default is field.default_factory is MISSING}
        found[name] = set(fields) - {"law"}, {key for key in plain if "default" not in keys[key]}
    return found


def doubts_section() -> str:
    """The section of the kinds of doubts that a study can accept."""
    rows = "".join(f"| `{kind}` | {DOUBTS[kind]} |\n" for kind in KINDS)
    return f"\n## Kinds of doubts\n\nWhat `accept` names.\n\n| kind | what is odd |\n|---|---|\n{rows}"


def choices_section() -> str:
    """The section of the page of all keys that says which keys belong to which choice."""
    tables: dict[str, Mapping[str, tuple[set[str], set[str]]]] = {
        "`law` of `[[models]]`": of_classes("ModelTable", LAWS),
        "`generator` of `[motions]`": of_classes("MotionsTable", GENERATORS),
        "`pulse` of `[motions]`": of_classes("MotionsTable", PULSES),
        "`kind` of `[motions.envelope]`": of_classes("EnvelopeTable", ENVELOPES),
        "`kind` of `[building]`": motions.BUILDINGS,
        "`kind` of `[building.isolation]`": motions.ISOLATORS,
        "`kind` of `[support]`": supports.KINDS,
        "`kind` of `[restraints.NAME]`": {
            kind: (keys, set(blocks.RESTRAINT_NEEDS[kind])) for kind, keys in blocks.RESTRAINT_KEYS.items()
        },
        "`standard` of `[performance.code]`": code.STANDARDS,
        "`distribution` of `[uncertainty.inputs.NAME]`": {
            name: ({*given, *more}, set(given)) for name, (_, given, more) in uncertainty.DISTRIBUTIONS.items()
        },
    }
    parts = ["\n## Keys of one choice\n\nKeys in bold must be given.\n\n| choice | name | its keys |\n|---|---|---|\n"]
    for choice, names in tables.items():
        for name, (own, needed) in names.items():
            keys = ", ".join(f"**`{key}`**" if key in needed else f"`{key}`" for key in sorted(own))
            parts.append(f"| {choice} | `{name}` | {keys} |\n")
    return "".join(parts)
