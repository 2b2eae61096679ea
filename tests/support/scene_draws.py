"""Random scenes of the independent reference, and the same scenes as blocks and laws of the package."""

import contextlib
import math
from typing import NamedTuple

import numpy as np
from scene_reference import random_scene, tables

import toppling as tp

LAWS = ("housner", "housner", "housner", "housner", "housner", "discrete", "energy")


class Case(NamedTuple):
    """A scene as the engine takes it: seen from the other side where its only or its touching wall is the front one."""

    block: tp.Block
    law: tp.models.Law
    record: np.ndarray
    dt: float
    mirrored: bool


def scene_of(seed):
    """A random scene with its record; both walls of a niche are met at one height."""
    rng = np.random.default_rng(seed)
    while True:
        scene, record, dt = random_scene(rng, LAWS[rng.integers(len(LAWS))])
        if scene.wall_gap is None or scene.front_gap is None:
            return scene, record, dt
        scene = scene._replace(front_height=scene.wall_height)
        with contextlib.suppress(ValueError):  # (the walls then stand inside an elastic zone)
            tables(scene)
            return scene, record, dt


def case_of(scene, record, dt):
    mirrored = scene.front_gap is not None and (scene.wall_gap is None or scene.front_gap == 0.0)
    sign = -1.0 if mirrored else 1.0
    walls = ((scene.wall_gap, scene.wall_height), (scene.front_gap, scene.front_height))
    (gap, height), (front_gap, _) = walls[::-1] if mirrored else walls
    wall = None if gap is None else tp.Wall(gap, height, scene.wall_restitution, front_gap)
    hold = scene.restraint
    restraint = None
    if hold is not None:
        arms = (hold.arm, hold.arm if hold.both_sides else None)
        front, back = arms[::-1] if mirrored else arms
        kind = "adhesive" if math.isinf(hold.stiffness) else "bracket"
        restraint = tp.Restraint(kind, hold.strength, hold.stiffness, front, back, hold.slack, hold.preload)
    block = tp.Block(
        scene.width,
        scene.height,
        scene.cm_height,
        scene.inertia,
        mass=scene.mass,
        cm_offset=sign * scene.cm_offset,
        lean=sign * scene.lean,
        wall=wall,
        restraint=restraint,
    )
    if scene.law == "housner":
        law = tp.HousnerImpact(scene.restitution, scene.geometry)
    else:
        kind = tp.DiscreteDamping if scene.law == "discrete" else tp.EnergyConsistent
        law = kind(scene.restitution, scene.delta, rest="rigid")
    return Case(block, law, sign * record, dt, mirrored)
