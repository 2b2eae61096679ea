"""Catalogue of real contents of buildings: outer sizes, their sources and the quality of the sources."""

import csv
import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from importlib import resources

from .block import Block
from .scenes.wall import Wall

QUALITIES = {
    "A": "read in a published database, standard, paper or the maker's own data sheet",
    "B": "a maker's or paper's figure, recalled or seen second-hand",
    "C": "typical value, assumed",
}


@dataclass(frozen=True)
class Item:
    """Catalogue entry: the block, which tips in the direction of its smaller plan size, and the source of its sizes.

    `breadth` is the other plan size, m, if known (the block's depth). `fema_p58` is the FEMA P-58 fragility id, if it
    has one. `wall_gap` is the clear distance to a wall behind the item in its usual place, m, None if it is free in the
    direction in which it tips. `placement` gives the reason, with a source or as an assumption. `quality` (of the
    sizes) is a letter of `QUALITIES`.
    """

    block: Block
    title: str
    category: str
    breadth: float | None
    fema_p58: str | None
    wall_gap: float | None
    placement: str
    quality: str
    source: str

    @property
    def placed(self) -> Block:
        """The block in its usual place, unfixed: back to a wall, or the free block if it is usually free.

        A block with a wall is named for it: ``bookcase-5-shelf, back to a wall``.
        """
        if self.wall_gap is None:
            return self.block
        return replace(self.block, name=f"{self.block.name}, back to a wall", wall=Wall(self.wall_gap))


class Catalogue(Mapping[str, Block]):
    """Blocks of real contents by name; `item(name)` gives title, category, source and quality as well.

    The sizes are outer sizes, and the block is assumed to be uniform (mass centre at mid-height, inertia factor 4/3).
    If the real object is not uniform, make a `Block` from its sizes. ``catalogue[name]`` is free-standing.
    `placed(name)` is the same block in its usual place, with its back to a wall if such pieces have one.

    Examples
    --------
    >>> round(catalogue["bookcase-5-shelf"].height, 4)
    1.8034
    >>> catalogue.placed("bookcase-5-shelf").wall
    Wall(gap=0.02, height=None, restitution=None, front_gap=None)
    >>> catalogue.item("bookcase-5-shelf").fema_p58
    'E.20.22.105a'
    """

    def __init__(self, items: Mapping[str, Item]) -> None:
        self._items = dict(items)

    def item(self, name: str) -> Item:
        """Return the whole entry; KeyError with the nearest names if there is none."""
        try:
            return self._items[name]
        except KeyError:
            near = difflib.get_close_matches(str(name), self._items, n=3, cutoff=0.4)
            hint = f"; nearest: {', '.join(near)}" if near else ""
            raise KeyError(f"no catalogue item {str(name)[:60]!r}{hint}") from None

    def placed(self, name: str) -> Block:
        """Return an item's block as it is usually placed (`Item.placed`); KeyError with the nearest names."""
        return self.item(name).placed

    def __repr__(self) -> str:
        return f"<catalogue of {len(self)} contents: {', '.join(self)}>"

    def __getitem__(self, name: str) -> Block:
        return self.item(name).block

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)


def _load() -> Catalogue:
    items = {}
    text = resources.files(__package__).joinpath("catalogue.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        items[row["name"]] = Item(
            block=Block(
                float(row["width_m"]),
                float(row["height_m"]),
                name=row["name"],
                depth=float(row["breadth_m"]) if row["breadth_m"] else None,
            ),
            title=row["title"],
            category=row["category"],
            breadth=float(row["breadth_m"]) if row["breadth_m"] else None,
            fema_p58=row["fema_p58_id"] or None,
            wall_gap=float(row["wall_gap_m"]) if row["wall_gap_m"] else None,
            placement=row["placement"],
            quality=row["quality"],
            source=row["source"],
        )
    return Catalogue(items)


catalogue = _load()
