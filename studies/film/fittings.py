"""Walls and restraints in a film, in metres from the middle of the upright block, the back to the left."""

import json
import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...models import Block, Restraint
from ...models.sides import sides, surroundings
from .frames import rotated

STANDS_OFF = 0.06
"""Distance of the fixing of a restraint if there is no wall, over the block's height."""
STUB = 0.11
"""Length of the loose ends of a broken restraint, over the block's height."""
CEILING = 1.12
"""Height of the ceiling above a pole, over the block's height."""
LEAST = 1e-3
"""Rotation (rad) from its wall at which a block counts as leaning on it."""


class Face(NamedTuple):
    """Face of a wall: its x, the side on which it is (-1 behind, 1 in front), contact height (m) and rotation (rad)."""

    x: float
    side: float
    height: float
    rotation: float
    rail: bool

    def contact(self, block: Block, rotation: float) -> Array:
        """Return the point (2,) of a block that meets this wall: its upper edge, or its face at the rail's height."""
        return _meets(block, self.side, self.height, rotation)


class Strap(NamedTuple):
    """Restraint as it is drawn, by its moment arm: its points on the block and its fixing, and True if it sags."""

    restraint: Restraint
    on_block: Array
    fixed: Array
    sags: bool


def faces(response: xr.Dataset, block: Block) -> list[Face]:
    """Return the walls that a block can meet, each where its edge touches it in the drawing."""
    wall = block.wall
    if wall is None:
        return []
    options = json.loads(response.attrs["configuration"])["model"]
    exact = options.get("geometry") == "exact"
    around = surroundings(block, *sides(block, "exact" if exact else "linear"), exact)
    height = block.height if wall.height is None else wall.height
    met = []
    for side, contact in ((-1.0, around.back_wall), (1.0, around.front_wall)):
        if contact is not None:
            x = float(_meets(block, side, height, side * contact.rotation)[0])
            met.append(Face(x, side, height, contact.rotation, height < block.height))
    return met


def _meets(block: Block, side: float, height: float, rotation: float) -> Array:
    """Return the point (2,) of a block that meets a wall on a side at a height."""
    if height < block.height:  # (the face turns about the lower edge, and slides along the rail)
        return np.array([side * block.b + height * math.tan(rotation), height])
    edge: Array = rotated(block, rotation, 0.0, np.array([[side * block.b, height]]))[0]
    return edge


def straps(block: Block, walls: list[Face]) -> list[Strap]:
    """Return the lines of a block's restraint; a pole or a tendon is one line, an adhesive two pads under the block."""
    restraint = block.restraint
    if restraint is None:
        return []
    if restraint.kind == "adhesive":
        places = [block.b - (restraint.back or 0.0), (restraint.front or 0.0) - block.b]
        # (the pad at the distance `front` from the front corner is the rear one)
        return [Strap(restraint, np.array([-x, 0.0]), np.array([-x, 0.0]), False) for x in places]
    if restraint.kind == "pole":
        x = block.b - (restraint.front or block.b)
        return [Strap(restraint, np.array([x, block.height]), np.array([x, CEILING * block.height]), False)]
    if restraint.kind == "tendon":
        return [Strap(restraint, np.array([0.0, block.h]), np.zeros(2), False)]
    level = restraint.front or restraint.back or block.height
    behind = next((face.x for face in walls if face.side < 0.0), -block.b - STANDS_OFF * block.height)
    bends = restraint.kind in ("strap", "cable")
    return [Strap(restraint, np.array([-block.b, level]), np.array([behind, level]), bends)]


def line(block: Block, strap: Strap, rotation: float) -> Array:
    """Return the points (n, 2) of an intact restraint: straight if it is taut, a sagging curve if it is slack."""
    end = rotated(block, rotation, 0.0, strap.on_block[None])[0]
    start = strap.fixed
    span = float(np.hypot(*(end - start)))
    free = float(np.hypot(*(strap.on_block - start))) + strap.restraint.slack - span
    if not strap.sags or free <= 0.0:
        return np.stack([start, end])
    s = np.linspace(0.0, 1.0, 15)
    # (a flat parabola of the length l over a span d sags by sqrt(3 d (l - d)/8))
    sag = math.sqrt(3.0 / 8.0 * max(span, free) * free)
    curve: Array = start + s[:, None] * (end - start)
    curve[:, 1] -= 4.0 * sag * s * (1.0 - s)
    return curve


def ends(block: Block, strap: Strap, rotation: float) -> Array:
    """Return the points of a broken restraint: an end that hangs from the block, a gap (NaN), the other end."""
    end = rotated(block, rotation, 0.0, strap.on_block[None])[0]
    down = np.array([0.0, -STUB * block.height])
    if strap.restraint.kind == "adhesive":  # (a part of the pad stays on the floor)
        down = np.zeros(2)
    if strap.restraint.kind == "tendon":  # the rest is in the floor
        return np.stack([end, end + down, np.full(2, np.nan), strap.fixed, strap.fixed - down])
    return np.stack([end, end + down, np.full(2, np.nan), strap.fixed, strap.fixed + down])


def force(restraint: Restraint, rotation: float) -> float | None:
    """Return the force (N) of one of the restraints at a rotation; None for a rigid one, whose force is not known."""
    if restraint.rigid:
        return None
    arm = restraint.front if rotation >= 0.0 else restraint.back
    stretch = 0.0 if arm is None else max(0.0, arm * abs(rotation) - restraint.slack)
    return restraint.preload + restraint.stiffness * stretch


def strikes(response: xr.Dataset, walls: list[Face]) -> Array:
    """Return the times (s) at which a block strikes a wall, to a sample: it comes near and turns back at once."""
    theta, omega = response["rotation"].values, response["angular_velocity"].values
    time = response["time"].values
    dt = float(time[-1] - time[0]) / (time.size - 1)
    struck = np.zeros(time.size - 1, bool)
    for face in walls:
        out, inward = face.side * omega[:-1], face.side * omega[1:]
        reaches = face.side * theta[:-1] + out * dt >= face.rotation - 0.1 * out * dt
        struck |= (out > 0.0) & (inward <= 0.0) & reaches
    times: Array = time[1:][struck]
    return times
