"""The table of docs/coverage.md: extremes over truths, and the worst truth."""

from check_facts import numbers_in

from toppling.benchmarks.coverage.__main__ import summary
from toppling.benchmarks.coverage.drawn import Row


def test_extremes_and_the_worst_truth():
    found = [
        Row("rate", "lognormal", 20, 200, 0.02, 0.03, 1.2),
        Row("rate", "Weibull", 20, 200, 0.10, 0.01, 1.4),
        Row("rate", "lognormal", 80, 200, 0.0, 0.0),
        Row("total", "shares", 20, 200, 0.025, 0.025),
    ]
    rate, total = summary(found)
    assert (rate[0], rate[1].split("; "), rate[3]) == ("Rate", ["20: 89.0–95.0", "80: 100.0–100.0"], "20: 1.40")
    assert (total[0], total[1], total[3]) == ("Total", "20: 95.0–95.0", "")
    assert [(row[2].split(",")[0], numbers_in(row[2])) for row in (rate, total)] == [
        ("Weibull", [20, 1, 10]),
        ("shares", [20, 2.5, 2.5]),
    ]
