"""What the first seconds of a command cost: CPU time of whole processes."""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path

from ..measure import Row
from .processes import spent

COMMANDS = ("--help", "--version", "schema", "catalogue", "status")
COMMAND_TARGET = 0.3
"""CPU time of a command that computes nothing, s."""
CALL_TARGET = 0.15
"""CPU time of the import and a simulation beyond that of importing numba and xarray, s."""
_PACKAGES = "import numba, xarray"
_LEAST = "from stored import one; import xarray; one(1.0); xarray.DataArray([1.0], {'x': [0.0]}, 'x')"
_FUNCTION = "import numba, xarray\n\n\n@numba.njit(cache=True)\ndef one(x):\n    return x + 1.0\n"
_CALL = """
import toppling as tp
motion = tp.motions.CloughPenzien(duration=20.0).sample(1, seed=1).isel(motion=0)
tp.simulate(tp.Block(0.4, 1.8), tp.EnergyConsistent(), motion)
"""
_STUDY = """
title = "One block"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "energy-consistent"
[motions]
generator = "clough-penzien"
number = 4
[ida]
im = "pga"
levels = { values = [0.2, 0.4, 0.8], unit = "g" }
"""


def first_use(repeats: int = 5) -> list[Row]:
    """Measure commands that compute nothing, and the first simulation of a process: medians of `repeats`, in turns."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
        command = ("-m", "toppling")
        spent([*command, "run", "study.toml", "--out", "out"], folder)  # (compiles what the simulation needs, too)
        tasks = {one: [*command, one, *(["out"] if one == "status" else [])] for one in COMMANDS}
        tasks[_PACKAGES] = ["-c", _PACKAGES]
        (folder / "stored.py").write_text(_FUNCTION, encoding="utf-8")
        tasks[_LEAST] = ["-c", _LEAST]
        tasks["simulate"] = ["-c", _CALL]
        for task in tasks.values():
            spent(task, folder)
        taken: dict[str, list[float]] = {one: [] for one in tasks}
        for _ in range(repeats):
            for one, task in tasks.items():
                taken[one].append(spent(task, folder).cpu)
    cpu = {one: statistics.median(times) for one, times in taken.items()}
    rows: list[Row] = [{"what": f"toppling {one}", "cpu": cpu[one], "target": COMMAND_TARGET} for one in COMMANDS]
    rows.append({"what": f'python -c "{_PACKAGES}"', "cpu": cpu[_PACKAGES], "target": None})
    rows.append(
        {
            "what": "the same, numba loads a stored function of one line, xarray labels one number",
            "cpu": cpu[_LEAST],
            "target": None,
        }
    )
    allowed = cpu[_PACKAGES] + CALL_TARGET
    return [*rows, {"what": "import toppling and one simulation", "cpu": cpu["simulate"], "target": allowed}]
