"""Ids of curves in files, which the programs accept."""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

from .files import ExchangeError

MAX_ID = 60
OPENQUAKE_MARKS = "_:-"
TABLE_MARKS = "_."
"""Characters of ids beside letters and digits: pelicun splits ids at hyphens, and FEMA P-58's own ids have points."""
DIGITS = 10  # of the hash that tells alike ids apart

# Words that tables take for a missing or infinite number or a truth value, and names of rows that pelicun reserves.
_RESERVED = {"na", "nan", "null", "none", "n", "nil", "inf", "infinity", "true", "false"}
_RESERVED |= {"units", "collapse", "irreparable", "excessiverid", "aggregate"}


def is_id(text: str, marks: str = "_") -> bool:
    """Return True if a text is an id: a letter, then letters, digits and `marks`, at most `MAX_ID` characters.

    With underscores as the only marks every program accepts it. A word that a table reads as a missing number is no id.
    OpenQuake's rule is that of assets and models: openquake.hazardlib.valid.SimpleId, with the engine of 2017 (read);
    the colon is that of newer engines (recalled).
    """
    allowed = rf"[A-Za-z][A-Za-z0-9{re.escape(marks)}]{{0,{MAX_ID - 1}}}"
    return re.fullmatch(allowed, text) is not None and text.lower() not in _RESERVED


def check_ids(ids: Sequence[str], components: int, marks: str) -> list[str]:
    """Return ids that a caller chose; TypeError, ValueError where they are not one a component, legal and unique."""
    if isinstance(ids, str) or not all(isinstance(one, str) for one in ids):
        raise TypeError("ids must be a sequence of texts, one a component")
    chosen = [str(one) for one in ids]
    if len(chosen) != components:
        raise ValueError(f"ids must be one a component, got {len(chosen):,} for {components:,} components")
    bad = next((one for one in chosen if not is_id(one, marks)), None)
    if bad is not None:
        raise ValueError(
            f"ids must begin with a letter, hold letters, digits and {' '.join(marks)} alone, have at most {MAX_ID} "
            f"characters and be no reserved word, got {bad!r:.80}"
        )
    name, count = Counter(chosen).most_common(1)[0] if chosen else ("", 0)
    if count > 1:
        raise ValueError(f"ids must differ, got {name!r} for {count:,} components")
    return chosen


def make_ids(labels: Sequence[tuple[str, ...]], dims: Sequence[str] = ()) -> dict[tuple[str, ...], str]:
    """Return an id for each combination of labels: independent of their order, and unique even without capitals.

    An id holds letters, digits and underscores. Where two would be alike, where one would be too long or a reserved
    word, it ends in ten digits of a hash of its labels.

    >>> list(make_ids([("bookcase-5-shelf", "discrete e=0.92 δ=0.05")]).values())
    ['bookcase_5_shelf__discrete_e_0_92_delta_0_05']
    """
    at = dims.index("floor") if "floor" in dims else None
    plain = {
        one: _plain([f"floor {x}" if k == at and x.isdecimal() else x for k, x in enumerate(one)]) for one in labels
    }
    counts = Counter(made.lower() for made in plain.values())
    found = {
        one: made if counts[made.lower()] == 1 and is_id(made) else f"{made[: MAX_ID - DIGITS - 1]}_{_digest(one)}"
        for one, made in plain.items()
    }
    if len({made.lower() for made in found.values()}) < len(found):
        raise ExchangeError(f"{len(found)} curves get ids that are alike: rename their blocks or models")
    return found


def _plain(labels: Sequence[str]) -> str:
    text = "__".join(word for word in map(_slug, labels) if word) or "curve"
    return text if text[0].isalpha() else f"c_{text}"


def _slug(label: str) -> str:
    """Return a label's letters and digits: Greek letters by name, no accents, an underscore for runs of all else."""
    found = []
    for character in unicodedata.normalize("NFKD", label):
        if character.isascii():
            found.append(character if character.isalnum() else "_")
            continue
        words = unicodedata.name(character, "").split(" ")
        if words[0] == "GREEK" and words[2:3] == ["LETTER"] and len(words) == 4:
            found.append(words[3].lower())
        elif not unicodedata.combining(character):
            found.append("_")
    return re.sub(r"_+", "_", "".join(found)).strip("_")


def _digest(labels: tuple[str, ...]) -> str:
    return hashlib.sha256(json.dumps(labels).encode()).hexdigest()[:DIGITS]
