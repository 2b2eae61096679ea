"""The end of a study on a terminal, below its short table: the answer in sentences, and how valid it is."""

from __future__ import annotations

import xarray as xr

from ..region.rows import event_sentences
from ..report.actions import money_steps
from ..report.crossed import crossed_pieces
from ..report.extrapolation import rate_sentences, second_opinions
from ..report.law_choice import choice_of_law
from ..report.summary import plain_answer
from ..report.validity import INVALID, badge, checks_of, worst_word
from ..tables.breaks import break_sentences
from ..tables.gains import gain_sentences
from ..tables.slides import edge_sentences, trip_sentences
from ..text.precision import missed_precision


def verdict(results: xr.Dataset, answered: bool) -> list[str]:
    """Return the validity of results in a line, which comes first where they are not valid, and the answer."""
    checks = checks_of(results)
    said = _beside_table(results) if answered else plain_answer(results)
    line = f"validity: {badge(checks)}"
    return [f"{line}; do not rely on these results", *said] if worst_word(checks) == INVALID else [*said, line]


def _beside_table(results: xr.Dataset) -> list[str]:
    """Return what the short table of a study does not show: the building as a whole, sensitivity, kits."""
    kind = str(results.attrs["kind"])
    if kind == "performance":
        # (how often anything falls, and what is lost, with what stands between)
        plain = plain_answer(results)
        last = next((place for place, sentence in enumerate(plain) if sentence.startswith("The expected loss")), 0)
        return [*plain[: last + 1], *money_steps(results)]
    if kind == "sensitivity":
        return plain_answer(results)
    choice = [one for one in (choice_of_law(results),) if one]
    slid = [*edge_sentences(results), *trip_sentences(results)]
    crossing = crossed_pieces(results)[:1]  # (the report has the others)
    beyond = [*rate_sentences(results), *second_opinions(results)] if "rate" in results else []
    # (what rates rest on and which law they are of is one paragraph)
    rests = " ".join([*beyond, *choice])
    missed = filter(None, [missed_precision(results)])
    together = [*missed, *event_sentences(results), *crossing, *([rests] if rests else [])]
    return [*together, *gain_sentences(results), *break_sentences(results), *slid]
