"""The figure of docs/theory/sliding.md: the chance that a block slides instead of rocking, `make sliding-map`."""

from __future__ import annotations

from pathlib import Path

import toppling as tp

HERE = Path(__file__).resolve().parent
ITEMS = ("bookcase-5-shelf", "file-vertical-4-drawer", "file-vertical-2-drawer")


def main() -> None:
    """Write the figure."""
    drawn = tp.plot.sliding([tp.catalogue[name] for name in ITEMS])
    drawn.figure.savefig(HERE / "theory" / "sliding_map.png", dpi=130, metadata={"Software": None})


if __name__ == "__main__":
    main()
