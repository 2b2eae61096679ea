"""A small sensitivity study: two blocks under seven laws."""

import math

import numpy as np

import toppling as tp

BLOCK = tp.Block.from_slenderness(math.atan(0.2), 0.38)
STUDY = """
title = "small"
[[blocks]]
alpha_rad = 0.2
R_m = 0.38
[[blocks]]
catalogue = "server-rack-42u"
[[models]]
law = "discrete"
[[models]]
law = "giannini-masiani"
[[models]]
law = "makris-konstantinidis"
[[models]]
law = "vassiliou"
[[models]]
law = "discrete"
rest = "rigid"
[[models]]
law = "energy-consistent"
[[models]]
law = "housner"
geometry = "bilinear"
[motions]
generator = "clough-penzien"
number = 12
seed = 1
duration_s = 10
dt_s = 0.01
[ida]
im = "pga"
levels = { from = 0.1, to = 3.0, number = 8, spacing = "log", unit = "g" }
"""


def study_of(folder, *parts):
    path = folder / "study.toml"
    path.write_text("".join(parts), encoding="utf-8")
    return tp.Study.from_toml(path)


def of_law(results, law, rest=None):
    """The part of one law."""
    at = results["law"].values == law
    if rest is not None:
        at &= results["rest"].values == rest
    return results.isel(model=int(np.flatnonzero(at)[0]))
