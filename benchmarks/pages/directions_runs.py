"""The pieces, motions and runs of the page docs/directions.md: falls and slips, under each case."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import xarray as xr

import toppling as tp

from ...core.streams import stream
from ...models.friction import CONTACTS
from ...motions import SiteBasedScenario
from ...motions.simulated.generator import steps_of
from ...motions.simulated.scenario import Parameters
from ...motions.simulated.site_based import site_based_motions
from .page import RESULTS, some

LAW = tp.HousnerImpact()
GENERATOR = SiteBasedScenario(7.2, 8e3, 400.0, "strike-slip", dt=0.01)
"""The scenario of docs/p58.md."""
NUMBER, SEED, PART = some(1200, 60), 23, 100
LEVELS = (0.1, 0.125, 0.16, 0.2, 0.25, 0.315, 0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0)
"""RotD50 of the peak velocity, m/s."""
FASTER = 2.0
"""Frequency of the vertical components over that of the horizontal ones."""
RATIOS = (2.0 / 3.0, 1.0)
"""Peak vertical acceleration over RotD50 of the peak horizontal one."""
NUDGE = 1.001
"""Factor of the control: what is so slight a change does to the outcomes of single motions, and to their shares."""
DRAWS = 50
SLIPS = (0.05, 0.10, 0.30)  # m
EDGE = tp.Edge(0.10)
VINYL = "vinyl"
"""The contact under which slips are run in both directions and with vertical shaking, too."""
FLOORS = (VINYL, "rubber feet", "carpet")


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
        return bool(2.0 / self.block.inertia * np.sin(self.block.alpha) ** 2 < 1.0)


# Contents of FEMA P-58, with a depth that it does not list.
P58 = tuple(
    Item(
        replace(tp.catalogue[name], name=name, depth=depth),
        f"catalogue (FEMA P-58); other plan size {depth:g} m: assumed",
    )
    for name, depth in (
        *((f"bookcase-{shelves}-shelf", 0.914) for shelves in range(2, 7)),
        ("file-vertical-2-drawer", 0.673),
        ("file-vertical-4-drawer", 0.673),
        ("file-lateral-4-drawer", 0.914),
        ("file-lateral-5-drawer", 0.914),
    )
)
BENCH = (
    Item(tp.Block(0.12, 0.35, 0.16, 1.35, "vase", depth=0.12, round=True), "assumed; sizes of the base"),
    Item(tp.Block(0.20, 0.50, 0.30, 1.15, "monitor", depth=0.25), "assumed; sizes of the foot, mass in the screen"),
    Item(tp.Block(0.20, 0.40, 0.18, 1.35, "microscope", depth=0.28), "assumed"),
    Item(tp.Block(0.40, 0.50, name="analyser", depth=0.50), "assumed"),
    Item(tp.Block(0.23, 0.25, 0.05, 1.35, "laptop", depth=0.33), "assumed; open, mass in its base"),
)
ITEMS = (*P58, *BENCH)
ROCKING = tuple(item for item in ITEMS if item.rocks)
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
        parameters = GENERATOR.parameters(n, SEED, first)
        values = {name: parameters[name].values for name in Parameters._fields}
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
    """Return whether a block falls and whether the floor leaves it (level, motion); the latter count as fallen."""
    shaking = tp.motions.as_recorded(shakes, component, vertical=vertical)
    outputs = ("overturned", "airborne") if vertical else ("overturned",)
    levels = [factor * level for level in LEVELS]
    runs = tp.ida(block, LAW, shaking, levels, im="scale", outputs=outputs, screen=False)
    fallen = runs["overturned"].values[0, 0]
    return fallen, runs["airborne"].values[0, 0] if vertical else np.zeros_like(fallen)


def shakes_of(number: int = NUMBER) -> tuple[xr.DataArray, xr.DataArray]:
    """The motions of the page, or the first of them: triples at V/H of 1, and the same at V/H of 2/3."""
    full = triples(number)
    return full, lifted(full, RATIOS[0])


def of_item(item: Item, full: xr.DataArray, two_thirds: xr.DataArray) -> dict[str, np.ndarray]:
    """Falls of a piece (level, motion) under one component and with all that this page adds to it."""
    falls = {
        "one": rocked(item.block, full, "h1")[0],
        "nudged": rocked(item.block, full, "h1", factor=NUDGE)[0],
        "other": rocked(item.block, full, "h2")[0],
        "deep": rocked(item.block.across, full, "h2")[0],
    }
    falls["two thirds"], falls["airborne two thirds"] = rocked(item.block, two_thirds, "h1", vertical=True)
    falls["full"], falls["airborne full"] = rocked(item.block, full, "h1", vertical=True)
    return falls


def coefficients(contact: str, number: int = DRAWS) -> np.ndarray:
    """Equally probable static coefficients of friction (draw,) of a contact."""
    return CONTACTS[contact].friction.quantile((np.arange(number) + 0.5) / number)


def slid(contact: str, shaking: list[xr.DataArray] | xr.DataArray, *names: str) -> dict[str, np.ndarray]:
    """Return slips in m (draw, level, motion) of a square block; infinite where the floor leaves it."""
    laws = [tp.Sliding(mu, CONTACTS[contact].kinetic_ratio * mu) for mu in coefficients(contact).tolist()]
    runs = tp.ida(tp.Block(1.0, 1.0, depth=1.0), laws, shaking, LEVELS, im="scale", outputs=names, screen=False)
    return {name: np.nan_to_num(runs[name].values[0], nan=np.inf).astype(np.float32) for name in names}


def of_contact(contact: str, full: xr.DataArray, two_thirds: xr.DataArray) -> dict[str, np.ndarray]:
    """Return slips on a contact under one component, to either side, too; on vinyl under both and with V/H 2/3, too."""
    along, peak = tp.motions.as_recorded, "slide_peak"
    slips = slid(contact, along(full, "h1", vertical=False), peak, "slide_forward", "slide_backward")
    if contact == VINYL:
        slips["both"] = slid(contact, tp.motions.both_axes(full, vertical=False), peak)[peak]
        slips["lifted"] = slid(contact, along(two_thirds, "h1", vertical=True), peak)[peak]
    return slips


class Runs(NamedTuple):
    """All runs of the page."""

    falls: dict[str, dict[str, np.ndarray]]
    """Of every piece that rocks: flags (level, motion) by case."""
    slips: dict[str, dict[str, np.ndarray]]
    """Of every contact: slips, m (draw, level, motion), by case."""


def compute() -> Runs:
    """Return all runs, as many at a time as there are processors; kept runs of the same settings are read."""
    settings = (
        GENERATOR, NUMBER, SEED, LEVELS, FASTER, RATIOS, NUDGE, DRAWS, ITEMS, sorted(CONTACTS.items()),
        "slips in the plane",
    )  # fmt: skip
    folder = RESULTS / "directions" / hashlib.sha256(repr(settings).encode()).hexdigest()[:12]
    folder.mkdir(parents=True, exist_ok=True)
    rocking = {item.name: partial(of_item, item) for item in ROCKING}
    sliding = {contact: partial(of_contact, contact) for contact in FLOORS}
    making = rocking | sliding
    paths = {what: folder / f"{what.replace(' ', '-')}.npz" for what in making}
    shakes = cache(shakes_of)
    if not all(path.is_file() for path in paths.values()):
        shakes()  # (once, before several threads ask for it)

    def kept(what: str) -> dict[str, np.ndarray]:
        path = paths[what]
        if not path.is_file():
            part = path.with_suffix(".part")
            with part.open("wb") as file:
                np.savez_compressed(file, **making[what](*shakes()))  # type: ignore[arg-type]
            part.replace(path)
        with np.load(path) as stored:
            return dict(stored)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        outcomes = dict(zip(making, pool.map(kept, making), strict=True))
    return Runs({what: outcomes[what] for what in rocking}, {what: outcomes[what] for what in sliding})
