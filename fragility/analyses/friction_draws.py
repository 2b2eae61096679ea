"""Friction drawn for every run: coefficients, and their slips from runs with friction 1."""

from collections.abc import Iterable, Sequence

import numpy as np

from ...core.aliases import Array, Index
from ...core.streams import stream
from ...models import Block, Model, RandomSliding
from ...models.runs import Specimen
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import Record
from ..runs.request import Request, specimen_of

DRAWS = (0, 4)
"""Key, under a seed and before the number of a motion, of the random number that its coefficients are drawn from."""
FRICTION = "friction"
"""Variable of the coefficient of a run."""
PROPORTIONAL = frozenset(
    ("slide_peak", "slide_forward", "slide_backward", "slide_residual", "slide_path", "slide_velocity", "slide_after")
)
"""Outputs of a run that are those with friction 1, times the coefficient."""


def is_random(models: Iterable[Model]) -> bool:
    """Return True if a law draws its friction."""
    return any(isinstance(model, RandomSliding) for model in models)


def specimens_in(request: Request, plane: bool) -> Sequence[Specimen]:
    """Return the specimens of a request, curve by curve: of random friction, those with friction 1.

    `plane`: True if both horizontal components act on sliding blocks.
    """
    if not is_random(request.models):
        return request.specimens(plane=plane)

    def numbers(law: Model, block: Block) -> Specimen:
        if isinstance(law, RandomSliding):
            return law.of_unit_in_plane if plane else law.of_unit
        return specimen_of(block, law, plane)

    return [numbers(law, block) for block in request.blocks for law in request.models]


def draws(law: SlidingLaw, block: Block, seed: int, motions: Index, runs: int) -> Array:
    """Return the coefficients (run, motion) of the runs of a block under motions of these numbers (motion,).

    Random coefficients of one motion are equally spaced in probability, from a random start. Each is a draw from the
    distribution at any level, and a motion's runs have small and large coefficients.
    """
    begin = np.array([stream(seed, *DRAWS, motion).random() for motion in motions.tolist()])
    share = (begin + np.arange(runs)[:, None] / runs) % 1.0
    return law.coefficients(block, share)


def check_draws(models: Iterable[Model], blocks: Iterable[Block], motions: Iterable[Record]) -> None:
    """Raise a ValueError for blocks that do not slide under a random friction, and for a vertical component.

    A vertical component changes the friction force, so that slips are not proportional to the coefficient.
    """
    laws = [model for model in models if isinstance(model, RandomSliding)]
    if not laws:
        return
    lifted = next((motion.label for motion in motions if motion.vertical is not None), None)
    if lifted is not None:
        raise ValueError(
            f"random friction at adaptive levels needs motions without a vertical component, and {lifted!r} has one"
        )
    for law in laws:
        for block in blocks:
            law.coefficients(block, np.array([0.5]))
