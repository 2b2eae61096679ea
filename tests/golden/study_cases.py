"""The studies of the corpus: a folder each, with its study, its inputs and the numbers that are expected of it.

`case.toml` in a folder may hold `commands` in place of `COMMANDS`, `fast = true` for what `make test` runs, and
`tolerances`, which `expect` reads.
"""

import tomllib
from pathlib import Path
from typing import Any

from case import HERE, Case

STUDIES = HERE / "studies"
COMMANDS = (
    ("run", "study.toml", "--out", "out"),
    ("report", "out/results.nc", "--out", "report.html"),
    ("export", "out/results.nc", "--format", "csv", "--out", "export"),
)
"""Commands of a study without others."""
NOT_INPUTS = ("case.toml", "expected.json", "page.json")


def folders() -> list[Path]:
    """Return the folders of all studies by name."""
    return sorted(path.parent for path in STUDIES.glob("*/study.toml"))


def settings(folder: Path) -> dict[str, Any]:
    """Return what `case.toml` of a study says, if it has one."""
    path = folder / "case.toml"
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def inputs(folder: Path) -> dict[str, Path]:
    """Return the study and the files that it reads, by their names in the folder."""
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in NOT_INPUTS)
    return {path.relative_to(folder).as_posix(): path for path in paths}


def cases() -> list[Case]:
    """Return a case for each study."""
    return [
        Case(f"studies/{folder.name}", inputs(folder), settings(folder).get("commands", COMMANDS))
        for folder in folders()
    ]
