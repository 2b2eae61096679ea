"""Random examples that do not depend on where a test lies, and interrupts for tests that run in the background."""

import signal
import threading

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
