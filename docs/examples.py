"""The figures of docs/decisions.md: every example study is run, and its figures kept in docs/examples.

`make examples` runs it; finished results in results/ are kept.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from toppling.studies.command.cli import main as toppling

HERE = Path(__file__).parent
STUDIES = HERE.parent / "studies/examples"
FIGURES = {
    "stripes": ("fragility",),
    "cloud": ("fragility",),
    "risk": ("risk", "measures_2"),
    "uncertainty": ("uncertainty", "sobol"),
    "clinic": ("number", "exceedance", "anchoring"),
    "tower": ("fragility",),
    "isolated": ("fragility",),
    "branches": ("branches",),
    "clinic_branches": ("branches",),
}
"""What is shown of each study."""


def main(out: Path = HERE / "examples", results: Path = HERE.parent / "results") -> int:
    """Run the examples and copy their figures into `out`; the exit code of the first that fails."""
    out.mkdir(exist_ok=True)
    for name, figures in FIGURES.items():
        code = toppling(["run", str(STUDIES / f"{name}.toml"), "--out", str(results / name)])
        if code:
            return code
        for figure in figures:
            shutil.copyfile(results / name / f"{figure}.png", out / f"{name}_{figure}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(*(Path(one) for one in sys.argv[1:])))
