"""The page on large studies has the numbers that were measured."""

import csv

from toppling.benchmarks.pages.page import ROOT


def test_measured_sizes():
    with (ROOT / "docs/scaling/measured.csv").open(encoding="utf-8", newline="") as table:
        measured = {row["quantity"]: row["value"] for row in csv.DictReader(table)}
    text = (ROOT / "docs/howto/large_studies.md").read_text(encoding="utf-8")
    for kind in ("1 thread", "2 threads", "1 process", "2 processes"):
        seconds = measured[f"100,000 runs, {kind}"]
        alone = measured["100,000 runs, 1 process" if "process" in kind else "100,000 runs, 1 thread"]
        speed_up = float(alone) / float(seconds)
        (row,) = (line.split(" | ") for line in text.splitlines() if line.startswith(f"| {kind} |"))
        assert row[1] == f"{seconds} s"
        assert abs(float(row[2].rstrip(" |")) - speed_up) < 0.02  # (from times with more digits)
    memory = measured["maximum memory of the command"]
    assert f"take {measured['10,000,000 runs by the command']} s and {memory} GB of memory" in text
    assert f"One run costs {measured['one run']} µs of a core" in text
