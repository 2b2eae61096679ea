"""Tables of numbers that the engine reads: their columns, actions, rules, sizes and limits.  Nothing compiled here."""

import math
from typing import Any, NamedTuple

import numpy as np

# Options of compilation. Kernels that allocate nothing run without numba's reference counts (their atomic operations
# cost more than a piece). Fused multiply-add is for scalar kernels, and for turns and flights, whose columns fill whole
# vectors. A lane's bits must not depend on the number of lanes.
BARE: dict[str, Any] = {"_nrt": False}
FUSED: dict[str, Any] = {**BARE, "fastmath": {"contract"}}

# Columns of the region table: x'' = -stiffness x - damping x' + offset + gain forcing for lower <= x <= upper, in
# balance at the centre offset / stiffness. GAIN: relative to PAR_GAIN. INERTIA: relative to the oscillator's. *_FACTOR:
# on the velocity at an edge. *_LOSS: 1 - e of the bounces that follow an edge (see `comes_to_rest`).
(
    REGION_LOWER,
    REGION_UPPER,
    REGION_STIFFNESS,
    REGION_OFFSET,
    REGION_DAMPING,
    REGION_POTENTIAL,
    REGION_CENTRE,
    REGION_GAIN,
    REGION_INERTIA,
    REGION_LOWER_FACTOR,
    REGION_UPPER_FACTOR,
    REGION_LOWER_LOSS,
    REGION_UPPER_LOSS,
) = range(13)
REGION_COLUMNS = 13

# Columns of the link table. *_SLOW: the region taken instead if the entry rule requires it. *_REST: the state of rest
# into which bounces at this edge die. TURN_*: the region that takes over if the velocity vanishes inside this one, left
# and right of zero. FALLS: the law of this region is valid up to overturning. HOPS: the region across an impact at 0
# between two alike, undamped regions, whose bounces have closed forms. BROKEN: it is without the restraint.
(
    LINK_LOWER_ACTION,
    LINK_LOWER_TARGET,
    LINK_LOWER_SLOW,
    LINK_LOWER_REST,
    LINK_UPPER_ACTION,
    LINK_UPPER_TARGET,
    LINK_UPPER_SLOW,
    LINK_UPPER_REST,
    LINK_HELD,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
    LINK_FALLS,
    LINK_HOPS,
    LINK_BROKEN,
) = range(14)
LINK_COLUMNS = 14

# Columns of the states of rest: the rotation, and the forcing (of gain 1) above which the block leaves it for a region.
# Then the same of the forcing with the opposite sign, and a flag if leaving it breaks the restraint.
REST_THETA, REST_UP, REST_UP_TARGET, REST_DOWN, REST_DOWN_TARGET, REST_BREAKS = range(6)
REST_COLUMNS = 6

# Actions at an edge of a region: into the region beyond, into a zone whose damping is then held, or an impact into the
# region beyond. Further the ground, an impact back into the same region, and into a region without the restraint.
CROSS, ENTER, IMPACT, OVERTURN, BOUNCE, BREAK = range(6)

# Instead of a region: none, and a block at rest. Rest k of an oscillator is there as -1 - k.
NO_REGION = -1
REST = -1

# Rules of the damping held while a zone is crossed.
RULE_CONSTANT, RULE_ENTRY_SPEED, RULE_ENERGY = range(3)

# Parameters of an oscillator that are not a region's.
(
    PAR_GAIN,
    PAR_RESTITUTION,
    PAR_COEFFICIENT,
    PAR_RULE,
    PAR_START,
    PAR_EXACT,
    PAR_SIDED,
    PAR_TOUCHING,
) = range(8)
PAR_COLUMNS = 8

# State of a run.  FRONT, BACK: the largest rotations to the right and to the left; where an oscillator is not SIDED,
# both are the larger one.
THETA, OMEGA, HELD, FRONT, BACK, CALM_MARGIN, DAMPING, STRIKE, OVERTURN_TIME, WALL_STRIKE, BREAK_TIME = range(11)
(
    NOW,
    NEED,
    GRADE,
    UPWARD,
    LISTED,
    OVERTURNED,
    IMPACTS,
    UPLIFTED,
    TURNS,
    FREE,
    SAFE,
    SIDED,
    WALL_IMPACTS,
    BROKEN,
    WELL,
    PIECES,
) = range(16)
STATE_FLOATS, STATE_INTEGERS = 11, 16

# Results of a run.
(
    OUT_OVERTURNED,
    OUT_PEAK,
    OUT_UPLIFTED,
    OUT_IMPACTS,
    OUT_OVERTURN_TIME,
    OUT_STRIKE,
    OUT_DIRECTION,
    OUT_FRONT,
    OUT_BACK,
    OUT_WALL_IMPACTS,
    OUT_WALL_STRIKE,
    OUT_BROKEN,
    OUT_BREAK_TIME,
    OUT_WELL,
    OUT_AIRBORNE,
) = range(15)
OUT_COLUMNS = 15

# Counts of a batch: samples of all runs, omitted samples, events solved. Omitted samples are before the first uplift,
# after overturning, or once the rest of the record cannot overturn the block.
TALLY = ("samples", "before_uplift", "after_overturning", "cannot_overturn", "events")
TALLY_SAMPLES, TALLY_BEFORE_UPLIFT, TALLY_OVERTURNED, TALLY_SAFE, TALLY_EVENTS = range(len(TALLY))

# Rows of a history.
HISTORY_THETA, HISTORY_OMEGA, HISTORY_REGION, HISTORY_DAMPING, HISTORY_PEAK = range(5)
HISTORY_ROWS = 5

# Runs that advance together over one record, so that events are solved by the dozen. It is no power of two: a lane's
# rows would share a set of the cache.
LANES = 1048

# Rows of the lanes' state: two sets of (theta, omega) written in turn.
(
    ROW_EVEN,
    _,
    ROW_ODD,
    _,
    ROW_AMPLITUDE,
    ROW_OFFSET,
    ROW_STIFFNESS,
    ROW_SQUARE,
    ROW_G0,
    ROW_G1,
    ROW_G2,
    ROW_G3,
    ROW_G2_RISE,
    ROW_UPPER,
    ROW_LOWER,
    ROW_CALM_UPPER,
    ROW_CALM_LOWER,
) = range(17)
LANE_ROWS = 17

# Samples that a lane may lag behind the others, so that events gather and are solved together. A lane that has just
# taken over a bouncing block may lag for longer: see BOUNCE_INTERVAL in `linear_runs`.
TILE = 6

# Samples of a record of which the largest is kept, for blocks at rest.
SPAN = 32

# Samples between two looks at whether the rest of a record can still overturn a block: whole spans, and whole tiles.
SAFETY_INTERVAL = 3 * SPAN

# Columns of a propagator; the grade says what a sample may be taken for, the pull is the region's largest |f(theta)|.
STEP_G0, STEP_G1, STEP_G2, STEP_G3, STEP_G2_RISE, STEP_DAMPING, STEP_GRADE, STEP_PULL = range(8)
STEP_COLUMNS = 8
MANY_STEPS, ONE_STEP, ONE_PIECE = range(3)

# Rows of the pieces that are solved together, a column each.
(
    PIECE_OMEGA,
    PIECE_A,
    PIECE_SLOPE,
    PIECE_STIFFNESS,
    PIECE_DAMPING,
    PIECE_SPAN,
    PIECE_GAP,
    PIECE_TIME,
    PIECE_MOVED,
    PIECE_SPEED,
    PIECE_SURE,
) = range(11)
PIECE_ROWS = 11

# What a marked sample needs.
WAITS, CROSSES, RETURNS, TURNS_BACK, HARD = range(5)

# Room for the turns of a tile: one for each lane and sample, and a vector more.
TURN_COLUMNS = LANES * TILE + 8

# The local series: its largest degree, its rows, and 1/k.
DEGREE = 30
MOVED, SPEED, ACCELERATION = range(3)
INVERSE = np.array([0.0, *(1.0 / k for k in range(1, DEGREE + 1))])

EPSILON = 2.220446049250313e-16  # spacing of the numbers next to 1
FLAT = 0.5 * math.pi  # the rotation of an overturned block, rad
MANY_HOPS = 50  # impacts in one sample beyond which low bounces are solved as cubics

# After this number of impacts a block that bounces low counts as at rest (see `rest.has_bounced_out`). This happens
# only if e is within about 1e-6 of 1, and e = 1 itself would bounce by the billion.
MANY_IMPACTS = 4_000_000

# This number of pieces and edges of a run is solved one by one, in about a second. Then the run is GIVEN_UP, instead of
# an overturning (1), and has no result. Flights in closed form are no more than MANY_IMPACTS, and MANY_HOPS per piece.
MOST_PIECES = 10_000_000
GIVEN_UP = 2

# Accelerations and states below this are zero: products of denormal numbers have no sign left to decide an event.
NOTHING = 1e-200

# Of the weight at rest: a block that is lighter at any time counts as airborne (more than the rounding of a weight).
LEAST_WEIGHT = 1e-12


class Model(NamedTuple):
    """All oscillators of a batch: region tables (o, r, 13), links (o, r, 14), rests (o, s, 6), parameters (o, 8)."""

    tables: Any
    links: Any
    rests: Any
    parameters: Any


class Shaking(NamedTuple):
    """Records of one step dt, one after the other, and the place of each run's record.

    `record` (n,): all samples, m/s², with zeros between records. `highs` (n / SPAN,): the largest |u''| of each SPAN of
    them. The following are for each run (m,). `start`: the place of its first sample in `record` (a multiple of SPAN).
    `last`: the number of its last sample, counted from there. `strongest`: the largest |u''| of its record. The
    function `starts.begin_runs` fills in highs and strongest.
    """

    record: Any
    dt: Any
    highs: Any
    start: Any
    last: Any
    strongest: Any


class Work(NamedTuple):
    """Room for one run at a time: the coefficients of a local series (3, DEGREE + 1), and turning points (2, t)."""

    poly: Any
    turns: Any


class Batch(NamedTuple):
    """Runs of oscillators which[j] under factors[j] times a record each, and the places of their results.

    `shaking`: the records. `steps` (o, r, 8): the propagator of each oscillator and region. `which`, `factors` (m,),
    best sorted by record, then oscillator. `first` (m,) and `begin` (m, 4): the first sample of each run, and theta,
    omega, peak and region there. `lifting` (n or 0): the vertical acceleration over g, scaled as the records,
    `lifting_highs` as their highs. `shaking_left` and `lifting_left` (n / SPAN or 0): the integrals of |u''| and
    |lifting| from the first sample of each span to the end of its record. They and `barriers` (o, 7) are for runs of
    which only the flag is needed. `out` (m, 15). `turns` (2, t) and `history` (5, n or 0) store a single run's. `tally`
    (5,) is added to.
    """

    shaking: Any
    model: Any
    steps: Any
    which: Any
    factors: Any
    first: Any
    begin: Any
    lifting: Any
    lifting_highs: Any
    shaking_left: Any
    lifting_left: Any
    barriers: Any
    out: Any
    turns: Any
    history: Any
    tally: Any
