"""
A fragility curve
=================

How likely is a five-shelf bookcase to overturn, given the peak velocity of its floor?
"""

import numpy as np
from matplotlib import pyplot as plt

import toppling as tp
from toppling.fragility import curve_probability

shaking = tp.motions.SiteBasedScenario(magnitude=7.0, distance=20e3, vs30=760.0, dt=0.01).sample(100, seed=1)
levels = np.geomspace(0.15, 1.2, 11)
runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shaking, levels, im="pgv")
share = tp.overturning_probability(runs).isel(block=0, model=0)
curve = tp.fit_fragility(runs)

x = np.linspace(0.01, 1.3, 200)
figure, ax = plt.subplots(figsize=(5.2, 4), layout="constrained")
ends = np.abs(np.stack([share["lower"], share["upper"]]) - share["probability"].values)
ax.errorbar(levels, share["probability"], ends, fmt="o", ms=4, capsize=2, label="100 motions, 95 % interval")
ax.plot(x, curve_probability(curve, x).squeeze(), label="lognormal, maximum likelihood")
ax.set(xlabel="peak floor velocity (m/s)", ylabel="probability of overturning", ylim=(0, 1))
ax.legend()
plt.show()
