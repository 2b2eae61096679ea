"""Sentences of a comparison: how many blocks or pieces differ, and how its tables are read."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.wording import counted
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, UNKNOWN
from .ratios import ANCHORED_IN, Line, Quantity, law_text

ONE = {
    HIGHER: f"{HIGHER} in B, by more than the choice of motions explains",
    LOWER: f"{LOWER} in B, by more than the choice of motions explains",
    OPEN: f"{OPEN}: the choice of motions may explain the difference",
    SAME: "exactly the same",
}
"""What is said of a single comparison, by its verdict."""
KEPT = {
    ANCHORED_IN["A"]: "anchored in A and cannot fall there",
    ANCHORED_IN["B"]: "anchored in B and cannot fall there",
    ANCHORED_IN["both"]: "anchored in both and cannot fall",
}
"""What is said of anchored pieces, by their verdict."""


def answer(lines: Sequence[Line], quantity: Quantity) -> str:
    """Return in a sentence how many of a quantity differ by more than the choice of motions explains, law by law."""
    own = [line for line in lines if line.quantity == quantity.name]
    each = {law: _counts([line for line in own if law_text(line.laws) == law]) for law in _laws(own)}
    different = set(each.values())
    if len(different) == 1:
        under = f" under each of the {len(each)} laws" if len(each) > 1 else ""
        return f"{quantity.title}{under}: {different.pop()}"
    return f"{quantity.title}: {'; '.join(f'under {law}, {said}' for law, said in each.items())}"


def _laws(lines: Sequence[Line]) -> list[str]:
    return list(dict.fromkeys(law_text(line.laws) for line in lines))


def _counts(own: Sequence[Line]) -> str:
    """Say how many lines under one law differ, are not resolved, are the same, and how many pieces are anchored."""
    said = []
    for verdict, text in KEPT.items():
        number = sum(line.verdict == verdict for line in own)
        said += [f"{counted(number, 'piece')} {'is' if number == 1 else 'are'} {text}"] if number else []
    free = [line for line in own if line.verdict not in KEPT]
    total = len(free)
    if not total:
        return "; ".join(said)
    other = "other " if said else ""
    numbers = {word: sum(line.verdict == word for line in free) for word in (HIGHER, LOWER, OPEN, SAME, UNKNOWN)}
    decided = numbers[HIGHER] + numbers[LOWER]
    if numbers[UNKNOWN] == total:
        none = "no ratio has an interval"
        said.append(f"for the other {total:,}, {none}" if other else none)
    elif numbers[SAME] == total:
        said.append(f"the other {total:,} {'is' if total == 1 else 'are'} unchanged" if other else ONE[SAME])
    elif total == 1:
        (only,) = free
        said.append(f"the other one is {ONE[only.verdict]}" if other else ONE[only.verdict])
    else:
        which = [f"{numbers[word]} {word} in B" for word in (HIGHER, LOWER) if numbers[word]]
        counts = f" ({', '.join(which)})" if which else ""
        of = f"the other {total:,}" if other else f"{total:,}"
        said.append(f"{decided} of {of} differ by more than the choice of motions explains{counts}")
        said += (
            [f"{numbers[OPEN]} not resolved: the choice of motions may explain the difference"] if numbers[OPEN] else []
        )
        said += [f"{numbers[SAME]} exactly the same"] if numbers[SAME] else []
        few = numbers[UNKNOWN]
        said += [f"{few} without a verdict, because their ratios have no interval"] if few else []
    return "; ".join(said)


def reading(lines: Sequence[Line]) -> str:
    """Return the legend of the verdicts of a comparison's tables: of those that occur."""
    words = {line.verdict for line in lines}
    said = []
    decided = [word for word in (HIGHER, LOWER) if word in words]
    if decided:
        said.append(
            f"{', '.join(decided)}: the interval of B/A does not include 1, so the choice of motions does not explain "
            "the difference"
        )
    if OPEN in words:
        said.append(f"{OPEN}: the interval of B/A includes 1, and more motions may decide")
    if words & set(KEPT):
        said.append("anchored: the piece is taken as one that cannot fall, so there is no ratio")
    if UNKNOWN in words:
        said.append("–: the ratio has no interval (too few motions bring something down, or a note says why)")
    if SAME in words:
        said.append(f"{SAME}: both numbers are equal in every resample of the motions")
    return "; ".join(said)
