"""A plugin of pytest for find.py and `make covered-lines`: the outcome and the seconds of each part of a test."""

import os
from pathlib import Path

import pytest

REPORT, PLACE, SKIPPED = "FAULTS_REPORT", "FAULTS_PLACE", "FAULTS_SKIPPED"


def pytest_sessionstart():
    """Refuse another copy of the package than the copy with the fault, such as the installed package."""
    if PLACE in os.environ:
        import toppling

        place = Path(toppling.__file__).resolve().parent
        if place != Path(os.environ[PLACE]):
            pytest.exit(f"toppling is imported from {place}", returncode=3)


def pytest_collection_modifyitems(items):
    """Leave out the named tests with all their parameters (`--deselect` takes every name that begins so)."""
    skipped = {*os.environ.get(SKIPPED, "").splitlines()}
    items[:] = [item for item in items if item.nodeid.partition("[")[0] not in skipped]


def pytest_runtest_logreport(report):
    _write(report.outcome, report.duration, report.nodeid)


def pytest_collectreport(report):
    if report.failed:
        _write(report.outcome, 0.0, report.nodeid)


def _write(outcome, seconds, name):
    if "PYTEST_XDIST_WORKER" not in os.environ:  # (workers pass their reports on)
        with Path(os.environ[REPORT]).open("a", encoding="utf-8") as file:
            file.write(f"{outcome}\t{seconds:.3f}\t{name}\n")
