"""The same bits on every x86-64 with FMA: studies and kernels in processes that take this machine for another."""

import functools
import os

import pytest
from processors import PROCESSORS, STUDIES, WIDE, child, features

from toppling.core.machine_code import FAMILIES, FUSED, target

pytestmark = pytest.mark.skipif("fma" not in features(), reason="the promise is of x86-64 with FMA")


@functools.cache
def as_it_is():
    return child("studies", {}, *STUDIES)


@pytest.mark.slow
@pytest.mark.longest
@pytest.mark.parametrize("processor", [name for name in PROCESSORS if PROCESSORS[name]])
def test_studies_have_the_same_bits(processor):
    if "SkylakeX" in processor and "avx512f" not in features():
        pytest.skip("this processor has no AVX-512")
    found = child("studies", PROCESSORS[processor], *STUDIES)
    assert [*found] == [*STUDIES]
    wrong = [
        f"{study}: {name}"
        for study, variables in as_it_is().items()
        for name in variables.keys() | found[study].keys()
        if variables.get(name) != found[study].get(name)
    ]
    assert wrong == []


@pytest.mark.slow
@pytest.mark.longest
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "other", FUSED if os.environ.get("EVERY_TARGET") else [family for family in FAMILIES if family != target()[0]]
)
def test_kernels_have_the_same_bits(other, tmp_path):
    """Each compiles the engine anew, a minute or two: EVERY_TARGET=1 for targets that are no family, too."""
    if other in WIDE and "avx512f" not in features():
        pytest.skip("this processor has no AVX-512")
    settings = {"NUMBA_CPU_NAME": other, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    found = child("kernels", settings)
    assert found == child("kernels", {})
    assert found["kernels"]["processor"] == "x86-64 with FMA"
