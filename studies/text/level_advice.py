"""Advice on the levels of a study that are too low or too high, by the keys that its study file has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ...core.units import UNITS
from .reached import EDGE

EVERY = 0.0, math.inf


def other_levels(study: Mapping[str, Any], higher: bool, run: tuple[float, float] = EVERY) -> str:
    """Return what to change in a study file (plain values) so that the shaking reaches higher, or begins lower.

    `run` is the lowest and the highest level that was run (SI): selected stripes beyond them were left out.

    >>> other_levels({"ida": {"levels": {"from": 0.1, "to": 1.0, "number": 5}}}, True)
    'raise ida.levels.to'
    >>> other_levels({"ida": {"levels": {"values": [0.1, 0.2]}}}, True)
    'add higher levels to ida.levels.values'
    >>> other_levels({"stripes": {}}, False)
    'add a stripe below the lowest'
    """
    if "ida" in study:
        if isinstance(study["ida"]["levels"], str):  # (adaptive levels look as far as they must)
            return "allow more motions (until.motions.most)"
        if study["ida"]["levels"].get("values") is not None:
            return f"add {'higher' if higher else 'lower'} levels to ida.levels.values"
        return "raise ida.levels.to" if higher else "lower ida.levels.from"
    if "stripes" in study:
        stripes = study["stripes"]
        if "select" in stripes:
            lowest, highest = (stripes["at"][end]["level"] * UNITS[stripes["unit"]][0] for end in (0, -1))
            if highest > run[1] * EDGE if higher else lowest < run[0] / EDGE:
                return "select the stripes that were left out from more motions, or with a wider stripes.select.factor"
        return f"add a stripe {'above the highest' if higher else 'below the lowest'}"
    return f"take {'stronger' if higher else 'weaker'} motions"
