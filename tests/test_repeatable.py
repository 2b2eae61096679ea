"""The random examples of the tests are the same in every run."""

import importlib.util
import sys

from hypothesis import given, settings, strategies as st
from repeatable import REPEATABLE


def test_other_sources_other_constants_same_examples(tmp_path):
    """Whatever is loaded, and whatever literals stand in it."""
    seen = []

    @settings(max_examples=200, **REPEATABLE)
    @given(st.floats(0.0, 1e6), st.integers(0, 10**9))
    def see(number, count):
        seen.append((number, count))

    see()
    before = list(seen)
    seen.clear()
    path = tmp_path / "many_constants.py"
    path.write_text(f"NUMBERS = {[i + 0.123 for i in range(300)]}\nCOUNTS = {[7919 * i for i in range(300)]}\n")
    spec = importlib.util.spec_from_file_location("many_constants", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules["many_constants"] = module
    try:
        see()
    finally:
        del sys.modules["many_constants"]
    assert seen == before
    assert len(set(seen)) > 100
