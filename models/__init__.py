"""What a block is and how it loses energy: blocks, damping laws, the engine that solves them, single histories."""

from .block import Block
from .catalogue import Catalogue, Item, catalogue
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
)
from .simulate import describe_block, describe_law, free_rocking, simulate

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
    "Vassiliou",
    "ViscousDamping",
    "catalogue",
    "describe_block",
    "describe_law",
    "free_rocking",
    "simulate",
]
