"""
Risk at a site
==============

How often a year does the bookcase fall, and from which shaking does that come?
"""

import numpy as np
from matplotlib import pyplot as plt

import toppling as tp
from toppling.fragility import curve_probability

levels = np.array([0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2])  # peak ground velocity, m/s (an invented site)
rates = np.array([2e-2, 7e-3, 2e-3, 4.5e-4, 7e-5, 7e-6, 6e-7])  # a year
hazard = tp.HazardCurve(levels, rates, "pgv")

shaking = tp.motions.SiteBasedScenario(magnitude=6.8, distance=15e3, vs30=400.0, dt=0.01).sample(60, seed=5)
runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.EnergyConsistent(), shaking, np.geomspace(0.1, 4, 14), im="pgv")
curve = tp.fit_fragility(runs, keep_replicates=True)
risk = tp.annual_rate(curve, hazard, years=50).squeeze()

x = np.geomspace(0.05, 3.2, 200)
probability = curve_probability(curve, x).squeeze()
frequency = -np.gradient(hazard.rate_at(x), np.log(x))
figure, (upper, lower) = plt.subplots(2, 1, figsize=(5.2, 6.4), layout="constrained")
upper.loglog(levels, rates, "o-", color="tab:gray", label="exceeded, 1/yr")
upper.set(xlabel="peak ground velocity (m/s)", ylabel="annual rate")
right = upper.twinx()
right.plot(x, probability, color="tab:red")
right.set_ylabel("probability of overturning", color="tab:red")
lower.semilogx(x, probability * frequency / float(risk["rate"]))
lower.set(xlabel="peak ground velocity (m/s)", ylabel="share of the rate per unit of ln x")
lower.set_title(
    f"{float(risk['probability']):.1%} in 50 years "
    f"({float(risk['probability_lower']):.1%} to {float(risk['probability_upper']):.1%})",
    fontsize="medium",
)
plt.show()
