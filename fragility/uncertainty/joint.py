"""Joint overturning of many blocks under the same motions, with differences between pieces of one kind."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.aliases import Array, Index, Progress
from ...core.parameters import SHARE, Parameter, Seed, check
from ...core.streams import key_of, stream
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...motions.arrays import Record
from ..runs.request import Request, collect_about, runner_of, work_of
from ..runs.runners import Workers
from .distributions import Beta, Lognormal

INDEPENDENT, TOGETHER = "independent", "together"
PIECES = (INDEPENDENT, TOGETHER)
MOST_VARIANTS = 1000


class PieceDraws(Protocol):
    """Rules by which the pieces of a line are drawn from its equally probable variants; see `Variability`."""

    @property
    def pieces(self) -> str: ...
    @property
    def variants(self) -> int: ...
    @property
    def realisations(self) -> int: ...
    @property
    def seed(self) -> int: ...


def drawn_pieces(how: PieceDraws, label: str, count: int, motions: int) -> Index:
    """Return the number of pieces of a line of each variant (motion, realisation, variant), independent draws.

    Each realisation draws from its own stream, motion after motion, which the seed and the label determine. Other lines
    and further realisations or motions do not change it.
    """
    even = np.full(how.variants, 1.0 / how.variants)
    key = key_of(f"pieces of {label}")  # (consequences draw by the label itself)
    pieces, together = (count, 1) if how.pieces == INDEPENDENT else (1, count)
    drawn = [stream(how.seed, *key, r).multinomial(pieces, even, size=motions) for r in range(how.realisations)]
    return together * np.stack(drawn, axis=1)


@dataclass(frozen=True)
class Variability:
    """Variability of pieces of one line of an inventory.

    Parameters
    ----------
    restitution_sd : float
        Standard deviation of the restitution.
    slenderness_dispersion : float
        Dispersion of the slenderness.
    pieces : {"independent", "together"}
        Each its own draw, or one for all.
    variants : int
        Variants of each block that are run.
    realisations : int
        Fillings of the building under each motion.
    seed : int
        Seed of the draws.

    Notes
    -----
    The restitution has a beta distribution with its nominal value as mean. The slenderness angle has a lognormal one
    with its nominal value as median. The size R does not vary.

    FEMA P-58 has two kinds of performance group, whose components are all in one damage state or each in its own. Here
    the motion is common to all pieces in either case, and only the differences between pieces are drawn. Given the
    motion, each independent piece of a line falls with the same probability, the share of the variants that fall.
    Without variability that share is 0 or 1, so that pieces of a line fall together. The number overturned then has its
    maximum variance, while its mean is unbiased.

    Variants are a Latin hypercube sample, the same for every block, so that blocks are compared under the same draws.
    Every motion has its own fillings. With one filling for all motions, sums over motions would have the error of as
    many draws as realisations. With 60 motions that is three to four times the error of independent fillings.
    """

    restitution_sd: Annotated[float, Parameter(at_least=0.0, below=0.5)] = 0.0
    slenderness_dispersion: Annotated[float, SHARE] = 0.0
    pieces: Annotated[str, Parameter(words=PIECES)] = INDEPENDENT
    variants: Annotated[int, Parameter(at_least=2, at_most=MOST_VARIANTS)] = 16
    realisations: Annotated[int, Parameter(at_least=1, at_most=MOST_VARIANTS)] = 20
    seed: Seed = 0

    def __post_init__(self) -> None:
        check(self)
        if self.restitution_sd == 0.0 and self.slenderness_dispersion == 0.0:
            raise ValueError("variability needs restitution_sd or slenderness_dispersion > 0, got 0 for both")

    @property
    def plain(self) -> dict[str, Any]:
        """Every option by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def sample(self) -> Array:
        """Probabilities (variant, 2), for restitution and slenderness: each column has one value in every stratum."""
        n = self.variants
        columns = []
        for index in range(2):
            generator = stream(self.seed, index)
            columns.append((generator.permutation(n) + generator.random(n)) / n)
        return np.stack(columns, axis=1)


def oscillators_of_pieces(
    block: Block, model: Law, e: float | None = None, variability: Variability | None = None, across: bool = False
) -> list[Oscillator]:
    """Return the oscillator of a block under a law with its own restitution `e`, or its variants if pieces differ.

    `across`: in the direction of the depth of each (`Block.across`); a variant keeps the block's ratio of depth to
    width.
    """
    return [oscillator_of(*pair) for pair in pieces_of(block, model, e, variability, across)]


def pieces_of(
    block: Block, model: Law, e: float | None = None, variability: Variability | None = None, across: bool = False
) -> list[tuple[Block, Law]]:
    """Return the block and the law behind each of `oscillators_of_pieces`, with the same arguments and errors."""
    law_of_pieces = with_restitution(model, e)
    if variability is None:
        return [(block.across if across else block, law_of_pieces)]
    pairs = []
    for restitution, slenderness in variability.sample():
        angle = block.alpha
        if variability.slenderness_dispersion > 0.0:
            law_of_angle = Lognormal(block.alpha, variability.slenderness_dispersion)
            angle = float(law_of_angle.quantile(np.array(slenderness)))
        if angle >= 0.5 * math.pi:
            raise ValueError(
                f"slenderness_dispersion {variability.slenderness_dispersion:g} makes {block.label} a block of alpha = "
                f"{angle:.3g} rad, which must be below pi/2"
            )
        piece = block
        if variability.slenderness_dispersion > 0.0:
            sizes = Block.from_slenderness(angle, block.R, block.inertia)
            depth = None if block.depth is None else sizes.width * (block.depth / block.width)
            piece = replace(
                block, width=sizes.width, height=sizes.height, cm_height=None, name=block.label, depth=depth
            )
        if across:
            piece = piece.across
        mean = law_of_pieces.restitution(piece)
        law = law_of_pieces
        if mean is not None and variability.restitution_sd > 0.0:
            law = with_restitution(law_of_pieces, _beta(mean, variability.restitution_sd, restitution, block))
        pairs.append((piece, law))
    return pairs


def with_restitution(model: Law, e: float | None) -> Law:
    """Return the law with the restitution `e`, unchanged if `e` is None; ValueError if it has no restitution."""
    if e is None:
        return model
    names = {field.name for field in fields(model)}  # type: ignore[arg-type]
    if "e" not in names:
        raise ValueError(f"law {model.law!r} has no restitution, so a block cannot have its own, got e = {e:g}")
    changed: dict[str, Any] = {"e": e, **({"restitution_factor": 1.0} if "restitution_factor" in names else {})}
    return replace(model, **changed)  # type: ignore[type-var]


def _beta(mean: float, sd: float, probability: float, block: Block) -> float:
    """Quantile of the beta distribution with the given mean and standard deviation."""
    try:
        law = Beta.from_moments(mean, sd)
    except ValueError as error:
        raise ValueError(f"restitution_sd {sd:g} for {block.label}, whose restitution is {mean:.3g}: {error}") from None
    return float(law.quantile(np.array(probability)))


def outputs_of(
    names: Sequence[str],
    oscillators: Sequence[Oscillator],
    across: Sequence[Oscillator] | None,
    motions: Sequence[Record],
    factors: Array,
    client: Workers = None,
    progress: Progress | None = None,
) -> dict[str, NDArray[Any]]:
    """Return outputs (oscillator, level, motion) of pieces under motions times factors (1, level, motion), by name.

    `oscillators` and `across` are of the same pieces along their width and depth; motions along the width have the
    motions along the depth as companions. Bit-identical for any chunking and any number of workers.
    """
    request = Request([], [], [*names], True, runner_of(client), progress, screen=False)
    work = work_of(oscillators, motions, factors, request)
    return collect_about(work, across, request.runner, progress).results
