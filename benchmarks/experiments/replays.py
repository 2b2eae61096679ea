"""Replays of the granite rocks' shake-table runs, whose table motions lie outside of the project.

The runs and their outcomes are read apart: what is replayed knows no outcome.
"""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.units import STANDARD_GRAVITY
from ...core.wording import system_reason
from ...fragility import ida
from ...models import Block, HousnerImpact
from ...motions import from_array
from ...motions.polarity import AS_RECORDED
from ...studies.file.csv_table import CsvTable, TableKind
from .table import ExperimentError

TESTS, HISTORIES = "granite_tests.csv", "granite_table_motions.npz"
COLUMNS = (
    *("test", "date", "record", "pgv_over_pga_s", "pga_g", "pga_is_nominal", "history_file", "pga_measured_g"),
    *("pgv_measured_m_s", "pgd_measured_m", "specimen_1_overturned", "specimen_2_overturned"),
)
KIND = TableKind("table of granite tests", COLUMNS, 10_000, 16 * 2**20, ExperimentError)
MOST_BYTES = 256 * 2**20
STEP = 0.005
"""Step of the table motions, s; their values are in g."""
HALF_WIDTHS = (0.043, 0.053, 0.063)
"""Weakest half-width of the support of the rock's scan: its range and the middle, m."""
CANDIDATES = np.round(np.arange(0.028, 0.0701, 0.001), 3)
"""Half-widths of which one is fitted on half of the records, m: wider than the range of the scan."""
HEIGHT, CM_HEIGHT, GYRATION_SQUARED = 0.79, 0.293, 0.0565
"""Height and mass centre, m, and the square of the radius of gyration, m² (middle of 0.053 to 0.060), of the scan."""


class Run(NamedTuple):
    """A run of the table: its number, its record, the record's PGV/PGA (s), and the table's motion (g)."""

    test: str
    record: str
    ratio: float
    motion: Array


@dataclass(frozen=True)
class Replays:
    """Runs with the outcome of a rigid block of each half-width."""

    runs: tuple[Run, ...]
    overturned: Flags  # half-width, run
    digest: str

    def inside(self, low: float | None, high: float | None) -> Flags:
        """Return whether each run's PGV/PGA lies in a band, its upper end left out; ExperimentError where none does."""
        ratios = np.array([run.ratio for run in self.runs])
        inside = (ratios >= (0.0 if low is None else low)) & (ratios < (np.inf if high is None else high))
        if not inside.any():
            raise ExperimentError(f"no run has a PGV/PGA from {low} to {high} s")
        return np.asarray(inside)


def read_runs(folder: Path) -> tuple[list[Run], str]:
    """Read the runs whose table motion is known, without their outcomes, and a hash; ExperimentError for faults."""
    path = folder / HISTORIES
    if not path.is_file():
        raise ExperimentError(f"{path}: no such file")
    if path.stat().st_size > MOST_BYTES:
        raise ExperimentError(f"{path}: larger than {MOST_BYTES // 2**20} MiB, no set of table motions is")
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        with np.load(path) as histories:
            columns = {name: np.asarray(histories[name], dtype=float) for name in histories.files}
    except OSError as error:
        raise ExperimentError(f"{path}: cannot be read ({system_reason(error)})") from None
    except (ValueError, zipfile.BadZipFile, KeyError):
        raise ExperimentError(f"{path}: no archive of numpy arrays") from None
    runs = []
    for line in CsvTable(folder / TESTS, KIND):
        motion = columns.get(line.text("test"))
        ratio = line.number_in("pgv_over_pga_s", above=0.0)
        if motion is None or ratio is None:
            continue
        if motion.ndim != 1 or motion.size < 2 or not np.isfinite(motion).all():
            line.refuse("test", f"has no plain history of finite values in {path}")
        runs.append(Run(line.text("test"), line.text("record").removesuffix(".xlsx"), ratio, motion))
    if not runs:
        raise ExperimentError(f"{folder / TESTS}: no run has a motion in {path}")
    return runs, digest


def rock(half_width: float, gyration_squared: float = GYRATION_SQUARED, centre: float = CM_HEIGHT) -> Block:
    """Return the rock as a rigid block about the weakest side of its support."""
    radius = half_width**2 + centre**2
    return Block(
        2.0 * half_width,
        HEIGHT,
        centre,
        (gyration_squared + radius) / radius,
        f"granite rock, half-width {1000.0 * half_width:g} mm",
    )


def table_motions(runs: Sequence[Run]) -> list[xr.DataArray]:
    """Return the motions of runs, m/s²."""
    return [from_array(STANDARD_GRAVITY * run.motion, STEP, [run.test], "table motion") for run in runs]


def replay(runs: list[Run], digest: str) -> Replays:
    """Replay runs with a rigid block of each half-width: Housner's impact, exact geometry, the block's restitution."""
    return Replays(tuple(runs), fallen([rock(half_width) for half_width in HALF_WIDTHS], table_motions(runs)), digest)


def fallen(
    blocks: list[Block], motions: list[xr.DataArray], law: HousnerImpact | None = None, polarity: str = AS_RECORDED
) -> Flags:
    """Return whether each block overturns in each motion (block, run), or in its reversed copy (block, run of both)."""
    runs = ida(
        blocks, law or HousnerImpact(), motions, [1.0], im="scale", outputs=("overturned",), screen=False,
        polarity=polarity,
    )  # fmt: skip
    return np.asarray(runs["overturned"].values[:, 0, 0], dtype=bool)


class GraniteOutcomes(NamedTuple):
    """Whether each of the two rocks overturned (rock, run), and the measured PGV (m/s) of every run."""

    overturned: Flags
    pgv: Array


def read_granite_outcomes(folder: Path, runs: tuple[Run, ...]) -> GraniteOutcomes:
    """Read the outcomes of runs; ExperimentError where one is missing."""
    rows: dict[str, tuple[float, ...]] = {}
    for line in CsvTable(folder / TESTS, KIND):
        flags = [line.yes_in(f"specimen_{i}_overturned") for i in (1, 2)]
        pgv = line.number_in("pgv_measured_m_s")
        rows[line.text("test")] = (*map(float, flags), np.nan if pgv is None else pgv)
    missing = [run.test for run in runs if run.test not in rows]
    if missing:
        raise ExperimentError(f"{folder / TESTS}: has no test {missing[0]}")
    values = np.array([rows[run.test] for run in runs]).T
    return GraniteOutcomes(values[:2].astype(bool), values[2])
