"""
A fragility curve
=================

How likely is a five-shelf bookcase to overturn, given the peak acceleration of its floor?
"""

import numpy as np
from matplotlib import pyplot as plt

import toppling as tp
from toppling.fragility import curve_probability
from toppling.units import STANDARD_GRAVITY

shaking = tp.motions.CloughPenzien(duration=20, dt=0.01).sample(100, seed=1)
levels = np.linspace(0.1, 0.6, 11) * STANDARD_GRAVITY
runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shaking, levels)
share = tp.overturning_probability(runs).isel(block=0, model=0)
curve = tp.fit_fragility(runs)

x = np.linspace(0.02, 0.7, 200)
figure, ax = plt.subplots(figsize=(5.2, 4), layout="constrained")
ends = np.abs(np.stack([share["lower"], share["upper"]]) - share["probability"].values)
ax.errorbar(
    levels / STANDARD_GRAVITY, share["probability"], ends, fmt="o", ms=4, capsize=2, label="100 motions, 95 % interval"
)
ax.plot(x, curve_probability(curve, x * STANDARD_GRAVITY).squeeze(), label="lognormal, maximum likelihood")
ax.set(xlabel="peak floor acceleration (g)", ylabel="probability of overturning", ylim=(0, 1))
ax.legend()
plt.show()
