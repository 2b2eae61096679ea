"""`toppling.core.labelled`: xarray answers as ever, with dask's arrays and without them."""

import subprocess
import sys

import pytest

BEFORE = "import sys, numpy as np, xarray as xr\nfrom toppling.core.labelled import spare_dask\nspare_dask()\n"


def run(code):
    done = subprocess.run([sys.executable, "-c", BEFORE + code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_plain_arrays_do_not_load_those_of_dask():
    code = """
one = xr.DataArray([1.0, np.nan], dims="x")
both = (xr.Dataset({"a": one, "b": 2.0 * one}) + 1.0).fillna(0.0).mean()
repr(both)
assert "dask.array" not in sys.modules
"""
    run(code)
    # (without it, they are loaded by the first array)
    assert "loaded" in run("""
from xarray.namedarray.pycompat import _cached_duck_array_modules as known
del known["dask"]
xr.DataArray([1.0])
print("loaded" * ("dask.array" in sys.modules))
""")


@pytest.mark.slow
def test_arrays_of_dask_stay_arrays_of_dask():
    """Kept as they are, shown as such, with the values hidden behind a mask as NaN."""
    run("""
xr.DataArray([1.0])
import dask.array as da
one = xr.DataArray(da.arange(6, chunks=2), dims="x")
assert isinstance(one.data, da.Array) and one.chunks == ((2, 2, 2),)
assert "dask.array" in repr(one)
assert (2.0 * one).compute().values.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
masked = xr.DataArray(da.ma.masked_array(da.arange(3.0, chunks=3), mask=[False, True, False]))
assert np.isnan(masked.values).tolist() == [False, True, False]
""")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["version", "available", "module"])
def test_what_else_xarray_may_ask(name):
    run(f"""
from xarray.namedarray import pycompat
spared = pycompat._get_cached_duck_array_module("dask")
assert spared.{name} == pycompat.DuckArrayModule("dask").{name}
""")
