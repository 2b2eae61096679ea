"""
A block under a pulse
=====================

One cycle of a sine of three strengths: the block rocks and stands, falls after coming back, falls at once to the other
side.  Frames of the block, and its rotation.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Polygon

import toppling as tp

block = tp.Block(width=0.40, height=1.80)
pulse = tp.motions.OneCycleSine(amplitude=1.0, omega=6.0, dt=0.002, tail=2.0).sample()
frames = np.linspace(0.2, 2.2, 6)


def outline(rotation):
    """Corners of the block turned about the corner on which it stands."""
    corners = np.array([[-block.b, 0.0], [block.b, 0.0], [block.b, block.height], [-block.b, block.height]])
    pivot = np.array([block.b if rotation > 0 else -block.b, 0.0])
    c, s = np.cos(rotation), np.sin(rotation)
    return (corners - pivot) @ np.array([[c, -s], [s, c]]) + pivot


runs = {peak: tp.simulate(block, tp.HousnerImpact(), peak * pulse) for peak in (2.6, 3.5, 6.0)}  # m/s²

figure, axes = plt.subplots(4, 6, figsize=(5.2, 5.4), layout="constrained", height_ratios=(1, 1, 1, 2))
for row, (peak, run) in zip(axes, runs.items(), strict=False):
    for ax, time in zip(row, frames, strict=True):
        rotation = float(run["rotation"].interp(time=time))
        ax.add_patch(Polygon(outline(rotation), facecolor="tab:blue", edgecolor="k", alpha=0.6))
        ax.axhline(0, color="k", lw=1)
        ax.set(xlim=(-2.1, 2.1), ylim=(-0.3, 2.2), aspect="equal", xticks=[], yticks=[])
        ax.set_title(f"{time:.1f} s", fontsize="medium")
    row[0].set_ylabel(f"{peak:g} m/s²")
grid = axes[3, 0].get_gridspec()
for ax in axes[3]:
    ax.remove()
below = figure.add_subplot(grid[3, :])
for peak, run in runs.items():
    below.plot(run["time"], run["rotation"] / block.alpha, label=f"{peak:g} m/s²")
below.axhline(1, ls=":", color="0.5")
below.set(xlabel="time (s)", ylabel="θ/α", ylim=(-9, 9))
below.legend(loc="upper left")
plt.show()
