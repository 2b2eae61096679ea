"""The table of a study file that describes a damping law: ``[[models]]``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from ...models import LAWS, Block, Law, delta_from_frequency, delta_from_settlement
from ...models.laws import GEOMETRIES, LEVERS, RESTS
from .table import KeyInfo, Table, one_of

SUPPORT = ("settlement_mm", "rocking_frequency_hz", "body_frequency_hz")
"""Keys of a soft support."""
ALIKE = 1e-9
"""Relative difference of delta below which blocks have the same."""


class ModelTable(Table):
    """One damping law and its options."""

    law: Annotated[str, one_of(LAWS), Field(description="Short name of the damping law.")]
    e: Annotated[
        float | None,
        KeyInfo("the block's own, e_R = 1 - (2/λ) sin²α", above=0.0, at_most=1.0),
        Field(description="Restitution, above 0 to 1; not of `vassiliou` and `viscous`."),
    ] = None
    restitution_factor: Annotated[
        float | None, KeyInfo(1.0, above=0.0), Field(description="Factor on e_R where e is not given.")
    ] = None
    delta: Annotated[
        float | None,
        KeyInfo(0.05, above=0.0, below=1.0),
        Field(description="Half width of the elastic zone over α, 0 to 1; not of `housner`."),
    ] = None
    zeta: Annotated[
        float | None,
        KeyInfo(at_least=0.0),
        Field(le=1.0, description="Damping ratio of the viscous law, 0.05 for 5 %."),
    ] = None
    coefficient: Annotated[
        float | None, KeyInfo(0.02, at_least=0.0), Field(description="Coefficient of the law of Vassiliou et al.")
    ] = None
    lever: Annotated[str | None, one_of(LEVERS), KeyInfo("h"), Field(description="Lever arm of the shaking.")] = None
    rest: Annotated[
        str | None,
        one_of(RESTS),
        KeyInfo("elastic; rigid for `energy-consistent`"),
        Field(
            description="Kind of rest; `soft` is elastic on a support of measured softness, of `discrete` and "
            "`energy-consistent`."
        ),
    ] = None
    geometry: Annotated[str | None, one_of(GEOMETRIES), KeyInfo("exact"), Field(description="Housner's geometry.")] = (
        None
    )

    settlement_mm: Annotated[
        float | None,
        KeyInfo(above=0.0),
        Field(
            description="Instead of delta and rest: settlement d0 of two soft feet under the block's weight, mm, "
            "at most a tenth of its half width b. Then δ = d0/(bα), at most 0.3 and the same for all "
            "blocks. Not for inventories."
        ),
    ] = None
    rocking_frequency_hz: Annotated[
        float | None,
        KeyInfo(above=0.0),
        Field(
            description="Instead of delta and rest: measured frequency of rocking on a soft support before uplift, Hz."
        ),
    ] = None
    body_frequency_hz: Annotated[
        float | None,
        KeyInfo("a rigid body", above=0.0),
        Field(description="With it: frequency of the body on a rigid base, Hz."),
    ] = None

    def build(self, blocks: Sequence[Block] = ()) -> Law:
        """Make the law; ValueError for a wrong option. Soft supports of `blocks` give delta where it is not given."""
        given = self.model_dump(exclude={"law", *SUPPORT})
        options = {k: v for k, v in given.items() if v is not None}
        law = LAWS[self.law]
        support = [name for name in SUPPORT if getattr(self, name) is not None]
        if support:
            options |= {"delta": self._soft_delta(support, blocks), "rest": "soft"}
        known = set(law.__dataclass_fields__)  # type: ignore[attr-defined]
        foreign = sorted(set(options) - known)
        if foreign:
            raise ValueError(f"law {self.law!r} has no option {foreign[0]!r}, allowed are {', '.join(sorted(known))}")
        if self.law == "viscous" and self.zeta is None:
            raise ValueError("law 'viscous' needs zeta (its damping ratio)")
        return law(**options)

    def _soft_delta(self, support: list[str], blocks: Sequence[Block]) -> float:
        """Return delta of the study's blocks on their soft support; ValueError where they have no common one."""
        if "rest" not in LAWS[self.law].__dataclass_fields__:  # type: ignore[attr-defined]
            raise ValueError(f"{support[0]} belongs to the laws discrete and energy-consistent, got {self.law!r}")
        if self.delta is not None or self.rest is not None:
            both = "delta" if self.delta is not None else "rest"
            raise ValueError(f"{support[0]} gives delta and rest = 'soft', got {both} as well")
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
