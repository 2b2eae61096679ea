"""Rocking blocks and their loss of energy: blocks, walls, restraints, damping laws, the engine, single histories."""

from .block import Block, describe_block
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
    Vassiliou,
    ViscousDamping,
    describe_law,
)
from .scenes.restraint import Restraint
from .scenes.wall import Wall
from .statics import half_weight, required_force, static_capacity
from .supports import delta_from_frequency, delta_from_settlement

__all__ = [
    "LAWS",
    "Block",
    "Catalogue",
    "DiscreteDamping",
    "EnergyConsistent",
    "GianniniMasiani",
    "HousnerImpact",
    "Item",
    "Law",
    "MakrisKonstantinidis",
    "Restraint",
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
