"""Outputs of a run, each declared once: type, unit, meaning, and its value in runs about both axes or in the air."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..core.units import ANGULAR_VELOCITY, DIMENSIONLESS, METRE, NEWTON, RADIAN, SECOND, VELOCITY, described
from .block import Block
from .engine import tables
from .scenes.edge import FALLEN_OFF
from .sliding_engine import tables as slips

AXIS = "axis"
"""Output: 1 if the block fell along its width, 2 along its depth, 0 without a fall."""
EITHER, DECIDING, FALLEN, EARLIER, LARGER = "either", "deciding", "fallen", "earlier", "larger"
"""Outputs about both axes: of either, of that about which the block fell (else the larger), of the earlier fall."""
IN_PLANE, OF_WIDTH = "plane", "width"
"""Outputs of a block that slides in the plane of the floor, and of its slips along its width alone."""
BOTH = {
    EITHER: "",
    DECIDING: ", about the axis about which it fell, else the larger of both",
    FALLEN: ", about the axis about which it fell",
    EARLIER: ", the earlier of both axes",
    LARGER: ", the larger of both axes",
    IN_PLANE: ", in the plane of the floor",
    OF_WIDTH: ", along the width",
}
"""Combination rule of an output over the two axes, for its long name."""


class Output(NamedTuple):
    """An output of a run.

    `kind`: type in which it is kept. `both`: combination rule of runs about both axes, '' if these have no such output.
    `airborne`: value of runs in which the floor leaves the block, for outputs without NaN; it counts as overturned to
    either side. `column`: its column among the results of an engine. `of`: the outputs of the engine from which it is
    derived, none if the engine returns it. `formula`: its value from the block and those outputs (level, motion), None
    if `labels` needs the motions too.
    """

    kind: type[np.generic]
    text: str
    units: str = DIMENSIONLESS
    both: str = ""
    airborne: int | None = None
    column: int | None = None
    of: tuple[str, ...] = ()
    formula: Callable[..., Any] | None = None

    @property
    def attributes(self) -> dict[str, str]:
        """Unit and long name of a labelled array."""
        return described(self.text, self.units)


def _fallen_off(block: Block, forward: Any, backward: Any) -> Any:
    return block.edge is not None and block.edge.fallen_off(forward, backward, block.b)


FLAG, COUNT, SIGN, FLOAT = np.bool_, np.int32, np.int8, np.float64
TRIP_VELOCITY = "trip_velocity"
"""Output of runs towards an obstacle."""
_SIDES = "NaN of blocks that are alike on both sides"
_STRUCK = "greatest angular speed at which the block struck a wall"
_FINAL = (
    "where the block ends: 0 stands, 1 and -1 held beyond its balance at the front and at the back (by a wall, on a "
    "strap), 2 and -2 fell forward and backward"
)
_FORCE = "greatest force of each part of the restraint, its strength if it broke"
_MODE = "what the block does first: 0 rests, 1 slides, 2 rocks, -1 loses contact with the floor"
_MET = "velocity with which the block first meets the obstacle, NaN if it does not get there"
_ROCKING = {
    "overturned": Output(FLAG, "whether the block overturned", DIMENSIONLESS, EITHER, 1, tables.OUT_OVERTURNED),
    "peak_rotation": Output(
        FLOAT, "peak absolute rotation, pi/2 if overturned", RADIAN, LARGER, column=tables.OUT_PEAK
    ),
    "uplifted": Output(FLAG, "whether the block uplifted", DIMENSIONLESS, EITHER, 1, tables.OUT_UPLIFTED),
    "impacts": Output(COUNT, "impacts during the record", DIMENSIONLESS, DECIDING, -1, tables.OUT_IMPACTS),
    "overturning_time": Output(
        FLOAT, "time of overturning, NaN if it stands", SECOND, EARLIER, column=tables.OUT_OVERTURN_TIME
    ),
    "impact_velocity": Output(
        FLOAT,
        "greatest angular speed at which the block came down",
        ANGULAR_VELOCITY,
        DECIDING,
        column=tables.OUT_STRIKE,
    ),
    "direction": Output(
        SIGN,
        "sign of the rotation in which the block fell, 0 if it stands",
        DIMENSIONLESS,
        FALLEN,
        2,
        tables.OUT_DIRECTION,
    ),
    "peak_front": Output(FLOAT, f"peak forward rotation, {_SIDES}", RADIAN, column=tables.OUT_FRONT),
    "peak_back": Output(FLOAT, f"peak backward rotation, {_SIDES}", RADIAN, column=tables.OUT_BACK),
    "wall_impacts": Output(COUNT, "impacts at walls during the record", airborne=-1, column=tables.OUT_WALL_IMPACTS),
    "wall_impact_velocity": Output(FLOAT, _STRUCK, ANGULAR_VELOCITY, column=tables.OUT_WALL_STRIKE),
    "ruptured": Output(FLAG, "whether the restraint broke", DIMENSIONLESS, EITHER, 1, tables.OUT_BROKEN),
    "rupture_time": Output(
        FLOAT, "time at which the restraint broke, NaN if it held", SECOND, column=tables.OUT_BREAK_TIME
    ),
    "final_state": Output(SIGN, _FINAL, airborne=3, column=tables.OUT_WELL),
    "airborne": Output(
        FLAG,
        "whether the floor falls faster than g: not computed, counted as overturned",
        DIMENSIONLESS,
        EITHER,
        column=tables.OUT_AIRBORNE,
    ),
}
_SLIDING = {
    "slide_peak": Output(FLOAT, "greatest slip to either side", METRE, IN_PLANE, column=slips.OUT_PEAK),
    "slide_forward": Output(FLOAT, "greatest slip to the front", METRE, OF_WIDTH, column=slips.OUT_FORWARD),
    "slide_backward": Output(FLOAT, "greatest slip to the back", METRE, OF_WIDTH, column=slips.OUT_BACKWARD),
    "slide_residual": Output(
        FLOAT, "slip in which the block comes to rest", METRE, IN_PLANE, column=slips.OUT_RESIDUAL
    ),
    "slide_path": Output(FLOAT, "way that the block slides in all", METRE, IN_PLANE, column=slips.OUT_PATH),
    "slide_velocity": Output(
        FLOAT, "greatest velocity relative to the floor", VELOCITY, IN_PLANE, column=slips.OUT_SPEED
    ),
    "slips": Output(
        FLOAT,
        "number of times that the block begins to slide or turns round",
        DIMENSIONLESS,
        EITHER,
        column=slips.OUT_SLIPS,
    ),
    "first_slip_time": Output(
        FLOAT, "time at which the block first slides, NaN if it stays", SECOND, EITHER, column=slips.OUT_FIRST
    ),
    "slide_after": Output(
        FLOAT,
        "way that the block slides after the end of the motion, on a floor at rest",
        METRE,
        IN_PLANE,
        column=slips.OUT_AFTER,
    ),
}
OUTPUTS = {
    **_ROCKING,
    **_SLIDING,
    TRIP_VELOCITY: Output(FLOAT, _MET, VELOCITY, column=slips.OUT_MET),
    "top_displacement": Output(
        FLOAT,
        "greatest horizontal displacement of the upper corner",
        METRE,
        LARGER,
        of=("peak_rotation",),
        formula=lambda block, peak: block.height * np.sin(peak),
    ),
    "restraint_force": Output(FLOAT, _FORCE, NEWTON, of=("peak_front", "peak_back", "ruptured")),
    "mode": Output(SIGN, _MODE, of=("slips",)),
    FALLEN_OFF: Output(
        FLAG,
        "whether the block slid over an edge, False of blocks near none",
        of=("slide_forward", "slide_backward"),
        formula=_fallen_off,
    ),
    AXIS: Output(SIGN, "axis along which the block fell first: 1 its width, 2 its depth, 0 if it stands", both=EITHER),
}
"""Every output by name; slips are NaN in the air."""

COLUMNS = {name: output.column for name, output in OUTPUTS.items() if output.column is not None}
"""Outputs that an engine returns, and their column among the columns of its kind."""
OF_ENGINE = {name: COLUMNS[name] for name in _ROCKING}
"""Outputs of the engine of rocking blocks, and their column."""
SLIDES = {name: COLUMNS[name] for name in _SLIDING}
"""Outputs of the engine of sliding blocks, along one axis or in the plane of the floor, and their column."""
OF_SLIDING = (*SLIDES, "mode", FALLEN_OFF)
"""Outputs that a run of a sliding block can have."""
OF_ROCKING = tuple(name for name in OUTPUTS if name not in (*OF_SLIDING, TRIP_VELOCITY))
"""Outputs that a run of a rocking block can have, about one axis or both."""
OF_AXES = tuple(name for name in OF_ROCKING if OUTPUTS[name].both)
"""Outputs of rocking blocks about both axes."""
DERIVED = {name: output.of for name, output in OUTPUTS.items() if output.of}
"""Outputs that are derived from the block and outputs of the engine."""
