"""Figures of example studies: the studies are run, and their figures kept in docs/examples."""

from __future__ import annotations

import shutil

from ...studies.command.cli import main as toppling
from .page import RESULTS, example, folder

FIGURES = {
    "branches": ("branches",),
    "uncertainty": ("sobol",),
}
"""Figures of each study that pages show."""


def main() -> None:
    """Run the examples and copy their figures."""
    for name, figures in FIGURES.items():
        code = toppling(["run", str(example(name)), "--out", str(RESULTS / name)])
        if code:
            raise SystemExit(code)
        for figure in figures:
            shutil.copyfile(RESULTS / name / f"{figure}.png", folder("examples") / f"{name}_{figure}.png")
