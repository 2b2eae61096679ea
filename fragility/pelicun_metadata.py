"""What stands beside a fragility table of pelicun: a JSON that tells people, and `read_pelicun`, what each id is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from .exchange import Curve, CurveSet
from .exchange_about import Component, about, component
from .exchange_files import ExchangeError, read_text

OURS = "Toppling"  # our own key among a component's metadata
GENERAL = "_GeneralInformation"

ADVICE = (
    "The probability is that under shaking in the direction of the component, across its smaller plan "
    "size: give the component direction 1 or 2. In direction 0, or with Demand-Directional 0, pelicun takes 1.2 times "
    "the larger of both directions."
)


class Metadata(NamedTuple):
    """Title of the table, and what we wrote of its components, by id."""

    title: str = ""
    components: Mapping[str, Component] = MappingProxyType({})


def metadata(found: CurveSet) -> str:
    """The JSON beside a table: the library's layout, and our own labels under one key of each component."""
    content = {
        GENERAL: {
            "ShortName": found.title,
            "Description": f"{found.title}; made by toppling. {ADVICE}",
            "Version": "1.0",
        },
        **{name: _entry(found, rows) for name, rows in found.components().items()},
    }
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


def _entry(found: CurveSet, rows: Sequence[Curve]) -> dict[str, Any]:
    ours = about(found, rows)
    reason = ours.get("status")
    return {
        "Description": f"{', '.join(ours['labels'].values()) or found.title}: fragility in {found.long_name}",
        "Comments": " ".join([*([ours["note"]] if "note" in ours else []), ADVICE])
        if reason is None
        else f"No estimate: {reason}.",
        "SuggestedComponentBlockSize": "1 EA",
        "RoundUpToIntegerQuantity": "True",
        "LimitStates": {
            f"LS{i}": {"DS1": {"Description": state, "RepairAction": "To be given by the user."}}
            for i, state in enumerate(found.limit_states, start=1)
        },
        OURS: ours,
    }


def read_metadata(file: Path) -> Metadata:
    """What stands beside a table; nothing where there is no such file; ExchangeError where it is no such JSON."""
    if not file.is_file():
        return Metadata()
    _, text = read_text(file)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ExchangeError(f"{file}: no JSON") from None
    if not isinstance(found, dict):
        raise ExchangeError(f"{file}: must say something of each component, got {type(found).__name__}")
    general = found.get(GENERAL)
    title = general.get("ShortName") if isinstance(general, dict) else None
    entries = {name: component(entry.get(OURS)) for name, entry in found.items() if isinstance(entry, dict)}
    return Metadata(
        title if isinstance(title, str) else "", {name: one for name, one in entries.items() if one is not None}
    )
