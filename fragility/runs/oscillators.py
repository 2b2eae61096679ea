"""Oscillators that are made when they are read, so that a million blocks need no table of numbers each."""

import operator
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, SupportsIndex, TypeVar, overload

from ...models.runs import Specimen

Row = TypeVar("Row")


class OscillatorGrid(Sequence[Specimen], Generic[Row]):
    """Oscillators block by block, made by a function of the block whenever they are read.

    `oscillators_of` makes the `per_block` oscillators of a block, whose kinds (`Oscillator.exact`) depend on their
    positions alone.
    """

    def __init__(
        self, blocks: Sequence[Row], oscillators_of: Callable[[Row], Sequence[Specimen]], per_block: int
    ) -> None:
        self._blocks, self._oscillators_of, self._per_block = blocks, oscillators_of, per_block
        # chunks of the same oscillators follow each other, one for each part of the motions
        self._last: tuple[tuple[int, int], tuple[Specimen, ...]] = ((0, 0), ())

    def __len__(self) -> int:
        return len(self._blocks) * self._per_block

    def __iter__(self) -> Iterator[Specimen]:
        for block in self._blocks:
            yield from self._oscillators_of(block)

    @overload
    def __getitem__(self, at: SupportsIndex) -> Specimen: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Specimen, ...]: ...

    def __getitem__(self, at: SupportsIndex | slice) -> Specimen | tuple[Specimen, ...]:
        if not isinstance(at, slice):
            row = range(len(self))[operator.index(at)]
            return self._oscillators_of(self._blocks[row // self._per_block])[row % self._per_block]
        rows = range(len(self))[at]
        if rows.step != 1:
            return tuple(self[row] for row in rows)
        if not rows:
            return ()
        bounds, specimens = self._last
        if bounds != (rows.start, rows.stop):
            first, last = rows.start // self._per_block, -(-rows.stop // self._per_block)
            near = [specimen for block in self._blocks[first:last] for specimen in self._oscillators_of(block)]
            specimens = tuple(near[rows.start - first * self._per_block : rows.stop - first * self._per_block])
            self._last = (rows.start, rows.stop), specimens
        return specimens

    @property
    def first(self) -> tuple[Specimen, ...]:
        """The oscillators of the first block."""
        return self[: self._per_block]
