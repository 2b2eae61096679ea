"""The state of the live page: a study file, its edits one key at a time, and the file in which it is kept."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ...core.parameters import declared
from ...core.wording import about_years
from ...core.writing import write_bytes
from ...models import Block, catalogue
from ...models.friction import CONTACTS
from ...models.laws import LAWS
from ..file.blocks import BlockTable
from ..file.include import read_content, refuse_text
from ..file.json_schema import study_schema
from ..file.refusals import refusals
from ..file.schema import StudyFile
from ..file.table import UNIT_FACTORS, WRITTEN, all_errors
from ..text.error import StudyError, writing

START = Path(__file__).parent / "piece.toml"
ENDING = ".live.toml"
PIECE_STATE, BUILDING_STATE = f"piece{ENDING}", f"building{ENDING}"
"""Files of the states of a page without a study, in its folder."""
MOST_TEXT = 200
"""Most characters of a value."""
LENGTHS = {unit: UNIT_FACTORS[unit][0] for unit in ("cm", "mm", "in")}
"""Units in which sizes are typed, in metres."""
SHOWN = {"motions.distance_m": ("km", 1000.0)}
"""Units of keys that are shown in other units than in the study file."""
NUMBERS = (
    *("blocks.0.width_m", "blocks.0.height_m", "blocks.0.mass_kg", "blocks.0.wall_gap_mm"),
    *("building.period_s", "building.storeys", "motions.magnitude", "motions.distance_m", "motions.vs30_m_s"),
)
"""Keys of numbers that the page edits, in addition to keys of restraints and the hazard's levels."""
SIZES = {"blocks.0.width_m": "width", "blocks.0.height_m": "height"}
OF_RESTRAINTS = ("height_m", "strength_n", "slack_mm", "cost")
PIECE, EARTHQUAKE, REMEDIES, VARIANT = "piece", "earthquake", "remedies", "a"
"""Studies of the page; the last is the variant that the piece is compared with."""
LESS_RESTITUTION = {PIECE: "restitution", EARTHQUAKE: "earthquake-restitution"}
"""Studies of the same with less restitution."""
OF_LAWS = {"models.e": "e", "models.delta": "delta"}
"""Options that the page gives to all laws of a study."""
FREE = "free"
"""Name of the piece without a restraint among the remedies."""


class Field(NamedTuple):
    """A key as the page shows it: its value in the unit shown, the bounds and the sentence of its declaration."""

    path: str
    value: Any
    unit: str
    least: float | None
    most: float | None
    whole: bool
    about: str


def declared_at(content: Mapping[str, Any], path: str) -> dict[str, Any]:
    """Return the schema of a key of a study; KeyError if the study's tables have no such key."""
    node: dict[str, Any] = study_schema()
    value: Any = content
    for part in path.split("."):
        node = _chosen(node, value)
        if part.isdigit():
            node, value = node["items"], value[int(part)] if int(part) < len(value) else {}
        else:
            node = node["properties"][part] if "properties" in node else node["additionalProperties"]
            value = value.get(part, {}) if isinstance(value, Mapping) else {}
    return _chosen(node, value)


def _chosen(node: dict[str, Any], value: Any) -> dict[str, Any]:
    """Return a schema without references, of several alternatives the one that has the words of a value."""
    if "$ref" in node:
        definition: dict[str, Any] = study_schema()["$defs"][node["$ref"].rpartition("/")[2]]
        return {**definition, **{key: text for key, text in node.items() if key == "description"}}
    for alternative in node.get("oneOf", ()):
        table = _chosen(alternative, value)
        words = {key: about["const"] for key, about in table.get("properties", {}).items() if "const" in about}
        needed = {*table.get("required", ())}
        if (
            isinstance(value, Mapping)
            and needed <= {*value}
            and words.items() >= {(key, value[key]) for key in words.keys() & {*value}}
        ):
            return table
    return node


def value_at(content: Any, path: str) -> Any:
    """Return the value of a key, None if it is not given."""
    for part in path.split("."):
        content = content[int(part)] if part.isdigit() else content.get(part) if isinstance(content, Mapping) else None
        if content is None:
            return None
    return content


def hazard_points(content: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Return the points of the hazard curve that the page edits: return period and level."""
    table = content.get("hazard", {})
    pairs = zip(table.get("levels", []), table.get("rates", []), strict=False)
    return [(about_years(rate), level) for level, rate in pairs]


def field(content: Mapping[str, Any], path: str, length: str) -> Field:
    """Return a key as the page shows it, lengths in a unit."""
    about = declared_at(content, path)
    factor, unit = factor_of(path, about.get("unit", ""), length)
    bounds = [about.get(key) for key in ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")]
    least, most = ((first if first is not None else other) for first, other in (bounds[:2], bounds[2:]))
    value = value_at(content, path)
    if value is None and path in SIZES:
        value = _plain(getattr(piece_of(content), SIZES[path]))  # (of an item of the catalogue)
    value = about.get("default") if value is None else value
    shown = _digits(value / factor) if isinstance(value, int | float) else ""
    ends = [None if end is None or end >= 1e6 else float(_digits(end / factor)) for end in (least, most)]
    return Field(path, shown, unit, ends[0], ends[1], about.get("type") == "integer", str(about.get("description", "")))


def factor_of(path: str, unit: str, length: str) -> tuple[float, str]:
    """Return the value of one unit shown in the key's unit, and that unit."""
    if path in SHOWN:
        name, factor = SHOWN[path]
        return factor, name
    if unit in ("m", "mm"):
        return LENGTHS[length] / WRITTEN.get(unit, 1.0), length
    return 1.0, unit


def _digits(value: float) -> str:
    return f"{value:.6g}" if abs(value) < 1e6 else f"{value:.0f}"


def number_of(content: Mapping[str, Any], path: str, text: str, length: str) -> float | int:
    """Return the number that a text gives for a key, in the key's unit; StudyError names what is wrong."""
    about = declared_at(content, path)
    key = path.rpartition(".")[2]
    unit = about.get("unit", "")
    if unit in ("m", "mm") and path not in SHOWN:
        # (a number alone is in the unit of the page)
        typed = re.fullmatch(rf"({_NUMBER.pattern})\s*(m|cm|mm|in|)", text.strip())
        if typed is None or not 0.0 <= float(typed[1]) < math.inf:
            raise StudyError(f"{key}: must be a number >= 0, alone or with m, cm, mm or in, got {text[:40]!r}")
        value = float(typed[1]) * {**LENGTHS, "m": 1.0}[typed[2] or length] / WRITTEN.get(unit, 1.0)
    else:
        value = number_in(text, key)
        value *= SHOWN.get(path, ("", 1.0))[1]
    if about.get("type") == "integer":
        if value != int(value):
            raise StudyError(f"{key}: must be a whole number, got {text[:40]!r}")
        return int(value)
    return float(f"{value:.12g}")


def edited(content: Mapping[str, Any], path: str, text: str, length: str) -> dict[str, Any]:
    """Return a study with one key changed; StudyError for a key that the page does not edit, or a wrong value."""
    if len(text) > MOST_TEXT:
        raise StudyError(f"{path[:40]!r}: must have at most {MOST_TEXT} characters, got {len(text):,}")
    made: dict[str, Any] = copy.deepcopy(dict(content))
    piece = made["blocks"][0]
    if path == "blocks.0.name":
        name = " ".join(text.split())
        refuse_text("name", name)  # (a file with the name could not be read again)
        piece["name"] = name or None
        made["title"] = name or made["title"]
    elif path == "blocks.0.catalogue":
        _take_item(made, text)
    elif path == "wall":
        piece["wall_gap_mm"] = 20.0 if text == "yes" else None
    elif path == "blocks.0.restraint":
        if text and text not in (known := made.get("restraints", {})):
            raise StudyError(f"restraint: must be one of {', '.join(known) or 'none'}, got {text!r}")
        piece["restraint"] = text or None
    elif path.startswith("law.") and path.removeprefix("law.") in LAWS:
        _take_law(made, path.removeprefix("law."), text == "yes")
    elif path in OF_LAWS:
        _set_of_laws(made, OF_LAWS[path], text, length)
    elif path == "feet":
        made.pop("friction", None)
        if text:
            if text not in CONTACTS:
                raise StudyError(f"feet: must be one of {', '.join(CONTACTS)}, got {text[:40]!r}")
            made["friction"] = {"contact": text}
    elif path == "building.floors":
        floors = whole_number(text, "floor", 3)
        if "building" not in made:
            raise StudyError("floor: needs a building")
        made["building"]["floors"] = [floors]
    elif path == "building":
        _build(made, text == "yes")
    elif path == "hazard":
        if text != "points":
            raise StudyError(f"hazard: must be points or a file, got {text[:40]!r}")
        made["hazard"] = start_state()["hazard"]
    elif re.fullmatch(r"hazard\.levels\.\d{1,2}", path) and "levels" in made.get("hazard", {}):
        at = int(path.rpartition(".")[2])
        if at >= len(made["hazard"]["levels"]):
            raise StudyError(f"{path}: the hazard curve has {len(made['hazard']['levels'])} levels")
        made["hazard"]["levels"][at] = positive(text, "hazard.levels")
    elif path in NUMBERS or _of_restraint(made, path):
        _set_number(made, path, text, length)
    else:
        raise StudyError(f"{path[:40]!r}: the page does not edit this key")
    made["blocks"][0] = {key: value for key, value in piece.items() if value is not None}
    return made


_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def number_in(text: str, name: str) -> float:
    """Return the number that a text is; StudyError if it is none."""
    value = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
    if not math.isfinite(value):
        raise StudyError(f"{name}: must be a number, got {text[:40]!r}")
    return value


def whole_number(text: str, name: str, digits: int = 9) -> int:
    """Return the whole number that a text is; StudyError if it is none."""
    if not re.fullmatch(rf"[0-9]{{1,{digits}}}", text.strip()):
        raise StudyError(f"{name}: must be a whole number, got {text[:40]!r}")
    return int(text)


def positive(text: str, name: str) -> float:
    """Return the number above 0 that a text is; StudyError if it is none."""
    value = number_in(text, name)
    if not value > 0.0:
        raise StudyError(f"{name}: must be > 0, got {text[:40]!r}")
    return value


def _of_restraint(content: Mapping[str, Any], path: str) -> bool:
    parts = path.split(".")
    known = content.get("restraints", {})
    return len(parts) == 3 and parts[0] == "restraints" and parts[1] in known and parts[2] in OF_RESTRAINTS


def _set_number(content: dict[str, Any], path: str, text: str, length: str) -> None:
    *tables, key = path.split(".")
    table: Any = content
    for part in tables:
        table = table[int(part)] if part.isdigit() else table.get(part)
        if table is None:
            raise StudyError(f"{path}: the study has no table {part}")
    if not text.strip() and key in ("mass_kg", "cost"):
        table.pop(key, None)
        return
    if path in SIZES:
        before = piece_of(content)
        table.pop("catalogue", None)
        table |= {"width_m": _plain(before.width), "height_m": _plain(before.height)}
    value = number_of(content, path, text, length)
    if path == "blocks.0.height_m":
        _move_restraints(content, float(value) - table["height_m"])
    table[key] = value
    if path == "building.storeys":
        content["building"]["floors"] = [min(floor, int(value)) for floor in content["building"].get("floors", [0])]


def _move_restraints(content: dict[str, Any], change: float) -> None:
    """Keep the distance between restraints and the upper edge of the piece, whose height changes."""
    for restraint in content.get("restraints", {}).values():
        if "height_m" in restraint:
            restraint["height_m"] = _plain(max(0.1, restraint["height_m"] + change))


def _take_item(content: dict[str, Any], name: str) -> None:
    """Make the piece an item of the catalogue; '' keeps its sizes as sizes of its own."""
    piece, before = content["blocks"][0], piece_of(content)
    if not name:
        piece.pop("catalogue", None)
        piece |= {"width_m": _plain(before.width), "height_m": _plain(before.height)}
        return
    if name not in catalogue:
        raise StudyError(f"catalogue: no item {name[:60]!r}; choose one of the list")
    for key in ("width_m", "height_m", "cm_height_m", "inertia_factor", "alpha_rad", "R_m"):
        piece.pop(key, None)
    piece |= {"catalogue": name, "name": name}
    content["title"] = name
    _move_restraints(content, piece_of(content).height - before.height)


def laws_with(content: Mapping[str, Any], key: str) -> list[int]:
    """Return the positions of the laws of a study that have an option."""
    models = enumerate(content["models"])
    return [i for i, model in models if model.get("law") in LAWS and key in declared(LAWS[model["law"]])]


def _set_of_laws(content: dict[str, Any], key: str, text: str, length: str) -> None:
    """Give an option to all laws that have it; '' gives each law its usual one."""
    for i in laws_with(content, key):
        content["models"][i].pop(key, None)
        if text.strip():
            content["models"][i][key] = number_of(content, f"models.{i}.{key}", text, length)


def _take_law(content: dict[str, Any], law: str, wanted: bool) -> None:
    others = [model for model in content["models"] if model.get("law") != law]
    content["models"] = [*others, *([{"law": law}] if wanted else [])]
    if not content["models"]:
        raise StudyError("law: a study needs one law at least")
    # (the new law has the options that all laws of the page share)
    for key in OF_LAWS.values():
        given = {model[key] for model in others if key in model}
        if wanted and len(given) == 1 and key in declared(LAWS[law]):
            content["models"][-1][key] = given.pop()


def _build(content: dict[str, Any], wanted: bool) -> None:
    """Put the piece into a building, or onto the ground."""
    if wanted:
        content["building"] = {"kind": "flexural-shear", "period_s": 0.5, "storeys": 4, "floors": [1]}
        content["ida"]["im_at"] = "ground"
    else:
        content.pop("building", None)
        content["ida"].pop("im_at", None)


def _plain(value: float) -> float:
    return float(f"{value:.12g}")


def piece_of(content: Mapping[str, Any]) -> Block:
    """Return the block of the page, without its restraint; StudyError if its keys make none."""
    piece = {key: value for key, value in content["blocks"][0].items() if key != "restraint"}
    try:
        return BlockTable.model_validate(piece).build()
    except ValidationError as error:
        raise StudyError(all_errors([sentence for sentence, _ in refusals(error, piece, BlockTable)])) from None
    except ValueError as error:
        raise StudyError(f"blocks[1]: {error}") from None


def read_state(path: Path) -> dict[str, Any]:
    """Return the state of a study file: its content, with the restraints of its study of remedies.

    StudyError if the page shows another kind of study, or if the study is wrong.
    """
    content: dict[str, Any] = read_content(path, StudyFile).content
    blocks, ida, motions = content.get("blocks"), content.get("ida"), content.get("motions")
    shown = (
        isinstance(blocks, list) and len(blocks) == 1 and isinstance(blocks[0], dict) and isinstance(ida, dict)
    ) and (isinstance(ida.get("levels"), dict) and isinstance(motions, dict) and "generator" in motions)
    further = {"uncertainty", "sensitivity", "branches", "events", "until", "buildings"} & content.keys()
    if not shown or further:
        raise StudyError(
            f"{path}: the page shows studies with one [[blocks]], a generator in [motions] and given levels in [ida]"
            f"{f', without {min(further)}' if further else ''}"
        )
    held = with_held(content)
    try:
        StudyFile.model_validate(held)
    except ValidationError as error:
        raise StudyError(f"{path}: {all_errors([text for text, _ in refusals(error, held, StudyFile)])}") from None
    remedies = file_of(path, REMEDIES)
    tried = read_content(remedies, StudyFile).content.get("restraints", {}) if remedies.is_file() else {}
    usual = {} if tried else start_state()["restraints"]
    height = piece_of(content).height
    # (the file of remedies is written later, and may still have the height of an earlier piece)
    for table in [*usual.values(), *(table for table in dict(tried).values() if table.get("height_m", 0.0) > height)]:
        table["height_m"] = _plain(0.95 * height)
    if not isinstance(tried, dict) or not isinstance(content.get("restraints", {}), dict):
        raise StudyError(f"{path}: restraints must be tables")
    return {**content, "restraints": {**usual, **tried, **content.get("restraints", {})}}


def with_held(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study without the restraints that its block does not use."""
    held, tables = content["blocks"][0].get("restraint"), content.get("restraints", {})
    if not isinstance(tables, Mapping):
        return dict(content)
    restraints = {name: table for name, table in tables.items() if name == held}
    others = {key: table for key, table in content.items() if key != "restraints"}
    return {**others, "restraints": restraints} if restraints else others


def start_state() -> dict[str, Any]:
    """Return the state with which a page without a study begins."""
    return tomllib.loads(START.read_text(encoding="utf-8"))


def file_of(path: Path, name: str) -> Path:
    """Return the file of one of the page's studies, in the folder of the piece's file."""
    return path if name == PIECE else path.with_name(f"{path.stem}.{name}.toml")


def live_file(path: Path) -> Path:
    """Return the file in which the page keeps the state of a study file."""
    return path if path.name.endswith(ENDING) else path.with_name(f"{path.stem}{ENDING}")


def write_state(path: Path, contents: Mapping[str, Mapping[str, Any]]) -> list[Path]:
    """Write the studies of the page, each file completely or not at all; return the files."""
    files = []
    for name, content in contents.items():
        file = file_of(path, name)
        with writing(file):
            write_bytes(file, toml_of(content).encode("utf-8"))
        files.append(file)
    return files


def toml_of(content: Mapping[str, Any]) -> str:
    """Return a study as the text of a TOML file."""
    text = "\n".join(_lines(content, "")).strip() + "\n"
    assert tomllib.loads(text) == content, "a study must be the same after it was written"
    return text


def _lines(table: Mapping[str, Any], name: str) -> Iterator[str]:
    tables = {key: value if isinstance(value, list) else [value] for key, value in table.items()}
    below = {key: table[key] for key, parts in tables.items() if parts and all(isinstance(p, Mapping) for p in parts)}
    flat = {key: value for key, value in table.items() if key not in below or (name and key == "levels")}
    yield from (f"{_key(key)} = {_value(value)}" for key, value in flat.items())
    for key, value in below.items():
        if key in flat:
            continue
        whole = f"{name}.{_key(key)}" if name else _key(key)
        for part in tables[key]:
            # (a table that only holds tables needs no heading)
            if isinstance(value, list) or not part or any(not isinstance(inner, Mapping) for inner in part.values()):
                yield f"\n[[{whole}]]" if isinstance(value, list) else f"\n[{whole}]"
            yield from _lines(part, whole)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(key)} = {_value(part)}' for key, part in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value)


def _text(text: str) -> str:
    # (TOML allows no character 127 in a text)
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
