"""Elementary functions: digits, values at the ends, and that no way of calling them changes a bit."""

import math
import os
import subprocess
import sys
import warnings

import mpmath
import numpy as np
import pytest

from toppling.core import elementary
from toppling.core.elementary import FEW, arctan2, exp, geomspace, power, times

POINTS = int(os.environ.get("POINTS", "10_000"))
DOMAINS = {
    "exp": (-740.0, 709.0),
    "log": (1e-300, 1e6),
    "expm1": (-40.0, 50.0),
    "log1p": (-0.999999, 1e3),
    "tan": (-1.57, 1.57),
    "arcsin": (-1.0, 1.0),
    "arccos": (-1.0, 1.0),
    "arctan": (-1e3, 1e3),
}
ENDS = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.0, 0.5, -2.0, 710.0, -750.0, 5e-324, 1e308])


def exact(name, *x):
    """The value to 40 digits."""
    with mpmath.workdps(40):
        at = [mpmath.mpf(one) for one in x]
        names = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2"}
        return getattr(mpmath, names.get(name, name))(*at)


def in_ulps(name, found, *x):
    """The greatest error, in units of the last place of the exact value."""
    return max(
        float(abs(mpmath.mpf(one) - value) / math.ulp(float(value)))
        for one, value in (
            (y, exact(name, *at)) for y, *at in zip(found.tolist(), *(a.tolist() for a in x), strict=True)
        )
        if abs(value) > sys.float_info.min
    )


def test_names():
    assert [*DOMAINS] == ["exp", "log", "expm1", "log1p", "tan", "arcsin", "arccos", "arctan"]
    assert len(elementary.PYTHON) == len(DOMAINS) + 2


@pytest.mark.parametrize("name", DOMAINS)
def test_error_is_below_one_unit_of_the_last_place(name):
    random = np.random.default_rng(55)
    low, high = DOMAINS[name]
    x = np.concatenate(
        [random.uniform(low, high, POINTS // 2), random.uniform(max(low, -1.0), min(high, 1.0), POINTS // 2)]
    )
    x = np.abs(x) if name == "log" else x
    assert in_ulps(name, getattr(elementary, name)(x), x) < 1.0


def test_errors_of_powers_and_angles():
    random = np.random.default_rng(56)
    x, y = np.exp(random.uniform(-20.0, 20.0, POINTS // 2)), random.uniform(-15.0, 15.0, POINTS // 2)
    assert in_ulps("power", power(x, y), x, y) < 1.0
    assert in_ulps("arctan2", arctan2(y, x), y, x) < 1.0


@pytest.mark.parametrize("name", [*DOMAINS, "power", "arctan2"])
@pytest.mark.parametrize("repeats", [1, 2 * FEW])
def test_ends_are_those_of_numpy_without_its_warnings(name, repeats):
    x = np.tile(ENDS, repeats)
    given = (x,) if name in DOMAINS else (x[:, None], ENDS)
    with np.errstate(all="ignore"):
        expected = getattr(np, name)(*given)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = getattr(elementary, name)(*given)
    np.testing.assert_array_max_ulp(found, expected, maxulp=4)
    np.testing.assert_array_equal(np.signbit(found)[~np.isnan(found)], np.signbit(expected)[~np.isnan(expected)])


@pytest.mark.parametrize("name", DOMAINS)
def test_few_values_have_the_bits_of_many(name):
    low, high = DOMAINS[name]
    x = np.random.default_rng(57).uniform(low, high, 1000)
    function = getattr(elementary, name)
    np.testing.assert_array_equal(function(x), [function(one) for one in x])
    np.testing.assert_array_equal(function(x), np.concatenate([function(x[:FEW]), function(x[FEW:])]))


def test_few_powers_and_angles_have_the_bits_of_many():
    x, y = np.random.default_rng(58).uniform(0.01, 10.0, (2, 1000))
    for function in (power, arctan2):
        np.testing.assert_array_equal(function(x, y), [function(a, b) for a, b in zip(x, y, strict=True)])


def test_shapes_and_types_are_those_of_numpy():
    assert type(exp(1)) is np.float64
    assert exp([]).shape == (0,)
    assert exp(np.zeros((2, 0, 3))).shape == (2, 0, 3)
    assert exp(np.zeros((5, 7, 3))[:, ::2]).shape == (5, 4, 3)
    assert power(np.ones((3, 1)), np.ones(4)).shape == (3, 4)
    np.testing.assert_array_equal(
        exp(np.arange(100)[::-1].reshape(4, 25).T), exp(np.arange(100)[::-1]).reshape(4, 25).T
    )
    with pytest.raises(ValueError, match="broadcast"):
        power(np.ones(3), np.ones(4))


def test_equal_ratios():
    found = geomspace(0.1, 7.0, 50)
    assert found[[0, -1]].tolist() == [0.1, 7.0]
    np.testing.assert_allclose(found, np.geomspace(0.1, 7.0, 50), rtol=1e-15)


def test_products_have_one_order():
    """With another vector or column beside it, a sum keeps its bits."""
    random = np.random.default_rng(59)
    a, b, c = random.normal(size=(30, 40)), random.normal(size=(40, 7)), random.normal(size=40)
    np.testing.assert_allclose(times(a, b), a @ b, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(times(a, c), a @ c, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(times(c, b), c @ b, rtol=1e-12, atol=1e-12)
    assert float(times(c, c)) == pytest.approx(c @ c, rel=1e-14)
    np.testing.assert_array_equal(times(a, b)[:3], times(a[:3], b))


def test_without_a_compiler():
    """Uncompiled, values are the same but for the last digits of numpy's loops."""
    script = (
        "import sys; from toppling.core.elementary import exp, power; x = 99 * [0.3]\n"
        "print(exp(x).sum() + power(2.0, x).sum(), 'numba' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    value, loaded = done.stdout.split()
    assert float(value) == pytest.approx(99.0 * (math.exp(0.3) + 2.0**0.3), rel=1e-14)
    assert loaded == "False"
