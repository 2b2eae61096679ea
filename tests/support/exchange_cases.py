"""Curves with awkward names, numbers and forms, and the formats that they go through."""

import numpy as np
import xarray as xr

from toppling.fragility import read_curve_csv, read_nrml, read_pelicun, write_curve_csv, write_nrml, write_pelicun

FORMATS = {
    "pelicun": (write_pelicun, read_pelicun, "fragility.csv"),
    "nrml": (write_nrml, read_nrml, "fragility.xml"),
    "csv": (write_curve_csv, read_curve_csv, "curves.csv"),
}
NAMES = ["bookcase-5-shelf", '=HYPERLINK("http://x"); δ, <b>&amp;\'--> \n\u200b', "../../etc/passwd", "units"]
LAWS = ["discrete e=0.92 δ=0.05", "housner e=e_R"]
UNITS = {"pga": "m s-2", "pgv": "m s-1", "Sa(0.7)": "m s-2"}


def lognormal(im="pga", blocks=NAMES, models=LAWS, floors=(), seed=1):
    """Curves with awkward names and odd numbers; the last has no estimate."""
    rng = np.random.default_rng(seed)
    dims, coords = ["block", "model"], {"block": list(blocks), "model": list(models)}
    if floors:
        dims.append("floor")
        coords["floor"] = list(floors)
    shape = [len(coords[dim]) for dim in dims]
    median, dispersion = np.exp(rng.normal(0.0, 2.0, shape)), rng.uniform(0.05, 1.5, shape)
    status = np.full(shape, "ok", dtype=object)
    last = (-1,) * len(shape)
    median[last] = dispersion[last] = np.nan
    status[last] = "no overturning"
    return xr.Dataset(
        {
            "median": (dims, median, {"units": UNITS[im]}),
            "dispersion": (dims, dispersion, {"units": "1"}),
            "status": (dims, status),
        },
        {**coords, "width": ("block", rng.uniform(0.2, 1.0, shape[0]))},
        {"im": im, "title": "Curves -- of a <test> & more"},
    )


def uplifting():
    """A step and a smooth factor of uplift, far above and below the median too."""
    values = [
        (3.0, 0.4, 2.0, 0.0),
        (3.0, 0.4, 2.0, 0.2),
        (3.0, 0.3, 30.0, 0.0),
        (3.0, 0.3, 0.1, 0.5),
        (2.0, 0.8, 2.0, 1.0),
    ]
    names = ("median", "dispersion", "uplift_median", "uplift_dispersion")
    units = ("m s-2", "1", "m s-2", "1")
    columns = zip(names, units, zip(*values, strict=True), strict=True)
    return xr.Dataset(
        {name: ("block", list(column), {"units": unit}) for name, unit, column in columns},
        {"block": list("abcde")},
        {"im": "pga", "form": "uplift-lognormal"},
    )


def isotonic():
    levels = np.array([0.3, 0.7, 1.1, 4.0])
    table = [[[0.0, 0.1, 0.1, 1.0], [0.2, 0.2, 0.5, 0.6]], [[0.0, 0.0, 0.0, 0.0], [np.nan] * 4]]
    return xr.Dataset(
        {"probability": (("block", "model", "level"), table, {"units": "1"})},
        {"block": ["a", "b"], "model": LAWS, "level": ("level", levels, {"units": "m s-1", "im": "pgv"})},
        {"form": "isotonic"},
    )


def there_and_back(curves, name, folder, **options):
    write, read, file = FORMATS[name]
    written = write(curves, folder / file)
    return written, read(written.paths[0], **options)
