"""What the Damage and Loss Model Library asks of a JSON beside a table: written here from its own tests.

Its tests (``tests/test_data_format.py`` of NHERI-SimCenter/DamageAndLossModelLibrary, read in version 3.2) allow these
keys and no others.  `make test-exchange` holds these rules to every JSON of the library itself.
"""

TEXT = {"type": "string"}


def closed(needed, others=None, patterns=None):
    """An object of these keys alone."""
    return {
        "type": "object",
        "required": [*needed],
        "properties": {**needed, **(others or {})},
        "patternProperties": patterns or {},
        "additionalProperties": False,
    }


STATES = closed({}, patterns={r"^DS\d+$": closed({"Description": TEXT}, {"RepairAction": TEXT})})
COMPONENT = {
    "Description": TEXT,
    "SuggestedComponentBlockSize": TEXT,
    "RoundUpToIntegerQuantity": {"enum": ["True", "False"]},
}
GENERAL = closed(
    {"ShortName": TEXT, "Description": TEXT, "Version": TEXT, "ComponentGroups": {"type": ["object", "array"]}},
    {"DecisionVariables": {"type": "object"}},
)


def whole(component):
    """A file: the general part, references, and components for all other keys."""
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "type": "object",
        "required": ["_GeneralInformation"],
        "properties": {
            "_GeneralInformation": GENERAL,
            "References": {"type": "object", "additionalProperties": TEXT},
        },
        "additionalProperties": component,
    }


SCHEMAS = {
    "fragility": whole(
        closed(
            {**COMPONENT, "LimitStates": closed({}, patterns={r"^LS\d+$": STATES})},
            {"Comments": TEXT, "Reference": {"type": "array", "items": TEXT}},
        )
    ),
    "consequence_repair": whole(
        closed({**COMPONENT, "DamageStates": STATES}, {"Comments": TEXT, "ControllingDemand": TEXT})
    ),
}
