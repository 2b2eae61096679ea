"""What all tables of a study file share: unknown keys refused, words checked, units taken off the keys."""

from __future__ import annotations

import difflib
import glob
import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core.core_schema import CoreSchema, no_info_after_validator_function

from ..motions import RecordError

MOST_CHARACTERS = 399
"""Of a message: a terminal's few lines."""


class StudyError(ValueError):
    """A study file that cannot be run; one sentence that names the file, the key, the value and what is allowed.

    Whatever a hostile file puts into it, it is one printable line of fewer than 400 characters.
    """

    def __init__(self, message: str) -> None:
        line = "".join(one if one.isprintable() else " " for one in message)
        if len(line) > MOST_CHARACTERS:  # what was got and what may be meant stand at the end
            line = f"{line[: MOST_CHARACTERS - 123]} … {line[-120:]}"
        super().__init__(line)


def nearest(value: str, words: Iterable[str]) -> str | None:
    """The word that is most like `value`, capitals or not; None where none is."""
    known = {word.casefold(): word for word in words}
    near = difflib.get_close_matches(value[:100].casefold(), known, n=1, cutoff=0.5)
    return known[near[0]] if near else None


def checked(value: str, allowed: Iterable[str], beside: str = "") -> str:
    """A word that must be one of those allowed; the nearest is suggested where it is not."""
    words = list(allowed)
    if value in words:
        return value
    near = nearest(value, words)
    hint = f"; did you mean {near!r}?" if near else ""
    raise ValueError(f"must be one of {', '.join(words)}{beside}, got {shown(value)}{hint}")


def shown(value: Any, most: int = 60) -> str:
    """A value for a message."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists in lists
        return f"a {type(value).__name__}"
    return text if len(text) <= most else f"{text[: most - 3]}..."


@dataclass(frozen=True)
class Words:
    """A text (or None) that must be one of some words, which the schema lists."""

    allowed: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any) -> Any:
            return None if value is None else checked(value, self.allowed)

        return no_info_after_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "enum": list(self.allowed)}


def one_of(names: Iterable[str]) -> Words:
    """A word (or None) that must be one of `names`."""
    return Words(tuple(names))


@dataclass(frozen=True)
class Said:
    """What the schema says of a key beside its description; it checks nothing, what is built of the key does.

    `default`: what holds where it is not given, in words where it is no value; `unit`, where the key's ending is none;
    bounds of the value, or of each of a list.
    """

    default: Any = None
    unit: str = ""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None


@dataclass(frozen=True)
class Located:
    """A path (or several) relative to the file that names it; `pattern`, where * and ** stand for others."""

    pattern: bool = False


class Table(BaseModel):
    """A table of a study file: keys that it does not know are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


@dataclass(frozen=True)
class KeysOf:
    """A table whose keys are those of another, each of them optional, checked only where they are merged with it."""

    table: type[Table]


# Unit of each ending of a key, longest first.
UNIT_SUFFIXES = {
    "_m2_s3": "m²/s³",
    "_rad_s2": "rad/s²",
    "_kg_m3": "kg/m³",
    "_rad_s": "rad/s",
    "_per_s": "1/s",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_n_m": "N/m",
    "_rad": "rad",
    "_hz": "Hz",
    "_pa": "Pa",
    "_kg": "kg",
    "_m": "m",
    "_s": "s",
}


def suffix_of(key: str) -> str:
    """The ending of a key that is a unit, '' where there is none."""
    return next((suffix for suffix in UNIT_SUFFIXES if key.endswith(suffix)), "")


def bare(key: str) -> str:
    """A key without its unit."""
    return key.removesuffix(suffix_of(key))


def refuse_foreign(table: BaseModel, allowed: set[str], what: str) -> None:
    """ValueError where a key is given that does not belong to what the table describes."""
    for name in sorted(table.model_fields_set):
        if getattr(table, name) is not None and name not in allowed:
            raise ValueError(f"{what} has no key {name!r}, allowed are {', '.join(sorted(allowed))}")


def construct(cls: Any, table: BaseModel, apart: set[str], what: str) -> Any:
    """An instance of a dataclass from the table's keys, their units taken off; keys `apart` are not its own."""
    own = {key for key in type(table).model_fields if bare(key) in cls.__dataclass_fields__}
    refuse_foreign(table, own | apart, what)
    options = {bare(key): getattr(table, key) for key in own if getattr(table, key) is not None}
    if isinstance(options.get("envelope"), Table):
        options["envelope"] = options["envelope"].build()
    try:
        return cls(**options)
    except TypeError as error:
        raise ValueError(f"{what}: {error}") from None


MOST_FILES = 100_000
"""Files and folders that a pattern may look at: more is a folder too high up, and minutes of looking."""


def expand(patterns: str | list[str], folder: Path, what: str = "records") -> list[Path]:
    """Files that the patterns name, sorted, each once; RecordError where a pattern names none or looks at too many."""
    found: dict[Path, None] = {}
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        try:
            _refuse_wide(pattern, folder)
            matches = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
            files = [folder / match for match in matches if (folder / match).is_file()]
            # a name with brackets is a pattern that does not match itself
            if not files and (folder / pattern).is_file():
                files = [folder / pattern]
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise RecordError(f"{what}: {shown(pattern)} cannot be looked for ({reason})") from None
        if not files:
            raise RecordError(f"{what}: no file matches {shown(pattern)} (looked in {folder.resolve()})")
        found.update(dict.fromkeys(files))
    return list(found)


def _refuse_wide(pattern: str, folder: Path) -> None:
    """ValueError where a pattern looks at more than so many files: counted before glob, which cannot be stopped."""
    parts = Path(pattern).parts
    if "\0" in pattern or not parts:
        raise ValueError("no name of a file")
    first = next((i for i, part in enumerate(parts) if glob.has_magic(part)), len(parts))
    if first == len(parts):
        return
    if parts.count("**") > 1:
        raise ValueError("** may stand once")
    deepest = sys.maxsize if "**" in parts else len(parts) - first
    left = [(str(folder.joinpath(*parts[:first])), 1)]
    seen = 0
    while left:
        at, depth = left.pop()
        with suppress(OSError), os.scandir(at) as entries:  # as glob, which goes by what it may not enter
            for entry in entries:
                seen += 1
                if seen > MOST_FILES:
                    raise ValueError(f"there are more than {MOST_FILES:,} files to look at: name a folder further down")
                if depth < deepest and entry.is_dir():
                    left.append((entry.path, depth + 1))
