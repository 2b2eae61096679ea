"""Curves with awkward names, numbers and forms, and the formats that they go through; plain readers of two of them."""

import json
import math
import re
import xml.etree.ElementTree as ET

import numpy as np
import pandas as pd
import xarray as xr

from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import read_pelicun, write_curve_csv, write_nrml, write_pelicun

NS = "{http://openquake.org/xmlns/nrml/0.5}"


def unguarded(cell):
    """The text of a cell that was kept from being a formula."""
    return re.sub(r"\\x([0-9a-f]{2})", lambda match: chr(int(match[1], 16)), cell.removeprefix("'"))


def on_labels(table, dims):
    """Rows as a dataset on the columns of their labels, in the order of the rows."""
    if not dims:
        return table.iloc[0].to_frame().T.reset_index(drop=True).to_xarray().isel(index=0, drop=True)
    return table.set_index(dims).to_xarray().reindex({dim: table[dim].dropna().unique() for dim in dims})


def read_table(path):
    table = pd.read_csv(path, dtype=str, keep_default_na=False).map(unguarded)
    table.columns = [name.partition(" (")[0] for name in table.columns]
    names = list(table.columns)
    dims = names[1 : names.index("measure")]
    texts = ("id", "measure", "measured_at", "state", "form", "status", "weights", *dims)
    for name in set(names) - set(texts):
        table[name] = [float(cell or "nan") for cell in table[name]]
    found = on_labels(table, [*dims, "level"] if "level" in names else dims)
    first = table.iloc[0]
    form = "isotonic" if "level" in names else "uplift-lognormal" if "uplift_median" in names else "lognormal"
    return found.assign_attrs(
        im=first["measure"],
        im_at=first["measured_at"],
        state=first.get("state", "overturning"),
        form=first.get("form", form),
    )


def read_model(path):
    """Estimates of a fragility model, SI; labels are those of the comments before its functions."""
    rows, labels = [], {}
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    model = ET.parse(path, parser).getroot().find(f"{NS}fragilityModel")
    states = []
    for child in model:
        if child.tag is ET.Comment:
            record = json.loads(child.text.strip().removeprefix("toppling"))
            labels, states = record["labels"], record.get("limit_states", [])
        if child.tag != f"{NS}fragilityFunction":
            continue
        imls, *curves = child
        unit = {"PGA": G, "PGV": 0.01}.get(imls.attrib["imt"], G)
        for i, curve in enumerate(curves):
            row = {"id": child.attrib["id"], **labels, **({"limit_state": states[i]} if states else {})}
            if child.attrib["format"] == "continuous":
                mean, stddev = float(curve.attrib["mean"]), float(curve.attrib["stddev"])
                variance = math.log1p((stddev / mean) ** 2)
                row |= {"median": mean / math.sqrt(1.0 + (stddev / mean) ** 2) * unit, "dispersion": variance**0.5}
                rows.append(row)
            else:
                for level, p in zip(imls.text.split(), curve.text.split(), strict=True):
                    rows.append({**row, "level": float(level) * unit, "probability": float(p)})
    table = pd.DataFrame(rows)
    return on_labels(table, [name for name in table.columns if name in (*labels, "limit_state", "level")])


FORMATS = {
    "pelicun": (write_pelicun, read_pelicun, "fragility.csv"),
    "nrml": (write_nrml, read_model, "fragility.xml"),
    "csv": (write_curve_csv, read_table, "curves.csv"),
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
