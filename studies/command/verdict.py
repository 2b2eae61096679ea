"""The end of a study on a terminal, below its short table: the answer in sentences, and how valid it is."""

from __future__ import annotations

import xarray as xr

from ..report.summary import plain_answer
from ..report.validity import badge, checks_of


def verdict(results: xr.Dataset, answered: bool) -> list[str]:
    """Return how valid results are, a line, after the answer in sentences where it is not `answered` by a table."""
    found = checks_of(results)
    return [*([] if answered else plain_answer(results)), f"validity: {badge(found)}"]
