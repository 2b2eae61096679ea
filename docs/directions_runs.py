"""The pieces, motions and runs of docs/directions.md: what falls and how far it slides, under each case."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

import toppling as tp
from toppling.core.streams import stream
from toppling.models.friction import CONTACTS
from toppling.motions import SiteBasedScenario
from toppling.motions.simulated.generator import steps_of
from toppling.motions.simulated.scenario import Parameters
from toppling.motions.simulated.site_based import site_based_motions

LAW = tp.HousnerImpact()
GENERATOR = SiteBasedScenario(7.2, 8e3, 400.0, "strike-slip", dt=0.01)
"""The scenario of docs/p58.md."""
NUMBER, SEED, PART = 1200, 23, 100
LEVELS = (0.1, 0.125, 0.16, 0.2, 0.25, 0.315, 0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0)
"""RotD50 of the peak velocity, m/s."""
FASTER = 2.0
"""Frequency of the vertical components over that of the horizontal ones."""
RATIOS = (2.0 / 3.0, 1.0)
"""Peak vertical acceleration over RotD50 of the peak horizontal one."""
NUDGES = (0.999, 1.001)
"""Factors of the controls: what is so slight a change does to the outcomes of single motions, and to their shares."""
DRAWS = 50
SLIPS = (0.05, 0.10, 0.30)  # m
EDGE = tp.Edge(0.10)
VINYL = "vinyl"
"""The contact under which slips are run in both directions and with vertical shaking, too."""
FLOORS = (VINYL, "rubber feet", "carpet")
HAZARD = tp.fragility.HazardCurve([0.05, 0.5, 5.0], [10.0**2.5 / 475.0, 1.0 / 475.0, 10.0**-2.5 / 475.0], "pgv")
"""10 % in 50 years at 0.5 m/s, and a straight line of slope 2.5 on a log-log plot; read as RotD50."""


class Item(NamedTuple):
    """A piece: its block with the plan assumed here, and where the sizes come from."""

    block: tp.Block
    source: str

    @property
    def name(self) -> str:
        """Its name."""
        return self.block.label

    @property
    def limit(self) -> float:
        """b/h: the friction below which it slides in place of rocking."""
        return self.block.b / self.block.h

    @property
    def rocks(self) -> bool:
        """False of a piece so flat that Housner's restitution is not positive: it is not run as a rocking block."""
        return 2.0 / self.block.inertia * np.sin(self.block.alpha) ** 2 < 1.0


def _p58(name: str, depth: float) -> Item:
    """One of FEMA P-58's contents, with a depth that FEMA P-58 does not list."""
    one = tp.catalogue[name]
    block = tp.Block(one.width, one.height, name=name, depth=depth)
    return Item(block, f"catalogue (FEMA P-58); other plan size {depth:g} m: judgement")


P58 = (
    _p58("bookcase-2-shelf", 0.914),
    _p58("bookcase-3-shelf", 0.914),
    _p58("bookcase-4-shelf", 0.914),
    _p58("bookcase-5-shelf", 0.914),
    _p58("bookcase-6-shelf", 0.914),
    _p58("file-vertical-2-drawer", 0.673),
    _p58("file-vertical-4-drawer", 0.673),
    _p58("file-lateral-4-drawer", 0.914),
    _p58("file-lateral-5-drawer", 0.914),
)
BENCH = (
    Item(tp.Block(0.12, 0.35, 0.16, 1.35, "vase", depth=0.12, round=True), "judgement; sizes of the base"),
    Item(tp.Block(0.20, 0.50, 0.30, 1.15, "monitor", depth=0.25), "judgement; sizes of the foot, mass in the screen"),
    Item(tp.Block(0.20, 0.40, 0.18, 1.35, "microscope", depth=0.28), "judgement"),
    Item(tp.Block(0.40, 0.50, name="analyser", depth=0.50), "judgement"),
    Item(tp.Block(0.23, 0.25, 0.05, 1.35, "laptop", depth=0.33), "judgement; open, mass in its base"),
)
ITEMS = (*P58, *BENCH)
ROCKING = tuple(one for one in ITEMS if one.rocks)
TWO_DRAWER = "file-vertical-2-drawer"


def triples(number: int = NUMBER) -> xr.DataArray:
    """Three components of simulated motions, at RotD50 of the peak velocity of 1 m/s; the vertical one at V/H of 1.

    The horizontal components are an uncorrelated pair of the generator.  The vertical one has the duration and the
    envelope of the first, twice its frequency, noise of its own, and the peak acceleration RotD50 of the pair.
    """
    parts = []
    for first in range(0, number, PART):
        n = min(PART, number - first)
        pair = GENERATOR.sample_pairs(n, SEED, first)
        own = GENERATOR.parameters(n, SEED, first)
        values = {name: own[name].values for name in Parameters._fields}
        drawn = Parameters(**{**values, **{name: FASTER * values[name] for name in ("omega_mid", "omega_slope")}})
        steps = steps_of(GENERATOR.length, GENERATOR.dt)
        streams = [stream(SEED, first + i, 2) for i in range(n)]
        vertical = site_based_motions(streams, drawn, 0.45, GENERATOR.corner, GENERATOR.dt, steps)
        names = ["RotD50(pga)", "RotD50(pgv)"]
        pga, pgv = (tp.motions.measures(tp.motions.as_recorded(pair), names)[name].values for name in names)
        h1, h2 = (pair.sel(component=name, drop=True).drop_vars("azimuth") for name in ("h1", "h2"))
        up = h1.copy(data=vertical * (pga / np.abs(vertical).max(1))[:, None])
        joined = tp.motions.join(h1, h2, up)
        parts.append(joined.copy(data=joined.values / pgv[:, None, None]))
    return xr.concat(parts, "motion", combine_attrs="override")


def lifted(shakes: xr.DataArray, ratio: float) -> xr.DataArray:
    """The triples with another V/H."""
    factors = np.array([1.0, 1.0, ratio])[None, :, None]
    return shakes.copy(data=shakes.values * factors)


def rocked(
    block: tp.Block, shakes: xr.DataArray, component: str, vertical: bool = False, factor: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Whether a block falls, and whether the floor leaves it (level, motion); those that it leaves count as fallen."""
    shaking = tp.motions.as_recorded(shakes, component, vertical=vertical)
    outputs = ("overturned", "airborne") if vertical else ("overturned",)
    levels = [factor * one for one in LEVELS]
    found = tp.ida(block, LAW, shaking, levels, im="scale", outputs=outputs, screen=False)
    fallen = found["overturned"].values[0, 0]
    return fallen, found["airborne"].values[0, 0] if vertical else np.zeros_like(fallen)


class Shakes(NamedTuple):
    """The motions of the page."""

    full: xr.DataArray
    """Triples at V/H of 1."""
    two_thirds: xr.DataArray
    """The same at V/H of 2/3."""


def shakes_of(number: int = NUMBER) -> Shakes:
    """The motions of the page, or the first of them."""
    full = triples(number)
    return Shakes(full, lifted(full, RATIOS[0]))


def of_item(item: Item, shakes: Shakes) -> dict[str, np.ndarray]:
    """Falls of a piece (level, motion) under one component and with all that this page adds to it."""
    full, two_thirds = shakes
    deep = item.block.across
    found = {
        "one": rocked(item.block, full, "h1")[0],
        "nudged": rocked(item.block, full, "h1", factor=NUDGES[1])[0],
        "nudged down": rocked(item.block, full, "h1", factor=NUDGES[0])[0],
        "other": rocked(item.block, full, "h2")[0],
        "deep": rocked(deep, full, "h2")[0],
    }
    found["two thirds"], found["airborne two thirds"] = rocked(item.block, two_thirds, "h1", vertical=True)
    found["full"], found["airborne full"] = rocked(item.block, full, "h1", vertical=True)
    found["deep two thirds"] = rocked(deep, two_thirds, "h2", vertical=True)[0]
    return found


def coefficients(contact: str, number: int = DRAWS) -> np.ndarray:
    """Equally probable static coefficients of friction (draw,) of a contact."""
    return CONTACTS[contact].friction.quantile((np.arange(number) + 0.5) / number)


def slid(contact: str, shakes: xr.DataArray, component: str, vertical: bool = False) -> dict[str, np.ndarray]:
    """Slips in m (draw, level, motion): the greatest, and those to either side; infinite where the floor leaves it."""
    shaking = tp.motions.as_recorded(shakes, component, vertical=vertical)
    laws = [tp.Sliding(mu, CONTACTS[contact].kinetic_ratio * mu) for mu in coefficients(contact).tolist()]
    names = ("slide_peak", "slide_forward", "slide_backward")
    found = tp.ida(tp.Block(1.0, 1.0), laws, shaking, LEVELS, im="scale", outputs=names, screen=False)
    return {name: np.nan_to_num(found[name].values[0], nan=np.inf).astype(np.float32) for name in names}


def slid_in_plane(contact: str, shakes: xr.DataArray, vertical: bool = False) -> np.ndarray:
    """Greatest slips in m (draw, level, motion) under both components; infinite where the floor leaves the piece."""
    shaking = tp.motions.both_axes(shakes, vertical=vertical)
    laws = [tp.Sliding(mu, CONTACTS[contact].kinetic_ratio * mu) for mu in coefficients(contact).tolist()]
    block = tp.Block(1.0, 1.0, depth=1.0)
    found = tp.ida(block, laws, shaking, LEVELS, im="scale", outputs=("slide_peak",), screen=False)
    return np.nan_to_num(found["slide_peak"].values[0], nan=np.inf).astype(np.float32)


def of_contact(contact: str, shakes: Shakes) -> dict[str, np.ndarray]:
    """Slips of a contact under one component; on vinyl under both and with V/H 2/3, too."""
    found = slid(contact, shakes.full, "h1")
    if contact == VINYL:
        found["both"] = slid_in_plane(contact, shakes.full)
        found["lifted"] = slid(contact, shakes.two_thirds, "h1", vertical=True)["slide_peak"]
        found["both, lifted"] = slid_in_plane(contact, shakes.two_thirds, vertical=True)
    return found


class Runs(NamedTuple):
    """All runs of the page."""

    falls: dict[str, dict[str, np.ndarray]]
    """Of every piece that rocks: flags (level, motion) by case."""
    slips: dict[str, dict[str, np.ndarray]]
    """Of every contact: slips, m (draw, level, motion), by case."""


def settings() -> str:
    """A digest of what the runs depend on: kept runs of other settings are not read."""
    text = repr(
        (
            GENERATOR,
            NUMBER,
            SEED,
            LEVELS,
            FASTER,
            RATIOS,
            NUDGES,
            DRAWS,
            ITEMS,
            sorted(CONTACTS.items()),
            "slips in the plane",
        )
    )
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def compute(results: Path) -> Runs:
    """All runs, as many at a time as there are processors; those that are in the folder are read."""
    folder = results / settings()
    folder.mkdir(parents=True, exist_ok=True)
    rocking = {one.name: partial(of_item, one) for one in ROCKING}
    sliding = {one: partial(of_contact, one) for one in FLOORS}

    def path(what: str) -> Path:
        return folder / f"{what.replace(' ', '-')}.npz"

    missing = {what: make for what, make in (rocking | sliding).items() if not path(what).is_file()}
    if missing:
        shakes = shakes_of()

        def keep(what: str) -> None:
            part = path(what).with_suffix(".part")
            with part.open("wb") as file:
                np.savez_compressed(file, **missing[what](shakes))  # type: ignore[arg-type]
            part.replace(path(what))

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(keep, missing))

    def read(what: str) -> dict[str, np.ndarray]:
        with np.load(path(what)) as stored:
            return {name: stored[name] for name in stored.files}

    return Runs({what: read(what) for what in rocking}, {what: read(what) for what in sliding})
