"""Answers of every public function of toppling.models."""

import numpy as np

from toppling import models
from toppling.models import friction
from toppling.motions import Ricker

BLOCK = models.Block(0.4, 1.8, depth=0.8)
SHELF = models.Block(
    0.3, 1.2, depth=0.6, cm_height=0.5, inertia_factor=1.4, name="shelf", mass=80.0, cm_offset=0.02, lean=0.01
)
TRUNK = models.Block(0.4, 1.5, depth=0.4, round=True)
LAWS = {
    "discrete": models.DiscreteDamping(delta=0.04, rest="rigid"),
    "energy": models.EnergyConsistent(restitution_factor=0.95, lever="R"),
    "giannini": models.GianniniMasiani(0.9),
    "housner": models.HousnerImpact(),
    "bilinear": models.HousnerImpact(0.92, geometry="bilinear"),
    "makris": models.MakrisKonstantinidis(),
    "vassiliou": models.Vassiliou(coefficient=0.03),
    "viscous": models.ViscousDamping(0.05),
}
LINEAR = models.HousnerImpact(geometry="linear")
MOTION = Ricker(5.0, 8.0, dt=0.005).sample()
DERIVED = ("R", "alpha", "b", "h", "p", "gyration", "inertia", "restitution", "corners", "balances", "across",
           "scene_words", "sided", "symmetric", "label")  # fmt: skip


def blocks():
    found = {}
    for name, block in {"block": BLOCK, "shelf": SHELF, "trunk": TRUNK}.items():
        found[name] = {key: getattr(block, key) for key in DERIVED}
        found[f"describe_{name}"] = models.describe_block(block)
    found["from_slenderness"] = models.Block.from_slenderness(0.2, 0.9, name="slender")
    found["from_tilt_test"] = models.Block.from_tilt_test(0.19, 0.4, 1.8, inertia_factor=1.4)
    return found


def columns():
    array = models.BlockArray(
        [0.3, 0.35, 0.4],
        [1.2, 1.5, 1.9],
        cm_height=[0.5, 0.8, 0.9],
        inertia_factor=[1.35, 1.3, 1.4],
        e=[0.9, 0.92, 0.95],
    )
    return {
        "R": array.R,
        "alpha": array.alpha,
        "p": array.p,
        "names": list(array.names),
        "of": models.BlockArray.of([BLOCK, models.Block(0.3, 1.2)]).alpha,
        "some": array.some(np.array([0, 2])),
    }


def contents():
    own = models.Catalogue({"own": models.catalogue.item("bookcase-5-shelf")})
    assert isinstance(own.item("own"), models.Item)
    return {
        "names": list(models.catalogue.keys()),
        "items": {name: models.catalogue.item(name) for name in models.catalogue},
        "placed": {name: models.catalogue.placed(name) for name in models.catalogue},
        "item_placed": own.item("own").placed,
        "get": own.get("missing", 1.0),
        "values": list(own.values()),
        "own": dict(own.items()),
    }


def laws():
    found = {"names": sorted(models.LAWS)}
    for name, law in LAWS.items():
        assert isinstance(law, models.Law)
        assert isinstance(law, models.Model)
        found[name] = {
            "label": law.label,
            "options": law.options,
            "oscillator": law.oscillator(BLOCK),
            "restitution": law.restitution(BLOCK),
            "zone_edge": law.zone_edge(BLOCK),
            "describe_law": models.describe_law(law),
        }
    found["giannini_damping_ratio"] = models.GianniniMasiani.damping_ratio(0.9)
    found["makris_damping_ratio"] = models.MakrisKonstantinidis.damping_ratio(0.9)
    found["fema356"] = models.ViscousDamping.fema356(0.9)
    return found


def scenes():
    edge = models.Edge(0.1, 0.3, falls_when="foot")
    restraints = {
        "adhesive": models.Restraint.adhesive(300.0, 0.2),
        "bracket": models.Restraint.bracket(1.7, 900.0, count=2),
        "cable": models.Restraint.cable(1.7, 900.0, angle=0.5, width=0.4),
        "pole": models.Restraint.pole(100.0, 400.0, 2e4, 0.1, 0.3),
        "strap": models.Restraint.strap(1.7, slack=0.005),
        "tendon": models.Restraint.tendon(5e4, preload=50.0, width=0.4),
    }
    wall = models.Wall(0.02, height=1.2, restitution=0.5, front_gap=0.5)
    return {
        "bed": models.Bed(0.002).label,
        "edge": edge.label,
        "edge_fallen_off": edge.fallen_off(np.array([0.05, 0.2, 0.4]), np.array([0.0, 0.1, 0.4]), 0.2),
        "edge_slips": edge.slips(0.2),
        "restraints": restraints,
        "restraint_labels": {name: restraint.label for name, restraint in restraints.items()},
        "restraint_rigid": {name: restraint.rigid for name, restraint in restraints.items()},
        "wall": wall.label,
        "wall_contact": [wall.contact(0.02, 1.2, exact) for exact in (True, False)],
    }


def statics():
    return {
        "half_weight": models.half_weight(SHELF),
        "required_force": models.required_force(SHELF, 6.0, 1.0),
        "static_capacity": models.static_capacity(SHELF),
        "delta_from_frequency": models.delta_from_frequency(BLOCK, 3.0, 12.0),
        "delta_from_settlement": models.delta_from_settlement(BLOCK, 0.002),
    }


def sliding():
    needed = np.array([0.1, 0.3, 0.6])
    shares = np.array([0.1, 0.5, 0.9])
    kinds = {
        "fixed": friction.FixedFriction(0.4),
        "lognormal": friction.LognormalFriction(0.4, 0.3),
        "of_number": friction.contact_of(0.5).friction,
        "from_median": friction.friction_and_ratio(None, 0.4, 0.2)[0],
    }
    found = {
        name: {"below": kind.below(needed), "quantile": kind.quantile(shares), "description": kind.description}
        for name, kind in kinds.items()
        if isinstance(kind, friction.Friction)
    }
    law, random = models.Sliding(0.4, 0.3), models.RandomSliding(kinds["lognormal"], 0.8)
    for name, sliding_law in {"sliding": law, "random": random}.items():
        found[name] = {
            "label": sliding_law.label,
            "options": sliding_law.options,
            "coefficients": sliding_law.coefficients(BLOCK, shares),
            "restitution": sliding_law.restitution(BLOCK),
        }
    found["slider"] = law.slider(BLOCK)
    found["in_plane"] = law.in_plane(BLOCK)
    found["chance"] = models.RandomSliding(kinds["lognormal"]).chance(BLOCK)
    found["contact_named"] = friction.contact_named("vinyl")
    assert isinstance(found["contact_named"], friction.Contact)
    found["friction_at_impact"] = friction.friction_at_impact(shares, 0.9)
    found["friction_at_uplift"] = friction.friction_at_uplift(np.array([0.1, 0.2]), 5.0)
    return found


def free_rocking():
    return {name: models.free_rocking(BLOCK, law, 0.5 * BLOCK.alpha, 2.0, dt=0.01) for name, law in LAWS.items()}


def simulate():
    restraint = models.Restraint.strap(1.7, slack=0.005)
    standing = {
        "wall": models.Block(0.4, 1.8, wall=models.Wall(0.02)),
        "restraint": models.Block(0.4, 1.8, mass=100.0, restraint=restraint),
        "lean": SHELF,
    }
    found = {name: models.simulate(BLOCK, law, MOTION) for name, law in LAWS.items()}
    found |= {name: models.simulate(block, LINEAR, MOTION) for name, block in standing.items()}
    bed = models.Block(0.4, 1.8, bed=models.Bed(0.002))
    found["bed"] = models.simulate(bed, models.EnergyConsistent(rest="soft"), MOTION)
    found["tilted"] = models.simulate(BLOCK, LAWS["housner"], MOTION, theta0=0.05, omega0=-0.1)
    found["sliding"] = models.simulate(BLOCK, models.Sliding(0.4, 0.3), MOTION)
    return found
