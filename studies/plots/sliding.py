"""Map of the probability that a block slides instead of rocking, over its proportions and its friction."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from ...core import checks
from ...models import Block
from ...models.friction import CONTACTS, SPREAD, LognormalFriction
from ..plan.slides import BAND
from . import axes

FLATTEST, SLENDEREST = 0.8, 0.05
LEAST, MOST = 0.1, 1.2
"""Ends of b/h and of the median coefficient."""
SHARES = (0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99)


@axes.drawing
def sliding(blocks: Block | Sequence[Block] = (), ax: Axes | None = None, *, dispersion: float = 0.3) -> Axes:
    """Draw the chance that a block slides instead of rocking: P(mu < b/h) of a lognormal coefficient of friction.

    Thin lines are the assumed medians of kinds of contact.  In the dotted band, from b/h to 1.3 b/h, a rocking block
    also slides at its impacts.

    From rest a block slides if its static friction is below b/h, for any motion strong enough to move it. (Shenton, H.
    W. (1996). Criteria for initiation of slide, rock, and slide-rock rigid-body modes. Journal of Engineering Mechanics
    122(7), 690-693.) The map does not show if it moves.

    Parameters
    ----------
    blocks : Block or sequence of Block
        Blocks whose b/h is marked.
    dispersion : float
        Logarithmic standard deviation of the coefficient, > 0.
    """
    spread = SPREAD.number("dispersion", dispersion)
    marked = checks.several("blocks", blocks, Block)
    alone = ax is None
    ax = ax or axes.new(4.6)
    ratio = np.geomspace(SLENDEREST, FLATTEST, 160)
    median = np.geomspace(LEAST, MOST, 150)
    share = np.stack([LognormalFriction(middle, spread).below(ratio) for middle in median.tolist()])
    shades = mpl.colormaps["YlOrBr"](np.linspace(0.0, 0.55, len(SHARES) + 1))
    ax.contourf(ratio, median, share, (0.0, *SHARES, 1.0), colors=shades)
    lines = ax.contour(ratio, median, share, SHARES, colors="0.25", linewidths=0.7)
    ax.fill_between(ratio, ratio, BAND * ratio, facecolor="none", edgecolor="0.6", hatch="...", linewidth=0.0)
    for name, contact in CONTACTS.items():
        ax.axhline(contact.friction.median, color="0.2", lw=0.8, ls=":")
        ax.annotate(name, (SLENDEREST * 1.03, contact.friction.median), va="bottom")
    for i, block in enumerate(marked):
        ax.axvline(block.b / block.h, color=axes.colour(i), lw=1.4, label=block.label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(SLENDEREST, FLATTEST)
    ax.set_ylim(LEAST, MOST)
    for axis, ticks in ((ax.xaxis, (0.05, 0.1, 0.2, 0.3, 0.5, 0.8)), (ax.yaxis, (0.1, 0.2, 0.3, 0.5, 0.75, 1.0))):
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_ticks([], minor=True)
    # each line has its label where no other line is near, and the labels before it are twice as far
    upright = np.log([SLENDEREST, FLATTEST, *(block.b / block.h for block in marked)])
    level = np.log([LEAST, MOST, *(contact.friction.median for contact in CONTACTS.values())])
    places: list[tuple[float, float]] = []
    for chance in SHARES:
        along = np.log(ratio), np.log(ratio) - spread * NormalDist().inv_cdf(chance)
        room = [abs(np.subtract.outer(logs, others)) for logs, others in zip(along, (upright, level), strict=True)]
        room += [0.5 * np.hypot(along[0] - np.log(x), along[1] - np.log(y))[:, None] for x, y in places]
        inside = (along[1] > level[0]) & (along[1] < level[1])
        at = int(np.where(inside, np.hstack(room).min(axis=1), -1.0).argmax())
        places += [(ratio[at], math.exp(along[1][at]))] if inside[at] else []
    ax.clabel(lines, fmt={share: f"{100.0 * share:g} %" for share in SHARES}, fontsize=8, manual=places)
    axes.label(ax, "half the width over the height of the mass centre, b/h", "median coefficient of friction")
    if alone:
        axes.name(ax, f"Chance of sliding (dispersion {spread:g})")
        if marked:
            ax.legend(loc="lower right", frameon=True, framealpha=1.0)
    return ax
