"""Progress of work that is done in parts, reported for the whole."""

from ...core.aliases import Progress


def part_of(progress: Progress | None, before: int, total: int | None = None) -> Progress | None:
    """Return the progress callback of a part that begins after `before` of all `total` units of work.

    Without `total`, the part's own total is assumed to be the end of the whole.
    """
    if progress is None:
        return None

    def shifted(done: int, of_part: int) -> None:
        progress(before + done, before + of_part if total is None else total)

    return shifted
