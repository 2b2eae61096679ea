"""The page of study files, from their JSON schema: every key, the keys of one generator, law …, and kinds of doubts."""

from collections.abc import Iterator, Sequence
from typing import Any

from toppling.core.doubts import KINDS
from toppling.studies.file.json_schema import study_schema

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
    "year, peaks of 2 g or 4 m/s in 475 years), end below 0.01 g, contradict others or comments, are one branch, or "
    "lack a measure",
    "selection": "stripes whose motions do not agree with the hazard, disaggregations of another level",
    "ringing": "floor motions that end while the building sways with more than a fifth of its peak acceleration",
    "collapse": "ground motions under which a building that yields collapses",
    "strike": "motions under which an isolated platform moves further than its clearance (`stop_frequency_hz`)",
    "rocks first": "blocks that slide, under so much friction that they would rock",
    "slides on": "motions at whose end blocks still slide: add zeros after records, or friction is next to nothing",
    "scaling": "recordings scaled by less than 0.2 or more than 5 before they go through a building or an isolator "
    "that yields",
    "structure": "columns of a structure or block beside others of the ground",
    "misfit": "matched motions whose mean misfit is above 5 %, or whose PGV or PGD leave their bounds (`pgv_bound`)",
    "table": "lines that lack cells or are cut, factors not applied, what is left out, hidden cells, unlikely pairs, "
    "floors counted from 1",
}
"""Kinds of doubts: what each questions."""


def key_reference() -> str:
    """Return the reference of all keys in Markdown; tables in the order in which a study names them."""
    schema = study_schema()
    parts = []
    for heading, about, tables in _places(schema, "The study itself: keys before the first table.", [schema], ""):
        several = len(tables) > 1
        titles = ["key", "meaning", "unit", "default", "type", *["for"] * several]
        lines = [_line(titles), _line(["---"] * len(titles))]
        for cells, words in _rows(tables).items():
            of = ["all" if len(words) == len(tables) else ", ".join(words)]
            lines.append(_line([*cells, *of * several]))
        parts.append("\n".join([f"### {heading or 'Top of the file'}", "", about, "", *lines, ""]))
    return "\n".join(parts)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _rows(tables: list[dict[str, Any]]) -> dict[tuple[str, ...], list[str]]:
    """Return the cells of all keys of tables among which a word chooses, each key once, with the words that have it."""
    words_of: dict[tuple[str, ...], list[str]] = {}
    for table in tables:
        needed = [*table.get("required", ()), *table.get("then", {}).get("required", ())]
        words = [
            f"`{about['const']}`" for key, about in table["properties"].items() if "const" in about and key in needed
        ]
        word = words[0] if words else f"`{needed[0]}`" if needed else ""
        for key, about in table["properties"].items():
            given = {name: value for name, value in about.items() if name != "const" or key not in needed}
            words_of.setdefault(_cells(key, given, key in needed), []).append(word)
    return words_of


def _places(
    schema: dict[str, Any], text: str, tables: list[dict[str, Any]], path: str
) -> Iterator[tuple[str, str, list[dict[str, Any]]]]:
    """Yield the tables of a place, of which a word chooses one, and those in them, after heading and text."""
    brackets = f"`[[{path.removesuffix('[]')}]]`" if path.endswith("[]") else f"`[{path}]`"
    yield brackets if path else "", text, tables
    seen = set()
    for table in tables:
        for key, about in table["properties"].items():
            names, mark = _tables_in(about)
            if names and key not in seen:
                seen.add(key)
                place = f"{path.removesuffix('[]')}.{key}".lstrip(".")
                inner = [schema["$defs"][name] for name in names]
                of_key = about["description"].partition(NAMED)[0]
                yield from _places(schema, of_key if len(inner) > 1 else inner[0]["description"], inner, place + mark)


def _tables_in(about: dict[str, Any]) -> tuple[list[str], str]:
    """Return the tables that a key may hold, and '[]' for a list of tables or '.NAME' for tables with names."""
    for part, mark in ((about, ""), (about.get("items"), "[]"), (about.get("additionalProperties"), ".NAME")):
        if not isinstance(part, dict):
            continue
        parts = [part, *part.get("anyOf", []), *part.get("oneOf", [])]
        parts += [inner for either in parts[1:] for inner in either.get("oneOf", [])]
        names = [about["$ref"].rpartition("/")[2] for about in parts if "$ref" in about]
        if names:
            return names, mark
    return [], ""


def _cells(key: str, about: dict[str, Any], needed: bool) -> tuple[str, ...]:
    meaning, _, default = about["description"].partition(NAMED)
    if needed:
        default = "must be given"
    elif "default" in about:
        plain = about["default"]
        default = f"`{str(plain).lower() if isinstance(plain, bool) else _number(plain)}`"
    cells = (f"`{key}`", meaning, about.get("unit", ""), default.removesuffix("."), _type(about))
    return tuple(cell.replace("|", "\\|") for cell in cells)


def _type(about: dict[str, Any]) -> str:
    """The type of a value in words."""
    if "const" in about:
        return f"`{about['const']}`"
    if "properties" in about:
        return "table"
    names, mark = _tables_in(about)
    if names and "anyOf" not in about:
        return {"": "table", "[]": "tables", ".NAME": "a table each"}[mark]
    if "enum" in about:
        return ", ".join(f"`{word}`" for word in about["enum"])
    if "anyOf" in about and "type" not in about:
        return " or ".join(_type(part) for part in about["anyOf"])
    if about.get("type") == "array":
        if "prefixItems" in about:
            return f"list of {len(about['prefixItems'])}"
        return f"list of {_type(about['items'])}"
    if "oneOf" in about:
        return " or ".join(_type(part) for part in about["oneOf"])
    words = {"string": "text", "boolean": "true or false", "integer": "whole number", "object": "table"}
    kind = words.get(about.get("type", ""), "number")
    return kind + ",".join(
        f" {sign} {_number(about[word])}"
        for word, sign in (
            ("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤"),
        )
        if word in about
    )  # fmt: skip


def _number(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_number, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def doubts_section() -> str:
    """The section of the kinds of doubts that a study can accept."""
    rows = "".join(f"| `{kind}` | {DOUBTS[kind]} |\n" for kind in KINDS)
    return f"\n## Kinds of doubts\n\nWhat `accept` names.\n\n| kind | what is odd |\n|---|---|\n{rows}"
