"""Histories of sliding blocks as labelled datasets."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import ACCELERATION, METRE, SECOND, VELOCITY, provenance
from ..block import Block, describe_block
from ..laws import describe_law
from ..scenes.edge import FALLEN_OFF, OF_FALLEN_OFF
from ..slip import tables
from .law import Sliding
from .mode import MODE, Mode, demand, mode_of
from .runs import LABELS, SLIDES, airborne, friction_table, run_sliders


def slide_history(
    block: Block, model: Sliding, acceleration: Array, vertical: Array | None, time: Array, dt: float
) -> xr.Dataset:
    """Return the history of one block that slides under one motion (n,), m/s²; `vertical` is the vertical acceleration.

    ValueError where the vertical acceleration takes the whole weight.
    """
    if vertical is not None and airborne(vertical, np.ones(1))[0]:
        at = int(np.argmin(vertical))
        raise ValueError(
            f"the vertical acceleration must stay above -g, so that the block keeps its weight, got {vertical[at]:g} "
            f"m/s² at {time[at]:g} s"
        )
    history = np.zeros((tables.HISTORY_ROWS, acceleration.size))
    slider = model.slider(block)
    run = run_sliders(friction_table([slider]), np.ones((1, 1)), acceleration, vertical, dt, False, None, history)[0, 0]
    results: dict[str, Any] = {name: run[column] for name, column in SLIDES.items()}
    results["slips"] = int(results["slips"])
    results["first_slip_time"] += time[0]
    ends = results["slide_forward"], results["slide_backward"]
    fell = None if block.edge is None else block.edge.fallen_off(*ends, block.b)
    mode = Mode(int(mode_of(block, model.static, demand(acceleration, vertical, np.ones(1))[0])))
    upward = {} if vertical is None else {"vertical_acceleration": (vertical, ACCELERATION, "of the floor, upward")}
    series = {
        "slip": (history[tables.HISTORY_SLIP], METRE, "slip relative to the floor, to the front"),
        "slip_velocity": (history[tables.HISTORY_SPEED], VELOCITY, "velocity relative to the floor"),
        "floor_acceleration": (acceleration, ACCELERATION, "floor acceleration"),
        **upward,
    }
    return xr.Dataset(
        {
            **{
                name: ("time", values, {"units": units, "long_name": text})
                for name, (values, units, text) in series.items()
            },
            **{
                name: ((), value, {"units": LABELS[name][0], "long_name": LABELS[name][1]})
                for name, value in results.items()
            },
            "mode": ((), mode.value, MODE),
            **({} if fell is None else {FALLEN_OFF: ((), fell, OF_FALLEN_OFF)}),
        },
        coords={"time": ("time", time, {"units": SECOND, "long_name": "time"})},
        attrs={
            "title": "History of a sliding block",
            "block": block.label,
            "model": model.label,
            **provenance({"block": describe_block(block), "model": describe_law(model)}),
        },
    )
