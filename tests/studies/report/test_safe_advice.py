"""What a report tells people to do must be safe: nobody tilts loaded furniture to measure something."""

import re

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.studies.facts import sensitivity
from toppling.studies.facts.say import TEMPLATES, say

BLOCK = tp.Block(0.4, 1.9, name="shelf")


@pytest.mark.parametrize("parameter", ["e", "delta"])
def test_of_a_sensitivity_study(parameter):
    """The median changes by a factor of 4, so the report says how the parameter can be made certain."""
    median = np.array([[[4.0, 3.0, 2.0, 1.0]]])
    results = xr.Dataset(
        {
            "half_level": (("block", "model", "value"), median),
            "median": (("block", "model", "value"), median),
            "median_ratio": (("block", "model", "value", "comparison"), median[..., None] / 2.0),
        },
        {
            "block": [BLOCK.label],
            "model": ["housner e"],
            "law": ("model", ["housner"]),
            "value": [0.7, 0.8, 0.9, 1.0] if parameter == "e" else [0.01, 0.02, 0.05, 0.1],
            "comparison": ["rigid"],
            "in_use": (("block", "value"), [[True] * 4]),
            "level": ("level", [1.0, 12.0], {"units": "m s-2", "im": "pga"}),
            **{name: ("block", [getattr(BLOCK, name)]) for name in ("width", "height", "cm_height")},
            "inertia_factor": ("block", [BLOCK.inertia]),
        },
        {"kind": "sensitivity", "parameter": parameter, "friction": 1.0, "usual": "the usual ones"},
    )
    fact = next(sensitivity.actions(results))
    assert (fact.what, fact.value) == (f"sensitivity.{parameter}_matters", 4.0)
    assert ("measured on an unloaded sample" in say(fact, "page")) == (parameter == "e")


def test_no_advice_is_to_tilt_or_to_push():
    texts = [path.read_text(encoding="utf-8") for path in TEMPLATES.glob("*.j2")]
    assert sum("unloaded sample" in text for text in texts) == 1
    assert not [
        text for text in texts if re.search(r"measure it on the piece|\b[Tt]ilt (?!of)|\b[Pp]ush (it|the)\b", text)
    ]
