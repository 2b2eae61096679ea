"""Order and pace of tests, random examples that do not depend on where a test lies, interrupts in the background.

Calls that are refused or doubted stand in refusals.csv and doubts.csv of each package.
"""

import gc
import signal
import threading

import pytest
from refusals import doubts, pytest_generate_tests, refusal

__all__ = ["doubts", "pytest_generate_tests", "refusal"]

# (a third of the time that collecting all tests takes goes to the garbage collector, which finds none)
gc.disable()
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
    """Begin with the longest tests, so that no process waits for the last of them."""
    items.sort(key=lambda item: item.get_closest_marker("longest") is None)


def pytest_collection_finish():
    """Start the garbage collector again, which from now on passes by what has been loaded and collected."""
    gc.enable()
    gc.freeze()
