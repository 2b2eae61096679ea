"""Problems of the benchmark: blocks, laws and one record, as plain numbers (SI, per unit inertia)."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.aliases import Array
from ..core.units import STANDARD_GRAVITY
from ..models import (
    Block,
    DiscreteDamping,
    EnergyConsistent,
    GianniniMasiani,
    HousnerImpact,
    Law,
    MakrisKonstantinidis,
    Vassiliou,
)
from ..motions import CloughPenzien, RiseStrongDecay, scale_to
from .kernels.rivals import ENERGY, ENTRY_SPEED, EXACT, IMPACT, VISCOUS

TRUTH_FILE = Path(__file__).with_name("truth.nc")
"""Peaks to 40 digits and rotations of every law x block x factor: made by `truth`."""

DT = 0.005
DURATION = 20.0
SHAKING = CloughPenzien(omega_g=15.0, xi_g=0.6, duration=DURATION, dt=DT, envelope=RiseStrongDecay(2.0, 10.0, 0.2))
LAWS: tuple[Law, ...] = (
    DiscreteDamping(e=0.9),
    DiscreteDamping(e=0.9, rest="rigid"),
    GianniniMasiani(e=0.9),
    MakrisKonstantinidis(e=0.9),
    Vassiliou(),
    EnergyConsistent(e=0.9),
    EnergyConsistent(e=0.9, rest="elastic"),
    HousnerImpact(e=0.9, geometry="linear"),
    HousnerImpact(e=0.9, geometry="bilinear"),
    HousnerImpact(e=0.9),
)
HARD = Block.from_slenderness(alpha=0.2, R=0.38)
LARGE = Block.from_slenderness(alpha=0.28, R=1.5)
TRUTH_BLOCKS = {"hard": HARD, "large": LARGE}
TRUTH_FACTORS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45)
"""Scale factors of the runs of the truth, on a record with a peak of 1 g."""


class Problem(NamedTuple):
    """One block under one law: theta'' + c theta' + f(theta) = -gain u''(t), per unit inertia, rad and s.

    f = zone theta for abs(theta) <= edge and sgn(theta) q2 (alpha - abs(theta)) beyond; edge = 0: no zone.  `kind`
    gives the meaning of c.  VISCOUS: `c` at every rotation.  ENTRY_SPEED: inside the zone (1 - e) v/(2 edge), v the
    speed at its last inward crossing (0 before the first), 0 outside.  ENERGY: inside the zone, held from each inward
    crossing, the c for which the unforced crossing leaves with v² -> e² v² - (1 - e²) q2 edge (2 alpha - edge), 0
    outside.  IMPACT: no zone; v -> e v at theta = 0, at rest until gain abs(u'') > q2 alpha.  EXACT: as IMPACT with
    theta'' = -q2 (sin(s alpha - theta) + u''/g cos(s alpha - theta)), s = sgn theta (q2 is p²), at rest until
    abs(u'') > g tan alpha.  `rigid`: rest="rigid" of ENTRY_SPEED and ENERGY.
    """

    label: str
    kind: int
    q2: float
    alpha: float
    edge: float
    zone: float
    c: float
    e: float
    gain: float
    rigid: bool


def problem(block: Block, law: Law) -> Problem:
    """Return the problem of `block` under `law`."""
    oscillator = law.oscillator(block)
    q2 = -oscillator.regions[0].stiffness
    rigid = getattr(law, "rest", "elastic") == "rigid"
    if isinstance(law, HousnerImpact):
        kind = EXACT if law.geometry == "exact" else IMPACT
        return Problem(law.label, kind, q2, block.alpha, 0.0, 0.0, 0.0, oscillator.e, oscillator.gain, True)
    zone = oscillator.regions[1]
    kind = VISCOUS
    if isinstance(law, DiscreteDamping):
        kind = ENTRY_SPEED
    elif isinstance(law, EnergyConsistent):
        kind = ENERGY
    return Problem(
        law.label, kind, q2, block.alpha, zone.upper, zone.stiffness, zone.damping, oscillator.e, oscillator.gain, rigid
    )


def record() -> Array:
    """Return the record, m/s², peak 1 g: filtered noise (omega_g = 15 rad/s, xi_g = 0.6, high-pass), 20 s, 0.005 s."""
    scaled = scale_to(SHAKING.sample(1, seed=5), STANDARD_GRAVITY)
    return np.ascontiguousarray(scaled.values[0, : round(DURATION / DT) + 1])


def typical() -> list[Block]:
    """Return the blocks of a typical study: five slendernesses by five sizes."""
    return [
        Block.from_slenderness(alpha, R) for alpha in (0.16, 0.20, 0.24, 0.28, 0.32) for R in (0.38, 0.8, 1.5, 2.5, 4.0)
    ]


CASES: dict[str, tuple[list[Block], Array]] = {
    "K": ([HARD], np.linspace(0.05, 0.45, 1024)),
    "B": (typical(), np.linspace(0.05, 0.44, 40)),
}
"""Blocks and scale factors of the cost measurements: hard rocking, and a typical study."""
