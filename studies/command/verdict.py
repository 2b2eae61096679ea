"""The end of a study on a terminal, below its short table: the answer in sentences, and how valid it is."""

from __future__ import annotations

import xarray as xr

from ..report.summary import plain_answer
from ..report.validity import GOOD, INVALID, checks_of, worst_word


def verdict(results: xr.Dataset, answered: bool) -> list[str]:
    """Return how valid results are, a line, after the answer in sentences where it is not `answered` by a table."""
    found = checks_of(results)
    word = worst_word(found)
    bad = sorted((one for one in found if one.word != GOOD), key=lambda one: one.word != INVALID)
    worst = f": {bad[0].reason}" if bad else ""
    return [*([] if answered else plain_answer(results)), f"validity: {word}{worst}"]
