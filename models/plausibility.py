"""Plausibility of blocks and laws: sizes and numbers outside of the known range, with the likely slip of units."""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ..core.aliases import Array
from ..core.doubts import NAMED, Doubt, first_names, first_of
from ..core.elementary import tan
from .block import WIDEST, Block, likely_sizes
from .block_array import BlockArray
from .laws import Model
from .scenes.restraint import Restraint
from .sliding.law import Sliding

LARGEST, SMALLEST = 20.0, 0.01  # m: sides of contents of buildings
UNITS = "units"
"""Kind of input warnings on numbers that are likely of another unit."""
FURNITURE, DEEPEST = (1.2, 2.5), 0.7
"""Heights, m, of cabinets and shelves, and the depth beyond which their width is likely taken for it (assumed)."""
MOST_DAMPED = 1.0
"""Damping ratio: FEMA 356 and the published laws have 0 to 0.64."""
LEAST_RESTITUTION = 0.3
"""Coefficient of restitution; tests of free rocking found 0.5 and more."""
LEAST_STRENGTH, MOST_STRENGTH = 10.0, 1e6  # N
LEAST_SLACK, MOST_SLACK = 1e-4, 0.2  # m
LEAST_STRETCH, MOST_STRETCH = 5e-5, 0.3
"""Elongation, m, at which a restraint breaks: its strength over its stiffness."""
LEAST_ARM = 0.2
"""Height, m, below which nothing is strapped to a wall: anti-tip kits support the upper half of furniture."""
LEAST_DENSE, MOST_DENSE = 5.0, 4000.0  # kg/m³: of nothing to solid stone; metals are denser
UNKNOWN_DEPTH = 10.0
"""Depth over width, at most, of a block whose depth is not given."""
LEAST_GAP, MOST_GAP = 0.001, 5.0
"""Distance, m, below which a gap that is not 0 is no measured one, and beyond which a wall is none of the block's."""
LEAST_OFFSET, LEAST_LEAN = 1e-4, math.radians(0.0999)  # m, rad
LEAST_TILT = math.radians(1.0)
"""Rotation that may count as overturning, rad; nothing spills at less."""
METRES = "metres in place of mm, or the other way round?"
IMPOSSIBLY_LARGE, IMPOSSIBLY_SMALL = 100.0, 0.001  # m
NEVER = np.zeros(1, dtype=bool)


def block_doubts(blocks: Iterable[Block] | BlockArray) -> list[Doubt]:
    """Return the input warnings on block sizes: sides above 20 m or below 0.01 m, widths above 1.5 m, h/b below 1."""
    if isinstance(blocks, BlockArray):
        sides, slenderness = np.stack([blocks.width, blocks.height], axis=1), 1.0 / tan(blocks.alpha)
        restitution = blocks.own.get("e", np.ones(0))
        low = [
            (str(blocks.names[i]), float(restitution[i]))
            for i in np.flatnonzero(restitution < LEAST_RESTITUTION).tolist()
        ]
        return [*size_doubts(sides, slenderness, lambda i: str(blocks.names[i])), *restitution_doubts(low)]
    every = list(blocks)
    sides = np.array([(block.width, block.height) for block in every]).reshape(-1, 2)
    # (a block without a name is called by its sizes)
    sizes = size_doubts(sides, np.array([block.h / block.b for block in every]), lambda i: every[i].name)
    restraints = [(block.label, block.restraint) for block in every if block.restraint is not None]
    return [*sizes, *_front_doubts(every), *unit_doubts(restraints, every)]


def _front_doubts(blocks: Sequence[Block]) -> list[Doubt]:
    """Return the input warning on blocks as high as furniture, wider than its depth, and without a depth of their own.

    A narrower depth than the width is an error of `Block`.
    """
    low, high = FURNITURE
    wide = [
        f"{f'{block.name}: ' if block.name else ''}{block.width:g} m × {block.height:g} m"
        for block in blocks
        if block.depth is None and low < block.height <= high and DEEPEST < block.width <= min(WIDEST, block.height)
    ]
    if not wide:
        return []
    what = f"blocks of the height of furniture are wider than {DEEPEST:g} m ({first_of(wide)})"
    cure = "the width is the smaller size in plan, of a bookcase its depth; if it is, give depth_m, too"
    return [Doubt("block size", f"{what}: {cure}")]


def unit_doubts(restraints: Iterable[tuple[str, Restraint]], blocks: Iterable[Block] = ()) -> list[Doubt]:
    """Return the input warnings on restraints with their blocks, and on masses and distances of blocks: wrong units."""
    slips: dict[str, list[str]] = {}
    for name, restraint in restraints:
        if not LEAST_STRENGTH <= restraint.strength <= MOST_STRENGTH and restraint.strength != math.inf:
            slips.setdefault("kN in place of N?", []).append(f"{name}: a strength of {restraint.strength:g} N")
        elif (
            restraint.strength < math.inf > restraint.stiffness
            and not LEAST_STRETCH <= (stretch := restraint.strength / restraint.stiffness) <= MOST_STRETCH
        ):
            text = f"{name}: it would stretch by {1e3 * stretch:.3g} mm before it breaks"
            slips.setdefault("a stiffness in N/m or kN/mm in place of N/mm?", []).append(text)
        if (
            restraint.front is not None
            and restraint.front < LEAST_ARM
            and restraint.kind in ("strap", "bracket", "cable")
        ):
            text = f"{name}: a {restraint.kind} that acts {1e3 * restraint.front:.3g} mm above the floor"
            slips.setdefault("a height in centimetres or decimetres?", []).append(text)
        if restraint.slack > MOST_SLACK or 0.0 < restraint.slack < LEAST_SLACK:
            slips.setdefault(METRES, []).append(f"{name}: a slack of {1e3 * restraint.slack:g} mm")
    for block in blocks:
        if block.depth is not None and block.depth > LARGEST:
            slips.setdefault(METRES, []).append(f"{block.label}: a depth of {block.depth:g} m")
        if 0.0 < abs(block.cm_offset) < LEAST_OFFSET:
            slips.setdefault(METRES, []).append(f"{block.label}: an offset of {1e3 * block.cm_offset:g} mm")
        if 0.0 < abs(block.lean) < LEAST_LEAN:
            text = f"{block.label}: leans by {math.degrees(block.lean):.2g} degrees"
            slips.setdefault("radians in place of degrees?", []).append(text)
        if block.tilt_limit is not None and block.tilt_limit < LEAST_TILT:
            text = f"{block.label}: counts as overturned at {math.degrees(block.tilt_limit):.2g} degrees"
            slips.setdefault("radians in place of degrees?", []).append(text)
        if block.mass is not None:
            density = block.mass / (block.width * (block.depth or block.width) * block.height)
            most = MOST_DENSE if block.depth else UNKNOWN_DEPTH * MOST_DENSE
            if not LEAST_DENSE <= density <= most:
                text = f"{block.label}: {block.mass:,g} kg"
                slips.setdefault("tonnes, grams or newtons in place of kg?", []).append(text)
        wall, edge = block.wall, block.edge
        gaps = (() if wall is None else (wall.gap, wall.front_gap)) + (() if edge is None else (edge.front, edge.back))
        far = (gap for gap in gaps[:2] if wall is not None and gap is not None and gap > MOST_GAP)
        odd = [*(gap for gap in gaps if gap is not None and 0.0 < gap < LEAST_GAP), *far]
        if odd:
            slips.setdefault(METRES, []).append(f"{block.label}: {1e3 * odd[0]:g} mm to a wall or an edge")
    return [Doubt(UNITS, f"{first_of(named)}: {slip}") for slip, named in slips.items()]


def size_doubts(sides: Array, slenderness: Array, name: Callable[[int], str | None]) -> list[Doubt]:
    """Return the input warnings on sides (block, 2), in m, and slendernesses (block,) of blocks with names."""
    doubts = []
    large, small = sides.max(axis=1) > LARGEST, sides.min(axis=1) < SMALLEST
    wide = ~large & ~small & (sides[:, 0] > WIDEST)
    squat = ~large & ~small & ~wide & (slenderness < 1.0 - 1e-9)
    for odd, beyond, text, slip in (
        (
            large,
            sides > IMPOSSIBLY_LARGE,
            f"sides above {LARGEST:g} m",
            "centimetres or millimetres written as metres?",
        ),
        (small, sides < IMPOSSIBLY_SMALL, f"sides below {SMALLEST:g} m", "another unit than metres?"),
        (wide, NEVER, f"a width above {WIDEST:g} m", "the width is the size in the direction in which a block tips"),
        (
            squat,
            NEVER,
            "a centre of mass lower than half the width",
            "such a block slides or bounces, and hardly rocks",
        ),
    ):
        named = np.flatnonzero(odd).tolist()
        if named:
            sizes = first_of([*(_sizes(sides[i], name(i)) for i in named[:NAMED]), *map(str, named[NAMED:])])
            have = "has" if len(named) == 1 else "have"
            of = f"{len(named):,} of {len(sides):,} blocks {have}" if len(sides) > 1 else "the block has"
            doubts.append(Doubt("block size", f"{of} {text} ({sizes}): {slip}", bool(beyond.any())))
    return doubts


def _sizes(sides: Array, name: str | None) -> str:
    """Return the name and the sizes of a block, and those that may be meant."""
    width, height = map(float, sides)
    likely = likely_sizes(width, height)
    return f"{f'{name}: ' if name else ''}{width:g} m × {height:g} m{f', or {likely}?' if likely else ''}"


def restitution_doubts(given: Iterable[tuple[str, float | None]]) -> list[Doubt]:
    """Return the input warning on given coefficients of restitution, each with the name of its law or piece."""
    odd = [f"{name}: {e:g}" for name, e in given if e is not None and e < LEAST_RESTITUTION]
    what = f"restitution below {LEAST_RESTITUTION:g} ({first_of(odd)}): e of blocks that rock is 0.5 to 1"
    return [Doubt(UNITS, what)] if odd else []


def stated_restitution_doubts(models: Iterable[Model]) -> list[Doubt]:
    """Return the input warning on coefficients of restitution that laws state, or their factors on the block's own."""
    return restitution_doubts((law.label, law.options.get(of)) for law in models for of in ("e", "restitution_factor"))


def law_doubts(blocks: Sequence[Block], models: Iterable[Model], outputs: Sequence[str]) -> list[Doubt]:
    """Return the input warnings on damping ratios above 1, and on sliding blocks with static friction >= b/h.

    The latter only without an output `mode`, which shows it.
    """
    models = list(models)
    doubts = stated_restitution_doubts(models)
    for law in models:
        if law.options.get("zeta", 0.0) > MOST_DAMPED:
            doubts.append(Doubt(UNITS, f"{law.label}: no block is damped so: a ratio, 0.05 for 5 %?"))
        if not isinstance(law, Sliding) or "mode" in outputs:
            continue
        early = [block.label for block in blocks if law.static >= math.tan(block.alpha)]
        if early:
            doubts.append(
                Doubt(
                    "rocks first",
                    f"{law.label}: {len(early):,} of {len(blocks):,} blocks uplift before they slide, since their "
                    f"friction is not below b/h ({first_names(early)}): their slips are those of blocks that cannot "
                    "rock",
                )
            )
    return doubts
