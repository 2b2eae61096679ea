"""Slow tests, random examples that do not depend on where a test lies, interrupts for tests in the background."""

import signal
import threading
from pathlib import Path

import pytest

# (a shell lets commands in its background ignore interrupts, and what they start inherits that)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_call(item):
    """Seed Hypothesis by a test's own name: by its whole path, as the plugin does, a moved file has other examples."""
    test = getattr(getattr(item, "obj", None), "hypothesis", None)
    if test is not None:
        test.inner_test._hypothesis_internal_add_digest = item.nodeid.rpartition("/")[2].encode()
    return (yield)


def pytest_collection_modifyitems(items):
    """Mark the tests that slow.txt lists (more than 1.5 s of CPU time) as slow, all their parameters."""
    slow = set(Path(__file__).with_name("slow.txt").read_text().split())
    for item in items:
        if item.nodeid.partition("[")[0] in slow:
            item.add_marker(pytest.mark.slow)
