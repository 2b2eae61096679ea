"""What all tables of a study file share: unknown keys refused, words checked, units taken off the keys."""

from __future__ import annotations

import difflib
import glob
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import AfterValidator, BaseModel, ConfigDict

from ..motions import RecordError


class StudyError(ValueError):
    """A study file that cannot be run; one sentence that names the file, the key, the value and what is allowed."""


def checked(value: str, allowed: Iterable[str], beside: str = "") -> str:
    """A word that must be one of those allowed; the nearest is suggested where it is not."""
    words = list(allowed)
    if value in words:
        return value
    near = difflib.get_close_matches(value, words, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ValueError(f"must be one of {', '.join(words)}{beside}, got {value!r}{hint}")


def one_of(names: Iterable[str]) -> AfterValidator:
    """A word (or None) that must be one of `names`."""
    allowed = list(names)
    return AfterValidator(lambda value: None if value is None else checked(value, allowed))


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


# longest first
_UNIT_SUFFIXES = (
    "_m2_s3", "_rad_s2", "_kg_m3", "_rad_s", "_per_s", "_m_s2", "_m_s", "_n_m", "_rad", "_hz", "_pa", "_kg", "_m", "_s"
)  # fmt: skip


def bare(key: str) -> str:
    """A key without its unit."""
    for suffix in _UNIT_SUFFIXES:
        if key.endswith(suffix):
            return key.removesuffix(suffix)
    return key


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


def expand(patterns: str | list[str], folder: Path, what: str = "records") -> list[Path]:
    """Files that the patterns name, sorted, each once; RecordError where a pattern names none."""
    found: dict[Path, None] = {}
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        matches = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
        files = [folder / match for match in matches if (folder / match).is_file()]
        if not files and (folder / pattern).is_file():  # a name with brackets is a pattern that does not match itself
            files = [folder / pattern]
        if not files:
            raise RecordError(f"{what}: no file matches {pattern!r} (looked in {folder.resolve()})")
        found.update(dict.fromkeys(files))
    return list(found)
