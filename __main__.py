"""The `toppling` command, and `python -m toppling`: an interrupt while the packages still load ends in one line too."""

import os
import sys

INTERRUPTED = 130


def main() -> int:
    """Load the command and run it; returns the exit code."""
    try:
        from .studies.cli import main as command  # noqa: PLC0415 - what takes long, where an interrupt is caught

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


def is_interrupt(error: BaseException | None) -> bool:
    """Whether an interrupt is the error, or its cause: CPython 3.11 wraps what is raised while a class is made."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or is_interrupt(error.__cause__))


if __name__ == "__main__":
    sys.exit(main())
