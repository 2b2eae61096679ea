"""The one error of studies, apart from their readers: it needs no library."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.wording import system_reason

MOST_CHARACTERS = 399
"""Most characters of a message, which must fit a few lines of a terminal."""


class StudyError(ValueError):
    """Error for a study that cannot be run: one sentence with the file, the key, the value and the allowed values.

    Whatever a hostile file puts into the message, it is one printable line of fewer than 400 characters.
    """

    def __init__(self, message: str) -> None:
        line = "".join(character if character.isprintable() else " " for character in message)
        if len(line) > MOST_CHARACTERS:  # (the end names the given value and what may be meant)
            line = f"{line[: MOST_CHARACTERS - 123]} … {line[-120:]}"
        super().__init__(line)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raise StudyError if a file or a folder cannot be written in the block."""
    try:
        yield
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({system_reason(error)})") from None
