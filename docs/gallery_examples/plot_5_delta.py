"""
Sensitivity to the width of the zone
====================================

The elastic zone is a numerical device; a result that depends on its width says something of the device.  With elastic
rest it does, with rigid rest hardly.
"""

import numpy as np
from matplotlib import pyplot as plt

import toppling as tp

block = tp.Block.from_slenderness(alpha=np.arctan(0.25), R=0.5)
shaking = tp.motions.SiteBasedScenario(magnitude=7.0, distance=20e3, vs30=760.0, dt=0.01).sample(60, seed=2)
deltas = np.array([0.2, 0.1, 0.05, 0.02, 0.01, 0.005])
LEVEL = 0.4  # PGV, m/s
families = {
    "discrete, elastic rest": [tp.DiscreteDamping(delta=delta) for delta in deltas],
    "discrete, rigid rest": [tp.DiscreteDamping(delta=delta, rest="rigid") for delta in deltas],
    "energy-consistent": [tp.EnergyConsistent(delta=delta) for delta in deltas],
}

figure, ax = plt.subplots(figsize=(5.2, 4.6), layout="constrained")
for name, laws in families.items():
    # (not screened: the screen finds that the elastic mode resonates, which is what is drawn)
    runs = tp.ida(block, laws, shaking, [LEVEL], "pgv", outputs=("overturned",), screen=False)
    share = tp.overturning_probability(runs).isel(block=0, level=0)
    p = share["probability"].values
    ax.errorbar(deltas, p, [p - share["lower"], share["upper"] - p], marker="o", capsize=2, label=name)
rigid = tp.ida(block, tp.HousnerImpact(geometry="bilinear"), shaking, [LEVEL], "pgv", outputs=("overturned",))
ax.axhline(float(rigid["overturned"].mean()), ls="--", color="k", label="rigid block (Housner)")
ax.set(xscale="log", xlabel="half width of the zone over α, δ", ylabel="probability of overturning", ylim=(0, 1))
figure.legend(loc="outside lower center", ncols=2)
plt.show()
