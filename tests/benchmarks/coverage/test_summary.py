"""The table docs/runs/coverage.csv: extremes over truths, and the worst truth."""

from toppling.benchmarks.coverage.__main__ import summary
from toppling.benchmarks.coverage.drawn_studies import Row


def test_extremes_and_the_worst_truth():
    found = [
        Row("rate", "lognormal", 20, 200, 0.02, 0.03, 1.2),
        Row("rate", "Weibull", 20, 200, 0.10, 0.01, 1.4),
        Row("rate", "lognormal", 80, 200, 0.0, 0.0),
        Row("total", "shares", 20, 200, 0.025, 0.025),
    ]
    assert [*summary(found)] == [
        ("Rate", 20, "89.0", "95.0", "Weibull", "1.0", "10.0", "1.40"),
        ("Rate", 80, "100.0", "100.0", "", "", "", ""),
        ("Total", 20, "95.0", "95.0", "shares", "2.5", "2.5", ""),
    ]
