"""Run cases of the corpus with the toppling of this Python, all of them in this one process.

Usage: worker.py PLACE LIST: every folder of PLACE that LIST names, a line each, has its commands in `.case.json`; what
they print and how they end is written beside it, file by file.
"""

import contextlib
import gc
import json
import os
import runpy
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

PLAN, ENDS, REPORT = ".case.json", ".ends.json", ".done.json"
LONGEST = 300  # s, of one command
HUNG, DIED, ESCAPED = "hung", "the process died", "traceback"


class Hung(BaseException):
    """A command that takes longer than `LONGEST`; no exception of Python's own, which a command may catch."""


def run_case(folder: Path) -> None:
    """Run the commands of a case in its folder and write the exit code and the seconds of each as it ends."""
    plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
    ends: list[dict[str, Any]] = []
    for number, command in enumerate(plan["commands"], 1):
        streams = folder / f".{number}.out", folder / f".{number}.err"
        start = time.monotonic()
        if plan["process"]:
            code = run_process(command, folder, *streams)
        else:
            code = run_here(command, folder, *streams)
        ends.append({"code": code, "seconds": round(time.monotonic() - start, 3)})
        (folder / ENDS).write_text(json.dumps(ends), encoding="utf-8")
        print(folder.name, number, ends[-1], flush=True)
    (folder / ENDS).replace(folder / REPORT)


def run_here(command: Sequence[str], folder: Path, out: Path, err: Path) -> int | str:
    """Run one command in this process and return its exit code, or what went wrong."""
    signal.signal(signal.SIGALRM, _hung)
    signal.alarm(LONGEST)
    try:
        with (
            _inside(folder),
            out.open("w", encoding="utf-8") as sys.stdout,
            err.open("w", encoding="utf-8") as sys.stderr,
        ):
            try:
                return _python(command) if command[:1] == ["python"] else _toppling(command)
            except SystemExit as leaving:
                return leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
            except Hung:
                return HUNG
            except BaseException as error:
                traceback.print_exc()
                return f"{ESCAPED}: {type(error).__name__}"
    finally:
        signal.alarm(0)


def _toppling(command: Sequence[str]) -> int:
    sys.argv = ["toppling", *command]
    from toppling.__main__ import main

    return main()


def _python(command: Sequence[str]) -> int:
    sys.argv = list(command[1:])
    runpy.run_path(command[1], run_name="__main__")
    return 0


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """Be in the case's folder; afterwards the process is as it was, but for what is loaded and compiled."""
    before = Path.cwd(), sys.argv, sys.stdout, sys.stderr, sys.unraisablehook, signal.getsignal(signal.SIGINT)
    os.chdir(folder)
    try:
        yield
    finally:
        here, sys.argv, sys.stdout, sys.stderr, sys.unraisablehook, interrupt = before
        os.chdir(here)
        signal.signal(signal.SIGINT, interrupt)
        if "matplotlib.pyplot" in sys.modules:
            sys.modules["matplotlib.pyplot"].close("all")
        gc.unfreeze()  # (what `main` freezes because its process ends)


def run_process(command: Sequence[str], folder: Path, out: Path, err: Path) -> int | str:
    """Run one command as a process; SIGINT or SIGTERM in front of it: that signal when the first chunk is kept."""
    kill = getattr(signal, command[0]) if command and command[0].startswith("SIG") else None
    arguments = command[1:] if command[:1] == ["python"] else ["-m", "toppling", *command[kill is not None :]]
    with out.open("wb") as stdout, err.open("wb") as stderr:
        process = subprocess.Popen([sys.executable, *arguments], cwd=folder, stdout=stdout, stderr=stderr)
        try:
            if kill:
                while process.poll() is None and not any(folder.glob("*/shards/*.nc")):
                    time.sleep(0.002)
                process.send_signal(kill)
            return process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            return HUNG
        finally:
            process.kill()


def _hung(*_: object) -> None:
    raise Hung


def main(place: Path, names: Path) -> None:
    """Run all cases."""
    for name in names.read_text(encoding="utf-8").splitlines():
        run_case(place / name)


if __name__ == "__main__":
    main(*(Path(argument).absolute() for argument in sys.argv[1:]))
