"""Freestanding blocks and their loss of energy: blocks, damping laws, the engine that solves them, single histories."""

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
