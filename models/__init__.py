"""Rocking blocks and their loss of energy: blocks, walls, restraints, beds, damping laws, engine, single histories."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .block import Block, describe_block
    from .columns import BlockArray
    from .history import free_rocking, simulate
    from .items import Catalogue, Item, catalogue
    from .laws import (
        LAWS,
        DiscreteDamping,
        EnergyConsistent,
        GianniniMasiani,
        HousnerImpact,
        Law,
        MakrisKonstantinidis,
        Model,
        Vassiliou,
        ViscousDamping,
        describe_law,
    )
    from .scenes.bed import Bed
    from .scenes.edge import Edge
    from .scenes.restraint import Restraint
    from .scenes.wall import Wall
    from .sliding.law import RandomSliding, Sliding
    from .statics import half_weight, required_force, static_capacity
    from .supports import delta_from_frequency, delta_from_settlement

__all__ = [
    "LAWS",
    "Bed",
    "Block",
    "BlockArray",
    "Catalogue",
    "DiscreteDamping",
    "Edge",
    "EnergyConsistent",
    "GianniniMasiani",
    "HousnerImpact",
    "Item",
    "Law",
    "MakrisKonstantinidis",
    "Model",
    "RandomSliding",
    "Restraint",
    "Sliding",
    "Vassiliou",
    "ViscousDamping",
    "Wall",
    "catalogue",
    "delta_from_frequency",
    "delta_from_settlement",
    "describe_block",
    "describe_law",
    "free_rocking",
    "half_weight",
    "required_force",
    "simulate",
    "static_capacity",
]

__getattr__, __dir__ = face(
    __name__,
    {
        "block": ("Block", "describe_block"),
        "columns": ("BlockArray",),
        "history": ("free_rocking", "simulate"),
        "items": ("Catalogue", "Item", "catalogue"),
        "laws": (
            "LAWS",
            "DiscreteDamping",
            "EnergyConsistent",
            "GianniniMasiani",
            "HousnerImpact",
            "Law",
            "MakrisKonstantinidis",
            "Model",
            "Vassiliou",
            "ViscousDamping",
            "describe_law",
        ),
        "scenes.bed": ("Bed",),
        "scenes.edge": ("Edge",),
        "scenes.restraint": ("Restraint",),
        "scenes.wall": ("Wall",),
        "sliding.law": ("RandomSliding", "Sliding"),
        "statics": ("half_weight", "required_force", "static_capacity"),
        "supports": ("delta_from_frequency", "delta_from_settlement"),
    },
)
