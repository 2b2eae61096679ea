"""Intended differences: the entries of CHANGES.md."""

import math
import re
import tomllib
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from itertools import product
from typing import NamedTuple

from compare import Difference

CASES = ("studies/office", "refused/studies/block_lean", "commands/wrong/option", "scripts/models")
ITEMS = ("out/results.nc:median", "report.html", "1 err", "1 exit")
"""Examples of cases and items: who allows all of them allows everything."""


class Change(NamedTuple):
    """An intended difference, an entry of CHANGES.md.

    after, before: last commit without the change; first commit that has it no longer, empty if there is none.
    studies, items: patterns of cases and of items.
    largest: largest relative difference allowed of numbers; infinity for texts, variables and files.
    text: a regular expression that the words of the difference contain.
    """

    issue: str
    after: str
    studies: str
    items: Sequence[str]
    reason: str
    largest: float = math.inf
    text: str = ""
    before: str = ""

    def allows(self, difference: Difference) -> bool:
        """True if the change explains a difference."""
        return (
            fnmatchcase(difference.case, self.studies)
            and any(fnmatchcase(difference.item, item) for item in self.items)
            and difference.size <= self.largest
            and re.search(self.text, difference.what) is not None
        )


def read_changes(text: str) -> list[Change]:
    """Return the entries of CHANGES.md, which stand in its blocks of TOML.

    Raises
    ------
    ValueError
        An entry allows every difference of every case, lacks a key or has another one.
    """
    blocks = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    changes = []
    for entry in (entry for block in blocks for entry in tomllib.loads(block).get("change", [])):
        try:
            change = Change(**entry)
        except TypeError as error:
            raise ValueError(f"CHANGES.md: {entry.get('issue', 'an entry')}: {error}") from None
        changes.append(change)
        for size, words in product((0.0, 1e-9, math.inf), ("1 of 2 values", "“a” → “b”")):
            if all(change.allows(Difference(case, item, size, words)) for case in CASES for item in ITEMS):
                raise ValueError(f"CHANGES.md: {change.issue}: {change.reason}: an entry must not allow everything")
    return changes


def sort_out(differences: Iterable[Difference], changes: Sequence[Change]) -> tuple[list[Difference], list[Change]]:
    """Return the differences that no change allows, and the changes that allow none."""
    unlisted, idle = [], list(changes)
    for difference in differences:
        allowing = [change for change in changes if change.allows(difference)]
        idle = [change for change in idle if change not in allowing]
        if not allowing:
            unlisted.append(difference)
    return unlisted, idle
