"""Studies of every kind, their reports as pages, and what every page must be."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import xarray as xr
from study_texts import blocks, laws, motions

from toppling.studies.report.figures import LONGEST_ALT
from toppling.studies.report.page import write_report
from toppling.studies.store.content import sealed

TWO_LAWS = laws("energy-consistent", "housner")
BASE = 'title = "A <small> study"\n' + blocks(shelf=0.4, rack=0.6) + TWO_LAWS + motions(12, 10, 0.01)
IDA = """
[ida]
im = "pga"
levels = { from = 0.1, to = 2.0, number = 8, spacing = "log", unit = "g" }
"""
HAZARD = """
[hazard]
levels = [0.1, 0.3, 1.0]
rates = [1e-2, 1e-3, 1e-5]
unit = "g"
"""
CLOUD = """
[cloud]
im = "pga"
"""
STRIPES = """
[stripes]
im = "pga"
unit = "g"
scale = true
[[stripes.at]]
level = 0.3
[[stripes.at]]
level = 0.9
motions = { seed = 5 }
"""
UNCERTAIN = """
[uncertainty]
samples = 8
seed = 1
[uncertainty.inputs]
restitution_factor = { distribution = "uniform", lower = 0.8, upper = 1.0 }
alpha_factor = { distribution = "uniform", lower = 0.9, upper = 1.1 }
"""
SENSITIVE = """
[sensitivity]
parameter = "delta"
values = [0.02, 0.05, 0.1]
replicates = 100
"""
INVENTORY = "item,width_m,height_m,floor,count,value,currency,consequence\nrack,0.5,1.8,0,2,100,EUR,injury\n"
NOT_SWEPT = BASE.replace(TWO_LAWS, laws("discrete", "giannini-masiani"))
STUDIES = {
    "fragility": BASE + IDA + HAZARD,
    "cloud": BASE + CLOUD + "[measures]\n",
    "stripes": BASE + STRIPES,
    "uncertainty": BASE + IDA + HAZARD + UNCERTAIN,
    "sensitivity": NOT_SWEPT.replace(blocks(rack=0.6), "") + IDA + SENSITIVE,
    "performance": re.sub(r"\[\[blocks\]\][^\[]*", "", BASE)
    + HAZARD
    + '[performance]\ninventory = "inventory.csv"\nim = "pga"\n'
    + 'levels = { from = 0.1, to = 2.0, number = 6, spacing = "log", unit = "g" }\n',
}
SECTIONS = ["answer", "actions", "appendix"]
DETAILS = ["results", "figures", "inputs", "method", "checks", "terms", "reproduce"]
HOSTILE = [
    "<script>alert(1)</script>",
    "\"'><img src=x onerror=alert(1)>",
    "x" * 300,
    "🪦 \u202egnp\x00\x1b[31m",
    r"$\frac{1}$ {{ 7*7 }} {% raw %}",
    "</style></svg></title>",
]
WIDTHS = (360, 768, 1440)
UNFOLDED = "document.querySelectorAll('details').forEach(one => { one.open = true });"
OVERFLOW = f"{UNFOLDED} [document.documentElement.scrollWidth, innerWidth, document.readyState]"
"""Script of an unfolded page: how wide it is, how wide the screen is, and whether it is loaded."""


def loaded(folder, name="fragility"):
    with xr.open_dataset(folder / name / "results.nc") as stored:
        return stored.load()


def written(results, folder, name="changed"):
    path = folder / f"{name}.nc"
    path.unlink(missing_ok=True)
    results.to_netcdf(path, engine="netcdf4")
    return path


def write_hostile(folder, blocks):
    few = loaded(folder).isel(motion=slice(4))
    many = few.isel(block=np.arange(blocks) % 2, model=np.arange(6) % 2)
    names = [f"{HOSTILE[i % len(HOSTILE)]}{i}".replace("\x00", "\x01") for i in range(blocks)]
    laws = [one.replace("\x00", "\x01") for one in HOSTILE]
    many = many.assign_coords(block=("block", names), model=("model", laws))
    for name in ("median", "rate", "risk_probability"):
        for end in ("", "_lower", "_upper"):
            many[f"{name}{end}"][:, 1] = np.nan
    many["converged"][:, 1] = False
    many["status"] = many["status"].astype(object)
    many["status"][:, 1] = "<i>none</i>"
    study = json.loads(many.attrs["study"]) | {"title": HOSTILE[0], "motions": {"records": HOSTILE}}
    many = many.assign_attrs(title=" ".join(laws[:2]), notes="\n".join(laws), study=json.dumps(study))
    path = written(sealed(many), folder, f"hostile{blocks}")
    write_report(path, path.with_suffix(".html"))
    return path.with_suffix(".html")


class Page(HTMLParser):
    """The contents of a page: tags with attributes, headings, ids, and text outside of tags."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.headings, self.text, self.within = [], [], [], []
        self.feed(Path(path).read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_data(self, data):
        self.text.append(data)

    def every(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]


def outside(path):
    """A page refers to nothing but itself, and runs nothing."""
    text = path.read_text(encoding="utf-8")
    page = Page(path)
    assert not [tag for tag, _ in page.tags if tag in ("script", "img", "link", "iframe", "object", "embed", "base")]
    for tag, attributes in page.tags:
        assert not [key for key in attributes if key.startswith("on")], (tag, attributes)
        for key in ("src", "href", "xlink:href", "action", "srcset", "poster"):
            if key in attributes:
                data = "data:application/json" if "download" in attributes else "data:image/png"
                assert attributes[key].startswith(("#", f"{data};base64,")), (tag, attributes)
    assert "@import" not in text
    assert all(one.startswith("#") for one in re.findall(r"url\(([^)]*)\)", text))
    policy = next(one["content"] for one in page.every("meta") if one.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy


def accessible(page):
    assert page.every("html")[0]["lang"] == "en"
    assert page.every("a")[0]["href"] == "#answer"
    images = [one for one in page.every("div") if one.get("role") == "img"]
    assert len(images) == len([one for one in page.every("figure") if one.get("id") != "figure"])  # (bars are a list)
    assert all(20 < len(one["aria-label"]) <= LONGEST_ALT for one in images)
    regions = [one for one in page.every("div") if one.get("aria-label") == "Validity checks"]
    assert len(page.every("caption")) + len(regions) == len(page.every("table"))
    assert all(one.get("scope") in ("col", "row", "rowgroup") for one in page.every("th"))
    boxes = [one for one in page.every("div") if "scroll" in one.get("class", "")]
    assert all(one.get("tabindex") == "0" and one.get("role") for one in boxes)


def of_client(page):
    """The text of the part of a page that is written for the client."""
    return page.read_text(encoding="utf-8").split('<section id="appendix"')[0].split("</header>")[1].split("<main>")[1]
