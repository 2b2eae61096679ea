"""Times, rotations and floor displacements of a film's frames, and the block's corners in closed form."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Flags
from ...models import Block
from ...models.sides import sides
from ...motions.intensity.peaks import displacement, velocity
from ..text.histories import FLAT, block_of, checked
from .writers import FRAME_RATES

STAYS = 2.0
"""Time that a film continues after the block lies on its side, s of the film."""
MOST_FRAMES = 1500
"""Largest number of frames of a film at 25 a second; a longer film has fewer frames a second."""
LONGEST = 1200.0
"""Maximum length of a film, s: a longer film would have no viewers, and a large file."""
FALL_STEP = 1e-3
SLOWEST, FASTEST = 0.01, 100.0
VARIABLES = ("angular_velocity", "floor_acceleration", "overturned")
ATTRIBUTES = ("alpha", "p", "block", "model", "configuration")
"""Variables and attributes of a history that a film needs in addition to the rotation."""


class Frames(NamedTuple):
    """The state at each frame of a film: time (s), rotation (rad), floor (m), and True if the fall is only drawn."""

    time: Array
    rotation: Array
    displacement: Array
    drawn: Flags
    fps: int
    speed: float


def frames_of(response: xr.Dataset, *, speed: float = 1.0, fps: int | None = None) -> Frames:
    """Return the evenly spaced frames of a film, linear between samples, until `STAYS` seconds after the block lies."""
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
        fall = rigid_fall(float(theta[-1]), float(response["angular_velocity"].values[-1]), block_of(response))
        if fall is not None:
            stop = end + FALL_STEP * (fall.size - 1) + rate * STAYS
    length = (stop - begin) / rate
    if length > LONGEST:
        raise ValueError(f"a film must be at most {LONGEST:g} s long, got {length:.0f} s at speed {rate:g}")
    if fps is None:
        fps = next((rate for rate in (25, 20, 10) if rate * length <= MOST_FRAMES), 5)
    elif checks.count("fps", fps) not in FRAME_RATES:
        raise ValueError(f"fps must be one of {', '.join(map(str, FRAME_RATES))}, got {fps}")
    moments: Array = begin + np.arange(math.floor(length * fps + 1e-9) + 1, dtype=np.float64) * (rate / fps)
    acceleration = response["floor_acceleration"].values
    u = displacement(acceleration, dt)
    after = moments > end
    floor = np.interp(moments, time, u)
    # (without acceleration the floor keeps the velocity that it has at the end of the record)
    floor[after] += float(velocity(acceleration, dt)[-1]) * (moments[after] - end)
    rotation = np.interp(moments, time, theta)
    if fall is not None:
        rotation[after] = np.interp(moments[after] - end, FALL_STEP * np.arange(fall.size), fall)
    return Frames(moments, rotation, floor, after & (fall is not None), fps, rate)


def rigid_fall(theta: float, omega: float, block: Block) -> Array | None:
    """Return the rotation (rad) of a rigid block that falls on a quiet floor, every ms; None if it turns back."""
    side = math.copysign(1.0, theta)
    side_of_fall = sides(block, "exact")[0 if side > 0.0 else 1]
    alpha, p2 = side_of_fall.alpha, side_of_fall.q2
    x, v = side * theta, side * omega
    rotations = [x]
    # the block falls if it is past its balance, or moves outwards fast enough to reach it
    while x < FLAT and (x > alpha or v > 0.0) and len(rotations) < 20_000:
        # midpoint rule: its error is 1e-6 of the rotation at these steps, and a picture needs 1e-3
        push = p2 * math.sin(x - alpha)
        half = p2 * math.sin(x + 0.5 * FALL_STEP * v - alpha)
        x, v = x + FALL_STEP * (v + 0.5 * FALL_STEP * push), v + FALL_STEP * half
        rotations.append(x)
    if x < FLAT:
        return None
    return np.asarray(side * np.minimum(np.array(rotations), FLAT))


def corners(block: Block, rotation: float, floor: float = 0.0) -> Array:
    """Return the corners (4, 2) of a block, m, from bottom left; a rotation (rad) is positive to the right."""
    return rotated(
        block,
        rotation,
        floor,
        np.array([[-block.b, 0.0], [block.b, 0.0], [block.b, block.height], [-block.b, block.height]]),
    )


def rotated(block: Block, rotation: float, floor: float, points: Array) -> Array:
    """Return points of the upright block (n, 2), m, rotated about the block's lower corner."""
    pivot = math.copysign(block.b, rotation)
    c, s = math.cos(rotation), math.sin(rotation)
    x, y = points[:, 0] - pivot, points[:, 1]
    return np.column_stack([floor + pivot + x * c + y * s, y * c - x * s])
