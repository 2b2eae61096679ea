"""Outputs of a run, each declared once: type, unit, meaning, and its value in runs about both axes or in the air."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...core.units import DIMENSIONLESS, METRE
from ...models import Block
from ...models.restraint_force import OF_FORCE
from ...models.runs import RESULTS
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
_ROCKING: dict[str, tuple[type[np.generic], str, int | None]] = {
    "overturned": (np.bool_, EITHER, 1),
    "peak_rotation": (np.float64, LARGER, None),
    "uplifted": (np.bool_, EITHER, 1),
    "impacts": (np.int32, DECIDING, -1),
    "overturning_time": (np.float64, EARLIER, None),
    "impact_velocity": (np.float64, DECIDING, None),
    "direction": (np.int8, FALLEN, 2),
    "peak_front": (np.float64, "", None),
    "peak_back": (np.float64, "", None),
    "wall_impacts": (np.int32, "", -1),
    "wall_impact_velocity": (np.float64, "", None),
    "ruptured": (np.bool_, EITHER, 1),
    "rupture_time": (np.float64, "", None),
    "final_state": (np.int8, "", 3),
    "airborne": (np.bool_, EITHER, None),
}
"""Type of each output of rocking blocks, its rule about both axes, and its value in the air."""
OUTPUTS = {
    **{name: Output(kind, *reversed(RESULTS[name][1:]), *rules) for name, (kind, *rules) in _ROCKING.items()},
    **{
        name: Output(np.float64, LABELS[name][1], LABELS[name][0], _SLIDES.get(name, ""))
        for name in (*SLIDES, *OF_OBSTACLES)
    },
    "top_displacement": Output(
        np.float64,
        "greatest horizontal displacement of the upper corner",
        METRE,
        LARGER,
        of=("peak_rotation",),
        formula=lambda block, peak: block.height * np.sin(peak),
    ),
    "restraint_force": Output(
        np.float64, OF_FORCE["long_name"], OF_FORCE["units"], of=("peak_front", "peak_back", "ruptured")
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
