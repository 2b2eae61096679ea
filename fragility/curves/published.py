"""Published overturning criteria as curves, to plot, compare and export with fitted curves.

FEMA P-58's nine rows of contents that overturn, the law between their medians, and the Japanese criteria in peak floor
acceleration and velocity. A criterion depends only on a block's outer sizes, not on its centre of mass or its
dissipation.
"""

import csv
from collections.abc import Sequence
from importlib import resources

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, exp, log, power
from ...core.units import DIMENSIONLESS, STANDARD_GRAVITY, described, provenance, variables as variables_on
from ...models import Block
from ...models.plausibility import block_doubts
from ...motions.intensity.measure import MEASURES
from ..fitting.states import OK
from ..runs.labels import block_coordinates
from ..runs.request import labelled_sequence

CRITERIA = ("acceleration", "velocity")
DISPERSION = 0.5
"""Dispersion of the Japanese criteria, and of every FEMA P-58 row of contents that overturn."""

# ln(median in m/s) = a + b ln B + c ln H, B and H in m: least squares over the nine rows, to two decimals.
P58_COEFFICIENTS = (1.05, 1.48, -1.07)


def fema_p58() -> xr.Dataset:
    """Return FEMA P-58's fragility curves of the nine unanchored contents whose damage state is overturning.

    Returns
    -------
    xarray.Dataset
        On ``block``, labelled as in `toppling.catalogue`: median (m s-1, of peak floor velocity) and dispersion.
        Coordinates are id (FEMA P-58's), title, quality, directional (0: its demand has no direction), and the blocks'
        sizes. The attribute im is ``pgv``.

    Notes
    -----
    The database states for each row that its limit "is calculated as a function of the aspect ratio … and the building
    period". It rates none of them and gives no period. Its other contents (E.20.22) slide, fall off shelves or are
    anchored. Their rows are in peak floor acceleration, and the rows of anchored contents (…b) have no numbers.

    References
    ----------
    FEMA P-58 (2018). Seismic performance assessment of buildings, 2nd ed., fragility database v3.1.2, E.20.22.

    Examples
    --------
    >>> curves = fema_p58()
    >>> float(curves["median"].sel(block="bookcase-5-shelf")), curves.attrs["im"]
    (0.29, 'pgv')
    """
    text = resources.files(__package__).joinpath("published.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    blocks = [Block(float(row["width_m"]), float(row["height_m"]), name=row["name"]) for row in rows]
    median = np.array([float(row["median"]) for row in rows])
    dispersion = np.array([float(row["dispersion"]) for row in rows])
    descriptions = {
        name: xr.Variable("block", np.array([row[name] for row in rows], dtype=object), described(text))
        for name, text in (
            ("id", "FEMA P-58 fragility id"),
            ("title", "what it is"),
            ("quality", "how far to trust the source, as in the catalogue"),
            ("source", "where the numbers stand"),
        )
    }
    descriptions["directional"] = xr.Variable(
        "block",
        [int(row["directional"]) for row in rows],
        described("whether the demand is taken in the component's own direction"),
    )
    curves = _curves(blocks, median, dispersion, "pgv", "FEMA P-58 fragility of contents that overturn")
    return curves.assign_coords(descriptions)


def p58_estimate(blocks: Block | Sequence[Block]) -> xr.Dataset:
    """Return curves of any blocks by the law between FEMA P-58's medians, exp(1.05) B^1.48 H^-1.07, dispersion 0.5.

    Returns
    -------
    xarray.Dataset
        As `fema_p58`, with extrapolated on ``block``: True if a size lies outside the range of the nine rows.

    Notes
    -----
    B and H: outer width and height, m. A fit over the nine rows of `fema_p58` by least squares gives 1.0535, 1.4802 and
    -1.0740, which reproduce them within -3.3 to 5.1 %. Rounded as here they are within -3.0 to 5.6 %; the two-drawer
    vertical file, the most squat, is worst.

    Examples
    --------
    >>> round(p58_estimate(Block(0.40, 1.80))["median"].item(), 3)
    0.393
    """
    every = labelled_sequence("blocks", blocks, Block)
    width, height = _widths(every)
    a, b, c = P58_COEFFICIENTS
    rows = fema_p58()
    outside = np.zeros(len(every), dtype=bool)
    for sizes, known in ((width, rows["width"].values), (height, rows["height"].values)):
        outside |= (sizes < known.min()) | (sizes > known.max())
    curves = _curves(
        every,
        exp(a + b * log(width) + c * log(height)),
        np.full(len(every), DISPERSION),
        "pgv",
        "Fragility by the law between FEMA P-58's medians",
    )
    return curves.assign(
        extrapolated=("block", outside, described("whether a size lies outside those of the nine rows"))
    )


def japanese(blocks: Block | Sequence[Block], criterion: str = "acceleration") -> xr.Dataset:
    """Return curves of any blocks by the Japanese criteria for furniture, dispersion 0.5.

    Parameters
    ----------
    blocks : Block or sequence of Block
        Blocks with unique labels.
    criterion : str
        ``acceleration``: peak floor acceleration, for floors of high frequency; ``velocity``: peak floor velocity, for
        floors of low frequency.

    Returns
    -------
    xarray.Dataset
        median (m s-2 or m s-1) and dispersion on ``block``; attribute im is ``pga`` or ``pgv``.

    Notes
    -----
    A50 = g (B/H)(1 + B/H) and V50 = 10 B/sqrt(H) (1 + B/H)^2.5 cm/s, B and H in cm.  The first reproduces a table of
    Japan's National Institute for Land and Infrastructure Management to its digits.  The second and the dispersion
    are recalled, not re-read in their source: trust them less.  They are consistent with each other: V50 = A50/(2 pi F)
    at the frequency F = 15.6 H^-0.5 (1 + B/H)^-1.5 Hz (recalled as well), where the second criterion takes over.  FEMA
    P-58's nine medians are 0.79 V50 in the mean, 0.75 to 0.81, with a coefficient of variation of 2.3 %.

    References
    ----------
    Kaneko, M. and Hayashi, Y. (2000). Proposal of a curve to describe overturning ratios of rigid bodies. Journal of
    Structural and Construction Engineering (AIJ) 536, 55-62 (recalled, not re-read).

    Examples
    --------
    >>> block = Block(0.40, 1.80)
    >>> round(japanese(block)["median"].item(), 3), round(japanese(block, "velocity")["median"].item(), 3)
    (2.664, 0.492)
    """
    every = labelled_sequence("blocks", blocks, Block)
    chosen = checks.choice("criterion", criterion, CRITERIA)
    width, height = _widths(every)
    slenderness = width / height
    if chosen == "acceleration":
        im, median = "pga", STANDARD_GRAVITY * slenderness * (1.0 + slenderness)
    else:
        # 10 cm/s with sizes in cm is 1 m/s with sizes in m: 0.1 m/s * 100 / sqrt(100)
        im, median = "pgv", width / np.sqrt(height) * power(1.0 + slenderness, 2.5)
    return _curves(every, median, np.full(len(every), DISPERSION), im, f"Japanese criterion of overturning in {chosen}")


def _widths(blocks: Sequence[Block]) -> tuple[Array, Array]:
    """Return the widths and the heights of blocks, and warn of implausible blocks."""
    warn(block_doubts(blocks))
    return np.array([block.width for block in blocks]), np.array([block.height for block in blocks])


def _curves(blocks: Sequence[Block], median: Array, dispersion: Array, im: str, title: str) -> xr.Dataset:
    """Return lognormal curves on ``block`` that need no fit."""
    measure = MEASURES[im]
    table = {
        "median": (median, measure.units, f"median {measure.long_name} at overturning"),
        "dispersion": (dispersion, DIMENSIONLESS, "lognormal standard deviation of the fragility curve"),
        "converged": (np.ones(len(blocks), dtype=bool), DIMENSIONLESS, "whether there is a curve"),
        "status": (np.array([OK] * len(blocks), dtype=object), DIMENSIONLESS, "ok, or why there is no estimate"),
    }
    return xr.Dataset(
        variables_on("block", table),
        coords=block_coordinates(blocks),
        attrs={
            "title": title,
            **provenance({"blocks": [block.label for block in blocks], "im": im}),
            "im": im,
            "form": "lognormal",
            "state": "overturning",
        },
    )
