"""Run the corpus under an old commit and under the working tree on this machine, and show what differs.

Usage: run.py --old COMMIT [--only PATTERN] [--pairs] (`make golden OLD=COMMIT`). The old commit, its compiled code and
the outcomes that differ stay in `.golden`. Exit code 1 if anything differs that CHANGES.md does not list.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import time
import venv
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from case import HERE, ROOT, Case
from changes import read_changes, sort_out
from compare import Difference, compare_case
from corpus import cases, renames, with_old_keys
from worker import PLAN, REPORT

PLACE = ROOT / ".golden"
ENVIRONMENT = {"COLUMNS": "100", "NO_COLOR": "1", "MPLBACKEND": "Agg", "TZ": "UTC", "PYTHONHASHSEED": "0"}
VERSIONS = (
    "import importlib.metadata as m, json;"
    "print(json.dumps({d.name.lower(): d.version for d in reversed(list(m.distributions())) if d.name != 'toppling'}))"
)


def git(*arguments: str) -> str:
    """Return what git says of the project."""
    return subprocess.run(
        ["git", "-C", str(ROOT), *arguments], check=True, capture_output=True, text=True
    ).stdout.strip()


def lies_between(old: str, after: str, before: str = "") -> bool:
    """True if a change made after a commit lies between the old commit and the working tree."""

    def is_in(commit: str, later: str) -> bool:
        return (
            subprocess.run(
                ["git", "-C", str(ROOT), "merge-base", "--is-ancestor", commit, later], check=False
            ).returncode
            == 0
        )

    return is_in(old, after) and not (before and is_in(before, "HEAD"))


def environment(commit: str) -> Path:
    """Return the Python of an environment that has a commit installed beside the dependencies of this one."""
    place = PLACE / commit[:12]
    python = place / "env/bin/python"
    if (place / "installed").is_file():
        return python
    print(f"installing {commit[:12]} (half a minute, once)", flush=True)
    shutil.rmtree(place, ignore_errors=True)
    source = place / "source"
    source.mkdir(parents=True)
    archive = subprocess.run(["git", "-C", str(ROOT), "archive", commit], check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", str(source)], input=archive, check=True)
    venv.create(place / "env", with_pip=True)
    (packages,) = (place / "env").glob("lib/python*/site-packages")
    here = next(path for path in sys.path if path.endswith("site-packages"))
    (packages / "dependencies.pth").write_text(f"{here}\n", encoding="utf-8")
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, str(source)], check=True)
    (place / "installed").touch()
    return python


def lay_out(corpus: Sequence[Case], side: Path, old: bool, applies: Callable[[str], bool]) -> None:
    """Write the files of all cases into new folders; for the old commit with its keys and twins."""
    shutil.rmtree(side, ignore_errors=True)
    keys = renames("keys", applies) if old else []
    for case in corpus:
        folder = side / case.name
        (case._replace(files={**case.files, **case.twins}) if old else case).write(folder)
        for path in folder.rglob("*.toml") if keys else ():
            content = path.read_bytes().decode("utf-8", "surrogateescape")  # (some refused files are no text)
            path.write_bytes(with_old_keys(content, keys).encode("utf-8", "surrogateescape"))
        plan = {"commands": case.commands, "process": case.process}
        (folder / PLAN).write_text(json.dumps(plan), encoding="utf-8")


def run_side(python: Path, side: Path, names: Sequence[str]) -> None:
    """Run all cases of a side in one process, and in a further one if a case ends it."""
    waiting = list(names)
    while waiting:
        (side / "names.txt").write_text("\n".join(waiting), encoding="utf-8")
        with (side / "worker.log").open("a", encoding="utf-8") as log:
            subprocess.run(
                [str(python), str(HERE / "worker.py"), str(side), str(side / "names.txt")],
                stdout=log, stderr=log, env=os.environ | ENVIRONMENT, check=False,
            )  # fmt: skip
        waiting = [name for name in waiting if not (side / name / REPORT).is_file()]
        if waiting:  # (the first of them ended the process)
            ended = {"code": "the process died", "seconds": 0.0}
            (side / waiting[0] / REPORT).write_text(json.dumps([ended]), encoding="utf-8")
            del waiting[0]


def same_versions(pythons: Iterable[Path]) -> None:
    """Refuse to compare environments whose dependencies differ.

    Raises
    ------
    SystemExit
        A version differs.
    """
    old, new = (
        set(json.loads(subprocess.run([str(python), "-c", VERSIONS], check=True, capture_output=True).stdout).items())
        for python in pythons
    )
    differs = sorted((old ^ new) - {(name, version) for name, version in old ^ new if name in {"pip", "setuptools"}})
    if differs:
        raise SystemExit(f"versions differ: {', '.join(f'{name} {version}' for name, version in differs)}")


def show(differences: Sequence[Difference]) -> None:
    """Print a line for each item of each case that differs."""
    lines: dict[tuple[str, str], list[Difference]] = {}
    for difference in differences:
        lines.setdefault((difference.case, difference.item), []).append(difference)
    for (case, item), of_item in lines.items():
        size = max(difference.size for difference in of_item)
        more = f" (and {len(of_item) - 1} more places)" if len(of_item) > 1 else ""
        print(f"{case:40} {item:40} {'' if size == math.inf else f'{size:.1e}':8} {of_item[0].what}{more}")


def main() -> int:
    """Run, compare and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--old", required=True)
    parser.add_argument("--only")
    parser.add_argument("--pairs", action="store_true")
    options = parser.parse_args()
    start = time.monotonic()
    commit = git("rev-parse", f"{options.old}^{{commit}}")
    applies = partial(lies_between, commit)
    changes = [
        change
        for change in read_changes((HERE / "CHANGES.md").read_text(encoding="utf-8"))
        if applies(change.after, change.before)
    ]
    corpus = cases(options.only, options.pairs)
    if not corpus:
        raise SystemExit(f"no case has {options.only!r} in its name")
    pythons = environment(commit), Path(sys.executable)
    same_versions(pythons)
    sides = PLACE / "old", PLACE / "new"
    for side, old in zip(sides, (True, False), strict=True):
        lay_out(corpus, side, old, applies)
    print(f"running {len(corpus)} cases under {commit[:12]} and under the working tree", flush=True)
    names = [case.name for case in corpus]
    with ThreadPoolExecutor(2) as both:
        list(both.map(run_side, pythons, sides, (names, names)))
    variables = {rename.old: rename.new for rename in renames("variables", applies)}
    differences = []
    for case in corpus:
        old, new = (side / case.name for side in sides)
        of_case = compare_case(case.name, case.files, case.names, old, new, variables)
        differences += of_case
        for folder in () if of_case else (old, new):
            shutil.rmtree(folder)
    unlisted, idle = sort_out(differences, changes, whole=options.only is None)
    show(unlisted)
    for change in idle:
        print(f"CHANGES.md: explains no difference: {change.issue}: {change.studies}: {change.reason}")
    listed, seconds = len(differences) - len(unlisted), time.monotonic() - start
    print(f"{len(corpus)} cases in {seconds:.0f} s: {listed} differences that CHANGES.md lists, {len(unlisted)} others")
    return 1 if unlisted or idle else 0


if __name__ == "__main__":
    sys.exit(main())
