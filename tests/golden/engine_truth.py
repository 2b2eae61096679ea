"""The engine against the 40-digit truth: `python tests/golden/engine_truth.py` prints errors by law, and a hash.

A rebuilding changes no line of what is printed before and after it on one machine with the same versions of numpy and
numba; other processors fuse other operations and so have another hash.
"""

import hashlib
from typing import NamedTuple

import numpy as np

from toppling.benchmarks.measure import answers, errors, oscillators, true_record
from toppling.benchmarks.problems import DT, LAWS, TRUTH_BLOCKS, TRUTH_FACTORS
from toppling.benchmarks.scenes import SCENE_LAWS, SCENES
from toppling.models.runs import run_many


class Row(NamedTuple):
    """A line of the table: errors over alpha of the runs that stand, and a hash of all numbers; no errors of scenes."""

    law: str
    runs: int
    wrong_flags: int | None
    peak: float | None
    rotation: float | None
    digest: str


def rows() -> list[Row]:
    """Return a row of each law of the truth, then of each law with walls, restraints and masses off the middle."""
    return _of_truth() + _of_scenes()


def whole(table: list[Row]) -> str:
    """Return the hash of all numbers of the table's runs."""
    return hashlib.sha256("".join(row.digest for row in table).encode()).hexdigest()


def _of_truth() -> list[Row]:
    found = []
    for law in LAWS:
        runs = answers(law, None, true_record())
        error = errors(law, runs)
        blocks = oscillators(law, list(TRUTH_BLOCKS.values()))
        skipping = run_many(blocks, np.tile(TRUTH_FACTORS, (len(blocks), 1)), true_record(), DT)
        numbers = [skipping, *(array for run in runs for array in run)]
        digest = _digest(numbers)
        found.append(
            Row(law.label, error["flags"], error["wrong_flags"], error["peak_max"], error["trajectory_max"], digest)
        )
    return found


def _of_scenes() -> list[Row]:
    found = []
    for law in SCENE_LAWS:
        placed = [scene(block) for scene in SCENES.values() for block in TRUTH_BLOCKS.values()]
        results = []
        for block in placed:
            try:
                oscillator = law.oscillator(block)
            except ValueError:  # (restraints in exact geometry, slack that ends inside a zone)
                continue
            results.append(run_many([oscillator], np.array([TRUTH_FACTORS]), true_record(), DT, skip=False))
        runs = len(results) * len(TRUTH_FACTORS)
        found.append(Row(f"{law.label}, scenes", runs, None, None, None, _digest(results)))
    return found


def _digest(arrays: list[np.ndarray]) -> str:
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def main() -> None:
    """Print the table and the hash."""
    table = rows()
    print(f"{'law':42} {'runs':>5} {'wrong flags':>11} {'peak':>8} {'rotation':>8}  hash")
    for law, runs, wrong, peak, rotation, digest in table:
        errors_of = [f"{value:.1e}" if isinstance(value, float) else "" for value in (peak, rotation)]
        print(
            f"{law:42} {runs:5} {'' if wrong is None else wrong:>11} {errors_of[0]:>8} {errors_of[1]:>8}  {digest[:12]}"
        )
    print(f"sha256 of all numbers: {whole(table)}")


if __name__ == "__main__":
    main()
