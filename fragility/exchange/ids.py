"""Identity of curves in files: ids that the programs accept, and the labels that are written with them.

Each format stores the labels in its own way, so that curves are read back with them.
"""

import hashlib
import itertools
import json
import math
import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core import checks
from ...core.doubts import warn
from ...motions.plausibility import unusual
from ..fitting.states import OK, SEPARATED
from ..validity.plausibility import level_doubts
from .files import ExchangeError
from .rows import LARGEST, LIMIT_STATE, OVERTURNING, SMALLEST, CurveRow, CurveSet

SIZES = ("width", "height")

GUESSED = "The data are separated: the dispersion is a guess (penalised likelihood)."
"""Note on a curve whose dispersion few runs determine."""

MAX_ID = 60
OPENQUAKE_MARKS = "_:-"
TABLE_MARKS = "_."
"""Characters of ids in addition to letters and digits: pelicun splits ids at hyphens, and FEMA P-58's own ids have
points.
"""
DIGITS = 10  # of the hash that tells alike ids apart

# Words that tables take for a missing or infinite number or a truth value, and names of rows that pelicun reserves.
_RESERVED = {"na", "nan", "null", "none", "n", "nil", "inf", "infinity", "true", "false"}
_RESERVED |= {"units", "collapse", "irreparable", "excessiverid", "aggregate"}


def is_id(text: str, marks: str = "_") -> bool:
    """Return True if a text is an id: a letter, then letters, digits and `marks`, at most `MAX_ID` characters.

    Every program accepts ids with underscores as the only marks. A word that a table reads as a missing number is no
    id. OpenQuake accepts any text as the id of a function, which is the taxonomy of assets. The rule here is
    OpenQuake's for its other ids (assets, models), so that a name can serve in both places:
    openquake.hazardlib.valid.SimpleId. It allows letters, digits, ``_`` and ``-``, at most 60 characters, with the
    engine of 2017 (read); newer engines also allow the colon (recalled).
    """
    allowed = rf"[A-Za-z][A-Za-z0-9{re.escape(marks)}]{{0,{MAX_ID - 1}}}"
    return re.fullmatch(allowed, text) is not None and text.lower() not in _RESERVED


def check_ids(ids: Sequence[str], components: int, marks: str) -> list[str]:
    """Return ids that a caller chose; TypeError, ValueError if they are not one a component, legal and unique."""
    if isinstance(ids, str) or not checks.is_several(ids) or not all(isinstance(number, str) for number in ids):
        raise TypeError("ids must be a sequence of texts, one a component")
    chosen = [str(number) for number in ids]
    if len(chosen) != components:
        raise ValueError(f"ids must be one a component, got {len(chosen):,} for {components:,} components")
    bad = next((chosen_id for chosen_id in chosen if not is_id(chosen_id, marks)), None)
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

    An id consists of letters, digits and underscores. If two would be alike, or one would be too long or a reserved
    word, it ends in ten digits of a hash of its labels.

    >>> list(make_ids([("bookcase-5-shelf", "discrete e=0.92 δ=0.05")]).values())
    ['bookcase_5_shelf__discrete_e_0_92_delta_0_05']
    """
    at = dims.index("floor") if "floor" in dims else None
    plain = {
        label: _plain([f"floor {x}" if k == at and x.isdecimal() else x for k, x in enumerate(label)])
        for label in labels
    }
    counts = Counter(made.lower() for made in plain.values())
    made_ids = {
        key: made if counts[made.lower()] == 1 and is_id(made) else f"{made[: MAX_ID - DIGITS - 1]}_{_digest(key)}"
        for key, made in plain.items()
    }
    if len({made.lower() for made in made_ids.values()}) < len(made_ids):
        raise ExchangeError(f"{len(made_ids)} curves get ids that are alike: rename their blocks or models")
    return made_ids


def _plain(labels: Sequence[str]) -> str:
    text = "__".join(word for word in map(_slug, labels) if word) or "curve"
    return text if text[0].isalpha() else f"c_{text}"


def _slug(label: str) -> str:
    """Return a label's letters and digits: Greek letters by name, no accents, an underscore for runs of all else."""
    letters = []
    for character in unicodedata.normalize("NFKD", label):
        if character.isascii():
            letters.append(character if character.isalnum() else "_")
            continue
        words = unicodedata.name(character, "").split(" ")
        if words[0] == "GREEK" and words[2:3] == ["LETTER"] and len(words) == 4:
            letters.append(words[3].lower())
        elif not unicodedata.combining(character):
            letters.append("_")
    return re.sub(r"_+", "_", "".join(letters)).strip("_")


def _digest(labels: tuple[str, ...]) -> str:
    return hashlib.sha256(json.dumps(labels).encode()).hexdigest()[:DIGITS]


class Component(NamedTuple):
    """Our record of a component: labels by dimension, limit states, sizes (m), and the reason for a missing curve."""

    labels: Mapping[str, str]
    limit_states: Sequence[str]
    sizes: Mapping[str, float]
    reason: str | None


def component_record(curves: CurveSet, rows: Sequence[CurveRow]) -> dict[str, Any]:
    """Return our record of a component in the types of JSON."""
    labels = dict(zip(curves.dims, rows[0].labels, strict=True))
    labels.pop(LIMIT_STATE, None)
    reason = next((row.status for row in rows if not row.estimated), None)
    return {
        "labels": labels,
        **({} if curves.limit_states == (OVERTURNING,) else {"limit_states": list(curves.limit_states)}),
        **{name: rows[0].numbers[name] for name in SIZES if name in rows[0].numbers},
        **({} if reason is None else {"status": reason}),
        **({"note": GUESSED} if reason is None and any(row.status == SEPARATED for row in rows) else {}),
    }


def component_of(written: Any) -> Component | None:
    """Return the component of a record that was read back; None for anything that `component_record` does not make."""
    labels = written.get("labels") if isinstance(written, dict) else None
    if not isinstance(written, dict) or not isinstance(labels, dict) or LIMIT_STATE in labels:
        return None
    if not all(isinstance(value, str) and re.fullmatch(r"[a-z_]{1,40}", key) for key, value in labels.items()):
        return None
    states = written.get("limit_states")
    reason = written.get("status")
    return Component(
        labels,
        [state for state in states if isinstance(state, str)] if isinstance(states, list) else [],
        {key: size for key in SIZES if isinstance(size := written.get(key), float) and SMALLEST < size < LARGEST},
        reason if isinstance(reason, str) and reason != OK else None,
    )


def labelled_curves(
    file: Path,
    rows: Sequence[tuple[str, int, CurveRow]],
    components: Mapping[str, Component],
    states: Sequence[str],
    units: str,
) -> tuple[tuple[str, ...], tuple[CurveRow, ...]]:
    """Return dimensions, and curves with all their labels, from rows of (id, index of the limit state, curve).

    Labels come from our records if every component has them on the same dimensions, else from the ids, on ``block``.
    Limit states form a dimension if a component has more than the first.
    """
    # (what we wrote may have states of any order, and medians that are far extrapolated)
    foreign = [row for row in rows if row[0] not in components]
    for (better, lower, lesser), (name, at, worse) in itertools.pairwise(foreign):
        (least, spread, *_), (median, dispersion, *_) = lesser.parameters, worse.parameters
        more = median < least and math.isclose(dispersion, spread, rel_tol=1e-6)
        if worse.probability is not None and lesser.probability is not None:
            more = bool(np.any(worse.probability > lesser.probability + 1e-6))
        if better == name and at > lower and more:
            raise ExchangeError(
                f"{file}: {states[at]} of {name!r:.80} is more likely than {states[lower]}, a lesser state, which "
                "contains it: correct the median of one"
            )
    estimated = [row.parameters for *_, row in foreign if row.estimated]
    doubts = level_doubts(np.array([lognormal.median for lognormal in estimated]), units)
    doubts += unusual({"dispersion of a curve": [lognormal.dispersion for lognormal in estimated]}, "table")
    warn(
        doubt._replace(sentence=f"{file}: {doubt.sentence.replace('highest level', 'highest median')}")
        for doubt in doubts
    )
    written = [components.get(name) for name, _, _ in rows]
    dims_of = {None if record is None else tuple(record.labels) for record in written}
    dims = next(iter(dims_of)) if len(dims_of) == 1 else None
    several = any(at > 0 for _, at, _ in rows)
    named = []
    for (name, at, curve), component in zip(rows, written, strict=True):
        labels = (name,) if dims is None or component is None else tuple(component.labels.values())
        state, status, sizes = states[at], curve.status, {}
        if component is not None:
            state = component.limit_states[at] if at < len(component.limit_states) else state
            status = component.reason if status != OK and component.reason is not None else status
            sizes = dict(component.sizes)
        named.append(
            curve._replace(
                labels=(*labels, state) if several else labels, status=status, numbers={**curve.numbers, **sizes}
            )
        )
    named_dims = ("block",) if dims is None else dims
    return (*named_dims, LIMIT_STATE) if several else named_dims, tuple(named)


def common_limit_state(rows: Sequence[tuple[str, int, CurveRow]], components: Mapping[str, Component]) -> str:
    """Return the limit state of curves that have only one: from our records, or LS1 if these differ or are missing."""
    written = [components.get(name) for name, _, _ in rows]
    named = {None if record is None else (*record.limit_states, OVERTURNING)[0] for record in written}
    state = named.pop() if len(named) == 1 else None
    return "LS1" if state is None else state
