"""Parts of the page of study files beside the keys: which belong to one generator, law …, and kinds of doubts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any

from toppling.core.doubts import KINDS
from toppling.models import LAWS
from toppling.motions import ENVELOPES, GENERATORS, PULSES
from toppling.studies.file import blocks, code, motions, supports, uncertainty
from toppling.studies.file.table import bare
from toppling.studies.reference.json_schema import study_schema


def of_classes(table: str, classes: Mapping[str, Any]) -> dict[str, tuple[set[str], set[str]]]:
    """Return, by name, the keys of a table that an instance of each class takes, and those that it must be given."""
    keys = study_schema()["$defs"][table]["properties"]
    found = {}
    for name, one in classes.items():
        fields = {key: one.__dataclass_fields__[bare(key)] for key in keys if bare(key) in one.__dataclass_fields__}
        plain = {key for key, field in fields.items() if field.default is field.default_factory is MISSING}
        found[name] = set(fields) - {"law"}, {key for key in plain if "default" not in keys[key]}
    return found


def doubts_section() -> str:
    """The section of the kinds of doubts that a study can accept."""
    rows = "".join(f"| `{kind}` | {text} |\n" for kind, text in KINDS.items())
    return f"\n## Kinds of doubts\n\nWhat `accept` names.\n\n| kind | what is odd |\n|---|---|\n{rows}"


def choices_section() -> str:
    """The section of the page of all keys that says which keys belong to which choice."""
    tables: dict[str, Mapping[str, tuple[set[str], set[str]]]] = {
        "`law` of `[[models]]`": of_classes("ModelTable", LAWS),
        "`generator` of `[motions]`": of_classes("MotionsTable", GENERATORS),
        "`pulse` of `[motions]`": of_classes("MotionsTable", PULSES),
        "`kind` of `[motions.envelope]`": of_classes("EnvelopeTable", ENVELOPES),
        "`kind` of `[building]`": motions.BUILDINGS,
        "`kind` of `[building.isolation]`": motions.ISOLATORS,
        "`kind` of `[support]`": supports.KINDS,
        "`kind` of `[restraints.NAME]`": {
            kind: (keys, set(blocks.RESTRAINT_NEEDS[kind])) for kind, keys in blocks.RESTRAINT_KEYS.items()
        },
        "`standard` of `[performance.code]`": code.STANDARDS,
        "`distribution` of `[uncertainty.inputs.NAME]`": {
            name: ({*given, *more}, set(given)) for name, (_, given, more) in uncertainty.DISTRIBUTIONS.items()
        },
    }
    parts = ["\n## Keys of one choice\n\nKeys in bold must be given.\n\n| choice | name | its keys |\n|---|---|---|\n"]
    for choice, names in tables.items():
        for name, (own, needed) in names.items():
            keys = ", ".join(f"**`{key}`**" if key in needed else f"`{key}`" for key in sorted(own))
            parts.append(f"| {choice} | `{name}` | {keys} |\n")
    return "".join(parts)
