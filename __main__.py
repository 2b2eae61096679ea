"""The `toppling` command, and `python -m toppling`: an interrupt while the packages still load ends in one line too."""

import sys

INTERRUPTED = 130


def main() -> int:
    """Load the command and run it; returns the exit code."""
    try:
        from .studies.cli import main as command  # noqa: PLC0415 - what takes long, where an interrupt is caught
    except KeyboardInterrupt:
        print("toppling: interrupted, nothing was begun", file=sys.stderr)
        return INTERRUPTED
    try:
        return command()
    except KeyboardInterrupt:  # in the moments outside of what the command catches
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
