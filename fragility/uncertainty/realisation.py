"""Realisation of a block and a law from values of inputs: the possible inputs, their ranges, and their effect."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ...core.units import DIMENSIONLESS, NEWTON, STIFFNESS
from ...models import LAWS, Block, Law, Restraint
from ..runs.labels import OF_BLOCKS, OF_LAWS
from .distributions import Categorical, Distribution


class InputRange(NamedTuple):
    """An input that a block or a law has: unit, long name, and the range within which its values are physical."""

    units: str
    long_name: str
    lower: float
    upper: float


SLENDERNESS = {
    "alpha": InputRange(*OF_BLOCKS["alpha"], 0.0, 0.5 * math.pi),
    "alpha_factor": InputRange(DIMENSIONLESS, f"{OF_BLOCKS['alpha'][1]} over that of the nominal block", 0.0, math.inf),
    "R": InputRange(*OF_BLOCKS["R"], 0.0, math.inf),
    "R_factor": InputRange(DIMENSIONLESS, f"{OF_BLOCKS['R'][1]} over the nominal", 0.0, math.inf),
}
SIZES = {name: InputRange(*OF_BLOCKS[name], 0.0, math.inf) for name in ("width", "height", "cm_height")}
INERTIA = {"inertia_factor": InputRange(*OF_BLOCKS["inertia_factor"], 1.0, 2.0)}
RESTRAINT = {
    "restraint_strength": InputRange(NEWTON, "strength of the restraint", 0.0, math.inf),
    "restraint_stiffness": InputRange(STIFFNESS, "stiffness of the restraint", 0.0, math.inf),
}
OPTIONS = {
    "e": InputRange(DIMENSIONLESS, "coefficient of restitution", 0.0, 1.0),
    "restitution_factor": InputRange(DIMENSIONLESS, "coefficient of restitution over e_R", 0.0, math.inf),
    "delta": InputRange(DIMENSIONLESS, OF_LAWS["delta"], 0.0, 1.0),
    "zeta": InputRange(DIMENSIONLESS, "damping ratio", 0.0, math.inf),
    "coefficient": InputRange(DIMENSIONLESS, "coefficient of Vassiliou's law", 0.0, math.inf),
}
LAW, PREFIX = "law", "restraint_"
BLOCK_INPUTS = {**SLENDERNESS, **SIZES, **INERTIA, **RESTRAINT}
KNOWN = {**BLOCK_INPUTS, **OPTIONS, LAW: InputRange(DIMENSIONLESS, "damping law", 0.0, math.inf)}
"""The properties of a block and its law that can be uncertain."""
TWICE = (("alpha", "alpha_factor"), ("R", "R_factor"), ("e", "restitution_factor"))


def check_known(distributions: Mapping[str, Distribution]) -> None:
    """Raise ValueError if two inputs define the same property, or if one leaves its physical range."""
    names = {*distributions}
    for pair in TWICE:
        if {*pair} <= names:
            raise ValueError(f"{pair[0]} and {pair[1]} say the same: give one of them, got both")
    angular, outer = sorted(names & {*SLENDERNESS}), sorted(names & {*SIZES})
    if angular and outer:
        raise ValueError(f"a block is uncertain in alpha and R or in its outer sizes, got {angular} and {outer}")
    for name, distribution in distributions.items():
        if name == LAW:
            laws_of(distribution)
        elif name in KNOWN:
            _within(name, distribution)


def _within(name: str, distribution: Distribution) -> None:
    if isinstance(distribution, Categorical):
        raise ValueError(f"input {name!r} must be a number, got choices {distribution.labels!r:.60}")
    known = KNOWN[name]
    lower, upper = distribution.support
    if lower < known.lower or upper > known.upper:
        unit = f" {known.units}" if known.units != DIMENSIONLESS else ""
        raise ValueError(
            f"{name} must stay within {known.lower:g} to {known.upper:g}{unit}, got {distribution!r}, which reaches "
            f"{lower:g} to {upper:g}: give it bounds (lower, upper)"
        )


def laws_of(distribution: Distribution) -> dict[str, Law]:
    """Return the laws of a choice by label; ValueError if a word names no law, or a law that needs options."""
    if not isinstance(distribution, Categorical):
        raise ValueError(f"input 'law' must be Categorical, got {distribution!r:.60}")
    laws: dict[str, Law] = {}
    for label, choice in zip(distribution.labels, distribution.choices, strict=True):
        if isinstance(choice, Law):
            laws[label] = choice
            continue
        kind = LAWS.get(choice)
        if kind is None:
            raise ValueError(f"choices of 'law' must be laws or among {', '.join(LAWS)}, got {choice!r:.40}")
        try:
            laws[label] = kind()
        except TypeError:
            raise ValueError(f"law {choice!r} needs options: give the law, such as ViscousDamping(0.05)") from None
    return laws


def taken_by(laws: Mapping[str, Law], names: Iterable[str]) -> dict[str, list[str]]:
    """Return the inputs that each law has, by its label; ValueError for an option that no law has."""
    options = [name for name in names if name in OPTIONS]
    taken = {label: [name for name in options if name in law.options] for label, law in laws.items()}
    for name in options:
        if not any(name in options_of_law for options_of_law in taken.values()):
            raise ValueError(f"input {name!r} is no option of {', '.join(law.label for law in laws.values())}")
    return taken


def block_with(block: Block, values: Mapping[str, Any]) -> Block:
    """Return the nominal block with the given values; the block itself if no value concerns the block.

    A depth keeps its ratio to the width.
    """
    number = {name: float(values[name]) for name in BLOCK_INPUTS if name in values}
    held = {name.removeprefix(PREFIX): number.pop(name) for name in RESTRAINT if name in number}
    if held:
        block = replace(block, restraint=_restraint_with(block, held))
    if not number:
        return block
    inertia = number.get("inertia_factor", block.inertia)
    if {*number} & {*SLENDERNESS}:
        alpha = number.get("alpha", block.alpha * number.get("alpha_factor", 1.0))
        size = number.get("R", block.R * number.get("R_factor", 1.0))
        if not 0.0 < alpha < 0.5 * math.pi:
            raise ValueError(f"alpha must be > 0 and < pi/2 (in rad), got {alpha:g}")
        cm_height = size * math.cos(alpha)
        width, height = 2.0 * size * math.sin(alpha), block.height * (cm_height / block.h)
    else:
        width, height = number.get("width", block.width), number.get("height", block.height)
        cm_height = number.get("cm_height", block.h / block.height * height)
    depth = None if block.depth is None else width * (block.depth / block.width)
    return replace(block, width=width, height=height, cm_height=cm_height, inertia_factor=inertia, depth=depth)


def _restraint_with(block: Block, held: Mapping[str, float]) -> Restraint:
    """Return the block's restraint with another strength or stiffness; ValueError for a block that has none of it."""
    if block.restraint is None:
        raise ValueError(f"inputs of a restraint need a block that has one, which {block.label!r} has not")
    if block.restraint.rigid and "stiffness" in held:
        raise ValueError(f"the {block.restraint.kind} of {block.label!r} is rigid and has no uncertain stiffness")
    strength, stiffness = (held.get(name, getattr(block.restraint, name)) for name in ("strength", "stiffness"))
    return replace(block.restraint, strength=strength, stiffness=stiffness)


def check_restitution(block: Block, laws: Iterable[Law], distributions: Mapping[str, Distribution]) -> None:
    """Raise ValueError if a law uses the block's own e_R and the inputs let e_R times its factor leave 0 to 1."""
    if not {*distributions} & {*SLENDERNESS, *SIZES, *INERTIA, "restitution_factor"} or "e" in distributions:
        return
    alpha = _slenderness(block, distributions)
    if alpha[1] > 0.5 * math.pi:
        raise ValueError(f"alpha must stay below pi/2 rad, got inputs that let it reach {alpha[1]:g}: give them bounds")
    inertia = _ends(distributions, "inertia_factor", block.inertia)
    least = 1.0 - 2.0 / inertia[0] * math.sin(alpha[1]) ** 2
    largest = 1.0 - 2.0 / inertia[1] * math.sin(alpha[0]) ** 2
    for law in laws:
        options = law.options
        if "restitution_factor" not in options or options["e"] is not None:
            continue
        low, high = _ends(distributions, "restitution_factor", options["restitution_factor"])
        if least <= 0.0 or largest * high > 1.0:
            raise ValueError(
                f"the restitution of {law.label}, e_R times restitution_factor, must stay above 0 and at most 1, got "
                f"inputs that let it reach {least * low:.4g} to {largest * high:.4g}: give them bounds, or give e"
            )


def _ends(distributions: Mapping[str, Distribution], name: str, nominal: float) -> tuple[float, float]:
    """Support of an input; the nominal value if the name is no input."""
    return distributions[name].support if name in distributions else (nominal, nominal)


def _slenderness(block: Block, distributions: Mapping[str, Distribution]) -> tuple[float, float]:
    """Smallest and largest slenderness angle that the inputs allow, rad."""
    if not {*distributions} & {*SIZES}:
        if "alpha" in distributions:
            return distributions["alpha"].support
        low, high = _ends(distributions, "alpha_factor", 1.0)
        return low * block.alpha, high * block.alpha
    width, height = _ends(distributions, "width", block.width), _ends(distributions, "height", block.height)
    cm_height = height[0] * block.h / block.height, height[1] * block.h / block.height
    if "cm_height" in distributions:
        cm_height = distributions["cm_height"].support
    return math.atan2(0.5 * width[0], cm_height[1]), math.atan2(0.5 * width[1], cm_height[0])
