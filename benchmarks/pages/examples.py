"""Figures of example studies: the studies are run, and their figures kept in docs/examples; docs/office.png."""

from __future__ import annotations

import shutil
from contextlib import nullcontext

from ...studies.command.cli import main as toppling
from ...studies.plots.axes import on_a_phone
from ...studies.show import figures, save_figures
from .page import OUT, RESULTS, example, folder, results

FIGURES = {
    "branches": ("branches",),
    "uncertainty": ("sobol",),
}
"""Figures of each study that pages show."""


def main() -> None:
    """Run the examples and copy their figures."""
    for name, shown in FIGURES.items():
        code = toppling(["run", str(example(name)), "--out", str(RESULTS / name)])
        if code:
            raise SystemExit(code)
        for figure in shown:
            shutil.copyfile(RESULTS / name / f"{figure}.png", folder("examples") / f"{name}_{figure}.png")
    first_page()


def first_page() -> None:
    """Draw the curves of the first page, for wide and for narrow screens."""
    office = results("office")
    for name, around in (("office", nullcontext()), ("office_phone", on_a_phone())):
        with around:
            save_figures([(name, dict(figures(office))["fragility"])], OUT)
