"""The figure of docs/theory/sliding.md: the chance that a block slides instead of rocking."""

from __future__ import annotations

import toppling as tp

from .page import save

ITEMS = ("bookcase-5-shelf", "file-vertical-4-drawer", "file-vertical-2-drawer")


def main() -> None:
    """Write the figure."""
    drawn = tp.plot.sliding([tp.catalogue[name] for name in ITEMS])
    save("theory", {"sliding_map": drawn.figure}, 130, metadata={"Software": None})
