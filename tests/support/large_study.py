"""The command with runs that cost nothing: more of them than the memory that it may take.

``python large_study.py PLACE LIMIT STUDY OUT``: PLACE is "disk" or "memory", where arrays of all runs are; LIMIT is how
many bytes of memory it may take beside those of what is loaded when the work begins, or "none".
"""

import resource
import sys
from pathlib import Path

import matplotlib.figure  # noqa: F401 - loaded before the limit is set
import numpy as np

from toppling.fragility.numerics import slabs
from toppling.fragility.runs import plan, runners
from toppling.models.outputs import OUTPUTS
from toppling.models.runs import TALLY
from toppling.studies.command import cli
from toppling.studies.kinds import study as base
from toppling.studies.store import netcdf, shards


def pretended(work, chunk, left):
    """Flags and peaks that rise with the level, from the chunk's bounds alone."""
    random = np.random.default_rng([chunk.row, chunk.first, work.levels])
    shape = (chunk.row_stop - chunk.row, work.levels, chunk.stop - chunk.first)
    demand = random.random(shape, np.float32) + np.linspace(-0.6, 0.6, work.levels, dtype=np.float32)[:, None]
    made = {
        "overturned": demand > 0.5,
        "uplifted": demand > 0.2,
        "peak_rotation": np.where(demand > 0.5, 0.5 * np.pi, 0.2 * np.abs(demand)).astype(np.float64),
    }
    results = tuple(made.get(name, demand).astype(OUTPUTS[name].kind) for name in work.outputs)
    return plan.ChunkResult(results, np.ones(len(TALLY), np.int64), 0.1)


def data_bytes():
    """Private writable memory of this process, which RLIMIT_DATA counts."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmData"))


def main(place, limit, study, out):
    runners.run_chunk = pretended
    base.Study.prepare = lambda study: None
    slabs.RUNS = 2**17
    netcdf.SLAB_BYTES = 2**22
    shards.IN_MEMORY = 2**60 if place == "memory" else 2**20
    begin = base.Study._kept

    def limited(*arguments):
        most = data_bytes() + int(limit)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        return begin(*arguments)

    if limit != "none":
        base.Study._kept = limited
    return cli.main(["run", study, "--out", out])


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
