"""Plausibility of blocks and laws: sizes and numbers outside of the known range, with the likely slip of units."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ..core.aliases import Array
from ..core.doubts import NAMED, Doubt, doubt_data, first_names, first_of
from ..core.units import STANDARD_GRAVITY
from ..core.wording import two_digits
from .block import HEIGHTS, WIDEST, Block, likely_sizes
from .block_array import BlockArray
from .laws import Model
from .scenes.restraint import Restraint
from .sliding.law import Sliding

STILL = 0.9
"""Share of the acceleration at which a block lifts off, below which a motion of some vertical shaking moves nothing."""
LARGEST, SMALLEST = 20.0, 0.01  # m: sides of contents of buildings
CENTRES, UNLIKE = (0.3, 0.7), 1.05
"""Height of the centre of mass over the height of usual contents, and ratio of heights that are not equal (assumed)."""
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
LEAST_GAP, SMALL_GAP, MOST_GAP = 0.001, 0.005, 5.0
"""Distances, m: no measured gap or trip, no usual gap but 0, and beyond which a wall is none of the block's."""
LEAST_OFFSET, LEAST_LEAN = 1e-4, math.radians(0.0999)  # m, rad
LEAST_TILT = math.radians(1.0)
"""Rotation that may count as overturning, rad; nothing spills at less."""
FARTHER = 1.5
"""Distance of a wall that changes nothing, over the reach of a block that is about to fall (assumed)."""
IMPOSSIBLY_LARGE, IMPOSSIBLY_SMALL = 100.0, 0.001  # m
NEVER = np.zeros(1, dtype=bool)
_Number = tuple[str, float | None, float, float]
"""Name of a quantity in `doubts.toml`, a number, and its minimum and maximum; 0 and infinity mean absence."""


def block_doubts(blocks: Iterable[Block] | BlockArray) -> list[Doubt]:
    """Return the input warnings on the sizes, the surroundings, the restraints and the restitution of blocks."""
    if isinstance(blocks, BlockArray):
        sides = np.stack([blocks.width, blocks.height], axis=1)
        restitution = blocks.own.get("e", np.ones(0))
        low = [
            (str(blocks.names[i]), float(restitution[i]))
            for i in np.flatnonzero(restitution < LEAST_RESTITUTION).tolist()
        ]
        sizes = size_doubts(sides, blocks.cm_height, lambda i: str(blocks.names[i]))
        return [*sizes, *restitution_doubts(low)]
    every = list(blocks)
    sides = np.array([(block.width, block.height) for block in every]).reshape(-1, 2)
    # (a block without a name is called by its sizes)
    sizes = size_doubts(sides, np.array([block.h for block in every]), lambda i: every[i].name)
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
    return [Doubt.of("block_front", deepest=DEEPEST, named=first_of(wide))] if wide else []


def unit_doubts(restraints: Iterable[tuple[str, Restraint]], blocks: Iterable[Block] = ()) -> list[Doubt]:
    """Return the input warnings on restraints with their blocks, and on masses and distances of blocks: wrong units."""
    slips: dict[str, list[str]] = {}
    numbers = [(name, row) for name, restraint in restraints for row in _numbers_of_restraint(restraint)]
    numbers += [(block.label, row) for block in blocks for row in _numbers_of_block(block)]
    for name, (quantity, value, least, most) in numbers:
        if value is not None and 0.0 < abs(value) < math.inf and not least <= abs(value) <= most:
            text, slip = doubt_data()["quantity"][quantity]
            slips.setdefault(slip, []).append(f"{name}: {text.format(value)}")
    return [Doubt.of("quantity", named=first_of(named), slip=slip) for slip, named in slips.items()]


def still_doubts(blocks: Iterable[Block], peaks: Iterable[float]) -> list[Doubt]:
    """Return the input warning on motions with peaks, m/s², of which none lifts any of some blocks, at tan alpha g."""
    angles = (math.atan2(block.b - abs(block.cm_offset), block.h) - abs(block.lean) for block in blocks)
    first = math.tan(min(angles, default=0.0))
    peak = max(peaks, default=math.inf) / STANDARD_GRAVITY
    return [] if peak >= STILL * first else [Doubt.of("still", peak=two_digits(peak), first=two_digits(first))]


def _numbers_of_restraint(restraint: Restraint) -> Iterator[_Number]:
    """Return the numbers of a restraint."""
    strength = restraint.strength
    yield "strength", strength, LEAST_STRENGTH, MOST_STRENGTH
    if strength < math.inf > restraint.stiffness and LEAST_STRENGTH <= strength <= MOST_STRENGTH:
        yield "stretch", 1e3 * strength / restraint.stiffness, 1e3 * LEAST_STRETCH, 1e3 * MOST_STRETCH
    if restraint.front is not None and restraint.kind in ("strap", "bracket", "cable"):
        yield restraint.kind, 1e3 * restraint.front, 1e3 * LEAST_ARM, math.inf
    yield "slack", 1e3 * restraint.slack, 1e3 * LEAST_SLACK, 1e3 * MOST_SLACK


def _numbers_of_block(block: Block) -> Iterator[_Number]:
    """Return the numbers of a block other than its sizes."""
    wall, edge, tilt = block.wall, block.edge, block.tilt_limit
    yield "depth", block.depth, 0.0, LARGEST
    yield "offset", 1e3 * block.cm_offset, 1e3 * LEAST_OFFSET, math.inf
    yield "lean", math.degrees(block.lean), math.degrees(LEAST_LEAN), math.inf
    if tilt is not None:
        yield "tilt", math.degrees(tilt), math.degrees(LEAST_TILT), math.inf
        free = wall is None and block.restraint is None
        yield "lost_tilt", math.degrees(tilt), 0.0, math.degrees(block.alpha) if free else math.inf
    if block.mass is not None:
        volume = block.width * (block.depth or block.width) * block.height
        yield "mass", block.mass, LEAST_DENSE * volume, (1.0 if block.depth else UNKNOWN_DEPTH) * MOST_DENSE * volume
    reach = FARTHER * block.height * math.sin(block.alpha)
    distances: list[tuple[float | None, float, float]] = []
    if wall is not None:
        distances += [(wall.gap, SMALL_GAP, reach), (wall.front_gap, SMALL_GAP, max(reach, block.height))]
    if edge is not None:
        distances += [(edge.front, LEAST_GAP, MOST_GAP), (edge.back, LEAST_GAP, MOST_GAP)]
    for gap, nearest, farthest in distances:
        if gap is not None:
            small, far = LEAST_GAP <= gap < nearest, farthest < gap <= MOST_GAP
            quantity = "small_gap" if small else "far_gap" if far else "gap"
            yield quantity, 1e3 * gap, 1e3 * nearest, 1e3 * min(farthest, MOST_GAP)


def size_doubts(sides: Array, centres: Array, name: Callable[[int], str | None]) -> list[Doubt]:
    """Return the input warnings on sides (block, 2) and heights of centres of mass (block,), m, of named blocks."""
    doubts = []
    large, small = sides.max(axis=1, initial=0.0) > LARGEST, sides.min(axis=1, initial=1.0) < SMALLEST
    wide = ~large & ~small & (sides[:, 0] > WIDEST)
    squat = ~large & ~small & ~wide & (2.0 * centres / sides[:, 0] < 1.0 - 1e-9)
    high = ~large & ~wide & ~squat & (sides[:, 1] > HEIGHTS[1])
    share = centres / sides[:, 1]
    odd_centre = (share < CENTRES[0]) | (share > CENTRES[1])
    uneven = np.abs(share - 0.5) > 1e-9
    given, heights = centres[uneven], sides[uneven, 1]
    if given.size and np.ptp(given) == 0.0 and CENTRES[0] <= given[0] <= CENTRES[1]:
        odd_centre |= uneven & (heights.max() > UNLIKE * heights.min())
    for entry, odd, beyond, bounds in (
        ("block_large", large, sides > IMPOSSIBLY_LARGE, (LARGEST,)),
        ("block_small", small, sides < IMPOSSIBLY_SMALL, (SMALLEST,)),
        ("block_wide", wide, NEVER, (WIDEST,)),
        ("block_squat", squat, NEVER, ()),
        ("block_high", high, NEVER, HEIGHTS),
        ("block_centre", odd_centre & ~squat, NEVER, CENTRES),
    ):
        named = np.flatnonzero(odd).tolist()
        if named:
            first = [_sizes(name(i), sides[i], float(centres[i]), bool(uneven[i])) for i in named[:NAMED]]
            sizes = first_of([*first, *map(str, named[NAMED:])])
            of = f"{len(named):,} of {len(sides):,} blocks" if len(sides) > 1 else "the block"
            grave = bool(beyond.any())
            doubts.append(Doubt.of(entry, grave, number=len(named), of=of, bounds=bounds, named=sizes))
    return doubts


def _sizes(name: str | None, sides: Array, centre: float, uneven: bool) -> str:
    """Return the name and the sizes of a block, and those that may be meant."""
    width, height = map(float, sides)
    likely = likely_sizes(width, height)
    sizes = f"{f'{name}: ' if name else ''}{width:g} m × {height:g} m"
    return f"{sizes}{f', centre of mass at {centre:g} m' * uneven}{f', or {likely}?' if likely else ''}"


def restitution_doubts(given: Iterable[tuple[str, float | None]]) -> list[Doubt]:
    """Return the input warning on given coefficients of restitution, each with the name of its law or piece."""
    odd = [f"{name}: {e:g}" for name, e in given if e is not None and e < LEAST_RESTITUTION]
    return [Doubt.of("restitution", least=LEAST_RESTITUTION, named=first_of(odd))] if odd else []


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
            doubts.append(Doubt.of("law_damping", law=law.label))
        if not isinstance(law, Sliding) or "mode" in outputs:
            continue
        early = [block.label for block in blocks if law.static >= math.tan(block.alpha)]
        if early:
            counts = {"early": len(early), "total": len(blocks)}
            doubts.append(Doubt.of("rocks_first", law=law.label, named=first_names(early), **counts))
    return doubts
