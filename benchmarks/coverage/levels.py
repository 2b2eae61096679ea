"""Coverage of the level at which half of the motions overturn, of the quartiles, and of the fitted median."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...fragility.fitting.fit import fit_fragility
from ...fragility.fitting.intervals import PROFILE
from ..sequential.truths import DISPERSION, MEDIAN, Truth
from .drawn_studies import LOGNORMAL, SHAPES, Row, cloud, ida, level_of, row_of, stripes

COARSE = MEDIAN * np.exp(np.linspace(-1.8, 1.8, 10))
APART = MEDIAN * np.exp(1.9 * DISPERSION * (np.arange(4.0) - 1.5))
"""Levels almost two dispersions apart: half overturn between two of them."""
MOTIONS = (10, 20, 40, 100, 400)
SHARES = (0.1, 0.25, 0.75)
SEED = 52


class Design(NamedTuple):
    """A design of studies: its name, how studies are drawn, its correlations within motions, numbers of motions."""

    name: str
    draw: Callable[[Truth, int, int, int], xr.Dataset]
    correlations: tuple[float, ...]
    motions: tuple[int, ...] = MOTIONS


DESIGNS = (
    Design("20 common levels", ida, (0.3, 0.5, 1.0)),
    Design("10 common levels", partial(ida, levels=COARSE), (0.3, 0.5, 1.0)),
    Design("4 levels far apart", partial(ida, levels=APART), (0.3, 0.5, 1.0), (*MOTIONS[:-1], 200, MOTIONS[-1])),
    Design("5 stripes", stripes, (0.0,)),
    Design("cloud", cloud, (0.0,)),
)


def rows(full: bool) -> Iterator[Row]:
    """Yield the coverage of each interval under each truth."""
    studies = 1000 if full else 300
    for design in DESIGNS:
        for shape, correlation, motions in product(SHAPES, design.correlations, design.motions):
            yield from _of(design, replace(shape, correlation=correlation), motions, studies)


def _of(design: Design, truth: Truth, motions: int, studies: int) -> Iterator[Row]:
    # (the profile serves the fitted median, whose bootstrap takes a hundred times as long and holds no more)
    fits = fit_fragility(design.draw(truth, studies, motions, SEED), intervals=PROFILE, fractiles=SHARES, replicates=1)
    name = f"{truth.name}, within motions {truth.correlation:g}" if len(design.correlations) > 1 else truth.name

    def row(interval: str, ends: tuple[Array, Array], share: float) -> Row:
        return row_of(f"{interval}, {design.name}", name, motions, ends, level_of(truth, share))

    yield row("level at which half overturn", _ends(fits, "half_level"), 0.5)
    for share in SHARES:
        of_share = fits.sel(fraction=share)
        yield row(f"level at which {100 * share:g} % overturn", _ends(of_share, "fraction_level"), share)
    yield row("fitted median, taken for the level of half", _ends(fits, "median"), 0.5)
    if truth.name == LOGNORMAL.name:
        ends = _ends(fits, "dispersion")
        yield row_of(f"dispersion of the fitted curve, {design.name}", name, motions, ends, DISPERSION)


def _ends(curves: xr.Dataset, name: str) -> tuple[Array, Array]:
    return curves[f"{name}_lower"].values, curves[f"{name}_upper"].values
