"""Differences between two study files in words, for a folder with the results of the other study."""

import json
from collections.abc import Iterator
from typing import Any

from ..file.motions import PROCESSING

MOST_SAID = 3
"""Most keys that are named; of more keys only their number is given."""


APART = ("title", "accept", "report")
"""Keys of a study file that change no result, and are no part of a study's identity."""
DECISIONS = {"performance": ("sort", "safety", "code", "budget", "target", "discount_rate")}
"""Keys by table that change no run: their results are computed from results, and they are no part of the identity."""
FILES = ("records", "floors_file", "floors_index", "target")
"""Keys of motions that name files."""


def identifying(study: Any) -> Any:
    """Return the part of a study file's content that decides its runs, and so its identity."""
    if not isinstance(study, dict):
        return study
    tables = {key: value for key, value in study.items() if key not in APART}
    for table, keys in DECISIONS.items():
        if isinstance(tables.get(table), dict):
            tables[table] = {key: value for key, value in tables[table].items() if key not in keys}
    if isinstance(tables.get("restraints"), dict):  # (what a kit costs changes no run)
        kits = tables["restraints"].items()
        tables["restraints"] = {
            name: {key: value for key, value in kit.items() if key != "cost"} if isinstance(kit, dict) else kit
            for name, kit in kits
        }
    return tables


def same_inputs(before: str, now: str) -> bool:
    """Return True if two identities are of one study and the tables that it reads, whatever its motions' samples."""
    return before.partition("-")[0] == now.partition("-")[0]


def makes_motions(study: Any) -> bool:
    """Return True if the motions of a study are generated, so that no file can have changed them."""
    tables = _motions_of(study)
    return bool(tables) and not any(name in table for table in tables for name in FILES)


def corrects(study: Any) -> bool:
    """Return True if a study computes its motions from its input: corrections, or floors of a building."""
    tables = _motions_of(study)
    return any(name in table for table in tables for name in PROCESSING) or "building" in study


def _motions_of(study: Any) -> list[dict[str, Any]]:
    """Return the tables of motions of a study; none if it is not one."""
    if not isinstance(study, dict):
        return []
    tables = [study.get("motions")]
    tables += [stripe.get("motions") or {} for stripe in (study.get("stripes") or {}).get("at", [])]
    tables += [motion_set.get("motions") for motion_set in study.get("motion_sets") or []]
    tables_of = [table for table in tables if isinstance(table, dict)]
    return tables_of if len(tables_of) == len(tables) else []


def differences(before: Any, now: Any, same: bool = False) -> str:
    """Return the keys of a study file whose values differ; if none differs, the other changes.

    Both contents are plain values; keys outside the identity are not compared. `same` is True if the inputs are the
    same, and the motions alone differ (`same_inputs`).

    >>> differences({"motions": {"seed": 1}}, {"motions": {"seed": 2}})
    'motions.seed was 1, is 2'
    """
    changed = [f"{key} was {old}, is {new}" for key, old, new in changes(identifying(before), identifying(now))]
    if not changed:
        if same and makes_motions(now):
            return "this processor or its libraries make other motions"
        if same:
            how = ", or this machine corrects them in other last digits" if corrects(now) else ""
            return f"the records that it reads have changed{how}"
        return "the records or tables that it reads have changed"
    more = f" and {len(changed) - MOST_SAID} more" if len(changed) > MOST_SAID else ""
    return "; ".join(changed[:MOST_SAID]) + more


def changes(before: Any, now: Any, key: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield each key whose values differ with both values in words; keys `APART` are not compared.

    >>> list(changes({"hazard": {"k": 2.0}}, {"hazard": {"k": 2.5, "k0": 0.001}}))
    [('hazard.k', '2.0', '2.5'), ('hazard.k0', 'not given', '0.001')]
    """
    if isinstance(before, dict) and isinstance(now, dict):
        for name in dict.fromkeys([*before, *now]):
            if not key and name in APART:
                continue
            yield from changes(before.get(name), now.get(name), f"{key}.{name}" if key else str(name))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for i, (old, new) in enumerate(zip(before, now, strict=True), start=1):
            yield from changes(old, new, f"{key}[{i}]")
    elif before != now:
        texts = _text(before), _text(now)
        first = next(
            (i for i, pair in enumerate(zip(*texts, strict=False)) if pair[0] != pair[1]), min(map(len, texts))
        )
        yield key, _short(texts[0], first), _short(texts[1], first)


def _text(value: Any) -> str:
    return "not given" if value is None else json.dumps(value, ensure_ascii=False)


def _short(text: str, first: int) -> str:
    """Return at most 40 characters of a text, its first difference from another one among them."""
    start = first - 10 if first > 30 else 0
    head, tail = "..." * bool(start), text[start:]
    return f"{head}{tail}" if len(head + tail) <= 40 else f"{head}{tail[:34]}..."
