"""Run the corpus under an old commit and under the working tree on this machine, and show what differs.

Usage: run.py --old COMMIT [--only PATTERN] [--pairs] (`make golden OLD=COMMIT`). The old commit, its compiled code and
the outcomes that differ stay in `.golden`. Exit code 1 if anything differs that CHANGES.md does not list.
"""

import argparse
import fcntl
import fnmatch
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
import venv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from case import HERE, ROOT, Case
from changes import read_changes, sort_out
from compare import Difference, compare_case
from corpus import SCHEMA_1, cases, renamed_keys, with_old_keys
from worker import DIED, ENDS, HUNG, LONGEST, PLAN, REPORT

from toppling.studies.store.renames import renamed

PLACE = ROOT / ".golden"
ENVIRONMENT = {"COLUMNS": "100", "NO_COLOR": "1", "MPLBACKEND": "Agg", "TZ": "UTC", "PYTHONHASHSEED": "0"}
LOG = "worker.log"
TELLING = 30.0  # s between two lines of progress
IN_ONE_PROCESS = 200  # cases; figures and datasets of a thousand studies would fill the memory
VERSIONS = (
    "import importlib.metadata as m, json;"
    "print(json.dumps({d.name.lower(): d.version for d in reversed(list(m.distributions())) if d.name != 'toppling'}))"
)


def commit_of(name: str) -> str:
    """Return the full name of a commit.

    Raises
    ------
    SystemExit
        This clone has no such commit.
    """
    command = ["git", "-C", str(ROOT), "rev-parse", "--quiet", "--verify", f"{name}^{{commit}}"]
    answer = subprocess.run(command, check=False, capture_output=True, text=True)
    if answer.returncode:
        raise SystemExit(f"{name}: this clone has no such commit (a shallow clone: git fetch --unshallow)")
    return answer.stdout.strip()


@contextmanager
def alone() -> Iterator[None]:
    """Refuse a second run at the same time, whose folders would be the same.

    Raises
    ------
    SystemExit
        Another run has begun.
    """
    PLACE.mkdir(exist_ok=True)
    with (PLACE / "lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SystemExit("another `make golden` is running in this folder") from None
        yield


def lies_between(old: str, after: str, before: str = "") -> bool:
    """True if a change made after a commit lies between the old commit and the working tree."""

    def is_in(commit: str, later: str) -> bool:
        command = ["git", "-C", str(ROOT), "merge-base", "--is-ancestor", commit, later]
        return subprocess.run(command, check=False).returncode == 0

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
    keys = renamed_keys(applies) if old else []
    for case in corpus:
        folder = side / case.name
        twins = case.twins if old and case.renamed and applies(case.renamed) else {}
        case._replace(files={**case.files, **twins}).write(folder)
        for path in folder.rglob("*.toml") if keys else ():
            content = path.read_bytes().decode("utf-8", "surrogateescape")  # (some refused files are no text)
            path.write_bytes(with_old_keys(content, keys).encode("utf-8", "surrogateescape"))
        plan = {"commands": case.commands, "process": case.process}
        (folder / PLAN).write_text(json.dumps(plan), encoding="utf-8")


def run_sides(pythons: Mapping[Path, Path], names: Sequence[str]) -> None:
    """Run all cases of each side (folder and Python), so many in one process; in a further one if a case ends it."""
    processes: dict[Path, subprocess.Popen[bytes]] = {}
    given: dict[Path, list[str]] = {}
    waiting = {side: list(names) for side in pythons}
    told = time.monotonic()
    try:
        while any(waiting.values()):
            for side, python in pythons.items():
                hangs = side in processes and time.time() > (side / LOG).stat().st_mtime + LONGEST + TELLING
                if hangs:  # (in compiled code, which no alarm of its own ends)
                    _end(processes[side])
                if side in processes and processes[side].poll() is None:
                    continue
                waiting[side] = [name for name in waiting[side] if not (side / name / REPORT).is_file()]
                if waiting[side] and waiting[side][0] in given.get(side, ()):
                    folder = side / waiting[side].pop(0)
                    ends = json.loads((folder / ENDS).read_text(encoding="utf-8")) if (folder / ENDS).is_file() else []
                    ends.append({"code": HUNG if hangs else DIED, "seconds": 0.0})
                    (folder / REPORT).write_text(json.dumps(ends), encoding="utf-8")
                if waiting[side]:
                    given[side] = waiting[side][:IN_ONE_PROCESS]
                    processes[side] = _worker(python, side, given[side])
            time.sleep(0.1)
            if time.monotonic() > told + TELLING:
                told = time.monotonic()
                done = [sum((side / name / REPORT).is_file() for name in names) for side in pythons]
                print(f"done of {len(names)} cases: old {done[0]}, new {done[-1]}", flush=True)
    finally:
        for process in processes.values():
            _end(process)


def _worker(python: Path, side: Path, names: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start a process for some cases, in a session of its own: an interrupt ends this process, and this one ends it."""
    (side / "names.txt").write_text("\n".join(names), encoding="utf-8")
    command = [str(python), str(HERE / "worker.py"), str(side), str(side / "names.txt")]
    with (side / LOG).open("a", encoding="utf-8") as log:
        log.write(f"{len(names)} cases\n")
        environment = os.environ | ENVIRONMENT
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment, start_new_session=True
        )


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process with those that it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


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


def show(differences: Sequence[Difference]) -> int:
    """Print a line for each item of each case that differs, and return how many they are."""
    lines: dict[tuple[str, str], list[Difference]] = {}
    for difference in differences:
        lines.setdefault((difference.case, difference.item), []).append(difference)
    for (case, item), of_item in lines.items():
        sizes = [difference.size for difference in of_item if difference.size < math.inf]
        words = "; ".join(difference.what for difference in of_item[:2])
        more = f" (and {len(of_item) - 2} more places)" if len(of_item) > 2 else ""
        print(f"{case:30} {item:30} {f'{max(sizes):.1e}' if sizes else '':8} {words}{more}")
    return len(lines)


def main() -> int:
    """Read the arguments, run, compare and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--old", required=True)
    parser.add_argument("--only")
    parser.add_argument("--pairs", action="store_true")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with alone():
            return compared(options.old, options.only, options.pairs)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def compared(old_commit: str, only: str | None, pairs: bool) -> int:
    """Run the corpus on both sides and print what differs; return the exit code."""
    start = time.monotonic()
    commit = commit_of(old_commit)
    applies = partial(lies_between, commit)
    try:
        changes = read_changes((HERE / "CHANGES.md").read_text(encoding="utf-8"))
    except ValueError as error:
        raise SystemExit(str(error)) from None
    for change in changes:
        commit_of(change.after)
    changes = [change for change in changes if applies(change.after, change.before)]
    corpus = cases(only, pairs)
    if not corpus:
        raise SystemExit(f"ONLY={only}: no case has this in its name")
    pythons = environment(commit), Path(sys.executable)
    same_versions(pythons)
    sides = PLACE / "old", PLACE / "new"
    for side, old in zip(sides, (True, False), strict=True):
        lay_out(corpus, side, old, applies)
    print(f"running {len(corpus)} cases under {commit[:12]} and under the working tree", flush=True)
    names = [case.name for case in corpus]
    run_sides(dict(zip(sides, pythons, strict=True)), names)
    variables = renamed if applies(SCHEMA_1) else str
    differences = []
    for case in corpus:
        old, new = (side / case.name for side in sides)
        of_case = compare_case(case.name, case.files, case.names, old, new, variables)
        differences += of_case
        for folder in () if of_case else (old, new):
            shutil.rmtree(folder)
    unlisted, idle = sort_out(differences, changes)
    shown = show(unlisted)
    # (what explains nothing is judged by a run of all cases that it is for)
    run, known = set(names), [case.name for case in cases(pairs=True)]
    idle = [change for change in idle if run.issuperset(fnmatch.filter(known, change.studies))]
    for change in idle:
        print(f"CHANGES.md: explains no difference: {change.issue}: {change.studies}: {change.reason}")
    listed, seconds = len(differences) - len(unlisted), time.monotonic() - start
    print(f"cases: {len(corpus)}, {seconds:.0f} s; differences that CHANGES.md lists: {listed}, others: {shown}")
    return 1 if unlisted or idle else 0


if __name__ == "__main__":
    sys.exit(main())
