"""Ids that every program takes, made of the labels of curves."""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

from .exchange_files import ExchangeError

MAX_ID = 75
DIGITS = 10  # of the hash that tells alike ids apart

# Words that tables take for a missing or infinite number or a truth value, and rows that pelicun keeps for itself.
_RESERVED = {"na", "nan", "null", "none", "n", "nil", "inf", "infinity", "true", "false"}
_RESERVED |= {"units", "collapse", "irreparable", "excessiverid", "aggregate"}
_ID = re.compile(rf"[A-Za-z][A-Za-z0-9_.]{{0,{MAX_ID - 1}}}")


def is_id(text: str) -> bool:
    """Whether every program takes a text as an id.

    A letter, then letters, digits, underscores and points: no hyphen (pelicun splits ids there), no quotes or blanks
    (OpenQuake), no word that a table reads as a missing number.
    """
    return _ID.fullmatch(text) is not None and text.lower() not in _RESERVED


def make_ids(labels: Sequence[tuple[str, ...]], dims: Sequence[str] = ()) -> dict[tuple[str, ...], str]:
    """An id for each combination of labels: the same whatever their order, no two alike, not even but for capitals.

    Examples
    --------
    >>> list(make_ids([("bookcase-5-shelf", "discrete e=0.92 δ=0.05")]).values())
    ['bookcase_5_shelf.discrete_e_0.92_delta_0.05']
    >>> list(make_ids([("vase", "3")], ["block", "floor"]).values())
    ['vase.floor_3']
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
    text = ".".join(word for word in map(_slug, labels) if word) or "curve"
    return text if text[0].isalpha() else f"c_{text}"


def _slug(label: str) -> str:
    """Letters and digits of a label, Greek ones by their names, accents dropped, runs of all else an underscore."""
    found = []
    for character in unicodedata.normalize("NFKD", label):
        if character.isascii():
            found.append(character if character.isalnum() or character == "." else "_")
            continue
        words = unicodedata.name(character, "").split(" ")
        if words[0] == "GREEK" and words[2:3] == ["LETTER"] and len(words) == 4:
            found.append(words[3].lower())
        elif not unicodedata.combining(character):
            found.append("_")
    return re.sub(r"_+", "_", "".join(found)).strip("_.")


def _digest(labels: tuple[str, ...]) -> str:
    return hashlib.sha256(json.dumps(labels).encode()).hexdigest()[:DIGITS]
