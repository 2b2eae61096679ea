"""JSON file of a fragility table of pelicun: description of each id, for people and for `read_pelicun`.

Its keys are those that the Damage and Loss Model Library allows, and no others: our own record of a component is the
last line of its comments.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ....core.sentences import register_of
from ...validity.notes import TEMPLATES
from ..files import ExchangeError, read_text
from ..ids import Component, component_of, component_record
from ..rows import CurveRow, CurveSet

GENERAL = "_GeneralInformation"
RECORD = "Labels for toppling: "
"""Beginning of the line of comments with our record of a component."""
REPAIR = "To be given by the user."


def general_information(title: str, description: str, ids: Iterable[str]) -> dict[str, Any]:
    """Return the library's information on a whole table; groups are the parts of the ids before their last points."""
    groups = dict.fromkeys(number.rpartition(".")[0] for number in ids if "." in number)
    return {
        "ShortName": title,
        "Description": description,
        "Version": "1.0",
        "ComponentGroups": [f"{group} - {title}" for group in groups],
    }


def metadata_text(
    curves: CurveSet, description: str = "", notes: Mapping[str, str] = MappingProxyType({}), repair: str = REPAIR
) -> str:
    """Return the JSON of a table. `notes`: comments on components, by id."""
    components = curves.components()
    about = f"{curves.title}; made by toppling. {description}{_register().advice}"
    content = {
        GENERAL: general_information(curves.title, about, components),
        **{name: _entry(curves, rows, notes.get(name, ""), repair) for name, rows in components.items()},
    }
    return json_of(content)


def json_of(content: Mapping[str, Any]) -> str:
    """Return metadata as text."""
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


def _entry(curves: CurveSet, rows: Sequence[CurveRow], note: str, repair: str) -> dict[str, Any]:
    ours = component_record(curves, rows)
    rough = any(row.probability is not None for row in rows)
    fine = not all(row.lognormal for row in rows)
    beta = next((row.numbers["modelling_dispersion"] for row in rows if "modelling_dispersion" in row.numbers), None)
    text = _register().comments(note, ours.get("note", ""), ours.get("status"), rough, fine, beta)
    return {
        "Description": f"{', '.join(ours['labels'].values()) or curves.title}: fragility in {curves.long_name}",
        "Comments": f"{text}\n{RECORD}{json.dumps(ours, ensure_ascii=False)}",
        "SuggestedComponentBlockSize": "1 EA",
        "RoundUpToIntegerQuantity": "True",
        "LimitStates": _limit_states(curves, rows, repair),
    }


def _limit_states(curves: CurveSet, rows: Sequence[CurveRow], repair: str) -> dict[str, Any]:
    """Return the damage states of each limit state, which pelicun counts through all limit states of a component."""
    states: dict[str, Any] = {}
    number = 0
    for i, (state, row) in enumerate(zip(curves.limit_states, rows, strict=True), start=1):
        several = len(row.words.get("weights", "").split("|"))
        states[f"LS{i}"] = {
            f"DS{number + k}": {"Description": state, "RepairAction": repair} for k in range(1, several + 1)
        }
        number += several
    return states


def _register() -> Any:
    return register_of(TEMPLATES, "components")


def read_metadata(file: Path) -> tuple[str, dict[str, Component]]:
    """Return the title of a table and our records of its components, by id, from the table's JSON.

    Both are empty without such a file; ExchangeError for any other JSON.
    """
    if not file.is_file():
        return "", {}
    _, text = read_text(file)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise ExchangeError(f"{file}: no JSON") from None
    if not isinstance(content, dict):
        raise ExchangeError(f"{file}: must say something of each component, got {type(content).__name__}")
    general = content.get(GENERAL)
    title = general.get("ShortName") if isinstance(general, dict) else None
    entries = {name: component_of(_record(entry)) for name, entry in content.items() if isinstance(entry, dict)}
    known = {name: entry for name, entry in entries.items() if entry is not None}
    return title if isinstance(title, str) else "", known


def _record(entry: Mapping[str, Any]) -> Any:
    """Return our record of a component; None if its comments have none."""
    comments = entry.get("Comments")
    if not isinstance(comments, str):
        return None
    _, mark, record = comments.rpartition(f"\n{RECORD}")
    try:
        return json.loads(record) if mark else None
    except (ValueError, RecursionError):
        return None
