"""Studies in processes that take this machine for another: numpy, OpenBLAS and the compiler each have a word for it.

A child of other numba targets keeps its code in a folder of its own, because numba's cache is named by the target, not
by what it was told of it.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import toppling as tp
from toppling.core import elementary
from toppling.core.machine_code import processor

STUDIES = (
    *("simulated_earthquakes", "noise", "pulses", "matched_spectra", "shake_table", "selected"),
    *("yielding_building", "adaptive_rate", "uncertain_bookcase", "clinic_branches"),
)
"""Of the corpus: all generators, matching, selection, floors, fits, rates, uncertainty, inventories with branches."""
NARROW = "X86_V4 AVX512_ICL AVX512_SPR"
"""numpy's names of what is wider than AVX2."""
PROCESSORS = {
    "as it is": {},
    "Haswell": {"NPY_DISABLE_CPU_FEATURES": NARROW, "OPENBLAS_CORETYPE": "Haswell"},
    "Zen": {"NPY_DISABLE_CPU_FEATURES": NARROW, "OPENBLAS_CORETYPE": "Zen"},
    "SkylakeX without numpy's wide loops": {"NPY_DISABLE_CPU_FEATURES": NARROW, "OPENBLAS_CORETYPE": "SkylakeX"},
    "Haswell with numpy's wide loops": {"OPENBLAS_CORETYPE": "Haswell"},
}
WIDE = ("x86-64-v4", "skylake-avx512")
SETTINGS = ("NPY_DISABLE_CPU_FEATURES", "OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_CACHE_DIR")


def features() -> set[str]:
    """What this machine's processor has, as Linux calls it; nothing elsewhere."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return set(next((line.partition(":")[2].split() for line in lines if line.startswith("flags")), []))


def digest(values: object) -> str:
    """A digest of an array's bits; -0 and 0 differ, NaN is NaN."""
    array = np.asarray(values)
    if array.dtype.kind == "f":
        array = np.where(np.isnan(array), np.nan, array)
    data = array.tobytes() if array.dtype.kind in "biufcM" else repr(array.tolist()).encode()
    return hashlib.sha256(data).hexdigest()[:16]


def child(script: str, environment: dict[str, str], *arguments: str) -> dict[str, dict[str, str]]:
    """What a function of this module finds in a process with an environment of its own."""
    plain = {name: value for name, value in os.environ.items() if name not in SETTINGS}
    command = [sys.executable, __file__, script, *arguments]
    done = subprocess.run(command, env={**plain, **environment}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{environment}: {done.stderr[-2000:]}"
    found: dict[str, dict[str, str]] = json.loads(done.stdout.splitlines()[-1])
    return found


def studies(*names: str) -> dict[str, dict[str, str]]:
    """Digests of all variables of studies of the corpus."""
    found = {}
    with tempfile.TemporaryDirectory() as place:
        for name in names:
            folder = Path(place) / name
            shutil.copytree(Path(__file__).parents[1] / "golden" / "studies" / name, folder)
            results = tp.Study.from_toml(folder / "study.toml").run(folder / "out")
            found[name] = {str(key): digest(variable.values) for key, variable in results.variables.items()}
    return found


def kernels() -> dict[str, dict[str, str]]:
    """Digests of what some kernels give: elementary functions, filters of motions, blocks, and fits of curves."""
    x = np.random.default_rng(5).uniform(0.01, 5.0, 500)
    found = {name: digest(getattr(elementary, name)(x)) for name in ("exp", "log", "expm1", "log1p", "tan", "arctan")}
    found |= {"power": digest(elementary.power(x, 1.7)), "arctan2": digest(elementary.arctan2(x, 2.0))}
    motions = tp.motions.CloughPenzien().sample(8)
    runs = tp.ida(tp.Block(width=0.3, height=1.2), tp.EnergyConsistent(), motions, [2.0, 3.0, 5.0])
    fitted = tp.fit_fragility(runs, replicates=20)
    found |= {name: digest(fitted[name].values) for name in ("median", "dispersion", "median_lower")}
    found |= {"motions": digest(motions.values), "overturned": digest(runs["overturned"].values)}
    return {"kernels": found | {"processor": processor()}}


if __name__ == "__main__":
    answer = {"studies": studies, "kernels": kernels}[sys.argv[1]](*sys.argv[2:])
    print(json.dumps(answer))
