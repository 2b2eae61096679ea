"""Rocking blocks and their loss of energy: blocks, walls, restraints, beds, damping laws, engine, single histories."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .block import Block as Block, describe_block as describe_block
    from .block_array import BlockArray as BlockArray
    from .history import free_rocking as free_rocking, simulate as simulate
    from .items import Catalogue as Catalogue, Item as Item, catalogue as catalogue
    from .laws import (
        LAWS as LAWS,
        DiscreteDamping as DiscreteDamping,
        EnergyConsistent as EnergyConsistent,
        GianniniMasiani as GianniniMasiani,
        HousnerImpact as HousnerImpact,
        Law as Law,
        MakrisKonstantinidis as MakrisKonstantinidis,
        Model as Model,
        Vassiliou as Vassiliou,
        ViscousDamping as ViscousDamping,
        describe_law as describe_law,
    )
    from .scenes.bed import Bed as Bed
    from .scenes.edge import Edge as Edge
    from .scenes.restraint import Restraint as Restraint
    from .scenes.wall import Wall as Wall
    from .sliding.law import RandomSliding as RandomSliding, Sliding as Sliding
    from .statics import (
        half_weight as half_weight,
        required_force as required_force,
        static_capacity as static_capacity,
    )
    from .supports import delta_from_frequency as delta_from_frequency, delta_from_settlement as delta_from_settlement

__getattr__, __dir__, __all__ = face(__name__)
