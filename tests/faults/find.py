"""Put each fault into a copy of the repository and print the tests that find it.

    python tests/faults/find.py [PATTERN] [--record] [--jobs 2] [--slow] [--budget SECONDS]

The tests that found it last time come first, then those chosen by the recorded coverage of the changed lines
(record.py), then all tests of the same folder.
Without a recording the latter are followed by tests with names of the changed module in their text.
"""

import argparse
import ast
import csv
import fnmatch
import gzip
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))

from fault_reports import PLACE, REPORT, SKIPPED  # noqa: E402
from faults import KERNELS, NOT_SEARCHED, ROOT, Fault, faults, write_table  # noqa: E402

WORK = Path(tempfile.gettempdir()) / "toppling-faults"
COVERED = HERE / "covered.csv.gz"
COMPILED = (".nbi", ".nbc")
KEPT = "__pycache__.kept"
OWN_TESTS = "test_faults.py"  # (every patch fails them where it is applied)
HANGS = "--timeout=150"
NAMED, BATCH_SECONDS, FILES_ELSEWHERE = 3, 60.0, 8


class Result(NamedTuple):
    """The tests that find a fault, how many were run, and True if those were all tests that run the changed lines."""

    found: list[str]
    run: int
    whole: bool


def renewed(number: int) -> Path:
    """Return a copy of the working tree named as the package, with its compiled code."""
    root = WORK / str(number) / "toppling"
    root.mkdir(parents=True, exist_ok=True)
    for aside in root.rglob(KEPT):  # (of a search that was killed)
        shutil.rmtree(aside.with_name("__pycache__"), ignore_errors=True)
        aside.rename(aside.with_name("__pycache__"))
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    wanted = {name for name in listed if (ROOT / name).is_file()}
    for path in root.rglob("*"):
        if path.is_file() and str(path.relative_to(root)) not in wanted and path.parent.name != "__pycache__":
            path.unlink()
    for name in wanted:
        theirs, ours = root / name, (ROOT / name).stat()
        if not theirs.exists() or (theirs.stat().st_size, theirs.stat().st_mtime) != (ours.st_size, ours.st_mtime):
            theirs.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, theirs)
    for folder in {
        name.rpartition("/")[0] for name in wanted if name.split("/")[-2:-1] in [[room] for room in KERNELS]
    }:
        for path in (ROOT / folder / "__pycache__").glob("*.nb[ic]"):
            theirs = root / path.relative_to(ROOT)
            if not theirs.exists():
                theirs.parent.mkdir(exist_ok=True)
                shutil.copy2(path, theirs)
    return root


@contextmanager
def applied(root: Path, fault: Fault) -> Iterator[None]:
    """Put a fault into a copy for a while; compiled code of its folder is laid aside, so that it is not lost."""
    file = root / fault.place
    text, times = file.read_text("utf-8"), file.stat()
    code = file.parent / "__pycache__" if file.parent.name in KERNELS else None
    if code is not None and code.exists():
        code.rename(code.with_name(KEPT))
    file.write_text(fault.applied(text), encoding="utf-8")
    try:
        yield
    finally:
        file.write_text(text, encoding="utf-8")
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
        if code is not None and code.with_name(KEPT).exists():
            shutil.rmtree(code, ignore_errors=True)
            code.with_name(KEPT).rename(code)


def read_report(path: Path) -> dict[str, tuple[str, float]]:
    """Return the outcome and the seconds of each test or file, without parameters; one failed part fails it."""
    results: dict[str, tuple[str, float]] = {}
    for line in path.read_text("utf-8").splitlines() if path.exists() else ():
        outcome, seconds, name = line.split("\t", 2)
        name = name.partition("[")[0]
        before, total = results.get(name, ("passed", 0.0))
        results[name] = ("failed" if "failed" in (outcome, before) else outcome, total + float(seconds))
    return results


def outcomes(
    root: Path, tests: list[str], most: int, seconds: float, skipped: Iterable[str] = ()
) -> dict[str, tuple[str, float]]:
    """Run tests of a copy, for so long at most, until so many have failed; return what each did."""
    report, log = root.parent / "report.tsv", root.parent / "pytest.log"
    report.unlink(missing_ok=True)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "fault_reports", f"--maxfail={most}", HANGS, *tests]
    # (the copy precedes the installed package)
    paths = os.pathsep.join(map(str, (root.parent, root / "tests/faults")))
    given = {"PYTHONPATH": paths, PLACE: str(root), REPORT: str(report), SKIPPED: "\n".join(skipped)}
    with log.open("w") as out:
        run = subprocess.Popen(
            command, cwd=root / "tests", env={**os.environ, **given}, stdout=out, stderr=out, start_new_session=True
        )
        try:
            code = run.wait(seconds)
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            code = run.wait()
        except BaseException:
            os.killpg(run.pid, signal.SIGKILL)
            raise
    results = read_report(report)
    if code in (3, 4) and not any(outcome == "failed" for outcome, _ in results.values()):
        raise RuntimeError(f"pytest cannot run: {log.read_text()[-2000:]}")
    return results


@cache
def covered() -> dict[str, list[tuple[str, float]]]:
    """Return the recorded tests of each fault with their seconds; none without a recording."""
    found: dict[str, list[tuple[str, float]]] = {}
    if COVERED.exists():
        with gzip.open(COVERED, "rt", encoding="utf-8", newline="") as file:
            for fault, test, seconds in csv.reader(file):
                found.setdefault(fault, []).append((test, float(seconds)))
    return found


def batches(root: Path, fault: Fault, slow: bool) -> list[list[str]]:
    """Return the arguments of pytest for each batch of tests, the most promising first."""
    recorded: dict[int, list[str]] = {}
    total = 0.0
    before = [test for test in fault.header["Found by"] if "::" in test and _exists(root, test)]
    for test, seconds in covered().get(fault.name, []):
        if _exists(root, test) and test not in before:
            recorded.setdefault(int(total / BATCH_SECONDS), []).append(test)
            total += seconds
    names, rooms = [], []
    tests = root / "tests"
    for place in fault.lines(root):
        body = ast.parse((root / place).read_text("utf-8")).body
        names += [Path(place).stem, *(node.name for node in body if hasattr(node, "name"))]
        rooms.append((tests / place).parent)
    own = re.compile(rf"\b({'|'.join(names)})\b")
    mentions = {path: len(own.findall(path.read_text("utf-8"))) for path in tests.rglob("test_*.py")}
    order = sorted((path for path in mentions if path.name != OWN_TESTS), key=lambda path: (-mentions[path], path))
    near = [str(path.relative_to(tests)) for path in order if path.parent in rooms]
    far = [str(path.relative_to(tests)) for path in order if path.parent not in rooms and mentions[path]]
    groups = [group for group in (near, [] if recorded else far[:FILES_ELSEWHERE]) if group]
    marks = ("not slow", "slow") if slow else ("not slow",)
    return [
        *([before] if before else []),
        *recorded.values(),
        *(["-m", mark, *group] for mark in marks for group in groups),
    ]


def _exists(root: Path, test: str) -> bool:
    file, *within = test.split("::")
    path = root / "tests" / file
    if not path.is_file():
        return False
    text = path.read_text("utf-8")
    return not within or (f"def {within[-1]}(" in text and all(f"class {name}" in text for name in within[:-1]))


def search(root: Path, fault: Fault, slow: bool, budget: float) -> Result:
    """Return the tests that find a fault: those that fail with it alone."""
    run: set[str] = set()
    end = time.monotonic() + budget
    for batch in batches(root, fault, slow):
        while (left := end - time.monotonic()) > 0.0:
            with applied(root, fault):
                results = outcomes(root, batch, NAMED, left, run)
            run |= results.keys()
            failed = [name for name, (outcome, _) in results.items() if outcome == "failed"]
            if not failed:
                break
            without = outcomes(root, failed, len(failed), budget)
            fine = [name for name in failed if without.get(name, ("", 0.0))[0] != "failed"]
            if fine:
                return Result(fine[:NAMED], len(run), True)
    return Result([], len(run), fault.name in covered() and time.monotonic() < end)


def in_words(result: Result) -> list[str]:
    """Return which tests find a fault, as they stand in its file."""
    if result.found or result.whole:
        return result.found or [f"none of {result.run} tests"]
    return [f"{NOT_SEARCHED} in the whole suite: none of {result.run} tests"]


def main() -> None:
    """Search for the faults that the arguments name."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pattern", nargs="?", default="*", help="of names of patches, such as '0*' or '*weight*'")
    parser.add_argument("--record", action="store_true", help="write the tests into the patches and the README")
    parser.add_argument("--jobs", type=int, default=2, help="faults at a time")
    parser.add_argument("--slow", action="store_true", help="slow tests of the folder, too")
    parser.add_argument("--budget", type=float, default=300.0, help="most seconds for the tests of one fault")
    asked = parser.parse_args()
    chosen = [fault for fault in faults() if fnmatch.fnmatch(fault.name, asked.pattern)]
    copies: SimpleQueue[Path] = SimpleQueue()
    for number in range(asked.jobs):
        copies.put(renewed(number))

    def one_fault(fault: Fault) -> tuple[Result, float]:
        root, begun = copies.get(), time.monotonic()
        try:
            return search(root, fault, asked.slow, asked.budget), time.monotonic() - begun
        finally:
            copies.put(root)

    missed = 0
    with ThreadPoolExecutor(asked.jobs) as pool:
        for fault, (result, seconds) in zip(chosen, pool.map(one_fault, chosen), strict=True):
            missed += not result.found
            print(f"{fault.name} ({seconds:.0f} s): {', '.join(in_words(result))}", flush=True)
            if asked.record:
                fault.record(in_words(result))
                write_table()
    print(f"{len(chosen) - missed} of {len(chosen)} faults are found")


if __name__ == "__main__":
    main()
