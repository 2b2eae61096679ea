"""The figure of docs/theory/sliding.md: the chance that a block slides instead of rocking."""

from __future__ import annotations

import toppling as tp

from .page import save

ITEMS = ("bookcase-5-shelf", "file-vertical-4-drawer", "file-vertical-2-drawer")


def main() -> None:
    """Write the figure."""
    panel = tp.plot.sliding([tp.catalogue[name] for name in ITEMS])
    figure = panel.get_figure(root=True)
    assert figure is not None
    save("theory", {"sliding_map": figure}, 130, metadata={"Software": None})
