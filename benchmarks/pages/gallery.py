"""The figures of docs/motions.md, the gallery of motions: each of the `shaking` that the code of its section makes."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from ...core.units import STANDARD_GRAVITY
from ...motions.arrays import records
from ...motions.intensity.cumulative import husid
from ...motions.intensity.peaks import velocity
from ...studies.plots.axes import colour
from ...studies.single.motions import draw_spectra
from .page import ROOT, folder

SAMPLES = 3  # histories in a figure


def sections() -> dict[str, str]:
    """Return the code of each section of the page by its name."""
    text = (ROOT / "docs/motions.md").read_text(encoding="utf-8")
    return dict(re.findall(r"(?ms)^## (\S+)\n.*?^```python\n(.*?)^```", text))


def shaking_of(code: str) -> xr.DataArray:
    """Return the motions that a section's code makes."""
    made: dict[str, Any] = {}
    exec(code, made)
    shaking: xr.DataArray = made["shaking"]
    return shaking


def draw(shaking: xr.DataArray) -> Figure:
    """Draw three histories of acceleration and of velocity, and the spectra of all, one under the other."""
    figure = Figure(figsize=(4.6, 6.4), layout="constrained")
    above, middle, below = figure.subplots(3, 1, height_ratios=(1.0, 1.0, 1.35))
    shown = records(shaking)[:SAMPLES]
    histories = [record.acceleration / STANDARD_GRAVITY for record in shown]
    velocities = [velocity(record.acceleration, record.dt) for record in shown]
    # histories without their long quiet ends
    strong = [husid(record.acceleration, record.dt).searchsorted(0.999) * record.dt for record in shown]
    end = min(1.15 * max(strong), max(record.duration for record in shown))
    several = len(shown) > 1
    for ax, values, name in ((above, histories, "acceleration (g)"), (middle, velocities, "velocity (m/s)")):
        step = 1.6 * max(float(np.abs(history).max()) for history in values) if several else 0.0
        for i, (record, history) in enumerate(zip(shown, values, strict=True)):
            time = np.arange(history.size) * record.dt
            ax.plot(time, history - i * step, lw=0.6 if several else 1.6, color=colour(i))
            if several:
                ax.axhline(-i * step, lw=0.4, color="0.5", zorder=0)
            if several and record.floor and ax is above:
                text = "ground" if record.floor == "0" else f"floor {record.floor}"
                ax.text(end, -i * step + 0.3 * step, text, ha="right", fontsize=9, color=colour(i))
        if several:  # one under the other: a bar says how large
            size = _round(step)
            ax.set_yticks([0.0, size], ["0", f"{size:g}"])
        ax.set_title(name, fontsize=10, loc="left")
        ax.set_xlim(0.0, end)
        ax.spines[["top", "right"]].set_visible(False)
    middle.set_xlabel("time (s)")
    draw_spectra(below, [shaking])
    if shaking.sizes["motion"] == 1:  # the section says which
        below.get_legend().remove()
    return figure


def _round(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value) * power)


def main() -> None:
    """Write the figures."""
    for name, code in sections().items():
        picture = io.BytesIO()
        draw(shaking_of(code)).savefig(picture, dpi=120)
        # 64 colours are plenty for lines, and a third of the size
        Image.open(picture).convert("RGB").quantize(64).save(folder("motions") / f"{name}.png", optimize=True)
