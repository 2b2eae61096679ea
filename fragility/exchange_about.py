"""What we write beside an id, in whatever way a format allows, so that curves come back with their labels."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .exchange import LARGEST, LIMIT_STATE, OVERTURNING, SMALLEST, Curve, CurveSet
from .statuses import OK, SEPARATED

SIZES = ("width", "height")

GUESSED = "The data are separated: the dispersion is a guess (penalised likelihood)."
"""What is said of a curve that few runs hold up."""


class Component(NamedTuple):
    """What we wrote of a component: labels by dimension, limit states, sizes (m), and why it has no curve."""

    labels: Mapping[str, str]
    limit_states: Sequence[str]
    sizes: Mapping[str, float]
    reason: str | None


def about(found: CurveSet, rows: Sequence[Curve]) -> dict[str, Any]:
    """What there is to say of a component, as JSON holds it."""
    labels = found.named(rows[0])
    labels.pop(LIMIT_STATE, None)
    reason = next((row.status for row in rows if not row.estimated), None)
    return {
        "labels": labels,
        **({} if found.limit_states == (OVERTURNING,) else {"limit_states": list(found.limit_states)}),
        **{name: rows[0].numbers[name] for name in SIZES if name in rows[0].numbers},
        **({} if reason is None else {"status": reason}),
        **({"note": GUESSED} if reason is None and any(row.status == SEPARATED for row in rows) else {}),
    }


def component(written: Any) -> Component | None:
    """What `about` made, read back; None where it is not what we write."""
    labels = written.get("labels") if isinstance(written, dict) else None
    if not isinstance(written, dict) or not isinstance(labels, dict) or LIMIT_STATE in labels:
        return None
    if not all(isinstance(value, str) and re.fullmatch(r"[a-z_]{1,40}", key) for key, value in labels.items()):
        return None
    states = written.get("limit_states")
    reason = written.get("status")
    return Component(
        labels,
        [one for one in states if isinstance(one, str)] if isinstance(states, list) else [],
        {key: size for key in SIZES if isinstance(size := written.get(key), float) and SMALLEST < size < LARGEST},
        reason if isinstance(reason, str) and reason != OK else None,
    )


def with_labels(
    rows: Sequence[tuple[str, int, Curve]], components: Mapping[str, Component], states: Sequence[str]
) -> tuple[tuple[str, ...], tuple[Curve, ...]]:
    """Dimensions, and curves with all their labels, of (id, which of the limit states, curve).

    Labels are those that we wrote where every component has them on the same dimensions, else the ids on ``block``;
    limit states make a dimension where one has more than the first.
    """
    written = [components.get(name) for name, _, _ in rows]
    dims_of = {None if one is None else tuple(one.labels) for one in written}
    dims = next(iter(dims_of)) if len(dims_of) == 1 else None
    several = any(at > 0 for _, at, _ in rows)
    named = []
    for (name, at, curve), one in zip(rows, written, strict=True):
        labels = (name,) if dims is None or one is None else tuple(one.labels.values())
        state, status, sizes = states[at], curve.status, {}
        if one is not None:
            state = one.limit_states[at] if at < len(one.limit_states) else state
            status = one.reason if status != OK and one.reason is not None else status
            sizes = dict(one.sizes)
        named.append(
            curve._replace(
                labels=(*labels, state) if several else labels, status=status, numbers={**curve.numbers, **sizes}
            )
        )
    found = ("block",) if dims is None else dims
    return (*found, LIMIT_STATE) if several else found, tuple(named)


def only_state(rows: Sequence[tuple[str, int, Curve]], components: Mapping[str, Component], state: str) -> str:
    """The limit state of curves that have one: what we wrote of all of them, `state` where we did not."""
    written = [components.get(name) for name, _, _ in rows]
    named = {None if one is None else (*one.limit_states, OVERTURNING)[0] for one in written}
    found = named.pop() if len(named) == 1 else None
    return state if found is None else found
