"""Small tables of published tests, and a small folder of replays in the granite rocks' form."""

import csv

import numpy as np

from toppling.benchmarks.experiments import replays
from toppling.benchmarks.experiments.table import COLUMNS, read_experiments

ROW = {
    "id": "one",
    "kind": "shake-table count",
    "piece": "cabinet",
    "specimen": "a cabinet",
    "width_m": "0.4",
    "height_m": "1.8",
    "placement": "free",
    "motion": "broadband",
    "measure": "JMA intensity",
    "level_low": "6.0",
    "level_high": "6.5",
    "unit": "1",
    "trials": "4",
    "overturned": "3",
    "source": "somebody 2020",
    "address": "https://example.org",
    "read": "abstract",
    "quality": "B",
    "predict": "overturned",
}


def table_of(path, *rows):
    with path.open("w", encoding="utf-8", newline="") as stream:
        lines = csv.DictWriter(stream, COLUMNS)
        lines.writeheader()
        lines.writerows(rows)
    return path


def row_of(folder, **changes):
    """Read a table of `ROW` with these changes alone."""
    (row,) = read_experiments(table_of(folder / "one.csv", {**ROW, **changes}))
    return row


def granite_folder(path, falls):
    """Three runs, of which the last has no motion: a push that each half-width resists or not."""
    path.mkdir(exist_ok=True)
    time = np.arange(400) * replays.STEP
    pushes = {str(i): np.where(time < 0.5, a, 0.0) for i, a in ((1, 0.05), (2, 0.6))}
    np.savez(path / replays.HISTORIES, **{name: value.astype(np.float32) for name, value in pushes.items()})
    lines = [",".join(replays.COLUMNS)]
    lines += [f"{i},20210621,R,{0.02 * i},0.1,False,True,0.1,0.1,0.1,{falls[0]},{falls[1]}" for i in (1, 2, 3)]
    (path / replays.TESTS).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
