"""Energy that a law takes from free rocking, as the restitution of the impact that would take the same."""

from __future__ import annotations

import math

import numpy as np

from ..core import checks
from .block import Block
from .laws import Law, oscillator_of
from .oscillator import Oscillator
from .runs import trace

LONGEST = 1000.0
"""Length of the run in which the next turning point is sought, times 1/p."""
STEP = 0.01
"""Its step, times 1/p; events are found exactly within each."""


def apparent_restitution(block: Block, model: Law, rotation: float) -> float:
    """Return the square root of the share of energy that half a cycle of free rocking keeps.

    An impact with this coefficient of restitution would take as much.  Of a block on a soft bed it depends on the
    amplitude, and `e` of the law is its nominal value only.

    Parameters
    ----------
    block : Block
    model : law
        A law under which the block rests in an elastic zone, that of a soft bed or of delta.
    rotation : float
        Rotation from which the block is released, rad, 0 < |rotation| < that at which it falls.

    Returns
    -------
    float
        sqrt(U(theta_1)/U(theta_0)) with the potential energy U above that at rest, at the release and at the next
        turning point; 0 where the damping is so strong that there is none.

    Raises
    ------
    TypeError, ValueError
        Arguments of other types, a law with rigid rest, a rotation out of range, or one from which the block falls.

    Examples
    --------
    >>> from .laws import EnergyConsistent
    >>> from .scenes.bed import Bed
    >>> cabinet = Block(0.4, 1.8, bed=Bed(0.002))
    >>> round(apparent_restitution(cabinet, EnergyConsistent(e=0.9, rest="soft"), 0.1), 6)
    0.9
    """
    oscillator = oscillator_of(block, model)
    if oscillator.start < 0:
        raise ValueError(f"model must rest in an elastic zone, got {model.label!r} for {block.label!r}")
    theta = checks.number("rotation", rotation, above=-block.alpha, below=block.alpha, unit="rad")
    if theta == oscillator.balance:
        raise ValueError(f"rotation must be other than that at rest, {theta:g} rad")
    quiet = np.zeros(round(LONGEST / STEP) + 1)
    run = trace(oscillator, quiet, STEP / block.p, theta, max_turning_points=1)
    if run.results[0]:
        raise ValueError(f"{block.label!r} falls from a rotation of {theta:.4g} rad")
    if run.turning_points.shape[1] == 0:
        return 0.0
    kept = _energy(oscillator, float(run.turning_points[1, 0])) / _energy(oscillator, theta)
    return math.sqrt(max(0.0, kept))


def _energy(oscillator: Oscillator, theta: float) -> float:
    """Return the potential energy at a rotation above that at rest."""

    def potential(at: float) -> float:
        region = oscillator.regions[oscillator.region_at(at, 0.0)]
        return region.inertia * ((0.5 * region.stiffness * at - region.offset) * at + region.potential)

    return potential(theta) - potential(oscillator.balance)
