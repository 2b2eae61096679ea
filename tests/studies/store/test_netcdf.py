"""Result files: written without xarray's writer, which loads a cluster's library, to the bytes that it would write."""

import numpy as np
import xarray as xr

from toppling.studies.store import netcdf


def test_the_bytes_are_those_of_xarray(tmp_path):
    """Numbers, flags, words, coordinates, and attributes of each kind."""
    results = xr.Dataset(
        {
            "median": (("block", "level"), np.array([[1.0, np.nan], [3.0, 4.0]]), {"units": "m s-2"}),
            "converged": ("block", [True, False]),
            "count": ("level", np.array([3, 4], dtype=np.int64)),
            "one": 2.5,
            "empty": ("none", np.empty(0)),
        },
        {
            "block": ["shelf", "Schränkchen"],
            "level": ("level", [0.1, 0.2], {"im": "pga"}),
            "label": ("block", np.array(["a", "bc"], dtype=object)),
        },
        {"title": "Überall", "number": 3, "share": 0.5, "several": [1.0, 2.0]},
    )
    netcdf.write(results, tmp_path / "ours.nc")
    names = ["median", "converged", "count", "level"]
    encoding = {name: {"fletcher32": True, "chunksizes": results[name].shape} for name in names}
    results.to_netcdf(tmp_path / "theirs.nc", engine="netcdf4", encoding=encoding)
    assert (tmp_path / "ours.nc").read_bytes() == (tmp_path / "theirs.nc").read_bytes()
    with xr.open_dataset(tmp_path / "ours.nc", engine="netcdf4") as stored:
        xr.testing.assert_identical(stored.load().drop_encoding(), results)
