"""The table of a study file that describes a damping law: ``[[models]]``."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import TypeAdapter

from ...core.parameters import SHARE, declared
from ...models import LAWS, Block, Law, delta_from_frequency, delta_from_settlement
from ...models.scenes.bed import SETTLEMENT
from ...models.supports import FREQUENCY
from .derived import Derived, choice, derived
from .table import KeyInfo, as_written

SUPPORT = ("settlement_mm", "rocking_frequency_hz", "body_frequency_hz")
"""Keys of a soft support."""
ALIKE = 1e-9
"""Relative difference of delta below which blocks have the same."""


class ModelTable(Derived):
    """One damping law and its options.

    law: Short name of the damping law.
    """

    law: str

    def build(self, blocks: Sequence[Block] = ()) -> Law:
        """Make the law; ValueError if options do not go together."""
        law: Law = type(self).makes(**self.options())
        return law


class SupportedModelTable(ModelTable):
    """One damping law whose elastic zone may be a soft support, and its options.

    settlement_mm: Instead of delta and rest: settlement d0 of two soft feet under the block's weight, mm, at
        most a tenth of its half width b. Then δ = d0/(bα), at most 0.3 and the same for all blocks. Not for
        inventories.
    rocking_frequency_hz: Instead of delta and rest: measured frequency of rocking on a soft support before
        uplift, Hz.
    body_frequency_hz: With it: frequency of the body on a rigid base, Hz.
    """

    settlement_mm: Annotated[float, as_written(SETTLEMENT)] | None = None
    rocking_frequency_hz: Annotated[float, FREQUENCY] | None = None
    body_frequency_hz: Annotated[Annotated[float, FREQUENCY] | None, KeyInfo("a rigid body")] = None

    def build(self, blocks: Sequence[Block] = ()) -> Law:
        """Make the law; ValueError for a wrong option. Soft supports of `blocks` give delta if it is not given."""
        support = [name for name in SUPPORT if getattr(self, name) is not None]
        soft = {"delta": self._soft_delta(support, blocks), "rest": "soft"} if support else {}
        law: Law = type(self).makes(**{**self.options(), **soft})
        return law

    def _soft_delta(self, support: list[str], blocks: Sequence[Block]) -> float:
        """Return delta of the study's blocks on their soft support; ValueError if they have no common one."""
        if both := self.options().keys() & {"delta", "rest"}:
            raise ValueError(f"{support[0]} gives delta and rest = 'soft', got {min(both)} as well")
        if support == ["body_frequency_hz"]:
            raise ValueError("body_frequency_hz needs rocking_frequency_hz")
        if self.settlement_mm is not None and len(support) > 1:
            raise ValueError(f"a soft support is given by settlement_mm or by frequencies, got {' and '.join(support)}")
        if not blocks:
            raise ValueError(f"{support[0]} needs blocks of given sizes: give delta and rest = 'soft' here")
        deltas = [self._delta_of(block) for block in blocks]
        low, high = min(deltas), max(deltas)
        if not math.isclose(low, high, rel_tol=ALIKE):
            raise ValueError(
                f"{support[0]} gives the blocks different delta, from {low:.4g} to {high:.4g}: give each a study"
            )
        return deltas[0]

    def _delta_of(self, block: Block) -> float:
        try:
            if self.settlement_mm is not None:
                return delta_from_settlement(block, 1e-3 * self.settlement_mm)
            assert self.rocking_frequency_hz is not None
            return delta_from_frequency(block, self.rocking_frequency_hz, self.body_frequency_hz)
        except ValueError as error:
            raise ValueError(f"{block.label!r}: {error}") from None


ZETA = Annotated[float, SHARE]
TABLES = {
    word: derived(
        law, SupportedModelTable if "rest" in declared(law) else ModelTable, word=("law", word), types={"zeta": ZETA}
    )
    for word, law in LAWS.items()
}
if TYPE_CHECKING:
    Models = ModelTable
else:
    Models = choice("law", TABLES)
model_table: Callable[[Any], ModelTable] = TypeAdapter(Models, config={"defer_build": True}).validate_python
"""Function that returns the table of a law of some content; pydantic's ValidationError if it is not valid."""
