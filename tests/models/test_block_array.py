"""Blocks as columns: the properties of each are those of a `Block`, and what no block is has one sentence."""

import math

import numpy as np
import pytest

from toppling.models import Bed, Block, BlockArray, Restraint, Wall

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


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([0.4], [1.8, 1.6]), "height must have 1 entries, as width has, got 2"),
        (([0.4, -0.1], [1.8, 1.6]), "width must be > 0 .*, got -0.1 of block 2"),
        (([0.4, 0.5], [1.8, math.nan]), "height must be finite, got nan of block 2"),
        (([0.4], [math.inf]), "height must be finite, got inf of block 1"),
        (([1e7], [1.8]), "width must be .* <= 1e[+]06 .*, got 1e[+]07 of block 1"),
        (([0.4], [1.8], [2.0]), "cm_height must be above 0 and below the height, got 2 of block 1"),
        (([0.4], [1.8], [0.7]), "inertia_factor must be given where cm_height is not mid-height, got 0.7 of block 1"),
        (([0.4], [1.8], None, [2.5]), "inertia_factor must be > 1 and <= 2, got 2.5 of block 1"),
        (([1e-6], [1e4]), "slenderness angle must be inside"),
        (([0.4, 0.4], [1.8, 1.8], None, None, ["a", "a"]), "names must be unique, got 'a' more than once"),
        (([0.4, 0.4], [1.8, 1.8], None, None, ["a"]), "names must be one for each of the 2 blocks"),
        (([[0.4]], [[1.8]]), "width must be a column of at least one block"),
        (([], []), "width must be a column of at least one block"),
    ],
)
def test_what_no_block_is_has_one_sentence(arguments, text):
    with pytest.raises(ValueError, match=text):
        BlockArray(*arguments)


def test_the_offending_block_is_named():
    with pytest.raises(ValueError, match="got 3 of 'b'"):
        BlockArray([0.4, 0.4], [1.8, 1.8], None, [1.4, 3.0], ["a", "b"])
    with pytest.raises(TypeError, match="width must be real numbers"):
        BlockArray(["wide"], [1.8])


@pytest.mark.parametrize(
    "block",
    [
        Block(0.4, 1.8, wall=Wall(0.01)),
        Block(0.4, 1.8, bed=Bed(0.001)),
        Block(0.4, 1.8, cm_offset=0.05),
        Block(0.4, 1.8, lean=0.01),
        Block(0.4, 1.8, mass=50.0, restraint=Restraint.strap(1.7, 600.0, 2e4)),
    ],
)
def test_blocks_that_do_not_stand_free_are_refused(block):
    with pytest.raises(ValueError, match="does not stand free on a rigid floor"):
        BlockArray.of([BLOCKS[0], block])
    with pytest.raises(TypeError, match="blocks must be Blocks or a BlockArray, got"):
        BlockArray.of([0.4])
    with pytest.raises(TypeError, match="blocks must be Blocks or a BlockArray, got"):
        BlockArray.of(3)
