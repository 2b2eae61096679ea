"""
What each law takes out
=======================

Total moment against rotation, of the same block let go at half its slenderness.  The rigid block loses energy in an
instant, the discrete law in its zone, viscous damping all the way.
"""

import numpy as np
from matplotlib import pyplot as plt

import toppling as tp

block = tp.Block.from_slenderness(alpha=np.arctan(0.2), R=0.38)
laws = [
    tp.HousnerImpact(e=0.925, geometry="bilinear"),
    tp.EnergyConsistent(e=0.925),
    tp.DiscreteDamping(e=0.925),
    tp.GianniniMasiani(e=0.925),
    tp.MakrisKonstantinidis(e=0.925),
    tp.Vassiliou(),
]

figure, axes = plt.subplots(3, 2, figsize=(5.2, 6.5), sharex=True, sharey=True, layout="constrained")
for ax, law in zip(axes.flat, laws, strict=True):
    run = tp.free_rocking(block, law, 0.5 * block.alpha, duration=3.0, dt=2e-4)
    moment = (run["restoring_moment"] + run["damping_moment"]) / (block.p**2 * np.sin(block.alpha))
    ax.plot(run["rotation"] / block.alpha, moment, lw=0.8)
    ax.set_title(law.law, fontsize="medium")
    ax.axvline(0, lw=0.5, color="0.6")
    ax.axhline(0, lw=0.5, color="0.6")
figure.supxlabel("rotation over slenderness, θ/α")
figure.supylabel("moment over m g R sin α")
plt.show()
