"""Blocks as columns: the properties of each are those of a `Block`, and what no block is has one sentence."""

import math

import numpy as np

from toppling.models import Block, BlockArray

BLOCKS = [
    Block(0.4, 1.8),
    Block(0.5, 1.6, cm_height=0.6, inertia_factor=1.4, name="server rack"),
    Block.from_slenderness(0.2, 1.1, name="pedestal"),
]


def test_properties_are_those_of_the_blocks():
    columns = BlockArray.of(BLOCKS)
    assert len(columns) == 3
    assert columns.names.tolist() == [one.label for one in BLOCKS]
    for name in ("width", "height", "alpha", "R", "p", "inertia"):
        np.testing.assert_allclose(getattr(columns, name), [getattr(one, name) for one in BLOCKS], rtol=1e-15)
    assert columns.cm_height.tolist() == [one.h for one in BLOCKS]
    assert BlockArray.of(columns) is columns
    assert BlockArray.of(BLOCKS[0]).width.tolist() == [0.4]


def test_what_is_not_given_is_usual():
    columns = BlockArray([0.4, 0.5], [1.8, 1.6], [math.nan, 0.6], [math.nan, 1.4])
    assert columns.cm_height.tolist() == [0.9, 0.6]
    assert columns.inertia.tolist() == [4 / 3, 1.4]
    assert columns.names.tolist() == ["block 1", "block 2"]


def test_refused(refusal):
    refusal()
