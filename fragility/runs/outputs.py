"""Outputs of a run, each declared once: type, unit, meaning, and its value in runs about both axes or in the air."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...core.units import ANGULAR_VELOCITY, DIMENSIONLESS, METRE, NEWTON, RADIAN, SECOND
from ...models import Block
from ...models.scenes.edge import FALLEN_OFF, OF_FALLEN_OFF
from ...models.sliding.mode import MODE
from ...models.sliding.runs import LABELS, OF_OBSTACLES, SLIDES

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
    either side. `of`: the outputs of the engine from which it is derived, none if the engine returns it. `formula`: its
    value from the block and those outputs (level, motion), None if `labels` needs the motions too.
    """

    kind: type[np.generic]
    text: str
    units: str = DIMENSIONLESS
    both: str = ""
    airborne: int | None = None
    of: tuple[str, ...] = ()
    formula: Callable[..., Any] | None = None


def _fallen_off(block: Block, forward: Any, backward: Any) -> Any:
    return block.edge is not None and block.edge.fallen_off(forward, backward, block.b)


_SLIDES = {
    "slide_peak": IN_PLANE,
    "slide_forward": OF_WIDTH,
    "slide_backward": OF_WIDTH,
    "slide_residual": IN_PLANE,
    "slide_path": IN_PLANE,
    "slide_velocity": IN_PLANE,
    "slips": EITHER,
    "first_slip_time": EITHER,
    "slide_after": IN_PLANE,
}
"""Rule for each output of sliding blocks under both components."""
OUTPUTS = {
    "overturned": Output(np.bool_, "whether the block overturned", both=EITHER, airborne=1),
    "peak_rotation": Output(np.float64, "peak absolute rotation, pi/2 if overturned", RADIAN, LARGER),
    "uplifted": Output(np.bool_, "whether the block uplifted", both=EITHER, airborne=1),
    "impacts": Output(np.int32, "impacts during the record", both=DECIDING, airborne=-1),
    "overturning_time": Output(np.float64, "time of overturning, NaN if it stands", SECOND, EARLIER),
    "impact_velocity": Output(
        np.float64, "greatest angular speed at which the block came down", ANGULAR_VELOCITY, DECIDING
    ),
    "direction": Output(
        np.int8, "sign of the rotation in which the block fell, 0 if it stands", both=FALLEN, airborne=2
    ),
    "peak_front": Output(np.float64, "peak forward rotation, NaN of blocks that are alike on both sides", RADIAN),
    "peak_back": Output(np.float64, "peak backward rotation, NaN of blocks that are alike on both sides", RADIAN),
    "wall_impacts": Output(np.int32, "impacts at walls during the record", airborne=-1),
    "wall_impact_velocity": Output(
        np.float64, "greatest angular speed at which the block struck a wall", ANGULAR_VELOCITY
    ),
    "ruptured": Output(np.bool_, "whether the restraint broke", both=EITHER, airborne=1),
    "rupture_time": Output(np.float64, "time at which the restraint broke, NaN if it held", SECOND),
    "final_state": Output(
        np.int8,
        "where the block ends: 0 stands, 1 and -1 held beyond its balance at the front and at the back (by a wall, "
        "on a strap), 2 and -2 fell forward and backward",
        airborne=3,
    ),
    **{
        name: Output(np.float64, LABELS[name][1], LABELS[name][0], _SLIDES.get(name, ""))
        for name in (*SLIDES, *OF_OBSTACLES)
    },
    "airborne": Output(
        np.bool_, "whether the floor falls faster than g: not computed, counted as overturned", both=EITHER
    ),
    "top_displacement": Output(
        np.float64,
        "greatest horizontal displacement of the upper corner",
        METRE,
        LARGER,
        of=("peak_rotation",),
        formula=lambda block, peak: block.height * np.sin(peak),
    ),
    "restraint_force": Output(
        np.float64,
        "greatest force of each part of the restraint, its strength if it broke",
        NEWTON,
        of=("peak_front", "peak_back", "ruptured"),
    ),
    "mode": Output(np.int8, MODE["long_name"], MODE["units"], of=("slips",)),
    FALLEN_OFF: Output(
        np.bool_, OF_FALLEN_OFF["long_name"], of=("slide_forward", "slide_backward"), formula=_fallen_off
    ),
    AXIS: Output(
        np.int8, "axis along which the block fell first: 1 its width, 2 its depth, 0 if it stands", both=EITHER
    ),
}
"""Every output by name; the engine returns those in `models.runs.COLUMNS`, and slips are NaN in the air."""

OF_SLIDING = (*SLIDES, "mode", FALLEN_OFF)
"""Outputs that a run of a sliding block can have."""
OF_ROCKING = tuple(name for name in OUTPUTS if name not in (*OF_SLIDING, *OF_OBSTACLES))
"""Outputs that a run of a rocking block can have, about one axis or both."""
OF_AXES = tuple(name for name in OF_ROCKING if OUTPUTS[name].both)
"""Outputs of rocking blocks about both axes."""
SLIDES_IN_PLANE = tuple(_SLIDES)
"""Outputs of blocks that slide in the plane of the floor, under both components."""
DERIVED = {name: output.of for name, output in OUTPUTS.items() if output.of}
"""Outputs that are derived from the block and outputs of the engine."""
