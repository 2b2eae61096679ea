"""Floor histories as a user's own building model gives them, with their index: the files of own_building.toml.

`python tests/support/own_building.py` writes them into studies/examples.  The histories are of toppling's own building
model, one frame in each direction, so that they can be checked: the same motions through `Building` overturn the same
pieces (tests/studies/kinds/test_own_building.py).
"""

import csv
from pathlib import Path

import numpy as np
import xarray as xr

from toppling import motions
from toppling.core.units import STANDARD_GRAVITY

LEVELS = (0.1, 0.2, 0.4, 0.8)
"""PGA of the ground motions, g."""
NUMBER = 8
SUPPORTS = ((1, "x"), (3, "x"), (3, "y"))
BUILDINGS = {
    "x": motions.Building.flexural_shear(0.5, damping=0.08, storeys=4),
    "y": motions.Building.flexural_shear(0.3, damping=0.08, storeys=4),
}
DECIMALS = 3
"""Decimals of the histories, m/s²."""


def ground(level: int, number: int = NUMBER) -> xr.DataArray:
    """Return the ground motions of a level, other ones at each level, scaled to it: A1, A2 … at the first."""
    noise = motions.KanaiTajimi(
        duration=7.0,
        dt=0.02,
        omega_g_dispersion=0.5,
        xi_g_dispersion=0.3,
        envelope=motions.RiseStrongDecay(rise=1.0, strong_end=4.0, decay=0.8),
    )
    # (filtered between zeros, so that the ground and the building come to rest)
    shaking = motions.highpass(motions.pad(noise.sample(number, seed=level + 1), before=1.0, after=2.0), low=0.3)
    made = motions.scale_to(shaking, LEVELS[level] * STANDARD_GRAVITY, "pga")
    return made.assign_coords(motion=[f"{'ABCD'[level]}{j}" for j in range(1, number + 1)])


def write(folder: Path, number: int = NUMBER, decimals: int | None = DECIMALS) -> list[Path]:
    """Write an index and a table of histories for each level, with all digits where `decimals` is not given."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [("level (g)", "motion", "floor", "direction", "file", "column")]
    written = [folder / "own_building_index.csv"]
    for i, level in enumerate(LEVELS):
        shaking = ground(i, number)
        floors = {direction: one.floor_motions(shaking) for direction, one in BUILDINGS.items()}
        file = folder / f"own_building_{i + 1}.csv"
        columns = {"time (s)": shaking["time"].values.round(6)}
        for j, name in enumerate(shaking["motion"].values):
            for floor, direction in SUPPORTS:
                column = f"{name} floor {floor} {direction}"
                values = floors[direction].isel(motion=j).sel(floor=floor).values
                columns[f"{column} (m/s2)"] = values if decimals is None else values.round(decimals)
                lines.append((f"{level:g}", str(name), str(floor), direction, file.name, column))
        with file.open("w", newline="", encoding="utf-8") as table:
            rows = csv.writer(table, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(
                [repr(float(value)).removesuffix(".0") for value in row] for row in np.transpose(list(columns.values()))
            )
        written.append(file)
    with written[0].open("w", newline="", encoding="utf-8") as table:
        csv.writer(table, lineterminator="\n").writerows(lines)
    return written


if __name__ == "__main__":
    write(Path(__file__).parents[2] / "studies/examples")
