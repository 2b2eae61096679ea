"""Oscillators that are made when they are wanted: a million blocks hold no table of numbers each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import overload

from ..models import Block
from ..models.oscillator import Oscillator


class Made(Sequence[Oscillator]):
    """Block by block the oscillators that `of` makes of each, `each` of them, anew whenever they are read."""

    def __init__(self, blocks: Sequence[Block], of: Callable[[Block], Sequence[Oscillator]], each: int) -> None:
        self._blocks, self._of, self._each = blocks, of, each

    def __len__(self) -> int:
        return len(self._blocks) * self._each

    def __iter__(self) -> Iterator[Oscillator]:
        for block in self._blocks:
            yield from self._of(block)

    @overload
    def __getitem__(self, at: int) -> Oscillator: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Oscillator, ...]: ...

    def __getitem__(self, at: int | slice) -> Oscillator | tuple[Oscillator, ...]:
        if isinstance(at, int):
            row = range(len(self))[at]
            return self._of(self._blocks[row // self._each])[row % self._each]
        start, stop, step = at.indices(len(self))
        first = start // self._each
        last = -(-stop // self._each)
        near = [one for block in self._blocks[first:last] for one in self._of(block)]
        here = slice(start - first * self._each, max(stop, start) - first * self._each, step)
        return tuple(near[here])
