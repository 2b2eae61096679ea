"""The `toppling` command, and `python -m toppling`: an interrupt while the packages still load ends in one line too."""

import os
import signal
import sys

INTERRUPTED = 130


def main() -> int:
    """Load the command and run it; returns the exit code."""
    # (not where interrupts are ignored: in the background of a shell)
    interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if interruptible:
        signal.signal(signal.SIGINT, _leave)
    try:
        from .studies.cli import main as command  # noqa: PLC0415 - what takes long

        if interruptible:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        code = command()
    except (KeyboardInterrupt, RuntimeError) as error:
        if not is_interrupt(error):
            raise
        print("toppling: interrupted", file=sys.stderr)
        code = INTERRUPTED
    if code == INTERRUPTED:
        # CPython would die of the signal where an interrupt has passed through code made from text, as dataclasses are,
        # although it was caught
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)
    return code


def _leave(number: int, frame: object) -> None:
    """End at once, while nothing but packages are loaded: some of these swallow what is raised, or make it theirs."""
    os.write(2, b"toppling: interrupted\n")
    os._exit(INTERRUPTED)


def is_interrupt(error: BaseException | None) -> bool:
    """Whether an interrupt is the error, or its cause: CPython 3.11 wraps what is raised while a class is made."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or is_interrupt(error.__cause__))


if __name__ == "__main__":
    sys.exit(main())
