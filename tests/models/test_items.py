"""The catalogue: every item as a free block, and as it is usually placed."""

import pytest

import toppling as tp
from toppling.models.scenes.wall import Wall

CATALOGUE = tp.catalogue


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_free_by_default_and_placed_where_asked(name):
    """The placed block is the free one with a wall, under another name; sideways tippers stand free."""
    item, free = CATALOGUE.item(name), CATALOGUE[name]
    assert free.wall is None
    assert free.restraint is None
    placed = CATALOGUE.placed(name)
    assert (placed.width, placed.height, placed.restraint) == (free.width, free.height, None)
    assert item.placement.startswith("free: " if item.wall_gap is None else "back to ")
    assert item.placement.endswith("(assumed)")
    if item.wall_gap is None:
        assert placed is free
    else:
        assert placed.wall == Wall(item.wall_gap)
        assert 0.0 <= item.wall_gap <= 0.1
        assert placed.label.startswith(f"{name}, back to")


def test_an_item_that_stands_back_to_a_wall_is_no_wider_than_its_breadth():
    """A block tips in its narrower direction: the wall is behind it only if that is its depth."""
    for name in CATALOGUE:
        item = CATALOGUE.item(name)
        if item.wall_gap is not None and item.breadth is not None:
            assert item.block.width < item.breadth


def test_no_such_item():
    with pytest.raises(KeyError, match="nearest: bookcase-5-shelf"):
        CATALOGUE.placed("bookcase-5-shelve")
