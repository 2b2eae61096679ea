"""The `toppling` command, and `python -m toppling`: an interrupt while the packages still load ends in one line too."""

import _thread
import gc
import os
import signal
import sys
import threading
from contextlib import suppress
from typing import Any

from .core.limits import memory_limit

FAILED, HUNG_UP, INTERRUPTED, TERMINATED = 1, 129, 130, 143
AGAIN_SECONDS = 0.02


def main() -> int:
    """Load the command, run it and return its exit code."""
    # Packages and figures are many objects and no garbage: collecting after every 700 takes a tenth of a short study.
    gc.set_threshold(50_000, 20)
    # A signal that is ignored, as in the background of a shell, stays ignored.
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    caught = [number for number in numbers if signal.getsignal(number) != signal.SIG_IGN]
    for number in caught:
        signal.signal(number, _leave)
    sys.unraisablehook = interrupt_again
    # Figures are drawn into files: no backend of a notebook or a desktop is needed, nor need it be there.
    os.environ["MPLBACKEND"] = "agg"
    try:
        from .studies.command.cli import main as command, prepare_streams  # noqa: PLC0415

        for number in caught:
            signal.signal(number, _interrupt)
        prepare_streams()
        code = command()
    except (KeyboardInterrupt, RuntimeError, ImportError, MemoryError, SystemError) as error:
        if is_interrupt(error):
            print("toppling: interrupted", file=sys.stderr)
            code = 128 + getattr(error, "number", signal.SIGINT)
        elif (limit := memory_limit()) and (not isinstance(error, RuntimeError) or "thread" in str(error)):
            print(f"toppling: {limit} kB of memory (ulimit -v) are not enough, allow more ({error})", file=sys.stderr)
            code = FAILED
        else:
            raise
    if code in (FAILED, HUNG_UP, INTERRUPTED, TERMINATED):
        # Where an interrupt has passed through code that was made from text, as that of dataclasses is, CPython would
        # end by the signal although the interrupt was caught.
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)
    # The interpreter ends with several collections of all that was ever loaded, half a second for nothing.
    gc.freeze()
    return code


def _leave(number: int, frame: object) -> None:
    """End at once while the packages load: some of them swallow an exception, or replace it by one of their own."""
    os.write(2, b"toppling: interrupted\n")
    os._exit(128 + number)


def _interrupt(number: int, frame: object) -> None:
    """Interrupt: what is half written goes, and the exit code is the signal's."""
    error = KeyboardInterrupt()
    error.number = number  # type: ignore[attr-defined]
    raise error


def interrupt_again(swallowed: Any) -> None:
    """Interrupt once more where a callback, as that of a lock of an import, has swallowed the interrupt."""
    if isinstance(swallowed.exc_value, KeyboardInterrupt):
        # (a moment later: at once it would be swallowed here)
        threading.Timer(AGAIN_SECONDS, _thread.interrupt_main).start()
    else:
        sys.__unraisablehook__(swallowed)


def is_interrupt(error: BaseException | None) -> bool:
    """Return True if the error is an interrupt or was caused by one; CPython 3.11 wraps errors of a class body."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or is_interrupt(error.__cause__))


if __name__ == "__main__":
    sys.exit(main())
