"""When and where a film shows a block: moments, rotations, the floor's way, and the block's corners in closed form.

Nothing here draws.
"""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..models import Block
from ..motions.peaks import displacement, velocity
from .histories import FLAT, checked
from .movies import FRAME_RATES

Values = NDArray[np.float64]
STAYS = 2.0
"""Time that a film goes on after that, s of the film."""
MOST_FRAMES = 1500
"""Frames of a film at 25 a second; a longer one gets fewer a second."""
LONGEST = 1200.0
"""Length of a film, s, beyond which nobody would look at it (and its file grows)."""
FALL_STEP = 1e-3
SLOWEST, FASTEST = 0.01, 100.0
VARIABLES = ("angular_velocity", "floor_acceleration", "overturned")
ATTRIBUTES = ("alpha", "p", "block", "model", "configuration")
"""What a history holds beside its rotation, where it is to be seen."""


class Frames(NamedTuple):
    """What is seen at each moment of a film: time (s), rotation (rad), displacement of the floor (m).

    `drawn` marks the moments after the record, where the fall is drawn and not the engine's.
    """

    time: Values
    rotation: Values
    displacement: Values
    drawn: NDArray[np.bool_]
    fps: int
    speed: float


def frames_of(response: xr.Dataset, *, speed: float = 1.0, fps: int | None = None) -> Frames:
    """The moments of a film of `response`, evenly spaced: rotation and floor between samples taken as linear.

    From the first sample to the last, or to `STAYS` seconds (of the film) after the block lies on its side.

    Raises
    ------
    TypeError, ValueError
        As `animate`.
    """
    checked(response, VARIABLES, ATTRIBUTES)
    rate = checks.number("speed", speed, at_least=SLOWEST, at_most=FASTEST)
    time, theta = response["time"].values, response["rotation"].values
    begin, end = float(time[0]), float(time[-1])
    dt = (end - begin) / (time.size - 1)
    fall = None
    lies = np.flatnonzero(np.abs(theta) >= FLAT)
    stop = end
    if lies.size:
        stop = float(time[lies[0]]) + rate * STAYS
    elif bool(response["overturned"]):
        fall = falling(float(theta[-1]), float(response["angular_velocity"].values[-1]), response.attrs)
        if fall is not None:
            stop = end + FALL_STEP * (fall.size - 1) + rate * STAYS
    length = (stop - begin) / rate
    if length > LONGEST:
        raise ValueError(f"a film must be at most {LONGEST:g} s long, got {length:.0f} s at speed {rate:g}")
    if fps is None:
        fps = next((one for one in (25, 20, 10) if one * length <= MOST_FRAMES), 5)
    elif checks.count("fps", fps) not in FRAME_RATES:
        raise ValueError(f"fps must be one of {', '.join(map(str, FRAME_RATES))}, got {fps}")
    moments: Values = begin + np.arange(math.floor(length * fps + 1e-9) + 1, dtype=np.float64) * (rate / fps)
    acceleration = response["floor_acceleration"].values
    u = displacement(acceleration, dt)
    after = moments > end
    floor = np.interp(moments, time, u)
    # (with no more acceleration the floor keeps the velocity that the record leaves)
    floor[after] += float(velocity(acceleration, dt)[-1]) * (moments[after] - end)
    rotation = np.interp(moments, time, theta)
    if fall is not None:
        rotation[after] = np.interp(moments[after] - end, FALL_STEP * np.arange(fall.size), fall)
    return Frames(moments, rotation, floor, after & (fall is not None), fps, rate)


def falling(theta: float, omega: float, block: Any) -> Values | None:
    """Rotation (rad) of a rigid block that falls on a quiet floor, every millisecond until it lies on its side.

    None where it does not fall without turning back first; `block` holds alpha and p.
    """
    side = math.copysign(1.0, theta)
    alpha, p2 = float(block["alpha"]), float(block["p"]) ** 2
    x, v = side * theta, side * omega
    found = [x]
    # energy and the way to go: past the balance, or fast enough to get there
    while x < FLAT and (x > alpha or v > 0.0) and len(found) < 20_000:
        # midpoint rule: 1e-6 of the rotation at these steps, a picture needs 1e-3
        push = p2 * math.sin(x - alpha)
        half = p2 * math.sin(x + 0.5 * FALL_STEP * v - alpha)
        x, v = x + FALL_STEP * (v + 0.5 * FALL_STEP * push), v + FALL_STEP * half
        found.append(x)
    if x < FLAT:
        return None
    return np.asarray(side * np.minimum(np.array(found), FLAT))


def corners(block: Block, rotation: float, floor: float = 0.0) -> Values:
    """Corners (4, 2) of a block on a floor at height 0, m: bottom left, bottom right, top right, top left.

    Parameters
    ----------
    block : Block
    rotation : float
        Rad; positive about the right corner, to the right.
    floor : float
        Displacement of the floor, m: x of the middle of the upright block.
    """
    return placed(
        block,
        rotation,
        floor,
        np.array([[-block.b, 0.0], [block.b, 0.0], [block.b, block.height], [-block.b, block.height]]),
    )


def placed(block: Block, rotation: float, floor: float, points: Values) -> Values:
    """Points of the upright block (n, 2), m, where they are under a rotation: about the corner it stands on."""
    pivot = math.copysign(block.b, rotation)
    c, s = math.cos(rotation), math.sin(rotation)
    x, y = points[:, 0] - pivot, points[:, 1]
    return np.column_stack([floor + pivot + x * c + y * s, y * c - x * s])


def block_of(response: xr.Dataset) -> Block:
    """The block of a run, as its attributes describe it."""
    return Block(**json.loads(response.attrs["configuration"])["block"])
