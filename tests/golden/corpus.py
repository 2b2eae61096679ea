"""The whole corpus, and the table of names that later commits gave to keys."""

import csv
import re
from collections.abc import Callable, Iterable
from fnmatch import fnmatchcase
from importlib import import_module
from typing import NamedTuple

from case import HERE, Case

MODULES = ("study_cases", "command_cases", "script_cases", "refused_cases")


class Rename(NamedTuple):
    """A name before and after a change; `after` is the last commit that has the old one."""

    old: str
    new: str
    after: str


def cases(only: str | None = None, pairs: bool = False) -> list[Case]:
    """Return the cases whose names match a pattern, in the order of the corpus; pairs of features on request."""
    modules = [import_module(name) for name in (*MODULES, *(("pair_cases",) if pairs else ()))]
    return [
        case for module in modules for case in module.cases() if only is None or fnmatchcase(case.name, f"*{only}*")
    ]


SCHEMA_1 = "608a04f0"
"""The last commit whose results are of schema 1."""


def renamed_keys(applies: Callable[[str], bool] = lambda after: True) -> list[Rename]:
    """Return the renames of keys that lie between the commits compared."""
    with (HERE / "renamed_keys.csv").open(encoding="utf-8", newline="") as file:
        return [rename for rename in map(Rename._make, list(csv.reader(file))[1:]) if applies(rename.after)]


def with_old_keys(text: str, keys: Iterable[Rename]) -> str:
    """Return a study file as the old commit reads it, with old names of keys (paths as `blocks.lean_deg`)."""
    lines, table = [], ""
    for line in text.split("\n"):
        heading = re.match(r"\s*\[+\s*([\w.-]+)", line)
        table = heading[1] if heading else table
        renamed = line
        for rename in keys:
            (parent, _, new), old = rename.new.rpartition("."), rename.old.rpartition(".")[2]
            key = rf"(?<![\w-]){new}(?=\s*=)"
            if heading and f"{table}.".startswith(f"{rename.new}."):
                renamed = re.sub(rf"\b{new}\b", old, renamed, count=1)
            elif not heading and parent == table:
                renamed = re.sub(key, old, renamed)
            elif not heading and parent.startswith(f"{table}."):  # (an inline table)
                holder = parent.removeprefix(f"{table}.").partition(".")[0]
                renamed = re.sub(rf"^\s*{holder}\s*=.*", lambda inline: re.sub(key, old, inline[0]), renamed)  # noqa: B023
        lines.append(renamed)
    return "\n".join(lines)
