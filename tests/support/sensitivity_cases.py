"""A small sensitivity study: two blocks under seven laws."""

import math

import numpy as np
from study_texts import laws, motions

import toppling as tp

BLOCK = tp.Block.from_slenderness(math.atan(0.2), 0.38)
STUDY = (
    '[[blocks]]\nalpha_rad = 0.2\nR_m = 0.38\n[[blocks]]\ncatalogue = "server-rack-42u"\n'
    + laws("discrete", "giannini-masiani", "makris-konstantinidis", "vassiliou", "discrete")
    + 'rest = "rigid"\n'
    + laws("energy-consistent", "housner")
    + 'geometry = "bilinear"\n'
    + motions(12, 10, 0.01)
    + '[ida]\nim = "pga"\nlevels = { from = 0.1, to = 3.0, number = 8, spacing = "log", unit = "g" }\n'
)


def of_law(results, law, rest=None):
    """The part of one law."""
    at = results["law"].values == law
    if rest is not None:
        at &= results["rest"].values == rest
    return results.isel(model=int(np.flatnonzero(at)[0]))
